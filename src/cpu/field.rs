//! The field of a lattice at a place: the weighted mean of the samples that the kernel reaches there, and its gradient.
//!
//! A Gaussian on a lattice is a product of Gaussians along its axes. So the mean over 64 samples takes four weights an axis,
//! and the gradient follows from the first moments: ∂/∂p E[f] = (E[n·f] − E[n]·E[f])/σ², n the sample's index along the axis.
//! Samples outside the lattice have no weight.
//!
//! Tensor products have weights that are polynomials of the place between two samples. Their derivatives give the gradient. The
//! samples go on mirrored at the outermost ones, so the weights always add up to 1.

use super::vector::{Lanes, each, exp, four, three};
use crate::{
    math::{Kernel, Profile, Tensor},
    volume::{Samples, Volume},
};
use fearless_simd::{Simd, f32x4, i32x8, mask32x8, prelude::*, u32x8};

/// How far a place may lie outside the lattice and still have a sample in reach, in steps.
const BEYOND: f32 = 1.999;
/// Weights that samples out of reach may have, beside 1 at the centre.
const LEAST_WEIGHT: f64 = 5e-3;

/// How the samples around a place are weighed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weighting {
    /// By Gaussians of this standard deviation, in steps.
    Gaussian(f64),
    Tensor(Tensor),
}

/// How a kernel weighs samples; none where four weights an axis do not hold it.
pub fn weighting(kernel: &Kernel) -> Option<Weighting> {
    match kernel.profile {
        Profile::Gaussian(sigma) => {
            let at = |distance: f64| (-0.5 * (distance / sigma).powi(2)).exp();
            (at(kernel.extent.min(2.0)) <= LEAST_WEIGHT).then_some(Weighting::Gaussian(sigma))
        }
        Profile::Tensor(tensor) => Some(Weighting::Tensor(tensor)),
        Profile::BSpline | Profile::Hann | Profile::Table(_) => None,
    }
}

/// The standard deviation, in steps, of a Gaussian of which four weights an axis hold all.
pub fn deviation(kernel: &Kernel) -> Option<f64> {
    if let Some(Weighting::Gaussian(sigma)) = weighting(kernel) { Some(sigma) } else { None }
}

/// What samples are, as vectors of them are loaded.
pub trait Sample: Copy + Send + Sync {
    /// The samples at four successive places, for places of eight lanes.
    fn four<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 4];

    /// The samples at two successive places.
    fn two<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 2];

    fn value(self) -> f32;
}

impl Sample for u8 {
    #[inline(always)]
    fn four<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 4] {
        let word =
            |place: usize| samples[place + offset..].first_chunk::<4>().map_or(0, |four| u32::from_le_bytes(*four));
        let words: [u32; 8] = [
            word(places[0]),
            word(places[1]),
            word(places[2]),
            word(places[3]),
            word(places[4]),
            word(places[5]),
            word(places[6]),
            word(places[7]),
        ];
        let words: u32x8<S> = words.simd_into(simd);
        four!(I => Lanes::float_from(((words >> (8 * I as u32)) & 0xff).bitcast::<i32x8<S>>()))
    }

    #[inline(always)]
    fn two<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 2] {
        let samples = &samples[offset..];
        let word = |place: usize| samples[place..].first_chunk::<2>().map_or(0, |two| u16::from_le_bytes(*two).into());
        let words: [u32; 8] = [
            word(places[0]),
            word(places[1]),
            word(places[2]),
            word(places[3]),
            word(places[4]),
            word(places[5]),
            word(places[6]),
            word(places[7]),
        ];
        let words: u32x8<S> = words.simd_into(simd);
        [Lanes::float_from((words & 0xff).bitcast::<i32x8<S>>()), Lanes::float_from((words >> 8).bitcast::<i32x8<S>>())]
    }

    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self)
    }
}

/// Samples of other types are loaded one by one.
macro_rules! one_by_one {
    ($($sample:ty),*) => {$(
        impl Sample for $sample {
            #[inline(always)]
            fn four<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 4] {
                let mut four = [[0.0f32; 8]; 4];
                for (lane, place) in places.iter().enumerate() {
                    let Some(own) = samples[place + offset..].first_chunk::<4>() else { continue };
                    for (row, sample) in four.iter_mut().zip(own) {
                        row[lane] = *sample as f32;
                    }
                }
                four!(I => four[I].simd_into(simd))
            }

            #[inline(always)]
            fn two<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 2] {
                let samples = &samples[offset..];
                let mut two = [[0.0f32; 8]; 2];
                for (lane, place) in places.iter().enumerate() {
                    let Some(own) = samples[*place..].first_chunk::<2>() else { continue };
                    two[0][lane] = own[0] as f32;
                    two[1][lane] = own[1] as f32;
                }
                [two[0].simd_into(simd), two[1].simd_into(simd)]
            }

            #[inline(always)]
            fn value(self) -> f32 {
                self as f32
            }
        }
    )*};
}
one_by_one!(u16, i16, i32);

impl Sample for f32 {
    #[inline(always)]
    fn four<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 4] {
        let samples = &samples[offset..];
        let [a, b] = each!([0, 4], I => {
            let [a, b, c, d]: [f32x4<S>; 4] = four!(L => {
                samples[places[I + L]..].first_chunk::<4>().map_or([0.0; 4], |four| *four).simd_into(simd)
            });
            // Rows become columns.
            let (ac, bd) = (a.zip_low(c), b.zip_low(d));
            let (ac_high, bd_high) = (a.zip_high(c), b.zip_high(d));
            [ac.zip_low(bd), ac.zip_high(bd), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
        });
        four!(I => simd.combine_f32x4(a[I], b[I]))
    }

    #[inline(always)]
    fn two<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 2] {
        let samples = &samples[offset..];
        let mut two = [[0.0f32; 8]; 2];
        for (lane, place) in places.iter().enumerate() {
            let Some(own) = samples[*place..].first_chunk::<2>() else { continue };
            two[0][lane] = own[0];
            two[1][lane] = own[1];
        }
        [two[0].simd_into(simd), two[1].simd_into(simd)]
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
}

/// The samples of a volume by their type.
pub enum Typed<'a> {
    U8(Field<'a, u8>),
    U16(Field<'a, u16>),
    I16(Field<'a, i16>),
    I32(Field<'a, i32>),
    F32(Field<'a, f32>),
}

impl<'a> Typed<'a> {
    /// The field of a volume, whose values count from `zero`. A sharp one has coefficients for a tensor product.
    pub fn new(volume: &'a Volume, weighting: Weighting, zero: f64) -> Self {
        let dims = volume.lattice.dims;
        if let Some(coefficients) = &volume.coefficients {
            return Self::F32(Field::new(&coefficients.values, dims, weighting, zero));
        }
        match &volume.samples {
            Samples::U8(samples) => Self::U8(Field::new(samples, dims, weighting, zero)),
            Samples::U16(samples) => Self::U16(Field::new(samples, dims, weighting, zero)),
            Samples::I16(samples) => Self::I16(Field::new(samples, dims, weighting, zero)),
            Samples::I32(samples) => Self::I32(Field::new(samples, dims, weighting, zero)),
            Samples::F32(samples) => Self::F32(Field::new(samples, dims, weighting, zero)),
        }
    }
}

/// Samples on a Cartesian lattice and the kernel between them.
pub struct Field<'a, T> {
    samples: &'a [T],
    dims: [usize; 3],
    shape: Shape,
    zero: f32,
}

/// The kernel between samples.
#[derive(Clone, Copy)]
enum Shape {
    Gaussian(Bell),
    Linear,
    /// Four weights an axis, of the factors of 1, t, t² and t³.
    Cubic([[f32; 4]; 4]),
}

/// A Gaussian along an axis.
#[derive(Clone, Copy)]
struct Bell {
    /// One over the kernel's variance in squared steps.
    per_variance: f32,
    /// Weights one and two steps from the centre.
    near: f32,
    far: f32,
}

/// Four weights of an axis, which add up to 1, and their first moment.
struct Weights<S: Simd> {
    weights: [Lanes<S>; 4],
    moment: Lanes<S>,
}

/// Four weights of an axis, which add up to 1, and their derivatives.
struct Taps<S: Simd> {
    weights: [Lanes<S>; 4],
    slopes: [Lanes<S>; 4],
}

impl<'a, T: Sample> Field<'a, T> {
    fn new(samples: &'a [T], dims: [usize; 3], weighting: Weighting, zero: f64) -> Self {
        let shape = match weighting {
            Weighting::Gaussian(sigma) => Shape::Gaussian(Bell::new(sigma)),
            Weighting::Tensor(Tensor::Linear) => Shape::Linear,
            Weighting::Tensor(tensor) => Shape::Cubic(polynomials(tensor)),
        };
        Self { samples, dims, shape, zero: zero as f32 }
    }

    /// Values, counted from zero, and their changes a step along each axis, at places in steps.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        match &self.shape {
            Shape::Gaussian(bell) => self.gaussian(simd, bell, place),
            Shape::Linear => self.linear(simd, place),
            // A function of its own: large, and asked for at three places.
            Shape::Cubic(factors) => simd.vectorize(
                #[inline(always)]
                || self.cubic(simd, factors, place),
            ),
        }
    }
}

/// Where samples are in memory whose indices along the axes are whole numbers.
#[inline(always)]
pub fn offsets<S: Simd>(dims: [usize; 3], index: [Lanes<S>; 3]) -> [usize; 8] {
    let [x, y, z]: [i32x8<S>; 3] = three!(I => i32x8::truncate_from(index[I]));
    let [nx, ny, nz] = dims;
    if nx * ny * nz <= i32::MAX as usize {
        let own: [i32; 8] = ((z * ny as i32 + y) * nx as i32 + x).into();
        return each!([0, 1, 2, 3, 4, 5, 6, 7], I => own[I] as usize);
    }
    let [x, y, z]: [[i32; 8]; 3] = [x.into(), y.into(), z.into()];
    each!([0, 1, 2, 3, 4, 5, 6, 7], I => (z[I] as usize * ny + y[I] as usize) * nx + x[I] as usize)
}

/// Gaussians.
impl<T: Sample> Field<'_, T> {
    #[inline(always)]
    fn gaussian<S: Simd>(&self, simd: S, bell: &Bell, place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let mut place = place;
        let mut first = [Lanes::splat(simd, 0.0); 3];
        let mut is_within = true;
        for axis in 0..3 {
            let last = self.dims[axis] as f32 - 1.0;
            let low = Lanes::splat(simd, -BEYOND);
            place[axis] = place[axis].max(low).min(Lanes::splat(simd, last + BEYOND));
            first[axis] = place[axis].floor();
            let within = first[axis].simd_ge(1.0) & (first[axis] + 2.0).simd_le(last);
            is_within &= within.all_true();
        }
        if is_within { self.within(simd, bell, place, first) } else { self.beside(simd, bell, place, first) }
    }

    /// Where all samples in reach lie in the lattice.
    #[inline(always)]
    fn within<S: Simd>(
        &self,
        simd: S,
        bell: &Bell,
        place: [Lanes<S>; 3],
        first: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let weights: [Weights<S>; 3] = three!(I => bell.weights(simd, place[I] - first[I]));
        let places = offsets(self.dims, three!(I => first[I] - 1.0));
        let [nx, ny, _] = self.dims;
        self.sums(simd, bell, &weights, &Inside { samples: self.samples, places, row: nx, slice: nx * ny })
    }

    /// At the border: samples outside the lattice have no weight.
    #[inline(always)]
    fn beside<S: Simd>(
        &self,
        simd: S,
        bell: &Bell,
        place: [Lanes<S>; 3],
        first: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let mut weights: [Weights<S>; 3] = three!(I => bell.weights(simd, place[I] - first[I]));
        let mut taps = [[[0; 4]; 8]; 3];
        for axis in 0..3 {
            let last = Lanes::splat(simd, self.dims[axis] as f32 - 1.0);
            let own = &mut weights[axis];
            let mut sum = none;
            for tap in 0..4 {
                let index = first[axis] + (tap as f32 - 1.0);
                let inside = index.max(none).min(last);
                own.weights[tap] = inside.simd_eq(index).select(own.weights[tap], none);
                sum += own.weights[tap];
                let indices: [f32; 8] = inside.into();
                for (own, index) in taps[axis].iter_mut().zip(indices) {
                    own[tap] = index as usize;
                }
            }
            let inverse = Lanes::splat(simd, 1.0) / sum;
            own.weights = four!(I => own.weights[I] * inverse);
            own.moment = own.weights[2] - own.weights[0] + own.weights[3] * 2.0;
        }
        let [nx, ny, _] = self.dims;
        self.sums(simd, bell, &weights, &Border { samples: self.samples, taps, row: nx, slice: nx * ny })
    }

    /// The mean of the samples in reach and its gradient.
    #[inline(always)]
    fn sums<S: Simd>(
        &self,
        simd: S,
        bell: &Bell,
        [x, y, z]: &[Weights<S>; 3],
        samples: &impl Rows<S>,
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let (mut sum, mut sum_x, mut sum_y, mut sum_z) = (none, none, none, none);
        for k in 0..4 {
            let (mut slice, mut slice_x, mut slice_y) = (none, none, none);
            for j in 0..4 {
                let mut four = samples.four(simd, j, k);
                if self.zero != 0.0 {
                    four = four!(I => four[I] - self.zero);
                }
                let before = x.weights[0] * four[0];
                let after = x.weights[2] * four[2];
                let second = x.weights[3] * four[3];
                let row = x.weights[1].mul_add(four[1], before) + (after + second);
                slice = y.weights[j].mul_add(row, slice);
                slice_x = y.weights[j].mul_add(after - before + second * 2.0, slice_x);
                slice_y = (y.weights[j] * (j as f32 - 1.0)).mul_add(row, slice_y);
            }
            sum = z.weights[k].mul_add(slice, sum);
            sum_x = z.weights[k].mul_add(slice_x, sum_x);
            sum_y = z.weights[k].mul_add(slice_y, sum_y);
            sum_z = (z.weights[k] * (k as f32 - 1.0)).mul_add(slice, sum_z);
        }
        let (moments, means) = ([sum_x, sum_y, sum_z], [x.moment, y.moment, z.moment]);
        (sum, three!(I => (moments[I] - means[I] * sum) * bell.per_variance))
    }
}

impl Bell {
    fn new(sigma: f64) -> Self {
        let per_variance = 1.0 / (sigma * sigma);
        let at = |distance: f64| (-0.5 * distance * distance * per_variance).exp() as f32;
        Self { per_variance: per_variance as f32, near: at(1.0), far: at(2.0) }
    }

    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S, t: Lanes<S>) -> Weights<S> {
        // Beside the weight of the sample before the place.
        let q = exp(simd, t * self.per_variance);
        let before = Lanes::splat(simd, self.near) / q;
        let after = q * self.near;
        let second = q * q * self.far;
        let inverse = Lanes::splat(simd, 1.0) / (before + 1.0 + after + second);
        let weights = [before * inverse, inverse, after * inverse, second * inverse];
        Weights { weights, moment: weights[2] - weights[0] + weights[3] * 2.0 }
    }
}

/// Tensor products.
impl<T: Sample> Field<'_, T> {
    /// Interpolates between eight samples.
    #[inline(always)]
    fn linear<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let (mut place, mut first) = (place, three!(I => place[I].floor()));
        let mut sides = None;
        if !self.hold(first, [0.0, 1.0]) {
            if self.dims.iter().any(|&count| count < 2) {
                let factors = polynomials(Tensor::Linear);
                return simd.vectorize(
                    #[inline(always)]
                    || self.mirrored(simd, &factors, place),
                );
            }
            let seen = three!(I => Seen::new(simd, place[I], self.dims[I]));
            (place, first) = (three!(I => seen[I].place), three!(I => seen[I].first));
            sides = Some(three!(I => seen[I].side));
        }
        let [x, y, z]: [Lanes<S>; 3] = three!(I => place[I] - first[I]);
        let starts = offsets(self.dims, first);
        let [nx, ny, _] = self.dims;
        // The rows of the near slice, then those of the far one, with their changes along x.
        let slice = nx * ny;
        let pairs = four!(I => T::two(simd, self.samples, &starts, (I % 2) * nx + (I / 2) * slice));
        let rises = four!(I => pairs[I][1] - pairs[I][0]);
        let rows = four!(I => x.mul_add(rises[I], pairs[I][0] - self.zero));
        let along_x = [y.mul_add(rises[1] - rises[0], rises[0]), y.mul_add(rises[3] - rises[2], rises[2])];
        let along_y = [rows[1] - rows[0], rows[3] - rows[2]];
        let slices = [y.mul_add(along_y[0], rows[0]), y.mul_add(along_y[1], rows[2])];
        let along_z = slices[1] - slices[0];
        let slope_x = z.mul_add(along_x[1] - along_x[0], along_x[0]);
        let slope_y = z.mul_add(along_y[1] - along_y[0], along_y[0]);
        let mut slopes = [slope_x, slope_y, along_z];
        if let Some(sides) = sides {
            slopes = three!(I => slopes[I] * sides[I]);
        }
        (z.mul_add(along_z, slices[0]), slopes)
    }

    /// Sums four samples along each axis.
    #[inline(always)]
    fn cubic<S: Simd>(&self, simd: S, factors: &[[f32; 4]; 4], place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        let [nx, ny, _] = self.dims;
        if self.hold(first, [-1.0, 2.0]) {
            let taps: [Taps<S>; 3] = three!(I => Taps::new(simd, factors, place[I] - first[I]));
            let places = offsets(self.dims, three!(I => first[I] - 1.0));
            return self.tap_sums(simd, &taps, &Inside { samples: self.samples, places, row: nx, slice: nx * ny });
        }
        if self.dims.iter().any(|&count| count < 4) {
            return self.mirrored(simd, factors, place);
        }
        // Four samples of the lattice, on which the mirror images beside them count too.
        let seen = three!(I => Seen::new(simd, place[I], self.dims[I]));
        let mut taps: [Taps<S>; 3] = three!(I => Taps::new(simd, factors, seen[I].place - seen[I].first));
        let starts = three!(I => {
            let is_low = seen[I].first.simd_lt(0.5);
            let is_high = seen[I].first.simd_gt(self.dims[I] as f32 - 2.5);
            taps[I].weights = within_lattice(simd, taps[I].weights, is_low, is_high);
            taps[I].slopes = within_lattice(simd, taps[I].slopes, is_low, is_high);
            let start = is_high.select(seen[I].first - 2.0, seen[I].first - 1.0);
            is_low.select(seen[I].first, start)
        });
        let places = offsets(self.dims, starts);
        let samples = Inside { samples: self.samples, places, row: nx, slice: nx * ny };
        let (value, slopes) = self.tap_sums(simd, &taps, &samples);
        (value, three!(I => slopes[I] * seen[I].side))
    }

    /// Whether the samples from one offset to another lie in the lattice, along all axes and in all lanes.
    #[inline(always)]
    fn hold<S: Simd>(&self, first: [Lanes<S>; 3], [from, to]: [f32; 2]) -> bool {
        let within = three!(I => {
            first[I].simd_ge(-from) & first[I].simd_le(self.dims[I] as f32 - 1.0 - to)
        });
        (within[0] & within[1] & within[2]).all_true()
    }

    /// At the border of any lattice, sample by sample.
    #[inline(always)]
    fn mirrored<S: Simd>(&self, simd: S, factors: &[[f32; 4]; 4], place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let mut sides = [none; 3];
        let mut indices = [[[0; 4]; 8]; 3];
        let taps: [Taps<S>; 3] = three!(I => {
            let last = self.dims[I] as f32 - 1.0;
            let Seen { place, first, side } = Seen::new(simd, place[I], self.dims[I]);
            sides[I] = side;
            for tap in 0..4 {
                let index = (first + (tap as f32 - 1.0)).abs();
                let index: [f32; 8] = ((index - last).abs() * -1.0 + last).max(none).into();
                for (own, index) in indices[I].iter_mut().zip(index) {
                    own[tap] = index as usize;
                }
            }
            Taps::new(simd, factors, place - first)
        });
        let [nx, ny, _] = self.dims;
        let samples = Border { samples: self.samples, taps: indices, row: nx, slice: nx * ny };
        let (value, slopes) = self.tap_sums(simd, &taps, &samples);
        (value, three!(I => slopes[I] * sides[I]))
    }

    /// The sum of the samples in reach and its gradient.
    #[inline(always)]
    fn tap_sums<S: Simd>(
        &self,
        simd: S,
        [x, y, z]: &[Taps<S>; 3],
        samples: &impl Rows<S>,
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let (mut sum, mut sum_x, mut sum_y, mut sum_z) = (none, none, none, none);
        for k in 0..4 {
            let (mut slice, mut slice_x, mut slice_y) = (none, none, none);
            for j in 0..4 {
                let mut four = samples.four(simd, j, k);
                if self.zero != 0.0 {
                    four = four!(I => four[I] - self.zero);
                }
                let row = of_four(&x.weights, &four);
                slice = y.weights[j].mul_add(row, slice);
                slice_x = y.weights[j].mul_add(of_four(&x.slopes, &four), slice_x);
                slice_y = y.slopes[j].mul_add(row, slice_y);
            }
            sum = z.weights[k].mul_add(slice, sum);
            sum_x = z.weights[k].mul_add(slice_x, sum_x);
            sum_y = z.weights[k].mul_add(slice_y, sum_y);
            sum_z = z.slopes[k].mul_add(slice, sum_z);
        }
        (sum, [sum_x, sum_y, sum_z])
    }
}

impl<S: Simd> Taps<S> {
    /// The weights at t of the way between two samples.
    #[inline(always)]
    fn new(simd: S, factors: &[[f32; 4]; 4], t: Lanes<S>) -> Self {
        let weights = four!(I => {
            let [a, b, c, d] = factors[I];
            let sum = t.mul_add(Lanes::splat(simd, d), Lanes::splat(simd, c));
            t.mul_add(t.mul_add(sum, Lanes::splat(simd, b)), Lanes::splat(simd, a))
        });
        let slopes = four!(I => {
            let [_, b, c, d] = factors[I];
            let sum = t.mul_add(Lanes::splat(simd, 3.0 * d), Lanes::splat(simd, 2.0 * c));
            t.mul_add(sum, Lanes::splat(simd, b))
        });
        Self { weights, slopes }
    }
}

/// The sum of four samples with weights.
#[inline(always)]
fn of_four<S: Simd>(weights: &[Lanes<S>; 4], samples: &[Lanes<S>; 4]) -> Lanes<S> {
    let pairs = [weights[0] * samples[0], weights[1] * samples[1]];
    weights[2].mul_add(samples[2], pairs[0]) + weights[3].mul_add(samples[3], pairs[1])
}

/// Weights of four samples in the lattice, of those of the four around a place. Of these the first lies outside the lattice where
/// the place is in the lowest cell, and the last where it is in the highest: a mirror image has the weight of what it shows too.
#[inline(always)]
fn within_lattice<S: Simd>(
    simd: S,
    [before, here, after, second]: [Lanes<S>; 4],
    is_low: mask32x8<S>,
    is_high: mask32x8<S>,
) -> [Lanes<S>; 4] {
    let none = Lanes::splat(simd, 0.0);
    [
        is_low.select(here, is_high.select(none, before)),
        is_low.select(after + before, is_high.select(before, here)),
        is_low.select(second, is_high.select(here + second, after)),
        is_low.select(none, is_high.select(after, second)),
    ]
}

/// A place as it is seen in a mirrored axis.
struct Seen<S: Simd> {
    /// Where it is seen in the lattice.
    place: Lanes<S>,
    /// The sample before it; the last sample lies at the end of the cell before it.
    first: Lanes<S>,
    /// The sign of slopes; 0 along an axis of one sample.
    side: Lanes<S>,
}

impl<S: Simd> Seen<S> {
    #[inline(always)]
    fn new(simd: S, place: Lanes<S>, count: usize) -> Self {
        let none = Lanes::splat(simd, 0.0);
        if count < 2 {
            return Self { place: none, first: none, side: none };
        }
        let last = count as f32 - 1.0;
        let period = 2.0 * last;
        let around = place - (place * (1.0 / period)).floor() * period;
        let is_turned = around.simd_gt(last);
        let place = is_turned.select(around * -1.0 + period, around).max(none).min(Lanes::splat(simd, last));
        let first = place.floor().min(Lanes::splat(simd, last - 1.0));
        let side = is_turned.select(Lanes::splat(simd, -1.0), Lanes::splat(simd, 1.0));
        Self { place, first, side }
    }
}

/// [`Tensor::polynomials`] in 32 bits.
fn polynomials(tensor: Tensor) -> [[f32; 4]; 4] {
    tensor.polynomials().map(|row| row.map(|factor| factor as f32))
}

/// The rows of four samples around eight places, in the four rows of four slices.
trait Rows<S: Simd> {
    fn four(&self, simd: S, row: usize, slice: usize) -> [Lanes<S>; 4];
}

/// Rows that lie in the lattice.
struct Inside<'a, T> {
    samples: &'a [T],
    /// The first sample of each lane.
    places: [usize; 8],
    row: usize,
    slice: usize,
}

impl<S: Simd, T: Sample> Rows<S> for Inside<'_, T> {
    #[inline(always)]
    fn four(&self, simd: S, row: usize, slice: usize) -> [Lanes<S>; 4] {
        T::four(simd, self.samples, &self.places, slice * self.slice + row * self.row)
    }
}

/// Rows that reach beyond the lattice: samples at its border stand for those outside.
struct Border<'a, T> {
    samples: &'a [T],
    /// Along each axis, for each lane, the four indices.
    taps: [[[usize; 4]; 8]; 3],
    row: usize,
    slice: usize,
}

impl<S: Simd, T: Sample> Rows<S> for Border<'_, T> {
    #[inline(always)]
    fn four(&self, simd: S, row: usize, slice: usize) -> [Lanes<S>; 4] {
        let mut found = [[0.0f32; 8]; 4];
        for lane in 0..8 {
            let start = self.taps[2][lane][slice] * self.slice + self.taps[1][lane][row] * self.row;
            for (own, x) in found.iter_mut().zip(self.taps[0][lane]) {
                own[lane] = self.samples[start + x].value();
            }
        }
        four!(I => found[I].simd_into(simd))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::cosine::mirrored, volume::Lattice};
    use fearless_simd::{Level, dispatch};
    use glam::DVec3;

    /// The value and its changes a step along each axis, sample by sample in double precision.
    fn truth(volume: &Volume, tensor: Tensor, place: [f64; 3]) -> [f64; 4] {
        let [nx, ny, _] = volume.lattice.dims;
        let mut sums = [0.0; 4];
        for tap in 0..64 {
            let index = [tap % 4, tap / 4 % 4, tap / 16];
            let index = [0, 1, 2].map(|axis| place[axis].floor() as isize - 1 + index[axis]);
            let away = [0, 1, 2].map(|axis| place[axis] - index[axis] as f64);
            let [i, j, k] = [0, 1, 2].map(|axis| mirrored(index[axis], volume.lattice.dims[axis]));
            let sample = volume.value((k * ny + j) * nx + i);
            for (number, sum) in sums.iter_mut().enumerate() {
                let weight = |axis: usize| {
                    if axis + 1 == number { tensor.slope(away[axis]) } else { tensor.value(away[axis]) }
                };
                *sum += sample * weight(0) * weight(1) * weight(2);
            }
        }
        sums
    }

    fn found(volume: &Volume, tensor: Tensor, places: [[f32; 8]; 3], zero: f64) -> [[f32; 8]; 4] {
        fn at<T: Sample, S: Simd>(simd: S, field: &Field<T>, places: [[f32; 8]; 3]) -> [[f32; 8]; 4] {
            let (value, [x, y, z]) = field.at(simd, three!(I => places[I].simd_into(simd)));
            [value, x, y, z].map(Into::into)
        }
        let level = Level::new();
        match Typed::new(volume, Weighting::Tensor(tensor), zero) {
            Typed::U8(field) => dispatch!(level, simd => at(simd, &field, places)),
            Typed::U16(field) => dispatch!(level, simd => at(simd, &field, places)),
            Typed::I16(field) => dispatch!(level, simd => at(simd, &field, places)),
            Typed::I32(field) => dispatch!(level, simd => at(simd, &field, places)),
            Typed::F32(field) => dispatch!(level, simd => at(simd, &field, places)),
        }
    }

    #[test]
    fn tensor_products_are_sums_over_mirrored_samples() {
        for (number, dims) in [[7, 6, 8], [1, 5, 4], [6, 2, 1], [4, 5, 6], [2, 3, 2]].into_iter().enumerate() {
            let count = dims.iter().product();
            let bytes: Vec<u8> = (0..count).map(|at: usize| (at * at * 31 % 251) as u8).collect();
            let samples = match number {
                0 => Samples::U8(bytes),
                1 => Samples::U16(bytes.into_iter().map(u16::from).collect()),
                2 => Samples::I16(bytes.into_iter().map(i16::from).collect()),
                3 => Samples::I32(bytes.into_iter().map(i32::from).collect()),
                _ => Samples::F32(bytes.into_iter().map(f32::from).collect()),
            };
            let volume = Volume::new(Lattice::with_spacing(dims, DVec3::ONE), samples).unwrap();
            for tensor in Tensor::ALL {
                for round in 0..60 {
                    // The first rounds lie in the lattice, the others also up to three steps beyond it.
                    let beyond = if round < 20 { 0.0 } else { 3.0 };
                    let place = |axis: usize, lane: usize| {
                        let part = ((round * 8 + lane) as f64 * [0.61, 0.77, 0.37][axis]).fract();
                        let last = dims[axis] as f64 - 1.0;
                        (part * (last + 2.0 * beyond) - beyond) as f32
                    };
                    let places = [0, 1, 2].map(|axis| std::array::from_fn(|lane| place(axis, lane)));
                    for zero in [0.0, 100.0] {
                        let found = found(&volume, tensor, places, zero);
                        for lane in 0..8 {
                            let place = places.map(|lanes| f64::from(lanes[lane]));
                            let mut expected = truth(&volume, tensor, place);
                            expected[0] -= zero;
                            // At a sample a linear field has a kink: its slope is that of either side.
                            let is_kink = tensor == Tensor::Linear && place.iter().any(|at| at.fract() == 0.0);
                            let compared = if is_kink { 1 } else { 4 };
                            for (found, expected) in found.iter().zip(expected).take(compared) {
                                let found = f64::from(found[lane]);
                                assert!(
                                    (found - expected).abs() < 2e-3,
                                    "{tensor:?} {dims:?} {place:?}: {found} {expected}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }
}

//! The field of a lattice at a place: the weighted mean of the samples that the kernel reaches there, and its gradient.
//!
//! A Gaussian on a lattice is a product of Gaussians along its axes. So the mean over 64 samples takes four weights an axis,
//! and the gradient follows from the first moments: ∂/∂p E[f] = (E[n·f] − E[n]·E[f])/σ², n the sample's index along the axis.
//! Samples outside the lattice have no weight.
//!
//! Tensor products have weights that are polynomials of the place between two samples. Their derivatives give the gradient. The
//! samples go on mirrored at the outermost ones, so the weights always add up to 1.

use super::vector::{Lanes, exp, four, three};
use crate::{
    math::{Kernel, Profile, Tensor},
    volume::{Samples, Volume},
};
use fearless_simd::{Simd, i32x8, prelude::*, u32x8};

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
one_by_one!(u16, i16, i32, f32);

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

    /// The first samples in memory of eight lanes, whose indices along the axes are whole numbers.
    #[inline(always)]
    fn starts<S: Simd>(&self, first: [Lanes<S>; 3]) -> [usize; 8] {
        let [ix, iy, iz]: [[i32; 8]; 3] = three!(I => i32x8::truncate_from(first[I]).into());
        let [nx, ny, _] = self.dims;
        let mut starts = [0; 8];
        for (lane, own) in starts.iter_mut().enumerate() {
            *own = (iz[lane] as usize * ny + iy[lane] as usize) * nx + ix[lane] as usize;
        }
        starts
    }
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
        let places = self.starts(three!(I => first[I] - 1.0));
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
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        if !self.hold(first, [0.0, 1.0]) {
            let factors = polynomials(Tensor::Linear);
            return simd.vectorize(
                #[inline(always)]
                || self.mirrored(simd, &factors, place),
            );
        }
        let [x, y, z]: [Lanes<S>; 3] = three!(I => place[I] - first[I]);
        let starts = self.starts(first);
        let [nx, ny, _] = self.dims;
        let row = |offset: usize| {
            let [a, b] = T::two(simd, self.samples, &starts, offset);
            let rise = b - a;
            // Its value and its change along x.
            (x.mul_add(rise, a - self.zero), rise)
        };
        let slice = |offset: usize| {
            let ((a, rise_a), (b, rise_b)) = (row(offset), row(offset + nx));
            let rise = b - a;
            (y.mul_add(rise, a), [y.mul_add(rise_b - rise_a, rise_a), rise])
        };
        let ((a, [ax, ay]), (b, [bx, by])) = (slice(0), slice(nx * ny));
        let rise = b - a;
        (z.mul_add(rise, a), [z.mul_add(bx - ax, ax), z.mul_add(by - ay, ay), rise])
    }

    /// Sums four samples along each axis.
    #[inline(always)]
    fn cubic<S: Simd>(&self, simd: S, factors: &[[f32; 4]; 4], place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        if !self.hold(first, [-1.0, 2.0]) {
            return self.mirrored(simd, factors, place);
        }
        let taps: [Taps<S>; 3] = three!(I => Taps::new(simd, factors, place[I] - first[I]));
        let places = self.starts(three!(I => first[I] - 1.0));
        let [nx, ny, _] = self.dims;
        self.tap_sums(simd, &taps, &Inside { samples: self.samples, places, row: nx, slice: nx * ny })
    }

    /// Whether the samples from one offset to another lie in the lattice, along all axes and in all lanes.
    #[inline(always)]
    fn hold<S: Simd>(&self, first: [Lanes<S>; 3], [from, to]: [f32; 2]) -> bool {
        let within = three!(I => {
            first[I].simd_ge(-from) & first[I].simd_le(self.dims[I] as f32 - 1.0 - to)
        });
        (within[0] & within[1] & within[2]).all_true()
    }

    /// At the border, where samples go on mirrored.
    #[inline(always)]
    fn mirrored<S: Simd>(&self, simd: S, factors: &[[f32; 4]; 4], place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let mut sides = [none; 3];
        let mut indices = [[[0; 4]; 8]; 3];
        let taps: [Taps<S>; 3] = three!(I => {
            let last = self.dims[I] as f32 - 1.0;
            let (own, side) = folded(simd, place[I], last);
            sides[I] = side;
            // The last sample lies at the end of the cell before it.
            let first = own.floor().min(Lanes::splat(simd, last - 1.0)).max(none);
            for tap in 0..4 {
                let index = (first + (tap as f32 - 1.0)).abs();
                let index: [f32; 8] = ((index - last).abs() * -1.0 + last).max(none).into();
                for (own, index) in indices[I].iter_mut().zip(index) {
                    own[tap] = index as usize;
                }
            }
            Taps::new(simd, factors, own - first)
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
        let splat = |factor: f32| Lanes::splat(simd, factor);
        let weights = four!(I => {
            let [a, b, c, d] = factors[I];
            t.mul_add(t.mul_add(t.mul_add(splat(d), splat(c)), splat(b)), splat(a))
        });
        let slopes = four!(I => {
            let [_, b, c, d] = factors[I];
            t.mul_add(t.mul_add(splat(3.0 * d), splat(2.0 * c)), splat(b))
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

/// Where a place is seen in a mirrored axis that ends at `last`, and the sign of slopes there: 0 along an axis of one sample.
#[inline(always)]
fn folded<S: Simd>(simd: S, place: Lanes<S>, last: f32) -> (Lanes<S>, Lanes<S>) {
    let none = Lanes::splat(simd, 0.0);
    if last < 1.0 {
        return (none, none);
    }
    let period = 2.0 * last;
    let around = place - (place * (1.0 / period)).floor() * period;
    let is_turned = around.simd_gt(last);
    let own = is_turned.select(around * -1.0 + period, around);
    let side = is_turned.select(Lanes::splat(simd, -1.0), Lanes::splat(simd, 1.0));
    (own.max(none).min(Lanes::splat(simd, last)), side)
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

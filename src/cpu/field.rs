//! The field of a lattice at a place: the weighted mean of the samples that the kernel reaches there, and its gradient.
//!
//! A Gaussian on a lattice is a product of Gaussians along its axes. So the mean over 64 samples takes four weights an axis,
//! and the gradient follows from the first moments: ∂/∂p E[f] = (E[n·f] − E[n]·E[f])/σ², n the sample's index along the axis.

use super::vector::{Lanes, exp, four, three};
use crate::{
    math::{Kernel, Profile},
    volume::{Samples, Volume},
};
use fearless_simd::{Simd, i32x8, prelude::*, u32x8};

/// How far a place may lie outside the lattice and still have a sample in reach, in steps.
const BEYOND: f32 = 1.999;
/// Weights that samples out of reach may have, beside 1 at the centre.
const LEAST_WEIGHT: f64 = 5e-3;

/// The standard deviation of a kernel in steps, where four weights an axis hold it.
pub fn deviation(kernel: &Kernel) -> Option<f64> {
    let Profile::Gaussian(sigma) = kernel.profile else { return None };
    let at = |distance: f64| (-0.5 * (distance / sigma).powi(2)).exp();
    (at(kernel.extent.min(2.0)) <= LEAST_WEIGHT).then_some(sigma)
}

/// What samples are, as vectors of them are loaded.
pub trait Sample: Copy + Send + Sync {
    /// The samples at four successive places, for places of eight lanes.
    fn four<S: Simd>(simd: S, samples: &[Self], places: &[usize; 8], offset: usize) -> [Lanes<S>; 4];

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
    /// The field of a volume, whose values count from `zero`.
    pub fn new(volume: &'a Volume, sigma: f64, zero: f64) -> Self {
        let dims = volume.lattice.dims;
        match &volume.samples {
            Samples::U8(samples) => Self::U8(Field::new(samples, dims, sigma, zero)),
            Samples::U16(samples) => Self::U16(Field::new(samples, dims, sigma, zero)),
            Samples::I16(samples) => Self::I16(Field::new(samples, dims, sigma, zero)),
            Samples::I32(samples) => Self::I32(Field::new(samples, dims, sigma, zero)),
            Samples::F32(samples) => Self::F32(Field::new(samples, dims, sigma, zero)),
        }
    }
}

/// Samples on a Cartesian lattice and the kernel between them.
pub struct Field<'a, T> {
    samples: &'a [T],
    dims: [usize; 3],
    /// One over the kernel's variance in squared steps.
    per_variance: f32,
    /// Weights one and two steps from the centre.
    near: f32,
    far: f32,
    zero: f32,
}

/// Four weights of an axis, which add up to 1, and their first moment.
struct Weights<S: Simd> {
    weights: [Lanes<S>; 4],
    moment: Lanes<S>,
}

impl<'a, T: Sample> Field<'a, T> {
    fn new(samples: &'a [T], dims: [usize; 3], sigma: f64, zero: f64) -> Self {
        let per_variance = 1.0 / (sigma * sigma);
        let at = |distance: f64| (-0.5 * distance * distance * per_variance).exp() as f32;
        Self { samples, dims, per_variance: per_variance as f32, near: at(1.0), far: at(2.0), zero: zero as f32 }
    }

    /// Values, counted from zero, and their changes a step along each axis, at places in steps.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
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
        if is_within { self.within(simd, place, first) } else { self.beside(simd, place, first) }
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

    /// Where all samples in reach lie in the lattice.
    #[inline(always)]
    fn within<S: Simd>(&self, simd: S, place: [Lanes<S>; 3], first: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let weights: [Weights<S>; 3] = three!(I => self.weights(simd, place[I] - first[I]));
        let [ix, iy, iz]: [[i32; 8]; 3] = three!(I => i32x8::truncate_from(first[I]).into());
        let [nx, ny, _] = self.dims;
        let mut places = [0; 8];
        for (lane, own) in places.iter_mut().enumerate() {
            *own = ((iz[lane] - 1) as usize * ny + (iy[lane] - 1) as usize) * nx + (ix[lane] - 1) as usize;
        }
        self.sums(simd, &weights, &Inside { samples: self.samples, places, row: nx, slice: nx * ny })
    }

    /// At the border: samples outside the lattice have no weight.
    #[inline(always)]
    fn beside<S: Simd>(&self, simd: S, place: [Lanes<S>; 3], first: [Lanes<S>; 3]) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let mut weights: [Weights<S>; 3] = three!(I => self.weights(simd, place[I] - first[I]));
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
        self.sums(simd, &weights, &Border { samples: self.samples, taps, row: nx, slice: nx * ny })
    }

    /// The mean of the samples in reach and its gradient.
    #[inline(always)]
    fn sums<S: Simd>(&self, simd: S, [x, y, z]: &[Weights<S>; 3], samples: &impl Rows<S>) -> (Lanes<S>, [Lanes<S>; 3]) {
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
        (sum, three!(I => (moments[I] - means[I] * sum) * self.per_variance))
    }
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

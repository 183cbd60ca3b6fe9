//! The field of a lattice at a place: the weighted mean of the samples within reach of the kernel,
//! and its gradient.
//!
//! A Gaussian on a lattice is a product of Gaussians along the axes. So the mean over 64 samples
//! takes four weights an axis. The gradient follows from the first moments: ∂/∂p E[f] = (E[n·f] −
//! E[n]·E[f])/σ², with n the sample's index along the axis. Samples outside the lattice have no
//! weight.
//!
//! The weights of tensor products are polynomials of the place between two samples, and so are
//! their slopes, which give the gradient. The samples are mirrored at the outermost ones, so the
//! weights always add up to 1. The slopes of linear weights take more samples than the weights do,
//! so they are evaluated apart.
//!
//! A label map has the label of the nearest sample, and the gradient of that label's mask.

mod labels;

use super::{
    blend::{Blend, Blended},
    brick_cache::{BESIDE, Grid, SLOT, SLOT_SIDE},
    kernel_sums::Point,
    vector::{Lanes, each, exp2_within, four, three, words},
    window::{Sample, Taps, Weights, Window, of_four, row_of},
};
use crate::{
    bricks::SIDE,
    math::Tensor,
    plan::weighting::{MASK_DEVIATION, Weighting},
    volume::{SampleSlice, Samples, Volume},
};
use fearless_simd::{Simd, i32x8, mask32x8, prelude::*};

/// How far outside the lattice a place may lie and still have a sample in reach, in steps.
pub const BEYOND: f32 = 1.999;

/// The field of a volume, by the type of its samples.
pub enum Typed<'a> {
    U8(Field<'a, u8>),
    U16(Field<'a, u16>),
    I16(Field<'a, i16>),
    I32(Field<'a, i32>),
    F32(Field<'a, f32>),
    /// By sums, for any type.
    Blend(Blended<'a>),
}

impl<'a> Typed<'a> {
    /// Returns the field of a volume, with values relative to `zero`. A sharp volume's coefficients
    /// take the samples' place.
    pub fn new(volume: &'a Volume, weighting: Weighting, zero: f64) -> Self {
        Self::of_volume(volume, Shape::new(weighting), zero)
    }

    /// Returns the field of a label map. `shares` are those of each sample's own label around it.
    pub fn labels(volume: &'a Volume, shares: &'a [u8], zero: f64) -> Self {
        Self::of_volume(volume, Shape::Labels(Bell::new(MASK_DEVIATION), shares), zero)
    }

    /// Returns the same by sums over samples.
    pub fn blended(volume: &'a Volume, blend: &'a Blend, zero: f64) -> Self {
        Self::Blend(Blended::new(volume, blend, zero))
    }

    fn of_volume(volume: &'a Volume, shape: Shape<'a>, zero: f64) -> Self {
        let dims = volume.drawn_lattice().dims;
        match &volume.coefficients {
            Some(coefficients) => {
                Self::F32(Field::new(&coefficients.values, dims, Memory::Rows, shape, zero))
            }
            None => Self::in_memory(&volume.samples, dims, Memory::Rows, shape, zero),
        }
    }

    /// Returns the field of a level of a volume in bricks. `samples` are those of all slots; there
    /// is at least one slot.
    pub fn of_bricks(
        samples: &'a Samples,
        dims: [usize; 3],
        grid: &'a Grid,
        weighting: Weighting,
        zero: f64,
    ) -> Self {
        Self::in_memory(samples, dims, Memory::Slots(grid), Shape::new(weighting), zero)
    }

    fn in_memory(
        samples: &'a Samples,
        dims: [usize; 3],
        memory: Memory<'a>,
        shape: Shape<'a>,
        zero: f64,
    ) -> Self {
        match samples.as_slice() {
            SampleSlice::U8(samples) => Self::U8(Field::new(samples, dims, memory, shape, zero)),
            SampleSlice::U16(samples) => Self::U16(Field::new(samples, dims, memory, shape, zero)),
            SampleSlice::I16(samples) => Self::I16(Field::new(samples, dims, memory, shape, zero)),
            SampleSlice::I32(samples) => Self::I32(Field::new(samples, dims, memory, shape, zero)),
            SampleSlice::F32(samples) => Self::F32(Field::new(samples, dims, memory, shape, zero)),
        }
    }
}

/// Samples on a Cartesian lattice, and the kernel that interpolates them.
pub struct Field<'a, T> {
    samples: &'a [T],
    dims: [usize; 3],
    memory: Memory<'a>,
    shape: Shape<'a>,
    zero: f32,
}

/// The layout of samples in memory.
#[derive(Clone, Copy)]
enum Memory<'a> {
    /// Row by row.
    Rows,
    /// In the slots of bricks.
    Slots(&'a Grid),
}

/// The kernel that interpolates samples.
#[derive(Clone, Copy)]
enum Shape<'a> {
    Gaussian(Bell),
    /// Two weights an axis, and four slopes.
    Linear(Factors),
    /// Four weights and slopes an axis.
    Cubic(Factors),
    /// The nearest sample, with the Gaussian that smooths the mask of its label, and the shares of
    /// each sample's own label around it ([`label_shares`](crate::volume::label_shares)).
    Labels(Bell, &'a [u8]),
}

impl Shape<'_> {
    fn new(weighting: Weighting) -> Self {
        match weighting {
            Weighting::Gaussian(sigma) => Self::Gaussian(Bell::new(sigma)),
            Weighting::Tensor(Tensor::Linear) => Self::Linear(Factors::new(Tensor::Linear)),
            Weighting::Tensor(tensor) => Self::Cubic(Factors::new(tensor)),
            Weighting::Labels => unreachable!("the field of a label map is made by `labels`"),
        }
    }
}

/// A Gaussian along an axis.
#[derive(Clone, Copy)]
struct Bell {
    /// One over the kernel's variance in squared steps.
    per_variance: f32,
    /// Weights at one and two steps from the centre.
    near: f32,
    far: f32,
}

/// The weights of four samples of an axis as polynomials of the place t between two of them: the
/// factors of 1, t, t² and t³. The same for their slopes, without t³.
#[derive(Clone, Copy)]
struct Factors {
    weights: [[f32; 4]; 4],
    slopes: [[f32; 3]; 4],
}

impl<'a, T: Sample> Field<'a, T> {
    fn new(
        samples: &'a [T],
        dims: [usize; 3],
        memory: Memory<'a>,
        shape: Shape<'a>,
        zero: f64,
    ) -> Self {
        Self { samples, dims, memory, shape, zero: zero as f32 }
    }

    /// Sets a point to the value relative to zero and its change per step along each axis, at
    /// places in steps.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, place: &[Lanes<S>; 3], point: &mut Point<S>) {
        match &self.shape {
            Shape::Gaussian(bell) => self.gaussian(simd, bell, place, point),
            Shape::Linear(factors) => self.linear(simd, factors, place, point),
            // A separate function, because it is large and called from three places.
            Shape::Cubic(factors) => simd.vectorize(
                #[inline(always)]
                || point.set(self.cubic(simd, factors, *place)),
            ),
            Shape::Labels(bell, shares) => simd.vectorize(
                #[inline(always)]
                || point.set(self.label(simd, bell, shares, *place)),
            ),
        }
    }
}

impl Grid {
    /// Returns the bricks of the windows' second samples, from the indices of the first samples.
    #[inline(always)]
    fn bricks<S: Simd>(&self, [x, y, z]: [i32x8<S>; 3]) -> ([i32x8<S>; 3], [usize; 8]) {
        let [x, y, z] = [(x + 1) >> 5, (y + 1) >> 5, (z + 1) >> 5];
        let [columns, rows, _] = self.counts.map(|count| count as i32);
        let numbers: [i32; 8] = ((z * rows + y) * columns + x).into();
        ([x, y, z], each!([0, 1, 2, 3, 4, 5, 6, 7], L => numbers[L] as usize))
    }

    /// Returns the places of windows in the slots. For absent bricks the places are arbitrary.
    #[inline(always)]
    fn places<S: Simd>(&self, first: [i32x8<S>; 3]) -> [usize; 8] {
        let (bricks, numbers) = self.bricks(first);
        let [x, y, z]: [i32x8<S>; 3] =
            three!(I => first[I] + BESIDE as i32 - bricks[I] * SIDE as i32);
        let side = SLOT_SIDE as i32;
        let within: [i32; 8] = ((z * side + y) * side + x).into();
        each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
            let slot = self.slots[numbers[L]];
            (if slot == Self::ABSENT { 0 } else { slot as usize * SLOT }) + within[L] as usize
        })
    }

    /// Returns where there are bricks around places, and a value of each brick. Places are in steps
    /// of the level, whose size is `dims`.
    #[inline(always)]
    pub fn held<S: Simd>(
        &self,
        simd: S,
        dims: [usize; 3],
        place: [Lanes<S>; 3],
    ) -> (mask32x8<S>, Lanes<S>) {
        let first = three!(I => {
            let last = Lanes::splat(simd, dims[I] as f32 - 1.0);
            i32x8::truncate_from(place[I].max(Lanes::splat(simd, 0.0)).min(last)) - 1
        });
        let (_, numbers) = self.bricks(first);
        let values = words!(simd, L => self.values[numbers[L]].to_bits());
        (words!(simd, L => self.slots[numbers[L]]).simd_lt(Self::ABSENT), values.bitcast())
    }
}

/// Gaussians.
impl<T: Sample> Field<'_, T> {
    #[inline(always)]
    fn gaussian<S: Simd>(&self, simd: S, bell: &Bell, place: &[Lanes<S>; 3], point: &mut Point<S>) {
        let place: [Lanes<S>; 3] = three!(I => {
            let last = self.dims[I] as f32 - 1.0;
            place[I].max(Lanes::splat(simd, -BEYOND)).min(Lanes::splat(simd, last + BEYOND))
        });
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        let is_within = self.hold(first, [-1.0, 2.0]);
        let mut weights: [Weights<S>; 3] = three!(I => bell.weights(simd, place[I] - first[I]));
        let mut starts = three!(I => first[I] - 1.0);
        if !is_within {
            if self.dims.iter().any(|&count| count < 4) {
                return simd.vectorize(
                    #[inline(always)]
                    || point.set(self.beside(simd, bell, place, first)),
                );
            }
            // Use four samples of the lattice; samples outside have no weight.
            starts = three!(I => {
                let end = Lanes::splat(simd, self.dims[I] as f32 - 4.0);
                let start = starts[I].max(Lanes::splat(simd, 0.0)).min(end);
                weights[I] = moved(simd, weights[I].weights, start - starts[I]);
                start
            });
        }
        let row = T::weigh(simd, &mut weights[0]);
        let window = self.window(starts);
        let (sum, gradient) = self.sums(
            bell,
            &weights,
            T::UNIT,
            #[inline(always)]
            |j, k| T::row(simd, &window, j, k, &row, self.zero),
        );
        point.set((T::ZERO.map_or(sum, |zero| sum + (zero - self.zero)), gradient));
    }

    /// Returns the windows of samples in the lattice that begin at the first sample of each lane.
    #[inline(always)]
    fn window<S: Simd, const N: usize>(&self, starts: [Lanes<S>; 3]) -> Window<'_, T, N> {
        self.window_of(self.samples, starts)
    }

    /// Returns the same windows of something else that lies as the samples do.
    #[inline(always)]
    fn window_of<'b, U: Copy, S: Simd, const N: usize>(
        &self,
        samples: &'b [U],
        starts: [Lanes<S>; 3],
    ) -> Window<'b, U, N> {
        let first: [i32x8<S>; 3] = three!(I => i32x8::truncate_from(starts[I]));
        let [nx, ny, nz] = self.dims;
        let (places, row, slice) = match self.memory {
            Memory::Slots(grid) => (grid.places(first), SLOT_SIDE, SLOT_SIDE * SLOT_SIDE),
            Memory::Rows if nx * ny * nz <= i32::MAX as usize => {
                let [x, y, z] = first;
                let indices: [i32; 8] = ((z * ny as i32 + y) * nx as i32 + x).into();
                (each!([0, 1, 2, 3, 4, 5, 6, 7], I => indices[I] as usize), nx, nx * ny)
            }
            Memory::Rows => {
                let [x, y, z]: [[i32; 8]; 3] = three!(I => first[I].into());
                let indices = each!([0, 1, 2, 3, 4, 5, 6, 7], I => (z[I] as usize * ny
                    + y[I] as usize) * nx + x[I] as usize);
                (indices, nx, nx * ny)
            }
        };
        Window::new(samples, places, row, slice)
    }

    /// Evaluates lattices with fewer than four samples along an axis, sample by sample.
    #[inline(always)]
    fn beside<S: Simd>(
        &self,
        simd: S,
        bell: &Bell,
        place: [Lanes<S>; 3],
        first: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let (weights, samples) = self.held(self.samples, simd, (bell, place, first));
        let row = weights[0].weights;
        self.sums(
            bell,
            &weights,
            1.0,
            #[inline(always)]
            |j, k| row_of(&row, samples.four(simd, j, k), self.zero),
        )
    }

    /// Returns the weights of the samples around places, of which those outside the lattice have
    /// none, and the samples. `first` is the sample before a place.
    #[inline(always)]
    fn held<'b, U, S: Simd>(
        &self,
        samples: &'b [U],
        simd: S,
        (bell, place, first): (&Bell, [Lanes<S>; 3], [Lanes<S>; 3]),
    ) -> ([Weights<S>; 3], Border<'b, U>) {
        let none = Lanes::splat(simd, 0.0);
        let mut weights: [Weights<S>; 3] = three!(I => bell.weights(simd, place[I] - first[I]));
        let mut taps = [[[0; 4]; 8]; 3];
        for axis in 0..3 {
            let last = Lanes::splat(simd, self.dims[axis] as f32 - 1.0);
            let mut kept = weights[axis].weights;
            for tap in 0..4 {
                let index = first[axis] + (tap as f32 - 1.0);
                let inside = index.max(none).min(last);
                kept[tap] = inside.simd_eq(index).select(kept[tap], none);
                let indices: [f32; 8] = inside.into();
                for (lane_taps, index) in taps[axis].iter_mut().zip(indices) {
                    lane_taps[tap] = index as usize;
                }
            }
            weights[axis] = normalised(simd, kept);
        }
        (weights, self.border(samples, taps))
    }

    /// Returns the mean of the samples in reach, and its gradient. `row` returns the sum of a row
    /// of a slice and its first moment, both to be multiplied by `unit`.
    #[inline(always)]
    fn sums<S: Simd>(
        &self,
        bell: &Bell,
        [x, y, z]: &[Weights<S>; 3],
        unit: f32,
        row: impl Fn(usize, usize) -> [Lanes<S>; 2],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let weights = four!(K => z.weights[K] * unit);
        // For each slice: the sum, and the moments along x and y.
        let slices = four!(K => {
            let rows = four!(J => row(J, K));
            let sums = four!(J => y.weights[J] * rows[J][0]);
            let moment = y.weights[0].mul_add(rows[0][1], y.weights[1] * rows[1][1])
                + y.weights[2].mul_add(rows[2][1], y.weights[3] * rows[3][1]);
            [(sums[0] + sums[1]) + (sums[2] + sums[3]), moment, sums[3] * 2.0 + (sums[2] - sums[0])]
        });
        let [sum, sum_x, sum_y] = three!(I => {
            weights[0].mul_add(slices[0][I], weights[1] * slices[1][I])
                + weights[2].mul_add(slices[2][I], weights[3] * slices[3][I])
        });
        let sum_z = weights[3].mul_add(slices[3][0] * 2.0, weights[2] * slices[2][0])
            - weights[0] * slices[0][0];
        let (moments, means) = ([sum_x, sum_y, sum_z], [x.moment, y.moment, z.moment]);
        (sum, three!(I => (moments[I] - means[I] * sum) * bell.per_variance))
    }
}

/// Returns the weights of the four samples that lie `by` samples after those of `weights`. Samples
/// without a weight get 0.
#[inline(always)]
fn moved<S: Simd>(simd: S, weights: [Lanes<S>; 4], by: Lanes<S>) -> Weights<S> {
    let none = Lanes::splat(simd, 0.0);
    let mut shifted = [none; 4];
    for (to, target) in shifted.iter_mut().enumerate() {
        for (from, weight) in weights.iter().enumerate() {
            *target = by.simd_eq(from as f32 - to as f32).select(*weight, *target);
        }
    }
    normalised(simd, shifted)
}

/// Scales weights so that they add up to 1.
#[inline(always)]
fn normalised<S: Simd>(simd: S, weights: [Lanes<S>; 4]) -> Weights<S> {
    let inverse = Lanes::splat(simd, 1.0) / ((weights[0] + weights[1]) + (weights[2] + weights[3]));
    Weights::new(four!(I => weights[I] * inverse))
}

impl Bell {
    fn new(sigma: f64) -> Self {
        let per_variance = 1.0 / (sigma * sigma);
        let at = |distance: f64| (-0.5 * distance * distance * per_variance).exp() as f32;
        Self { per_variance: per_variance as f32, near: at(1.0), far: at(2.0) }
    }

    #[inline(always)]
    fn weights<S: Simd>(&self, simd: S, t: Lanes<S>) -> Weights<S> {
        // All weights follow from one factor: that from the sample before the place to the place
        // itself.
        let q = exp2_within(simd, t * (self.per_variance * std::f32::consts::LOG2_E));
        let after = q * q * self.near;
        let second = q * (q * q * self.far);
        let inverse = Lanes::splat(simd, 1.0) / (q + (after + self.near) + second);
        Weights::new([inverse * self.near, q * inverse, after * inverse, second * inverse])
    }
}

/// Tensor products.
impl<T: Sample> Field<'_, T> {
    /// Interpolates between eight samples. The slopes are the derivatives.
    #[inline(always)]
    fn linear<S: Simd>(
        &self,
        simd: S,
        factors: &Factors,
        place: &[Lanes<S>; 3],
        point: &mut Point<S>,
    ) {
        let mut place = three!(I => place[I]);
        let mut first = three!(I => place[I].floor());
        let mut sides = None;
        if !self.hold(first, [0.0, 1.0]) {
            if self.dims.iter().any(|&count| count < 2) {
                return simd.vectorize(
                    #[inline(always)]
                    || point.set(self.mirrored(simd, factors, place)),
                );
            }
            let seen = three!(I => Seen::new(simd, place[I], self.dims[I]));
            (place, first) = (three!(I => seen[I].place), three!(I => seen[I].first));
            sides = Some(three!(I => seen[I].side));
        }
        let [x, y, z]: [Lanes<S>; 3] = three!(I => place[I] - first[I]);
        // The rows of the near slice, then those of the far slice, with their changes along x.
        let window: Window<T, 2> = self.window(first);
        let pairs = four!(I => T::two(simd, &window, [0, I % 2, I / 2]));
        let rises = four!(I => pairs[I][1] - pairs[I][0]);
        let rows = four!(I => x.mul_add(rises[I], pairs[I][0] - self.zero));
        let along_x =
            [y.mul_add(rises[1] - rises[0], rises[0]), y.mul_add(rises[3] - rises[2], rises[2])];
        let along_y = [rows[1] - rows[0], rows[3] - rows[2]];
        let slices = [y.mul_add(along_y[0], rows[0]), y.mul_add(along_y[1], rows[2])];
        let along_z = slices[1] - slices[0];
        let slope_x = z.mul_add(along_x[1] - along_x[0], along_x[0]);
        let slope_y = z.mul_add(along_y[1] - along_y[0], along_y[0]);
        let mut slopes = [slope_x, slope_y, along_z];
        if let Some(sides) = sides {
            slopes = three!(I => slopes[I] * sides[I]);
        }
        point.set((z.mul_add(along_z, slices[0]), slopes));
    }

    /// Returns the slopes of a linear field per step along each axis ([`Tensor::slope`]), from 32
    /// samples.
    #[inline(always)]
    pub fn slopes<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let Shape::Linear(factors) = &self.shape else { unreachable!("another kernel") };
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        if !self.hold(first, [-1.0, 2.0]) {
            return simd.vectorize(
                #[inline(always)]
                || self.cubic(simd, factors, place).1,
            );
        }
        let [x, y, z]: [Lanes<S>; 3] = three!(I => place[I] - first[I]);
        let window: Window<T, 4> = self.window(three!(I => first[I] - 1.0));
        // Rows of four samples in the middle: two of the near slice, two of the far slice.
        let fours = four!(I => T::four(simd, &window, [0, 1 + I % 2, 1 + I / 2]));
        let rises = four!(I => {
            between([fours[I][2] - fours[I][0], fours[I][3] - fours[I][1]], x)
        });
        let rows = four!(I => between([fours[I][1], fours[I][2]], x));
        let along_y = each!([0, 1], K => {
            let beside = each!([0, 3], J => between(T::two(simd, &window, [1, J, 1 + K]), x));
            between([rows[2 * K + 1] - beside[0], beside[1] - rows[2 * K]], y)
        });
        let slices = each!([0, 1], K => between([rows[2 * K], rows[2 * K + 1]], y));
        let beside = each!([0, 3], K => {
            between(each!([1, 2], J => between(T::two(simd, &window, [1, J, K]), x)), y)
        });
        let slopes = [
            between([between([rises[0], rises[1]], y), between([rises[2], rises[3]], y)], z),
            between(along_y, z),
            between([slices[1] - beside[0], beside[1] - slices[0]], z),
        ];
        three!(I => slopes[I] * 0.5)
    }

    /// Sums four samples along each axis.
    #[inline(always)]
    fn cubic<S: Simd>(
        &self,
        simd: S,
        factors: &Factors,
        place: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        if self.hold(first, [-1.0, 2.0]) {
            let taps: [Taps<S>; 3] = three!(I => Taps::new(simd, factors, place[I] - first[I]));
            return self.window_sums(simd, &taps, three!(I => first[I] - 1.0));
        }
        if self.dims.iter().any(|&count| count < 4) {
            return self.mirrored(simd, factors, place);
        }
        // Use four samples of the lattice. The mirror images beside them count too.
        let seen = three!(I => Seen::new(simd, place[I], self.dims[I]));
        let mut taps: [Taps<S>; 3] =
            three!(I => Taps::new(simd, factors, seen[I].place - seen[I].first));
        let starts = three!(I => {
            let is_low = seen[I].first.simd_lt(0.5);
            let is_high = seen[I].first.simd_gt(self.dims[I] as f32 - 2.5);
            taps[I].weights = within_lattice(simd, taps[I].weights, is_low, is_high);
            taps[I].slopes = within_lattice(simd, taps[I].slopes, is_low, is_high);
            let start = is_high.select(seen[I].first - 2.0, seen[I].first - 1.0);
            is_low.select(seen[I].first, start)
        });
        let (value, slopes) = self.window_sums(simd, &taps, starts);
        (value, three!(I => slopes[I] * seen[I].side))
    }

    /// Whether the samples from one offset to another lie in the lattice, along all axes and in all
    /// lanes.
    #[inline(always)]
    fn hold<S: Simd>(&self, first: [Lanes<S>; 3], [from, to]: [f32; 2]) -> bool {
        let within = three!(I => {
            first[I].simd_ge(-from) & first[I].simd_le(self.dims[I] as f32 - 1.0 - to)
        });
        (within[0] & within[1] & within[2]).all_true()
    }

    /// Evaluates the border of any lattice, sample by sample.
    #[inline(always)]
    fn mirrored<S: Simd>(
        &self,
        simd: S,
        factors: &Factors,
        place: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
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
                for (lane_indices, index) in indices[I].iter_mut().zip(index) {
                    lane_indices[tap] = index as usize;
                }
            }
            Taps::new(simd, factors, place - first)
        });
        let samples = self.border(self.samples, indices);
        let (value, slopes) = tap_sums(
            &taps,
            1.0,
            #[inline(always)]
            |j, k| {
                let four = samples.four(simd, j, k);
                let four = four!(I => four[I] - self.zero);
                [of_four(&taps[0].weights, &four), of_four(&taps[0].slopes, &four)]
            },
        );
        (value, three!(I => slopes[I] * sides[I]))
    }

    /// Returns the sum of the samples of windows in the lattice, and its gradient.
    #[inline(always)]
    fn window_sums<S: Simd>(
        &self,
        simd: S,
        taps: &[Taps<S>; 3],
        starts: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let window = self.window(starts);
        let row = T::tap(simd, &taps[0]);
        let (sum, slopes) = tap_sums(
            taps,
            T::UNIT,
            #[inline(always)]
            |j, k| T::tapped(simd, &window, [j, k], &row, self.zero),
        );
        (T::ZERO.map_or(sum, |zero| sum + (zero - self.zero)), slopes)
    }
}

/// Returns the sum of the samples in reach, and its gradient. `row` returns the sum of a row of a
/// slice and its slope, both to be multiplied by `unit`.
#[inline(always)]
fn tap_sums<S: Simd>(
    [_, y, z]: &[Taps<S>; 3],
    unit: f32,
    row: impl Fn(usize, usize) -> [Lanes<S>; 2],
) -> (Lanes<S>, [Lanes<S>; 3]) {
    // For each slice: the sum, and the slopes along x and y.
    let slices = four!(K => {
        let rows = four!(J => row(J, K));
        let [sums, slopes] = each!([0, 1], I => four!(J => rows[J][I]));
        [of_four(&y.weights, &sums), of_four(&y.weights, &slopes), of_four(&y.slopes, &sums)]
    });
    let [sums, along_x, along_y] = three!(I => four!(K => slices[K][I]));
    let weights = four!(K => z.weights[K] * unit);
    let along_z = of_four(&z.slopes, &sums) * unit;
    let [sum, along_x, along_y] =
        [of_four(&weights, &sums), of_four(&weights, &along_x), of_four(&weights, &along_y)];
    (sum, [along_x, along_y, along_z])
}

/// Returns the value at a share of the way between two values.
#[inline(always)]
fn between<S: Simd>([from, to]: [Lanes<S>; 2], share: Lanes<S>) -> Lanes<S> {
    share.mul_add(to - from, from)
}

impl Factors {
    fn new(tensor: Tensor) -> Self {
        Self {
            weights: tensor.polynomials().map(|row| row.map(|factor| factor as f32)),
            slopes: tensor.slope_polynomials().map(|row| row.map(|factor| factor as f32)),
        }
    }
}

impl<S: Simd> Taps<S> {
    /// Returns the weights at the fraction t between two samples.
    #[inline(always)]
    fn new(simd: S, factors: &Factors, t: Lanes<S>) -> Self {
        let weights = four!(I => {
            let [a, b, c, d] = factors.weights[I];
            let sum = t.mul_add(Lanes::splat(simd, d), Lanes::splat(simd, c));
            t.mul_add(t.mul_add(sum, Lanes::splat(simd, b)), Lanes::splat(simd, a))
        });
        let slopes = four!(I => {
            let [a, b, c] = factors.slopes[I];
            let [a, b, c] = [a, b, c].map(|part| Lanes::splat(simd, part));
            t.mul_add(t.mul_add(c, b), a)
        });
        Self { weights, slopes }
    }
}

/// Moves the weights of the four samples around a place to four samples in the lattice. In the
/// lowest cell the first sample lies outside the lattice, in the highest cell the last one. The
/// weight of a mirror image goes to the sample that it mirrors.
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

/// A place on a mirrored axis.
struct Seen<S: Simd> {
    /// Its mirror image in the lattice.
    place: Lanes<S>,
    /// The sample before it. The last sample lies at the end of the last cell.
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
        let place = is_turned
            .select(around * -1.0 + period, around)
            .max(none)
            .min(Lanes::splat(simd, last));
        let first = place.floor().min(Lanes::splat(simd, last - 1.0));
        let side = is_turned.select(Lanes::splat(simd, -1.0), Lanes::splat(simd, 1.0));
        Self { place, first, side }
    }
}

/// Rows of four samples around eight places, in four rows of four slices.
trait Rows<S: Simd> {
    fn four(&self, simd: S, row: usize, slice: usize) -> [Lanes<S>; 4];
}

impl<S: Simd, T: Sample> Rows<S> for Window<'_, T, 4> {
    #[inline(always)]
    fn four(&self, simd: S, row: usize, slice: usize) -> [Lanes<S>; 4] {
        T::four(simd, self, [0, row, slice])
    }
}

/// Samples at arbitrary indices: samples at the lattice's border replace those outside.
struct Border<'a, T> {
    samples: &'a [T],
    /// The index at which each lane's samples begin.
    starts: [usize; 8],
    /// For each axis and lane, the indices of four samples.
    taps: [[[usize; 4]; 8]; 3],
    row: usize,
    slice: usize,
}

impl<T> Field<'_, T> {
    /// Returns the samples at four indices along each axis for each lane. The second index is at
    /// most two from the others.
    fn border<'b, U>(&self, samples: &'b [U], mut taps: [[[usize; 4]; 8]; 3]) -> Border<'b, U> {
        let [nx, ny, _] = self.dims;
        let mut starts = [0; 8];
        let Memory::Slots(grid) = self.memory else {
            return Border { samples, starts, taps, row: nx, slice: nx * ny };
        };
        for (lane, start) in starts.iter_mut().enumerate() {
            let mut number = 0;
            for axis in (0..3).rev() {
                let brick = taps[axis][lane][1] / SIDE;
                number = number * grid.counts[axis] + brick;
                taps[axis][lane] = taps[axis][lane].map(|tap| tap + BESIDE - brick * SIDE);
            }
            let slot = grid.slots[number];
            *start = if slot == Grid::ABSENT { 0 } else { slot as usize * SLOT };
        }
        Border { samples, starts, taps, row: SLOT_SIDE, slice: SLOT_SIDE * SLOT_SIDE }
    }
}

impl<S: Simd, T: Sample> Rows<S> for Border<'_, T> {
    #[inline(always)]
    fn four(&self, simd: S, row: usize, slice: usize) -> [Lanes<S>; 4] {
        let mut values = [[0.0f32; 8]; 4];
        for lane in 0..8 {
            let start = self.taps[2][lane][slice] * self.slice + self.taps[1][lane][row] * self.row;
            for (lanes, x) in values.iter_mut().zip(self.taps[0][lane]) {
                lanes[lane] = self.samples[self.starts[lane] + start + x].value();
            }
        }
        four!(I => values[I].simd_into(simd))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::vector::lanes;
    use crate::{math::cosine::mirrored, volume::Lattice};
    use fearless_simd::Level;
    use glam::DVec3;

    /// Returns the value and its changes per step along each axis, sample by sample in double
    /// precision.
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
                    if axis + 1 == number {
                        tensor.slope(away[axis])
                    } else {
                        tensor.value(away[axis])
                    }
                };
                *sum += sample * weight(0) * weight(1) * weight(2);
            }
        }
        sums
    }

    fn evaluate(
        volume: &Volume,
        weighting: Weighting,
        places: [[f32; 8]; 3],
        zero: f64,
    ) -> [[f32; 8]; 4] {
        fn at<T: Sample, S: Simd>(
            simd: S,
            field: &Field<T>,
            places: [[f32; 8]; 3],
        ) -> [[f32; 8]; 4] {
            let places = three!(I => places[I].simd_into(simd));
            let mut point = Point::none(simd);
            field.at(simd, &places, &mut point);
            let Point { value, mut slopes, .. } = point;
            if matches!(field.shape, Shape::Linear(_)) {
                slopes = field.slopes(simd, places);
            }
            let [x, y, z] = slopes;
            [value, x, y, z].map(Into::into)
        }
        let level = Level::new();
        match Typed::new(volume, weighting, zero) {
            Typed::U8(field) => lanes!(level, simd => at(simd, &field, places)),
            Typed::U16(field) => lanes!(level, simd => at(simd, &field, places)),
            Typed::I16(field) => lanes!(level, simd => at(simd, &field, places)),
            Typed::I32(field) => lanes!(level, simd => at(simd, &field, places)),
            Typed::F32(field) => lanes!(level, simd => at(simd, &field, places)),
            Typed::Blend(_) => unreachable!("four weights an axis"),
        }
    }

    #[test]
    fn tensor_products_are_sums_over_mirrored_samples() {
        for (number, dims) in
            [[7, 6, 8], [1, 5, 4], [6, 2, 1], [4, 5, 6], [2, 3, 2]].into_iter().enumerate()
        {
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
                    // The first rounds lie in the lattice, the others also up to three steps
                    // outside it.
                    let beyond = if round < 20 { 0.0 } else { 3.0 };
                    let place = |axis: usize, lane: usize| {
                        let part = ((round * 8 + lane) as f64 * [0.61, 0.77, 0.37][axis]).fract();
                        let last = dims[axis] as f64 - 1.0;
                        (part * (last + 2.0 * beyond) - beyond) as f32
                    };
                    let places =
                        [0, 1, 2].map(|axis| std::array::from_fn(|lane| place(axis, lane)));
                    for zero in [0.0, 100.0] {
                        let results = evaluate(&volume, Weighting::Tensor(tensor), places, zero);
                        for lane in 0..8 {
                            let place = places.map(|lanes| f64::from(lanes[lane]));
                            let mut expected = truth(&volume, tensor, place);
                            expected[0] -= zero;
                            // Weights of small integers are rounded.
                            let most = if number < 3 { 2e-2 } else { 2e-3 };
                            for (lanes, expected) in results.iter().zip(expected) {
                                let value = f64::from(lanes[lane]);
                                assert!(
                                    (value - expected).abs() < most,
                                    "{tensor:?} {dims:?} {place:?}: {value} {expected}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }

    /// Returns the mean of the samples under a Gaussian that four weights an axis cover, and its
    /// changes per step along each axis.
    fn mean(volume: &Volume, sigma: f64, place: [f64; 3]) -> [f64; 4] {
        let dims = volume.lattice.dims;
        let at = |place: [f64; 3]| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for index in 0..dims.iter().product() {
                let sample =
                    [index % dims[0], index / dims[0] % dims[1], index / (dims[0] * dims[1])];
                let away = [0, 1, 2].map(|axis| place[axis] - sample[axis] as f64);
                let weight =
                    (-0.5 * away.iter().map(|d| d * d).sum::<f64>() / (sigma * sigma)).exp();
                (sum, weights) = (sum + weight * volume.value(index), weights + weight);
            }
            sum / weights
        };
        let slope = |axis: usize| {
            let beside = |by: f64| {
                [0, 1, 2].map(|other| place[other] + if other == axis { by } else { 0.0 })
            };
            (at(beside(1e-4)) - at(beside(-1e-4))) / 2e-4
        };
        [at(place), slope(0), slope(1), slope(2)]
    }

    #[test]
    fn gaussians_are_means_beside_the_lattice_too() {
        let dims = [7, 6, 8];
        let bytes: Vec<u8> = (0..336).map(|at: usize| (at * at * 31 % 251) as u8).collect();
        let kinds = [
            Samples::U8(bytes.clone()),
            Samples::U16(bytes.iter().map(|byte| u16::from(*byte)).collect()),
            Samples::I16(bytes.iter().map(|byte| i16::from(*byte)).collect()),
            Samples::F32(bytes.iter().map(|byte| f32::from(*byte)).collect()),
        ];
        for samples in kinds {
            let volume = Volume::new(Lattice::with_spacing(dims, DVec3::ONE), samples).unwrap();
            for round in 0..40 {
                let place = |axis: usize, lane: usize| {
                    let part = ((round * 8 + lane) as f64 * [0.61, 0.77, 0.37][axis]).fract();
                    (part * (dims[axis] as f64 + 2.0) - 1.5) as f32
                };
                let places = [0, 1, 2].map(|axis| std::array::from_fn(|lane| place(axis, lane)));
                let results = evaluate(&volume, Weighting::Gaussian(0.5), places, 0.0);
                for lane in 0..8 {
                    let place = places.map(|lanes| f64::from(lanes[lane]));
                    for (lanes, expected) in results.iter().zip(mean(&volume, 0.5, place)) {
                        // Relative to 251. The errors come from omitted weights, and for integers
                        // from rounded weights.
                        let value = f64::from(lanes[lane]);
                        assert!((value - expected).abs() < 2.0, "{place:?}: {value} {expected}");
                    }
                }
            }
        }
    }
}

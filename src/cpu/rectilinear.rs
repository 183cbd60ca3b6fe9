//! Gaussians on rectilinear lattices. Along each axis, a sample's Gaussian is as wide as the
//! distance to the sample's neighbours. The sample's value continues along its slope. Both are
//! products along the axes, so a place takes two weights for each sample and axis. One weights the
//! value; the other adds the slopes of the samples around.

use super::{
    kernel_sums::{MOST_TAPS, Sums, reach},
    vector::{Lanes, each, exp2, three},
    window::columns,
};
use crate::{
    math::{Kernel, Profile},
    plan::weighting::LEAST_WEIGHT,
    volume::{Volume, overshoot::Overshoot, reach::neighbourhood_ranges},
};
use fearless_simd::{Simd, i32x8, prelude::*};

/// Samples with less weight than this at all eight places are skipped.
const LEAST_COUNTED: f32 = 1e-4;
/// Maximum number of equal bins along an axis, through which cells are looked up.
const MOST_BINS: f64 = 1048576.0;
/// Distance of missing samples, relative to the lattice's size.
const FAR: f32 = 1e4;
/// Number of places in a cell at which the sum of the weights' magnitudes is measured.
const PLACES: usize = 8;

/// The samples along the axes of a lattice.
#[derive(Debug)]
pub struct Axes([Axis; 3]);

#[derive(Debug)]
struct Axis {
    count: usize,
    /// For each sample: its place relative to the first one, the inverse of its kernel's standard
    /// deviation, and its slope's factors for the differences to the samples before and after.
    samples: Vec<[f32; 4]>,
    /// For each cell after a sample: the first sample that places in the cell read.
    starts: Vec<u32>,
    /// For each cell: the first and the last sample with weight there, extended by one on each
    /// side.
    reached: Vec<[u32; 2]>,
    /// The cell in which each bin begins, and the number of bins per step.
    bins: Vec<u32>,
    per_step: f32,
    /// The width of the equal cells, and their number.
    width: f64,
    cells: usize,
}

/// Samples along an axis around eight places: the first sample, the weights of the values, the
/// weights that slopes add, and the changes of both per step.
pub struct Along<S: Simd, const N: usize> {
    pub start: Lanes<S>,
    /// A bit for each sample that counts.
    pub counted: u32,
    weights: [Lanes<S>; N],
    added: [Lanes<S>; N],
    weight_slopes: [Lanes<S>; N],
    added_slopes: [Lanes<S>; N],
}

/// Returns the standard deviation of each sample's kernel along an axis, in steps.
fn deviations(places: &[f64], kernel: &Kernel) -> Vec<f64> {
    let sigma = if let Profile::Gaussian(sigma) = kernel.profile { sigma } else { 1.0 };
    let last = places.len() - 1;
    let unit = |at: usize| {
        let (before, after) = (at.saturating_sub(1), (at + 1).min(last));
        if before == after {
            1.0
        } else {
            (places[after] - places[before]) / (after - before) as f64
        }
    };
    (0..=last).map(|at| sigma * unit(at)).collect()
}

/// Returns the first and the last sample with weight in each cell between samples, extended by one
/// on each side.
fn reached(places: &[f64], kernel: &Kernel) -> Vec<[u32; 2]> {
    let sigma = if let Profile::Gaussian(sigma) = kernel.profile { sigma } else { 1.0 };
    let reach = reach(kernel) / sigma;
    let last = places.len() - 1;
    let cells = last.max(1);
    let mut ranges: Vec<[u32; 2]> =
        (0..cells).map(|cell| [cell as u32, (cell + 1).min(last) as u32]).collect();
    for (at, (place, deviation)) in places.iter().zip(deviations(places, kernel)).enumerate() {
        let ends = [place - reach * deviation, place + reach * deviation];
        let first = places.partition_point(|place| *place <= ends[0]).saturating_sub(1);
        let end = places.partition_point(|place| *place < ends[1]).min(cells);
        for [low, high] in &mut ranges[first.min(cells - 1)..end] {
            *low = (*low).min(at as u32);
            *high = (*high).max(at as u32);
        }
    }
    ranges.iter().map(|[low, high]| [low.saturating_sub(1), (high + 1).min(last as u32)]).collect()
}

/// Returns the minimum distance of neighbours along an axis, and the distance of its ends.
fn distances(places: &[f64]) -> [f64; 2] {
    let all = places[places.len() - 1] - places[0];
    [places.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min), all]
}

impl Axes {
    /// Returns the number of samples along an axis that a place reads, or `None` if that is too
    /// many.
    pub fn taps(places: &[Vec<f64>; 3], kernel: &Kernel) -> Option<usize> {
        let most = |places: &Vec<f64>| {
            let [least, all] = distances(places);
            let most = reached(places, kernel)
                .iter()
                .map(|[low, high]| (high - low + 1) as usize)
                .max()
                .unwrap_or(1);
            (all / least <= 0.5 * MOST_BINS).then_some(most)
        };
        let [x, y, z] = places;
        let most = most(x)?.max(most(y)?).max(most(z)?);
        (most <= MOST_TAPS).then_some(most)
    }

    pub fn new(places: &[Vec<f64>; 3], kernel: &Kernel, taps: usize) -> Self {
        Self([0, 1, 2].map(|axis| Axis::new(&places[axis], kernel, taps)))
    }

    /// Returns the number of equal cells along each axis, and their widths in steps.
    pub fn cells(&self) -> ([usize; 3], [f64; 3]) {
        ([0, 1, 2].map(|axis| self.0[axis].cells), [0, 1, 2].map(|axis| self.0[axis].width))
    }

    /// Returns the weights along an axis.
    #[inline(always)]
    pub fn along<S: Simd, const N: usize>(
        &self,
        simd: S,
        axis: usize,
        place: Lanes<S>,
    ) -> Along<S, N> {
        self.0[axis].along(simd, place)
    }

    /// Returns the range of the field in each cell and half a cell around it, in steps of 1/255 of
    /// the volume's range.
    pub fn ranges(&self, volume: &Volume) -> Vec<[u8; 2]> {
        let mut ranges = neighbourhood_ranges(volume, [0; 3]);
        let mut dims = volume.lattice.dims;
        // From samples to cells, one axis after another.
        for (number, axis) in self.0.iter().enumerate() {
            let reached = axis.reached_of_cells();
            let inner: usize = dims[..number].iter().product();
            let from = ranges;
            ranges = Vec::with_capacity(from.len() / dims[number] * axis.cells);
            for slab in from.chunks(inner * dims[number]) {
                for [first, last] in &reached {
                    for at in 0..inner {
                        let along = (*first..=*last).map(|sample| slab[sample * inner + at]);
                        ranges.push(
                            along.fold([255, 0], |[a, b], [low, high]| [a.min(low), b.max(high)]),
                        );
                    }
                }
            }
            dims[number] = axis.cells;
        }
        let lebesgue = 1.0 + self.0.iter().map(Axis::added).sum::<f64>();
        let overshoot = Overshoot { lebesgue, tails: Vec::new() };
        ranges.iter_mut().for_each(|range| *range = overshoot.widen([*range].into_iter()));
        ranges
    }

    /// Returns the sums over the samples in reach. The values of a row are adjacent.
    #[inline(always)]
    pub fn sums<S: Simd, const N: usize>(
        simd: S,
        [x, y, z]: &[Along<S, N>; 3],
        values: &[Lanes<S>],
    ) -> Sums<S> {
        let none = Lanes::splat(simd, 0.0);
        let mut both = [none; N];
        let mut both_slopes = [none; N];
        for tap in 0..N {
            both[tap] = x.weights[tap] + x.added[tap];
            both_slopes[tap] = x.weight_slopes[tap] + x.added_slopes[tap];
        }
        let (mut value, mut slopes) = (none, [none; 3]);
        for (k, slice) in values.chunks_exact(N * N).enumerate() {
            if z.counted >> k & 1 == 0 {
                continue;
            }
            // Sums of complete values, and of values that still lack the slopes along z.
            let (mut sum, mut plain) = (none, none);
            let (mut sum_x, mut plain_x) = (none, none);
            let (mut sum_y, mut plain_y) = (none, none);
            for (j, row) in slice.chunks_exact(N).enumerate() {
                if y.counted >> j & 1 == 0 {
                    continue;
                }
                let (mut a, mut b, mut a_x, mut b_x) = (none, none, none, none);
                for (tap, sample) in row.iter().enumerate() {
                    a = both[tap].mul_add(*sample, a);
                    b = x.weights[tap].mul_add(*sample, b);
                    a_x = both_slopes[tap].mul_add(*sample, a_x);
                    b_x = x.weight_slopes[tap].mul_add(*sample, b_x);
                }
                let (weight, added) = (y.weights[j], y.added[j]);
                sum = weight.mul_add(a, added.mul_add(b, sum));
                plain = weight.mul_add(b, plain);
                sum_x = weight.mul_add(a_x, added.mul_add(b_x, sum_x));
                plain_x = weight.mul_add(b_x, plain_x);
                let (weight, added) = (y.weight_slopes[j], y.added_slopes[j]);
                sum_y = weight.mul_add(a, added.mul_add(b, sum_y));
                plain_y = weight.mul_add(b, plain_y);
            }
            let (weight, added) = (z.weights[k], z.added[k]);
            value = weight.mul_add(sum, added.mul_add(plain, value));
            slopes[0] = weight.mul_add(sum_x, added.mul_add(plain_x, slopes[0]));
            slopes[1] = weight.mul_add(sum_y, added.mul_add(plain_y, slopes[1]));
            slopes[2] =
                z.weight_slopes[k].mul_add(sum, z.added_slopes[k].mul_add(plain, slopes[2]));
        }
        let all = three!(I => total(simd, &[x, y, z][I].weights));
        let changes = three!(I => total(simd, &[x, y, z][I].weight_slopes));
        Sums {
            weight: all[0] * all[1] * all[2],
            value,
            weight_slopes: [
                changes[0] * all[1] * all[2],
                all[0] * changes[1] * all[2],
                all[0] * all[1] * changes[2],
            ],
            value_slopes: three!(I => slopes[I]),
        }
    }
}

#[inline(always)]
fn total<S: Simd>(simd: S, all: &[Lanes<S>]) -> Lanes<S> {
    let mut sum = Lanes::splat(simd, 0.0);
    for value in all {
        sum += *value;
    }
    sum
}

impl Axis {
    fn new(places: &[f64], kernel: &Kernel, taps: usize) -> Self {
        let count = places.len();
        let last = count - 1;
        let sample = |at: usize, deviation: f64| {
            let before = (at > 0).then(|| places[at] - places[at - 1]);
            let after = (at < last).then(|| places[at + 1] - places[at]);
            let shares = match (before, after) {
                (Some(before), Some(after)) => {
                    [after / before / (before + after), before / after / (before + after)]
                }
                (before, after) => {
                    [before, after].map(|distance| distance.map_or(0.0, |distance| 1.0 / distance))
                }
            };
            [places[at] - places[0], 1.0 / deviation, shares[0], shares[1]]
                .map(|number| number as f32)
        };
        let deviations = deviations(places, kernel);
        let mut samples: Vec<_> =
            deviations.iter().enumerate().map(|(at, deviation)| sample(at, *deviation)).collect();
        // Windows may extend beyond smaller lattices.
        samples
            .resize(count.max(taps), [FAR * (samples[last][0] + 1.0), samples[last][1], 0.0, 0.0]);
        let reached = reached(places, kernel);
        let start = |[low, high]: &[u32; 2]| {
            let spare = (taps as u32).saturating_sub(high - low + 1);
            low.saturating_sub(spare / 2).min(count.saturating_sub(taps) as u32)
        };
        let starts = reached.iter().map(start).collect();
        let [least, all] = distances(places);
        let bins = if last > 0 { (2.0 * all / least).ceil().min(MOST_BINS) } else { 1.0 };
        let per_step = if last > 0 { bins / all } else { 1.0 };
        let cell = |bin: usize| {
            let place = places[0] + bin as f64 / per_step;
            (places.partition_point(|at| *at <= place) as u32)
                .saturating_sub(1)
                .min(last.max(1) as u32 - 1)
        };
        let cells = if last > 0 { (all / least).ceil().min(2.0 * count as f64) } else { 1.0 };
        Self {
            count,
            samples,
            starts,
            reached,
            bins: (0..=bins as usize).map(cell).collect(),
            per_step: per_step as f32,
            width: if last > 0 { all / cells } else { 1.0 },
            cells: cells as usize,
        }
    }

    /// Returns the first and the last sample that count in each equal cell and half a cell around
    /// it.
    fn reached_of_cells(&self) -> Vec<[usize; 2]> {
        let end = self.reached.len() - 1;
        let of = |place: f64| {
            let bin = (place.max(0.0) * f64::from(self.per_step)) as usize;
            self.bins[bin.min(self.bins.len() - 1)] as usize
        };
        let cell = |cell: usize| {
            let places = [cell as f64 - 0.5, cell as f64 + 1.5].map(|at| at * self.width);
            // A bin maps to the cell in which it begins; a place may lie in the next cell.
            let [first, last] = [of(places[0]), (of(places[1]) + 1).min(end)];
            let ranges = self.reached[first..=last].iter();
            ranges.fold([usize::MAX, 0], |[a, b], [low, high]| {
                [a.min(*low as usize), b.max(*high as usize)]
            })
        };
        (0..self.cells).map(cell).collect()
    }

    /// Returns the largest sum of the magnitudes of the weights that slopes add, relative to the
    /// values' own weights.
    fn added(&self) -> f64 {
        let mut most = 0.0f64;
        for (cell, start) in self.starts.iter().enumerate() {
            let window = *start as usize..(*start as usize + MOST_TAPS).min(self.count);
            for part in 0..=PLACES {
                let ends =
                    [cell, (cell + 1).min(self.count - 1)].map(|at| f64::from(self.samples[at][0]));
                let place = ends[0] + (ends[1] - ends[0]) * part as f64 / PLACES as f64;
                let mut added = [0.0; MOST_TAPS + 2];
                let mut all = 0.0;
                for (tap, sample) in self.samples[window.clone()].iter().enumerate() {
                    let [at, inverse, before, after] = sample.map(f64::from);
                    let weight = (-0.5 * ((place - at) * inverse).powi(2)).exp();
                    let moment = weight * (place - at);
                    all += weight;
                    added[tap] -= moment * before;
                    added[tap + 1] += moment * (before - after);
                    added[tap + 2] += moment * after;
                }
                most = most.max(added.iter().map(|weight| weight.abs()).sum::<f64>() / all);
            }
        }
        most
    }

    #[inline(always)]
    fn along<S: Simd, const N: usize>(&self, simd: S, place: Lanes<S>) -> Along<S, N> {
        let none = Lanes::splat(simd, 0.0);
        let end = Lanes::splat(simd, self.bins.len() as f32 - 1.0);
        let bins: [i32; 8] =
            i32x8::truncate_from((place * self.per_step).max(none).min(end)).into();
        let places: [f32; 8] = place.into();
        let last = self.starts.len() - 1;
        let starts = each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
            let cell = self.bins[bins[L] as usize] as usize;
            // A bin contains at most one sample.
            let next = (cell + 1).min(last);
            let cell = if next > cell && places[L] >= self.samples[next][0] { next } else { cell };
            self.starts[cell] as usize
        });
        let mut along = Along {
            start: each!([0, 1, 2, 3, 4, 5, 6, 7], L => starts[L] as f32).simd_into(simd),
            counted: 0,
            weights: [none; N],
            added: [none; N],
            weight_slopes: [none; N],
            added_slopes: [none; N],
        };
        for tap in 0..N {
            let rows = each!([0, 1, 2, 3, 4, 5, 6, 7], L => self.samples[starts[L] + tap]);
            let [at, inverse, mut before, mut after] = columns(simd, rows);
            // Samples at the ends of the window have negligible weight, or no neighbour.
            if tap == 0 {
                (before, after) = (none, along.start.simd_gt(0.0).select(none, after));
            }
            if tap + 1 == N {
                let is_cut = along.start.simd_lt(self.count as f32 - N as f32);
                (before, after) = (is_cut.select(none, before), none);
            }
            let away = place - at;
            let scaled = away * inverse;
            let weight = exp2(simd, scaled * scaled * (-0.5 * std::f32::consts::LOG2_E));
            if !weight.simd_gt(LEAST_COUNTED).any_true() {
                continue;
            }
            along.counted |= 1 << tap;
            // Slopes use the neighbours, so the weights that they add end where the weights end.
            let has_weight = weight.simd_gt(LEAST_WEIGHT as f32);
            if has_weight.any_true() {
                along.counted |= (2 << tap) | ((1 << tap) >> 1);
            }
            (before, after) = (has_weight.select(before, none), has_weight.select(after, none));
            let slope = -(weight * scaled * inverse);
            let moment = weight * away;
            let moment_slope = slope.mul_add(away, weight);
            along.weights[tap] = weight;
            along.weight_slopes[tap] = slope;
            if tap > 0 {
                along.added[tap - 1] -= moment * before;
                along.added_slopes[tap - 1] -= moment_slope * before;
            }
            along.added[tap] += moment * (before - after);
            along.added_slopes[tap] += moment_slope * (before - after);
            if tap + 1 < N {
                along.added[tap + 1] += moment * after;
                along.added_slopes[tap + 1] += moment_slope * after;
            }
        }
        along
    }
}

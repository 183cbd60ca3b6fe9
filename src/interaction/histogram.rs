//! How often the values of a field are, and how steep the field is at them.

use crate::{
    bricks::{Bricks, Level},
    parallel::{current_num_threads, prelude::*},
    scene::Item,
    volume::{Arrangement, Lattice, Volume, each_type},
};
use glam::{DMat3, DVec3};
use std::ops::Range;

/// At most about so many samples are counted: of more, every second, third, … one along each axis.
const MOST_SAMPLES: usize = 1 << 24;
/// Of so many samples the percentile of the gradient's magnitude is taken.
const FEW: usize = 1 << 20;
/// The share of the magnitudes that the joint histogram leaves out at its upper end.
const STEEPEST: f64 = 1e-3;

/// How often the values of a field are.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// The smallest and the largest value of the field, in the data's unit.
    pub range: [f64; 2],
    /// The number of samples in [`BINS`](Self::BINS) equal parts of the range. The largest value
    /// counts in the last one. If the range has no width, all values count in the first one.
    pub counts: Vec<u64>,
    /// The counts by value and gradient, for samples on a lattice.
    pub joint: Option<Joint>,
}

/// How often the values of a field are together with the magnitudes of its gradient (Kindlmann and
/// Durkin 1998). Boundaries between two materials are arcs in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// The upper end of the magnitudes, in value per world length; the lower end is 0. Above it are
    /// 0.1 % of the samples, and they are not counted. 0 for a constant field.
    pub magnitude: f64,
    /// The counts: [`Joint::ROWS`] rows by ascending magnitude, each of [`Histogram::BINS`] counts
    /// by ascending value.
    pub counts: Vec<u64>,
}

impl Joint {
    /// The number of equal parts of the magnitudes.
    pub const ROWS: usize = 128;

    fn add(&mut self, bin: usize, magnitude: f64) {
        if magnitude <= self.magnitude {
            let share = if self.magnitude > 0.0 { magnitude / self.magnitude } else { 0.0 };
            let row = ((share * Self::ROWS as f64) as usize).min(Self::ROWS - 1);
            self.counts[row * Histogram::BINS + bin] += 1;
        }
    }
}

impl Histogram {
    /// The number of equal parts of the values.
    pub const BINS: usize = 256;

    /// Counts the values of an item (in parallel): the samples of a volume or of a set, the values
    /// at the points or in the tetrahedra of cells. Values that are not finite do not count. Of
    /// more than 16 million values, evenly spread ones count. Of a volume in bricks, those of a
    /// coarser level with at most so many samples count; its range is that of the finest level.
    ///
    /// Returns `None` for an item without a field, for a field without finite values, and for
    /// bricks that cannot be read.
    pub fn of_item(item: &Item) -> Option<Self> {
        let range = item.value_range()?;
        if !(range[0] <= range[1] && (range[1] - range[0]).is_finite()) {
            return None;
        }
        match item {
            Item::Volume(volume, ..) => Some(Self::of_volume(volume, range)),
            Item::Bricks(bricks, ..) => {
                let level = bricks.volume(overview(bricks)).ok()?;
                Some(Self::of_volume(&level, range))
            }
            Item::Scalar(set, _) => {
                let splats = &set.splats;
                Some(Self::of_values(splats.len(), range, |at| f64::from(splats[at].strength)))
            }
            Item::Cells(cells, _) => {
                let values = &cells.values;
                Some(Self::of_values(values.len(), range, |at| f64::from(values[at])))
            }
            Item::Radiance(_)
            | Item::Facets(_)
            | Item::Solid(_)
            | Item::Gaussians(_)
            | Item::Hierarchy(_) => None,
        }
    }

    fn empty(range: [f64; 2], magnitude: Option<f64>) -> Self {
        let rows = Joint::ROWS * Self::BINS;
        let joint = magnitude.map(|magnitude| Joint { magnitude, counts: vec![0; rows] });
        Self { range, counts: vec![0; Self::BINS], joint }
    }

    fn of_values(count: usize, range: [f64; 2], value: impl Fn(usize) -> f64 + Sync) -> Self {
        let step = count.div_ceil(MOST_SAMPLES).max(1);
        let samples = count.div_ceil(step);
        in_parts(
            samples,
            || Self::empty(range, None),
            |histogram, sample| {
                histogram.add(value(sample * step));
            },
        )
    }

    fn of_volume(volume: &Volume, range: [f64; 2]) -> Self {
        each_type!(volume.samples, values => {
            Self::of_lattice(&volume.lattice, range, |at: usize| f64::from(values[at]))
        })
    }

    fn of_lattice(lattice: &Lattice, range: [f64; 2], value: impl Fn(usize) -> f64 + Sync) -> Self {
        let slopes = Slopes::new(lattice, value);
        let magnitude = slopes.steepest();
        let grid = Grid::new(lattice.dims, MOST_SAMPLES);
        let rows = grid.counts[1] * grid.counts[2];
        let start = || Self::empty(range, Some(magnitude));
        in_parts(rows, start, |histogram, row| {
            for number in 0..grid.counts[0] {
                let index = grid.index(row * grid.counts[0] + number);
                let value = slopes.value(index);
                if let (Some(bin), Some(joint)) = (histogram.add(value), &mut histogram.joint) {
                    joint.add(bin, slopes.magnitude(index));
                }
            }
        })
    }

    /// Counts a value and returns its bin; `None` if it is not finite.
    fn add(&mut self, value: f64) -> Option<usize> {
        if !value.is_finite() {
            return None;
        }
        let [low, high] = self.range;
        let scale = if high > low { Self::BINS as f64 / (high - low) } else { 0.0 };
        // Casts saturate.
        let bin = (((value - low) * scale) as usize).min(Self::BINS - 1);
        self.counts[bin] += 1;
        Some(bin)
    }

    fn merged(mut self, other: Self) -> Self {
        let add = |into: &mut [u64], from: &[u64]| {
            into.iter_mut().zip(from).for_each(|(into, from)| *into += from);
        };
        add(&mut self.counts, &other.counts);
        if let (Some(joint), Some(other)) = (&mut self.joint, &other.joint) {
            add(&mut joint.counts, &other.counts);
        }
        self
    }
}

/// Returns the finest level that can be read quickly as a whole, or the coarsest level.
fn overview(bricks: &Bricks) -> usize {
    let is_quick = |level: &Level| level.dims.iter().product::<usize>() <= MOST_SAMPLES;
    bricks.levels().iter().position(is_quick).unwrap_or(bricks.levels().len() - 1)
}

/// Counts `count` things in parallel, some of them in one go.
fn in_parts(
    count: usize,
    start: impl Fn() -> Histogram + Sync,
    add: impl Fn(&mut Histogram, usize) + Sync,
) -> Histogram {
    let part = count.div_ceil(4 * current_num_threads()).max(1);
    let of_part = |range: Range<usize>| {
        let mut histogram = start();
        range.for_each(|at| add(&mut histogram, at));
        histogram
    };
    (0..count.div_ceil(part))
        .into_par_iter()
        .map(|number| of_part(number * part..count.min((number + 1) * part)))
        .reduce(&start, Histogram::merged)
}

/// Samples that are evenly spread over a lattice, ends included.
struct Grid {
    dims: [usize; 3],
    counts: [usize; 3],
}

impl Grid {
    fn new(dims: [usize; 3], most: usize) -> Self {
        // Both ends of an axis are looked at.
        let counts = |step: usize| dims.map(|n| n.div_ceil(step).max(n.min(2)));
        let all = |counts: [usize; 3]| counts.iter().map(|&n| n as f64).product::<f64>();
        let mut step = 1;
        while all(counts(step)) > most as f64 {
            step += step.div_ceil(4);
        }
        Self { dims, counts: counts(step) }
    }

    fn len(&self) -> usize {
        self.counts.iter().product()
    }

    fn index(&self, number: usize) -> [usize; 3] {
        let [nx, ny, _] = self.counts;
        let numbers = [number % nx, number / nx % ny, number / nx / ny];
        std::array::from_fn(|axis| match self.counts[axis] {
            1 => 0,
            count => numbers[axis] * (self.dims[axis] - 1) / (count - 1),
        })
    }
}

/// The gradient of a lattice's samples, by central differences, at the border by one-sided ones.
struct Slopes<'a, F> {
    lattice: &'a Lattice,
    value: F,
    /// Maps derivatives by step to the gradient in world space.
    world: DMat3,
    /// Along each axis the number of indices to the neighbour that lies exactly along it.
    strides: [usize; 3],
}

impl<'a, F: Fn(usize) -> f64 + Sync> Slopes<'a, F> {
    fn new(lattice: &'a Lattice, value: F) -> Self {
        // On a body-centred lattice every other layer is displaced.
        let is_centred = lattice.arrangement == Arrangement::BodyCentred;
        let strides = [1, 1, if is_centred { 2 } else { 1 }];
        Self { lattice, value, world: lattice.axes.inverse().transpose(), strides }
    }

    fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [nx, ny, _] = self.lattice.dims;
        (self.value)(i + nx * (j + ny * k))
    }

    /// Returns the gradient's magnitude at a sample, in value per world length.
    fn magnitude(&self, index: [usize; 3]) -> f64 {
        let slope = |axis: usize| {
            let (at, last) = (index[axis], self.lattice.dims[axis] - 1);
            let stride = self.strides[axis];
            let (mut before, mut after) = (index, index);
            before[axis] = at.checked_sub(stride).unwrap_or(at);
            after[axis] = if at + stride <= last { at + stride } else { at };
            let steps = self.lattice.steps(after)[axis] - self.lattice.steps(before)[axis];
            if steps > 0.0 { (self.value(after) - self.value(before)) / steps } else { 0.0 }
        };
        (self.world * DVec3::new(slope(0), slope(1), slope(2))).length()
    }

    /// Returns the magnitude that [`STEEPEST`] of the samples exceed.
    fn steepest(&self) -> f64 {
        let grid = Grid::new(self.lattice.dims, FEW);
        let all = (0..grid.len()).into_par_iter().map(|number| self.magnitude(grid.index(number)));
        let mut magnitudes: Vec<f64> = all.filter(|magnitude| magnitude.is_finite()).collect();
        let Some(last) = magnitudes.len().checked_sub(1) else { return 0.0 };
        let rank = last - (STEEPEST * magnitudes.len() as f64) as usize;
        *magnitudes.select_nth_unstable_by(rank, f64::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::Kernel,
        scene::Scene,
        volume::{Samples, TransferFunction, phantoms::Phantom},
    };
    use std::sync::Arc;

    fn transfer() -> TransferFunction {
        TransferFunction { opacity: vec![(0.0, 0.5)], ..TransferFunction::default() }
    }

    fn of(volume: Volume) -> Histogram {
        let item = Item::Volume(Arc::new(volume), Kernel::default(), transfer());
        Histogram::of_item(&item).unwrap()
    }

    /// Samples with the value 3x + 4z in world space, on any lattice.
    fn ramp(lattice: Lattice) -> Volume {
        let value = |at| {
            let place = lattice.sample_position(at);
            (3.0 * place.x + 4.0 * place.z) as f32
        };
        let samples = (0..lattice.len()).map(value).collect();
        Volume::new(lattice, Samples::F32(samples)).unwrap()
    }

    #[test]
    fn every_sample_counts_once_in_its_bin() {
        let values = vec![0, 0, 0, 128, 255, 255, 1, 2];
        let lattice = Lattice::with_spacing([2, 2, 2], DVec3::ONE);
        let histogram = of(Volume::new(lattice, Samples::U8(values)).unwrap());
        assert_eq!(histogram.range, [0.0, 255.0]);
        assert_eq!(histogram.counts.len(), Histogram::BINS);
        let counts = [0, 1, 2, 128, 255].map(|bin| histogram.counts[bin]);
        assert_eq!((counts, histogram.counts.iter().sum::<u64>()), ([3, 1, 1, 1, 2], 8));
        let phantom = Phantom::Specimen.sample_bytes([40, 30, 20]).unwrap();
        let expected = phantom.histogram(Histogram::BINS).unwrap();
        assert_eq!(of(phantom).counts, expected);
    }

    #[test]
    fn gradients_are_those_of_the_world_on_every_lattice() {
        let skewed = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z * 0.25);
        let places = [vec![0.0, 1.0, 5.0, 6.0], vec![0.0, 2.0], vec![0.0, 0.5, 3.0]];
        let uneven = Lattice {
            dims: [4, 2, 3],
            origin: DVec3::ZERO,
            axes: DMat3::IDENTITY,
            arrangement: Arrangement::Rectilinear(Arc::new(places)),
        };
        for lattice in [
            Lattice::cartesian([6, 5, 4], DVec3::ONE, skewed),
            Lattice::body_centred([6, 5, 8], DVec3::ZERO, DMat3::IDENTITY * 2.0),
            uneven,
        ] {
            let count = lattice.len() as u64;
            let joint = of(ramp(lattice)).joint.unwrap();
            assert!((joint.magnitude - 5.0).abs() < 1e-4, "{}", joint.magnitude);
            // All samples have the largest magnitude, but for rounding.
            let last: u64 = joint.counts[(Joint::ROWS - 1) * Histogram::BINS..].iter().sum();
            assert!(10 * last >= 9 * count, "{last} of {count}");
        }
    }

    #[test]
    fn constant_fields_and_holes_are_fine() {
        let constant = of(Phantom::Constant(7.0).sample([5; 3]).unwrap());
        assert_eq!((constant.range, constant.counts[0]), ([7.0; 2], 125));
        let joint = constant.joint.unwrap();
        assert_eq!((joint.magnitude, joint.counts[0]), (0.0, 125));
        let mut volume = Phantom::Ball.sample([8; 3]).unwrap();
        if let Samples::F32(values) = &mut volume.samples {
            values[100] = f32::NAN;
        }
        let histogram = of(volume);
        assert_eq!(histogram.counts.iter().sum::<u64>(), 511);
        assert!(histogram.joint.unwrap().magnitude.is_finite());
    }

    #[test]
    fn large_volumes_are_looked_at_evenly() {
        let grid = Grid::new([1000, 7, 900], 10_000);
        assert!(grid.len() <= 10_000 && grid.len() > 2000, "{}", grid.len());
        assert!(Grid::new([100_000, 100_000, 1], 10_000).len() <= 10_000);
        assert_eq!(grid.index(0), [0; 3]);
        assert_eq!(grid.index(grid.len() - 1), [999, 6, 899]);
        let all = Grid::new([3, 4, 5], 10_000);
        let lattice = Lattice::with_spacing([3, 4, 5], DVec3::ONE);
        assert!((0..60).all(|at| all.index(at) == lattice.index(at)));
    }

    #[test]
    fn fields_without_a_lattice_have_no_joint_counts() {
        let volume = Phantom::Ball.sample_bytes([16; 3]).unwrap();
        let bricks = Bricks::from_volume(Arc::new(volume.clone())).unwrap();
        let item = Item::Bricks(Arc::new(bricks), Kernel::default(), transfer());
        let expected = of(volume.clone());
        assert_eq!(Histogram::of_item(&item), Some(expected.clone()));
        let splat = |at| {
            let value = volume.value(at) as f32;
            let factor = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];
            crate::splat::Splat::sample(glam::Vec3::ZERO, value, factor, 1.0, glam::Vec3::ZERO)
        };
        let set = crate::splat::SampleSplats {
            origin: DVec3::ZERO,
            splats: (0..volume.len()).map(splat).collect(),
            extent: 3.0,
            overlap: 1.0,
        };
        let scene = Scene::new().with_samples(set, transfer());
        let histogram = Histogram::of_item(&scene.items[0]).unwrap();
        assert_eq!((histogram.counts, histogram.joint), (expected.counts, None));
    }
}

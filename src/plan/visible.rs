//! In which sheets of which tiles a lattice may be visible: projected blocks of visible samples.

use super::{TILE, weighting::deviation};
use crate::{
    math::{Bounds, Kernel, Sheets, Tensor, View},
    parallel::{self, prelude::*},
    volume::{
        Arrangement, Lattice, Volume,
        reach::{self, near_and_far_ranges, neighbourhood_ranges, turned, weighted_ranges},
    },
};
use glam::{DAffine3, DMat3, DVec3};

/// Samples along each side of a block.
pub const BLOCK: usize = 4;

/// The samples of a volume around which something is visible: two words for each block of 4 × 4 × 4
/// samples, a bit for each sample. For a level in bricks, a bit stands for a block of samples with
/// a known range.
#[derive(Debug)]
pub struct VisibleBlocks {
    /// Samples along each axis.
    pub dims: [usize; 3],
    /// Bits stand for cells of 2 to the power of this many samples along each axis.
    pub coarse: u32,
    pub blocks: [usize; 3],
    pub words: Vec<[u32; 2]>,
}

/// Samples from a first one up to an end, along each axis.
struct Span {
    first: [usize; 3],
    end: [usize; 3],
}

/// The bits of 2 × 2 × 2 cells in a word.
const QUARTER: u32 = 0x0033_0033;

/// How far from a sample the places may lie that are looked up by it, in steps along an axis: in
/// its cell, and up to a third of a step further away.
const FARTHEST: f64 = 0.5 + MOST_APART / 2.0;
/// Maximum distance of the places on a ray at which visibility is looked up, in steps.
pub const MOST_APART: f64 = 0.67;
/// The widest Gaussian whose field is made of two samples on either side, in steps.
const WIDEST: f64 = 0.6;

/// What the samples around a sample count at most in the field at the places that are looked up by
/// it.
#[derive(Debug, Clone, Copy)]
enum Shares {
    /// Of positive weights, along an axis.
    Positive(reach::Shares),
    /// Of Catmull & Rom's, in all, in hundredths: the magnitudes of the weights of samples two
    /// steps away, and of the negative ones of samples next to it.
    Negative([u16; 2]),
}

impl Shares {
    const CATMULL_ROM: Self = Self::Negative([30, 28]);

    /// Returns those of a kernel of which only samples up to two steps away count, if they are
    /// known.
    fn of(kernel: &Kernel) -> Option<Self> {
        match kernel.as_tensor() {
            Some(Tensor::Linear) => None,
            Some(Tensor::CatmullRom) => Some(Self::CATMULL_ROM),
            Some(tensor) => Some(Self::positive(|steps| tensor.value(steps))),
            None => {
                let sigma = deviation(kernel).filter(|&sigma| sigma <= WIDEST)?;
                Some(Self::positive(|steps| (-0.5 * (steps / sigma).powi(2)).exp()))
            }
        }
    }

    /// Returns those of positive weights, by the distance in steps. A place takes the two samples
    /// on either side.
    fn positive(weight: impl Fn(f64) -> f64) -> Self {
        let most = |of: &[f64]| {
            let shares = (0..=100).map(|part| {
                let place = f64::from(part) / 100.0 * FARTHEST;
                let sum = |taps: &[f64]| taps.iter().map(|tap| weight(tap - place)).sum::<f64>();
                sum(of) / sum(&[-1.0, 0.0, 1.0, 2.0])
            });
            shares.fold(0.0, f64::max) * 256.0
        };
        let (near, far) = (most(&[-1.0, 1.0]).ceil() as u8, most(&[2.0]).ceil() as u8);
        // Two less, as samples beyond the border weigh nothing.
        let others = (256.0 - most(&[0.0]).ceil() - 2.0).max(0.0) as u8;
        Self::Positive(reach::Shares { near, far, others })
    }
}

/// Replaces the ranges of the samples up to two steps away by those of the field, with the ranges
/// of the samples next to a sample ([`near_and_far_ranges`]). The shares are those of
/// [`Shares::Negative`].
fn narrow([far_share, negative]: [u16; 2], near: &[[u8; 2]], far: &mut [[u8; 2]]) {
    let share = |number: u16, hundredths: u16| (number * hundredths).div_ceil(100);
    for (out, near) in far.iter_mut().zip(near) {
        let [low, high] = turned(*near).map(u16::from);
        let [lowest, highest] = turned(*out).map(u16::from);
        // A negative weight moves the field away from its sample.
        let below = (low - lowest).max(highest - low);
        let above = (highest - high).max(high - lowest);
        let wider = |beyond: u16| share(beyond, far_share) + share(high - low, negative);
        let range = [low.saturating_sub(wider(below)), (high + wider(above)).min(255)];
        *out = turned(range.map(|number| number as u8));
    }
}

/// Returns, for each sample of a volume, the range of the field at the places that are looked up by
/// it. They are nearest to it, or up to a third of a step further away.
pub fn field_ranges(volume: &Volume, kernel: &Kernel) -> Vec<[u8; 2]> {
    if volume.is_label_map() {
        // A lookup may miss the nearest sample by one.
        return neighbourhood_ranges(volume, [1; 3]);
    }
    let reaches_two = volume.lattice.arrangement == Arrangement::Cartesian && kernel.extent > 1.0;
    match Shares::of(kernel).filter(|_| reaches_two && volume.coefficients.is_none()) {
        Some(Shares::Positive(shares)) => weighted_ranges(volume, shares),
        Some(Shares::Negative(shares)) => {
            near_and_far_ranges(volume, |near, far| narrow(shares, near, far))
        }
        None => volume.drawn_ranges(kernel).into_owned(),
    }
}

impl VisibleBlocks {
    /// `dims` is the number of samples along each axis, `ranges` the extremes around each sample.
    /// For each minimum, `first` is the smallest maximum with which something is visible.
    pub fn new(dims: [usize; 3], ranges: &[[u8; 2]], first: &[u16; 256]) -> Self {
        let shows = |[low, high]: [u8; 2]| u16::from(high) >= first[usize::from(low)];
        let blocks = dims.map(|n| n.div_ceil(BLOCK));
        let word = |block: usize| {
            let at =
                [block % blocks[0], block / blocks[0] % blocks[1], block / blocks[0] / blocks[1]];
            let along = |axis: usize| at[axis] * BLOCK..((at[axis] + 1) * BLOCK).min(dims[axis]);
            let mut words = [0; 2];
            for z in along(2) {
                for y in along(1) {
                    let row = &ranges[(z * dims[1] + y) * dims[0]..][along(0)];
                    for (x, range) in row.iter().enumerate() {
                        let (half, bit) = bit_of([x, y, z]);
                        words[half] |= u32::from(shows(*range)) << bit;
                    }
                }
            }
            words
        };
        let words = (0..blocks.iter().product::<usize>()).into_par_iter().map(word).collect();
        Self { dims, coarse: 0, blocks, words }
    }

    /// Returns the bytes of memory.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.words.as_slice()) as u64
    }

    /// Returns for each tile, row by row, the sheets in which something may be visible, as bits.
    pub fn sheets_of_tiles(
        &self,
        lattice: &Lattice,
        view: &View,
        sheets: &Sheets,
    ) -> Vec<Vec<u64>> {
        let tiles = view.size.map(|side| (side as usize).div_ceil(TILE));
        let words = sheets.count().div_ceil(64);
        let [columns, rows, layers] = self.blocks;
        let to_view = DAffine3 {
            matrix3: view.rotation * lattice.axes,
            translation: view.to_view(lattice.origin),
        };
        let slice = |layer: usize| {
            let mut marks = vec![0u64; tiles[0] * tiles[1] * words];
            for block in 0..columns * rows {
                let words = self.words[layer * columns * rows + block];
                let place = [block % columns, block / columns, layer].map(|at| at * BLOCK);
                if self.coarse == 0 {
                    if let Some(span) = Span::of_bits(place, words) {
                        self.mark(&to_view, view, sheets, span, &mut marks);
                    }
                    continue;
                }
                // Cells of many samples: eight cells at a time.
                for (half, word) in words.iter().enumerate() {
                    for quarter in 0..4 {
                        let [x, y] = [quarter % 2 * 2, quarter / 2 * 2];
                        if word >> (x + BLOCK * y) & QUARTER != 0 {
                            let at = [place[0] + x, place[1] + y, place[2] + 2 * half];
                            let [first, end] =
                                [0, 2].map(|by| at.map(|at| (at + by) << self.coarse));
                            self.mark(&to_view, view, sheets, Span { first, end }, &mut marks);
                        }
                    }
                }
            }
            marks
        };
        let join = |mut a: Vec<u64>, b: Vec<u64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            a
        };
        let none = || vec![0u64; tiles[0] * tiles[1] * words];
        let threads = parallel::current_num_threads();
        let all = (0..layers)
            .into_par_iter()
            .with_min_len(layers.div_ceil(threads))
            .fold(none, |sum, layer| join(sum, slice(layer)));
        all.reduce(none, join).chunks(words.max(1)).map(<[u64]>::to_vec).collect()
    }

    /// Marks the tiles and sheets that samples may meet. `to_view` converts steps to view space.
    fn mark(
        &self,
        to_view: &DAffine3,
        view: &View,
        sheets: &Sheets,
        Span { first, end }: Span,
        marks: &mut [u64],
    ) {
        let low = DVec3::from_array(first.map(|n| n as f64 - 0.5));
        let end = |axis: usize| end[axis].min(self.dims[axis]) as f64 - 0.5;
        let high = DVec3::new(end(0), end(1), end(2));
        let (axes, extent) = (to_view.matrix3, 0.5 * (high - low));
        let half = DMat3::from_cols(
            axes.x_axis * extent.x,
            axes.y_axis * extent.y,
            axes.z_axis * extent.z,
        );
        let center = to_view.transform_point3(0.5 * (low + high));
        let reach = half.x_axis.abs() + half.y_axis.abs() + half.z_axis.abs();
        let tiles = view.size.map(|side| side.div_ceil(TILE as u32) as usize);
        let box_around = Bounds { min: center - reach, max: center + reach };
        let (mut first, mut last) = ([0, 0], tiles.map(|n| n - 1));
        // Blocks beside the eye may project anywhere.
        if !view.perspective || box_around.min.z > 1e-6 * reach.max_element() {
            for axis in 0..2 {
                let ends = [box_around.min, box_around.max].map(|v| v[axis]);
                let place = |along: f64, z: f64| {
                    view.center[axis] + view.scale * along / if view.perspective { z } else { 1.0 }
                };
                let depths = [box_around.min.z, box_around.max.z];
                let places = ends.iter().flat_map(|&along| depths.map(|z| place(along, z)));
                let [from, to] = places
                    .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
                let side = TILE as f64;
                if to < 0.0 || from >= f64::from(view.size[axis]) {
                    return;
                }
                first[axis] = (from / side).max(0.0) as usize;
                last[axis] = ((to / side).max(0.0) as usize).min(tiles[axis] - 1);
            }
        } else if box_around.max.z < 0.0 {
            return;
        }
        let (near, far) = if view.perspective {
            // Along the ray through the centre, and aside of it at most as far as a corner.
            let distance = center.length();
            let along = (half.transpose() * (center / distance.max(f64::MIN_POSITIVE))).abs();
            let along = along.element_sum();
            (distance - along, (distance + along).hypot(reach.length()))
        } else {
            (center.z - reach.z, center.z + reach.z)
        };
        let planes = &sheets.planes;
        let from = planes.partition_point(|&plane| plane <= near).saturating_sub(1);
        let to = planes.partition_point(|&plane| plane < far).min(sheets.count());
        let words = sheets.count().div_ceil(64);
        for row in first[1]..=last[1] {
            for column in first[0]..=last[0] {
                let tile = &mut marks[(row * tiles[0] + column) * words..][..words];
                for sheet in from..to {
                    tile[sheet / 64] |= 1 << (sheet % 64);
                }
            }
        }
    }
}

impl Span {
    /// Returns the samples of a block between whose bits all set bits lie, or `None` without any.
    /// `place` is the block's first sample.
    fn of_bits(place: [usize; 3], words: [u32; 2]) -> Option<Self> {
        let bits = u64::from(words[0]) | u64::from(words[1]) << 32;
        if bits == 0 {
            return None;
        }
        let slice = BLOCK * BLOCK;
        // Slices, rows and columns in which bits are set, each as a few bits.
        let slices =
            (0..BLOCK).fold(0, |all, z| all | u32::from(bits >> (z * slice) & 0xffff != 0) << z);
        let layer = [0, 1, 2, 3].map(|z| bits >> (z * slice) & 0xffff);
        let layer = layer[0] | layer[1] | layer[2] | layer[3];
        let rows =
            (0..BLOCK).fold(0, |all, y| all | u32::from(layer >> (y * BLOCK) & 0xf != 0) << y);
        let columns = (layer | layer >> 4 | layer >> 8 | layer >> 12) as u32 & 0xf;
        let along = [columns, rows, slices];
        let first = [0, 1, 2].map(|axis| place[axis] + along[axis].trailing_zeros() as usize);
        let end = [0, 1, 2].map(|axis| place[axis] + along[axis].ilog2() as usize + 1);
        Some(Self { first, end })
    }
}

/// Returns the word of a sample in its block, and its bit in that word.
pub fn bit_of([x, y, z]: [usize; 3]) -> (usize, usize) {
    (z / 2 % 2, (z % 2 * BLOCK + y % BLOCK) * BLOCK + x % BLOCK)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};
    use glam::DVec2;
    use std::collections::HashSet;

    const DIMS: [usize; 3] = [9, 7, 6];

    /// Whether a sample is visible: a few of them, alone and side by side.
    fn shows(at: [usize; 3]) -> bool {
        let [x, y, z] = at;
        (x * 5 + y * 3 + z * 7) % 23 == 0 || [x, y] == [8, 6]
    }

    /// Checks that each sheet of each tile is marked in which a ray is nearest to a visible sample.
    /// Returns how many times as many pairs of a tile and a sheet are marked.
    fn times_marked(camera: &Camera) -> f64 {
        let axes = DMat3::from_cols(
            DVec3::new(1.0, 0.1, 0.0),
            DVec3::new(0.2, 0.8, 0.1),
            DVec3::new(0.0, -0.3, 1.4),
        );
        let lattice = Lattice::cartesian(DIMS, DVec3::new(-4.0, -3.0, -4.0), axes);
        let ranges: Vec<[u8; 2]> = (0..DIMS.iter().product::<usize>())
            .map(|i| [i % DIMS[0], i / DIMS[0] % DIMS[1], i / (DIMS[0] * DIMS[1])])
            .map(|at| [0, if shows(at) { 255 } else { 0 }])
            .collect();
        let visible = VisibleBlocks::new(DIMS, &ranges, &[100; 256]);
        let view = camera.view([40, 33]).unwrap();
        let sheets = Sheets::new(&view, [0.0, 40.0], Some(0.37), None);
        let marks = visible.sheets_of_tiles(&lattice, &view, &sheets);
        let to_steps = lattice.axes.inverse();
        let mut met = HashSet::new();
        for pixel in 0..40 * 33 {
            let [x, y] = [pixel % 40, pixel / 40];
            let (origin, direction) = view.ray(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
            let tile = y / TILE * 40usize.div_ceil(TILE) + x / TILE;
            for (sheet, ends) in sheets.planes.windows(2).enumerate() {
                for part in 0..5 {
                    let distance = ends[0] + (ends[1] - ends[0]) * (f64::from(part) + 0.5) / 5.0;
                    let world =
                        view.position + view.rotation.transpose() * (origin + direction * distance);
                    let nearest = (to_steps * (world - lattice.origin)).round();
                    let at = nearest.to_array().map(|n| n as usize);
                    let is_inside = nearest.cmpge(DVec3::ZERO).all()
                        && at.iter().zip(DIMS).all(|(n, count)| *n < count);
                    if is_inside && shows(at) {
                        let is_marked = marks[tile][sheet / 64] >> (sheet % 64) & 1 != 0;
                        assert!(is_marked, "{x} {y}, sheet {sheet}");
                        met.insert((tile, sheet));
                    }
                }
            }
        }
        let marked: u32 = marks.iter().flatten().map(|word| word.count_ones()).sum();
        f64::from(marked) / met.len() as f64
    }

    #[test]
    fn sheets_that_meet_visible_samples_are_marked() {
        let far = |projection| Camera {
            position: DVec3::new(9.0, 7.0, 14.0),
            focal_point: DVec3::ZERO,
            view_up: DVec3::Y,
            projection,
        };
        let times = [
            times_marked(&far(Projection::Perspective { view_angle: 35.0 })),
            times_marked(&far(Projection::Orthographic { height: 11.0 })),
        ];
        // A ball around each block would mark 6.5 and 5.8 times as many.
        assert!(times.iter().all(|times| *times < 4.2), "{times:?}");
        // From a place among the samples.
        let inside = Camera {
            position: DVec3::new(0.3, -0.2, 0.9),
            focal_point: DVec3::new(3.0, 1.0, -1.0),
            ..far(Projection::Perspective { view_angle: 80.0 })
        };
        times_marked(&inside);
    }

    #[test]
    fn bits_span_their_samples() {
        let place = [8, 4, 12];
        assert!(Span::of_bits(place, [0; 2]).is_none());
        for at in 0..64 {
            for other in 0..64 {
                let cells = [at, other].map(|n| [n % 4, n / 4 % 4, n / 16]);
                let mut words = [0; 2];
                for cell in cells {
                    let (half, bit) = bit_of(cell);
                    words[half] |= 1 << bit;
                }
                let span = Span::of_bits(place, words).unwrap();
                for axis in 0..3 {
                    let [a, b] = cells.map(|cell| cell[axis] + place[axis]);
                    assert_eq!([span.first[axis], span.end[axis]], [a.min(b), a.max(b) + 1]);
                }
            }
        }
    }

    /// Returns the shares of a tensor product at places in steps from a sample, as [`Shares`] has
    /// them.
    fn shares(tensor: Tensor, place: [f64; 3]) -> [f64; 2] {
        let (mut far, mut negative) = (0.0, 0.0);
        for tap in 0..125 {
            let steps: [i32; 3] = [tap % 5 - 2, tap / 5 % 5 - 2, tap / 25 - 2];
            let weight: f64 =
                (0..3).map(|axis| tensor.value(place[axis] - f64::from(steps[axis]))).product();
            if steps.iter().any(|step| step.abs() == 2) {
                far += weight.abs();
            } else {
                negative -= weight.min(0.0);
            }
        }
        [far * 100.0, negative * 100.0]
    }

    #[test]
    fn shares_hold_for_the_places_nearest_to_a_sample() {
        let Shares::Negative(most) = Shares::CATMULL_ROM else { panic!("negative weights") };
        let mut largest = [0.0f64; 2];
        for x in 0..=10 {
            for y in 0..=6 {
                for z in 0..=6 {
                    let place = [x, y, z].map(|step| f64::from(step) / 12.0);
                    let shares = shares(Tensor::CatmullRom, place);
                    largest = [0, 1].map(|i| largest[i].max(shares[i]));
                }
            }
        }
        for (largest, most) in largest.into_iter().zip(most.map(f64::from)) {
            assert!(most - 1.0 < largest && largest <= most, "{largest} {most}");
        }
        // Weights along an axis. At the farthest place, the sample itself has the rest.
        for kernel in [Kernel::default(), Kernel::tensor(Tensor::CubicBSpline)] {
            let Some(Shares::Positive(shares)) = Shares::of(&kernel) else {
                panic!("positive weights")
            };
            let value = |steps: f64| match kernel.as_tensor() {
                Some(tensor) => tensor.value(steps),
                None => kernel.value(steps.abs()),
            };
            let weights = [-1.0, 0.0, 1.0, 2.0].map(|tap| value(tap - FARTHEST));
            let all: f64 = weights.iter().sum();
            let expected = [weights[0] + weights[2], weights[3]].map(|weight| weight / all * 256.0);
            for (share, expected) in [shares.near, shares.far].into_iter().zip(expected) {
                let share = f64::from(share);
                assert!(expected <= share && share < expected + 1.0, "{expected} {share}");
            }
            let weights = [-1.0, 0.0, 1.0, 2.0].map(value);
            let others = 256.0 * (1.0 - weights[1] / weights.iter().sum::<f64>());
            let found = f64::from(shares.others);
            assert!(others - 4.0 < found && found < others - 1.0, "{found} {others}");
        }
    }

    #[test]
    fn bits_are_in_blocks() {
        let (dims, odd) = ([5, 3, 6], |sample: usize| sample * sample % 7 == 2);
        let ranges: Vec<[u8; 2]> =
            (0..90).map(|sample| [0, if odd(sample) { 200 } else { 10 }]).collect();
        let visible = VisibleBlocks::new(dims, &ranges, &[100; 256]);
        assert_eq!(visible.blocks, [2, 1, 2]);
        for (sample, _) in ranges.iter().enumerate() {
            let at = [sample % 5, sample / 5 % 3, sample / 15];
            let block = at[2] / BLOCK * 2 + at[0] / BLOCK;
            let (half, bit) = bit_of(at);
            assert_eq!(visible.words[block][half] >> bit & 1 != 0, odd(sample), "{at:?}");
        }
    }
}

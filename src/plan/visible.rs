//! In which sheets of which tiles a lattice may be visible: projected blocks of visible samples.

use super::{TILE, weighting::deviation};
use crate::{
    math::{Bounds, Kernel, Sheets, View},
    parallel::{self, prelude::*},
    volume::{Lattice, Volume, reach::neighbourhood_ranges},
};
use glam::{DMat3, DVec3};

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

/// A cube of samples: the first one, and the number of samples along each axis.
struct Cube {
    first: [usize; 3],
    side: usize,
}

/// The bits of 2 × 2 × 2 cells in a word.
const QUARTER: u32 = 0x0033_0033;

/// The widest Gaussian, in steps, for which `FAR_WEIGHT` holds.
const WIDEST: f64 = 0.6;

/// The share of a Gaussian's weight that samples two steps from the nearest one have in total. It
/// allows for places up to a third of a step further away. For the usual kernel it is 0.085 at half
/// a step.
const FAR_WEIGHT: f64 = 0.15;

/// Returns, for each sample of a volume, the range of the field at the places nearest to that
/// sample. The samples next to it have nearly all the weight; those two steps away move the field
/// by at most their share.
pub fn field_ranges(volume: &Volume, kernel: &Kernel) -> Vec<[u8; 2]> {
    if volume.is_label_map() {
        // A lookup may miss the nearest sample by one.
        return neighbourhood_ranges(volume, [1; 3]);
    }
    let mut ranges = volume.drawn_ranges(kernel).into_owned();
    if deviation(kernel).is_some_and(|sigma| sigma <= WIDEST) && volume.coefficients.is_none() {
        let near = neighbourhood_ranges(volume, [1; 3]);
        let shares: [u8; 256] =
            std::array::from_fn(|difference| (difference as f64 * FAR_WEIGHT).ceil() as u8);
        let share = |difference: u8| shares[usize::from(difference)];
        ranges.par_iter_mut().zip(near).for_each(|([low, high], [near_low, near_high])| {
            *low = near_low - share(near_low - *low);
            *high = near_high + share(*high - near_high);
        });
    }
    ranges
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
        let slice = |layer: usize| {
            let mut marks = vec![0u64; tiles[0] * tiles[1] * words];
            for block in 0..columns * rows {
                let words = self.words[layer * columns * rows + block];
                let place = [block % columns, block / columns, layer].map(|at| at * BLOCK);
                if self.coarse == 0 {
                    if words != [0; 2] {
                        let block = Cube { first: place, side: BLOCK };
                        self.mark(lattice, view, sheets, &block, &mut marks);
                    }
                    continue;
                }
                // Cells of many samples: eight cells at a time.
                for (half, word) in words.iter().enumerate() {
                    for quarter in 0..4 {
                        let [x, y] = [quarter % 2 * 2, quarter / 2 * 2];
                        if word >> (x + BLOCK * y) & QUARTER != 0 {
                            let at = [place[0] + x, place[1] + y, place[2] + 2 * half];
                            let first = at.map(|at| at << self.coarse);
                            let cells = Cube { first, side: 2 << self.coarse };
                            self.mark(lattice, view, sheets, &cells, &mut marks);
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

    /// Marks the tiles and sheets that a cube of samples may meet.
    fn mark(
        &self,
        lattice: &Lattice,
        view: &View,
        sheets: &Sheets,
        &Cube { first, side }: &Cube,
        marks: &mut [u64],
    ) {
        let low = DVec3::from_array(first.map(|n| n as f64 - 0.5));
        let end = |axis: usize| (first[axis] + side).min(self.dims[axis]) as f64 - 0.5;
        let high = DVec3::new(end(0), end(1), end(2));
        let half = lattice.axes * DMat3::from_diagonal(0.5 * (high - low));
        let center = view.to_view(lattice.position(0.5 * (low + high)));
        let half = view.rotation * half;
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
        let radius = reach.length();
        let distance = if view.perspective { center.length() } else { center.z };
        let (near, far) = (distance - radius, distance + radius);
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

/// Returns the word of a sample in its block, and its bit in that word.
pub fn bit_of([x, y, z]: [usize; 3]) -> (usize, usize) {
    (z / 2 % 2, (z % 2 * BLOCK + y % BLOCK) * BLOCK + x % BLOCK)
}

#[cfg(test)]
mod tests {
    use super::*;

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

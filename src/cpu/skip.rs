//! Which sheets may show something in which tiles: blocks of samples that show something, projected.

use super::{
    field::deviation,
    plan::TILE,
    vector::{Lanes, three},
};
use crate::{
    math::{Bounds, Kernel, Sheets, View},
    volume::{Volume, reach::neighbourhood_ranges},
};
use fearless_simd::{Simd, i32x8, prelude::*};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Samples along each side of a block.
const BLOCK: usize = 4;

/// The samples of a volume around which something shows: for each block of 4 × 4 × 4 samples a word with a bit for each.
#[derive(Debug)]
pub struct Shown {
    dims: [usize; 3],
    blocks: [usize; 3],
    words: Vec<u64>,
}

/// The widest Gaussian, in steps, of which that holds.
const WIDEST: f64 = 0.6;

/// The part of a Gaussian's weight that samples two steps from the nearest one have together, with room for places that lie up
/// to a third of a step beyond it: 0.085 at half a step for the usual kernel.
const FAR_WEIGHT: f64 = 0.15;

/// For each sample of a volume, the range of the field nearer to it than to any other. The samples around it weigh nearly all;
/// those two steps away move the field by their share at most.
pub fn field_ranges(volume: &Volume, kernel: &Kernel) -> Vec<[u8; 2]> {
    let mut ranges = volume.drawn_ranges(kernel).into_owned();
    if deviation(kernel).is_some_and(|sigma| sigma <= WIDEST) && volume.coefficients.is_none() {
        let near = neighbourhood_ranges(volume, [1; 3]);
        ranges.par_iter_mut().zip(near).for_each(|([low, high], [near_low, near_high])| {
            let share = |difference: u8| (f64::from(difference) * FAR_WEIGHT).ceil() as u8;
            *low = near_low - share(near_low - *low);
            *high = near_high + share(*high - near_high);
        });
    }
    ranges
}

impl Shown {
    /// `ranges`: the extremes around each sample; `first`: the least largest one that shows, for each smallest one.
    pub fn new(volume: &Volume, ranges: &[[u8; 2]], first: &[u16; 256]) -> Self {
        let dims = volume.lattice.dims;
        let shows = |[low, high]: [u8; 2]| u16::from(high) >= first[usize::from(low)];
        let blocks = dims.map(|n| n.div_ceil(BLOCK));
        let word = |block: usize| {
            let at = [block % blocks[0], block / blocks[0] % blocks[1], block / blocks[0] / blocks[1]];
            let along = |axis: usize| at[axis] * BLOCK..((at[axis] + 1) * BLOCK).min(dims[axis]);
            let mut word = 0;
            for z in along(2) {
                for y in along(1) {
                    let row = &ranges[(z * dims[1] + y) * dims[0]..][along(0)];
                    for (x, range) in row.iter().enumerate() {
                        word |= u64::from(shows(*range)) << bit_of([x, y, z]);
                    }
                }
            }
            word
        };
        let words = (0..blocks.iter().product::<usize>()).into_par_iter().map(word).collect();
        Self { dims, blocks, words }
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.words.as_slice()) as u64
    }

    /// A bit for each sample in the order of the volume, 32 a word, the first in the lowest bit.
    pub fn bits(&self) -> Vec<u32> {
        let [nx, ny, _] = self.dims;
        let [columns, rows, _] = self.blocks;
        let count = self.dims.iter().product::<usize>();
        let word = |word: usize| {
            let own = (32 * word..count.min(32 * word + 32)).map(|sample| {
                let at = [sample % nx, sample / nx % ny, sample / (nx * ny)];
                let block = (at[2] / BLOCK * rows + at[1] / BLOCK) * columns + at[0] / BLOCK;
                (self.words[block] >> bit_of(at) & 1) as u32
            });
            own.enumerate().fold(0, |word, (place, bit)| word | bit << place)
        };
        (0..count.div_ceil(32)).into_par_iter().map(word).collect()
    }

    /// Where something may show nearer to the sample beside a place than to any other, a bit for each lane; places in steps.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> u64 {
        let [x, y, z]: [i32x8<S>; 3] = three!(I => {
            let last = Lanes::splat(simd, self.dims[I] as f32 - 1.0);
            i32x8::truncate_from((place[I] + 0.5).max(Lanes::splat(simd, 0.0)).min(last))
        });
        let [columns, rows, _] = self.blocks.map(|n| n as i32);
        let block = ((z >> 2) * rows + (y >> 2)) * columns + (x >> 2);
        let bit = ((z & 3) << 4) | ((y & 3) << 2) | (x & 3);
        let (blocks, bits): ([i32; 8], [i32; 8]) = (block.into(), bit.into());
        let mut shows = 0;
        for lane in 0..8 {
            shows |= (self.words[blocks[lane] as usize] >> bits[lane] & 1) << lane;
        }
        shows
    }

    /// For each tile, row by row, the sheets in which it may show something, as bits.
    pub fn sheets_of_tiles(&self, volume: &Volume, view: &View, sheets: &Sheets) -> Vec<Vec<u64>> {
        let tiles = view.size.map(|side| (side as usize).div_ceil(TILE));
        let words = sheets.count().div_ceil(64);
        let [columns, rows, layers] = self.blocks;
        let slice = |layer: usize| {
            let mut own = vec![0u64; tiles[0] * tiles[1] * words];
            for block in 0..columns * rows {
                if self.words[layer * columns * rows + block] != 0 {
                    let at = [block % columns, block / columns, layer];
                    self.mark(volume, view, sheets, at, &mut own);
                }
            }
            own
        };
        let join = |mut a: Vec<u64>, b: Vec<u64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            a
        };
        let none = || vec![0u64; tiles[0] * tiles[1] * words];
        let threads = rayon::current_num_threads();
        let all = (0..layers)
            .into_par_iter()
            .with_min_len(layers.div_ceil(threads))
            .fold(none, |sum, layer| join(sum, slice(layer)));
        all.reduce(none, join).chunks(words.max(1)).map(<[u64]>::to_vec).collect()
    }

    /// Marks the tiles and sheets that a block may lie in.
    fn mark(&self, volume: &Volume, view: &View, sheets: &Sheets, at: [usize; 3], marks: &mut [u64]) {
        let low = DVec3::from_array(at.map(|n| (n * BLOCK) as f64 - 0.5));
        let end = |axis: usize| ((at[axis] + 1) * BLOCK).min(self.dims[axis]) as f64 - 0.5;
        let high = DVec3::new(end(0), end(1), end(2));
        let half = volume.lattice.axes * DMat3::from_diagonal(0.5 * (high - low));
        let center = view.to_view(volume.lattice.position(0.5 * (low + high)));
        let half = view.rotation * half;
        let reach = half.x_axis.abs() + half.y_axis.abs() + half.z_axis.abs();
        let tiles = view.size.map(|side| side.div_ceil(TILE as u32) as usize);
        let box_around = Bounds { min: center - reach, max: center + reach };
        let (mut first, mut last) = ([0, 0], tiles.map(|n| n - 1));
        // Blocks beside the eye may lie anywhere.
        if !view.perspective || box_around.min.z > 1e-6 * reach.max_element() {
            for axis in 0..2 {
                let ends = [box_around.min, box_around.max].map(|v| v[axis]);
                let place = |along: f64, z: f64| {
                    view.center[axis] + view.scale * along / if view.perspective { z } else { 1.0 }
                };
                let depths = [box_around.min.z, box_around.max.z];
                let places = ends.iter().flat_map(|&along| depths.map(|z| place(along, z)));
                let [from, to] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
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
                let own = &mut marks[(row * tiles[0] + column) * words..][..words];
                for sheet in from..to {
                    own[sheet / 64] |= 1 << (sheet % 64);
                }
            }
        }
    }
}

/// The bit of a sample in the word of its block.
fn bit_of([x, y, z]: [usize; 3]) -> usize {
    (z % BLOCK * BLOCK + y % BLOCK) * BLOCK + x % BLOCK
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    #[test]
    fn bits_are_in_the_order_of_the_samples() {
        let (dims, odd) = ([5, 3, 6], |sample: usize| sample * sample % 7 == 2);
        let volume = Volume::new(Lattice::with_spacing(dims, DVec3::ONE), Samples::U8(vec![0; 90])).unwrap();
        let ranges: Vec<[u8; 2]> = (0..90).map(|sample| [0, if odd(sample) { 200 } else { 10 }]).collect();
        let shown = Shown::new(&volume, &ranges, &[100; 256]);
        for (word, bits) in shown.bits().into_iter().enumerate() {
            for bit in 0..32 {
                let sample = 32 * word + bit;
                assert_eq!(bits >> bit & 1 != 0, sample < 90 && odd(sample), "{sample}");
            }
        }
    }
}

//! Which sheets may show something in which tiles: blocks of samples that show something, projected.

use super::plan::TILE;
use crate::{
    math::{Bounds, Sheets, View},
    volume::Volume,
};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Samples along each side of a block.
const BLOCK: usize = 4;

/// The samples of a volume around which something shows, and blocks of them.
#[derive(Debug)]
pub struct Shown {
    dims: [usize; 3],
    /// Whether something may show nearer to this sample than to any other, and how many of these there are.
    pub samples: Vec<bool>,
    pub count: u64,
    blocks: [usize; 3],
    any: Vec<bool>,
}

impl Shown {
    /// `ranges`: the extremes around each sample; `first`: the least largest one that shows, for each smallest one.
    pub fn new(volume: &Volume, ranges: &[[u8; 2]], first: &[u16; 256]) -> Self {
        let dims = volume.lattice.dims;
        let shows = |[low, high]: &[u8; 2]| u16::from(*high) >= first[usize::from(*low)];
        let samples: Vec<bool> = ranges.par_iter().map(shows).collect();
        let blocks = dims.map(|n| n.div_ceil(BLOCK));
        let any = (0..blocks.iter().product::<usize>()).into_par_iter().map(|block| {
            let at = [block % blocks[0], block / blocks[0] % blocks[1], block / blocks[0] / blocks[1]];
            let along = |axis: usize| at[axis] * BLOCK..((at[axis] + 1) * BLOCK).min(dims[axis]);
            along(2).any(|z| along(1).any(|y| samples[(z * dims[1] + y) * dims[0]..][along(0)].contains(&true)))
        });
        let any = any.collect();
        let count = samples.par_iter().filter(|shows| **shows).count() as u64;
        Self { dims, any, samples, count, blocks }
    }

    /// For each tile, row by row, the sheets in which it may show something, as bits.
    pub fn sheets_of_tiles(&self, volume: &Volume, view: &View, sheets: &Sheets) -> Vec<Vec<u64>> {
        let tiles = view.size.map(|side| (side as usize).div_ceil(TILE));
        let words = sheets.count().div_ceil(64);
        let [columns, rows, layers] = self.blocks;
        let slice = |layer: usize| {
            let mut own = vec![0u64; tiles[0] * tiles[1] * words];
            for block in 0..columns * rows {
                if self.any[layer * columns * rows + block] {
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

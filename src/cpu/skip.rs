//! Looking up what is visible: for the lanes of a packet, and for the bricks at hand.

use super::{
    brick_cache::BrickCache,
    vector::{Lanes, three, words},
};
use crate::{
    bricks::{self, BLOCKS, Choice},
    plan::visible::{BLOCK, VisibleBlocks, bit_of},
};
use fearless_simd::{Simd, i32x8, prelude::*, u32x8};

impl VisibleBlocks {
    /// Returns the visible blocks of a level of a volume in bricks, of those that a picture shows.
    pub fn of_bricks(cache: &BrickCache, choice: &Choice, level: usize) -> Self {
        let size = cache.bricks.level(level);
        let coarse = bricks::BLOCK.ilog2();
        let blocks = size.dims.map(|n| n.div_ceil(bricks::BLOCK).div_ceil(BLOCK));
        let mut words = vec![[0; 2]; blocks.iter().product()];
        for &(_, brick) in choice.bricks.iter().filter(|(brick_level, _)| *brick_level == level) {
            let Some(slot) = cache.slot(level, brick) else { continue };
            let first = size.place(brick).map(|at| at * BLOCKS);
            for (number, [low, high]) in cache.blocks(slot).iter().enumerate() {
                if u16::from(*high) < choice.first_visible[usize::from(*low)] {
                    continue;
                }
                let block = [number % BLOCKS, number / BLOCKS % BLOCKS, number / (BLOCKS * BLOCKS)];
                let cell = [0, 1, 2].map(|axis| first[axis] + block[axis]);
                let [x, y, z] = cell.map(|at| at / BLOCK);
                // Blocks entirely outside the border show nothing.
                let Some(words) = words.get_mut((z * blocks[1] + y) * blocks[0] + x) else {
                    continue;
                };
                let (half, bit) = bit_of(cell);
                words[half] |= 1 << bit;
            }
        }
        Self { dims: size.dims, coarse, blocks, words }
    }

    /// Returns where something may be visible at the places nearest to the sample beside a place, a
    /// bit for each lane. Places are in steps.
    #[inline(always)]
    pub fn at<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> u64 {
        let [x, y, z]: [i32x8<S>; 3] = three!(I => {
            let last = Lanes::splat(simd, self.dims[I] as f32 - 1.0);
            i32x8::truncate_from((place[I] + 0.5).max(Lanes::splat(simd, 0.0)).min(last))
                >> self.coarse
        });
        let [columns, rows, _] = self.blocks.map(|n| n as i32);
        let block = ((z >> 2) * rows + (y >> 2)) * columns + (x >> 2);
        let halves: [i32; 8] = ((block << 1) | ((z >> 1) & 1)).into();
        let all = self.words.as_flattened();
        let words = words!(simd, L => all[halves[L] as usize]);
        let bit = ((z & 1) << 4) | ((y & 3) << 2) | (x & 3);
        let shows = (words >> bit.bitcast::<u32x8<S>>()) & 1;
        shows.simd_eq(1).to_bitmask()
    }
}

/// Returns whether `sheet`, counted from 1, is marked in the words of a tile
/// ([`VisibleBlocks::sheets_of_tiles`]).
pub fn is_marked(marks: &[u64], sheet: usize) -> bool {
    let bit = sheet - 1;
    marks.get(bit / 64).is_some_and(|word| word >> (bit % 64) & 1 != 0)
}

//! Blocks of an object: the units that are kept, and the ranges that are asked for.

use std::{collections::BTreeSet, ops::Range};

/// Bytes of a block.
pub const BLOCK: u64 = 64 << 10;

/// Blocks between two wanted ones that are fetched too, instead of asking twice: 1 MiB.
const GAP: u64 = (1 << 20) / BLOCK;

/// Most blocks of one request: 4 MiB, so that a slow line finishes it in time.
const MOST: u64 = (4 << 20) / BLOCK;

/// Returns the blocks that ranges of bytes touch.
pub fn touched(ranges: &[Range<u64>]) -> BTreeSet<u64> {
    let blocks = |range: &Range<u64>| range.start / BLOCK..range.end.div_ceil(BLOCK);
    ranges.iter().filter(|range| !range.is_empty()).flat_map(blocks).collect()
}

/// Returns the bytes of a range of blocks of an object.
pub fn bytes_of(blocks: &Range<u64>, size: u64) -> Range<u64> {
    blocks.start * BLOCK..blocks.end.saturating_mul(BLOCK).min(size)
}

/// Returns the ranges of blocks to ask for, so that all of these are among them.
pub fn joined(blocks: impl IntoIterator<Item = u64>) -> Vec<Range<u64>> {
    let mut ranges: Vec<Range<u64>> = Vec::new();
    for block in blocks {
        match ranges.last_mut() {
            Some(last) if block <= last.end + GAP && block < last.start + MOST => {
                last.end = block + 1;
            }
            _ => ranges.push(block..block + 1),
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_touch_blocks() {
        let touched = |ranges: &[Range<u64>]| touched(ranges).into_iter().collect::<Vec<_>>();
        assert_eq!(touched(&[0..1, BLOCK - 1..BLOCK + 1, 5..5]), [0, 1]);
        assert_eq!(touched(&[3 * BLOCK..4 * BLOCK, 0..BLOCK]), [0, 3]);
        assert_eq!(bytes_of(&(1..3), 2 * BLOCK + 7), BLOCK..2 * BLOCK + 7);
    }

    #[test]
    fn near_blocks_are_one_request() {
        assert_eq!(joined([0, 1, 2]), [Range { start: 0, end: 3 }]);
        // 16 blocks lie between 0 and 17.
        assert_eq!(joined([0, 17]), [Range { start: 0, end: 18 }]);
        assert_eq!(joined([0, 18]), [0..1, 18..19]);
        assert_eq!(joined(0..130), [0..64, 64..128, 128..130]);
        assert!(joined([]).is_empty());
    }
}

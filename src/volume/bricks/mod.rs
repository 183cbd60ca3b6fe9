//! Volumes beyond memory: levels of detail, each cut in bricks of 32³ samples that are read one by one.
//!
//! Level 0 has the samples as they are. Every further level has half as many along each axis, rounded up, each the mean of
//! up to 2×2×2 of the level below, until one brick holds a level. Beside its samples a brick has, for each block of 4³ of
//! them, the range of the values that a kernel there can meet; so what shows nothing under a transfer function is known
//! without looking at samples.
//!
//! [`Bricks`] reads from a volume in memory or from a file (`.splv`, docs/splv.md); [`write`](write()) and
//! [`convert`](convert()) make such files, [`check`](check()) looks for damage, [`choice`](choice()) tells which bricks a
//! picture needs.

mod choice;
mod cut;
mod file;
mod halve;
mod level;
mod pyramid;
mod store;
#[cfg(test)]
mod tests;

pub use choice::{Choice, choice};
pub use cut::Brick;
pub use file::{WriteOptions, check, convert, memory_of, write};
pub use level::Level;
pub use store::{Bricks, Header};

/// Samples of a brick along each axis.
pub const SIDE: usize = 32;

/// Samples of a block along each axis.
pub const BLOCK: usize = 4;

/// Blocks of a brick along each axis, and in all.
pub const BLOCKS: usize = SIDE / BLOCK;
pub const BRICK_BLOCKS: usize = BLOCKS * BLOCKS * BLOCKS;

/// How many samples of its level beyond itself a block's range holds for: kernels that reach further may meet values that
/// it does not tell of.
pub const REACH: usize = 3;

/// The range of no samples: what lies wholly beyond the volume's border. No transfer function shows it.
pub const EMPTY: [u8; 2] = [255, 0];

/// Bytes that a brick takes when it is drawn: its samples and the ranges of its blocks.
pub(crate) fn slot_bytes(bricks: &Bricks) -> u64 {
    (bricks.brick_bytes() + 2 * BRICK_BLOCKS) as u64
}

/// The smaller range that holds two.
fn joined([low, high]: [u8; 2], other: [u8; 2]) -> [u8; 2] {
    [low.min(other[0]), high.max(other[1])]
}

//! Volumes beyond memory: levels of detail, each cut into bricks of 32³ samples that are read one
//! by one.
//!
//! Level 0 holds the original samples. Every further level has half as many along each axis,
//! rounded up, until a level fits in one brick. Each of its samples is the mean of up to 2×2×2
//! samples of the level below.
//!
//! A brick also holds, for each block of 4³ samples, the range of the values that a kernel there
//! can meet. Blocks that show nothing under a transfer function are therefore known without reading
//! samples.
//!
//! [`Bricks`] reads from a volume in memory, from a file (`.splv`, docs/splv.md), or from an image
//! that is stored in levels of its own (OME-Zarr; levels.rs).
//! [`write`](write()) and [`convert`](convert()) make these files, and [`check`](check()) looks for
//! damage. [`choice`](choice()) selects the bricks that a picture needs.

mod choice;
mod cut;
mod file;
mod halve;
mod level;
#[cfg(feature = "zarr")]
mod levels;
mod parts;
mod pyramid;
mod store;
#[cfg(test)]
mod tests;

pub use choice::{Choice, Wish, choice};
pub use cut::Brick;
pub use file::{WriteOptions, check, convert, memory_of, write};
pub use level::Level;
pub use store::{Bricks, Header};

/// Samples of a brick along each axis.
pub const SIDE: usize = 32;

/// Samples of a block along each axis.
pub const BLOCK: usize = 4;

/// Blocks of a brick along each axis.
pub const BLOCKS: usize = SIDE / BLOCK;
/// Blocks of a brick in all.
pub const BRICK_BLOCKS: usize = BLOCKS * BLOCKS * BLOCKS;

/// A block's range covers the samples up to this many samples around the block, in its level. A
/// kernel that reaches further may meet values outside the range.
pub const REACH: usize = 3;

/// The range of an empty set of samples: a block wholly beyond the volume's border. No transfer
/// function shows it.
pub const EMPTY: [u8; 2] = [255, 0];

/// Bytes of a brick that is drawn: its samples and the ranges of its blocks.
pub(crate) fn slot_bytes(bricks: &Bricks) -> u64 {
    (bricks.brick_bytes() + 2 * BRICK_BLOCKS) as u64
}

/// Returns the smallest range that contains both.
fn joined([low, high]: [u8; 2], other: [u8; 2]) -> [u8; 2] {
    [low.min(other[0]), high.max(other[1])]
}

//! The plan of a frame, shared by both engines: its numbers, its tables, and the pace of resting and
//! moving views.

pub(crate) mod gathering;
pub(crate) mod pace;
pub(crate) mod shown;
mod stats;
pub(crate) mod tables;
pub(crate) mod uniforms;
pub(crate) mod weighting;

pub use stats::FrameStats;

/// Pixels along each side of a tile.
pub(crate) const TILE: usize = 8;

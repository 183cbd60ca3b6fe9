//! The plan of a frame, which both engines share: its numbers and tables, the weights and visible
//! parts of a lattice, and the pace of resting and moving views.

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

//! The plan of a frame, which both engines share. It has the numbers of the view, of its fields and
//! of their tables, the weights and visible parts of a lattice, and the pace of resting and moving
//! views. The CPU engine reads the numbers by name, and the GPU engine packs them for its shaders.

pub(crate) mod field;
pub(crate) mod frame;
pub(crate) mod gathering;
pub(crate) mod lamps;
pub(crate) mod pace;
pub(crate) mod source;
mod stats;
pub(crate) mod tables;
pub(crate) mod visible;
pub(crate) mod weighting;

pub use stats::FrameStats;

/// Pixels along each side of a tile.
pub(crate) const TILE: usize = 8;

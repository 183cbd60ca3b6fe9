//! The plan of a frame, shared by both engines: its numbers, its tables, and the pace of resting and
//! moving views.

pub(crate) mod pace;
mod stats;
pub(crate) mod tables;
pub(crate) mod uniforms;

pub use stats::FrameStats;

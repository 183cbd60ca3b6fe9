//! splatkit draws volumes and surfaces as elliptic splats, on a GPU or on the processor.
//!
//! The way of the data: a file → [`input`] (opened, guarded) → [`formats`] (what it says) → [`volume`] / [`scattered`] / [`surface`] (what it means) → splats
//! ([`splat`]) in a [`Scene`](scene::Scene) → a [`Renderer`], which draws with the [`gpu`] on wgpu (one pass, one Rust file, one
//! shader) or with that for processors ([`cpu`]) → a [`Picture`](picture::Picture).

// The scenes of the integration tests, which unit tests share, call the crate by its name.
#[cfg(test)]
extern crate self as splatkit;

pub mod bricks;
pub mod compare;
pub mod container;
pub mod cpu;
pub mod deadline;
pub mod disk;
pub mod error;
pub mod formats;
pub mod gpu;
pub mod hierarchy;
pub mod input;
pub mod math;
pub mod memory;
pub mod picture;
pub(crate) mod plan;
pub mod reference;
mod renderer;
pub mod scattered;
pub mod scene;
pub mod splat;
pub mod surface;
pub mod volume;

pub use deadline::Deadline;
pub use error::{Error, Result};
pub use plan::FrameStats;
pub use renderer::{Device, Renderer};

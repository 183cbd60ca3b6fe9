//! splatkit draws volumes and surfaces as elliptic splats, on a GPU or on the processor.
//!
//! Data flows through these modules:
//!
//! - [`input`] opens a file and guards against damaged ones; [`formats`] decodes it.
//! - [`volume`], [`scattered`] and [`surface`] interpret its content. Meshes, points and scattered
//!   samples become splats ([`splat`]).
//! - A [`Scene`](scene::Scene) holds splats, hierarchies and volumes, and the transfer functions
//!   that show them.
//! - A [`Renderer`] draws the scene into a [`Picture`](picture::Picture), with the GPU engine
//!   ([`gpu`], on wgpu: each pass is one Rust file and one shader) or the CPU engine ([`cpu`]).

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

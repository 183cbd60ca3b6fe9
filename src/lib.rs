//! splatkit draws volumes and surfaces as elliptic splats, on a GPU or on the processor.
//!
//! Data flows through these modules:
//!
//! - [`input`] opens a file and guards against damaged ones; [`formats`] decodes it.
//! - [`volume`], [`scattered`], [`cells`] and [`surface`] interpret its content. Meshes, points and
//!   scattered samples become splats ([`splat`]).
//! - A [`Scene`](scene::Scene) holds splats, hierarchies and volumes, and the transfer functions
//!   that show them.
//! - A [`Renderer`] draws the scene into a [`Picture`](picture::Picture), with the GPU engine
//!   ([`gpu`], on wgpu: each pass is one Rust file and one shader) or the CPU engine ([`cpu`]).
//!
//! # An example
//!
//! A mesh becomes surfels, a volume gets a transfer function, and both are drawn in one picture:
//!
//! ```
//! use glam::DVec3;
//! use splatkit::{
//!     Device, Renderer,
//!     math::{Camera, Kernel},
//!     scene::{Scene, Settings},
//!     surface::{Mesh, SurfelOptions},
//!     volume::{TransferFunction, phantoms::Phantom},
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // `formats::load_volume` and `formats::load_mesh` read files.
//! let volume = Phantom::Specimen.sample_bytes([24; 3])?;
//! let transfer = TransferFunction::automatic(&volume);
//! let surfels = Mesh::sphere(2).surfels(&SurfelOptions::default())?;
//! let scene =
//!     Scene::new().with_volume(volume, Kernel::default(), transfer).with_splats(surfels);
//!
//! // `Device::automatic` takes a GPU if there is one.
//! let mut renderer = Renderer::new(&Device::Cpu, &scene)?;
//! let mut camera = Camera::framing(&scene.bounds(), DVec3::NEG_Z, DVec3::Y, 4.0 / 3.0);
//! camera.azimuth(40.0);
//! let (picture, stats) = renderer.render(&camera, &Settings::new([64, 48]))?;
//! assert!(stats.splats > 0 && picture.color.iter().any(|pixel| pixel[3] > 0.9));
//! // `picture.save` writes PNG or JPEG.
//! # Ok(())
//! # }
//! ```
//!
//! A renderer keeps its scene prepared. The viewpoint and the settings may change from picture to
//! picture, and items come, go and move. A host application with a device of its own encodes frames
//! among its passes ([`Renderer::encode`]).
//!
//! # What is where
//!
//! | task | module |
//! |---|---|
//! | read a file of any kind | [`read`], with options [`session::Reading`] |
//! | read a file of a known kind, or bytes in memory | [`formats`] |
//! | limit what a file may take: memory, points, time | [`input::Limits`] |
//! | work with meshes and volumes | [`surface`], [`volume`] |
//! | work with scattered samples and cells | [`scattered`], [`cells`] |
//! | work with trained 3D Gaussians | [`gaussians`] |
//! | colour them by a named map | [`color`] |
//! | draw data larger than memory | [`hierarchy`], [`bricks`] |
//! | describe a picture and draw it | [`scene`], [`math`], [`Renderer`] |
//! | draw among the passes of a host application | [`Renderer::encode`], [`gpu::Gpu::from_wgpu`] |
//! | move a camera by hand, keep a pace | [`interaction`] |
//! | cut, move, thin and clean scenes | [`edit`] |
//! | compare pictures | [`compare`] |
//! | count values, look under a cursor, cut slices: what windows need | [`interaction`] |
//! | look up what a picture is, exactly | [`mod@reference`] |
//!
//! # Features
//!
//! Cargo features leave out what a program does not need:
//!
//! - `gpu`, and its backends `vulkan`, `metal`, `dx12` and `webgpu`;
//! - the formats `ply`, `obj`, `gltf`, `las`, `e57`, `vtk`, `dicom`, `tiff`, `npz`, `sog` and
//!   `hdf5`;
//! - `files` larger than memory, `pictures` in other files than PNG, `remote` inputs and
//!   `reference`.
//!
//! All are on by default except `webgpu` and `remote`. docs/library.md says what each brings.
//!
//! # Units and frames
//!
//! World coordinates are in the unit of the files, right-handed. Positions are 32-bit and relative
//! to an origin in 64 bits, so that geo-referenced data keep their precision. In view space x is
//! right, y down and z forward. Colours are display colours from 0 to 1 (not linear light). They
//! are mixed and composited as they are.
//!
//! # Errors
//!
//! Functions that may fail return [`Error`]. Its message names the file, the place in it, what was
//! found and what was expected. A few functions know no file or place; they return a message as a
//! string. A damaged or hostile file is an error, never a panic.

// Rooms that all builds share have items for engines and formats that this build may leave out.
// What is unused shows in the build with all default features.
#![cfg_attr(not(feature = "default"), allow(dead_code, unused_imports))]

// The scenes of the integration tests, which unit tests share, call the crate by its name.
#[cfg(test)]
extern crate self as splatkit;

pub mod about;
pub mod bricks;
pub mod cells;
pub mod color;
pub mod compare;
pub(crate) mod container;
pub mod cpu;
pub mod deadline;
// For the project's own front ends.
#[doc(hidden)]
pub mod disk;
pub mod edit;
pub mod error;
pub mod facet;
pub mod formats;
pub mod gaussians;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod hierarchy;
pub mod input;
pub mod interaction;
pub mod math;
// For the project's own front ends.
#[doc(hidden)]
pub mod memory;
pub(crate) mod parallel;
pub mod picture;
pub(crate) mod plan;
pub mod progress;
#[cfg(feature = "reference")]
pub mod reference;
mod renderer;
pub mod scattered;
pub mod scene;
pub mod session;
pub mod splat;
mod stop;
pub mod surface;
pub mod volume;
pub(crate) mod warning;

// What the public functions take and return of these crates, in the versions that they need.
pub use glam;
#[cfg(feature = "gpu")]
pub use wgpu;

pub use container::{Finding, Report, Severity};
pub use deadline::Deadline;
pub use error::{Error, Result};
pub use plan::FrameStats;
#[cfg(feature = "gpu")]
pub use renderer::Frame;
pub use renderer::{Device, ItemId, Renderer};
pub use session::read;
pub use stop::Stop;

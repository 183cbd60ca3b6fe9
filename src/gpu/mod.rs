//! The engine: draws a scene of splats by sheets, on the GPU.
//!
//! A frame runs through these passes, each one Rust file here and one shader of the same name in shaders/:
//!
//! | pass | does |
//! |---|---|
//! | `select` | which samples of a volume the transfer function can show (only when it changes) |
//! | `select_bricks` | the same for a volume in bricks (only when other bricks are drawn, too) |
//! | `cut` | which nodes of a hierarchy stand for it in this view |
//! | `measure` | what each splat meets of the picture, and how much room it will need |
//! | `plan` | cuts the frame into depth passes that fit the buffers |
//! | `cull` | per depth pass: which splats it draws, and which are hidden |
//! | `project` | the records of these |
//! | `clear`, `bin`, `scan` | entries (splat, tile, window of four sheets) into bins |
//! | `large` | the same for splats that meet many bins, each spread over a workgroup |
//! | `tiles` | which tiles have entries |
//! | `order` | sorts each bin, for the same bytes each time |
//! | `march` | per tile: adds up sections, closes sheets, composites front to back |
//! | `resume` | goes on with tiles that march has stopped |
//! | `gather` | the field of a lattice that is not scattered, pixel by pixel |
//! | `occlusion` | which tiles have become opaque |
//!
//! docs/engine.md tells the mathematics.

pub(crate) mod budget;
#[cfg(test)]
mod checks;
pub(crate) mod device;
mod frame;
mod passes;
mod pipeline;
mod renderer;
mod scene;
mod targets;
mod variant;

pub use budget::Budget;
pub use device::{AdapterChoice, Gpu};
pub use renderer::Renderer;
pub use scene::PreparedScene;

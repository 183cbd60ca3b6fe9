//! The GPU engine: draws a scene, sheet by sheet, on wgpu.
//!
//! A frame runs through these passes. Each has a Rust file in `passes` and a shader of the same
//! name in shaders/passes/:
//!
//! | pass | purpose |
//! |---|---|
//! | `select` | which samples of a volume the transfer function can show (only when it changes) |
//! | `select_bricks` | the same for a volume in bricks (also when other bricks are drawn) |
//! | `recolor` | the colours of trained Gaussians that the eye sees (only when the eye moves) |
//! | `cut` | which nodes of a hierarchy are drawn in this view |
//! | `measure` | the tiles and sheets that each splat meets, and the capacity that it needs |
//! | `plan` | divides the frame into depth passes that fit the buffers |
//! | `cull` | per depth pass: which splats it draws, and which are hidden |
//! | `project` | the records of the drawn splats |
//! | `clear`, `bin`, `scan` | sorts entries (splat, tile, window of four sheets) into bins |
//! | `large` | the same for splats that meet many bins, each spread over a workgroup |
//! | `tiles` | which tiles have entries |
//! | `order` | sorts each bin, so that the bytes of the picture are the same every time |
//! | `march` | per tile: adds up sections, closes sheets, composites front to back |
//! | `resume` | continues tiles that march has stopped |
//! | `gather` | the field of a lattice that is not scattered, pixel by pixel |
//! | `occlusion` | which tiles have become opaque |
//! | `present` | writes the finished picture into the textures of a host application |
//!
//! The other modules:
//!
//! | module | purpose |
//! |---|---|
//! | `device` | adapters and their limits, errors of a device, buffers and timestamps |
//! | `pipeline` | shader files, and pipelines with their bindings |
//! | `variant` | which features of the shaders a picture needs, and the constants that say so |
//! | `uniforms` | the plan's numbers, packed as shaders read them |
//! | `scene` | the data of a scene on the GPU |
//! | `lamps` | what keeps light away, on the GPU |
//! | `targets`, `budget` | the buffers of a frame, and the capacity of a depth pass |
//! | `output` | where a host application gets the picture |
//! | `upload` | pictures of the CPU engine, for a host application |
//! | `frame` | the order of the passes |
//! | `outline` | the plan of a frame: detail, bricks, sheets, strips |
//! | `pending` | a picture that is being drawn, batch by batch |
//! | `renderer` | begins pictures, and completes or polls them |
//!
//! docs/engine.md explains the mathematics.

pub(crate) mod budget;
#[cfg(test)]
mod checks;
pub(crate) mod device;
mod frame;
mod lamps;
mod outline;
mod output;
mod passes;
mod pending;
mod pipeline;
mod renderer;
mod scene;
mod targets;
mod uniforms;
mod upload;
mod variant;

pub use budget::Budget;
pub use device::{AdapterChoice, Gpu};
pub use output::{Depth, Output};
pub use pending::PendingFrame;
pub use renderer::{Progress, Renderer};
pub(crate) use scene::Parked;
pub use scene::PreparedScene;
pub(crate) use upload::Upload;

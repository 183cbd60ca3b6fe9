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

mod bin;
mod bricks;
mod clear;
mod cull;
mod cut;
mod fault;
mod frame;
mod gather;
mod gpu;
mod large;
mod march;
mod measure;
mod nodes;
mod occlusion;
mod order;
pub(crate) mod pace;
mod plan;
mod project;
mod renderer;
mod resume;
mod scan;
mod select;
mod shaders;
mod source;
mod stage;
pub(crate) mod tables;
mod tiles;
mod timestamps;
pub(crate) mod uniforms;
mod upload;

pub use frame::Budget;
pub use gpu::{AdapterChoice, Gpu};
pub use renderer::{FrameStats, Renderer};
pub use upload::PreparedScene;

/// An empty buffer; its size is rounded up to what every binding takes.
fn buffer(gpu: &Gpu, label: &str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(16).next_multiple_of(16),
        usage: usage | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A buffer that holds some bytes, padded with zeros to what every binding takes.
fn filled_buffer(gpu: &Gpu, label: &str, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: (bytes.len() as u64).max(16).next_multiple_of(16),
        usage,
        mapped_at_creation: true,
    });
    // Without memory for it there is nothing to fill; the device has told so (see fault.rs).
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.slice(..bytes.len()).copy_from_slice(bytes);
        drop(mapped);
        buffer.unmap();
    }
    buffer
}

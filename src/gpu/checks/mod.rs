//! Checks of the shaders that need no device: every pipeline compiles for every backend, and the
//! structures that Rust and the shaders share are the same on both sides.

mod layouts;
mod pipelines;
mod recipes;
#[path = "../../../tests/scenes/mod.rs"]
mod scenes;
mod variants;

// The shaders are checked by the compiler that wgpu uses.
const _: fn(wgpu::naga::Module) -> naga::Module = std::convert::identity;

//! The viewer for browsers. [`Stage`] holds a scene and draws it piece by piece; `bindings` is what
//! JavaScript calls. The scripts around it are in `js`.

#[cfg(target_arch = "wasm32")]
mod bindings;
mod files;
mod stage;

pub use files::{Files, MOST, Request};
pub use stage::{Frame, Stage, Step};

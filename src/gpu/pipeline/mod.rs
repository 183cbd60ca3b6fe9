//! Compute pipelines: the commands of a frame, the shader files, the bindings, and the state of a
//! frame that shaders update.

pub(crate) mod commands;
pub(crate) mod recipe;
pub(crate) mod shaders;
pub(crate) mod stage;
pub(crate) mod state;

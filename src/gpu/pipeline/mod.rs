//! Compute pipelines: the commands of a frame, the shader files, the constants of a variant that
//! precede them, the bindings, the state of a frame that shaders update, and the prefix sum that
//! several passes share.

pub(crate) mod commands;
pub(crate) mod recipe;
pub(crate) mod scan;
pub(crate) mod shaders;
pub(crate) mod stage;
pub(crate) mod state;
pub(crate) mod variant;

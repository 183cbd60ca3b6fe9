//! How a compute pipeline is made: the shader files, the constants of a variant before them, the
//! bindings, and the prefix sum that several passes share.

pub(crate) mod recipe;
pub(crate) mod scan;
pub(crate) mod shaders;
pub(crate) mod stage;
pub(crate) mod state;
pub(crate) mod variant;

//! The data of a scene on the GPU. `prepared` holds a scene, divided into the chunks of `chunk`,
//! each of which fits a binding. `nodes` and `bricks` cache the pages of hierarchies and the bricks
//! of volumes, `field` holds a gathered lattice, and `select` and `select_bricks` list visible
//! samples.

pub(crate) mod bricks;
pub(crate) mod chunk;
pub(crate) mod field;
pub(crate) mod nodes;
#[allow(clippy::too_many_arguments, reason = "updates take the parts of a frame one by one")]
mod prepared;
#[allow(clippy::too_many_arguments, reason = "updates take the parts of a frame one by one")]
pub(crate) mod select;
#[allow(clippy::too_many_arguments, reason = "updates take the parts of a frame one by one")]
pub(crate) mod select_bricks;

pub use prepared::PreparedScene;

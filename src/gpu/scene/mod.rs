//! The data of a scene on the GPU. `prepared` holds a scene, divided into the chunks of `chunk`,
//! each of which fits a binding. `nodes` caches the pages of hierarchies in the slots of `slots`,
//! and `bricks` the bricks of volumes. `field` holds a gathered lattice, and `select` and
//! `select_bricks` list visible samples. `recolor` gives trained Gaussians their colours, and
//! `images` holds what facets show.

pub(crate) mod bricks;
pub(crate) mod chunk;
pub(crate) mod field;
pub(crate) mod images;
pub(crate) mod nodes;
mod prepared;
pub(crate) mod recolor;
pub(crate) mod select;
pub(crate) mod select_bricks;
pub(crate) mod slots;
pub(crate) mod tables;

pub use prepared::PreparedScene;

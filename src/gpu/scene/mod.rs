//! The data of a scene on the GPU. `prepared` holds a scene, divided into the chunks of `chunk`,
//! each of which fits a binding, and `changes` adds items to it and takes them out. `nodes` caches
//! the pages of hierarchies in the slots of `slots`, and `bricks` the bricks of volumes. `field`
//! holds a gathered lattice, `selection` the visible samples of a scattered one, `harmonics` the
//! colours of trained Gaussians, and `images` what facets show.

pub(crate) mod bricks;
mod changes;
pub(crate) mod chunk;
pub(crate) mod field;
pub(crate) mod harmonics;
pub(crate) mod images;
pub(crate) mod nodes;
pub(crate) mod prepared;
pub(crate) mod selection;
pub(crate) mod slots;
pub(crate) mod tables;

pub(crate) use changes::Parked;
pub use prepared::PreparedScene;

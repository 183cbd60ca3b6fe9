//! Code that several formats share: point clouds, columns of samples, polygons, textures, sample
//! types.

pub(super) mod cloud;
pub(super) mod found;
pub(super) mod gather;
pub(super) mod plain;
pub(super) mod polygon;
pub(super) mod sample_type;
pub(super) mod texture;

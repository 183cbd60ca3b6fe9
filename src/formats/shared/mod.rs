//! Code that several formats share: the choice among arrays, holes, point clouds, columns of
//! samples, polygons, textures, sample types.

pub(super) mod attribute;
pub(super) mod choice;
pub(super) mod cloud;
pub(super) mod found;
pub(super) mod gather;
pub(super) mod holes;
pub(super) mod luminance;
pub(super) mod plain;
pub(super) mod polygon;
pub(super) mod rescale;
pub(super) mod sample_type;
pub(super) mod texture;

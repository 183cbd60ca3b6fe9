//! The passes of a frame. Each has a file here and a shader of the same name in shaders/passes/.
//! `sources` contains what passes over candidates share, and `listing` what those share that list
//! visible samples.

pub(crate) mod bin;
pub(crate) mod clear;
pub(crate) mod cull;
pub(crate) mod cut;
pub(crate) mod gather;
pub(crate) mod large;
pub(crate) mod listing;
pub(crate) mod march;
pub(crate) mod mark;
pub(crate) mod measure;
pub(crate) mod occlusion;
pub(crate) mod order;
pub(crate) mod plan;
pub(crate) mod present;
pub(crate) mod project;
pub(crate) mod recolor;
pub(crate) mod resume;
pub(crate) mod scan;
pub(crate) mod select;
pub(crate) mod select_bricks;
pub(crate) mod sources;
pub(crate) mod tiles;

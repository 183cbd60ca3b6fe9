//! Hierarchies of splats. Each node is one splat that stands for those below it. So a picture needs
//! only as many splats as its pixels can show (Rusinkiewicz & Levoy 2000). The page
//! docs/hierarchy.md explains how a scan becomes a tree, and a tree a picture.

mod build;
mod cluster;
mod colors;
mod cut;
pub mod external;
pub mod file;
mod leaves;
mod levels;
mod measure;
mod merge;
pub(crate) mod needed;
mod node;
mod partition;
mod sphere;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod trained;
mod validate;

pub use build::{BuildOptions, Preset, build_file, check_splats};
pub use cut::{BLEND_BAND, Cut, CutSplats, Detail, SHARE_UNIT};
pub(crate) use cut::{MOST_PIXELS, cone_margin};
#[doc(hidden)]
pub use file::CutSphere;
pub use file::Hierarchy;
pub(crate) use levels::Levels;
pub use node::{Block, MOST_CHILDREN, Node, Tree};
pub use trained::build_gaussians;
pub use validate::validate;

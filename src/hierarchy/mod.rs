//! Hierarchies of splats: each node one splat that stands for those below it, so that a picture takes what its pixels can
//! show and no more (Rusinkiewicz & Levoy 2000). docs/hierarchy.md tells how a scan becomes a tree becomes a picture.

pub mod file;
mod node;
#[cfg(test)]
pub(crate) mod testing;
mod validate;

pub use file::Hierarchy;
pub use node::{Block, MOST_CHILDREN, Node, Tree};
pub use validate::{Finding, Severity, validate};

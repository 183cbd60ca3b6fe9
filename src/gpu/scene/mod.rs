//! A scene on the GPU: every item cut into chunks that fit a binding.

pub(crate) mod bricks;
pub(crate) mod chunk;
pub(crate) mod field;
pub(crate) mod nodes;
mod prepared;
pub(crate) mod select;
pub(crate) mod select_bricks;

pub use prepared::PreparedScene;

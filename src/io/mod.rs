//! Reading files: one module per format, all behind the same guarded opening ([`Source`]) and [`Limits`].
//!
//! [`load`] looks at the name and the first bytes and gives a [`Loaded`]: a mesh (or cloud) or a volume.

mod limits;
mod source;

pub use limits::Limits;
pub use source::Source;

//! Reading files: one module per format, all behind the same guarded opening ([`Source`]) and [`Limits`].
//!
//! [`load_mesh`] looks at the name and the first bytes and gives a mesh or cloud.

pub mod gltf;
pub mod obj;
pub mod ply;

mod limits;
mod load_mesh;
mod positions;
mod source;
#[cfg(test)]
mod test_files;
mod texture;

pub use limits::Limits;
pub use load_mesh::load_mesh;
pub use source::Source;

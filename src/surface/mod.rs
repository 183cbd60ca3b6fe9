//! Surfaces: meshes and clouds, and the elliptic surfels that draw them.

mod mesh;

pub use mesh::{Material, Mesh, Texture};

//! Surfaces: meshes and clouds, and the elliptic surfels that draw them.

mod adjacency;
mod cloud;
mod ellipse;
mod mesh;
mod neighbours;
mod paint;
mod refine;
mod shapes;
mod surfels;
mod weld;

pub use mesh::{Material, Mesh, Texture};
pub use surfels::SurfelOptions;

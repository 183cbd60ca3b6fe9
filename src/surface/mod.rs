//! Surfaces: meshes and clouds, and the elliptic surfels that draw them.

mod adjacency;
mod cloud;
mod ellipse;
mod mesh;
mod orient;
mod paint;
mod piece;
mod refine;
mod shapes;
mod surfels;
mod survey;

pub use mesh::{Material, Mesh, Sensor, Texture};
pub(crate) use orient::Known;
pub(crate) use piece::{MeshPieces, Triangles, cloud_piece};
pub(crate) use surfels::EXTENT;
pub use surfels::SurfelOptions;
pub use survey::Survey;

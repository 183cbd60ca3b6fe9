//! Surfaces: meshes and clouds, and the elliptic surfels that draw them.

mod adjacency;
mod cloud;
mod ellipse;
mod mesh;
mod orient;
mod paint;
mod refine;
mod shapes;
mod surfels;
mod survey;

pub use mesh::{Material, Mesh, Sensor, Texture};
pub use surfels::SurfelOptions;
pub use survey::Survey;

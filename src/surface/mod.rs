//! Surfaces: meshes and point clouds, and the elliptic surfels that draw them.

mod adjacency;
mod cloud;
mod disc;
mod eight;
mod ellipse;
mod facets;
mod fan;
mod fan_rules;
mod lines;
mod machined;
mod mesh;
mod opacity;
mod orient;
mod paint;
mod parts;
mod piece;
mod planar;
mod refine;
mod shapes;
mod smooth;
mod solid;
mod surfels;
mod survey;
mod upright;

pub use crate::facet::Texture;
pub use mesh::{Material, Mesh, Sensor};
pub(crate) use orient::Known;
pub(crate) use paint::color_at;
pub use paint::{Paint, Values};
pub(crate) use parts::Joining;
pub(crate) use piece::{MeshPieces, PiecesClosing, Triangles, cloud_piece};
pub(crate) use smooth::corner_normals;
pub(crate) use solid::{Sides, Told};
pub(crate) use surfels::EXTENT;
pub use surfels::{PointStyle, SurfelOptions};
pub use survey::Survey;

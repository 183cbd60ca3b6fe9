//! What a mesh or cloud file says, whatever its format.

use glam::{DVec3, Vec2, Vec3};
use std::{ops::Range, sync::Arc};

/// A triangle mesh, or a point cloud when it has no triangles.
///
/// Positions are in the file's own unit, relative to `origin` (so that geo-referenced doubles keep their precision in
/// 32 bits). Optional attributes are either empty or as long as `positions`.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    pub origin: DVec3,
    pub positions: Vec<Vec3>,
    /// Unit normals as the file gives them; empty where it gives none. Those that are shorter than half a unit, or not finite,
    /// count as none.
    pub normals: Vec<Vec3>,
    /// Linear copies of the file's display colours, 8 bits a channel: red, green, blue, opacity.
    pub colors: Vec<[u8; 4]>,
    pub uvs: Vec<Vec2>,
    /// Vertex indices, counter-clockwise from outside; polygons are already cut into triangles.
    pub triangles: Vec<[u32; 3]>,
    /// The material of each triangle, an index into `materials`; empty where there are none.
    pub triangle_materials: Vec<u32>,
    pub materials: Vec<Material>,
    /// Where scanners stood, in the order of the points that they saw; empty where the file does not say. Those points
    /// face them.
    pub sensors: Vec<Sensor>,
    /// Whether +Z is up by the custom of the format, as in surveying.
    pub z_is_up: bool,
}

impl Mesh {
    /// Bytes of its arrays; textures are shared and do not count.
    pub(crate) fn bytes(&self) -> u64 {
        let Self { positions, normals, colors, uvs, triangles, triangle_materials, .. } = self;
        let arrays = [
            size_of_val(&positions[..]),
            size_of_val(&normals[..]),
            size_of_val(&colors[..]),
            size_of_val(&uvs[..]),
            size_of_val(&triangles[..]),
            size_of_val(&triangle_materials[..]),
        ];
        arrays.iter().map(|&bytes| bytes as u64).sum()
    }

    /// The unit normal that the file gives at a vertex.
    pub(super) fn given_normal(&self, vertex: usize) -> Option<Vec3> {
        self.normals.get(vertex).copied().and_then(given)
    }
}

/// A unit normal; none where what stands in its place is shorter than half of one, or not finite.
pub(super) fn given(normal: Vec3) -> Option<Vec3> {
    Some(normal).filter(|normal| normal.length_squared() > 0.25)?.try_normalize()
}

/// The place of a scanner.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Relative to the mesh's origin, as the positions.
    pub position: Vec3,
    /// The points that were seen from there.
    pub points: Range<usize>,
}

/// A base colour, and a texture that it multiplies.
#[derive(Debug, Clone)]
pub struct Material {
    pub name: String,
    /// Red, green, blue, opacity in 0 … 1, as displayed (not linear light).
    pub color: [f32; 4],
    pub texture: Option<Arc<Texture>>,
}

/// A decoded picture, rows from the top; `uv` (0, 0) is its top left corner.
#[derive(Debug, Clone)]
pub struct Texture {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<[u8; 4]>,
}

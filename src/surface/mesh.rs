//! The content of a mesh or point cloud file, whatever its format.

use crate::{
    about::{About, Orientation},
    color::ColorScale,
    facet::Texture,
    parallel::prelude::*,
};
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::{ops::Range, sync::Arc};

/// A triangle mesh, lines, or a point cloud if it has neither triangles nor lines.
///
/// Positions are in the file's own unit, relative to `origin`, so that geo-referenced doubles keep
/// their precision in 32 bits. Optional attributes are either empty or as long as `positions`.
///
/// A mesh is drawn as surfels, elliptic discs that overlap without holes:
///
/// ```
/// use glam::Vec3;
/// use splatkit::surface::{Mesh, SurfelOptions};
///
/// let square = Mesh {
///     positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
///     triangles: vec![[0, 1, 2], [0, 2, 3]],
///     ..Mesh::default()
/// };
/// let surfels = square.surfels(&SurfelOptions::default())?;
/// assert!(surfels.splats.len() >= 4);
/// assert!(!square.is_solid() && Mesh::sphere(2).is_solid());
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// World position that the vertices are relative to.
    pub origin: DVec3,
    /// The positions of the vertices, relative to `origin`.
    pub positions: Vec<Vec3>,
    /// Unit normals from the file; empty if it has none. Normals shorter than half a unit, or not
    /// finite, count as missing.
    pub normals: Vec<Vec3>,
    /// Linear copies of the file's display colours, 8 bits per channel: red, green, blue, opacity.
    pub colors: Vec<[u8; 4]>,
    /// Texture coordinates; (0, 0) is the top left corner of the texture.
    pub uvs: Vec<Vec2>,
    /// Vertex indices, counter-clockwise from outside. Polygons are already split into triangles.
    pub triangles: Vec<[u32; 3]>,
    /// The segments of lines, as vertex indices. Lines are drawn as tubes
    /// ([`line_rods`](Self::line_rods)); a mesh without triangles, but with lines, is no point
    /// cloud.
    pub lines: Vec<[u32; 2]>,
    /// The material of each triangle, an index into `materials`; empty if there are none.
    pub triangle_materials: Vec<u32>,
    /// The materials that `triangle_materials` refers to.
    pub materials: Vec<Material>,
    /// Positions of scanners, in the order of the points that they saw; empty if the file has none.
    /// The normals of those points face the scanner.
    pub sensors: Vec<Sensor>,
    /// One value of each vertex, to colour it by; empty if the file has none, or none was asked
    /// for. NaN where a vertex has no value. `about` has the name and the unit.
    pub values: Vec<f32>,
    /// The radius of each point of a cloud, in world units; empty if none was asked for. Points
    /// have the usual radius where this is not finite.
    pub radii: Vec<f32>,
    /// How `values` colour the mesh instead of its own colours; `None` if they do not
    /// ([`paint`](Self::paint)).
    pub scale: Option<ColorScale>,
    /// What the file says beyond this.
    pub about: About,
}

impl Mesh {
    /// Bytes of the arrays. Textures are shared and do not count.
    pub(crate) fn bytes(&self) -> u64 {
        let Self { positions, normals, colors, uvs, triangles, triangle_materials, values, .. } =
            self;
        let arrays = [
            size_of_val(&positions[..]),
            size_of_val(&normals[..]),
            size_of_val(&colors[..]),
            size_of_val(&uvs[..]),
            size_of_val(&triangles[..]),
            size_of_val(&triangle_materials[..]),
            size_of_val(&values[..]),
            size_of_val(&self.radii[..]),
            size_of_val(&self.lines[..]),
        ];
        arrays.iter().map(|&bytes| bytes as u64).sum()
    }

    /// Turns a mesh of a known orientation in the world, so that it has another one.
    pub fn stand(&mut self, wanted: Orientation) {
        if let Some(previous) = self.about.orientation.replace(wanted) {
            self.turn(previous.turn_to(wanted));
        }
    }

    /// Turns the world about its origin. If the matrix mirrors, triangles turn over, so that their
    /// outsides stay outside.
    pub(crate) fn turn(&mut self, turn: DMat3) {
        let matrix = turn.as_mat3();
        self.origin = turn * self.origin + DVec3::ZERO;
        self.positions.par_iter_mut().for_each(|position| *position = matrix * *position);
        self.normals.par_iter_mut().for_each(|normal| *normal = matrix * *normal);
        self.sensors.iter_mut().for_each(|sensor| sensor.position = matrix * sensor.position);
        if turn.determinant() < 0.0 {
            self.triangles.par_iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        }
    }

    /// Returns whether a triangle is drawn in its own colour, without light.
    pub(crate) fn is_unlit(&self, triangle: usize) -> bool {
        let material = self.triangle_materials.get(triangle);
        material.is_some_and(|&material| self.materials[material as usize].unlit)
    }

    /// Returns the unit normal from the file at a vertex, if there is one.
    pub(super) fn given_normal(&self, vertex: usize) -> Option<Vec3> {
        self.normals.get(vertex).copied().and_then(given)
    }
}

/// Normalises a normal from the file. `None` if it is shorter than half a unit or not finite.
pub(super) fn given(normal: Vec3) -> Option<Vec3> {
    Some(normal).filter(|normal| normal.length_squared() > 0.25)?.try_normalize()
}

/// The position of a scanner.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Relative to the mesh's origin, like the positions.
    pub position: Vec3,
    /// The points that were seen from there.
    pub points: Range<usize>,
}

/// A base colour, and a texture that is multiplied with it.
#[derive(Debug, Clone, Default)]
pub struct Material {
    /// The name in the file; may be empty.
    pub name: String,
    /// Red, green, blue, opacity in 0 … 1, as displayed (not linear light).
    pub color: [f32; 4],
    /// The texture; `None` if the base colour is all.
    pub texture: Option<Arc<Texture>>,
    /// Whether the colour is drawn as it is, whatever the light.
    pub unlit: bool,
}

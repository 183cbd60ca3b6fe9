//! From meshes and clouds to elliptic surfels.
//!
//! Large triangles are cut first ([`refine`]). Then every vertex gives one surfel for each smooth group of the triangles
//! around it, in the plane of the group's mean normal, with the smallest ellipse found that is at least as wide as what
//! each of those triangles asks for ([`Tensor::of_triangle`]). So three surfels of its own cover each triangle, and
//! a surface has no holes, whatever its triangles look like.

use super::{
    Mesh,
    adjacency::Adjacency,
    cloud,
    ellipse::{Tensor, factor},
    paint::{corner_color, pack},
    refine::refine,
};
use crate::{
    Error, Result,
    math::weld::first_of_equals,
    splat::{Payload, Splat, SplatSet, encode_normal},
};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// How surfels are made from a mesh or cloud.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfelOptions {
    /// Factor on all radii. Below 1 the surface may show holes.
    pub radius_scale: f32,
    /// Optical depth at the centre of a surfel. Each triangle has at least 0.76 of it everywhere.
    pub optical_depth: f32,
    /// Neighbouring triangles whose normals differ by more meet in a crease; 60 at most.
    pub crease_angle_degrees: f32,
    /// Triangles are cut until no edge is longer than this part of the bounding box's diagonal.
    pub largest_spacing: f32,
    /// About the most triangles that cutting may lead to; spacing grows to keep to it.
    pub most_triangles: usize,
}

impl Default for SurfelOptions {
    fn default() -> Self {
        Self {
            radius_scale: 1.0,
            optical_depth: 8.0,
            crease_angle_degrees: 75.0,
            largest_spacing: 1.0 / 128.0,
            most_triangles: 1 << 23,
        }
    }
}

/// Where footprints end, in standard deviations.
pub(crate) const EXTENT: f32 = 3.0;

/// Vertices of one parallel task.
const CHUNK: usize = 1 << 12;

impl Mesh {
    /// Surfels that cover the triangles without holes, or, where there are none, stand for the points. World units;
    /// centres relative to the mesh's origin; the order depends on the input only.
    ///
    /// Colours are vertex colour × material × texture. A surfel has the file's normal at its vertex, or the
    /// angle-weighted normal of its group of triangles. Triangles without area, and vertices that no triangle uses, give
    /// nothing; nor do points that coincide with another.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`] where nothing is left; [`Error::Argument`] for options that are no positive numbers and
    /// for a mesh whose indices or attributes do not fit its positions.
    pub fn surfels(&self, options: &SurfelOptions) -> Result<SplatSet> {
        let _span = tracing::info_span!("surfels").entered();
        self.check(options)?;
        let splats =
            if self.triangles.is_empty() { cloud::surfels(self, options) } else { of_triangles(self, options) };
        if splats.is_empty() {
            let what = if self.positions.is_empty() { "there are no points" } else { "no triangle has an area" };
            return Err(Error::NothingToDraw(what.into()));
        }
        Ok(SplatSet { origin: self.origin, payload: Payload::Radiance, splats, extent: EXTENT, overlap: 1.0 })
    }

    /// The smallest and the largest world coordinates of the positions; `None` where there are none.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let first = self.positions.first()?;
        let pairs = self.positions.par_iter().map(|&p| (p, p));
        let (low, high) = pairs.reduce(|| (*first, *first), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        Some([self.origin + low.as_dvec3(), self.origin + high.as_dvec3()])
    }

    pub(super) fn check(&self, options: &SurfelOptions) -> Result<()> {
        let values = [
            ("radius_scale", options.radius_scale),
            ("optical_depth", options.optical_depth),
            ("crease_angle_degrees", options.crease_angle_degrees),
            ("largest_spacing", options.largest_spacing),
        ];
        for (name, value) in values {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Argument(format!("{name} is {value}; a positive number is needed")));
            }
        }
        let count = self.positions.len();
        for (name, length, wanted) in [
            ("normals", self.normals.len(), count),
            ("colors", self.colors.len(), count),
            ("uvs", self.uvs.len(), count),
            ("triangle_materials", self.triangle_materials.len(), self.triangles.len()),
        ] {
            if length != 0 && length != wanted {
                return Err(Error::Argument(format!("the mesh has {length} {name} where {wanted} are needed")));
            }
        }
        if u32::try_from(count).is_err() || self.triangles.len() > u32::MAX as usize / 3 {
            return Err(Error::Argument("the mesh has more vertices or corners than 32 bits can name".into()));
        }
        if !self.triangles.par_iter().all(|t| t.iter().all(|&index| (index as usize) < count)) {
            return Err(Error::Argument(format!("a triangle refers beyond the mesh's {count} vertices")));
        }
        if !self.triangle_materials.par_iter().all(|&index| (index as usize) < self.materials.len()) {
            return Err(Error::Argument("a triangle refers to a material that is not there".into()));
        }
        let whole = |t: &super::Texture| !t.texels.is_empty() && t.texels.len() == t.width as usize * t.height as usize;
        if !self.materials.iter().filter_map(|material| material.texture.as_deref()).all(whole) {
            return Err(Error::Argument("a texture's size is not that of its texels".into()));
        }
        if !self.positions.par_iter().all(|p| p.is_finite()) {
            return Err(Error::Argument("a position of the mesh is not finite".into()));
        }
        Ok(())
    }
}

fn of_triangles(mesh: &Mesh, options: &SurfelOptions) -> Vec<Splat> {
    let Some([low, high]) = mesh.bounds() else { return Vec::new() };
    let diagonal = (high - low).length() as f32;
    let has_seams = !mesh.uvs.is_empty() || mesh.materials.len() > 1;
    let is_split = mesh.normals.is_empty() && may_be_split(has_seams, mesh.positions.len(), mesh.triangles.len());
    let fine = refine(mesh, diagonal * options.largest_spacing, options.most_triangles);
    of_vertices(&fine, is_split, options, |_| true)
}

/// Files split vertices at seams of texture and material, or give every triangle its own. A seam must not show, so
/// vertices at one place are one; but not where the file has normals, which may be split to be seen.
pub(super) fn may_be_split(has_seams: bool, vertices: usize, triangles: usize) -> bool {
    has_seams || vertices > triangles / 4 * 3
}

/// The surfels of those vertices of a refined mesh that are wanted.
pub(super) fn of_vertices(
    mesh: &Mesh,
    is_split: bool,
    options: &SurfelOptions,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Vec<Splat> {
    let keep: Vec<bool> = mesh.triangles.par_iter().map(|&triangle| has_area(mesh, triangle)).collect();
    let adjacency = if is_split {
        let first = first_of_equals(&mesh.positions);
        let triangles: Vec<[u32; 3]> = mesh.triangles.par_iter().map(|t| t.map(|i| first[i as usize])).collect();
        Adjacency::new(&triangles, mesh.positions.len(), &keep)
    } else {
        Adjacency::new(&mesh.triangles, mesh.positions.len(), &keep)
    };
    let maker = Maker {
        mesh,
        adjacency: &adjacency,
        options,
        crease: f64::from(options.crease_angle_degrees.min(60.0)).to_radians().cos(),
    };
    let parts: Vec<Vec<Splat>> = (0..mesh.positions.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut splats = Vec::with_capacity(CHUNK);
            let mut around = Vec::new();
            let mut seeds = Vec::new();
            let vertices = chunk * CHUNK..((chunk + 1) * CHUNK).min(mesh.positions.len());
            for vertex in vertices.filter(|&vertex| is_wanted(vertex)) {
                maker.vertex(vertex, &mut around, &mut seeds, &mut splats);
            }
            splats
        })
        .collect();
    parts.concat()
}

fn corner(mesh: &Mesh, index: u32) -> DVec3 {
    mesh.positions[index as usize].as_dvec3()
}

/// Whether a triangle is more than a line, at the precision of its coordinates.
pub(super) fn has_area(mesh: &Mesh, [a, b, c]: [u32; 3]) -> bool {
    let [a, b, c] = [a, b, c].map(|index| corner(mesh, index));
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() > longest * 1e-10
}

/// A triangle as one of its vertices sees it.
struct Around {
    triangle: usize,
    /// Which of its corners the vertex is.
    corner: usize,
    /// Unit normal.
    normal: DVec3,
    area: f64,
    /// At this vertex.
    angle: f64,
    edges: [DVec3; 3],
    group: usize,
}

struct Maker<'a> {
    mesh: &'a Mesh,
    adjacency: &'a Adjacency,
    options: &'a SurfelOptions,
    /// Cosine of the crease angle.
    crease: f64,
}

impl Maker<'_> {
    /// Adds the surfels of a vertex. `around` and `seeds` are room to work in.
    fn vertex(&self, vertex: usize, around: &mut Vec<Around>, seeds: &mut Vec<DVec3>, splats: &mut Vec<Splat>) {
        around.clear();
        seeds.clear();
        for &at in self.adjacency.corners(vertex) {
            let mut triangle = self.around(at);
            // A group is a cone around its first normal, so that no surfel is far from the plane of a triangle it has to
            // cover, even where many small steps add up to a large turn. There are never more than a few groups.
            let nearest = seeds
                .iter()
                .enumerate()
                .map(|(group, seed): (usize, &DVec3)| (group, seed.dot(triangle.normal)))
                .filter(|&(_, cosine)| cosine >= self.crease)
                .max_by(|a, b| a.1.total_cmp(&b.1));
            triangle.group = nearest.map_or(seeds.len(), |(group, _)| group);
            if nearest.is_none() {
                seeds.push(triangle.normal);
            }
            around.push(triangle);
        }
        for (group, &seed) in seeds.iter().enumerate() {
            splats.push(self.surfel(vertex, seed, || around.iter().filter(|t| t.group == group)));
        }
    }

    fn around(&self, at: u32) -> Around {
        let triangle = at as usize / 3;
        let indices = self.mesh.triangles[triangle];
        let [a, b, c] = [0, 1, 2].map(|i| corner(self.mesh, indices[(at as usize + i) % 3]));
        let edges = [b - a, c - b, a - c];
        let cross = edges[0].cross(-edges[2]);
        let double_area = cross.length();
        Around {
            triangle,
            corner: at as usize % 3,
            normal: cross / double_area,
            area: double_area * 0.5,
            angle: double_area.atan2(edges[0].dot(-edges[2])),
            edges,
            group: 0,
        }
    }

    fn surfel<'t, I>(&self, vertex: usize, seed: DVec3, group: impl Fn() -> I) -> Splat
    where
        I: Iterator<Item = &'t Around>,
    {
        let sum: DVec3 = group().map(|t| t.normal * t.angle).sum();
        let normal = sum.try_normalize().unwrap_or(seed);
        let (x, y) = normal.any_orthonormal_pair();
        let mut tensor: Option<Tensor> = None;
        let mut color = [0.0; 4];
        let mut area = 0.0;
        for triangle in group() {
            // Seen along the triangle's normal the surfel must be wide enough, so the edges are laid on the surfel's
            // plane in that direction.
            let slope = normal.dot(triangle.normal).max(0.25);
            let edges = triangle.edges.map(|edge| {
                let laid = edge - triangle.normal * (normal.dot(edge) / slope);
                DVec2::new(laid.dot(x), laid.dot(y))
            });
            let asked = Tensor::of_triangle(edges);
            tensor = Some(tensor.map_or(asked, |tensor| tensor.join(asked)));
            let own = corner_color(self.mesh, triangle.triangle, triangle.corner);
            color.iter_mut().zip(own).for_each(|(sum, own)| *sum += own * triangle.area as f32);
            area += triangle.area as f32;
        }
        let scale = f64::from(self.options.radius_scale).powi(2);
        let Tensor { xx, xy, yy } = tensor.unwrap_or(Tensor::disc(0.0));
        let tensor = Tensor { xx: xx * scale, xy: xy * scale, yy: yy * scale };
        let given = self.mesh.normals.get(vertex).filter(|normal| normal.length_squared() > 0.25);
        Splat {
            center: self.mesh.positions[vertex].to_array(),
            strength: self.options.optical_depth,
            factor: factor(tensor, x, y, normal),
            color: pack(color.map(|sum| sum / area)),
            normal: encode_normal(given.copied().unwrap_or(normal.as_vec3())),
        }
    }
}

#[cfg(test)]
mod tests;

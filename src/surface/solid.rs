//! Decides whether a mesh is solid. Then its back is never visible from outside, and faces that
//! point away need not be drawn.
//!
//! A closed surface is not enough. A translucent front reveals the back, and if the normals of a
//! part point inward, its front faces away. The sign of the enclosed volume determines which side
//! of a part is outside.

use super::{Material, Mesh, fan::Sums, mesh::given, parts::Joining, survey::Closing};
use crate::{memory, parallel::prelude::*, warning};
use glam::Vec3;

/// The tolerated fraction of a part's area with normals on the wrong side. Also the tolerated
/// fraction of the whole area in parts without volume. Scans have folds of a few triangles.
const FOLDS: f64 = 1e-3;
/// A given normal is on the other side of a triangle if its cosine with the triangle's normal is
/// below the negative of this. On slanted triangles it may be slightly beyond.
const BEYOND: f32 = 0.25;

/// Evidence on a connected part: where its outside is, and where its normals point. Areas are
/// counted once per corner.
#[derive(Debug, Default, Clone, Copy)]
struct Part {
    sums: Sums,
    /// Area where given normals agree with the winding of the triangle, and where they oppose it.
    along: f64,
    against: f64,
}

impl Part {
    /// Adds a triangle, with the normals that are given at its corners.
    fn add(&mut self, corners: [Vec3; 3], normals: [Option<Vec3>; 3]) {
        let cross = self.sums.add_triangle(corners);
        if normals == [None; 3] {
            return;
        }
        let area = cross.length();
        let across = (cross / area).as_vec3();
        for normal in normals.into_iter().flatten() {
            let cosine = normal.dot(across);
            self.along += if cosine > BEYOND { area } else { 0.0 };
            self.against += if cosine < -BEYOND { area } else { 0.0 };
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            sums: self.sums.with(other.sums),
            along: self.along + other.along,
            against: self.against + other.against,
        }
    }
}

/// The evidence of some triangles on their parts.
#[derive(Debug, Default)]
pub(crate) struct Evidence {
    /// One entry for each sequence of consecutive triangles of the same part.
    runs: Vec<(u32, Part)>,
    is_translucent: bool,
    /// Whether a corner has no given normal.
    lacks_normals: bool,
}

impl Evidence {
    /// Adds a triangle of a part. Normals of zero length count as missing.
    pub fn add(&mut self, part: u32, corners: [Vec3; 3], normals: [Vec3; 3], is_opaque: bool) {
        self.is_translucent |= !is_opaque;
        let normals = normals.map(given);
        self.lacks_normals |= normals.contains(&None);
        match self.runs.last_mut() {
            Some((last, run)) if *last == part => run.add(corners, normals),
            _ => {
                let mut run = Part::default();
                run.add(corners, normals);
                self.runs.push((part, run));
            }
        }
    }
}

/// The parts of a mesh, with the evidence of their triangles.
#[derive(Debug)]
pub(crate) struct Sides {
    parts: Vec<Part>,
    is_translucent: bool,
    lacks_normals: bool,
}

impl Sides {
    /// Bytes for this many parts.
    pub fn memory(parts: usize) -> u64 {
        (parts * size_of::<Part>()) as u64
    }

    /// Starts this many parts without any evidence.
    pub fn new(parts: usize) -> Self {
        Self { parts: vec![Part::default(); parts], is_translucent: false, lacks_normals: false }
    }

    pub fn add(&mut self, evidence: Evidence) {
        self.is_translucent |= evidence.is_translucent;
        self.lacks_normals |= evidence.lacks_normals;
        for (part, run) in evidence.runs {
            let part = &mut self.parts[part as usize];
            *part = part.with(run);
        }
    }

    /// Returns whether everything that was added is opaque and shows its front to the outside. A
    /// part with a cavity shows its back: the cavity cannot be told from a separate part that is
    /// inside out.
    pub fn are_solid(&self) -> bool {
        // Computed normals are turned outward for the mesh as a whole.
        let all = self.parts.iter().fold(Sums::default(), |sums, part| sums.with(part.sums));
        let turned = if all.side(1.0) < 0 { -1 } else { 1 };
        // A part without volume has no side.
        let (flat, parts): (Vec<&Part>, Vec<&Part>) =
            self.parts.iter().partition(|part| part.sums.side_of_closed() == 0);
        !self.is_translucent
            && flat.iter().map(|part| part.sums.area()).sum::<f64>() <= FOLDS * all.area()
            && parts.iter().all(|part| {
                let side = part.sums.side_of_closed();
                let wrong = if side < 0 { part.along } else { part.against };
                wrong <= FOLDS * part.sums.area() && !(self.lacks_normals && side * turned < 0)
            })
    }
}

/// Triangles of one parallel task, and tasks whose results are held before they are added.
const CHUNK: usize = 1 << 14;
const TOGETHER: usize = 64;

/// Values for vertices for which the mesh has no normal or colour.
const NO_DIRECTION: Vec3 = Vec3::ZERO;
const OPAQUE: u8 = 255;

impl Mesh {
    /// Returns whether only the front is visible from outside, as
    /// [`Tree::closed`](crate::hierarchy::Tree::closed) promises. The mesh must be
    /// [closed](Self::is_closed) and opaque everywhere, and the normals of its surfels must point
    /// out of every connected part. A part with a cavity, or without volume, makes the result
    /// false. Parts that share an edge count as one.
    pub fn is_solid(&self) -> bool {
        let Some(closing) = self.closing() else { return false };
        if !self.has_opaque_materials() || u32::try_from(self.triangles.len()).is_err() {
            return false;
        }
        // The part of each triangle, and the unmatched edges. If they do not fit in memory, backs
        // are drawn too, which is always correct.
        if memory::room("joining the parts of a mesh", 40 * self.triangles.len() as u64).is_err() {
            warning::give!(
                "too little memory to tell whether all parts are turned outward: \
                 backs will be drawn"
            );
            return false;
        }
        let name = |vertex: u32| match &closing {
            Closing::Vertices => vertex,
            Closing::Places(first) => first[vertex as usize],
        };
        let chunks: Vec<(usize, &[[u32; 3]])> = self.triangles.chunks(CHUNK).enumerate().collect();
        let joining = Joining::new(self.triangles.len());
        let open = chunks.par_iter().flat_map_iter(|(chunk, triangles)| {
            joining.add((chunk * CHUNK) as u32, triangles, name)
        });
        let open = open.collect();
        let parts = joining.parts(open);
        let gather = |(chunk, triangles): (usize, &[[u32; 3]])| {
            let mut evidence = Evidence::default();
            for (number, triangle) in (chunk * CHUNK..).zip(triangles) {
                let at = triangle.map(|vertex| vertex as usize);
                let normals =
                    at.map(|vertex| self.normals.get(vertex).copied().unwrap_or(NO_DIRECTION));
                let is_opaque = at.iter().all(|&vertex| {
                    self.colors.get(vertex).map_or(OPAQUE, |color| color[3]) == OPAQUE
                });
                evidence.add(
                    parts.of(number),
                    at.map(|vertex| self.positions[vertex]),
                    normals,
                    is_opaque,
                );
            }
            evidence
        };
        let mut sides = Sides::new(parts.count());
        for few in chunks.chunks(TOGETHER) {
            let all: Vec<Evidence> = few.par_iter().copied().map(gather).collect();
            all.into_iter().for_each(|evidence| sides.add(evidence));
        }
        sides.are_solid()
    }

    /// Returns whether all materials that triangles use are opaque.
    pub(super) fn has_opaque_materials(&self) -> bool {
        self.used_materials().all(|material| {
            let is_opaque = |texel: &[u8; 4]| texel[3] == 255;
            let texture = material.texture.as_deref();
            material.color[3] >= 1.0
                && texture.is_none_or(|texture| texture.texels.par_iter().all(is_opaque))
        })
    }

    /// Whether all materials that triangles use are opaque, apart from their textures.
    pub(super) fn has_opaque_tints(&self) -> bool {
        self.used_materials().all(|material| material.color[3] >= 1.0)
    }

    /// Returns the materials that triangles use.
    fn used_materials(&self) -> impl Iterator<Item = &Material> {
        let mut is_used = vec![false; self.materials.len()];
        for &material in &self.triangle_materials {
            if let Some(used) = is_used.get_mut(material as usize) {
                *used = true;
            }
        }
        let used = self.materials.iter().zip(is_used).filter(|(_, used)| *used);
        used.map(|(material, _)| material)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Texture;
    use glam::Vec2;
    use std::sync::Arc;

    fn sphere(center: f32) -> Mesh {
        let mut mesh = Mesh::sphere(2);
        mesh.normals.clear();
        mesh.positions.iter_mut().for_each(|place| place.x += center);
        mesh
    }

    fn both(mut one: Mesh, other: Mesh) -> Mesh {
        let first = one.positions.len() as u32;
        one.positions.extend(other.positions);
        one.normals.extend(other.normals);
        one.triangles
            .extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        one
    }

    fn turned(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        mesh
    }

    /// Gives every triangle its own vertices.
    fn split(mesh: &Mesh) -> Mesh {
        let corners = mesh.triangles.iter().flatten();
        Mesh {
            positions: corners.map(|&corner| mesh.positions[corner as usize]).collect(),
            triangles: (0..mesh.triangles.len() as u32)
                .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
                .collect(),
            ..Mesh::default()
        }
    }

    /// Sets the normals of a sphere around a centre, or their opposites.
    fn with_normals(mut mesh: Mesh, center: f32, sign: f32) -> Mesh {
        mesh.normals = mesh
            .positions
            .iter()
            .map(|place| (place - Vec3::X * center).normalize() * sign)
            .collect();
        mesh
    }

    #[test]
    fn a_closed_opaque_surface_that_faces_outward_is_solid() {
        assert!(sphere(0.0).is_solid() && turned(sphere(0.0)).is_solid());
        assert!(both(sphere(0.0), sphere(5.0)).is_solid());
        assert!(both(turned(sphere(0.0)), turned(sphere(5.0))).is_solid());
        let mut open = sphere(0.0);
        open.triangles.pop();
        assert!(!open.is_solid());
    }

    #[test]
    fn a_part_that_is_inside_out_is_not_solid() {
        assert!(!both(sphere(0.0), turned(sphere(5.0))).is_solid());
        assert!(!both(turned(sphere(5.0)), sphere(0.0)).is_solid());
        // Also if every triangle has its own vertices.
        let split = split(&both(sphere(0.0), turned(sphere(5.0))));
        assert!(split.is_closed() && !split.is_solid());
    }

    /// Places one mesh beside the other so that they share a vertex: the farthest along x of `one`,
    /// and of `other` against x.
    fn hanging(one: Mesh, mut other: Mesh) -> Mesh {
        let farthest = |mesh: &Mesh, sign: f32| {
            let along = |vertex: &u32| mesh.positions[*vertex as usize].x * sign;
            (0..mesh.positions.len() as u32)
                .max_by(|a, b| along(a).total_cmp(&along(b)))
                .expect("a vertex")
        };
        let (shared, hung, count) =
            (farthest(&one, 1.0), farthest(&other, -1.0), one.positions.len() as u32);
        let shift = one.positions[shared as usize] - other.positions[hung as usize];
        other.positions.iter_mut().for_each(|place| *place += shift);
        let mut both = both(one, other);
        let join = |vertex: u32| if vertex == count + hung { shared } else { vertex };
        both.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(join));
        both
    }

    /// If they were one part, the larger would hide that the smaller is inside out.
    #[test]
    fn parts_that_share_a_vertex_are_told_apart() {
        let small = || Mesh {
            positions: sphere(0.0).positions.iter().map(|p| *p * 0.5).collect(),
            ..sphere(0.0)
        };
        assert!(hanging(sphere(0.0), small()).is_solid());
        let hidden = hanging(sphere(0.0), turned(small()));
        assert!(hidden.is_closed() && !hidden.is_solid());
        assert!(!split(&hidden).is_solid() && split(&hanging(sphere(0.0), small())).is_solid());
    }

    #[test]
    fn thin_parts_count() {
        let flat = |mesh: Mesh| Mesh {
            positions: mesh.positions.iter().map(|p| *p * Vec3::new(1.0, 1.0, 1e-4)).collect(),
            ..mesh
        };
        assert!(flat(sphere(0.0)).is_solid());
        assert!(!both(sphere(5.0), turned(flat(sphere(0.0)))).is_solid());
        assert!(
            !both(
                sphere(5.0),
                Mesh {
                    positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                    triangles: vec![[0, 1, 2], [0, 2, 1]],
                    ..Mesh::default()
                }
            )
            .is_solid()
        );
    }

    /// Two small triangles back to back, as scanners produce them, do not make a scan open. Large
    /// ones do.
    #[test]
    fn small_flaps_do_not_count() {
        let with_flap = |size: f32| {
            let mut mesh = sphere(0.0);
            let first = mesh.positions.len() as u32;
            let at = mesh.positions[0];
            mesh.positions.extend([at + size * Vec3::X, at + size * Vec3::Y]);
            mesh.triangles.extend([[0, first, first + 1], [0, first + 1, first]]);
            mesh
        };
        assert!(with_flap(0.01).is_solid() && !with_flap(1.0).is_solid());
    }

    #[test]
    fn given_normals_count() {
        assert!(with_normals(sphere(0.0), 0.0, 1.0).is_solid());
        assert!(!with_normals(sphere(0.0), 0.0, -1.0).is_solid());
        // The winding of triangles does not matter then.
        let other = with_normals(turned(sphere(5.0)), 5.0, 1.0);
        assert!(both(with_normals(sphere(0.0), 0.0, 1.0), other.clone()).is_solid());
        let mut some = both(with_normals(sphere(0.0), 0.0, 1.0), other);
        some.normals[3] = Vec3::ZERO;
        assert!(!some.is_solid());
    }

    #[test]
    fn what_lets_light_through_is_not_solid() {
        let mut mesh = sphere(0.0);
        mesh.colors = vec![[9, 9, 9, 255]; mesh.positions.len()];
        assert!(mesh.is_solid());
        mesh.colors[7][3] = 254;
        assert!(!mesh.is_solid());
        let mut mesh = sphere(0.0);
        mesh.triangle_materials = vec![0; mesh.triangles.len()];
        mesh.uvs = vec![Vec2::ZERO; mesh.positions.len()];
        let texture =
            |alpha| Some(Arc::new(Texture { width: 1, height: 1, texels: vec![[9, 9, 9, alpha]] }));
        let material = |opacity, alpha| Material {
            color: [1.0, 1.0, 1.0, opacity],
            texture: texture(alpha),
            ..Material::default()
        };
        // The second material is not used.
        for (opacity, alpha, is_solid) in [(1.0, 255, true), (0.9, 255, false), (1.0, 99, false)] {
            mesh.materials = vec![material(opacity, alpha), material(0.0, 0)];
            assert_eq!(mesh.is_solid(), is_solid, "{opacity} {alpha}");
        }
    }
}

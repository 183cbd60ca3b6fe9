//! Whether a mesh is solid: then nobody outside can see the back of it, and what faces away need not be drawn.
//!
//! A closed surface alone is not enough. Through a translucent front its back is seen; and where the normals of a part point
//! into it, what faces away is its front. Which side of a part is out is told by the sign of the volume within.

use super::{Mesh, fan::Sums, survey::Closing};
use glam::Vec3;
use rayon::prelude::*;
use std::{
    collections::HashMap,
    sync::atomic::{AtomicU32, Ordering::Relaxed},
};

/// The connected parts of a mesh. Vertices are joined by any number of threads at once: each links to itself, or to one of a
/// smaller index, and a link is only taken by whoever finds a root there still (Anderson & Woll 1991).
pub(crate) struct Parts(Vec<AtomicU32>);

impl Parts {
    /// Each vertex is a part of its own.
    pub fn new(vertices: u32) -> Self {
        Self((0..vertices).into_par_iter().map(AtomicU32::new).collect())
    }

    /// The vertex of the smallest index in the part of this one, once all are joined.
    pub fn of(&self, mut vertex: u32) -> u32 {
        loop {
            let above = self.0[vertex as usize].load(Relaxed);
            if above == vertex {
                return vertex;
            }
            let higher = self.0[above as usize].load(Relaxed);
            if higher < above {
                // Halves the way for the next time. It does no harm where another thread has done so.
                self.0[vertex as usize].store(higher, Relaxed);
            }
            vertex = higher;
        }
    }

    pub fn join(&self, [a, b, c]: [u32; 3]) {
        self.join_two(a, b);
        self.join_two(b, c);
    }

    fn join_two(&self, mut a: u32, mut b: u32) {
        loop {
            (a, b) = (self.of(a), self.of(b));
            if a == b {
                return;
            }
            let (low, high) = (a.min(b), a.max(b));
            if self.0[high as usize].compare_exchange(high, low, Relaxed, Relaxed).is_ok() {
                return;
            }
        }
    }
}

/// Of the area of a part: so little of it may have normals on the wrong side. Scans have folds of a few triangles.
const FOLDS: f64 = 1e-3;
/// A given normal is on the other side of a triangle where its cosine with the triangle's is below the negative of this:
/// at slanting ones it may be a little beyond.
const BEYOND: f32 = 0.25;

/// What tells of a connected part where its outside is, and where its normals point. Areas of corners.
#[derive(Debug, Default, Clone, Copy)]
struct Part {
    sums: Sums,
    /// Where given normals point to the side that the triangle runs counter-clockwise on, or to the other one.
    along: f64,
    against: f64,
}

impl Part {
    /// Adds a triangle, with those normals that are given at its corners.
    fn add(&mut self, corners: [Vec3; 3], normals: [Option<Vec3>; 3]) {
        self.sums.add_triangle(corners, 1.0);
        if normals == [None; 3] {
            return;
        }
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let cross = (b - a).cross(c - a) * 0.5;
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

/// The normal that a surfel takes from its vertex.
fn given(normal: Vec3) -> Option<Vec3> {
    Some(normal).filter(|normal| normal.length_squared() > 0.25)?.try_normalize()
}

/// The parts of a mesh, as its triangles tell of them. Two halves add up.
#[derive(Debug, Default)]
pub(crate) struct Sides {
    parts: HashMap<u32, Part>,
    /// The part of the triangles that came last.
    last: (u32, Part),
    is_translucent: bool,
    /// Whether a corner has no normal of its own.
    lacks_normals: bool,
}

impl Sides {
    /// Adds a triangle of a part; normals of no length are none.
    pub fn add(&mut self, part: u32, corners: [Vec3; 3], normals: [Vec3; 3], is_opaque: bool) {
        self.is_translucent |= !is_opaque;
        let normals = normals.map(given);
        self.lacks_normals |= normals.contains(&None);
        if part != self.last.0 {
            self.put_last();
            self.last.0 = part;
        }
        self.last.1.add(corners, normals);
    }

    fn put_last(&mut self) {
        let (part, sums) = std::mem::take(&mut self.last);
        let found = self.parts.entry(part).or_default();
        *found = found.with(sums);
    }

    pub fn join(&mut self, mut other: Self) {
        self.put_last();
        other.put_last();
        self.is_translucent |= other.is_translucent;
        self.lacks_normals |= other.lacks_normals;
        for (part, sums) in other.parts {
            let found = self.parts.entry(part).or_default();
            *found = found.with(sums);
        }
    }

    /// Whether all that was added is opaque, and shows its front to whoever is outside. A hollow within a part is one that
    /// shows its back: it cannot be told from a part beside the others that is inside out.
    pub fn are_solid(mut self) -> bool {
        self.put_last();
        // Normals that the file does not give are turned as a whole.
        let all = self.parts.values().fold(Sums::default(), |sums, part| sums.with(part.sums));
        let turned = if all.side(1.0) < 0 { -1 } else { 1 };
        !self.is_translucent
            && self.parts.values().all(|part| {
                let side = part.sums.side_of_closed();
                let wrong = if side < 0 { part.along } else { part.against };
                // A part without a volume has no side, and one without an area does not matter.
                part.sums.area() == 0.0
                    || (side != 0 && wrong <= FOLDS * part.sums.area() && !(self.lacks_normals && side * turned < 0))
            })
    }
}

impl Mesh {
    /// Whether whoever is outside sees the front of it alone, as [`Tree::closed`](crate::hierarchy::Tree::closed) promises: it
    /// [is closed](Self::is_closed), opaque everywhere, and the normals of its surfels point out of every connected part.
    /// Where a part has a hollow within, or no volume, the answer is no. Parts that share a vertex are one.
    pub fn is_solid(&self) -> bool {
        let Some(closing) = self.closing() else { return false };
        if !self.has_opaque_materials() {
            return false;
        }
        let name = |vertex: u32| match &closing {
            Closing::Vertices => vertex,
            Closing::Places(first) => first[vertex as usize],
        };
        let parts = Parts::new(self.positions.len() as u32);
        self.triangles.par_iter().for_each(|triangle| parts.join(triangle.map(name)));
        let none = (Vec3::ZERO, 255);
        let sides = self.triangles.par_chunks(1 << 14).map(|triangles| {
            let mut sides = Sides::default();
            for triangle in triangles {
                let at = triangle.map(|vertex| vertex as usize);
                let normals = at.map(|vertex| self.normals.get(vertex).copied().unwrap_or(none.0));
                let is_opaque =
                    at.iter().all(|&vertex| self.colors.get(vertex).map_or(none.1, |color| color[3]) == 255);
                sides.add(parts.of(name(triangle[0])), at.map(|vertex| self.positions[vertex]), normals, is_opaque);
            }
            sides
        });
        let join = |mut sides: Sides, more| {
            sides.join(more);
            sides
        };
        sides.reduce(Sides::default, join).are_solid()
    }

    /// Whether the materials that triangles have let nothing through.
    fn has_opaque_materials(&self) -> bool {
        let mut is_used = vec![false; self.materials.len()];
        for &material in &self.triangle_materials {
            if let Some(used) = is_used.get_mut(material as usize) {
                *used = true;
            }
        }
        self.materials.iter().zip(is_used).filter(|(_, used)| *used).all(|(material, _)| {
            let is_opaque = |texel: &[u8; 4]| texel[3] == 255;
            let texture = material.texture.as_deref();
            material.color[3] >= 1.0 && texture.is_none_or(|texture| texture.texels.par_iter().all(is_opaque))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Material, Texture};
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
        one.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        one
    }

    fn turned(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        mesh
    }

    /// With the normals of a sphere around a place, or the opposite.
    fn with_normals(mut mesh: Mesh, center: f32, sign: f32) -> Mesh {
        mesh.normals = mesh.positions.iter().map(|place| (place - Vec3::X * center).normalize() * sign).collect();
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
        // Of vertices of their own, too.
        let parts = both(sphere(0.0), turned(sphere(5.0)));
        let corners: Vec<u32> = parts.triangles.iter().flatten().copied().collect();
        let split = Mesh {
            positions: corners.iter().map(|&corner| parts.positions[corner as usize]).collect(),
            triangles: (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..Mesh::default()
        };
        assert!(split.is_closed() && !split.is_solid());
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

    #[test]
    fn given_normals_count() {
        assert!(with_normals(sphere(0.0), 0.0, 1.0).is_solid());
        assert!(!with_normals(sphere(0.0), 0.0, -1.0).is_solid());
        // The way that triangles run does not.
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
        let texture = |alpha| Some(Arc::new(Texture { width: 1, height: 1, texels: vec![[9, 9, 9, alpha]] }));
        let material =
            |opacity, alpha| Material { name: String::new(), color: [1.0, 1.0, 1.0, opacity], texture: texture(alpha) };
        // The last one is not used.
        for (opacity, alpha, is_solid) in [(1.0, 255, true), (0.9, 255, false), (1.0, 99, false)] {
            mesh.materials = vec![material(opacity, alpha), material(0.0, 0)];
            assert_eq!(mesh.is_solid(), is_solid, "{opacity} {alpha}");
        }
    }

    #[test]
    fn parts_are_those_of_one_thread() {
        let mesh = (0..40).map(|i| sphere(3.0 * i as f32)).reduce(both).unwrap_or_default();
        let parts = Parts::new(mesh.positions.len() as u32);
        mesh.triangles.par_iter().rev().for_each(|&triangle| parts.join(triangle));
        let per_sphere = mesh.positions.len() as u32 / 40;
        assert!((0..mesh.positions.len() as u32).all(|vertex| parts.of(vertex) == vertex / per_sphere * per_sphere));
    }
}

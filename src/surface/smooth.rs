//! Which triangles around a vertex are smooth with each other, and the normals that they share.

use super::{
    Mesh,
    adjacency::{Connected, is_split},
};
use crate::{Deadline, Result, deadline::Clock, memory, parallel::prelude::*};
use glam::Vec3;

/// Creases sharper than this (degrees) stay creases, whatever the options say, because surfels lie
/// in the plane of their group.
const SHARPEST: f32 = 60.0;

/// The name of this module's work in errors.
const WORK: &str = "finding the normals of the triangles' corners";

/// The smooth groups of the triangles around one vertex.
///
/// A group is a cone around its first normal. A surfel in the plane of the group's normal is thus
/// never far from its triangles, even if many small steps add up to a large turn. There are never
/// more than a few groups.
pub(super) struct Groups {
    /// Cosine of the crease angle.
    crease: f32,
    seeds: Vec<Vec3>,
}

impl Groups {
    pub fn new(crease_angle_degrees: f32) -> Self {
        Self { crease: crease_angle_degrees.min(SHARPEST).to_radians().cos(), seeds: Vec::new() }
    }

    /// Cosine of the crease angle.
    pub fn crease(&self) -> f32 {
        self.crease
    }

    /// Forgets the previous vertex.
    pub fn clear(&mut self) {
        self.seeds.clear();
    }

    pub fn len(&self) -> usize {
        self.seeds.len()
    }

    /// Returns the group of a triangle with this unit normal: the nearest within the crease angle,
    /// or a new one.
    pub fn place(&mut self, normal: Vec3) -> usize {
        let mut nearest = (self.seeds.len(), self.crease);
        for (group, seed) in self.seeds.iter().enumerate() {
            let cosine = seed.dot(normal);
            if cosine >= nearest.1 && (cosine > nearest.1 || nearest.0 == self.seeds.len()) {
                nearest = (group, cosine);
            }
        }
        if nearest.0 == self.seeds.len() {
            self.seeds.push(normal);
        }
        nearest.0
    }
}

/// Returns the normal of each triangle at its corners: the file's at the vertex, or the mean of the
/// corner's smooth group, weighted by angle. Triangles without area only have the file's normals,
/// or zero.
///
/// # Errors
/// [`Error::Timeout`](crate::Error::Timeout) and [`Error::Memory`](crate::Error::Memory).
pub(crate) fn corner_normals(
    mesh: &Mesh,
    crease_angle_degrees: f32,
    deadline: Deadline,
) -> Result<Vec<[Vec3; 3]>> {
    let adjacency = Connected::new(mesh, is_split(mesh))?.adjacency;
    memory::room(WORK, 48 * mesh.positions.len() as u64 + 120 * mesh.triangles.len() as u64)?;
    let clock = Clock::new(deadline);
    let by_vertex: Vec<Vec<(u32, Vec3)>> = (0..mesh.positions.len())
        .into_par_iter()
        .map_init(
            || Groups::new(crease_angle_degrees),
            |groups, vertex| {
                if clock.is_over(vertex) {
                    return Vec::new();
                }
                groups.clear();
                let corners = adjacency.corners(vertex).iter();
                let around: Vec<(u32, usize, Vec3)> = corners
                    .filter_map(|&at| {
                        let (normal, angle) = at_corner(mesh, at)?;
                        Some((at, groups.place(normal), normal * angle))
                    })
                    .collect();
                let sum = |group| around.iter().filter(|t| t.1 == group).map(|t| t.2).sum::<Vec3>();
                let normals: Vec<Vec3> =
                    (0..groups.len()).map(|group| sum(group).normalize_or_zero()).collect();
                around.iter().map(|&(at, group, _)| (at, normals[group])).collect()
            },
        )
        .collect();
    clock.finish(WORK)?;
    let mut normals = vec![[Vec3::ZERO; 3]; mesh.triangles.len()];
    for (at, normal) in by_vertex.into_iter().flatten() {
        normals[at as usize / 3][at as usize % 3] = normal;
    }
    if !mesh.normals.is_empty() {
        normals.par_iter_mut().zip(&mesh.triangles).for_each(|(normals, triangle)| {
            for (normal, &vertex) in normals.iter_mut().zip(triangle) {
                *normal = mesh.given_normal(vertex as usize).unwrap_or(*normal);
            }
        });
    }
    Ok(normals)
}

/// Returns a triangle's unit normal, and its angle (radians) at a corner; `None` if it has no area.
fn at_corner(mesh: &Mesh, at: u32) -> Option<(Vec3, f32)> {
    let indices = mesh.triangles[at as usize / 3];
    let [a, b, c] =
        [0, 1, 2].map(|i| mesh.positions[indices[(at as usize + i) % 3] as usize].as_dvec3());
    let cross = (b - a).cross(c - a);
    let twice_area = cross.length();
    let longest = (b - a).length_squared().max((c - a).length_squared());
    (twice_area > longest * 1e-6)
        .then(|| ((cross / twice_area).as_vec3(), twice_area.atan2((b - a).dot(c - a)) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_cones_around_their_first() {
        let mut groups = Groups::new(30.0);
        let turned =
            |degrees: f32| Vec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        assert_eq!(
            [0.0, 29.0, 31.0, 16.0, 14.0, 62.0].map(|angle| groups.place(turned(angle))),
            [0, 0, 1, 1, 0, 2]
        );
        groups.clear();
        assert_eq!((groups.place(turned(90.0)), groups.len()), (0, 1));
    }

    #[test]
    fn corners_have_the_normals_of_their_side() {
        let cube = Mesh::cube(2.0);
        for (triangle, normals) in
            cube.triangles.iter().zip(corner_normals(&cube, 75.0, Deadline::NEVER).unwrap())
        {
            let [a, b, c] = triangle.map(|vertex| cube.positions[vertex as usize]);
            let flat = (b - a).cross(c - a).normalize();
            assert!(normals.iter().all(|normal| normal.dot(flat) > 0.9999));
        }
        let sphere = Mesh::sphere(3);
        for (triangle, normals) in
            sphere.triangles.iter().zip(corner_normals(&sphere, 75.0, Deadline::NEVER).unwrap())
        {
            for (normal, &vertex) in normals.iter().zip(triangle) {
                assert!(normal.dot(sphere.positions[vertex as usize].normalize()) > 0.999);
            }
        }
    }
}

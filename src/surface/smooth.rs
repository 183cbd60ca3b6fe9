//! Which triangles around a vertex are smooth with each other, and the normals that they share.

use super::{
    Mesh,
    adjacency::{Connected, is_split},
    creases::{Creases, Fan},
};
use crate::{Deadline, Result, deadline::Clock, memory, parallel::prelude::*};
use glam::Vec3;

/// Creases sharper than this (degrees) stay creases, whatever the options say, because surfels lie
/// in the plane of their group.
const SHARPEST: f32 = 60.0;

/// Creases of parts (degrees), unless the options say otherwise: meshes as construction programs
/// make them. The sides of a prism of nine sides are flat, and ten sides are meant as a round.
const OF_PARTS: f32 = 38.0;

/// The name of this module's work in errors.
const WORK: &str = "finding the normals of the triangles' corners";

/// How the triangles around a vertex are grouped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grouping {
    /// By cones ([`Groups`]), which depend on the triangles at the vertex alone: for surfels, which
    /// lie in planes, and for parts of a mesh.
    Cones,
    /// By cones too, but of a sculpture by what lies between its [`Creases`]: for a whole mesh.
    Whole,
}

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
/// A crease angle above 60 degrees is the usual one: 60, but 38 in a whole mesh that is no
/// sculpture and has no normals.
///
/// # Errors
/// [`Error::Timeout`](crate::Error::Timeout) and [`Error::Memory`](crate::Error::Memory).
pub(crate) fn corner_normals(
    mesh: &Mesh,
    (crease_angle_degrees, grouping): (f32, Grouping),
    deadline: Deadline,
) -> Result<Vec<[Vec3; 3]>> {
    let Connected { places, adjacency } = Connected::new(mesh, is_split(mesh))?;
    memory::room(WORK, 48 * mesh.positions.len() as u64 + 120 * mesh.triangles.len() as u64)?;
    let clock = Clock::new(deadline);
    let cosine = Groups::new(crease_angle_degrees).crease();
    let is_free = mesh.normals.is_empty() && grouping == Grouping::Whole;
    let creases = if is_free {
        let unit = |triangle: usize| at_corner(mesh, 3 * triangle as u32);
        let unit = |triangle: usize| unit(triangle).map_or(Vec3::ZERO, |(normal, _)| normal);
        let unit: Vec<Vec3> = (0..mesh.triangles.len()).into_par_iter().map(unit).collect();
        let corners = |vertex: usize| adjacency.corners(vertex);
        Creases::of_sculpture(mesh, &places, &unit, (corners, cosine))
    } else {
        None
    };
    let is_part = is_free && creases.is_none() && crease_angle_degrees > SHARPEST;
    let crease = if is_part { OF_PARTS } else { crease_angle_degrees };
    let by_vertex: Vec<Vec<(u32, Vec3)>> = (0..mesh.positions.len())
        .into_par_iter()
        .map_init(
            || (Groups::new(crease), Fan::new()),
            |(cones, fan), vertex| {
                if clock.is_over(vertex) {
                    return Vec::new();
                }
                let corners = adjacency.corners(vertex);
                match &creases {
                    None => of_cones(mesh, corners, cones),
                    Some(creases) => {
                        let groups = creases.groups(fan, &places, (vertex, corners));
                        of_groups(mesh, groups, cones)
                    }
                }
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

/// Returns the normals of the corners of a vertex, each with its corner: the means of their cones.
fn of_cones(mesh: &Mesh, corners: &[u32], cones: &mut Groups) -> Vec<(u32, Vec3)> {
    cones.clear();
    let around: Vec<(u32, usize, Vec3)> = corners
        .iter()
        .filter_map(|&at| {
            let (normal, angle) = at_corner(mesh, at)?;
            Some((at, cones.place(normal), normal * angle))
        })
        .collect();
    let sum = |group| around.iter().filter(|t| t.1 == group).map(|t| t.2).sum::<Vec3>();
    let normals: Vec<Vec3> = (0..cones.len()).map(|group| sum(group).normalize_or_zero()).collect();
    around.iter().map(|&(at, group, _)| (at, normals[group])).collect()
}

/// As [`of_cones`], of corners behind their groups, by groups. A group whose mean none of its
/// triangles faces, as at the tip of a cone, is divided into cones.
fn of_groups(mesh: &Mesh, corners: &[(usize, u32)], cones: &mut Groups) -> Vec<(u32, Vec3)> {
    let mut normals = Vec::with_capacity(corners.len());
    for group in corners.chunk_by(|a, b| a.0 == b.0) {
        let around = || group.iter().filter_map(|&(_, at)| Some((at, at_corner(mesh, at)?)));
        let mean = around().map(|(_, (normal, angle))| normal * angle).sum::<Vec3>();
        let mean = mean.normalize_or_zero();
        if around().any(|(_, (normal, _))| normal.dot(mean) > FACING) {
            normals.extend(around().map(|(at, _)| (at, mean)));
        } else {
            let group: Vec<u32> = group.iter().map(|(_, at)| *at).collect();
            normals.extend(of_cones(mesh, &group, cones));
        }
    }
    normals
}

/// Cosine of the angle up to which a triangle faces the mean of a group.
const FACING: f32 = 0.7;

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
    use crate::surface::SurfelOptions;

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
        for (triangle, normals) in cube
            .triangles
            .iter()
            .zip(corner_normals(&cube, (75.0, Grouping::Whole), Deadline::NEVER).unwrap())
        {
            let [a, b, c] = triangle.map(|vertex| cube.positions[vertex as usize]);
            let flat = (b - a).cross(c - a).normalize();
            assert!(normals.iter().all(|normal| normal.dot(flat) > 0.9999));
        }
        let sphere = Mesh::sphere(3);
        for (triangle, normals) in sphere
            .triangles
            .iter()
            .zip(corner_normals(&sphere, (75.0, Grouping::Whole), Deadline::NEVER).unwrap())
        {
            for (normal, &vertex) in normals.iter().zip(triangle) {
                assert!(normal.dot(sphere.positions[vertex as usize].normalize()) > 0.999);
            }
        }
    }

    /// A closed prism around z, of faces that share their vertices.
    fn prism(sides: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for z in [0.0, 1.0] {
            mesh.positions.extend((0..sides).map(|side| {
                let angle = std::f32::consts::TAU * side as f32 / sides as f32;
                Vec3::new(angle.cos(), angle.sin(), z)
            }));
        }
        for a in 0..sides {
            let b = (a + 1) % sides;
            mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
        for a in 1..sides - 1 {
            mesh.triangles.extend([[0, a + 1, a], [sides, sides + a, sides + a + 1]]);
        }
        mesh
    }

    #[test]
    fn the_sides_of_prisms_are_flat_and_those_of_cylinders_are_not() {
        let flat = |mesh: &Mesh, crease: f32| {
            let normals = corner_normals(mesh, (crease, Grouping::Whole), Deadline::NEVER).unwrap();
            mesh.triangles.iter().zip(&normals).all(|(triangle, normals)| {
                let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
                let flat = (b - a).cross(c - a).normalize();
                normals.iter().all(|normal| normal.dot(flat) > 0.9999)
            })
        };
        let usual = SurfelOptions::default().crease_angle_degrees;
        for (sides, is_flat) in [(3, true), (6, true), (8, true), (10, false), (24, false)] {
            assert_eq!(flat(&prism(sides), usual), is_flat, "{sides} sides");
        }
        // An angle that is asked for counts.
        assert!(!flat(&prism(8), 60.0) && flat(&prism(24), 10.0));
    }

    /// A closed tube whose end is rounded within two rings of triangles of uneven steps: some of
    /// their edges turn by more than the angle of a crease, and others by less.
    fn uneven_rim() -> Mesh {
        let (sides, mut mesh) = (200u32, Mesh::default());
        let rings = [(1.0, 0.0), (1.0, 1.0), (0.97, 1.03), (0.9, 1.012), (0.9, 0.0)];
        for (ring, (radius, z)) in rings.into_iter().enumerate() {
            for side in 0..sides {
                let angle = std::f32::consts::TAU * side as f32 / sides as f32;
                let step = if ring == 2 { 0.01 * (50.0 * angle + 0.5).sin() } else { 0.0 };
                // Nothing is flat.
                let radius = radius + 0.002 * (67.0 * angle + 2.0 * ring as f32).sin();
                let (sine, cosine) = angle.sin_cos();
                mesh.positions.push(Vec3::new(radius * cosine, radius * sine, z + step));
            }
        }
        for ring in 0..rings.len() as u32 - 1 {
            for side in 0..sides {
                let [a, b] = [side, (side + 1) % sides].map(|side| ring * sides + side);
                mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
            }
        }
        mesh
    }

    #[test]
    fn rims_of_sculptures_have_no_dashes() {
        let mesh = uneven_rim();
        let normals = corner_normals(&mesh, (75.0, Grouping::Whole), Deadline::NEVER).unwrap();
        // All corners at a vertex of the rim have the same normal.
        let mut first = std::collections::HashMap::new();
        for (triangle, normals) in mesh.triangles.iter().zip(&normals) {
            for (&vertex, &normal) in triangle.iter().zip(normals).filter(|(v, _)| **v / 200 == 2) {
                let before = *first.entry(vertex).or_insert(normal);
                assert!(before.dot(normal) > 0.9999, "{vertex}: {before} {normal}");
            }
        }
        assert_eq!(first.len(), 200);
    }

    /// A dome on a wide ring has a crease all around, which closes.
    #[test]
    fn creases_of_sculptures_stay_where_they_close() {
        let mut mesh = Mesh::sphere(5);
        mesh.positions.iter_mut().for_each(|p| {
            // The lower half is turned up: the surface folds at the equator.
            if p.z < 0.0 {
                p.z *= -0.3;
            }
        });
        let normals = corner_normals(&mesh, (75.0, Grouping::Whole), Deadline::NEVER).unwrap();
        let differs = |t: usize, i: usize| {
            let [a, b, c] = mesh.triangles[t].map(|v| mesh.positions[v as usize]);
            normals[t][i].dot((b - a).cross(c - a).normalize()) < 0.5
        };
        let wrong = (0..mesh.triangles.len()).filter(|t| (0..3).any(|i| differs(*t, i))).count();
        assert!(wrong * 50 < mesh.triangles.len(), "{wrong} of {}", mesh.triangles.len());
    }
}

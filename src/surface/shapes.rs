//! Meshes made by formula, for tests, examples and the demo. All are closed, and their winding
//! makes normals point outward.

use super::Mesh;
use glam::Vec3;
use std::{
    collections::HashMap,
    f32::consts::{PI, TAU},
};

impl Mesh {
    /// A sphere of radius 1: an icosahedron whose triangles are split in four `subdivisions` times
    /// (at most 9).
    pub fn sphere(subdivisions: u32) -> Self {
        let g = (1.0 + 5f32.sqrt()) / 2.0;
        let mut positions: Vec<Vec3> = [
            [-1.0, g, 0.0],
            [1.0, g, 0.0],
            [-1.0, -g, 0.0],
            [1.0, -g, 0.0],
            [0.0, -1.0, g],
            [0.0, 1.0, g],
            [0.0, -1.0, -g],
            [0.0, 1.0, -g],
            [g, 0.0, -1.0],
            [g, 0.0, 1.0],
            [-g, 0.0, -1.0],
            [-g, 0.0, 1.0],
        ]
        .map(|p| Vec3::from_array(p).normalize())
        .to_vec();
        // The faces are the triples of vertices that are all neighbours, oriented outward.
        let near = |a: usize, b: usize| positions[a].distance(positions[b]) < 1.1;
        let mut triangles = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if near(a, b) && near(b, c) && near(c, a) {
                        let out = positions[a].dot(positions[b].cross(positions[c])) > 0.0;
                        triangles.push(
                            if out { [a, b, c] } else { [a, c, b] }.map(|index| index as u32),
                        );
                    }
                }
            }
        }
        for _ in 0..subdivisions.min(9) {
            let mut middle: HashMap<(u32, u32), u32> = HashMap::new();
            let mut halve = |a: u32, b: u32| {
                *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push((positions[a as usize] + positions[b as usize]).normalize());
                    positions.len() as u32 - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (x, y, z) = (halve(a, b), halve(b, c), halve(c, a));
                    [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
                })
                .collect();
        }
        Self { positions, triangles, ..Self::default() }
    }

    /// An axis-parallel cube around the origin, with edges of this length: 8 vertices, 12
    /// triangles.
    pub fn cube(size: f32) -> Self {
        let half = |bit: usize| if bit == 0 { -size / 2.0 } else { size / 2.0 };
        let positions = (0..8).map(|i| Vec3::new(half(i & 1), half(i & 2), half(i & 4))).collect();
        let sides =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { positions, triangles, ..Self::default() }
    }

    /// The demo's object: a tube of radius 0.35 along a trefoil knot of radius about 3, whose
    /// colour runs through the hues. It has `along` vertices along the tube and `around` around it.
    /// Both are clamped to 3 … 65,536.
    pub fn knot(along: u32, around: u32) -> Self {
        let (along, around) = (along.clamp(3, 1 << 16), around.clamp(3, 1 << 16));
        let curve = |t: f32| {
            let ring = 2.0 + (3.0 * t).cos();
            Vec3::new(ring * (2.0 * t).cos(), ring * (2.0 * t).sin(), (3.0 * t).sin())
        };
        let mut mesh = Self::default();
        for i in 0..along {
            let t = TAU * i as f32 / along as f32;
            let center = curve(t);
            // The frame follows the torus that the knot lies on, so it closes.
            let tangent = (curve(t + 1e-2) - curve(t - 1e-2)).normalize();
            let axis = Vec3::new((2.0 * t).cos(), (2.0 * t).sin(), 0.0) * 2.0;
            let up = (center - axis).normalize();
            let side = tangent.cross(up).normalize();
            let up = side.cross(tangent);
            for j in 0..around {
                let angle = TAU * j as f32 / around as f32;
                let normal = side * angle.cos() + up * angle.sin();
                mesh.positions.push(center + normal * 0.35);
                mesh.normals.push(normal);
                mesh.colors.push(hue(2.0 * t, 0.75 + 0.25 * (3.0 * t + angle).sin()));
            }
        }
        for i in 0..along {
            for j in 0..around {
                let index = |i: u32, j: u32| (i % along) * around + j % around;
                let (a, b, c, d) =
                    (index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
                mesh.triangles.push([a, b, c]);
                mesh.triangles.push([a, c, d]);
            }
        }
        mesh
    }
}

/// Returns a colour of the rainbow; the angle is in radians.
fn hue(angle: f32, value: f32) -> [u8; 4] {
    let part = |shift: f32| ((0.55 + 0.45 * (angle + shift).cos()) * value * 255.0) as u8;
    [part(0.0), part(-2.0 * PI / 3.0), part(2.0 * PI / 3.0), 255]
}

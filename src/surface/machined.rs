//! Meshes as they come from construction programs: few large triangles, slivers, sharp edges and
//! narrow bevels. They test what is hardest to draw with round splats.

use super::Mesh;
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;

impl Mesh {
    /// A spur gear of radius 1 with `teeth` teeth (3 to 4,096), a bore, and edges bevelled by 0.02.
    /// It is closed. The axis is z.
    pub fn gear(teeth: u32) -> Self {
        let teeth = teeth.clamp(3, 1 << 12);
        let (tip, root, bore, half, bevel) = (1.0, 0.82, 0.35, 0.18, 0.02);
        // Angle within a tooth and radius of the corners of its outline.
        let tooth = [(0.0, root), (0.25, root), (0.35, tip), (0.65, tip), (0.75, root)];
        let outline: Vec<(f32, f32)> = (0..teeth)
            .flat_map(|number| {
                let at = move |part: f32| TAU * (number as f32 + part) / teeth as f32;
                tooth.map(|(part, radius)| (at(part), radius))
            })
            .collect();
        let outer = |by: f32, z: f32| -> Vec<Vec3> {
            outline.iter().map(|&(angle, radius)| around(angle, radius - by, z)).collect()
        };
        let inner = |by: f32, z: f32| -> Vec<Vec3> {
            outline.iter().map(|&(angle, _)| around(angle, bore + by, z)).collect()
        };
        let (low, high) = (-half + bevel, half - bevel);
        closed_by_rings(&[
            outer(bevel, half),
            inner(bevel, half),
            inner(0.0, high),
            inner(0.0, low),
            inner(bevel, -half),
            outer(bevel, -half),
            outer(0.0, low),
            outer(0.0, high),
        ])
    }

    /// A plate of 2 × 1.4 × 0.2 with rounded corners and edges, whose faces are fans of slivers
    /// from one corner. It is closed. The flat faces are perpendicular to z.
    pub fn bevelled_plate() -> Self {
        const CORNER: u32 = 12;
        const SIDE: u32 = 24;
        let (size, radius, bevel) = (Vec2::new(1.0, 0.7), 0.15, 0.02);
        let ring = |inset: f32, z: f32| -> Vec<Vec3> {
            let mut ring = Vec::new();
            for corner in 0..4 {
                let turn = |k: u32| TAU * (corner as f32 + k as f32 / CORNER as f32) / 4.0;
                let sign = |angle: f32| Vec2::from_angle(angle + TAU / 8.0).signum();
                let middle = sign(turn(0)) * (size - radius);
                let on = |k: u32| middle + (radius - inset) * Vec2::from_angle(turn(k));
                ring.extend((0..=CORNER).map(|k| on(k).extend(z)));
                // Along the side to the next corner.
                let next = sign(turn(CORNER)) * (size - radius)
                    + (radius - inset) * Vec2::from_angle(turn(CORNER));
                let from = on(CORNER);
                let part = |k: u32| from.lerp(next, k as f32 / SIDE as f32);
                ring.extend((1..SIDE).map(|k| part(k).extend(z)));
            }
            ring
        };
        // A quarter of a circle in four steps, at the top and at the bottom.
        let step = |k: u32| {
            let (sine, cosine) = (TAU / 16.0 * k as f32).sin_cos();
            [bevel * (1.0 - sine), 0.1 - bevel + bevel * cosine]
        };
        let top: Vec<[f32; 2]> = (0..=4).map(step).collect();
        let bottom = top.iter().rev().map(|&[inset, z]| [inset, -z]);
        let rings: Vec<_> =
            top.iter().copied().chain(bottom).map(|[inset, z]| ring(inset, z)).collect();
        capped_by_fans(&rings)
    }

    /// A block of 2 × 1 × 0.2 with `count` fins on it, each 0.006 thick. Every fin is a closed box
    /// that reaches into the block. The fins point along z.
    pub fn fins(count: u32) -> Self {
        let mut mesh = Self::default();
        mesh.add_box(Vec3::new(-1.0, -0.5, -0.2), Vec3::new(1.0, 0.5, 0.0));
        let count = count.clamp(1, 1 << 12);
        for number in 0..count {
            let x = -0.97 + 1.94 * (number as f32 + 0.5) / count as f32;
            mesh.add_box(Vec3::new(x - 0.003, -0.46, -0.05), Vec3::new(x + 0.003, 0.46, 0.7));
        }
        mesh
    }

    /// A pencil: a cylinder of radius 0.4 with a cone as its tip and a fan as its end, all of
    /// `sides` slivers (3 to 65,536). It is closed. The axis is z.
    pub fn slivers(sides: u32) -> Self {
        let sides = sides.clamp(3, 1 << 16);
        let ring = |radius: f32, z: f32| -> Vec<Vec3> {
            (0..sides).map(|at| around(TAU * at as f32 / sides as f32, radius, z)).collect()
        };
        let tip = ring(1e-4, 1.0);
        capped_by_fans(&[tip, ring(0.4, 0.3), ring(0.4, -1.0)])
    }

    /// An open sheet of 2 × 1 without thickness, folded along `folds` lines at right angles.
    pub fn folded_sheet(folds: u32) -> Self {
        let folds = folds.clamp(1, 1 << 12);
        let mut mesh = Self::default();
        for at in 0..folds + 2 {
            let x = -1.0 + 2.0 * at as f32 / (folds + 1) as f32;
            let z = if at % 2 == 0 { 0.0 } else { 2.0 / (folds + 1) as f32 };
            mesh.positions.extend([Vec3::new(x, -0.5, z), Vec3::new(x, 0.5, z)]);
        }
        for first in (0..=folds).map(|at| 2 * at) {
            let [a, b, c, d] = [first, first + 2, first + 3, first + 1];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        mesh
    }

    /// Adds a closed box.
    fn add_box(&mut self, low: Vec3, high: Vec3) {
        let first = self.positions.len() as u32;
        let cube = Self::cube(2.0);
        let place = |p: Vec3| low + (high - low) * (p + 1.0) / 2.0;
        self.positions.extend(cube.positions.into_iter().map(place));
        self.triangles.extend(cube.triangles.iter().map(|t| t.map(|corner| first + corner)));
    }
}

fn around(angle: f32, radius: f32, z: f32) -> Vec3 {
    Vec3::new(radius * angle.cos(), radius * angle.sin(), z)
}

/// Joins rings of equally many points by strips, the last one with the first too.
fn closed_by_rings(rings: &[Vec<Vec3>]) -> Mesh {
    let mut mesh = Mesh { positions: rings.concat(), ..Mesh::default() };
    for ring in 0..rings.len() {
        join(&mut mesh, rings[0].len() as u32, [ring, (ring + 1) % rings.len()]);
    }
    mesh
}

/// Joins rings of equally many points by strips, and closes the first and the last one by fans from
/// their first points.
fn capped_by_fans(rings: &[Vec<Vec3>]) -> Mesh {
    let mut mesh = Mesh { positions: rings.concat(), ..Mesh::default() };
    let count = rings[0].len() as u32;
    for ring in 0..rings.len() - 1 {
        join(&mut mesh, count, [ring + 1, ring]);
    }
    let last = (rings.len() as u32 - 1) * count;
    for at in 1..count - 1 {
        mesh.triangles.push([0, at, at + 1]);
        mesh.triangles.push([last, last + at + 1, last + at]);
    }
    mesh
}

/// Joins two rings by a strip.
fn join(mesh: &mut Mesh, count: u32, rings: [usize; 2]) {
    let [from, to] = rings.map(|ring| ring as u32 * count);
    for at in 0..count {
        let next = (at + 1) % count;
        mesh.triangles.push([from + at, from + next, to + next]);
        mesh.triangles.push([from + at, to + next, to + at]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_closed_and_the_sheet_is_open() {
        for (name, mesh) in [
            ("gear", Mesh::gear(24)),
            ("plate", Mesh::bevelled_plate()),
            ("fins", Mesh::fins(12)),
            ("slivers", Mesh::slivers(360)),
        ] {
            assert!(mesh.is_solid(), "{name}");
        }
        assert!(!Mesh::folded_sheet(7).is_solid());
    }
}

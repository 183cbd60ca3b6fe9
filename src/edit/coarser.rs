//! Fewer vertices of a mesh: those that are kept take over the neighbourhoods of the others.
//!
//! Each place of the mesh goes to the kept one that is nearest along its edges. Three
//! neighbourhoods that meet in a triangle make a new one: the dual of a Voronoi diagram on the
//! surface (Valette & Chassery 2004). Parts that hold no kept place vanish.

use crate::{
    math::{neighbours::Neighbours, sets::Sets},
    surface::Mesh,
};
use glam::Vec3;
use std::{
    cmp::Reverse,
    collections::{BinaryHeap, HashMap, HashSet},
};

/// No kept place can be reached.
const NONE: u32 = u32::MAX;

/// Moves the corners of triangles to vertices that are kept, and removes triangles that have no
/// area left. Where a file splits vertices, such as at seams of a texture, a corner stays on its
/// own side if the kept place has a vertex there: `kept` gets the vertices of both.
pub fn coarsen(mesh: &mut Mesh, kept: &mut [bool]) {
    let place = Neighbours::first_of_equals(&mesh.positions);
    let triangles: Vec<[u32; 3]> =
        mesh.triangles.iter().map(|t| t.map(|vertex| place[vertex as usize])).collect();
    let nearest = nearest(&mesh.positions, &triangles, kept);
    let mut sides = Sets::new(mesh.positions.len());
    for [a, b, c] in &mesh.triangles {
        sides.join(*a, *b);
        sides.join(*b, *c);
    }
    // The vertex at each kept place that lies on a side.
    let mut on_side = HashMap::new();
    for (vertex, place) in (0..).zip(&place) {
        if kept[*place as usize] {
            on_side.entry((*place, sides.root(vertex))).or_insert(vertex);
        }
    }
    let (mut seen, mut is_left) = (HashSet::new(), Vec::with_capacity(triangles.len()));
    for (triangle, places) in mesh.triangles.iter_mut().zip(&triangles) {
        let [a, b, c] = places.map(|place| nearest[place as usize]);
        let first = (0..3).min_by_key(|at| [a, b, c][*at]).unwrap_or(0);
        let turned = [0, 1, 2].map(|step| [a, b, c][(first + step) % 3]);
        let is_whole = a != b && b != c && c != a && ![a, b, c].contains(&NONE);
        is_left.push(is_whole && seen.insert(turned));
        if is_left.last() == Some(&true) {
            for (corner, place) in triangle.iter_mut().zip([a, b, c]) {
                let side = sides.root(*corner);
                *corner = on_side.get(&(place, side)).copied().unwrap_or(place);
                kept[*corner as usize] = true;
            }
        }
    }
    let mut at = is_left.iter();
    mesh.triangles.retain(|_| at.next() == Some(&true));
    let mut at = is_left.iter();
    mesh.triangle_materials.retain(|_| at.next() == Some(&true));
}

/// Returns for each place the kept one that is nearest along edges (Dijkstra 1959).
fn nearest(positions: &[Vec3], triangles: &[[u32; 3]], kept: &[bool]) -> Vec<u32> {
    let mut starts = vec![0u32; positions.len() + 1];
    triangles.iter().flatten().for_each(|place| starts[*place as usize + 1] += 2);
    for at in 1..starts.len() {
        starts[at] += starts[at - 1];
    }
    let mut next = starts.clone();
    let mut others = vec![0; 6 * triangles.len()];
    for triangle in triangles {
        for corner in 0..3 {
            let at = &mut next[triangle[corner] as usize];
            others[*at as usize] = triangle[(corner + 1) % 3];
            others[*at as usize + 1] = triangle[(corner + 2) % 3];
            *at += 2;
        }
    }
    let mut nearest = vec![NONE; positions.len()];
    // Lengths are not negative, so their bits are in their order.
    let seeds = (0..).zip(kept).filter(|(_, kept)| **kept);
    let mut reached: BinaryHeap<Reverse<(u32, u32, u32)>> =
        seeds.map(|(place, _)| Reverse((0, place, place))).collect();
    while let Some(Reverse((length, place, seed))) = reached.pop() {
        if nearest[place as usize] != NONE {
            continue;
        }
        nearest[place as usize] = seed;
        let [first, end] = [starts[place as usize], starts[place as usize + 1]];
        for &other in &others[first as usize..end as usize] {
            if nearest[other as usize] == NONE {
                let step = positions[place as usize].distance(positions[other as usize]);
                reached.push(Reverse(((f32::from_bits(length) + step).to_bits(), other, seed)));
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::{Context, Edit, Surface, Thin, apply};

    fn thinned(mesh: Mesh, share: f64) -> Mesh {
        let mut surface = Surface::from(mesh);
        apply(&mut surface, &[Edit::Thin(Thin::Share(share))], &Context::default()).unwrap();
        surface.mesh
    }

    /// How many edges have another number of triangles than two, with corners at one place joined.
    fn open_edges(mesh: &Mesh) -> usize {
        let place = Neighbours::first_of_equals(&mesh.positions);
        let mut counts: HashMap<[u32; 2], u32> = HashMap::new();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| place[vertex as usize]);
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *counts.entry([from.min(to), from.max(to)]).or_default() += 1;
            }
        }
        counts.values().filter(|count| **count != 2).count()
    }

    fn volume(mesh: &Mesh) -> f32 {
        let corner = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
        mesh.triangles.iter().map(corner).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn a_ball_stays_closed() {
        let ball = Mesh::sphere(5);
        let fewer = thinned(ball.clone(), 0.1);
        assert_eq!(fewer.positions.len(), (ball.positions.len() as f64 * 0.1).round() as usize);
        assert_eq!(open_edges(&fewer), 0);
        assert!(volume(&fewer) / volume(&ball) > 0.97, "{}", volume(&fewer));
        // All triangles are right side out.
        for triangle in &fewer.triangles {
            let [a, b, c] = triangle.map(|vertex| fewer.positions[vertex as usize]);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
    }

    #[test]
    fn seams_do_not_open() {
        // Two halves of a ball, each with its own vertices and texture coordinates.
        let mut ball = Mesh::sphere(4);
        let count = ball.positions.len() as u32;
        ball.positions.extend_from_within(..);
        let height =
            |mesh: &Mesh, t: &[u32; 3]| t.map(|v| mesh.positions[v as usize].z).iter().sum::<f32>();
        let is_low: Vec<bool> = ball.triangles.iter().map(|t| height(&ball, t) < 0.0).collect();
        for (triangle, is_low) in ball.triangles.iter_mut().zip(is_low) {
            if is_low {
                *triangle = triangle.map(|vertex| vertex + count);
            }
        }
        ball.uvs = (0..2 * count).map(|v| glam::Vec2::splat((v / count) as f32)).collect();
        let fewer = thinned(ball, 0.1);
        assert_eq!(open_edges(&fewer), 0);
        // Only a neighbourhood that reaches over the seam takes triangles with it.
        let is_mixed = |triangle: &&[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| fewer.uvs[vertex as usize].x);
            a != b || b != c
        };
        let mixed = fewer.triangles.iter().filter(is_mixed).count();
        assert!(mixed * 8 < fewer.triangles.len(), "{mixed} of {}", fewer.triangles.len());
    }
}

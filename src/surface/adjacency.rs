//! Which triangle corners meet at each vertex.

use super::Mesh;
use crate::math::weld::first_of_equals;
use glam::DVec3;
use rayon::prelude::*;

/// The corners at each vertex, in two flat arrays. Corner `3·t + i` is the `i`-th of triangle `t`.
pub(super) struct Adjacency {
    /// Where each vertex's corners begin; one more entry than vertices.
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl Adjacency {
    /// The corners of a mesh's triangles that have an area.
    ///
    /// Files split vertices at seams of texture and material, or give every triangle its own. A seam must not show, so
    /// vertices at one place are one; but not where the file has normals, which may be split to be seen.
    pub fn of(mesh: &Mesh) -> Self {
        let may_be_split =
            !mesh.uvs.is_empty() || mesh.materials.len() > 1 || mesh.positions.len() > mesh.triangles.len() / 4 * 3;
        let keep: Vec<bool> = mesh.triangles.par_iter().map(|&triangle| has_area(mesh, triangle)).collect();
        if mesh.normals.is_empty() && may_be_split {
            let first = first_of_equals(&mesh.positions);
            let triangles: Vec<[u32; 3]> = mesh.triangles.par_iter().map(|t| t.map(|i| first[i as usize])).collect();
            Self::new(&triangles, mesh.positions.len(), &keep)
        } else {
            Self::new(&mesh.triangles, mesh.positions.len(), &keep)
        }
    }

    /// Triangles for which `keep` is false are left out. All indices must be below `vertices`, and there must be at most
    /// `u32::MAX` corners.
    pub fn new(triangles: &[[u32; 3]], vertices: usize, keep: &[bool]) -> Self {
        let kept = || triangles.iter().zip(keep).enumerate().filter(|(_, (_, keep))| **keep);
        let mut starts = vec![0u32; vertices + 1];
        for (_, (triangle, _)) in kept() {
            for &vertex in triangle {
                starts[vertex as usize] += 1;
            }
        }
        // From counts to the ends of the ranges; filling from the back turns ends into starts.
        let mut end = 0;
        for entry in &mut starts {
            end += *entry;
            *entry = end;
        }
        let mut corners = vec![0u32; end as usize];
        for (index, (triangle, _)) in triangles.iter().zip(keep).enumerate().rev().filter(|(_, (_, keep))| **keep) {
            for (corner, &vertex) in triangle.iter().enumerate().rev() {
                let slot = &mut starts[vertex as usize];
                *slot -= 1;
                corners[*slot as usize] = (index * 3 + corner) as u32;
            }
        }
        Self { starts, corners }
    }

    /// The corners at a vertex, in ascending order.
    pub fn corners(&self, vertex: usize) -> &[u32] {
        &self.corners[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

/// Whether a triangle is more than a line, at the precision of its coordinates.
fn has_area(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|index| -> DVec3 { mesh.positions[index as usize].as_dvec3() });
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() > longest * 1e-10
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_kept_triangles_in_order() {
        let adjacency = Adjacency::new(&[[0, 1, 2], [2, 1, 3], [3, 3, 0]], 5, &[true, true, false]);
        assert_eq!(adjacency.corners(0), [0]);
        assert_eq!(adjacency.corners(1), [1, 4]);
        assert_eq!(adjacency.corners(2), [2, 3]);
        assert_eq!(adjacency.corners(3), [5]);
        assert!(adjacency.corners(4).is_empty());
    }
}

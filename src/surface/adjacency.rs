//! Which triangle corners meet at each vertex.

use super::Mesh;
use crate::{
    Result,
    math::weld::first_of_equals,
    memory,
    parallel::{self, prelude::*},
};
use std::borrow::Cow;

/// The corners at each vertex. Corner `3·t + i` is the `i`-th of triangle `t`.
pub(super) struct Adjacency {
    /// Vertices of each part except the last.
    step: usize,
    parts: Vec<Part>,
}

/// The corners at a range of vertices, in two flat arrays.
struct Part {
    /// Where each vertex's corners begin; one more entry than vertices.
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl Adjacency {
    /// All indices must be below `vertices`, and there must be at most `u32::MAX` corners.
    pub fn new(triangles: &[[u32; 3]], vertices: usize) -> Self {
        // Each task scans all triangles but handles only its own vertices. No two tasks write to
        // the same memory, and the order does not depend on the number of tasks.
        let step = vertices.div_ceil(parallel::current_num_threads()).max(1);
        let parts = (0..vertices.div_ceil(step)).into_par_iter().map(|part| {
            let first = part * step;
            Part::new(triangles, first as u32, step.min(vertices - first) as u32)
        });
        Self { step, parts: parts.collect() }
    }

    /// Returns the corners at a vertex, in ascending order.
    pub fn corners(&self, vertex: usize) -> &[u32] {
        let part = &self.parts[vertex / self.step];
        let vertex = vertex % self.step;
        &part.corners[part.starts[vertex] as usize..part.starts[vertex + 1] as usize]
    }
}

impl Part {
    fn new(triangles: &[[u32; 3]], first: u32, count: u32) -> Self {
        let mut starts = vec![0u32; count as usize + 1];
        for triangle in triangles {
            for &vertex in triangle {
                // Smaller vertex numbers wrap around and become too large.
                let offset = vertex.wrapping_sub(first);
                if offset < count {
                    starts[offset as usize] += 1;
                }
            }
        }
        // Turns counts into the ends of the ranges. Filling from the back then turns the ends into
        // starts.
        let mut end = 0;
        for entry in &mut starts {
            end += *entry;
            *entry = end;
        }
        let mut corners = vec![0u32; end as usize];
        for (index, triangle) in triangles.iter().enumerate().rev() {
            for (corner, &vertex) in triangle.iter().enumerate().rev() {
                let offset = vertex.wrapping_sub(first);
                if offset < count {
                    let slot = &mut starts[offset as usize];
                    *slot -= 1;
                    corners[*slot as usize] = (index * 3 + corner) as u32;
                }
            }
        }
        Self { starts, corners }
    }
}

/// A mesh's triangles, with the vertices that are connected identified.
pub(super) struct Connected<'a> {
    /// The triangles by position: of vertices at one position, the first represents all.
    pub places: Cow<'a, [[u32; 3]]>,
    pub adjacency: Adjacency,
}

impl<'a> Connected<'a> {
    /// With `is_split`, vertices at one position count as one. The adjacency does not merge them if
    /// the file has normals, because then the split may be intended.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory).
    pub fn new(mesh: &'a Mesh, is_split: bool) -> Result<Self> {
        // The corners, and the start of each vertex's corners. With `is_split`, also the sorted
        // positions and the merged triangles.
        let [vertices, triangles] =
            [mesh.positions.len(), mesh.triangles.len()].map(|count| count as u64);
        let (of_vertex, of_triangle) = if is_split { (12, 24) } else { (4, 12) };
        memory::room(
            "finding the triangles at each vertex",
            of_vertex * vertices + of_triangle * triangles,
        )?;
        let places: Cow<[[u32; 3]]> = if is_split {
            let first = first_of_equals(&mesh.positions);
            let places = mesh.triangles.par_iter().map(|t| t.map(|i| first[i as usize]));
            Cow::Owned(places.collect())
        } else {
            Cow::Borrowed(&mesh.triangles)
        };
        let joined: &[[u32; 3]] = if mesh.normals.is_empty() { &places } else { &mesh.triangles };
        let adjacency = Adjacency::new(joined, mesh.positions.len());
        Ok(Self { places, adjacency })
    }
}

/// Returns whether several vertices of a mesh may lie at one position. Files split vertices at
/// seams of texture and material, or give every triangle its own. A seam must not be visible.
pub(super) fn is_split(mesh: &Mesh) -> bool {
    let has_seams = !mesh.uvs.is_empty() || mesh.materials.len() > 1;
    may_be_split(has_seams, mesh.positions.len(), mesh.triangles.len())
}

/// Like [`is_split`], from the mesh's counts.
pub(super) fn may_be_split(has_seams: bool, vertices: usize, triangles: usize) -> bool {
    has_seams || vertices > triangles / 4 * 3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_in_order() {
        let adjacency = Adjacency::new(&[[0, 1, 2], [2, 1, 3], [0, 4, 1]], 6);
        assert_eq!(adjacency.corners(0), [0, 6]);
        assert_eq!(adjacency.corners(1), [1, 4, 8]);
        assert_eq!(adjacency.corners(2), [2, 3]);
        assert_eq!(adjacency.corners(3), [5]);
        assert_eq!(adjacency.corners(4), [7]);
        assert!(adjacency.corners(5).is_empty());
    }
}

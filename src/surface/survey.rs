//! Properties of a mesh: whether it is closed, and how many of its elements are irregular.

use super::{Mesh, adjacency::may_be_split};
use crate::{math::weld::first_of_equals, parallel::prelude::*};
use glam::Vec3;

/// Counts of irregular elements of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Survey {
    /// Positions with a coordinate that is not finite.
    pub not_finite: usize,
    /// Positions equal to that of an earlier vertex.
    pub duplicates: usize,
    /// Triangles that are no more than a line.
    pub without_area: usize,
    /// Vertices that no triangle uses, in a mesh that has triangles.
    pub unused: usize,
}

/// What is identified along the edges of a closed surface.
pub(super) enum Closing {
    /// Triangles share vertices.
    Vertices,
    /// Triangles have vertices at the same positions. Holds the first vertex at each vertex's
    /// position.
    Places(Vec<u32>),
}

impl Mesh {
    /// Returns whether the triangles bound a solid: along every edge, as many run one way as the
    /// other. From outside, such a surface hides its own back.
    ///
    /// Edges are not listed. Each one adds or subtracts a hash of its ends, by its direction. The
    /// sum over a closed surface is zero. Over any other surface it is zero only by chance, once in
    /// 2⁶⁴.
    ///
    /// [`is_solid`](Self::is_solid) decides whether that back need not be drawn.
    pub fn is_closed(&self) -> bool {
        self.closing().is_some()
    }

    /// Returns what closes the surface, or `None` if it is not closed.
    pub(super) fn closing(&self) -> Option<Closing> {
        let refers_beyond = |triangle: &[u32; 3]| {
            triangle.iter().any(|&vertex| vertex as usize >= self.positions.len())
        };
        if self.triangles.is_empty() || self.triangles.par_iter().any(refers_beyond) {
            return None;
        }
        let sum = |name: &(dyn Fn(u32) -> u32 + Sync)| {
            let of_triangle = |t: &[u32; 3]| {
                let [a, b, c] = t.map(name);
                edge(a, b).wrapping_add(edge(b, c)).wrapping_add(edge(c, a))
            };
            let triangles = self.triangles.par_iter().with_min_len(1 << 14);
            triangles.map(of_triangle).reduce(|| 0, u64::wrapping_add)
        };
        if sum(&|vertex| vertex) == 0 {
            return Some(Closing::Vertices);
        }
        // Scans that share all vertices have fewer vertices than files that split them.
        let has_seams = !self.uvs.is_empty() || !self.normals.is_empty();
        if !may_be_split(has_seams, self.positions.len(), self.triangles.len()) {
            return None;
        }
        let first = first_of_equals(&self.positions);
        (sum(&|vertex| first[vertex as usize]) == 0).then_some(Closing::Places(first))
    }

    /// Counts the elements of the mesh that produce nothing to draw.
    pub fn survey(&self) -> Survey {
        let first = first_of_equals(&self.positions);
        let mut is_used = vec![false; self.positions.len()];
        for vertex in self.triangles.iter().flatten() {
            if let Some(used) = is_used.get_mut(*vertex as usize) {
                *used = true;
            }
        }
        let used = is_used.iter().filter(|used| **used).count();
        Survey {
            not_finite: self.positions.par_iter().filter(|p| !p.is_finite()).count(),
            duplicates: (0..).zip(&first).filter(|(index, first)| *index != **first).count(),
            without_area: self
                .triangles
                .par_iter()
                .filter(|&&triangle| !has_area(self, triangle))
                .count(),
            unused: if self.triangles.is_empty() { 0 } else { self.positions.len() - used },
        }
    }
}

/// Returns whether a triangle is more than a line, at the precision of its coordinates.
pub(super) fn has_area(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [Some(a), Some(b), Some(c)] = triangle.map(|index| mesh.positions.get(index as usize))
    else {
        return false;
    };
    let [a, b, c] = [a, b, c].map(|place| place.as_dvec3());
    let longest =
        (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() > longest * 1e-10
}

/// Returns a hash of an edge, negated for the reverse edge.
pub(super) fn edge(a: u32, b: u32) -> u64 {
    signed(a, b, mixed(u64::from(a.min(b)) << 32 | u64::from(a.max(b))))
}

/// Like [`edge`], from the positions of the ends. Edges between equal positions have equal hashes.
pub(super) fn edge_of_places(a: Vec3, b: Vec3) -> u64 {
    // Adding zero turns −0 into 0.
    let name = |p: Vec3| {
        let bits = (p + Vec3::ZERO).to_array().map(|value| u64::from(value.to_bits()));
        mixed(bits[0] << 32 | bits[1]) ^ mixed(!bits[2])
    };
    let (a, b) = (name(a), name(b));
    signed(a, b, mixed(a.min(b) ^ a.max(b).rotate_left(32)))
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014).
fn mixed(bits: u64) -> u64 {
    let mut z = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn signed<T: Ord>(a: T, b: T, z: u64) -> u64 {
    if a < b {
        z
    } else if a > b {
        z.wrapping_neg()
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_solid_is_closed_until_a_triangle_is_missing_or_turned() {
        assert!(tetrahedron().is_closed());
        let mut open = tetrahedron();
        open.triangles.pop();
        assert!(!open.is_closed());
        let mut turned = tetrahedron();
        turned.triangles[2].swap(0, 1);
        assert!(!turned.is_closed());
    }

    #[test]
    fn triangles_with_vertices_of_their_own_may_bound_a_solid() {
        let whole = tetrahedron();
        let corners: Vec<u32> = whole.triangles.iter().flatten().copied().collect();
        let split = Mesh {
            positions: corners.iter().map(|&corner| whole.positions[corner as usize]).collect(),
            triangles: (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
            ..Mesh::default()
        };
        assert!(split.is_closed());
        assert_eq!(split.survey().duplicates, 8);
    }

    #[test]
    fn odd_parts_are_counted() {
        let mut mesh = tetrahedron();
        mesh.positions.extend([Vec3::ZERO, Vec3::splat(f32::NAN)]);
        mesh.triangles.push([0, 1, 1]);
        let survey = mesh.survey();
        assert_eq!(survey, Survey { not_finite: 1, duplicates: 1, without_area: 1, unused: 2 });
    }
}

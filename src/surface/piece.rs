//! Surfels of parts of meshes and clouds that are too large to be held as a whole: each part is a mesh of its own, with what
//! is around the vertices that it answers for.

use super::{
    Known, Mesh, SurfelOptions,
    adjacency::may_be_split,
    cloud,
    fan::Sums,
    refine::{affordable, pieces},
    surfels::of_part,
    survey::{edge, edge_of_places},
};
use crate::{Result, splat::Splat};
use glam::Vec3;

/// What going through the triangles of a mesh once tells of it. Two parts add up.
#[derive(Debug, Clone, Default)]
pub(crate) struct Triangles {
    /// Sums as of [`Mesh::is_closed`], by index and by place.
    edges: [u64; 2],
    /// Which side is out.
    sums: Sums,
    /// About how many triangles they will be once long edges are cut.
    expected: f64,
    /// The corners of those with an edge that is to be cut.
    pub long: Vec<Vec3>,
    pub longest: f32,
}

impl Triangles {
    /// Adds a triangle by its indices and corners where edges longer than `length` are cut.
    pub fn add(&mut self, [a, b, c]: [u32; 3], corners: [Vec3; 3], length: f32) {
        let [p, q, r] = corners;
        let sums = [
            edge(a, b).wrapping_add(edge(b, c)).wrapping_add(edge(c, a)),
            edge_of_places(p, q).wrapping_add(edge_of_places(q, r)).wrapping_add(edge_of_places(r, p)),
        ];
        self.edges.iter_mut().zip(sums).for_each(|(sum, more)| *sum = sum.wrapping_add(more));
        self.sums.add_triangle(corners, 1.0);
        let edges = [(p, q), (q, r), (r, p)].map(|(a, b)| (a - b).length());
        let longest = edges[0].max(edges[1]).max(edges[2]);
        self.longest = self.longest.max(longest);
        self.expected += pieces(edges.map(|edge| f64::from(edge / length)));
        if longest / length > 1.0 {
            self.long.extend(corners);
        }
    }

    pub fn join(&mut self, other: Self) {
        self.edges.iter_mut().zip(other.edges).for_each(|(sum, more)| *sum = sum.wrapping_add(more));
        self.sums = self.sums.with(other.sums);
        self.expected += other.expected;
        self.long.extend(other.long);
        self.longest = self.longest.max(other.longest);
    }
}

/// How the surfels of all parts of a mesh are made, so that they are those of the whole.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeshPieces {
    is_split: bool,
    /// The length that edges are measured in, and −1 where the mesh is inside out.
    unit: f32,
    outward: f32,
    /// Whether any edge is cut.
    is_coarse: bool,
    /// The longest that an edge may stay.
    pub length: f32,
    pub is_closed: bool,
}

impl MeshPieces {
    /// Of a mesh with a bounding box of this `diagonal`; `look` goes through its triangles where edges longer than what it is
    /// given are cut. Also gives what the last look told.
    pub fn new(
        [points, triangles]: [usize; 2],
        [has_normals, has_uvs]: [bool; 2],
        diagonal: f32,
        options: &SurfelOptions,
        mut look: impl FnMut(f32) -> Result<Triangles>,
    ) -> Result<(Self, Triangles)> {
        let mut seen = None;
        let budget = options.most_triangles.max(triangles) as f64;
        let unit = (diagonal * options.largest_spacing).max(f32::MIN_POSITIVE);
        let length = affordable(unit, budget, |length| {
            let found = look(length)?;
            let expected = found.expected;
            seen = Some((length, found));
            Ok::<f64, crate::Error>(expected)
        })?;
        let seen = match seen {
            Some((at, found)) if at == length => found,
            _ => look(length)?,
        };
        let is_closed = triangles > 0
            && (seen.edges[0] == 0 || (seen.edges[1] == 0 && may_be_split(has_uvs || has_normals, points, triangles)));
        let outward = if seen.sums.are_inside_out(1.0) { -1.0 } else { 1.0 };
        let is_coarse = seen.longest > length;
        Ok((
            Self { is_coarse, is_split: may_be_split(has_uvs, points, triangles), unit, outward, length, is_closed },
            seen,
        ))
    }

    /// The surfels of those vertices of a part that are `owned`; all triangles at them must be in it. Where `is_long`, also
    /// those that cutting long edges adds; then all triangles that are cut must be in it.
    pub fn surfels(&self, part: &Mesh, owned: &[bool], is_long: bool, options: &SurfelOptions) -> Result<Vec<Splat>> {
        part.check(options)?;
        let is_wanted = |vertex: usize| owned.get(vertex).is_none_or(|&owned| owned);
        let cut = is_long.then_some(self.length);
        Ok(of_part(part, self.is_split, options, [self.unit, self.outward], self.is_coarse, cut, is_wanted))
    }
}

/// The surfels of those points of a part of a cloud that are `owned`, with their indices; the others are their neighbours.
pub(crate) fn cloud_piece(
    part: &Mesh,
    owned: &[bool],
    known: Known,
    options: &SurfelOptions,
) -> Result<Vec<(u32, Splat)>> {
    part.check(options)?;
    Ok(cloud::some_surfels(part, options, known, |point| owned[point]))
}

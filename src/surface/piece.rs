//! Surfels of parts of meshes and clouds that are too large to be held as a whole: each part is a mesh of its own, with what
//! is around the vertices that it answers for.

use super::{
    Known, Mesh, SurfelOptions,
    adjacency::may_be_split,
    cloud,
    fan::Sums,
    refine::{affordable, pieces},
    surfels::{largest_edge, of_part},
    survey::{edge, edge_of_places},
};
use crate::{Result, splat::Splat};
use glam::{DVec3, Vec3};

/// What going through the triangles of a mesh once tells of it. Two parts add up.
#[derive(Debug, Clone, Default)]
pub(crate) struct Triangles {
    /// Sums as of [`Mesh::is_closed`], by index and by place.
    edges: [u64; 2],
    /// Which side is out.
    sums: Sums,
    /// About how many triangles they will be once long edges are cut, and those with long edges alone.
    pub expected: f64,
    pub expected_of_long: f64,
    /// The smallest and the largest coordinates of corners.
    bounds: Option<[Vec3; 2]>,
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
        self.surround([p.min(q).min(r), p.max(q).max(r)]);
        let edges = [(p, q), (q, r), (r, p)].map(|(a, b)| (a - b).length());
        let longest = edges[0].max(edges[1]).max(edges[2]);
        self.longest = self.longest.max(longest);
        let pieces = pieces(edges.map(|edge| f64::from(edge / length)));
        self.expected += pieces;
        if longest / length > 1.0 {
            self.expected_of_long += pieces;
            self.long.extend(corners);
        }
    }

    fn surround(&mut self, [low, high]: [Vec3; 2]) {
        let [own_low, own_high] = self.bounds.unwrap_or([low, high]);
        self.bounds = Some([own_low.min(low), own_high.max(high)]);
    }

    /// The diagonal of the box around all corners that are at this origin.
    fn diagonal(&self, origin: DVec3) -> f32 {
        let [low, high] = self.bounds.unwrap_or_default().map(|corner| origin + corner.as_dvec3());
        (high - low).length() as f32
    }

    pub fn join(&mut self, other: Self) {
        other.bounds.into_iter().for_each(|bounds| self.surround(bounds));
        self.edges.iter_mut().zip(other.edges).for_each(|(sum, more)| *sum = sum.wrapping_add(more));
        self.sums = self.sums.with(other.sums);
        self.expected += other.expected;
        self.expected_of_long += other.expected_of_long;
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
    pub closing: Option<PiecesClosing>,
}

/// What closes a mesh, as of [`Mesh::is_closed`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PiecesClosing {
    Vertices,
    Places,
}

impl MeshPieces {
    /// Of a mesh around an `origin` whose vertices lie in a box of this `diagonal`; `look` goes through its triangles where
    /// edges longer than what it is given are cut. Also gives what the last look told.
    pub fn new(
        [points, triangles]: [usize; 2],
        [has_normals, has_uvs]: [bool; 2],
        (origin, diagonal): (DVec3, f32),
        options: &SurfelOptions,
        mut look: impl FnMut(f32) -> Result<Triangles>,
    ) -> Result<(Self, Triangles)> {
        let budget = options.most_triangles.max(triangles) as f64;
        let mut unit = largest_edge(diagonal, options);
        let mut seen = (unit, look(unit)?);
        // Vertices that no triangle has do not count.
        unit = largest_edge(seen.1.diagonal(origin), options);
        let length = affordable(unit, budget, |length| {
            if seen.0 != length {
                seen = (length, look(length)?);
            }
            Ok::<f64, crate::Error>(seen.1.expected)
        })?;
        if seen.0 != length {
            seen = (length, look(length)?);
        }
        let (_, seen) = seen;
        let closing = if seen.edges[0] == 0 {
            Some(PiecesClosing::Vertices)
        } else {
            let is_closed = seen.edges[1] == 0 && may_be_split(has_uvs || has_normals, points, triangles);
            is_closed.then_some(PiecesClosing::Places)
        };
        let outward = if seen.sums.side(1.0) < 0 { -1.0 } else { 1.0 };
        let is_coarse = seen.longest > length;
        let closing = closing.filter(|_| triangles > 0);
        Ok((
            Self { is_coarse, is_split: may_be_split(has_uvs, points, triangles), unit, outward, length, closing },
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

//! Surfels of parts of meshes and point clouds that are too large for memory. Each part is a mesh
//! of its own. It includes the surroundings of the vertices whose surfels it makes.

use super::{
    Known, Mesh, SurfelOptions,
    adjacency::may_be_split,
    cloud,
    fan::Sums,
    refine::{Expected, STRETCH, affordable, count_once_cut, pieces, stretch},
    surfels::{Whole, largest_edge, of_part},
    survey::{edge, edge_of_places},
};
use crate::{Deadline, Result, parallel::prelude::*, splat::Splat};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// What one pass over the triangles of a mesh collects. The results of two parts can be joined.
#[derive(Debug, Clone, Default)]
pub(crate) struct Triangles {
    /// Sums as in [`Mesh::is_closed`], by index and by position.
    edges: [u64; 2],
    /// Decides which side is outside.
    sums: Sums,
    /// Estimated triangles after long edges are cut.
    pub expected: f64,
    /// The number of triangles that those with long edges are cut into, once counted. An estimate
    /// if it exceeds the limit.
    pub cut: usize,
    /// The smallest and the largest coordinates of corners.
    bounds: Option<[Vec3; 2]>,
    /// The corners of the triangles that have an edge to cut. `names` holds their indices.
    pub long: Vec<[Vec3; 3]>,
    names: Vec<[u32; 3]>,
    pub longest: f32,
    /// The largest factor by which an edge is too long.
    excess: f32,
}

impl Triangles {
    /// Adds a triangle by its indices and corners. Edges longer than `length` are to be cut.
    pub fn add(&mut self, [a, b, c]: [u32; 3], corners: [Vec3; 3], length: f32) {
        let [p, q, r] = corners;
        let sums = [
            edge(a, b).wrapping_add(edge(b, c)).wrapping_add(edge(c, a)),
            edge_of_places(p, q)
                .wrapping_add(edge_of_places(q, r))
                .wrapping_add(edge_of_places(r, p)),
        ];
        self.edges.iter_mut().zip(sums).for_each(|(sum, more)| *sum = sum.wrapping_add(more));
        self.sums.add_triangle(corners);
        self.surround([p.min(q).min(r), p.max(q).max(r)]);
        let edges = [(p, q), (q, r), (r, p)].map(|(a, b)| (a - b).length());
        // The edges of a narrow triangle may be longer, so it counts as shorter.
        let allowed = length * stretch(edges, length);
        let longest = edges[0].max(edges[1]).max(edges[2]);
        self.longest = self.longest.max(longest);
        self.excess = self.excess.max(longest / allowed);
        self.expected += pieces(edges.map(|edge| f64::from(edge / allowed)));
        if longest / allowed > 1.0 {
            self.long.push(corners);
            self.names.push([a, b, c]);
        }
    }

    fn surround(&mut self, [low, high]: [Vec3; 2]) {
        let [own_low, own_high] = self.bounds.unwrap_or([low, high]);
        self.bounds = Some([own_low.min(low), own_high.max(high)]);
    }

    pub fn join(&mut self, other: Self) {
        other.bounds.into_iter().for_each(|bounds| self.surround(bounds));
        self.edges
            .iter_mut()
            .zip(other.edges)
            .for_each(|(sum, more)| *sum = sum.wrapping_add(more));
        self.sums = self.sums.with(other.sums);
        self.expected += other.expected;
        self.long.extend(other.long);
        self.names.extend(other.names);
        self.longest = self.longest.max(other.longest);
        self.excess = self.excess.max(other.excess);
    }

    /// Counts the triangles that those with long edges are cut into, up to `room`.
    fn count_long(&mut self, length: f32, room: usize, deadline: Deadline) -> Result<()> {
        let mut vertices: Vec<u32> = self.names.as_flattened().to_vec();
        vertices.par_sort_unstable();
        vertices.dedup();
        let place = |name: u32| vertices.binary_search(&name).unwrap_or(0) as u32;
        let triangles: Vec<[u32; 3]> =
            self.names.par_iter().map(|names| names.map(place)).collect();
        let mut positions = vec![Vec3::ZERO; vertices.len()];
        for (triangle, corners) in triangles.iter().zip(&self.long) {
            triangle
                .iter()
                .zip(corners)
                .for_each(|(&vertex, corner)| positions[vertex as usize] = *corner);
        }
        let long = Mesh { positions, triangles, ..Mesh::default() };
        self.cut = count_once_cut(&long, length, room, deadline)?;
        Ok(())
    }
}

/// How the surfels of all parts of a mesh are made, so that they equal those of the whole.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct MeshPieces {
    whole: Whole,
    /// The longest edge that is not cut, unless its triangle is narrow.
    pub length: f32,
    pub closing: Option<PiecesClosing>,
}

/// How a mesh is closed, as in [`Mesh::is_closed`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum PiecesClosing {
    Vertices,
    Places,
}

impl MeshPieces {
    /// Prepares a mesh with this many points and triangles and with these `bounds`, relative to its
    /// origin. `visit(length)` visits its triangles with edges longer than `length` to be cut.
    /// Returns the result of the last visit as well. If cutting would give more than `room`
    /// triangles, `cut` of that result is an estimate above `room`.
    pub fn new(
        [points, triangles]: [usize; 2],
        [has_normals, has_uvs]: [bool; 2],
        bounds: [Vec3; 2],
        options: &SurfelOptions,
        room: usize,
        mut visit: impl FnMut(f32) -> Result<Triangles>,
    ) -> Result<(Self, Triangles)> {
        let budget = options.most_once_cut(triangles);
        let around_all = largest_edge(bounds, f64::INFINITY, options);
        let first = visit(around_all)?;
        // Vertices that no triangle uses do not count towards the bounds, and the area may limit
        // the length.
        let unit = largest_edge(first.bounds.unwrap_or_default(), first.sums.area() / 3.0, options);
        let mut first = (unit == around_all).then_some(first);
        let (length, seen) = affordable(
            unit,
            budget,
            |length| first.take().map_or_else(|| visit(length), Ok),
            |seen| {
                let whole = triangles.saturating_sub(seen.long.len()) as f64;
                Expected { whole, cut: seen.expected - whole }
            },
            |seen, length| {
                let others = triangles.saturating_sub(seen.long.len());
                let [room, budget] = [room, budget].map(|all| all.saturating_sub(others));
                seen.count_long(length, room.min(budget), options.deadline)?;
                Ok(seen.cut <= budget || room < budget)
            },
        )?;
        let closing = if seen.edges[0] == 0 {
            Some(PiecesClosing::Vertices)
        } else {
            let is_closed =
                seen.edges[1] == 0 && may_be_split(has_uvs || has_normals, points, triangles);
            is_closed.then_some(PiecesClosing::Places)
        };
        let outward = if seen.sums.side(1.0) < 0 { -1.0 } else { 1.0 };
        let closing = closing.filter(|_| triangles > 0);
        let whole = Whole {
            is_split: may_be_split(has_uvs, points, triangles),
            is_coarse: seen.excess > 1.0,
            unit,
            outward,
        };
        Ok((Self { whole, length, closing }, seen))
    }

    /// Checks numbers that come from a file. An error names the field.
    pub fn check(&self) -> Result<(), String> {
        let (Whole { unit, outward, .. }, length) = (self.whole, self.length);
        if !(unit >= 0.0 && unit.is_finite()) {
            Err(format!("whole.unit is {unit}; a length is expected"))
        } else if outward.abs() != 1.0 {
            Err(format!("whole.outward is {outward}; 1 or -1 is expected"))
        } else if !(length >= unit && length.is_finite()) {
            Err(format!("length is {length}; at least the unit, {unit}, is expected"))
        } else {
            Ok(())
        }
    }

    /// The longest edge after cutting.
    pub fn longest(&self) -> f32 {
        self.length * STRETCH
    }

    /// Makes the surfels of the `owned` vertices of a part, which must contain all triangles at
    /// them. With `most`, also makes the surfels that cutting long edges adds. The part must then
    /// contain all triangles that are cut. There are at most that many triangles afterwards.
    pub fn surfels(
        &self,
        part: &Mesh,
        owned: &[bool],
        most: Option<usize>,
        options: &SurfelOptions,
    ) -> Result<Vec<Splat>> {
        part.check(options)?;
        let is_wanted = |vertex: usize| owned.get(vertex).is_none_or(|&owned| owned);
        let cut = most.map(|most| (self.length, most));
        of_part(part, self.whole, options, cut, is_wanted)
    }
}

/// Makes the surfels of the `owned` points of a part of a point cloud, with their indices. The
/// other points are neighbours.
pub(crate) fn cloud_piece(
    part: &Mesh,
    owned: &[bool],
    known: Known,
    options: &SurfelOptions,
) -> Result<Vec<(u32, Splat)>> {
    part.check(options)?;
    cloud::some_surfels(part, options, known, |point| owned[point])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::refine::count_of_refined;

    fn seen(mesh: &Mesh, length: f32) -> Triangles {
        let mut seen = Triangles::default();
        for &triangle in &mesh.triangles {
            seen.add(triangle, triangle.map(|vertex| mesh.positions[vertex as usize]), length);
        }
        seen
    }

    /// A few long triangles below a scan that already has as many triangles as the budget. The long
    /// ones are cut, and the scan is visited only a few times.
    #[test]
    fn the_long_ones_of_a_large_scan_are_cut() {
        let mut mesh = Mesh::cube(1.0);
        let scan = Mesh::sphere(5);
        mesh.triangles
            .extend(scan.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + 8)));
        mesh.positions.extend(scan.positions.iter().map(|place| *place * 0.02));
        let counts = [mesh.positions.len(), mesh.triangles.len()];
        let options = SurfelOptions { most_triangles: counts[1], ..SurfelOptions::default() };
        let mut visits = 0;
        let visit = |length: f32| {
            visits += 1;
            Ok(seen(&mesh, length))
        };
        let (pieces, last) = MeshPieces::new(
            counts,
            [false; 2],
            [Vec3::splat(-1.0), Vec3::ONE],
            &options,
            usize::MAX,
            visit,
        )
        .unwrap();
        assert!(
            pieces.whole.unit < 0.1 && last.cut > counts[1] / 20,
            "{} and {}",
            pieces.whole.unit,
            last.cut
        );
        assert!(visits < 8, "{visits} visits");
        let fine = mesh.triangles_once_cut(&options, usize::MAX).unwrap();
        assert_eq!(fine, counts[1] - last.long.len() + last.cut);
    }

    /// Pieces are cut like the whole mesh, also with a budget, and never further than `room`
    /// allows.
    #[test]
    fn the_budget_is_that_of_the_whole() {
        let mut mixed = Mesh::cube(1.0);
        let small = Mesh::sphere(2);
        mixed
            .triangles
            .extend(small.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + 8)));
        mixed.positions.extend(small.positions.iter().map(|place| *place * 0.2));
        for mesh in [Mesh::cube(1.0), Mesh::sphere(1), mixed] {
            for most_triangles in [300, 500, 900, 1000, 1500, 2000, 5000] {
                let options = SurfelOptions {
                    most_triangles,
                    largest_spacing: 1e-3,
                    ..SurfelOptions::default()
                };
                let bounds = [
                    mesh.positions.iter().copied().reduce(Vec3::min),
                    mesh.positions.iter().copied().reduce(Vec3::max),
                ];
                let pieces = |room: usize| {
                    let counts = [mesh.positions.len(), mesh.triangles.len()];
                    MeshPieces::new(
                        counts,
                        [false; 2],
                        bounds.map(Option::unwrap),
                        &options,
                        room,
                        |length| Ok(seen(&mesh, length)),
                    )
                };
                let (pieces_of_all, last) = pieces(usize::MAX).unwrap();
                let count = mesh.triangles.len() - last.long.len() + last.cut;
                let whole = count_of_refined(
                    &mesh,
                    pieces_of_all.whole.unit,
                    most_triangles,
                    usize::MAX,
                    Deadline::NEVER,
                );
                assert_eq!(count, whole.unwrap());
                assert!(
                    count <= options.most_once_cut(mesh.triangles.len()),
                    "{count} of {most_triangles}"
                );
                let (_, last) = pieces(count - 1).unwrap();
                assert!(mesh.triangles.len() - last.long.len() + last.cut >= count);
            }
        }
    }
}

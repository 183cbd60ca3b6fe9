//! The creases of sculptures: scans, and shapes that artists make. Their triangles follow a surface
//! that is curved everywhere. Where it turns within a few of them, as at the rim of an ear, single
//! edges are sharp by chance, and a crease that begins and ends there looks like a dash.
//!
//! So an edge is a crease of a sculpture only if it is part of a line of sharp edges: one that
//! closes, or that is long. All triangles between the creases at a vertex share a normal.
//!
//! Shapes from construction programs have edges between triangles of one plane, and creases and
//! bevels that may be one triangle long. They are grouped by the directions of their triangles.

use super::Mesh;
use crate::parallel::prelude::*;
use glam::Vec3;
use std::collections::HashMap;

/// Two triangles are of one plane if the cosine of their angle is above this: half a degree.
const FLAT: f32 = 0.999_962;
/// A sculpture has no more edges in planes than this share of all, and at least so many edges.
const MOST_FLAT: f64 = 0.1;
const LEAST_EDGES: usize = 1000;
/// A line of sharp edges that does not close is a crease if it is long or very sharp. It is long if
/// it has so many edges, or this share of the mesh's diagonal. [`SHARP`] is a cosine.
const LONG_EDGES: usize = 16;
const LONG_SHARE: f32 = 0.05;
const SHARP: f32 = -0.5;

/// The edges that are creases, each from its smaller vertex to the larger one; sorted.
pub(super) struct Creases(Vec<[u32; 2]>);

/// An edge at which two triangles meet.
struct Edge {
    ends: [u32; 2],
    /// Cosine of the angle between the triangles' normals.
    cosine: f32,
}

/// The corners of a vertex, in the order of the other vertices of their triangles.
pub(super) struct Fan {
    /// A vertex at the far end of an edge, and the place of the corner among those of the vertex.
    sides: Vec<(u32, usize)>,
    /// The corners by groups.
    groups: Vec<(usize, u32)>,
}

impl Fan {
    pub fn new() -> Self {
        Self { sides: Vec::new(), groups: Vec::new() }
    }

    /// Takes the corners of a vertex.
    fn set(&mut self, triangles: &[[u32; 3]], corners: &[u32]) {
        self.sides.clear();
        for (place, &at) in corners.iter().enumerate() {
            let (triangle, corner) = (triangles[at as usize / 3], at as usize % 3);
            self.sides.push((triangle[(corner + 1) % 3], place));
            self.sides.push((triangle[(corner + 2) % 3], place));
        }
        self.sides.sort_unstable();
    }

    /// Returns the far ends of edges, each with two corners that meet there.
    fn edges(&self) -> impl Iterator<Item = (u32, [usize; 2])> {
        let meet = |pair: &[(u32, usize)]| {
            (pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1)
                .then_some((pair[0].0, [pair[0].1, pair[1].1]))
        };
        self.sides.windows(2).filter_map(meet)
    }
}

impl Creases {
    /// Returns the creases of a mesh if it is a sculpture. `triangles` have the vertices whose
    /// `corners` are known, and `normals` are their unit normals, or zero. `crease` is the cosine
    /// of the angle at a crease.
    pub fn of_sculpture<'a>(
        mesh: &Mesh,
        triangles: &[[u32; 3]],
        normals: &[Vec3],
        (corners, crease): (impl Fn(usize) -> &'a [u32] + Sync, f32),
    ) -> Option<Self> {
        let at_vertex = |fan: &mut Fan, vertex: usize| {
            let corners = corners(vertex);
            fan.set(triangles, corners);
            let (mut all, mut flat, mut sharp) = (0, 0, Vec::new());
            for (other, pair) in fan.edges().filter(|(other, _)| *other as usize > vertex) {
                let [a, b] = pair.map(|place| normals[corners[place] as usize / 3]);
                let cosine = a.dot(b);
                all += 1;
                flat += usize::from(cosine > FLAT);
                if cosine < crease && a != Vec3::ZERO && b != Vec3::ZERO {
                    sharp.push(Edge { ends: [vertex as u32, other], cosine });
                }
            }
            (all, flat, sharp)
        };
        let join = |mut a: (usize, usize, Vec<Edge>), mut b: (usize, usize, Vec<Edge>)| {
            a.2.append(&mut b.2);
            (a.0 + b.0, a.1 + b.1, a.2)
        };
        let found: Vec<_> =
            (0..mesh.positions.len()).into_par_iter().map_init(Fan::new, at_vertex).collect();
        let (all, flat, sharp) = found.into_iter().fold((0, 0, Vec::new()), join);
        let is_sculpture = all >= LEAST_EDGES && flat as f64 <= MOST_FLAT * all as f64;
        is_sculpture.then(|| Self::of_lines(mesh, &sharp))
    }

    /// Keeps the edges of lines that are creases.
    fn of_lines(mesh: &Mesh, sharp: &[Edge]) -> Self {
        let mut lines = Lines::default();
        sharp.iter().for_each(|edge| lines.join(edge.ends));
        let length = |edge: &Edge| {
            let [a, b] = edge.ends.map(|vertex| mesh.positions[vertex as usize]);
            a.distance(b)
        };
        // Edges, length, the smallest cosine, and open ends of each line.
        let mut found: HashMap<u32, (usize, f32, f32, usize)> = HashMap::new();
        for edge in sharp {
            let line = found.entry(lines.line_of(edge.ends[0])).or_insert((0, 0.0, 1.0, 0));
            let (edges, whole, cosine, ends) = *line;
            let open = edge.ends.iter().filter(|end| lines.edges_at[*end] == 1).count();
            *line = (edges + 1, whole + length(edge), cosine.min(edge.cosine), ends + open);
        }
        let diagonal = mesh.bounds().map_or(0.0, |bounds| bounds.diagonal()) as f32;
        let is_crease = |&(edges, length, cosine, ends): &(usize, f32, f32, usize)| {
            ends == 0 || edges >= LONG_EDGES || length >= LONG_SHARE * diagonal || cosine < SHARP
        };
        let kept = sharp.iter().filter(|edge| is_crease(&found[&lines.line_of(edge.ends[0])]));
        let mut kept: Vec<[u32; 2]> = kept.map(|edge| edge.ends).collect();
        kept.sort_unstable();
        Self(kept)
    }

    fn is_crease(&self, a: u32, b: u32) -> bool {
        !self.0.is_empty() && self.0.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// Returns the corners of a vertex, each behind its group, by groups. Corners of one group are
    /// connected by edges that are no creases.
    pub fn groups<'a>(
        &self,
        fan: &'a mut Fan,
        triangles: &[[u32; 3]],
        (vertex, corners): (usize, &[u32]),
    ) -> &'a [(usize, u32)] {
        fan.set(triangles, corners);
        let mut parents: Vec<usize> = (0..corners.len()).collect();
        let root = |parents: &mut [usize], mut at: usize| {
            while parents[at] != at {
                parents[at] = parents[parents[at]];
                at = parents[at];
            }
            at
        };
        for (other, pair) in fan.edges() {
            if !self.is_crease(vertex as u32, other) {
                let [from, to] = pair.map(|place| root(&mut parents, place));
                parents[from] = to;
            }
        }
        fan.groups.clear();
        for (place, &at) in corners.iter().enumerate() {
            fan.groups.push((root(&mut parents, place), at));
        }
        fan.groups.sort_unstable();
        &fan.groups
    }
}

/// Edges that are joined to lines where they share a vertex.
#[derive(Default)]
struct Lines {
    parents: HashMap<u32, u32>,
    edges_at: HashMap<u32, usize>,
}

impl Lines {
    fn join(&mut self, ends: [u32; 2]) {
        ends.iter().for_each(|end| *self.edges_at.entry(*end).or_default() += 1);
        let [a, b] = ends.map(|end| self.line_of(end));
        if a != b {
            self.parents.insert(a, b);
        }
    }

    /// Returns the vertex that stands for the line of a vertex.
    fn line_of(&self, mut vertex: u32) -> u32 {
        while let Some(&parent) = self.parents.get(&vertex) {
            vertex = parent;
        }
        vertex
    }
}

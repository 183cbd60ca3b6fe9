//! Cutting large triangles, so that surfels at the corners stay small.
//!
//! Each round halves the longest edges of every triangle that has edges over the wanted length, and
//! cuts the triangles beside them in two, three or four. Both neighbours of an edge see it halved,
//! so no gap opens between them. Halving would also multiply needles (two long edges and a short
//! one) across their width, so these are cut into slabs.

use super::{
    Mesh, Texture,
    smooth::{Grouping, corner_normals},
};
use crate::{Deadline, Result, memory, parallel::prelude::*};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::borrow::Cow;

/// A texture is sampled about this many texels apart …
const TEXELS: f32 = 1.5;
/// … but no closer than this fraction of the longest allowed edge.
const FINEST: f32 = 1.0 / 8.0;

/// A triangle is narrow if its shortest edge is at most this fraction of the longest allowed one …
const NARROW: f32 = 1.0 / 8.0;
/// … and then its edges may be this many times as long. An ellipse can be just as long and narrow,
/// whereas cutting across would give many.
pub(super) const STRETCH: f32 = 2.5;

/// If a texture repeats this often between two of its finest samples, it cannot be resolved: its
/// triangle is not cut for it.
const MOST_REPEATS: f64 = 16.0;

/// The name of this module's work in errors.
const WORK: &str = "cutting long triangles";

/// With too many triangles, lengths grow by whole steps of this factor. Two passes over the same
/// triangles then take the same number of steps, in whatever order they add them up.
const STEP: f64 = 1.05;

/// Which edges may stay uncut.
struct Wanted<'a> {
    mesh: &'a Mesh,
    /// The longest edge that the caller asked for.
    asked: f32,
    to_texels: bool,
    length: f32,
    /// Factor on [`TEXELS`] and [`FINEST`] that keeps to the budget.
    coarser: f32,
    steps: i32,
    /// Triangles whose texture cannot be resolved; empty if the mesh has no texture.
    is_blurred: Vec<bool>,
}

/// How far a mesh is cut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cutting {
    /// The longest edge, in the mesh's unit.
    pub length: f32,
    /// Whether textured triangles are cut to about the size of the texels.
    pub to_texels: bool,
}

impl From<f32> for Cutting {
    fn from(length: f32) -> Self {
        Self { length, to_texels: true }
    }
}

/// A mesh of small triangles.
pub(super) struct Refined<'a> {
    pub mesh: Cow<'a, Mesh>,
    /// The triangle of the original mesh that each was cut from; `None` if nothing was cut.
    pub sources: Option<Vec<u32>>,
}

/// Returns the mesh with triangles cut so far. If there would be more triangles than the
/// [`budget`], lengths grow.
///
/// # Errors
/// [`Error::Timeout`](crate::Error::Timeout) and [`Error::Memory`](crate::Error::Memory).
pub(super) fn refine(
    mesh: &Mesh,
    cutting: impl Into<Cutting>,
    most: usize,
    deadline: Deadline,
) -> Result<Refined<'_>> {
    let mut fine = match refined(mesh, cutting.into(), most, usize::MAX, deadline) {
        Ok(Some(fine)) => fine,
        Ok(None) | Err(Stop::TooMany(_)) => {
            return Ok(Refined { mesh: Cow::Borrowed(mesh), sources: None });
        }
        Err(Stop::Failed(error)) => return Err(error),
    };
    let sources = std::mem::take(&mut fine.triangle_materials);
    if !mesh.triangle_materials.is_empty() {
        fine.triangle_materials =
            sources.par_iter().map(|&source| mesh.triangle_materials[source as usize]).collect();
    }
    Ok(Refined { mesh: Cow::Owned(fine), sources: Some(sources) })
}

/// Returns the most triangles after cutting: `most`, or an eighth more than there are. The latter
/// lets the few long triangles of a large scan be cut too.
pub(super) fn budget(most: usize, triangles: usize) -> usize {
    most.max(triangles.saturating_add(triangles / 8))
}

/// How many triangles to expect.
#[derive(Clone, Copy, Default)]
pub(super) struct Expected {
    /// Triangles that stay whole.
    pub whole: f64,
    /// Estimated pieces of the other triangles.
    pub cut: f64,
}

impl Expected {
    fn all(self) -> f64 {
        self.whole + self.cut
    }

    fn with(self, other: Self) -> Self {
        Self { whole: self.whole + other.whole, cut: self.cut + other.cut }
    }

    /// Returns by how many steps lengths have to grow. Longer lengths do not reduce the triangles
    /// that stay whole.
    fn steps(self, budget: usize) -> i32 {
        let wanted = (self.cut / (budget as f64 - self.whole).max(1.0)).sqrt().ln() / STEP.ln();
        wanted.ceil().clamp(1.0, 1e3) as i32
    }
}

/// Returns the steps to take after `failed` attempts gave too many triangles. The first are single
/// steps, because estimates are nearly right for scans and modelled meshes. Later ones double, so
/// that any input needs few attempts.
fn steps_after(failed: u32) -> i32 {
    1 << failed.saturating_sub(SINGLE_STEPS).min(9)
}

const SINGLE_STEPS: u32 = 24;

/// Why cutting ended early.
#[derive(Debug)]
enum Stop {
    /// There would be more triangles than allowed. Holds an estimate of their number.
    TooMany(usize),
    Failed(crate::Error),
}

impl From<crate::Error> for Stop {
    fn from(error: crate::Error) -> Self {
        Self::Failed(error)
    }
}

/// Like [`refine`], but the material of each triangle is the number of the triangle that it was cut
/// from. `None` if nothing is to be cut.
///
/// # Errors
/// [`Stop::TooMany`] for more than `room` triangles, before there are that many.
fn refined(
    mesh: &Mesh,
    cutting: Cutting,
    most: usize,
    room: usize,
    deadline: Deadline,
) -> std::result::Result<Option<Mesh>, Stop> {
    let mut wanted = Wanted::new(mesh, cutting);
    if wanted.are_small() {
        return Ok(None);
    }
    let budget = budget(most, mesh.triangles.len());
    let mut failed = 0;
    loop {
        deadline.check(WORK)?;
        let expected = wanted.expected();
        if expected.all() > budget as f64 {
            wanted.coarsen(expected.steps(budget));
            continue;
        }
        // A triangle is also cut if its neighbours are, so only cutting gives the exact number.
        memory::room(WORK, mesh.bytes().saturating_add(4 * mesh.triangles.len() as u64))?;
        let mut fine =
            Mesh { triangle_materials: (0..mesh.triangles.len() as u32).collect(), ..mesh.clone() };
        match cut_all(&mut fine, &wanted, budget.min(room), deadline) {
            Ok(()) => return Ok(Some(fine)),
            Err(Stop::TooMany(_)) if room < budget => {
                return Err(Stop::TooMany((expected.all() as usize).max(room + 1)));
            }
            Err(Stop::TooMany(_)) => {
                wanted.coarsen(steps_after(failed));
                failed += 1;
            }
            Err(error) => return Err(error),
        }
    }
}

/// The triangles that those of a refined mesh were cut from.
pub(super) struct Origin<'a> {
    mesh: &'a Mesh,
    sources: Vec<u32>,
    normals: Vec<[Vec3; 3]>,
}

impl<'a> Origin<'a> {
    pub fn new(
        mesh: &'a Mesh,
        sources: Vec<u32>,
        crease: (f32, Grouping),
        deadline: Deadline,
    ) -> Result<Self> {
        Ok(Self { mesh, sources, normals: corner_normals(mesh, crease, deadline)? })
    }

    /// Returns the normal at a corner of the `fine` mesh, interpolated between those of the
    /// original triangle. It is not normalised.
    pub fn normal(&self, fine: &Mesh, at: u32) -> Vec3 {
        let source = self.sources[at as usize / 3] as usize;
        let [a, b, c] = self.mesh.triangles[source]
            .map(|vertex| self.mesh.positions[vertex as usize].as_dvec3());
        let place =
            fine.positions[fine.triangles[at as usize / 3][at as usize % 3] as usize].as_dvec3();
        let cross = (b - a).cross(c - a);
        let part = |from: DVec3, to: DVec3| {
            (from - place).cross(to - place).dot(cross) / cross.length_squared()
        };
        let weights = [part(b, c), part(c, a), part(a, b)];
        self.normals[source]
            .iter()
            .zip(weights)
            .map(|(normal, weight)| *normal * weight as f32)
            .sum()
    }
}

/// Returns the number of triangles after the mesh is refined. If there are more than `room`, the
/// result is an estimate above `room`.
///
/// # Errors
/// As [`refine`].
pub(super) fn count_of_refined(
    mesh: &Mesh,
    length: f32,
    most: usize,
    room: usize,
    deadline: Deadline,
) -> Result<usize> {
    if is_fine(mesh, length) {
        deadline.check(WORK)?;
        return Ok(mesh.triangles.len());
    }
    memory::room(WORK, mesh.bytes())?;
    let Mesh { positions, uvs, triangles, triangle_materials, materials, .. } = mesh;
    let bare = Mesh {
        positions: positions.clone(),
        uvs: uvs.clone(),
        triangles: triangles.clone(),
        triangle_materials: triangle_materials.clone(),
        materials: materials.clone(),
        ..Mesh::default()
    };
    match refined(&bare, length.into(), most, room, deadline) {
        Ok(fine) => Ok(fine.unwrap_or(bare).triangles.len()),
        Err(Stop::TooMany(about)) => Ok(about),
        Err(Stop::Failed(error)) => Err(error),
    }
}

/// Returns the number of triangles after those of a mesh without texture are cut until no edge is
/// longer than `length`. If there are more than `room`, the result is an estimate above `room`.
///
/// # Errors
/// As [`refine`].
pub(super) fn count_once_cut(
    mesh: &Mesh,
    length: f32,
    room: usize,
    deadline: Deadline,
) -> Result<usize> {
    count_of_refined(mesh, length, usize::MAX, room, deadline)
}

/// Chooses the longest edge without texture for a budget of triangles that the input does not
/// exceed: `length`, or longer, as [`refine`] chooses it. `visit` visits the triangles for a
/// length, and `expected` estimates how many there will be. `fits` cuts them and returns whether
/// the exact number keeps to the budget.
pub(super) fn affordable<S, E>(
    length: f32,
    budget: usize,
    mut visit: impl FnMut(f32) -> std::result::Result<S, E>,
    expected: impl Fn(&S) -> Expected,
    mut fits: impl FnMut(&mut S, f32) -> std::result::Result<bool, E>,
) -> std::result::Result<(f32, S), E> {
    let (mut taken, mut failed) = (0, 0);
    loop {
        let length = length * coarser(taken).max(1.0);
        let mut seen = visit(length)?;
        let expected = expected(&seen);
        if expected.all() > budget as f64 {
            taken += expected.steps(budget);
        } else if fits(&mut seen, length)? {
            return Ok((length, seen));
        } else {
            taken += steps_after(failed);
            failed += 1;
        }
    }
}

/// Returns the factor on lengths after this many steps.
fn coarser(steps: i32) -> f32 {
    STEP.powi(steps) as f32
}

/// Cuts until every edge may stay.
///
/// # Errors
/// [`Stop::TooMany`] for more than `most` triangles, before there are that many.
fn cut_all(
    fine: &mut Mesh,
    wanted: &Wanted,
    most: usize,
    deadline: Deadline,
) -> std::result::Result<(), Stop> {
    // Triangles before `settled` have no long edge.
    let mut settled = 0;
    loop {
        deadline.check(WORK)?;
        slice_needles(fine, wanted, settled, most)?;
        // At most three edges per triangle are marked, in one list per task and in one joint list.
        let open = (fine.triangles.len() - settled) as u64;
        memory::room(WORK, open.saturating_mul(6 * size_of::<(u32, u32)>() as u64))?;
        let mut marked = marked_edges(fine, wanted, settled);
        if marked.is_empty() || fine.positions.len() + marked.len() > u32::MAX as usize {
            return Ok(());
        }
        marked.par_sort_unstable();
        marked.dedup();
        settled = cut(fine, &marked, settled, most)?;
    }
}

impl<'a> Wanted<'a> {
    fn new(mesh: &'a Mesh, Cutting { length, to_texels }: Cutting) -> Self {
        let (coarser, steps, is_blurred) = (1.0, 0, Vec::new());
        let mut wanted =
            Self { mesh, asked: length, length, to_texels, coarser, steps, is_blurred };
        wanted.coarsen(0);
        if wanted.is_textured() {
            let triangles = mesh.triangles.par_iter().enumerate();
            wanted.is_blurred = triangles.map(|(index, t)| wanted.is_blurred(index, t)).collect();
        }
        wanted
    }

    /// Returns whether a triangle's texture runs too fast along an edge to be resolved, however
    /// finely the edge is cut.
    fn is_blurred(&self, triangle: usize, t: &[u32; 3]) -> bool {
        let Some(texture) = self.texture(triangle) else { return false };
        let size = DVec2::new(texture.width.into(), texture.height.into());
        let finest = f64::from(self.asked * FINEST);
        [(0, 1), (1, 2), (2, 0)].iter().any(|&(i, j)| {
            let ends = [t[i] as usize, t[j] as usize];
            let [a, b] = ends.map(|vertex| self.mesh.positions[vertex].as_dvec3());
            let [Some(from), Some(to)] = ends.map(|vertex| self.mesh.uvs.get(vertex)) else {
                return false;
            };
            let texels = ((from.as_dvec2() - to.as_dvec2()) * size).length();
            // Shorter edges are not cut anyway.
            let parts = a.distance(b) / finest;
            parts > 1.0 && texels > MOST_REPEATS * size.max_element() * parts
        })
    }

    /// Returns the texture of a triangle of the mesh.
    fn texture(&self, triangle: usize) -> Option<&Texture> {
        let &material = self.mesh.triangle_materials.get(triangle)?;
        self.mesh.materials[material as usize].texture.as_deref()
    }

    fn is_textured(&self) -> bool {
        self.to_texels
            && !self.mesh.uvs.is_empty()
            && self.mesh.materials.iter().any(|material| material.texture.is_some())
    }

    /// Takes this many steps. Textured triangles become coarser first, up to the length of others.
    fn coarsen(&mut self, steps: i32) {
        self.steps = self.steps.saturating_add(steps);
        let first = if self.is_textured() { 1.0 } else { 1.0 / FINEST };
        self.coarser = first * coarser(self.steps);
        self.length = self.asked * (self.coarser * FINEST).max(1.0);
    }

    /// Returns the length of an edge in texels of its triangle's texture; 0 without one.
    fn texels(&self, mesh: &Mesh, source: usize, a: u32, b: u32) -> f32 {
        // Empty without textures, or if they do not count.
        if self.is_blurred.get(source).is_none_or(|is_blurred| *is_blurred) {
            return 0.0;
        }
        let Some(texture) = self.texture(source) else { return 0.0 };
        let (Some(&a), Some(&b)) = (mesh.uvs.get(a as usize), mesh.uvs.get(b as usize)) else {
            return 0.0;
        };
        ((a - b) * Vec2::new(texture.width as f32, texture.height as f32)).length()
    }

    /// Returns how many times too long an edge is in a triangle of this stretch; up to 1 it may
    /// stay. An edge whose midpoint is not distinct in 32 bits stays.
    fn excess(&self, mesh: &Mesh, source: usize, stretch: f32, [a, b]: [u32; 2]) -> f32 {
        let ends = [mesh.positions[a as usize], mesh.positions[b as usize]];
        if ends.contains(&(ends[0] * 0.5 + ends[1] * 0.5)) {
            return 0.0;
        }
        let length = (ends[0] - ends[1]).length();
        let texels = self.texels(mesh, source, a, b) / (TEXELS * self.coarser);
        let finest = length / (self.length * FINEST * self.coarser).min(self.length);
        (length / (self.length * stretch)).max(texels.min(finest))
    }

    /// Returns how many times too long each edge of a triangle is, starting at the first corner.
    fn excesses(&self, mesh: &Mesh, source: usize, t: [u32; 3]) -> [f32; 3] {
        let [a, b, c] = t.map(|vertex| mesh.positions[vertex as usize]);
        let stretch = stretch([a - b, b - c, c - a].map(Vec3::length), self.length);
        [(0, 1), (1, 2), (2, 0)].map(|(i, j)| self.excess(mesh, source, stretch, [t[i], t[j]]))
    }

    /// Returns whether a triangle of the mesh may stay whole.
    fn is_small(&self, triangle: usize, t: [u32; 3]) -> bool {
        self.excesses(self.mesh, triangle, t).iter().all(|excess| *excess <= 1.0)
    }

    /// Returns whether all triangles of the mesh may stay whole.
    fn are_small(&self) -> bool {
        self.mesh.triangles.par_iter().enumerate().all(|(index, &t)| self.is_small(index, t))
    }

    /// Estimates how many triangles there will be.
    fn expected(&self) -> Expected {
        let parts = |(source, t): (usize, &[u32; 3])| {
            let excess = self.excesses(self.mesh, source, *t).map(f64::from);
            let [a, b, c] = t.map(|vertex| self.mesh.positions[vertex as usize]);
            let edges = [a - b, b - c, c - a].map(Vec3::length);
            let stretch = stretch(edges, self.length);
            let plain = edges.map(|edge| f64::from(edge / (self.length * stretch)));
            // Lengths that texels dominate need not form a triangle. Then the longer two give an
            // upper bound.
            if excess.iter().all(|excess| *excess <= 1.0) {
                Expected { whole: 1.0, cut: 0.0 }
            } else if excess.iter().zip(plain).all(|(excess, plain)| *excess <= plain) {
                Expected { whole: 0.0, cut: pieces(excess) }
            } else {
                Expected { whole: 0.0, cut: most_pieces(excess) }
            }
        };
        self.mesh
            .triangles
            .par_iter()
            .enumerate()
            .map(parts)
            .reduce(Expected::default, Expected::with)
    }
}

/// Returns how many times the normal length the edges of a triangle may have, for a triangle of
/// these edges.
pub(super) fn stretch(edges: [f32; 3], length: f32) -> f32 {
    let shortest = edges[0].min(edges[1]).min(edges[2]);
    if shortest <= length * NARROW { STRETCH } else { 1.0 }
}

/// Returns whether no edge of the mesh has to be cut if `length` is the longest allowed.
pub(super) fn is_fine(mesh: &Mesh, length: f32) -> bool {
    Wanted::new(mesh, length.into()).are_small()
}

/// Estimates the pieces of a triangle whose edges are these many times too long.
pub(super) fn pieces([p, q, r]: [f64; 3]) -> f64 {
    if p.max(q).max(r) <= 1.0 {
        return 1.0;
    }
    // The triangle's area in units of the wanted length, by Heron's formula. A cut leaves edges of
    // about 0.7.
    let s = (p + q + r) * 0.5;
    let area = (s * (s - p) * (s - q) * (s - r)).max(0.0).sqrt();
    (area / 0.21).max(p.max(q).max(r)).max(1.0)
}

/// Returns an upper bound on the pieces of a triangle whose edges are these many times too long.
/// The lengths need not form a triangle.
fn most_pieces(mut edges: [f64; 3]) -> f64 {
    edges.sort_by(f64::total_cmp);
    let [short, middle, long] = edges;
    if long <= 1.0 {
        return 1.0;
    }
    (0.5 * short.max(1.0) * middle.max(1.0) / 0.21).max(long)
}

/// A needle's corners, starting at its tip, and the number of parts of its long edges.
struct Needle {
    triangle: usize,
    corners: [u32; 3],
    parts: u32,
}

/// Cuts triangles with two long edges and a short one into slabs across, each as long as allowed.
///
/// # Errors
/// [`Stop::TooMany`] for more than `most` triangles, before there are that many.
fn slice_needles(
    mesh: &mut Mesh,
    wanted: &Wanted,
    settled: usize,
    most: usize,
) -> std::result::Result<(), Stop> {
    let needles = needles(mesh, wanted, settled)?;
    if needles.is_empty() {
        return Ok(());
    }
    let mut chains = Chains::of(&needles)?;
    let slabs = |needle: &Needle| {
        let [tip, a, b] = needle.corners;
        [a, b].map(|corner| u64::from(chains.edges[chains.rank(tip, corner)].1) - 1)
    };
    let more = needles.iter().flat_map(slabs).sum::<u64>();
    if mesh.triangles.len() as u64 + more > most as u64 {
        return Err(Stop::TooMany(most));
    }
    let new = chains.place(mesh.positions.len())?;
    memory::reserve(&mut mesh.triangles, more as usize, WORK)?;
    memory::reserve(&mut mesh.triangle_materials, more as usize, WORK)?;
    let Some(new) = new else { return Ok(()) };
    add_vertices(mesh, &new)?;
    needles.iter().for_each(|needle| chains.slice(mesh, needle));
    Ok(())
}

/// Returns the triangles from `settled` on that have two long edges and a short one.
fn needles(mesh: &Mesh, wanted: &Wanted, settled: usize) -> Result<Vec<Needle>> {
    let needle = |(index, &t): (usize, &[u32; 3])| {
        let triangle = settled + index;
        let source = mesh.triangle_materials[triangle] as usize;
        let excess = wanted.excesses(mesh, source, t);
        let short = (0..3).min_by(|&i, &j| excess[i].total_cmp(&excess[j]))?;
        let longest = excess[(short + 1) % 3].max(excess[(short + 2) % 3]);
        let least = excess[(short + 1) % 3].min(excess[(short + 2) % 3]);
        // A slab's diagonal may be as long as an edge.
        let step = (1.0 - excess[short] * excess[short]).max(0.0).sqrt();
        let is_needle = excess[short] < 0.8 && least > 1.0 && longest > 2.0;
        let corners = [t[(short + 2) % 3], t[short], t[(short + 1) % 3]];
        is_needle.then(|| Needle {
            triangle,
            corners,
            parts: (longest / step).ceil().min(1e6) as u32,
        })
    };
    // One list per task and one joint list; then the edges of each needle.
    let open = (mesh.triangles.len() - settled) as u64;
    memory::room(WORK, open.saturating_mul(2 * size_of::<Needle>() as u64))?;
    Ok(mesh.triangles[settled..].par_iter().enumerate().filter_map(needle).collect())
}

/// The long edges of needles, each a chain of vertices.
struct Chains {
    /// Each edge, ascending, with the number of parts that the more demanding neighbour needs.
    edges: Vec<((u32, u32), u32)>,
    /// The first new vertex of each edge.
    starts: Vec<u32>,
}

impl Chains {
    fn of(needles: &[Needle]) -> Result<Self> {
        memory::room(WORK, needles.len() as u64 * 4 * size_of::<((u32, u32), u32)>() as u64)?;
        let mut edges: Vec<((u32, u32), u32)> = needles
            .iter()
            .flat_map(|n| [1, 2].map(|i| (sorted((n.corners[0], n.corners[i])), n.parts)))
            .collect();
        edges.par_sort_unstable_by_key(|&(edge, parts)| (edge, std::cmp::Reverse(parts)));
        edges.dedup_by_key(|&mut (edge, _)| edge);
        Ok(Self { edges, starts: Vec::new() })
    }

    fn rank(&self, a: u32, b: u32) -> usize {
        let edge = sorted((a, b));
        self.edges.binary_search_by_key(&edge, |&(edge, _)| edge).unwrap_or(0)
    }

    /// Numbers the new vertices, from `next` on. Returns where each lies on its edge; `None` if
    /// 32 bits cannot number them.
    fn place(&mut self, next: usize) -> Result<Option<Vec<(u32, u32, f32)>>> {
        let mut next = next as u64;
        let added = self.edges.iter().map(|&(_, parts)| u64::from(parts) - 1).sum::<u64>();
        let mut new = Vec::new();
        memory::reserve(&mut self.starts, self.edges.len(), WORK)?;
        memory::reserve(&mut new, added as usize, WORK)?;
        for &((a, b), parts) in &self.edges {
            self.starts.push(next as u32);
            next += u64::from(parts) - 1;
            new.extend((1..parts).map(|i| (a, b, i as f32 / parts as f32)));
        }
        Ok((next <= u64::from(u32::MAX)).then_some(new))
    }

    /// Returns the number of parts of an edge, and its vertices, which count from `from`.
    fn chain(&self, from: u32, to: u32) -> (u32, impl Fn(u32) -> u32 + use<>) {
        let rank = self.rank(from, to);
        let (((low, _), parts), start) = (self.edges[rank], self.starts[rank]);
        let vertex = move |i: u32| match i {
            0 => from,
            _ if i == parts => to,
            _ if low == from => start + i - 1,
            _ => start + parts - i - 1,
        };
        (parts, vertex)
    }

    /// Cuts a needle into slabs. The first one takes its place in the mesh.
    fn slice(&self, mesh: &mut Mesh, needle: &Needle) {
        let [tip, a, b] = needle.corners;
        let ((left, left_at), (right, right_at)) = (self.chain(tip, a), self.chain(tip, b));
        let source = mesh.triangle_materials[needle.triangle];
        mesh.triangles[needle.triangle] = [tip, left_at(1), right_at(1)];
        let (mut i, mut j) = (1, 1);
        while i < left || j < right {
            let on_left = j == right
                || (i < left
                    && u64::from(i + 1) * u64::from(right) <= u64::from(j + 1) * u64::from(left));
            let (l, r) = (left_at(i), right_at(j));
            if on_left {
                i += 1;
                mesh.triangles.push([l, left_at(i), r]);
            } else {
                j += 1;
                mesh.triangles.push([l, right_at(j), r]);
            }
            mesh.triangle_materials.push(source);
        }
    }
}

/// Returns every edge (smaller index first) that is too long for one of its triangles, possibly
/// twice.
fn marked_edges(mesh: &Mesh, wanted: &Wanted, settled: usize) -> Vec<(u32, u32)> {
    mesh.triangles[settled..]
        .par_iter()
        .enumerate()
        .flat_map_iter(|(index, &t)| {
            let edges = [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
            let source = mesh.triangle_materials[settled + index] as usize;
            let excess = wanted.excesses(mesh, source, t);
            // Only the longest, and those of similar length: a flat triangle is cut along its
            // length first.
            let least = (excess.iter().fold(0.0, |a: f32, &b| a.max(b)) * 0.7).max(1.0);
            edges
                .into_iter()
                .zip(excess)
                .filter_map(move |(edge, excess)| (excess > least).then_some(sorted(edge)))
        })
        .collect()
}

fn sorted((a, b): (u32, u32)) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// The pieces of a triangle, their number, and the triangle that they were cut from.
type Pieces = (([[u32; 3]; 4], usize), u32);

/// Halves the marked edges of the triangles from `settled` on. Afterwards the triangles without any
/// come first. Returns the new number of settled triangles.
///
/// # Errors
/// [`Stop::TooMany`] for more than `most` triangles, before there are that many.
fn cut(
    mesh: &mut Mesh,
    marked: &[(u32, u32)],
    settled: usize,
    most: usize,
) -> std::result::Result<usize, Stop> {
    let base = mesh.positions.len() as u32;
    let starts = starts_of(marked, mesh.positions.len())?;
    let rank = |edge: (u32, u32)| {
        let (low, high) = sorted(edge);
        let [from, to] = [0, 1].map(|by| starts[low as usize + by] as usize);
        marked[from..to].iter().position(|edge| edge.1 == high).map(|at| from + at)
    };
    let halves = |t: [u32; 3]| {
        [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]
            .map(|edge| rank(edge).map(|rank| base + rank as u32))
    };
    let count = |&t: &[u32; 3]| 1 + halves(t).iter().flatten().count();
    let all = settled + mesh.triangles[settled..].par_iter().map(count).sum::<usize>();
    if all > most {
        return Err(Stop::TooMany(most));
    }
    let mut middles = Vec::new();
    memory::reserve(&mut middles, marked.len(), WORK)?;
    middles.extend(marked.iter().map(|&(a, b)| (a, b, 0.5)));
    add_vertices(mesh, &middles)?;
    drop(middles);
    let more = all - mesh.triangles.len();
    memory::reserve(&mut mesh.triangles, more, WORK)?;
    memory::reserve(&mut mesh.triangle_materials, more, WORK)?;
    let positions = &mesh.positions;
    let open = &mesh.triangles[settled..];
    memory::room(WORK, open.len() as u64 * size_of::<Pieces>() as u64)?;
    let open = open.par_iter().zip(&mesh.triangle_materials[settled..]);
    let parts: Vec<Pieces> =
        open.map(|(&t, &source)| (split(t, halves(t), positions), source)).collect();
    mesh.triangles.truncate(settled);
    mesh.triangle_materials.truncate(settled);
    let mut now_settled = settled;
    for whole in [true, false] {
        for ((pieces, count), source) in &parts {
            if (*count == 1) == whole {
                mesh.triangles.extend_from_slice(&pieces[..*count]);
                mesh.triangle_materials.extend(std::iter::repeat_n(*source, *count));
            }
        }
        if whole {
            now_settled = mesh.triangles.len();
        }
    }
    Ok(now_settled)
}

/// Returns, for each of `count` vertices, the first of the ascending edges that begins there or
/// later, and at last their number. A vertex has few edges, so one is found at once.
fn starts_of(edges: &[(u32, u32)], count: usize) -> Result<Vec<u32>> {
    let mut starts = Vec::new();
    memory::reserve(&mut starts, count + 1, WORK)?;
    for (number, edge) in edges.iter().enumerate() {
        starts.resize(starts.len().max(edge.0 as usize + 1), number as u32);
    }
    starts.resize(count + 1, edges.len() as u32);
    Ok(starts)
}

/// Appends vertices between pairs of others, each at a fraction of the way.
fn add_vertices(mesh: &mut Mesh, new: &[(u32, u32, f32)]) -> Result<()> {
    fn extend<T: Copy + Send + Sync>(
        values: &mut Vec<T>,
        new: &[(u32, u32, f32)],
        mix: impl Fn(T, T, f32) -> T + Sync,
    ) -> Result<()> {
        if !values.is_empty() {
            memory::reserve(values, new.len(), WORK)?;
            memory::room(WORK, size_of_val(new) as u64)?;
            let between =
                |&(a, b, part): &(u32, u32, f32)| mix(values[a as usize], values[b as usize], part);
            let more: Vec<T> = new.par_iter().map(between).collect();
            values.extend(more);
        }
        Ok(())
    }
    // Written so that the midpoint is the same from either end: vertices that coincide continue to
    // do so.
    extend(&mut mesh.positions, new, |a: Vec3, b, part| a * (1.0 - part) + b * part)?;
    extend(&mut mesh.normals, new, |a: Vec3, b, part| a.lerp(b, part).normalize_or_zero())?;
    extend(&mut mesh.uvs, new, |a: Vec2, b, part| a.lerp(b, part))?;
    extend(&mut mesh.values, new, |a: f32, b, part| a * (1.0 - part) + b * part)?;
    extend(&mut mesh.colors, new, |a: [u8; 4], b, part| {
        std::array::from_fn(|i| {
            (f32::from(a[i]) * (1.0 - part) + f32::from(b[i]) * part).round() as u8
        })
    })
}

/// Returns the pieces of a triangle whose edges (0–1, 1–2, 2–0) have these midpoints.
fn split(t: [u32; 3], halves: [Option<u32>; 3], positions: &[Vec3]) -> ([[u32; 3]; 4], usize) {
    let none = [0; 3];
    let turn = |by: usize| [t[by % 3], t[(by + 1) % 3], t[(by + 2) % 3]];
    match halves {
        [None, None, None] => ([t, none, none, none], 1),
        [Some(x), Some(y), Some(z)] => ([[t[0], x, z], [x, t[1], y], [z, y, t[2]], [x, y, z]], 4),
        _ => {
            let count = halves.iter().flatten().count();
            // Rotated so that a single midpoint is on the first edge, and with two midpoints the
            // last edge has none.
            let by = (0..3).find(|&by| {
                let has = |i: usize| halves[(by + i) % 3].is_some();
                has(0) && !has(2) && (count == 1 || has(1))
            });
            let by = by.unwrap_or(0);
            let [a, b, c] = turn(by);
            let (Some(x), second) = (halves[by], halves[(by + 1) % 3]) else {
                return ([t, none, none, none], 1);
            };
            let Some(y) = second else { return ([[a, x, c], [x, b, c], none, none], 2) };
            let length =
                |i: u32, j: u32| positions[i as usize].distance_squared(positions[j as usize]);
            if length(a, y) <= length(x, c) {
                ([[x, b, y], [a, x, y], [a, y, c], none], 3)
            } else {
                ([[x, b, y], [a, x, c], [x, y, c], none], 3)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_begin_where_their_vertex_says() {
        let edges = [(1, 4), (1, 7), (3, 4), (8, 9)];
        let starts = starts_of(&edges, 10).unwrap();
        assert_eq!(starts, [0, 0, 2, 2, 3, 3, 3, 3, 3, 4, 4]);
        assert_eq!(starts_of(&[], 2).unwrap(), [0, 0, 0]);
    }

    const NEVER: Deadline = Deadline::NEVER;

    fn area(mesh: &Mesh) -> f32 {
        let corner = |i: u32| mesh.positions[i as usize];
        mesh.triangles
            .iter()
            .map(|t| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).z * 0.5)
            .sum()
    }

    fn one(c: Vec3) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, c],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    #[test]
    fn no_edge_stays_long_and_the_area_is_kept() {
        for apex in [Vec3::new(0.3, 0.8, 0.0), Vec3::new(0.5, 1e-3, 0.0), Vec3::new(0.0, 3.0, 0.0)]
        {
            let mesh = one(apex);
            let fine = refine(&mesh, 0.1, 1 << 20, NEVER).unwrap().mesh;
            for t in &fine.triangles {
                let edges = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
                    fine.positions[t[i] as usize].distance(fine.positions[t[j] as usize])
                });
                let most = if edges.iter().any(|edge| *edge <= 0.1 / 8.0) { 0.25 } else { 0.1 };
                assert!(edges.iter().all(|edge| *edge <= most * 1.001), "{edges:?}");
            }
            assert!((area(&fine) / area(&mesh) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn a_sliver_is_cut_along_its_length_only() {
        let mesh = one(Vec3::new(0.5, 1e-3, 0.0));
        assert!(refine(&mesh, 0.01, 1 << 20, NEVER).unwrap().mesh.triangles.len() < 400);
    }

    /// Whatever the triangles are like, and however small the excess is.
    #[test]
    fn the_budget_holds() {
        let apexes = [
            [0.3, 0.8],
            [0.5, 0.87],
            [0.0, 1.0],
            [0.5, 0.01],
            [0.02, 0.5],
            [-3.0, 0.5],
            [0.9, 1e-4],
        ];
        let meshes = apexes.map(|[x, y]| one(Vec3::new(x, y, 0.0))).into_iter();
        for (number, mesh) in meshes.chain([Mesh::sphere(2), Mesh::cube(1.0)]).enumerate() {
            let most = 2_000 + mesh.triangles.len();
            for length in [0.1, 0.05, 0.03, 0.025, 0.02, 0.015, 1e-2, 1e-3, 1e-4, 1e-9] {
                let fine = refine(&mesh, length, most, NEVER).unwrap().mesh;
                let count = fine.triangles.len();
                assert!(
                    count <= most && (length > 1e-3 || count > most / 6),
                    "{number}, {length}: {count}"
                );
                assert_eq!(
                    count_of_refined(&mesh, length, most, usize::MAX, NEVER).unwrap(),
                    count
                );
                assert!(count_of_refined(&mesh, length, most, count - 1, NEVER).unwrap() >= count);
            }
        }
    }

    #[test]
    fn small_triangles_are_borrowed() {
        assert!(refine(&one(Vec3::Y), 2.0, 100, NEVER).unwrap().sources.is_none());
    }

    #[test]
    fn normals_are_those_of_the_whole_triangles() {
        let sphere = Mesh::sphere(1);
        let fine = refine(&sphere, 0.1, 1 << 20, NEVER).unwrap();
        let origin =
            Origin::new(&sphere, fine.sources.unwrap(), (60.0, Grouping::Whole), NEVER).unwrap();
        for (index, triangle) in fine.mesh.triangles.iter().enumerate() {
            for (corner, &vertex) in triangle.iter().enumerate() {
                // Normals that change linearly over a triangle, like positions, stay the same.
                let normal = origin.normal(&fine.mesh, (3 * index + corner) as u32).normalize();
                assert!(
                    normal.dot(fine.mesh.positions[vertex as usize].normalize()) > 0.9999,
                    "{normal}"
                );
            }
        }
    }
}

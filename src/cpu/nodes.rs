//! The nodes of a page, and which of them a cut draws: the result of [`Cut::share`], for eight
//! nodes at a time.

use super::{
    project::normals,
    vector::{Lanes, dot, each, three},
};
use crate::{
    gaussians::{Colors, Eye},
    hierarchy::{
        BLEND_BAND, Cut, MOST_PIXELS, SHARE_UNIT, cone_margin,
        file::{CutSphere, NO_PAGE, Page},
        trained,
    },
    splat::Splat,
};
use fearless_simd::{Simd, mask32x8, prelude::*};
use glam::{DVec3, Vec3};

/// Number of nodes whose parents are tested together.
const RUN: usize = 64;

/// Spheres with sizes, as a structure of arrays: the centres' three coordinates, radii, sizes. The
/// arrays are padded to a multiple of eight with spheres of size 0.
#[derive(Debug)]
struct Spheres([Vec<f32>; 5]);

impl Spheres {
    fn new(spheres: impl Iterator<Item = CutSphere>, count: usize) -> Self {
        let mut parts: [Vec<f32>; 5] =
            std::array::from_fn(|_| Vec::with_capacity(count.next_multiple_of(8)));
        for sphere in spheres {
            let [x, y, z] = sphere.center;
            for (part, value) in parts.iter_mut().zip([x, y, z, sphere.radius, sphere.size]) {
                part.push(value);
            }
        }
        parts.iter_mut().for_each(|part| part.resize(count.next_multiple_of(8), 0.0));
        Self(parts)
    }

    /// Returns how far eight spheres are refined, in parts of [`SHARE_UNIT`].
    #[inline(always)]
    fn refinement<S: Simd>(&self, simd: S, cut: &Cut, first: usize) -> Lanes<S> {
        let [x, y, z, radius, size]: [Lanes<S>; 5] =
            each!([0, 1, 2, 3, 4], I => Lanes::from_slice(simd, &self.0[I][first..first + 8]));
        let mut pixels = size * cut.scale;
        if cut.perspective {
            let center = to_view(simd, cut, [x, y, z]);
            pixels /= (dot(center, center).sqrt() - radius).max(Lanes::splat(simd, 1e-30));
        }
        let widths = pixels.min(Lanes::splat(simd, MOST_PIXELS)) * cut.fineness;
        let excess = (widths - 1.0) / (BLEND_BAND - 1.0);
        let within = excess.max(Lanes::splat(simd, 0.0)).min(Lanes::splat(simd, 1.0));
        (within * SHARE_UNIT as f32 + 0.5).floor()
    }
}

/// The nodes of a page, as a structure of arrays.
#[derive(Debug)]
pub struct Nodes {
    pub splats: Vec<Splat>,
    /// The colours of trained Gaussians.
    pub colors: Option<Colors>,
    spheres: Spheres,
    cones: Vec<f32>,
    /// The index of each node's parent. The root of the tree has no parent; its index lies after
    /// the padding.
    parent: Vec<u32>,
    /// The page of each node's children.
    child_pages: Vec<u32>,
    parents: Spheres,
    /// The first and the last parent of each batch of nodes.
    runs: Vec<[u32; 2]>,
}

/// A drawn node, and its share in parts of [`SHARE_UNIT`].
pub type Drawn = (u32, f32);

impl Nodes {
    pub fn new(page: &Page) -> Self {
        let spheres = page.nodes.iter().enumerate().map(|(index, node)| CutSphere {
            // A portal is replaced by its block as soon as the block is in memory.
            size: if page.is_portal(index) { f32::MAX } else { node.size },
            ..CutSphere::of(node)
        });
        let count = page.parents.len();
        let root = count.next_multiple_of(8) as u32;
        let or_root = |parent: &u32| if (*parent as usize) < count { *parent } else { root };
        let parent: Vec<u32> = page.parent.iter().map(or_root).collect();
        let ends = |run: &[u32]| {
            run.iter().fold([u32::MAX, 0], |[low, high], index| [low.min(*index), high.max(*index)])
        };
        Self {
            splats: page.nodes.iter().map(|node| node.splat).collect(),
            colors: page.colors.clone(),
            spheres: Spheres::new(spheres, page.nodes.len()),
            cones: page.nodes.iter().map(|node| node.cone).collect(),
            runs: parent.chunks(RUN).map(ends).collect(),
            parent,
            child_pages: page.child_pages.clone(),
            parents: Spheres::new(page.parents.iter().copied(), count),
        }
    }

    /// Returns the bytes of memory of a number of nodes, without their parents, with colours of a
    /// degree if they have one.
    pub fn bytes_of(nodes: usize, degree: Option<u32>) -> u64 {
        let colors = degree.map_or(0, |degree| Colors::bytes_of(degree, nodes));
        (nodes * (size_of::<Splat>() + size_of::<CutSphere>() + 12)) as u64 + colors
    }

    pub fn bytes(&self) -> u64 {
        Self::bytes_of(self.splats.len(), self.colors.as_ref().map(Colors::degree))
            + (self.parents.0[0].len() * size_of::<CutSphere>()) as u64
    }

    /// Returns a node of a trained scene as an eye sees it, with its share.
    pub fn seen(&self, (node, share): Drawn, eye: Eye, origin: DVec3) -> Splat {
        let splat = &self.splats[node as usize];
        let place = origin + Vec3::from(splat.center).as_dvec3();
        let color = self
            .colors
            .as_ref()
            .map_or([0.0; 3], |colors| colors.seen(node as usize, eye.toward(place)));
        let is_leaf = self.child_pages[node as usize] == NO_PAGE;
        trained::drawn(splat, is_leaf, share / SHARE_UNIT as f32, color)
    }

    /// Returns the nodes that a cut draws, in order. `is_active` returns whether a page takes part.
    #[inline(always)]
    pub fn drawn<S: Simd>(
        &self,
        simd: S,
        cut: &Cut,
        is_active: impl Fn(u32) -> bool,
    ) -> Vec<Drawn> {
        let root = self.parents.0[0].len();
        let mut above = vec![SHARE_UNIT as f32; root + 1];
        for first in (0..root).step_by(8) {
            self.parents.refinement(simd, cut, first).store_slice(&mut above[first..first + 8]);
        }
        let mut drawn = Vec::new();
        let mut last_child = (NO_PAGE, false);
        for (run, [low, high]) in self.runs.iter().enumerate() {
            if above[*low as usize..=*high as usize].iter().all(|above| *above == 0.0) {
                continue;
            }
            let end = ((run + 1) * RUN).min(self.splats.len());
            for first in (run * RUN..end).step_by(8) {
                let count = (end - first).min(8);
                let (mut parent_shares, mut gives_way) = ([0.0f32; 8], [0.0f32; 8]);
                let nodes = self.parent[first..first + count]
                    .iter()
                    .zip(&self.child_pages[first..first + count]);
                for (lane, (parent, child)) in nodes.enumerate() {
                    if *child != last_child.0 {
                        last_child = (*child, *child != NO_PAGE && is_active(*child));
                    }
                    parent_shares[lane] = above[*parent as usize];
                    gives_way[lane] = f32::from(u8::from(last_child.1));
                }
                let parent_shares: Lanes<S> = parent_shares.simd_into(simd);
                if !parent_shares.simd_gt(0.0).any_true() {
                    continue;
                }
                let gives_way: Lanes<S> = gives_way.simd_into(simd);
                let shares = parent_shares - self.spheres.refinement(simd, cut, first) * gives_way;
                let mut bits = shares.simd_gt(0.0).to_bitmask();
                let shares: [f32; 8] = shares.into();
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize & 7;
                    bits &= bits - 1;
                    drawn.push(((first + lane) as u32, shares[lane]));
                }
            }
        }
        self.keep_seen(simd, cut, &mut drawn);
        drawn
    }

    /// Removes invisible nodes.
    #[inline(always)]
    fn keep_seen<S: Simd>(&self, simd: S, cut: &Cut, drawn: &mut Vec<Drawn>) {
        let mut kept = 0;
        for first in (0..drawn.len()).step_by(8) {
            let count = (drawn.len() - first).min(8);
            let mut nodes = [0; 8];
            for (node, entry) in nodes.iter_mut().zip(&drawn[first..first + count]) {
                *node = entry.0 as usize;
            }
            let mut seen = !self.are_hidden(simd, cut, nodes).to_bitmask() & ((1 << count) - 1);
            while seen != 0 {
                drawn[kept] = drawn[first + seen.trailing_zeros() as usize];
                seen &= seen - 1;
                kept += 1;
            }
        }
        drawn.truncate(kept);
    }

    /// Returns which of eight nodes' splats are invisible, because they lie beside the picture or
    /// face away.
    #[inline(always)]
    fn are_hidden<S: Simd>(&self, simd: S, cut: &Cut, nodes: [usize; 8]) -> mask32x8<S> {
        let (mut centers, mut ends) = ([[0.0f32; 8]; 3], [[0.0f32; 8]; 2]);
        for (lane, node) in nodes.into_iter().enumerate() {
            let [x, y, z] = self.splats[node].center;
            (centers[0][lane], centers[1][lane], centers[2][lane]) = (x, y, z);
            (ends[0][lane], ends[1][lane]) = (self.spheres.0[3][node], self.spheres.0[4][node]);
        }
        let [radius, size]: [Lanes<S>; 2] = each!([0, 1], I => ends[I].simd_into(simd));
        // A merged footprint may reach beyond the splats that it replaces.
        let reach = radius + size * 1.3;
        let center = to_view(simd, cut, three!(I => centers[I].simd_into(simd)));
        let mut hidden = mask32x8::splat(simd, false);
        for side in cut.sides {
            hidden |= (center[0] * side.x + center[1] * side.y + center[2] * side.z + side.w)
                .simd_lt(-reach);
        }
        if cut.perspective {
            hidden |= center[2].simd_lt(-reach);
        }
        if cut.culls { hidden | self.face_away(simd, cut, nodes, radius) } else { hidden }
    }

    /// Returns for which of eight nodes all normals of their cones face away.
    #[inline(always)]
    fn face_away<S: Simd>(
        &self,
        simd: S,
        cut: &Cut,
        nodes: [usize; 8],
        radius: Lanes<S>,
    ) -> mask32x8<S> {
        let (mut places, mut cones, mut packed) = ([[0.0f32; 8]; 3], [0.0f32; 8], [0i32; 8]);
        for (lane, node) in nodes.into_iter().enumerate() {
            for (places, part) in places.iter_mut().zip(&self.spheres.0) {
                places[lane] = part[node];
            }
            cones[lane] = self.cones[node];
            packed[lane] = self.splats[node].normal as i32;
        }
        let (normal, has_normal) = normals(simd, packed.simd_into(simd));
        let axis = turned(cut, normal);
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let (mut along, mut near) = (axis[2], none);
        if cut.perspective {
            let center = to_view(simd, cut, three!(I => places[I].simd_into(simd)));
            let inverse = one / dot(center, center).sqrt();
            (along, near) = (dot(axis, center) * inverse, radius * inverse);
        }
        let cone: Lanes<S> = cones.simd_into(simd);
        let cos_near = (one - near * near).max(none).sqrt();
        let sin_cone = (one - cone * cone).max(none).sqrt();
        let (sin_margin, cos_margin) = cone_margin();
        // Cosine and sine of cone + near + margin.
        let (c, s) = (cone * cos_near - sin_cone * near, sin_cone * cos_near + cone * near);
        let (c, s) = (c * cos_margin - s * sin_margin, s * cos_margin + c * sin_margin);
        let is_turned = along.simd_gt(0.0) & near.simd_lt(1.0) & c.simd_gt(0.0) & along.simd_ge(s);
        is_turned & has_normal & cone.simd_gt(0.0)
    }
}

#[inline(always)]
fn turned<S: Simd>(cut: &Cut, [x, y, z]: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    let [a, b, c] = cut.axes.map(|axis| axis.to_array());
    three!(I => x * a[I] + y * b[I] + z * c[I])
}

#[inline(always)]
fn to_view<S: Simd>(simd: S, cut: &Cut, place: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
    let (turned, origin) = (turned(cut, place), cut.origin.to_array());
    three!(I => turned[I] + Lanes::splat(simd, origin[I]))
}

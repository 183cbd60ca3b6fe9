//! Tight bounding spheres, each inside its parent's.
//!
//! The smallest sphere around other spheres is found by moving its centre towards the farthest of
//! them, in smaller and smaller steps (Bădoiu & Clarkson 2003).
//!
//! If spheres are built from children alone, they grow on the way up: each reaches beyond its
//! leaves, and its parent must contain that too. So the root gets the smallest sphere around the
//! leaves, and from there down every node gets one inside its parent's. That is the sphere around
//! its children if it fits, or around descendants some levels below, which reach out less.
//! Otherwise the centre moves towards the parent's centre until the sphere fits; at the parent's
//! own centre, it would be the parent's sphere.

use super::{Block, Node, merge::leaf};
use crate::{parallel::prelude::*, splat::Splat};
use fearless_simd::{Level, Simd, dispatch, f32x8, prelude::*};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sphere {
    pub center: DVec3,
    pub radius: f64,
}

/// Steps towards the smallest sphere, for all nodes and for the few high ones.
const FEW_ROUNDS: u32 = 4;
const MANY_ROUNDS: u32 = 16;
/// Nodes at least this many levels above the leaves are fitted to descendants below their children.
const FITTED_HEIGHT: u32 = 3;
/// How many levels below the children these descendants are.
const LEVELS_BELOW: u32 = 1;
/// If leaves lie on the surface of a sphere, any sphere inside the smallest one around all leaves
/// that contains some of them is nearly as large. If that would make the root of a block more than
/// `MOST_WIDER` times as wide as necessary, it may reach farther: `ROOM` times as far as the sphere
/// around all blocks.
const ROOM: f64 = 1.04;
const MOST_WIDER: f64 = 1.5;

impl Sphere {
    pub fn of(node: &Node) -> Self {
        Self { center: node.center().as_dvec3(), radius: f64::from(node.radius) }
    }

    /// Sets a node's sphere to this one, rounded so that it contains everything that this one
    /// contains.
    fn give(&self, node: &mut Node) {
        node.center = self.center.as_vec3().to_array();
        let shift = node.center().as_dvec3().distance(self.center);
        node.radius = ((self.radius + shift) as f32).next_up();
    }

    /// Returns how far the spheres reach from a centre.
    pub fn reach(center: DVec3, spheres: &[Self]) -> f64 {
        spheres.iter().map(|s| s.center.distance(center) + s.radius).fold(0.0, f64::max)
    }

    /// Returns a sphere around others that is nearly the smallest.
    pub fn around(spheres: &[Self], rounds: u32) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = spheres.iter().fold(none, |(low, high), s| {
            (low.min(s.center - s.radius), high.max(s.center + s.radius))
        });
        let mut center = (low + high) * 0.5;
        let mut best = Self { center, radius: f64::INFINITY };
        for round in 0..=rounds {
            let mut farthest = (-1.0, 0.0, center);
            for s in spheres {
                let distance = s.center.distance(center);
                if distance + s.radius > farthest.0 {
                    farthest = (distance + s.radius, distance, s.center);
                }
            }
            let (reach, distance, toward) = farthest;
            if reach < best.radius {
                best = Self { center, radius: reach };
            }
            if distance > 0.0 {
                center += (toward - center) * (reach / distance / f64::from(round + 2));
            }
        }
        best
    }

    /// Returns whether this sphere contains another. The margin covers rounding to 32 bits, both of
    /// the radius and of a centre far from the origin.
    fn holds(&self, other: &Self) -> bool {
        other.center.distance(self.center) + other.radius <= self.room()
    }

    /// Returns how far the contents of this sphere may reach from its centre.
    fn room(&self) -> f64 {
        let rounded = 4.0 * self.radius + 2.0 * self.center.abs().max_element();
        self.radius - rounded * f64::from(f32::EPSILON)
    }

    /// Returns a sphere around `spheres` that lies in `outer`, which contains them all. Its centre
    /// is on the segment between the centres of `self` and `outer`, as near to `self`'s as
    /// possible.
    fn moved_inside(self, outer: &Self, spheres: &[Self]) -> Self {
        let at = |part: f64| {
            let center = self.center.lerp(outer.center, part);
            Self { center, radius: Self::reach(center, spheres) }
        };
        // Without square roots, and only up to the first sphere that does not fit.
        let room = outer.room();
        let fits = |part: f64| {
            let center = self.center.lerp(outer.center, part);
            let left = room - center.distance(outer.center);
            spheres.iter().all(|s| {
                let most = left - s.radius;
                most >= 0.0 && s.center.distance_squared(center) <= most * most
            })
        };
        let search = |fits: &dyn Fn(f64) -> bool| {
            let (mut out, mut within) = (0.0, 1.0);
            for _ in 0..12 {
                let middle = (out + within) * 0.5;
                *(if fits(middle) { &mut within } else { &mut out }) = middle;
            }
            (within < 1.0).then(|| at(within))
        };
        // Rounding may accept a sphere that just does not fit, or reject one that does.
        let quick = search(&fits).filter(|sphere| outer.holds(sphere));
        quick.or_else(|| search(&|part| outer.holds(&at(part)))).unwrap_or(*outer)
    }
}

/// Gives every inner node of a block a sphere around its children's. Returns the number of levels
/// below each node.
pub(crate) fn raise(block: &mut Block) -> Vec<u32> {
    let nodes = &mut block.nodes;
    let mut heights = vec![0u32; nodes.len()];
    let mut around = Vec::new();
    for index in (0..nodes.len()).rev() {
        let children = children_of(&nodes[index]);
        if children.is_empty() {
            continue;
        }
        heights[index] = 1 + heights[children.clone()].iter().copied().max().unwrap_or(0);
        around.clear();
        around.extend(nodes[children].iter().map(Sphere::of));
        Sphere::around(&around, FEW_ROUNDS).give(&mut nodes[index]);
    }
    heights
}

/// Moves the spheres of a raised block into their parents', and shrinks those of higher nodes. The
/// root's sphere lies in `outer`, which is enlarged if it does not contain all leaves. If leaves
/// lie on the surface of `outer`, the root's sphere may be slightly larger.
pub(crate) fn nest(block: &mut Block, heights: &[u32], outer: Sphere) {
    let nodes = &mut block.nodes;
    let leaves = nodes.iter().filter(|node| node.is_leaf()).map(Sphere::of);
    let reach =
        leaves.map(|leaf| leaf.center.distance(outer.center) + leaf.radius).fold(0.0, f64::max);
    let outer = Sphere { radius: outer.radius.max(reach * (1.0 + 1e-6)), ..outer };
    let mut parents = vec![0u32; nodes.len()];
    for (index, node) in (0..).zip(nodes.iter()) {
        parents[children_of(node)].fill(index);
    }
    let mut around = Vec::new();
    // Parents come before their children, so each finds its parent's final sphere.
    for index in 0..nodes.len() {
        if nodes[index].is_leaf() {
            continue;
        }
        let outer = if index == 0 { outer } else { Sphere::of(&nodes[parents[index] as usize]) };
        let mut levels = LEVELS_BELOW;
        let mut sphere = Sphere::of(&nodes[index]);
        if heights[index] >= FITTED_HEIGHT {
            descendants(nodes, index, levels, &mut around);
            sphere = Sphere::around(&around, MANY_ROUNDS);
        } else if outer.holds(&sphere) {
            continue;
        }
        if !outer.holds(&sphere) {
            descendants(nodes, index, levels, &mut around);
            // While descendants reach beyond the outer sphere, go one level deeper. Leaves never
            // reach beyond it.
            while levels < heights[index] && Sphere::reach(outer.center, &around) > outer.radius {
                levels += 1;
                descendants(nodes, index, levels, &mut around);
            }
            let moved = sphere.moved_inside(&outer, &around);
            let roomy = Sphere { radius: outer.radius * ROOM, ..outer };
            sphere = match () {
                () if index > 0 || moved.radius <= MOST_WIDER * sphere.radius => moved,
                () if roomy.holds(&sphere) => sphere,
                () => sphere.moved_inside(&roomy, &around),
            };
        }
        sphere.give(&mut nodes[index]);
    }
}

pub(crate) fn children_of(node: &Node) -> std::ops::Range<usize> {
    node.first_child as usize..(node.first_child + node.children) as usize
}

/// Collects the spheres of descendants `levels` levels below a node's children, or of leaves that
/// are less deep.
fn descendants(nodes: &[Node], index: usize, levels: u32, spheres: &mut Vec<Sphere>) {
    fn walk(nodes: &[Node], index: usize, levels: u32, spheres: &mut Vec<Sphere>) {
        for child in children_of(&nodes[index]) {
            if levels == 0 || nodes[child].is_leaf() {
                spheres.push(Sphere::of(&nodes[child]));
            } else {
                walk(nodes, child, levels - 1, spheres);
            }
        }
    }
    spheres.clear();
    walk(nodes, index, levels, spheres);
}

/// Directions in which the farthest spheres are searched: the axes of a cube, and those through its
/// edges and corners.
pub(super) const DIRECTIONS: [[f32; 3]; 13] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Returns, for each direction and its opposite, the first of the splats that are farthest in it.
fn extremes(splats: &[Splat]) -> Vec<usize> {
    let chunks: Vec<&[Splat]> = splats.chunks(CHUNK).collect();
    let chunk_ends: Vec<[Ends; DIRECTIONS.len()]> =
        chunks.par_iter().map(|chunk| dispatch!(Level::new(), simd => ends(simd, chunk))).collect();
    let mut out = Vec::with_capacity(2 * DIRECTIONS.len());
    for (number, direction) in DIRECTIONS.iter().enumerate() {
        for side in [0, 1] {
            let of = |chunk: usize| chunk_ends[chunk][number][side];
            let mut farthest = 0;
            for chunk in 1..chunks.len() {
                if of(chunk) > of(farthest) {
                    farthest = chunk;
                }
            }
            let sign = [1.0, -1.0][side];
            let along = |splat: &Splat| Vec3::from(splat.center).dot(Vec3::from(*direction)) * sign;
            let place = chunks[farthest].iter().position(|splat| along(splat) == of(farthest));
            out.push(farthest * CHUNK + place.unwrap_or(0));
        }
    }
    out
}

/// Splats in a unit of parallel work.
const CHUNK: usize = 1 << 14;

/// The farthest distances in a direction, and in its opposite.
type Ends = [f32; 2];

/// Returns how far the centres reach in each direction, and in its opposite.
#[inline(always)]
fn ends<S: Simd>(simd: S, splats: &[Splat]) -> [Ends; DIRECTIONS.len()] {
    let none = f32x8::splat(simd, f32::NEG_INFINITY);
    let mut lanes = [[none; 2]; DIRECTIONS.len()];
    let mut places = [[0.0f32; 8]; 3];
    for eight in splats.chunks(8) {
        for lane in 0..8 {
            // The last splat fills incomplete groups of eight.
            let splat = eight.get(lane).unwrap_or(&eight[eight.len() - 1]);
            for (places, place) in places.iter_mut().zip(splat.center) {
                places[lane] = place;
            }
        }
        let [x, y, z]: [f32x8<S>; 3] =
            [places[0].simd_into(simd), places[1].simd_into(simd), places[2].simd_into(simd)];
        for (ends, direction) in lanes.iter_mut().zip(DIRECTIONS) {
            let along = x * direction[0] + y * direction[1] + z * direction[2];
            *ends = [ends[0].max(along), ends[1].max(-along)];
        }
    }
    let mut out = [[f32::NEG_INFINITY; 2]; DIRECTIONS.len()];
    for (out, lanes) in out.iter_mut().zip(lanes) {
        let farthest: [[f32; 8]; 2] = [lanes[0].into(), lanes[1].into()];
        *out = [0, 1].map(|side| farthest[side].iter().copied().fold(f32::NEG_INFINITY, f32::max));
    }
    out
}

/// How often the farthest sphere outside is added to the core set.
const MOST_GROWTHS: usize = 12;
/// How far splats may reach outside before the sphere is refitted, as a fraction of its radius.
const OUTSIDE: f64 = 0.005;

/// Returns a sphere around the footprints of very many splats that is nearly the smallest. It
/// starts with the splats farthest in some directions, then repeatedly adds the one that reaches
/// farthest outside (a core set, Bădoiu & Clarkson 2003). Footprints end `extent` standard
/// deviations from their centres.
pub(crate) fn enclosing(splats: &[Splat], extent: f32) -> Sphere {
    let sphere = |splat: &Splat| Sphere::of(&leaf(splat, extent));
    let mut core: Vec<Sphere> =
        extremes(splats).iter().map(|&index| sphere(&splats[index])).collect();
    let mut around = Sphere::around(&core, 1 << 12);
    for growth in 0.. {
        // Most splats are so far inside that their exact size is not needed. A splat's largest
        // standard deviation is at most the root of the sum of all variances.
        let center = around.center.as_vec3();
        let outside = |splat: &Splat| {
            let variances: f32 = splat.factor.iter().map(|entry| entry * entry).sum();
            let most = Vec3::from(splat.center).distance(center) + extent * variances.sqrt();
            (f64::from(most) > around.radius).then(|| {
                let footprint = sphere(splat);
                (footprint.center.distance(around.center) + footprint.radius, footprint)
            })
        };
        let farther = |a: (f64, Sphere), b: (f64, Sphere)| if b.0 > a.0 { b } else { a };
        let all = splats.par_iter().with_min_len(1 << 14).filter_map(outside);
        let farthest = all.reduce(|| (0.0, around), farther);
        if growth == MOST_GROWTHS || farthest.0 <= around.radius * (1.0 + OUTSIDE) {
            // With a margin for rounding.
            around.radius = around.radius.max(farthest.0) * (1.0 + 1e-5);
            break;
        }
        core.push(farthest.1);
        around = Sphere::around(&core, 1 << 12);
    }
    around
}

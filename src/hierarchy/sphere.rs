//! Tight bounding spheres, each inside its parent's.
//!
//! The smallest sphere around spheres is found by moving a centre towards what reaches farthest, by smaller and smaller
//! steps (Bădoiu & Clarkson 2003). Built from children alone, spheres grow on their way up: each sticks out of what it
//! holds, and the next must hold that too. So above the lowest levels, from the root down, a node gets the smallest sphere
//! around descendants a few levels below, which stick out less. Where that one reaches out of the parent's, its centre moves
//! towards the parent's until it does not; at the parent's own centre it would be the parent's sphere.

use super::{Block, MOST_CHILDREN, Node};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sphere {
    pub center: DVec3,
    pub radius: f64,
}

/// Steps towards the smallest sphere where there are many nodes, and where there are few.
const FEW_ROUNDS: u32 = 4;
const MANY_ROUNDS: u32 = 96;
/// Nodes this many levels above the leaves, and higher ones, are fitted to their descendants.
const FITTED_HEIGHT: u8 = 3;
/// How many levels below them these descendants are; one more for the root and its children.
const LEVELS_BELOW: u32 = 1;

impl Sphere {
    pub fn of(node: &Node) -> Self {
        Self { center: node.center().as_dvec3(), radius: f64::from(node.radius) }
    }

    /// Sets a node's sphere to this one, rounded so that it holds whatever this one holds.
    fn give(&self, node: &mut Node) {
        node.center = self.center.as_vec3().to_array();
        let shift = node.center().as_dvec3().distance(self.center);
        node.radius = ((self.radius + shift) as f32).next_up();
    }

    /// How far a sphere reaches from a centre.
    fn reach(center: DVec3, spheres: &[Self]) -> f64 {
        spheres.iter().map(|s| s.center.distance(center) + s.radius).fold(0.0, f64::max)
    }

    /// A sphere around others that is nearly the smallest.
    pub fn around(spheres: &[Self], rounds: u32) -> Self {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) =
            spheres.iter().fold(none, |(low, high), s| (low.min(s.center - s.radius), high.max(s.center + s.radius)));
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

    /// The sphere around others whose centre is the nearest to `self`'s on the way to the centre of `outer`, such that it lies
    /// in `outer`, which holds all of them.
    fn inside(self, outer: Self, spheres: &[Self]) -> Self {
        let at = |part: f64| {
            let center = self.center.lerp(outer.center, part);
            Self { center, radius: Self::reach(center, spheres) }
        };
        // Room for what rounding to 32 bits adds: to the radius, and to a centre that may be far from the origin.
        let rounded = 4.0 * outer.radius + 2.0 * outer.center.abs().max_element();
        let room = outer.radius - rounded * f64::from(f32::EPSILON);
        let fits = |s: &Self| s.center.distance(outer.center) + s.radius <= room;
        let own = at(0.0);
        if fits(&own) {
            return own;
        }
        let (mut out, mut within) = (0.0, 1.0);
        for _ in 0..12 {
            let middle = (out + within) * 0.5;
            *(if fits(&at(middle)) { &mut within } else { &mut out }) = middle;
        }
        let fitted = at(within);
        // Rounding may leave no room at all; and a caller's `outer` may not hold what it promised.
        if within < 1.0 || Self::reach(outer.center, spheres) <= outer.radius { fitted } else { own }
    }
}

/// Gives every inner node of a block a sphere around its children's, and tells how many levels there are below each node.
pub(crate) fn raise(block: &mut Block) -> Vec<u8> {
    let nodes = &mut block.nodes;
    let mut heights = vec![0u8; nodes.len()];
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

/// Makes the spheres of the higher nodes of a raised block as small as they can be inside their parents'; the root's lies
/// in `outer`, where there is one.
pub(crate) fn nest(block: &mut Block, heights: &[u8], outer: Option<Sphere>) {
    let nodes = &mut block.nodes;
    let mut parents = vec![0usize; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        parents[children_of(node)].fill(index);
    }
    let mut around = Vec::new();
    // Parents come before their children, so each finds its parent's final sphere.
    for index in 0..nodes.len() {
        let outer = if index == 0 { outer } else { Some(Sphere::of(&nodes[parents[index]])) };
        if nodes[index].is_leaf() || (index > 0 && heights[parents[index]] < FITTED_HEIGHT) {
            continue;
        }
        around.clear();
        let is_fitted = heights[index] >= FITTED_HEIGHT;
        let is_high = index <= MOST_CHILDREN;
        descendants(nodes, heights, index, if is_high { LEVELS_BELOW + 1 } else { LEVELS_BELOW }, &mut around);
        let rounds = if is_high { MANY_ROUNDS } else { 4 * FEW_ROUNDS };
        let own = if is_fitted { Sphere::around(&around, rounds) } else { Sphere::of(&nodes[index]) };
        let fitted = outer.map_or(own, |outer| own.inside(outer, &around));
        fitted.give(&mut nodes[index]);
    }
}

/// Directions in which the farthest spheres are looked for: the axes of a cube, of its edges and of its corners.
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

/// How often what lies farthest outside is taken in.
const MOST_GROWTHS: usize = 12;
/// What may lie outside before the sphere is grown to hold it, in parts of its radius.
const OUTSIDE: f64 = 0.005;

/// A sphere around very many that is nearly the smallest: around what is farthest in some directions, then what lies
/// farthest outside of that, and so on (a core set, Bădoiu & Clarkson 2003).
pub(crate) fn enclosing<T: Sync>(
    items: &[T],
    sphere: impl Fn(&T) -> Sphere + Sync,
    place: impl Fn(&T) -> Vec3 + Sync,
) -> Sphere {
    let none = [[(f32::NEG_INFINITY, 0usize); 2]; DIRECTIONS.len()];
    let farther = |a: (f32, usize), b: (f32, usize)| if b.0 > a.0 { b } else { a };
    let extremes = items
        .par_chunks(1 << 14)
        .enumerate()
        .map(|(chunk, items)| {
            let mut found = none;
            for (index, item) in items.iter().enumerate() {
                let place = place(item);
                for (ends, direction) in found.iter_mut().zip(DIRECTIONS) {
                    let along = place.dot(Vec3::from(direction));
                    for (end, along) in ends.iter_mut().zip([along, -along]) {
                        if along > end.0 {
                            *end = (along, (chunk << 14) + index);
                        }
                    }
                }
            }
            found
        })
        .reduce(|| none, |a, b| std::array::from_fn(|i| std::array::from_fn(|j| farther(a[i][j], b[i][j]))));
    let mut core: Vec<Sphere> = extremes.iter().flatten().map(|&(_, index)| sphere(&items[index])).collect();
    let mut around = Sphere::around(&core, 1 << 12);
    for _ in 0..MOST_GROWTHS {
        let reach = |item: &T| {
            let own = sphere(item);
            (own.center.distance(around.center) + own.radius, own)
        };
        let farther = |a: (f64, Sphere), b: (f64, Sphere)| if b.0 > a.0 { b } else { a };
        let farthest = items.par_iter().with_min_len(1 << 14).map(reach).reduce(|| (0.0, around), farther);
        if farthest.0 <= around.radius * (1.0 + OUTSIDE) {
            around.radius = around.radius.max(farthest.0) * (1.0 + 1e-6);
            return around;
        }
        core.push(farthest.1);
        around = Sphere::around(&core, 1 << 12);
    }
    let reach = |item: &T| {
        let own = sphere(item);
        own.center.distance(around.center) + own.radius
    };
    around.radius = items.par_iter().with_min_len(1 << 14).map(reach).reduce(|| 0.0, f64::max) * (1.0 + 1e-6);
    around
}

pub(crate) fn children_of(node: &Node) -> std::ops::Range<usize> {
    node.first_child as usize..(node.first_child + node.children) as usize
}

/// The spheres of descendants some levels below a node, but none lower than the nodes whose spheres stay as they are.
fn descendants(nodes: &[Node], heights: &[u8], index: usize, levels: u32, found: &mut Vec<Sphere>) {
    fn walk(nodes: &[Node], heights: &[u8], index: usize, levels: u32, found: &mut Vec<Sphere>) {
        for child in children_of(&nodes[index]) {
            if levels == 0 || heights[child] < FITTED_HEIGHT {
                found.push(Sphere::of(&nodes[child]));
            } else {
                walk(nodes, heights, child, levels - 1, found);
            }
        }
    }
    walk(nodes, heights, index, levels, found);
}

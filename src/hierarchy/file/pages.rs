//! Splits a block into pages, and computes what a page must know of the nodes above it.

use super::{FIRST_NODES, GROWTH, MOST_NODES};
use crate::hierarchy::{MOST_CHILDREN, Node};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Checks that the nodes are in breadth-first order and that the children of successive nodes are
/// adjacent. Then the position of children follows from the number of children before them.
pub fn in_order(nodes: &[Node]) -> Result<(), String> {
    if nodes.is_empty() {
        return Err("there are no nodes".into());
    }
    if u32::try_from(nodes.len()).is_err() {
        return Err(format!("there are {} nodes, more than 32 bits can number", nodes.len()));
    }
    let mut next = 1;
    for (index, node) in nodes.iter().enumerate() {
        if next <= index {
            return Err(format!("node {index} has no parent"));
        }
        if node.children as usize > MOST_CHILDREN {
            return Err(format!(
                "node {index} has {} children; at most {MOST_CHILDREN} are allowed",
                node.children
            ));
        }
        let wanted = if node.is_leaf() { 0 } else { next as u32 };
        if node.first_child != wanted {
            return Err(format!(
                "the children of node {index} begin at {}, not at {wanted}",
                node.first_child
            ));
        }
        next += node.children as usize;
    }
    if next != nodes.len() {
        return Err(format!(
            "there are {} nodes, but the nodes with children refer to {next}",
            nodes.len()
        ));
    }
    Ok(())
}

/// A page of a block, as ranges of nodes in the block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Run {
    pub nodes: Range<usize>,
    /// A range that contains the parents of its nodes, except for the root, which has none.
    pub parents: Range<usize>,
    /// The children of its nodes.
    pub children: Range<usize>,
}

/// Splits a block into pages without separating siblings, short ones first.
pub fn pages(nodes: &[Node]) -> Vec<Run> {
    let mut most = FIRST_NODES;
    let mut runs: Vec<Run> = Vec::with_capacity(nodes.len() / (MOST_NODES - MOST_CHILDREN) + 3);
    let (mut start, mut end, mut first_parent, mut first_child) = (0, 1, 0, 1);
    let mut push = |nodes_of: Range<usize>, parents: Range<usize>| {
        let count: usize = nodes[nodes_of.clone()].iter().map(|node| node.children as usize).sum();
        runs.push(Run { nodes: nodes_of, parents, children: first_child..first_child + count });
        first_child += count;
    };
    for (index, node) in nodes.iter().enumerate() {
        let group = node.children as usize;
        if end + group - start > most {
            push(start..end, first_parent..index);
            (start, first_parent, most) = (end, index, MOST_NODES.min(GROWTH * most));
        }
        end += group;
    }
    push(start..end, first_parent..nodes.len());
    runs
}

/// Returns where each level of a block begins, and where the last one ends.
pub fn levels(nodes: &[Node]) -> Vec<usize> {
    let mut bounds = vec![0, 1];
    loop {
        let level = bounds[bounds.len() - 2]..bounds[bounds.len() - 1];
        let children: usize = nodes[level.clone()].iter().map(|node| node.children as usize).sum();
        if children == 0 {
            return bounds;
        }
        bounds.push(level.end + children);
    }
}

/// A sphere around the spheres of several nodes, and their largest size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    pub center: [f32; 3],
    pub radius: f32,
    pub largest_size: f32,
}

impl Around {
    /// Bounds around everything: the page of a root without a parent is always needed.
    pub const EVERYTHING: Self =
        Self { center: [0.0; 3], radius: f32::INFINITY, largest_size: f32::INFINITY };

    /// Returns the bounds around the nodes that have children.
    pub fn parents(nodes: &[Node]) -> Self {
        let nodes = nodes.iter().filter(|node| !node.is_leaf());
        Self::enclosing(nodes.map(|node| Self {
            center: node.center,
            radius: node.radius,
            largest_size: node.size,
        }))
    }

    /// Returns the bounds around others. They are endless if one of these is.
    pub fn of(all: &[Self]) -> Self {
        if all.iter().any(Self::is_endless) {
            Self::EVERYTHING
        } else {
            Self::enclosing(all.iter().copied())
        }
    }

    fn enclosing(all: impl Iterator<Item = Self> + Clone) -> Self {
        let place = |bounds: &Self| Vec3::from(bounds.center).as_dvec3();
        let (low, high) =
            all.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), bounds| {
                let (center, radius) = (place(&bounds), f64::from(bounds.radius));
                (low.min(center - radius), high.max(center + radius))
            });
        let center = ((low + high) * 0.5).as_vec3();
        let reach =
            |bounds: &Self| center.as_dvec3().distance(place(bounds)) + f64::from(bounds.radius);
        let radius = all.clone().map(|bounds| reach(&bounds)).fold(0.0, f64::max);
        let largest_size = all.map(|bounds| bounds.largest_size).fold(0.0, f32::max);
        Self { center: center.to_array(), radius: round_up(radius), largest_size }
    }

    /// Whether these are bounds around everything.
    pub fn is_endless(&self) -> bool {
        self.radius == f32::INFINITY && self.largest_size == f32::INFINITY
    }
}

/// Returns how far a node's sphere reaches from a position.
pub fn reach(from: DVec3, node: &Node) -> f64 {
    from.distance(node.center().as_dvec3()) + f64::from(node.radius)
}

/// Rounds up to a 32-bit number, with a margin for the rounding of the operations before.
pub fn round_up(value: f64) -> f32 {
    let value = value * (1.0 + 1e-12);
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

/// Returns the parent of each node of a block; `None` for the root.
pub(super) fn parents(nodes: &[Node]) -> Vec<Option<u32>> {
    let mut parents = vec![None];
    for (index, node) in nodes.iter().enumerate() {
        parents.extend(std::iter::repeat_n(Some(index as u32), node.children as usize));
    }
    parents
}

//! What a hierarchy is made of: nodes, in blocks, in a tree.

use crate::{math::Bounds, splat::Splat};
use glam::{DVec3, Vec3};

/// The most children of a node.
pub const MOST_CHILDREN: usize = 8;

/// A node: one splat that stands for all the leaves below it, and bounds of them. Lengths are world units, places relative
/// to the tree's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// A leaf's own splat; else the leaves below merged into one.
    pub splat: Splat,
    /// The sphere around the footprints of all leaves below; every child's lies in its parent's.
    pub center: [f32; 3],
    pub radius: f32,
    /// How wide the splat looks: the width of its footprint at half its height along its longest axis (2.355 σ), and never
    /// less than a child's. A cut compares this, seen from the nearest point of the sphere, with pixels.
    pub size: f32,
    /// Cosine of the half-angle of a cone around the splat's normal that holds the normals of all leaves below; −1 where
    /// there is no such cone.
    pub cone: f32,
    /// Where its children stand in its block, side by side; 0 for a leaf.
    pub first_child: u32,
    /// How many there are: 0 for a leaf, at most [`MOST_CHILDREN`].
    pub children: u32,
}

impl Node {
    pub fn is_leaf(&self) -> bool {
        self.children == 0
    }

    pub fn center(&self) -> Vec3 {
        Vec3::from(self.center)
    }
}

/// Nodes breadth first: node 0 is the root, siblings stand side by side, children behind their parents.
#[derive(Debug, Clone, Default)]
pub struct Block {
    pub nodes: Vec<Node>,
    /// The leaf of block 0 that this block hangs below, in whose place its root stands; `None` for block 0 itself.
    pub portal: Option<u32>,
}

/// A hierarchy of splats in memory. Large ones consist of several blocks, each built on its own: block 0 joins the others,
/// and its leaves are portals to them. A single block has ordinary leaves.
#[derive(Debug, Clone)]
pub struct Tree {
    /// World position that all places are relative to.
    pub origin: DVec3,
    /// Footprints end this many standard deviations from the centre.
    pub extent: f32,
    /// Whether the source was solid ([`Mesh::is_solid`](crate::surface::Mesh::is_solid)): each side of its surfaces hides the
    /// other from every point outside, so that what faces away need not be drawn.
    pub closed: bool,
    /// The box around all footprints, in world coordinates.
    pub bounds: Bounds,
    /// Points of the source: vertices or samples.
    pub source_points: u64,
    pub blocks: Vec<Block>,
}

impl Tree {
    /// Whether the leaves of block 0 are portals.
    pub fn is_joined(&self) -> bool {
        self.blocks.len() > 1
    }

    /// All nodes that are drawn: those of all blocks but portals.
    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        let joined = self.is_joined();
        let blocks = self.blocks.iter().enumerate();
        blocks.flat_map(move |(index, block)| {
            block.nodes.iter().filter(move |n| !(joined && index == 0 && n.is_leaf()))
        })
    }

    /// How many splats of the source the tree holds.
    pub fn leaf_count(&self) -> u64 {
        self.nodes().filter(|node| node.is_leaf()).count() as u64
    }
}

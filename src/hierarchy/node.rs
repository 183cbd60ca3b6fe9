//! The parts of a hierarchy: nodes in blocks, blocks in a tree.

use crate::{gaussians::Colors, math::Bounds, splat::Splat};
use glam::{DVec3, Vec3};

/// The maximum number of children of a node.
pub const MOST_CHILDREN: usize = 8;

/// A node: one splat that stands for all the leaves below it, with their bounds. Lengths are in
/// world units, positions relative to the tree's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// The splat of a leaf, or the merged splat of all leaves below.
    pub splat: Splat,
    /// Bounding sphere of the footprints of all leaves below. A child's sphere lies inside its
    /// parent's.
    pub center: [f32; 3],
    /// The radius of that sphere, in world units.
    pub radius: f32,
    /// The apparent width of the splat: the full width at half maximum of its footprint along its
    /// longest axis (2.355 σ), and never less than a child's. A cut projects this width from the
    /// nearest point of the sphere and compares it with pixels.
    pub size: f32,
    /// Cosine of the half-angle of a cone around the splat's normal that contains the normals of
    /// all leaves below; −1 if there is no such cone.
    pub cone: f32,
    /// Index of the first child in the block; siblings are adjacent. 0 for a leaf.
    pub first_child: u32,
    /// The number of children: 0 for a leaf, at most [`MOST_CHILDREN`].
    pub children: u32,
}

impl Node {
    /// Returns whether the node has no children.
    pub fn is_leaf(&self) -> bool {
        self.children == 0
    }

    /// Returns the centre of the bounding sphere, relative to the tree's origin.
    pub fn center(&self) -> Vec3 {
        Vec3::from(self.center)
    }
}

/// Nodes in breadth-first order: node 0 is the root, siblings are adjacent, and children come after
/// their parents.
#[derive(Debug, Clone, Default)]
pub struct Block {
    /// The nodes; node 0 is the root.
    pub nodes: Vec<Node>,
    /// The leaf of block 0 that this block's root replaces; `None` for block 0 itself.
    pub portal: Option<u32>,
    /// The colours of all nodes, if they are trained Gaussians: then all blocks of a tree have
    /// some, of one degree. The nodes' own colours do not count.
    pub colors: Option<Colors>,
}

/// A hierarchy of splats in memory. A large one consists of several blocks, each built on its own.
/// Block 0 joins the others, and its leaves are portals to them. If there is only one block, it has
/// ordinary leaves.
///
/// A small picture takes few of the splats:
///
/// ```
/// use glam::DVec3;
/// use splatkit::{
///     hierarchy::{BuildOptions, Detail, Tree, validate},
///     math::Camera,
///     surface::{Mesh, SurfelOptions},
/// };
///
/// let ball = Mesh::sphere(4).surfels(&SurfelOptions::default())?;
/// let tree = Tree::build(&ball, &BuildOptions::default(), None)?;
/// assert!(validate(&tree).is_empty());
/// // From afar, few splats stand for the whole.
/// let camera = Camera::framing(&tree.bounds, DVec3::NEG_Z, DVec3::Y, 1.0);
/// let cut = tree.cut(&camera.view([64, 64])?, Detail::Pixels(8.0), None)?;
/// assert!(cut.splats().len() < ball.splats.len() / 4);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Tree {
    /// World position of the origin of all positions.
    pub origin: DVec3,
    /// Footprints end this many standard deviations from the centre.
    pub extent: f32,
    /// Whether the source was solid ([`Mesh::is_solid`](crate::surface::Mesh::is_solid)). From
    /// every point outside, the front of a solid's surface hides its back, so back faces need not
    /// be drawn.
    pub closed: bool,
    /// The box around all footprints, in world coordinates.
    pub bounds: Bounds,
    /// Points in the source: vertices or samples.
    pub source_points: u64,
    /// The blocks. If there are several, block 0 joins the others.
    pub blocks: Vec<Block>,
}

impl Tree {
    /// Returns whether the leaves of block 0 are portals.
    pub fn is_joined(&self) -> bool {
        self.blocks.len() > 1
    }

    /// Returns all nodes that can be drawn: those of all blocks, without portals.
    pub fn nodes(&self) -> impl Iterator<Item = &Node> {
        let joined = self.is_joined();
        let blocks = self.blocks.iter().enumerate();
        blocks.flat_map(move |(index, block)| {
            block.nodes.iter().filter(move |n| !(joined && index == 0 && n.is_leaf()))
        })
    }

    /// Returns the number of leaves: the splats of the finest level.
    pub fn leaf_count(&self) -> u64 {
        self.nodes().filter(|node| node.is_leaf()).count() as u64
    }
}

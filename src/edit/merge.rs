//! Fewer splats that look alike: the nodes of a hierarchy of them.
//!
//! A node's splat stands for all splats below it (`hierarchy::merge`). Nodes are replaced by their
//! children in the order of their widths, the widest first, until there are as many as wanted, or
//! until all are narrow enough.

use super::thin::Thin;
use crate::{
    Result,
    hierarchy::{BuildOptions, Node, Tree},
    splat::Surfels,
};
use std::{cmp::Ordering, collections::BinaryHeap};

/// A node of a tree, by its block and its index.
struct Wide {
    size: f32,
    block: usize,
    node: usize,
}

impl PartialEq for Wide {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Wide {}

impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Wide {
    /// Wider nodes are greater. Of nodes of the same width, the earlier one is.
    fn cmp(&self, other: &Self) -> Ordering {
        let places = (other.block, other.node).cmp(&(self.block, self.node));
        self.size.total_cmp(&other.size).then(places)
    }
}

/// Returns the nodes that stand for all leaves, by block and index, in ascending order.
fn chosen(tree: &Tree, thin: &Thin) -> Vec<(usize, usize)> {
    let mut portals = vec![None; tree.blocks[0].nodes.len()];
    for (index, block) in tree.blocks.iter().enumerate() {
        if let Some(portal) = block.portal {
            portals[portal as usize] = Some(index);
        }
    }
    let wide = |block: usize, node: usize| {
        let (block, node) = match portals.get(node).copied().flatten().filter(|_| block == 0) {
            Some(inner) => (inner, 0),
            None => (block, node),
        };
        Wide { size: tree.blocks[block].nodes[node].size, block, node }
    };
    let leaves = tree.leaf_count();
    let wanted = thin.count(leaves) as usize;
    let narrow = match thin {
        Thin::Distance(distance) => *distance as f32,
        _ => 0.0,
    };
    let (mut nodes, mut whole) = (BinaryHeap::from([wide(0, 0)]), Vec::new());
    while let Some(Wide { size, block, node }) = nodes.pop() {
        let Node { first_child, children, .. } = tree.blocks[block].nodes[node];
        let is_split = children > 0
            && size > narrow
            && nodes.len() + whole.len() + children as usize <= wanted;
        if is_split {
            let first = first_child as usize;
            nodes.extend((first..first + children as usize).map(|child| wide(block, child)));
        } else {
            whole.push((block, node));
        }
    }
    whole.sort_unstable();
    whole
}

/// Returns the splats of a set merged.
pub fn splats(set: &Surfels, thin: &Thin) -> Result<Surfels> {
    let tree = Tree::build(set, &BuildOptions::default(), None)?;
    let chosen = chosen(&tree, thin);
    let splat = |&(block, node): &(usize, usize)| tree.blocks[block].nodes[node].splat;
    let splats = chosen.iter().map(splat).collect();
    Ok(Surfels { origin: tree.origin, splats, extent: tree.extent })
}

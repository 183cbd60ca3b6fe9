//! The colours of the nodes of trained Gaussians: those of the leaves, and means of them above.

use super::{Block, Node, merge::Mass};
use crate::gaussians::{
    Colors, Gaussians,
    harmonics::{MOST_TERMS, terms},
};

/// The harmonics of a node; those above the degree are 0.
pub(super) type Harmonics = [[f32; 3]; MOST_TERMS];

/// The colours of the leaves that a hierarchy is built of.
pub(super) struct LeafColors<'a> {
    set: &'a Gaussians,
    /// The number of the Gaussian of each splat.
    numbers: Vec<u32>,
    is_exact: bool,
}

impl<'a> LeafColors<'a> {
    /// `numbers` has the number of the Gaussian of each splat.
    pub fn new(set: &'a Gaussians, numbers: Vec<u32>, is_exact: bool) -> Self {
        Self { set, numbers, is_exact }
    }

    fn of(&self, splat: u32) -> Harmonics {
        let mut all = [[0.0; 3]; MOST_TERMS];
        let harmonics = self.set.harmonics_of(self.numbers[splat as usize] as usize);
        all[..harmonics.len()].copy_from_slice(harmonics);
        all
    }

    /// Returns the colours of a block's nodes. `splat` returns the splat of a leaf.
    pub fn of_block(&self, nodes: &[Node], splat: impl Fn(usize) -> u32) -> Colors {
        colors_of(nodes, self.set.degree, self.is_exact, |leaf| self.of(splat(leaf)))
    }

    /// Returns the colours of the block that joins others, from the colours of their roots.
    pub fn of_top(&self, top: &Block, portals: &[u32], roots: &[Harmonics]) -> Colors {
        let mut of_leaf = vec![0; top.nodes.len()];
        for (root, portal) in portals.iter().enumerate() {
            of_leaf[*portal as usize] = root;
        }
        colors_of(&top.nodes, self.set.degree, self.is_exact, |leaf| roots[of_leaf[leaf]])
    }
}

/// Returns the colours of nodes, from those of the leaves up.
fn colors_of(
    nodes: &[Node],
    degree: u32,
    is_exact: bool,
    leaf: impl Fn(usize) -> Harmonics,
) -> Colors {
    let count = terms(degree);
    let mut all = vec![[0f32; 3]; nodes.len() * count];
    let mut masses = vec![0f32; nodes.len()];
    for (index, node) in nodes.iter().enumerate().rev() {
        let mut harmonics = [[0f32; 3]; MOST_TERMS];
        if node.is_leaf() {
            masses[index] = Mass::of(&node.splat).mass;
            harmonics = leaf(index);
        } else {
            let children = node.first_child as usize..(node.first_child + node.children) as usize;
            let total: f32 = masses[children.clone()].iter().sum();
            masses[index] = total;
            for child in children {
                let share = masses[child] / total;
                for (term, part) in harmonics.iter_mut().zip(&all[child * count..][..count]) {
                    term.iter_mut().zip(part).for_each(|(value, part)| *value += share * part);
                }
            }
        }
        all[index * count..][..count].copy_from_slice(&harmonics[..count]);
    }
    if is_exact { Colors::exact(degree, all) } else { Colors::coded(degree, &all) }
}

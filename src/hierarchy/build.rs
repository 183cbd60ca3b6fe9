//! From splats to a tree of them.

use super::{
    Block, Node, Tree,
    cluster::{box_of, cluster},
    merge::leaf,
    partition,
    sphere::{self, Sphere, enclosing, nest, raise},
};
use crate::{
    Error, Result,
    splat::{Payload, SplatSet},
};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// How much time building may take for how good a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Preset {
    Fastest,
    Fast,
    #[default]
    Balanced,
    Slow,
    Best,
}

/// How a tree is built.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildOptions {
    pub preset: Preset,
    /// See [`Tree::closed`].
    pub closed: bool,
    /// Points of the source; the number of splats where `None`.
    pub source_points: Option<u64>,
    /// Splats of a block; larger sets become several blocks.
    pub block_splats: usize,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self { preset: Preset::default(), closed: false, source_points: None, block_splats: 1 << 16 }
    }
}

/// Told of each finished part: how many splats have been built into blocks, of how many.
pub type Watch<'a> = &'a (dyn Fn(u64, u64) + Sync);

impl Tree {
    /// Builds the tree of a set of splats that carry radiance. The same set gives the same tree.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`] for an empty set, [`Error::Argument`] for one of scalars or with places that are not finite.
    pub fn build(set: &SplatSet, options: &BuildOptions, watch: Watch<'_>) -> Result<Self> {
        let _span = tracing::info_span!("build").entered();
        check(set)?;
        let splats = &set.splats;
        let parts = partition::blocks(splats, options.block_splats.max(64));
        let built = AtomicU64::new(0);
        let total = splats.len() as u64;
        let raised: Vec<(Block, Vec<u8>)> = parts
            .into_par_iter()
            .map(|part| {
                let boxes: Vec<_> = part.iter().map(|&i| box_of(&splats[i as usize])).collect();
                let leaf = |i: u32| leaf(&splats[part[i as usize] as usize], set.extent);
                let (mut block, _) = cluster(&boxes, leaf, options.preset);
                let heights = raise(&mut block);
                let count = part.len() as u64;
                watch(built.fetch_add(count, Ordering::Relaxed) + count, total);
                (block, heights)
            })
            .collect();
        let outer = (raised.len() > 1).then(|| {
            let all: Vec<Vec<Sphere>> =
                raised.par_iter().map(|(block, heights)| sphere::parts(block, heights)).collect();
            enclosing(&all.concat())
        });
        let mut blocks: Vec<Block> = raised
            .into_par_iter()
            .map(|(mut block, heights)| {
                nest(&mut block, &heights, outer);
                block
            })
            .collect();
        if let Some(outer) = outer {
            let roots: Vec<Node> = blocks.iter().map(|block| block.nodes[0]).collect();
            let (top, portals) = join(&roots, options.preset, outer);
            for (block, portal) in blocks.iter_mut().zip(portals) {
                block.portal = Some(portal);
            }
            blocks.insert(0, top);
        }
        Ok(Self {
            origin: set.origin,
            extent: set.extent,
            closed: options.closed,
            bounds: set.bounds(),
            source_points: options.source_points.unwrap_or(total),
            blocks,
        })
    }
}

/// The block above the roots of others, all of which lie in `outer`, and the place of each root's portal in it.
pub(crate) fn join(roots: &[Node], preset: Preset, outer: Sphere) -> (Block, Vec<u32>) {
    let boxes: Vec<_> = roots.iter().map(|root| box_of(&root.splat)).collect();
    let leaf = |i: u32| Node { children: 0, first_child: 0, ..roots[i as usize] };
    let (mut block, sources) = cluster(&boxes, leaf, preset);
    let heights = raise(&mut block);
    nest(&mut block, &heights, Some(outer));
    let mut portals = vec![0; roots.len()];
    for (place, (node, source)) in (0..).zip(block.nodes.iter().zip(sources)) {
        if node.is_leaf() {
            portals[source as usize] = place;
        }
    }
    (block, portals)
}

fn check(set: &SplatSet) -> Result<()> {
    if set.payload != Payload::Radiance {
        return Err(Error::Argument("a hierarchy is built of splats that carry colour, not of samples".into()));
    }
    if set.splats.is_empty() {
        return Err(Error::NothingToDraw("there are no splats to build a hierarchy of".into()));
    }
    if u32::try_from(set.splats.len()).is_err() {
        return Err(Error::Argument("a set holds more splats than 32 bits can name; build it in blocks".into()));
    }
    let is_sound = |s: &crate::splat::Splat| {
        s.center.iter().chain(&s.factor).all(|v| v.is_finite()) && s.strength.is_finite() && s.strength >= 0.0
    };
    if !set.splats.par_iter().all(is_sound) {
        return Err(Error::Argument("a splat's place, shape or strength is not finite".into()));
    }
    Ok(())
}

//! Builds a tree from splats.

use super::{
    Block, Node, Tree,
    cluster::{box_of, cluster},
    colors::{Harmonics, LeafColors},
    file::{Placed, Top, Whole, WriteOptions, Writer},
    measure::Measures,
    merge::Mass,
    partition,
    sphere::{Sphere, enclosing, nest, raise},
};
use crate::{
    Deadline, Error, Result,
    gaussians::harmonics::MOST_TERMS,
    memory,
    parallel::{self, prelude::*},
    progress::{Watch, tell},
    splat::{Splat, Surfels},
};
use serde::{Deserialize, Serialize};
use std::{
    path::Path,
    sync::atomic::{AtomicU64, Ordering},
};

/// Trades the time of building against the quality of the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Preset {
    /// Compares each splat with the fewest neighbours before it is paired.
    Fastest,
    /// Compares with few neighbours.
    Fast,
    /// Compares with some more neighbours; the default.
    #[default]
    Balanced,
    /// Compares with many neighbours.
    Slow,
    /// Compares with the most neighbours; the best tree, and the slowest to build.
    Best,
}

/// Options for building a tree.
#[derive(Debug, Clone, PartialEq)]
pub struct BuildOptions {
    /// How much time to spend on the tree's quality.
    pub preset: Preset,
    /// See [`Tree::closed`].
    pub closed: bool,
    /// Points in the source; `None` for the number of splats.
    pub source_points: Option<u64>,
    /// Splats in a block. Larger sets become several blocks.
    pub block_splats: usize,
    /// The moment by which the hierarchy must be built.
    pub deadline: Deadline,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            preset: Preset::default(),
            closed: false,
            source_points: None,
            block_splats: 1 << 14,
            deadline: Deadline::NEVER,
        }
    }
}

impl Tree {
    /// Builds the tree of a set of radiance splats. The same set gives the same tree. `watch` is
    /// called with the splats built into blocks so far and the total.
    ///
    /// # Errors
    /// Those of [`check_splats`]; [`Error::Timeout`] after the deadline; [`Error::Memory`] if there
    /// is too little memory.
    pub fn build(set: &Surfels, options: &BuildOptions, watch: Watch<'_>) -> Result<Self> {
        tree_colored(set, options, watch, None)
    }
}

/// Builds the tree of a set whose splats have these colours, if any.
pub(super) fn tree_colored(
    set: &Surfels,
    options: &BuildOptions,
    watch: Watch<'_>,
    colors: Option<&LeafColors>,
) -> Result<Tree> {
    let _span = tracing::info_span!("build").entered();
    check_splats(set)?;
    // There are at most a quarter more nodes than leaves.
    let nodes = (set.splats.len() * size_of::<Node>()) as u64 / 4 * 5;
    memory::room(WORK, nodes + order_bytes(set) + at_work(options.block_splats))?;
    let parts = partition::blocks(&set.splats, options.block_splats.max(64));
    let outer = enclosing(&set.splats, set.extent);
    let built = AtomicU64::new(0);
    let blocks: Result<Vec<Block>> = parts
        .into_par_iter()
        .map(|part| {
            options.deadline.check(WORK)?;
            let block = colored_block_of(set, &part, options.preset, outer, colors);
            let count = part.len() as u64;
            let done = built.fetch_add(count, Ordering::Relaxed) + count;
            tell(watch, done, set.splats.len() as u64);
            Ok(block)
        })
        .collect();
    let mut blocks = blocks?;
    if blocks.len() > 1 {
        let roots: Vec<Node> = blocks.iter().map(|block| block.nodes[0]).collect();
        let (mut top, portals) = join(&roots, options.preset, outer);
        if let Some(colors) = colors {
            let roots: Vec<Harmonics> = blocks.iter().map(root_color).collect();
            top.colors = Some(colors.of_top(&top, &portals, &roots));
        }
        for (block, portal) in blocks.iter_mut().zip(portals) {
            block.portal = Some(portal);
        }
        blocks.insert(0, top);
    }
    Ok(Tree {
        origin: set.origin,
        extent: set.extent,
        closed: options.closed,
        bounds: set.bounds(),
        source_points: options.source_points.unwrap_or(set.splats.len() as u64),
        blocks,
    })
}

/// Returns the colour of a block's root; 0 without colours.
fn root_color(block: &Block) -> Harmonics {
    block.colors.as_ref().map_or([[0.0; 3]; MOST_TERMS], |colors| colors.harmonics(0))
}

/// Builds the tree of a set and writes it a few blocks at a time, so that only these blocks are in
/// memory.
///
/// # Errors
/// Those of [`Tree::build`], and [`Error::Output`] if the file cannot be written; then there is no
/// file.
pub fn build_file(
    set: &Surfels,
    path: impl AsRef<Path>,
    build: &BuildOptions,
    write: &WriteOptions,
    watch: Watch<'_>,
) -> Result<()> {
    build_colored(set, path.as_ref(), build, write, watch, None)
}

/// As [`build_file`], of a set whose splats have these colours, if any.
pub(super) fn build_colored(
    set: &Surfels,
    path: &Path,
    build: &BuildOptions,
    write: &WriteOptions,
    watch: Watch<'_>,
    colors: Option<&LeafColors>,
) -> Result<()> {
    let _span = tracing::info_span!("build").entered();
    check_splats(set)?;
    memory::room(WORK, order_bytes(set) + at_work(build.block_splats))?;
    let parts = partition::blocks(&set.splats, build.block_splats.max(64));
    let mut builder =
        Builder::new(path, set.extent, enclosing(&set.splats, set.extent), build.preset, write)?;
    let mut built = 0;
    for parts in parts.chunks(2 * parallel::current_num_threads()) {
        let block = |part: &Vec<u32>| {
            build.deadline.check(WORK)?;
            Ok(colored_block_of(set, part, build.preset, builder.outer, colors))
        };
        let blocks: Result<Vec<Block>> = parts.par_iter().map(block).collect();
        builder.add(blocks?)?;
        built += parts.iter().map(|part| part.len() as u64).sum::<u64>();
        tell(watch, built, set.splats.len() as u64);
    }
    let whole = Whole {
        origin: set.origin,
        bounds: set.bounds(),
        closed: build.closed,
        source_points: build.source_points.unwrap_or(set.splats.len() as u64),
    };
    builder.finish_colored(&whole, colors)
}

/// The name of this module's work in errors.
pub(crate) const WORK: &str = "building the hierarchy";

/// Bytes needed to sort the splats.
fn order_bytes(set: &Surfels) -> u64 {
    24 * set.splats.len() as u64
}

/// Bytes needed by the blocks that are built at once: the box of each splat, the pairs above it,
/// its nodes, and their encoded form.
pub(crate) fn at_work(block_splats: usize) -> u64 {
    const OF_SPLAT: u64 = 600;
    let blocks = 2 * parallel::current_num_threads() as u64;
    blocks.saturating_mul(OF_SPLAT).saturating_mul(block_splats.max(64) as u64)
}

/// Writes blocks as they arrive, and joins them at the end.
pub(crate) struct Builder {
    writer: Writer,
    /// A sphere around all leaves.
    pub outer: Sphere,
    preset: Preset,
    roots: Vec<Node>,
    root_colors: Vec<Harmonics>,
}

impl Builder {
    pub fn new(
        path: &Path,
        extent: f32,
        outer: Sphere,
        preset: Preset,
        options: &WriteOptions,
    ) -> Result<Self> {
        Ok(Self::over(Writer::new(path, extent, options)?, outer, preset))
    }

    /// As [`new`](Self::new), with a writer whose pages are there already.
    pub fn over(writer: Writer, outer: Sphere, preset: Preset) -> Self {
        Self { writer, outer, preset, roots: Vec::new(), root_colors: Vec::new() }
    }

    /// Adds a block whose pages have been written.
    pub fn adopt(&mut self, block: &Placed) -> Result<()> {
        self.writer.adopt(block)?;
        self.roots.push(block.root);
        Ok(())
    }

    pub fn add(&mut self, blocks: Vec<Block>) -> Result<()> {
        self.roots.extend(self.writer.blocks(&blocks.iter().collect::<Vec<_>>())?);
        self.root_colors.extend(blocks.iter().map(root_color));
        Ok(())
    }

    pub fn finish(self, whole: &Whole) -> Result<()> {
        self.finish_colored(whole, None)
    }

    fn finish_colored(self, whole: &Whole, colors: Option<&LeafColors>) -> Result<()> {
        if self.roots.len() == 1 {
            return self.writer.finish(None, whole);
        }
        let (mut top, portals) = join(&self.roots, self.preset, self.outer);
        top.colors = colors.map(|colors| colors.of_top(&top, &portals, &self.root_colors));
        self.writer.finish(Some(Top { block: &top, portals: &portals }), whole)
    }
}

/// Builds the block of the splats with the indices `part`. Its root's sphere lies in `outer`.
pub(crate) fn block_of(set: &Surfels, part: &[u32], preset: Preset, outer: Sphere) -> Block {
    colored_block_of(set, part, preset, outer, None)
}

/// As [`block_of`], of splats with these colours, if any.
fn colored_block_of(
    set: &Surfels,
    part: &[u32],
    preset: Preset,
    outer: Sphere,
    colors: Option<&LeafColors>,
) -> Block {
    let splat = |i: u32| &set.splats[part[i as usize] as usize];
    let measures = Measures::of(&set.splats, part);
    let boxes: Vec<_> = (0..).zip(&measures).map(|(i, measure)| measure.box_of(splat(i))).collect();
    let leaf = |i: u32| measures[i as usize].leaf(splat(i), set.extent);
    let mass = |i: u32| measures[i as usize].mass(splat(i));
    let (mut block, sources) = cluster(&boxes, leaf, mass, preset);
    let heights = raise(&mut block);
    nest(&mut block, &heights, outer);
    let number = |leaf: usize| part[sources[leaf] as usize];
    block.colors = colors.map(|colors| colors.of_block(&block.nodes, number));
    block
}

/// Builds the block above the roots of other blocks, all of which lie in `outer`. Also returns the
/// index of each root's portal in it.
pub(crate) fn join(roots: &[Node], preset: Preset, outer: Sphere) -> (Block, Vec<u32>) {
    let boxes: Vec<_> = roots.iter().map(|root| box_of(&root.splat)).collect();
    let leaf = |i: u32| Node { children: 0, first_child: 0, ..roots[i as usize] };
    let mass = |i: u32| Mass::of(&roots[i as usize].splat);
    let (mut block, sources) = cluster(&boxes, leaf, mass, preset);
    let heights = raise(&mut block);
    nest(&mut block, &heights, outer);
    let mut portals = vec![0; roots.len()];
    for (place, (node, source)) in (0..).zip(block.nodes.iter().zip(sources)) {
        if node.is_leaf() {
            portals[source as usize] = place;
        }
    }
    (block, portals)
}

/// The largest coordinate and factor element that can be merged. Masses are their squares times
/// optical depths, and sums of many masses must fit in 32 bits.
const FARTHEST: f32 = 1e9;

/// Checks that a hierarchy can be built of the splats.
///
/// # Errors
/// [`Error::Argument`] if values are not finite, or too large to be added up in 32 bits; if an
/// optical depth is above [`MOST_OPTICAL_DEPTH`](Splat::MOST_OPTICAL_DEPTH).
/// [`Error::NothingToDraw`] if there are no splats.
pub fn check_splats(set: &Surfels) -> Result<()> {
    if set.splats.is_empty() {
        return Err(Error::NothingToDraw("there are no splats to build a hierarchy of".into()));
    }
    if !(set.extent > 0.0 && set.extent <= Splat::MAX_EXTENT) {
        let most = Splat::MAX_EXTENT;
        return Err(Error::Argument(format!(
            "a splat set's extent must lie in 0 … {most}, is {}",
            set.extent
        )));
    }
    if u32::try_from(set.splats.len()).is_err() {
        return Err(Error::Argument(
            "a set contains more splats than 32 bits can number; build it in blocks".into(),
        ));
    }
    if !set.origin.is_finite() {
        return Err(Error::Argument(format!(
            "the origin {} of the splats is not finite",
            set.origin
        )));
    }
    let most = Splat::MOST_OPTICAL_DEPTH;
    let is_sound = |s: &Splat| {
        let fits = |v: &f32| v.abs() <= FARTHEST;
        s.center.iter().chain(&s.factor).all(fits) && (0.0..=most).contains(&s.strength)
    };
    if let Some(index) = set.splats.par_iter().position_first(|splat| !is_sound(splat)) {
        let Splat { center, strength, factor, .. } = set.splats[index];
        let message = format!(
            "splat {index} at {center:?} with factor {factor:?} and optical depth {strength}"
        );
        return Err(Error::Argument(format!(
            "{message}: only coordinates and shapes up to {FARTHEST:e}, and optical depths from 0 \
             to {most:e}, can be merged"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{hierarchy::testing::surface, input::testing::Folder};

    #[test]
    fn building_keeps_to_the_deadline() {
        let splats = surface(500, 1);
        let set = Surfels { origin: glam::DVec3::ZERO, splats, extent: 3.0 };
        let options = BuildOptions { deadline: Deadline::after(0), ..BuildOptions::default() };
        let built = [
            Tree::build(&set, &options, None).map(drop),
            build_file(
                &set,
                Folder::new().path("a.splk"),
                &options,
                &WriteOptions::default(),
                None,
            ),
        ];
        for built in built {
            let message = built.unwrap_err().to_string();
            assert_eq!(message, "building the hierarchy takes longer than the limit of 0 s");
        }
    }
}

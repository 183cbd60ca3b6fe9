//! Writes a hierarchy block by block. Only the blocks being written are in memory.

use super::{
    HASH, PAGE_NODES,
    drafts::{Drafts, Joint},
    header::{Header, Stored},
    page::{self, Coded},
    pages::{Around, Run, in_order, pages},
};
use crate::{
    Error, Result,
    about::Orientation,
    gaussians::Colors,
    hierarchy::{
        Block, MOST_CHILDREN, Node, Tree,
        validate::{fault, fault_of_box, fault_of_extent},
    },
    math::Bounds,
    splat::NO_NORMAL,
};
use crate::{
    container::{
        Spill, Target,
        directory::{Layout, Place},
    },
    parallel::{self, prelude::*},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::{
    io::{self, Write},
    ops::Range,
    path::{Path, PathBuf},
};

/// Options for writing a hierarchy, and what the file says about its source.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct WriteOptions {
    /// Store every bit, at about eight times the size.
    pub lossless: bool,
    /// How the source stands; `None` if unknown.
    pub orientation: Option<Orientation>,
    /// Whether the orientation was guessed from the shape.
    pub is_guessed: bool,
    /// The name of the world's unit.
    pub unit: String,
    /// The name of the source.
    pub source: String,
}

/// The properties of a hierarchy that are known once all its blocks are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Whole {
    /// World position of the origin of all positions.
    pub origin: DVec3,
    /// The box around all footprints, in world coordinates.
    pub bounds: Bounds,
    /// Whether the source is solid ([`Tree::closed`]).
    pub closed: bool,
    /// Points in the source: vertices or samples.
    pub source_points: u64,
}

/// The block that joins the others.
#[derive(Debug, Clone, Copy)]
pub struct Top<'a> {
    /// Its nodes, breadth first, and their colours if those of the others have some. Its leaves are
    /// portals.
    pub block: &'a Block,
    /// For each block, in the order of writing, the leaf that its root replaces.
    pub portals: &'a [u32],
}

/// Writes a file block by block. Pages are kept in a temporary file beside it.
/// [`finish`](Self::finish) makes the whole file appear; without that, there is none.
pub struct Writer {
    path: Option<PathBuf>,
    options: WriteOptions,
    extent: f32,
    spill: Spill,
    drafts: Drafts,
    roots: Vec<Node>,
    contents: Contents,
    /// The degree of the first block's colours, if there is one already.
    degree: Option<Option<u32>>,
}

impl Writer {
    /// Begins a file of splats whose footprints end `extent` standard deviations from their
    /// centres.
    ///
    /// # Errors
    /// [`Error::Output`] if nothing can be written beside `path`; [`Error::Argument`] if the extent
    /// is not a positive number, or above [`MAX_EXTENT`](crate::splat::Splat::MAX_EXTENT).
    pub fn new(path: impl AsRef<Path>, extent: f32, options: &WriteOptions) -> Result<Self> {
        let path = path.as_ref();
        Self::begin(Some(path.to_owned()), extent, options, || Spill::beside(path))
    }

    /// As [`new`](Self::new), with pages that are there already ([`adopt`](Self::adopt)).
    pub(in crate::hierarchy) fn over(
        path: &Path,
        extent: f32,
        options: &WriteOptions,
        pages: Spill,
    ) -> Result<Self> {
        Self::begin(Some(path.to_owned()), extent, options, || Ok(pages))
    }

    fn begin(
        path: Option<PathBuf>,
        extent: f32,
        options: &WriteOptions,
        spill: impl FnOnce() -> Result<Spill>,
    ) -> Result<Self> {
        if let Some(fault) = fault_of_extent(extent) {
            return Err(Error::Argument(format!("the hierarchy: {fault}")));
        }
        let drafts = match &path {
            Some(path) => Spill::beside(path)?,
            None => Spill::Memory(Vec::new()),
        };
        Ok(Self {
            path,
            options: options.clone(),
            extent,
            spill: spill()?,
            drafts: Drafts::new(drafts),
            roots: Vec::new(),
            contents: Contents::default(),
            degree: None,
        })
    }

    /// Writes an ordinary block, breadth first, with positions relative to the tree's origin.
    /// Returns its root as it will be decoded, which the block that joins the others must bound.
    ///
    /// # Errors
    /// [`Error::Argument`] if the nodes are not in the order that
    /// [`Block`](crate::hierarchy::Block) requires, or if values are not finite or cannot be drawn;
    /// [`Error::Output`] if the block cannot be written.
    pub fn block(&mut self, block: &Block) -> Result<Node> {
        Ok(self.blocks(&[block])?[0])
    }

    /// Writes several blocks in parallel, as [`block`](Self::block) writes one.
    ///
    /// # Errors
    /// Those of [`block`](Self::block).
    pub fn blocks(&mut self, blocks: &[&Block]) -> Result<Vec<Node>> {
        let written = self.roots.len();
        for (number, block) in (written..).zip(blocks) {
            self.check_colors(block).map_err(|message| refusal(number, message))?;
        }
        let wanted = self.path.as_deref().unwrap_or(Path::new("memory"));
        let (extent, is_lossless) = (self.extent, self.options.lossless);
        for (coded, around) in encode(blocks, written, extent, is_lossless, wanted)? {
            let places = self.push(&coded.pages)?;
            self.adopt(&Placed::new(&coded, around, places))?;
        }
        Ok(self.roots[written..].to_vec())
    }

    /// Adds a block whose pages are already in the storage that this began with.
    ///
    /// # Errors
    /// [`Error::Output`] if its entries cannot be written.
    pub(in crate::hierarchy) fn adopt(&mut self, block: &Placed) -> Result<()> {
        self.degree.get_or_insert(None);
        self.contents.join(&block.contents);
        let Placed { runs, around, places, .. } = block;
        self.drafts.push(runs, around, places).map_err(|e| self.fault(e))?;
        self.roots.push(block.root);
        Ok(())
    }

    /// Returns an error unless all blocks have colours of one degree for all nodes, or none has.
    fn check_colors(&mut self, block: &Block) -> Result<(), String> {
        let degree = block.colors.as_ref().map(Colors::degree);
        let first = *self.degree.get_or_insert(degree);
        let count = block.colors.as_ref().map_or(block.nodes.len(), Colors::len);
        if first != degree || count != block.nodes.len() {
            return Err(format!(
                "it has {count} colours of the degree {degree:?} for {} nodes, but the degree of \
                 the first block is {first:?}",
                block.nodes.len()
            ));
        }
        Ok(())
    }

    /// Finishes the file. A single block needs no `top`; several need the block that joins them.
    /// The leaves of that block get the bounds of the roots that replace them, and its other nodes
    /// grow as necessary.
    ///
    /// # Errors
    /// [`Error::Argument`] if `top` does not fit the blocks that were written, if it has values
    /// that cannot be drawn, or if the origin or the bounds are not finite. [`Error::Output`] if
    /// the file cannot be written.
    pub fn finish(self, top: Option<Top>, whole: &Whole) -> Result<()> {
        let path = self.path.clone();
        let target = || path.as_deref().map_or(Ok(Target::Memory(Vec::new())), Target::at);
        self.end(top, whole, target).map(|_| ())
    }

    fn end(
        mut self,
        top: Option<Top>,
        whole: &Whole,
        target: impl FnOnce() -> Result<Target>,
    ) -> Result<Vec<u8>> {
        if let Some(fault) = fault_of_box(whole.origin, &whole.bounds) {
            return Err(Error::Argument(format!("the hierarchy: {fault}")));
        }
        let joint = match (top, self.roots.len()) {
            (_, 0) => return Err(Error::Argument("the hierarchy has no blocks".into())),
            (None, 1) => Joint::default(),
            (None, count) => {
                return Err(Error::Argument(format!(
                    "the {count} blocks of the hierarchy need a block that joins them"
                )));
            }
            (Some(top), _) => self.join(top)?,
        };
        let (wanted, path) = (self.path.clone(), PathBuf::from("memory"));
        let wanted = wanted.unwrap_or(path);
        let mut stored = Stored {
            header: self.header(whole, joint.nodes.len() as u64),
            file_bytes: 0,
            blocks: self.drafts.blocks() + u32::from(!joint.pages.is_empty()),
            pages: self.drafts.pages + joint.pages.len() as u32,
        };
        let mut out = target()?;
        let written = self.assemble(&mut stored, joint, &mut out);
        written.map_err(|e| Error::output(&wanted, e))?;
        out.end(&wanted)
    }

    /// Writes the whole file.
    fn assemble(self, stored: &mut Stored, joint: Joint, out: &mut Target) -> io::Result<()> {
        let mut entries = self.drafts.end(joint)?;
        let mut spill = self.spill;
        let mut layout = Layout::new(stored.pages, stored.length() as u64, &mut entries)?;
        stored.file_bytes = layout.end + HASH as u64;
        let (root, waiting) = layout.encode(&mut entries, &mut spill)?;
        let mut hash = blake3::Hasher::new();
        let mut put = |bytes: &[u8]| {
            hash.update(bytes);
            out.write_all(bytes)
        };
        put(&stored.encode())?;
        put(&root)?;
        layout.write(&mut entries, &waiting, &mut spill.end()?, &mut put)?;
        out.write_all(hash.finalize().as_bytes())
    }

    /// Writes the pages of the block on top.
    fn join(&mut self, top: Top) -> Result<Joint> {
        let refuse = |message: String| {
            Error::Argument(format!("the block that joins the others: {message}"))
        };
        in_order(&top.block.nodes).map_err(refuse)?;
        self.check_colors(top.block).map_err(refuse)?;
        let mut nodes = top.block.nodes.clone();
        let leaves = nodes.iter().filter(|node| node.is_leaf()).count();
        if top.portals.len() != self.roots.len() || leaves != self.roots.len() {
            let [portals, blocks] = [top.portals.len(), self.roots.len()];
            return Err(refuse(format!(
                "it has {leaves} leaves and {portals} portals for {blocks} blocks"
            )));
        }
        let mut is_taken = vec![false; nodes.len()];
        for (root, &portal) in self.roots.iter().zip(top.portals) {
            let portal = portal as usize;
            if !nodes.get(portal).is_some_and(Node::is_leaf)
                || std::mem::replace(&mut is_taken[portal], true)
            {
                return Err(refuse(format!(
                    "node {portal} is not a leaf, or is the portal of two blocks"
                )));
            }
            nodes[portal] = Node { first_child: 0, children: 0, ..*root };
        }
        page::enclose(&mut nodes);
        check_nodes(&nodes).map_err(refuse)?;
        // Each portal states the first page of its block. The pages on top come before these.
        let top_pages = pages(&nodes).len() as u32;
        for (&portal, first) in top.portals.iter().zip(self.drafts.firsts()) {
            nodes[portal as usize].first_child = top_pages + first;
        }
        let block = Block { nodes, colors: top.block.colors.clone(), portal: None };
        let (coded, around) = encode_block(&block, self.extent, true).map_err(|e| self.fault(e))?;
        let places = self.push(&coded.pages)?;
        Ok(Joint::new(block.nodes, &coded.runs, &around, &places, top.portals))
    }

    fn fault(&self, e: io::Error) -> Error {
        Error::output(self.path.as_deref().unwrap_or(Path::new("memory")), e)
    }

    fn push(&mut self, pages: &[Vec<u8>]) -> Result<Vec<Place>> {
        let mut places = Vec::with_capacity(pages.len());
        for bytes in pages {
            let offset = self.spill.push(bytes);
            let offset = offset.map_err(|e| self.fault(e))?;
            places.push(Place::of(offset, bytes));
        }
        Ok(places)
    }

    fn header(&self, whole: &Whole, joint_nodes: u64) -> Header {
        Header {
            origin: whole.origin,
            bounds: whole.bounds,
            extent: self.extent,
            closed: whole.closed,
            has_color: self.contents.has_color,
            has_normals: self.contents.has_normals,
            degree: self.degree.flatten(),
            lossless: self.options.lossless,
            source_points: whole.source_points,
            leaves: self.contents.leaves,
            nodes: self.drafts.nodes + joint_nodes,
            orientation: self.options.orientation,
            is_guessed: self.options.is_guessed,
            unit: self.options.unit.clone(),
            source: self.options.source.clone(),
        }
    }
}

/// A block whose pages have been written: everything that a [`Writer`] must know of it.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::hierarchy) struct Placed {
    pub root: Node,
    pub runs: Vec<Run>,
    pub around: Vec<Around>,
    pub places: Vec<Place>,
    pub contents: Contents,
}

impl Placed {
    pub fn new(coded: &Coded, around: Vec<Around>, places: Vec<Place>) -> Self {
        let mut contents = Contents::default();
        contents.add(&coded.nodes);
        Self { root: coded.nodes[0], runs: coded.runs.clone(), around, places, contents }
    }

    /// Whether it can be what [`new`](Self::new) returns, with pages in this part of a file. One
    /// that was read from a file may be anything.
    pub fn is_sound(&self, pages: &Range<u64>) -> bool {
        let Self { root, runs, around, places, contents } = self;
        // Nodes follow each other from the root on, and every node but the root is a child.
        let (mut nodes, mut children) = (0, 1);
        for run in runs {
            let is_next = run.nodes.start == nodes
                && (1..=PAGE_NODES).contains(&run.nodes.end.saturating_sub(nodes))
                && run.children.start == children
                && run.children.end >= children
                && run.children.start > run.nodes.start;
            if !is_next {
                return false;
            }
            (nodes, children) = (run.nodes.end, run.children.end);
        }
        let of_around = |(at, around): (usize, &Around)| {
            let lengths = [around.radius, around.largest_size];
            let is_bounded = around.center.iter().chain(&lengths).all(|value| value.is_finite())
                && lengths.iter().all(|length| *length >= 0.0);
            if at == 0 { *around == Around::EVERYTHING } else { is_bounded }
        };
        let of_place = |place: &Place| {
            let end = place.offset.checked_add(place.bytes.into());
            place.offset >= pages.start && end.is_some_and(|end| end <= pages.end)
        };
        let has_children = root.children > 0;
        nodes > 0
            && children == nodes
            && u32::try_from(nodes).is_ok()
            && (around.len(), places.len()) == (runs.len(), runs.len())
            && around.iter().enumerate().all(of_around)
            && places.iter().all(of_place)
            && (1..=nodes as u64).contains(&contents.leaves)
            && root.children as usize <= MOST_CHILDREN
            && has_children == (nodes > 1)
            && root.first_child == u32::from(has_children)
            && check_nodes(std::slice::from_ref(root)).is_ok()
    }
}

fn refusal(number: usize, message: String) -> Error {
    Error::Argument(format!("block {number} of the hierarchy: {message}"))
}

/// Encodes blocks in parallel, with the bounds above each of their pages. `number` is that of the
/// first, and `wanted` the file, for errors.
///
/// # Errors
/// Those of [`Writer::block`].
pub(in crate::hierarchy) fn encode(
    blocks: &[&Block],
    number: usize,
    extent: f32,
    is_lossless: bool,
    wanted: &Path,
) -> Result<Vec<(Coded, Vec<Around>)>> {
    for (number, block) in (number..).zip(blocks) {
        in_order(&block.nodes).map_err(|message| refusal(number, message))?;
        check_nodes(&block.nodes).map_err(|message| refusal(number, message))?;
    }
    let encode = |block: &&Block| encode_block(block, extent, is_lossless);
    let coded: io::Result<Vec<_>> = blocks.par_iter().map(encode).collect();
    coded.map_err(|e| Error::output(wanted, e))
}

fn encode_block(block: &Block, extent: f32, is_lossless: bool) -> io::Result<(Coded, Vec<Around>)> {
    let coded = page::encode(block, extent, is_lossless)?;
    let around = arounds(&coded.nodes, &coded.runs);
    Ok((coded, around))
}

/// Returns an error if a node has values that cannot be drawn.
pub(super) fn check_nodes(nodes: &[Node]) -> Result<(), String> {
    let faulty =
        nodes.par_iter().enumerate().find_map_first(|(index, node)| Some((index, fault(node)?)));
    faulty.map_or(Ok(()), |(index, fault)| Err(format!("node {index} has {fault}")))
}

/// Properties of the leaves of ordinary blocks.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::hierarchy) struct Contents {
    pub leaves: u64,
    pub has_color: bool,
    pub has_normals: bool,
    /// Red, green and blue of the first leaf.
    pub color: Option<u32>,
}

impl Contents {
    fn add(&mut self, nodes: &[Node]) {
        for node in nodes.iter().filter(|node| node.is_leaf()) {
            let color = node.splat.color & 0xff_ffff;
            self.leaves += 1;
            self.has_color |= *self.color.get_or_insert(color) != color;
            self.has_normals |= node.splat.normal != NO_NORMAL;
        }
    }

    /// Adds those of the blocks that follow.
    fn join(&mut self, other: &Self) {
        self.leaves += other.leaves;
        self.has_normals |= other.has_normals;
        self.has_color |= other.has_color;
        if let Some(color) = other.color {
            self.has_color |= *self.color.get_or_insert(color) != color;
        }
    }
}

/// Returns, for each page of a block, the bounds around the parents of its nodes.
pub(super) fn arounds(nodes: &[Node], runs: &[Run]) -> Vec<Around> {
    let around = |run: &Run| match run.nodes.start {
        0 => Around::EVERYTHING,
        _ => Around::parents(&nodes[run.parents.clone()]),
    };
    runs.par_iter().map(around).collect()
}

/// Writes a whole hierarchy to a temporary file beside `path`, which is renamed once it is
/// complete.
///
/// # Errors
/// Those of [`Writer`]; also [`Error::Argument`] if a block of a joined tree has no portal.
pub fn write(tree: &Tree, path: impl AsRef<Path>, options: &WriteOptions) -> Result<()> {
    let path = path.as_ref();
    all(tree, Writer::new(path, tree.extent, options)?, || Target::at(path)).map(|_| ())
}

/// Returns the bytes of the file that [`write`](write()) would write.
///
/// # Errors
/// Those of [`write`](write()).
pub fn to_bytes(tree: &Tree, options: &WriteOptions) -> Result<Vec<u8>> {
    let writer = Writer::begin(None, tree.extent, options, || Ok(Spill::Memory(Vec::new())))?;
    all(tree, writer, || Ok(Target::Memory(Vec::new())))
}

fn all(
    tree: &Tree,
    mut writer: Writer,
    target: impl FnOnce() -> Result<Target>,
) -> Result<Vec<u8>> {
    let Tree { origin, bounds, closed, source_points, .. } = *tree;
    let whole = Whole { origin, bounds, closed, source_points };
    let below = &tree.blocks[usize::from(tree.is_joined())..];
    for blocks in below.chunks(2 * parallel::current_num_threads()) {
        writer.blocks(&blocks.iter().collect::<Vec<_>>())?;
    }
    if !tree.is_joined() {
        return writer.end(None, &whole, target);
    }
    let portals: Option<Vec<u32>> = below.iter().map(|block| block.portal).collect();
    let portals =
        portals.ok_or_else(|| Error::Argument("a block of the hierarchy has no portal".into()))?;
    writer.end(Some(Top { block: &tree.blocks[0], portals: &portals }), &whole, target)
}

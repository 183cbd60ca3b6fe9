//! Writes a hierarchy block by block. Only the blocks being written are in memory.

use super::{
    HASH,
    directory::{Directory, Place},
    header::{Header, Stored},
    page::{self, Coded},
    pages::{Around, Run, in_order},
};
use crate::{
    Error, Result,
    about::Stance,
    gaussians::Colors,
    hierarchy::{
        Block, Node, Tree,
        validate::{fault, fault_of_box, fault_of_extent},
    },
    math::Bounds,
    splat::NO_NORMAL,
};
use crate::{
    container::{Spill, Target},
    parallel::{self, prelude::*},
};
use glam::DVec3;
use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

/// Options for writing a hierarchy, and what the file says about its source.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WriteOptions {
    /// Store every bit, at about eight times the size.
    pub lossless: bool,
    /// How the source stands; `None` if unknown.
    pub stance: Option<Stance>,
    /// Whether the stance was guessed from the shape.
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
    /// Of the ordinary blocks, without the one that joins them.
    directory: Directory,
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
    /// is not a positive number, or above [`MAX_EXTENT`](crate::splat::SplatSet::MAX_EXTENT).
    pub fn new(path: impl AsRef<Path>, extent: f32, options: &WriteOptions) -> Result<Self> {
        let path = path.as_ref();
        Self::begin(Some(path.to_owned()), extent, options, || Spill::beside(path))
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
        Ok(Self {
            path,
            options: options.clone(),
            extent,
            spill: spill()?,
            directory: Directory::default(),
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
            let refuse = |message: String| {
                Error::Argument(format!("block {number} of the hierarchy: {message}"))
            };
            in_order(&block.nodes).map_err(refuse)?;
            check_nodes(&block.nodes).map_err(refuse)?;
            self.check_colors(block).map_err(refuse)?;
        }
        let (extent, is_lossless) = (self.extent, self.options.lossless);
        let encode = |block: &&Block| {
            let coded = page::encode(block, extent, is_lossless)?;
            let around = arounds(&coded.nodes, &coded.runs);
            Ok((coded, around))
        };
        let coded: io::Result<Vec<(Coded, Vec<Around>)>> = blocks.par_iter().map(encode).collect();
        let coded = coded.map_err(|e| self.fault(e))?;
        for (coded, around) in coded {
            self.contents.add(&coded.nodes);
            let places = self.push(&coded.pages)?;
            self.directory.push_block(&coded.runs, &around, &places);
            self.roots.push(coded.nodes[0]);
        }
        Ok(self.roots[written..].to_vec())
    }

    /// Returns an error unless all blocks have colours of one degree for all nodes, or none has.
    fn check_colors(&mut self, block: &Block) -> Result<(), String> {
        let own = block.colors.as_ref().map(Colors::degree);
        let degree = *self.degree.get_or_insert(own);
        let count = block.colors.as_ref().map_or(block.nodes.len(), Colors::len);
        if degree != own || count != block.nodes.len() {
            return Err(format!(
                "it has {count} colours of the degree {own:?} for {} nodes, but the degree of the \
                 first block is {degree:?}",
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
        let mut directory = match (top, self.roots.len()) {
            (_, 0) => return Err(Error::Argument("the hierarchy has no blocks".into())),
            (None, 1) => std::mem::take(&mut self.directory),
            (None, count) => {
                return Err(Error::Argument(format!(
                    "the {count} blocks of the hierarchy need a block that joins them"
                )));
            }
            (Some(top), _) => self.join(top)?,
        };
        directory.link();
        let order = directory.coarse_first();
        let spilled: Vec<Place> = directory.pages.iter().map(|page| page.place).collect();
        let mut stored = Stored {
            header: self.header(&directory, whole),
            file_bytes: 0,
            blocks: directory.blocks.len() as u32,
            pages: directory.pages.len() as u32,
        };
        let mut at = stored.length() as u64
            + Directory::length(directory.blocks.len(), directory.pages.len());
        for &page in &order {
            let place = &mut directory.pages[page as usize].place;
            place.offset = at;
            at += u64::from(place.bytes);
        }
        stored.file_bytes = at + HASH as u64;
        let mut out = target()?;
        let mut hash = blake3::Hasher::new();
        let mut put = |bytes: &[u8]| {
            hash.update(bytes);
            out.write_all(bytes)
        };
        let pieces =
            order.iter().map(|&page| (spilled[page as usize].offset, spilled[page as usize].bytes));
        let written = put(&stored.encode())
            .and_then(|()| put(&directory.encode()))
            .and_then(|()| self.spill.replay(pieces, &mut put))
            .and_then(|()| out.write_all(hash.finalize().as_bytes()));
        let wanted = self.path.as_deref().unwrap_or(Path::new("memory"));
        written.map_err(|e| Error::output(wanted, e))?;
        out.end(wanted)
    }

    /// Writes the block on top, and returns the directory of all blocks.
    fn join(&mut self, top: Top) -> Result<Directory> {
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
        let block = Block { nodes, colors: top.block.colors.clone(), portal: None };
        let coded = page::encode(&block, self.extent, true).map_err(|e| self.fault(e))?;
        let nodes = block.nodes;
        let places = self.push(&coded.pages)?;
        let mut directory = Directory::default();
        directory.push_block(&coded.runs, &arounds(&nodes, &coded.runs), &places);
        directory.append(std::mem::take(&mut self.directory));
        directory.hang(&nodes, top.portals);
        Ok(directory)
    }

    fn fault(&self, e: io::Error) -> Error {
        Error::output(self.path.as_deref().unwrap_or(Path::new("memory")), e)
    }

    fn push(&mut self, pages: &[Vec<u8>]) -> Result<Vec<Place>> {
        let mut places = Vec::with_capacity(pages.len());
        for bytes in pages {
            let offset = self.spill.push(bytes);
            let offset = offset.map_err(|e| self.fault(e))?;
            places.push(Place { offset, bytes: bytes.len() as u32, crc: crc32fast::hash(bytes) });
        }
        Ok(places)
    }

    fn header(&self, directory: &Directory, whole: &Whole) -> Header {
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
            nodes: directory.blocks.iter().map(|block| u64::from(block.nodes)).sum(),
            stance: self.options.stance,
            is_guessed: self.options.is_guessed,
            unit: self.options.unit.clone(),
            source: self.options.source.clone(),
        }
    }
}

/// Returns an error if a node has values that cannot be drawn.
pub(super) fn check_nodes(nodes: &[Node]) -> Result<(), String> {
    let found =
        nodes.par_iter().enumerate().find_map_first(|(index, node)| Some((index, fault(node)?)));
    found.map_or(Ok(()), |(index, fault)| Err(format!("node {index} has {fault}")))
}

/// Properties of the leaves of ordinary blocks.
#[derive(Default)]
struct Contents {
    leaves: u64,
    has_color: bool,
    has_normals: bool,
    /// Red, green and blue of the first leaf.
    color: Option<u32>,
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

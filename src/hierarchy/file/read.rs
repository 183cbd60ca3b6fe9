//! Reads a hierarchy: pages one by one as a picture needs them, with those of the directory that
//! list them, or everything.

use super::{
    HASH,
    entry::{self, Listing, NO_PORTAL, PageEntry},
    header::{Header, Refusal, Stored},
    page::{self, Frame},
    pages::{Around, in_order, pages},
    write::{arounds, check_nodes},
};
use crate::{
    Error, Result,
    container::directory::{Directory, Fault, Place, Run, Shape},
    error::LimitKind,
    gaussians::Colors,
    hierarchy::{
        Block, Node, Tree,
        validate::{fault_of_box, fault_of_extent},
    },
    input::{self, Bytes, Limits},
    math::Bounds,
    parallel::prelude::*,
};
use std::{
    collections::{HashMap, VecDeque},
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

/// No root of a directory is longer, with its checksum.
const MOST_ROOT: usize = 64 << 10;

/// In [`Page::child_pages`]: a leaf, which has no children.
pub const NO_PAGE: u32 = u32::MAX;

/// The bounds that decide whether a node is refined. Lengths are in world units, the centre
/// relative to the tree's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CutSphere {
    /// The centre of the node's bounding sphere.
    pub center: [f32; 3],
    /// The radius of that sphere.
    pub radius: f32,
    /// The apparent width of the node's splat ([`Node::size`]).
    pub size: f32,
}

impl CutSphere {
    /// Returns the bounds of a node.
    pub fn of(node: &Node) -> Self {
        Self { center: node.center, radius: node.radius, size: node.size }
    }

    fn around(around: &Around) -> Self {
        Self { center: around.center, radius: around.radius, size: around.largest_size }
    }
}

/// The nodes of a page, their colours, and for each node the page that a portal states, if pages
/// state these.
struct Content {
    nodes: Vec<Node>,
    colors: Option<Colors>,
    links: Option<Vec<u32>>,
}

/// A decoded page.
#[derive(Debug, Clone)]
pub struct Page {
    /// Its nodes, adjacent in their block; [`Node::first_child`] is an index in the block.
    pub nodes: Vec<Node>,
    /// The colours of its nodes, if they are trained Gaussians.
    pub colors: Option<Colors>,
    /// The parents of its nodes, each once, with exactly the values that they have in their own
    /// pages. The parent of a block's root is that of its portal.
    pub parents: Vec<CutSphere>,
    /// For each node, the index of its parent in `parents`; `u32::MAX` for the root of the tree.
    pub parent: Vec<u32>,
    /// For each node, the page that contains its children or, for a portal, the first page of its
    /// block; [`NO_PAGE`] for a leaf.
    pub child_pages: Vec<u32>,
    /// Whether the leaves of this page are portals, which are never drawn.
    pub has_portals: bool,
}

impl Page {
    /// Returns whether a node is a portal, which the root of its block replaces.
    pub fn is_portal(&self, node: usize) -> bool {
        self.has_portals && self.nodes[node].is_leaf()
    }
}

/// A hierarchy opened from a file, from bytes, or from a tree in memory.
///
/// The same as a file on disk, in memory:
///
/// ```
/// use splatkit::{
///     hierarchy::{BuildOptions, Hierarchy, Tree, file},
///     input::Limits,
///     surface::{Mesh, SurfelOptions},
/// };
///
/// let ball = Mesh::sphere(3).surfels(&SurfelOptions::default())?;
/// let tree = Tree::build(&ball, &BuildOptions::default(), None)?;
/// let bytes = file::to_bytes(&tree, &file::WriteOptions::default())?;
/// let hierarchy = Hierarchy::from_bytes(bytes, "ball.splk", &Limits::default())?;
/// assert_eq!(hierarchy.header().leaves, ball.splats.len() as u64);
/// assert_eq!(hierarchy.leaves()?.splats.len(), ball.splats.len());
/// # Ok::<(), splatkit::Error>(())
/// ```
pub struct Hierarchy {
    path: PathBuf,
    store: Store,
    header: Header,
    /// The number of blocks.
    blocks: u32,
    directory: Directory<Listing>,
    /// The page for each portal, a leaf of block 0. `None` if the portals themselves state it.
    portals: Option<HashMap<u32, u32>>,
    families: Mutex<Families>,
    limits: Limits,
}

impl std::fmt::Debug for Hierarchy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Hierarchy")
            .field("path", &self.path)
            .field("header", &self.header)
            .finish_non_exhaustive()
    }
}

enum Store {
    File(Bytes),
    Blocks(Vec<Block>),
}

/// Pages that are fetched and decoded together.
const BATCH: usize = 64;

impl Hierarchy {
    /// Opens a file: reads and checks the header and the directory, and maps the rest. Pages of a
    /// remote object ([`address`](crate::input::address())) are fetched when they are read.
    ///
    /// # Errors
    /// [`Error::Input`] for other kinds of files, other versions, damaged headers and directories,
    /// and incomplete files; [`Error::Limit`] and [`Error::File`] as for every input.
    pub fn open(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = &input::address(path.as_ref());
        Self::new(path, Bytes::open(path, limits)?, limits)
    }

    /// Opens the bytes of a file, which errors call `name`.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn from_bytes(bytes: Vec<u8>, name: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        Self::new(name.as_ref(), Bytes::Held(bytes), limits)
    }

    pub(super) fn new(path: &Path, bytes: Bytes, limits: &Limits) -> Result<Self> {
        let begun = bytes.begun(|bytes| begin(path, bytes, limits));
        let begun = begun.map_err(|error| bytes.why(path, error))?;
        Ok(Self::assemble(path, Store::File(bytes.ready()), begun, limits.clone()))
    }

    /// Uses a tree directly, without encoding it.
    ///
    /// # Errors
    /// [`Error::Argument`] if the nodes of a block are not in the order that [`Block`] requires, if
    /// blocks do not match portals, or if values cannot be drawn. Those are the values that
    /// [`validate`](crate::hierarchy::validate()) rejects in a single node.
    pub fn from_tree(tree: Tree) -> Result<Self> {
        if tree.blocks.is_empty() {
            return Err(Error::Argument("the hierarchy has no blocks".into()));
        }
        let fault = fault_of_box(tree.origin, &tree.bounds).map(str::to_owned);
        if let Some(fault) = fault.or_else(|| fault_of_extent(tree.extent)) {
            return Err(Error::Argument(format!("the hierarchy: {fault}")));
        }
        let (entries, portals) = entries_of(&tree)?;
        let header = Header {
            origin: tree.origin,
            bounds: tree.bounds,
            extent: tree.extent,
            closed: tree.closed,
            has_color: true,
            has_normals: true,
            degree: tree.degree(),
            lossless: true,
            source_points: tree.source_points,
            leaves: tree.leaf_count(),
            nodes: tree.blocks.iter().map(|block| block.nodes.len() as u64).sum(),
            orientation: None,
            is_guessed: false,
            unit: String::new(),
            source: String::new(),
        };
        let blocks = tree.blocks.len() as u32;
        let kind = Listing { blocks, pages: entries.len() as u32, start: 0, end: 0 };
        let directory = Directory::held(kind, &entries);
        let begun = Begun { header, blocks, directory, portals: Some(portals) };
        Ok(Self::assemble(Path::new("memory"), Store::Blocks(tree.blocks), begun, Limits::none()))
    }

    fn assemble(path: &Path, store: Store, begun: Begun, limits: Limits) -> Self {
        let Begun { header, blocks, directory, portals } = begun;
        let (path, families) = (path.to_owned(), Mutex::default());
        Self { path, store, header, blocks, directory, portals, families, limits }
    }

    /// Returns the properties of the whole hierarchy.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Returns the box around all footprints, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        self.header.bounds
    }

    /// Returns the number of pages. They are numbered from 0, block by block; the root's page is
    /// first.
    pub fn page_count(&self) -> u32 {
        self.directory.len()
    }

    /// Returns the entry of a page in the directory. May read the part of the directory that lists
    /// it.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such page; [`Error::Input`] if the directory is damaged
    /// or not available there.
    pub fn entry(&self, page: u32) -> Result<PageEntry> {
        let count = self.page_count();
        if page >= count {
            return Err(Error::Argument(format!("there is no page {page} among {count}")));
        }
        self.directory.entry(self.bytes(), page).map_err(|fault| self.fault(fault))
    }

    /// Calls `each` with batches of entries, in the order of pages: those of the pages that are
    /// present and whose bounds, or bounds around them, pass. It returns whether to go on.
    pub(in crate::hierarchy) fn visit(
        &self,
        around: impl Fn(&CutSphere) -> bool + Sync,
        mut each: impl FnMut(&[Run<Listing>]) -> Result<bool>,
    ) -> Result<()> {
        let wanted = |bounds: &Around| bounds.is_endless() || around(&CutSphere::around(bounds));
        let fail = |fault| self.fault(fault);
        self.directory.visit(self.bytes(), &wanted, &mut each, &fail)
    }

    /// Returns whether the leaves of block 0 are portals.
    pub fn is_joined(&self) -> bool {
        self.blocks > 1
    }

    /// Reads and decodes a page, and verifies its checksum. Can be called from any thread. Pages
    /// whose parents were read recently are faster.
    ///
    /// # Errors
    /// [`Error::Input`] if the page, or a page above it, is damaged;
    /// [`Error::Argument`] if there is no such page.
    pub fn read_page(&self, page: u32) -> Result<Page> {
        let entry = self.entry(page)?;
        let Content { nodes, colors, links } = self.read_nodes(page, &entry)?;
        let page_families: Arc<[Family]> = families(&nodes).into();
        let is_first = entry.first_node == 0;
        let mut parents = Vec::new();
        let mut parent = Vec::with_capacity(nodes.len());
        if is_first {
            parent.push(match entry.portal {
                NO_PORTAL | 0 => u32::MAX,
                portal => {
                    let above = self.families(entry.parent_pages.start)?;
                    let family =
                        above.partition_point(|family| family.first_child <= portal).checked_sub(1);
                    let family =
                        family.map(|index| above[index]).filter(|family| family.has(portal));
                    let family = family.ok_or_else(|| self.torn(page))?;
                    parents.push(family.parent);
                    0
                }
            });
        }
        let range = entry.range();
        let mut add = |families: &[Family]| {
            let begin = families.partition_point(|family| family.first_child < range.start);
            for family in
                families[begin..].iter().take_while(|family| family.first_child < range.end)
            {
                if family.first_child != range.start + parent.len() as u32 {
                    return Err(self.torn(page));
                }
                parent.extend(std::iter::repeat_n(parents.len() as u32, family.children as usize));
                parents.push(family.parent);
            }
            Ok(())
        };
        if !is_first {
            for above in entry.parent_pages.clone() {
                add(&self.families(above)?)?;
            }
        }
        add(&page_families)?;
        if parent.len() != nodes.len() {
            return Err(self.torn(page));
        }
        self.families.lock().unwrap_or_else(|e| e.into_inner()).keep(page, page_families);
        let has_portals = self.has_portals(&entry);
        let child_pages = self.child_pages(page, &entry, &nodes, links.as_deref())?;
        Ok(Page { nodes, colors, parents, parent, child_pages, has_portals })
    }

    /// Returns whether the leaves of a page are portals.
    fn has_portals(&self, entry: &PageEntry) -> bool {
        self.is_joined() && entry.block == 0
    }

    /// Reads pages in parallel, as [`read_page`](Self::read_page) does. Those of a remote object
    /// are fetched together.
    ///
    /// # Errors
    /// Those of [`read_page`](Self::read_page).
    pub fn read_pages(&self, pages: &[u32]) -> Result<Vec<Page>> {
        self.batched(pages, |page| self.read_page(page))
    }

    /// Returns what `read` makes of each page, in parallel and in order. Pages of a remote object
    /// are fetched together first, a batch at a time.
    pub(in crate::hierarchy) fn batched<T: Send>(
        &self,
        pages: &[u32],
        read: impl Fn(u32) -> Result<T> + Sync,
    ) -> Result<Vec<T>> {
        let is_remote = matches!(self.store, Store::File(Bytes::Remote(_)));
        let most = if is_remote { BATCH } else { pages.len().max(1) };
        let mut all = Vec::with_capacity(pages.len());
        for batch in pages.chunks(most) {
            self.fetch(batch.iter().copied())?;
            // Reports the first of several damaged pages, whichever thread finds one first.
            let results: Vec<Result<T>> = batch.par_iter().map(|&page| read(page)).collect();
            all.extend(results.into_iter().collect::<Result<Vec<T>>>()?);
        }
        Ok(all)
    }

    /// Fetches pages of a remote object together, which are read soon.
    fn fetch(&self, pages: impl Iterator<Item = u32>) -> Result<()> {
        let Store::File(file) = &self.store else { return Ok(()) };
        let entries = pages.map(|page| self.entry(page)).collect::<Result<Vec<_>>>()?;
        file.fetch(entries.iter().map(|entry| entry.place.range()))
    }

    /// Reads the whole tree.
    ///
    /// # Errors
    /// Those of [`read_page`](Self::read_page), and [`Error::Limit`] if the tree is larger than the
    /// limits allow.
    pub fn read_tree(&self) -> Result<Tree> {
        self.check_size()?;
        let mut blocks = Vec::new();
        let mut page = 0;
        while page < self.page_count() {
            let entries = self.block_from(page)?;
            blocks.push(self.read_block(page, &entries)?);
            page += entries.len() as u32;
        }
        Ok(Tree {
            origin: self.header.origin,
            extent: self.header.extent,
            closed: self.header.closed,
            bounds: self.header.bounds,
            source_points: self.header.source_points,
            blocks,
        })
    }

    /// Returns the entries of the block whose first page has a number.
    pub(super) fn block_from(&self, first: u32) -> Result<Vec<PageEntry>> {
        let mut entries: Vec<PageEntry> = Vec::new();
        loop {
            let page = first + entries.len() as u32;
            if page == self.page_count() {
                return Ok(entries);
            }
            let run = self.directory.run(self.bytes(), page).map_err(|fault| self.fault(fault))?;
            for entry in &run.1[(page - run.0) as usize..] {
                if entries.first().is_some_and(|first| first.block != entry.block) {
                    return Ok(entries);
                }
                entries.push(entry.clone());
            }
        }
    }

    /// Returns an error if the tree is larger than the limits allow. A few bytes of the file may
    /// decode to a whole page of equal nodes.
    pub(in crate::hierarchy) fn check_size(&self) -> Result<()> {
        // Once as pages, and once joined.
        let bytes = self.header.nodes.saturating_mul(2 * size_of::<Node>() as u64);
        self.limits.check(LimitKind::Bytes, &self.path, "the size of the tree in bytes", bytes)
    }

    /// Reads the block whose first page has the number `first`; `entries` are those of its pages.
    pub(super) fn read_block(&self, first: u32, entries: &[PageEntry]) -> Result<Block> {
        let (block, portal) = (entries[0].block, entries[0].portal);
        // A few bytes of the file may decode to a whole page of equal nodes.
        let bytes = entries.iter().map(|entry| u64::from(entry.nodes)).sum::<u64>()
            * 2
            * size_of::<Node>() as u64;
        self.limits.check(
            LimitKind::Bytes,
            &self.path,
            format!("the size of block {block} in bytes"),
            bytes,
        )?;
        let numbers: Vec<u32> = (first..).take(entries.len()).collect();
        let mut pages = self
            .batched(&numbers, |page| self.read_nodes(page, &entries[(page - first) as usize]))?;
        let colors: Option<Vec<Colors>> =
            pages.iter_mut().map(|content| content.colors.take()).collect();
        let nodes: Vec<Node> = pages.into_iter().flat_map(|content| content.nodes).collect();
        in_order(&nodes)
            .map_err(|message| damaged(&self.path, format!("block {block}"), message))?;
        Ok(Block {
            nodes,
            portal: Some(portal).filter(|&portal| portal != NO_PORTAL),
            colors: self.header.degree.zip(colors).map(|(_, colors)| Colors::joined(&colors)),
        })
    }

    pub(super) fn block_count(&self) -> u32 {
        self.blocks
    }

    pub(super) fn directory(&self) -> &Directory<Listing> {
        &self.directory
    }

    /// Returns the page that each portal states, if portals state it: those of a page of block 0.
    pub(super) fn links(&self, page: u32, entry: &PageEntry) -> Result<Option<Vec<u32>>> {
        Ok(self.read_nodes(page, entry)?.links)
    }

    /// Returns the error for a fault of the directory.
    pub(super) fn fault(&self, fault: Fault) -> Error {
        let error = error_of(&self.path, fault);
        match self.bytes() {
            Some(file) => file.why(&self.path, error),
            None => error,
        }
    }

    /// Returns the bytes of a file; `None` for a tree in memory.
    pub(super) fn bytes(&self) -> Option<&Bytes> {
        match &self.store {
            Store::File(bytes) => Some(bytes),
            Store::Blocks(_) => None,
        }
    }

    /// Reads the nodes of a page without their parents, and their colours.
    fn read_nodes(&self, page: u32, entry: &PageEntry) -> Result<Content> {
        let file = match &self.store {
            Store::File(file) => file,
            Store::Blocks(blocks) => {
                let (block, nodes) = (&blocks[entry.block as usize], entry.range());
                let range = nodes.start as usize..nodes.end as usize;
                let colors = block.colors.as_ref().map(|colors| colors.chosen(range.clone()));
                return Ok(Content { nodes: block.nodes[range].to_vec(), colors, links: None });
            }
        };
        let Place { offset, crc, .. } = entry.place;
        let place = || format!("page {page} (byte {offset})");
        if entry.place.range().end > file.len() {
            return Err(incomplete(&self.path, place()));
        }
        let has_links = self.portals.is_none() && self.has_portals(entry);
        let frame = Frame {
            nodes: entry.nodes as usize,
            first_child: entry.first_child,
            extent: self.header.extent,
            degree: self.header.degree,
            has_links,
        };
        let decode = |bytes: &[u8]| {
            if crc32fast::hash(bytes) != crc {
                return Err("its checksum does not match".into());
            }
            page::decode_colored(bytes, frame)
        };
        let (mut nodes, colors) = file
            .decoded(entry.place.range(), decode)?
            .map_err(|message| file.why(&self.path, damaged(&self.path, place(), message)))?;
        let links = has_links.then(|| links(&mut nodes));
        Ok(Content { nodes, colors, links })
    }

    /// Returns the nodes of a page that have children.
    fn families(&self, page: u32) -> Result<Arc<[Family]>> {
        if let Some(held) = self.families.lock().unwrap_or_else(|e| e.into_inner()).get(page) {
            return Ok(held);
        }
        let read = self.read_nodes(page, &self.entry(page)?)?;
        let read: Arc<[Family]> = families(&read.nodes).into();
        self.families.lock().unwrap_or_else(|e| e.into_inner()).keep(page, read.clone());
        Ok(read)
    }

    fn child_pages(
        &self,
        page: u32,
        entry: &PageEntry,
        nodes: &[Node],
        links: Option<&[u32]>,
    ) -> Result<Vec<u32>> {
        let wrong = |message: String| damaged(&self.path, format!("page {page}"), message);
        // Children are adjacent, so their pages are too.
        let mut below = entry.child_page;
        let mut range = 0..0;
        let child_page = |(index, node): (usize, &Node)| {
            if !node.is_leaf() {
                while !range.contains(&node.first_child) {
                    let next = if range.is_empty() { below } else { below + 1 };
                    let child = (next < self.page_count()).then(|| self.entry(next)).transpose()?;
                    let child = child.filter(|child| {
                        child.block == entry.block
                            && (range.is_empty() || child.first_node == range.end)
                            && child.first_node <= node.first_child
                    });
                    let child = child.ok_or_else(|| {
                        wrong(format!("no page has node {} of its block", node.first_child))
                    })?;
                    (below, range) = (next, child.range());
                }
                return Ok(below);
            }
            if !self.has_portals(entry) {
                return Ok(NO_PAGE);
            }
            let number = entry.first_node + index as u32;
            let linked = match (links, &self.portals) {
                (Some(links), _) => {
                    Some(links[index]).filter(|link| (page + 1..self.page_count()).contains(link))
                }
                (None, portals) => {
                    portals.as_ref().and_then(|portals| portals.get(&number).copied())
                }
            };
            linked.ok_or_else(|| wrong(format!("no block has the portal at node {number}")))
        };
        nodes.iter().enumerate().map(child_page).collect()
    }

    /// The error for a page that does not fit the pages above it.
    fn torn(&self, page: u32) -> Error {
        damaged(&self.path, format!("page {page}"), "its nodes are not the children of those above")
    }
}

/// Takes the pages that portals state out of the nodes of a page.
fn links(nodes: &mut [Node]) -> Vec<u32> {
    let link = |node: &mut Node| match node.is_leaf() {
        true => std::mem::take(&mut node.first_child),
        false => NO_PAGE,
    };
    nodes.iter_mut().map(link).collect()
}

/// Returns the entries of a tree in memory, whose pages have no places in a file, and the page for
/// each portal.
fn entries_of(tree: &Tree) -> Result<(Vec<PageEntry>, HashMap<u32, u32>)> {
    let top = &tree.blocks[0].nodes;
    let mut entries: Vec<PageEntry> = Vec::new();
    let mut portals = HashMap::new();
    for (number, block) in tree.blocks.iter().enumerate() {
        let refuse =
            |message| Error::Argument(format!("block {number} of the hierarchy: {message}"));
        in_order(&block.nodes).and_then(|()| check_nodes(&block.nodes)).map_err(refuse)?;
        let colors = block.colors.as_ref().map(|colors| (colors.degree(), colors.len()));
        if colors != tree.degree().map(|degree| (degree, block.nodes.len())) {
            return Err(refuse(format!(
                "its colours are {colors:?} for {} nodes",
                block.nodes.len()
            )));
        }
        let first = entries.len() as u32;
        match (number, block.portal) {
            (0, None) => {}
            (1.., Some(portal)) if top.get(portal as usize).is_some_and(Node::is_leaf) => {
                portals.insert(portal, first);
            }
            (_, portal) => return Err(refuse(format!("its portal is {portal:?}"))),
        }
        let runs = pages(&block.nodes);
        let places = vec![Place::default(); runs.len()];
        let around = arounds(&block.nodes, &runs);
        let mut block_entries = entry::of_block(number as u32, first, &runs, &around, &places);
        let portal = block.portal.unwrap_or(NO_PORTAL);
        block_entries.iter_mut().for_each(|entry| entry.portal = portal);
        entries.extend(block_entries);
    }
    let leaves = top.iter().filter(|node| node.is_leaf()).count();
    if tree.is_joined() && (portals.len() != leaves || tree.blocks.len() != leaves + 1) {
        let blocks = tree.blocks.len() - 1;
        let message = format!("the hierarchy has {blocks} blocks below {leaves} portals");
        return Err(Error::Argument(message));
    }
    let top_pages = entries.iter().take_while(|entry| entry.block == 0).count();
    let (top_entries, below) = entries.split_at_mut(top_pages);
    entry::hang_all(top_entries, below, top);
    Ok((entries, portals))
}

/// The beginning of a file.
struct Begun {
    header: Header,
    blocks: u32,
    directory: Directory<Listing>,
    portals: Option<HashMap<u32, u32>>,
}

/// Reads and checks the beginning of a file.
fn begin(path: &Path, file: &Bytes, limits: &Limits) -> Result<Begun> {
    let stored = Stored::decode(&file.beginning(0)?).map_err(|refusal| refused(path, refusal))?;
    let root = Shape::of(stored.pages).root_length::<Listing>();
    let kind = listing(&stored, (stored.length() + root) as u64);
    let head = file.beginning((stored.length() + MOST_ROOT) as u64)?;
    let place = (stored.length(), kind.end);
    let directory = Directory::open(kind, stored.pages, place, &head);
    let directory = directory.map_err(|fault| error_of(path, fault))?;
    let Stored { header, file_bytes, blocks, .. } = stored;
    let present = file.len();
    if present > file_bytes {
        let message = format!("the file has {} bytes after its end", present - file_bytes);
        return Err(damaged(path, format!("byte {file_bytes}"), message));
    }
    if present < file_bytes {
        return Err(incomplete(path, format!("byte {present} of {file_bytes}")));
    }
    for (what, count) in
        [("the number of leaves", header.leaves), ("the number of points", header.source_points)]
    {
        limits.check(LimitKind::Points, path, what, count)?;
    }
    limits.check(LimitKind::Bytes, path, "the size of the file in bytes", present)?;
    Ok(Begun { header, blocks, directory, portals: None })
}

/// What the directory of a file lists, whose pages begin at byte `start`.
fn listing(stored: &Stored, start: u64) -> Listing {
    let end = stored.file_bytes.saturating_sub(HASH as u64);
    Listing { blocks: stored.blocks, pages: stored.pages, start, end }
}

/// The error for a fault of the directory.
fn error_of(path: &Path, fault: Fault) -> Error {
    match fault {
        Fault::Incomplete(place) => incomplete(path, place),
        Fault::Damaged(place, message) => damaged(path, place, message),
        Fault::Unread(error) => error,
    }
}

/// A node with children, as these need it.
#[derive(Debug, Clone, Copy)]
struct Family {
    first_child: u32,
    children: u32,
    parent: CutSphere,
}

impl Family {
    fn has(&self, node: u32) -> bool {
        (self.first_child..self.first_child + self.children).contains(&node)
    }
}

fn families(nodes: &[Node]) -> Vec<Family> {
    let inner = nodes.iter().filter(|node| !node.is_leaf());
    let family = |node: &Node| Family {
        first_child: node.first_child,
        children: node.children,
        parent: CutSphere::of(node),
    };
    inner.map(family).collect()
}

/// The inner nodes of the pages that were read last, so that reading from coarse to fine decodes
/// each page once.
#[derive(Default)]
struct Families {
    held: HashMap<u32, Arc<[Family]>>,
    /// Oldest first.
    order: VecDeque<u32>,
    count: usize,
}

/// The maximum number of inner nodes in the cache: 56 MiB.
const MOST_FAMILIES: usize = 2 << 20;

impl Families {
    fn get(&self, page: u32) -> Option<Arc<[Family]>> {
        self.held.get(&page).cloned()
    }

    fn keep(&mut self, page: u32, families: Arc<[Family]>) {
        if families.is_empty() || self.held.contains_key(&page) {
            return;
        }
        self.count += families.len();
        self.held.insert(page, families);
        self.order.push_back(page);
        while self.count > MOST_FAMILIES && self.order.len() > 1 {
            let oldest = self.order.pop_front().and_then(|page| self.held.remove(&page));
            self.count -= oldest.map_or(0, |families| families.len());
        }
    }
}

pub(super) fn refused(path: &Path, refusal: Refusal) -> Error {
    match refusal {
        Refusal::Incomplete => incomplete(path, "header"),
        Refusal::Foreign => Error::input(path, "header", "is not a hierarchy of splats")
            .hint("give a .splk file, or convert the source to one"),
        Refusal::Version(version) => Error::input(
            path,
            "header",
            format!("has version {version}; version {} can be read", super::VERSION),
        )
        .hint("convert the source again, or use the release that wrote the file"),
        Refusal::Damaged(message) => damaged(path, "header", message),
    }
}

pub(super) fn incomplete(path: &Path, place: impl Into<String>) -> Error {
    Error::input(path, place, "the file is incomplete: it ends before its last page")
        .hint("copy or convert it again")
}

pub(super) fn damaged(path: &Path, place: impl Into<String>, message: impl Into<String>) -> Error {
    Error::input(path, place, message).hint("the file is damaged: copy or convert it again")
}

/// Returns where the hash of a file of this many bytes begins.
pub(super) fn hash_start(bytes: u64) -> Option<u64> {
    bytes.checked_sub(HASH as u64)
}

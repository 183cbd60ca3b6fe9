//! Reads a hierarchy: the directory at once, pages one by one as a picture needs them, or
//! everything.

use super::{
    HASH,
    directory::{Directory, NO_PORTAL, PageEntry, Place, Trouble},
    header::{Header, Refusal, Stored},
    page,
    pages::{in_order, pages},
    write::{arounds, check_nodes},
};
use crate::{
    Error, Result,
    error::LimitKind,
    gaussians::Colors,
    hierarchy::{
        Block, Node, Tree,
        validate::{fault_of_box, fault_of_extent},
    },
    input::{Limits, Mapping, Source, intact},
    math::Bounds,
    parallel::prelude::*,
};
use std::{
    collections::{HashMap, VecDeque},
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

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
}

/// The nodes of a page, and their colours.
type Content = (Vec<Node>, Option<Colors>);

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
    directory: Directory,
    /// The block for each portal, a leaf of block 0.
    portals: HashMap<u32, u32>,
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
    Mapped(Mapping),
    Bytes(Vec<u8>),
    Blocks(Vec<Block>),
}

impl Hierarchy {
    /// Opens a file: reads and checks the header and the directory, and maps the rest.
    ///
    /// # Errors
    /// [`Error::Input`] for other kinds of files, other versions, damaged headers and directories,
    /// and incomplete files; [`Error::Limit`] and [`Error::File`] as for every input.
    pub fn open(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let map = Source::map(path, limits)?;
        Self::new(path, Store::Mapped(map), limits, false)
    }

    /// Opens the beginning of a file that is still being transferred, or was cut off, as a coarser
    /// model. [`is_present`](Self::is_present) returns which pages are available.
    ///
    /// # Errors
    /// Those of [`open`](Self::open), if the header or the directory is not complete.
    pub fn open_prefix(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let map = Source::map(path, limits)?;
        Self::new(path, Store::Mapped(map), limits, true)
    }

    /// Opens the bytes of a file, which errors call `name`.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn from_bytes(bytes: Vec<u8>, name: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        Self::new(name.as_ref(), Store::Bytes(bytes), limits, false)
    }

    fn new(path: &Path, store: Store, limits: &Limits, may_be_cut: bool) -> Result<Self> {
        let begun =
            begin(path, store.bytes(), limits, may_be_cut).map_err(|error| store.why(path, error));
        let (header, directory) = begun?;
        Ok(Self::assemble(path, store, header, directory, limits.clone()))
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
        let directory = directory_of(&tree)?;
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
            stance: None,
            is_guessed: false,
            unit: String::new(),
            source: String::new(),
        };
        Ok(Self::assemble(
            Path::new("memory"),
            Store::Blocks(tree.blocks),
            header,
            directory,
            Limits::none(),
        ))
    }

    fn assemble(
        path: &Path,
        store: Store,
        header: Header,
        directory: Directory,
        limits: Limits,
    ) -> Self {
        let below = directory.blocks.iter().enumerate().skip(1);
        Self {
            path: path.to_owned(),
            store,
            header,
            portals: below.map(|(number, block)| (block.portal, number as u32)).collect(),
            directory,
            families: Mutex::default(),
            limits,
        }
    }

    /// Returns the properties of the whole hierarchy.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Returns the box around all footprints, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        self.header.bounds
    }

    /// Returns all pages, block by block; the root's page is first.
    pub fn pages(&self) -> &[PageEntry] {
        &self.directory.pages
    }

    /// Returns the indices of all pages, coarse ones first, each after the pages of its parents.
    pub(crate) fn coarse_first(&self) -> Vec<u32> {
        self.directory.coarse_first()
    }

    /// Returns whether the leaves of block 0 are portals.
    pub fn is_joined(&self) -> bool {
        self.directory.blocks.len() > 1
    }

    /// Returns whether a page is available. In a complete file all pages are; if only its beginning
    /// is open, some are not. `false` for a page that the directory does not contain.
    pub fn is_present(&self, page: u32) -> bool {
        let Some(entry) = self.directory.pages.get(page as usize) else { return false };
        let Place { offset, bytes, .. } = entry.place;
        match &self.store {
            Store::Blocks(_) => true,
            store => offset + u64::from(bytes) <= store.bytes().len() as u64,
        }
    }

    /// Reads and decodes a page, and verifies its checksum. Can be called from any thread. Pages
    /// whose parents were read recently are faster.
    ///
    /// # Errors
    /// [`Error::Input`] if the page, or a page above it, is damaged or not available;
    /// [`Error::Argument`] if there is no such page.
    pub fn read_page(&self, page: u32) -> Result<Page> {
        let entry = self.entry(page)?;
        let (nodes, colors) = self.read_nodes(page)?;
        let own: Arc<[Family]> = families(&nodes).into();
        let is_first = entry.first_node == 0;
        let mut parents = Vec::new();
        let mut parent = Vec::with_capacity(nodes.len());
        if is_first {
            parent.push(match self.directory.blocks[entry.block as usize].portal {
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
        let mut add = |families: &[Family]| {
            let nodes = self.directory.nodes(page);
            let begin = families.partition_point(|family| family.first_child < nodes.start);
            for family in
                families[begin..].iter().take_while(|family| family.first_child < nodes.end)
            {
                if family.first_child != nodes.start + parent.len() as u32 {
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
        add(&own)?;
        if parent.len() != nodes.len() {
            return Err(self.torn(page));
        }
        self.families.lock().unwrap_or_else(|e| e.into_inner()).keep(page, own);
        let has_portals = self.is_joined() && entry.block == 0;
        let child_pages = self.child_pages(page, &nodes)?;
        Ok(Page { nodes, colors, parents, parent, child_pages, has_portals })
    }

    /// Reads the whole tree.
    ///
    /// # Errors
    /// Those of [`read_page`](Self::read_page), and [`Error::Limit`] if the tree is larger than the
    /// limits allow.
    pub fn read_tree(&self) -> Result<Tree> {
        self.check_size()?;
        let blocks = (0..self.directory.blocks.len() as u32).map(|block| self.read_block(block));
        Ok(Tree {
            origin: self.header.origin,
            extent: self.header.extent,
            closed: self.header.closed,
            bounds: self.header.bounds,
            source_points: self.header.source_points,
            blocks: blocks.collect::<Result<_>>()?,
        })
    }

    /// Returns an error if the tree is larger than the limits allow. A few bytes of the file may
    /// decode to a whole page of equal nodes.
    pub(in crate::hierarchy) fn check_size(&self) -> Result<()> {
        // Once as pages, and once joined.
        let found = self.header.nodes.saturating_mul(2 * size_of::<Node>() as u64);
        self.limits.check(LimitKind::Bytes, &self.path, "the size of the tree in bytes", found)
    }

    pub(super) fn read_block(&self, block: u32) -> Result<Block> {
        let entry = self.directory.blocks[block as usize];
        // A few bytes of the file may decode to a whole page of equal nodes.
        let found = u64::from(entry.nodes) * 2 * size_of::<Node>() as u64;
        self.limits.check(
            LimitKind::Bytes,
            &self.path,
            format!("the size of block {block} in bytes"),
            found,
        )?;
        let pages = entry.first_page..entry.first_page + entry.pages;
        // Reports the first of several damaged pages, whichever thread finds one first.
        let pages: Vec<Result<Content>> =
            pages.into_par_iter().map(|page| self.read_nodes(page)).collect();
        let pages: Vec<Content> = pages.into_iter().collect::<Result<_>>()?;
        let (nodes, colors): (Vec<Vec<Node>>, Vec<Option<Colors>>) = pages.into_iter().unzip();
        let colors: Option<Vec<Colors>> = colors.into_iter().collect();
        Ok(Block {
            nodes: nodes.concat(),
            portal: Some(entry.portal).filter(|&portal| portal != NO_PORTAL),
            colors: self.header.degree.zip(colors).map(|(_, colors)| Colors::joined(&colors)),
        })
    }

    pub(super) fn directory(&self) -> &Directory {
        &self.directory
    }

    /// Returns all bytes of a file; empty for a tree in memory.
    pub(super) fn bytes(&self) -> &[u8] {
        self.store.bytes()
    }

    fn entry(&self, page: u32) -> Result<&PageEntry> {
        let count = self.directory.pages.len();
        self.directory
            .pages
            .get(page as usize)
            .ok_or_else(|| Error::Argument(format!("there is no page {page} among {count}")))
    }

    /// Reads the nodes of a page without their parents, and their colours.
    fn read_nodes(&self, page: u32) -> Result<Content> {
        let entry = self.entry(page)?;
        if let Store::Blocks(blocks) = &self.store {
            let (block, nodes) = (&blocks[entry.block as usize], self.directory.nodes(page));
            let range = nodes.start as usize..nodes.end as usize;
            let colors = block.colors.as_ref().map(|colors| colors.chosen(range.clone()));
            return Ok((block.nodes[range].to_vec(), colors));
        }
        let Place { offset, bytes: length, crc } = entry.place;
        let place = || format!("page {page} (byte {offset})");
        let all = self.store.bytes();
        let end = offset.saturating_add(u64::from(length)).min(all.len() as u64);
        if end < offset.saturating_add(u64::from(length)) {
            return Err(incomplete(&self.path, place()));
        }
        let broken =
            |message: String| self.store.why(&self.path, damaged(&self.path, place(), message));
        // Decodes a copy, so that the bytes decoded are those that were verified, whoever writes to
        // the file.
        let bytes = all[offset as usize..end as usize].to_vec();
        if crc32fast::hash(&bytes) != crc {
            return Err(broken("its checksum does not match".into()));
        }
        let children = self.directory.children(page);
        let (nodes, colors) = page::decode_colored(
            &bytes,
            entry.nodes as usize,
            entry.first_child,
            self.header.extent,
            self.header.degree,
        )
        .map_err(broken)?;
        let counted: u64 = nodes.iter().map(|node| u64::from(node.children)).sum();
        if counted != u64::from(children.end - children.start) {
            let message = format!(
                "its nodes have {counted} children, but the directory states {}",
                children.len()
            );
            return Err(damaged(&self.path, place(), message));
        }
        Ok((nodes, colors))
    }

    /// Returns the nodes of a page that have children.
    fn families(&self, page: u32) -> Result<Arc<[Family]>> {
        if let Some(held) = self.families.lock().unwrap_or_else(|e| e.into_inner()).get(page) {
            return Ok(held);
        }
        let read: Arc<[Family]> = families(&self.read_nodes(page)?.0).into();
        self.families.lock().unwrap_or_else(|e| e.into_inner()).keep(page, read.clone());
        Ok(read)
    }

    fn child_pages(&self, page: u32, nodes: &[Node]) -> Result<Vec<u32>> {
        let entry = &self.directory.pages[page as usize];
        let has_portals = self.is_joined() && entry.block == 0;
        // Children are adjacent, so their pages are too.
        let mut below = NO_PAGE;
        let child_page = |(index, node): (usize, &Node)| {
            if !node.is_leaf() {
                if below == NO_PAGE || !self.directory.nodes(below).contains(&node.first_child) {
                    below = self.directory.page_of(entry.block, node.first_child);
                }
                return Ok(below);
            }
            if !has_portals {
                return Ok(NO_PAGE);
            }
            let number = entry.first_node + index as u32;
            let block = self.portals.get(&number).ok_or_else(|| {
                damaged(
                    &self.path,
                    format!("page {page}"),
                    format!("no block has the portal at node {number}"),
                )
            })?;
            Ok(self.directory.blocks[*block as usize].first_page)
        };
        nodes.iter().enumerate().map(child_page).collect()
    }

    /// The error for a page that does not fit the pages above it.
    fn torn(&self, page: u32) -> Error {
        damaged(&self.path, format!("page {page}"), "its nodes are not the children of those above")
    }
}

/// Returns the directory of a tree in memory, whose pages have no places in a file.
fn directory_of(tree: &Tree) -> Result<Directory> {
    let top = &tree.blocks[0].nodes;
    let mut directory = Directory::default();
    let mut portals = Vec::new();
    for (number, block) in tree.blocks.iter().enumerate() {
        let refuse =
            |message| Error::Argument(format!("block {number} of the hierarchy: {message}"));
        in_order(&block.nodes).and_then(|()| check_nodes(&block.nodes)).map_err(refuse)?;
        let own = block.colors.as_ref().map(|colors| (colors.degree(), colors.len()));
        if own != tree.degree().map(|degree| (degree, block.nodes.len())) {
            return Err(refuse(format!("its colours are {own:?} for {} nodes", block.nodes.len())));
        }
        let runs = pages(&block.nodes);
        let places = vec![Place::default(); runs.len()];
        directory.push_block(&runs, &arounds(&block.nodes, &runs), &places);
        match (number, block.portal) {
            (0, None) => {}
            (1.., Some(portal)) if top.get(portal as usize).is_some_and(Node::is_leaf) => {
                portals.push(portal);
            }
            (_, portal) => return Err(refuse(format!("its portal is {portal:?}"))),
        }
    }
    let leaves = top.iter().filter(|node| node.is_leaf()).count();
    directory.hang(top, &portals);
    let mut sorted = portals.clone();
    sorted.sort_unstable();
    sorted.dedup();
    if tree.is_joined() && (sorted.len() != leaves || portals.len() != leaves) {
        let message = format!("the hierarchy has {} blocks below {leaves} portals", portals.len());
        return Err(Error::Argument(message));
    }
    directory.link();
    Ok(directory)
}

/// Reads and checks the beginning of a file.
fn begin(
    path: &Path,
    bytes: &[u8],
    limits: &Limits,
    may_be_cut: bool,
) -> Result<(Header, Directory)> {
    let stored = Stored::decode(bytes).map_err(|refusal| refused(path, refusal))?;
    let directory = Directory::decode(bytes, &stored).map_err(|trouble| match trouble {
        Trouble::Incomplete => incomplete(path, "directory"),
        Trouble::Damaged(message) => damaged(path, "directory", message),
    })?;
    let Stored { header, file_bytes, .. } = stored;
    let present = bytes.len() as u64;
    if present > file_bytes {
        let message = format!("the file has {} bytes after its end", present - file_bytes);
        return Err(damaged(path, format!("byte {file_bytes}"), message));
    }
    if present < file_bytes && !may_be_cut {
        return Err(incomplete(path, format!("byte {present} of {file_bytes}")));
    }
    for (what, found) in
        [("the number of leaves", header.leaves), ("the number of points", header.source_points)]
    {
        limits.check(LimitKind::Points, path, what, found)?;
    }
    let bytes = present + directory.memory();
    limits.check(
        LimitKind::Bytes,
        path,
        "the size of the file and its directory in bytes",
        bytes,
    )?;
    Ok((header, directory))
}

impl Store {
    /// Finds the cause of an error. A failed checksum shows damage, but not whether the file was
    /// changed while it was read.
    fn why(&self, path: &Path, error: Error) -> Error {
        match self {
            Self::Mapped(map) => intact(map, path).err().unwrap_or(error),
            Self::Bytes(_) | Self::Blocks(_) => error,
        }
    }

    fn bytes(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Bytes(bytes) => bytes,
            Self::Blocks(_) => &[],
        }
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
            format!("has version {version}; versions 1 and {} can be read", super::TRAINED_VERSION),
        )
        .hint("convert the source again, or use the release that wrote the file"),
        Refusal::Damaged(message) => damaged(path, "header", message),
    }
}

pub(super) fn incomplete(path: &Path, place: impl Into<String>) -> Error {
    Error::input(path, place, "the file is incomplete: it ends before its last page").hint(
        "copy or convert it again; once the header and the directory are complete, the \
             available part can be opened as a prefix",
    )
}

pub(super) fn damaged(path: &Path, place: impl Into<String>, message: impl Into<String>) -> Error {
    Error::input(path, place, message).hint("the file is damaged: copy or convert it again")
}

/// Returns where the hash of a file begins.
pub(super) fn hash_start(bytes: &[u8]) -> Option<usize> {
    bytes.len().checked_sub(HASH)
}

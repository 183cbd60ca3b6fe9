//! The entries of the directory: the pages, their positions in the file, and what must be refined
//! for each to be needed.

use super::{
    NO_PAGE, PAGE_NODES,
    pages::{Around, Run, parents},
};
use crate::{
    container::{
        Cursor, Put,
        directory::{Kind, Place},
    },
    hierarchy::Node,
};
use std::ops::Range;

/// A page, as listed in the directory.
#[derive(Debug, Clone, PartialEq)]
pub struct PageEntry {
    /// The block that contains its nodes.
    pub block: u32,
    /// Index of its first node in the block.
    pub first_node: u32,
    /// The number of its nodes, at most [`PAGE_NODES`].
    pub nodes: u32,
    /// Index, in the block, of the first child of its nodes.
    pub first_child: u32,
    /// The earlier pages that contain parents of its nodes; empty for the root's page. For the
    /// first page of a joined block, the page with the parent of its portal.
    ///
    /// Nodes whose parents are in the same page do not matter: if one is needed, so is a node whose
    /// parent is elsewhere.
    pub parent_pages: Range<u32>,
    /// A sphere around the spheres of all the parents, relative to the tree's origin. Its radius is
    /// infinite for the root's page.
    pub parents_center: [f32; 3],
    /// The radius of that sphere, in world units.
    pub parents_radius: f32,
    /// The largest size of a parent; infinite for the root's page. If a node of this sphere and
    /// size would not be refined, the page is not needed.
    pub largest_parent_size: f32,
    /// The page with the first child of its nodes; [`NO_PAGE`] if they have none.
    pub(super) child_page: u32,
    /// The leaf of block 0 that its block replaces; [`NO_PORTAL`] for block 0.
    pub(super) portal: u32,
    pub(super) place: Place,
}

/// The portal of block 0.
pub const NO_PORTAL: u32 = u32::MAX;

impl PageEntry {
    /// Returns the range of the page's nodes in their block.
    pub fn range(&self) -> Range<u32> {
        self.first_node..self.first_node.saturating_add(self.nodes)
    }

    pub(super) fn around(&self) -> Around {
        Around {
            center: self.parents_center,
            radius: self.parents_radius,
            largest_size: self.largest_parent_size,
        }
    }

    pub(super) fn set_around(&mut self, around: Around) {
        self.parents_center = around.center;
        (self.parents_radius, self.largest_parent_size) = (around.radius, around.largest_size);
    }

    /// Moves the pages that it names.
    pub(super) fn shift(&mut self, pages: u32) {
        self.parent_pages = self.parent_pages.start + pages..self.parent_pages.end + pages;
        if self.child_page != NO_PAGE {
            self.child_page += pages;
        }
    }

    /// Appends the record of the entry.
    pub(super) fn put(&self, out: &mut Vec<u8>) {
        self.place.put(out);
        let Range { start, end } = self.parent_pages;
        [self.block, self.first_node, self.nodes, self.first_child, self.child_page]
            .into_iter()
            .chain([start, end - start, self.portal])
            .for_each(|value| out.u32(value));
        put_around(&self.around(), out);
    }

    /// Reads a record.
    pub(super) fn read(record: &[u8]) -> Option<Self> {
        let mut record = Cursor::new(record);
        let place = Place::read(&mut record)?;
        let mut next = || record.u32();
        let [block, first_node, nodes, first_child, child_page] =
            [next()?, next()?, next()?, next()?, next()?];
        let [parent, parents, portal] = [next()?, next()?, next()?];
        let Around { center, radius, largest_size } = read_around(&mut record)?;
        Some(Self {
            block,
            first_node,
            nodes,
            first_child,
            parent_pages: parent..parent.checked_add(parents)?,
            parents_center: center,
            parents_radius: radius,
            largest_parent_size: largest_size,
            child_page,
            portal,
            place,
        })
    }
}

/// Returns the entries of the pages of an ordinary block whose first page has the number `first`.
/// The portal is not known yet.
pub fn of_block(
    block: u32,
    first: u32,
    runs: &[Run],
    around: &[Around],
    places: &[Place],
) -> Vec<PageEntry> {
    let entry = |((run, around), &place): ((&Run, &Around), &Place)| PageEntry {
        block,
        first_node: run.nodes.start as u32,
        nodes: run.nodes.len() as u32,
        first_child: run.children.start as u32,
        parent_pages: 0..0,
        parents_center: around.center,
        parents_radius: around.radius,
        largest_parent_size: around.largest_size,
        child_page: NO_PAGE,
        portal: NO_PORTAL,
        place,
    };
    let mut entries: Vec<PageEntry> = runs.iter().zip(around).zip(places).map(entry).collect();
    let nodes = runs.last().map_or(0, |run| run.nodes.end as u32);
    link(&mut entries, first, nodes);
    entries
}

/// Sets the pages of a block, of which `first` is the first, that contain parents and children.
pub fn link(block: &mut [PageEntry], first: u32, nodes: u32) {
    for index in 0..block.len() {
        let range = block[index].range();
        if index > 0 {
            let [start, end] = [range.start, range.end - 1].map(|node| parent_page(block, node));
            block[index].parent_pages = first + start..first + (end + 1).min(index as u32);
        }
        let children = block[index].first_child;
        let end = block.get(index + 1).map_or(nodes, |next| next.first_child);
        if children < end {
            let page = block.partition_point(|entry| entry.first_node <= children) as u32 - 1;
            block[index].child_page = first + page;
        }
    }
}

/// Returns the page of a block, counted from its first page, that contains the parent of a node.
pub fn parent_page(block: &[PageEntry], node: u32) -> u32 {
    block.partition_point(|entry| entry.first_child <= node).max(1) as u32 - 1
}

/// Attaches the first page of a block to its portal: `top` are the entries of block 0, and `nodes`
/// its nodes, each with its parent in `parents`.
pub fn hang(entry: &mut PageEntry, top: &[PageEntry], nodes: &[Node], parents: &[Option<u32>]) {
    let page = parent_page(top, entry.portal);
    entry.parent_pages = page..page + 1;
    let parent = parents[entry.portal as usize].map(|parent| parent as usize);
    entry.set_around(
        parent.map_or(Around::EVERYTHING, |parent| Around::parents(&nodes[parent..=parent])),
    );
}

/// Attaches blocks to their portals. `top` are the entries of block 0, and `below` those of all
/// other blocks, with their portals.
pub fn hang_all(top: &[PageEntry], below: &mut [PageEntry], nodes: &[Node]) {
    let parents = parents(nodes);
    for entry in below.iter_mut().filter(|entry| entry.first_node == 0) {
        hang(entry, top, nodes, &parents);
    }
}

/// The directory of a hierarchy's pages.
pub struct Listing {
    pub blocks: u32,
    pub pages: u32,
    /// Where the pages of the file begin, after the root, and where they end.
    pub start: u64,
    pub end: u64,
}

fn put_around(around: &Around, out: &mut Vec<u8>) {
    out.f32s(&around.center);
    out.f32s(&[around.radius, around.largest_size]);
}

/// Reads bounds. Returns `None` for those that no nodes have.
pub fn read_around(bytes: &mut Cursor) -> Option<Around> {
    let center: [f32; 3] = bytes.f32s()?;
    let [radius, largest_size] = bytes.f32s()?;
    let around = Around { center, radius, largest_size };
    let sound = |value: f32| value >= 0.0 && value.is_finite();
    let is_sound = center.iter().all(|value| value.is_finite())
        && (around.is_endless() || sound(radius) && sound(largest_size));
    is_sound.then_some(around)
}

impl Kind for Listing {
    type Entry = PageEntry;
    type Bounds = Around;
    const ENTRY: usize = Place::BYTES + 52;
    const BOUNDS: usize = 20;

    fn entry(&self, page: u32, record: &[u8]) -> Result<PageEntry, String> {
        let entry = PageEntry::read(record).ok_or("the sphere around its parents is not valid")?;
        let PageEntry { block, nodes, first_child, portal, child_page, place, .. } = entry;
        let is_first = entry.first_node == 0;
        if !(1..=PAGE_NODES as u32).contains(&nodes) {
            return Err(format!("it states {nodes} nodes; 1 to {PAGE_NODES} are possible"));
        }
        let is_known = block < self.blocks && block <= page && (page > 0 || is_first);
        if !is_known || (block == 0) != (portal == NO_PORTAL) || block == 0 && is_first && page > 0
        {
            return Err(format!("it states the block {block} and the portal {portal}"));
        }
        // Children come after their parents, and every node except the root is a child.
        let behind = if is_first { first_child == 1 } else { first_child > entry.first_node };
        if !behind || child_page != NO_PAGE && !(page..self.pages).contains(&child_page) {
            return Err(format!("its children begin at node {first_child}, on page {child_page}"));
        }
        let Range { start, end } = entry.parent_pages;
        let sound = match (page, is_first) {
            (0, _) => (start, end) == (0, 0),
            (_, true) => start < page && end == start + 1,
            (_, false) => start < end && end <= page,
        };
        if !sound || entry.around().is_endless() && !is_first {
            return Err(format!("the pages of its parents are {start} to {end}"));
        }
        if place.offset < self.start || place.range().end > self.end {
            let Self { start, end, .. } = self;
            return Err(format!(
                "it begins at byte {} and has {} bytes, but the pages are from byte {start} to \
                 {end}",
                place.offset, place.bytes
            ));
        }
        Ok(entry)
    }

    fn follows(before: &PageEntry, entry: &PageEntry) -> Result<(), String> {
        let is_next = if entry.block == before.block {
            let (previous, parents) = (&before.parent_pages, &entry.parent_pages);
            entry.first_node == before.range().end
                && entry.first_child >= before.first_child
                && entry.portal == before.portal
                // Parents are in the order of their children.
                && (before.first_node == 0 || parents.start + 1 >= previous.end)
        } else {
            entry.block == before.block + 1 && entry.first_node == 0
        };
        is_next.then_some(()).ok_or_else(|| "it does not follow the page before".into())
    }

    fn place(entry: &PageEntry) -> Place {
        entry.place
    }

    fn bounds(entry: &PageEntry) -> Around {
        entry.around()
    }

    fn read_bounds(bytes: &mut Cursor) -> Option<Around> {
        read_around(bytes)
    }

    fn put_bounds(bounds: &Around, out: &mut Vec<u8>) {
        put_around(bounds, out);
    }

    fn around(bounds: &[Around]) -> Around {
        Around::of(bounds)
    }
}

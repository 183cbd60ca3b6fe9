//! The directory: the pages, their positions in the file, and what must be refined for each to be
//! needed.

use super::{
    HASH, PAGE_NODES,
    header::Stored,
    pages::{Around, Run, parents},
};
use crate::container::{Cursor, Put};
use crate::hierarchy::Node;
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
    pub(super) place: Place,
}

/// Position, length and checksum of a page's bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Place {
    pub offset: u64,
    pub bytes: u32,
    pub crc: u32,
}

/// The pages of one block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockEntry {
    pub first_page: u32,
    pub pages: u32,
    pub nodes: u32,
    /// The leaf of block 0 that its root replaces; [`NO_PORTAL`] for block 0.
    pub portal: u32,
}

/// The portal of block 0.
pub const NO_PORTAL: u32 = u32::MAX;

const BLOCK_BYTES: usize = 16;
const PAGE_BYTES: usize = 44;

/// All blocks, and all pages, block by block.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Directory {
    pub blocks: Vec<BlockEntry>,
    pub pages: Vec<PageEntry>,
}

impl Directory {
    /// Returns the size in bytes of a directory with its checksum.
    pub fn length(blocks: usize, pages: usize) -> u64 {
        blocks as u64 * BLOCK_BYTES as u64 + pages as u64 * PAGE_BYTES as u64 + 4
    }

    /// Returns the bytes that it needs in memory, including data derived from it.
    pub fn memory(&self) -> u64 {
        (self.blocks.len() * 2 * size_of::<BlockEntry>()
            + self.pages.len() * 2 * size_of::<PageEntry>()) as u64
    }

    /// Adds a block whose portal is not known yet.
    pub fn push_block(&mut self, runs: &[Run], around: &[Around], places: &[Place]) {
        let (block, first_page) = (self.blocks.len() as u32, self.pages.len() as u32);
        let nodes = runs.last().map_or(0, |run| run.nodes.end as u32);
        self.blocks.push(BlockEntry {
            first_page,
            pages: runs.len() as u32,
            nodes,
            portal: NO_PORTAL,
        });
        for ((run, around), &place) in runs.iter().zip(around).zip(places) {
            self.pages.push(PageEntry {
                block,
                first_node: run.nodes.start as u32,
                nodes: run.nodes.len() as u32,
                first_child: run.children.start as u32,
                parent_pages: 0..0,
                parents_center: around.center,
                parents_radius: around.radius,
                largest_parent_size: around.largest_size,
                place,
            });
        }
    }

    /// Attaches all blocks except the first to their portals in the first. This also determines
    /// what must be refined for their first pages.
    pub fn hang(&mut self, top: &[Node], portals: &[u32]) {
        let parents = parents(top);
        for (block, &portal) in self.blocks[1..].iter_mut().zip(portals) {
            block.portal = portal;
            let parent = parents[portal as usize].map(|parent| parent as usize);
            let around =
                parent.map_or(Around::EVERYTHING, |parent| Around::parents(&top[parent..=parent]));
            let page = &mut self.pages[block.first_page as usize];
            page.parents_center = around.center;
            (page.parents_radius, page.largest_parent_size) = (around.radius, around.largest_size);
        }
    }

    /// Adds the blocks of another directory.
    pub fn append(&mut self, other: Self) {
        let (blocks, pages) = (self.blocks.len() as u32, self.pages.len() as u32);
        let shifted =
            |block: BlockEntry| BlockEntry { first_page: block.first_page + pages, ..block };
        self.blocks.extend(other.blocks.into_iter().map(shifted));
        self.pages.extend(
            other.pages.into_iter().map(|page| PageEntry { block: page.block + blocks, ..page }),
        );
    }

    /// Returns the range of a page's nodes in their block.
    pub fn nodes(&self, page: u32) -> Range<u32> {
        let entry = &self.pages[page as usize];
        entry.first_node..entry.first_node + entry.nodes
    }

    /// Returns the range, in the block, of the children of a page's nodes.
    pub fn children(&self, page: u32) -> Range<u32> {
        let entry = &self.pages[page as usize];
        let block = &self.blocks[entry.block as usize];
        let end = if page + 1 < block.first_page + block.pages {
            self.pages[page as usize + 1].first_child
        } else {
            block.nodes
        };
        entry.first_child..end
    }

    /// Returns the page that contains a node of a block.
    pub fn page_of(&self, block: u32, node: u32) -> u32 {
        let BlockEntry { first_page, pages, .. } = self.blocks[block as usize];
        let entries = &self.pages[first_page as usize..(first_page + pages) as usize];
        first_page + entries.partition_point(|entry| entry.first_node <= node) as u32 - 1
    }

    /// Returns the page that contains the parent of a node of a block, which must not be a root.
    pub fn parent_page_of(&self, block: u32, node: u32) -> u32 {
        let BlockEntry { first_page, pages, .. } = self.blocks[block as usize];
        let entries = &self.pages[first_page as usize..(first_page + pages) as usize];
        first_page + entries.partition_point(|entry| entry.first_child <= node).max(1) as u32 - 1
    }

    /// Sets, for each page, the pages that contain the parents of its nodes. Portals must be known.
    pub fn link(&mut self) {
        for page in 0..self.pages.len() as u32 {
            let block = self.pages[page as usize].block;
            let nodes = self.nodes(page);
            let BlockEntry { portal, .. } = self.blocks[block as usize];
            self.pages[page as usize].parent_pages = match (nodes.start, portal) {
                (0, NO_PORTAL | 0) => 0..0,
                (0, portal) => {
                    let parent = self.parent_page_of(0, portal);
                    parent..parent + 1
                }
                _ => {
                    self.parent_page_of(block, nodes.start)
                        ..page.min(self.parent_page_of(block, nodes.end - 1) + 1)
                }
            };
        }
    }

    /// Returns the pages by descending size of the nodes that they refine, each after the pages of
    /// its parents.
    pub fn coarse_first(&self) -> Vec<u32> {
        let mut sizes = vec![f32::INFINITY; self.pages.len()];
        for (page, entry) in self.pages.iter().enumerate() {
            let above = entry.parent_pages.clone().map(|parent| sizes[parent as usize]);
            sizes[page] = above.fold(entry.largest_parent_size, f32::min);
        }
        let mut order: Vec<u32> = (0..self.pages.len() as u32).collect();
        order.sort_by(|&a, &b| sizes[b as usize].total_cmp(&sizes[a as usize]).then(a.cmp(&b)));
        order
    }

    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for block in &self.blocks {
            [block.first_page, block.pages, block.nodes, block.portal]
                .iter()
                .for_each(|&value| out.u32(value));
        }
        for page in &self.pages {
            out.u64(page.place.offset);
            [page.place.bytes, page.place.crc, page.nodes, page.first_child]
                .iter()
                .for_each(|&value| out.u32(value));
            out.f32s(&page.parents_center);
            out.f32s(&[page.parents_radius, page.largest_parent_size]);
        }
        out.u32(crc32fast::hash(&out));
        out
    }

    /// Reads the directory after the header; `bytes` is the available part of the file.
    ///
    /// The contents are checked against the header and for consistency, so that later code can rely
    /// on them.
    pub fn decode(bytes: &[u8], stored: &Stored) -> Result<Self, Trouble> {
        let start = stored.length();
        let length = Self::length(stored.blocks as usize, stored.pages as usize);
        let Some(all) = usize::try_from(length)
            .ok()
            .and_then(|length| bytes.get(start..start.checked_add(length)?))
        else {
            return Err(Trouble::Incomplete);
        };
        let (content, stated) = all.split_at(all.len() - 4);
        if Cursor::new(stated).u32() != Some(crc32fast::hash(content)) {
            return Err(Trouble::Damaged("its checksum does not match".into()));
        }
        let mut directory = Self::fields(content, stored).ok_or(Trouble::Incomplete)?;
        directory.consistent(stored, start as u64 + length).map_err(Trouble::Damaged)?;
        directory.link();
        Ok(directory)
    }

    fn fields(content: &[u8], stored: &Stored) -> Option<Self> {
        let mut cursor = Cursor::new(content);
        let mut blocks = Vec::with_capacity(stored.blocks as usize);
        for _ in 0..stored.blocks {
            let [first_page, pages, nodes, portal] =
                [cursor.u32()?, cursor.u32()?, cursor.u32()?, cursor.u32()?];
            blocks.push(BlockEntry { first_page, pages, nodes, portal });
        }
        let mut pages = Vec::with_capacity(stored.pages as usize);
        for _ in 0..stored.pages {
            let offset = cursor.u64()?;
            let [bytes, crc, nodes, first_child] =
                [cursor.u32()?, cursor.u32()?, cursor.u32()?, cursor.u32()?];
            pages.push(PageEntry {
                block: 0,
                first_node: 0,
                nodes,
                first_child,
                parent_pages: 0..0,
                parents_center: cursor.f32s()?,
                parents_radius: cursor.f32()?,
                largest_parent_size: cursor.f32()?,
                place: Place { offset, bytes, crc },
            });
        }
        Some(Self { blocks, pages })
    }

    /// Numbers the nodes, and returns a message if the directory contradicts itself.
    fn consistent(&mut self, stored: &Stored, pages_start: u64) -> Result<(), String> {
        let joined = self.blocks.len() > 1;
        let mut next_page = 0u64;
        let mut nodes = 0u64;
        let mut portals = Vec::new();
        for (number, block) in self.blocks.iter().enumerate() {
            let pages =
                u64::from(block.first_page)..u64::from(block.first_page) + u64::from(block.pages);
            if pages.start != next_page || pages.is_empty() || pages.end > self.pages.len() as u64 {
                return Err(format!("the pages of block {number} are {pages:?}"));
            }
            let is_portal = if number == 0 {
                block.portal == NO_PORTAL
            } else {
                block.portal < self.blocks[0].nodes
            };
            if !is_portal {
                return Err(format!(
                    "the portal of block {number} is node {}, which block 0 does not have",
                    block.portal
                ));
            }
            portals.push(block.portal);
            let pages = pages.start as usize..pages.end as usize;
            number_nodes(number as u32, block.nodes, &mut self.pages[pages.clone()])
                .map_err(|(page, message)| format!("page {}: {message}", pages.start + page))?;
            next_page = pages.end as u64;
            nodes += u64::from(block.nodes);
        }
        if next_page != self.pages.len() as u64 {
            return Err(format!(
                "{} pages belong to no block",
                self.pages.len() as u64 - next_page
            ));
        }
        if nodes != stored.header.nodes {
            return Err(format!(
                "its blocks contain {nodes} nodes, but the header states {}",
                stored.header.nodes
            ));
        }
        portals.sort_unstable();
        if joined && portals.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err("two blocks have the same portal".into());
        }
        let mut places: Vec<Place> = self.pages.iter().map(|page| page.place).collect();
        places.sort_unstable_by_key(|place| place.offset);
        let mut at = pages_start;
        for place in places {
            if place.offset != at {
                return Err(format!("a page begins at byte {}, not at {at}", place.offset));
            }
            at = at.saturating_add(u64::from(place.bytes));
        }
        if at.saturating_add(HASH as u64) != stored.file_bytes {
            return Err(format!("its pages end at byte {at} of a file of {}", stored.file_bytes));
        }
        Ok(())
    }
}

/// Sets the first node of each page in a block.
fn number_nodes(block: u32, nodes: u32, pages: &mut [PageEntry]) -> Result<(), (usize, String)> {
    let mut next = 0u64;
    let mut next_child = 1;
    for (index, page) in pages.iter_mut().enumerate() {
        let fail = |message: String| Err((index, message));
        if !(1..=PAGE_NODES as u32).contains(&page.nodes) {
            return fail(format!("it states {} nodes; 1 to {PAGE_NODES} are possible", page.nodes));
        }
        // Children come after their parents, and every node except the root is a child.
        let first = index == 0;
        let behind = if first { page.first_child == 1 } else { u64::from(page.first_child) > next };
        if !behind || page.first_child < next_child || page.first_child > nodes {
            return fail(format!("its children begin at node {}", page.first_child));
        }
        let around = [page.parents_center[0], page.parents_center[1], page.parents_center[2]];
        let endless = first
            && page.parents_radius == f32::INFINITY
            && page.largest_parent_size == f32::INFINITY;
        let sound = |value: f32| value >= 0.0 && value.is_finite();
        if !around.iter().all(|v| v.is_finite())
            || !(endless || sound(page.parents_radius) && sound(page.largest_parent_size))
        {
            return fail("the sphere around its parents is not valid".into());
        }
        (page.block, page.first_node) = (block, next as u32);
        next_child = page.first_child;
        next += u64::from(page.nodes);
        if next > u64::from(nodes) {
            return fail(format!("it ends after the {nodes} nodes of its block"));
        }
    }
    if next != u64::from(nodes) {
        return Err((pages.len() - 1, format!("it ends before the {nodes} nodes of its block")));
    }
    Ok(())
}

/// Why a directory is rejected.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    Incomplete,
    Damaged(String),
}

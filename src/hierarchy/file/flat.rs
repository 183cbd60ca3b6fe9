//! The directory of versions 1 and 2, which is read as a whole.

use super::{
    HASH, NO_PAGE, PAGE_NODES,
    entry::{NO_PORTAL, PageEntry, link, parent_page},
    header::Stored,
};
use crate::container::{Cursor, directory::Place};
use std::collections::HashMap;

/// The pages of one block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct BlockEntry {
    first_page: u32,
    pages: u32,
    nodes: u32,
    /// The leaf of block 0 that its root replaces; [`NO_PORTAL`] for block 0.
    portal: u32,
}

const BLOCK_BYTES: usize = 16;
const PAGE_BYTES: usize = 44;

/// All blocks, and all pages, block by block.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Flat {
    blocks: Vec<BlockEntry>,
    pub pages: Vec<PageEntry>,
}

impl Flat {
    /// Returns the size in bytes of a directory with its checksum.
    pub fn length(blocks: usize, pages: usize) -> u64 {
        blocks as u64 * BLOCK_BYTES as u64 + pages as u64 * PAGE_BYTES as u64 + 4
    }

    /// Returns the bytes that it needs in memory, including data derived from it.
    pub fn memory(&self) -> u64 {
        (self.blocks.len() * 2 * size_of::<BlockEntry>()
            + self.pages.len() * 2 * size_of::<PageEntry>()) as u64
    }

    /// Returns the first page of the block that replaces each portal.
    pub fn portals(&self) -> HashMap<u32, u32> {
        self.blocks.iter().skip(1).map(|block| (block.portal, block.first_page)).collect()
    }

    /// Sets, for each page, the pages that contain parents and children. Portals must be known.
    fn link(&mut self) {
        for block in &self.blocks {
            let (first, end) = (block.first_page as usize, block.first_page + block.pages);
            let (above, rest) = self.pages.split_at_mut(first);
            let own = &mut rest[..end as usize - first];
            link(own, block.first_page, block.nodes);
            if block.portal != NO_PORTAL {
                own.iter_mut().for_each(|entry| entry.portal = block.portal);
                let top = &above[..self.blocks[0].pages as usize];
                let page = parent_page(top, block.portal);
                own[0].parent_pages = page..page + 1;
            }
        }
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
                child_page: NO_PAGE,
                portal: NO_PORTAL,
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

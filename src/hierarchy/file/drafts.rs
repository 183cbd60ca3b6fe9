//! Entries of the directory while a file is written: those of ordinary blocks wait in temporary
//! storage until the block that joins them is known.

use super::{
    entry::{self, Listing, PageEntry},
    pages::{Around, Run, parents},
};
use crate::{
    container::{
        Spill, Spilled,
        directory::{Contents, Kind, Place},
    },
    hierarchy::Node,
};
use std::io;

/// The entries of ordinary blocks.
pub struct Drafts {
    spill: Spill,
    /// The number of pages.
    pub pages: u32,
    /// The number of nodes.
    pub nodes: u64,
    firsts: Vec<u32>,
}

impl Drafts {
    pub fn new(spill: Spill) -> Self {
        Self { spill, pages: 0, nodes: 0, firsts: Vec::new() }
    }

    /// Adds the pages of a block.
    pub fn push(&mut self, runs: &[Run], around: &[Around], places: &[Place]) -> io::Result<()> {
        let number = self.blocks();
        let mut records = Vec::with_capacity(runs.len() * Listing::ENTRY);
        for entry in entry::of_block(number, self.pages, runs, around, places) {
            self.nodes += u64::from(entry.nodes);
            entry.put(&mut records);
        }
        self.spill.push(&records)?;
        self.firsts.push(self.pages);
        let pages = u32::try_from(runs.len()).ok().and_then(|more| self.pages.checked_add(more));
        self.pages = pages.filter(|pages| *pages < super::NO_PAGE).ok_or_else(|| {
            io::Error::new(io::ErrorKind::FileTooLarge, "more pages than 32 bits can number")
        })?;
        Ok(())
    }

    pub fn blocks(&self) -> u32 {
        self.firsts.len() as u32
    }

    /// Returns the first page of each block.
    pub fn firsts(&self) -> &[u32] {
        &self.firsts
    }

    /// Returns all entries, for reading.
    pub fn end(self, joint: Joint) -> io::Result<Entries> {
        let parents = parents(&joint.nodes);
        let sizes = Sizes::default();
        Ok(Entries { drafts: self.spill.end()?, joint, parents, sizes })
    }
}

/// The block that joins the others. It is empty if there is none.
#[derive(Default)]
pub struct Joint {
    pub nodes: Vec<Node>,
    pub pages: Vec<PageEntry>,
    /// The portal of each other block.
    portals: Vec<u32>,
}

impl Joint {
    pub fn new(
        nodes: Vec<Node>,
        runs: &[Run],
        around: &[Around],
        places: &[Place],
        portals: &[u32],
    ) -> Self {
        let pages = entry::of_block(0, 0, runs, around, places);
        Self { nodes, pages, portals: portals.to_vec() }
    }
}

/// The entries of all pages. The place of each is where its page waits.
pub struct Entries {
    drafts: Spilled,
    joint: Joint,
    /// The parent of each node of the block that joins the others.
    parents: Vec<Option<u32>>,
    sizes: Sizes,
}

/// The smallest size above pages that others refer to.
#[derive(Default)]
struct Sizes {
    /// In the block that joins the others.
    joint: Vec<f32>,
    /// In the last ordinary block.
    last: Vec<f32>,
    /// The first page of that block.
    first: u32,
}

impl Entries {
    fn entry(&mut self, page: u32) -> io::Result<PageEntry> {
        let Some(number) = page.checked_sub(self.joint.pages.len() as u32) else {
            return Ok(self.joint.pages[page as usize].clone());
        };
        let mut record = [0; Listing::ENTRY];
        self.drafts.read(u64::from(number) * Listing::ENTRY as u64, &mut record)?;
        let mut entry = PageEntry::read(&record).ok_or(io::ErrorKind::InvalidData)?;
        let Joint { nodes, pages, portals } = &self.joint;
        if !pages.is_empty() {
            entry.shift(pages.len() as u32);
            entry.portal = portals[entry.block as usize];
            entry.block += 1;
            if entry.first_node == 0 {
                entry::hang(&mut entry, pages, nodes, &self.parents);
            }
        }
        Ok(entry)
    }
}

impl Contents<Listing> for Entries {
    fn measure(&mut self, page: u32) -> io::Result<(u32, u8)> {
        let entry = self.entry(page)?;
        let joint = self.joint.pages.len() as u32;
        let Sizes { joint: above, last, first } = &mut self.sizes;
        if page >= joint && entry.first_node == 0 {
            last.clear();
            *first = page;
        }
        let size_of = |page: u32| match page < joint {
            true => above[page as usize],
            false => last[(page - *first) as usize],
        };
        let sizes = entry.parent_pages.clone().map(size_of);
        let size = sizes.fold(entry.largest_parent_size, f32::min);
        if page < joint {
            above.push(size);
        } else {
            last.push(size);
        }
        // The exponent of a number that is not negative.
        Ok((entry.place.bytes, (size.to_bits() >> 23) as u8))
    }

    fn record(&mut self, page: u32, offset: u64, out: &mut Vec<u8>) -> io::Result<Around> {
        let mut entry = self.entry(page)?;
        entry.place.offset = offset;
        entry.put(out);
        Ok(Listing::bounds(&entry))
    }

    fn waiting(&mut self, page: u32) -> io::Result<Place> {
        Ok(self.entry(page)?.place)
    }
}

//! Which pages of a hierarchy lie in which slots of GPU memory. A page takes as many slots as its
//! nodes need, anywhere: every node decides for itself whether it is drawn.

use crate::hierarchy::needed::Needed;
use std::collections::{HashMap, HashSet};

/// Nodes of a slot (`SLOT_NODES` in nodes.wgsl). Most pages that refine a block first have no more.
pub const SLOT_NODES: u32 = 512;

/// Returns the number of slots that a page takes.
pub fn slots_for(nodes: u32) -> usize {
    nodes.div_ceil(SLOT_NODES) as usize
}

/// The nodes in a slot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    pub page: u32,
    /// The first of them in their page.
    pub first: u32,
    pub nodes: u32,
}

/// The slots of a page, and the last frame that needed it.
#[derive(Debug)]
struct Placed {
    slots: Vec<u32>,
    last_needed: u64,
}

/// The pages in slots.
#[derive(Debug, Default)]
pub struct SlotTable {
    slots: Vec<Option<Part>>,
    pages: HashMap<u32, Placed>,
    /// The slots without nodes, the highest number first.
    free: Vec<u32>,
    frame: u64,
}

impl SlotTable {
    /// Begins a frame, which needs no page yet.
    pub fn begin(&mut self) {
        self.frame += 1;
    }

    /// Returns the number of slots.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Returns the number of slots without nodes.
    pub fn free(&self) -> usize {
        self.free.len()
    }

    /// Adds empty slots.
    pub fn grow(&mut self, count: usize) {
        self.slots.resize(self.slots.len() + count, None);
        self.list_free();
    }

    /// Removes slots at the end, with the pages that have parts in them.
    pub fn shrink(&mut self, count: usize) {
        let dropped: Vec<u32> =
            self.slots[count..].iter().flatten().map(|part| part.page).collect();
        dropped.into_iter().for_each(|page| self.drop(page));
        self.slots.truncate(count);
        self.list_free();
    }

    /// Marks a page as needed by the frame. Returns whether it has slots.
    pub fn need(&mut self, page: u32) -> bool {
        let Some(placed) = self.pages.get_mut(&page) else { return false };
        placed.last_needed = self.frame;
        true
    }

    /// Returns whether a page has slots.
    pub fn holds(&self, page: u32) -> bool {
        self.pages.contains_key(&page)
    }

    /// Of the pages that the frame needs, only these remain needed.
    pub fn keep_needed(&mut self, pages: &HashSet<u32>) {
        for (page, placed) in &mut self.pages {
            if placed.last_needed == self.frame && !pages.contains(page) {
                placed.last_needed = self.frame.saturating_sub(1);
            }
        }
    }

    /// Drops the pages that have been unused for longest until `wanted` slots are free, or until
    /// the frame needs all pages. Returns the dropped pages.
    pub fn make_room(&mut self, wanted: usize) -> Vec<u32> {
        let mut dropped = Vec::new();
        if self.free.len() >= wanted {
            return dropped;
        }
        let unused = |(page, placed): (&u32, &Placed)| {
            (placed.last_needed < self.frame).then_some((placed.last_needed, *page))
        };
        let mut unused: Vec<(u64, u32)> = self.pages.iter().filter_map(unused).collect();
        unused.sort_unstable();
        let mut free = self.free.len();
        for (_, page) in unused {
            if free >= wanted {
                break;
            }
            free += self.pages[&page].slots.len();
            self.drop(page);
            dropped.push(page);
        }
        self.list_free();
        dropped
    }

    /// Puts a page that the frame needs into free slots. Returns them, in the order of its nodes,
    /// or `None` if there are too few.
    pub fn place(&mut self, request: Needed) -> Option<Vec<u32>> {
        let first = self.free.len().checked_sub(slots_for(request.nodes))?;
        let mut slots = self.free.split_off(first);
        slots.reverse();
        for (slot, first) in slots.iter().zip((0..request.nodes).step_by(SLOT_NODES as usize)) {
            let nodes = SLOT_NODES.min(request.nodes - first);
            self.slots[*slot as usize] = Some(Part { page: request.page, first, nodes });
        }
        self.pages.insert(request.page, Placed { slots: slots.clone(), last_needed: self.frame });
        Some(slots)
    }

    /// Returns the pages that the frame needs and that have slots.
    pub fn needed(&self) -> impl Iterator<Item = u32> {
        let is_needed = |(_, placed): &(&u32, &Placed)| placed.last_needed == self.frame;
        self.pages.iter().filter(is_needed).map(|(page, _)| *page)
    }

    /// Returns the nodes that the frame needs in a range of slots, each with the number of its slot
    /// in the range.
    pub fn parts(&self, first: usize, count: usize) -> impl Iterator<Item = (u32, Part)> {
        let slots = &self.slots[first..first + count];
        (0..).zip(slots).filter_map(|(number, part)| {
            let part = (*part)?;
            (self.pages.get(&part.page)?.last_needed == self.frame).then_some((number, part))
        })
    }

    fn drop(&mut self, page: u32) {
        let Some(placed) = self.pages.remove(&page) else { return };
        placed.slots.iter().for_each(|slot| self.slots[*slot as usize] = None);
    }

    fn list_free(&mut self) {
        let empty = |(number, part): (u32, &Option<Part>)| part.is_none().then_some(number);
        self.free = (0..).zip(&self.slots).filter_map(empty).collect();
        self.free.reverse();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_take_slots_and_give_them_back() {
        let mut table = SlotTable::default();
        table.grow(10);
        table.begin();
        assert_eq!(table.place(Needed { page: 7, nodes: 4096 }), Some((0..8).collect()));
        assert_eq!(table.place(Needed { page: 8, nodes: 1025 }), None);
        assert_eq!(table.place(Needed { page: 8, nodes: 513 }), Some(vec![8, 9]));
        let parts: Vec<(u32, Part)> = table.parts(7, 3).collect();
        let part = |page, first, nodes| Part { page, first, nodes };
        assert_eq!(parts, [(0, part(7, 3584, 512)), (1, part(8, 0, 512)), (2, part(8, 512, 1))]);
        // Needed pages are not dropped.
        assert!(table.make_room(1).is_empty());
        assert_eq!(table.place(Needed { page: 9, nodes: 1 }), None);

        table.begin();
        assert!(table.need(7) && !table.need(9));
        assert_eq!(table.needed().collect::<Vec<_>>(), [7]);
        assert!(table.parts(8, 2).next().is_none(), "page 8 is not needed now");
        assert_eq!(table.make_room(1), [8]);
        assert_eq!(table.place(Needed { page: 9, nodes: 1 }), Some(vec![8]));
        assert_eq!(table.free(), 1);

        // A page that is left out of the frame keeps its slots.
        assert_eq!(table.needed().count(), 2);
        table.keep_needed(&HashSet::from([7]));
        assert_eq!(table.needed().collect::<Vec<_>>(), [7]);
        assert!(table.holds(9) && table.parts(8, 2).next().is_none());

        // The page that has been unused for longest goes first.
        table.begin();
        table.need(9);
        table.begin();
        assert_eq!(table.make_room(2), [7]);
        assert_eq!((table.free(), table.len()), (9, 10));
        table.grow(2);
        assert_eq!(
            table.place(Needed { page: 5, nodes: 5000 }),
            Some(vec![0, 1, 2, 3, 4, 5, 6, 7, 9, 10])
        );
        // Pages go as wholes with the slots at the end.
        table.shrink(10);
        assert_eq!((table.free(), table.needed().count()), (9, 0));
        assert!(table.need(9) && !table.need(5));
    }
}

//! Which splats meet which tiles. Blocks of tiles have lists of splats. The thread that draws a
//! block sorts its list by the splats' first sheets and distributes it to the tiles.

use super::{footprint::Record, plan::Plan};
use crate::{parallel::prelude::*, plan::TILE, scene::Order};
use std::{
    ops::Range,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

/// Tiles along each side of a block.
pub const BLOCK: usize = 4;
/// Maximum number of candidates in a batch of records, as a power of two.
const BATCH_BITS: u32 = 13;
pub const BATCH: usize = 1 << BATCH_BITS;
/// Maximum number of entries held at a time, 8 bytes each, over all blocks. A single row of blocks
/// may exceed it.
const MOST_ENTRIES: u64 = 1 << 26;
/// Maximum number of groups of batches, and of counts in all groups together. A thread counts and
/// lists one group at a time.
const MOST_GROUPS: usize = 64;
const MOST_COUNTS: usize = 1 << 20;

/// A splat that meets a tile or a block: the first sheet of its first window and its record. In a
/// block also the first and the last tile that it meets.
#[derive(Debug, Clone, Copy, Default)]
pub struct Entry {
    pub record: u32,
    pub sheet: u16,
    within: Within,
}

/// Columns and rows of tiles in a block, two bits each: first and last column, first and last row.
type Within = u8;

/// Returns the batch of a record, and its place in the batch.
pub fn place_of(number: u32) -> (usize, usize) {
    ((number >> BATCH_BITS) as usize, number as usize % BATCH)
}

/// The tiles that a record meets, and its sort key.
#[derive(Debug, Clone, Copy)]
struct Span {
    tiles: [[u16; 2]; 2],
    order: u32,
}

/// Successive batches: the spans of their records, and the number of records that meet each block.
#[derive(Debug, Default)]
struct Group {
    batches: Range<usize>,
    spans: Vec<Span>,
    counts: Vec<u32>,
}

/// Memory of the last picture's bins, kept for reuse: allocating it anew takes as long as filling
/// it.
#[derive(Debug, Default)]
pub struct Spare {
    groups: Vec<Group>,
    /// First sheet or distance key in the upper bits, record in the lower ones.
    entries: Vec<AtomicU64>,
}

/// The number of splats that meet each block of tiles.
pub struct Bins<'a> {
    plan: &'a Plan<'a>,
    records: &'a [Vec<Record>],
    blocks: [usize; 2],
    groups: &'a mut [Group],
    entries: &'a mut Vec<AtomicU64>,
}

/// The lists of several blocks, one after another.
pub struct Lists<'a> {
    plan: &'a Plan<'a>,
    records: &'a [Vec<Record>],
    first: usize,
    /// Where each list begins, and where the last one ends.
    starts: Vec<usize>,
    entries: &'a [AtomicU64],
}

/// The lists of a block's tiles, one after another.
pub struct TileLists {
    starts: [usize; BLOCK * BLOCK + 1],
    entries: Vec<Entry>,
}

impl<'a> Bins<'a> {
    pub fn new(plan: &'a Plan<'a>, records: &'a [Vec<Record>], spare: &'a mut Spare) -> Self {
        let blocks = plan.tiles().map(|tiles| tiles.div_ceil(BLOCK));
        let count = blocks[0] * blocks[1];
        let most_groups = (MOST_COUNTS / count).clamp(1, MOST_GROUPS).min(records.len());
        spare.groups.resize_with(most_groups, Group::default);
        for (number, group) in spare.groups.iter_mut().enumerate() {
            let at = |number: usize| number * records.len() / most_groups;
            group.batches = at(number)..at(number + 1);
        }
        spare.groups.par_iter_mut().for_each(|group| {
            group.counts.clear();
            group.counts.resize(count, 0);
            group.spans.clear();
            for record in records[group.batches.clone()].iter().flatten() {
                let tiles = tiles_of(plan, record).map(|tile| tile.map(|at| at as u16));
                let span = Span { tiles, order: order(plan, record) };
                group.spans.push(span);
                let [first, last] = span.blocks();
                for row in first[1]..=last[1] {
                    for column in first[0]..=last[0] {
                        group.counts[row * blocks[0] + column] += 1;
                    }
                }
            }
        });
        Self { plan, records, blocks, groups: &mut spare.groups, entries: &mut spare.entries }
    }

    /// The number of columns of blocks.
    pub fn columns(&self) -> usize {
        self.blocks[0]
    }

    fn count(&self, block: usize) -> usize {
        self.groups.iter().map(|group| group.counts[block] as usize).sum()
    }

    /// Divides the rows of blocks into ranges whose lists are held together, so that memory stays
    /// bounded.
    pub fn parts(&self) -> Vec<Range<usize>> {
        let mut parts = Vec::new();
        let (mut start, mut sum) = (0, 0);
        for row in 0..self.blocks[1] {
            let count: usize = (row * self.blocks[0]..(row + 1) * self.blocks[0])
                .map(|block| self.count(block))
                .sum();
            if row > start && sum + count as u64 > MOST_ENTRIES {
                parts.push(start..row);
                (start, sum) = (row, 0);
            }
            sum += count as u64;
        }
        parts.push(start..self.blocks[1]);
        parts
    }

    /// Builds the lists of successive rows of blocks.
    pub fn lists(&mut self, rows: &Range<usize>) -> Lists<'_> {
        let (plan, columns) = (self.plan, self.blocks[0]);
        let blocks = rows.start * columns..rows.end * columns;
        let mut starts = Vec::with_capacity(blocks.len() + 1);
        let mut sum = 0;
        for block in blocks.clone() {
            starts.push(sum);
            // From here on, a count is the position at which a group's part of a list begins.
            for group in self.groups.iter_mut() {
                let count = group.counts[block] as usize;
                group.counts[block] = sum as u32;
                sum += count;
            }
        }
        starts.push(sum);
        if self.entries.len() / 4 > sum {
            self.entries.truncate(2 * sum);
            self.entries.shrink_to_fit();
        }
        if self.entries.len() < sum {
            self.entries.resize_with(sum, AtomicU64::default);
        }
        let entries = &*self.entries;
        let turn = turn_of(plan);
        let is_single = plan.single().is_some();
        self.groups.par_iter_mut().for_each(|group| {
            let batches = group.batches.clone().zip(&self.records[group.batches.clone()]);
            let numbers = batches.flat_map(|(batch, records)| {
                (0..records.len()).map(move |place| batch << BATCH_BITS | place)
            });
            for (span, number) in group.spans.iter().zip(numbers) {
                let [first, last] = span.blocks();
                let (key, order) = (number as u32, u64::from(span.order));
                for row in first[1].max(rows.start)..=last[1].min(rows.end - 1) {
                    for column in first[0]..=last[0] {
                        let next = &mut group.counts[row * columns + column];
                        let entry = if is_single {
                            order << 32 | u64::from(key ^ turn)
                        } else {
                            order << 40
                                | u64::from(key) << 8
                                | u64::from(span.within([column, row]))
                        };
                        entries[*next as usize].store(entry, Relaxed);
                        *next += 1;
                    }
                }
            }
        });
        Lists { plan, records: self.records, first: blocks.start, starts, entries }
    }
}

impl Span {
    /// Returns the first and the last block.
    fn blocks(&self) -> [[usize; 2]; 2] {
        self.tiles.map(|tile| tile.map(|at| usize::from(at) / BLOCK))
    }

    /// Returns the tiles inside a block.
    fn within(&self, block: [usize; 2]) -> Within {
        let [first, last] = self.tiles;
        let [x, y] = [0, 1].map(|axis| {
            let start = block[axis] * BLOCK;
            let low = usize::from(first[axis]).saturating_sub(start);
            let high = (usize::from(last[axis]) - start).min(BLOCK - 1);
            low | high << 2
        });
        (x | y << 4) as Within
    }
}

impl Lists<'_> {
    /// Returns the lists of a block's tiles, with the splats in drawing order.
    pub fn of_tiles(&self, column: usize, row: usize, columns: usize) -> TileLists {
        let block = row * columns + column - self.first;
        let entries = &self.entries[self.starts[block]..self.starts[block + 1]];
        let entries = if self.plan.single().is_some() {
            self.by_order(entries, [column, row])
        } else {
            by_sheet(entries)
        };
        TileLists::new(&entries)
    }

    fn by_order(&self, entries: &[AtomicU64], block: [usize; 2]) -> Vec<Entry> {
        let mut sorted: Vec<u64> = entries.iter().map(|entry| entry.load(Relaxed)).collect();
        sorted.sort_unstable();
        let turn = turn_of(self.plan);
        let entry = |key: u64| {
            let number = key as u32 ^ turn;
            let (batch, place) = place_of(number);
            let record = &self.records[batch][place];
            let tiles = tiles_of(self.plan, record).map(|tile| tile.map(|at| at as u16));
            Entry {
                record: number,
                sheet: record.sheets[0],
                within: Span { tiles, order: 0 }.within(block),
            }
        };
        sorted.into_iter().map(entry).collect()
    }
}

/// Sorts a block's entries by first sheet. Entries with the same first sheet keep their order.
fn by_sheet(entries: &[AtomicU64]) -> Vec<Entry> {
    let sheet = |key: u64| (key >> 40) as u16;
    let mut ends = Vec::new();
    let mut least = u16::MAX;
    for entry in entries {
        let first_sheet = sheet(entry.load(Relaxed));
        least = least.min(first_sheet);
        if usize::from(first_sheet) >= ends.len() {
            ends.resize(usize::from(first_sheet) + 1, 0u32);
        }
        ends[usize::from(first_sheet)] += 1;
    }
    let mut sum = 0;
    for end in ends.iter_mut().skip(least.into()) {
        sum += std::mem::replace(end, sum);
    }
    let mut sorted = vec![Entry::default(); entries.len()];
    for entry in entries {
        let key = entry.load(Relaxed);
        let end = &mut ends[usize::from(sheet(key))];
        sorted[*end as usize] =
            Entry { record: (key >> 8) as u32, sheet: sheet(key), within: key as u8 };
        *end += 1;
    }
    sorted
}

impl TileLists {
    fn new(block: &[Entry]) -> Self {
        let mut starts = [0; BLOCK * BLOCK + 1];
        for entry in block {
            entry.tiles(|tile| starts[tile + 1] += 1);
        }
        for tile in 0..BLOCK * BLOCK {
            starts[tile + 1] += starts[tile];
        }
        let mut entries = vec![Entry::default(); starts[BLOCK * BLOCK]];
        let mut nexts = starts;
        for entry in block {
            entry.tiles(|tile| {
                entries[nexts[tile]] = *entry;
                nexts[tile] += 1;
            });
        }
        Self { starts, entries }
    }

    /// Returns the splats of a tile of the block.
    pub fn of(&self, tile: usize) -> &[Entry] {
        &self.entries[self.starts[tile]..self.starts[tile + 1]]
    }
}

impl Entry {
    /// Calls `name` for each tile of the block that the entry meets.
    fn tiles(&self, mut name: impl FnMut(usize)) {
        let [left, right, top, bottom] =
            [0, 2, 4, 6].map(|shift| usize::from(self.within >> shift & 3));
        for row in top..=bottom {
            for column in left..=right {
                name(row * BLOCK + column);
            }
        }
    }
}

/// Returns a mask that inverts a record's number in sort keys. Back to front, splats at equal
/// distance come in reverse order.
fn turn_of(plan: &Plan) -> u32 {
    if plan.single() == Some(Order::BackToFront) { u32::MAX } else { 0 }
}

/// Returns the sort key of a record: its first sheet, or the distance of its centre if splats are
/// composited one by one.
fn order(plan: &Plan, record: &Record) -> u32 {
    let Some(order) = plan.single() else { return record.sheets[0].into() };
    // Map the float's bits to an integer of the same order.
    let bits = plan.key(record.center.into()).to_bits();
    let rising = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    match order {
        Order::FrontToBack => rising,
        Order::BackToFront => !rising,
    }
}

/// Returns the first and the last tile that a record meets.
fn tiles_of(plan: &Plan, record: &Record) -> [[usize; 2]; 2] {
    let (step, apron) = (plan.tile_step() as i32, plan.apron());
    let tiles = plan.tiles();
    let [first, last] = record.pixels;
    // Avoids a division in most pictures.
    let over = |place: i32| if step == TILE as i32 { place >> TILE.ilog2() } else { place / step };
    let at = |place: i32, axis: usize| (place.max(0) as usize).min(tiles[axis] - 1);
    [
        [0, 1].map(|axis| at(over(first[axis] - apron + step) - 1, axis)),
        [0, 1].map(|axis| at(over(last[axis] + apron), axis)),
    ]
}

//! Which splats meet which tiles. Blocks of tiles have lists of splats by their first sheets; a thread that draws a block hands
//! them out to its tiles.

use super::{footprint::Record, plan::Plan};
use crate::scene::Order;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering::Relaxed};

/// Tiles along each side of a block.
pub const BLOCK: usize = 4;
/// Candidates of a batch of records at most, as a power of two.
const BATCH_BITS: u32 = 13;
pub const BATCH: usize = 1 << BATCH_BITS;
/// Entries of all blocks that are held at the same time (8 bytes each).
const MOST_ENTRIES: u64 = 1 << 26;

/// A splat that meets a tile: the first sheet of its first window, and its record.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    pub sheet: u16,
    pub record: u32,
}

/// The batch of a record, and its place there.
pub fn place_of(number: u32) -> (usize, usize) {
    ((number >> BATCH_BITS) as usize, number as usize % BATCH)
}

/// How many splats meet each block of tiles.
pub struct Bins<'a> {
    plan: &'a Plan<'a>,
    records: &'a [Vec<Record>],
    blocks: [usize; 2],
    counts: Vec<u32>,
}

/// The lists of some blocks, one behind the other.
pub struct Lists {
    first: usize,
    ends: Vec<usize>,
    /// First sheet or order above, record below.
    entries: Vec<AtomicU64>,
}

impl<'a> Bins<'a> {
    pub fn new(plan: &'a Plan<'a>, records: &'a [Vec<Record>]) -> Self {
        let blocks = plan.tiles().map(|tiles| tiles.div_ceil(BLOCK));
        let counts: Vec<AtomicU32> = (0..blocks[0] * blocks[1]).map(|_| AtomicU32::new(0)).collect();
        records.par_iter().for_each(|batch| {
            for record in batch {
                let [first, last] = blocks_of(plan, blocks, record);
                for row in first[1]..=last[1] {
                    for column in first[0]..=last[0] {
                        counts[row * blocks[0] + column].fetch_add(1, Relaxed);
                    }
                }
            }
        });
        Self { plan, records, blocks, counts: counts.into_iter().map(AtomicU32::into_inner).collect() }
    }

    /// The place of a block.
    pub fn place(&self, block: usize) -> [usize; 2] {
        [block % self.blocks[0], block / self.blocks[0]]
    }

    /// Successive blocks whose lists are held together, so that memory is bounded.
    pub fn parts(&self) -> Vec<std::ops::Range<usize>> {
        let mut parts = Vec::new();
        let (mut start, mut sum) = (0, 0);
        for (block, count) in self.counts.iter().enumerate() {
            if block > start && sum + u64::from(*count) > MOST_ENTRIES {
                parts.push(start..block);
                (start, sum) = (block, 0);
            }
            sum += u64::from(*count);
        }
        parts.push(start..self.counts.len());
        parts
    }

    /// The lists of successive blocks.
    pub fn lists(&self, part: &std::ops::Range<usize>) -> Lists {
        let mut ends = Vec::with_capacity(part.len());
        let mut sum = 0;
        for count in &self.counts[part.clone()] {
            ends.push(sum);
            sum += *count as usize;
        }
        let turn = turn_of(self.plan);
        let nexts: Vec<AtomicU32> = part.clone().map(|_| AtomicU32::new(0)).collect();
        let entries: Vec<AtomicU64> = (0..sum).into_par_iter().map(|_| AtomicU64::new(0)).collect();
        self.records.par_iter().enumerate().for_each(|(batch, records)| {
            for (place, record) in records.iter().enumerate() {
                let [first, last] = blocks_of(self.plan, self.blocks, record);
                let number = (batch << BATCH_BITS | place) as u32 ^ turn;
                let key = u64::from(order(self.plan, record)) << 32 | u64::from(number);
                for row in first[1]..=last[1] {
                    for column in first[0]..=last[0] {
                        let block = row * self.blocks[0] + column;
                        if part.contains(&block) {
                            let own = block - part.start;
                            let at = ends[own] + nexts[own].fetch_add(1, Relaxed) as usize;
                            entries[at].store(key, Relaxed);
                        }
                    }
                }
            }
        });
        for (end, next) in ends.iter_mut().zip(nexts) {
            *end += next.into_inner() as usize;
        }
        Lists { first: part.start, ends, entries }
    }
}

impl Lists {
    /// The numbers of the records that meet a block, in the order in which they are added.
    pub fn sorted(&self, plan: &Plan, block: usize) -> Vec<u32> {
        let own = block - self.first;
        let start = if own == 0 { 0 } else { self.ends[own - 1] };
        let mut sorted: Vec<u64> =
            self.entries[start..self.ends[own]].iter().map(|entry| entry.load(Relaxed)).collect();
        sorted.sort_unstable();
        let turn = turn_of(plan);
        sorted.into_iter().map(|key| key as u32 ^ turn).collect()
    }
}

/// Bits of a record's number that are turned in keys: back to front, what is equally far comes in the reverse of its order.
fn turn_of(plan: &Plan) -> u32 {
    if plan.single() == Some(Order::BackToFront) { u32::MAX } else { 0 }
}

/// What records are sorted by: their first sheets; splats that are composited one by one by the distances of their centres.
fn order(plan: &Plan, record: &Record) -> u32 {
    let Some(order) = plan.single() else { return record.sheets[0].into() };
    let [x, y, z] = record.center;
    let distance = if plan.view.perspective { (x * x + y * y + z * z).sqrt() } else { z };
    // Bits that are in the order of the numbers.
    let bits = distance.to_bits();
    let rising = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
    match order {
        Order::FrontToBack => rising,
        Order::BackToFront => !rising,
    }
}

/// The first and the last block that a record meets.
fn blocks_of(plan: &Plan, blocks: [usize; 2], record: &Record) -> [[usize; 2]; 2] {
    let [first, last] = tiles_of(plan, record);
    [first.map(|tile| tile / BLOCK), [0, 1].map(|axis| (last[axis] / BLOCK).min(blocks[axis] - 1))]
}

/// The first and the last tile that a record meets.
pub fn tiles_of(plan: &Plan, record: &Record) -> [[usize; 2]; 2] {
    let (step, apron) = (plan.tile_step() as i32, plan.apron());
    let tiles = plan.tiles();
    let [first, last] = record.pixels;
    let at = |place: i32, axis: usize| (place.max(0) as usize).min(tiles[axis] - 1);
    [
        [0, 1].map(|axis| at((first[axis] - apron + step) / step - 1, axis)),
        [0, 1].map(|axis| at((last[axis] + apron) / step, axis)),
    ]
}

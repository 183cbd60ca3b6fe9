//! Volumes in bricks on the GPU: the bricks that a view needs, in slots, within the room that there is.
//!
//! Slots lie in chunks. Any slot takes a brick of any level; a picture draws one level or two, and each chunk of slots is drawn
//! once for either ([`Slab`]). Bricks that are not at hand are read in parallel and take the slots whose bricks no view needed
//! for longest. Which samples show something is found by blocks (shaders/passes/select_bricks.wgsl), when other bricks are drawn or
//! under another transfer function.

use crate::{
    Result,
    gpu::device::{Gpu, buffers::buffer},
    math::Kernel,
    volume::bricks::{BRICK_BLOCKS, Brick, Bricks, Choice, SIDE, slot_bytes},
};
use rayon::prelude::*;
use std::{collections::HashMap, sync::Arc};
use wgpu::BufferUsages as Usage;

/// Samples of a slot.
pub const SLOT_SAMPLES: u32 = (SIDE * SIDE * SIDE) as u32;

/// Slots of a chunk at most (`slots` in sources/bricks.wgsl): the spans of all their samples fit a binding of 128 MiB.
const MOST_SLOTS: usize = 512;

/// Bricks read before they are sent.
const BATCH: usize = 64;

/// A brick's level and number.
type Key = (usize, u32);

/// The content of some slots.
#[derive(Debug)]
pub struct Slots {
    /// The samples of each slot's brick.
    pub data: wgpu::Buffer,
    /// The ranges of its blocks.
    pub ranges: wgpu::Buffer,
    first: usize,
    count: usize,
}

impl Slots {
    /// Samples that they hold.
    pub fn capacity(&self) -> u32 {
        self.count as u32 * SLOT_SAMPLES
    }
}

/// Some slots as one of the drawn levels sees them.
#[derive(Debug)]
pub struct Slab {
    pub(super) ranges: wgpu::Buffer,
    first: usize,
    count_slots: usize,
    /// 0 for the finer level, 1 for the coarser.
    pub part: usize,
    /// Where the brick of each slot lies in the level.
    pub slots: wgpu::Buffer,
    /// The selected samples, block by block, and their number.
    pub selected: wgpu::Buffer,
    pub count: u32,
}

impl Slab {
    pub fn new(gpu: &Gpu, slots: &Slots, part: usize) -> Self {
        Self {
            ranges: slots.ranges.clone(),
            first: slots.first,
            count_slots: slots.count,
            part,
            slots: buffer(gpu, "brick slots", 16 * MOST_SLOTS as u64, Usage::UNIFORM),
            selected: buffer(gpu, "selected", 4, Usage::STORAGE),
            count: 0,
        }
    }

    /// Bytes of its own buffers.
    pub fn bytes(&self) -> u64 {
        self.slots.size() + self.selected.size()
    }

    pub(super) fn blocks(&self) -> u32 {
        (self.count_slots * BRICK_BLOCKS) as u32
    }
}

/// What the bricks of a picture may take.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Bytes of their slots.
    pub bytes: u64,
    /// Runs of candidates that they show.
    pub runs: u64,
}

/// Whether what bricks show was listed.
#[derive(Debug, Clone, Copy)]
pub enum Listed {
    All,
    /// Nothing was: they show so many runs of candidates, of which there is room for `most`.
    TooMany {
        runs: u64,
        most: u64,
    },
}

/// The bricks of a volume that are at hand.
#[derive(Debug)]
pub struct Shelf {
    pub bricks: Arc<Bricks>,
    pub kernel: Kernel,
    /// Bricks read so far.
    pub reads: u64,
    /// What is drawn; none where that is not certain.
    drawn: Option<Drawn>,
    /// What was last too much for a picture of so many runs of candidates, and the number of bricks that was not.
    fitting: Option<(Drawn, u64, usize)>,
    /// The brick in each slot, and the last update that needed it.
    slots: Vec<Option<(Key, u64)>>,
    slot_of: HashMap<Key, usize>,
    /// Samples, ranges and first slot of each chunk, and those that the caller has not taken yet.
    chunks: Vec<(wgpu::Buffer, wgpu::Buffer, usize)>,
    grown: Vec<Slots>,
    update: u64,
}

impl Shelf {
    pub fn new(bricks: &Arc<Bricks>, kernel: &Kernel) -> Self {
        Self {
            bricks: bricks.clone(),
            kernel: kernel.clone(),
            reads: 0,
            drawn: None,
            fitting: None,
            slots: Vec::new(),
            slot_of: HashMap::new(),
            chunks: Vec::new(),
            grown: Vec::new(),
            update: 0,
        }
    }

    /// Bytes of GPU memory of all slots.
    pub fn bytes(&self) -> u64 {
        self.chunks.iter().map(|(data, ranges, _)| data.size() + ranges.size()).sum()
    }

    /// Whether the bricks of a choice are those that are drawn, and show the same.
    pub fn draws(&self, choice: &Choice) -> bool {
        self.drawn.as_ref() == Some(&Drawn::of(choice))
    }

    /// Takes note that the bricks of a choice are drawn.
    pub fn set_drawn(&mut self, choice: &Choice) {
        self.drawn = Some(Drawn::of(choice));
    }

    /// The most bricks of a choice that show no more than so many runs of candidates, where that was found for it.
    pub fn fitting(&self, choice: &Choice, runs: u64) -> Option<usize> {
        let (drawn, within, most) = self.fitting.as_ref()?;
        (*within == runs && *drawn == Drawn::of(choice)).then_some(*most)
    }

    /// Takes note of that number.
    pub fn set_fitting(&mut self, choice: &Choice, runs: u64, most: usize) {
        self.fitting = Some((Drawn::of(choice), runs, most));
    }

    /// Brings the bricks of a choice to the GPU, within `room` bytes. Gives the slots that were added for them.
    pub fn update(&mut self, gpu: &Gpu, choice: &Choice, room: u64) -> Result<Vec<Slots>> {
        self.drawn = None;
        self.update += 1;
        let mut absent = Vec::new();
        // The nearest are read first.
        for &key in &choice.bricks {
            match self.slot_of.get(&key) {
                Some(&slot) => self.slots[slot] = Some((key, self.update)),
                None => absent.push(key),
            }
        }
        let most = usize::try_from(room / slot_bytes(&self.bricks))
            .unwrap_or(usize::MAX)
            .max(choice.bricks.len());
        let free = self.slots.iter().filter(|slot| slot.is_none()).count();
        let mut wanted =
            absent.len().saturating_sub(free).min(most.saturating_sub(self.slots.len()));
        while wanted > 0 {
            wanted = wanted.saturating_sub(self.grow(gpu, wanted, most));
        }
        self.load(gpu, &absent)?;
        Ok(std::mem::take(&mut self.grown))
    }

    /// Adds slots for about `wanted` more bricks, so that there are no more than `most`; tells how many.
    fn grow(&mut self, gpu: &Gpu, wanted: usize, most: usize) -> usize {
        let bytes = self.bricks.brick_bytes();
        let fit = usize::try_from(gpu.binding_size() / (8 * u64::from(SLOT_SAMPLES)))
            .unwrap_or(usize::MAX);
        // A view's neighbours need some more; a small volume has no more.
        let all: usize = self.bricks.levels().iter().map(|level| level.bricks()).sum();
        let room = most.min(all).saturating_sub(self.slots.len()).max(1);
        let count = (wanted + wanted / 4 + 1).min(room).min(MOST_SLOTS).min(fit.max(1));
        let first = self.slots.len();
        self.slots.extend(std::iter::repeat_n(None, count));
        let data = buffer(gpu, "bricks", (count * bytes) as u64, Usage::STORAGE);
        let ranges = buffer(gpu, "brick ranges", (count * 2 * BRICK_BLOCKS) as u64, Usage::STORAGE);
        self.chunks.push((data.clone(), ranges.clone(), first));
        self.grown.push(Slots { data, ranges, first, count });
        count
    }

    /// Reads bricks and puts them in slots that are free, or whose bricks were not needed for longest.
    fn load(&mut self, gpu: &Gpu, absent: &[Key]) -> Result<()> {
        let last_needed = |slot: &usize| self.slots[*slot].map_or(0, |(_, update)| update);
        let mut places: Vec<usize> =
            (0..self.slots.len()).filter(|slot| last_needed(slot) < self.update).collect();
        places.sort_by_key(last_needed);
        let mut places = places.into_iter();
        let bytes = self.bricks.brick_bytes();
        for batch in absent.chunks(BATCH) {
            let read: Vec<Brick> = batch
                .par_iter()
                .map(|&(level, brick)| self.bricks.read(level, brick))
                .collect::<Result<_>>()?;
            for ((&key, brick), slot) in batch.iter().zip(&read).zip(&mut places) {
                if let Some((old, _)) = self.slots[slot].replace((key, self.update)) {
                    self.slot_of.remove(&old);
                }
                self.slot_of.insert(key, slot);
                self.reads += 1;
                let chunk = self.chunks.partition_point(|(_, _, first)| *first <= slot) - 1;
                let (data, ranges, first) = &self.chunks[chunk];
                let at = slot - first;
                gpu.queue.write_buffer(data, (at * bytes) as u64, &brick.samples);
                let own = bytemuck::cast_slice(brick.blocks.as_slice());
                gpu.queue.write_buffer(ranges, (at * 2 * BRICK_BLOCKS) as u64, own);
            }
            // What is written waits in staging memory until something is submitted.
            gpu.queue.submit([]);
        }
        Ok(())
    }

    /// Tells the GPU which slots hold bricks of a level that are drawn, and where they lie.
    pub fn describe(&self, gpu: &Gpu, slab: &Slab, level: Option<usize>) {
        let place = |slot: &Option<(Key, u64)>| match slot {
            Some(((own, brick), update)) if Some(*own) == level && *update == self.update => {
                let [x, y, z] = self.bricks.level(*own).place(*brick).map(|at| (at * SIDE) as u32);
                [x, y, z, 1]
            }
            _ => [0; 4],
        };
        let places: Vec<[u32; 4]> =
            self.slots[slab.first..slab.first + slab.count_slots].iter().map(place).collect();
        gpu.queue.write_buffer(&slab.slots, 0, bytemuck::cast_slice(&places));
    }
}

/// Bricks in order, the levels that are drawn, and what of them shows: what the lists are made from.
#[derive(Debug, PartialEq)]
struct Drawn {
    bricks: Vec<Key>,
    levels: Vec<usize>,
    shown: [u16; 256],
}

impl Drawn {
    fn of(choice: &Choice) -> Self {
        let mut bricks = choice.bricks.clone();
        bricks.sort_unstable();
        Self {
            bricks,
            levels: choice.levels.iter().map(|(level, _)| *level).collect(),
            shown: choice.shown,
        }
    }
}

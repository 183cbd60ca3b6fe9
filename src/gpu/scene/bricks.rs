//! Volumes in bricks on the GPU: a cache of the bricks that a view needs, within the available
//! memory.
//!
//! Slots lie in chunks. Any slot can hold a brick of any level. A picture draws one level or two,
//! and each chunk of slots is drawn once for each of them ([`Slab`]). Absent bricks are read in
//! parallel. They take the slots whose bricks have been unused for longest.
//! shaders/passes/select_bricks.wgsl finds the visible samples by blocks, whenever other bricks are
//! drawn or the transfer function changes.

use crate::{
    Result,
    bricks::{BLOCK, BLOCKS, BRICK_BLOCKS, Bricks, Choice, EMPTY, SIDE, slot_bytes},
    gpu::device::{Gpu, buffers::buffer},
    math::Kernel,
};
use std::{collections::HashMap, sync::Arc};
use wgpu::BufferUsages as Usage;

/// Samples of a slot.
pub const SLOT_SAMPLES: u32 = (SIDE * SIDE * SIDE) as u32;

/// Maximum number of slots in a chunk (`slots` in sources/bricks.wgsl): the spans of all their
/// samples fit a binding of 128 MiB.
const MOST_SLOTS: usize = 512;

/// Bricks read before they are uploaded.
const BATCH: usize = 64;

/// A brick's level and number.
type Key = (usize, u32);

/// The content of a chunk of slots.
#[derive(Debug)]
pub struct Slots {
    /// The samples of each slot's brick.
    pub data: wgpu::Buffer,
    /// The ranges of the blocks of each brick.
    pub ranges: wgpu::Buffer,
    first: usize,
    count: usize,
}

impl Slots {
    /// Returns the number of samples that fit the slots.
    pub fn capacity(&self) -> u32 {
        self.count as u32 * SLOT_SAMPLES
    }
}

/// A chunk of slots, for one of the drawn levels.
#[derive(Debug)]
pub struct Slab {
    pub ranges: wgpu::Buffer,
    first: usize,
    count_slots: usize,
    /// 0 for the finer level, 1 for the coarser.
    pub part: usize,
    /// Where the brick of each slot lies in the level.
    pub slots: wgpu::Buffer,
    /// The selected samples, block by block.
    pub selected: wgpu::Buffer,
    /// The number of selected samples.
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

    /// Returns the bytes of its own buffers.
    pub fn bytes(&self) -> u64 {
        self.slots.size() + self.selected.size()
    }

    /// The slots of the chunk, by number.
    fn all(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.count_slots
    }

    pub fn blocks(&self) -> u32 {
        (self.count_slots * BRICK_BLOCKS) as u32
    }
}

/// The capacity for the bricks of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Bytes of their slots.
    pub bytes: u64,
    /// Batches of visible candidates.
    pub runs: u64,
}

/// Whether the visible samples of bricks were listed.
#[derive(Debug, Clone, Copy)]
pub enum Listed {
    All,
    /// Nothing was listed: there are `runs` batches of visible candidates, and capacity for `most`.
    TooMany {
        runs: u64,
        most: u64,
    },
}

/// The brick cache of a volume.
#[derive(Debug)]
pub struct BrickCache {
    pub bricks: Arc<Bricks>,
    pub kernel: Kernel,
    /// The index of the item in the scene.
    pub item: usize,
    /// Bricks read so far.
    pub reads: u64,
    /// Whether bricks of the last update, of a file in parts, have not come yet.
    is_missing: bool,
    /// What the lists on the GPU show; `None` if that is not certain.
    drawn: Option<Drawn>,
    /// The last choice that exceeded a picture, the picture's limit in batches of candidates, and
    /// the number of bricks that kept to it.
    fitting: Option<(Drawn, u64, usize)>,
    /// For each slot, its brick and the last update that needed it.
    slots: Vec<Option<(Key, u64)>>,
    slot_of: HashMap<Key, usize>,
    /// For each slot, the ranges of its brick's blocks.
    ranges: Vec<[[u8; 2]; BRICK_BLOCKS]>,
    /// Samples, ranges and first slot of each chunk.
    chunks: Vec<(wgpu::Buffer, wgpu::Buffer, usize)>,
    /// The added chunks that the caller has not taken yet.
    grown: Vec<Slots>,
    update: u64,
}

impl BrickCache {
    pub fn new(bricks: &Arc<Bricks>, kernel: &Kernel, item: usize) -> Self {
        Self {
            bricks: bricks.clone(),
            kernel: kernel.clone(),
            item,
            reads: 0,
            is_missing: false,
            drawn: None,
            fitting: None,
            slots: Vec::new(),
            slot_of: HashMap::new(),
            ranges: Vec::new(),
            chunks: Vec::new(),
            grown: Vec::new(),
            update: 0,
        }
    }

    /// Returns the bytes of GPU memory of all slots.
    pub fn bytes(&self) -> u64 {
        self.chunks.iter().map(|(data, ranges, _)| data.size() + ranges.size()).sum()
    }

    /// Whether the lists on the GPU are those of this choice.
    pub fn draws(&self, choice: &Choice) -> bool {
        self.drawn.as_ref() == Some(&Drawn::of(choice))
    }

    /// Records that the lists on the GPU are those of this choice, if all its bricks are there.
    pub fn set_drawn(&mut self, choice: &Choice) {
        self.drawn = (!self.is_missing).then(|| Drawn::of(choice));
    }

    /// Returns the maximum number of bricks of a choice that show at most `runs` batches of
    /// candidates, if it was found before.
    pub fn fitting(&self, choice: &Choice, runs: u64) -> Option<usize> {
        let (drawn, within, most) = self.fitting.as_ref()?;
        (*within == runs && *drawn == Drawn::of(choice)).then_some(*most)
    }

    /// Records that number.
    pub fn set_fitting(&mut self, choice: &Choice, runs: u64, most: usize) {
        self.fitting = Some((Drawn::of(choice), runs, most));
    }

    /// Brings the bricks of a choice to the GPU, within `room` bytes. Returns the slots that were
    /// added for them.
    pub fn update(&mut self, gpu: &Gpu, choice: &Choice, room: u64) -> Result<Vec<Slots>> {
        (self.drawn, self.is_missing) = (None, false);
        self.update += 1;
        let mut absent = Vec::new();
        // The nearest bricks are read first.
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

    /// Adds slots for about `wanted` more bricks, at most `most` in total. Returns how many were
    /// added.
    fn grow(&mut self, gpu: &Gpu, wanted: usize, most: usize) -> usize {
        let bytes = self.bricks.brick_bytes();
        let fit = usize::try_from(gpu.binding_size() / (8 * u64::from(SLOT_SAMPLES)))
            .unwrap_or(usize::MAX);
        // Nearby views need a few more bricks. A small volume has no more.
        let all: usize = self.bricks.levels().iter().map(|level| level.bricks()).sum();
        let room = most.min(all).saturating_sub(self.slots.len()).max(1);
        let count = (wanted + wanted / 4 + 1).min(room).min(MOST_SLOTS).min(fit.max(1));
        let first = self.slots.len();
        self.slots.extend(std::iter::repeat_n(None, count));
        self.ranges.extend(std::iter::repeat_n([EMPTY; BRICK_BLOCKS], count));
        let data = buffer(gpu, "bricks", (count * bytes) as u64, Usage::STORAGE);
        let ranges = buffer(gpu, "brick ranges", (count * 2 * BRICK_BLOCKS) as u64, Usage::STORAGE);
        self.chunks.push((data.clone(), ranges.clone(), first));
        self.grown.push(Slots { data, ranges, first, count });
        count
    }

    /// Reads bricks into free slots, or into the slots whose bricks have been unused for longest.
    fn load(&mut self, gpu: &Gpu, absent: &[Key]) -> Result<()> {
        let last_needed = |slot: &usize| self.slots[*slot].map_or(0, |(_, update)| update);
        let mut places: Vec<usize> =
            (0..self.slots.len()).filter(|slot| last_needed(slot) < self.update).collect();
        places.sort_by_key(last_needed);
        let mut places = places.into_iter();
        let bytes = self.bricks.brick_bytes();
        for batch in absent.chunks(BATCH) {
            let read = self.bricks.read_there(batch)?;
            self.is_missing |= read.iter().any(Option::is_none);
            let read = batch.iter().zip(read).filter_map(|(key, brick)| Some((*key, brick?)));
            for ((key, brick), slot) in read.zip(&mut places) {
                if let Some((old, _)) = self.slots[slot].replace((key, self.update)) {
                    self.slot_of.remove(&old);
                }
                self.slot_of.insert(key, slot);
                self.reads += 1;
                let chunk = self.chunks.partition_point(|(_, _, first)| *first <= slot) - 1;
                let (data, ranges, first) = &self.chunks[chunk];
                let at = slot - first;
                gpu.queue.write_buffer(data, (at * bytes) as u64, &brick.samples);
                let blocks = bytemuck::cast_slice(brick.blocks.as_slice());
                gpu.queue.write_buffer(ranges, (at * 2 * BRICK_BLOCKS) as u64, blocks);
                self.ranges[slot] = *brick.blocks;
            }
            // Writes wait in staging memory until the next submission.
            gpu.queue.submit([]);
        }
        Ok(())
    }

    /// Returns the place of a slot's first sample in a level, if the slot contains a drawn brick of
    /// that level.
    fn place(&self, slot: usize, level: Option<usize>) -> Option<[usize; 3]> {
        let ((slot_level, brick), update) = self.slots[slot]?;
        let is_drawn = Some(slot_level) == level && update == self.update;
        is_drawn.then(|| self.bricks.level(slot_level).place(brick).map(|at| at * SIDE))
    }

    /// Uploads which slots contain drawn bricks of a level, and where these lie.
    pub fn describe(&self, gpu: &Gpu, slab: &Slab, level: Option<usize>) {
        let place = |slot| match self.place(slot, level) {
            Some([x, y, z]) => [x as u32, y as u32, z as u32, 1],
            None => [0; 4],
        };
        let places: Vec<[u32; 4]> = slab.all().map(place).collect();
        gpu.queue.write_buffer(&slab.slots, 0, bytemuck::cast_slice(&places));
    }

    /// Returns the number of visible samples in the drawn bricks of a level, as
    /// select_bricks.wgsl counts them. `first_visible` is `shown` of `Choice`.
    pub fn count(&self, slab: &Slab, level: Option<usize>, first_visible: &[u16; 256]) -> u32 {
        let visible = |slot| {
            let Some((at, level)) = self.place(slot, level).zip(level) else { return 0 };
            let dims = self.bricks.level(level).dims;
            let blocks = self.ranges[slot].iter().enumerate();
            blocks
                .filter(|(_, [low, high])| u16::from(*high) >= first_visible[usize::from(*low)])
                .map(|(block, _)| {
                    let place = [block, block / BLOCKS, block / BLOCKS.pow(2)];
                    let samples = |axis: usize| {
                        let first = at[axis] + place[axis] % BLOCKS * BLOCK;
                        // Beyond the level's border, bricks are padded with copies.
                        dims[axis].saturating_sub(first).min(BLOCK) as u32
                    };
                    samples(0) * samples(1) * samples(2)
                })
                .sum()
        };
        slab.all().map(visible).sum()
    }
}

/// What the lists are made from: the bricks in order, the drawn levels, and the visible ranges of
/// values.
#[derive(Debug, PartialEq)]
struct Drawn {
    bricks: Vec<Key>,
    levels: Vec<usize>,
    first_visible: [u16; 256],
}

impl Drawn {
    fn of(choice: &Choice) -> Self {
        let mut bricks = choice.bricks.clone();
        bricks.sort_unstable();
        Self {
            bricks,
            levels: choice.levels.iter().map(|(level, _)| *level).collect(),
            first_visible: choice.first_visible,
        }
    }
}

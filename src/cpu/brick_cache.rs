//! The cache of a volume's bricks. Each brick has a slot, which also holds the samples up to two
//! steps around it. So one slot contains all samples that a kernel in the brick reaches.

use crate::{
    Result,
    bricks::{BRICK_BLOCKS, Bricks, Choice, SIDE},
    math::Kernel,
    scene::Settings,
    volume::{Samples, each_type},
};
use bytemuck::AnyBitPattern;
use std::{collections::HashMap, sync::Arc};

/// Extra samples on each side of a brick.
pub const BESIDE: usize = 2;
/// Samples of a slot along each axis, and in total.
pub const SLOT_SIDE: usize = SIDE + 2 * BESIDE;
pub const SLOT: usize = SLOT_SIDE * SLOT_SIDE * SLOT_SIDE;
/// Number of bricks read together.
const BATCH: usize = 256;

/// A brick's level and number.
type Key = (usize, u32);

/// The slot of a brick, and the last update that needed the brick.
#[derive(Debug, Clone, Copy)]
struct Held {
    slot: usize,
    last: u64,
}

#[derive(Debug)]
pub struct BrickCache {
    pub bricks: Arc<Bricks>,
    pub kernel: Kernel,
    held: HashMap<Key, Held>,
    samples: Samples,
    /// The ranges of the blocks of each slot's brick.
    blocks: Vec<[[u8; 2]; BRICK_BLOCKS]>,
    free: Vec<usize>,
    update: u64,
    /// Number of bricks read so far.
    pub reads: u64,
}

/// Returns the bytes of memory of a slot.
pub fn slot_bytes(bricks: &Bricks) -> u64 {
    (SLOT * bricks.header().scalar.bytes() + 2 * BRICK_BLOCKS) as u64
}

/// Returns the number of bricks that fit into the settings' memory, at least one.
pub fn most_bricks(bricks: &Bricks, settings: &Settings) -> usize {
    usize::try_from(settings.controls.page_memory / slot_bytes(bricks)).unwrap_or(usize::MAX).max(1)
}

impl BrickCache {
    pub fn new(bricks: &Arc<Bricks>, kernel: &Kernel) -> Self {
        Self {
            bricks: bricks.clone(),
            kernel: kernel.clone(),
            held: HashMap::new(),
            samples: Samples::from_bytes(bricks.header().scalar, &[]),
            blocks: Vec::new(),
            free: Vec::new(),
            update: 0,
            reads: 0,
        }
    }

    /// Returns the samples of all slots.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Returns the slot of a brick.
    pub fn slot(&self, level: usize, brick: u32) -> Option<usize> {
        self.held.get(&(level, brick)).map(|held| held.slot)
    }

    /// Returns the ranges of the blocks of a slot's brick.
    pub fn blocks(&self, slot: usize) -> &[[u8; 2]; BRICK_BLOCKS] {
        &self.blocks[slot]
    }

    pub fn bytes(&self) -> u64 {
        self.blocks.len() as u64 * slot_bytes(&self.bricks)
    }

    /// Reads the bricks of a choice. Of the other bricks, the most recently needed ones stay, up to
    /// `most` bricks in total.
    pub fn update(&mut self, choice: &Choice, most: usize) -> Result<()> {
        self.update += 1;
        let absent: Vec<Key> =
            choice.bricks.iter().copied().filter(|key| !self.held.contains_key(key)).collect();
        for key in &choice.bricks {
            if let Some(held) = self.held.get_mut(key) {
                held.last = self.update;
            }
        }
        self.make_room((self.held.len() + absent.len()).saturating_sub(most));
        for keys in absent.chunks(BATCH) {
            let read = self.bricks.read_there(keys)?;
            for (key, brick) in keys.iter().zip(read) {
                let Some(brick) = brick else { continue };
                self.reads += 1;
                let slot = self.free.pop().unwrap_or(self.blocks.len());
                if slot == self.blocks.len() {
                    self.blocks.push(*brick.blocks);
                    each_type!(mut self.samples, samples => samples
                        .resize((slot + 1) * SLOT, Default::default()));
                } else {
                    self.blocks[slot] = *brick.blocks;
                }
                each_type!(mut self.samples, samples => fill(
                    &mut samples[slot * SLOT..], &brick.samples,
                ));
                self.held.insert(*key, Held { slot, last: self.update });
            }
        }
        self.surround(&absent);
        Ok(())
    }

    /// Evicts up to `count` bricks that this update does not need, least recently needed first.
    fn make_room(&mut self, count: usize) {
        let mut others: Vec<(u64, Key)> = self
            .held
            .iter()
            .filter(|(_, held)| held.last < self.update)
            .map(|(key, held)| (held.last, *key))
            .collect();
        others.sort_unstable();
        for (_, key) in others.iter().take(count) {
            self.free.extend(self.held.remove(key).map(|held| held.slot));
        }
    }

    /// Fills the extra samples around the new bricks and their neighbours. If there is no
    /// neighbour, the nearest sample of the brick takes its place. That changes nothing: an absent
    /// neighbour is invisible, and so is everything that its samples reach.
    fn surround(&mut self, read: &[Key]) {
        let mut touched: Vec<Key> = Vec::new();
        for &(level, brick) in read {
            touched.extend(
                around()
                    .filter_map(|step| self.neighbour(level, brick, step))
                    .map(|(number, _)| (level, number)),
            );
        }
        touched.sort_unstable();
        touched.dedup();
        for (level, brick) in touched {
            let Some(slot) = self.slot(level, brick) else { continue };
            for step in around().filter(|step| *step != [0; 3]) {
                let from = self.neighbour(level, brick, step).map(|(_, slot)| slot);
                each_type!(mut self.samples, samples => copy_beside(samples, slot, from, step));
            }
        }
    }

    /// Returns the number and the slot of the brick at an offset in bricks, if it is held.
    fn neighbour(&self, level: usize, brick: u32, step: [isize; 3]) -> Option<(u32, usize)> {
        let size = self.bricks.level(level);
        let place = size.place(brick);
        let mut number = 0;
        for axis in (0..3).rev() {
            let at = place[axis]
                .checked_add_signed(step[axis])
                .filter(|at| *at < size.brick_dims[axis])?;
            number = number * size.brick_dims[axis] + at;
        }
        let number = number as u32;
        Some((number, self.slot(level, number)?))
    }
}

/// Returns the offsets to a brick's neighbours and to the brick itself.
fn around() -> impl Iterator<Item = [isize; 3]> {
    (0..27).map(|number| [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1])
}

/// Returns the index of a brick's sample in its slot; coordinates run from −2 to 33 along each
/// axis.
fn place_of([x, y, z]: [isize; 3]) -> usize {
    let [x, y, z] = [x, y, z].map(|at| (at + BESIDE as isize) as usize);
    (z * SLOT_SIDE + y) * SLOT_SIDE + x
}

/// Copies the samples of a brick into its slot.
fn fill<T: AnyBitPattern>(slot: &mut [T], bytes: &[u8]) {
    for (row, bytes) in bytes.chunks_exact(SIDE * size_of::<T>()).enumerate() {
        let start = place_of([0, (row % SIDE) as isize, (row / SIDE) as isize]);
        for (sample, bytes) in
            slot[start..start + SIDE].iter_mut().zip(bytes.chunks_exact(size_of::<T>()))
        {
            *sample = bytemuck::pod_read_unaligned(bytes);
        }
    }
}

/// Fills the extra samples on one side of a brick from its neighbour there, or else from its own
/// border.
fn copy_beside<T: Copy>(samples: &mut [T], slot: usize, from: Option<usize>, step: [isize; 3]) {
    let side = SIDE as isize;
    let along = |axis: usize| match step[axis] {
        -1 => -(BESIDE as isize)..0,
        0 => 0..side,
        _ => side..side + BESIDE as isize,
    };
    // The source of a sample beside the brick.
    let source = |at: [isize; 3]| match from {
        Some(from) => from * SLOT + place_of([0, 1, 2].map(|axis| at[axis] - side * step[axis])),
        None => slot * SLOT + place_of(at.map(|at| at.clamp(0, side - 1))),
    };
    for z in along(2) {
        for y in along(1) {
            for x in along(0) {
                samples[slot * SLOT + place_of([x, y, z])] = samples[source([x, y, z])];
            }
        }
    }
}

/// The slots of a level's bricks that a picture shows.
#[derive(Debug)]
pub struct Grid {
    /// Bricks along each axis.
    pub counts: [usize; 3],
    /// The slot of each brick; [`Grid::ABSENT`] for bricks that the picture does not show.
    pub slots: Vec<u32>,
    /// A value of each brick. It is an invisible one if the brick is left out.
    pub values: Vec<f32>,
}

impl Grid {
    pub const ABSENT: u32 = u32::MAX;

    pub fn new(cache: &BrickCache, choice: &Choice, level: usize) -> Self {
        let mut slots = vec![Self::ABSENT; cache.bricks.level(level).bricks()];
        for &(_, brick) in choice.bricks.iter().filter(|(brick_level, _)| *brick_level == level) {
            if let Some(slot) = cache.slot(level, brick) {
                slots[brick as usize] = slot as u32;
            }
        }
        let [low, high] = cache.bricks.header().range;
        let value = |[step, _]: [u8; 2]| (low + (high - low) * f64::from(step) / 255.0) as f32;
        let values = cache.bricks.ranges(level).into_iter().map(value).collect();
        Self { counts: cache.bricks.level(level).brick_dims, slots, values }
    }
}

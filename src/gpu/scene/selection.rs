//! The visible samples of a chunk of a lattice: the ranges from which `select` lists them.

use crate::{
    gpu::{
        budget::SCAN_CAPACITY,
        device::{
            Gpu,
            buffers::{buffer, upload},
        },
    },
    parallel::prelude::*,
};
use wgpu::BufferUsages as Usage;

/// Samples along each side of the block that an invocation handles (`SIDE` in select.wgsl).
const SIDE: u32 = 4;

/// The selected samples of one chunk of a lattice.
#[derive(Debug)]
pub struct Selection {
    pub ranges: wgpu::Buffer,
    pub blocks: wgpu::Buffer,
    pub block_count: u32,
    pub counts: Counts,
    /// Indices within the chunk, block by block.
    pub selected: wgpu::Buffer,
    /// The number of selected samples.
    pub count: u32,
    /// The visible ranges that the list was made for; `None` if there is no list.
    pub first_visible: Option<[u16; 256]>,
}

impl Selection {
    /// `dims` is the number of the chunk's samples along each axis. `ranges` contains the smallest
    /// and the largest value around each sample, quantised over the volume's range.
    pub fn new(gpu: &Gpu, dims: [u32; 3], ranges: &[[u8; 2]]) -> Self {
        let block_count = dims.map(|n| n.div_ceil(SIDE)).iter().product::<u32>();
        debug_assert!(block_count < SCAN_CAPACITY);
        Self {
            ranges: upload(gpu, "ranges", bytemuck::cast_slice(ranges)),
            blocks: buffer(gpu, "select blocks", 4 * (u64::from(block_count) + 1), Usage::STORAGE),
            block_count,
            counts: Counts::of(ranges),
            selected: buffer(gpu, "selected", 4, Usage::STORAGE),
            count: 0,
            first_visible: None,
        }
    }

    /// Whether the list was made for these visible ranges.
    pub fn is_for(&self, first_visible: &[u16; 256]) -> bool {
        self.first_visible.as_ref() == Some(first_visible)
    }

    /// Drops the list. Returns whether there was one.
    pub fn forget(&mut self, gpu: &Gpu) -> bool {
        if self.first_visible.take().is_none() {
            return false;
        }
        self.selected = buffer(gpu, "selected", 4, Usage::STORAGE);
        self.count = 0;
        true
    }

    pub fn bytes(&self) -> u64 {
        self.ranges.size() + self.blocks.size() + self.selected.size()
    }
}

/// How many samples have each range of values around them. With it, the length of a list is known
/// without waiting for the GPU.
#[derive(Debug)]
pub struct Counts {
    /// The ranges that occur, with their numbers of samples.
    ranges: Vec<([u8; 2], u32)>,
}

impl Counts {
    fn of(ranges: &[[u8; 2]]) -> Self {
        const EACH: usize = 1 << 20;
        let count = |part: &[[u8; 2]]| {
            let mut counts = vec![0u32; 1 << 16];
            part.iter().for_each(|&range| counts[usize::from(u16::from_le_bytes(range))] += 1);
            counts
        };
        let add = |mut a: Vec<u32>, b: Vec<u32>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        let counts = ranges.par_chunks(EACH).map(count).reduce(|| vec![0; 1 << 16], add);
        let numbered = (0..=u16::MAX).map(u16::to_le_bytes).zip(counts);
        Self { ranges: numbered.filter(|(_, count)| *count > 0).collect() }
    }

    /// Returns the number of samples that show something, as select.wgsl counts them.
    pub fn visible(&self, first_visible: &[u16; 256]) -> u32 {
        let shows = |[low, high]: [u8; 2]| u16::from(high) >= first_visible[usize::from(low)];
        self.ranges.iter().filter(|(range, _)| shows(*range)).map(|(_, count)| count).sum()
    }
}

//! Select: lists the samples of a lattice that can add to the picture under the current transfer
//! function (shaders/passes/select.wgsl). Runs when the transfer function makes other samples
//! visible. Explicit splats have no such list: all are candidates.

use crate::{
    Result,
    gpu::{
        device::{
            Gpu,
            buffers::{buffer, upload},
        },
        pipeline::{
            commands::Commands,
            recipe::{Binding, Recipe},
            scan::{SCAN_CAPACITY, Scan},
            shaders,
            stage::Stage,
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
    ranges: wgpu::Buffer,
    blocks: wgpu::Buffer,
    block_count: u32,
    counts: Counts,
    /// Indices within the chunk, block by block.
    pub selected: wgpu::Buffer,
    /// The number of selected samples.
    pub count: u32,
    /// The visible ranges that the list was made for; `None` if there is no list.
    shown: Option<[u16; 256]>,
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
            shown: None,
        }
    }

    /// Whether the list was made for these visible ranges.
    pub fn is_for(&self, shown: &[u16; 256]) -> bool {
        self.shown.as_ref() == Some(shown)
    }

    /// Drops the list. Returns whether there was one.
    pub fn forget(&mut self, gpu: &Gpu) -> bool {
        if self.shown.take().is_none() {
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

/// The pass.
#[derive(Debug)]
pub struct Select {
    count: Stage,
    write: Stage,
    scan: Scan,
}

impl Select {
    pub fn new(gpu: &Gpu, scan: &Scan) -> Self {
        let [count, write] = Stage::all(gpu, Self::recipes());
        Self { count, write, scan: scan.clone() }
    }

    pub fn recipes() -> [Recipe; 2] {
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::FRAME, shaders::SELECT];
        let bindings: &[&[Binding]] = &[&[Uniform, Read, Read, Write, Write]];
        [
            Recipe::new("select: count", &sources, "count", bindings),
            Recipe::new("select: write", &sources, "write", bindings),
        ]
    }

    /// Makes the list of a chunk, in a buffer of its size, unless `check` refuses the number of
    /// samples. `uniform` is the chunk's source. `shown` contains the visible ranges
    /// ([`first_visible`](crate::volume::reach::first_visible)).
    pub fn update(
        &self,
        gpu: &Gpu,
        selection: &mut Selection,
        uniform: &wgpu::Buffer,
        shown: &[u16; 256],
        check: impl Fn(u32) -> Result<()>,
    ) -> Result<()> {
        selection.count = selection.counts.shown(shown);
        check(selection.count)?;
        selection.selected =
            buffer(gpu, "selected", 4 * u64::from(selection.count), Usage::STORAGE);
        let visible = upload(gpu, "visible levels", bytemuck::cast_slice(&shown.map(u32::from)));
        let buffers =
            [uniform, &selection.ranges, &visible, &selection.blocks, &selection.selected];
        let bind = |stage: &Stage| {
            stage.bind(gpu, 0, &buffers.map(wgpu::Buffer::as_entire_buffer_binding))
        };
        let (blocks, groups) = (selection.block_count, selection.block_count.div_ceil(64));
        Commands::submit(gpu, "select", |commands| {
            commands.clear(&selection.blocks);
            self.count.dispatch(commands, &[&bind(&self.count)], groups);
            self.scan.encode(gpu, commands, &selection.blocks, blocks + 1);
            self.write.dispatch(commands, &[&bind(&self.write)], groups);
        });
        selection.shown = Some(*shown);
        Ok(())
    }
}

/// How many samples have each range of values around them. With it, the length of a list is known
/// without waiting for the GPU.
#[derive(Debug)]
struct Counts {
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
    fn shown(&self, first_visible: &[u16; 256]) -> u32 {
        let shows = |[low, high]: [u8; 2]| u16::from(high) >= first_visible[usize::from(low)];
        self.ranges.iter().filter(|(range, _)| shows(*range)).map(|(_, count)| count).sum()
    }
}

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
            recipe::{Binding, Recipe},
            scan::{SCAN_CAPACITY, Scan},
            shaders,
            stage::Stage,
        },
    },
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
        let usage = Usage::STORAGE | Usage::COPY_SRC;
        Self {
            ranges: upload(gpu, "ranges", bytemuck::cast_slice(ranges)),
            blocks: buffer(gpu, "select blocks", 4 * (u64::from(block_count) + 1), usage),
            block_count,
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
}

impl Select {
    pub fn new(gpu: &Gpu) -> Self {
        let [count, write] = Stage::all(gpu, Self::recipes());
        Self { count, write }
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
        scan: &Scan,
        selection: &mut Selection,
        uniform: &wgpu::Buffer,
        shown: &[u16; 256],
        check: impl Fn(u32) -> Result<()>,
    ) -> Result<()> {
        let visible = upload(gpu, "visible levels", bytemuck::cast_slice(&shown.map(u32::from)));
        let bind = |stage: &Stage, selection: &Selection| {
            let buffers =
                [uniform, &selection.ranges, &visible, &selection.blocks, &selection.selected];
            stage.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()))
        };
        let encoder = || {
            gpu.device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("select") })
        };
        let (blocks, groups) = (selection.block_count, selection.block_count.div_ceil(64));
        let mut counting = encoder();
        // After the scan, the element behind the last block is their sum.
        counting.clear_buffer(&selection.blocks, 0, None);
        self.count.dispatch(&mut counting, &[&bind(&self.count, selection)], groups);
        scan.encode(gpu, &mut counting, &selection.blocks, blocks + 1);
        gpu.queue.submit([counting.finish()]);
        let total = gpu.read(&selection.blocks, 4 * u64::from(blocks), 4)?;
        selection.count = bytemuck::pod_read_unaligned(&total);
        check(selection.count)?;
        selection.selected =
            buffer(gpu, "selected", 4 * u64::from(selection.count), Usage::STORAGE);
        let mut writing = encoder();
        self.write.dispatch(&mut writing, &[&bind(&self.write, selection)], groups);
        gpu.queue.submit([writing.finish()]);
        selection.shown = Some(*shown);
        Ok(())
    }
}

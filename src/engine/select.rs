//! Select: which samples of a lattice can add to the picture under the current transfer function (shaders/select.wgsl).
//! Runs when the transfer function changes. Explicit splats have no such list: all of them are candidates.

use super::{
    Gpu,
    scan::{SCAN_CAPACITY, Scan},
    shaders,
    stage::{Binding, Stage},
    upload::upload,
};
use crate::volume::{TransferFunction, reach::first_visible};
use wgpu::BufferUsages as Usage;

/// Samples per invocation (`SELECT_RUN` in select.wgsl).
const SELECT_RUN: u32 = 64;
const WORKGROUP_SAMPLES: u32 = 64 * SELECT_RUN;

/// The selected samples of one chunk of a lattice.
#[derive(Debug)]
pub struct Selection {
    ranges: wgpu::Buffer,
    runs: wgpu::Buffer,
    /// Indices within the chunk, in lattice order; the element behind the last possible one is their number.
    pub selected: wgpu::Buffer,
    /// The arguments of a dispatch over them.
    pub arguments: wgpu::Buffer,
    /// Whether the transfer function changed since the list was made.
    pub outdated: bool,
}

impl Selection {
    /// `ranges`: smallest and largest value around each sample, quantised over the volume's range.
    pub fn new(gpu: &Gpu, ranges: &[[u8; 2]]) -> Self {
        let samples = ranges.len() as u64;
        let runs = samples.div_ceil(u64::from(SELECT_RUN));
        debug_assert!(runs <= u64::from(SCAN_CAPACITY));
        Self {
            ranges: upload(gpu, "ranges", bytemuck::cast_slice(ranges)),
            runs: super::buffer(gpu, "select runs", 4 * runs, Usage::STORAGE),
            selected: super::buffer(gpu, "selected", 4 * (samples + 1), Usage::STORAGE),
            arguments: super::buffer(gpu, "selected arguments", 12, Usage::STORAGE | Usage::INDIRECT),
            outdated: true,
        }
    }

    pub fn bytes(&self) -> u64 {
        self.ranges.size() + self.runs.size() + self.selected.size()
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
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::FRAME, shaders::SELECT];
        let bindings: &[&[Binding]] = &[&[Uniform, Read, Read, Write, Write, Write]];
        Self {
            count: Stage::new(gpu, "select: count", &sources, "count", bindings),
            write: Stage::new(gpu, "select: write", &sources, "write", bindings),
        }
    }

    /// Encodes the making of a chunk's list. `uniform` is the chunk's source, `count` its number of samples, `range` the
    /// volume's smallest and largest value.
    #[expect(clippy::too_many_arguments, reason = "each is a separate thing that the pass reads")]
    pub fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scan: &Scan,
        selection: &Selection,
        uniform: &wgpu::Buffer,
        count: u32,
        transfer: &TransferFunction,
        range: [f64; 2],
    ) {
        let first = first_visible(transfer, range).map(u32::from);
        let visible = upload(gpu, "visible levels", bytemuck::cast_slice(&first));
        let buffers =
            [uniform, &selection.ranges, &visible, &selection.runs, &selection.selected, &selection.arguments]
                .map(|b| b.as_entire_buffer_binding());
        let groups = count.div_ceil(WORKGROUP_SAMPLES);
        self.count.dispatch(encoder, &[&self.count.bind(gpu, 0, &buffers)], groups);
        scan.encode(gpu, encoder, &selection.runs, count.div_ceil(SELECT_RUN));
        self.write.dispatch(encoder, &[&self.write.bind(gpu, 0, &buffers)], groups);
    }
}

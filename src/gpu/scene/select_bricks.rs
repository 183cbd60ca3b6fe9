//! Select bricks: lists the samples of the loaded bricks that can add to the picture
//! (shaders/passes/select_bricks.wgsl).

use super::bricks::Slab;
use crate::{
    Result,
    gpu::{
        device::{
            Gpu,
            buffers::{buffer, upload},
        },
        pipeline::{
            recipe::{Binding, Recipe},
            scan::Scan,
            shaders,
            stage::Stage,
        },
        scene::chunk::runs_of,
    },
};
use wgpu::BufferUsages as Usage;

/// The pass.
#[derive(Debug)]
pub struct SelectBricks {
    count: Stage,
    write: Stage,
}

impl SelectBricks {
    pub fn new(gpu: &Gpu) -> Self {
        let [count, write] = Stage::all(gpu, Self::recipes());
        Self { count, write }
    }

    pub fn recipes() -> [Recipe; 2] {
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::FRAME, shaders::SELECT_BRICKS];
        let bindings: &[&[Binding]] = &[&[Uniform, Read, Read, Write, Write, Uniform]];
        [
            Recipe::new("select bricks: count", &sources, "count", bindings),
            Recipe::new("select bricks: write", &sources, "write", bindings),
        ]
    }

    /// Makes the lists of all slabs, each with its uniform, in buffers of their sizes. Makes none
    /// if `check` refuses the number of samples, or if they make more than `most_runs` batches of
    /// candidates. Returns the number of batches. `shown` is that of `Choice`.
    pub fn update(
        &self,
        gpu: &Gpu,
        scan: &Scan,
        slabs: &mut [(&mut Slab, &wgpu::Buffer)],
        shown: &[u16; 256],
        most_runs: u64,
        check: impl Fn(u64) -> Result<()>,
    ) -> Result<u64> {
        let visible = upload(gpu, "visible levels", bytemuck::cast_slice(&shown.map(u32::from)));
        // All slabs count in the same buffer, one after the other. So they count again before they
        // write.
        let most = slabs.iter().map(|(slab, _)| slab.blocks()).max().unwrap_or(0);
        let blocks = buffer(
            gpu,
            "select blocks",
            4 * (u64::from(most) + 1),
            Usage::STORAGE | Usage::COPY_SRC,
        );
        let totals = buffer(gpu, "select totals", 4 * slabs.len() as u64, Usage::COPY_SRC);
        let bind = |stage: &Stage, slab: &Slab, uniform: &wgpu::Buffer| {
            let buffers = [uniform, &slab.ranges, &visible, &blocks, &slab.selected, &slab.slots];
            stage.bind(gpu, 0, &buffers.map(wgpu::Buffer::as_entire_buffer_binding))
        };
        let count = |encoder: &mut wgpu::CommandEncoder, slab: &Slab, uniform: &wgpu::Buffer| {
            // After the scan, the element behind the last block is their sum.
            encoder.clear_buffer(&blocks, 0, None);
            self.count.dispatch(
                encoder,
                &[&bind(&self.count, slab, uniform)],
                slab.blocks().div_ceil(64),
            );
            scan.encode(gpu, encoder, &blocks, slab.blocks() + 1);
        };
        let encoder = || {
            gpu.device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("select") })
        };
        let mut counting = encoder();
        for (at, (slab, uniform)) in (0..).zip(slabs.iter()) {
            count(&mut counting, slab, uniform);
            counting.copy_buffer_to_buffer(
                &blocks,
                4 * u64::from(slab.blocks()),
                &totals,
                4 * at,
                4,
            );
        }
        gpu.queue.submit([counting.finish()]);
        let counts: Vec<u32> =
            bytemuck::pod_collect_to_vec(&gpu.read(&totals, 0, 4 * slabs.len() as u64)?);
        let runs: u64 = counts.iter().map(|&count| u64::from(runs_of(count))).sum();
        if runs > most_runs {
            return Ok(runs);
        }
        check(counts.iter().map(|&count| u64::from(count)).sum())?;
        let mut writing = encoder();
        for ((slab, uniform), own) in slabs.iter_mut().zip(counts) {
            slab.count = own;
            slab.selected = buffer(gpu, "selected", 4 * u64::from(own), Usage::STORAGE);
            if own > 0 {
                count(&mut writing, slab, uniform);
                self.write.dispatch(
                    &mut writing,
                    &[&bind(&self.write, slab, uniform)],
                    slab.blocks().div_ceil(64),
                );
            }
        }
        gpu.queue.submit([writing.finish()]);
        Ok(runs)
    }
}

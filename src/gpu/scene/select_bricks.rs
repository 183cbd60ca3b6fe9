//! Select bricks: lists the samples of the loaded bricks that can add to the picture
//! (shaders/passes/select_bricks.wgsl).

use super::bricks::Slab;
use crate::gpu::{
    device::{
        Gpu,
        buffers::{buffer, upload},
    },
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        scan::Scan,
        shaders,
        stage::Stage,
    },
};
use wgpu::BufferUsages as Usage;

/// The pass.
#[derive(Debug)]
pub struct SelectBricks {
    count: Stage,
    write: Stage,
    scan: Scan,
}

impl SelectBricks {
    pub fn new(gpu: &Gpu, scan: &Scan) -> Self {
        let [count, write] = Stage::all(gpu, Self::recipes());
        Self { count, write, scan: scan.clone() }
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

    /// Makes the lists of all slabs, each with its uniform and its number of visible samples.
    /// `shown` is that of `Choice`.
    pub fn update(
        &self,
        gpu: &Gpu,
        slabs: &mut [(&mut Slab, &wgpu::Buffer, u32)],
        shown: &[u16; 256],
    ) {
        let visible = upload(gpu, "visible levels", bytemuck::cast_slice(&shown.map(u32::from)));
        // All slabs count in the same buffer, one after the other.
        let most = slabs.iter().map(|(slab, ..)| slab.blocks()).max().unwrap_or(0);
        let blocks = buffer(gpu, "select blocks", 4 * (u64::from(most) + 1), Usage::STORAGE);
        Commands::submit(gpu, "select", |commands| {
            for (slab, uniform, count) in slabs {
                slab.count = *count;
                slab.selected = buffer(gpu, "selected", 4 * u64::from(*count), Usage::STORAGE);
                if *count == 0 {
                    continue;
                }
                let buffers =
                    [uniform, &slab.ranges, &visible, &blocks, &slab.selected, &slab.slots];
                let bind = |stage: &Stage| {
                    stage.bind(gpu, 0, &buffers.map(wgpu::Buffer::as_entire_buffer_binding))
                };
                let groups = slab.blocks().div_ceil(64);
                commands.clear(&blocks);
                self.count.dispatch(commands, &[&bind(&self.count)], groups);
                self.scan.encode(gpu, commands, &blocks, slab.blocks() + 1);
                self.write.dispatch(commands, &[&bind(&self.write)], groups);
            }
        });
    }
}

//! Occlusion: maps the tiles that are opaque so far, for culling (shaders/passes/occlusion.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        shaders,
        stage::{Binding, Stage},
        state::MARCH_ARGUMENTS,
        variant::Variant,
    },
    targets::Targets,
};

/// The pass.
#[derive(Debug)]
pub struct Occlusion {
    look: Stage,
    sum_rows: Stage,
    sum_columns: Stage,
}

impl Occlusion {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let stage = |label, entry| {
            let sources = [
                &variant.constants(),
                shaders::FRAME,
                shaders::MAP,
                shaders::PROGRESS,
                shaders::OCCLUSION,
            ];
            Stage::new(gpu, label, &sources, entry, &[&[Uniform, Read, Read, Write]])
        };
        Self {
            look: stage("occlusion: look", "look"),
            sum_rows: stage("occlusion: rows", "sum_rows"),
            sum_columns: stage("occlusion: columns", "sum_columns"),
        }
    }

    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        let buffers = [&targets.frame, &targets.colors, &targets.progress, &targets.map];
        let buffers = buffers.map(|b| b.as_entire_buffer_binding());
        // A workgroup checks 64 tiles, and march has a workgroup for each tile. So most workgroups
        // of this dispatch have nothing to do.
        let group = self.look.bind(gpu, 0, &buffers);
        self.look.dispatch_indirect(encoder, &[&group], (&targets.arguments, MARCH_ARGUMENTS));
        let [columns, rows] = targets.tiles;
        for (stage, count) in [(&self.sum_rows, rows), (&self.sum_columns, columns)] {
            stage.dispatch(encoder, &[&stage.bind(gpu, 0, &buffers)], count.div_ceil(64));
        }
    }
}

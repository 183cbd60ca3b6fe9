//! Occlusion: maps the tiles that are opaque so far, for culling (shaders/passes/occlusion.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
        state::MARCH_ARGUMENTS,
    },
    targets::Targets,
    variant::Variant,
};

/// The pass.
#[derive(Debug)]
pub struct Occlusion {
    find_opaque: Stage,
    sum_rows: Stage,
    sum_columns: Stage,
}

impl Occlusion {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let [find_opaque, sum_rows, sum_columns] = Stage::all(gpu, Self::recipes(variant));
        Self { find_opaque, sum_rows, sum_columns }
    }

    pub fn recipes(variant: &Variant) -> [Recipe; 3] {
        use Binding::{Read, Uniform, Write};
        let recipe = |label, entry| {
            let sources = [
                &variant.constants(),
                shaders::FRAME,
                shaders::MAP,
                shaders::PROGRESS,
                shaders::OCCLUSION,
            ];
            Recipe::new(label, &sources, entry, &[&[Uniform, Read, Read, Write]])
        };
        [
            recipe("occlusion: opaque tiles", "find_opaque"),
            recipe("occlusion: rows", "sum_rows"),
            recipe("occlusion: columns", "sum_columns"),
        ]
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = [&targets.frame, &targets.colors, &targets.progress, &targets.map];
        let buffers = buffers.map(|b| b.as_entire_buffer_binding());
        // A workgroup checks 64 tiles, and march has a workgroup for each tile. So most workgroups
        // of this dispatch have nothing to do.
        let group = self.find_opaque.bind(gpu, 0, &buffers);
        self.find_opaque.dispatch_indirect(
            commands,
            &[&group],
            (&targets.arguments, MARCH_ARGUMENTS),
        );
        let [columns, rows] = targets.tiles;
        for (stage, count) in [(&self.sum_rows, rows), (&self.sum_columns, columns)] {
            stage.dispatch(commands, &[&stage.bind(gpu, 0, &buffers)], count.div_ceil(64));
        }
    }
}

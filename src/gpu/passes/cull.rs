//! Cull: finds the candidates that a pass draws, except those hidden by earlier passes
//! (shaders/passes/cull.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
    scene::chunk::{Chunk, Origin, WORKGROUP_CANDIDATES},
    targets::Targets,
    variant::Variant,
};

/// Number of lanes to which workgroups are dealt (`LANES` in frame.wgsl).
const LANES: u32 = 16;

/// The pass.
#[derive(Debug)]
pub struct Cull {
    cull: Stage,
    prepare: Stage,
}

impl Cull {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let [cull, prepare] = Stage::all(gpu, Self::recipes(variant));
        Self { cull, prepare }
    }

    pub fn recipes(variant: &Variant) -> [Recipe; 2] {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let sources = [
            &constants,
            shaders::FRAME,
            shaders::SPANS,
            shaders::MAP,
            shaders::STATE,
            shaders::ACTIVE,
            shaders::CULL,
        ];
        let bindings: &[Binding] = &[Uniform, Uniform, Read, Read, Read, Write, Write, Write];
        let chunk: &[Binding] = &[Uniform, Read];
        [
            Recipe::new("cull", &sources, "cull", &[bindings, chunk]),
            Recipe::new("cull: prepare", &sources, "prepare", &[bindings, chunk, &[Write]]),
        ]
    }

    pub fn encode(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        targets: &Targets,
        chunks: &[Chunk],
    ) {
        // Batches behind a hierarchy's last drawn node, and the element after the last batch, count
        // as 0.
        commands.clear(&targets.runs);
        commands.clear(&targets.active);
        for chunk in chunks {
            let buffers = [
                &targets.frame,
                &targets.pass,
                &chunk.spans,
                &targets.run_spans,
                &targets.map,
                &targets.active,
                &targets.runs,
                &targets.state,
            ];
            // Only the number of nodes is unknown here. Other chunks bind their data in its place.
            let numbers = match &chunk.origin {
                Origin::Nodes { slots, .. } => &slots.selected,
                _ => &chunk.data,
            };
            let buffers = buffers.map(|b| b.as_entire_buffer_binding());
            let chunk_buffers = [&chunk.uniform, numbers].map(|b| b.as_entire_buffer_binding());
            let groups = [self.cull.bind(gpu, 0, &buffers), self.cull.bind(gpu, 1, &chunk_buffers)];
            let workgroups =
                chunk.candidates.div_ceil(WORKGROUP_CANDIDATES).next_multiple_of(LANES);
            self.cull.dispatch(commands, &[&groups[0], &groups[1]], workgroups);
            let arguments =
                self.prepare.bind(gpu, 2, &[chunk.active_arguments.as_entire_buffer_binding()]);
            let groups =
                [self.prepare.bind(gpu, 0, &buffers), self.prepare.bind(gpu, 1, &chunk_buffers)];
            self.prepare.dispatch(commands, &[&groups[0], &groups[1], &arguments], 1);
        }
    }
}

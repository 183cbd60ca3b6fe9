//! Project: writes the records of a pass's splats (shaders/passes/project.wgsl).

use crate::gpu::{
    device::Gpu,
    passes::sources::{Sources, per_source},
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
    scene::chunk::Chunk,
    targets::Targets,
    variant::Variant,
};

/// The pass, once per kind of source.
#[derive(Debug)]
pub struct Project(Sources<Stage>);

impl Project {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self(Self::recipes(variant).map(|recipe| Stage::new(gpu, &recipe)))
    }

    pub fn recipes(variant: &Variant) -> Sources<Recipe> {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        per_source(|kind, source, bindings| {
            let sources = [
                &constants,
                shaders::FRAME,
                shaders::NORMAL,
                shaders::KEY,
                shaders::FOOTPRINT,
                source,
                shaders::BINS,
                shaders::ACTIVE,
                shaders::PROJECT,
            ];
            let shared = [Uniform, Read, Read, Read, Write, Write];
            Recipe::new(&format!("project: {kind}"), &sources, "project", &[&shared, bindings])
        })
    }

    pub fn encode(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        targets: &Targets,
        chunks: &[Chunk],
    ) {
        let buffers = [
            &targets.frame,
            &targets.planes,
            &targets.runs,
            &targets.active,
            &targets.records,
            &targets.boxes,
        ]
        .map(|b| b.as_entire_buffer_binding());
        for chunk in chunks {
            self.0.dispatch_indirect(gpu, commands, chunk, &buffers, &chunk.active_arguments);
        }
    }
}

//! Measure: finds the tiles and sheets that each candidate meets, and the capacity that its batch
//! of candidates needs (shaders/passes/measure.wgsl).

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
pub struct Measure(Sources<Stage>);

impl Measure {
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
                shaders::SPANS,
                shaders::BINS,
                shaders::MEASURE,
            ];
            let shared = [Uniform, Read, Write, Write, Write];
            Recipe::new(&format!("measure: {kind}"), &sources, "measure", &[&shared, bindings])
        })
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets, chunk: &Chunk) {
        let buffers =
            [&targets.frame, &targets.planes, &chunk.spans, &targets.run_spans, &targets.needs];
        let buffers = buffers.map(|b| b.as_entire_buffer_binding());
        self.0.dispatch(gpu, commands, chunk, &buffers);
    }
}

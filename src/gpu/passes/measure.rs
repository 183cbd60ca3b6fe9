//! Measure: finds the tiles and sheets that each candidate meets, and the capacity that its batch
//! of candidates needs (shaders/passes/measure.wgsl).

use crate::gpu::{
    device::Gpu,
    passes::sources::{Sources, per_source},
    pipeline::{
        shaders,
        stage::{Binding, Stage},
        variant::Variant,
    },
    scene::chunk::Chunk,
    targets::Targets,
};

/// The pass, once per kind of source.
#[derive(Debug)]
pub struct Measure(Sources<Stage>);

impl Measure {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        Self(per_source(|source, bindings| {
            let constants = variant.constants();
            let sources = [
                &constants,
                shaders::FRAME,
                shaders::NORMAL,
                shaders::FOOTPRINT,
                source,
                shaders::SPANS,
                shaders::BINS,
                shaders::MEASURE,
            ];
            Stage::new(
                gpu,
                "measure",
                &sources,
                "measure",
                &[&[Uniform, Read, Write, Write, Write], bindings],
            )
        }))
    }

    pub fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        chunk: &Chunk,
    ) {
        let buffers =
            [&targets.frame, &targets.planes, &chunk.spans, &targets.run_spans, &targets.needs];
        let buffers = buffers.map(|b| b.as_entire_buffer_binding());
        self.0.dispatch(gpu, encoder, chunk, &buffers);
    }
}

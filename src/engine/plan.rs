//! Plan: cuts a frame into depth passes that fit the buffers (shaders/survey.wgsl and plan.wgsl).

use super::{
    Gpu,
    frame::Targets,
    shaders::{self, Variant},
    source::{Sources, per_source},
    stage::{Binding, Stage},
    upload::Chunk,
};

/// The most passes of a frame.
pub const MAX_PASSES: u32 = 256;
/// Bytes of the census for a number of sheets: 7 counts for each of 16 bands and for their sum, also for the sheet before
/// the first and the one behind the last.
pub fn census_bytes(sheets: usize) -> u64 {
    (sheets as u64 + 2) * 17 * 7 * 4
}

/// The passes.
#[derive(Debug)]
pub struct Plan {
    total: Stage,
    survey: Sources<Stage>,
    accumulate: Stage,
    plan: Stage,
}

impl Plan {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let sources = [&constants, shaders::FRAME, shaders::SPANS, shaders::CENSUS, shaders::PLAN];
        let bindings: &[&[Binding]] = &[&[Uniform, Read, Write, Write, Write, Write, Uniform]];
        let survey = per_source(|source, bindings| {
            let sources = [
                &constants,
                shaders::FRAME,
                shaders::NORMAL,
                shaders::FOOTPRINT,
                source,
                shaders::SPANS,
                shaders::CENSUS,
                shaders::BINS,
                shaders::SURVEY,
            ];
            Stage::new(gpu, "survey", &sources, "survey", &[&[Uniform, Read, Read, Read, Write], bindings])
        });
        Self {
            total: Stage::new(gpu, "plan: total", &sources, "total", bindings),
            survey,
            accumulate: Stage::new(gpu, "plan: accumulate", &sources, "accumulate", bindings),
            plan: Stage::new(gpu, "plan", &sources, "plan", bindings),
        }
    }

    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, chunks: &[Chunk]) {
        let buffers = [
            &targets.frame,
            &targets.needs,
            &targets.totals,
            &targets.census,
            &targets.passes,
            &targets.report,
            &targets.run_count,
        ]
        .map(|b| b.as_entire_buffer_binding());
        self.total.dispatch(encoder, &[&self.total.bind(gpu, 0, &buffers)], 1);
        encoder.clear_buffer(&targets.census, 0, None);
        for chunk in chunks {
            let buffers = [&targets.frame, &targets.planes, &chunk.spans, &targets.totals, &targets.census];
            self.survey.dispatch(gpu, encoder, chunk, &buffers.map(|b| b.as_entire_buffer_binding()));
        }
        self.accumulate.dispatch(encoder, &[&self.accumulate.bind(gpu, 0, &buffers)], 1);
        self.plan.dispatch(encoder, &[&self.plan.bind(gpu, 0, &buffers)], 1);
    }
}

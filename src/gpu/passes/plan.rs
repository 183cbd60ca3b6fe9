//! Plan: divides a frame into depth passes that fit the buffers (shaders/passes/survey.wgsl and
//! plan.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
    },
    targets::Targets,
    variant::Variant,
};

/// The stages of the pass. `advance` runs before each depth pass, the others once per frame.
#[derive(Debug)]
pub struct Plan {
    total: Stage,
    survey: Stage,
    accumulate: Stage,
    advance: Stage,
}

impl Plan {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let [total, survey, accumulate, advance] = Stage::all(gpu, Self::recipes(variant));
        Self { total, survey, accumulate, advance }
    }

    pub fn recipes(variant: &Variant) -> [Recipe; 4] {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let shared = [&constants, shaders::FRAME, shaders::SPANS, shaders::CENSUS];
        let plan = |label, entry| {
            let sources = [shaders::STATE, shaders::MAP, shaders::PROGRESS, shaders::PLAN];
            let bindings = [Uniform, Read, Uniform, Write, Write, Write, Write, Write, Read];
            Recipe::new(label, &[shared.as_slice(), &sources].concat(), entry, &[&bindings])
        };
        let survey = [shared.as_slice(), &[shaders::SURVEY]].concat();
        [
            plan("plan: total", "total"),
            Recipe::new("survey", &survey, "survey", &[&[Uniform, Read, Read, Uniform, Write]]),
            plan("plan: accumulate", "accumulate"),
            plan("plan: advance", "advance"),
        ]
    }

    fn buffers(targets: &Targets) -> [wgpu::BufferBinding<'_>; 9] {
        [
            &targets.frame,
            &targets.needs,
            &targets.run_count,
            &targets.state,
            &targets.census,
            &targets.pass,
            &targets.arguments,
            &targets.bin_size,
            &targets.map,
        ]
        .map(|b| b.as_entire_buffer_binding())
    }

    /// Sums the results of measure.
    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = Self::buffers(targets);
        self.total.dispatch(commands, &[&self.total.bind(gpu, 0, &buffers)], 1);
        commands.clear(&targets.census);
        let survey_buffers = [
            &targets.frame,
            &targets.run_spans,
            &targets.needs,
            &targets.run_count,
            &targets.census,
        ];
        let survey =
            self.survey.bind(gpu, 0, &survey_buffers.map(|b| b.as_entire_buffer_binding()));
        self.survey.dispatch(commands, &[&survey], targets.run_total.div_ceil(64));
        self.accumulate.dispatch(commands, &[&self.accumulate.bind(gpu, 0, &buffers)], 1);
    }

    /// Decides how far the next depth pass reaches.
    pub fn encode_advance(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        self.advance.dispatch(commands, &[&self.advance.bind(gpu, 0, &Self::buffers(targets))], 1);
    }
}

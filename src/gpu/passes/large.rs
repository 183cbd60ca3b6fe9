//! Large: writes the entries of splats that meet many bins (shaders/passes/large.wgsl).

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

/// The pass. Its first half runs before the bins are scanned, its second half after bin has filled
/// them.
#[derive(Debug)]
pub struct Large {
    prepare: Stage,
    count: Stage,
    fill: Stage,
}

impl Large {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let [prepare, count, fill] = Stage::all(gpu, Self::recipes(variant));
        Self { prepare, count, fill }
    }

    pub fn recipes(variant: &Variant) -> [Recipe; 3] {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let bindings: &[Binding] = &[Uniform, Uniform, Read, Write, Write, Read];
        let recipe = |label, entry, groups: &[&[Binding]]| {
            let sources = [&constants, shaders::FRAME, shaders::BINS, shaders::LARGE];
            Recipe::new(label, &sources, entry, groups)
        };
        [
            recipe("large: prepare", "prepare", &[bindings, &[Write]]),
            recipe("large: count", "count", &[bindings]),
            recipe("large: fill", "fill", &[bindings]),
        ]
    }

    fn buffers(targets: &Targets) -> [wgpu::BufferBinding<'_>; 6] {
        [
            &targets.frame,
            &targets.pass,
            &targets.boxes,
            &targets.bins,
            &targets.entries,
            &targets.large,
        ]
        .map(|b| b.as_entire_buffer_binding())
    }

    /// Counts the entries of the splats that bin has listed.
    pub fn encode_count(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = Self::buffers(targets);
        let arguments =
            self.prepare.bind(gpu, 1, &[targets.large_arguments.as_entire_buffer_binding()]);
        self.prepare.dispatch(commands, &[&self.prepare.bind(gpu, 0, &buffers), &arguments], 1);
        self.count.dispatch_indirect(
            commands,
            &[&self.count.bind(gpu, 0, &buffers)],
            (&targets.large_arguments, 0),
        );
    }

    /// Writes their entries.
    pub fn encode_fill(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = Self::buffers(targets);
        self.fill.dispatch_indirect(
            commands,
            &[&self.fill.bind(gpu, 0, &buffers)],
            (&targets.large_arguments, 0),
        );
    }
}

//! Bin: writes the entries of a pass, each into its bin (shaders/passes/bin.wgsl).

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

/// The pass. The number of its workgroups follows from the number of records, which only the GPU
/// knows.
#[derive(Debug)]
pub struct Bin {
    prepare: Stage,
    count: Stage,
    fill: Stage,
}

impl Bin {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let [prepare, count, fill] = Stage::all(gpu, Self::recipes(variant));
        Self { prepare, count, fill }
    }

    pub fn recipes(variant: &Variant) -> [Recipe; 3] {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let bindings: &[Binding] =
            &[Uniform, Uniform, Uniform, Read, Read, Write, Write, Write, Write];
        let recipe = |label, entry, groups: &[&[Binding]]| {
            let sources = [&constants, shaders::FRAME, shaders::BINS, shaders::STATE, shaders::BIN];
            Recipe::new(label, &sources, entry, groups)
        };
        [
            recipe("bin: prepare", "prepare", &[bindings, &[Write]]),
            recipe("bin: count", "count", &[bindings]),
            recipe("bin: fill", "fill", &[bindings]),
        ]
    }

    fn buffers(targets: &Targets) -> [wgpu::BufferBinding<'_>; 9] {
        [
            &targets.frame,
            &targets.pass,
            &targets.run_count,
            &targets.boxes,
            &targets.runs,
            &targets.bins,
            &targets.entries,
            &targets.large,
            &targets.state,
        ]
        .map(|b| b.as_entire_buffer_binding())
    }

    /// Counts the sizes of the bins, without the entries of large splats, and lists the large
    /// splats.
    pub fn encode_count(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = Self::buffers(targets);
        let arguments =
            self.prepare.bind(gpu, 1, &[targets.bin_arguments.as_entire_buffer_binding()]);
        self.prepare.dispatch(commands, &[&self.prepare.bind(gpu, 0, &buffers), &arguments], 1);
        self.count.dispatch_indirect(
            commands,
            &[&self.count.bind(gpu, 0, &buffers)],
            (&targets.bin_arguments, 0),
        );
    }

    /// Fills the bins.
    pub fn encode_fill(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let group = self.fill.bind(gpu, 0, &Self::buffers(targets));
        self.fill.dispatch_indirect(commands, &[&group], (&targets.bin_arguments, 0));
    }
}

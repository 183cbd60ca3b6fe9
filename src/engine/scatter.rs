//! Scatter: the entries of a pass, each into its bin (shaders/scatter.wgsl).

use super::{
    Gpu,
    frame::Targets,
    shaders::{self, Variant},
    stage::{Binding, Stage},
};

/// The pass: as many workgroups as it has records, which only the GPU knows.
#[derive(Debug)]
pub struct Scatter {
    count: Stage,
    scatter: Stage,
}

impl Scatter {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let bindings: &[Binding] = &[Uniform, Uniform, Read, Read, Write, Write, Uniform];
        let stage = |label, entry, groups: &[&[Binding]]| {
            let sources = [&constants, shaders::FRAME, shaders::BINS, shaders::SCATTER];
            Stage::new(gpu, label, &sources, entry, groups)
        };
        Self {
            count: stage("scatter: count", "count", &[bindings, &[Write]]),
            scatter: stage("scatter", "scatter", &[bindings]),
        }
    }

    /// Finds the workgroups that a pass's records need.
    pub fn encode_count(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, pass: u32) {
        let buffers = targets.bin_bindings(pass);
        let arguments = self.count.bind(gpu, 1, &[targets.scatter_arguments.as_entire_buffer_binding()]);
        self.count.dispatch(encoder, &[&self.count.bind(gpu, 0, &buffers), &arguments], 1);
    }

    /// Fills the bins.
    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, pass: u32) {
        let buffers = targets.bin_bindings(pass);
        let group = self.scatter.bind(gpu, 0, &buffers);
        self.scatter.dispatch_indirect(encoder, &[&group], (&targets.scatter_arguments, 0));
    }
}

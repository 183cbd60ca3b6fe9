//! Large: the entries of splats that meet many bins (shaders/large.wgsl).

use super::{
    Gpu,
    frame::Targets,
    shaders::{self, Variant},
    stage::{Binding, Stage},
};

/// The pass: its first half before the bins are scanned, its second after scatter.
#[derive(Debug)]
pub struct Large {
    find: Stage,
    prepare: Stage,
    count: Stage,
    fill: Stage,
}

impl Large {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let bindings: &[Binding] = &[Uniform, Uniform, Read, Read, Write, Write, Uniform, Write, Write];
        let stage = |label, entry, groups: &[&[Binding]]| {
            Stage::new(gpu, label, &[&constants, shaders::FRAME, shaders::BINS, shaders::LARGE], entry, groups)
        };
        Self {
            find: stage("large: find", "find", &[bindings]),
            prepare: stage("large: prepare", "prepare", &[bindings, &[Write]]),
            count: stage("large: count", "count", &[bindings]),
            fill: stage("large: fill", "fill", &[bindings]),
        }
    }

    fn buffers(targets: &Targets, pass: u32) -> Vec<wgpu::BufferBinding<'_>> {
        let own = [&targets.large, &targets.large_count].map(|b| b.as_entire_buffer_binding());
        targets.bin_bindings(pass).into_iter().chain(own).collect()
    }

    /// Lists the large splats and counts their entries. Needs the workgroups that scatter has found.
    pub fn encode_count(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, pass: u32) {
        encoder.clear_buffer(&targets.large_count, 0, None);
        let buffers = Self::buffers(targets, pass);
        self.find.dispatch_indirect(encoder, &[&self.find.bind(gpu, 0, &buffers)], (&targets.scatter_arguments, 0));
        let arguments = self.prepare.bind(gpu, 1, &[targets.large_arguments.as_entire_buffer_binding()]);
        self.prepare.dispatch(encoder, &[&self.prepare.bind(gpu, 0, &buffers), &arguments], 1);
        self.count.dispatch_indirect(encoder, &[&self.count.bind(gpu, 0, &buffers)], (&targets.large_arguments, 0));
    }

    /// Writes their entries.
    pub fn encode_fill(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, pass: u32) {
        let buffers = Self::buffers(targets, pass);
        self.fill.dispatch_indirect(encoder, &[&self.fill.bind(gpu, 0, &buffers)], (&targets.large_arguments, 0));
    }
}

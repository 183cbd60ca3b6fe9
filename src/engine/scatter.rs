//! Scatter: the entries of a pass, each into its bin (shaders/scatter.wgsl).

use super::{
    Gpu,
    frame::Targets,
    shaders::{self, Variant},
    stage::{Binding, Stage},
};

/// Workgroups that share the records of a pass.
const WORKGROUPS: u32 = 2048;

/// The pass.
#[derive(Debug)]
pub struct Scatter(Stage);

impl Scatter {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let sources = [&variant.constants(), shaders::FRAME, shaders::BINS, shaders::SCATTER];
        let bindings = [Uniform, Uniform, Read, Read, Write, Write, Uniform];
        Self(Stage::new(gpu, "scatter", &sources, "scatter", &[&bindings]))
    }

    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, pass: u32) {
        let buffers = [
            targets.frame.as_entire_buffer_binding(),
            targets.pass(pass),
            targets.boxes.as_entire_buffer_binding(),
            targets.runs.as_entire_buffer_binding(),
            targets.bins.as_entire_buffer_binding(),
            targets.entries.as_entire_buffer_binding(),
            targets.run_count.as_entire_buffer_binding(),
        ];
        self.0.dispatch(encoder, &[&self.0.bind(gpu, 0, &buffers)], WORKGROUPS);
    }
}

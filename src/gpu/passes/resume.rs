//! Resume: continues tiles that march has stopped (shaders/passes/resume.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        shaders,
        stage::{Binding, Stage},
    },
    targets::Targets,
};

/// The pass.
#[derive(Debug)]
pub struct Resume {
    again: Stage,
    hold: Stage,
    resume: Stage,
}

impl Resume {
    pub fn new(gpu: &Gpu) -> Self {
        use Binding::{Uniform, Write};
        let stage = |label, entry| {
            let sources = [shaders::FRAME, shaders::STATE, shaders::PROGRESS, shaders::RESUME];
            Stage::new(gpu, label, &sources, entry, &[&[Uniform, Write, Write, Write, Write]])
        };
        Self {
            again: stage("resume: again", "again"),
            hold: stage("resume: hold", "hold"),
            resume: stage("resume", "resume"),
        }
    }

    fn encode(stage: &Stage, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        let buffers =
            [&targets.frame, &targets.state, &targets.pass, &targets.arguments, &targets.progress];
        let group = stage.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()));
        stage.dispatch(encoder, &[&group], 1);
    }

    /// Prepares another march if any tiles are unfinished.
    pub fn encode_again(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        Self::encode(&self.again, gpu, encoder, targets);
    }

    /// Stops the frame if tiles are still unfinished.
    pub fn encode_hold(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        Self::encode(&self.hold, gpu, encoder, targets);
    }

    /// Continues the pass at which the frame stopped.
    pub fn encode_resume(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets) {
        Self::encode(&self.resume, gpu, encoder, targets);
    }
}

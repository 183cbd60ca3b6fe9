//! Resume: continues tiles that march has stopped (shaders/passes/resume.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
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
        let [again, hold, resume] = Stage::all(gpu, Self::recipes());
        Self { again, hold, resume }
    }

    pub fn recipes() -> [Recipe; 3] {
        use Binding::{Uniform, Write};
        let recipe = |label, entry| {
            let sources = [shaders::FRAME, shaders::STATE, shaders::PROGRESS, shaders::RESUME];
            Recipe::new(label, &sources, entry, &[&[Uniform, Write, Write, Write, Write]])
        };
        [
            recipe("resume: again", "again"),
            recipe("resume: hold", "hold"),
            recipe("resume", "resume"),
        ]
    }

    fn encode(stage: &Stage, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers =
            [&targets.frame, &targets.state, &targets.pass, &targets.arguments, &targets.progress];
        let group = stage.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()));
        stage.dispatch(commands, &[&group], 1);
    }

    /// Prepares another march if any tiles are unfinished.
    pub fn encode_again(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        Self::encode(&self.again, gpu, commands, targets);
    }

    /// Stops the frame if tiles are still unfinished.
    pub fn encode_hold(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        Self::encode(&self.hold, gpu, commands, targets);
    }

    /// Continues the pass at which the frame stopped.
    pub fn encode_resume(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        Self::encode(&self.resume, gpu, commands, targets);
        targets.restore_record_starts(commands);
    }
}

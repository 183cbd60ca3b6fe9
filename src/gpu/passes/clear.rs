//! Clear: empties the bins that a pass uses, and the progress of its tiles
//! (shaders/passes/clear.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
        state::SCAN_ARGUMENTS,
    },
    targets::Targets,
};

/// The pass.
#[derive(Debug)]
pub struct Clear(Stage);

impl Clear {
    pub fn new(gpu: &Gpu) -> Self {
        Self(Stage::new(gpu, &Self::recipe()))
    }

    pub fn recipe() -> Recipe {
        use Binding::{Uniform, Write};
        let sources = [shaders::FRAME, shaders::PROGRESS, shaders::CLEAR];
        Recipe::new("clear", &sources, "clear", &[&[Uniform, Uniform, Write, Write]])
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = [&targets.frame, &targets.bin_size, &targets.bins, &targets.progress];
        let group = self.0.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()));
        self.0.dispatch_indirect(commands, &[&group], (&targets.arguments, SCAN_ARGUMENTS));
    }
}

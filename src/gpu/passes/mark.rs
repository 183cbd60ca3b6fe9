//! Mark: finds the sheets of each tile in which a gathered lattice may be visible
//! (shaders/passes/mark.wgsl).

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

/// Words of marks that a workgroup finds.
const WORDS: u32 = 16;

/// The pass.
#[derive(Debug)]
pub struct Mark(Stage);

impl Mark {
    pub fn new(gpu: &Gpu) -> Self {
        Self(Stage::new(gpu, &Self::recipe()))
    }

    pub fn recipe() -> Recipe {
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::FRAME, shaders::PROGRESS, shaders::MARK];
        Recipe::new("mark", &sources, "mark", &[&[Uniform, Read, Write, Write]])
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let Some(gathered) = &targets.gathered else { return };
        let buffers = [&targets.frame, &targets.planes, &gathered.visibility, &targets.progress];
        let group = self.0.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()));
        self.0.dispatch(commands, &[&group], gathered.mark_words.div_ceil(WORDS));
    }
}

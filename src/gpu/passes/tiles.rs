//! Tiles: lists the tiles of the picture that have entries in a pass (shaders/passes/tiles.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
        state::TILE_ARGUMENTS,
    },
    targets::Targets,
};

/// The pass.
#[derive(Debug)]
pub struct Tiles {
    list: Stage,
    prepare: Stage,
}

impl Tiles {
    pub fn new(gpu: &Gpu) -> Self {
        let [list, prepare] = Stage::all(gpu, Self::recipes());
        Self { list, prepare }
    }

    pub fn recipes() -> [Recipe; 2] {
        use Binding::{Read, Uniform, Write};
        let recipe = |label, entry, groups: &[&[Binding]]| {
            let sources = [shaders::FRAME, shaders::STATE, shaders::PROGRESS, shaders::TILES];
            Recipe::new(label, &sources, entry, groups)
        };
        let bindings = [Uniform, Uniform, Read, Write];
        [
            recipe("tiles: list", "list", &[&bindings]),
            recipe("tiles: prepare", "prepare", &[&bindings, &[Write; 2]]),
        ]
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        let buffers = [&targets.frame, &targets.pass, &targets.bins, &targets.progress];
        let buffers = buffers.map(|b| b.as_entire_buffer_binding());
        let group = self.list.bind(gpu, 0, &buffers);
        self.list.dispatch_indirect(commands, &[&group], (&targets.arguments, TILE_ARGUMENTS));
        let arguments = self.prepare.bind(
            gpu,
            1,
            &[&targets.arguments, &targets.state].map(|b| b.as_entire_buffer_binding()),
        );
        self.prepare.dispatch(commands, &[&self.prepare.bind(gpu, 0, &buffers), &arguments], 1);
    }
}

//! Recolor: gives trained Gaussians the colours that an eye sees (shaders/passes/recolor.wgsl). The
//! harmonics stay on the device, so that nothing is computed or uploaded as the eye moves.

use crate::{
    Result,
    gaussians::Eye,
    gpu::{
        device::Gpu,
        pipeline::{
            commands::Commands,
            recipe::{Binding, Recipe},
            shaders,
            stage::Stage,
        },
        scene::{
            PreparedScene,
            chunk::Origin,
            harmonics::Harmonics,
            prepared::{SeenSet, gaussian_bytes},
        },
    },
    math::View,
};

/// The pass.
#[derive(Debug)]
pub struct Recolor(Stage);

impl Recolor {
    pub fn new(gpu: &Gpu) -> Self {
        Self(Stage::new(gpu, &Self::recipe()))
    }

    pub fn recipe() -> Recipe {
        use Binding::{Read, Uniform, Write};
        let sources = [shaders::SPLAT, shaders::RECOLOR];
        Recipe::new("recolor", &sources, "recolor", &[&[Uniform, Read, Write]])
    }

    /// Gives Gaussians the colours for a view's eye.
    pub fn update(&self, gpu: &Gpu, prepared: &mut PreparedScene, view: &View) -> Result<()> {
        for number in 0..prepared.seen.len() {
            let SeenSet { item, set, eye: last } = &mut prepared.seen[number];
            let eye = Eye::of(&prepared.scene.view_of(*item, view));
            let (item, set, last) = (*item, set.clone(), last.replace(eye));
            if last.is_none() {
                gpu.check_memory(prepared.bytes + gaussian_bytes(&set))?;
                prepared.add_gaussians(gpu, &set, item, eye);
            }
            if last == Some(eye) || !set.depends_on_eye() {
                continue;
            }
            Commands::submit(gpu, "recolor", |commands| {
                for chunk in prepared.chunks.iter().filter(|chunk| chunk.item == item) {
                    if let Origin::Splats { harmonics: Some(harmonics), .. } = &chunk.origin {
                        self.encode(gpu, commands, (harmonics, &chunk.data), eye);
                    }
                }
            });
        }
        Ok(())
    }

    /// Encodes the pass for a chunk's splats.
    fn encode(
        &self,
        gpu: &Gpu,
        commands: &mut Commands<'_>,
        (harmonics, splats): (&Harmonics, &wgpu::Buffer),
        eye: Eye,
    ) {
        harmonics.set_eye(gpu, eye);
        let buffers = [&harmonics.eye, &harmonics.numbers, splats];
        let group = self.0.bind(gpu, 0, &buffers.map(|b| b.as_entire_buffer_binding()));
        self.0.dispatch(commands, &[&group], harmonics.blocks());
    }
}

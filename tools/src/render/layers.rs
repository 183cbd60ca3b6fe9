//! Layers of a picture, which are stored beside its colours.

use super::{Drawer, Ready, Run};
use crate::failure::Failure;
use splatkit::{math::Camera, picture::Layers, scene::Scene, scene::Settings};

impl Run<'_> {
    /// Draws the layers that are asked for.
    pub(super) fn draw_layers(
        &self,
        camera: &Camera,
        drawer: &mut Drawer,
    ) -> Result<Layers, Failure> {
        let wanted = &self.output.layers;
        if wanted.is_empty() {
            return Ok(Layers::default());
        }
        let Ready { loaded, finish, .. } = self.ready;
        let inputs: Vec<_> = loaded.inputs.iter().map(|input| input.items.clone()).collect();
        let mut draw = |part: Option<&Scene>, settings: &Settings| {
            let drawn = match part {
                Some(part) => drawer.draw_scene(part, camera, settings),
                None => drawer.draw(loaded, camera, settings),
            };
            drawn.map(|(picture, _)| picture)
        };
        Ok(finish.drawing.layers(wanted, camera, (&loaded.scene, &inputs), &mut draw)?)
    }
}

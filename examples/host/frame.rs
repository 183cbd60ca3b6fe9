//! The frame of a host: its triangles before and behind splatkit's picture, in one depth buffer.

use super::{
    target::{COLOR, DEPTH, Target},
    triangles::{Corner, Triangles},
};
use splatkit::{
    Device, Renderer, Result,
    glam::DMat4,
    gpu::{Depth, Gpu, Output, Progress},
    math::View,
    picture::Picture,
    scene::{Scene, Settings},
};

/// A host, with textures of one size.
pub struct Host {
    gpu: Gpu,
    renderer: Renderer,
    triangles: Triangles,
    target: Target,
}

impl Host {
    pub fn new(
        gpu: &Gpu,
        engine: &Device,
        scene: &Scene,
        corners: &[Corner],
        size: [u32; 2],
    ) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            renderer: Renderer::new(engine, scene)?,
            triangles: Triangles::new(&gpu.device, corners, [COLOR, DEPTH]),
            target: Target::new(&gpu.device, size),
        })
    }

    /// Draws a frame with the host's matrices. `near` and `far` are the planes of the projection.
    pub fn draw(&mut self, [view, projection]: [DMat4; 2], [near, far]: [f64; 2]) -> Result<()> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        drop(self.target.pass(&mut encoder, true));

        // splatkit's colours over the background, and its depths in the host's depth buffer.
        let camera = View::from_matrices(view, projection, self.target.size)?;
        let depth = Depth::Buffer { view: self.target.depth.clone(), near, far };
        let output = Output::Textures {
            color: self.target.color.clone(),
            format: COLOR,
            depth: Some(depth),
            over: true,
        };
        let settings = Settings::new(self.target.size);
        let mut frame = self.renderer.encode(&mut encoder, &camera, &settings, output)?;
        self.gpu.queue.submit([encoder.finish()]);
        // A host with a window draws its other frames meanwhile.
        loop {
            match self.renderer.poll(&mut frame)? {
                Progress::Done(_) => break,
                Progress::NextBatch => {
                    let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
                    self.renderer.encode_next(&mut encoder, &mut frame)?;
                    self.gpu.queue.submit([encoder.finish()]);
                }
                _ => std::thread::yield_now(),
            }
        }

        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.triangles.look_from(&self.gpu.queue, projection * view);
        let mut pass = self.target.pass(&mut encoder, false);
        self.triangles.draw(&mut pass);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Reads the frame back.
    pub fn picture(&self) -> Result<Picture> {
        self.target.picture(&self.gpu)
    }
}

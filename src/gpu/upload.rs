//! Writes pictures of the CPU engine to where a host application wants them.

use crate::{
    Result,
    gpu::{
        device::{Gpu, buffers::filled_buffer, buffers::upload},
        output::Output,
        passes::present::{Pixels, Presenter, Strip},
    },
    math::View,
    picture::Picture,
    scene::Optics,
};
use glam::DVec2;

/// Uploads pictures to a host's device.
#[derive(Debug)]
pub struct Upload {
    gpu: Gpu,
    presenter: Presenter,
}

impl Upload {
    pub fn new(gpu: &Gpu) -> Self {
        Self { gpu: gpu.clone(), presenter: Presenter::default() }
    }

    /// Encodes the commands that write a picture of a view to the output.
    pub fn encode(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: &Picture,
        view: &View,
        output: &Output,
    ) -> Result<()> {
        let gpu = self.gpu.clone();
        gpu.watch(|| {
            match output {
                Output::Textures { .. } => self.encode_strips(encoder, picture, view, output),
                Output::Buffers { color, distance } => {
                    self.copy(encoder, bytemuck::cast_slice(&picture.color), color);
                    if let Some(distance) = distance {
                        let distances = distances(picture, view);
                        self.copy(encoder, bytemuck::cast_slice(&distances), distance);
                    }
                }
            }
            Ok(())
        })?
    }

    /// Writes as many rows at a time as a binding holds.
    fn encode_strips(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        picture: &Picture,
        view: &View,
        output: &Output,
    ) {
        let [width, height] = view.size;
        let most = self.gpu.binding_size() / (16 * u64::from(width));
        let rows = most.clamp(1, u64::from(height)) as u32;
        let done = upload(&self.gpu, "done", &[1; 4]);
        for first in (0..height).step_by(rows as usize) {
            let mut part = view.clone();
            part.size[1] = rows.min(height - first);
            part.center.y -= f64::from(first);
            let pixels = (first * width) as usize..((first + part.size[1]) * width) as usize;
            let colors = bytemuck::cast_slice(&picture.color[pixels.clone()]);
            let depths = bytemuck::cast_slice(&picture.depth[pixels]);
            let strip = Strip {
                view: &part,
                first_row: first,
                pixels: Pixels {
                    colors: &upload(&self.gpu, "colours", colors),
                    depths: &upload(&self.gpu, "depths", depths),
                    are_distances: false,
                    finished: (&done, 0, u32::from_ne_bytes([1; 4]), None),
                },
                optics: Optics::default(),
            };
            self.presenter.encode(&self.gpu, encoder, output, &strip);
        }
    }

    fn copy(&self, encoder: &mut wgpu::CommandEncoder, bytes: &[u8], to: &wgpu::Buffer) {
        let from = filled_buffer(&self.gpu, "picture", bytes, wgpu::BufferUsages::COPY_SRC);
        encoder.copy_buffer_to_buffer(&from, 0, to, 0, bytes.len() as u64);
    }
}

/// Returns the distances of a picture's pixels along their rays.
fn distances(picture: &Picture, view: &View) -> Vec<f32> {
    let width = picture.width as usize;
    let of_pixel = |(index, z): (usize, &f32)| {
        let at = DVec2::new((index % width) as f64 + 0.5, (index / width) as f64 + 0.5);
        z / view.ray(at).1.z as f32
    };
    picture.depth.iter().enumerate().map(of_pixel).collect()
}

//! The frame of a host: its triangles before and behind splatkit's picture, in one depth buffer.

use super::triangles::{Corner, Triangles};
use splatkit::{
    Device, Renderer, Result,
    glam::DMat4,
    gpu::{Depth, Gpu, Output, Progress},
    math::View,
    picture::Picture,
    scene::{Scene, Settings},
    wgpu,
};
use wgpu::{TextureFormat, TextureUsages};

/// A host, with textures of one size.
pub struct Host {
    gpu: Gpu,
    renderer: Renderer,
    triangles: Triangles,
    size: [u32; 2],
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
}

const BACKGROUND: wgpu::Color = wgpu::Color { r: 0.02, g: 0.03, b: 0.06, a: 1.0 };
const COLOR: TextureFormat = TextureFormat::Rgba8Unorm;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

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
            size,
            color: texture(gpu, COLOR, size),
            depth: texture(gpu, DEPTH, size),
        })
    }

    /// Draws a frame with the host's matrices. `near` and `far` are the planes of the projection.
    pub fn draw(&mut self, [view, projection]: [DMat4; 2], [near, far]: [f64; 2]) -> Result<()> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.pass(&mut encoder, [wgpu::LoadOp::Clear(BACKGROUND)], wgpu::LoadOp::Clear(1.0));

        // splatkit's colours over the background, and its depths in the host's depth buffer.
        let camera = View::from_matrices(view, projection, self.size)?;
        let depth = Depth::Buffer { view: self.depth.clone(), near, far };
        let output = Output::Textures {
            color: self.color.clone(),
            format: COLOR,
            depth: Some(depth),
            over: true,
        };
        let settings = Settings::new(self.size);
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
        let mut pass = self.pass(&mut encoder, [wgpu::LoadOp::Load], wgpu::LoadOp::Load);
        self.triangles.draw(&mut pass);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        [color]: [wgpu::LoadOp<wgpu::Color>; 1],
        depth: wgpu::LoadOp<f32>,
    ) -> wgpu::RenderPass<'a> {
        let store = wgpu::StoreOp::Store;
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("host"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: color, store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: depth, store }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        })
    }

    /// Reads the frame back.
    pub fn picture(&self) -> Result<Picture> {
        let [width, height] = self.size;
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("host"),
            size: u64::from(row * height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        };
        let texture = self.color.texture();
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &staging, layout },
            texture.size(),
        );
        self.gpu.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |_| ());
        self.gpu.wait()?;
        let bytes = staging.get_mapped_range(..).expect("mapped").to_vec();
        let rows = bytes.chunks(row as usize).map(|row| &row[..4 * width as usize]);
        let pixels = rows.flat_map(|row| row.chunks_exact(4));
        let color = pixels.map(|p| [p[0], p[1], p[2], p[3]].map(|part| f32::from(part) / 255.0));
        let depth = vec![f32::INFINITY; (width * height) as usize];
        Ok(Picture { width, height, color: color.collect(), depth })
    }
}

fn texture(gpu: &Gpu, format: TextureFormat, [width, height]: [u32; 2]) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("host"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

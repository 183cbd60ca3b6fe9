//! The textures that a host draws to: made, drawn to in a pass, and read back.

use splatkit::{Result, gpu::Gpu, picture::Picture, wgpu};
use wgpu::{TextureFormat, TextureUsages};

pub const COLOR: TextureFormat = TextureFormat::Rgba8Unorm;
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;

const BACKGROUND: wgpu::Color = wgpu::Color { r: 0.02, g: 0.03, b: 0.06, a: 1.0 };

/// Colours, and a depth buffer, of one size.
pub struct Target {
    pub size: [u32; 2],
    pub color: wgpu::TextureView,
    pub depth: wgpu::TextureView,
}

impl Target {
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        Self { size, color: texture(device, COLOR, size), depth: texture(device, DEPTH, size) }
    }

    /// Begins a pass over the background, or over what was drawn before.
    pub fn pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        is_first: bool,
    ) -> wgpu::RenderPass<'a> {
        let (color, depth) = match is_first {
            true => (wgpu::LoadOp::Clear(BACKGROUND), wgpu::LoadOp::Clear(1.0)),
            false => (wgpu::LoadOp::Load, wgpu::LoadOp::Load),
        };
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

    /// Reads the colours back.
    pub fn picture(&self, gpu: &Gpu) -> Result<Picture> {
        let [width, height] = self.size;
        let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("host"),
            size: u64::from(row * height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
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
        gpu.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |_| ());
        gpu.wait()?;
        let bytes = staging.get_mapped_range(..).expect("mapped").to_vec();
        let rows = bytes.chunks(row as usize).map(|row| &row[..4 * width as usize]);
        let pixels = rows.flat_map(|row| row.chunks_exact(4));
        let color = pixels.map(|p| [p[0], p[1], p[2], p[3]].map(|part| f32::from(part) / 255.0));
        let depth = vec![f32::INFINITY; (width * height) as usize];
        Ok(Picture { width, height, color: color.collect(), depth })
    }
}

fn texture(
    device: &wgpu::Device,
    format: TextureFormat,
    [width, height]: [u32; 2],
) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
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

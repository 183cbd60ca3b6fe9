//! What keeps light away, on the GPU (shaders/shared/lamps.wgsl).

use super::{device::Gpu, uniforms::Frame};
use crate::plan::lamps::{Lamps, Openness, ShadowMap, Shadows};
use std::sync::Arc;

/// The nodes of the light from all sides, and the map of the key lamp's light.
#[derive(Debug)]
pub struct ShadowTextures {
    pub shadows: Shadows,
    pub textures: [wgpu::TextureView; 2],
}

/// Whether two are one.
fn are_one<T>(one: Option<&Arc<T>>, other: Option<&Arc<T>>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (one, other) => one.is_none() && other.is_none(),
    }
}

impl ShadowTextures {
    /// Whether these are on the device.
    pub fn hold(&self, Shadows { open, key }: &Shadows) -> bool {
        are_one(self.shadows.open.as_ref(), open.as_ref())
            && are_one(self.shadows.key.as_ref(), key.as_ref())
    }

    /// Uploads what keeps light away. What is missing lets all light in.
    pub fn new(gpu: &Gpu, shadows: &Shadows) -> Self {
        let open = match &shadows.open {
            Some(open) => open_texture(gpu, open),
            None => {
                let nodes = [[0.0f32, 0.0, 0.0, 1.0]; 8];
                let format = wgpu::TextureFormat::Rgba32Uint;
                texture(gpu, (format, 16), [2; 3], bytemuck::cast_slice(&nodes))
            }
        };
        let key = match &shadows.key {
            Some(map) => key_texture(gpu, map),
            None => texture(gpu, (wgpu::TextureFormat::R8Uint, 1), [2; 3], &[255; 8]),
        };
        Self { shadows: shadows.clone(), textures: [open, key] }
    }
}

fn open_texture(gpu: &Gpu, open: &Openness) -> wgpu::TextureView {
    let size = open.place.size.map(|side| side as u32);
    let format = wgpu::TextureFormat::Rgba32Uint;
    texture(gpu, (format, 16), size, bytemuck::cast_slice(&open.nodes))
}

fn key_texture(gpu: &Gpu, map: &ShadowMap) -> wgpu::TextureView {
    let size = map.view.size;
    texture(gpu, (wgpu::TextureFormat::R8Uint, 1), [size + 1, size, size], &map.light)
}

/// Uploads words of a number of bytes.
fn texture(
    gpu: &Gpu,
    (format, each): (wgpu::TextureFormat, u32),
    [width, height, depth]: [u32; 3],
    words: &[u8],
) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: depth };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shadows"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture: &texture,
            mip_level: 0,
            origin: wgpu::Origin3d::ZERO,
            aspect: wgpu::TextureAspect::All,
        },
        words,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(width * each),
            rows_per_image: Some(height),
        },
        size,
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

impl Frame {
    /// Packs the lights.
    pub fn set_lamps(&mut self, lamps: &Lamps) {
        let [x, y, z] = lamps.key_direction;
        self.lamp_shares = [lamps.head, lamps.key, lamps.sky, 0.0];
        self.lamp_steps = [lamps.open_step, lamps.key_step, 0.0, 0.0];
        self.key_direction = [x, y, z, 0.0];
        let [x, y, z] = lamps.sky_side;
        self.sky_side = [x, y, z, 0.0];
        [self.open_x, self.open_y, self.open_z] = lamps.to_open;
        [self.key_x, self.key_y, self.key_z] = lamps.to_key;
    }
}

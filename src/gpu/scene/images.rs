//! The images that facets show, on the GPU (shaders/shared/images.wgsl).

use crate::{
    facet::{FacetSet, Image, TextureCoordinates},
    gpu::device::Gpu,
    scene::{Item, Scene},
};
use std::{collections::HashMap, sync::Arc};

/// Most texels along a row of a texture.
const WIDEST: u32 = 8192;

/// Words of four of what a facet shows.
const SHOWN_WORDS: usize = 3;

/// The images of a scene, and what facets show of them.
#[derive(Debug)]
pub struct Images {
    /// The texels, and what facets show.
    pub textures: [wgpu::TextureView; 2],
    pub bytes: u64,
    /// For each item with images, the number of its first facet among those of all such items.
    firsts: HashMap<usize, u32>,
}

impl Images {
    /// Returns the images of a scene; `None` if there are none, or more than the device's textures
    /// hold.
    pub fn of(gpu: &Gpu, scene: &Scene) -> Option<Self> {
        let mut firsts = HashMap::new();
        let (mut texels, mut facets): (Vec<[u8; 4]>, Vec<[u32; 4]>) = (Vec::new(), Vec::new());
        for (item, set) in sets(scene) {
            if texels.len() as u64 + texels_of(set) > u64::from(side(gpu)).pow(2) {
                return None;
            }
            let first = u32::try_from(facets.len() / SHOWN_WORDS).ok()?;
            firsts.insert(item, first);
            let images: Vec<[u32; 4]> =
                set.images.iter().map(|image| add(image, &mut texels)).collect();
            facets.extend(set.texture_coordinates.iter().flat_map(|facet| words(facet, &images)));
        }
        if facets.is_empty() {
            return None;
        }
        let (texels, texel_bytes) =
            texture(gpu, wgpu::TextureFormat::R32Uint, bytemuck::cast_slice(&texels))?;
        let (facets, facet_bytes) =
            texture(gpu, wgpu::TextureFormat::Rgba32Uint, bytemuck::cast_slice(&facets))?;
        Some(Self { textures: [texels, facets], bytes: texel_bytes + facet_bytes, firsts })
    }

    /// Returns the number of the first facet of an item with images.
    pub fn first(&self, item: usize) -> Option<u32> {
        self.firsts.get(&item).copied()
    }

    /// Returns the bytes that the images of a scene take.
    pub fn bytes_of(scene: &Scene) -> u64 {
        let of_set = |set: &Arc<FacetSet>| {
            4 * texels_of(set) + (16 * SHOWN_WORDS * set.texture_coordinates.len()) as u64
        };
        sets(scene).map(|(_, set)| of_set(set)).sum()
    }
}

/// Returns the sets of facets that show images, with the numbers of their items.
fn sets(scene: &Scene) -> impl Iterator<Item = (usize, &Arc<FacetSet>)> {
    scene.items.iter().enumerate().filter_map(|(number, item)| match item {
        Item::Facets(set) if !set.texture_coordinates.is_empty() => Some((number, set)),
        _ => None,
    })
}

fn texels_of(set: &FacetSet) -> u64 {
    let levels = set.images.iter().flat_map(|image| image.levels());
    levels.map(|level| level.texels.len() as u64).sum()
}

fn side(gpu: &Gpu) -> u32 {
    gpu.device.limits().max_texture_dimension_2d.min(WIDEST)
}

/// Adds the levels of an image. Returns its first texel, its width and height, and the number of
/// its coarser levels.
fn add(image: &Image, texels: &mut Vec<[u8; 4]>) -> [u32; 4] {
    let base = image.texture();
    let is_whole = base.texels.len() as u64 == u64::from(base.width) * u64::from(base.height);
    if !is_whole || base.texels.is_empty() {
        return [0; 4];
    }
    let first = texels.len() as u32;
    let mut levels = 0;
    for level in image.levels() {
        texels.extend_from_slice(&level.texels);
        levels += 1;
    }
    [first, base.width, base.height, levels - 1]
}

/// Returns what a facet shows, as the shader reads it.
fn words(facet: &TextureCoordinates, images: &[[u32; 4]]) -> [[u32; 4]; SHOWN_WORDS] {
    let [a, b, c] = facet.places.map(|place| place.to_array().map(f32::to_bits));
    let image = images.get(facet.image as usize).copied().unwrap_or_default();
    [[a[0], a[1], b[0], b[1]], [c[0], c[1], 0, 0], image]
}

/// Uploads words as a texture, row by row. Returns it and its bytes; `None` if they are too many.
fn texture(
    gpu: &Gpu,
    format: wgpu::TextureFormat,
    words: &[u8],
) -> Option<(wgpu::TextureView, u64)> {
    let each = format.block_copy_size(None)?;
    let count = (words.len() as u32 / each).max(1);
    let width = count.min(side(gpu));
    let height = count.div_ceil(width);
    if height > gpu.device.limits().max_texture_dimension_2d {
        return None;
    }
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("images"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let row = (width * each) as usize;
    let write = |first: u32, rows: u32, bytes: &[u8]| {
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: first, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(width * each),
                rows_per_image: Some(rows),
            },
            wgpu::Extent3d { height: rows, ..size },
        );
    };
    let whole = words.len() / row;
    if whole > 0 {
        write(0, whole as u32, &words[..whole * row]);
    }
    let mut rest = words[whole * row..].to_vec();
    if !rest.is_empty() {
        rest.resize(row, 0);
        write(whole as u32, 1, &rest);
    }
    Some((texture.create_view(&Default::default()), row as u64 * u64::from(height)))
}

//! The field of a gathered lattice: its samples as a texture, and where it may be visible.

use crate::{
    gpu::{
        device::{
            Gpu, MOST_BUFFERS,
            buffers::{buffer, filled_buffer},
        },
        uniforms::FrameField,
        variant::Variant,
    },
    math::{Kernel, Sheets},
    parallel::prelude::*,
    plan::{
        field,
        gathering::unsuited_kernel,
        tables::Values,
        visible::{BLOCK, VisibleBlocks, field_ranges},
        weighting::{MASK_DEVIATION, deviation},
    },
    scene::{Item, Scene, Settings},
    volume::{Arrangement, Scalar, Volume, label_shares},
};
use std::sync::Arc;
use wgpu::BufferUsages as Usage;

/// Maximum bytes of samples that are laid out one word each.
const MOST_FOURS: u64 = 512 << 20;

/// The number of that layout (`SAMPLE_FOUR` in value.wgsl).
pub const FOUR: u32 = 5;

/// The layout of the shares of labels, as labels.wgsl reads them: that of bytes.
const SHARES: u32 = 0;

/// Capacity behind the samples' bits: a bit for every sheet and tile of a picture (`MOST_BINS` in
/// variant/mod.rs), and the tables.
const TAIL_BYTES: u64 = 64 << 20;

/// Returns why the engine can't gather a volume, whatever the settings.
pub fn unsuited(volume: &Volume, kernel: &Kernel) -> Option<&'static str> {
    if volume.is_label_map() {
        return None;
    }
    if volume.lattice.arrangement != Arrangement::Cartesian {
        return Some("body-centred and rectilinear lattices");
    }
    if volume.coefficients.is_some() && kernel.as_tensor().is_none() {
        return Some("sharp volumes of radial kernels");
    }
    unsuited_kernel(kernel)
}

/// Returns the volume that is gathered, or why no device can gather a scene's field with these
/// settings.
pub fn gathered_volume<'a>(
    scene: &'a Scene,
    settings: &Settings,
    sheets: &Sheets,
) -> Result<&'a Volume, &'static str> {
    let parts = crate::plan::gathering::parts(&scene.items, sheets, None);
    if let Some(what) = crate::plan::gathering::obstacle(&scene.items, settings, parts, unsuited) {
        return Err(what);
    }
    if parts > 1 {
        return Err("sheets thicker than two samples");
    }
    let volume = scene
        .items
        .iter()
        .find_map(|item| if let Item::Volume(volume, ..) = item { Some(volume) } else { None });
    volume.map(Arc::as_ref).ok_or("volumes in bricks")
}

/// Returns why the engine can't gather a scene's field with these settings, or `None` if it can.
pub fn obstacle(
    scene: &Scene,
    settings: &Settings,
    sheets: &Sheets,
    gpu: &Gpu,
) -> Option<&'static str> {
    let volume = match gathered_volume(scene, settings, sheets) {
        Ok(volume) => volume,
        Err(what) => return Some(what),
    };
    beyond_limits(scene, volume, gpu)
}

/// Returns why a device can't gather a volume of a scene, or `None` if it can.
fn beyond_limits(scene: &Scene, volume: &Volume, gpu: &Gpu) -> Option<&'static str> {
    let limits = gpu.device.limits();
    if texture_size(volume.lattice.dims, kind_of(volume.samples.scalar()))
        .iter()
        .any(|side| *side > limits.max_texture_dimension_3d as usize)
    {
        return Some("a volume with more samples along an axis than the device's textures have");
    }
    // A bit for each sample, and the data of tiles and of the transfer function.
    if bit_words(volume.lattice.dims) * 4 + TAIL_BYTES > gpu.binding_size() {
        return Some("a volume larger than the device's bindings allow");
    }
    if scene.items.len() > 1 && limits.max_storage_buffers_per_shader_stage < MOST_BUFFERS {
        return Some("a volume among surfaces on a device whose shaders bind eight buffers");
    }
    None
}

/// Returns why a device can't draw a label map of a scene, which is always gathered; `None` if it
/// can.
pub fn label_obstacle(scene: &Scene, gpu: &Gpu) -> Option<&'static str> {
    let labels = scene.items.iter().find_map(|item| match item {
        Item::Volume(volume, ..) if volume.is_label_map() => Some(volume),
        _ => None,
    });
    labels.and_then(|volume| beyond_limits(scene, volume, gpu))
}

/// Returns the type of samples as value.wgsl numbers it.
pub fn kind_of(scalar: Scalar) -> u32 {
    match scalar {
        Scalar::U8 => 0,
        Scalar::U16 => 1,
        Scalar::I16 => 2,
        Scalar::I32 => 3,
        Scalar::F32 => 4,
    }
}

/// Returns the number of texels along the axes. Rows of samples are packed in words, with the words
/// that the taps of a row may read behind its end.
fn texture_size([width, height, depth]: [usize; 3], kind: u32) -> [usize; 3] {
    let words = match kind {
        0 => width.div_ceil(4) + 1,
        1 | 2 => width.div_ceil(2) + 2,
        FOUR => width,
        _ => width.max(4),
    };
    [words, height, depth]
}

/// Returns how the samples of a volume are laid out. Usually that is their own type. Bytes may take
/// a word each, with the three bytes behind them, so that one word contains a row of a kernel.
/// Mesa's software driver takes a third less time with that layout.
fn layout(gpu: &Gpu, volume: &Volume) -> u32 {
    let kind = kind_of(volume.samples.scalar());
    let most = gpu.device.limits().max_texture_dimension_3d as usize;
    let fits = 4 * volume.lattice.len() as u64 <= MOST_FOURS && volume.lattice.dims[0] <= most;
    if kind == 0 && gpu.is_software() && fits { FOUR } else { kind }
}

/// Returns the bytes of a volume's textures: its samples, and the shares of its labels.
pub fn texture_bytes(gpu: &Gpu, volume: &Volume) -> u64 {
    let bytes = |kind| {
        let size = texture_size(volume.lattice.dims, kind);
        size.iter().fold(4, |bytes, side| bytes * *side as u64)
    };
    bytes(layout(gpu, volume)) + if volume.is_label_map() { bytes(SHARES) } else { 0 }
}

/// Writes a row of samples as a row of texels.
fn write_row(from: &[u8], kind: u32, to: &mut [u8]) {
    if kind != FOUR {
        to[..from.len()].copy_from_slice(from);
        return;
    }
    for (index, word) in to.chunks_exact_mut(4).enumerate() {
        let samples = &from[index..(index + 4).min(from.len())];
        word[..samples.len()].copy_from_slice(samples);
    }
}

/// Makes a texture of samples of a kind, given as bytes in the order of the lattice.
fn texture(gpu: &Gpu, dims: [usize; 3], (kind, bytes): (u32, &[u8])) -> wgpu::Texture {
    /// Approximate bytes of one copy.
    const COPIED: usize = 16 << 20;
    let [words, rows, slices] = texture_size(dims, kind);
    let [width, height, depth] = [words, rows, slices].map(|side| side as u32);
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("samples"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let row = bytes.len() / (rows * slices);
    let (to_row, to_slice) = (4 * words, 4 * words * rows);
    let each = (COPIED / to_slice).max(1);
    for (first, samples) in (0..depth).step_by(each).zip(bytes.chunks(row * rows * each)) {
        let mut packed = vec![0u8; samples.len() / row * to_row];
        packed
            .par_chunks_mut(to_row)
            .zip(samples.par_chunks(row))
            .for_each(|(to, from)| write_row(from, kind, to));
        let layers = (packed.len() / to_slice) as u32;
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: first },
                aspect: wgpu::TextureAspect::All,
            },
            &packed,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(to_row as u32),
                rows_per_image: Some(height),
            },
            wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        );
    }
    texture
}

/// The data that the engine keeps to gather a lattice.
#[derive(Debug)]
pub struct Field {
    volume: Arc<Volume>,
    /// The kernel's standard deviation in steps.
    sigma: f64,
    /// The smallest and the largest value around each sample.
    ranges: Vec<[u8; 2]>,
    /// The samples, rows packed in words, and of a label map the shares of each sample's own label
    /// around it.
    textures: Vec<wgpu::TextureView>,
    texture_bytes: u64,
    /// The layout of the samples (`SAMPLE_KIND` in field_lattice.wgsl).
    pub kind: u32,
    /// Where the field may be visible, and the table of visible ranges that this holds for.
    visible: Option<([u16; 256], VisibleBlocks)>,
    /// `visibility` of field_lattice.wgsl.
    buffer: wgpu::Buffer,
    /// Whether the buffer contains the samples' bits.
    has_bits: bool,
    /// The visible entries that the buffer contains.
    visible_before: Vec<u32>,
    /// The sheets of each dispatch of gather, and what they were made for: the number of sheets,
    /// the sheets of a dispatch, the tiles.
    windows: Option<([u32; 3], Vec<wgpu::Buffer>)>,
}

/// The data that the passes of a picture need.
#[derive(Debug)]
pub struct Gathered {
    /// The samples, and the shares of labels.
    pub textures: Vec<wgpu::TextureView>,
    pub visibility: wgpu::Buffer,
    /// The sheets of each dispatch of gather (`Pass` in frame.wgsl).
    pub windows: Vec<wgpu::Buffer>,
    pub tiles: u32,
    /// Words of the marks of all tiles.
    pub mark_words: u32,
}

impl Gathered {
    /// Returns the number of workgroups, in all dispatches, that have a tile.
    pub fn workgroups(&self) -> u32 {
        self.tiles * self.windows.len() as u32
    }
}

impl Field {
    pub fn new(gpu: &Gpu, volume: &Arc<Volume>, kernel: &Kernel) -> Self {
        let kind = layout(gpu, volume);
        let dims = volume.lattice.dims;
        let mut textures = vec![texture(gpu, dims, (kind, volume.samples.bytes()))];
        let mut sigma = deviation(kernel).unwrap_or(1.0);
        if volume.is_label_map() {
            textures.push(texture(gpu, dims, (SHARES, &label_shares(volume))));
            sigma = MASK_DEVIATION;
        }
        let view_of_all = wgpu::TextureViewDescriptor::default();
        let textures = textures.iter().map(|texture| texture.create_view(&view_of_all)).collect();
        Self {
            kind,
            volume: volume.clone(),
            sigma,
            ranges: field_ranges(volume, kernel),
            textures,
            texture_bytes: texture_bytes(gpu, volume),
            visible: None,
            buffer: buffer(gpu, "shown", 0, Usage::STORAGE),
            has_bits: false,
            visible_before: Vec::new(),
            windows: None,
        }
    }

    /// Returns the bytes of GPU memory.
    pub fn bytes(&self) -> u64 {
        self.texture_bytes + self.buffer.size()
    }

    /// Finds the samples around which the transfer function may show something. `first` is the
    /// result of [`first_visible`](crate::volume::reach::first_visible).
    pub fn show(&mut self, first: &[u16; 256]) {
        if self.visible.as_ref().is_none_or(|(table, _)| table != first) {
            self.visible =
                Some((*first, VisibleBlocks::new(self.volume.lattice.dims, &self.ranges, first)));
            self.has_bits = false;
        }
    }

    /// Brings what a picture with this number of tiles needs, and packs where it lies. `field` is
    /// the field in the view, and `table` its entries.
    pub fn gathered(
        &mut self,
        gpu: &Gpu,
        (sheets, tiles): (&Sheets, u32),
        variant: &Variant,
        (table, field): (&[[f32; 4]], &field::Field),
        packed: &mut FrameField,
    ) -> Option<Gathered> {
        let (_, visible) = self.visible.as_ref()?;
        // Shaders number sheets from 1.
        let words = (sheets.count() as u32 + 1).div_ceil(32);
        let visible_before = visible_before(variant, table, field);
        let bits = bit_words(self.volume.lattice.dims) as u32;
        let marks = bits + visible_before.len() as u32;
        let bytes = 4 * (u64::from(marks) + u64::from(tiles) * u64::from(words));
        if self.buffer.size() < bytes {
            self.buffer = buffer(gpu, "shown", bytes, Usage::STORAGE);
            self.has_bits = false;
            self.visible_before.clear();
        }
        if !std::mem::replace(&mut self.has_bits, true) {
            gpu.queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&visible.words));
        }
        if self.visible_before != visible_before {
            let at = 4 * u64::from(bits);
            gpu.queue.write_buffer(&self.buffer, at, bytemuck::cast_slice(&visible_before));
            self.visible_before = visible_before;
        }
        let [width, height, depth] = self.volume.lattice.dims.map(|n| n as u32);
        packed.lattice = [width, height, depth, 0];
        let per_variance = 1.0 / (self.sigma * self.sigma);
        let weight = |steps: f64| (-0.5 * steps * steps * per_variance).exp() as f32;
        packed.taps = [per_variance as f32, weight(1.0), weight(2.0), 0.0];
        packed.visibility = [bits, marks, words, 0];
        Some(Gathered {
            textures: self.textures.clone(),
            visibility: self.buffer.clone(),
            windows: self.windows(gpu, [sheets.count() as u32, variant.gathered_sheets(), tiles]),
            tiles,
            mark_words: tiles * words,
        })
    }

    /// Returns the sheets of each dispatch of gather.
    fn windows(&mut self, gpu: &Gpu, request: [u32; 3]) -> Vec<wgpu::Buffer> {
        if let Some((cached, windows)) = &self.windows
            && *cached == request
        {
            return windows.clone();
        }
        let [sheets, window, tiles] = request;
        let last = sheets + 1;
        let windows = (1..last).step_by(window as usize).map(|first| {
            let end = first.saturating_add(window).min(last);
            let pass = [first, end, 0, 0, tiles, 0, 0, 0];
            filled_buffer(gpu, "window", bytemuck::cast_slice(&pass), Usage::UNIFORM)
        });
        let windows: Vec<_> = windows.collect();
        self.windows = Some((request, windows.clone()));
        windows
    }
}

/// Returns the words of the samples' bits: two for each block.
fn bit_words(dims: [usize; 3]) -> u64 {
    2 * dims.iter().map(|n| n.div_ceil(BLOCK) as u64).product::<u64>()
}

/// Returns, for each entry of the transfer function's table and for one behind the last, how many
/// entries before it show something.
fn visible_before(variant: &Variant, table: &[[f32; 4]], field: &field::Field) -> Vec<u32> {
    let Values { last, place, .. } = field.values;
    let mut shows: Vec<bool> = table[..=last as usize].iter().map(|entry| entry[3] > 0.0).collect();
    for surface in &field.isosurfaces[..variant.isosurfaces as usize] {
        let at = (surface.value + place).clamp(0.0, last) as usize;
        let end = (at + 2).min(shows.len());
        shows[at..end].fill(true);
    }
    let sums = shows.iter().scan(0, |sum, shows| {
        *sum += u32::from(*shows);
        Some(*sum)
    });
    std::iter::once(0).chain(sums).collect()
}

//! A scene on the GPU: every item cut into chunks that fit a binding.

use super::{
    Gpu,
    select::Selection,
    uniforms::{ISOTROPIC, RADIANCE, Source},
};
use crate::{
    Error, Result,
    math::{Kernel, View},
    scene::{Item, Scene},
    splat::{Splat, SplatSet},
    volume::{Samples, TransferFunction, Volume},
};
use std::sync::Arc;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Candidates that one invocation handles (`RUN` in frame.wgsl) and those of its workgroup of 64.
pub const RUN: u32 = 16;
pub const WORKGROUP_CANDIDATES: u32 = 64 * RUN;

/// Voxels of a chunk at most, so that a list of all of them, and their number, fit a binding of 128 MiB.
const CHUNK_VOXELS: u64 = (1 << 25) - 1;

/// What the candidates of a chunk are made from.
#[derive(Debug)]
pub enum Origin {
    Splats { set: Arc<SplatSet>, radiance: bool },
    Lattice { volume: Arc<Volume>, kernel: Kernel, first_slice: u32, selection: Selection },
}

/// A part of an item that fits a binding.
#[derive(Debug)]
pub struct Chunk {
    pub origin: Origin,
    /// Splats (48 bytes each) or samples in their own type.
    pub data: wgpu::Buffer,
    pub uniform: wgpu::Buffer,
    /// The sheets and bands that every candidate meets (`pack_span` in spans.wgsl).
    pub spans: wgpu::Buffer,
    /// Splats, or voxels before selection.
    pub count: u32,
    pub first_run: u32,
}

/// A scene whose splats and samples lie on the GPU. Cameras, settings and transfer functions may change between frames.
#[derive(Debug)]
pub struct PreparedScene {
    pub(super) scene: Scene,
    pub(super) chunks: Vec<Chunk>,
    /// Runs of candidates in all chunks.
    pub(super) runs: u32,
    /// Bytes of GPU memory that the scene holds.
    pub(super) bytes: u64,
}

impl PreparedScene {
    /// Uploads a scene. The scene's splats and samples are shared with the caller's, not copied.
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        scene.validate()?;
        let mut prepared = Self { scene: scene.clone(), chunks: Vec::new(), runs: 0, bytes: 0 };
        for item in &scene.items {
            match item {
                Item::Radiance(set) => prepared.add_splats(gpu, set, true),
                Item::Scalar(set, _) => prepared.add_splats(gpu, set, false),
                Item::Volume(volume, kernel, _) => prepared.add_volume(gpu, volume, kernel.clone())?,
            }
        }
        Ok(prepared)
    }

    /// Shows the scene's volume or sample set by another transfer function. Nothing is rebuilt on the CPU.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        for item in &mut self.scene.items {
            if let Item::Scalar(_, shown) | Item::Volume(_, _, shown) = item {
                *shown = transfer.clone();
            }
        }
        for chunk in &mut self.chunks {
            if let Origin::Lattice { selection, .. } = &mut chunk.origin {
                selection.outdated = true;
            }
        }
    }

    fn add_splats(&mut self, gpu: &Gpu, set: &Arc<SplatSet>, radiance: bool) {
        let most = (gpu.binding_size() / size_of::<Splat>() as u64) as usize;
        for splats in set.splats.chunks(most) {
            let origin = Origin::Splats { set: set.clone(), radiance };
            self.add_chunk(gpu, origin, bytemuck::cast_slice(splats), splats.len() as u32);
        }
    }

    fn add_volume(&mut self, gpu: &Gpu, volume: &Arc<Volume>, kernel: Kernel) -> Result<()> {
        let [width, height, depth] = volume.lattice.dims;
        let slice = (width * height) as u64;
        let bytes = volume.samples.sample_bytes() as u64;
        let voxels = CHUNK_VOXELS.min(gpu.binding_size() / bytes.max(4));
        let slices = (voxels / slice) as usize;
        if slices == 0 {
            return Err(Error::Argument(format!(
                "one slice of the volume holds {slice} samples, more than the {voxels} that fit a binding of {}",
                gpu.info.name
            )));
        }
        let ranges = volume.drawn_ranges(&kernel);
        for first in (0..depth).step_by(slices) {
            let part = first * slice as usize..(first + slices).min(depth) * slice as usize;
            let selection = Selection::new(gpu, &ranges[part.clone()]);
            self.bytes += selection.bytes();
            let origin = Origin::Lattice {
                volume: volume.clone(),
                kernel: kernel.clone(),
                first_slice: first as u32,
                selection,
            };
            let count = part.len() as u32;
            let bytes = match &volume.samples {
                Samples::U8(v) => bytemuck::cast_slice(&v[part]),
                Samples::U16(v) => bytemuck::cast_slice(&v[part]),
                Samples::I16(v) => bytemuck::cast_slice(&v[part]),
                Samples::I32(v) => bytemuck::cast_slice(&v[part]),
                Samples::F32(v) => bytemuck::cast_slice(&v[part]),
            };
            self.add_chunk(gpu, origin, bytes, count);
        }
        Ok(())
    }

    fn add_chunk(&mut self, gpu: &Gpu, origin: Origin, bytes: &[u8], count: u32) {
        let data = upload(gpu, "chunk", bytes);
        let uniform = super::buffer(gpu, "source", size_of::<Source>() as u64, wgpu::BufferUsages::UNIFORM);
        let spans = super::buffer(gpu, "spans", 4 * u64::from(count), wgpu::BufferUsages::STORAGE);
        self.bytes += data.size() + spans.size();
        self.chunks.push(Chunk { origin, data, uniform, spans, count, first_run: self.runs });
        self.runs += count.div_ceil(RUN);
    }
}

impl Chunk {
    /// The chunk's uniform for a view.
    pub fn source(&self, view: &View, isotropic: bool) -> Source {
        let source = match &self.origin {
            Origin::Splats { set, radiance } => Source::of_splats(view, set, *radiance),
            Origin::Lattice { volume, kernel, first_slice, .. } => {
                let [width, height, _] = volume.lattice.dims.map(|n| n as u32);
                let kind = match volume.samples {
                    Samples::U8(_) => 0,
                    Samples::U16(_) => 1,
                    Samples::I16(_) => 2,
                    Samples::I32(_) => 3,
                    Samples::F32(_) => 4,
                };
                Source {
                    lattice: [width, height, *first_slice, kind],
                    ..Source::of_lattice(view, &volume.lattice, kernel.unit(), kernel.extent, isotropic)
                }
            }
        };
        debug_assert!(source.flags & (RADIANCE | ISOTROPIC) == source.flags);
        Source { count: self.count, first_run: self.first_run, ..source }
    }
}

/// A read-only storage buffer of some bytes, padded to whole words.
pub fn upload(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE;
    if bytes.len().is_multiple_of(4) && !bytes.is_empty() {
        return gpu.device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents: bytes, usage });
    }
    let mut padded = bytes.to_vec();
    padded.resize(bytes.len().max(1).next_multiple_of(4), 0);
    gpu.device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents: &padded, usage })
}

//! The harmonics of trained Gaussians, from which `recolor` makes the colours that an eye sees.

use crate::{
    gaussians::{Eye, Gaussians, harmonics::terms},
    gpu::device::{
        Gpu,
        buffers::{buffer, upload},
    },
    parallel::prelude::*,
};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Gaussians of a block, which a workgroup colours.
const BLOCK: usize = 64;

/// The harmonics of a chunk's Gaussians.
#[derive(Debug)]
pub struct Harmonics {
    /// The origin of the centres.
    origin: DVec3,
    count: u32,
    terms: u32,
    /// By blocks of Gaussians, number by number.
    pub numbers: wgpu::Buffer,
    pub eye: wgpu::Buffer,
}

/// The uniform of the pass (`Eye` in recolor.wgsl).
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct GpuEye {
    pub place: [f32; 4],
    pub count: u32,
    pub terms: u32,
    pub unused: [u32; 2],
}

impl Harmonics {
    /// Uploads the harmonics of some of the Gaussians, in this order.
    pub fn new(gpu: &Gpu, set: &Gaussians, order: &[u32]) -> Self {
        let each = 3 * terms(set.degree);
        let mut numbers = vec![0f32; order.len().div_ceil(BLOCK) * BLOCK * each];
        let fill = |(block, order): (&mut [f32], &[u32])| {
            for (lane, &index) in order.iter().enumerate() {
                let coefficients = set.harmonics_of(index as usize).as_flattened();
                for (number, value) in coefficients.iter().enumerate() {
                    block[number * BLOCK + lane] = *value;
                }
            }
        };
        numbers.par_chunks_mut(BLOCK * each).zip(order.par_chunks(BLOCK)).for_each(fill);
        Self {
            origin: set.origin,
            count: order.len() as u32,
            terms: terms(set.degree) as u32,
            numbers: upload(gpu, "harmonics", bytemuck::cast_slice(&numbers)),
            eye: buffer(gpu, "eye", size_of::<GpuEye>() as u64, wgpu::BufferUsages::UNIFORM),
        }
    }

    /// Returns the bytes of one Gaussian on the device; none if its colour is the same from
    /// everywhere.
    pub fn bytes_of(set: &Gaussians) -> u64 {
        if set.depends_on_eye() { 12 * terms(set.degree) as u64 } else { 0 }
    }

    /// Returns the bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.numbers.size()
    }

    /// Writes the eye that sees the colours.
    pub fn set_eye(&self, gpu: &Gpu, eye: Eye) {
        let (at, w) = match eye {
            Eye::At(place) => (place - self.origin, 1.0),
            Eye::Along(direction) => (direction, 0.0),
        };
        let place = at.as_vec3().extend(w).to_array();
        let uniform = GpuEye { place, count: self.count, terms: self.terms, unused: [0; 2] };
        gpu.queue.write_buffer(&self.eye, 0, bytemuck::bytes_of(&uniform));
    }

    /// Returns the number of blocks.
    pub fn blocks(&self) -> u32 {
        self.count.div_ceil(BLOCK as u32)
    }
}

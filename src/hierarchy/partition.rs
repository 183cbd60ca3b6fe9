//! Splits many splats into blocks of neighbours along the space-filling curve of Morton (1966).

use crate::{parallel::prelude::*, splat::Splat};
use glam::{DVec3, Vec3};
use rdst::RadixSort;

/// Bits of a Morton key on each axis.
const BITS: u32 = 10;
/// Bits of a fine key on each axis.
pub(crate) const FINE_BITS: u32 = 21;

/// The cube around some points in which their keys are computed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cube {
    low: Vec3,
    scale: f32,
}

impl Cube {
    pub fn around(low: Vec3, high: Vec3) -> Self {
        let edge = (high - low).max_element().max(f32::MIN_POSITIVE);
        Self { low, scale: (1 << BITS) as f32 / edge }
    }

    /// Returns the Morton key of a position: ten bits of each axis, interleaved.
    pub fn key(&self, place: Vec3) -> u32 {
        let cell = ((place - self.low) * self.scale)
            .clamp(Vec3::ZERO, Vec3::splat(((1 << BITS) - 1) as f32));
        spread(cell.x as u32) | spread(cell.y as u32) << 1 | spread(cell.z as u32) << 2
    }

    /// Returns the Morton key with [`FINE_BITS`] bits of each axis.
    pub fn fine_key(&self, place: Vec3) -> u64 {
        let scale = f64::from(self.scale) * f64::from(1 << (FINE_BITS - BITS));
        let cell = (place - self.low).as_dvec3() * scale;
        let most = f64::from((1 << FINE_BITS) - 1);
        fine_key_of(cell.to_array().map(|cell| cell.clamp(0.0, most) as u32))
    }

    /// Returns the corners of the cell of a fine key and all keys that differ from it in the lowest
    /// `below` bits only, a multiple of three. They are rounded outward.
    pub fn cell(&self, key: u64, below: u32) -> [Vec3; 2] {
        let step = f64::from(self.edge()) / f64::from(1 << FINE_BITS);
        let low = self.low.as_dvec3() + DVec3::from(fine_cell(key).map(f64::from)) * step;
        let high = low + step * f64::from(1 << (below / 3));
        let margin = DVec3::splat(f64::from(self.edge()) * 1e-6);
        [(low - margin).as_vec3(), (high + margin).as_vec3()]
    }

    /// Returns the edge length of the cube.
    pub fn edge(&self) -> f32 {
        (1 << BITS) as f32 / self.scale
    }
}

/// Returns the fine key of a cell by its number on each axis.
pub(crate) fn fine_key_of([x, y, z]: [u32; 3]) -> u64 {
    let low = (1 << BITS) - 1;
    let part = |shift: u32| {
        let [x, y, z] = [x, y, z].map(|cell| cell >> shift & low);
        u64::from(spread(x) | spread(y) << 1 | spread(z) << 2)
    };
    part(0) | part(BITS) << (3 * BITS) | part(2 * BITS) << (6 * BITS)
}

/// Returns the number of a fine key's cell on each axis.
pub(crate) fn fine_cell(key: u64) -> [u32; 3] {
    let axis = |shift: u32| {
        let bit = |at: u32| ((key >> (3 * at + shift) & 1) as u32) << at;
        (0..FINE_BITS).map(bit).sum()
    };
    [axis(0), axis(1), axis(2)]
}

/// Inserts two zero bits between each of the lowest ten bits.
fn spread(mut bits: u32) -> u32 {
    bits = (bits | bits << 16) & 0x0300_00ff;
    bits = (bits | bits << 8) & 0x0300_f00f;
    bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

/// Sorts the splats along the curve and splits them into blocks of about `wanted` splats. Blocks
/// are equal in size, so that they can be built in parallel.
pub(crate) fn blocks(splats: &[Splat], wanted: usize) -> Vec<Vec<u32>> {
    if splats.len() <= wanted {
        return vec![(0..splats.len() as u32).collect()];
    }
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = splats
        .par_iter()
        .with_min_len(1 << 14)
        .map(|splat| Vec3::from(splat.center))
        .fold(|| none, |(low, high), p| (low.min(p), high.max(p)))
        .reduce(|| none, |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let cube = Cube::around(low, high);
    let key = |(index, splat): (usize, &Splat)| {
        u64::from(cube.key(Vec3::from(splat.center))) << 32 | index as u64
    };
    let mut keys: Vec<u64> = splats.par_iter().enumerate().with_min_len(1 << 14).map(key).collect();
    keys.radix_sort_unstable();
    let count = splats.len().div_ceil(wanted);
    let size = splats.len().div_ceil(count);
    keys.par_chunks(size).map(|part| part.iter().map(|&key| key as u32).collect()).collect()
}

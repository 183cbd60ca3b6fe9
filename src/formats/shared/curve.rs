//! The order of Gaussians along the space-filling curve of Morton (1966).

use crate::{gaussians::Gaussians, parallel::prelude::*};
use glam::Vec3;

/// Bits of a place on the curve, on each axis.
const AXIS_BITS: u32 = 21;

/// Returns the Gaussians along the curve, each with its place on the curve.
pub(crate) fn order(set: &Gaussians) -> Vec<(u64, usize)> {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let both = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let (low, high) = set.centers.par_iter().map(|&c| (c, c)).reduce(|| none, both);
    let edge = (high - low).max_element().max(f32::MIN_POSITIVE);
    let scale = f64::from((1u32 << AXIS_BITS) - 1) / f64::from(edge);
    let place = |index: usize| {
        let cell = (set.centers[index] - low).as_dvec3() * scale;
        let [x, y, z] = cell.to_array().map(|cell| spread(cell as u64));
        (x | y << 1 | z << 2, index)
    };
    let mut order: Vec<(u64, usize)> = (0..set.len()).into_par_iter().map(place).collect();
    order.par_sort_unstable();
    order
}

/// Inserts two zero bits between each of the lowest 21 bits.
fn spread(mut bits: u64) -> u64 {
    bits &= (1 << AXIS_BITS) - 1;
    bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn bits_are_spread() {
        let slow = |bits: u64| (0..21).fold(0, |out, at| out | (bits >> at & 1) << (3 * at));
        for bits in [0, 1, 0b1011, 0x15_5555, 0x1f_ffff, 0x12_3456] {
            assert_eq!(spread(bits), slow(bits));
        }
    }
}

//! Turns the packed numbers of a Gaussian into its own.

use super::{Attributes, Header};
use crate::formats::shared::trained::Trained;
use glam::{DVec3, Quat, Vec3};
use half::f16;
use std::f32::consts::FRAC_1_SQRT_2;

/// A step of a colour is this part of a step of its constant term, so that terms beyond the colours
/// from 0 to 1 fit.
pub(super) const COLOR: f32 = 0.15;

/// Largest magnitude of a part of a quaternion, in 9 bits.
pub(super) const MOST: u32 = 511;

/// Returns a Gaussian by its number, and fills in its colour.
pub(super) fn gaussian(
    header: &Header,
    attributes: &Attributes,
    index: usize,
    colors: &mut [[f32; 3]],
) -> Trained {
    let [positions, opacities, constants, scales, rotations, harmonics] = attributes;
    if let Some((constant, others)) = colors.split_first_mut() {
        *constant = of::<3>(constants, index).map(|byte| (f32::from(byte) / 255.0 - 0.5) / COLOR);
        let (terms, _) = harmonics.as_chunks::<3>();
        let terms = terms.iter().skip(index * others.len());
        for (color, term) in others.iter_mut().zip(terms) {
            *color = term.map(|byte| (f32::from(byte) - 128.0) / 128.0);
        }
    }
    let center = if header.version == 1 {
        halves(of(positions, index))
    } else {
        fixed(of(positions, index), header.fraction)
    };
    let rotation = if header.version < 3 {
        first_three(of(rotations, index))
    } else {
        smallest_three(u32::from_le_bytes(of(rotations, index)))
    };
    let [opacity]: [u8; 1] = of(opacities, index);
    Trained {
        center,
        scale: Vec3::from(of::<3>(scales, index).map(|byte| (f32::from(byte) / 16.0 - 10.0).exp())),
        rotation,
        opacity: f32::from(opacity) / 255.0,
    }
}

/// Returns the bytes of one Gaussian. There are enough: the sizes were checked.
fn of<const N: usize>(attribute: &[u8], index: usize) -> [u8; N] {
    attribute.as_chunks().0[index]
}

/// Returns the position of version 1.
fn halves([x0, x1, y0, y1, z0, z1]: [u8; 6]) -> DVec3 {
    DVec3::from([[x0, x1], [y0, y1], [z0, z1]].map(|half| f16::from_le_bytes(half).to_f64()))
}

/// Returns a position of signed 24-bit numbers.
fn fixed([x0, x1, x2, y0, y1, y2, z0, z1, z2]: [u8; 9], fraction: u8) -> DVec3 {
    let whole = |[a, b, c]: [u8; 3]| f64::from(i32::from_le_bytes([0, a, b, c]) >> 8);
    DVec3::from([[x0, x1, x2], [y0, y1, y2], [z0, z1, z2]].map(whole))
        * (-f64::from(fraction)).exp2()
}

/// Returns the rotation of versions 1 and 2: w follows from the others.
fn first_three(bytes: [u8; 3]) -> Quat {
    let [x, y, z] = bytes.map(|byte| f32::from(byte) / 127.5 - 1.0);
    Quat::from_xyzw(x, y, z, (1.0 - x * x - y * y - z * z).max(0.0).sqrt())
}

/// Returns a rotation without its largest part. The upper two bits are the number of that part, in
/// the order x, y, z, w. The others follow in the same order, 10 bits each: the sign, and the
/// magnitude as a part of √½.
fn smallest_three(packed: u32) -> Quat {
    let largest = (packed >> 30) as usize;
    let (mut parts, mut left, mut at) = ([0.0; 4], 1.0f32, 30u32);
    for (part, value) in parts.iter_mut().enumerate() {
        if part == largest {
            continue;
        }
        at -= 10;
        let bits = packed >> at;
        let size = FRAC_1_SQRT_2 * (bits & MOST) as f32 / MOST as f32;
        *value = if bits & (MOST + 1) == 0 { size } else { -size };
        left -= size * size;
    }
    parts[largest] = left.max(0.0).sqrt();
    Quat::from_array(parts)
}

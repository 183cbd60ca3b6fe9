//! Writes version 3, which all readers of SPZ know.

use super::{
    MAGIC,
    decode::{COLOR, MOST},
};
use crate::{Error, Result, disk, gaussians::Gaussians};
use flate2::{Compression, write::GzEncoder};
use glam::{DVec3, Quat};
use std::{
    f32::consts::SQRT_2,
    io::{self, BufWriter, Write},
    path::Path,
};

/// Fractional bits of positions, unless they are too large: a step is ¼ mm for a unit of 1 m.
const FRACTION: u8 = 12;

/// Largest position in steps, in 24 bits with a sign.
const LARGEST: f64 = 8_388_607.0;

/// Writes Gaussians with their harmonics, in world positions. Positions have steps of 2⁻¹² world
/// units, or larger ones if the farthest does not fit. Standard deviations change by up to 3 % and
/// are kept between e⁻¹⁰ and e⁶. Opacities and constant terms have 8 bits, the other terms steps of
/// 1/128 between −1 and 1, and rotations 30 bits.
///
/// # Errors
/// [`Error::Argument`] for a set that is empty, contradicts itself, or has positions beyond
/// 8 388 607; [`Error::Output`] if the file cannot be written.
pub fn write(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    set.validate().map_err(Error::Argument)?;
    // Other readers count with 31 bits.
    let count = i32::try_from(set.len())
        .map_err(|_| Error::Argument(format!("{} Gaussians do not fit in SPZ", set.len())))?;
    if count == 0 {
        return Err(Error::Argument("there are no Gaussians to write".into()));
    }
    let fraction = fraction(set)?;
    disk::write_with(path.as_ref(), |out| {
        let mut out = BufWriter::new(GzEncoder::new(out, Compression::default()));
        out.write_all(&MAGIC)?;
        out.write_all(&3u32.to_le_bytes())?;
        out.write_all(&count.to_le_bytes())?;
        out.write_all(&[set.degree as u8, fraction, 0, 0])?;
        write_attributes(set, fraction, &mut out)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)?.finish()?;
        Ok(())
    })
}

fn position(set: &Gaussians, index: usize) -> DVec3 {
    set.origin + set.centers[index].as_dvec3()
}

/// Returns the most fractional bits with which all positions fit.
fn fraction(set: &Gaussians) -> Result<u8> {
    let sizes = (0..set.len()).map(|index| position(set, index).abs().max_element());
    let largest = sizes.fold(0.0, f64::max);
    let fits = |bits: &u8| (largest * f64::from(*bits).exp2()).round() <= LARGEST;
    (0..=FRACTION).rev().find(fits).ok_or_else(|| {
        Error::Argument(format!("a position is {largest}, but SPZ has positions up to {LARGEST}"))
    })
}

/// Writes the attributes, each for all Gaussians. Casts to bytes keep to 0 … 255.
fn write_attributes(set: &Gaussians, fraction: u8, out: &mut impl Write) -> io::Result<()> {
    let steps = f64::from(fraction).exp2();
    for index in 0..set.len() {
        for part in (position(set, index) * steps).round().to_array() {
            let [a, b, c, _] = (part as i32).to_le_bytes();
            out.write_all(&[a, b, c])?;
        }
    }
    for opacity in &set.opacities {
        out.write_all(&[(opacity * 255.0).round() as u8])?;
    }
    for index in 0..set.len() {
        let constant = set.harmonics_of(index)[0];
        out.write_all(&constant.map(|term| ((term * COLOR + 0.5) * 255.0).round() as u8))?;
    }
    for scale in &set.scales {
        let byte = |scale: f32| ((scale.ln() + 10.0) * 16.0).round() as u8;
        out.write_all(&scale.to_array().map(byte))?;
    }
    for &rotation in &set.rotations {
        out.write_all(&smallest_three(rotation).to_le_bytes())?;
    }
    for index in 0..set.len() {
        for term in &set.harmonics_of(index)[1..] {
            out.write_all(&term.map(|part| (part * 128.0 + 128.0).round() as u8))?;
        }
    }
    Ok(())
}

/// Packs a rotation as `decode::smallest_three` unpacks it.
fn smallest_three(rotation: Quat) -> u32 {
    let parts = rotation.normalize().to_array();
    let larger = |a: usize, b: usize| if parts[b].abs() > parts[a].abs() { b } else { a };
    let largest = (1..4).fold(0, larger);
    let mut packed = largest as u32;
    for (part, value) in parts.iter().enumerate() {
        if part != largest {
            // Both signs of a quaternion are the same rotation. The largest part is positive.
            let is_negative = (*value < 0.0) != (parts[largest] < 0.0);
            let size = (value.abs() * SQRT_2 * MOST as f32).round() as u32;
            packed = packed << 10 | u32::from(is_negative) << 9 | size.min(MOST);
        }
    }
    packed
}

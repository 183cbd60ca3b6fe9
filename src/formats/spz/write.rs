//! Writes version 3, which all readers of SPZ know, and version 4, the newest of its library.

use super::{
    ATTRIBUTES, MAGIC,
    decode::{COLOR, MOST},
};
#[cfg(feature = "files")]
use crate::parallel::prelude::*;
use crate::{Error, Result, disk, formats::shared::trained::check_places, gaussians::Gaussians};
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

/// How well zstd packs, from 1 to 22. Higher numbers take far longer, for a few percent.
#[cfg(feature = "files")]
const LEVEL: i32 = 12;

/// Writes Gaussians with their harmonics, in world positions, as version 3. Positions have steps of
/// 2⁻¹² world units, or larger ones if the farthest does not fit. Standard deviations change by up
/// to 3 % and are kept between e⁻¹⁰ and e⁶. Opacities and constant terms have 8 bits, the other
/// terms steps of 1/128 between −1 and 1, and rotations 30 bits.
///
/// # Errors
/// [`Error::Argument`] for a set that is empty, contradicts itself, or has positions beyond
/// 8 388 607 or that would be rounded too much; [`Error::Output`] if the file cannot be written.
pub fn write(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    let (count, fraction) = checked(set)?;
    disk::write_with(path.as_ref(), |out| {
        let mut out = BufWriter::new(GzEncoder::new(out, Compression::default()));
        out.write_all(&head(set, [3, count], fraction))?;
        for which in 0..ATTRIBUTES.len() {
            write_attribute(set, fraction, which, &mut out)?;
        }
        out.into_inner().map_err(io::IntoInnerError::into_error)?.finish()?;
        Ok(())
    })
}

/// As [`write()`], but as version 4: the same numbers in a stream of zstd for each attribute. That
/// is smaller and is read faster. Programs of before 2026 do not read it.
///
/// # Errors
/// Those of [`write()`]; [`Error::Argument`] in a build without the feature `files`.
#[cfg(feature = "files")]
pub fn write_streams(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    let (count, fraction) = checked(set)?;
    let pack = |which: usize| -> io::Result<(u64, Vec<u8>)> {
        let mut content = Vec::new();
        write_attribute(set, fraction, which, &mut content)?;
        Ok((content.len() as u64, zstd::bulk::compress(&content, LEVEL)?))
    };
    let streams = (0..ATTRIBUTES.len()).into_par_iter().map(pack).collect::<Vec<_>>();
    let streams: io::Result<Vec<_>> = streams.into_iter().collect();
    let mut streams = streams.map_err(|error| Error::output(path, error))?;
    // Harmonics of degree 0 have no stream.
    streams.retain(|(size, _)| *size > 0);
    disk::write_with(path, |out| {
        let mut head = head(set, [super::STREAMS, count], fraction);
        head[super::HEADER - 1] = streams.len() as u8;
        out.write_all(&head)?;
        out.write_all(&(super::LONG_HEADER as u32).to_le_bytes())?;
        out.write_all(&[0; super::LONG_HEADER - super::HEADER - 4])?;
        for (size, packed) in &streams {
            out.write_all(&(packed.len() as u64).to_le_bytes())?;
            out.write_all(&size.to_le_bytes())?;
        }
        streams.iter().try_for_each(|(_, packed)| out.write_all(packed))
    })
}

/// Returns the number of Gaussians and the fractional bits of their positions.
fn checked(set: &Gaussians) -> Result<(u32, u8)> {
    set.validate().map_err(Error::Argument)?;
    // Other readers count with 31 bits.
    let count = i32::try_from(set.len())
        .map_err(|_| Error::Argument(format!("{} Gaussians do not fit in SPZ", set.len())))?;
    if count == 0 {
        return Err(Error::Argument("there are no Gaussians to write".into()));
    }
    let fraction = fraction(set)?;
    let steps = f64::from(fraction).exp2();
    check_places("SPZ", set, |place| (place * steps).round() / steps)?;
    Ok((count as u32, fraction))
}

/// Returns the fields of the header that all versions have.
fn head(set: &Gaussians, [version, count]: [u32; 2], fraction: u8) -> Vec<u8> {
    let mut head = MAGIC.to_vec();
    head.extend([version, count].map(u32::to_le_bytes).as_flattened());
    head.extend([set.degree as u8, fraction, 0, 0]);
    head
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

/// Writes an attribute of all Gaussians, by its place in [`ATTRIBUTES`]. Casts to bytes keep to
/// 0 … 255.
fn write_attribute(
    set: &Gaussians,
    fraction: u8,
    which: usize,
    out: &mut impl Write,
) -> io::Result<()> {
    let steps = f64::from(fraction).exp2();
    let scale = |scale: f32| ((scale.ln() + 10.0) * 16.0).round() as u8;
    for index in 0..set.len() {
        let color = set.harmonics_of(index);
        match which {
            0 => {
                for part in (position(set, index) * steps).round().to_array() {
                    let [a, b, c, _] = (part as i32).to_le_bytes();
                    out.write_all(&[a, b, c])?;
                }
            }
            1 => out.write_all(&[(set.opacities[index] * 255.0).round() as u8])?,
            2 => {
                out.write_all(&color[0].map(|term| ((term * COLOR + 0.5) * 255.0).round() as u8))?;
            }
            3 => out.write_all(&set.scales[index].to_array().map(scale))?,
            4 => out.write_all(&smallest_three(set.rotations[index]).to_le_bytes())?,
            _ => {
                for term in &color[1..] {
                    out.write_all(&term.map(|part| (part * 128.0 + 128.0).round() as u8))?;
                }
            }
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

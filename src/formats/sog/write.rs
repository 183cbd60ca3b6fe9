//! Writes version 2 of SOG: lossless WebP planes with a `meta.json`, in a ZIP file or beside it.
//!
//! Gaussians follow the curve of Morton, so that neighbours in a plane are neighbours in space and
//! the planes compress well.

mod codebook;
mod palette;
pub(super) mod streamed;
mod webp;

use super::{ENTRIES_IN_ROW, FIRST_TAG, META};
use crate::{
    Error, Result, disk,
    formats::shared::{curve, trained::check_places},
    gaussians::{Gaussians, harmonics::terms},
    math::keep::single,
    memory,
    parallel::prelude::*,
};
use codebook::Codebook;
use glam::{DVec3, Quat};
use palette::Palette;
use serde_json::{Value, json};
use std::{
    f32::consts::FRAC_1_SQRT_2,
    io::{self, Seek, Write},
    path::Path,
};
use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

/// Most pixels of a plane along an edge.
const EDGE: usize = 16383;

/// The smallest and the largest logarithm of a deviation that is written.
const LOGS: [f32; 2] = [-41.0, 41.0];

/// Most bytes of memory of a Gaussian: its place in the order, its values while a codebook is made,
/// and its pixels as they are and packed.
const MEMORY: usize = 96;

/// The pixel of no Gaussian.
const NONE: [u8; 4] = [0, 0, 0, u8::MAX];

/// A file with its name.
type Named = (&'static str, Vec<u8>);

/// Writes Gaussians to a `.sog` file, or to a `meta.json` and planes beside it if that is the name.
/// Positions have 16 bits in the range of the scene, with finer steps near the world's origin.
/// Deviations and constant terms are one of 256 numbers each, which are chosen for the scene;
/// opacities and the parts of rotations have 8 bits. The other terms are those of a palette of up
/// to 65,536 rows, of 256 numbers. The order changes.
///
/// # Errors
/// [`Error::Argument`] for a set that is empty, contradicts itself, or is too large for a plane;
/// also for one so far away that 32 bits do not hold its shape. [`Error::Memory`] if there is too
/// little of it; [`Error::Output`] if a file cannot be written.
pub fn write(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    set.validate().map_err(Error::Argument)?;
    check_places("SOG", set, single)?;
    if set.is_empty() {
        return Err(Error::Argument("there are no Gaussians to write".into()));
    }
    let size = Size::of(set.len())?;
    memory::room("packing Gaussians", (MEMORY * set.len()) as u64)?;
    let order: Vec<usize> = curve::order(set).into_iter().map(|(_, index)| index).collect();
    let (meta, planes) = pack(set, size, &order);
    if path.file_name().is_some_and(|name| name == META) {
        return write_beside(path, &meta, &planes);
    }
    disk::write_with(path, |out| archive(&meta, &planes, out))
}

/// Writes an archive.
fn archive(meta: &Vec<u8>, planes: &[Named], out: impl Write + Seek) -> io::Result<()> {
    let mut archive = ZipWriter::new(out);
    let plain = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut files = [(META, meta)].into_iter().chain(planes.iter().map(|(n, b)| (*n, b)));
    let written = files.try_for_each(|(name, bytes)| {
        archive.start_file(name, plain)?;
        archive.write_all(bytes)
    });
    if let Err(error) = written {
        // To drop it would end the archive, fail once more, and say so on the terminal.
        std::mem::forget(archive);
        return Err(error);
    }
    archive.finish()?;
    Ok(())
}

/// Writes a `meta.json` and planes beside it. They appear once all of them are whole, the
/// `meta.json` at last. If it may replace nothing, then they may not.
fn write_beside(path: &Path, meta: &[u8], planes: &[Named]) -> Result<()> {
    let folder = disk::folder(path);
    let may_replace = disk::is_replaceable(path);
    let mut whole = Vec::new();
    for (name, bytes) in planes {
        let plane = folder.join(name);
        if !may_replace && plane.symlink_metadata().is_ok() {
            let message = "exists already, but a scene is written beside it; give another folder";
            return Err(Error::output(&plane, io::Error::other(message)));
        }
        disk::may_replace(&plane, may_replace);
        let mut file = disk::AtomicFile::create(&plane)?;
        file.write_all(bytes).map_err(|error| Error::output(&plane, error))?;
        whole.push(file);
    }
    let mut last = disk::AtomicFile::create(path)?;
    last.write_all(meta).map_err(|error| Error::output(path, error))?;
    whole.into_iter().try_for_each(disk::AtomicFile::commit)?;
    last.commit()
}

/// The size of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Size {
    width: usize,
    height: usize,
}

impl Size {
    /// Returns the size of a plane with a pixel for each Gaussian: a square of whole blocks of 4².
    fn of(count: usize) -> Result<Self> {
        let root = (count as f64).sqrt().ceil() as usize;
        let width = root.next_multiple_of(4).min(EDGE);
        let height = count.div_ceil(width);
        if height > EDGE {
            let most = EDGE * EDGE;
            let message = format!("{count} Gaussians do not fit in SOG, which has at most {most}");
            return Err(Error::Argument(message));
        }
        Ok(Self { width, height: height.next_multiple_of(4).min(EDGE) })
    }

    /// Encodes a plane with the pixel of each Gaussian in its order.
    fn plane(self, order: &[usize], pixel: impl Fn(usize) -> [u8; 4] + Sync) -> Vec<u8> {
        let mut pixels: Vec<[u8; 4]> = order.par_iter().map(|&index| pixel(index)).collect();
        pixels.resize(self.width * self.height, NONE);
        webp::encode(&pixels, self.width)
    }
}

/// Returns the `meta.json` and the planes of Gaussians, in this order.
fn pack(set: &Gaussians, size: Size, order: &[usize]) -> (Vec<u8>, Vec<Named>) {
    let places = Places::of(set);
    let means = |index: usize, byte: usize| {
        opaque(places.steps(set, index).map(|steps| steps.to_le_bytes()[byte]))
    };
    let mut planes = vec![
        ("means_l.webp", size.plane(order, |index| means(index, 0))),
        ("means_u.webp", size.plane(order, |index| means(index, 1))),
        ("quats.webp", size.plane(order, |index| rotation(set.rotations[index]))),
    ];
    let log = |scale: f32| scale.ln().clamp(LOGS[0], LOGS[1]);
    let weights = Weights::of(set);
    let scales = Codebook::of_sample(3 * set.len(), |at| {
        (log(set.scales[at / 3][at % 3]), weights.of_one(set, at / 3))
    });
    let deviations =
        |index: usize| opaque(set.scales[index].to_array().map(|scale| scales.nearest(log(scale))));
    planes.push(("scales.webp", size.plane(order, deviations)));
    let constants =
        Codebook::of_sample(3 * set.len(), |at| (set.harmonics_of(at / 3)[0][at % 3], 1.0));
    let color = |index: usize| {
        let [r, g, b] = set.harmonics_of(index)[0].map(|term| constants.nearest(term));
        [r, g, b, (set.opacities[index] * 255.0).round() as u8]
    };
    planes.push(("sh0.webp", size.plane(order, color)));
    let mut meta = json!({
        "version": 2,
        "asset": { "generator": concat!("splatkit ", env!("CARGO_PKG_VERSION")) },
        "count": set.len(),
        "means": {
            "mins": places.low.to_array(),
            "maxs": places.high.to_array(),
            "files": ["means_l.webp", "means_u.webp"]
        },
        "scales": { "codebook": scales.levels(), "files": ["scales.webp"] },
        "quats": { "files": ["quats.webp"] },
        "sh0": { "codebook": constants.levels(), "files": ["sh0.webp"] }
    });
    if set.degree > 0 {
        meta["shN"] = pack_harmonics(set, size, order, &mut planes);
    }
    (meta.to_string().into_bytes(), planes)
}

/// How much the deviations of Gaussians count in their codebook. A wrong deviation of a large
/// Gaussian changes more pixels.
struct Weights {
    /// The mean of what Gaussians cover.
    mean: f64,
}

impl Weights {
    /// The weight that all have, as a part of the mean.
    const LEAST: f64 = 0.02;

    fn of(set: &Gaussians) -> Self {
        let sum: f64 = (0..set.len()).into_par_iter().map(|i| Self::covered(set, i)).sum();
        Self { mean: (sum / set.len() as f64).max(f64::MIN_POSITIVE) }
    }

    /// Returns the area that a Gaussian covers from its widest side.
    fn covered(set: &Gaussians, index: usize) -> f64 {
        let [a, b, c] = set.scales[index].as_dvec3().to_array();
        f64::from(set.opacities[index]) * (a * b).max(b * c).max(a * c)
    }

    fn of_one(&self, set: &Gaussians, index: usize) -> f32 {
        (Self::covered(set, index) / self.mean + Self::LEAST) as f32
    }
}

/// Adds the planes of the terms above the constant one, and returns what `meta.json` says of them.
fn pack_harmonics(set: &Gaussians, size: Size, order: &[usize], planes: &mut Vec<Named>) -> Value {
    let Palette { entries, labels, uses } = Palette::of(set);
    let terms = terms(set.degree) - 1;
    let values = entries.chunks_exact(3 * terms).zip(&uses);
    let values = values.flat_map(|(entry, &count)| entry.iter().map(move |&v| (v, count as f32)));
    let codebook = Codebook::of(values);
    let (colors, _) = entries.as_chunks::<3>();
    let pixel = |color: &[f32; 3]| opaque(color.map(|value| codebook.nearest(value)));
    let mut pixels: Vec<[u8; 4]> = colors.iter().map(pixel).collect();
    let width = ENTRIES_IN_ROW * terms;
    pixels.resize(pixels.len().next_multiple_of(width), NONE);
    planes.push(("shN_centroids.webp", webp::encode(&pixels, width)));
    let label = |index: usize| {
        let [low, high] = labels[index].to_le_bytes();
        [low, high, 0, u8::MAX]
    };
    planes.push(("shN_labels.webp", size.plane(order, label)));
    json!({
        "count": uses.len(),
        "bands": set.degree,
        "codebook": codebook.levels(),
        "files": ["shN_centroids.webp", "shN_labels.webp"]
    })
}

fn opaque([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, u8::MAX]
}

/// The logarithms of the corners of the box around all centres.
struct Places {
    low: DVec3,
    high: DVec3,
}

/// Returns sign(x) · ln(1 + |x|) of each coordinate.
fn log_of(place: DVec3) -> DVec3 {
    DVec3::from_array(place.to_array().map(|x| x.abs().ln_1p().copysign(x)))
}

impl Places {
    fn of(set: &Gaussians) -> Self {
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let logs = (0..set.len()).into_par_iter().map(|index| [place(set, index); 2]);
        let [low, high] = logs.reduce(|| none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        Self { low: log_of(low), high: log_of(high) }
    }

    /// Returns where a centre is between the corners, in 65,535 steps.
    fn steps(&self, set: &Gaussians, index: usize) -> [u16; 3] {
        let part = (log_of(place(set, index)) - self.low) / (self.high - self.low);
        // A box without width has no steps: NaN becomes 0.
        part.to_array().map(|part| (part * 65535.0).round() as u16)
    }
}

fn place(set: &Gaussians, index: usize) -> DVec3 {
    set.origin + set.centers[index].as_dvec3()
}

/// Packs a rotation as `super::rotation` unpacks it.
fn rotation(rotation: Quat) -> [u8; 4] {
    let [x, y, z, w] = rotation.normalize().to_array();
    let parts = [w, x, y, z];
    let larger = |most: usize, i: usize| if parts[i].abs() > parts[most].abs() { i } else { most };
    let most = (1..4).fold(0, larger);
    // Both signs of a quaternion are the same rotation. The largest part is positive.
    let sign = parts[most].signum();
    let byte = |i: usize| ((sign * parts[i] * FRAC_1_SQRT_2 + 0.5) * 255.0).round() as u8;
    let mut others = (0..4).filter(|&i| i != most).map(byte);
    let mut next = || others.next().unwrap_or_default();
    [next(), next(), next(), FIRST_TAG + most as u8]
}

#[cfg(test)]
mod tests;

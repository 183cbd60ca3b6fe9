//! SOG of PlayCanvas: trained 3D Gaussians as pictures whose bytes are positions in ranges or
//! entries of codebooks. A scene is a folder with `meta.json` and WebP planes, or both in one ZIP
//! file, `.sog`. Versions 1 and 2 of `meta.json` are read, and version 2 is written. Streamed
//! scenes, in levels and chunks, have an index, `lod-meta.json`.
//!
//! Pixel i of each plane, in rows from the top left, belongs to Gaussian i. The frame is that of
//! the trainer's PLY: tools turn nothing when they convert between both.

mod meta;
mod planes;
mod streamed;
#[cfg(test)]
mod tests;
mod write;

pub use write::{streamed::write as write_streamed, write};

use super::shared::trained::{Trained, opacity_of_logit, settle};
use crate::{
    Result,
    gaussians::{Gaussians, MOST_DEGREE, harmonics::terms},
    input::Source,
};
use glam::{DVec3, Quat, Vec3};
use meta::{INDEX, Levels, META, Meta, file};
use planes::{Files, Need, Plane};
use std::{array, f32::consts::SQRT_2};

/// Bytes at the beginning of a file that say whether it is a `meta.json`.
const HEAD: usize = 4096;

/// Number of harmonics in each row of their palette.
const ENTRIES_IN_ROW: usize = 64;

/// Most harmonics in their palette.
const MOST_ENTRIES: usize = 1 << 16;

/// The lowest alpha of a rotation; it says which component is left out.
const FIRST_TAG: u8 = 252;

/// Returns whether these bytes begin a ZIP file of a scene: its first entry is `meta.json` or a
/// WebP plane.
pub fn is_sog(bytes: &[u8]) -> bool {
    first_entry(bytes).is_some_and(|name| name == META.as_bytes() || name.ends_with(b".webp"))
}

/// Returns the name of the first entry of a ZIP file.
fn first_entry(bytes: &[u8]) -> Option<&[u8]> {
    let header = bytes.strip_prefix(b"PK\x03\x04")?;
    let &[low, high] = header.get(22..24)? else { return None };
    header.get(26..)?.get(..usize::from(u16::from_le_bytes([low, high])))
}

/// Returns whether these bytes begin the `meta.json` of a scene, or the index of a streamed one.
pub fn is_meta(bytes: &[u8]) -> bool {
    let any = |words: &[&str]| words.iter().any(|word| head_has(bytes, word));
    let has_plane = any(&["\"means\"", "\"scales\"", "\"quats\"", "\"sh0\"", "\"shN\""]);
    has_plane && any(&["\"mins\"", "\"codebook\"", ".webp\""]) || is_streamed(bytes)
}

/// Returns whether these bytes begin the index of a streamed scene.
fn is_streamed(bytes: &[u8]) -> bool {
    head_has(bytes, "\"lodLevels\"")
}

/// Returns whether a text begins with an object and has this word at its beginning.
fn head_has(bytes: &[u8], word: &str) -> bool {
    let head = bytes.get(..HEAD).unwrap_or(bytes).trim_ascii_start();
    head.starts_with(b"{") && head.windows(word.len()).any(|part| part == word.as_bytes())
}

/// Reads a scene from its `.sog` file, or from its `meta.json` and the planes beside it. Of a
/// streamed scene (`lod-meta.json`), all chunks of the finest level.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is no archive with a `meta.json`, for a
/// `meta.json` that is malformed or of another version, and for chunks that contradict their
/// index. Also for planes that are missing, outside the folder, not lossless or too small.
/// [`Error::Limit`](crate::Error::Limit) for counts and pictures over the limits.
pub fn read(source: &Source) -> Result<Gaussians> {
    let is_index = source.path.file_name().is_some_and(|name| name == INDEX);
    if is_index || is_streamed(source.bytes()) {
        return streamed::read(source);
    }
    let (text, mut files) = planes::open(source)?;
    let meta = Meta::parse(source, &text)?;
    let count = meta.count(source)?;
    let scene = Scene::load(source, &mut files, &meta, count)?;
    settle(source, count, scene.degree(), |index, color| scene.gaussian(source, index, color))
}

/// Returns the error for a streamed scene in an archive.
fn not_unpacked(source: &Source) -> crate::Error {
    let message = "contains a streamed SOG scene (lod-meta.json), which is read from a folder";
    source.error("archive", message).hint("unpack the archive, and open its lod-meta.json")
}

/// The decoded planes, and what their bytes mean.
struct Scene {
    /// The low and the high bytes of the positions.
    means: [Plane; 2],
    /// The logarithms of the corners of the box around all centres.
    corners: [[f64; 3]; 2],
    quats: Plane,
    scales: Plane,
    /// Standard deviations by byte, for each axis.
    deviations: [Levels; 3],
    /// Constant terms of the colours, and opacities.
    sh0: Plane,
    constants: [Levels; 3],
    opacities: Levels,
    palette: Option<Palette>,
}

impl Scene {
    fn load(source: &Source, files: &mut Files, meta: &Meta, count: usize) -> Result<Self> {
        let mut plane = |names: &[String], key: &str, at: usize| {
            let place = format!("{key}.files[{at}]");
            files.plane(source, &place, file(source, names, key, at)?, Need::Texels(count))
        };
        let means = &meta.means;
        let (low, high) = (plane(&means.files, "means", 0)?, plane(&means.files, "means", 1)?);
        let quats = plane(&meta.quats.files, "quats", 0)?;
        let scales = plane(&meta.scales.files, "scales", 0)?;
        let sh0 = plane(&meta.sh0.files, "sh0", 0)?;
        let levels = meta.scales.levels(source, "scales", meta.is_second)?;
        let opacities = if meta.is_second {
            array::from_fn(|byte| byte as f32 / 255.0)
        } else {
            meta.sh0.range(source, "sh0", 3)?.map(opacity_of_logit)
        };
        Ok(Self {
            means: [low, high],
            corners: [means.mins, means.maxs],
            quats,
            scales,
            deviations: levels.map(|axis| axis.map(|log| f64::from(log).exp() as f32)),
            sh0,
            constants: meta.sh0.levels(source, "sh0", meta.is_second)?,
            opacities,
            palette: Palette::load(source, files, meta, count)?,
        })
    }

    /// Returns the degree of the colours.
    fn degree(&self) -> u32 {
        self.palette.as_ref().map_or(0, |palette| palette.degree)
    }

    /// Returns one Gaussian, and fills in the coefficients of its colour.
    fn gaussian(&self, source: &Source, index: usize, color: &mut [[f32; 3]]) -> Result<Trained> {
        let sh0 = self.sh0.texel(index);
        if let [constant, rest @ ..] = color {
            *constant = values(&self.constants, sh0);
            if let Some(palette) = &self.palette {
                palette.fill(source, index, rest)?;
            }
        }
        Ok(Trained {
            center: self.center(index),
            scale: Vec3::from_array(values(&self.deviations, self.scales.texel(index))),
            rotation: rotation(self.quats.texel(index)),
            opacity: self.opacities[usize::from(sh0[3])],
        })
    }

    /// Returns a centre. The file has sign(x) · ln(1 + |x|) as 16 bits between the corners.
    fn center(&self, index: usize) -> DVec3 {
        let [low, high] = self.means.each_ref().map(|plane| plane.texel(index));
        let [mins, maxs] = self.corners;
        DVec3::from_array(array::from_fn(|axis| {
            let step = f64::from(u16::from_le_bytes([low[axis], high[axis]]));
            let log = mins[axis] + (maxs[axis] - mins[axis]) * (step / 65535.0);
            log.abs().exp_m1().copysign(log)
        }))
    }
}

/// Returns the values of the first three bytes of a texel.
fn values(levels: &[Levels; 3], texel: [u8; 4]) -> [f32; 3] {
    array::from_fn(|channel| levels[channel][usize::from(texel[channel])])
}

/// Returns a rotation. The texel has three of w, x, y, z in this order, times √2; its alpha says
/// which is left out, the largest, which is positive. Other alphas stand for no turn.
fn rotation([a, b, c, tag]: [u8; 4]) -> Quat {
    let [a, b, c] = [a, b, c].map(|byte| (f32::from(byte) / 255.0 - 0.5) * SQRT_2);
    let largest = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    match tag.checked_sub(FIRST_TAG) {
        Some(0) => Quat::from_xyzw(a, b, c, largest),
        Some(1) => Quat::from_xyzw(largest, b, c, a),
        Some(2) => Quat::from_xyzw(b, largest, c, a),
        Some(_) => Quat::from_xyzw(b, c, largest, a),
        None => Quat::IDENTITY,
    }
}

/// The terms above the constant one: each Gaussian refers to an entry of a palette.
struct Palette {
    degree: u32,
    /// The number of entries.
    count: usize,
    /// The entries in rows of 64. An entry has a texel for each term.
    centroids: Plane,
    /// The number of the entry for each Gaussian, low and high byte.
    labels: Plane,
    levels: [Levels; 3],
}

impl Palette {
    /// Returns `None` if the scene has constant colours only.
    fn load(source: &Source, files: &mut Files, meta: &Meta, count: usize) -> Result<Option<Self>> {
        let Some(rest) = meta.rest.as_ref().filter(|rest| rest.bands != Some(0)) else {
            return Ok(None);
        };
        let levels = rest.levels(source, meta.is_second)?;
        let mut plane = |at: usize, need: Need| {
            let name = file(source, &rest.files, "shN", at)?;
            files.plane(source, &format!("shN.files[{at}]"), name, need)
        };
        let claimed = rest.count.and_then(|count| usize::try_from(count).ok());
        // A label has 16 bits.
        let entries = claimed.unwrap_or(MOST_ENTRIES).min(MOST_ENTRIES);
        let centroids = plane(0, Need::Rows(entries.div_ceil(ENTRIES_IN_ROW)))?;
        let labels = plane(1, Need::Texels(count))?;
        let width = |degree: u32| ENTRIES_IN_ROW * (terms(degree) - 1);
        let degree = (1..=MOST_DEGREE).find(|&degree| width(degree) == centroids.width);
        let degree = degree.ok_or_else(|| {
            let wanted = [1, 2, 3].map(width);
            let message = format!("is {} pixels wide, not one of {wanted:?}", centroids.width);
            source.error("shN.files[0]", message)
        })?;
        if let Some(bands) = rest.bands.filter(|&bands| bands != u64::from(degree)) {
            let message =
                format!("has {bands} bands, but the width of its plane is that of {degree}");
            return Err(source.error("shN", message));
        }
        let there = centroids.texels.len() / (terms(degree) - 1);
        let count = claimed.map_or(there, |claimed| claimed.min(there));
        Ok(Some(Self { degree, count, centroids, labels, levels }))
    }

    /// Fills in the terms of a Gaussian above the constant one.
    fn fill(&self, source: &Source, index: usize, color: &mut [[f32; 3]]) -> Result<()> {
        let [low, high, ..] = self.labels.texel(index);
        let label = usize::from(u16::from_le_bytes([low, high]));
        let mut entries = self.centroids.texels.chunks_exact(terms(self.degree) - 1);
        let entry = entries.nth(label).filter(|_| label < self.count).ok_or_else(|| {
            let message =
                format!("has the harmonics {label} of a palette with {} entries", self.count);
            source.error(format!("Gaussian {index}"), message)
        })?;
        for (color, &texel) in color.iter_mut().zip(entry) {
            *color = values(&self.levels, texel);
        }
        Ok(())
    }
}

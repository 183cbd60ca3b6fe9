//! `meta.json`: the names of the planes, and what their bytes mean.

use crate::{Result, input::Source};
use serde::Deserialize;
use std::array;

/// The name of the file, in archives and in errors.
pub const META: &str = "meta.json";

/// The name of the index of a streamed scene.
pub const INDEX: &str = "lod-meta.json";

/// The values that the bytes of a channel stand for. Those without a value are not a number.
pub type Levels = [f32; 256];

#[derive(Deserialize)]
pub struct Meta {
    /// The number of Gaussians in version 2.
    count: Option<u64>,
    pub means: Means,
    pub scales: Coded,
    pub quats: Quats,
    pub sh0: Coded,
    #[serde(rename = "shN")]
    pub rest: Option<Rest>,
    /// Whether the version is 2.
    #[serde(skip)]
    pub is_second: bool,
}

/// Positions.
#[derive(Deserialize)]
pub struct Means {
    /// The number of Gaussians in version 1, and 3.
    shape: Option<Vec<u64>>,
    pub mins: [f64; 3],
    pub maxs: [f64; 3],
    pub files: Vec<String>,
}

/// Rotations.
#[derive(Deserialize)]
pub struct Quats {
    pub files: Vec<String>,
}

/// A plane with a codebook for all channels in version 2, and with a range for each in version 1.
#[derive(Deserialize)]
pub struct Coded {
    codebook: Option<Vec<Option<f64>>>,
    mins: Option<Vec<f64>>,
    maxs: Option<Vec<f64>>,
    pub files: Vec<String>,
}

/// Harmonics above the constant term.
#[derive(Deserialize)]
pub struct Rest {
    codebook: Option<Vec<Option<f64>>>,
    mins: Option<f64>,
    maxs: Option<f64>,
    /// The number of entries of the palette.
    pub count: Option<u64>,
    /// The degree.
    pub bands: Option<u64>,
    pub files: Vec<String>,
}

impl Meta {
    /// Reads the text of the file.
    pub fn parse(source: &Source, text: &str) -> Result<Self> {
        #[derive(Deserialize)]
        struct Head {
            version: Option<u64>,
        }
        let wrong = |error: serde_json::Error| source.error(META, error.to_string());
        let Head { version } = serde_json::from_str(text).map_err(wrong)?;
        // The first version has no number.
        if let Some(version @ (0 | 3..)) = version {
            let message = format!("has the version {version}, but only 1 and 2 are supported");
            return Err(source.error(META, message).hint("write the scene as PLY"));
        }
        let meta: Self = serde_json::from_str(text).map_err(wrong)?;
        Ok(Self { is_second: version == Some(2), ..meta })
    }

    /// Returns the number of Gaussians.
    pub fn count(&self, source: &Source) -> Result<usize> {
        let (key, count) = if self.is_second {
            ("count", self.count)
        } else {
            ("means.shape", self.means.shape.as_ref().and_then(|shape| shape.first().copied()))
        };
        let count = count.ok_or_else(|| source.error(META, format!("has no “{key}”")))?;
        source.check_points("the number of Gaussians", count)
    }
}

impl Coded {
    /// Returns what the bytes of the first three channels mean.
    pub fn levels(&self, source: &Source, key: &str, is_second: bool) -> Result<[Levels; 3]> {
        if is_second {
            return Ok([codebook(source, key, self.codebook.as_deref())?; 3]);
        }
        let range = |channel| self.range(source, key, channel);
        Ok([range(0)?, range(1)?, range(2)?])
    }

    /// Returns what the bytes of a channel with a range mean.
    pub fn range(&self, source: &Source, key: &str, channel: usize) -> Result<Levels> {
        let of = |list: &Option<Vec<f64>>| list.as_ref()?.get(channel).copied();
        let range = of(&self.mins).zip(of(&self.maxs));
        range.map(spread).ok_or_else(|| no_range(source, key, channel))
    }
}

impl Rest {
    /// Returns what the bytes of the palette mean.
    pub fn levels(&self, source: &Source, is_second: bool) -> Result<[Levels; 3]> {
        let levels = if is_second {
            codebook(source, "shN", self.codebook.as_deref())?
        } else {
            self.mins.zip(self.maxs).map(spread).ok_or_else(|| no_range(source, "shN", 0))?
        };
        Ok([levels; 3])
    }
}

/// Returns the name of a plane.
pub fn file<'a>(source: &Source, files: &'a [String], key: &str, at: usize) -> Result<&'a str> {
    let message = || format!("“{key}” names {} files, but needs {}", files.len(), at + 1);
    files.get(at).map(String::as_str).ok_or_else(|| source.error(META, message()))
}

fn no_range(source: &Source, key: &str, channel: usize) -> crate::Error {
    source.error(META, format!("“{key}” has no mins and maxs for channel {channel}"))
}

/// Returns values at equal distances.
fn spread((low, high): (f64, f64)) -> Levels {
    array::from_fn(|byte| (low + (high - low) * (byte as f64 / 255.0)) as f32)
}

/// Returns the values of a codebook.
fn codebook(source: &Source, key: &str, list: Option<&[Option<f64>]>) -> Result<Levels> {
    let list = list
        .filter(|list| !list.is_empty())
        .ok_or_else(|| source.error(META, format!("“{key}” has no codebook")))?;
    let mut levels = [f32::NAN; 256];
    for (level, value) in levels.iter_mut().zip(list) {
        *level = value.map_or(f32::NAN, |value| value as f32);
    }
    // Some files have null as the first value. PlayCanvas puts a step below the second there.
    if levels[0].is_nan() {
        levels[0] = levels[1] + (levels[1] - levels[255]) / 255.0;
    }
    Ok(levels)
}

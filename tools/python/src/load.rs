//! How files are read, as Python says it.

use crate::errors::{options, wrong};
use serde::Deserialize;
use splatkit::{
    Deadline, Error,
    formats::{Endian, RawLayout, ReadOptions, SampleType},
    glam::DVec3,
    input::Limits,
    memory,
    scattered::SampleOptions,
    session::{Reading, Showing},
};
use std::path::PathBuf;

/// How files are read.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Load {
    scalar: Option<String>,
    dims: Option<[usize; 3]>,
    r#type: Option<String>,
    endian: Option<String>,
    header: Option<u64>,
    time: Option<usize>,
    series: Option<String>,
    dataset: Option<String>,
    spacing: Option<[f64; 3]>,
    missing: Option<f64>,
    labels: Option<PathBuf>,
    radius: Option<f64>,
    neighbours: Option<usize>,
    slopes: Option<bool>,
    limits: LimitOptions,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct LimitOptions {
    points: Option<u64>,
    bytes: Option<u64>,
    depth: Option<usize>,
    texels: Option<u64>,
    seconds: Option<u64>,
}

impl Load {
    /// Reads the options.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let own: Self = options(text)?;
        own.layout()?;
        if own.spacing.is_some_and(|spacing| !spacing.iter().all(|s| *s > 0.0 && s.is_finite())) {
            return Err(wrong("a spacing has a length above 0 for each axis"));
        }
        if own.neighbours.is_some_and(|count| !(4..=64).contains(&count)) {
            return Err(wrong("neighbours is a number from 4 to 64"));
        }
        Ok(own)
    }

    pub fn limits(&self) -> Limits {
        let default = Limits::default();
        Limits {
            points: self.limits.points.unwrap_or(default.points),
            bytes: self.limits.bytes.unwrap_or(default.bytes),
            depth: self.limits.depth.unwrap_or(default.depth),
            texels: self.limits.texels.unwrap_or(default.texels),
            seconds: self.limits.seconds.unwrap_or(default.seconds),
            until: default.until,
        }
    }

    /// Returns what to read of a file.
    fn read_options(&self) -> ReadOptions {
        ReadOptions {
            scalar: self.scalar.clone(),
            raw: self.layout().ok().flatten(),
            time: self.time,
            series: self.series.clone(),
            dataset: self.dataset.clone(),
            spacing: self.spacing.map(DVec3::from_array),
            missing: self.missing,
            labels: Vec::new(),
        }
    }

    /// Completes how an input is shown by what files say, and by when its splats must be made.
    pub fn complete(&self, showing: Showing, deadline: Deadline) -> Showing {
        let (samples, is_named) = (self.sample_options(), self.scalar.is_some());
        Showing { samples, is_named, deadline, ..showing }
    }

    /// Returns how scattered samples become splats.
    fn sample_options(&self) -> SampleOptions {
        let default = SampleOptions::default();
        SampleOptions {
            neighbours: self.neighbours.unwrap_or(default.neighbours),
            radius: self.radius,
            slopes: self.slopes.unwrap_or(default.slopes),
            ..default
        }
    }

    fn layout(&self) -> Result<Option<RawLayout>, Error> {
        let (dims, name) = match (self.dims, &self.r#type) {
            (Some(dims), Some(name)) => (dims, name),
            (None, None) => return Ok(None),
            _ => return Err(wrong("a raw volume needs both dims and type")),
        };
        let types = "u8, i8, u16, i16, u32, i32, u64, i64, f32 or f64";
        let sample_type = SampleType::from_name(name)
            .ok_or_else(|| wrong(format!("the type “{name}” is none of {types}")))?;
        let endian = match self.endian.as_deref() {
            None | Some("little") => Endian::Little,
            Some("big") => Endian::Big,
            Some(other) => {
                return Err(wrong(format!("the byte order “{other}” is neither little nor big")));
            }
        };
        let spacing = self.spacing.map_or(DVec3::ONE, DVec3::from_array);
        let header = self.header.unwrap_or(0);
        Ok(Some(RawLayout { dims, sample_type, spacing, endian, header }))
    }

    /// Whether the caller limits the bytes of inputs.
    pub fn has_bytes(&self) -> bool {
        self.limits.bytes.is_some()
    }

    /// Returns the way to read files.
    pub fn reading(&self) -> Reading {
        let memory = memory::most().filter(|_| !self.has_bytes());
        Reading::new(self.read_options(), self.limits())
            .within_memory(memory)
            .with_label_table(self.labels.clone())
    }
}

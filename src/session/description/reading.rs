//! How inputs are read, as a description says it.

use crate::{
    Deadline, Error, Result,
    about::Modality,
    formats::{Endian, RawLayout, ReadOptions, SampleType},
    input::Limits,
    memory,
    scattered::SampleOptions,
    session::{Reading, Showing},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// How inputs are read: what of them, and what files do not say themselves.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ReadingEntry {
    /// The array, property or column that has the values ([`ReadOptions::scalar`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scalar: Option<String>,
    /// Raw volumes: the number of samples along each axis, the fastest axis first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dims: Option<[usize; 3]>,
    /// Raw volumes: the type of a sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub r#type: Option<SampleType>,
    /// Raw volumes: the byte order; by default little.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub endian: Option<Endian>,
    /// Raw volumes: the bytes before the first sample.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub header: Option<u64>,
    /// Volumes at several times: which one, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<usize>,
    /// DICOM: the series: its number, its UID or a part of its description.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub series: Option<String>,
    /// HDF5 and NPZ: the data set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<String>,
    /// Volumes: the distances between samples along the axes, in world units, instead of the
    /// file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<[f64; 3]>,
    /// A value that stands for “no value”.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<f64>,
    /// Volumes: what measured the values, whatever the file says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modality: Option<Modality>,
    /// Volumes: the array that says how opaque the samples are; the values give the colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opacity_from: Option<String>,
    /// Label maps: a table with names and colours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels: Option<PathBuf>,
    /// Scattered samples: one radius for all, in world units: two standard deviations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Scattered samples: the number of neighbours that kernels and slopes are made from, 4 to 64.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub neighbours: Option<usize>,
    /// Scattered samples: whether they have slopes, fitted to their neighbours; by default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slopes: Option<bool>,
    /// What reading may take.
    #[serde(skip_serializing_if = "is_default")]
    pub limits: LimitsEntry,
    /// By when everything must be read.
    #[serde(skip)]
    pub until: Deadline,
}

/// Limits of reading, where they are not the defaults of [`Limits`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct LimitsEntry {
    /// [`Limits::points`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<u64>,
    /// [`Limits::bytes`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
    /// [`Limits::depth`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<usize>,
    /// [`Limits::texels`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texels: Option<u64>,
    /// [`Limits::seconds`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<u64>,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl LimitsEntry {
    /// Returns a limit that is above its default: its name, its value, and the default. A scene may
    /// only lower limits.
    pub(super) fn raised(&self) -> Option<(&'static str, u64, u64)> {
        let Limits { points, bytes, depth, texels, seconds, .. } = Limits::default();
        let all = [
            ("points", self.points, points),
            ("bytes", self.bytes, bytes),
            ("depth", self.depth.map(|depth| depth as u64), depth as u64),
            ("texels", self.texels, texels),
            ("seconds", self.seconds, seconds),
        ];
        all.into_iter()
            .find_map(|(name, value, most)| Some((name, value.filter(|v| *v > most)?, most)))
    }

    /// Removes all.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}

impl ReadingEntry {
    /// Returns how an input is read that has this entry of its own: what it does not say is as the
    /// entry says that all inputs share. Limits are those of all.
    pub(super) fn beside(&self, shared: &Self) -> Self {
        macro_rules! own_or_shared {
            ($($field:ident),*) => {
                Self {
                    $($field: self.$field.clone().or_else(|| shared.$field.clone()),)*
                    limits: shared.limits,
                    until: shared.until,
                }
            };
        }
        own_or_shared!(
            scalar,
            dims,
            r#type,
            endian,
            header,
            time,
            series,
            dataset,
            spacing,
            missing,
            modality,
            opacity_from,
            labels,
            radius,
            neighbours,
            slopes
        )
    }

    /// Checks what does not depend on the inputs.
    ///
    /// # Errors
    /// [`Error::Argument`] with the name of the field that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|(field, message)| Error::Argument(format!("{field}: {message}")))
    }

    pub(super) fn check(&self) -> std::result::Result<(), super::appearance::Wrong> {
        if self.dims.is_some() != self.r#type.is_some() {
            return Err(("dims", "a raw volume needs both dims and type".into()));
        }
        if self.spacing.is_some_and(|spacing| !spacing.iter().all(|s| *s > 0.0 && s.is_finite())) {
            return Err(("spacing", "must be a length above 0 for each axis".into()));
        }
        if self.radius.is_some_and(|radius| !(radius > 0.0 && radius.is_finite())) {
            return Err(("radius", "must be a length above 0".into()));
        }
        if self.neighbours.is_some_and(|count| !(4..=64).contains(&count)) {
            return Err(("neighbours", "must be a number from 4 to 64".into()));
        }
        Ok(())
    }

    /// Returns the entry for several inputs that share one time limit, which begins now.
    pub fn begun(&self) -> Self {
        Self { until: self.limits().deadline(), ..self.clone() }
    }

    /// Returns the limits of every file that is read.
    pub fn limits(&self) -> Limits {
        let default = Limits::default();
        Limits {
            points: self.limits.points.unwrap_or(default.points),
            bytes: self.limits.bytes.unwrap_or(default.bytes),
            depth: self.limits.depth.unwrap_or(default.depth),
            texels: self.limits.texels.unwrap_or(default.texels),
            seconds: self.limits.seconds.unwrap_or(default.seconds),
            until: self.until,
        }
    }

    /// Returns the way to read inputs. One that is read as a whole must fit into memory, unless the
    /// entry limits bytes itself.
    pub fn reading(&self) -> Reading {
        self.reading_within(memory::most())
    }

    /// As [`reading`](Self::reading), within these bytes of memory.
    pub fn reading_within(&self, memory: Option<u64>) -> Reading {
        Reading::new(self.options(), self.limits())
            .within_memory(memory.filter(|_| self.limits.bytes.is_none()))
            .with_label_table(self.labels.clone())
            .with_modality(self.modality)
            .with_opacity_from(self.opacity_from.clone())
    }

    /// Returns what to read of a file.
    pub fn options(&self) -> ReadOptions {
        let spacing = self.spacing.map(DVec3::from_array);
        let layout = self.dims.zip(self.r#type).map(|(dims, sample_type)| RawLayout {
            dims,
            sample_type,
            spacing: spacing.unwrap_or(DVec3::ONE),
            endian: self.endian.unwrap_or_default(),
            header: self.header.unwrap_or(0),
        });
        ReadOptions {
            scalar: self.scalar.clone(),
            raw: layout,
            time: self.time,
            series: self.series.clone(),
            dataset: self.dataset.clone(),
            spacing,
            missing: self.missing,
            channels: None,
            labels: Vec::new(),
        }
    }

    /// Completes how an input is shown by what says how it is read, and by when its splats must be
    /// made.
    ///
    /// # Errors
    /// Those of [`SampleOptions::validate`].
    pub fn complete(&self, showing: Showing, deadline: Deadline) -> Result<Showing> {
        let is_named = self.scalar.is_some();
        Ok(Showing { samples: self.samples()?, is_named, deadline, ..showing })
    }

    fn samples(&self) -> Result<SampleOptions> {
        let default = SampleOptions::default();
        let options = SampleOptions {
            neighbours: self.neighbours.unwrap_or(default.neighbours),
            radius: self.radius,
            slopes: self.slopes.unwrap_or(default.slopes),
            ..default
        };
        options.validate()?;
        Ok(options)
    }
}

//! Conversions: surfaces to hierarchies and Gaussians, volumes to bricks and NRRD.

use crate::{
    errors::{options, raise, wrong},
    parts::{appearance, reading},
    worker::run,
};
use pyo3::prelude::*;
use serde::Deserialize;
use splatkit::{
    Deadline, Error, Stop, disk,
    glam::DVec3,
    hierarchy::Preset,
    session::{
        self, AppearanceEntry,
        convert::{Resampled, Target},
    },
};
use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

/// How files are converted.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Conversion {
    overwrite: bool,
    preset: Option<String>,
    lossless: bool,
    up: Option<[f64; 3]>,
    unit: Option<String>,
    degree: Option<u32>,
    radius_scale: Option<f32>,
    lattice: Option<String>,
    memory: Option<u64>,
}

/// A conversion with its files.
struct Work {
    files: Vec<PathBuf>,
    output: PathBuf,
    overwrite: bool,
    conversion: session::convert::Conversion,
}

/// Converts files. The extension of the output decides what they become.
#[pyfunction]
pub fn convert(
    py: Python<'_>,
    files: Vec<PathBuf>,
    output: PathBuf,
    conversion: &str,
    load: &str,
    appearance: &str,
) -> PyResult<()> {
    let made = || -> Result<Work, Error> {
        let (given, appearance): (Conversion, _) =
            (options(conversion)?, self::appearance(appearance)?);
        let (overwrite, conversion) = (given.overwrite, given.conversion(&appearance, load)?);
        // From here on, numbers that are wrong are those of files.
        conversion.surfel_options(Deadline::NEVER).validate()?;
        Ok(Work { files, output, overwrite, conversion })
    };
    let work = made().map_err(|error| raise(py, &error))?;
    let stop = Stop::default();
    let stopped = stop.clone();
    run(py, &stop, move || work.run(&stopped))
}

impl Conversion {
    /// Returns the conversion of the library.
    fn conversion(
        self,
        appearance: &AppearanceEntry,
        load: &str,
    ) -> Result<session::convert::Conversion, Error> {
        let up = self.up.map(|up| DVec3::from_array(up).try_normalize());
        if up == Some(None) {
            return Err(wrong("up is a direction with a length above 0"));
        }
        let load = reading(load)?;
        Ok(session::convert::Conversion {
            reading: load.reading(),
            fits_memory: load.limits.bytes.is_none(),
            coloring: appearance.coloring(),
            preset: self.preset()?,
            lattice: self.lattice()?,
            lossless: self.lossless,
            radius_scale: self.radius_scale.unwrap_or(1.0),
            up: up.flatten(),
            unit: self.unit,
            degree: self.degree,
            memory: self.memory,
            ..session::convert::Conversion::default()
        })
    }

    fn preset(&self) -> Result<Preset, Error> {
        Ok(match self.preset.as_deref() {
            None | Some("balanced") => Preset::Balanced,
            Some("fastest") => Preset::Fastest,
            Some("fast") => Preset::Fast,
            Some("slow") => Preset::Slow,
            Some("best") => Preset::Best,
            Some(other) => {
                return Err(wrong(format!(
                    "the preset “{other}” is none of fastest, fast, balanced, slow and best"
                )));
            }
        })
    }

    fn lattice(&self) -> Result<Option<Resampled>, Error> {
        Ok(match self.lattice.as_deref() {
            None => None,
            Some("cartesian") => Some(Resampled::Cartesian),
            Some("bcc") => Some(Resampled::BodyCentred),
            Some(other) => return Err(wrong(format!("the lattice “{other}” is not bcc"))),
        })
    }
}

impl Work {
    /// Converts to a file beside the output, which takes its place at the end. So an interrupted
    /// conversion leaves no file, although nothing stops its thread.
    fn run(&self, stop: &Stop) -> Result<(), Error> {
        self.check_output()?;
        let part = self.part();
        let done = self.conversion.convert(&self.files, &part, &()).and_then(|_| {
            if stop.is_requested() {
                return Err(Error::Stopped);
            }
            let renamed = disk::rename(&part, &self.output, self.overwrite);
            renamed.map_err(|error| Error::output(&self.output, error))
        });
        if done.is_err() {
            // It may not be there.
            fs::remove_file(&part).ok();
        }
        done.map_err(|error| match error {
            Error::Output { source, .. } => Error::output(&self.output, source),
            other => other,
        })
    }

    /// Returns the name of the unfinished file. It ends as the output does.
    fn part(&self) -> PathBuf {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let name = self.output.file_name().unwrap_or_default().to_string_lossy();
        let (process, count) = (std::process::id(), COUNT.fetch_add(1, Relaxed));
        self.output.with_file_name(format!(".splatkit-{process}-{count}-{name}"))
    }

    fn check_output(&self) -> Result<(), Error> {
        let refuse = |message: &str| {
            let source = std::io::Error::other(message.to_owned());
            Err(Error::output(&self.output, source))
        };
        if self.output.is_dir() {
            return refuse("it is a folder");
        }
        if !self.overwrite && self.output.symlink_metadata().is_ok() {
            let source = std::io::Error::from(std::io::ErrorKind::AlreadyExists);
            return Err(Error::output(&self.output, source));
        }
        let real = self.output.canonicalize().ok();
        let is_same = |file: &Path| real.is_some() && file.canonicalize().ok() == real;
        if self.files.iter().any(|file| is_same(file)) {
            return refuse("it is an input too");
        }
        if self.files.is_empty() {
            return Err(wrong("there is nothing to convert"));
        }
        // The name of the unfinished file would be wrong instead.
        Target::of(&self.output).map(drop)
    }
}

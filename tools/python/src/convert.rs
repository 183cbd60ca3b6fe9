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
    edit::Edit,
    glam::DVec3,
    hierarchy::{Preset, external::Plan},
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
    spz_version: Option<u32>,
    radius_scale: Option<f32>,
    lattice: Option<String>,
    memory: Option<u64>,
    /// The number of parts of a conversion in parts.
    parts: Option<u32>,
    /// The names and values of edits.
    edits: Vec<(String, String)>,
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

/// Plans a conversion in parts, and writes the plan to a folder as `plan.json`. Returns the number
/// of parts. A plan that is there already is kept.
#[pyfunction]
pub fn plan_parts(
    py: Python<'_>,
    files: Vec<PathBuf>,
    folder: PathBuf,
    conversion: &str,
    load: &str,
    appearance: &str,
) -> PyResult<u32> {
    let plan = folder.join("plan.json");
    if plan.exists() {
        return run(py, &Stop::default(), move || Ok(Plan::open(&plan)?.parts()));
    }
    let given: Result<Conversion, Error> = options(conversion);
    let made = given.and_then(|given| {
        let conversion = given.conversion(&self::appearance(appearance)?, load)?;
        conversion.surfel_options(Deadline::NEVER).validate()?;
        Ok(conversion)
    });
    let conversion = made.map_err(|error| raise(py, &error))?;
    run(py, &Stop::default(), move || Ok(conversion.plan(&files, &folder, &(), || Ok(()))?.parts()))
}

/// Makes a part of a plan, unless it is finished and intact.
#[pyfunction]
pub fn make_part(py: Python<'_>, plan: PathBuf, index: u32, load: &str) -> PyResult<()> {
    let limits = reading(load).map_err(|error| raise(py, &error))?.limits();
    run(py, &Stop::default(), move || Plan::open(&plan)?.part(index, &limits, None).map(drop))
}

/// Joins the parts of a plan to a file, which appears whole or not at all.
#[pyfunction]
pub fn join_parts(py: Python<'_>, plan: PathBuf, output: PathBuf, overwrite: bool) -> PyResult<()> {
    let stop = Stop::default();
    let stopped = stop.clone();
    run(py, &stop, move || {
        let part = part_of(&output);
        finished(&output, overwrite, &part, &stopped, || {
            Plan::open(&plan)?.join(&part, None).map(drop)
        })
    })
}

/// Writes a file beside the output, which takes its place at the end. So interrupted work leaves no
/// file, although nothing stops its thread.
fn finished(
    output: &Path,
    overwrite: bool,
    part: &Path,
    stop: &Stop,
    write: impl FnOnce() -> Result<(), Error>,
) -> Result<(), Error> {
    let done = write().and_then(|()| {
        if stop.is_requested() {
            return Err(Error::Stopped);
        }
        let renamed = disk::rename(part, output, overwrite);
        renamed.map_err(|error| Error::output(output, error))
    });
    if done.is_err() {
        // It may not be there.
        fs::remove_file(part).ok();
    }
    done.map_err(|error| match error {
        Error::Output { source, .. } => Error::output(output, source),
        other => other,
    })
}

/// Returns the name of an unfinished file. It ends as the output does.
fn part_of(output: &Path) -> PathBuf {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name = output.file_name().unwrap_or_default().to_string_lossy();
    let (process, count) = (std::process::id(), COUNT.fetch_add(1, Relaxed));
    output.with_file_name(format!(".splatkit-{process}-{count}-{name}"))
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
        let edit = |(name, value): &(String, String)| {
            Edit::parse(name, value).map_err(|message| wrong(format!("the edit {name}: {message}")))
        };
        let edits = self.edits.iter().map(edit).collect::<Result<_, _>>()?;
        let load = reading(load)?;
        Ok(session::convert::Conversion {
            reading: load.reading(),
            fits_memory: load.limits.bytes.is_none(),
            coloring: appearance.coloring(),
            edits,
            preset: self.preset()?,
            lattice: self.lattice()?,
            lossless: self.lossless,
            radius_scale: self.radius_scale.unwrap_or(1.0),
            up: up.flatten(),
            unit: self.unit,
            degree: self.degree,
            spz_version: self.spz_version.unwrap_or(3),
            memory: self.memory,
            parts: self.parts,
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
    fn run(&self, stop: &Stop) -> Result<(), Error> {
        self.check_output()?;
        if self.output.file_name().is_some_and(|name| name == "meta.json") {
            // It names the planes beside it, which appear together with it.
            disk::may_replace(&self.output, self.overwrite);
            return self.conversion.convert(&self.files, &self.output, &()).map(drop);
        }
        let part = part_of(&self.output);
        finished(&self.output, self.overwrite, &part, stop, || {
            self.conversion.convert(&self.files, &part, &()).map(drop)
        })
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

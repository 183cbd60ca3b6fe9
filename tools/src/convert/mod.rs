//! `splatkit convert`: the output's extension decides what the inputs become.

mod edits;
mod parts;
mod report;
mod surface;

use crate::{
    color::ColorFlags,
    failure::Failure,
    given::{self, Given},
    load::LoadFlags,
    output, parse,
    progress::{Progress, Stages},
    timing::milliseconds,
};
use clap::{Args, ValueEnum};
use splatkit::{
    edit::Change,
    session::convert::{Conversion, Resampled, Target, Watch},
};
use std::{
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    time::Instant,
};

#[derive(Args, Debug)]
pub struct Convert {
    /// Meshes, point clouds, hierarchies and trained Gaussians, which are merged into one; or a
    /// single volume. Addresses are inputs too (docs/remote.md).
    #[arg(
        value_name = "FILE",
        required_unless_present_any = ["part", "join"],
        value_parser = parse::input()
    )]
    files: Vec<PathBuf>,
    /// Write to this file. Meshes, point clouds, hierarchies and trained Gaussians become .splk, a
    /// hierarchy of splats; or 3D Gaussians for other viewers: .ply, .compressed.ply, .splat, .spz,
    /// .sog, meta.json with its planes beside it, lod-meta.json with levels of detail in folders
    /// beside it, or .glb. Meshes and point clouds become points with all their attributes: .las,
    /// .laz or .points.ply; or with colours and intensities alone: .e57. A volume becomes .nrrd, or
    /// .splv, levels of bricks that are read one by one.
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["plan", "part"])]
    output: Option<PathBuf>,
    /// Resample a Cartesian volume. bcc is the body-centred cubic lattice, which has 29.3 % fewer
    /// samples for the same detail in all directions [default: the file's lattice]
    #[arg(long, value_name = "NAME")]
    lattice: Option<Wanted>,
    /// Replace an existing file.
    #[arg(long)]
    overwrite: bool,
    /// Print how large the result would be and what making it would take, by trying a part; write
    /// nothing.
    #[arg(long)]
    dry_run: bool,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    edits: edits::EditFlags,
    /// What the edits have done.
    #[arg(skip)]
    changes: Mutex<Vec<Change>>,
    #[command(flatten)]
    parts: parts::PartFlags,
    #[command(flatten)]
    surface: surface::SurfaceFlags,
    #[command(flatten)]
    color: ColorFlags,
    /// Spread the colour map over these values [default: all values of a mesh, the 1st to the 99th
    /// percentile of a point cloud]
    #[arg(
        long,
        help_heading = "Appearance",
        value_name = "LOW,HIGH",
        value_parser = parse::range,
        allow_hyphen_values = true
    )]
    range: Option<[f64; 2]>,
    #[command(flatten)]
    load: LoadFlags,
}

/// The lattices that can be chosen.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq)]
enum Wanted {
    Cartesian,
    Bcc,
}

/// What the command hears of a conversion.
struct Hearing<'a> {
    convert: &'a Convert,
    stages: Stages<'a>,
}

impl Watch for Hearing<'_> {
    type Error = Failure;

    fn stage(&self, name: &str) {
        self.stages.begin(name);
    }

    fn progress(&self, stage: &'static str, done: u64, all: u64) {
        self.stages.set(stage, done, all);
    }

    fn has_read(&self, files: &[PathBuf]) -> Result<(), Failure> {
        let Convert { dry_run, .. } = self.convert;
        if *dry_run { Ok(()) } else { output::check_unneeded(self.convert.output(), files) }
    }

    fn has_colored(&self, is_mesh: bool, has_values: bool) -> Result<(), Failure> {
        self.convert.color.check_effect(is_mesh, has_values)
    }

    fn has_edited(&self, changes: &[Change]) {
        self.convert.changes.lock().unwrap_or_else(PoisonError::into_inner).extend(changes);
    }
}

impl Convert {
    pub fn run(mut self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        if let Some(plan) = &self.parts.part {
            return self.make_part(plan, given, progress);
        }
        let extension = self.extension();
        let target = Target::of(self.output())?;
        self.parts.check(&extension)?;
        if let Some(plan) = &self.parts.join {
            return self.join_parts(plan, given, progress);
        }
        match target {
            Target::Points if extension == "ply" => self.surface.check("points.ply")?,
            _ => self.surface.check(&extension)?,
        }
        self.check_target(target)?;
        self.color.check(&self.files)?;
        self.color = self.color.of(&self.files[0]);
        self.warn(given, progress);
        if !self.dry_run && self.parts.plan.is_none() {
            output::check(self.output(), self.overwrite)?;
            output::try_writing(self.output(), &self.files)?;
        }
        if self.lattice.is_some() && extension != "nrrd" {
            return Err(Failure::Usage("--lattice is for volumes written as .nrrd".into()));
        }
        self.make(progress)
    }

    /// Converts the files, or finds what that would take, and prints it.
    fn make(&self, progress: &Progress) -> Result<(), Failure> {
        let (conversion, start) = (self.conversion(), Instant::now());
        let hearing = Hearing { convert: self, stages: progress.stages() };
        if self.dry_run {
            let expected = conversion.expect(&self.files, self.output(), &hearing)?;
            drop(hearing);
            progress.clear();
            return self.print_expected(&expected);
        }
        if let Some(folder) = &self.parts.plan {
            let may_write = || self.check_plan(folder);
            let plan = conversion.plan(&self.files, folder, &hearing, may_write)?;
            drop(hearing);
            progress.clear();
            return self.print_plan(&plan);
        }
        let converted = conversion.convert(&self.files, self.output(), &hearing)?;
        drop(hearing);
        progress.clear();
        self.print(&converted, milliseconds(start))
    }

    /// Refuses flags without effect on a target.
    fn check_target(&self, target: Target) -> Result<(), Failure> {
        let is_volume = matches!(target, Target::Nrrd | Target::Bricks);
        let color = self.color.given().or(self.range.map(|_| "--range"));
        match (color, self.edits.0.first()) {
            (Some(flag), _) if is_volume => {
                Err(Failure::Usage(format!("{flag} colours meshes and point clouds, not volumes")))
            }
            (Some(flag), _) if target == Target::Points => Err(Failure::Usage(format!(
                "{flag} has no effect on files of points, which keep the attributes and colours of \
                 their inputs"
            ))),
            (_, Some(_)) if is_volume => Err(Failure::Usage(
                "edits such as --crop and --where are for meshes, point clouds, hierarchies and \
                 trained Gaussians, not for volumes"
                    .into(),
            )),
            _ => Ok(()),
        }
    }

    fn conversion(&self) -> Conversion {
        Conversion {
            reading: self.load.reading(None),
            fits_memory: !self.load.has_bytes(),
            coloring: self.color.coloring(self.range),
            edits: self.edits.0.clone(),
            lattice: self.lattice.map(|lattice| match lattice {
                Wanted::Cartesian => Resampled::Cartesian,
                Wanted::Bcc => Resampled::BodyCentred,
            }),
            in_regions: self.parts.divide(),
            parts: self.parts.parts,
            ..self.surface.conversion()
        }
    }

    /// Returns the file to write; a name that plans stand for if none is given.
    fn output(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new("out.splk"))
    }

    fn extension(&self) -> String {
        let extension = self.output().extension();
        extension.map_or(String::new(), |text| text.to_string_lossy().to_ascii_lowercase())
    }

    /// Warns of flags that change nothing in any conversion of these files.
    fn warn(&self, given: &Given, progress: &Progress) {
        // What cannot be read fails later.
        let reading = self.load.reading(None);
        let is_raw = |path: &PathBuf| {
            reading.layout().is_some() && reading.open(path).map_or(true, |opened| opened.is_raw())
        };
        let raw = if self.files.iter().any(is_raw) { 0 } else { given::RAW };
        given.warn_of_file(&self.files[0], given::ALL & !raw, progress);
    }
}

#[cfg(test)]
mod tests {
    use super::Target;
    use splatkit::formats::FORMATS;

    /// The extensions of outputs.
    const WRITTEN: [&str; 10] =
        ["splk", "ply", "splat", "spz", "sog", "glb", "las", "e57", "nrrd", "splv"];

    #[test]
    fn every_format_with_a_writer_is_written() {
        let written: Vec<&str> = FORMATS.iter().filter_map(|format| format.written).collect();
        assert_eq!(written, WRITTEN);
        for extension in written.into_iter().chain(["laz"]) {
            assert!(Target::of(format!("a.{extension}").as_ref()).is_ok(), "{extension}");
        }
    }
}

//! Flags that have no effect on the inputs: a table of what each flag needs, and the warnings.

use crate::{flag_names, progress::Progress};
use clap::{ArgMatches, parser::ValueSource};
use splatkit::{
    formats::{Format, Kind},
    session::{Data, Description, LoadedInput},
};
use std::{collections::BTreeSet, path::Path};

/// The flags that the user has given, by their names without dashes.
#[derive(Debug, Clone, Default)]
pub struct Given(BTreeSet<String>);

/// What inputs are, and how a picture of them is drawn: a bit for each.
pub type Kinds = u32;

/// Triangles.
pub const MESH: Kinds = 1;
/// Points without triangles.
pub const CLOUD: Kinds = 1 << 1;
pub const HIERARCHY: Kinds = 1 << 2;
/// Samples on a lattice.
pub const VOLUME: Kinds = 1 << 3;
pub const BRICKS: Kinds = 1 << 4;
/// Samples at any places.
pub const SAMPLES: Kinds = 1 << 5;
/// A volume whose layout the flags give.
pub const RAW: Kinds = 1 << 6;
/// Cells of a mesh of volumes.
pub const CELLS: Kinds = 1 << 7;

/// Trained 3D Gaussians.
pub const GAUSSIANS: Kinds = 1 << 8;

/// Lines, alone or beside triangles.
pub const LINES: Kinds = 1 << 9;

/// Any input.
pub const ALL: Kinds = Kinds::MAX;

/// All that have values which a transfer function shows.
const FIELD: Kinds = VOLUME | BRICKS | SAMPLES | CELLS;
const LATTICE: Kinds = VOLUME | BRICKS;

/// What each flag is for. Flags that are for everything are not listed.
const NEEDS: &[(&str, Kinds)] = &[
    ("dims", RAW),
    ("type", RAW),
    ("spacing", VOLUME | RAW),
    ("endian", RAW),
    ("header", RAW),
    ("scalar", MESH | CLOUD | LATTICE | SAMPLES | CELLS),
    ("missing", VOLUME | SAMPLES | CELLS),
    ("labels", VOLUME),
    ("modality", VOLUME),
    ("opacity-from", VOLUME),
    ("radius", SAMPLES),
    ("neighbours", SAMPLES),
    ("no-slopes", SAMPLES),
    ("channels", LATTICE),
    ("split-channels", LATTICE),
    ("transfer", FIELD),
    ("opacity-unit", FIELD),
    ("iso", FIELD),
    ("gradient-opacity", FIELD),
    ("kernel", LATTICE),
    ("sigma", LATTICE),
    ("extent", LATTICE),
    ("sharp", LATTICE),
    ("radius-scale", MESH | CLOUD),
    ("opacity", MESH | CLOUD | CELLS),
    ("points", CLOUD),
    ("point-size", CLOUD),
    ("point-radius", CLOUD),
    ("line-width", LINES),
    ("crease", MESH | CELLS),
    ("edges", MESH | CELLS),
    ("cells", CELLS),
    ("gradient", FIELD),
    ("evaluate", LATTICE),
    ("shade", FIELD),
    ("cut", HIERARCHY | BRICKS),
    ("budget", HIERARCHY | BRICKS),
    ("frame-time", HIERARCHY | BRICKS),
    ("memory", HIERARCHY | BRICKS),
    ("cull-backfaces", HIERARCHY),
    ("classify", FIELD),
];

/// Flags that some formats read, and the words by which their names in the table of formats are
/// known. Folders hold series and slices.
const READ_BY: &[(&str, &[&str])] = &[
    (
        "time",
        &[
            "NIfTI",
            "MetaImage",
            "MRC",
            "NPY",
            "NPZ",
            "TIFF",
            "HDF",
            "DICOM",
            "Zarr",
            "several files",
        ],
    ),
    ("series", &["DICOM"]),
    ("dataset", &["HDF", "NPZ", "Zarr"]),
];

/// The names of kinds, for messages.
const NAMES: [(Kinds, &str, &str); 10] = [
    (MESH, "meshes", "a mesh"),
    (CLOUD, "point clouds", "a point cloud"),
    (HIERARCHY, "hierarchies", "a hierarchy"),
    (VOLUME, "volumes", "a volume"),
    (BRICKS, "volumes in bricks", "a volume in bricks"),
    (SAMPLES, "scattered samples", "a set of samples"),
    (LINES, "lines", "a set of lines"),
    (CELLS, "cells", "a set of cells"),
    (GAUSSIANS, "trained Gaussians", "a set of trained Gaussians"),
    (RAW, "raw volumes", "a raw volume"),
];

/// Flags of reading that matter when a picture is drawn.
const DRAWN: [&str; 3] = ["radius", "neighbours", "no-slopes"];

/// Pairs of flags of which the first has no effect if the second is given, and why.
const IDLE: &[(&str, &str, &str)] = &[
    ("up", "view-up", "with --camera-position, --view-up says what is up in the picture"),
    ("view-angle", "orthographic", "there is no perspective"),
    ("gpu-timeout", "reference", "the reference draws on the processor"),
    ("gpu-memory", "reference", "the reference draws on the processor"),
    ("pass-entries", "reference", "the reference has no depth passes"),
    ("no-occlusion", "reference", "the reference draws all parts in any case"),
    ("evaluate", "reference", "the reference has its own sums"),
    ("frame-time", "reference", "the reference takes as long as it takes"),
    ("memory", "reference", "the reference keeps everything in memory"),
];

impl Given {
    /// Takes the flags on the command line from what clap found there.
    pub fn of(matches: &ArgMatches) -> Self {
        let task = matches.subcommand().map_or(matches, |(_, task)| task);
        let is_given = |id: &&str| task.value_source(id) == Some(ValueSource::CommandLine);
        // Names of fields have underscores; one differs from its flag.
        let name = |id: &str| match id {
            "sample_type" => "type".to_owned(),
            id => id.replace('_', "-"),
        };
        Self(task.ids().map(clap::Id::as_str).filter(is_given).map(name).collect())
    }

    /// Returns these flags and those that a scene stands for.
    pub fn with(&self, scene: &Description) -> Self {
        let mut all = self.0.clone();
        // A path that is no text has no JSON.
        let mut named = scene.clone();
        named.inputs.iter_mut().for_each(|input| input.file = "input".into());
        let Ok(scene) = serde_json::to_value(named) else { return self.clone() };
        let inputs = scene["inputs"].as_array().into_iter().flatten();
        for part in inputs.chain([&scene]) {
            all.extend(part.get("edits").map(|_| "edit".to_owned()));
            let parts = ["reading", "transform", "appearance", "framing", "picture", "overlay"];
            for (field, value) in
                parts.into_iter().filter_map(|name| part[name].as_object()).flatten()
            {
                let limits = value.as_object().filter(|_| field == "limits");
                all.extend(limits.into_iter().flatten().map(|(limit, _)| format!("limit-{limit}")));
                let is_negated = *value == serde_json::json!(false) && field != "cull_backfaces";
                all.insert(match is_negated {
                    true => format!("no-{}", field.replace('_', "-")),
                    false => flag_names::flag_of(field),
                });
            }
        }
        Self(all)
    }

    pub fn has(&self, flag: &str) -> bool {
        self.0.contains(flag)
    }

    /// Returns a given flag that is none of these, if there is one.
    pub fn other_than(&self, flags: &[&str]) -> Option<&str> {
        // Groups of flags are listed by the names of their types.
        let is_flag = |name: &str| name.starts_with(|first: char| first.is_ascii_lowercase());
        self.0.iter().map(String::as_str).find(|name| is_flag(name) && !flags.contains(name))
    }

    /// Returns a warning for each given flag that has no effect on inputs of these kinds.
    pub fn idle(&self, inputs: &[(&Path, Kinds)]) -> Vec<String> {
        let all = inputs.iter().fold(0, |all, (_, kinds)| all | kinds);
        let needless = NEEDS.iter().filter(|(flag, needs)| self.has(flag) && all & needs == 0);
        let mut warnings: Vec<String> = needless
            .map(|(flag, needs)| {
                let (path, kinds) = inputs[0];
                let reason = match inputs.len() {
                    1 => format!("{} is {}", path.display(), one_of(kinds)),
                    _ => "no input is one".to_owned(),
                };
                format!("--{flag} has no effect: it is for {}, but {reason}", plural_of(*needs))
            })
            .collect();
        warnings.extend(self.unread(inputs));
        for (flag, other, why) in IDLE {
            let is_placed = self.has("camera-position") || self.has("distance");
            let counts = match *flag {
                "up" => self.has("camera-position"),
                // At a given distance, the angle sets the height of the picture.
                "view-angle" => !is_placed,
                _ => true,
            };
            if counts && self.has(flag) && self.has(other) {
                warnings.push(format!("--{flag} has no effect: {why}"));
            }
        }
        warnings
    }

    /// Returns a warning for each given flag that no input's format reads.
    fn unread(&self, inputs: &[(&Path, Kinds)]) -> impl Iterator<Item = String> {
        let is_unread = |words: &[&str]| {
            inputs.iter().all(|(path, _)| {
                let name = Format::of_path(path).map_or("", |format| format.name);
                let reads = words.iter().any(|word| name.contains(word));
                !(reads || name.is_empty() || path.is_dir())
            })
        };
        let given = READ_BY.iter().filter(|(flag, _)| self.has(flag));
        given.filter(move |(_, words)| is_unread(words)).map(|(flag, words)| {
            format!("--{flag} has no effect: only files of these have one: {}", words.join(", "))
        })
    }

    /// Prints the warnings for a file that is read and not drawn.
    pub fn warn_of_file(&self, path: &Path, kinds: Kinds, progress: &Progress) {
        for flag in DRAWN.iter().filter(|flag| self.has(flag)) {
            progress.warn(format_args!(
                "--{flag} has no effect: it is for pictures of scattered samples"
            ));
        }
        let rest = self.0.iter().filter(|flag| !DRAWN.contains(&flag.as_str())).cloned().collect();
        Self(rest).warn(&[(path, kinds)], progress);
    }

    /// Prints these warnings.
    pub fn warn(&self, inputs: &[(&Path, Kinds)], progress: &Progress) {
        self.idle(inputs).into_iter().for_each(|warning| progress.warn(warning));
    }
}

/// Returns what a loaded input is.
pub fn kinds_of_input(input: &LoadedInput) -> Kinds {
    match (input.kind, input.is_cloud) {
        (Kind::Mesh, _) if input.has_lines => MESH | LINES,
        (Kind::Mesh, true) => CLOUD,
        (Kind::Mesh, false) => MESH,
        (Kind::Volume, _) if input.is_raw => VOLUME | RAW,
        (Kind::Volume, _) => VOLUME,
        (Kind::Samples, _) => SAMPLES,
        (Kind::Hierarchy, _) => HIERARCHY,
        (Kind::Bricks, _) => BRICKS,
        (Kind::Cells, _) => CELLS,
        (Kind::Gaussians, _) => GAUSSIANS,
    }
}

/// Returns what an input is. `is_raw`: the flags give its layout.
pub fn kinds_of(input: &Data, is_raw: bool) -> Kinds {
    match input {
        Data::Mesh(mesh) if !mesh.lines.is_empty() => MESH | LINES,
        Data::Mesh(mesh) if mesh.triangles.is_empty() => CLOUD,
        Data::Mesh(_) => MESH,
        Data::Volume(_) if is_raw => VOLUME | RAW,
        Data::Volume(_) => VOLUME,
        Data::Samples(_) => SAMPLES,
        Data::Hierarchy(_) => HIERARCHY,
        Data::Bricks(_) => BRICKS,
        Data::Cells(_) => CELLS,
        Data::Gaussians(_) => GAUSSIANS,
    }
}

fn one_of(kinds: Kinds) -> &'static str {
    NAMES.iter().find(|(kind, ..)| kinds & kind != 0).map_or("something else", |(.., one)| one)
}

fn plural_of(kinds: Kinds) -> String {
    let names: Vec<&str> =
        NAMES.iter().filter(|(kind, ..)| kinds & kind != 0).map(|(_, many, _)| *many).collect();
    match &names[..] {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(flags: &[&str]) -> Given {
        Given(flags.iter().map(|flag| (*flag).to_owned()).collect())
    }

    #[test]
    fn idle_flags_are_named() {
        let mesh = (Path::new("a.ply"), MESH);
        let volume = (Path::new("b.nrrd"), VOLUME);
        let warnings = given(&["sigma", "size", "crease"]).idle(&[mesh]);
        assert_eq!(
            warnings,
            ["--sigma has no effect: it is for volumes and volumes in bricks, but a.ply is a mesh"]
        );
        assert!(given(&["sigma", "crease"]).idle(&[mesh, volume]).is_empty());
        let warnings = given(&["radius"]).idle(&[mesh, volume]);
        assert_eq!(
            warnings,
            ["--radius has no effect: it is for scattered samples, but no input is one"]
        );
        assert_eq!(given(&["dims", "type"]).idle(&[volume]).len(), 2);
        assert!(given(&["dims", "type"]).idle(&[(volume.0, VOLUME | RAW)]).is_empty());
    }

    #[test]
    fn flags_that_others_replace_are_named() {
        let mesh = [(Path::new("a.ply"), MESH)];
        assert_eq!(given(&["up", "view-up", "camera-position"]).idle(&mesh).len(), 1);
        assert!(given(&["up", "view-up"]).idle(&mesh).is_empty());
        assert_eq!(given(&["view-angle", "orthographic"]).idle(&mesh).len(), 1);
        assert!(given(&["view-angle", "orthographic", "distance"]).idle(&mesh).is_empty());
    }
}

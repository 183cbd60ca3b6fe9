//! Scene files on the command line. Flags beside a scene file count more than its own fields.

use crate::{
    failure::Failure,
    flag_names::{field_of, flag_of},
    given::Given,
};
use serde_json::Value;
use splatkit::{
    Error,
    formats::{Kind, ReadOptions},
    input::{Limits, Source},
    session::Description,
};
use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
};

/// Flags that say what the command does, rather than what the picture is.
pub const NOT_OF_PICTURES: &[&str] = &[
    "output",
    "bits",
    "depth",
    "layers",
    "split-channels",
    "overwrite",
    "json",
    "turntable",
    "path",
    "times",
    "fps",
    "raw",
    "help",
    "version",
    "verbose",
    "quiet",
    "threads",
    "cache",
    "cache-size",
    "allow-host",
    "trust-scene",
    "reference",
];

/// Flags whose values no picture is made of, beside those: they say how it is made.
const NOT_VALUES: &[&str] = &[
    "inputs",
    "engine",
    "gpu",
    "gpu-timeout",
    "gpu-memory",
    "pass-entries",
    "memory",
    "limit-points",
    "limit-bytes",
    "limit-depth",
    "limit-texels",
    "limit-seconds",
];

/// Flags of the camera.
const CAMERA: &[&str] = &[
    "camera",
    "view-of",
    "view",
    "camera-position",
    "focal-point",
    "view-up",
    "view-angle",
    "distance",
    "azimuth",
    "elevation",
    "orthographic",
    "path",
    "zoom",
    "up",
];

/// Returns whether a file is a scene file, by its name. The `meta.json` of trained Gaussians (SOG)
/// is none.
pub fn is_scene(path: &Path) -> bool {
    let kind = || Kind::of(path, &Limits::default(), &ReadOptions::default());
    path.extension() == Some(OsStr::new("json")) && !matches!(kind(), Ok(Some(Kind::Gaussians)))
}

/// Refuses a scene file where a file of data is needed, also one that is damaged. A model of glTF
/// may have a scene file's extension.
pub fn refuse(path: &Path) -> Result<(), Failure> {
    let limits = Limits::default();
    let is_model = || {
        let source = Source::open(path, &limits);
        let text = source.and_then(|source| source.small_text("a model", usize::MAX)).ok();
        let json: Option<Value> = text.and_then(|text| serde_json::from_str(&text).ok());
        json.is_some_and(|json| json.get("asset").is_some())
    };
    if !is_scene(path) || path.is_dir() {
        return Ok(());
    }
    if let Err(error) = Description::read_trusted(path, &limits) {
        return if is_model() { Ok(()) } else { Err(error.into()) };
    }
    let error = Error::input(path, "file", "is a scene file, which names files of data");
    Err(error.hint("splatkit render draws it; name one of its inputs here").into())
}

/// Reads a scene file. Only a trusted one may name files outside its folder, and addresses.
pub fn read(path: &Path, is_trusted: bool) -> splatkit::Result<Description> {
    let limits = Limits::default();
    match is_trusted {
        true => Description::read_trusted(path, &limits),
        false => Description::read(path, &limits),
    }
}

/// Returns the scene of some inputs: the one that a scene file describes, with where it is stated,
/// or one of these inputs with nothing else set.
pub fn open(
    inputs: &[PathBuf],
    is_trusted: bool,
    given: &Given,
) -> Result<(Description, Option<Stated>), Failure> {
    let Some(path) = inputs.iter().find(|path| is_scene(path)) else {
        return Ok((Description::new(inputs.iter().cloned()), None));
    };
    if inputs.len() > 1 {
        return Err(Failure::Usage(format!(
            "{}: a scene file is drawn alone; add the other files to its inputs",
            path.display()
        )));
    }
    let scene = read(path, is_trusted)?;
    if scene.visible().next().is_none() {
        return Err(Error::input(path, "inputs", "none of them is visible").into());
    }
    // What a scene file states is text.
    let fields = serde_json::to_value(&scene).unwrap_or_default();
    let stated = Stated { path: path.clone(), fields, given: given.clone() };
    Ok((scene, Some(stated)))
}

/// Which values a scene file states, and which the user.
#[derive(Debug, Clone)]
pub struct Stated {
    path: PathBuf,
    /// The scene file as JSON.
    fields: Value,
    given: Given,
}

impl Stated {
    /// Returns the failure for a field of a scene with the user's flags: the scene's, unless the
    /// user has given the flag.
    pub fn wrong(&self, place: String, message: String) -> Failure {
        let flag = flag_of(&place);
        if self.given.has(&flag) {
            return Failure::Usage(format!("--{flag}: {message}"));
        }
        Error::input(&self.path, place, message).into()
    }

    /// Makes a failure that looks like wrong usage the scene's, if the scene states the flags that
    /// it names. If it names none, it is about values, which are the scene's unless the user has
    /// given some. `written` are the files that the user wants written.
    pub fn blamed(&self, failure: Failure, written: &[&Path]) -> Failure {
        let (Failure::Usage(what)
        | Failure::Library(Error::Argument(what) | Error::Transfer(what))) = &failure
        else {
            return failure;
        };
        let flags: Vec<&str> = flags_in(what).collect();
        let of_camera = what.starts_with("the camera");
        let is_users = match &flags[..] {
            [] if of_camera => CAMERA.iter().any(|flag| self.given.has(flag)),
            [] => {
                let others = [NOT_OF_PICTURES, NOT_VALUES].concat();
                matches!(failure, Failure::Usage(_))
                    || written.iter().any(|file| what.contains(&*file.to_string_lossy()))
                    || self.given.other_than(&others).is_some()
            }
            named => named.iter().any(|flag| self.given.has(flag)),
        };
        if is_users {
            return failure;
        }
        let place = match flags.first() {
            Some(flag) => self.place(flag),
            None if of_camera && self.fields.get("camera").is_some() => "camera".into(),
            None if of_camera => "framing".into(),
            None => "scene".into(),
        };
        Error::input(&self.path, format!("“{place}”"), what.clone()).into()
    }

    /// Returns the place of what a flag says, if the scene states it.
    fn place(&self, flag: &str) -> String {
        let field = field_of(flag);
        let parts = ["reading", "appearance", "framing", "picture", "overlay"];
        let has = |part: &Value| part.get(&field).is_some();
        if let Some(part) = parts.into_iter().find(|part| self.fields.get(part).is_some_and(has)) {
            return format!("{part}.{field}");
        }
        if let Some(limit) = flag.strip_prefix("limit-") {
            return format!("reading.limits.{limit}");
        }
        let inputs = self.fields["inputs"].as_array().map_or(&[][..], Vec::as_slice);
        let place = inputs.iter().enumerate().find_map(|(number, input)| {
            let part = ["reading", "transform", "appearance"].into_iter();
            let part = part.into_iter().find(|part| input.get(part).is_some_and(has))?;
            Some(format!("inputs[{number}].{part}.{field}"))
        });
        place.unwrap_or(field)
    }
}

/// Returns the names of the flags that a message names.
fn flags_in(message: &str) -> impl Iterator<Item = &str> {
    let words = message.split(|c: char| c.is_whitespace() || "(),;:'".contains(c));
    words.filter(|word| word.starts_with("--")).map(|word| {
        let name = word.trim_start_matches('-');
        name.split(['=', '<']).next().unwrap_or(name)
    })
}

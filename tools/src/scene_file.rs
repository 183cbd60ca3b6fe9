//! Scene files on the command line: a scene file stands for its inputs and flags. Flags beside it
//! count more than its own.

use crate::{failure::Failure, given::Given, limits::default_of};
use clap::{
    ArgMatches, Command,
    error::{ContextKind, ErrorKind},
};
use serde_json::Value;
use splatkit::{
    Error,
    formats::{Kind, ReadOptions},
    input::Limits,
    interaction::{ClipEntry, InputEntry, SceneFile},
};
use std::{
    error::Error as _,
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
};

/// Tasks that draw scene files.
const TASKS: [&str; 3] = ["render", "bench", "view"];

/// Flags that a scene file cannot set as options: those that have fields of their own, and those
/// that say what the command does rather than what the picture is. A scene file writes nothing.
const NOT_OPTIONS: &[(&str, &str)] = &[
    ("size", "it has a field of its own"),
    ("camera", "it has a field of its own"),
    ("transfer", "it has a field of its own"),
    ("clip", "they have a field of their own, “clips”"),
    ("cut-out", "they have a field of their own, “clips”"),
];
const NOT_OF_PICTURES: &[&str] = &[
    "output",
    "depth",
    "overwrite",
    "json",
    "turntable",
    "path",
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

/// Flags that say what the command may take. The user decides that, not a file.
const SPENDING: &[&str] = &["memory", "gpu-memory", "gpu-timeout"];

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

/// Flags of the camera, any of which replaces that of a scene file.
pub const CAMERA: &[&str] = &[
    "camera",
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
];

/// Returns whether a file is a scene file, by its name. The `meta.json` of trained Gaussians (SOG)
/// is none.
pub fn is_scene(path: &Path) -> bool {
    let kind = || Kind::of(path, &Limits::default(), &ReadOptions::default());
    path.extension() == Some(OsStr::new("json")) && !matches!(kind(), Ok(Some(Kind::Gaussians)))
}

/// Refuses a scene file where a file of data is needed.
pub fn refuse(path: &Path) -> Result<(), Failure> {
    if !is_scene(path) || SceneFile::read_trusted(path, &Limits::default()).is_err() {
        return Ok(());
    }
    let error = Error::input(path, "file", "is a scene file, which names files of data");
    Err(error.hint("splatkit render draws it; name one of its inputs here").into())
}

/// Returns the arguments with a scene file replaced by what it stands for; `None` if there is none.
pub fn expanded(
    arguments: &[OsString],
    matches: &ArgMatches,
    command: &Command,
) -> Result<Option<Expanded>, Failure> {
    let Some((task, own)) = matches.subcommand().filter(|(task, _)| TASKS.contains(task)) else {
        return Ok(None);
    };
    let inputs: Vec<&PathBuf> =
        own.get_many("inputs").map_or_else(Vec::new, |inputs| inputs.collect());
    let Some(path) = inputs.iter().find(|path| is_scene(path)) else { return Ok(None) };
    if inputs.len() > 1 {
        return Err(Failure::Usage(format!(
            "{}: a scene file is drawn alone; add the other files to its inputs",
            path.display()
        )));
    }
    let is_trusted = own.get_flag("trust_scene");
    let scene = read(path, command, is_trusted)?;
    let given = Given::of(matches);
    let flags = flags(&scene, path, command, task, &given)?;
    let Some(at) = arguments.iter().rposition(|argument| Path::new(argument) == path.as_path())
    else {
        return Ok(None);
    };
    let mut expanded = arguments[..at].to_vec();
    expanded.extend(flags);
    expanded.extend(arguments[at + 1..].iter().cloned());
    let written = ["output", "depth"].into_iter().filter_map(|flag| own.try_get_raw(flag).ok()?);
    let written = written.flatten().map(|file| file.to_string_lossy().into_owned()).collect();
    let stated = Stated { path: path.to_path_buf(), scene, given, written };
    Ok(Some(Expanded { arguments: expanded, stated }))
}

/// The command line that a scene file stands for.
#[derive(Debug)]
pub struct Expanded {
    pub arguments: Vec<OsString>,
    pub stated: Stated,
}

/// Which flags a scene file states, and which the user. The command line is read before a scene
/// file and again with it, so this is where the origin of a value is known.
#[derive(Debug)]
pub struct Stated {
    path: PathBuf,
    scene: SceneFile,
    given: Given,
    /// The files that the user wants written, as messages name them.
    written: Vec<String>,
}

impl Stated {
    /// Returns the failure for flags of the scene that clap refuses. Those of the user alone were
    /// read before.
    pub fn refused(&self, answer: &clap::Error) -> Failure {
        let of = |kind| answer.get(kind).map(ToString::to_string);
        let flag = of(ContextKind::InvalidArg);
        let field = flag.as_deref().map_or("scene".into(), |flag| self.field(flag_name(flag)));
        let whole = answer.to_string();
        let message = match (of(ContextKind::InvalidValue), answer.source()) {
            (Some(value), Some(why)) => format!("is {value:?}: {why}"),
            _ => {
                let lines = whole.lines().map(str::trim).take_while(|line| !line.is_empty());
                let line = lines.collect::<Vec<_>>().join(" ");
                line.strip_prefix("error: ").unwrap_or(&line).to_owned()
            }
        };
        // The scene's flags are sound if only one of the user's does not go with them.
        let is_users = answer.kind() == ErrorKind::ArgumentConflict
            && flags_in(&message).any(|flag| self.given.has(flag));
        if is_users { Failure::Usage(message) } else { wrong(&self.path, &field, message) }
    }

    /// Makes a failure that looks like wrong usage the scene's, if the scene states the flags that
    /// it names. If it names none, it is about values, which are the scene's unless the user has
    /// given some.
    pub fn blamed(&self, failure: Failure) -> Failure {
        let (Failure::Usage(what)
        | Failure::Library(Error::Argument(what) | Error::Transfer(what))) = &failure
        else {
            return failure;
        };
        let flags: Vec<&str> = flags_in(what).collect();
        let of_camera = what.starts_with("the camera");
        let is_users = match &flags[..] {
            [] if of_camera => {
                CAMERA.iter().chain(&["zoom", "up"]).any(|flag| self.given.has(flag))
            }
            [] => {
                let others = [NOT_OF_PICTURES, NOT_VALUES].concat();
                matches!(failure, Failure::Usage(_))
                    || self.written.iter().any(|file| what.contains(file.as_str()))
                    || self.given.other_than(&others).is_some()
            }
            named => named.iter().any(|flag| self.given.has(flag)),
        };
        if is_users {
            return failure;
        }
        let field = match flags.first() {
            Some(flag) => self.field(flag),
            None if of_camera && self.scene.camera.is_some() => "camera".into(),
            None if of_camera && self.scene.options.contains_key("zoom") => "options.zoom".into(),
            None => "scene".into(),
        };
        wrong(&self.path, &field, what.clone())
    }

    /// Returns the field of a flag that the scene states.
    fn field(&self, flag: &str) -> String {
        let scene = &self.scene;
        let own = |input: &InputEntry| {
            own_values(input).iter().any(|(name, value)| *name == flag && value.is_some())
        };
        match flag {
            "size" | "camera" => flag.into(),
            "transfer" if scene.transfer.is_some() => flag.into(),
            "clip" | "cut-out" => "clips".into(),
            _ if scene.options.contains_key(flag) => format!("options.{flag}"),
            _ => match scene.inputs.iter().position(own) {
                Some(number) => format!("inputs[{number}].{flag}"),
                None => flag.into(),
            },
        }
    }
}

/// Returns the names of the flags that a message names.
fn flags_in(message: &str) -> impl Iterator<Item = &str> {
    let words = message.split(|c: char| c.is_whitespace() || "(),;:'".contains(c));
    words.filter(|word| word.starts_with("--")).map(flag_name)
}

/// Returns the name of a flag as messages write it, `--name`, `--name=VALUE` or `--name <VALUE>`.
fn flag_name(text: &str) -> &str {
    let name = text.trim_start_matches('-');
    name.split([' ', '=', '<']).next().unwrap_or(name)
}

/// Reads a scene file, and checks the options that it sets. Only a trusted one may name files
/// outside its folder, and addresses.
pub fn read(path: &Path, command: &Command, is_trusted: bool) -> Result<SceneFile, Failure> {
    let limits = Limits::default();
    let scene = match is_trusted {
        true => SceneFile::read_trusted(path, &limits)?,
        false => SceneFile::read(path, &limits)?,
    };
    for (name, value) in &scene.options {
        check_option(name, path, command)?;
        check_limit(name, value).map_err(|why| wrong(path, &format!("options.{name}"), why))?;
    }
    Ok(scene)
}

/// Returns what is wrong with an option that raises a limit, or says what the command may take. A
/// scene may only lower limits.
fn check_limit(name: &str, value: &Value) -> Result<(), String> {
    if SPENDING.contains(&name) {
        return Err(format!(
            "is not an option of a scene: it says what the command may take; give --{name} on the \
             command line"
        ));
    }
    let Some(most) = default_of(name) else { return Ok(()) };
    let found = match value {
        Value::Number(number) => number.as_f64(),
        Value::String(text) => text.trim().parse().ok(),
        Value::Array(values) => {
            return values.iter().try_for_each(|value| check_limit(name, value));
        }
        _ => None,
    };
    match found.filter(|found| *found > most as f64) {
        None => Ok(()),
        Some(_) => Err(format!(
            "is {value}, but a scene may only lower this limit, which is {most}; if you trust the \
             scene, give --{name} on the command line"
        )),
    }
}

/// Returns whether a flag limits what the command may take, so that a scene file leaves it out.
#[cfg(feature = "window")]
pub fn is_limit(name: &str) -> bool {
    SPENDING.contains(&name) || default_of(name).is_some()
}

#[cfg(feature = "window")]
/// Returns the arguments of `render` that draw a scene, for a shell, without the picture's name.
pub fn command_line(scene: &SceneFile, command: &Command) -> Result<String, Failure> {
    let given = Given::default();
    let flags = flags(scene, Path::new("scene"), command, "render", &given)?;
    let words = flags.iter().map(|flag| quoted(&flag.to_string_lossy()));
    Ok(std::iter::once("splatkit render".to_owned()).chain(words).collect::<Vec<_>>().join(" "))
}

#[cfg(feature = "window")]
/// Quotes a word for a shell, if it needs that.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Returns the inputs and flags that a scene stands for, except those that the user has given.
pub fn flags(
    scene: &SceneFile,
    path: &Path,
    command: &Command,
    task: &str,
    given: &Given,
) -> Result<Vec<OsString>, Failure> {
    let mut flags: Vec<OsString> = Vec::new();
    for (name, value) in &scene.options {
        check_option(name, path, command)?;
        let is_known = has_flag(command, task, name);
        if is_known && !given.has(name) {
            add_option(&mut flags, name, value).map_err(|message| wrong(path, name, message))?;
        }
    }
    if let Some([width, height]) = scene.size.filter(|_| !given.has("size")) {
        flags.push(format!("--size={width}x{height}").into());
    }
    if let Some(camera) = scene.camera.filter(|_| !CAMERA.iter().any(|flag| given.has(flag))) {
        flags.push(format!("--camera={}", serde_json::json!(camera)).into());
    }
    if let Some(transfer) = scene.transfer.as_ref().filter(|_| !given.has("transfer")) {
        flags.push(format!("--transfer={}", text_of(transfer)).into());
    }
    if !(given.has("clip") || given.has("cut-out")) {
        flags.extend(scene.clips.iter().map(|clip| clip_flag(clip).into()));
    }
    for input in scene.inputs.iter().filter(|input| input.visible) {
        let is_like_flag = input.file.as_os_str().as_encoded_bytes().starts_with(b"-");
        let file = if is_like_flag { Path::new(".").join(&input.file) } else { input.file.clone() };
        for (name, value) in own_values(input) {
            if let Some(value) = value.filter(|_| !given.has(name)) {
                let mut flag = OsString::from(format!("--{name}="));
                flag.push(&file);
                flag.push(format!("={value}"));
                flags.push(flag);
            }
        }
        flags.push(file.into());
    }
    if scene.inputs.iter().all(|input| !input.visible) {
        return Err(wrong(path, "inputs", "none of them is visible".into()));
    }
    Ok(flags)
}

/// Returns the flags that an input has of its own, with their values.
fn own_values(input: &InputEntry) -> [(&'static str, Option<String>); 5] {
    [
        ("color", input.color.clone()),
        ("opacity", input.opacity.map(|opacity| opacity.to_string())),
        ("transfer", input.transfer.as_ref().map(text_of)),
        ("range", input.range.map(|[low, high]| format!("{low},{high}"))),
        ("iso", input.iso.clone()),
    ]
}

/// Returns a transfer function as a flag takes it.
fn text_of(transfer: &Value) -> String {
    match transfer {
        Value::String(name) => name.clone(),
        whole => whole.to_string(),
    }
}

fn wrong(path: &Path, name: &str, message: String) -> Failure {
    Error::input(path, format!("“{name}”"), message).into()
}

fn has_flag(command: &Command, task: &str, name: &str) -> bool {
    let task = command.find_subcommand(task);
    task.is_some_and(|task| task.get_arguments().any(|flag| flag.get_long() == Some(name)))
}

/// Whether a flag of `render` may be an option of a scene.
#[cfg(feature = "window")]
pub fn is_option(name: &str) -> bool {
    !(NOT_OPTIONS.iter().any(|(other, _)| *other == name) || NOT_OF_PICTURES.contains(&name))
}

/// Checks that a scene file may set a flag.
fn check_option(name: &str, path: &Path, command: &Command) -> Result<(), Failure> {
    let refused = |why: &str| {
        let message = format!("is not an option of a scene: {why}");
        Err(wrong(path, &format!("options.{name}"), message))
    };
    if let Some((_, why)) = NOT_OPTIONS.iter().find(|(other, _)| *other == name) {
        return refused(why);
    }
    if NOT_OF_PICTURES.contains(&name) {
        return refused("it says what the command does, not what the picture is");
    }
    if has_flag(command, "render", name) {
        return Ok(());
    }
    refused("splatkit render has no such flag")
}

/// Adds a flag with its value.
fn add_option(flags: &mut Vec<OsString>, name: &str, value: &Value) -> Result<(), String> {
    match value {
        Value::Bool(true) => flags.push(format!("--{name}").into()),
        Value::String(text) => flags.push(format!("--{name}={text}").into()),
        Value::Number(number) => flags.push(format!("--{name}={number}").into()),
        Value::Array(values) => {
            values.iter().try_for_each(|value| add_option(flags, name, value))?;
        }
        Value::Bool(false) | Value::Null | Value::Object(_) => {
            return Err("must be a text, a number, true, or a list of them".into());
        }
    }
    Ok(())
}

fn clip_flag(clip: &ClipEntry) -> String {
    let list = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
    let flag = if clip.inside { "clip" } else { "cut-out" };
    match (clip.plane, clip.cuboid) {
        (Some(plane), _) => format!("--{flag}=plane:{}", list(&plane)),
        (None, corners) => {
            let [low, high] = corners.unwrap_or_default();
            format!("--{flag}=box:{}:{}", list(&low), list(&high))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn scene(text: &str) -> Result<Vec<String>, Failure> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("s.json");
        std::fs::write(&path, text).expect("written");
        let command = crate::Command::command();
        let words: Vec<OsString> =
            ["splatkit".into(), "render".into(), path.into(), "--no-shade".into()].into();
        let matches = command.clone().try_get_matches_from(&words).expect("arguments");
        let all = expanded(&words, &matches, &command)?.expect("a scene");
        // What it stands for can be parsed.
        let Expanded { arguments: all, stated } = all;
        command.try_get_matches_from(&all).map_err(|error| stated.refused(&error))?;
        Ok(all.iter().map(|word| word.to_string_lossy().into_owned()).collect())
    }

    #[test]
    fn a_scene_file_stands_for_flags() {
        let words = scene(
            r#"{"splatkit_scene": 1,
                "inputs": [{"file": "-a.ply"}, {"file": "b.ply", "visible": false},
                           {"file": "c.nrrd", "transfer": "mri", "range": [-1, 4.5], "iso": "3"}],
                "size": [64, 48],
                "camera": {"position": [1, 2, 3], "focal_point": [0, 0, 0], "view_up": [0, 0, 1],
                           "height": 2.5},
                "transfer": {"color": [[0, 1, 1, 1]], "opacity": [[0, 0], [5, 0.1]]},
                "clips": [{"plane": [-1, 0, 0, 2.5]},
                          {"box": [[0, 0, 0], [1, 1, 1]], "inside": false}],
                "options": {"background": "white", "no-shade": true, "iso": [1, "2:red"]}}"#,
        )
        .expect("flags");
        let has = |word: &str| words.iter().any(|own| own == word);
        assert!(has("--size=64x48") && has("--background=white") && has("--iso=2:red"));
        assert!(has("--clip=plane:-1,0,0,2.5") && has("--cut-out=box:0,0,0:1,1,1"));
        assert_eq!(words.iter().filter(|word| *word == "--no-shade").count(), 1);
        assert!(words.iter().any(|word| word.ends_with("-a.ply")));
        for end in ["c.nrrd=mri", "c.nrrd=-1,4.5", "c.nrrd=3"] {
            assert!(words.iter().any(|word| word.ends_with(end)), "{end}: {words:?}");
        }
        assert!(!words.iter().any(|word| word.contains("b.ply")));
    }

    #[test]
    fn what_a_scene_file_may_not_do_is_named() {
        let wrong = |options: &str| {
            let text = format!(
                r#"{{"splatkit_scene": 1, "inputs": [{{"file": "a.ply"}}], "options": {options}}}"#
            );
            format!("{:?}", scene(&text).expect_err(options))
        };
        assert!(wrong(r#"{"output": "x.png"}"#).contains("options.output"));
        assert!(wrong(r#"{"size": "3x3"}"#).contains("field of its own"));
        assert!(wrong(r#"{"bakground": "red"}"#).contains("no such flag"));
        assert!(wrong(r#"{"axes": false}"#).contains("true"));
        assert!(wrong(r#"{"background": "nocolour"}"#).contains("nocolour"));
    }

    #[test]
    fn scenes_lower_limits_only() {
        let error = |options: &str| {
            let text = format!(
                r#"{{"splatkit_scene": 1, "inputs": [{{"file": "a.ply"}}], "options": {options}}}"#
            );
            scene(&text).err().map(|error| format!("{error:?}"))
        };
        let flags = ["points", "bytes", "depth", "texels", "seconds"];
        for name in flags.map(|name| format!("limit-{name}")) {
            assert_eq!(error(&format!(r#"{{"{name}": 7}}"#)), None);
            for value in ["9999999999999", "\"9999999999999\"", "[1, 9999999999999]", "1e300"] {
                let error = error(&format!(r#"{{"{name}": {value}}}"#)).expect(&name);
                let place = format!("options.{name}");
                assert!(error.contains(&place) && error.contains("only lower"), "{error}");
            }
        }
        for name in ["memory", "gpu-memory", "gpu-timeout", "trust-scene", "allow-host", "threads"]
        {
            let error = error(&format!(r#"{{"{name}": "1"}}"#)).expect(name);
            assert!(error.contains(&format!("options.{name}")), "{error}");
        }
    }

    #[cfg(feature = "window")]
    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("--size=3x4"), "--size=3x4");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted("a b"), "'a b'");
    }
}

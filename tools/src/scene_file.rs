//! Scene files on the command line: a scene file stands for its inputs and flags. Flags beside it
//! count more than its own.

use crate::{failure::Failure, given::Given};
use clap::{ArgMatches, Command};
use serde_json::Value;
use splatkit::{
    Error,
    formats::{Kind, ReadOptions},
    input::Limits,
    interaction::{ClipEntry, InputEntry, SceneFile},
};
use std::{
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
    "reference",
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

/// Returns the arguments with a scene file replaced by what it stands for; `None` if there is none.
pub fn expanded(
    arguments: &[OsString],
    matches: &ArgMatches,
    command: &Command,
) -> Result<Option<Vec<OsString>>, Failure> {
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
    let scene = SceneFile::read(path, &Limits::default())?;
    let flags = flags(&scene, path, command, task, &Given::of(matches))?;
    let Some(at) = arguments.iter().rposition(|argument| Path::new(argument) == path.as_path())
    else {
        return Ok(None);
    };
    let mut expanded = arguments[..at].to_vec();
    expanded.extend(flags);
    expanded.extend(arguments[at + 1..].iter().cloned());
    Ok(Some(expanded))
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
        command.try_get_matches_from(&all).map_err(|error| Failure::Usage(error.to_string()))?;
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

    #[cfg(feature = "window")]
    #[test]
    fn words_are_quoted_for_a_shell() {
        assert_eq!(quoted("--size=3x4"), "--size=3x4");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted("a b"), "'a b'");
    }
}

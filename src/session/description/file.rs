//! Scene files: descriptions as JSON, and the paths in them.

use super::{Description, KernelEntry, ReadingEntry, TransferEntry};
use crate::{
    Error, Result,
    input::{Limits, Source, address, is_remote, neighbour},
    math::Kernel,
    session::SurfaceColor,
    volume::TransferFunction,
};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The size limit of a scene file. A larger file is something else.
const MOST_BYTES: usize = 16 << 20;

/// Most bytes of a text, apart from a caption.
const MOST_TEXT: usize = 4 << 10;

/// What a hint says of the form.
const FORM: &str = "the form is {\"splatkit_scene\": 2, \"inputs\": [{\"file\": \"scan.ply\"}], \
                    …}; docs/scene-files.md lists all fields";

pub(super) fn read(path: &Path, limits: &Limits) -> Result<Description> {
    let mut scene = read_text(path, limits)?;
    let folder = folder_of(path);
    // In the folder of an address there are no links.
    let home = if is_remote(path) { Ok(folder.clone()) } else { folder.canonicalize() };
    let home = home.map_err(|error| Error::file(&folder, "resolve", error))?;
    change_files(&mut scene, |place, file| {
        let name = file.to_string_lossy();
        match neighbour::leaves(&folder, &home, &name) {
            None => Ok(folder.join(file)),
            Some(why) => {
                let start: String = name.chars().take(80).collect();
                let message = format!("names “{start}”, {why}");
                Err(Error::input(path, place, message)
                    .hint("if you trust the scene, add --trust-scene"))
            }
        }
    })?;
    Ok(scene)
}

pub(super) fn read_trusted(path: &Path, limits: &Limits) -> Result<Description> {
    let mut scene = read_text(path, limits)?;
    let folder = folder_of(path);
    change_files(&mut scene, |_, file| {
        Ok(if is_remote(file) { address(file) } else { folder.join(file) })
    })?;
    Ok(scene)
}

fn read_text(path: &Path, limits: &Limits) -> Result<Description> {
    let text = Source::open(path, limits)?.small_text("a scene file", MOST_BYTES)?;
    parse(&text).map_err(|(place, message)| Error::input(path, place, message).hint(FORM))
}

/// Reads a description. An error is the place of a field and a message.
pub(super) fn parse(text: &str) -> std::result::Result<Description, (String, String)> {
    // Before all else: the fields of another version are others.
    let version = |text: &str| {
        #[derive(serde::Deserialize)]
        struct Version {
            splatkit_scene: u64,
        }
        serde_json::from_str::<Version>(text).ok().map(|scene| scene.splatkit_scene)
    };
    let ours = u64::from(Description::VERSION);
    if let Some(other) = version(text).filter(|version| *version != ours) {
        let message = format!("the version is {other}, but this program reads version {ours}");
        return Err(("splatkit_scene".into(), message));
    }
    let mut json = serde_json::Deserializer::from_str(text);
    let scene: Description = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let place = error.path().to_string();
        let is_whole = [".", "?"].contains(&&*place);
        (if is_whole { "scene".into() } else { place }, error.inner().to_string())
    })?;
    json.end().map_err(|error| ("scene".to_owned(), error.to_string()))?;
    scene.check()?;
    check_texts(&scene)?;
    check_taken(&scene)?;
    Ok(scene)
}

/// Refuses texts that are too long.
fn check_texts(scene: &Description) -> std::result::Result<(), (String, String)> {
    let of_reading = |place: String, reading: &ReadingEntry| {
        let fields = [
            ("scalar", reading.scalar.clone()),
            ("series", reading.series.clone()),
            ("dataset", reading.dataset.clone()),
        ];
        fields.map(|(name, text)| (format!("{place}.{name}"), text))
    };
    let mut texts: Vec<(String, Option<String>)> = Vec::new();
    texts.extend(of_reading("reading".into(), &scene.reading));
    let attribute = |color: &Option<SurfaceColor>| color.as_ref().map(ToString::to_string);
    texts.push(("appearance.color".into(), attribute(&scene.appearance.color)));
    texts.push(("appearance.point_radius".into(), scene.appearance.point_radius.clone()));
    for (number, input) in scene.inputs.iter().enumerate() {
        texts.extend(of_reading(format!("inputs[{number}].reading"), &input.reading));
        let place = format!("inputs[{number}].appearance.color");
        texts.push((place, attribute(&input.appearance.color)));
        let place = format!("inputs[{number}].appearance.point_radius");
        texts.push((place, input.appearance.point_radius.clone()));
    }
    let long = texts.into_iter().find_map(|(place, text)| {
        Some((place, text.map(|text| text.len()).filter(|bytes| *bytes > MOST_TEXT)?))
    });
    match long {
        None => Ok(()),
        Some((place, bytes)) => {
            Err((place, format!("has {bytes} bytes, but may have at most {MOST_TEXT}")))
        }
    }
}

/// Refuses limits that are raised, and what only the user decides.
fn check_taken(scene: &Description) -> std::result::Result<(), (String, String)> {
    let places = scene.inputs.iter().enumerate();
    let places =
        places.map(|(number, input)| (format!("inputs[{number}].reading"), &input.reading));
    for (place, reading) in places.chain([("reading".to_owned(), &scene.reading)]) {
        if let Some((name, value, most)) = reading.limits.raised() {
            let message = format!(
                "is {value}, but a scene may only lower this limit, which is {most}; if you trust \
                 the scene, give --limit-{name} on the command line"
            );
            return Err((format!("{place}.limits.{name}"), message));
        }
    }
    if scene.picture.memory.is_some() {
        let message = "is not for a scene: it says what the command may take; give --memory on \
                       the command line";
        return Err(("picture.memory".into(), message.into()));
    }
    Ok(())
}

/// Changes the paths of all files that a scene names. `change` also gets their places, such as
/// `inputs[0].file`.
fn change_files(
    scene: &mut Description,
    change: impl Fn(String, &Path) -> Result<PathBuf>,
) -> Result<()> {
    let text = |place: String, name: &mut String, known: &[&str]| -> Result<()> {
        if !known.contains(&name.as_str()) {
            *name = change(place, Path::new(&*name))?.to_string_lossy().into_owned();
        }
        Ok(())
    };
    let mut parts = Vec::new();
    for (number, input) in scene.inputs.iter_mut().enumerate() {
        input.file = change(format!("inputs[{number}].file"), &input.file)?;
        parts.push((format!("inputs[{number}]."), &mut input.reading, &mut input.appearance));
    }
    parts.push((String::new(), &mut scene.reading, &mut scene.appearance));
    for (place, reading, appearance) in parts {
        if let Some(TransferEntry::Name(name)) = &mut appearance.transfer {
            text(format!("{place}appearance.transfer"), name, &TransferFunction::NAMES)?;
        }
        if let Some(KernelEntry::Name(name)) = &mut appearance.kernel {
            text(format!("{place}appearance.kernel"), name, &Kernel::NAMES)?;
        }
        if let Some(labels) = &mut reading.labels {
            *labels = change(format!("{place}reading.labels"), labels)?;
        }
    }
    Ok(())
}

/// Returns the text of a scene file in a folder.
pub(super) fn to_json(scene: &Description, folder: &Path) -> String {
    let mut copy = scene.clone();
    // It never fails.
    change_files(&mut copy, |_, file| Ok(relative(file, folder))).ok();
    // The next user decides what may be taken.
    copy.picture.memory = None;
    copy.reading.limits.clear();
    join(&mut copy);
    // Maps with text keys and numbers always become JSON.
    let mut text = serde_json::to_string_pretty(&copy).unwrap_or_default();
    text.push('\n');
    text
}

/// Moves what all inputs say alike to what they share, so that a scene is written alike, whoever
/// has described it.
fn join(scene: &mut Description) {
    let readings = scene.inputs.iter().map(|input| (&input.reading, scene.reading_of(input)));
    let readings = joined(&scene.reading, readings);
    let appearances =
        scene.inputs.iter().map(|input| (&input.appearance, scene.appearance_of(input)));
    let appearances = joined(&scene.appearance, appearances);
    if let Some((shared, entries)) = readings {
        scene.reading = shared;
        scene.inputs.iter_mut().zip(entries).for_each(|(input, entry)| input.reading = entry);
    }
    if let Some((shared, entries)) = appearances {
        scene.appearance = shared;
        scene.inputs.iter_mut().zip(entries).for_each(|(input, entry)| input.appearance = entry);
    }
}

/// Returns a shared entry and the inputs' entries, without fields in which all inputs agree. Each
/// input has its entry, and the entry that counts for it beside the shared one.
fn joined<'a, T: Serialize + DeserializeOwned + 'a>(
    shared: &T,
    inputs: impl Iterator<Item = (&'a T, T)>,
) -> Option<(T, Vec<T>)> {
    let fields = |entry: &T| match serde_json::to_value(entry) {
        Ok(Value::Object(fields)) => Some(fields),
        _ => None,
    };
    let mut shared = fields(shared)?;
    let (mut entries, mut effective) = (Vec::new(), Vec::new());
    for (entry, counts) in inputs {
        entries.push(fields(entry)?);
        effective.push(fields(&counts)?);
    }
    let first = effective.first()?;
    for (name, value) in first {
        if effective.iter().all(|fields| fields.get(name) == Some(value)) {
            shared.insert(name.clone(), value.clone());
            entries.iter_mut().for_each(|fields| drop(fields.remove(name)));
        }
    }
    let entry = |fields| serde_json::from_value(Value::Object(fields)).ok();
    Some((entry(shared)?, entries.into_iter().map(entry).collect::<Option<_>>()?))
}

pub(super) fn write(scene: &Description, path: &Path) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    crate::disk::write(path, to_json(scene, folder).as_bytes())
}

/// Returns the folder of a scene file.
fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// Returns a path as seen from a folder, if it lies below the folder or beside it.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().ok()
    };
    let (Some(path), Some(folder)) = (whole(path), whole(folder)) else {
        return path.to_owned();
    };
    let mut up = PathBuf::new();
    for above in folder.ancestors() {
        if let Ok(rest) = path.strip_prefix(above) {
            // Two files that share no folder but the root have no common place to move with.
            return if above.parent().is_none() { path } else { up.join(rest) };
        }
        up.push("..");
    }
    path
}

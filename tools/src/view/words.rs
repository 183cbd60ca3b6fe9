//! The flags that say what a description says: for a shell, and for warnings about flags without
//! effect.

use serde_json::Value;
use splatkit::session::{
    ChannelEntry, ClipEntry, Description, IsosurfaceEntry, Rotation, TransferEntry,
};
use std::path::Path;

/// Returns the inputs and flags of `render` that draw a scene. An error names a field that no flag
/// sets.
pub fn words_of(scene: &Description) -> Result<Vec<String>, String> {
    let mut words = Vec::new();
    let json = serde_json::to_value(scene).map_err(|error| error.to_string())?;
    for part in ["framing", "picture", "overlay", "reading", "appearance"] {
        of_part(&mut words, &json[part], part)?;
    }
    if let Some(camera) = &scene.camera {
        words.push(format!("--camera={}", serde_json::json!(camera)));
    }
    let engine = serde_json::json!(scene.engine);
    if scene.engine != Default::default() {
        words.push(format!("--engine={}", plain(&engine)));
    }
    words.extend(scene.picture.clips.iter().map(flag_of_clip));
    let shared = scene.appearance.isosurfaces.iter();
    words.extend(shared.map(|entries| format!("--iso={}", surfaces(entries))));
    if let Some(entries) = &scene.appearance.channels {
        words.push(format!("--channels={}", channels(entries)?));
    }
    words.extend(
        scene.appearance.transfer.iter().map(|transfer| format!("--transfer={}", text(transfer))),
    );
    for input in scene.visible() {
        let file = input.file.to_string_lossy();
        let (mut appearance, transform) = (input.appearance.clone(), &input.transform);
        let values = [
            ("scale", transform.scale.map(|factor| factor.to_string())),
            ("rotate", transform.rotate.as_ref().map(turn)),
            ("translate", transform.translate.map(|[x, y, z]| format!("{x},{y},{z}"))),
            ("color", appearance.color.take().map(|color| color.to_string())),
            ("opacity", appearance.opacity.take().map(|opacity| opacity.to_string())),
            ("transfer", appearance.transfer.take().map(|transfer| text(&transfer))),
            ("range", appearance.range.take().map(|[low, high]| format!("{low},{high}"))),
            ("channels", appearance.channels.take().map(|entries| channels(&entries)).transpose()?),
            ("iso", appearance.isosurfaces.take().map(|entries| surfaces(&entries))),
        ];
        let is_plain = appearance == Default::default() && input.reading == Default::default();
        if !is_plain {
            return Err(format!(
                "{file} is read or shown in a way of its own that no flag says; save the scene, \
                 which splatkit render draws"
            ));
        }
        let file_of = |path: &Path| {
            let is_like_flag = path.as_os_str().as_encoded_bytes().starts_with(b"-");
            if is_like_flag { Path::new(".").join(path) } else { path.to_owned() }
        };
        let file = file_of(&input.file).to_string_lossy().into_owned();
        let given = values.into_iter().filter_map(|(name, value)| Some((name, value?)));
        words.extend(given.map(|(name, value)| format!("--{name}={file}={value}")));
        words.extend(input.edits.iter().map(|edit| format!("--edit={file}={edit}")));
        words.push(file);
    }
    Ok(words)
}

/// Adds the flags of one part, apart from those that [`words_of`] adds itself.
fn of_part(words: &mut Vec<String>, part: &Value, name: &str) -> Result<(), String> {
    for (field, value) in part.as_object().into_iter().flatten() {
        let flag = field.replace('_', "-");
        match (field.as_str(), value) {
            ("clips" | "isosurfaces" | "transfer" | "channels", _) => {}
            ("limits", limits) => {
                let limits = limits.as_object().into_iter().flatten();
                words.extend(limits.map(|(limit, most)| format!("--limit-{limit}={most}")));
            }
            ("gradient_opacity", points) => {
                let points = points.as_array().into_iter().flatten();
                let points: Vec<String> = points.map(|point| joined(point, ",")).collect();
                words.push(format!("--{flag}={}", points.join(":")));
            }
            ("kernel", Value::Array(_)) => {
                return Err(format!("{name}.{field} is a table, which no flag says"));
            }
            ("size" | "dims", numbers) => words.push(format!("--{flag}={}", joined(numbers, "x"))),
            (_, Value::Bool(true)) => words.push(format!("--{flag}")),
            (_, Value::Bool(false)) if field == "cull_backfaces" => {
                words.push(format!("--{flag}=false"));
            }
            (_, Value::Bool(false)) => words.push(format!("--no-{flag}")),
            (_, Value::Array(_)) => words.push(format!("--{flag}={}", joined(value, ","))),
            _ => words.push(format!("--{flag}={}", plain(value))),
        }
    }
    Ok(())
}

/// Returns a text without quotes, and anything else as JSON.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn joined(list: &Value, separator: &str) -> String {
    let items = list.as_array().into_iter().flatten();
    items.map(plain).collect::<Vec<_>>().join(separator)
}

/// Returns a transfer function as a flag takes it.
fn text(transfer: &TransferEntry) -> String {
    match transfer {
        TransferEntry::Name(name) => name.clone(),
        TransferEntry::Whole(transfer) => transfer.to_json(),
    }
}

/// Returns a turn as a flag takes it.
fn turn(Rotation { axis: [x, y, z], degrees }: &Rotation) -> String {
    format!("{x},{y},{z}:{degrees}")
}

/// Returns isosurfaces as a flag takes them.
pub fn surfaces(entries: &[IsosurfaceEntry]) -> String {
    let surface = |entry: &IsosurfaceEntry| {
        let mut text = match (entry.value, entry.percent) {
            (Some(value), _) => value.to_string(),
            (None, share) => format!("{}%", share.unwrap_or_default()),
        };
        if let Some(color) = &entry.color {
            text += &format!(":{}", plain(&serde_json::json!(color)));
        }
        if entry.opacity < 1.0 {
            text += &format!(":{}", entry.opacity);
        }
        text
    };
    entries.iter().map(surface).collect::<Vec<_>>().join(",")
}

/// Returns channels as a flag takes them. An error names what no flag says.
fn channels(entries: &[ChannelEntry]) -> Result<String, String> {
    let channel = |entry: &ChannelEntry| {
        let mut text = entry.name();
        if entry.transfer.is_some() || text.contains([':', ',', '=']) {
            return Err(format!(
                "channel {text} is shown in a way that no flag says; save the scene, which \
                 splatkit render draws"
            ));
        }
        if let Some(color) = &entry.color {
            text += &format!(":{}", plain(&serde_json::json!(color)));
        }
        if let Some([low, high]) = entry.range {
            text += &format!(":{low}..{high}");
        }
        if let Some(opacity) = entry.opacity {
            text += &format!(":{opacity}");
        }
        Ok(text)
    };
    let all: Result<Vec<String>, String> = entries.iter().map(channel).collect();
    Ok(all?.join(","))
}

fn flag_of_clip(clip: &ClipEntry) -> String {
    let flag = if clip.inside { "clip" } else { "cut-out" };
    format!("--{flag}={}", clip.text())
}

/// Quotes a word for a shell, if it needs that.
#[cfg(feature = "window")]
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Command, Task, given::Given};
    use clap::{CommandFactory, FromArgMatches};

    fn scene_of(words: &[String]) -> Description {
        let command = ["splatkit".to_owned(), "render".to_owned()];
        let words = command.iter().chain(words);
        let matches = Command::command().try_get_matches_from(words).expect("flags");
        let Task::Render(render) = Command::from_arg_matches(&matches).expect("a command").task
        else {
            panic!("another task");
        };
        render.job(&Given::of(&matches)).expect("a job").scene
    }

    /// Flags become a scene, the scene a file, and the file the same scene and the same flags.
    #[test]
    fn flags_scene_files_and_flags_say_the_same() {
        for flags in [
            "",
            "--iso 1,2:red,50%:#00ff00:0.5 --no-shade",
            "--iso a.nrrd=3 --iso 7 --range a.nrrd=-1,4.5",
            "--channels a.nrrd=DAPI:blue:1..5:0.5,2 --channels 1:#00ff00",
            "--transfer mri --opacity-unit 2.5 --colormap viridis_r --log-colors",
            "--transfer b.ply=ct-bone --nan-color orange",
            r#"--transfer {"color":[[0,1,1,1]],"opacity":[[0,0],[5,0.125]]}"#,
            "--gradient-opacity 0,0:50,0.2:200,1 --kernel hann --extent 2.5 --sharp",
            "--kernel gaussian --sigma 0.7 --edges --crease 30 --radius-scale 1.5",
            "--color height --opacity 0.5 --color b.ply=#ff8800 --opacity b.ply=0.25",
            "--size 64x48 --background white --samples 4",
            "--background none --samples auto --axes --scale-bar --scalar-bar --caption bone",
            "--mode splats --back-to-front --classify pre --shade",
            "--mode axis-sheets --gradient central --evaluate scatter --sheet-thickness 0.5",
            "--mip --cull-backfaces false --no-occlusion",
            "--x-ray --cut 3.5 --engine cpu",
            "--budget 1000 --engine gpu",
            "--frame-time 16.5",
            "--cells volume --points dots --point-size 3px --point-radius r --line-width 0.25",
            "--clip x<50% --cut-out box:0,0,0%:1,2,50% --clip plane:1,0,0,2.5",
            "--view iso --azimuth -20 --elevation 5 --zoom 1.5 --orthographic --up +Z",
            "--camera-position 1,2,3 --focal-point 0,0,0.5 --view-up 0,1,0 --view-angle 50",
            r#"--camera {"position":[1,2,3],"focal_point":[0,0,0],"view_up":[0,0,1],"height":2}"#,
            "--scalar heat --dims 4x5x6 --type u8 --spacing 1,1,2.5 --endian big --header 12",
            "--time 3 --series 2 --dataset a/b --missing -999",
            "--radius 0.4 --neighbours 9 --no-slopes",
            "--scale 0.001 --rotate b.ply=z:90 --translate a.nrrd=-1,0.5,1e-7 --translate 4,5,6",
            "--rotate -1,0.3,0:-12.25",
            "--edit where:x>3&&x!=5 --edit a.nrrd=crop:sphere:0,0,0,1 --edit remove-floaters",
        ] {
            let words: Vec<String> = ["a.nrrd", "b.ply"]
                .into_iter()
                .chain(flags.split_whitespace())
                .map(Into::into)
                .collect();
            let scene = scene_of(&words);
            let text = scene.to_json(Path::new(""));
            let again: Description = serde_json::from_str(&text).expect(flags);
            assert_eq!(again, scene, "{flags}: {text}");
            let words = words_of(&scene).expect(flags);
            assert_eq!(scene_of(&words), scene, "{flags}: {words:?}");
            assert!(flags.is_empty() || scene != scene_of(&words[words.len() - 2..]), "{flags}");
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

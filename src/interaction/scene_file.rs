//! Scene files: what a window shows, as one JSON file from which every front end draws the same
//! picture.

use crate::{
    Error, Result,
    input::{Limits, Source, address, is_remote, neighbour},
    math::{Bounds, Camera, Kernel, Projection},
    scene::{Clip, ClipShape},
    volume::TransferFunction,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// The size limit of a scene file. A larger file is something else.
const MOST_BYTES: usize = 16 << 20;

/// Most bytes of an option's text, and most values of an option.
const MOST_TEXT: usize = 4 << 10;
const MOST_VALUES: usize = 1000;

/// Options whose values are files.
const FILES: [&str; 2] = ["labels", "kernel"];

/// A scene file (docs/scene-files.md, docs/scene.schema.json).
///
/// `options` holds everything else that the command's `render` can be told, by the names of its
/// flags.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// The version of the layout, [`VERSION`](Self::VERSION).
    pub splatkit_scene: u32,
    /// What is drawn, in this order.
    pub inputs: Vec<InputEntry>,
    /// Width and height of the picture in pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Where the picture is taken from. Without it, the camera is fitted to the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraEntry>,
    /// The transfer function of the fields that have none of their own, in the layout of its own
    /// files, or the name of one, or the path of its file. Without it, it is made for the values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<Value>,
    /// The clips that cut the scene.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<ClipEntry>,
    /// Flags of `render` by their names, without dashes: a text, a number, or true for a flag
    /// without a value. A list gives a flag several times.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    pub options: Map<String, Value>,
}

/// An input of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputEntry {
    /// The path of the file. In a scene file it is relative to the scene file's folder.
    pub file: PathBuf,
    /// Whether the input is drawn.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub visible: bool,
    /// What colours the surfaces of this input: a colour, an attribute, height, …
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// The share of the light that a surface of this input absorbs, above 0 to 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f64>,
    /// The transfer function of this input's field, like [`SceneFile::transfer`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transfer: Option<Value>,
    /// The values that the transfer function or the colour map of this input is spread over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// The isosurfaces of this input's field, as `render --iso` takes them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub iso: Option<String>,
}

impl InputEntry {
    /// A visible input with nothing else set.
    pub fn new(file: PathBuf) -> Self {
        Self {
            file,
            visible: true,
            color: None,
            opacity: None,
            transfer: None,
            range: None,
            iso: None,
        }
    }
}

/// A camera, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// [`Camera::position`].
    pub position: [f64; 3],
    /// [`Camera::focal_point`].
    pub focal_point: [f64; 3],
    /// [`Camera::view_up`].
    pub view_up: [f64; 3],
    /// The full vertical view angle in degrees, in perspective.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub view_angle: Option<f64>,
    /// The world height that the picture shows, without perspective.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
}

/// A clip: a shape in world coordinates, and what is kept. It has one shape.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClipEntry {
    /// The half-space of the points x with normal·x ≤ offset: normal, then offset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plane: Option<[f64; 4]>,
    /// A box along the world's axes: the lower and the upper corner.
    #[serde(default, skip_serializing_if = "Option::is_none", rename = "box")]
    pub cuboid: Option<[[f64; 3]; 2]>,
    /// Whether what is inside the shape is kept, or what is outside.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub inside: bool,
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
}

impl SceneFile {
    /// The version of the layout.
    pub const VERSION: u32 = 1;

    /// Most inputs of a scene file.
    pub const MOST_INPUTS: usize = 10_000;

    /// Most letters of a caption.
    pub const MOST_CAPTION: usize = 1000;

    /// A scene of these inputs, with nothing else set.
    pub fn new(inputs: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            splatkit_scene: Self::VERSION,
            inputs: inputs.into_iter().map(InputEntry::new).collect(),
            size: None,
            camera: None,
            transfer: None,
            clips: Vec::new(),
            options: Map::new(),
        }
    }

    /// Reads a scene file. The paths of its files are joined with its folder. A scene file is an
    /// input like any other: the files that it names must lie beside it or below.
    ///
    /// # Errors
    /// [`Error::File`] and [`Error::Limit`] as for every input; [`Error::Input`] if the file is not
    /// a scene: the message names the line, the column and the field. Also for files elsewhere.
    pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let mut scene = Self::read_text(path, limits)?;
        let folder = folder_of(path);
        // In the folder of an address there are no links.
        let home = if is_remote(path) { Ok(folder.clone()) } else { folder.canonicalize() };
        let home = home.map_err(|error| Error::file(&folder, "resolve", error))?;
        scene.change_files(|place, file| {
            let name = file.to_string_lossy();
            match neighbour::leaves(&folder, &home, &name) {
                None => Ok(folder.join(file)),
                Some(why) => {
                    let shown: String = name.chars().take(80).collect();
                    let message = format!("names “{shown}”, {why}");
                    Err(Error::input(path, place, message)
                        .hint("if you trust the scene, add --trust-scene"))
                }
            }
        })?;
        Ok(scene)
    }

    /// As [`read`](Self::read), but the scene may name any files and addresses: for one that the
    /// user has made or trusts.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), except for files elsewhere.
    pub fn read_trusted(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        let path = path.as_ref();
        let mut scene = Self::read_text(path, limits)?;
        let folder = folder_of(path);
        scene.change_files(|_, file| {
            Ok(if is_remote(file) { address(file) } else { folder.join(file) })
        })?;
        Ok(scene)
    }

    fn read_text(path: &Path, limits: &Limits) -> Result<Self> {
        let text = Source::open(path, limits)?.small_text("a scene file", MOST_BYTES)?;
        Self::parse(&text).map_err(|message| {
            Error::input(path, "scene", message).hint(
                "the form is {\"splatkit_scene\": 1, \"inputs\": [{\"file\": \"scan.ply\"}], …}; \
                 docs/scene-files.md lists all fields",
            )
        })
    }

    fn parse(text: &str) -> Result<Self, String> {
        let scene: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if scene.splatkit_scene != Self::VERSION {
            return Err(format!(
                "the version is {}, but this program reads version {}",
                scene.splatkit_scene,
                Self::VERSION
            ));
        }
        if scene.inputs.is_empty() {
            return Err("there is no input".into());
        }
        if scene.inputs.len() > Self::MOST_INPUTS {
            let (found, most) = (scene.inputs.len(), Self::MOST_INPUTS);
            return Err(format!("inputs: there are {found}, but a scene may have at most {most}"));
        }
        scene.options.iter().try_for_each(|(name, value)| check_text(name, value))?;
        if let Some(camera) = &scene.camera {
            camera.camera()?;
        }
        let is_opacity = |opacity: &f64| *opacity > 0.0 && *opacity <= 1.0;
        if let Some(input) = scene.inputs.iter().find(|i| !i.opacity.iter().all(is_opacity)) {
            let file = input.file.display();
            return Err(format!("inputs: the opacity of {file} must be above 0 and at most 1"));
        }
        scene.transfer_function()?;
        for input in &scene.inputs {
            let file = input.file.display();
            function_of(input.transfer.as_ref()).map_err(|error| format!("{file}: {error}"))?;
        }
        scene.clips.iter().try_for_each(|clip| clip.clip().map(|_| ()))?;
        Ok(scene)
    }

    /// Changes the paths of all files that the scene names. `change` also gets their places, such
    /// as `inputs[0].file`.
    fn change_files(&mut self, change: impl Fn(String, &Path) -> Result<PathBuf>) -> Result<()> {
        let changed = |place: String, transfer: &mut Option<Value>| -> Result<()> {
            if let Some(file) = file_of(transfer.as_ref()) {
                *transfer = Some(change(place, &file)?.to_string_lossy().into());
            }
            Ok(())
        };
        for (number, input) in self.inputs.iter_mut().enumerate() {
            input.file = change(format!("inputs[{number}].file"), &input.file)?;
            changed(format!("inputs[{number}].transfer"), &mut input.transfer)?;
        }
        changed("transfer".into(), &mut self.transfer)?;
        for name in FILES {
            let Some(value) = self.options.get_mut(name) else { continue };
            for text in values_of(value) {
                if let Some(file) = text.as_str().filter(|text| !Kernel::NAMES.contains(text)) {
                    let file = change(format!("options.{name}"), Path::new(file))?;
                    *text = file.to_string_lossy().into();
                }
            }
        }
        Ok(())
    }

    /// Returns the transfer function, if the scene has one of its own, rather than a name or a
    /// file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn transfer_function(&self) -> Result<Option<TransferFunction>, String> {
        function_of(self.transfer.as_ref())
    }

    /// Returns the transfer function of an input, by its number, like
    /// [`transfer_function`](Self::transfer_function): that of the input itself, or else that of
    /// the scene.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn transfer_of(&self, input: usize) -> Result<Option<TransferFunction>, String> {
        let own = self.inputs.get(input).and_then(|input| input.transfer.as_ref());
        function_of(own.or(self.transfer.as_ref()))
    }

    /// Sets the transfer function.
    pub fn set_transfer(&mut self, transfer: &TransferFunction) {
        self.transfer = value_of(transfer);
    }

    /// Sets the transfer function of an input, by its number.
    pub fn set_transfer_of(&mut self, input: usize, transfer: &TransferFunction) {
        if let Some(input) = self.inputs.get_mut(input) {
            input.transfer = value_of(transfer);
        }
    }

    /// Returns the text of a scene file in a folder. Inputs below the folder get relative paths.
    pub fn to_json(&self, folder: &Path) -> String {
        let mut own = self.clone();
        // It never fails.
        own.change_files(|_, file| Ok(relative(file, folder))).ok();
        // Maps with text keys and numbers always become JSON.
        let mut text = serde_json::to_string_pretty(&own).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Writes a scene file.
    ///
    /// # Errors
    /// [`Error::Output`]; a file that was there before is then unchanged.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let folder = path.parent().unwrap_or(Path::new(""));
        crate::disk::write(path, self.to_json(folder).as_bytes())
    }
}

/// Returns the folder of a scene file.
fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new(".")).to_owned()
}

/// Returns the values of an option: those of a list, or the one.
fn values_of(value: &mut Value) -> &mut [Value] {
    match value {
        Value::Array(values) => values,
        one => std::slice::from_mut(one),
    }
}

/// Returns what is wrong with an option that has too many values, or too long ones.
fn check_text(name: &str, value: &Value) -> Result<(), String> {
    match value {
        Value::Array(values) if values.len() > MOST_VALUES => {
            let found = values.len();
            Err(format!("options.{name}: has {found} values, but may have at most {MOST_VALUES}"))
        }
        Value::Array(values) => values.iter().try_for_each(|value| check_text(name, value)),
        Value::String(text) if name == "caption" => {
            let (found, most) = (text.chars().count(), SceneFile::MOST_CAPTION);
            if found <= most {
                return Ok(());
            }
            Err(format!("options.caption: has {found} letters, but may have at most {most}"))
        }
        Value::String(text) if text.len() > MOST_TEXT => {
            let found = text.len();
            Err(format!("options.{name}: has {found} bytes, but may have at most {MOST_TEXT}"))
        }
        _ => Ok(()),
    }
}

/// Returns the file of a transfer function, if an entry names one.
fn file_of(transfer: Option<&Value>) -> Option<PathBuf> {
    let name = transfer?.as_str()?;
    (!TransferFunction::NAMES.contains(&name)).then(|| name.into())
}

/// Returns the transfer function of an entry, if the entry is one, rather than a name or a file.
fn function_of(transfer: Option<&Value>) -> Result<Option<TransferFunction>, String> {
    let read = |value: &Value| TransferFunction::from_json(&value.to_string());
    let own = transfer.filter(|transfer| !transfer.is_string());
    own.map(read).transpose().map_err(|error| format!("transfer: {error}"))
}

/// Returns a transfer function as an entry.
fn value_of(transfer: &TransferFunction) -> Option<Value> {
    // What `to_json` writes is JSON.
    serde_json::from_str(&transfer.to_json()).ok()
}

/// Returns a path as seen from a folder, if it lies below the folder or beside it.
fn relative(path: &Path, folder: &Path) -> PathBuf {
    let whole = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        path.canonicalize().ok()
    };
    let (Some(own), Some(folder)) = (whole(path), whole(folder)) else {
        return path.to_owned();
    };
    let mut up = PathBuf::new();
    for above in folder.ancestors() {
        if let Ok(rest) = own.strip_prefix(above) {
            // Two files that share no folder but the root have no common place to move with.
            return if above.parent().is_none() { own } else { up.join(rest) };
        }
        up.push("..");
    }
    own
}

impl CameraEntry {
    /// Returns the camera.
    ///
    /// # Errors
    /// If there is neither a view angle nor a height, or both.
    pub fn camera(&self) -> Result<Camera, String> {
        let projection = match (self.view_angle, self.height) {
            (Some(view_angle), None) => Projection::Perspective { view_angle },
            (None, Some(height)) => Projection::Orthographic { height },
            _ => return Err("a camera has either a view_angle or a height".into()),
        };
        let [position, focal_point, view_up] =
            [self.position, self.focal_point, self.view_up].map(DVec3::from_array);
        let camera = Camera { position, focal_point, view_up, projection };
        camera.view([1, 1]).map_err(|error| error.to_string())?;
        Ok(camera)
    }
}

impl From<&Camera> for CameraEntry {
    fn from(camera: &Camera) -> Self {
        let [position, focal_point, view_up] =
            [camera.position, camera.focal_point, camera.view_up].map(|v| v.to_array());
        let (view_angle, height) = match camera.projection {
            Projection::Perspective { view_angle } => (Some(view_angle), None),
            Projection::Orthographic { height } => (None, Some(height)),
        };
        Self { position, focal_point, view_up, view_angle, height }
    }
}

impl ClipEntry {
    /// Returns the clip.
    ///
    /// # Errors
    /// If there is no shape, or more than one.
    pub fn clip(&self) -> Result<Clip, String> {
        let shape = match (self.plane, self.cuboid) {
            (Some([x, y, z, offset]), None) => {
                ClipShape::HalfSpace { normal: DVec3::new(x, y, z), offset }
            }
            (None, Some(corners)) => {
                let [min, max] = corners.map(DVec3::from_array);
                ClipShape::Box(Bounds { min, max })
            }
            _ => return Err("a clip has either a plane or a box".into()),
        };
        Ok(Clip { shape, inside: self.inside })
    }
}

impl From<&Clip> for ClipEntry {
    fn from(clip: &Clip) -> Self {
        let (plane, cuboid) = match clip.shape {
            ClipShape::HalfSpace { normal: DVec3 { x, y, z }, offset } => {
                (Some([x, y, z, offset]), None)
            }
            ClipShape::Box(Bounds { min, max }) => (None, Some([min.to_array(), max.to_array()])),
        };
        Self { plane, cuboid, inside: clip.inside }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> SceneFile {
        SceneFile::parse(
            r#"{"splatkit_scene": 1,
                "inputs": [{"file": "a.nrrd"}, {"file": "b.ply", "visible": false}],
                "size": [640, 480],
                "camera": {"position": [0.1, 2, 3], "focal_point": [0, 0, 0], "view_up": [0, 0, 1],
                           "view_angle": 30},
                "transfer": {"color": [[0, 1, 1, 1]], "opacity": [[0, 0], [5, 0.1]]},
                "clips": [{"plane": [1, 0, 0, 2.5]},
                          {"box": [[0, 0, 0], [1, 1, 1]], "inside": false}],
                "options": {"background": "white", "no-shade": true}}"#,
        )
        .expect("a scene")
    }

    #[test]
    fn a_scene_is_written_as_it_is_read() {
        let scene = scene();
        assert_eq!(scene.clips[1].cuboid, Some([[0.0; 3], [1.0; 3]]));
        let clip = scene.clips[0].clip().expect("valid");
        assert_eq!(ClipEntry::from(&clip), scene.clips[0]);
        assert!(!scene.clips[1].inside && scene.clips[0].inside && !scene.inputs[1].visible);
        let again = SceneFile::parse(&scene.to_json(Path::new(""))).expect("its own text");
        assert_eq!(again, scene);
        let camera = scene.camera.expect("a camera").camera().expect("valid");
        assert_eq!(CameraEntry::from(&camera), scene.camera.unwrap());
    }

    #[test]
    fn inputs_have_transfer_functions_of_their_own() {
        let mut scene = scene();
        let shared = scene.transfer_function().expect("a function");
        assert!(shared.is_some());
        assert_eq!(scene.transfer_of(0), Ok(shared.clone()));
        let own = TransferFunction { opacity: vec![(1.0, 0.5)], ..TransferFunction::default() };
        scene.set_transfer_of(1, &own);
        (scene.inputs[1].range, scene.inputs[1].iso) = (Some([0.0, 9.0]), Some("50%:red".into()));
        let again = SceneFile::parse(&scene.to_json(Path::new(""))).expect("its own text");
        assert_eq!(again, scene);
        assert_eq!(again.transfer_of(1), Ok(Some(own)));
        assert_eq!(again.transfer_of(0), Ok(shared));
        scene.inputs[0].transfer = Some("mri".into());
        assert_eq!(scene.transfer_of(0), Ok(None));
        scene.inputs[0].transfer = Some(serde_json::json!({"opacity": 3}));
        let error = SceneFile::parse(&scene.to_json(Path::new(""))).expect_err("no function");
        assert!(error.contains("a.nrrd: transfer"), "{error}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        let wrong = |from: &str, to: &str| {
            let text = scene().to_json(Path::new("")).replace(from, to);
            SceneFile::parse(&text).expect_err(to)
        };
        assert!(wrong("\"inputs\"", "\"input\"").contains("`input`"));
        assert!(wrong("\"visible\"", "\"visable\"").contains("visable"));
        assert!(wrong("\"splatkit_scene\": 1", "\"splatkit_scene\": 2").contains("version 1"));
        assert!(wrong("\"view_angle\": 30.0", "\"view_angle\": 0.0").contains("angle"));
        assert!(wrong("\"view_angle\": 30.0", "\"angle\": 30.0").contains("angle"));
        assert!(wrong("\"plane\"", "\"plan\"").contains("plan"));
        assert!(wrong("0.1", "7.5").contains("transfer"), "an opacity above 1");
    }

    #[test]
    fn paths_are_relative_to_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let data = folder.path().join("data");
        std::fs::create_dir(&data).expect("a folder");
        std::fs::write(data.join("a.ply"), "ply").expect("a file");
        let scenes = folder.path().join("scenes");
        std::fs::create_dir(&scenes).expect("a folder");
        let file = scenes.join("s.json");
        std::fs::write(data.join("t.json"), "{}").expect("a file");
        let mut scene = SceneFile::new([data.join("a.ply")]);
        scene.transfer = Some(data.join("t.json").to_string_lossy().into());
        scene.write(&file).expect("written");
        let text = std::fs::read_to_string(&file).expect("text");
        assert!(text.contains("../data/a.ply") && text.contains("../data/t.json"), "{text}");
        let error = SceneFile::read(&file, &Limits::default()).expect_err("outside").to_string();
        assert!(error.contains("inputs[0].file") && error.contains("leads out"), "{error}");
        let read = SceneFile::read_trusted(&file, &Limits::default()).expect("read");
        assert!(file_of(read.transfer.as_ref()).is_some_and(|file| file.exists()));
        assert_eq!(
            read.inputs[0].file.canonicalize().unwrap(),
            data.join("a.ply").canonicalize().unwrap()
        );
    }

    /// Makes files in a folder and in the folder of a scene inside it. Returns the latter, and
    /// names of what lies elsewhere.
    fn inside_and_elsewhere(folder: &Path) -> (PathBuf, Vec<&'static str>) {
        let inside = folder.join("scenes");
        std::fs::create_dir_all(inside.join("below")).expect("a folder");
        for file in ["scenes/a.ply", "scenes/below/t.json", "outside.ply"] {
            std::fs::write(folder.join(file), "{}").expect("a file");
        }
        let mut elsewhere = vec![
            "../outside.ply",
            "below/../../outside.ply",
            "/etc/hostname",
            "..\\outside.ply",
            "C:\\outside.ply",
            "//server/share/a.ply",
            "file:///etc/hostname",
            "https://example.org/a.ply",
            "s3://bucket/a.ply",
            "..",
        ];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink("../outside.ply", inside.join("link.ply")).expect("a link");
            std::os::unix::fs::symlink("..", inside.join("up")).expect("a link");
            elsewhere.extend(["link.ply", "up/outside.ply"]);
        }
        (inside, elsewhere)
    }

    /// A scene from elsewhere reads no other files of the user's, and asks no server.
    #[test]
    fn files_elsewhere_need_the_users_word() {
        let folder = tempfile::tempdir().expect("a folder");
        let (inside, elsewhere) = inside_and_elsewhere(folder.path());
        let file = inside.join("s.json");
        let text = |input: &str, own: &str, all: &str, labels: &str, kernel: &str| {
            serde_json::json!({
                "splatkit_scene": 1,
                "inputs": [{"file": "a.ply"}, {"file": input, "transfer": own, "visible": false}],
                "transfer": all,
                "options": {"labels": labels, "kernel": [kernel]},
            })
            .to_string()
        };
        let good = ["a.ply", "mri", "below/t.json", "below/t.json", "hann"];
        let write = |[input, own, all, labels, kernel]: [&str; 5]| {
            std::fs::write(&file, text(input, own, all, labels, kernel)).expect("a file");
            SceneFile::read(&file, &Limits::default())
        };
        let scene = write(good).expect("a scene");
        assert_eq!(scene.inputs[1].file, inside.join("a.ply"));
        assert_eq!(scene.inputs[1].transfer, Some("mri".into()));
        for value in [scene.transfer.as_ref(), scene.options.get("labels")] {
            assert_eq!(
                value.and_then(Value::as_str).map(Path::new),
                inside.join("below/t.json").to_str().map(Path::new)
            );
        }
        assert_eq!(scene.options["kernel"], serde_json::json!(["hann"]));
        let places = [
            "inputs[1].file",
            "inputs[1].transfer",
            "transfer",
            "options.labels",
            "options.kernel",
        ];
        for (number, place) in places.into_iter().enumerate() {
            for name in &elsewhere {
                let mut names = good;
                names[number] = name;
                let error = write(names).expect_err(name);
                let Error::Input { place: found, hint, .. } = &error else { panic!("{error}") };
                assert_eq!(found, place, "{name}: {error}");
                assert!(hint.as_deref().is_some_and(|hint| hint.contains("--trust-scene")));
                assert!(SceneFile::read_trusted(&file, &Limits::default()).is_ok(), "{name}");
            }
        }
    }

    #[test]
    fn counts_and_texts_are_limited() {
        let scene = |inputs: usize, options: Value| {
            let inputs = vec![serde_json::json!({"file": "a.ply"}); inputs];
            let whole =
                serde_json::json!({"splatkit_scene": 1, "inputs": inputs, "options": options});
            SceneFile::parse(&whole.to_string())
        };
        let none = || serde_json::json!({});
        assert!(scene(SceneFile::MOST_INPUTS, none()).is_ok());
        let error = scene(SceneFile::MOST_INPUTS + 1, none()).expect_err("too many");
        assert!(error.contains("10001") && error.contains("10000"), "{error}");
        let caption =
            |letters: usize| scene(1, serde_json::json!({"caption": "ä".repeat(letters)}));
        assert!(caption(SceneFile::MOST_CAPTION).is_ok());
        let error = caption(500_000).expect_err("too long");
        assert!(error.contains("options.caption: has 500000 letters"), "{error}");
        for value in [Value::from("a".repeat(MOST_TEXT + 1)), vec![1; MOST_VALUES + 1].into()] {
            let error = scene(1, serde_json::json!({"iso": value})).expect_err("too much");
            assert!(error.contains("options.iso"), "{error}");
        }
    }
}

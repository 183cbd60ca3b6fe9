//! The cameras that a trained scene was captured by, as trainers and their tools write them.

use super::CameraEntry;
use crate::{
    Error, Result,
    input::{Limits, Source},
};
use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;
use serde_json::Value;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

/// A view of a training.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingView {
    /// The name of its picture, without folders and extension.
    pub name: String,
    /// The camera. The middle of the picture is its axis, also where the lens was elsewhere.
    pub camera: CameraEntry,
    /// Width and height of the picture in pixels; 0 if the file does not say.
    pub size: [u32; 2],
}

/// Reads the views of a training: `cameras.json` beside a trained scene, `transforms.json` of
/// nerfstudio, or a folder of COLMAP with `images` and `cameras` as `.txt` or `.bin`, or one of
/// these `images` files.
///
/// # Errors
/// Those of opening the files; [`Error::Input`] for a file that is none of these, or damaged.
pub fn training_views(path: &Path, limits: &Limits) -> Result<Vec<TrainingView>> {
    if path.is_dir() {
        for name in ["images.bin", "images.txt"] {
            let file = path.join(name);
            if file.exists() {
                return training_views(&file, limits);
            }
        }
        let message = "a folder of COLMAP has images.bin or images.txt";
        return Err(Error::input(path, "folder", message));
    }
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let bytes = bytes(path, limits)?;
    let wrong = |message: String| Error::input(path, "cameras", message);
    if matches!(extension.as_str(), "bin" | "txt") {
        let cameras = path.with_file_name(format!("cameras.{extension}"));
        let lenses = self::bytes(&cameras, limits)?;
        let of_lens = |message: String| Error::input(&cameras, "cameras", message);
        return match extension.as_str() {
            "bin" => {
                let lenses = packed_lenses(&lenses).ok_or_else(|| of_lens("is cut".into()))?;
                packed_images(&bytes).ok_or_else(|| wrong("is cut".into()))?.views(&lenses)
            }
            _ => {
                let lenses = text_lenses(&text(&lenses)).map_err(of_lens)?;
                text_images(&text(&bytes)).map_err(wrong)?.views(&lenses)
            }
        }
        .map_err(wrong);
    }
    let value: Value = serde_json::from_slice(&bytes).map_err(|e| wrong(e.to_string()))?;
    let views = match value {
        Value::Array(all) => all.into_iter().map(of_trainer).collect(),
        Value::Object(_) => of_nerfstudio(value),
        _ => Err("has no list of cameras".into()),
    };
    views.map_err(wrong)
}

/// Returns a view by its number, from 0, or by its name.
///
/// # Errors
/// Those of [`training_views`]; [`Error::Input`] if there is no such view.
pub fn training_view(path: &Path, view: &str, limits: &Limits) -> Result<TrainingView> {
    let views = training_views(path, limits)?;
    let by_name = views.iter().position(|one| one.name == view);
    let number = || view.parse().ok().filter(|number: &usize| *number < views.len());
    match by_name.or_else(number) {
        Some(at) => Ok(views[at].clone()),
        None => {
            let last = views.len().saturating_sub(1);
            let first = views.first().map_or("", |view| view.name.as_str());
            Err(Error::input(path, "cameras", format!("has no view “{view}”"))
                .hint(format!("name one by its number, 0 to {last}, or its picture, as {first}")))
        }
    }
}

fn bytes(path: &Path, limits: &Limits) -> Result<Vec<u8>> {
    let source = Source::open(path, limits)?;
    Ok(source.part(0..source.len())?.into_owned())
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

type Read<T> = std::result::Result<T, String>;

/// Returns the name of a picture without folders and extension.
fn stem(name: &str) -> String {
    let name = name.replace('\\', "/");
    PathBuf::from(&name).file_stem().map_or(name, |stem| stem.to_string_lossy().into_owned())
}

/// Makes a view of a camera that looks along a direction, with another one down.
fn view(
    name: &str,
    [position, forward, down]: [DVec3; 3],
    [width, height]: [u32; 2],
    angle: f64,
) -> Read<TrainingView> {
    let entry = CameraEntry {
        position: position.to_array(),
        focal_point: (position + forward).to_array(),
        view_up: (-down).to_array(),
        view_angle: Some(angle),
        height: None,
    };
    entry.camera().map_err(|message| format!("the view “{name}”: {message}"))?;
    Ok(TrainingView { name: stem(name), camera: entry, size: [width, height] })
}

/// Returns the full angle of a length in pixels, seen by a lens with a focal length in pixels.
fn angle(pixels: f64, focal: f64) -> f64 {
    2.0 * (0.5 * pixels / focal).atan().to_degrees()
}

/// A camera of `cameras.json`: its axes are the columns of `rotation`, x to the right, y down.
#[derive(Deserialize)]
struct Trainer {
    img_name: String,
    width: u32,
    height: u32,
    position: [f64; 3],
    rotation: [[f64; 3]; 3],
    fy: f64,
}

fn of_trainer(value: Value) -> Read<TrainingView> {
    let one: Trainer = serde_json::from_value(value).map_err(|e| e.to_string())?;
    let axes = DMat3::from_cols_array_2d(&one.rotation).transpose();
    let places = [DVec3::from_array(one.position), axes.z_axis, axes.y_axis];
    let angle = angle(f64::from(one.height), one.fy);
    view(&one.img_name, places, [one.width, one.height], angle)
}

#[derive(Deserialize)]
struct Frame {
    file_path: String,
    /// From the camera to the world, by rows; x to the right, y up, z backward.
    transform_matrix: [[f64; 4]; 4],
    #[serde(flatten)]
    lens: Lens,
}

#[derive(Deserialize, Clone, Copy, Default)]
struct Lens {
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
}

/// `transforms.json`: frames with their lens, or with that of all.
#[derive(Deserialize)]
struct Nerfstudio {
    #[serde(flatten)]
    lens: Lens,
    frames: Vec<Frame>,
}

fn of_nerfstudio(value: Value) -> Read<Vec<TrainingView>> {
    let all: Nerfstudio = serde_json::from_value(value).map_err(|e| e.to_string())?;
    let of = |frame: Frame| {
        let (one, shared) = (frame.lens, all.lens);
        let [w, h] = [one.w.or(shared.w), one.h.or(shared.h)];
        let focal = one.fl_y.or(shared.fl_y).or(one.fl_x.or(shared.fl_x));
        let across = one.camera_angle_x.or(shared.camera_angle_x);
        let upright = one.camera_angle_y.or(shared.camera_angle_y);
        let angle = match (focal, h, upright, across, w) {
            (Some(focal), Some(h), ..) => angle(h, focal),
            (_, _, Some(upright), ..) => upright.to_degrees(),
            // Pictures without a size are as high as wide.
            (_, h, _, Some(across), w) => {
                let ratio = h.zip(w).map_or(1.0, |(h, w)| h / w);
                2.0 * ((0.5 * across).tan() * ratio).atan().to_degrees()
            }
            _ => return Err("has no focal length (fl_y) or angle (camera_angle_x)".into()),
        };
        let column =
            |at: usize| DVec3::from_array([0, 1, 2].map(|row| frame.transform_matrix[row][at]));
        let places = [column(3), -column(2), -column(1)];
        let size = [w, h].map(|pixels| pixels.unwrap_or(0.0) as u32);
        view(&frame.file_path, places, size, angle)
    };
    all.frames.into_iter().map(of).collect()
}

/// The lenses of COLMAP by their numbers: width, height, and the vertical focal length.
type Lenses = BTreeMap<u32, ([u32; 2], f64)>;

/// The number of parameters of COLMAP's lenses, by their numbers, and the place of the vertical
/// focal length among them.
const MODELS: [(&str, usize, usize); 11] = [
    ("SIMPLE_PINHOLE", 3, 0),
    ("PINHOLE", 4, 1),
    ("SIMPLE_RADIAL", 4, 0),
    ("RADIAL", 5, 0),
    ("OPENCV", 8, 1),
    ("OPENCV_FISHEYE", 8, 1),
    ("FULL_OPENCV", 12, 1),
    ("FOV", 5, 1),
    ("SIMPLE_RADIAL_FISHEYE", 4, 0),
    ("RADIAL_FISHEYE", 5, 0),
    ("THIN_PRISM_FISHEYE", 12, 1),
];

/// The pictures of COLMAP, each with its turn and shift from the world to the camera, and its lens.
struct Images(Vec<(String, [f64; 7], u32)>);

impl Images {
    fn views(self, lenses: &Lenses) -> Read<Vec<TrainingView>> {
        let of = |(name, [w, x, y, z, a, b, c], lens): (String, [f64; 7], u32)| {
            let (size, focal) =
                lenses.get(&lens).ok_or(format!("“{name}” has the unknown camera {lens}"))?;
            let axes = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
            let position = -(axes.transpose() * DVec3::new(a, b, c));
            let [forward, down] = [DVec3::Z, DVec3::Y].map(|axis| axes.transpose() * axis);
            view(&name, [position, forward, down], *size, angle(f64::from(size[1]), *focal))
        };
        let mut views: Vec<TrainingView> = self.0.into_iter().map(of).collect::<Read<_>>()?;
        views.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(views)
    }
}

/// Reads little-endian numbers; `None` at the end.
struct Packed<'a>(&'a [u8]);

impl Packed<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn whole(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn small(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn number(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }
}

fn packed_lenses(bytes: &[u8]) -> Option<Lenses> {
    let mut bytes = Packed(bytes);
    let mut lenses = Lenses::new();
    for _ in 0..bytes.whole()? {
        let (id, model) = (bytes.small()?, bytes.small()?);
        let size = [bytes.whole()? as u32, bytes.whole()? as u32];
        let (_, count, focal) = *MODELS.get(model as usize)?;
        let parameters: Vec<f64> = (0..count).map(|_| bytes.number()).collect::<Option<_>>()?;
        lenses.insert(id, (size, parameters[focal]));
    }
    Some(lenses)
}

fn packed_images(bytes: &[u8]) -> Option<Images> {
    let mut bytes = Packed(bytes);
    let mut images = Vec::new();
    for _ in 0..bytes.whole()? {
        bytes.small()?;
        let mut pose = [0.0; 7];
        for part in &mut pose {
            *part = bytes.number()?;
        }
        let lens = bytes.small()?;
        let end = bytes.0.iter().position(|byte| *byte == 0)?;
        let name = text(&bytes.0[..end]);
        bytes.0 = &bytes.0[end + 1..];
        let points = usize::try_from(bytes.whole()?).ok()?.checked_mul(24)?;
        bytes.0 = bytes.0.get(points..)?;
        images.push((name, pose, lens));
    }
    Some(Images(images))
}

/// Returns the words of the lines of a text, without comments. Empty lines count: a picture
/// without points has one.
fn lines(text: &str) -> impl Iterator<Item = Vec<&str>> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    lines.map(|line| line.split_whitespace().collect())
}

fn parsed<T: std::str::FromStr>(words: &[&str], at: usize) -> Read<T> {
    let word = words.get(at).ok_or(format!("a line ends before its value {}", at + 1))?;
    word.parse().map_err(|_| format!("“{word}” is not a number"))
}

fn text_lenses(text: &str) -> Read<Lenses> {
    let of = |words: Vec<&str>| {
        let model = MODELS.iter().find(|(name, ..)| words.get(1) == Some(name));
        let (_, _, focal) = model.ok_or(format!("{words:?} is no camera that is known"))?;
        let size = [parsed(&words, 2)?, parsed(&words, 3)?];
        Ok((parsed(&words, 0)?, (size, parsed(&words, 4 + focal)?)))
    };
    lines(text).filter(|words| !words.is_empty()).map(of).collect()
}

fn text_images(text: &str) -> Read<Images> {
    // Every second line has the points of the picture before it.
    let of = |words: Vec<&str>| {
        let mut pose = [0.0; 7];
        for (at, part) in pose.iter_mut().enumerate() {
            *part = parsed(&words, 1 + at)?;
        }
        Ok((words.get(9..).unwrap_or_default().join(" "), pose, parsed(&words, 8)?))
    };
    let images = lines(text).step_by(2).filter(|words| !words.is_empty());
    images.map(of).collect::<Read<_>>().map(Images)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::Folder;

    const CAMERAS: &str = r#"[{"id": 0, "img_name": "a/0001.jpg", "width": 800, "height": 600,
        "position": [1, 2, 3], "rotation": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
        "fx": 500, "fy": 300}]"#;

    /// The same camera by all formats: at (1, 2, 3), looking along y with −z down.
    fn check(view: &TrainingView) {
        assert_eq!((view.name.as_str(), view.size), ("0001", [800, 600]));
        let CameraEntry { position, focal_point, view_up, view_angle, .. } = view.camera;
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(position, [1.0, 2.0, 3.0]), "{position:?}");
        assert!(near(focal_point, [1.0, 3.0, 3.0]), "{focal_point:?}");
        assert!(near(view_up, [0.0, 0.0, 1.0]), "{view_up:?}");
        assert!((view_angle.unwrap() - 90.0).abs() < 1e-9);
    }

    #[test]
    fn all_formats_give_the_same_view() {
        let folder = Folder::new();
        let limits = Limits::default();
        let views = |name: &str| training_views(&folder.path(name), &limits).unwrap();
        folder.write("cameras.json", CAMERAS);
        check(&views("cameras.json")[0]);
        folder.write(
            "transforms.json",
            r#"{"fl_x": 500, "fl_y": 300, "w": 800, "h": 600, "other": [], "frames": [
            {"file_path": "images/0001.png", "transform_matrix":
            [[1, 0, 0, 1], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]]}]}"#,
        );
        check(&views("transforms.json")[0]);
        // The turn from the world to the camera: a quarter about x.
        let half = 0.5f64.sqrt();
        folder
            .write("images.txt", format!("# comment\n7 {half} {half} 0 0 -1 3 -2 2 0001.jpg\n\n"));
        folder.write("cameras.txt", "2 PINHOLE 800 600 500 300 400 300\n");
        check(&views("images.txt")[0]);
        let mut images = 1u64.to_le_bytes().to_vec();
        images.extend(7u32.to_le_bytes());
        for part in [half, half, 0.0, 0.0, -1.0, 3.0, -2.0] {
            images.extend(part.to_le_bytes());
        }
        images.extend(2u32.to_le_bytes());
        images.extend(b"0001.jpg\0");
        images.extend(1u64.to_le_bytes());
        images.extend([0; 24]);
        let mut cameras = 1u64.to_le_bytes().to_vec();
        cameras.extend(2u32.to_le_bytes());
        cameras.extend(1u32.to_le_bytes());
        [800u64, 600].iter().for_each(|size| cameras.extend(size.to_le_bytes()));
        [500.0f64, 300.0, 400.0, 300.0].iter().for_each(|one| cameras.extend(one.to_le_bytes()));
        folder.write("cameras.bin", &cameras);
        folder.write("images.bin", &images);
        check(&views("images.bin")[0]);
        check(&views("")[0]);
        // Every cut is an error.
        for end in 0..images.len() {
            folder.write("images.bin", &images[..end]);
            assert!(training_views(&folder.path("images.bin"), &limits).is_err(), "cut at {end}");
        }
    }

    #[test]
    fn views_are_chosen_by_number_and_name() {
        let folder = Folder::new();
        let path = folder.write("cameras.json", CAMERAS);
        let limits = Limits::default();
        check(&training_view(&path, "0", &limits).unwrap());
        check(&training_view(&path, "0001", &limits).unwrap());
        let error = training_view(&path, "7", &limits).unwrap_err();
        assert!(error.to_string().contains("no view “7”"));
        for (text, word) in [
            ("[{}]", "img_name"),
            ("3", "no list"),
            (r#"{"frames": [{"file_path": "a", "transform_matrix": 3}]}"#, "invalid type"),
        ] {
            let path = folder.write("cameras.json", text);
            let message = training_views(&path, &limits).unwrap_err().to_string();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}

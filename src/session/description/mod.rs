//! A scene described: which inputs it has, how they are read and shown, and how its picture is
//! drawn.
//!
//! A [`Description`] is what a scene file holds, what the flags of the command and the arguments of
//! Python say, and what a window changes. Its parts are plain data, with the names that they have
//! in JSON. [`Description::load`] makes a scene of it.

mod appearance;
mod camera;
mod clip;
mod color;
mod edit;
mod file;
mod kernel_file;
mod length;
mod light;
mod load;
#[cfg(test)]
mod parts_tests;
mod picture;
mod reading;
#[cfg(test)]
mod tests;
mod times;
mod transform;

pub use appearance::{
    AppearanceEntry, ChannelEntry, ChannelName, IsosurfaceEntry, KernelEntry, TransferEntry,
};
pub use camera::CameraEntry;
pub use clip::{Axis, ClipEntry, ClipSide, Place};
pub use color::{Background, ColorEntry};
pub use edit::EditEntry;
pub use length::PaperLength;
pub use light::LightName;
pub use load::{Loaded, LoadedInput, ReadInput};
pub use picture::{Composite, PictureEntry, Samples};
pub use reading::{LimitsEntry, ReadingEntry};
pub use transform::{Rotation, TransformEntry};

use super::{CellStyle, Framing, Showing};
use crate::{Error, Result, input::Limits};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A scene, and a picture of it (docs/scene-files.md, docs/scene.schema.json).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Description {
    /// The version of the layout, [`VERSION`](Self::VERSION).
    pub splatkit_scene: u32,
    /// What is drawn, in this order.
    pub inputs: Vec<InputEntry>,
    /// How inputs are read that do not say it themselves.
    #[serde(default, skip_serializing_if = "is_default")]
    pub reading: ReadingEntry,
    /// How inputs are shown that do not say it themselves.
    #[serde(default, skip_serializing_if = "is_default")]
    pub appearance: AppearanceEntry,
    /// Where the picture is taken from. Without a camera, one is fitted to the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraEntry>,
    /// How a camera is fitted to the scene, if there is none.
    #[serde(default, skip_serializing_if = "is_default")]
    pub framing: Framing,
    /// How the picture is drawn.
    #[serde(default, skip_serializing_if = "is_default")]
    pub picture: PictureEntry,
    /// What is written over the picture.
    #[serde(default, skip_serializing_if = "is_default")]
    pub overlay: OverlayEntry,
    /// What draws.
    #[serde(default, skip_serializing_if = "is_default")]
    pub engine: Engine,
}

/// An input of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct InputEntry {
    /// The path of the file. In a scene file it is relative to the scene file's folder.
    pub file: PathBuf,
    /// Whether the input is drawn.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub visible: bool,
    /// How it is read. Limits are those of the whole scene.
    #[serde(default, skip_serializing_if = "is_default")]
    pub reading: ReadingEntry,
    /// Where it is moved to.
    #[serde(default, skip_serializing_if = "is_default")]
    pub transform: TransformEntry,
    /// What is changed once it is moved, in this order.
    #[serde(default, skip_serializing_if = "is_default")]
    pub edits: Vec<EditEntry>,
    /// How it is shown.
    #[serde(default, skip_serializing_if = "is_default")]
    pub appearance: AppearanceEntry,
}

/// What is written over a picture.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct OverlayEntry {
    /// The colours of values, with their name, their unit and round numbers.
    #[serde(skip_serializing_if = "is_no")]
    pub scalar_bar: bool,
    /// How the axes lie; of patients, their sides.
    #[serde(skip_serializing_if = "is_no")]
    pub axes: bool,
    /// A round length in the inputs' unit.
    #[serde(skip_serializing_if = "is_no")]
    pub scale_bar: bool,
    /// A text above the picture's content. `\n` begins a new line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caption: Option<String>,
}

/// What draws a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Engine {
    /// A GPU if there is one, else the processor.
    #[default]
    Auto,
    /// A GPU.
    Gpu,
    /// The processor.
    Cpu,
}

impl OverlayEntry {
    /// Checks the texts.
    ///
    /// # Errors
    /// [`Error::Argument`] with the name of the field that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|(field, message)| Error::Argument(format!("{field}: {message}")))
    }

    fn check(&self) -> std::result::Result<(), appearance::Wrong> {
        let letters = self.caption.as_ref().map_or(0, |text| text.chars().count());
        let most = Description::MOST_CAPTION;
        match letters {
            letters if letters > most => {
                Err(("caption", format!("has {letters} letters, but may have at most {most}")))
            }
            _ => Ok(()),
        }
    }
}

fn yes() -> bool {
    true
}

fn is_yes(value: &bool) -> bool {
    *value
}

fn is_no(value: &bool) -> bool {
    !value
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl InputEntry {
    /// A visible input with nothing else set.
    pub fn new(file: PathBuf) -> Self {
        let (reading, transform, appearance) = Default::default();
        Self { file, visible: true, reading, transform, edits: Vec::new(), appearance }
    }
}

impl Description {
    /// The version of the layout.
    pub const VERSION: u32 = 2;

    /// Most inputs of a scene.
    pub const MOST_INPUTS: usize = 10_000;

    /// Most letters of a caption.
    pub const MOST_CAPTION: usize = 1000;

    /// A scene of these inputs, with nothing else set.
    pub fn new(inputs: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            splatkit_scene: Self::VERSION,
            inputs: inputs.into_iter().map(InputEntry::new).collect(),
            reading: ReadingEntry::default(),
            appearance: AppearanceEntry::default(),
            camera: None,
            framing: Framing::default(),
            picture: PictureEntry::default(),
            overlay: OverlayEntry::default(),
            engine: Engine::default(),
        }
    }

    /// Returns the inputs that are drawn.
    pub fn visible(&self) -> impl Iterator<Item = &InputEntry> {
        self.inputs.iter().filter(|input| input.visible)
    }

    /// Returns how an input is read.
    pub fn reading_of(&self, input: &InputEntry) -> ReadingEntry {
        input.reading.beside(&self.reading)
    }

    /// Returns how an input is shown.
    pub fn appearance_of(&self, input: &InputEntry) -> AppearanceEntry {
        input.appearance.beside(&self.appearance)
    }

    /// Returns how an input is shown. Reads the files that its appearance names.
    ///
    /// # Errors
    /// Those of [`AppearanceEntry::showing`] and [`ReadingEntry::complete`].
    pub fn showing(&self, input: &InputEntry) -> Result<Showing> {
        let reading = self.reading_of(input);
        let limits = reading.limits();
        let showing = self.appearance_of(input).showing(&limits)?;
        let mut showing = reading.complete(showing, limits.deadline())?;
        // Of values alone: colours have no largest one.
        if self.picture.optics.is_some_and(|optics| optics != Default::default()) {
            showing.appearance.optics = self.picture.optics.unwrap_or_default();
            showing.values_by = showing.values_by.or_else(|| Some("optics".into()));
            // They show the field inside cells.
            showing.cells = showing.cells.or(Some(CellStyle::Volume));
        }
        Ok(showing)
    }

    /// Returns how the camera looks at the scene.
    ///
    /// # Errors
    /// [`Error::Argument`] for a camera that cannot be.
    pub fn framing(&self) -> Result<Framing> {
        let camera = self.camera.as_ref().map(CameraEntry::camera).transpose();
        Ok(Framing { camera: camera.map_err(Error::Argument)?, ..self.framing.clone() })
    }

    /// Checks what does not depend on the inputs.
    ///
    /// # Errors
    /// The place of the field, such as `inputs[0].appearance.opacity`, and what is wrong with it.
    pub fn check(&self) -> std::result::Result<(), (String, String)> {
        let scene = |message: String| Err(("inputs".to_owned(), message));
        if self.inputs.is_empty() {
            return scene("there is no input".into());
        }
        let (count, most) = (self.inputs.len(), Self::MOST_INPUTS);
        if count > most {
            return scene(format!("there are {count}, but a scene may have at most {most}"));
        }
        for (number, input) in self.inputs.iter().enumerate() {
            let place = |part: &str, (field, message): appearance::Wrong| {
                (format!("inputs[{number}].{part}.{field}"), message)
            };
            input.reading.check().map_err(|wrong| place("reading", wrong))?;
            input.transform.check().map_err(|wrong| place("transform", wrong))?;
            self.appearance_of(input).check().map_err(|wrong| match self.appearance.check() {
                Err((field, message)) => (format!("appearance.{field}"), message),
                Ok(()) => place("appearance", wrong),
            })?;
            let channels = self.appearance_of(input).channels;
            if channels.is_some() && self.reading_of(input).scalar.is_some() {
                let message = "name channels (--channels) or one array (--scalar), not both";
                return Err(place("appearance", ("channels", message.into())));
            }
        }
        let place = |part: &'static str| {
            move |(field, message): appearance::Wrong| (format!("{part}.{field}"), message)
        };
        self.reading.check().map_err(place("reading"))?;
        self.appearance.check().map_err(place("appearance"))?;
        self.picture.check().map_err(place("picture"))?;
        self.framing.validate().map_err(|message| ("framing".to_owned(), message))?;
        let camera = self.camera.as_ref().map(CameraEntry::camera).transpose();
        camera.map_err(|message| ("camera".to_owned(), message))?;
        let is_placed = self.camera.is_some() || self.framing.camera_position.is_some();
        if is_placed && !self.picture.views.is_empty() {
            let message = "sides to look from need a camera that is fitted to the scene: leave out \
                           the place of the camera (--camera, --camera-position), or the sides";
            return Err(("picture.views".into(), message.into()));
        }
        self.overlay.check().map_err(place("overlay"))
    }

    /// Returns the files that the description names beside its inputs.
    pub fn files(&self) -> Vec<PathBuf> {
        let parts = self.visible().map(|input| &input.appearance).chain([&self.appearance]);
        parts.flat_map(AppearanceEntry::files).collect()
    }

    /// Reads a scene file. The paths of its files are joined with its folder. A scene file is an
    /// input like any other: the files that it names must lie beside it or below, and it may lower
    /// the limits of reading, but not raise them.
    ///
    /// # Errors
    /// [`Error::File`] and [`Error::Limit`] as for every input; [`Error::Input`] if the file is not
    /// a scene: the message names the field, or the line and the column. Also for files elsewhere,
    /// and for limits that are raised.
    pub fn read(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        file::read(path.as_ref(), limits)
    }

    /// As [`read`](Self::read), but the scene may name any files and addresses: for one that the
    /// user has made or trusts.
    ///
    /// # Errors
    /// Those of [`read`](Self::read), except for files elsewhere.
    pub fn read_trusted(path: impl AsRef<Path>, limits: &Limits) -> Result<Self> {
        file::read_trusted(path.as_ref(), limits)
    }

    /// Reads the text of a scene file. The paths of its files stay as they are: those of files in
    /// memory, for [`load_held`](Self::load_held).
    ///
    /// # Errors
    /// [`Error::Argument`] with the place and what is wrong there.
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = |(place, message)| Error::Argument(format!("{place}: {message}"));
        file::parse(text).map_err(wrong)
    }

    /// Returns the text of a scene file in this folder: paths are written as seen from there, and
    /// what reading and drawing may take is left out.
    pub fn to_json(&self, folder: &Path) -> String {
        file::to_json(self, folder)
    }

    /// Writes a scene file.
    ///
    /// # Errors
    /// [`Error::Output`]; a file that was there before is then unchanged.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        file::write(self, path.as_ref())
    }
}

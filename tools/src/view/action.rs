//! What a user asks for. Panels, keys and the hand return actions; the window applies them.

use super::selection::{Mode, Tool};
use eframe::egui::{ThemePreference, Vec2};
use glam::{DVec2, DVec3};
use splatkit::{
    interaction::Orbit,
    math::{Camera, Keyframe, Projection},
    session::{Description, Side},
    volume::TransferFunction,
};
use std::path::PathBuf;

/// A change of the scene.
pub type Change = Box<dyn FnOnce(&mut Description)>;

/// What a user asks for.
pub enum Action {
    /// Open the dialog that asks for a path.
    Ask(Purpose),
    /// Use the files that were chosen.
    Chosen(Purpose, Vec<PathBuf>),
    /// Show a file in place of the scene.
    OpenRecent(PathBuf),
    /// Forget the list of recent files.
    ForgetRecent,
    /// Change the scene, as one step that can be undone.
    Change(Change),
    /// Change the scene while the hand moves. The step ends once no button of the pointer is held.
    Drag(Change),
    /// Undo the last step.
    Undo,
    /// Take the step again that was undone.
    Redo,
    /// Edit the field of this item.
    ChooseField(usize),
    /// Show the field that is edited by this function, as [`Self::Drag`] does.
    Transfer(Box<TransferFunction>),
    /// Move and widen the function of the field, by a drag in points.
    Level(Vec2),
    /// Move the camera.
    Move(Motion),
    /// Look at the whole scene from a side, or as usual.
    View(Option<Side>),
    /// Show or hide a part of the window.
    Toggle(Part),
    /// Change what is selected, or do something with it.
    Select(Select),
    /// Begin or end measuring.
    Measure,
    /// Measure from or to a point, in world units.
    Pick(DVec3),
    /// Turn about a point from now on, where the slices cross too.
    Center(DVec3),
    /// Replace the keyframes of the camera's path.
    Keyframes(Vec<Keyframe>),
    /// Give up the film or the figure that is being written.
    CancelFilm,
    /// Give up the scene that is being loaded.
    CancelLoading,
    /// Copy the command that draws what is shown.
    CopyCommand,
    /// Choose light or dark colours of the window.
    Theme(ThemePreference),
    /// Fill the screen, or stop.
    FullScreen,
    /// Close the window.
    Quit,
    /// Show a message.
    Say(String),
}

impl Action {
    /// Returns a change of the scene, as one step.
    pub fn change(change: impl FnOnce(&mut Description) + 'static) -> Self {
        Self::Change(Box::new(change))
    }

    /// Returns a change of the scene that is part of a step.
    pub fn drag(change: impl FnOnce(&mut Description) + 'static) -> Self {
        Self::Drag(Box::new(change))
    }
}

/// A change of what is selected.
#[derive(Debug, Clone, PartialEq)]
pub enum Select {
    /// Draw outlines with this, or turn the scene again.
    Tool(Option<Tool>),
    /// What becomes of the selection before.
    Mode(Mode),
    /// Whether outlines select no deeper than what is seen in them.
    Near(bool),
    /// Select what an outline holds, by its corners in pixels of the picture.
    Outline(Vec<DVec2>),
    /// Select what meets a condition.
    Condition(String),
    /// Select everything else.
    Invert,
    /// Select nothing, and turn the scene again.
    Clear,
    /// Delete what is selected.
    Delete,
    /// Delete everything else.
    Keep,
}

/// A part of the window that can be hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The panels beside the picture.
    Side,
    /// The slices of a volume.
    Slices,
    /// The list of keys.
    Help,
    /// The handles of clips in the picture.
    Handles,
}

/// A movement of the camera. Drags are in pixels of the picture.
#[derive(Debug, Clone)]
pub enum Motion {
    Turn(DVec2),
    LookAround(DVec2),
    /// A drag of the point at this depth.
    Pan(DVec2, Option<f64>),
    /// A factor, at a pixel where the scene has this depth.
    Zoom(f64, DVec2, Option<f64>),
    /// A step to the right, up and forwards, as shares of the distance to the focal point.
    Fly(DVec3),
    /// Perspective on or off.
    Perspective,
    Set(Box<Camera>),
}

impl Motion {
    /// Moves a camera whose picture has this size in pixels.
    pub fn apply(self, orbit: &mut Orbit, size: [u32; 2]) {
        match self {
            Self::Turn(drag) => orbit.turn(drag, size),
            Self::LookAround(drag) => orbit.look_around(drag, size),
            // Without a picture there is nothing to move.
            Self::Pan(drag, depth) => drop(orbit.pan(drag, size, depth)),
            Self::Zoom(factor, cursor, depth) => drop(orbit.zoom(factor, cursor, size, depth)),
            Self::Fly(step) => {
                let camera = orbit.camera();
                let distance = (camera.focal_point - camera.position).length();
                orbit.fly(step * distance);
            }
            Self::Perspective => {
                let projection = &orbit.camera().projection;
                let is_perspective = matches!(projection, Projection::Perspective { .. });
                orbit.set_orthographic(is_perspective);
            }
            Self::Set(camera) => orbit.set_camera(*camera),
        }
    }
}

/// What a path is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    Open,
    SaveScene,
    SavePicture,
    SaveFigure,
    OpenTransfer,
    SaveTransfer,
    OpenPath,
    SavePath,
    Export,
    /// An input as it is edited, by its number.
    SaveEdited(usize),
}

impl Purpose {
    /// Returns the title of the dialog.
    pub fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a file",
            Self::SaveScene => "Save the scene",
            Self::SavePicture => "Save the picture",
            Self::SaveFigure => "Save the figure",
            Self::OpenTransfer => "Load a transfer function",
            Self::SaveTransfer => "Save the transfer function",
            Self::OpenPath => "Open a path of the camera",
            Self::SavePath => "Save the path of the camera",
            Self::Export => "Export a film",
            Self::SaveEdited(_) => "Save the edited input",
        }
    }

    /// Returns the name to begin with, for a file that is written.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Self::Open | Self::OpenTransfer | Self::OpenPath => None,
            Self::SaveScene => Some("scene.json"),
            Self::SavePicture => Some("picture.png"),
            Self::SaveFigure => Some("figure.png"),
            Self::SaveTransfer => Some("transfer.json"),
            Self::SavePath => Some("path.json"),
            Self::Export => Some("film.webp"),
            Self::SaveEdited(_) => Some("edited.ply"),
        }
    }

    /// Returns the endings of the names of files, if only a few are meant.
    pub fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Open => &[],
            Self::SavePicture | Self::SaveFigure => {
                &["png", "jpg", "jpeg", "tiff", "tif", "webp", "exr"]
            }
            Self::SaveEdited(_) => {
                &["ply", "las", "laz", "e57", "spz", "sog", "splat", "glb", "splk"]
            }
            Self::Export => &["webp", "gif", "apng", "mp4", "webm", "mov", "png"],
            _ => &["json"],
        }
    }
}

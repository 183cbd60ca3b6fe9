//! The flags of the camera.

use crate::{figure::sides, parse};
use clap::Args;
use glam::DVec3;
use splatkit::{
    Error,
    input::Limits,
    math::Camera,
    session::{CameraEntry, Description, Framing, Side, training_view},
};

/// The camera's flags. By default, the camera sees the whole scene from the front, from the right
/// and from above.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Camera")]
pub struct CameraFlags {
    /// Use this camera, as JSON: what --json prints. The scene is not fitted to the picture then.
    #[arg(
        long,
        value_name = "JSON",
        value_parser = given_camera,
        conflicts_with_all = [
            "view", "camera_position", "focal_point", "view_up", "view_angle", "distance",
            "azimuth", "elevation", "orthographic",
        ]
    )]
    camera: Option<CameraEntry>,
    /// Take a view of a training: FILE:VIEW, by its number from 0 or by its picture. FILE is
    /// cameras.json, transforms.json of nerfstudio, or a folder of COLMAP. Set --size to the shape
    /// of the picture.
    #[arg(
        long,
        value_name = "FILE:VIEW",
        value_parser = view_of,
        conflicts_with_all = [
            "camera", "view", "camera_position", "focal_point", "view_up", "view_angle",
            "distance", "azimuth", "elevation", "orthographic",
        ]
    )]
    view_of: Option<CameraEntry>,
    /// Look from this side. right is at the right of a viewer who looks at the front; iso is a
    /// corner of the box around the scene. --azimuth and --elevation turn the view further
    /// [default: from the front, 30 degrees to the right and 20 upwards]
    #[arg(long, value_parser = sides(), value_name = "SIDE", conflicts_with = "camera_position")]
    view: Option<Side>,
    /// Place the camera at this point.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    camera_position: Option<DVec3>,
    /// Aim the camera at this point [default: the middle of what is seen]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    focal_point: Option<DVec3>,
    /// Set the direction that is up in the picture [default: the scene's up axis]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    view_up: Option<DVec3>,
    /// Set the vertical view angle at a zoom of 1 [default: 30]
    #[arg(long, value_name = "DEGREES", value_parser = parse::view_angle)]
    view_angle: Option<f64>,
    /// Set the distance of the camera from its focal point, in world units [default: the scene
    /// fills the picture]
    #[arg(
        long,
        value_name = "LENGTH",
        value_parser = parse::positive,
        conflicts_with = "camera_position"
    )]
    distance: Option<f64>,
    /// Orbit the camera to the right around the up axis [default: 30, or 0 with --view or
    /// --camera-position]
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    azimuth: Option<f64>,
    /// Orbit the camera upwards [default: 20, or 0 with --view or --camera-position]
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    elevation: Option<f64>,
    /// Enlarge the middle of the picture. At 1, the scene fills the picture; for bench, the sphere
    /// around the scene does [default: 1]
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    zoom: Option<f64>,
    /// Draw without perspective.
    #[arg(long)]
    orthographic: bool,
    /// Set the scene's up axis: +X, -X, +Y, -Y, +Z, -Z or X,Y,Z [default: as the first input says
    /// that does; +Z for volumes and samples, -Y for trained Gaussians; otherwise guessed from the
    /// shape]
    #[arg(
        long,
        value_name = "AXIS",
        value_parser = parse::direction,
        allow_hyphen_values = true
    )]
    up: Option<DVec3>,
}

impl CameraFlags {
    /// Returns how the camera looks at the scene.
    pub fn framing(&self) -> Framing {
        Framing {
            camera: None,
            view: self.view,
            camera_position: self.camera_position,
            focal_point: self.focal_point,
            view_up: self.view_up,
            view_angle: self.view_angle,
            distance: self.distance,
            azimuth: self.azimuth,
            elevation: self.elevation,
            zoom: self.zoom,
            orthographic: self.orthographic,
            up: self.up,
        }
    }

    /// Changes where the picture of a scene is taken from: by the flags that are given. Any of
    /// those that place the camera replaces the scene's own camera.
    pub fn apply(&self, scene: &mut Description) {
        let framing = self.framing();
        let placing = Framing { zoom: None, up: None, ..framing.clone() };
        if placing != Framing::default() {
            scene.camera = None;
        }
        let camera = self.camera.or(self.view_of);
        scene.camera = camera.or(scene.camera);
        if camera.is_some() || self.view.is_some() || self.camera_position.is_some() {
            scene.picture.views.clear();
            (scene.picture.columns, scene.picture.panel_labels) = (None, None);
        }
        let mut before = std::mem::take(&mut scene.framing);
        if framing.camera_position.is_some() {
            (before.view, before.distance) = (None, None);
        }
        if framing.view.is_some() || framing.distance.is_some() {
            before.camera_position = None;
        }
        scene.framing = Framing {
            camera: None,
            view: framing.view.or(before.view),
            camera_position: framing.camera_position.or(before.camera_position),
            focal_point: framing.focal_point.or(before.focal_point),
            view_up: framing.view_up.or(before.view_up),
            view_angle: framing.view_angle.or(before.view_angle),
            distance: framing.distance.or(before.distance),
            azimuth: framing.azimuth.or(before.azimuth),
            elevation: framing.elevation.or(before.elevation),
            zoom: framing.zoom.or(before.zoom),
            orthographic: framing.orthographic || before.orthographic,
            up: framing.up.or(before.up),
        };
    }
}

/// Reads a view of a training.
fn view_of(text: &str) -> Result<CameraEntry, String> {
    let form = "the form is FILE:VIEW, such as cameras.json:17";
    let (file, view) = text.rsplit_once(':').ok_or(form)?;
    let view =
        training_view(file.as_ref(), view, &Limits::default()).map_err(|error| match &error {
            Error::Input { hint: Some(hint), .. } => format!("{error}; {hint}"),
            error => error.to_string(),
        })?;
    Ok(view.camera)
}

/// Parses a camera that [`to_json`] has written.
fn given_camera(text: &str) -> Result<CameraEntry, String> {
    let form = "the form is {\"position\": [x, y, z], \"focal_point\": [x, y, z], \"view_up\": \
                [x, y, z], \"view_angle\": 30}, or with \"height\" without perspective";
    let entry: CameraEntry = serde_json::from_str(text).map_err(|e| format!("{e}; {form}"))?;
    entry.camera()?;
    Ok(entry)
}

/// Returns the camera with the flags' names as keys.
pub fn to_json(camera: &Camera) -> serde_json::Value {
    serde_json::json!(CameraEntry::from(camera))
}

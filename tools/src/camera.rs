//! The flags of the camera.

use crate::parse;
use clap::Args;
use glam::DVec3;
use splatkit::math::{Bounds, Camera, Projection};

/// Share of the picture that stays free around a scene that the camera is fitted to.
const MARGIN: f64 = 0.04;

/// Where the default camera stands: to the right of the front and above it.
const AZIMUTH: f64 = 30.0;
const ELEVATION: f64 = 20.0;

/// Camera: by default the whole scene is seen from the front, turned to the right and above.
///
/// The front is seen along −z where +Y is up, as in VTK; along +y where +Z is up.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Camera")]
pub struct CameraFlags {
    /// Where the camera stands.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    camera_position: Option<DVec3>,
    /// What it looks at; the scene's centre by default.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    focal_point: Option<DVec3>,
    /// The direction that is up in the picture; that of --up by default.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    view_up: Option<DVec3>,
    /// Vertical view angle in degrees, at a zoom of 1; 30 by default.
    #[arg(long, value_name = "DEGREES", value_parser = parse::view_angle)]
    view_angle: Option<f64>,
    /// Turns the camera to the right around the up axis [default: 30, or 0 with --camera-position]
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    azimuth: Option<f64>,
    /// Turns the camera up [default: 20, or 0 with --camera-position]
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    elevation: Option<f64>,
    /// Enlarges the picture's middle; 1 shows the sphere around the scene. By default the scene's box fills the picture;
    /// 1 for turntables and with --camera-position.
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    zoom: Option<f64>,
    /// Draws without perspective.
    #[arg(long)]
    orthographic: bool,
    /// The scene's up axis: +Y by default, +Z where all inputs are volumes, samples, or clouds of a surveyor's format (LAS,
    /// E57, tables of points).
    #[arg(long, value_name = "AXIS", value_parser = parse::axis, allow_hyphen_values = true)]
    up: Option<DVec3>,
}

/// What the camera is pointed at.
#[derive(Debug, Clone, Copy)]
pub struct Subject {
    /// The box around samples and vertices (footprints reach further).
    pub bounds: Bounds,
    /// The up axis where the user names none.
    pub up: DVec3,
}

impl CameraFlags {
    /// The camera of a single picture.
    pub fn camera(&self, subject: &Subject, size: [u32; 2]) -> splatkit::Result<Camera> {
        let mut camera = self.turned(subject, size, 0.0);
        if self.zoom.is_none() && self.camera_position.is_none() {
            camera.fit(&subject.bounds, size, MARGIN)?;
        }
        Ok(camera)
    }

    /// The camera turned by further degrees about the up axis, at the same distance for every turn.
    pub fn turned(&self, subject: &Subject, size: [u32; 2], turn: f64) -> Camera {
        let up = self.up.unwrap_or(subject.up);
        let view_up = self.view_up.unwrap_or(up);
        let view_angle = self.view_angle.unwrap_or(Camera::DEFAULT_VIEW_ANGLE);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let mut camera =
            Camera::framing_with(&subject.bounds, front(up), view_up, aspect, view_angle);
        if let Some(focal_point) = self.focal_point {
            camera.position += focal_point - camera.focal_point;
            camera.focal_point = focal_point;
        }
        let placed = self.camera_position.is_some();
        if let Some(position) = self.camera_position {
            camera.position = position;
        }
        camera.azimuth(self.azimuth.unwrap_or(if placed { 0.0 } else { AZIMUTH }) + turn);
        camera.elevation(self.elevation.unwrap_or(if placed { 0.0 } else { ELEVATION }));
        if self.orthographic {
            camera.make_orthographic();
        }
        camera.zoom(self.zoom.unwrap_or(1.0));
        camera
    }
}

/// The direction that the front is looked at along.
fn front(up: DVec3) -> DVec3 {
    if up.z.abs() > 0.5 { DVec3::Y } else { DVec3::NEG_Z }
}

/// The camera as the flags take it.
pub fn to_json(camera: &Camera) -> serde_json::Value {
    let (name, value) = match camera.projection {
        Projection::Perspective { view_angle } => ("view_angle", view_angle),
        Projection::Orthographic { height } => ("height", height),
    };
    serde_json::json!({
        "position": camera.position.to_array(),
        "focal_point": camera.focal_point.to_array(),
        "view_up": camera.view_up.to_array(),
        name: value,
    })
}

//! The flags of the camera.

use crate::parse;
use clap::Args;
use glam::DVec3;
use splatkit::math::{Bounds, Camera, Projection};

/// Share of the picture that is left free around a scene that the camera is fitted to.
const MARGIN: f64 = 0.04;

/// Angles of the default camera, in degrees: to the right of the front and above it.
const AZIMUTH: f64 = 30.0;
const ELEVATION: f64 = 20.0;

/// The camera's flags. By default, the camera sees the whole scene from the front, from the right
/// and from above.
///
/// The front is seen along −z if +Y is up, as in VTK, and along +y if +Z is up.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Camera")]
pub struct CameraFlags {
    /// Place the camera at this point.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    camera_position: Option<DVec3>,
    /// Aim the camera at this point [default: the scene's centre]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    focal_point: Option<DVec3>,
    /// Set the direction that is up in the picture [default: the scene's up axis]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::vector, allow_hyphen_values = true)]
    view_up: Option<DVec3>,
    /// Set the vertical view angle at a zoom of 1 [default: 30]
    #[arg(long, value_name = "DEGREES", value_parser = parse::view_angle)]
    view_angle: Option<f64>,
    /// Orbit the camera to the right around the up axis [default: 30, or 0 with --camera-position]
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    azimuth: Option<f64>,
    /// Orbit the camera upwards [default: 20, or 0 with --camera-position]
    #[arg(long, value_name = "DEGREES", value_parser = parse::finite, allow_hyphen_values = true)]
    elevation: Option<f64>,
    /// Enlarge the middle of the picture. At 1, the sphere around the scene fills the picture
    /// [default: the scene's box fills the picture; 1 for turntables, for bench and with
    /// --camera-position]
    #[arg(long, value_name = "FACTOR", value_parser = parse::positive)]
    zoom: Option<f64>,
    /// Draw without perspective.
    #[arg(long)]
    orthographic: bool,
    /// Set the scene's up axis [default: +Y; +Z if all inputs are volumes, samples, or point clouds
    /// in a surveyor's format (LAS, E57, tables of points)]
    #[arg(long, value_name = "AXIS", value_parser = parse::axis, allow_hyphen_values = true)]
    up: Option<DVec3>,
}

/// The scene as the camera needs it.
#[derive(Debug, Clone, Copy)]
pub struct Subject {
    /// The box around samples and vertices; footprints reach further.
    pub bounds: Bounds,
    /// The up axis unless the user sets one.
    pub up: DVec3,
}

impl CameraFlags {
    /// Returns the camera of a single picture.
    pub fn camera(&self, subject: &Subject, size: [u32; 2]) -> splatkit::Result<Camera> {
        let mut camera = self.turned(subject, size, 0.0);
        if self.zoom.is_none() && self.camera_position.is_none() {
            camera.fit(&subject.bounds, size, MARGIN)?;
        }
        Ok(camera)
    }

    /// Returns the camera turned by `turn` more degrees about the up axis. Its distance is the same
    /// for every turn.
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

/// Returns the view direction of the front.
fn front(up: DVec3) -> DVec3 {
    if up.z.abs() > 0.5 { DVec3::Y } else { DVec3::NEG_Z }
}

/// Returns the camera with the flags' names as keys.
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

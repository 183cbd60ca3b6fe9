//! Cameras of a description.

use crate::math::{Camera, Projection};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A camera, in world units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
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

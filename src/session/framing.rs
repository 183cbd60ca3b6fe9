//! The camera that shows a scene: by default all of it, from the front, from the right and from
//! above.

use super::{Origin, Subject};
use crate::{
    Error, Result,
    about::Orientation,
    math::{Bounds, Camera, Projection},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Share of the picture that is left free around a scene that the camera is fitted to.
const MARGIN: f64 = 0.04;

/// Angles of the default camera, in degrees: to the right of the front and above it.
const AZIMUTH: f64 = 30.0;
const ELEVATION: f64 = 20.0;

/// How a camera looks at a scene. What is not given follows from the scene. Lengths are in world
/// units, angles in degrees.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Framing {
    /// A whole camera. All else but the zoom and the up axis is ignored then.
    #[serde(skip)]
    pub camera: Option<Camera>,
    /// The side to look from. The azimuth and the elevation turn the view further.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<Side>,
    /// The place of the camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<[f64; 3]>"))]
    pub camera_position: Option<DVec3>,
    /// The point that the camera aims at; by default the middle of what is seen.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<[f64; 3]>"))]
    pub focal_point: Option<DVec3>,
    /// The direction that is up in the picture; by default the scene's up axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<[f64; 3]>"))]
    pub view_up: Option<DVec3>,
    /// The vertical view angle at a zoom of 1; by default [`Camera::DEFAULT_VIEW_ANGLE`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_angle: Option<f64>,
    /// The distance of the camera from its focal point; by default the scene fills the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
    /// The turn to the right around the up axis; by default 30, or 0 with a side or a position, and
    /// for slices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub azimuth: Option<f64>,
    /// The turn upwards; by default 20, or 0 with a side or a position, and for slices.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub elevation: Option<f64>,
    /// How often the middle of the picture is enlarged; by default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zoom: Option<f64>,
    /// Whether to draw without perspective.
    #[serde(skip_serializing_if = "is_perspective")]
    pub orthographic: bool,
    /// The scene's up axis; by default that of the [`Subject`].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, schemars(with = "Option<[f64; 3]>"))]
    pub up: Option<DVec3>,
}

fn is_perspective(orthographic: &bool) -> bool {
    !orthographic
}

/// A side to look from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Side {
    /// Against the scene's front.
    Front,
    /// From behind.
    Back,
    /// From the left of a viewer who looks at the front.
    Left,
    /// From the right of that viewer.
    Right,
    /// From above.
    Top,
    /// From below.
    Bottom,
    /// From a corner of the box around the scene.
    Iso,
}

impl Side {
    /// All sides.
    pub const ALL: [Self; 7] =
        [Self::Front, Self::Back, Self::Left, Self::Right, Self::Top, Self::Bottom, Self::Iso];

    /// Returns the name: `front`, `back`, `left`, `right`, `top`, `bottom` or `iso`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Iso => "iso",
        }
    }

    /// Returns the azimuth and the elevation, in degrees.
    fn angles(self) -> [f64; 2] {
        match self {
            Self::Front => [0.0, 0.0],
            Self::Back => [180.0, 0.0],
            Self::Left => [-90.0, 0.0],
            Self::Right => [90.0, 0.0],
            Self::Top => [0.0, 90.0],
            Self::Bottom => [0.0, -90.0],
            // The three sides of a cube look alike.
            Self::Iso => [45.0, 0.5f64.sqrt().atan().to_degrees()],
        }
    }
}

impl Framing {
    /// Returns a message if a number cannot be that of a camera.
    pub fn validate(&self) -> std::result::Result<(), String> {
        let vectors = [self.camera_position, self.focal_point, self.view_up, self.up];
        let turns = [self.azimuth, self.elevation];
        let numbers = [self.view_angle, self.distance, self.zoom];
        let are_finite = vectors.iter().flatten().all(|vector| vector.is_finite())
            && turns.iter().flatten().all(|angle| angle.is_finite());
        let are_positive = numbers.iter().flatten().all(|v| *v > 0.0 && v.is_finite());
        if !are_finite || !are_positive {
            return Err("a camera needs finite numbers; angles and lengths are above 0".into());
        }
        if self.camera_position.is_some() && (self.view.is_some() || self.distance.is_some()) {
            return Err("a camera has either a position, or a side and a distance".into());
        }
        if self.view_angle.is_some_and(|angle| angle >= 180.0) {
            return Err("view_angle is an angle between 0 and 180 degrees".into());
        }
        if self.up.is_some_and(|up| up.try_normalize().is_none()) {
            return Err("up is a direction with a length above 0".into());
        }
        Ok(())
    }

    /// Returns the camera of a picture of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Argument`] for a scene that no camera can hold.
    pub fn camera(&self, subject: &Subject, size: [u32; 2]) -> Result<Camera> {
        let mut camera = self.aimed(subject, size, 0.0);
        if !self.is_placed() {
            let points = spanning(subject);
            if self.focal_point.is_none() {
                camera.fit_points(&points, size, MARGIN)?;
            } else if let Some(distance) = camera.distance_to_fit(&points, size, MARGIN)? {
                camera.set_distance(distance);
            }
        }
        camera.zoom(self.zoom.unwrap_or(1.0));
        Ok(camera)
    }

    /// Returns the cameras of a turntable, which turn once about the up axis. All have the same
    /// distance, at which every frame shows the whole scene.
    ///
    /// # Errors
    /// Those of [`camera`](Self::camera).
    pub fn turntable(&self, subject: &Subject, size: [u32; 2], frames: u32) -> Result<Vec<Camera>> {
        let turn = |frame: u32| 360.0 * f64::from(frame) / f64::from(frames);
        let mut cameras: Vec<Camera> =
            (0..frames).map(|frame| self.aimed(subject, size, turn(frame))).collect();
        if !self.is_placed() {
            let points = spanning(subject);
            let mut most: Option<f64> = None;
            // A degree more or less changes nothing.
            for camera in cameras.iter().step_by(cameras.len().div_ceil(360)) {
                let distance = camera.distance_to_fit(&points, size, MARGIN)?;
                most = distance.map(|distance| most.map_or(distance, |most| most.max(distance)));
            }
            if let Some(distance) = most {
                cameras.iter_mut().for_each(|camera| camera.set_distance(distance));
            }
        }
        cameras.iter_mut().for_each(|camera| camera.zoom(self.zoom.unwrap_or(1.0)));
        Ok(cameras)
    }

    /// Returns the cameras of pictures of one size that show the scene from several sides. All have
    /// the same scale: a length in the focal plane is as long in each.
    ///
    /// # Errors
    /// Those of [`camera`](Self::camera).
    pub fn views(&self, subject: &Subject, size: [u32; 2], sides: &[Side]) -> Result<Vec<Camera>> {
        let from = |side: &Side| Self { view: Some(*side), ..self.clone() }.camera(subject, size);
        let mut cameras: Vec<Camera> = sides.iter().map(from).collect::<Result<_>>()?;
        let distance = |camera: &Camera| match camera.projection {
            Projection::Perspective { .. } => camera.position.distance(camera.focal_point),
            Projection::Orthographic { height } => height,
        };
        let most = cameras.iter().map(distance).fold(0.0, f64::max);
        cameras.iter_mut().for_each(|camera| camera.set_distance(most));
        Ok(cameras)
    }

    /// Returns the camera turned by `turn` more degrees about the up axis. At a zoom of 1, the
    /// sphere around the scene's box fills the picture. Its distance is the same for every turn.
    pub fn turned(&self, subject: &Subject, size: [u32; 2], turn: f64) -> Camera {
        let mut camera = self.aimed(subject, size, turn);
        camera.zoom(self.zoom.unwrap_or(1.0));
        camera
    }

    /// Returns why the usual camera, which is the default, cannot see a box in a picture of
    /// `size` pixels. If it cannot, the box is at fault, whatever the user says.
    pub fn usual_fault(subject: &Subject, bounds: &Bounds, size: [u32; 2]) -> Option<Error> {
        let usual = Self::default().camera(subject, size);
        usual.and_then(|camera| camera.view(size)?.validate_for(bounds)).err()
    }

    /// Returns the error for an input that no usual camera sees, because of such a fault.
    pub fn out_of_sight(path: &Path, Bounds { min, max }: Bounds, fault: &Error) -> Error {
        let text = |place: DVec3| place.to_array().map(|v| format!("{v:e}")).join(", ");
        let (min, max) = (text(min), text(max));
        let message = format!("the content reaches from {min} to {max}: {fault}");
        Error::input(path, "bounds", message)
            .hint("give positions, sizes and spacings in a unit in which they are moderate numbers")
    }

    /// Whether the camera's distance is given, so that it is not fitted to the scene.
    pub fn is_placed(&self) -> bool {
        self.camera.is_some() || self.camera_position.is_some() || self.distance.is_some()
    }

    /// Returns how the scene stands in the picture, and where that comes from.
    pub fn orientation(&self, subject: &Subject) -> (Orientation, Origin) {
        match self.up.and_then(DVec3::try_normalize) {
            // The front is kept if the axis is the subject's own.
            Some(up) if up.dot(subject.orientation.up) < 0.999_999 => {
                (Orientation::with_up(up), Origin::Flag)
            }
            Some(_) => (subject.orientation, Origin::Flag),
            // A slice is looked at head-on.
            None => (subject.facing().unwrap_or(subject.orientation), subject.origin),
        }
    }

    /// Returns the azimuth and the elevation, in degrees.
    fn angles(&self, subject: &Subject) -> [f64; 2] {
        let [azimuth, elevation] = match (self.camera_position, self.view) {
            (None, None) if subject.facing().is_some() && self.up.is_none() => [0.0; 2],
            (None, None) => {
                return [self.azimuth.unwrap_or(AZIMUTH), self.elevation.unwrap_or(ELEVATION)];
            }
            (Some(_), _) => [0.0; 2],
            (None, Some(side)) => side.angles(),
        };
        [azimuth + self.azimuth.unwrap_or(0.0), elevation + self.elevation.unwrap_or(0.0)]
    }

    /// Returns the camera before it is fitted and enlarged: the sphere around what is seen, or the
    /// scene's box, fills the picture.
    fn aimed(&self, subject: &Subject, size: [u32; 2], turn: f64) -> Camera {
        if let Some(mut camera) = self.camera.clone() {
            camera.azimuth(turn);
            return camera;
        }
        let (orientation, _) = self.orientation(subject);
        let view_up = self.view_up.unwrap_or(orientation.up);
        let view_angle = self.view_angle.unwrap_or(Camera::DEFAULT_VIEW_ANGLE);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let around = |all: Bounds, &point: &DVec3| all.union(Bounds { min: point, max: point });
        let seen = subject.seen.iter().fold(Bounds::EMPTY, around);
        let bounds = if subject.seen.is_empty() { subject.bounds } else { seen };
        let mut camera =
            Camera::framing_with(&bounds, -orientation.front, view_up, aspect, view_angle);
        if let Some(focal_point) = self.focal_point {
            camera.position += focal_point - camera.focal_point;
            camera.focal_point = focal_point;
        }
        if let Some(position) = self.camera_position {
            camera.position = position;
        }
        let [azimuth, elevation] = self.angles(subject);
        camera.azimuth(azimuth + turn);
        camera.elevation(elevation);
        if let Some(distance) = self.distance {
            camera.set_distance(distance);
        }
        if self.orthographic {
            camera.make_orthographic();
        }
        camera
    }
}

/// Returns the points that a camera is fitted to.
fn spanning(subject: &Subject) -> Vec<DVec3> {
    if subject.seen.is_empty() { subject.bounds.corners().to_vec() } else { subject.seen.clone() }
}

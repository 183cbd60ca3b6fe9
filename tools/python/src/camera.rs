//! Cameras that are fitted to a scene, with the command's defaults.

use crate::errors::{options, wrong};
use serde::Deserialize;
use splatkit::{
    Error,
    about::{Frame, Frames, Stance},
    glam::DVec3,
    interaction::CameraEntry,
    math::{Bounds, Camera},
};

/// Share of the picture that is left free around a scene that the camera is fitted to.
const MARGIN: f64 = 0.04;

/// Angles of the default camera, in degrees: to the right of the front and above it.
const ANGLES: [f64; 2] = [30.0, 20.0];

/// How a fitted camera looks at a scene.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fit {
    view: Option<String>,
    focal_point: Option<[f64; 3]>,
    view_up: Option<[f64; 3]>,
    view_angle: Option<f64>,
    distance: Option<f64>,
    azimuth: Option<f64>,
    elevation: Option<f64>,
    zoom: Option<f64>,
    orthographic: bool,
    up: Option<[f64; 3]>,
}

/// Where a scene's stance comes from, from the least certain on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// The default for shapes that rest no better one way than the other.
    Default,
    /// Guessed from the shape.
    Guess,
    /// The convention for volumes, samples and trained Gaussians.
    Convention,
    /// The file, or the convention of its format.
    File,
}

/// The scene as the camera needs it.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The box around samples and vertices; footprints reach further.
    pub bounds: Bounds,
    pub stance: Stance,
    pub origin: Origin,
    /// The frames of the inputs.
    frames: Frames,
}

impl Default for Subject {
    fn default() -> Self {
        let stance = Stance::with_up(DVec3::Y);
        Self { bounds: Bounds::EMPTY, stance, origin: Origin::Default, frames: Frames::default() }
    }
}

impl Subject {
    /// Takes a stance if it comes from a more certain origin than the one before. Returns the
    /// scene's stance if it is another one, although both come from files.
    pub fn consider(&mut self, stance: Stance, origin: Origin) -> Option<Stance> {
        if origin > self.origin {
            (self.stance, self.origin) = (stance, origin);
        }
        let differs = origin == Origin::File && self.stance.up.dot(stance.up) < 0.999;
        differs.then_some(self.stance)
    }

    /// Takes the frame of an input, and says if it cannot be compared with those before.
    pub fn frame(&mut self, name: &str, frame: Frame) {
        if let Some(warning) = self.frames.add(name, frame) {
            tracing::warn!("{warning}");
        }
    }

    /// Takes what a file says of its stance, or the convention.
    pub fn stand(&mut self, told: Option<Stance>, usual: Stance) {
        match told {
            Some(stance) => self.consider(stance, Origin::File),
            None => self.consider(usual, Origin::Convention),
        };
    }

    pub fn count_in(&mut self, bounds: Bounds) {
        self.bounds = self.bounds.union(bounds);
    }
}

impl Fit {
    /// Reads the options.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let own: Self = options(text)?;
        own.angles()?;
        let vectors = [own.focal_point, own.view_up, own.up];
        let are_finite = vectors.iter().flatten().flatten().all(|number| number.is_finite());
        let numbers = [own.view_angle, own.distance, own.zoom];
        let are_positive = numbers.iter().flatten().all(|v| *v > 0.0 && v.is_finite());
        if !are_finite || !are_positive {
            return Err(wrong("a camera needs finite numbers; angles and lengths are above 0"));
        }
        if own.view_angle.is_some_and(|angle| angle >= 180.0) {
            return Err(wrong("view_angle is an angle between 0 and 180 degrees"));
        }
        if own.up.is_some_and(|up| DVec3::from_array(up).try_normalize().is_none()) {
            return Err(wrong("up is a direction with a length above 0"));
        }
        Ok(own)
    }

    /// Returns the camera of a single picture. `seen` spans what is seen.
    pub fn camera(
        &self,
        subject: &Subject,
        seen: &[DVec3],
        size: [u32; 2],
    ) -> Result<Camera, Error> {
        let mut camera = self.aimed(subject, seen, size, 0.0)?;
        if self.distance.is_none() {
            let points = spanning(subject, seen);
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
    pub fn turntable(
        &self,
        subject: &Subject,
        seen: &[DVec3],
        size: [u32; 2],
        frames: u32,
    ) -> Result<Vec<Camera>, Error> {
        let turn = |frame: u32| 360.0 * f64::from(frame) / f64::from(frames);
        let aimed = |frame| self.aimed(subject, seen, size, turn(frame));
        let mut cameras = (0..frames).map(aimed).collect::<Result<Vec<_>, _>>()?;
        if self.distance.is_none() {
            let points = spanning(subject, seen);
            let mut most: Option<f64> = None;
            // A degree more or less changes nothing.
            for camera in cameras.iter().step_by(cameras.len().div_ceil(360).max(1)) {
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

    /// Whether the camera's distance is given, so that it is not fitted to the scene.
    pub fn is_placed(&self) -> bool {
        self.distance.is_some()
    }

    fn stance(&self, subject: &Subject) -> Stance {
        let up = self.up.and_then(|up| DVec3::from_array(up).try_normalize());
        match up {
            // The front is kept if the axis is the subject's own.
            Some(up) if up.dot(subject.stance.up) < 0.999_999 => Stance::with_up(up),
            _ => subject.stance,
        }
    }

    /// Returns the azimuth and the elevation, in degrees.
    fn angles(&self) -> Result<[f64; 2], Error> {
        let of_view = match self.view.as_deref() {
            None => {
                let [azimuth, elevation] = ANGLES;
                return Ok([self.azimuth.unwrap_or(azimuth), self.elevation.unwrap_or(elevation)]);
            }
            Some("front") => [0.0, 0.0],
            Some("back") => [180.0, 0.0],
            Some("left") => [-90.0, 0.0],
            Some("right") => [90.0, 0.0],
            Some("top") => [0.0, 90.0],
            Some("bottom") => [0.0, -90.0],
            // The three sides of a cube look alike.
            Some("iso") => [45.0, 0.5f64.sqrt().atan().to_degrees()],
            Some(other) => {
                return Err(wrong(format!(
                    "the view “{other}” is none of front, back, left, right, top, bottom and iso"
                )));
            }
        };
        let [azimuth, elevation] = of_view;
        Ok([azimuth + self.azimuth.unwrap_or(0.0), elevation + self.elevation.unwrap_or(0.0)])
    }

    /// Returns the camera before it is fitted and enlarged.
    fn aimed(
        &self,
        subject: &Subject,
        seen: &[DVec3],
        size: [u32; 2],
        turn: f64,
    ) -> Result<Camera, Error> {
        let stance = self.stance(subject);
        let view_up = self.view_up.map_or(stance.up, DVec3::from_array);
        let view_angle = self.view_angle.unwrap_or(Camera::DEFAULT_VIEW_ANGLE);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let around = |all: Bounds, &point: &DVec3| all.union(Bounds { min: point, max: point });
        let bounds = match seen.is_empty() {
            true => subject.bounds,
            false => seen.iter().fold(Bounds::EMPTY, around),
        };
        let mut camera = Camera::framing_with(&bounds, -stance.front, view_up, aspect, view_angle);
        if let Some(focal_point) = self.focal_point.map(DVec3::from_array) {
            camera.position += focal_point - camera.focal_point;
            camera.focal_point = focal_point;
        }
        let [azimuth, elevation] = self.angles()?;
        camera.azimuth(azimuth + turn);
        camera.elevation(elevation);
        if let Some(distance) = self.distance {
            camera.set_distance(distance);
        }
        if self.orthographic {
            camera.make_orthographic();
        }
        Ok(camera)
    }
}

fn spanning(subject: &Subject, seen: &[DVec3]) -> Vec<DVec3> {
    if seen.is_empty() { subject.bounds.corners().to_vec() } else { seen.to_vec() }
}

/// Reads a camera that Python has written.
pub fn camera(text: &str) -> Result<Camera, Error> {
    options::<CameraEntry>(text)?.camera().map_err(wrong)
}

/// Returns a camera as JSON, which [`camera`] reads.
pub fn to_json(camera: &Camera) -> String {
    serde_json::json!(CameraEntry::from(camera)).to_string()
}

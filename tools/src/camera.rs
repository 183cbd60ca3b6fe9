//! The flags of the camera.

use crate::parse;
use clap::{Args, ValueEnum};
use glam::DVec3;
use splatkit::{
    Error,
    about::Stance,
    interaction::CameraEntry,
    math::{Bounds, Camera},
};

/// Share of the picture that is left free around a scene that the camera is fitted to.
const MARGIN: f64 = 0.04;

/// Angles of the default camera, in degrees: to the right of the front and above it.
const AZIMUTH: f64 = 30.0;
const ELEVATION: f64 = 20.0;

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
    camera: Option<Camera>,
    /// Look from this side. right is at the right of a viewer who looks at the front; iso is a
    /// corner of the box around the scene. --azimuth and --elevation turn the view further
    /// [default: from the front, 30 degrees to the right and 20 upwards]
    #[arg(long, value_enum, value_name = "SIDE", conflicts_with = "camera_position")]
    view: Option<View>,
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

/// A side to look from.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq)]
enum View {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
    Iso,
}

impl View {
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
    /// The flag.
    Flag,
}

impl Origin {
    /// Returns the name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Guess => "guess",
            Self::Convention => "convention",
            Self::File => "file",
            Self::Flag => "flag",
        }
    }
}

/// The scene as the camera needs it.
#[derive(Debug, Clone)]
pub struct Subject {
    /// The box around samples and vertices; footprints reach further.
    pub bounds: Bounds,
    /// How the scene stands unless the user says how.
    pub stance: Stance,
    /// Where the stance comes from.
    pub origin: Origin,
    /// Points that span what is seen; if there are none, the box is seen.
    pub seen: Vec<DVec3>,
}

impl Subject {
    /// A subject whose box is seen.
    pub fn new(bounds: Bounds, up: DVec3) -> Self {
        let stance = Stance::with_up(up);
        Self { bounds, stance, origin: Origin::Default, seen: Vec::new() }
    }

    /// Takes a stance if it comes from a more certain origin than the one before. Returns whether
    /// it contradicts that one, although both come from files.
    pub fn consider(&mut self, stance: Stance, origin: Origin) -> bool {
        if origin > self.origin {
            (self.stance, self.origin) = (stance, origin);
        }
        origin == Origin::File && self.stance.up.dot(stance.up) < 0.999
    }

    fn points(&self) -> Vec<DVec3> {
        if self.seen.is_empty() { self.bounds.corners().to_vec() } else { self.seen.clone() }
    }
}

impl CameraFlags {
    /// Returns the camera of a single picture.
    pub fn camera(&self, subject: &Subject, size: [u32; 2]) -> splatkit::Result<Camera> {
        let mut camera = self.aimed(subject, size, 0.0);
        if !self.is_placed() {
            let points = subject.points();
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
        size: [u32; 2],
        frames: u32,
    ) -> splatkit::Result<Vec<Camera>> {
        let turn = |frame: u32| 360.0 * f64::from(frame) / f64::from(frames);
        let mut cameras: Vec<Camera> =
            (0..frames).map(|frame| self.aimed(subject, size, turn(frame))).collect();
        if !self.is_placed() {
            let points = subject.points();
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

    /// Returns the camera turned by `turn` more degrees about the up axis. At a zoom of 1, the
    /// sphere around the scene's box fills the picture. Its distance is the same for every turn.
    pub fn turned(&self, subject: &Subject, size: [u32; 2], turn: f64) -> Camera {
        let mut camera = self.aimed(subject, size, turn);
        camera.zoom(self.zoom.unwrap_or(1.0));
        camera
    }

    /// Returns why the usual camera, which is that without flags, cannot see a box in a picture of
    /// `size` pixels. If it cannot, the box is at fault, whatever the flags say.
    pub fn usual_fault(subject: &Subject, bounds: &Bounds, size: [u32; 2]) -> Option<Error> {
        let usual = Self::default().camera(subject, size);
        usual.and_then(|camera| camera.view(size)?.validate_for(bounds)).err()
    }

    /// Whether the flags set the camera's distance, so that it is not fitted to the scene.
    pub fn is_placed(&self) -> bool {
        self.camera.is_some() || self.camera_position.is_some() || self.distance.is_some()
    }

    /// Returns how the scene stands in the picture, and where that comes from.
    pub fn stance(&self, subject: &Subject) -> (Stance, Origin) {
        match self.up {
            // The front is kept if the axis is the subject's own.
            Some(up) if up.dot(subject.stance.up) < 0.999_999 => {
                (Stance::with_up(up), Origin::Flag)
            }
            Some(_) => (subject.stance, Origin::Flag),
            None => (subject.stance, subject.origin),
        }
    }

    /// Returns the azimuth and the elevation, in degrees.
    fn angles(&self) -> [f64; 2] {
        let [azimuth, elevation] = match (self.camera_position, self.view) {
            (None, None) => {
                return [self.azimuth.unwrap_or(AZIMUTH), self.elevation.unwrap_or(ELEVATION)];
            }
            (Some(_), _) => [0.0; 2],
            (None, Some(view)) => view.angles(),
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
        let (stance, _) = self.stance(subject);
        let view_up = self.view_up.unwrap_or(stance.up);
        let view_angle = self.view_angle.unwrap_or(Camera::DEFAULT_VIEW_ANGLE);
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let around = |all: Bounds, &point: &DVec3| all.union(Bounds { min: point, max: point });
        let seen = subject.seen.iter().fold(Bounds::EMPTY, around);
        let bounds = if subject.seen.is_empty() { subject.bounds } else { seen };
        let mut camera = Camera::framing_with(&bounds, -stance.front, view_up, aspect, view_angle);
        if let Some(focal_point) = self.focal_point {
            camera.position += focal_point - camera.focal_point;
            camera.focal_point = focal_point;
        }
        if let Some(position) = self.camera_position {
            camera.position = position;
        }
        let [azimuth, elevation] = self.angles();
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

/// Parses a camera that [`to_json`] has written.
fn given_camera(text: &str) -> Result<Camera, String> {
    let form = "the form is {\"position\": [x, y, z], \"focal_point\": [x, y, z], \"view_up\": \
                [x, y, z], \"view_angle\": 30}, or with \"height\" without perspective";
    let entry: CameraEntry = serde_json::from_str(text).map_err(|e| format!("{e}; {form}"))?;
    entry.camera()
}

/// Returns the camera with the flags' names as keys.
pub fn to_json(camera: &Camera) -> serde_json::Value {
    serde_json::json!(CameraEntry::from(camera))
}

//! The way of a camera through keyframes.
//!
//! The point looked at, the distance from it, the direction and the size of the view are
//! interpolated apart, each by a cubic between two keyframes:
//!
//! - The focal point has the tangents of Catmull and Rom (1974) for uneven times, no longer than
//!   three times the slower of the two moves around the keyframe. A camera that rests between two
//!   equal keyframes does not sway.
//! - The logarithms of the distance, and of the size of the view, have the tangents of Fritsch and
//!   Butland (1984), which do not overshoot. No camera on the way is nearer than its keyframes.
//! - Directions follow the cubic of unit quaternions by Kim, Kim and Shin (1995). Its tangents are
//!   those of the focal point, for angular velocities. Each move turns the shorter way.
//!
//! The camera starts and ends at rest. If the last keyframe has the camera of the first one, the
//! way is a loop, which passes this camera without a stop.

use super::{Camera, Projection};
use crate::{Error, Result};
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// A camera, and when it is reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Keyframe {
    /// Seconds, from any start.
    pub time: f64,
    /// The camera at that time.
    pub camera: Camera,
}

/// A smooth way of a camera through keyframes. It passes exactly through each of them.
///
/// As JSON: `{"splatkit_path": 1, "keyframes": [{"time": 0, "camera": {"position": [x, y, z],
/// "focal_point": [x, y, z], "view_up": [x, y, z], "view_angle": 30}}, …]}`. Orthographic cameras
/// have a `height` instead of a `view_angle`. All cameras of a path are of one kind.
///
/// ```
/// use splatkit::{glam::DVec3, math::{Camera, CameraPath, Keyframe, Projection}};
///
/// let from = |x: f64| Camera {
///     position: DVec3::new(x, 0.0, 9.0),
///     focal_point: DVec3::new(x, 0.0, 0.0),
///     view_up: DVec3::Y,
///     projection: Projection::Perspective { view_angle: 30.0 },
/// };
/// let keyframes = [(0.0, from(-1.0)), (2.0, from(1.0))];
/// let path = CameraPath::new(keyframes.map(|(time, camera)| Keyframe { time, camera }).into())?;
/// assert!((path.at(1.0).position - DVec3::new(0.0, 0.0, 9.0)).length() < 1e-12);
/// assert_eq!(CameraPath::from_json(&path.to_json())?, path);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CameraPath {
    keyframes: Vec<Keyframe>,
    /// The keyframes as they are interpolated.
    knots: Vec<Knot>,
}

/// What is interpolated at a keyframe, and how fast it changes there, by the second.
#[derive(Debug, Clone, PartialEq)]
struct Knot {
    focal_point: DVec3,
    focal_speed: DVec3,
    /// From the camera's frame (x right, y down, z forward) to the world.
    turn: DQuat,
    /// The axis in the camera's frame, times radians.
    turn_speed: DVec3,
    /// The logarithms of the distance and of the size of the view.
    sizes: [f64; 2],
    size_speeds: [f64; 2],
}

/// The version of the JSON.
const VERSION: u32 = 1;

/// The layout of the JSON.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    splatkit_path: u32,
    keyframes: Vec<TimedCamera>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct TimedCamera {
    time: f64,
    camera: Place,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Place {
    position: [f64; 3],
    focal_point: [f64; 3],
    view_up: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    view_angle: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    height: Option<f64>,
}

impl CameraPath {
    /// Makes the path through these keyframes.
    ///
    /// # Errors
    /// [`Error::Argument`] without a keyframe, for times that are not finite or do not ascend, for
    /// cameras that have no view ([`Camera::view`]), and if perspective and orthographic cameras
    /// are mixed. It names the keyframe, counted from 1.
    pub fn new(keyframes: Vec<Keyframe>) -> Result<Self> {
        Self::through(keyframes).map_err(Error::Argument)
    }

    /// Reads the JSON form.
    ///
    /// # Errors
    /// [`Error::Argument`] for invalid JSON (with line and column), and those of
    /// [`new`](Self::new).
    pub fn from_json(text: &str) -> Result<Self> {
        Self::parse(text).map_err(Error::Argument)
    }

    /// Returns the JSON form with a line for each keyframe. [`from_json`](Self::from_json) reads
    /// the same path from it.
    pub fn to_json(&self) -> String {
        let lines = self.keyframes.iter().map(|Keyframe { time, camera }| {
            let (view_angle, height) = match camera.projection {
                Projection::Perspective { view_angle } => (Some(view_angle), None),
                Projection::Orthographic { height } => (None, Some(height)),
            };
            let camera = Place {
                position: camera.position.to_array(),
                focal_point: camera.focal_point.to_array(),
                view_up: camera.view_up.to_array(),
                view_angle,
                height,
            };
            format!("    {}", serde_json::json!(TimedCamera { time: *time, camera }))
        });
        let lines: Vec<String> = lines.collect();
        format!(
            "{{\n  \"splatkit_path\": {VERSION},\n  \"keyframes\": [\n{}\n  ]\n}}\n",
            lines.join(",\n")
        )
    }

    /// Returns the keyframes, in the order of their times.
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// Returns the time of the first keyframe, in seconds.
    pub fn start(&self) -> f64 {
        self.keyframes[0].time
    }

    /// Returns the seconds from the first keyframe to the last one; 0 if there is only one.
    pub fn duration(&self) -> f64 {
        self.keyframes[self.keyframes.len() - 1].time - self.start()
    }

    /// Returns the camera at a time: that of the first keyframe before it, and that of the last one
    /// after it.
    pub fn at(&self, time: f64) -> Camera {
        // NaN is before all times.
        let next = self.keyframes.iter().position(|keyframe| keyframe.time > time);
        let next = if time.is_nan() { 0 } else { next.unwrap_or(self.keyframes.len()) };
        let last = next.saturating_sub(1);
        let before = &self.keyframes[last];
        if next == 0 || next == self.keyframes.len() || before.time == time {
            return before.camera.clone();
        }
        let length = self.keyframes[next].time - before.time;
        let share = (time - before.time) / length;
        let [from, to] = [&self.knots[last], &self.knots[next]];
        let focal_point = hermite(
            [from.focal_point, to.focal_point],
            [from.focal_speed * length, to.focal_speed * length],
            share,
        );
        let [distance, size] = [0, 1].map(|at| {
            let speeds = [from.size_speeds[at], to.size_speeds[at]].map(|speed| speed * length);
            hermite([from.sizes[at], to.sizes[at]], speeds, share).exp()
        });
        let turn = turned(from, to, length, share);
        Camera {
            position: focal_point - distance * (turn * DVec3::Z),
            focal_point,
            view_up: turn * DVec3::NEG_Y,
            projection: match before.camera.projection {
                Projection::Perspective { .. } => {
                    Projection::Perspective { view_angle: (2.0 * size.atan()).to_degrees() }
                }
                Projection::Orthographic { .. } => Projection::Orthographic { height: size },
            },
        }
    }

    /// Like [`from_json`](Self::from_json). The error is a message, to which the caller adds the
    /// place.
    fn parse(text: &str) -> Result<Self, String> {
        let document: Document = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if document.splatkit_path != VERSION {
            let version = document.splatkit_path;
            return Err(format!("the version is {version}, but only version {VERSION} is known"));
        }
        let keyframe = |(number, TimedCamera { time, camera }): (usize, TimedCamera)| {
            let projection = match (camera.view_angle, camera.height) {
                (Some(view_angle), None) => Projection::Perspective { view_angle },
                (None, Some(height)) => Projection::Orthographic { height },
                _ => {
                    let number = number + 1;
                    return Err(format!("keyframe {number} needs either view_angle or height"));
                }
            };
            let [position, focal_point, view_up] =
                [camera.position, camera.focal_point, camera.view_up].map(DVec3::from_array);
            Ok(Keyframe { time, camera: Camera { position, focal_point, view_up, projection } })
        };
        let keyframes = document.keyframes.into_iter().enumerate().map(keyframe);
        Self::through(keyframes.collect::<Result<_, _>>()?)
    }

    /// Like [`new`](Self::new). The error is a message.
    fn through(keyframes: Vec<Keyframe>) -> Result<Self, String> {
        if keyframes.is_empty() {
            return Err("a path needs a keyframe".into());
        }
        let mut knots = Vec::with_capacity(keyframes.len());
        let is_flat = |keyframe: &Keyframe| {
            matches!(keyframe.camera.projection, Projection::Orthographic { .. })
        };
        for (at, keyframe) in keyframes.iter().enumerate() {
            let number = at + 1;
            if !keyframe.time.is_finite() {
                return Err(format!("the time of keyframe {number} is not a finite number"));
            }
            if at > 0 && keyframes[at - 1].time >= keyframe.time {
                return Err(format!("the time of keyframe {number} is not after the one before"));
            }
            if is_flat(keyframe) != is_flat(&keyframes[0]) {
                return Err(format!(
                    "keyframe {number} is not of the first one's kind: all have a view_angle, or \
                     all have a height"
                ));
            }
            let knot = Knot::resting(&keyframe.camera);
            knots.push(knot.map_err(|error| format!("keyframe {number}: {error}"))?);
        }
        let mut path = Self { keyframes, knots };
        path.set_speeds();
        Ok(path)
    }

    /// Sets how fast everything changes at each keyframe.
    fn set_speeds(&mut self) {
        let moves: Vec<Move> = self
            .keyframes
            .windows(2)
            .zip(self.knots.windows(2))
            .map(|(keyframes, knots)| {
                Move::between(&knots[0], &knots[1], keyframes[1].time - keyframes[0].time)
            })
            .collect();
        let [Some(first), Some(last)] = [moves.first(), moves.last()] else { return };
        let ends = [&self.keyframes[0], &self.keyframes[self.keyframes.len() - 1]];
        if ends[0].camera == ends[1].camera {
            let knot = self.knots[0].clone().passing(last, first);
            self.knots[0] = knot.clone();
            self.knots[moves.len()] = knot;
        }
        for (at, pair) in moves.windows(2).enumerate() {
            self.knots[at + 1] = self.knots[at + 1].clone().passing(&pair[0], &pair[1]);
        }
    }
}

impl Knot {
    /// Returns the knot of a camera at rest.
    fn resting(camera: &Camera) -> Result<Self> {
        let view = camera.view([1, 1])?;
        let size = match camera.projection {
            Projection::Perspective { view_angle } => (0.5 * view_angle).to_radians().tan(),
            Projection::Orthographic { height } => height,
        };
        Ok(Self {
            focal_point: camera.focal_point,
            focal_speed: DVec3::ZERO,
            turn: DQuat::from_mat3(&DMat3::transpose(&view.rotation)),
            turn_speed: DVec3::ZERO,
            sizes: [(camera.focal_point - camera.position).length().ln(), size.ln()],
            size_speeds: [0.0; 2],
        })
    }

    /// Returns the knot as it is passed between two moves.
    fn passing(self, before: &Move, after: &Move) -> Self {
        let lengths = [before.length, after.length];
        let slope = |at: usize| monotone([before.sizes[at], after.sizes[at]], lengths);
        Self {
            focal_speed: limited([before.focal_point, after.focal_point], lengths),
            turn_speed: limited([before.turn, after.turn], lengths),
            size_speeds: [slope(0), slope(1)],
            ..self
        }
    }
}

/// The mean speeds between two knots, by the second.
struct Move {
    /// Seconds.
    length: f64,
    focal_point: DVec3,
    /// The same in the frames of both knots, because it is the axis of the turn.
    turn: DVec3,
    sizes: [f64; 2],
}

impl Move {
    fn between(from: &Knot, to: &Knot, length: f64) -> Self {
        Self {
            length,
            focal_point: (to.focal_point - from.focal_point) / length,
            turn: rotation(from.turn.inverse() * to.turn) / length,
            sizes: [0, 1].map(|at| (to.sizes[at] - from.sizes[at]) / length),
        }
    }
}

/// Returns the speed of Catmull and Rom between two moves: that of the parabola through three
/// knots. It is at most three times the slower one.
fn limited([before, after]: [DVec3; 2], [first, second]: [f64; 2]) -> DVec3 {
    let speed = (second * before + first * after) / (first + second);
    speed.clamp_length_max(3.0 * before.length().min(after.length()))
}

/// Returns the slope of Fritsch and Butland between two moves: a weighted harmonic mean, or 0 at a
/// turning point.
fn monotone([before, after]: [f64; 2], [first, second]: [f64; 2]) -> f64 {
    if before * after <= 0.0 {
        return 0.0;
    }
    let [weight, other] = [first + 2.0 * second, 2.0 * first + second];
    (weight + other) / (weight / before + other / after)
}

/// Returns the cubic between two values with these changes in the length of the move.
fn hermite<T>(ends: [T; 2], changes: [T; 2], share: f64) -> T
where
    T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let [square, cube] = [share.powi(2), share.powi(3)];
    let rise = 3.0 * square - 2.0 * cube;
    ends[0] * (1.0 - rise)
        + ends[1] * rise
        + changes[0] * (cube - 2.0 * square + share)
        + changes[1] * (cube - square)
}

/// Returns the direction between two knots (Kim, Kim and Shin 1995, section 4): the control points
/// of a Bézier curve, added up as turns. Unlike nested slerps it has no jump where two control
/// points are opposite.
fn turned(from: &Knot, to: &Knot, length: f64, share: f64) -> DQuat {
    let [first, last] = [from.turn_speed, to.turn_speed].map(|speed| speed * (length / 3.0));
    let control = [from.turn * exponential(first), to.turn * exponential(-last)];
    let middle = rotation(control[0].inverse() * control[1]);
    let rest = 1.0 - share;
    let turn = from.turn
        * exponential(first * (1.0 - rest.powi(3)))
        * exponential(middle * (3.0 * share.powi(2) - 2.0 * share.powi(3)))
        * exponential(last * share.powi(3));
    turn.normalize()
}

/// Returns the axis of a turn times its angle in radians, the shorter way round.
fn rotation(turn: DQuat) -> DVec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.to_scaled_axis()
}

fn exponential(rotation: DVec3) -> DQuat {
    DQuat::from_scaled_axis(rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn around(degrees: f64) -> Camera {
        let mut camera = Camera {
            position: DVec3::new(0.0, 0.0, 10.0),
            focal_point: DVec3::ZERO,
            view_up: DVec3::Y,
            projection: Projection::Perspective { view_angle: 30.0 },
        };
        camera.azimuth(degrees);
        camera
    }

    fn path(cameras: &[(f64, Camera)]) -> CameraPath {
        let keyframe =
            |(time, camera): &(f64, Camera)| Keyframe { time: *time, camera: camera.clone() };
        CameraPath::new(cameras.iter().map(keyframe).collect()).unwrap()
    }

    /// How far two cameras are apart: their positions, their focal points and their frames.
    fn apart(a: &Camera, b: &Camera) -> f64 {
        let [a_view, b_view] = [a, b].map(|camera| camera.view([64, 64]).unwrap());
        let frames: f64 = (0..3)
            .map(|axis| (a_view.rotation.col(axis) - b_view.rotation.col(axis)).length())
            .sum();
        (a.position - b.position).length()
            + (a.focal_point - b.focal_point).length()
            + frames
            + (a_view.scale / b_view.scale).ln().abs()
    }

    fn winding() -> CameraPath {
        let mut far = around(170.0);
        far.set_distance(40.0);
        far.view_up = DVec3::new(0.3, 1.0, 0.1);
        far.projection = Projection::Perspective { view_angle: 12.0 };
        let mut aside = around(-170.0);
        aside.elevation(50.0);
        aside.focal_point = DVec3::new(1.0, -2.0, 0.5);
        path(&[(-1.0, around(0.0)), (0.5, far), (2.0, aside), (2.25, around(-95.0))])
    }

    #[test]
    fn the_camera_passes_through_its_keyframes_without_a_jump() {
        let path = winding();
        for keyframe in path.keyframes() {
            let (time, camera) = (keyframe.time, &keyframe.camera);
            assert_eq!(path.at(time), *camera);
            for step in [-1e-7, 1e-7] {
                let distance = apart(&path.at(time + step), camera);
                assert!(distance < 1e-4, "{time} {step}: {distance}");
            }
            // The speed has no jump either.
            let speed =
                |at: f64| (path.at(at + 1e-5).position - path.at(at - 1e-5).position) / 2e-5;
            let [before, after] = [speed(time - 2e-5), speed(time + 2e-5)];
            assert!((before - after).length() < 0.1, "{time}: {before} {after}");
        }
        let steps = 4000;
        let camera = |step: u32| path.at(-1.0 + 3.25 * f64::from(step) / f64::from(steps));
        for step in 0..steps {
            let distance = apart(&camera(step), &camera(step + 1));
            assert!(distance < 0.2, "{step}: {distance}");
        }
        assert_eq!(path.at(-9.0), path.keyframes()[0].camera);
        assert_eq!(path.at(f64::NAN), path.keyframes()[0].camera);
        assert_eq!(path.at(9.0), path.keyframes()[3].camera);
    }

    #[test]
    fn turns_go_the_shorter_way() {
        // From 170 to -170 degrees: through 180, not through 0.
        let path = path(&[(0.0, around(170.0)), (2.0, around(-170.0))]);
        assert!(apart(&path.at(1.0), &around(180.0)) < 1e-9);
        // The distance stays the same, and the camera is at rest at the ends.
        for time in [0.1, 0.7, 1.9] {
            let camera = path.at(time);
            assert!((camera.position.length() - 10.0).abs() < 1e-9);
        }
        assert!(apart(&path.at(1e-4), &around(170.0)) < 1e-6);
    }

    #[test]
    fn half_a_turn_is_made_somehow() {
        let path = path(&[(0.0, around(0.0)), (1.0, around(180.0)), (2.0, around(0.0))]);
        for step in 0..200 {
            let time = f64::from(step) / 100.0;
            let camera = path.at(time);
            assert!((camera.position.length() - 10.0).abs() < 1e-9, "{time}: {camera:?}");
            assert!(apart(&camera, &path.at(time + 0.01)) < 1.5, "{time}");
        }
    }

    #[test]
    fn a_loop_does_not_stop() {
        let turns: Vec<(f64, Camera)> =
            (0..=4).map(|turn| (f64::from(turn), around(90.0 * f64::from(turn % 4)))).collect();
        let path = path(&turns);
        // A turntable: each time is the angle.
        for time in [0.01, 0.3, 1.5, 2.2, 3.99] {
            assert!(apart(&path.at(time), &around(90.0 * time)) < 1e-9, "{time}");
        }
    }

    #[test]
    fn a_resting_camera_does_not_sway() {
        let mut near = around(0.0);
        near.set_distance(2.0);
        let path = path(&[
            (0.0, around(60.0)),
            (1.0, near.clone()),
            (3.0, near.clone()),
            (4.0, around(-90.0)),
        ]);
        for time in [1.2, 2.0, 2.9] {
            assert!(apart(&path.at(time), &near) < 1e-9, "{time}");
        }
        for step in 0..400 {
            let camera = path.at(f64::from(step) / 100.0);
            let distance = (camera.position - camera.focal_point).length();
            assert!((2.0 - 1e-9..=10.0 + 1e-9).contains(&distance), "{step}: {distance}");
        }
    }

    #[test]
    fn one_keyframe_is_a_still() {
        let path = path(&[(7.0, around(20.0))]);
        assert_eq!((path.start(), path.duration()), (7.0, 0.0));
        assert_eq!(path.at(0.0), around(20.0));
    }

    #[test]
    fn orthographic_cameras_move_too() {
        let flat =
            |height: f64| Camera { projection: Projection::Orthographic { height }, ..around(0.0) };
        let path = path(&[(0.0, flat(1.0)), (1.0, flat(4.0))]);
        let Projection::Orthographic { height } = path.at(0.5).projection else { panic!() };
        assert!((height - 2.0).abs() < 1e-12);
        assert_eq!(CameraPath::from_json(&path.to_json()).unwrap(), path);
    }

    #[test]
    fn the_json_is_read_back_as_it_was() {
        let path = winding();
        let text = path.to_json();
        assert_eq!(CameraPath::from_json(&text).unwrap(), path);
        assert_eq!(text.lines().count(), 9, "{text}");
    }

    #[test]
    fn wrong_paths_are_named() {
        let camera =
            r#"{"position":[0,0,9],"focal_point":[0,0,0],"view_up":[0,1,0],"view_angle":30}"#;
        let keyframe = |time: f64, camera: &str| format!(r#"{{"time":{time},"camera":{camera}}}"#);
        let document = |version: u32, keyframes: &[String]| {
            format!(r#"{{"splatkit_path":{version},"keyframes":[{}]}}"#, keyframes.join(","))
        };
        let one = |camera: &str| document(1, &[keyframe(0.0, camera)]);
        assert!(CameraPath::from_json(&one(camera)).is_ok());
        for (text, says) in [
            (document(1, &[]), "needs a keyframe"),
            (document(2, &[keyframe(0.0, camera)]), "version is 2"),
            (one(&camera.replace("view_up", "viewup")), "unknown field `viewup`"),
            (one(&camera.replace(r#","view_angle":30"#, "")), "keyframe 1 needs either"),
            (one(&camera.replace("30", r#"30,"height":2"#)), "keyframe 1 needs either"),
            (one(&camera.replace("[0,0,9]", "[0,0,0]")), "keyframe 1: the camera is at its own"),
            (one(&camera.replace("30", "300")), "keyframe 1: the camera needs a view angle"),
            (
                document(1, &[keyframe(1.0, camera), keyframe(1.0, camera)]),
                "keyframe 2 is not after",
            ),
            (
                document(
                    1,
                    &[
                        keyframe(1.0, camera),
                        keyframe(2.0, &camera.replace("view_angle", "height")),
                    ],
                ),
                "keyframe 2 is not of the first one's kind",
            ),
            (one(camera).replace("time", "when"), "unknown field `when`"),
            ("{\n  nonsense".into(), "line 2"),
        ] {
            let error = CameraPath::from_json(&text).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}

//! How the camera moves from frame to frame.

use crate::{failure::Failure, parse, times::Times};
use clap::Args;
use splatkit::{
    Error,
    input::{Limits, Source},
    math::{Camera, CameraPath},
    session::{Framing, Subject},
};
use std::path::{Path, PathBuf};

/// Most frames of a film.
const MOST_FRAMES: u32 = 100_000;

/// The usual frames per second.
pub const RATE: f64 = 30.0;

/// The usual frames per second of times.
const RATE_OF_TIMES: f64 = 10.0;

/// Largest size of a path's file, in bytes.
const MOST_BYTES: usize = 16 << 20;

#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Animation")]
pub struct MotionFlags {
    /// Draw this many frames while the camera turns once around the up axis.
    #[arg(
        long,
        value_name = "FRAMES",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_FRAMES))
    )]
    turntable: Option<u32>,
    /// Move the camera smoothly through the keyframes of a JSON file (docs/video.md describes it).
    /// The frames are as many as --fps and the times of the keyframes say.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["turntable", "CameraFlags"])]
    path: Option<PathBuf>,
    /// Draw a frame for each of these times of the inputs: all, or numbers from 0 and ranges with
    /// their ends, such as 0,4,8 or 0..20 or 0..20:2. The camera is fitted to all of them; the
    /// transfer functions and the ranges of colours are those of the first. In --caption, {time}
    /// becomes the number. With --columns, all stand beside each other in one picture.
    #[arg(long, value_name = "all|TIMES", conflicts_with_all = ["turntable", "path", "time"])]
    times: Option<Times>,
    /// Set the frames per second of an animation [default: 30; 10 with --times]
    #[arg(long, value_name = "NUMBER", value_parser = parse::rate)]
    fps: Option<f64>,
}

/// How the camera moves.
pub enum Motion {
    /// A single picture.
    Still,
    /// Once around, in this number of frames.
    Turntable(u32),
    /// Along a path, in this number of frames.
    Path(CameraPath, u32),
    /// Not at all, in this number of frames: the inputs change.
    Times(u32),
}

impl MotionFlags {
    /// Returns whether there may be several frames.
    pub fn is_moving(&self) -> bool {
        self.turntable.is_some() || self.path.is_some() || self.times.is_some()
    }

    /// Returns the times to draw.
    pub fn times(&self) -> Option<&Times> {
        self.times.as_ref()
    }

    /// Returns the file of the path.
    pub fn file(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Returns the frames per second.
    pub fn rate(&self) -> f64 {
        self.fps.unwrap_or(if self.times.is_some() { RATE_OF_TIMES } else { RATE })
    }

    /// Returns a warning if the rate has no effect. `is_film`: the frames go to one file that is
    /// played.
    pub fn idle(&self, is_film: bool) -> Option<&'static str> {
        let counts = self.path.is_some() || self.is_moving() && is_film;
        (self.fps.is_some() && !counts)
            .then_some("--fps has no effect: it is for animations, and pictures have no rate")
    }

    /// Reads the path, if there is one.
    pub fn open(&self, limits: &Limits) -> Result<Motion, Failure> {
        let Some(file) = &self.path else {
            return Ok(self.turntable.map_or(Motion::Still, Motion::Turntable));
        };
        Motion::along(read_path(file, limits)?, self.rate(), file)
    }
}

/// Reads the file of a path.
pub fn read_path(file: &Path, limits: &Limits) -> splatkit::Result<CameraPath> {
    let text = Source::open(file, limits)?.small_text("a path of a camera", MOST_BYTES)?;
    CameraPath::from_json(&text).map_err(|error| {
        Error::input(file, "path of a camera", error.to_string()).hint(
            "the form is {\"splatkit_path\": 1, \"keyframes\": [{\"time\": 0, \"camera\": \
             {\"position\": [x, y, z], \"focal_point\": [x, y, z], \"view_up\": [x, y, z], \
             \"view_angle\": 30}}, …]}",
        )
    })
}

impl Motion {
    /// Moves along a path at a rate in frames per second. `file` is what an error names.
    pub fn along(path: CameraPath, rate: f64, file: &Path) -> Result<Self, Failure> {
        let moves = (path.duration() * rate).round();
        if moves >= f64::from(MOST_FRAMES) {
            let message = format!(
                "{} s at {rate} frames per second are too many frames; {MOST_FRAMES} are the most",
                path.duration()
            );
            // At the usual rate, the times are the file's fault.
            return Err(if path.duration() * RATE >= f64::from(MOST_FRAMES) {
                Error::input(file, "“time” of the last keyframe", message).into()
            } else {
                Failure::Usage(format!("{}: {message}", file.display()))
            });
        }
        Ok(Self::Path(path, moves as u32 + 1))
    }

    /// Returns the number of pictures.
    pub fn frames(&self) -> u32 {
        match self {
            Self::Still => 1,
            Self::Turntable(frames) | Self::Path(_, frames) | Self::Times(frames) => *frames,
        }
    }

    /// Returns where the camera of a frame is in the file of a path: between which keyframes.
    pub fn place(&self, frame: usize) -> String {
        let Self::Path(path, frames) = self else { return "camera".into() };
        let step = path.duration() / f64::from((frames - 1).max(1));
        let time = path.start() + step * frame as f64;
        let passed = path.keyframes().iter().filter(|keyframe| keyframe.time <= time).count();
        format!("“camera” of keyframe {}, at {time} s", passed.max(1))
    }

    /// Returns whether the camera is fitted to what is seen, unless the camera's flags place it.
    pub fn is_fitted(&self) -> bool {
        !matches!(self, Self::Path(..))
    }

    /// Returns the camera of each frame. `size` is the part of the picture that a camera is fitted
    /// to.
    pub fn cameras(
        &self,
        framing: &Framing,
        subject: &Subject,
        size: [u32; 2],
    ) -> splatkit::Result<Vec<Camera>> {
        match self {
            Self::Still => Ok(vec![framing.camera(subject, size)?]),
            Self::Turntable(frames) => framing.turntable(subject, size, *frames),
            Self::Times(frames) => {
                Ok(vec![framing.camera(subject, size)?; (*frames).max(1) as usize])
            }
            Self::Path(path, frames) => {
                // The last frame is the last keyframe.
                let step = path.duration() / f64::from((frames - 1).max(1));
                let last = path.start() + path.duration();
                let time = |frame: u32| path.start() + step * f64::from(frame);
                let mut cameras: Vec<Camera> =
                    (0..frames - 1).map(|frame| path.at(time(frame))).collect();
                cameras.push(path.at(last));
                Ok(cameras)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a path of two seconds and returns its frames at a rate.
    fn frames(folder: &Path, rate: f64) -> Result<(Motion, Vec<Camera>), Failure> {
        let keyframe = |time: f64, x: f64| {
            format!(
                r#"{{"time":{time},"camera":{{"position":[{x},0,9],"focal_point":[{x},0,0],
                "view_up":[0,1,0],"view_angle":30}}}}"#
            )
        };
        let keyframes = [keyframe(1.0, 0.0), keyframe(3.0, 4.0)].join(",");
        let file = folder.join("path.json");
        std::fs::write(&file, format!(r#"{{"splatkit_path":1,"keyframes":[{keyframes}]}}"#))
            .unwrap();
        let flags = MotionFlags { turntable: None, path: Some(file), times: None, fps: Some(rate) };
        let motion = flags.open(&Limits::default())?;
        let subject = Subject::new(splatkit::math::Bounds::EMPTY, glam::DVec3::Y);
        let cameras = motion.cameras(&Framing::default(), &subject, [4, 3])?;
        Ok((motion, cameras))
    }

    #[test]
    fn a_path_has_a_frame_at_each_end() {
        let folder = tempfile::tempdir().unwrap();
        // Also if the rate and the duration do not go together.
        for (rate, count) in [(30.0, 61), (0.5, 2), (0.9, 3), (0.1, 1)] {
            let (motion, cameras) = frames(folder.path(), rate).unwrap();
            assert_eq!((motion.frames(), cameras.len()), (count, count as usize), "{rate}");
            assert_eq!(cameras[cameras.len() - 1].focal_point.x, 4.0);
            assert!(count == 1 || cameras[0].focal_point.x == 0.0);
        }
        assert!(frames(folder.path(), 60_000.0).is_err());
    }
}

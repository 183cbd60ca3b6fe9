//! Films: pictures in one file, and the cameras of a path.

use crate::{
    camera::to_json,
    errors::{of_media, raise, wrong},
    notes,
    picture::Picture,
    worker::run,
};
use pyo3::prelude::*;
use splatkit::{Error, Stop, math::CameraPath};
use splatkit_media::video::{Encoder, Film as Facts, Format};
use std::{
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
};

/// Most frames of a film.
const MOST_FRAMES: f64 = 100_000.0;

/// A film that is being written. No file of its name appears before the last frame.
#[pyclass(frozen, module = "pysplatkit._pysplatkit")]
pub struct Film {
    /// The encoder; none once the film is complete or has failed.
    encoder: Arc<Mutex<Option<Box<dyn Encoder>>>>,
    background: Option<[f32; 3]>,
}

#[pymethods]
impl Film {
    #[new]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        size: [u32; 2],
        frames: u32,
        rate: f64,
        background: Option<[f32; 3]>,
    ) -> PyResult<Self> {
        let Some(format) = Format::of(&path) else {
            let message = format!(
                "{}: unknown format of a film, use .gif, .webp, .apng, .mp4, .webm or .mov, or \
                 .png or .jpg for numbered pictures",
                path.display()
            );
            return Err(raise(py, &wrong(message)));
        };
        let facts = Facts { size, frames, rate, background };
        let opened = format.check(&path, &facts).and_then(|()| format.open(&path, facts));
        let encoder = opened.map_err(|failure| raise(py, &of_media(failure)))?;
        if let Some(loss) = format.loss(&facts) {
            notes::add(format!("{}: {loss}", path.display()));
            notes::warn(py)?;
        }
        let black = (!format.keeps_opacity()).then_some([0.0; 3]);
        let encoder = Arc::new(Mutex::new(Some(encoder)));
        Ok(Self { encoder, background: background.or(black) })
    }

    /// Adds a frame.
    fn add(&self, py: Python<'_>, picture: &Picture) -> PyResult<()> {
        let (encoder, background) = (self.encoder.clone(), self.background);
        let pixels = picture.shared();
        run(py, &Stop::default(), move || {
            let mut encoder = encoder.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(encoder) = encoder.as_mut() else { return Err(wrong("the film has ended")) };
            encoder.add(&pixels.to_rgba8(background)).map(drop).map_err(of_media)
        })
    }

    /// Completes the film.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        let encoder = self.encoder.clone();
        run(py, &Stop::default(), move || {
            let encoder = encoder.lock().unwrap_or_else(PoisonError::into_inner).take();
            encoder
                .map_or_else(|| Err(wrong("the film has ended")), |e| e.finish().map_err(of_media))
        })
    }
}

/// Returns the cameras of the frames of a path, which is JSON, at a rate in frames per second.
#[pyfunction]
pub fn path_cameras(py: Python<'_>, text: &str, rate: f64) -> PyResult<Vec<String>> {
    cameras(text, rate).map_err(|error| raise(py, &error))
}

fn cameras(text: &str, rate: f64) -> Result<Vec<String>, Error> {
    let path = CameraPath::from_json(text)?;
    let moves = (path.duration() * rate).round();
    if moves >= MOST_FRAMES {
        return Err(wrong(format!(
            "{} s at {rate} frames per second are too many frames; {MOST_FRAMES} are the most",
            path.duration()
        )));
    }
    // The last frame is the last keyframe.
    let step = path.duration() / moves.max(1.0);
    let times = (0..moves as u32).map(|frame| path.start() + step * f64::from(frame));
    let times = times.chain([path.start() + path.duration()]);
    Ok(times.map(|time| to_json(&path.at(time))).collect())
}

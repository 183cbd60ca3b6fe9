//! Films: the pictures of a moving camera in one file. Each frame goes to an encoder as soon as it
//! is drawn, and is not kept.

mod apng;
mod ffmpeg;
mod gif;
mod palette;
mod webp;

use crate::Failure;
pub use ffmpeg::Container;
use splatkit::{Error, disk::AtomicFile};
use std::{
    io::{BufWriter, Write},
    path::Path,
};

/// What an encoder must know before the first frame.
#[derive(Debug, Clone, Copy)]
pub struct Film {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// The number of frames.
    pub frames: u32,
    /// Frames per second.
    pub rate: f64,
    /// The colour behind the pictures, red, green and blue in 0 … 1; `None` for transparency.
    pub background: Option<[f32; 3]>,
}

impl Film {
    /// Returns how long a frame is shown, in units of which a second has `units`. The sum of all
    /// frames is off by less than a unit.
    fn duration(&self, frame: u32, units: f64) -> u32 {
        let begins = |frame: u32| (f64::from(frame) * units / self.rate).round();
        (begins(frame + 1) - begins(frame)) as u32
    }
}

/// Takes the frames of a film, one after the other.
pub trait Encoder: Send {
    /// Adds a frame: rows from the top, and red, green, blue and opacity of each pixel (not
    /// premultiplied). Returns whether more frames are wanted: who reads them may be gone.
    ///
    /// # Errors
    /// [`Failure`] of the file or of its encoder.
    fn add(&mut self, rgba: &[u8]) -> Result<bool, Failure>;

    /// Completes the film. A file gets its name only now.
    ///
    /// # Errors
    /// [`Failure`] of the file or of its encoder.
    fn finish(self: Box<Self>) -> Result<(), Failure>;
}

/// How a film is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Format {
    /// Animated GIF.
    Gif,
    /// Animated WebP.
    Webp,
    /// Animated PNG.
    Apng,
    /// Encoded by ffmpeg.
    Coded(Container),
}

impl Format {
    /// Returns the format for a file's extension; `None` if it is none of a film.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match &*extension {
            "gif" => Self::Gif,
            "webp" => Self::Webp,
            "apng" => Self::Apng,
            "mp4" => Self::Coded(Container::Mp4),
            "webm" => Self::Coded(Container::Webm),
            "mov" => Self::Coded(Container::Mov),
            _ => return None,
        })
    }

    /// Refuses, before the work is done, a film that cannot be written.
    ///
    /// # Errors
    /// [`Failure`] for pictures that are too large for the format, and where ffmpeg is missing.
    pub fn check(self, path: &Path, film: &Film) -> Result<(), Failure> {
        let most = match self {
            Self::Gif => gif::MOST,
            Self::Webp => webp::MOST,
            Self::Coded(_) => return ffmpeg::check(path),
            Self::Apng => return Ok(()),
        };
        let [width, height] = film.size;
        if width.max(height) <= most {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "{}: {width}x{height} pixels are too many for this format, whose sides have at most \
             {most}",
            path.display()
        )))
    }

    /// Returns what the format cannot show of the film.
    pub fn loss(self, film: &Film) -> Option<&'static str> {
        match self {
            Self::Gif if film.rate > gif::FASTEST => {
                Some("GIF shows at most 50 frames a second: the film is slower than --fps says")
            }
            _ if film.background.is_none() && !self.keeps_opacity() => {
                Some("MP4 has no opacity: the background is black; .webm and .mov keep opacity")
            }
            _ => None,
        }
    }

    /// Whether the format can store transparent pixels.
    pub fn keeps_opacity(self) -> bool {
        self != Self::Coded(Container::Mp4)
    }

    /// Begins a film. No file of its name appears before the last frame.
    ///
    /// # Errors
    /// [`Failure`] for a file that cannot be created, and an ffmpeg that does not start.
    pub fn open(self, path: &Path, film: Film) -> Result<Box<dyn Encoder>, Failure> {
        Ok(match self {
            Self::Gif => Box::new(gif::Gif::open(path, film)?),
            Self::Webp => Box::new(webp::Webp::open(path, film)?),
            Self::Apng => Box::new(apng::Apng::open(path, film)?),
            Self::Coded(container) => Box::new(ffmpeg::Ffmpeg::open(container, path, film)?),
        })
    }
}

/// Size of the buffer of a file, in bytes.
const BUFFER: usize = 1 << 20;

/// The file of an encoder.
type Out = BufWriter<AtomicFile>;

fn create(path: &Path) -> Result<Out, Failure> {
    Ok(BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?))
}

/// Gives the finished file its name.
fn commit(mut out: Out, path: &Path) -> Result<(), Failure> {
    out.flush().map_err(|error| Error::output(path, error))?;
    let file = out.into_inner().map_err(|error| Error::output(path, error.into_error()))?;
    Ok(file.commit()?)
}

/// Returns the colours without the opacities.
fn rgb(rgba: &[u8]) -> Vec<u8> {
    rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frames_last_as_long_as_the_film() {
        for (rate, units) in [(30.0, 100.0), (24.0, 1000.0), (29.97, 1000.0), (0.1, 100.0)] {
            let film = Film { size: [1, 1], frames: 100, rate, background: None };
            let durations = (0..100).map(|frame| film.duration(frame, units));
            let sum: u32 = durations.clone().sum();
            assert!((f64::from(sum) - 100.0 * units / rate).abs() <= 0.5, "{rate}: {sum}");
            let even = units / rate;
            assert!(durations.into_iter().all(|duration| (f64::from(duration) - even).abs() < 1.0));
        }
    }
}

//! Films that ffmpeg encodes, which must be installed: it reads the raw frames from a pipe.

use super::{Encoder, Film};
use crate::Failure;
use splatkit::disk::AtomicFile;
use std::{
    ffi::OsString,
    io::{ErrorKind, Read, Write},
    path::{Path, PathBuf},
    process::{Child, ChildStderr, ChildStdin, Command, Stdio},
    thread::{self, JoinHandle},
};

/// The name of the program.
const PROGRAM: &str = "ffmpeg";

/// Bytes and lines that are kept of what ffmpeg says.
const MOST_SAID: usize = 4096;
const LINES: usize = 4;

/// A kind of file that ffmpeg writes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Container {
    /// H.264.
    Mp4,
    /// VP9.
    Webm,
    /// H.264, or ProRes with opacity.
    Mov,
}

/// Checks that ffmpeg can be started.
pub fn check(path: &Path) -> Result<(), Failure> {
    let mut command = Command::new(PROGRAM);
    command.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().map(drop).map_err(|error| missing(path, &error))
}

fn missing(path: &Path, error: &std::io::Error) -> Failure {
    let message = match error.kind() {
        ErrorKind::NotFound => "needs the program ffmpeg, which is not installed".to_owned(),
        _ => format!("needs the program ffmpeg, which cannot be started: {error}"),
    };
    let hint = "install ffmpeg, or write a .gif, .webp or .apng file, or numbered pictures, such \
                as out.png; the command also writes raw frames for another encoder (-o - --raw)";
    Failure::Output { file: path.to_owned(), message, hint: Some(hint) }
}

pub struct Ffmpeg {
    path: PathBuf,
    // Ends before the file is removed.
    process: Process,
    file: AtomicFile,
}

impl Ffmpeg {
    pub fn open(container: Container, path: &Path, film: Film) -> Result<Self, Failure> {
        let file = AtomicFile::create(path)?;
        let mut command = Command::new(PROGRAM);
        command.args(arguments(container, film));
        // ffmpeg takes other names with a colon for addresses, and with a dash for flags.
        let mut target = OsString::from("file:");
        target.push(file.part());
        command.arg(target).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| missing(path, &error))?;
        let (frames, errors) = (child.stdin.take(), child.stderr.take());
        let mut process = Process { child, frames, said: None };
        // Somebody must read what ffmpeg says, or it would wait for that.
        let reader = thread::Builder::new().spawn(move || errors.map_or(String::new(), last_lines));
        process.said = Some(reader.map_err(|error| Failure::output(path, error))?);
        Ok(Self { path: path.to_owned(), process, file })
    }
}

impl Encoder for Ffmpeg {
    fn add(&mut self, rgba: &[u8]) -> Result<bool, Failure> {
        let Some(frames) = &mut self.process.frames else { return Ok(false) };
        match frames.write_all(rgba) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => {
                self.process.end(&self.path)?;
                Err(Failure::output(&self.path, "ffmpeg ended before the last frame"))
            }
            Err(error) => Err(Failure::output(&self.path, error)),
        }
    }

    fn finish(self: Box<Self>) -> Result<(), Failure> {
        let Self { path, mut process, file } = *self;
        process.end(&path)?;
        Ok(file.commit()?)
    }
}

/// The running ffmpeg. Dropping this stops it.
struct Process {
    child: Child,
    frames: Option<ChildStdin>,
    /// Returns the last lines that ffmpeg said.
    said: Option<JoinHandle<String>>,
}

impl Process {
    /// Closes the pipe and waits for the end. Fails with the last lines that ffmpeg said if it
    /// failed.
    fn end(&mut self, path: &Path) -> Result<(), Failure> {
        drop(self.frames.take());
        let status = self.child.wait().map_err(|error| Failure::output(path, error))?;
        let said = self.said.take().and_then(|reader| reader.join().ok()).unwrap_or_default();
        match status.success() {
            true => Ok(()),
            false if said.is_empty() => Err(failed(path, format!("ffmpeg failed ({status})"))),
            false => Err(failed(path, format!("ffmpeg failed ({status}): {said}"))),
        }
    }
}

fn failed(path: &Path, message: String) -> Failure {
    let hint = "a .gif, .webp or .apng file needs no ffmpeg";
    Failure::Output { file: path.to_owned(), message, hint: Some(hint) }
}

impl Drop for Process {
    fn drop(&mut self) {
        // It has ended already after the last frame.
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

/// Reads to the end, and returns the last lines on one line.
fn last_lines(mut errors: ChildStderr) -> String {
    let (mut said, mut part) = (Vec::new(), [0; MOST_SAID]);
    while let Ok(count @ 1..) = errors.read(&mut part) {
        said.extend_from_slice(&part[..count]);
        said.drain(..said.len().saturating_sub(MOST_SAID));
    }
    let text = String::from_utf8_lossy(&said);
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines[lines.len().saturating_sub(LINES)..].join("; ")
}

/// Returns ffmpeg's arguments, without the name of the file.
fn arguments(container: Container, film: Film) -> Vec<String> {
    let [width, height] = film.size;
    let input = format!(
        "-hide_banner -nostdin -loglevel error -y -f rawvideo -pixel_format rgba \
         -video_size {width}x{height} -framerate {} -i pipe:0 -an",
        film.rate
    );
    let is_clear = film.background.is_none();
    let (layout, codec) = match container {
        Container::Mp4 => ("yuv420p", H264),
        Container::Mov if !is_clear => ("yuv420p", H264),
        Container::Mov => ("yuva444p10le", PRORES),
        Container::Webm if !is_clear => ("yuv420p", VP9),
        Container::Webm => ("yuva420p", VP9),
    };
    // Colours by ITU-R BT.709, as players expect them of films of this time.
    let mut filter = format!(
        "scale=out_color_matrix=bt709:out_range=tv,format={layout},setparams=range=tv:\
         colorspace=bt709:color_primaries=bt709:color_trc=bt709"
    );
    if codec == H264 {
        // Two by two pixels share a colour, so sides are even.
        let [red, green, blue] =
            film.background.unwrap_or_default().map(|channel| (channel * 255.0).round() as u8);
        filter = format!(
            "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=0x{red:02x}{green:02x}{blue:02x},{filter}"
        );
    }
    let mut arguments: Vec<String> = input.split(' ').map(str::to_owned).collect();
    arguments.extend(["-vf".to_owned(), filter]);
    let container = match container {
        Container::Mp4 => "-movflags +faststart -f mp4",
        Container::Mov => "-movflags +faststart -f mov",
        Container::Webm => "-f webm",
    };
    let rest = format!("{codec} {container}");
    arguments.extend(rest.split(' ').map(str::to_owned));
    arguments
}

/// Quality before size: hardly any difference from the frames is visible.
const H264: &str = "-c:v libx264 -preset medium -crf 18";
const VP9: &str = "-c:v libvpx-vp9 -crf 24 -b:v 0 -row-mt 1";
const PRORES: &str = "-c:v prores_ks -profile:v 4444";

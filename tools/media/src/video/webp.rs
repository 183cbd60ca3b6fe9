//! Animated WebP: lossless, with opacity. `image-webp` encodes the frames; this adds the container
//! of animations (“Extended File Format” of Google's WebP Container Specification).

use super::{Encoder, Film, Out, commit, create, rgb};
use crate::Failure;
use image_webp::{ColorType, EncodingError, WebPEncoder};
use splatkit::Error;
use std::{
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Most pixels of a side.
pub const MOST: u32 = 1 << 14;

/// Bits of the file's header.
const HAS_ANIMATION: u8 = 1 << 1;
const HAS_OPACITY: u8 = 1 << 4;
/// A bit of a frame: its pixels replace those before, also where they are transparent.
const REPLACES: u8 = 1 << 1;

/// The start of a file: `RIFF`, a size, `WEBP`.
const START: usize = 12;

pub struct Webp {
    path: PathBuf,
    film: Film,
    out: Out,
    /// The number of frames so far.
    count: u32,
    /// The bytes of the file so far.
    bytes: u64,
}

impl Webp {
    pub fn open(path: &Path, film: Film) -> Result<Self, Failure> {
        let mut flags = HAS_ANIMATION;
        if film.background.is_none() {
            flags |= HAS_OPACITY;
        }
        let mut header = b"RIFF\0\0\0\0WEBP".to_vec();
        let mut canvas = vec![flags, 0, 0, 0];
        film.size.into_iter().for_each(|side| push_24(&mut canvas, side - 1));
        push_chunk(&mut header, b"VP8X", &canvas);
        // A transparent background, and no end.
        push_chunk(&mut header, b"ANIM", &[0; 6]);
        let mut webp = Self { path: path.to_owned(), film, out: create(path)?, count: 0, bytes: 0 };
        webp.write(&header)?;
        Ok(webp)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        self.bytes += bytes.len() as u64;
        self.out.write_all(bytes).map_err(|error| Error::output(&self.path, error).into())
    }

    /// Returns the chunk of a frame's pixels.
    fn pixels(&self, rgba: &[u8]) -> Result<Vec<u8>, EncodingError> {
        let [width, height] = self.film.size;
        let mut still = Vec::new();
        let encoder = WebPEncoder::new(&mut still);
        match self.film.background {
            Some(_) => encoder.encode(&rgb(rgba), width, height, ColorType::Rgb8)?,
            None => encoder.encode(rgba, width, height, ColorType::Rgba8)?,
        }
        Ok(still.split_off(START))
    }
}

impl Encoder for Webp {
    fn add(&mut self, rgba: &[u8]) -> Result<bool, Failure> {
        let pixels = self.pixels(rgba).map_err(|error| match error {
            EncodingError::IoError(error) => Error::output(&self.path, error).into(),
            error => Failure::output(&self.path, error),
        })?;
        let mut frame = Vec::with_capacity(pixels.len() + 32);
        // The corner of the frame, its size, and how long it is shown.
        let duration = self.film.duration(self.count, 1000.0);
        let [width, height] = self.film.size;
        [0, 0, width - 1, height - 1, duration]
            .into_iter()
            .for_each(|part| push_24(&mut frame, part));
        frame.push(REPLACES);
        frame.extend(pixels);
        let mut chunk = Vec::with_capacity(frame.len() + 8);
        push_chunk(&mut chunk, b"ANMF", &frame);
        self.write(&chunk)?;
        self.count += 1;
        Ok(true)
    }

    fn finish(mut self: Box<Self>) -> Result<(), Failure> {
        let size = u32::try_from(self.bytes - 8)
            .map_err(|_| Failure::output(&self.path, "an animated WebP has at most 4 GiB"))?;
        let written: io::Result<()> = (|| {
            self.out.seek(SeekFrom::Start(4))?;
            self.out.write_all(&size.to_le_bytes())
        })();
        written.map_err(|error| Error::output(&self.path, error))?;
        commit(self.out, &self.path)
    }
}

/// Adds a chunk: its name, its size and its bytes, to an even number of bytes.
fn push_chunk(to: &mut Vec<u8>, name: &[u8; 4], bytes: &[u8]) {
    to.extend(name);
    to.extend((bytes.len() as u32).to_le_bytes());
    to.extend(bytes);
    to.extend(&[0][..bytes.len() % 2]);
}

/// Adds a number of 24 bits.
fn push_24(to: &mut Vec<u8>, number: u32) {
    to.extend(&number.to_le_bytes()[..3]);
}

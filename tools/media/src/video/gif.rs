//! Animated GIF: 256 colours a frame: all of them, if a frame has no more, or else chosen for the
//! frame and dithered. A pixel is opaque or transparent.

use super::{
    Encoder, Film, Out, commit, create,
    palette::{Color, chosen, dithered},
};
use crate::Failure;
use gif::{DisposalMethod, EncodingError, Frame, Repeat};
use splatkit::Error;
use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

/// Most pixels of a side.
pub const MOST: u32 = u16::MAX as u32;
/// Most frames a second. Browsers show frames that are to be shown for less than 0.02 s for 0.1 s.
pub const FASTEST: f64 = 50.0;

/// The least opacity of a pixel that is drawn.
const OPAQUE: u8 = 128;

pub struct Gif {
    path: PathBuf,
    film: Film,
    encoder: gif::Encoder<Out>,
    /// The number of frames so far.
    count: u32,
}

impl Gif {
    pub fn open(path: &Path, film: Film) -> Result<Self, Failure> {
        let [width, height] = film.size.map(|side| side as u16);
        let begun = gif::Encoder::new(create(path)?, width, height, &[]).and_then(|mut encoder| {
            encoder.set_repeat(Repeat::Infinite)?;
            Ok(encoder)
        });
        let encoder = begun.map_err(|error| failure(path, error))?;
        Ok(Self { path: path.to_owned(), film, encoder, count: 0 })
    }
}

impl Encoder for Gif {
    fn add(&mut self, rgba: &[u8]) -> Result<bool, Failure> {
        let is_transparent = self.film.background.is_none();
        let (palette, indices, transparent) = indexed(rgba, self.film.size[0], is_transparent);
        let [width, height] = self.film.size.map(|side| side as u16);
        let delay = self.film.duration(self.count, 100.0).max(2);
        self.count += 1;
        let frame = Frame {
            // At most 10 s, because of the least frame rate.
            delay: delay as u16,
            // Otherwise the frame before would show through.
            dispose: if is_transparent { DisposalMethod::Background } else { DisposalMethod::Keep },
            transparent,
            width,
            height,
            palette: Some(palette),
            buffer: indices.into(),
            ..Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(|error| failure(&self.path, error))?;
        Ok(true)
    }

    fn finish(self: Box<Self>) -> Result<(), Failure> {
        let out = self.encoder.into_inner().map_err(|error| failure(&self.path, error))?;
        commit(out, &self.path)
    }
}

/// Returns the palette, the index of each pixel, and the index of transparent pixels.
fn indexed(rgba: &[u8], width: u32, is_transparent: bool) -> (Vec<u8>, Vec<u8>, Option<u8>) {
    let is_seen = |pixel: &[u8]| pixel[3] >= OPAQUE;
    // A pixel that is not drawn takes the colour of the last one that is: a colour of its own would
    // claim a part of the palette.
    let mut last = [0; 3];
    let color = |pixel: &[u8]| {
        if is_seen(pixel) {
            last = [pixel[0], pixel[1], pixel[2]];
        }
        last
    };
    let colors: Vec<Color> = rgba.chunks_exact(4).map(color).collect();
    // The last index is left for transparent pixels.
    let most = if is_transparent { 255 } else { 256 };
    let (palette, mut indices) = exact(&colors, most).unwrap_or_else(|| {
        let palette = chosen(&colors, most);
        let indices = dithered(&colors, &palette, width as usize);
        (palette, indices)
    });
    let mut palette = palette.into_flattened();
    let mut transparent = None;
    if is_transparent {
        let index = (palette.len() / 3) as u8;
        palette.extend([0; 3]);
        for (at, pixel) in indices.iter_mut().zip(rgba.chunks_exact(4)) {
            if !is_seen(pixel) {
                *at = index;
            }
        }
        transparent = Some(index);
    }
    (palette, indices, transparent)
}

/// Returns all colours and the index of each pixel, if there are at most so many colours.
fn exact(colors: &[Color], most: usize) -> Option<(Vec<Color>, Vec<u8>)> {
    let mut palette = Vec::new();
    let mut known = HashMap::new();
    let mut indices = Vec::with_capacity(colors.len());
    for color in colors {
        let index = *known.entry(color).or_insert(palette.len());
        if index == palette.len() {
            palette.push(*color);
        }
        if palette.len() > most {
            return None;
        }
        indices.push(index as u8);
    }
    Some((palette, indices))
}

fn failure(path: &Path, error: EncodingError) -> Failure {
    match error {
        EncodingError::Io(error) => Error::output(path, error).into(),
        error => Failure::output(path, error),
    }
}

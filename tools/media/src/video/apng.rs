//! Animated PNG: lossless, with opacity.

use super::{Encoder, Film, Out, commit, create, rgb};
use crate::Failure;
use png::{BlendOp, ColorType, EncodingError, Writer};
use splatkit::Error;
use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

pub struct Apng {
    path: PathBuf,
    film: Film,
    writer: Writer<Shared>,
    file: Shared,
    /// The number of frames so far.
    count: u32,
}

/// The file of a writer that does not return it.
#[derive(Clone)]
struct Shared(Arc<Mutex<Out>>);

impl Shared {
    fn out(&self) -> MutexGuard<'_, Out> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out().flush()
    }
}

impl Apng {
    pub fn open(path: &Path, film: Film) -> Result<Self, Failure> {
        let file = Shared(Arc::new(Mutex::new(create(path)?)));
        let [width, height] = film.size;
        let mut encoder = png::Encoder::new(file.clone(), width, height);
        encoder.set_color(match film.background {
            Some(_) => ColorType::Rgb,
            None => ColorType::Rgba,
        });
        // Without an end.
        let begun = encoder.set_animated(film.frames, 0).and_then(|()| {
            // Pixels replace those of the frame before, also where they are transparent.
            encoder.set_blend_op(BlendOp::Source)?;
            encoder.write_header()
        });
        let writer = begun.map_err(|error| failure(path, error))?;
        Ok(Self { path: path.to_owned(), film, writer, file, count: 0 })
    }
}

impl Encoder for Apng {
    fn add(&mut self, rgba: &[u8]) -> Result<bool, Failure> {
        // At most 10 s, because of the least frame rate.
        let delay = self.film.duration(self.count, 1000.0) as u16;
        self.count += 1;
        let written =
            self.writer.set_frame_delay(delay, 1000).and_then(|()| match self.film.background {
                Some(_) => self.writer.write_image_data(&rgb(rgba)),
                None => self.writer.write_image_data(rgba),
            });
        written.map_err(|error| failure(&self.path, error))?;
        Ok(true)
    }

    fn finish(self: Box<Self>) -> Result<(), Failure> {
        let Self { path, writer, file, .. } = *self;
        writer.finish().map_err(|error| failure(&path, error))?;
        match Arc::into_inner(file.0).map(Mutex::into_inner) {
            Some(file) => commit(file.unwrap_or_else(PoisonError::into_inner), &path),
            None => Err(Failure::output(&path, "it is still being written")),
        }
    }
}

fn failure(path: &Path, error: EncodingError) -> Failure {
    match error {
        EncodingError::IoError(error) => Error::output(path, error).into(),
        error => Failure::output(path, error),
    }
}

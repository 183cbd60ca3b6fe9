//! Volumes in levels of bricks.

use super::{Convert, memory};
use crate::{failure::Failure, load::Input, output, progress::Progress, render::milliseconds, scene::in_file};
use serde_json::json;
use splatkit::{
    Error,
    io::{Kind, VolumeStream},
    volume::{
        Lattice, Scalar, Volume,
        bricks::{self, WriteOptions},
    },
};
use std::{path::Path, time::Instant};

/// A volume to convert.
enum Source {
    /// Slice by slice.
    Stream(VolumeStream),
    Whole(Volume),
}

impl Convert {
    /// Writes the volume as .splv.
    pub(super) fn bricks(self, progress: &Progress) -> Result<(), Failure> {
        let [file] = &self.files[..] else {
            return Err(Failure::Usage("volumes are converted one by one".into()));
        };
        if self.lattice.is_some() {
            return Err(Failure::Usage("--lattice is for volumes written as .nrrd".into()));
        }
        let start = Instant::now();
        let most = self.surface.memory.or_else(memory::usual).unwrap_or(u64::MAX);
        progress.stage(format!("Reading {}", file.display()));
        let source = self.source(file, most)?;
        let (lattice, scalar) = source.shape();
        let need = source.memory();
        if need > most {
            let [wanted, most] = [need, most].map(|bytes| bytes.div_ceil(1 << 20));
            return Err(Failure::Usage(format!(
                "{}: this takes about {wanted} MiB, but only {most} MiB may be taken; --memory allows more",
                file.display()
            )));
        }
        if self.dry_run {
            return self.expect_bricks(&source, progress);
        }
        let options = WriteOptions {
            unit: self.surface.unit.clone(),
            source: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        };
        let stages = progress.stages();
        let watch = |done, all| stages.set("Writing bricks, slice by slice", done, all);
        match &source {
            Source::Whole(volume) => bricks::write(volume, &self.output, &options, &watch),
            Source::Stream(stream) => {
                let range = stream.range(&|done, all| stages.set("Looking through the input", done, all))?;
                bricks::convert(stream, range, &self.output, &options, &watch)
            }
        }
        .map_err(|error| in_file(file, error))?;
        drop(stages);
        progress.clear();
        let bytes = self.output.metadata().map_err(|e| Error::file(&self.output, "read", e))?.len();
        let per_sample = bytes as f64 / lattice.len() as f64;
        let [nx, ny, nz] = lattice.dims;
        if self.json {
            return output::line(json!({
                "file": self.output.to_string_lossy(),
                "dims": lattice.dims,
                "type": scalar.name(),
                "slice_by_slice": matches!(source, Source::Stream(_)),
                "bytes": bytes,
                "bytes_per_point": per_sample,
                "total_ms": milliseconds(start),
            }));
        }
        output::line(format_args!("samples         {} ({nx} × {ny} × {nz}, {})", lattice.len(), scalar.name()))?;
        output::line(format_args!("bytes           {bytes} ({per_sample:.3} a sample)"))?;
        output::line(format_args!("time            {:.2} s", milliseconds(start) / 1e3))
    }

    /// Opens the input, slice by slice where that can be.
    fn source(&self, file: &Path, most: u64) -> Result<Source, Failure> {
        let none = || {
            let file = file.display();
            Err(Failure::Usage(format!("{file} holds no volume that can be cut in bricks; write surfaces as .splk")))
        };
        if self.load.kind(file)? != Kind::Volume {
            return none();
        }
        if let Some(stream) = self.load.stream(file)? {
            return Ok(Source::Stream(stream));
        }
        // What is not packed takes no less memory than its file; what is shows when it is unpacked.
        let bytes = file.metadata().map_err(|e| Error::file(file, "read", e))?.len();
        if bytes > most {
            return Err(Failure::Usage(format!(
                "{}: {} MiB cannot be read as a whole in {} MiB; raw volumes, and NRRD files of raw encoding, are read slice \
                 by slice, others need more --memory",
                file.display(),
                bytes >> 20,
                most >> 20
            )));
        }
        match self.load.open(file)? {
            Input::Volume(volume) => Ok(Source::Whole(volume)),
            _ => none(),
        }
    }

    /// Tells what a conversion would take.
    fn expect_bricks(&self, source: &Source, progress: &Progress) -> Result<(), Failure> {
        progress.clear();
        let (lattice, scalar) = source.shape();
        let need = source.memory();
        // Levels above the finest have a seventh of its samples, blocks a 32nd of the bricks' samples.
        let unpacked = (lattice.len() as u64).saturating_mul(scalar.bytes() as u64) / 7 * 8;
        let slice_by_slice = matches!(source, Source::Stream(_));
        if self.json {
            return output::line(json!({
                "dims": lattice.dims,
                "type": scalar.name(),
                "unpacked_bytes": unpacked,
                "expected_memory": need,
                "slice_by_slice": slice_by_slice,
            }));
        }
        let [nx, ny, nz] = lattice.dims;
        let how = if slice_by_slice { "slice by slice" } else { "as a whole" };
        output::line(format_args!("samples         {} ({nx} × {ny} × {nz}, {})", lattice.len(), scalar.name()))?;
        output::line(format_args!("bytes           {unpacked} with all levels, less what packing takes away"))?;
        output::line(format_args!("memory          about {} MiB, {how}", need >> 20))
    }
}

impl Source {
    fn shape(&self) -> (Lattice, Scalar) {
        match self {
            Self::Stream(stream) => (stream.lattice().clone(), stream.scalar()),
            Self::Whole(volume) => (volume.lattice.clone(), volume.samples.scalar()),
        }
    }

    /// About how much memory converting takes.
    fn memory(&self) -> u64 {
        let (lattice, scalar) = self.shape();
        let whole = match self {
            Self::Stream(_) => 0,
            Self::Whole(volume) => volume.samples.bytes().len() as u64,
        };
        bricks::memory_of(lattice.dims, scalar).saturating_add(whole)
    }
}

//! Volumes in levels of bricks.

use super::{Convert, memory, source::Source};
use crate::{
    failure::{Failure, in_file},
    output,
    progress::Progress,
    timing::milliseconds,
};
use serde_json::json;
use splatkit::{
    Error,
    bricks::{self, WriteOptions},
    session::warn_of_holes,
};
use std::time::Instant;

impl Convert {
    /// Writes the volume as .splv.
    pub(super) fn bricks(self, progress: &Progress) -> Result<(), Failure> {
        let [file] = &self.files[..] else {
            return Err(Failure::Usage(
                "volumes are converted one by one; give a single file".into(),
            ));
        };
        if self.lattice.is_some() {
            return Err(Failure::Usage("--lattice is for volumes written as .nrrd".into()));
        }
        let start = Instant::now();
        let most = self.most_memory();
        progress.stage(format!("Reading {}", file.display()));
        let source = self.source(file, most)?;
        let (lattice, scalar) = source.shape();
        memory::check(file, memory_of(&source), 0, most)?;
        if self.dry_run {
            return self.expect_bricks(&source, progress);
        }
        let options = WriteOptions {
            unit: self.surface.unit.clone().unwrap_or_default(),
            source: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        };
        let stages = progress.stages();
        let watch = |done, all| stages.set("Writing bricks, slice by slice", done, all);
        match &source {
            Source::Whole(volume) => bricks::write(volume, self.output(), &options, Some(&watch)),
            Source::Stream(stream) => {
                let range =
                    stream.range(Some(&|done, all| stages.set("Scanning the input", done, all)))?;
                let (name, all) = (file.display().to_string(), lattice.len() as u64);
                warn_of_holes(&name, stream.holes(), all, "read as the lowest value");
                bricks::convert(stream, range, self.output(), &options, Some(&watch))
            }
        }
        .map_err(|error| in_file(file, error))?;
        drop(stages);
        progress.clear();
        let bytes =
            self.output().metadata().map_err(|e| Error::file(self.output(), "read", e))?.len();
        let per_sample = bytes as f64 / lattice.len() as f64;
        let [nx, ny, nz] = lattice.dims;
        if self.json {
            return output::line(json!({
                "file": self.output().to_string_lossy(),
                "dims": lattice.dims,
                "type": scalar.name(),
                "slice_by_slice": matches!(source, Source::Stream(_)),
                "bytes": bytes,
                "bytes_per_point": per_sample,
                "total_ms": milliseconds(start),
            }));
        }
        output::line(format_args!(
            "samples         {} ({nx} × {ny} × {nz}, {})",
            lattice.len(),
            scalar.name()
        ))?;
        output::line(format_args!("bytes           {bytes} ({per_sample:.3} a sample)"))?;
        output::line(format_args!("time            {:.2} s", milliseconds(start) / 1e3))
    }

    /// Prints what a conversion would take.
    fn expect_bricks(&self, source: &Source, progress: &Progress) -> Result<(), Failure> {
        progress.clear();
        let (lattice, scalar) = source.shape();
        let need = memory_of(source);
        // The levels above the finest have a seventh of its samples, the blocks a 32nd of the
        // bricks' samples.
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
        output::line(format_args!(
            "samples         {} ({nx} × {ny} × {nz}, {})",
            lattice.len(),
            scalar.name()
        ))?;
        output::line(format_args!(
            "bytes           {unpacked} with all levels, before compression"
        ))?;
        output::line(format_args!("memory          about {} MiB, {how}", need >> 20))
    }
}

/// Estimates the bytes of memory for a conversion.
fn memory_of(source: &Source) -> u64 {
    let (lattice, scalar) = source.shape();
    let whole = match source {
        Source::Stream(_) => 0,
        Source::Whole(volume) => volume.samples.bytes().len() as u64,
    };
    bricks::memory_of(lattice.dims, scalar).saturating_add(whole)
}

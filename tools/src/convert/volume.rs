//! Volumes: written in another format, or on another lattice.

use super::{Convert, memory, source::Source};
use crate::{failure::Failure, output, progress::Progress};
use clap::ValueEnum;
use serde_json::json;
use splatkit::{
    Error, formats,
    volume::{self, Arrangement, Volume},
};

/// The lattices that can be chosen.
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq)]
pub enum Wanted {
    Cartesian,
    Bcc,
}

impl Convert {
    /// Writes the volume as .nrrd.
    pub(super) fn volume(self, progress: &Progress) -> Result<(), Failure> {
        let [file] = &self.files[..] else {
            return Err(Failure::Usage(
                "volumes are converted one by one; give a single file".into(),
            ));
        };
        if self.dry_run {
            return Err(Failure::Usage(
                "--dry-run is for .splk and .splv; a .nrrd is at most about as large as its samples"
                    .into(),
            ));
        }
        progress.stage(format!("Reading {}", file.display()));
        let most = self.most_memory();
        let source = self.source(file, most)?;
        memory::check(file, memory_of(&source, self.lattice), 0, most)?;
        let volume = match source {
            Source::Whole(volume) => *volume,
            Source::Stream(_) => self.whole(file, None)?,
        };
        let count = volume.len();
        progress.stage("Resampling");
        let volume = on_lattice(volume, self.lattice)?;
        progress.stage(format!("Writing {}", self.output().display()));
        formats::nrrd::write(&volume, self.output())?;
        progress.clear();
        let (lattice, dims) = (name_of(&volume), volume.lattice.dims);
        if self.json {
            return output::line(json!({
                "file": self.output().to_string_lossy(),
                "lattice": lattice,
                "dims": dims,
                "type": volume.samples.type_name(),
                "samples_read": count,
                "samples_written": volume.len(),
            }));
        }
        let [nx, ny, nz] = dims;
        output::line(format_args!("samples read      {count}"))?;
        output::line(format_args!(
            "samples written   {} ({nx} × {ny} × {nz}, {lattice})",
            volume.len()
        ))
    }
}

/// Estimates the bytes of memory for a conversion: the samples and, for a body-centred lattice, its
/// own samples (0.71 times as many) and the values that they are interpolated from.
fn memory_of(source: &Source, wanted: Option<Wanted>) -> u64 {
    let (lattice, scalar) = source.shape();
    let is_resampled = wanted == Some(Wanted::Bcc) && lattice.arrangement == Arrangement::Cartesian;
    let bytes = scalar.bytes() as u64;
    let of_sample = if is_resampled { 2 * bytes + size_of::<f64>() as u64 } else { bytes };
    (lattice.len() as u64).saturating_mul(of_sample)
}

fn on_lattice(volume: Volume, wanted: Option<Wanted>) -> Result<Volume, Error> {
    match (&volume.lattice.arrangement, wanted) {
        (Arrangement::Cartesian, Some(Wanted::Bcc)) => volume::body_centred(&volume),
        (_, None)
        | (Arrangement::Cartesian, Some(Wanted::Cartesian))
        | (Arrangement::BodyCentred, Some(Wanted::Bcc)) => Ok(volume),
        (_, Some(wanted)) => {
            let (from, to) =
                (name_of(&volume), if wanted == Wanted::Bcc { "bcc" } else { "cartesian" });
            Err(Error::Argument(format!(
                "a volume on a {from} lattice cannot be resampled to a {to} one"
            )))
        }
    }
}

fn name_of(volume: &Volume) -> &'static str {
    match volume.lattice.arrangement {
        Arrangement::Cartesian => "cartesian",
        Arrangement::BodyCentred => "bcc",
        Arrangement::Rectilinear(_) => "rectilinear",
    }
}

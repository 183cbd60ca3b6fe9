//! The volume to convert, read slice by slice if possible, or as a whole.

use super::Convert;
use crate::failure::Failure;
use splatkit::{
    formats::{Kind, VolumeStream},
    input,
    session::Data,
    volume::{Lattice, Scalar, Volume},
};
use std::path::Path;

/// A volume to convert.
pub enum Source {
    /// Read slice by slice.
    Stream(Box<VolumeStream>),
    Whole(Box<Volume>),
}

impl Source {
    pub fn shape(&self) -> (Lattice, Scalar) {
        match self {
            Self::Stream(stream) => (stream.lattice().clone(), stream.scalar()),
            Self::Whole(volume) => (volume.lattice.clone(), volume.samples.scalar()),
        }
    }
}

impl Convert {
    /// Opens the input: slice by slice if possible, or as a whole in `most` bytes of memory.
    pub(super) fn source(&self, file: &Path, most: u64) -> Result<Source, Failure> {
        let name = file.display();
        match self.load.kind(file)? {
            Kind::Volume => {}
            Kind::Bricks => {
                let message = format!(
                    "{name} holds a volume in bricks already; convert the volume it was made from"
                );
                return Err(Failure::Usage(message));
            }
            Kind::Samples => {
                return Err(Failure::Usage(format!(
                    "{name} holds scattered samples; only volumes on a lattice can be converted"
                )));
            }
            Kind::Cells => {
                return Err(Failure::Usage(format!(
                    "{name} holds cells; only volumes on a lattice can be converted"
                )));
            }
            Kind::Mesh | Kind::Gaussians | Kind::Hierarchy => return Err(none(file)),
        }
        if let Some(stream) = self.load.reading(None).stream(file)? {
            self.check_unneeded(&[stream.path().to_owned()])?;
            return Ok(Source::Stream(Box::new(stream)));
        }
        // Uncompressed data takes no less memory than its file. What compressed data takes is known
        // once it is unpacked.
        let bytes = input::size(file)?;
        if bytes > most {
            return Err(Failure::Usage(format!(
                "{}: {} MiB cannot be read as a whole in {} MiB of memory; raw volumes and NRRD \
                 files of raw encoding become .splv slice by slice, others need more --memory",
                file.display(),
                bytes >> 20,
                most >> 20
            )));
        }
        self.whole(file, Some(most)).map(Box::new).map(Source::Whole)
    }

    /// Reads a volume as a whole. `memory` limits its bytes if its need is not known yet.
    pub(super) fn whole(&self, file: &Path, memory: Option<u64>) -> Result<Volume, Failure> {
        match self.data(file, memory)? {
            Data::Volume(volume) => {
                if volume.colors.is_some() {
                    let file = file.display();
                    tracing::warn!("{file}: the brightness is written, and the colours are not");
                }
                Ok(volume)
            }
            _ => Err(none(file)),
        }
    }
}

fn none(file: &Path) -> Failure {
    let file = file.display();
    Failure::Usage(format!(
        "{file} holds no volume; meshes, point clouds, hierarchies and trained Gaussians are \
         written as .splk, .ply, .splat, .spz or .glb"
    ))
}

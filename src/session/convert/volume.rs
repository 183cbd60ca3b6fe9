//! Volumes: as bricks, in another format, or on another lattice. A volume is read slice by slice if
//! possible, or as a whole.

use super::{Converted, Expected, Resampled, Watch, Work, memory, name_of, splats::in_file, wrong};
use crate::{
    Error, Result,
    bricks::{self, WriteOptions},
    formats::{self, Kind, VolumeStream},
    input,
    session::{Data, warn_of_holes},
    volume::{self, Arrangement, Lattice, Scalar, Volume},
    warning,
};
use std::{path::Path, slice};

/// A volume to convert.
enum Input {
    /// Read slice by slice.
    Stream(Box<VolumeStream>),
    Whole(Box<Volume>),
}

impl Input {
    fn shape(&self) -> (Lattice, Scalar) {
        match self {
            Self::Stream(stream) => (stream.lattice().clone(), stream.scalar()),
            Self::Whole(volume) => (volume.lattice.clone(), volume.samples.scalar()),
        }
    }

    fn is_stream(&self) -> bool {
        matches!(self, Self::Stream(_))
    }

    /// Estimates the bytes of memory for a conversion to bricks.
    fn memory_of_bricks(&self) -> u64 {
        let (lattice, scalar) = self.shape();
        let whole = match self {
            Self::Stream(_) => 0,
            Self::Whole(volume) => volume.samples.bytes().len() as u64,
        };
        bricks::memory_of(lattice.dims, scalar).saturating_add(whole)
    }

    /// Estimates the bytes of memory for a conversion on a lattice: the samples and, for a
    /// body-centred lattice, its own samples (0.71 times as many) and the values that they are
    /// interpolated from.
    fn memory_on(&self, wanted: Option<Resampled>) -> u64 {
        let (lattice, scalar) = self.shape();
        let is_resampled =
            wanted == Some(Resampled::BodyCentred) && lattice.arrangement == Arrangement::Cartesian;
        let bytes = scalar.bytes() as u64;
        let of_sample = if is_resampled { 2 * bytes + size_of::<f64>() as u64 } else { bytes };
        (lattice.len() as u64).saturating_mul(of_sample)
    }
}

impl<W: Watch> Work<'_, W> {
    /// Writes the volume as NRRD.
    pub fn nrrd(&self) -> Result<Converted, W::Error> {
        let file = self.single()?;
        self.watch.stage(&format!("Reading {}", file.display()));
        let most = self.conversion.most_memory();
        let input = self.input(file, most)?;
        memory::check(file, input.memory_on(self.conversion.lattice), 0, most)?;
        let volume = match input {
            Input::Whole(volume) => *volume,
            Input::Stream(_) => self.whole(file, None)?,
        };
        let samples_read = volume.len();
        self.watch.stage("Resampling");
        let volume = on_lattice(volume, self.conversion.lattice)?;
        self.watch.stage(&format!("Writing {}", self.output.display()));
        formats::nrrd::write(&volume, self.output)?;
        let sample_type = volume.samples.type_name();
        Ok(Converted::Volume { lattice: volume.lattice, sample_type, samples_read })
    }

    /// Refuses a trial of NRRD.
    pub fn expect_nrrd(&self) -> Result<Expected, W::Error> {
        self.single()?;
        let message =
            "--dry-run is for .splk and .splv; a .nrrd is at most about as large as its samples";
        Err(wrong(message).into())
    }

    /// Writes the volume in bricks.
    pub fn bricks(&self) -> Result<Converted, W::Error> {
        let file = self.single()?;
        let input = self.input_of_bricks(file)?;
        let (lattice, scalar) = input.shape();
        let options = WriteOptions {
            unit: self.conversion.unit.clone().unwrap_or_default(),
            source: name_of(file).unwrap_or_default(),
        };
        let watch = |done, all| self.watch.progress("Writing bricks, slice by slice", done, all);
        match &input {
            Input::Whole(volume) => bricks::write(volume, self.output, &options, Some(&watch)),
            Input::Stream(stream) => {
                let scan = |done, all| self.watch.progress("Scanning the input", done, all);
                let range = stream.range(Some(&scan))?;
                let (name, all) = (file.display().to_string(), lattice.len() as u64);
                warn_of_holes(&name, stream.holes(), all, "read as the lowest value");
                bricks::convert(stream, range, self.output, &options, Some(&watch))
            }
        }
        .map_err(|error| in_file(file, error))?;
        Ok(Converted::Bricks { lattice, scalar, slice_by_slice: input.is_stream() })
    }

    /// Finds what a conversion to bricks would take.
    pub fn expect_bricks(&self) -> Result<Expected, W::Error> {
        let input = self.input_of_bricks(self.single()?)?;
        let (lattice, scalar) = input.shape();
        // The levels above the finest have a seventh of its samples, the blocks a 32nd of the
        // bricks' samples.
        let unpacked = (lattice.len() as u64).saturating_mul(scalar.bytes() as u64) / 7 * 8;
        let (slice_by_slice, memory) = (input.is_stream(), input.memory_of_bricks());
        Ok(Expected::Bricks { lattice, scalar, slice_by_slice, unpacked, memory })
    }

    fn input_of_bricks(&self, file: &Path) -> Result<Input, W::Error> {
        self.watch.stage(&format!("Reading {}", file.display()));
        let most = self.conversion.most_memory();
        let input = self.input(file, most)?;
        memory::check(file, input.memory_of_bricks(), 0, most)?;
        Ok(input)
    }

    /// Returns the only file.
    fn single(&self) -> Result<&Path> {
        let [file] = self.files else {
            return Err(wrong("volumes are converted one by one; give a single file"));
        };
        Ok(file)
    }

    /// Opens the input: slice by slice if possible, or as a whole in `most` bytes of memory.
    fn input(&self, file: &Path, most: u64) -> Result<Input, W::Error> {
        let name = file.display();
        let refused = match self.conversion.reading(crate::memory::most()).kind(file)? {
            Kind::Volume => None,
            Kind::Bricks if Kind::at_once(file, self.conversion.reading.limits())?.is_none() => {
                Some(format!(
                    "{name} holds an image that is drawn from its levels; --dataset names one that \
                     can be converted as a whole"
                ))
            }
            Kind::Bricks => Some(format!(
                "{name} holds a volume in bricks already; convert the volume it was made from"
            )),
            Kind::Samples => Some(format!(
                "{name} holds scattered samples; only volumes on a lattice can be converted"
            )),
            Kind::Cells => {
                Some(format!("{name} holds cells; only volumes on a lattice can be converted"))
            }
            Kind::Mesh | Kind::Gaussians | Kind::Hierarchy => return Err(no_volume(file).into()),
        };
        if let Some(message) = refused {
            return Err(wrong(message).into());
        }
        if let Some(stream) = self.conversion.reading.stream(file)? {
            self.watch.has_read(slice::from_ref(&stream.path().to_owned()))?;
            return Ok(Input::Stream(Box::new(stream)));
        }
        // Uncompressed data takes no less memory than its file. What compressed data takes is known
        // once it is unpacked.
        let bytes = input::size(file)?;
        if bytes > most {
            return Err(wrong(format!(
                "{name}: {} MiB cannot be read as a whole in {} MiB of memory; raw volumes and \
                 NRRD files of raw encoding become .splv slice by slice, others need more --memory",
                bytes >> 20,
                most >> 20
            ))
            .into());
        }
        self.whole(file, Some(most)).map(Box::new).map(Input::Whole)
    }

    /// Reads a volume as a whole. `memory` limits its bytes if its need is not known yet.
    fn whole(&self, file: &Path, memory: Option<u64>) -> Result<Volume, W::Error> {
        match self.data(file, memory)? {
            Data::Volume(volume) => {
                if volume.colors.is_some() {
                    let file = file.display();
                    warning::give!("{file}: the brightness is written, and the colours are not");
                }
                Ok(volume)
            }
            _ => Err(no_volume(file).into()),
        }
    }
}

fn no_volume(file: &Path) -> Error {
    let file = file.display();
    wrong(format!(
        "{file} holds no volume; meshes, point clouds, hierarchies and trained Gaussians are \
         written as .splk, .ply, .splat, .spz, .sog or .glb"
    ))
}

fn on_lattice(volume: Volume, wanted: Option<Resampled>) -> Result<Volume> {
    match (&volume.lattice.arrangement, wanted) {
        (Arrangement::Cartesian, Some(Resampled::BodyCentred)) => volume::body_centred(&volume),
        (_, None)
        | (Arrangement::Cartesian, Some(Resampled::Cartesian))
        | (Arrangement::BodyCentred, Some(Resampled::BodyCentred)) => Ok(volume),
        (arrangement, Some(wanted)) => {
            let from = arrangement.name();
            let to = if wanted == Resampled::BodyCentred { "bcc" } else { "cartesian" };
            Err(wrong(format!("a volume on a {from} lattice cannot be resampled to a {to} one")))
        }
    }
}

//! Writes NRRD: samples in their own type, compressed by gzip, in the same file as the header.

use crate::{
    Error, Result,
    about::Frame,
    disk,
    volume::{Arrangement, Lattice, Scalar, Volume},
};
use flate2::{Compression, write::GzEncoder};
use glam::DVec3;
use std::{
    io::{ErrorKind, Write},
    path::Path,
};

/// Writes a volume with its position in space. Lattices that are not Cartesian are written with the
/// keys that [`read`](super::read) knows.
///
/// # Errors
/// [`Error::Argument`] for a volume that was built by hand and contradicts itself;
/// [`Error::Output`] if the file cannot be written.
pub fn write(volume: &Volume, path: impl AsRef<Path>) -> Result<()> {
    volume.validate().map_err(Error::Argument)?;
    disk::write_with(path.as_ref(), |out| write_to(volume, out))
}

/// Writes a volume of bytes slice by slice, uncompressed, so that it can also be read slice by
/// slice ([`VolumeStream`](crate::formats::VolumeStream)). `slice` returns the samples of each
/// slice across the last axis; it is called in order.
///
/// # Errors
/// [`Error::Argument`] for an invalid lattice ([`Lattice::validate`]), and if `slice` returns
/// another number of samples than a slice has; [`Error::Output`] if the file cannot be written. In
/// both cases no file is left behind.
pub fn write_bytes(
    lattice: &Lattice,
    path: impl AsRef<Path>,
    mut slice: impl FnMut(usize) -> Vec<u8>,
) -> Result<()> {
    lattice.validate()?;
    let [nx, ny, nz] = lattice.dims;
    let mut wrong = None;
    let written = disk::write_with(path.as_ref(), |out| {
        write_header((lattice, Frame::Own), Scalar::U8, "raw", out)?;
        for k in 0..nz {
            let samples = slice(k);
            if samples.len() != nx * ny {
                wrong = Some(format!("slice {k} has {} samples, not {nx} × {ny}", samples.len()));
                return Err(ErrorKind::InvalidInput.into());
            }
            out.write_all(&samples)?;
        }
        Ok(())
    });
    wrong.map_or(written, |message| Err(Error::Argument(message)))
}

/// Writes the header: the fields that every file has, and the keys of lattices that are not
/// Cartesian.
fn write_header(
    (lattice, frame): (&Lattice, Frame),
    scalar: Scalar,
    encoding: &str,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let [nx, ny, nz] = lattice.dims;
    let body_centred = lattice.arrangement == Arrangement::BodyCentred;
    let layer = if body_centred { 0.5 * lattice.axes.z_axis } else { lattice.axes.z_axis };
    let [i, j, k] = [lattice.axes.x_axis, lattice.axes.y_axis, layer].map(vector);
    let kind = match scalar {
        Scalar::U8 => "uint8",
        Scalar::U16 => "uint16",
        Scalar::I16 => "int16",
        Scalar::I32 => "int32",
        Scalar::F32 => "float",
    };
    let space = match frame {
        Frame::Patient => "space: right-anterior-superior",
        Frame::Own => "space dimension: 3",
    };
    let endian = if cfg!(target_endian = "little") { "little" } else { "big" };
    writeln!(out, "NRRD0004\ntype: {kind}\ndimension: 3\n{space}\nsizes: {nx} {ny} {nz}")?;
    writeln!(out, "space directions: {i} {j} {k}\nspace origin: {}", vector(lattice.origin))?;
    writeln!(out, "endian: {endian}\nencoding: {encoding}")?;
    if body_centred {
        writeln!(out, "lattice:=bcc")?;
    }
    if let Arrangement::Rectilinear(places) = &lattice.arrangement {
        for (axis, places) in places.iter().enumerate() {
            let places: Vec<String> = places.iter().map(f64::to_string).collect();
            writeln!(out, "axis positions {axis}:={}", places.join(" "))?;
        }
    }
    writeln!(out)
}

fn write_to(volume: &Volume, out: &mut impl Write) -> std::io::Result<()> {
    let place = (&volume.lattice, volume.about.frame);
    write_header(place, volume.samples.scalar(), "gzip", out)?;
    let mut packed = GzEncoder::new(out, Compression::default());
    packed.write_all(volume.samples.bytes())?;
    packed.finish().map(drop)
}

fn vector(v: DVec3) -> String {
    format!("({},{},{})", v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        formats::{ReadOptions, nrrd},
        input::testing::*,
        volume::Samples,
    };

    #[test]
    fn what_is_written_reads_back() {
        let folder = Folder::new();
        let axes =
            glam::DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.0, 2.0, 0.0), DVec3::Z);
        let lattice = Lattice::cartesian([2, 3, 1], DVec3::new(-1.5, 0.0, 1e9), axes);
        let places = [vec![-0.1, 1.0 / 3.0], vec![1e-300, 2.0, 1e9], vec![7.5]];
        let rectilinear =
            Lattice { arrangement: Arrangement::Rectilinear(places.into()), ..lattice };
        let samples = [
            Samples::U8(vec![0, 1, 2, 3, 4, 255]),
            Samples::U16(vec![0, 1, 2, 3, 4, 65535]),
            Samples::I16(vec![0, 1, 2, 3, 4, -32768]),
            Samples::I32(vec![0, 1, 2, 3, 4, i32::MIN]),
            Samples::F32(vec![0.0, 1e-30, -2.5, 3.0, 4.0, 1e30]),
        ];
        let body_centred = Lattice { arrangement: Arrangement::BodyCentred, ..lattice };
        for samples in samples {
            for lattice in [&lattice, &body_centred, &rectilinear] {
                let path = folder.write("volume.nrrd", b"");
                write(&Volume::new(lattice.clone(), samples.clone()).unwrap(), &path).unwrap();
                let read =
                    read_with(&path, |source| nrrd::read(source, &ReadOptions::default())).unwrap();
                assert_eq!((&read.samples, &read.lattice), (&samples, lattice));
            }
        }
    }
    #[test]
    fn slices_are_written_on_any_lattice() {
        let folder = Folder::new();
        let cartesian = Lattice::with_spacing([2, 3, 3], DVec3::ONE);
        let places = [vec![0.0, 5.0], vec![1.0, 2.0, 7.5], vec![0.0, 1.0, 9.0]];
        let rectilinear =
            Lattice { arrangement: Arrangement::Rectilinear(places.into()), ..cartesian };
        let body_centred = Lattice { arrangement: Arrangement::BodyCentred, ..cartesian };
        for lattice in [cartesian, rectilinear, body_centred] {
            let path = folder.write("bytes.nrrd", b"");
            write_bytes(&lattice, &path, |k| (0..6).map(|at| (6 * k + at) as u8).collect())
                .unwrap();
            let read =
                read_with(&path, |source| nrrd::read(source, &ReadOptions::default())).unwrap();
            assert_eq!((read.samples, read.lattice), (Samples::U8((0..18).collect()), lattice));
        }
    }

    #[test]
    fn contradictions_are_refused_and_leave_no_file() {
        let folder = Folder::new();
        let path = folder.write("before.nrrd", b"before");
        let refused = |result: Result<()>, word: &str| {
            let Err(Error::Argument(message)) = result else {
                panic!("{result:?} where {word} was expected")
            };
            assert!(message.contains(word), "{message}");
            assert_eq!(std::fs::read(&path).unwrap(), b"before");
        };
        let lattice = Lattice::with_spacing([2, 2, 2], DVec3::ONE);
        let good = Volume::new(lattice.clone(), Samples::F32(vec![1.0; 8])).unwrap();
        refused(
            write(&Volume { samples: Samples::F32(vec![1.0; 3]), ..good.clone() }, &path),
            "3 samples",
        );
        refused(
            write(&Volume { samples: Samples::F32(vec![f32::NAN; 8]), ..good.clone() }, &path),
            "not finite",
        );
        let places = Arrangement::Rectilinear([vec![0.0], vec![], vec![0.0, 1.0]].into());
        let uneven = Lattice { arrangement: places, ..lattice };
        refused(write(&Volume { lattice: uneven.clone(), ..good }, &path), "1 coordinates along x");
        refused(write_bytes(&uneven, &path, |_| vec![0; 4]), "1 coordinates along x");
        refused(
            write_bytes(&lattice, &path, |k| vec![0; 4 - k]),
            "slice 1 has 3 samples, not 2 × 2",
        );
    }
}

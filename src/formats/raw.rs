//! Raw volumes: samples without a header, or after a header to skip. The caller gives the layout.

use super::{
    Endian, ReadOptions, SampleType,
    shared::{grid::Component, holes, plain::Plain},
};
use crate::{
    Result,
    about::Frame,
    input::Source,
    volume::{Lattice, Volume},
};
use flate2::read::MultiGzDecoder;
use glam::DVec3;
use std::borrow::Cow;

/// The layout of a raw file, which the file itself does not describe.
#[derive(Debug, Clone, PartialEq)]
pub struct RawLayout {
    /// Samples along each axis. The first axis varies fastest in the file.
    pub dims: [usize; 3],
    /// The type of one sample.
    pub sample_type: SampleType,
    /// World units between samples along each axis.
    pub spacing: DVec3,
    /// The byte order of samples of more than one byte.
    pub endian: Endian,
    /// Bytes before the first sample, of the uncompressed file if it is compressed.
    pub header: u64,
}

/// Reads a raw file, which may be compressed by gzip. Sample (0, 0, 0) is at the world's origin.
/// Of the options, only [`ReadOptions::missing`] matters.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if the file's size is not exactly that of header and
/// samples, with a guess at the layout it fits; [`Error::Limit`](crate::Error::Limit) for a layout
/// over the limits.
pub fn read(source: &Source, layout: &RawLayout, options: &ReadOptions) -> Result<Volume> {
    let (lattice, wanted) = whole(source, layout)?;
    Component::chosen(source, options, 1, false)?;
    let bytes = source.bytes();
    let mut unpacked: Cow<[u8]> = if is_packed(source, wanted) {
        let unpacked = source.unpack("gzip stream", MultiGzDecoder::new(bytes), wanted);
        // gzip ends with the lower 32 bits of the unpacked size.
        let claim = bytes.last_chunk().map_or(0, |&size| u64::from(u32::from_le_bytes(size)));
        unpacked.map_err(|e| e.hint(guess(claim, layout)))?.into()
    } else {
        bytes.into()
    };
    if unpacked.len() != wanted {
        let [nx, ny, nz] = layout.dims;
        let message = format!(
            "has {} bytes after the header, but {nx} × {ny} × {nz} samples of type {} need {}",
            (bytes.len() as u64).saturating_sub(layout.header),
            layout.sample_type.name(),
            wanted as u64 - layout.header
        );
        return Err(source.error("size", message).hint(guess(bytes.len() as u64, layout)));
    }
    let header = layout.header as usize;
    source.spend(
        "the size of the samples in bytes",
        layout.sample_type.decoded_bytes(wanted - header),
    )?;
    match &mut unpacked {
        Cow::Borrowed(bytes) => *bytes = &bytes[header..],
        Cow::Owned(bytes) => drop(bytes.drain(..header)),
    }
    let samples = layout.sample_type.decode(unpacked, layout.endian);
    holes::volume(source, lattice, samples, options)
}

/// Returns where the samples are in a file that contains exactly the header and the samples; `None`
/// for other files and for compressed ones.
///
/// # Errors
/// As [`read`], for the layout only.
pub(super) fn plain(source: &Source, layout: &RawLayout) -> Result<Option<Plain>> {
    let (lattice, wanted) = whole(source, layout)?;
    let &RawLayout { sample_type, endian, header, .. } = layout;
    let plain = Plain {
        path: source.path.to_owned(),
        start: header as usize,
        sample_type,
        endian,
        lattice,
        frame: Frame::Own,
    };
    Ok((source.bytes().len() == wanted && !is_packed(source, wanted)).then_some(plain))
}

/// Returns the lattice of a layout, and the number of bytes of header and samples.
fn whole(source: &Source, layout: &RawLayout) -> Result<(Lattice, usize)> {
    let lattice = Lattice::with_spacing(layout.dims, layout.spacing);
    lattice.validate()?;
    let samples =
        layout.sample_type.bytes_of(layout.dims).and_then(|bytes| bytes.checked_add(layout.header));
    let wanted = source
        .check_bytes("the size of header and samples in bytes", samples.unwrap_or(u64::MAX))?;
    Ok((lattice, wanted))
}

/// Returns whether a file is compressed by gzip. A raw file may begin with gzip's magic number by
/// chance. Then it has the expected size and no `.gz` extension.
fn is_packed(source: &Source, wanted: usize) -> bool {
    let named = source.path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    source.bytes().starts_with(&[0x1f, 0x8b]) && (named || source.bytes().len() != wanted)
}

/// Returns a guess at the layout of a file of `size` bytes, as a hint.
fn guess(size: u64, layout: &RawLayout) -> String {
    let RawLayout { dims: [nx, ny, nz], sample_type, header, .. } = layout;
    let names = ["u8", "i16", "f32", "f64"];
    let types = names.iter().filter_map(|name| SampleType::from_name(name));
    let count = (*nx as u64).saturating_mul(*ny as u64).saturating_mul(*nz as u64);
    let rest = size.saturating_sub(*header);
    for other in types {
        if count.checked_mul(other.bytes() as u64) == Some(rest)
            && other.bytes() != sample_type.bytes()
        {
            return format!(
                "the size fits samples of {} bytes, such as {}",
                other.bytes(),
                other.name()
            );
        }
    }
    let available = rest / sample_type.bytes() as u64;
    let whole = available > 0 && rest.is_multiple_of(sample_type.bytes() as u64);
    let slice = (*nx as u64).saturating_mul(*ny as u64);
    let side = (available as f64).cbrt().round() as u64;
    if whole && available.is_multiple_of(slice) {
        return format!("the size fits {nx} × {ny} × {}", available / slice);
    }
    if whole && side.checked_pow(3) == Some(available) {
        return format!("the size fits {side} × {side} × {side}");
    }
    let samples = count.saturating_mul(sample_type.bytes() as u64);
    if size > samples {
        return format!("the size fits a header of {} bytes before the samples", size - samples);
    }
    "check the dimensions, the type and the header".into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, input::testing::*, volume::Samples};
    use flate2::{Compression, write::GzEncoder};
    use std::io::Write;

    fn read(source: &Source, layout: &RawLayout) -> Result<Volume> {
        super::read(source, layout, &ReadOptions::default())
    }

    fn layout(dims: [usize; 3], sample_type: SampleType) -> RawLayout {
        RawLayout {
            dims,
            sample_type,
            spacing: DVec3::new(1.0, 2.0, 3.0),
            endian: Endian::Little,
            header: 0,
        }
    }

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    fn hint(error: Error) -> String {
        match error {
            Error::Input { hint, .. } => hint.unwrap_or_default(),
            other => panic!("{other}"),
        }
    }

    #[test]
    fn plain_packed_with_header_and_in_both_orders() {
        let folder = Folder::new();
        let values: Vec<i16> = (0..24).map(|i| i * 1000 - 9000).collect();
        for endian in [Endian::Little, Endian::Big] {
            for header in [0, 5] {
                let mut bytes = vec![0x1f, 0x8b, 0, 0, 0][..header].to_vec();
                for v in &values {
                    bytes.extend(if endian == Endian::Little {
                        v.to_le_bytes()
                    } else {
                        v.to_be_bytes()
                    });
                }
                for content in [gzip(&bytes), bytes] {
                    let path = folder.write("volume.raw", &content);
                    let layout = RawLayout {
                        endian,
                        header: header as u64,
                        ..layout([2, 3, 4], SampleType::I16)
                    };
                    let volume = read_with(&path, |source| read(source, &layout)).unwrap();
                    assert_eq!(volume.samples, Samples::I16(values.clone()));
                    assert_eq!(volume.range, [-9000.0, 14000.0]);
                    assert_eq!(volume.bounds().max, DVec3::new(1.0, 4.0, 9.0));
                }
            }
        }
    }

    #[test]
    fn a_size_that_does_not_fit_gives_a_guess() {
        let folder = Folder::new();
        let path = folder.write("volume.raw", [7; 128]);
        let error =
            |layout: RawLayout| read_with(&path, |source| read(source, &layout)).unwrap_err();
        let message = error(layout([4, 4, 4], SampleType::U8)).to_string();
        assert!(
            message.contains(
                "has 128 bytes after the header, but 4 × 4 × 4 samples of type u8 need 64"
            ),
            "{message}"
        );
        assert!(hint(error(layout([4, 4, 4], SampleType::U8))).contains("2 bytes, such as i16"));
        assert!(hint(error(layout([4, 4, 5], SampleType::U8))).contains("4 × 4 × 8"));
        assert!(hint(error(layout([3, 5, 5], SampleType::I16))).contains("4 × 4 × 4"));
        assert!(hint(error(layout([5, 5, 5], SampleType::U8))).contains("header of 3 bytes"));
        let packed = folder.write("volume.raw.gz", gzip(&[7; 128]));
        let error = read_with(&packed, |source| read(source, &layout([4, 4, 4], SampleType::U8)))
            .unwrap_err();
        assert!(hint(error).contains("2 bytes"));
    }

    #[test]
    fn broken_files_and_layouts_are_errors() {
        let folder = Folder::new();
        let whole = gzip(&(0..64).collect::<Vec<u8>>());
        for (name, content) in [("volume.raw.gz", &whole[..]), ("volume.raw", &[9; 64])] {
            every_cut(&folder, name, content, |source| {
                read(source, &layout([4, 4, 4], SampleType::U8))
            });
        }
        let path = folder.write("bomb.raw.gz", gzip(&vec![0; 1 << 20]));
        let small =
            |layout: RawLayout| read_with(&path, |source| read(source, &layout)).unwrap_err();
        assert!(small(layout([2, 2, 2], SampleType::U8)).to_string().contains("too many bytes"));
        assert!(matches!(small(layout([1 << 40, 1, 1], SampleType::U8)), Error::Limit { .. }));
        assert!(matches!(
            small(layout([1 << 31, 1 << 31, 1], SampleType::F64)),
            Error::Limit { .. }
        ));
        assert!(matches!(
            small(RawLayout { header: u64::MAX, ..layout([2; 3], SampleType::U8) }),
            Error::Limit { .. }
        ));
        assert!(matches!(small(layout([2, 0, 2], SampleType::U8)), Error::Argument(_)));
        let path = folder.write("nan.raw", [0, 0, 192, 127, 0, 0, 128, 63]);
        let load = |missing| {
            let options = ReadOptions { missing, ..ReadOptions::default() };
            let layout = layout([2, 1, 1], SampleType::F32);
            read_with(&path, |source| super::read(source, &layout, &options))
        };
        let volume = load(None).unwrap();
        assert_eq!((volume.samples, volume.about.holes), (Samples::F32(vec![1.0; 2]), 1));
        let message = load(Some(1.0)).unwrap_err().to_string();
        assert!(message.contains("samples: none of the 2 samples has a value"), "{message}");
    }

    #[test]
    fn volumes_are_known_by_name_then_layout_then_content() {
        let folder = Folder::new();
        let nrrd = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 1 1\nencoding: raw\n\n\x01\x02";
        let layout = layout([nrrd.len(), 1, 1], SampleType::U8);
        let load = |name: &str, raw| {
            crate::formats::load_volume(
                folder.write(name, nrrd),
                &crate::input::Limits::default(),
                &ReadOptions::raw(raw),
            )
        };
        assert_eq!(load("a.nrrd", Some(&layout)).unwrap().len(), 2);
        assert_eq!(load("a.data", Some(&layout)).unwrap().len(), nrrd.len());
        assert_eq!(load("a.data", None).unwrap().len(), 2);
        assert!(load("a.VTI", None).is_err());
        let path = folder.write("b.raw", [1, 2, 3]);
        assert!(
            hint(
                crate::formats::load_volume(
                    &path,
                    &crate::input::Limits::default(),
                    &ReadOptions::default()
                )
                .unwrap_err()
            )
            .contains("dimensions")
        );
    }
}

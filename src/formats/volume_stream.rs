//! Reads a volume slice by slice, for callers that cannot hold all of it.

use super::{
    FORMATS, RawLayout, SampleType,
    format::{InPieces, find_volume},
    shared::{holes, plain::Plain},
};
use crate::{
    Error, Result,
    about::Frame,
    input::{Limits, Mapping, Source, intact},
    progress::{Watch, tell},
    volume::{Lattice, Samples, Scalar},
};
use glam::DVec3;
use std::{ops::Range, path::Path, sync::OnceLock};

/// A volume whose samples are stored uncompressed: a raw file, or an NRRD file with raw encoding.
/// It yields the same data as [`load_volume`](super::load_volume). It regularly returns the pages
/// of the file that were read to the system.
pub struct VolumeStream {
    plain: Plain,
    scalar: Scalar,
    map: Mapping,
    missing: Option<f64>,
    /// The number of samples without a value, and the value that they are read as. Known once all
    /// samples were looked at.
    holes: OnceLock<(u64, f64)>,
}

/// Slices that are read together.
const PIECE: usize = 8;

impl VolumeStream {
    /// Opens a file and reads its header, or checks its size if `raw` gives its layout. Returns
    /// `None` for a file that can only be read as a whole:
    /// - other formats and compressed samples,
    /// - types whose decoded type depends on their values (u32, u64, i64),
    /// - files in which [`load_volume`](super::load_volume) will find an error.
    ///
    /// # Errors
    /// Those of opening the file, [`Error::Input`] for a malformed header and for a format that
    /// this build leaves out, and [`Error::Limit`] for sizes over the limits.
    pub fn open(
        path: impl AsRef<Path>,
        limits: &Limits,
        raw: Option<&RawLayout>,
    ) -> Result<Option<Self>> {
        let path = path.as_ref();
        let source = Source::open_any(path, limits)?;
        let format = find_volume(FORMATS, &source, raw.is_some())?;
        let plain = match (format.map(|format| format.pieces), raw) {
            (Some(InPieces::Volume { find, .. }), _) => find(&source)?,
            (Some(InPieces::Described { find, .. }), Some(layout)) => find(&source, layout)?,
            _ => None,
        };
        let Some(plain) = plain else { return Ok(None) };
        let scalar = match plain.sample_type {
            SampleType::U8 => Scalar::U8,
            SampleType::U16 => Scalar::U16,
            SampleType::I8 | SampleType::I16 => Scalar::I16,
            SampleType::I32 => Scalar::I32,
            SampleType::F32 | SampleType::F64 => Scalar::F32,
            SampleType::U32 | SampleType::U64 | SampleType::I64 => return Ok(None),
        };
        source.intact()?;
        let file = if plain.path == path { source } else { source.open_beside(&plain.path)? };
        let Some(map) = file.into_mapping() else { return Ok(None) };
        let bytes = plain
            .sample_type
            .bytes_of(plain.lattice.dims)
            .and_then(|bytes| bytes.checked_add(plain.start as u64));
        let is_whole = bytes.is_some_and(|bytes| bytes <= map.len() as u64) && !map.is_empty();
        let (missing, holes) = (None, OnceLock::new());
        Ok(is_whole.then_some(Self { plain, scalar, map, missing, holes }))
    }

    /// Takes samples of a value as holes, too ([`ReadOptions::missing`](super::ReadOptions)).
    #[must_use]
    pub fn with_missing(mut self, missing: Option<f64>) -> Self {
        self.missing = missing;
        self
    }

    /// Returns the number of samples without a value, once [`range`](Self::range) has counted them.
    pub fn holes(&self) -> u64 {
        self.holes.get().map_or(0, |(count, _)| *count)
    }

    /// Replaces the distances between samples along the axes ([`ReadOptions::spacing`]).
    ///
    /// # Errors
    /// [`Error::Input`] for distances that are not positive and finite.
    ///
    /// [`ReadOptions::spacing`]: super::ReadOptions::spacing
    pub fn with_spacing(mut self, spacing: DVec3) -> Result<Self> {
        let lattice = self.plain.lattice.with_steps_of(spacing);
        self.plain.lattice =
            lattice.map_err(|message| Error::input(&self.plain.path, "spacing", message))?;
        Ok(self)
    }

    /// Returns the file that contains the samples. For a detached header, this is not the header's
    /// file.
    pub fn path(&self) -> &Path {
        &self.plain.path
    }

    /// Returns what the axes of the world mean.
    pub fn frame(&self) -> Frame {
        self.plain.frame
    }

    /// Returns the lattice that the samples lie on.
    pub fn lattice(&self) -> &Lattice {
        &self.plain.lattice
    }

    /// Returns the type of the samples that [`slices`](Self::slices) returns.
    pub fn scalar(&self) -> Scalar {
        self.scalar
    }

    /// Returns the samples of a range of slices across the last axis. Once [`range`](Self::range)
    /// has looked at all samples, those without a value are read as the lowest value.
    ///
    /// # Errors
    /// [`Error::Input`] if the file has changed since it was opened.
    ///
    /// # Panics
    /// If the range exceeds the volume's slices.
    pub fn slices(&self, z: Range<usize>) -> Result<Samples> {
        let Plain { start, sample_type, endian, ref lattice, .. } = self.plain;
        let slice = lattice.dims[0] * lattice.dims[1] * sample_type.bytes();
        let mut samples = sample_type
            .decode(self.map[start + z.start * slice..start + z.end * slice].into(), endian);
        self.map.release();
        if let Some(&(count, lowest)) = self.holes.get()
            && count > 0
        {
            holes::fill_with(&mut samples, self.missing, lowest);
        }
        intact(&self.map, &self.plain.path).map(|()| samples)
    }

    /// Returns the minimum and maximum of all samples, in one pass over the file. Calls `watch`
    /// with the number of slices visited so far and their total.
    ///
    /// # Errors
    /// [`Error::Input`] if no sample has a value.
    pub fn range(&self, watch: Watch<'_>) -> Result<[f64; 2]> {
        let count = self.plain.lattice.dims[2];
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        let mut holes = 0;
        for first in (0..count).step_by(PIECE) {
            tell(watch, first as u64, count as u64);
            let z = first..(first + PIECE).min(count);
            let (count, extremes) = holes::measure(&self.slices(z)?, self.missing);
            holes += count;
            if let Some([low, high]) = extremes {
                range = [range[0].min(low), range[1].max(high)];
            }
        }
        if range[0] > range[1] {
            let message = holes::all_missing(self.plain.lattice.len(), self.missing);
            return Err(Error::input(&self.plain.path, "samples", message));
        }
        self.holes.get_or_init(|| (holes, range[0]));
        Ok(range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::Endian;
    use crate::{
        formats::{ReadOptions, load_volume},
        input::testing::Folder,
    };
    use glam::DVec3;

    /// Numbers that every type can represent, as bytes.
    fn bytes(sample_type: SampleType, endian: Endian) -> Vec<u8> {
        let text: Vec<String> = (0..3 * 4 * 19).map(|i| (i / 2).to_string()).collect();
        let little = sample_type.parse(&text.join(" "), text.len()).unwrap();
        match endian {
            Endian::Little => little,
            Endian::Big => {
                little.chunks(sample_type.bytes()).flat_map(|n| n.iter().rev().copied()).collect()
            }
        }
    }

    fn compare(path: &Path, layout: Option<&RawLayout>) {
        let limits = Limits::default();
        let whole = load_volume(path, &limits, &ReadOptions::raw(layout)).unwrap();
        let stream = VolumeStream::open(path, &limits, layout).unwrap().unwrap();
        assert_eq!((stream.lattice(), stream.scalar()), (&whole.lattice, whole.samples.scalar()));
        assert_eq!(stream.range(None).unwrap(), whole.range);
        let slice = whole.lattice.dims[0] * whole.lattice.dims[1] * whole.samples.sample_bytes();
        assert_eq!(
            stream.slices(3..7).unwrap().bytes(),
            &whole.samples.bytes()[3 * slice..7 * slice]
        );
        assert_eq!(stream.slices(0..19).unwrap(), whole.samples);
    }

    #[test]
    fn slices_are_those_of_the_whole() {
        let folder = Folder::new();
        for sample_type in ["u8", "i8", "u16", "i16", "i32", "f32", "f64"]
            .map(|name| SampleType::from_name(name).unwrap())
        {
            for endian in [Endian::Little, Endian::Big] {
                let samples = bytes(sample_type, endian);
                let layout = RawLayout {
                    dims: [3, 4, 19],
                    sample_type,
                    spacing: DVec3::ONE,
                    endian,
                    header: 7,
                };
                let path = folder.write("a.raw", [&[0; 7], &samples[..]].concat());
                compare(&path, Some(&layout));
                let order = if endian == Endian::Big { "big" } else { "little" };
                let name = match sample_type.name() {
                    "f32" => "float".into(),
                    "f64" => "double".into(),
                    name => name.replace('u', "uint").replacen(
                        'i',
                        "int",
                        usize::from(name.starts_with('i')),
                    ),
                };
                let fields = format!(
                    "type: {name}\ndimension: 3\nsizes: 3 4 19\nendian: {order}\nencoding: raw"
                );
                let path = folder.write(
                    "a.nrrd",
                    [format!("NRRD0004\n{fields}\n\n").as_bytes(), &samples].concat(),
                );
                compare(&path, None);
                folder.write("b.bin", &samples);
                compare(
                    &folder.write("b.nhdr", format!("NRRD0004\n{fields}\ndata file: b.bin\n")),
                    None,
                );
            }
        }
    }

    #[test]
    fn what_is_packed_or_wrong_is_told_and_holes_are_filled() {
        let folder = Folder::new();
        let limits = Limits::default();
        let layout = |sample_type| RawLayout {
            dims: [2, 1, 2],
            sample_type,
            spacing: DVec3::ONE,
            endian: Endian::Little,
            header: 0,
        };
        let path = folder.write("a.raw", [0; 16]);
        for (sample_type, is_plain) in
            [(SampleType::F32, true), (SampleType::U32, false), (SampleType::U8, false)]
        {
            let stream = VolumeStream::open(&path, &limits, Some(&layout(sample_type))).unwrap();
            assert_eq!(stream.is_some(), is_plain, "{sample_type:?}");
        }
        for encoding in ["gzip", "raw\nbyte skip: 1", "raw\nline skip: 1", "ascii"] {
            let text = format!(
                "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: {encoding}\n\n 1"
            );
            let path = folder.write("a.nrrd", text);
            assert!(VolumeStream::open(&path, &limits, None).unwrap().is_none(), "{encoding}");
        }
        let cut = folder.write(
            "a.nrrd",
            "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\n12",
        );
        assert!(VolumeStream::open(&cut, &limits, None).unwrap().is_none());
        let path = folder.write("a.raw", [1f32, 2.0, f32::NAN, 3.0].map(f32::to_le_bytes).concat());
        let open = |missing| {
            let stream = VolumeStream::open(&path, &limits, Some(&layout(SampleType::F32)));
            stream.unwrap().unwrap().with_missing(missing)
        };
        let stream = open(Some(1.0));
        assert_eq!((stream.range(None).unwrap(), stream.holes()), ([2.0, 3.0], 2));
        assert_eq!(stream.slices(0..2).unwrap(), Samples::F32(vec![2.0, 2.0, 2.0, 3.0]));
        folder.write("a.raw", [f32::NAN; 4].map(f32::to_le_bytes).concat());
        let message = open(None).range(None).unwrap_err().to_string();
        assert!(message.contains("a.raw: samples: none of the 4 samples has"), "{message}");
    }
}

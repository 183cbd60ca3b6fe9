//! The headers of NIfTI files, of both versions and in both byte orders, and of their predecessor
//! Analyze 7.5.

use crate::{Result, formats::Endian, input::Source};

/// Bytes of the headers of version 1 (and Analyze 7.5) and of version 2.
const SIZES: [usize; 2] = [348, 540];

/// Bytes that hold any header.
pub const LONGEST: usize = SIZES[1];

/// What a header says.
#[derive(Debug, Clone)]
pub struct Header {
    pub endian: Endian,
    /// 1 or 2.
    pub version: u8,
    /// Whether the samples are in a file of their own.
    pub is_pair: bool,
    /// The counts along x, y, z, time, components and two further axes; 1 where there is none.
    pub dims: [u64; 7],
    /// The number of axes that the file has.
    pub axes: usize,
    /// The code of the samples' type.
    pub datatype: i64,
    /// What the values are: 1007 for vectors.
    pub intent: i64,
    /// The handedness of the rotation, then the steps along the axes.
    pub steps: [f64; 8],
    /// Where the samples begin in their file.
    pub start: f64,
    pub slope: f64,
    pub intercept: f64,
    /// The lowest and the highest value to show.
    pub window: [f64; 2],
    /// The codes of the units of lengths and of times.
    pub units: i64,
    /// Whether the rotation (“qform”) places the samples.
    pub has_rotation: bool,
    /// Whether the matrix (“sform”) places the samples.
    pub has_matrix: bool,
    /// The last three numbers of the rotation's quaternion.
    pub quaternion: [f64; 3],
    /// The position of the first sample, for the rotation.
    pub offset: [f64; 3],
    /// Three rows of the matrix.
    pub matrix: [[f64; 4]; 3],
    pub name: String,
    /// What wrote the file says of it.
    pub description: String,
}

/// Returns the version of the header that bytes begin with, as an index of `SIZES`, and its byte
/// order.
fn version(bytes: &[u8]) -> Option<(usize, Endian)> {
    let size: [u8; 4] = *bytes.first_chunk()?;
    let of = |size: u32| SIZES.iter().position(|&known| known as u32 == size);
    of(u32::from_le_bytes(size))
        .map(|version| (version, Endian::Little))
        .or_else(|| of(u32::from_be_bytes(size)).map(|version| (version, Endian::Big)))
}

/// Returns whether bytes begin with a header of NIfTI.
pub fn is_header(bytes: &[u8]) -> bool {
    match version(bytes) {
        Some((0, _)) => matches!(bytes.get(344..348), Some(b"n+1\0" | b"ni1\0")),
        Some((_, _)) => matches!(bytes.get(4..8), Some(b"n+2\0" | b"ni2\0")),
        None => false,
    }
}

impl Header {
    /// Reads a header from the first bytes of a file, or from its first unpacked bytes.
    pub fn read(source: &Source, bytes: &[u8]) -> Result<Self> {
        let Some((version, endian)) = version(bytes) else {
            return Err(foreign(source, bytes));
        };
        if bytes.len() < SIZES[version] {
            let message =
                format!("has {} bytes where {} were expected", bytes.len(), SIZES[version]);
            return Err(source.error("header", message));
        }
        let fields = Fields { bytes, endian };
        let header = if version == 0 { fields.first() } else { fields.second() };
        if version == 1 && !is_header(bytes) {
            let message = "begins as a header of NIfTI-2, but has no “n+2” or “ni2” at byte 4";
            return Err(source.error("header", message));
        }
        header.checked(source)
    }

    /// Checks the counts along the axes. Axes beyond those that the file has count one sample.
    fn checked(mut self, source: &Source) -> Result<Self> {
        let axes = self.axes;
        if !(1..=7).contains(&axes) {
            let message = format!("the number of axes is {}, but 1 to 7 are possible", axes as i64);
            return Err(source.error("header, dim[0]", message));
        }
        self.dims[axes..].fill(1);
        if let Some(axis) = self.dims.iter().position(|&n| n == 0 || n > i64::MAX as u64) {
            let count = self.dims[axis] as i64;
            let message = format!("counts {count} samples, but at least 1 is needed");
            return Err(source.error(format!("header, dim[{}]", axis + 1), message));
        }
        Ok(self)
    }
}

/// Returns the error for a file that does not begin with a header.
fn foreign(source: &Source, bytes: &[u8]) -> crate::Error {
    let error = |message| source.error("header", message);
    if bytes.len() < SIZES[0] {
        let message =
            format!("has {} bytes where at least {} were expected", bytes.len(), SIZES[0]);
        return error(message);
    }
    if bytes.trim_ascii_start().starts_with(b"ENVI") {
        return error("is a header of ENVI, not of NIfTI or Analyze".into()).hint(
            "its samples are raw: name the data file with --dims, --type and --header as the \
             header says",
        );
    }
    let size = u32::from_le_bytes(*bytes.first_chunk().unwrap_or(&[0; 4]));
    error(format!("begins with {size} where the header's size, 348 or 540, was expected"))
        .hint("the file is not NIfTI or Analyze; if its samples are raw, give --dims and --type")
}

/// The bytes of a header. They reach to its end.
struct Fields<'a> {
    bytes: &'a [u8],
    endian: Endian,
}

impl Fields<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut bytes = [0; N];
        bytes.copy_from_slice(&self.bytes[at..at + N]);
        if self.endian == Endian::Big {
            bytes.reverse();
        }
        bytes
    }

    fn short(&self, at: usize) -> i64 {
        i16::from_le_bytes(self.bytes(at)).into()
    }

    fn int(&self, at: usize) -> i64 {
        i32::from_le_bytes(self.bytes(at)).into()
    }

    fn long(&self, at: usize) -> i64 {
        i64::from_le_bytes(self.bytes(at))
    }

    fn float(&self, at: usize) -> f64 {
        f32::from_le_bytes(self.bytes(at)).into()
    }

    fn double(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.bytes(at))
    }

    /// Returns a text that a zero may end.
    fn text(&self, at: usize, most: usize) -> String {
        let bytes = self.bytes[at..at + most].split(|&byte| byte == 0).next();
        crate::input::copy::lossy(bytes.unwrap_or_default()).trim().to_owned()
    }

    fn first(&self) -> Header {
        let floats = |at: usize| move |i: usize| self.float(at + 4 * i);
        let is_analyze = !matches!(&self.bytes[344..347], b"n+1" | b"ni1");
        // In Analyze files, these places hold other fields.
        let of_nifti = |code: i64| !is_analyze && code > 0;
        Header {
            endian: self.endian,
            version: 1,
            is_pair: is_analyze || &self.bytes[344..347] == b"ni1",
            dims: std::array::from_fn(|i| self.short(42 + 2 * i) as u64),
            axes: self.short(40) as usize,
            datatype: self.short(70),
            intent: self.short(68),
            steps: std::array::from_fn(floats(76)),
            start: self.float(108),
            slope: if is_analyze { 0.0 } else { self.float(112) },
            intercept: if is_analyze { 0.0 } else { self.float(116) },
            window: if is_analyze { [0.0; 2] } else { [self.float(128), self.float(124)] },
            units: if is_analyze { 0 } else { self.bytes[123].into() },
            has_rotation: of_nifti(self.short(252)),
            has_matrix: of_nifti(self.short(254)),
            quaternion: std::array::from_fn(floats(256)),
            offset: std::array::from_fn(floats(268)),
            matrix: std::array::from_fn(|row| std::array::from_fn(floats(280 + 16 * row))),
            name: if is_analyze { String::new() } else { self.text(328, 16) },
            description: self.text(148, 80),
        }
    }

    fn second(&self) -> Header {
        let doubles = |at: usize| move |i: usize| self.double(at + 8 * i);
        Header {
            endian: self.endian,
            version: 2,
            is_pair: &self.bytes[4..7] == b"ni2",
            dims: std::array::from_fn(|i| self.long(24 + 8 * i) as u64),
            axes: self.long(16) as usize,
            datatype: self.short(12),
            intent: self.int(504),
            steps: std::array::from_fn(doubles(104)),
            start: self.long(168) as f64,
            slope: self.double(176),
            intercept: self.double(184),
            window: [self.double(200), self.double(192)],
            units: self.int(500),
            has_rotation: self.int(344) > 0,
            has_matrix: self.int(348) > 0,
            quaternion: std::array::from_fn(doubles(352)),
            offset: std::array::from_fn(doubles(376)),
            matrix: std::array::from_fn(|row| std::array::from_fn(doubles(400 + 32 * row))),
            name: self.text(508, 16),
            description: self.text(240, 80),
        }
    }
}

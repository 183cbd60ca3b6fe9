//! The header: the properties of the volume as a whole.

use super::{MAGIC, VERSION};
use crate::{
    about::Frame,
    bricks::{Header, REACH, SIDE, level},
    container::{Cursor, Put},
    input::copy,
    volume::{Lattice, Scalar},
};
use glam::DMat3;

/// Bytes before the texts.
const FIXED: usize = 192;

/// A header as stored in the file, with what the reader needs to find the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    pub header: Header,
    /// Bytes of the whole file.
    pub file_bytes: u64,
}

/// Why a header is refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// The data ends before the header does.
    Incomplete,
    /// Another kind of file.
    Foreign,
    /// Another version of this kind.
    Version(u32),
    Damaged(String),
}

impl Stored {
    /// Bytes of the header, including its checksum.
    pub fn length(&self) -> usize {
        FIXED + self.header.unit.len() + self.header.source.len() + 4
    }

    pub fn encode(&self) -> Vec<u8> {
        let Header { lattice, scalar, range, frame, unit, source } = &self.header;
        let mut out = Vec::with_capacity(self.length());
        out.put(&MAGIC);
        out.u32(VERSION);
        out.u32(Scalar::ALL.iter().position(|known| known == scalar).unwrap_or_default() as u32);
        out.u64(self.file_bytes);
        lattice.dims.iter().for_each(|&n| out.u64(n as u64));
        out.dvec3(lattice.origin);
        [lattice.axes.x_axis, lattice.axes.y_axis, lattice.axes.z_axis]
            .into_iter()
            .for_each(|axis| out.dvec3(axis));
        range.iter().for_each(|value| out.put(&value.to_le_bytes()));
        out.u32(level::levels(lattice.dims).len() as u32);
        out.u32(SIDE as u32);
        out.u32(REACH as u32);
        out.u32(unit.len() as u32);
        out.u32(source.len() as u32);
        out.u32(u32::from(*frame == Frame::Patient));
        out.put(&[0; FIXED - 184]);
        debug_assert_eq!(out.len(), FIXED);
        out.put(unit.as_bytes());
        out.put(source.as_bytes());
        out.u32(crc32fast::hash(&out));
        out
    }

    /// Reads the header at the beginning of a file.
    pub fn decode(bytes: &[u8]) -> Result<Self, Refusal> {
        if bytes.len() < MAGIC.len() {
            return Err(if MAGIC.starts_with(bytes) {
                Refusal::Incomplete
            } else {
                Refusal::Foreign
            });
        }
        let mut cursor = Cursor::new(bytes);
        if cursor.array() != Some(MAGIC) {
            return Err(Refusal::Foreign);
        }
        let version = cursor.u32().ok_or(Refusal::Incomplete)?;
        if version != VERSION {
            return Err(Refusal::Version(version));
        }
        // The lengths of the texts determine where the checksum is, and the checksum then confirms
        // the lengths.
        let mut lengths = Cursor::new(bytes.get(172..FIXED).ok_or(Refusal::Incomplete)?);
        let [unit, source] =
            [lengths.u32(), lengths.u32()].map(|length| length.unwrap_or_default() as usize);
        let end = FIXED + unit + source;
        let text = bytes.get(..end).ok_or(Refusal::Incomplete)?;
        if Cursor::new(&bytes[end..]).u32().ok_or(Refusal::Incomplete)? != crc32fast::hash(text) {
            return Err(Refusal::Damaged("its checksum does not match".into()));
        }
        Self::fields(cursor, &text[FIXED..], unit)
            .ok_or(Refusal::Incomplete)?
            .map_err(Refusal::Damaged)
    }

    fn fields(mut cursor: Cursor, texts: &[u8], unit: usize) -> Option<Result<Self, String>> {
        let scalar = cursor.u32()?;
        let file_bytes = cursor.u64()?;
        let dims = [cursor.u64()?, cursor.u64()?, cursor.u64()?];
        let origin = cursor.dvec3()?;
        let axes = DMat3::from_cols(cursor.dvec3()?, cursor.dvec3()?, cursor.dvec3()?);
        let range =
            [cursor.array().map(f64::from_le_bytes)?, cursor.array().map(f64::from_le_bytes)?];
        let [levels, side, reach] = [cursor.u32()?, cursor.u32()?, cursor.u32()?];
        let [_, _, frame] = [cursor.u32()?, cursor.u32()?, cursor.u32()?];
        let sound = || {
            let wrong = |what: &str| format!("its {what} is not valid");
            let scalar =
                *Scalar::ALL.get(scalar as usize).ok_or_else(|| wrong("type of samples"))?;
            let [Ok(nx), Ok(ny), Ok(nz)] = dims.map(usize::try_from) else {
                return Err(wrong("size"));
            };
            let lattice = Lattice::cartesian([nx, ny, nz], origin, axes);
            let text = |bytes| copy::text(bytes).map_err(|_| "its texts are not UTF-8");
            let (unit, source) = (text(&texts[..unit])?, text(&texts[unit..])?);
            let frame = match frame {
                0 => Frame::Own,
                1 => Frame::Patient,
                _ => return Err(wrong("frame")),
            };
            let header = Header { lattice, scalar, range, frame, unit, source };
            header.validate()?;
            if [levels, side, reach].map(|n| n as usize)
                != [level::levels(header.lattice.dims).len(), SIDE, REACH]
            {
                return Err(wrong("number of levels, or the size of its bricks,"));
            }
            Ok(Self { header, file_bytes })
        };
        Some(sound())
    }
}

//! A file of DICOM: its header, and the bytes of its data set (PS3.10).

use super::{
    element::{Coding, Set},
    syntax::{Packing, Syntax, guess, syntax},
    tags,
};
use crate::{Result, input::Source};
use flate2::read::DeflateDecoder;
use std::{borrow::Cow, io::Read};

/// Bytes before the mark “DICM”.
const PREAMBLE: usize = 128;

/// Bytes that are unpacked between two checks of the limits.
const PORTION: u64 = 1 << 20;

/// The identifier of files that list others.
const DIRECTORY: &str = "1.2.840.10008.1.3.10";

/// An opened file: the bytes of its data set, and how they are encoded.
pub struct File<'a> {
    pub source: &'a Source<'a>,
    bytes: Cow<'a, [u8]>,
    pub syntax: Syntax,
    pub identifier: String,
    pub is_directory: bool,
}

/// Returns whether the first bytes of a file are those of DICOM.
pub fn is_dicom(bytes: &[u8]) -> bool {
    has_mark(bytes) || is_bare(bytes)
}

fn has_mark(bytes: &[u8]) -> bool {
    bytes.get(PREAMBLE..PREAMBLE + 4) == Some(b"DICM")
}

/// Returns whether bytes begin with an element of the groups that files without a mark begin with.
fn is_bare(bytes: &[u8]) -> bool {
    let Some(&[a, b, c, d, k, l, m, n]) = bytes.first_chunk() else { return false };
    let is_group = |low: u8, high: u8| high == 0 && (low == 2 || low == 8);
    let (number, length) =
        if is_group(a, b) { ([c, d], [k, l, m, n]) } else { ([d, c], [n, m, l, k]) };
    if !(is_group(a, b) || is_group(b, a)) || number[1] != 0 {
        return false;
    }
    let kinds = [b"UL", b"CS", b"UI", b"SH", b"LO", b"DA", b"TM", b"OB", b"SQ", b"IS"];
    let is_typed = kinds.contains(&&[k, l]);
    // Without a type: the first elements of a data set are a group length, a character set, a type
    // of image or an identifier.
    let is_first = matches!(number[0], 0 | 1 | 5 | 8 | 0x12 | 0x16 | 0x18);
    let length = u32::from_le_bytes(length);
    is_typed || is_first && is_group(a, b) && length.is_multiple_of(2) && (2..=64).contains(&length)
}

impl<'a> File<'a> {
    /// Finds the data set of a file.
    pub fn open(source: &'a Source<'a>) -> Result<Self> {
        let bytes = source.bytes();
        if !is_dicom(bytes) {
            let message = "is not DICOM: it has no “DICM” at byte 128, and does not begin with an \
                           element of group 0008";
            return Err(source.error("header", message));
        }
        let start = if has_mark(bytes) { PREAMBLE + 4 } else { 0 };
        let header = &bytes[start..];
        // The groups of the header are always encoded in the same way.
        let end = header_end(source, header)?;
        let meta = Set::read(source, &header[..end], Coding::PLAIN, |_| false)?;
        let rest = &header[end..];
        let identifier = meta.text(tags::TRANSFER_SYNTAX).unwrap_or_default();
        let mut syntax = if identifier.is_empty() { guess(rest) } else { syntax(&identifier) };
        // Some files with packed pixels have no types, whatever their syntax says.
        if syntax.coding == Coding::PLAIN && !syntax.is_deflated && !guess(rest).coding.is_explicit
        {
            syntax.coding = Coding::IMPLICIT;
        }
        let class = meta.text(tags::MEDIA_CLASS);
        let bytes = if syntax.is_deflated { inflated(source, rest)?.into() } else { rest.into() };
        let is_directory = class.as_deref() == Some(DIRECTORY);
        Ok(Self { source, bytes, syntax, identifier, is_directory })
    }

    /// Reads the elements of the data set, up to its pixels.
    pub fn set(&'a self) -> Result<Set<'a>> {
        Set::read(self.source, &self.bytes, self.syntax.coding, |tag| {
            matches!(tag, tags::PIXEL_DATA | tags::FLOAT_PIXELS | tags::DOUBLE_PIXELS)
        })
    }

    /// Returns the error for a packing of pixels that is not read.
    pub fn packing(&self) -> Result<Packing> {
        let Packing::Other(name) = self.syntax.packing else { return Ok(self.syntax.packing) };
        let message = format!(
            "the pixels are packed by {name} (transfer syntax {}), which is not read",
            super::excerpt(&self.identifier)
        );
        let hint = match name {
            "JPEG XL" | "an unknown method" => {
                "convert the files to an uncompressed transfer syntax; RLE, JPEG, JPEG-LS and \
                 JPEG 2000 are read too"
            }
            "JPIP references" => "the pixels are on a server; ask it for the files with pixels",
            _ => "it is a video; extract its frames, for example with ffmpeg",
        };
        Err(self.source.error("pixel data", message).hint(hint))
    }
}

/// Returns where the header's elements end, those of group 0002.
fn header_end(source: &Source, bytes: &[u8]) -> Result<usize> {
    let mut at = 0;
    while bytes.get(at..at + 2) == Some(&[2, 0]) {
        let kind = bytes.get(at + 4..at + 6).unwrap_or_default();
        let length = match kind {
            b"OB" | b"UN" | b"OW" | b"UT" => {
                let long = bytes.get(at + 8..at + 12).and_then(|rest| rest.first_chunk());
                long.map(|&long| u32::from_le_bytes(long) as usize + 12)
            }
            _ => {
                let short = bytes.get(at + 6..at + 8).and_then(|rest| rest.first_chunk());
                short.map(|&short| usize::from(u16::from_le_bytes(short)) + 8)
            }
        };
        let next = length.and_then(|length| at.checked_add(length));
        at = next.filter(|&next| next <= bytes.len()).ok_or_else(|| {
            source.error("header", format!("is cut off in the element at byte {at}"))
        })?;
    }
    Ok(at)
}

/// Unpacks a data set of unknown size, within the limits.
fn inflated(source: &Source, bytes: &[u8]) -> Result<Vec<u8>> {
    let mut stream = DeflateDecoder::new(bytes);
    let mut out = Vec::new();
    loop {
        source.check_time()?;
        let before = out.len();
        let read = stream.by_ref().take(PORTION).read_to_end(&mut out);
        read.map_err(|e| {
            let message = format!("cannot be unpacked after {} bytes: {e}", out.len());
            source.error("deflated data set", message)
        })?;
        source.spend("the size of the unpacked data set in bytes", (out.len() - before) as u64)?;
        if out.len() == before {
            return Ok(out);
        }
    }
}

//! The bytes of an array in a VTK XML file: base64, a leading count, and blocks compressed by zlib,
//! LZ4 or LZMA.

use super::super::Endian;
use crate::{
    Result,
    input::{Source, isolate::isolated},
    parallel::prelude::*,
};
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::read::ZlibDecoder;
use lzma_rust2::XzReader;
use std::{borrow::Cow, io::Read};

/// Bytes that are unpacked between two checks of the time limit.
const PORTION: usize = 16 << 20;

/// Most memory of the decoder of LZMA, in KiB: that of VTK's highest level.
const MOST_LZMA: u32 = 128 << 10;

/// How the arrays of a file are encoded.
#[derive(Debug, Clone, Copy)]
pub struct ArrayEncoding {
    pub endian: Endian,
    /// Counts have 8 bytes instead of 4.
    pub wide_counts: bool,
    /// Arrays are split into blocks, each compressed by this; `None` if they are not.
    pub packed: Option<Packing>,
}

/// What compresses the blocks of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    /// zlib streams.
    Zlib,
    /// LZ4 blocks without a frame.
    Lz4,
    /// LZMA2 in xz streams.
    Lzma,
}

impl Packing {
    /// Returns the packing with VTK's name.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "vtkZLibDataCompressor" => Self::Zlib,
            "vtkLZ4DataCompressor" => Self::Lz4,
            "vtkLZMADataCompressor" => Self::Lzma,
            _ => return None,
        })
    }

    /// Maximum compression ratio, in bytes per byte; a block that claims more is invalid. LZMA
    /// needs at least 0.3 bits for a match of 273 bytes.
    fn ratio(self) -> u64 {
        match self {
            Self::Zlib => 1032,
            Self::Lz4 => 256,
            Self::Lzma => 1 << 13,
        }
    }

    /// Unpacks a block that must fill `part`. The error is a message.
    fn unpack(self, source: &Source, packed: &[u8], part: &mut [u8]) -> Result<(), String> {
        let stream = |stream: &mut dyn Read, part: &mut [u8]| {
            for part in part.chunks_mut(PORTION) {
                // The caller finds the same error.
                source.check_time().map_err(|error| error.to_string())?;
                stream.read_exact(part).map_err(|e| format!("cannot be unpacked: {e}"))?;
            }
            match stream.read(&mut [0]) {
                Ok(0) => Ok(()),
                Ok(_) => Err(format!("unpacks to more than its {} bytes", part.len())),
                Err(e) => Err(format!("cannot be unpacked: {e}")),
            }
        };
        match self {
            Self::Zlib => stream(&mut ZlibDecoder::new(packed), part),
            Self::Lzma => {
                let most = (source.limits.bytes / 1024).min(MOST_LZMA.into()) as u32;
                stream(&mut XzReader::new_mem_limit(packed, false, most), part)
            }
            Self::Lz4 => match lz4_flex::block::decompress_into(packed, part) {
                Ok(size) if size == part.len() => Ok(()),
                Ok(size) => Err(format!("unpacks to {size} bytes instead of {}", part.len())),
                Err(e) => Err(format!("cannot be unpacked: {e}")),
            },
        }
    }
}

impl ArrayEncoding {
    /// Returns the array of `size` bytes at the start of `bytes`, which begins with its counts.
    /// Bytes after it are ignored. `place` names it in errors.
    pub fn array<'b>(
        &self,
        source: &Source,
        place: &str,
        bytes: Cow<'b, [u8]>,
        size: usize,
    ) -> Result<Cow<'b, [u8]>> {
        if let Some(packing) = self.packed {
            return self.unpack(source, place, &bytes, (packing, size)).map(Cow::Owned);
        }
        let claim = self
            .count(&bytes, 0)
            .ok_or_else(|| source.error(place, "ends before its data begin"))?;
        if claim != size as u64 {
            return Err(
                source.error(place, format!("claims {claim} bytes where {size} were expected"))
            );
        }
        let start = self.count_bytes();
        if bytes.len() - start < size {
            let message =
                format!("there are {} bytes where {size} were expected", bytes.len() - start);
            return Err(source.error(place, message));
        }
        Ok(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[start..start + size]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(start + size);
                bytes.drain(..start);
                Cow::Owned(bytes)
            }
        })
    }

    /// Unpacks an array of blocks. It begins with the number of blocks, the unpacked size of each
    /// but the last, that of the last (0: as the others), and the packed size of each. Then the
    /// blocks follow.
    fn unpack(
        &self,
        source: &Source,
        place: &str,
        bytes: &[u8],
        (packing, size): (Packing, usize),
    ) -> Result<Vec<u8>> {
        let wrong = |message: String| source.error(place, message);
        let cut = || wrong("ends inside the sizes of its blocks".into());
        let head = |i| self.count(bytes, i).ok_or_else(cut);
        let (blocks, block, last) = (head(0)?, head(1)?, head(2)?);
        let whole = if last == 0 { blocks } else { blocks.saturating_sub(1) };
        let claim = whole.checked_mul(block).and_then(|n| n.checked_add(last));
        if claim != Some(size as u64) || last > block {
            return Err(wrong(format!(
                "claims {blocks} blocks of {block} bytes, the last of {last}, where {size} bytes \
                 were expected"
            )));
        }
        let sizes_end =
            blocks.checked_add(3).and_then(|n| n.checked_mul(self.count_bytes() as u64));
        let sizes_end =
            sizes_end.filter(|&end| end <= bytes.len() as u64).ok_or_else(cut)? as usize;
        let mut rest = &bytes[sizes_end..];
        source.room::<&[u8]>("the list of blocks", blocks as usize)?;
        let mut packed = Vec::with_capacity(blocks as usize);
        for i in 0..blocks as usize {
            let length = head(3 + i)?;
            let Some((block, after)) =
                usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length))
            else {
                return Err(wrong(format!(
                    "block {i} claims {length} bytes, but {} are left",
                    rest.len()
                )));
            };
            packed.push(block);
            rest = after;
        }
        let present: u64 = packed.iter().map(|block| block.len() as u64).sum();
        if present.saturating_mul(packing.ratio()) < size as u64 {
            return Err(wrong(format!(
                "claims {size} bytes, more than {present} compressed bytes can hold"
            )));
        }
        source.spend("the unpacked size in bytes", size as u64)?;
        let mut unpacked = vec![0; size];
        // `size` is above 0, so `block` is too. `last` is at most `block`, so there are as many
        // parts as blocks.
        unpacked.par_chunks_mut(block as usize).zip(packed).enumerate().try_for_each(
            |(i, (part, packed))| {
                source.check_time()?;
                isolated(source, place, || {
                    packing.unpack(source, packed, part).map_err(|message| {
                        let wrong = || wrong(format!("block {i} {message}"));
                        source.check_time().err().unwrap_or_else(wrong)
                    })
                })
            },
        )?;
        Ok(unpacked)
    }

    fn count_bytes(&self) -> usize {
        if self.wide_counts { 8 } else { 4 }
    }

    /// Returns the count at an index of a list of counts.
    fn count(&self, bytes: &[u8], index: usize) -> Option<u64> {
        let bytes = bytes.get(index.checked_mul(self.count_bytes())?..)?;
        Some(match (self.wide_counts, self.endian) {
            (false, Endian::Little) => u32::from_le_bytes(*bytes.first_chunk()?).into(),
            (false, Endian::Big) => u32::from_be_bytes(*bytes.first_chunk()?).into(),
            (true, Endian::Little) => u64::from_le_bytes(*bytes.first_chunk()?),
            (true, Endian::Big) => u64::from_be_bytes(*bytes.first_chunk()?),
        })
    }
}

/// Decodes base64 with any white space in it. The counts may be encoded separately from the data
/// after them, so padding may occur inside.
pub fn from_base64(source: &Source, place: &str, text: &[u8]) -> Result<Vec<u8>> {
    source.spend("the size of base64 in bytes", 2 * text.len() as u64)?;
    let clean: Vec<u8> = text.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
    let mut bytes = Vec::with_capacity(clean.len() / 4 * 3);
    let mut rest = &clean[..];
    while !rest.is_empty() {
        let padded = rest.iter().position(|&b| b == b'=');
        let end = padded.map_or(rest.len(), |at| rest.len().min((at / 4 + 1) * 4));
        let (part, after) = rest.split_at(end);
        STANDARD.decode_vec(part, &mut bytes).map_err(|e| {
            source.error(place, format!("is not valid base64 (after {} bytes): {e}", bytes.len()))
        })?;
        rest = after;
    }
    Ok(bytes)
}

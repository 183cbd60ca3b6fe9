//! The bytes of an array in a VTK XML file: base64, a leading count, and blocks compressed by zlib.

use super::Endian;
use crate::{Result, input::Source, parallel::prelude::*};
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::read::ZlibDecoder;
use std::{borrow::Cow, io::Read};

/// How the arrays of a file are encoded.
#[derive(Debug, Clone, Copy)]
pub struct ArrayEncoding {
    pub endian: Endian,
    /// Counts have 8 bytes instead of 4.
    pub wide_counts: bool,
    /// Arrays are split into blocks, each compressed by zlib.
    pub packed: bool,
}

/// Maximum compression ratio of deflate, 1032 bytes per byte; a block that claims more is invalid.
const DEFLATE_RATIO: u64 = 1032;

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
        if self.packed {
            return self.unpack(source, place, &bytes, size).map(Cow::Owned);
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
    fn unpack(&self, source: &Source, place: &str, bytes: &[u8], size: usize) -> Result<Vec<u8>> {
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
        if present.saturating_mul(DEFLATE_RATIO) < size as u64 {
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
                let mut stream = ZlibDecoder::new(packed);
                stream
                    .read_exact(part)
                    .map_err(|e| wrong(format!("block {i} cannot be unpacked: {e}")))?;
                match stream.read(&mut [0]) {
                    Ok(0) => Ok(()),
                    Ok(_) => Err(wrong(format!(
                        "block {i} unpacks to more than its {} bytes",
                        part.len()
                    ))),
                    Err(e) => Err(wrong(format!("block {i} cannot be unpacked: {e}"))),
                }
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

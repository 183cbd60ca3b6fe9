//! How the bytes of a chunk become elements: the codecs of Zarr 3, and what Zarr 2 calls
//! compressors and filters.

use super::{
    blosc,
    unpack::{read_all, unlz4, unzlib, unzstd},
};
use flate2::read::MultiGzDecoder;
use serde_json::Value;

/// A codec of bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Codec {
    Gzip,
    Zlib,
    Zstd,
    Blosc,
    /// With the size in front, as numcodecs writes it.
    Lz4,
    /// A checksum behind the bytes.
    Crc32c,
    /// Bytes of elements in planes, as a filter of numcodecs; the number is an element's bytes.
    Shuffle(usize),
}

/// What was done to the elements of a chunk, in this order: the axes were turned, then bytes were
/// packed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chain {
    /// The axis of the array that each axis of the stored chunk is; empty if they are the same.
    pub order: Vec<usize>,
    pub packing: Vec<Codec>,
}

impl Codec {
    /// Reads a codec of bytes of Zarr 3, or a compressor of Zarr 2. The error is a message.
    pub fn named(name: &str, settings: &Value) -> Result<Self, String> {
        let plain = name.strip_prefix("numcodecs.").unwrap_or(name);
        Ok(match plain {
            "gzip" => Self::Gzip,
            "zlib" => Self::Zlib,
            "zstd" => Self::Zstd,
            "blosc" => Self::Blosc,
            "lz4" => Self::Lz4,
            "crc32c" => Self::Crc32c,
            "shuffle" => {
                let size = settings.get("elementsize").and_then(Value::as_u64).unwrap_or(4);
                Self::Shuffle(usize::try_from(size).unwrap_or(1).clamp(1, 64))
            }
            _ => return Err(unknown(name)),
        })
    }

    /// Returns what was packed: at most `most` bytes.
    fn unpack(self, packed: &[u8], most: usize) -> Result<Vec<u8>, String> {
        match self {
            Self::Gzip => read_all(MultiGzDecoder::new(packed), most),
            Self::Zlib => unzlib(packed, most),
            Self::Zstd => unzstd(packed, most),
            Self::Blosc => blosc::unpack(packed, most),
            Self::Lz4 => {
                let (size, stream) = packed.split_first_chunk().ok_or("is cut off")?;
                let size = u32::from_le_bytes(*size) as usize;
                if size > most {
                    return Err(format!("claims {size} unpacked bytes, where {most} fit"));
                }
                unlz4(stream, size)
            }
            Self::Crc32c => {
                let (bytes, sum) = packed.split_last_chunk().ok_or("is cut off")?;
                let stored = u32::from_le_bytes(*sum);
                if crc32c(bytes) != stored {
                    return Err("does not have the checksum that it was written with".into());
                }
                Ok(bytes.to_vec())
            }
            Self::Shuffle(size) => {
                let count = packed.len() / size;
                let mut out = packed.to_vec();
                for (at, byte) in packed[..count * size].iter().enumerate() {
                    out[at % count * size + at / count] = *byte;
                }
                Ok(out)
            }
        }
    }
}

/// Returns the message for a codec that is not read.
fn unknown(name: &str) -> String {
    let name: String = name.chars().take(40).collect();
    format!(
        "names the codec “{name}”, which is not read; blosc, crc32c, gzip, lz4, zlib and zstd are"
    )
}

impl Chain {
    /// Returns the elements of a chunk of this shape, each of `element` bytes, last axis fastest.
    /// The error is a message.
    pub fn decode(
        &self,
        mut bytes: Vec<u8>,
        shape: &[usize],
        element: usize,
    ) -> Result<Vec<u8>, String> {
        let size = shape.iter().product::<usize>() * element;
        // Packed bytes that are packed again may be more than those of the elements, by a little.
        let most = size + size / 8 + (64 << 10);
        for (at, codec) in self.packing.iter().enumerate().rev() {
            bytes = codec.unpack(&bytes, if at == 0 { size } else { most })?;
        }
        if bytes.len() != size {
            return Err(format!("has {} bytes where {size} were expected", bytes.len()));
        }
        Ok(if self.order.is_empty() { bytes } else { turned(&bytes, shape, &self.order, element) })
    }
}

/// Returns elements with the axes of the array, of a chunk that has them in another order.
fn turned(bytes: &[u8], shape: &[usize], order: &[usize], element: usize) -> Vec<u8> {
    // Elements from one to the next along each axis of the array, in the stored chunk.
    let mut strides = vec![0; shape.len()];
    let mut stride = 1;
    for &axis in order.iter().rev() {
        strides[axis] = stride;
        stride *= shape[axis];
    }
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = vec![0; shape.len()];
    for _ in 0..bytes.len() / element.max(1) {
        let number: usize = at.iter().zip(&strides).map(|(at, stride)| at * stride).sum();
        out.extend_from_slice(&bytes[number * element..][..element]);
        for (place, count) in at.iter_mut().zip(shape).rev() {
            *place += 1;
            if *place < *count {
                break;
            }
            *place = 0;
        }
    }
    out
}

/// The table of the checksum of Castagnoli's polynomial, reversed: for each byte, its remainder.
const REMAINDERS: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut rest = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            rest = if rest & 1 == 1 { rest >> 1 ^ 0x82f6_3b78 } else { rest >> 1 };
            bit += 1;
        }
        table[byte] = rest;
        byte += 1;
    }
    table
};

/// Returns the checksum CRC-32C (RFC 3720).
pub fn crc32c(bytes: &[u8]) -> u32 {
    let step = |sum: u32, byte: &u8| sum >> 8 ^ REMAINDERS[usize::from(sum as u8 ^ byte)];
    !bytes.iter().fold(u32::MAX, step)
}

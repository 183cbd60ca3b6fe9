//! The container of Blosc 1, as numcodecs and c-blosc write it: blocks that are shuffled, by bytes
//! or by bits, and packed by one of several codecs. Follows README_CHUNK_FORMAT of c-blosc.

use super::unpack::{unlz4, unzlib, unzstd};

/// Bytes of the header.
const HEADER: usize = 16;

/// Most streams of a block, and least bytes of one.
const MOST_STREAMS: usize = 16;
const LEAST_STREAM: usize = 128;

/// Flags of the header.
const SHUFFLED: u8 = 1;
const COPIED: u8 = 2;
const BITS_SHUFFLED: u8 = 4;
const WHOLE_BLOCKS: u8 = 16;

/// What the header says.
struct Header {
    flags: u8,
    /// Bytes of an element.
    element: usize,
    /// Bytes of all unpacked elements, and of a block.
    bytes: usize,
    block: usize,
}

impl Header {
    fn of(packed: &[u8], most: usize) -> Result<Self, String> {
        let Some(&[_, _, flags, element, ref sizes @ ..]) = packed.first_chunk::<HEADER>() else {
            return Err(format!("has {} bytes, fewer than the header of Blosc", packed.len()));
        };
        let size = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| sizes[at + byte]));
        let [bytes, block, present] = [0, 4, 8].map(|at| size(at) as usize);
        if bytes > most {
            return Err(format!("claims {bytes} unpacked bytes, where {most} were expected"));
        }
        if present > packed.len() {
            return Err(format!("is cut off: {} of {present} bytes are there", packed.len()));
        }
        if bytes > 0 && block == 0 {
            return Err("claims blocks of 0 bytes".into());
        }
        Ok(Self { flags, element: usize::from(element).max(1), bytes, block })
    }

    /// Returns how many streams a block has.
    fn streams(&self, is_last_part: bool) -> usize {
        let is_split = self.flags & WHOLE_BLOCKS == 0
            && !is_last_part
            && self.element <= MOST_STREAMS
            && self.block / self.element >= LEAST_STREAM;
        if is_split { self.element } else { 1 }
    }
}

/// Unpacks at most `most` bytes. The error is a message.
pub fn unpack(packed: &[u8], most: usize) -> Result<Vec<u8>, String> {
    let header = Header::of(packed, most)?;
    let bytes = header.bytes;
    if header.flags & COPIED != 0 {
        let content = packed.get(HEADER..HEADER + bytes);
        return content.map(<[u8]>::to_vec).ok_or_else(|| "is cut off".into());
    }
    let mut out = Vec::new();
    for number in 0..bytes.div_ceil(header.block.max(1)) {
        let size = header.block.min(bytes - number * header.block);
        let block = block(packed, &header, number, size)?;
        out.extend_from_slice(&unshuffled(block, &header));
    }
    Ok(out)
}

/// Returns a block as it was before it was packed, still shuffled.
fn block(packed: &[u8], header: &Header, number: usize, size: usize) -> Result<Vec<u8>, String> {
    let cut = || format!("is cut off in block {number}");
    let word = |at: usize| {
        let bytes = packed.get(at..)?.first_chunk::<4>()?;
        Some(u32::from_le_bytes(*bytes) as usize)
    };
    let mut at = word(HEADER + 4 * number).ok_or_else(cut)?;
    let streams = header.streams(size < header.block);
    let each = size / streams;
    let mut block = Vec::with_capacity(size);
    for _ in 0..streams {
        let length = word(at).ok_or_else(cut)?;
        let end = (at + 4).checked_add(length).ok_or_else(cut)?;
        let stream = packed.get(at + 4..end).ok_or_else(cut)?;
        let unpacked = match header.flags >> 5 {
            _ if length == each => stream.to_vec(),
            0 => unblosclz(stream, each)?,
            1 => unlz4(stream, each)?,
            2 => return Err("is packed by Snappy within Blosc, which is not read".into()),
            3 => unzlib(stream, each)?,
            4 => unzstd(stream, each)?,
            other => return Err(format!("names the codec {other} of Blosc, which is unknown")),
        };
        if unpacked.len() != each {
            let present = unpacked.len();
            return Err(format!("has {present} bytes in a stream where {each} were expected"));
        }
        block.extend_from_slice(&unpacked);
        at = end;
    }
    Ok(block)
}

fn unshuffled(block: Vec<u8>, header: &Header) -> Vec<u8> {
    let size = header.element;
    if header.flags & SHUFFLED != 0 && size > 1 {
        let count = block.len() / size;
        let mut out = block.clone();
        for (byte, plane) in block[..count * size].chunks_exact(count.max(1)).enumerate() {
            for (element, &value) in plane.iter().enumerate() {
                out[element * size + byte] = value;
            }
        }
        return out;
    }
    // Bits are shuffled among groups of eight elements; what remains is as it was.
    let count = block.len() / size / 8 * 8;
    if header.flags & BITS_SHUFFLED == 0 || count == 0 {
        return block;
    }
    let mut out = block.clone();
    out[..count * size].fill(0);
    for (bit, row) in block[..count * size].chunks_exact(count / 8).enumerate() {
        for (group, &bits) in row.iter().enumerate() {
            for element in 0..8 {
                let value = (bits >> element & 1) << (bit % 8);
                out[(8 * group + element) * size + bit / 8] |= value;
            }
        }
    }
    out
}

/// Farthest distance of a match that has no bytes of its own for it.
const NEAR: usize = 8191;

/// Unpacks a stream of BloscLZ: literals, and matches of what was unpacked before.
fn unblosclz(packed: &[u8], size: usize) -> Result<Vec<u8>, String> {
    let mut bytes = packed.iter().copied().map(usize::from);
    let mut next = || bytes.next().ok_or_else(|| "is cut off".to_owned());
    let mut out: Vec<u8> = Vec::with_capacity(size);
    let mut control = next()? & 31;
    loop {
        if control < 32 {
            for _ in 0..=control {
                out.push(next()? as u8);
            }
        } else {
            let (mut length, mut distance) = ((control >> 5) + 2, (control & 31) << 8);
            if control >> 5 == 7 {
                loop {
                    let more = next()?;
                    length += more;
                    if more < 255 || length > size {
                        break;
                    }
                }
            }
            let low = next()?;
            if low == 255 && distance == 31 << 8 {
                distance = (next()? << 8) + next()? + NEAR;
            } else {
                distance += low;
            }
            let start = out.len().checked_sub(distance + 1);
            let start = start.ok_or("refers to bytes before its beginning")?;
            if out.len() + length > size {
                return Err(format!("unpacks to more than {size} bytes"));
            }
            for at in start..start + length {
                out.push(out[at]);
            }
        }
        if out.len() > size {
            return Err(format!("unpacks to more than {size} bytes"));
        }
        match next() {
            Ok(byte) => control = byte,
            Err(_) => return Ok(out),
        }
    }
}

//! How bytes lie in a page: rows are turned into columns, lzip or gzip packs them, and letters hold
//! them.
//!
//! Browsers have gzip. What lzip packs is a third smaller, and unpacking it needs a small module
//! (tools/web/unpack). The letters are code points below 128, seven bits each: a sixth more than
//! the bytes, where base64 takes a third more. Three letters have a meaning in HTML, and are
//! replaced by others. boot.js takes the bytes out again.

use flate2::{Compression, bufread::GzDecoder, write::GzEncoder};
use lzma_rust2::{LzipOptions, LzipWriter};
use std::{
    borrow::Cow,
    io::{Error, Read, Result, Write},
};

/// The bytes that are turned at once.
const BLOCK: usize = 1 << 18;

/// The bytes of a block that its stride is chosen by, and the widest stride.
const LOOKED_AT: usize = 1 << 14;
const WIDEST: usize = 64;

/// A block is turned only if that saves bits: this many of a byte.
const GAIN: f64 = 0.02;

/// Columns are packed instead of rows if they take less than this share of the bytes.
const TURNED: f64 = 0.99;

/// Most bytes that lzip packs. It packs 2 MB a second on one core, and browsers unpack some 50.
const MOST_LZIP: usize = 1 << 26;

/// Letters that a page may not have: HTML replaces the first and the second, and the third begins
/// a tag.
const UNFIT: [u8; 3] = [0, b'\r', b'<'];

/// Where the letters are that stand for unfit ones.
const AWAY: u32 = 256;

/// Bytes as they lie in a page.
pub struct Packed {
    /// Who unpacks them: `lzip` or `gzip`.
    pub by: &'static str,
    /// How many they are.
    pub count: usize,
    /// The strides of the blocks, if their rows were turned into columns.
    pub strides: String,
    /// What is in the page.
    pub letters: String,
}

impl Packed {
    /// Packs bytes.
    ///
    /// # Errors
    /// Those of the packers.
    pub fn new(bytes: &[u8]) -> Result<Self> {
        let bytes = &*loosened(bytes);
        let strides: Vec<usize> = bytes.chunks(BLOCK).map(stride).collect();
        let columns: Vec<u8> = bytes
            .chunks(BLOCK)
            .zip(&strides)
            .flat_map(|(block, stride)| turned(block, *stride))
            .collect();
        let quickly = |bytes: &[u8]| Ok::<_, Error>(gzipped(bytes, Compression::fast())?.len());
        let is_turned = (quickly(&columns)? as f64) < TURNED * quickly(bytes)? as f64;
        let bytes = if is_turned { &*columns } else { bytes };
        let (by, packed) = match bytes.len() <= MOST_LZIP {
            true => ("lzip", lzip(bytes)?),
            false => ("gzip", gzip(bytes)?),
        };
        let names = strides.iter().map(usize::to_string).collect::<Vec<_>>();
        let strides = if is_turned { names.join(" ") } else { String::new() };
        Ok(Self { by, count: bytes.len(), strides, letters: letters(&packed) })
    }

    /// Returns what lzip has packed already.
    pub fn lzip(packed: &[u8]) -> Self {
        let letters = letters(packed);
        Self { by: "lzip", count: unpacked_bytes(packed), strides: String::new(), letters }
    }

    /// Packs bytes so that browsers unpack them alone.
    ///
    /// # Errors
    /// Those of the packer.
    pub fn gzip(bytes: &[u8]) -> Result<Self> {
        let letters = letters(&gzip(bytes)?);
        Ok(Self { by: "gzip", count: bytes.len(), strides: String::new(), letters })
    }
}

fn gzip(bytes: &[u8]) -> Result<Vec<u8>> {
    gzipped(bytes, Compression::best())
}

fn gzipped(bytes: &[u8], level: Compression) -> Result<Vec<u8>> {
    let mut packer = GzEncoder::new(Vec::new(), level);
    packer.write_all(bytes)?;
    packer.finish()
}

fn lzip(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut packer = LzipWriter::new(Vec::new(), LzipOptions::with_preset(9));
    packer.write_all(bytes)?;
    packer.finish()
}

/// Returns how many bytes a file of lzip has unpacked: its end says so.
fn unpacked_bytes(packed: &[u8]) -> usize {
    let count = packed.last_chunk::<16>().and_then(|end| end.first_chunk::<8>());
    count.map_or(0, |count| u64::from_le_bytes(*count) as usize)
}

/// Returns a file that holds gzip (SPZ, NIfTI, NRRD) with the same content in gzip that packs
/// nothing, so that it can be packed better. Other files stay as they are.
fn loosened(bytes: &[u8]) -> Cow<'_, [u8]> {
    const GZIP: &[u8] = &[0x1f, 0x8b];
    let start = match bytes.starts_with(b"NRRD") {
        true => bytes.windows(2).position(|pair| pair == b"\n\n").map_or(0, |end| end + 2),
        false => 0,
    };
    let loosened = || {
        let (head, packed) = bytes.split_at(start);
        let mut unpacker = packed.starts_with(GZIP).then(|| GzDecoder::new(packed))?;
        let mut plain = Vec::new();
        (&mut unpacker).take(MOST_LZIP as u64).read_to_end(&mut plain).ok()?;
        // All of it, and nothing behind it.
        let is_all = plain.len() < MOST_LZIP && unpacker.into_inner().is_empty();
        let loose = is_all.then(|| gzipped(&plain, Compression::none()).ok())??;
        Some([head, &loose].concat())
    };
    loosened().map_or(bytes.into(), Cow::Owned)
}

/// Returns the length of the rows of a block whose columns change least from row to row.
fn stride(block: &[u8]) -> usize {
    let start = &block[..block.len().min(LOOKED_AT)];
    let mut best = (f64::INFINITY, 1);
    for stride in 1..=WIDEST {
        let rows = start.len() / stride;
        if rows < 32 {
            break;
        }
        let bits = (0..stride).map(|column| bits_of_column(start, stride, column)).sum::<f64>();
        let bits = bits / stride as f64;
        if bits < best.0 - GAIN {
            best = (bits, stride);
        }
    }
    best.1
}

/// Returns the bits that the changes of a column need at least, a byte.
fn bits_of_column(bytes: &[u8], stride: usize, column: usize) -> f64 {
    let mut counts = [0u32; 256];
    let rows = bytes.len() / stride;
    for row in 1..rows {
        let at = row * stride + column;
        counts[usize::from(bytes[at].wrapping_sub(bytes[at - stride]))] += 1;
    }
    let all = (rows - 1) as f64;
    let share = |count: &u32| f64::from(*count) / all;
    let used = counts.iter().filter(|count| **count > 0).map(share);
    -used.map(|share| share * share.log2()).sum::<f64>()
}

/// Returns the changes of each column from row to row, column after column.
fn turned(block: &[u8], stride: usize) -> Vec<u8> {
    let mut out = Vec::with_capacity(block.len());
    for column in 0..stride {
        let mut last = 0;
        for byte in block.iter().skip(column).step_by(stride) {
            out.push(byte.wrapping_sub(last));
            last = *byte;
        }
    }
    out
}

/// Returns bytes as letters of seven bits, the first bits first.
fn letters(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() / 7 * 8 + bytes.len() / 32 + 8);
    let (mut held, mut count) = (0u32, 0);
    let mut put = |seven: u32| {
        let code = if UNFIT.contains(&(seven as u8)) { seven + AWAY } else { seven };
        text.extend(char::from_u32(code));
    };
    for byte in bytes {
        held = held << 8 | u32::from(*byte);
        count += 8;
        while count >= 7 {
            count -= 7;
            put(held >> count & 127);
        }
        held &= (1 << count) - 1;
    }
    if count > 0 {
        put(held << (7 - count) & 127);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use lzma_rust2::LzipReader;

    /// Takes bytes out of letters, as boot.js does.
    fn unpacked(packed: &Packed) -> Vec<u8> {
        let (mut bytes, mut held, mut count) = (Vec::new(), 0u32, 0);
        for letter in packed.letters.chars() {
            held = held << 7 | (letter as u32 & 127);
            count += 7;
            if count >= 8 {
                count -= 8;
                bytes.push((held >> count & 255) as u8);
                held &= (1 << count) - 1;
            }
        }
        let mut turned = Vec::new();
        match packed.by {
            "lzip" => LzipReader::new(&bytes[..]).read_to_end(&mut turned),
            _ => GzDecoder::new(&bytes[..]).read_to_end(&mut turned),
        }
        .expect("a packed stream");
        assert_eq!(turned.len(), packed.count);
        let strides = packed.strides.split_whitespace();
        let strides: Vec<usize> = strides.map(|stride| stride.parse().unwrap()).collect();
        let mut out = vec![0; turned.len()];
        if strides.is_empty() {
            return turned;
        }
        let blocks = out.chunks_mut(BLOCK).zip(turned.chunks(BLOCK));
        for ((block, turned), stride) in blocks.zip(strides) {
            let mut next = turned.iter();
            for column in 0..stride {
                let mut last = 0u8;
                for byte in block.iter_mut().skip(column).step_by(stride) {
                    last = last.wrapping_add(*next.next().expect("a byte"));
                    *byte = last;
                }
            }
        }
        out
    }

    #[test]
    fn what_is_packed_comes_back() {
        let rows = |count: u32| (0..count).flat_map(|row| [row, row * row, 7]);
        let rows: Vec<u8> = rows(60_000).flat_map(u32::to_le_bytes).collect();
        let noise = |state: &mut u32| {
            *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            Some((*state >> 24) as u8)
        };
        let noise: Vec<u8> = std::iter::successors(Some(1), |s: &u32| Some(s.wrapping_add(1)))
            .scan(9, |state, _| noise(state))
            .take(300_001)
            .collect();
        for (bytes, is_turned) in
            [(&rows[..], true), (&noise, false), (b"", false), (b"\0\r<<<<", false)]
        {
            let packed = Packed::new(bytes).expect("letters");
            assert_eq!(!packed.strides.is_empty(), is_turned, "{}", packed.strides);
            assert!(!packed.letters.contains(['\0', '\r', '<']));
            assert!(unpacked(&packed) == bytes, "{} bytes", bytes.len());
            assert!(unpacked(&Packed::gzip(bytes).expect("letters")) == bytes);
        }
        assert!(Packed::new(&rows).expect("letters").letters.len() < rows.len() / 8);
    }

    /// Files that are packed already become smaller, and hold the same.
    #[test]
    fn gzip_inside_is_packed_anew() {
        let text: Vec<u8> = (0..90_000u32).flat_map(|at| (at / 7 * 3).to_le_bytes()).collect();
        let zipped = gzip(&text).expect("gzip");
        for head in [&b""[..], b"NRRD0004\nencoding: gzip\n\n"] {
            let file = [head, &zipped].concat();
            let packed = Packed::new(&file).expect("letters");
            let back = unpacked(&packed);
            let mut content = Vec::new();
            GzDecoder::new(&back[head.len()..]).read_to_end(&mut content).expect("gzip");
            assert!(back.starts_with(head) && content == text);
            assert!(packed.letters.len() < file.len() / 2, "{}", packed.letters.len());
            // Something behind it belongs to the file.
            let more = [&file[..], b"more"].concat();
            assert!(unpacked(&Packed::new(&more).expect("letters")) == more);
        }
    }
}

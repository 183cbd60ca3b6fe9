//! How bytes lie in a page: rows are turned into columns, gzip packs them, and letters hold them.
//!
//! The letters are code points below 128, seven bits each: a sixth more than the bytes, where
//! base64 takes a third more. Three letters have a meaning in HTML, and are replaced by others.
//! tools/web/js/page.js takes the bytes out again.

use flate2::{Compression, write::GzEncoder};
use std::io::{Result, Write};

/// The bytes that are turned at once.
const BLOCK: usize = 1 << 18;

/// The bytes of a block that its stride is chosen by, and the widest stride.
const LOOKED_AT: usize = 1 << 14;
const WIDEST: usize = 64;

/// A block is turned only if that saves bits: this many of a byte.
const GAIN: f64 = 0.02;

/// Letters that a page may not have: HTML replaces the first and the second, and the third begins
/// a tag.
const UNFIT: [u8; 3] = [0, b'\r', b'<'];

/// Where the letters are that stand for unfit ones.
const AWAY: u32 = 256;

/// Returns the strides of the blocks, if the bytes were turned, and the letters.
pub fn packed(bytes: &[u8]) -> Result<(String, String)> {
    let plain = gzip(bytes)?;
    let strides: Vec<usize> = bytes.chunks(BLOCK).map(stride).collect();
    let turned: Vec<u8> = bytes
        .chunks(BLOCK)
        .zip(&strides)
        .flat_map(|(block, stride)| turned(block, *stride))
        .collect();
    let turned = gzip(&turned)?;
    if turned.len() < plain.len() {
        let names: Vec<String> = strides.iter().map(usize::to_string).collect();
        return Ok((names.join(" "), letters(&turned)));
    }
    Ok((String::new(), letters(&plain)))
}

fn gzip(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::best());
    packer.write_all(bytes)?;
    packer.finish()
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
    use flate2::read::GzDecoder;
    use std::io::Read;

    /// Takes bytes out of letters, as tools/web/js/page.js does.
    fn unpacked(strides: &str, letters: &str) -> Vec<u8> {
        let (mut bytes, mut held, mut count) = (Vec::new(), 0u32, 0);
        for letter in letters.chars() {
            held = held << 7 | (letter as u32 & 127);
            count += 7;
            if count >= 8 {
                count -= 8;
                bytes.push((held >> count & 255) as u8);
                held &= (1 << count) - 1;
            }
        }
        let mut turned = Vec::new();
        GzDecoder::new(&bytes[..]).read_to_end(&mut turned).expect("a stream of gzip");
        let strides: Vec<usize> = strides.split_whitespace().map(|s| s.parse().unwrap()).collect();
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
            let (strides, letters) = packed(bytes).expect("letters");
            assert_eq!(!strides.is_empty(), is_turned, "{strides}");
            assert!(!letters.contains(['\0', '\r', '<']));
            assert!(unpacked(&strides, &letters) == bytes, "{} bytes", bytes.len());
        }
        assert!(packed(&rows).expect("letters").1.len() < rows.len() / 8);
    }
}

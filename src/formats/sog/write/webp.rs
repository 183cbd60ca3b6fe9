//! Lossless WebP (RFC 9649) of planes whose pixels are hardly alike.
//!
//! `image-webp` predicts each pixel from the one above, but along the curve of Morton the one to
//! the left is nearer: its files of a scene are 14 % larger than those of `libwebp`. These are as
//! small as `libwebp`'s. Each pixel is the difference to the pixel on its left or stands alone, red
//! and blue are differences to green or stand alone, and each channel has one prefix code. Nothing
//! is copied from earlier pixels.

use std::{cmp::Reverse, collections::BinaryHeap};

/// The longest word of a channel's code, and of the code for the lengths of words.
const MOST_BITS: u8 = 15;
const MOST_BITS_OF_LENGTHS: u8 = 7;

/// Symbols of the codes for green, which also has the lengths of copies, and for other channels.
const GREENS: usize = 256 + 24;
const OTHERS: usize = 256;

/// The order in which the lengths of the words for lengths are written.
const ORDER: [usize; 19] = [17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// The channels in the order of a pixel's words: green, red, blue and opacity.
const CHANNELS: [usize; 4] = [1, 0, 2, 3];

/// Encodes the rows of a picture, red, green, blue and opacity of each pixel. The size must be that
/// of the pixels, and at most 16,384 along each edge.
pub fn encode(pixels: &[[u8; 4]], width: usize) -> Vec<u8> {
    let height = pixels.len() / width;
    let mut bits = Bits::default();
    bits.put(0x2f, 8);
    bits.put(width as u64 - 1, 14);
    bits.put(height as u64 - 1, 14);
    let has_alpha = pixels.iter().any(|pixel| pixel[3] != u8::MAX);
    bits.put(has_alpha.into(), 1);
    bits.put(0, 3);
    let all = [false, true].map(|left| [false, true].map(|green| Change { left, green, width }));
    let counted = all.as_flattened().iter().map(|change| (change, change.counts(pixels)));
    let best = counted.min_by(|a, b| size(&a.1).total_cmp(&size(&b.1)));
    if let Some((change, counts)) = best {
        change.write(&mut bits);
        // Neither a cache of colours nor several codes for a channel.
        bits.put(0, 2);
        let codes = counts.map(|counts| Code::of(&counts, MOST_BITS));
        codes.iter().for_each(|code| code.write(&mut bits));
        // The code for the distances of copies has one word.
        Code::of(&[1], MOST_BITS).write(&mut bits);
        for at in 0..pixels.len() {
            let pixel = change.pixel(pixels, at);
            for (code, channel) in codes.iter().zip(CHANNELS) {
                code.put(pixel[channel], &mut bits);
            }
        }
    }
    in_file(bits.into_bytes())
}

/// Returns a file with this stream.
fn in_file(mut stream: Vec<u8>) -> Vec<u8> {
    let size = (stream.len() as u32).to_le_bytes();
    if stream.len() % 2 == 1 {
        stream.push(0);
    }
    let whole = (stream.len() as u32 + 12).to_le_bytes();
    [&b"RIFF"[..], &whole, b"WEBPVP8L", &size, &stream].concat()
}

/// Returns how many bits these counts of symbols need at least.
fn size(counts: &[Vec<u64>; 4]) -> f64 {
    let of_channel = |counts: &Vec<u64>| {
        let all = counts.iter().sum::<u64>() as f64;
        let used = counts.iter().filter(|count| **count > 0);
        used.map(|&count| count as f64 * (all / count as f64).log2()).sum::<f64>()
    };
    counts.iter().map(of_channel).sum()
}

/// How pixels are changed before they are written.
struct Change {
    /// Whether they are differences to the pixels on their left.
    left: bool,
    /// Whether red and blue are differences to green.
    green: bool,
    width: usize,
}

impl Change {
    fn write(&self, bits: &mut Bits) {
        if self.green {
            bits.put(0b101, 3);
        }
        if self.left {
            // Predictions are those of a picture with blocks of 512², whose green is 1 everywhere.
            bits.put(0b11_1001, 6);
            bits.put(0, 1);
            for symbol in [1, 0, 0, 0, 0] {
                bits.put_only(symbol);
            }
        }
        bits.put(0, 1);
    }

    /// Returns a changed pixel. The first of a row is predicted from the one above it.
    fn pixel(&self, pixels: &[[u8; 4]], at: usize) -> [u8; 4] {
        let green = |[r, g, b, a]: [u8; 4]| match self.green {
            true => [r.wrapping_sub(g), g, b.wrapping_sub(g), a],
            false => [r, g, b, a],
        };
        let this = green(pixels[at]);
        let before = match (self.left, at % self.width) {
            (false, _) => return this,
            (true, 0) if at == 0 => [0, 0, 0, u8::MAX],
            (true, 0) => green(pixels[at - self.width]),
            (true, _) => green(pixels[at - 1]),
        };
        [0, 1, 2, 3].map(|channel| this[channel].wrapping_sub(before[channel]))
    }

    /// Returns how often each symbol of the channels occurs, in their order.
    fn counts(&self, pixels: &[[u8; 4]]) -> [Vec<u64>; 4] {
        let mut counts = [GREENS, OTHERS, OTHERS, OTHERS].map(|symbols| vec![0; symbols]);
        for at in 0..pixels.len() {
            let pixel = self.pixel(pixels, at);
            for (counts, channel) in counts.iter_mut().zip(CHANNELS) {
                counts[usize::from(pixel[channel])] += 1;
            }
        }
        counts
    }
}

/// A prefix code (Huffman 1952). One with a single word has no bits.
struct Code {
    lengths: Vec<u8>,
    words: Vec<u16>,
    /// The symbol of a single word.
    only: Option<usize>,
}

impl Code {
    fn of(counts: &[u64], most: u8) -> Self {
        let mut used = (0..counts.len()).filter(|symbol| counts[*symbol] > 0);
        let (first, second) = (used.next().unwrap_or_default(), used.next());
        let mut lengths = vec![0; counts.len()];
        if second.is_none() {
            return Self { words: vec![0; counts.len()], lengths, only: Some(first) };
        }
        // Counts that are more alike have shorter words.
        let mut counts = counts.to_vec();
        loop {
            fill_lengths(&counts, &mut lengths);
            if lengths.iter().all(|length| *length <= most) {
                return Self { words: words_of(&lengths), lengths, only: None };
            }
            counts.iter_mut().filter(|count| **count > 0).for_each(|count| *count = *count / 2 + 1);
        }
    }

    fn put(&self, symbol: u8, bits: &mut Bits) {
        let symbol = usize::from(symbol);
        bits.put(self.words[symbol].into(), self.lengths[symbol].into());
    }

    fn write(&self, bits: &mut Bits) {
        if let Some(symbol) = self.only {
            return bits.put_only(symbol);
        }
        bits.put(0, 1);
        let mut counts = [0; 16];
        self.lengths.iter().for_each(|length| counts[usize::from(*length)] += 1);
        let code = Self::of(&counts, MOST_BITS_OF_LENGTHS);
        bits.put(ORDER.len() as u64 - 4, 4);
        for length in ORDER {
            let bit = if code.only == Some(length) { 1 } else { 0 };
            bits.put(code.lengths.get(length).map_or(0, |&bits| u64::from(bits)) | bit, 3);
        }
        // All symbols have a length.
        bits.put(0, 1);
        self.lengths.iter().for_each(|&length| code.put(length, bits));
    }
}

/// Fills in the lengths of the words of symbols, of which at least two are used.
fn fill_lengths(counts: &[u64], lengths: &mut [u8]) {
    let leaves = (0..counts.len()).filter(|symbol| counts[*symbol] > 0);
    let mut heap: BinaryHeap<_> = leaves.map(|symbol| Reverse((counts[symbol], symbol))).collect();
    // The parent of each symbol and, behind them, of each inner node.
    let mut parents = vec![0; counts.len()];
    while let Some(Reverse((a, first))) = heap.pop() {
        let Some(Reverse((b, second))) = heap.pop() else { break };
        let parent = parents.len();
        parents.push(0);
        parents[first] = parent;
        parents[second] = parent;
        heap.push(Reverse((a + b, parent)));
    }
    // Parents come behind their children.
    let mut depths = vec![0u8; parents.len()];
    for node in (0..parents.len() - 1).rev().filter(|&node| parents[node] > 0) {
        depths[node] = depths[parents[node]].saturating_add(1);
    }
    lengths.copy_from_slice(&depths[..lengths.len()]);
}

/// Returns the words for these lengths, in the order of their lengths and symbols. Their first bit
/// is the lowest.
fn words_of(lengths: &[u8]) -> Vec<u16> {
    let mut words = vec![0; lengths.len()];
    let mut next = 0u16;
    for length in 1..=MOST_BITS {
        let symbols = (0..lengths.len()).filter(|symbol| lengths[*symbol] == length);
        for symbol in symbols {
            words[symbol] = next.reverse_bits() >> (16 - length);
            next += 1;
        }
        next <<= 1;
    }
    words
}

/// A stream of bits, the lowest first.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    waiting: u64,
    count: u32,
}

impl Bits {
    fn put(&mut self, value: u64, bits: u32) {
        self.waiting |= value << self.count;
        self.count += bits;
        while self.count >= 8 {
            self.bytes.push(self.waiting as u8);
            self.waiting >>= 8;
            self.count -= 8;
        }
    }

    /// Writes a code that has a single word, for this symbol.
    fn put_only(&mut self, symbol: usize) {
        self.put(0b01, 2);
        let is_long = symbol > 1;
        self.put(is_long.into(), 1);
        self.put(symbol as u64, if is_long { 8 } else { 1 });
    }

    fn into_bytes(mut self) -> Vec<u8> {
        self.put(0, (8 - self.count) % 8);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image_webp::{ColorType, WebPDecoder, WebPEncoder};
    use std::io::Cursor;

    /// Checks that a decoder returns the pixels, and returns the size of the file.
    fn check(pixels: &[[u8; 4]], width: usize) -> usize {
        let file = encode(pixels, width);
        let mut decoder = WebPDecoder::new(Cursor::new(&file)).expect("a picture");
        let (w, h) = decoder.dimensions();
        assert_eq!((w as usize, h as usize), (width, pixels.len() / width));
        let mut out = vec![0; decoder.output_buffer_size().expect("a size")];
        decoder.read_image(&mut out).expect("pixels");
        let wanted: Vec<u8> = match decoder.has_alpha() {
            true => pixels.concat(),
            false => pixels.iter().flat_map(|pixel| pixel[..3].to_vec()).collect(),
        };
        assert!(out == wanted, "{width}");
        file.len()
    }

    fn noise(at: usize) -> u32 {
        (at as u32).wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(40_503) >> 8
    }

    #[test]
    fn decoders_return_the_pixels() {
        let picture = |count: usize, pixel: &dyn Fn(usize) -> [u8; 4]| -> Vec<[u8; 4]> {
            (0..count).map(pixel).collect()
        };
        let bytes = |at: usize| noise(at).to_le_bytes();
        for (width, height) in [(1, 1), (4, 4), (3, 7), (64, 33), (700, 3)] {
            let count = width * height;
            check(&picture(count, &|_| [9, 9, 9, 255]), width);
            check(&picture(count, &|_| [0, 1, 0, 0]), width);
            check(&picture(count, &|at| [at as u8 % 2, 0, 7, 255]), width);
            check(&picture(count, &|at| [at as u8, (at / 2) as u8, (at / 9) as u8, 255]), width);
            check(&picture(count, &bytes), width);
            check(&picture(count, &|at| [bytes(at)[0], 3, 4, 252 + at as u8 % 4]), width);
        }
        // Each symbol is half as frequent as the one before, so that words would be too long.
        check(&picture(1 << 18, &|at| [(at + 1).trailing_zeros() as u8, 0, 0, 255]), 512);
    }

    #[test]
    fn slow_changes_are_small() {
        let wave = |at: usize, speed: f32| (100.0 * (at as f32 * speed).sin() + 128.0) as u8;
        let pixel = |at| [wave(at, 0.05), wave(at, 0.03), wave(at, 0.07), 255];
        let pixels: Vec<[u8; 4]> = (0..1usize << 16).map(pixel).collect();
        let size = check(&pixels, 256);
        let mut other = Vec::new();
        WebPEncoder::new(&mut other)
            .encode(pixels.as_flattened(), 256, 256, ColorType::Rgba8)
            .unwrap();
        assert!(size < other.len() * 3 / 4, "{size} {}", other.len());
    }
}

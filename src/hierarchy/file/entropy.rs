//! Entropy coding of symbols by a range asymmetric numeral system (Duda 2009). Four states take
//! turns, so that a processor works on several symbols at once. Input and output are words of 16
//! bits.

use crate::container::Cursor;

/// The frequencies of a column add up to 2 to the power of this.
const SCALE: u32 = 12;
const WHOLE: u32 = 1 << SCALE;
/// The lowest state. States are less than 65536 times as large.
const LOWEST: u32 = 1 << 16;
/// The number of states that take turns.
const STATES: usize = 4;

/// One more than the largest symbol.
pub const SYMBOLS: usize = 127;

/// The number of weights that a table can contain: 0, 1, and those with two significant bits.
const WEIGHTS: u32 = 26;

fn weight(code: u32) -> u32 {
    if code < 2 { code } else { (2 + code % 2) << (code / 2 - 1) }
}

/// Returns the code of the weight nearest to a count, as a ratio.
fn nearest(count: u32) -> u32 {
    if count < 2 {
        return count;
    }
    let power = count.ilog2();
    // The count divided by 2^`power`, with 16 fractional bits. From √1.5 on, 1.5 is nearer than 1;
    // from √3 on, 2 is nearer.
    let part = (u64::from(count) << 16) >> power;
    (2 * power + u32::from(part >= 80_264) + u32::from(part >= 113_512)).min(WEIGHTS - 1)
}

/// The frequency of each symbol of a column, in units of 1/[`WHOLE`].
#[derive(Clone, Copy)]
pub struct Table {
    /// One more than the largest symbol of the column.
    length: usize,
    frequencies: [u16; SYMBOLS],
}

impl Table {
    /// Writes the table for symbols with these counts, all below 8192. There is a weight for each
    /// symbol up to the last that occurs, stored as a Rice code of its difference from the weight
    /// before.
    pub fn write(counts: &[u32; SYMBOLS], length: usize, bits: &mut Bits) -> Self {
        let mut before = 0;
        let mut codes = [0; SYMBOLS];
        for (code, &count) in codes.iter_mut().zip(&counts[..length]) {
            *code = nearest(count);
            let difference = *code as i32 - before;
            let folded = (difference << 1 ^ difference >> 31) as u32;
            bits.put((1 << (folded >> 1)) - 1, (folded >> 1) + 1);
            bits.put(folded & 1, 1);
            before = *code as i32;
        }
        Self::of(&codes[..length]).expect("what was counted has frequencies")
    }

    /// Reads a table; `None` if it is not valid.
    pub fn read(length: usize, bits: &mut BitReader) -> Option<Self> {
        let mut codes = [0; SYMBOLS];
        let mut before = 0;
        for code in codes.get_mut(..length)? {
            let mut folded = 0;
            while bits.take(1)? == 1 {
                folded += 2;
                if folded > 2 * WEIGHTS {
                    return None;
                }
            }
            folded |= bits.take(1)?;
            before += (folded >> 1) as i32 ^ -((folded & 1) as i32);
            *code = u32::try_from(before).ok().filter(|&code| code < WEIGHTS)?;
        }
        Self::of(&codes[..length])
    }

    /// Frequencies in proportion to the weights, at least 1. The largest absorbs the rounding error
    /// of the sum.
    fn of(codes: &[u32]) -> Option<Self> {
        let total: u32 = codes.iter().map(|&code| weight(code)).sum();
        let mut frequencies = [0; SYMBOLS];
        let (mut left, mut most) = (WHOLE as i32, 0);
        for (symbol, &code) in codes.iter().enumerate().filter(|(_, code)| **code > 0) {
            let frequency = (weight(code) * WHOLE / total).max(1);
            frequencies[symbol] = frequency as u16;
            left -= frequency as i32;
            if code > codes[most] {
                most = symbol;
            }
        }
        let largest = i32::from(frequencies[most]) + left;
        frequencies[most] =
            u16::try_from(largest).ok().filter(|&largest| total > 0 && largest > 0)?;
        Some(Self { length: codes.len(), frequencies })
    }

    fn starts(&self) -> [u16; SYMBOLS] {
        let mut next = 0;
        self.frequencies.map(|frequency| {
            next += frequency;
            next - frequency
        })
    }

    /// For each number below [`WHOLE`]: the frequency − 1, the distance from the start, and the
    /// symbol, in 12, 12 and 8 bits.
    fn slots(&self, slots: &mut Slots) {
        let mut at = 0;
        for (symbol, &frequency) in self.frequencies[..self.length].iter().enumerate() {
            let head = (u32::from(frequency).wrapping_sub(1)) << 20 | symbol as u32;
            for (step, slot) in (0..).zip(&mut slots.0[at..at + usize::from(frequency)]) {
                *slot = head | step << 8;
            }
            at += usize::from(frequency);
        }
    }
}

/// Lookup table for decoding. Its memory is shared by all columns.
pub struct Slots([u32; WHOLE as usize]);

impl Slots {
    pub fn new() -> Self {
        Self([0; WHOLE as usize])
    }
}

/// Encodes columns, starting with the last symbol.
pub struct Encoder {
    states: [u32; STATES],
    /// Symbols still to be encoded.
    left: usize,
    /// In reverse order.
    words: Vec<u16>,
}

impl Encoder {
    /// Creates an encoder for `count` symbols in total.
    pub fn new(count: usize) -> Self {
        Self { states: [LOWEST; STATES], left: count, words: Vec::with_capacity(count / 2) }
    }

    /// Encodes a column, in front of those already encoded.
    pub fn put(&mut self, symbols: &[u8], table: &Table) {
        let starts = table.starts();
        for &symbol in symbols.iter().rev() {
            self.left -= 1;
            let state = &mut self.states[self.left % STATES];
            let frequency = u32::from(table.frequencies[usize::from(symbol)]);
            if u64::from(*state) >= u64::from(frequency) << (32 - SCALE) {
                self.words.push(*state as u16);
                *state >>= 16;
            }
            *state = ((*state / frequency) << SCALE)
                + *state % frequency
                + u32::from(starts[usize::from(symbol)]);
        }
    }

    /// Appends the bytes, beginning with the states.
    pub fn finish(self, out: &mut Vec<u8>) {
        self.states.iter().for_each(|state| out.extend(state.to_le_bytes()));
        self.words.iter().rev().for_each(|word| out.extend(word.to_le_bytes()));
    }
}

/// Decodes the output of an [`Encoder`], starting with the first symbol.
pub struct Decoder<'a> {
    states: [u32; STATES],
    /// Symbols decoded so far.
    taken: usize,
    words: std::slice::Iter<'a, [u8; 2]>,
}

impl<'a> Decoder<'a> {
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        let mut cursor = Cursor::new(bytes);
        let mut states = [0; STATES];
        for state in &mut states {
            *state = cursor.u32()?;
        }
        let (words, []) = cursor.take(cursor.remaining())?.as_chunks() else { return None };
        Some(Self { states, taken: 0, words: words.iter() })
    }

    /// Calls `each` with the next symbols. Returns `None` if the bytes end too early, or if `each`
    /// returns `None`.
    pub fn take(
        &mut self,
        count: usize,
        table: &Table,
        slots: &mut Slots,
        mut each: impl FnMut(u8) -> Option<()>,
    ) -> Option<()> {
        table.slots(slots);
        // The states, in the order of their turns.
        let mut states: [u32; STATES] =
            std::array::from_fn(|turn| self.states[(self.taken + turn) % STATES]);
        let mut step = |state: &mut u32| {
            let slot = slots.0[(*state & (WHOLE - 1)) as usize];
            *state = ((slot >> 20) + 1) * (*state >> SCALE) + (slot >> 8 & (WHOLE - 1));
            if *state < LOWEST {
                *state = *state << 16 | u32::from(u16::from_le_bytes(*self.words.next()?));
            }
            each(slot as u8)
        };
        for _ in 0..count / STATES {
            step(&mut states[0])?;
            step(&mut states[1])?;
            step(&mut states[2])?;
            step(&mut states[3])?;
        }
        for state in &mut states[..count % STATES] {
            step(state)?;
        }
        for (turn, state) in states.into_iter().enumerate() {
            self.states[(self.taken + turn) % STATES] = state;
        }
        self.taken += count;
        Some(())
    }

    /// Returns whether all bytes are consumed, and the states are back where the encoder began.
    pub fn is_at_end(&self) -> bool {
        self.words.len() == 0 && self.states == [LOWEST; STATES]
    }
}

/// A list of bits, lowest first.
#[derive(Default)]
pub struct Bits {
    bytes: Vec<u8>,
    held: u64,
    count: u32,
}

impl Bits {
    /// Appends the lowest `count` bits of a number, at most 32.
    pub fn put(&mut self, value: u32, count: u32) {
        self.held |= (u64::from(value) & ((1 << count) - 1)) << self.count;
        self.count += count;
        if self.count >= 32 {
            self.bytes.extend((self.held as u32).to_le_bytes());
            self.held >>= 32;
            self.count -= 32;
        }
    }

    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.extend(&self.held.to_le_bytes()[..self.count.div_ceil(8) as usize]);
        self.bytes
    }
}

#[derive(Clone)]
pub struct BitReader<'a> {
    rest: &'a [u8],
    held: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, held: 0, count: 0 }
    }

    /// Returns the next `count` bits, at most 32; `None` if they end too early.
    #[inline]
    pub fn take(&mut self, count: u32) -> Option<u32> {
        if self.count < count {
            self.fill();
            if self.count < count {
                return None;
            }
        }
        let value = self.held & ((1 << count) - 1);
        self.held >>= count;
        self.count -= count;
        Some(value as u32)
    }

    fn fill(&mut self) {
        if let Some((word, rest)) = self.rest.split_first_chunk() {
            self.held |= u64::from(u32::from_le_bytes(*word)) << self.count;
            self.count += 32;
            self.rest = rest;
        } else {
            for byte in std::mem::take(&mut self.rest) {
                self.held |= u64::from(*byte) << self.count;
                self.count += 8;
            }
        }
    }

    /// Up to seven bits may be left, all of them 0.
    pub fn is_at_end(&self) -> bool {
        self.rest.is_empty() && self.count < 8 && self.held == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::testing::Random;

    #[test]
    fn tables_add_up_and_come_back() {
        let mut random = Random(3);
        for round in 0..300 {
            let mut counts = [0; SYMBOLS];
            let last = 1 + random.below(SYMBOLS - 1);
            counts[..=last]
                .iter_mut()
                .for_each(|count| *count = (random.next().powi(round % 12) * 4096.0) as u32);
            counts[last] = 1;
            let mut bits = Bits::default();
            let table = Table::write(&counts, last + 1, &mut bits);
            let bytes = bits.finish();
            let mut reader = BitReader::new(&bytes);
            let read = Table::read(last + 1, &mut reader).unwrap();
            assert!(reader.is_at_end());
            assert_eq!(read.frequencies, table.frequencies);
            assert_eq!(read.frequencies.iter().map(|&f| u32::from(f)).sum::<u32>(), WHOLE);
            assert!(
                counts
                    .iter()
                    .zip(&table.frequencies)
                    .all(|(&count, &frequency)| count == 0 || frequency > 0)
            );
        }
    }

    #[test]
    fn weights_are_near_what_was_counted() {
        for count in 0..=4096 {
            let coded = weight(nearest(count));
            assert!(
                count < 4 && coded == count
                    || (0.81..1.23).contains(&(f64::from(coded) / f64::from(count)))
            );
        }
    }

    #[test]
    fn symbols_come_back() {
        let mut random = Random(4);
        let columns: Vec<Vec<u8>> = (1..30)
            .map(|column| {
                (0..column * 39)
                    .map(|_| (random.next().powi(3) * f64::from(column) * 4.0) as u8)
                    .collect()
            })
            .collect();
        let table = |column: &Vec<u8>| {
            let mut counts = [0; SYMBOLS];
            column.iter().for_each(|&symbol| counts[usize::from(symbol)] += 1);
            Table::write(&counts, SYMBOLS, &mut Bits::default())
        };
        let tables: Vec<Table> = columns.iter().map(table).collect();
        let mut encoder = Encoder::new(columns.iter().map(Vec::len).sum());
        columns.iter().zip(&tables).rev().for_each(|(column, table)| encoder.put(column, table));
        let mut bytes = Vec::new();
        encoder.finish(&mut bytes);
        let mut decoder = Decoder::new(&bytes).unwrap();
        for (column, table) in columns.iter().zip(&tables) {
            let mut decoded = Vec::new();
            let each = |symbol| {
                decoded.push(symbol);
                Some(())
            };
            decoder.take(column.len(), table, &mut Slots::new(), each).unwrap();
            assert_eq!(decoded, *column);
        }
        assert!(decoder.is_at_end());
    }
}

//! Symbols in about as many bits as their frequencies say: range asymmetric numeral systems (Duda 2009), one state for all
//! columns of a page, bytes in and out.

/// Frequencies of a column add up to 2 to this.
const SCALE: u32 = 12;
const WHOLE: u32 = 1 << SCALE;
/// The state lies between this and 256 times it.
const LOWEST: u32 = 1 << 23;

/// The code of the frequency that the others leave.
const REST: u8 = 63;

/// Symbols are below this.
pub const SYMBOLS: usize = 128;

/// The frequency of a code: 0 to 7, then with three significant bits.
fn frequency(code: u8) -> u32 {
    match code {
        0..8 => u32::from(code),
        _ => (4 + u32::from(code & 3)) << (code / 4 - 1),
    }
}

/// How often each symbol of a column comes, as the file tells it.
#[derive(Clone)]
pub struct Table {
    /// For each symbol up to the last that comes.
    codes: Vec<u8>,
    frequencies: Vec<u32>,
    starts: Vec<u32>,
}

impl Table {
    /// The table for symbols with these counts.
    pub fn of(counts: &[u32; SYMBOLS]) -> Self {
        let total: u32 = counts.iter().sum();
        let last = counts.iter().rposition(|&count| count > 0).unwrap_or(0);
        let most = (0..=last).max_by_key(|&symbol| counts[symbol]).unwrap_or(0);
        let mut codes = vec![0; last + 1];
        let mut left = WHOLE;
        for symbol in (0..=last).filter(|&symbol| symbol != most && counts[symbol] > 0) {
            let wanted = f64::from(counts[symbol]) * f64::from(WHOLE) / f64::from(total);
            let miss = |&code: &u8| (f64::from(frequency(code)) - wanted).abs();
            let code = (1..REST).take_while(|&code| frequency(code) < WHOLE).min_by(|a, b| miss(a).total_cmp(&miss(b)));
            codes[symbol] = code.unwrap_or(1);
            left = left.saturating_sub(frequency(codes[symbol]));
        }
        // Rounded up too much, which takes many rare symbols: from the most frequent down, each gives something back.
        while left == 0 {
            let widest = (0..=last).filter(|&symbol| symbol != most).max_by_key(|&symbol| codes[symbol]).unwrap_or(0);
            codes[widest] -= 1;
            let others = (0..=last).filter(|&symbol| symbol != most).map(|symbol| frequency(codes[symbol]));
            left = WHOLE.saturating_sub(others.sum());
        }
        codes[most] = REST;
        Self::from_codes(codes).expect("the frequencies add up")
    }

    fn from_codes(codes: Vec<u8>) -> Option<Self> {
        let listed = codes.iter().filter(|&&code| code != REST);
        let sum: u64 = listed.clone().map(|&code| u64::from(frequency(code))).sum();
        let left = u64::from(WHOLE).checked_sub(sum).filter(|&left| left > 0)? as u32;
        if listed.count() + 1 != codes.len() || codes.len() > SYMBOLS {
            return None;
        }
        let frequencies: Vec<u32> =
            codes.iter().map(|&code| if code == REST { left } else { frequency(code) }).collect();
        let starts = frequencies.iter().scan(0, |next, &frequency| {
            let start = *next;
            *next += frequency;
            Some(start)
        });
        Some(Self { starts: starts.collect(), codes, frequencies })
    }

    /// How many symbols, then six bits for each, lowest first.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.push(self.codes.len() as u8);
        let (mut held, mut count) = (0u32, 0);
        for &code in &self.codes {
            held |= u32::from(code) << count;
            count += 6;
            while count >= 8 {
                out.push(held as u8);
                held >>= 8;
                count -= 8;
            }
        }
        if count > 0 {
            out.push(held as u8);
        }
    }

    /// Reads a table; `None` for what is none.
    pub fn read(cursor: &mut super::bytes::Cursor) -> Option<Self> {
        let length = usize::from(cursor.u8()?);
        let bytes = cursor.take((length * 6).div_ceil(8))?;
        let code = |symbol: usize| {
            let at = symbol * 6;
            let next = bytes.get(at / 8 + 1).copied().unwrap_or(0);
            (u16::from_le_bytes([bytes[at / 8], next]) >> (at % 8) & 63) as u8
        };
        Self::from_codes((0..length).map(code).collect())
    }
}

/// Encodes columns, the last symbol first.
pub struct Encoder {
    state: u32,
    /// Last byte first.
    bytes: Vec<u8>,
}

impl Encoder {
    pub fn new() -> Self {
        Self { state: LOWEST, bytes: Vec::new() }
    }

    /// Puts a column before those that are there.
    pub fn put(&mut self, symbols: &[u8], table: &Table) {
        for &symbol in symbols.iter().rev() {
            let frequency = table.frequencies[usize::from(symbol)];
            let most = ((LOWEST >> SCALE) << 8) * frequency;
            while self.state >= most {
                self.bytes.push(self.state as u8);
                self.state >>= 8;
            }
            self.state =
                ((self.state / frequency) << SCALE) + self.state % frequency + table.starts[usize::from(symbol)];
        }
    }

    /// The bytes, the state first.
    pub fn finish(mut self) -> Vec<u8> {
        self.bytes.extend(self.state.to_be_bytes());
        self.bytes.reverse();
        self.bytes
    }
}

/// Decodes what an [`Encoder`] gave, the first symbol first.
pub struct Decoder<'a> {
    state: u32,
    rest: &'a [u8],
}

impl<'a> Decoder<'a> {
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        let (state, rest) = bytes.split_first_chunk()?;
        Some(Self { state: u32::from_le_bytes(*state), rest })
    }

    /// The next symbols; `None` where the bytes end before.
    pub fn take(&mut self, count: usize, table: &Table) -> Option<Vec<u8>> {
        let mut symbols = [0u8; WHOLE as usize];
        for (symbol, (&start, &frequency)) in table.starts.iter().zip(&table.frequencies).enumerate() {
            symbols[start as usize..(start + frequency) as usize].fill(symbol as u8);
        }
        let mut out = Vec::with_capacity(count);
        for _ in 0..count {
            let place = self.state & (WHOLE - 1);
            let symbol = symbols[place as usize];
            let at = usize::from(symbol);
            self.state = table.frequencies[at] * (self.state >> SCALE) + place - table.starts[at];
            while self.state < LOWEST {
                let (&next, rest) = self.rest.split_first()?;
                self.state = self.state << 8 | u32::from(next);
                self.rest = rest;
            }
            out.push(symbol);
        }
        Some(out)
    }

    /// Whether all is taken, and was what was put.
    pub fn is_at_end(&self) -> bool {
        self.rest.is_empty() && self.state == LOWEST
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::{file::bytes::Cursor, testing::Random};

    #[test]
    fn tables_add_up_and_come_back() {
        let mut random = Random(3);
        for round in 0..300 {
            let mut counts = [0; SYMBOLS];
            let last = 1 + random.below(SYMBOLS - 1);
            counts[..=last].iter_mut().for_each(|count| *count = (random.next().powi(round % 12) * 4096.0) as u32);
            counts[last] = 1;
            let table = Table::of(&counts);
            let mut bytes = Vec::new();
            table.write(&mut bytes);
            let read = Table::read(&mut Cursor::new(&bytes)).unwrap();
            assert_eq!((&read.frequencies, read.frequencies.iter().sum::<u32>()), (&table.frequencies, WHOLE));
            assert!(counts.iter().zip(&table.frequencies).all(|(&count, &frequency)| count == 0 || frequency > 0));
        }
    }

    #[test]
    fn symbols_come_back() {
        let mut random = Random(4);
        let columns: Vec<Vec<u8>> = (0..30)
            .map(|column| (0..column * 40).map(|_| (random.next().powi(3) * column as f64 * 4.0) as u8).collect())
            .collect();
        let tables: Vec<Table> = columns
            .iter()
            .map(|column| {
                let mut counts = [0; SYMBOLS];
                column.iter().for_each(|&symbol| counts[usize::from(symbol)] += 1);
                Table::of(&counts)
            })
            .collect();
        let mut encoder = Encoder::new();
        columns.iter().zip(&tables).rev().for_each(|(column, table)| encoder.put(column, table));
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes).unwrap();
        for (column, table) in columns.iter().zip(&tables) {
            assert_eq!(decoder.take(column.len(), table).as_ref(), Some(column));
        }
        assert!(decoder.is_at_end());
    }
}

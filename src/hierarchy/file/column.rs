//! Columns of whole numbers as bytes.
//!
//! Every number becomes a class, which tells its size to a quarter, and the bits below. Classes take about their entropy;
//! the bits below are as good as random and stand as they are.

use super::{
    bytes::{Cursor, Put},
    entropy::{Decoder, Encoder, SYMBOLS, Table},
};

/// How the numbers of a column became what is coded, each 0 or above.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    /// All are the base.
    Constant = 0,
    /// Their distance above the base.
    Above = 1,
    /// Themselves, the sign lowest.
    Signed = 2,
    /// Their difference from the one before, the sign lowest.
    Difference = 3,
}

const fn fold(value: i32) -> u32 {
    (value.wrapping_shl(1) ^ (value >> 31)) as u32
}

const fn unfold(value: u32) -> i32 {
    (value >> 1) as i32 ^ -((value & 1) as i32)
}

/// The class of a number and how many bits below it has. Numbers below 16 are their own class.
fn class(value: u32) -> (u8, u32) {
    if value < 16 {
        return (value as u8, 0);
    }
    let bits = value.ilog2() - 2;
    ((8 + bits * 4 + (value >> bits & 3)) as u8, bits)
}

/// The least number of a class and how many bits below it has; `None` for what is no class.
fn least(class: u8) -> Option<(u32, u32)> {
    match class {
        0..16 => Some((u32::from(class), 0)),
        16..128 => {
            let bits = (u32::from(class) - 8) / 4;
            Some(((4 | u32::from(class) & 3) << bits, bits))
        }
        _ => None,
    }
}

/// Collects the columns of a page.
#[derive(Default)]
pub struct Columns {
    /// Each column's mode and base, and the table of its classes.
    heads: Vec<u8>,
    classes: Vec<(Vec<u8>, Table)>,
    bits: Bits,
}

impl Columns {
    pub fn push(&mut self, values: &[i32]) {
        let (mode, base) = choose(values);
        self.heads.push(mode as u8);
        if matches!(mode, Mode::Constant | Mode::Above) {
            self.heads.extend(base.to_le_bytes());
        }
        if mode == Mode::Constant {
            return;
        }
        let mut counts = [0; SYMBOLS];
        let mut before = 0;
        let class = |&value: &i32| {
            let coded = coded(mode, base, before, value);
            let (class, bits) = class(coded);
            counts[usize::from(class)] += 1;
            self.bits.put(coded, bits);
            before = value;
            class
        };
        let classes: Vec<u8> = values.iter().map(class).collect();
        let table = Table::of(&counts);
        table.write(&mut self.heads);
        self.classes.push((classes, table));
    }

    /// The bytes: the heads of the columns, all classes, then the bits below; the first two behind their lengths.
    pub fn finish(self, out: &mut Vec<u8>) {
        let mut encoder = Encoder::new();
        self.classes.iter().rev().for_each(|(classes, table)| encoder.put(classes, table));
        for part in [self.heads, encoder.finish()] {
            out.u32(part.len() as u32);
            out.extend(part);
        }
        out.extend(self.bits.finish());
    }
}

/// Numbers of a column that its mode is chosen by.
const SAMPLE: usize = 1024;

/// The way that takes the fewest bits, by the entropy of the classes.
fn choose(values: &[i32]) -> (Mode, i32) {
    let first = values.first().copied().unwrap_or(0);
    if values.iter().all(|&value| value == first) {
        return (Mode::Constant, first);
    }
    let least = values.iter().copied().min().unwrap_or(0);
    // A part tells as well as all.
    let part = &values[values.len().saturating_sub(SAMPLE) / 2..][..values.len().min(SAMPLE)];
    let cost = |mode: Mode| {
        let mut counts = [0u32; SYMBOLS];
        let mut total = 0.0;
        let mut before = 0;
        for &value in part {
            let (class, bits) = class(coded(mode, least, before, value));
            counts[class as usize] += 1;
            total += f64::from(bits);
            before = value;
        }
        let count = part.len() as f64;
        let bits = |&n: &u32| f64::from(n) * libm::log2(count / f64::from(n));
        (mode, total + counts.iter().filter(|&&n| n > 0).map(bits).sum::<f64>())
    };
    let costs = [Mode::Above, Mode::Signed, Mode::Difference].map(cost);
    let (mode, _) = costs.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).expect("there are three");
    (mode, if mode == Mode::Above { least } else { 0 })
}

fn coded(mode: Mode, base: i32, before: i32, value: i32) -> u32 {
    match mode {
        Mode::Constant => 0,
        Mode::Above => value.wrapping_sub(base) as u32,
        Mode::Signed => fold(value),
        Mode::Difference => fold(value.wrapping_sub(before)),
    }
}

/// Takes the columns of a page one after another.
pub struct Planes<'a> {
    heads: Cursor<'a>,
    classes: Decoder<'a>,
    bits: BitReader<'a>,
}

impl<'a> Planes<'a> {
    /// What [`Columns::finish`] gave, which ends with `bytes`.
    pub fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let mut cursor = Cursor::new(bytes);
        let mut part = || {
            let length = cursor.u32()? as usize;
            cursor.take(length)
        };
        let (heads, classes) = part().zip(part()).ok_or("it ends within its columns")?;
        let classes = Decoder::new(classes).ok_or("it has no classes")?;
        let bits = BitReader::new(cursor.take(cursor.remaining()).unwrap_or(&[]));
        Ok(Self { heads: Cursor::new(heads), classes, bits })
    }

    pub fn column(&mut self, count: usize) -> Result<Vec<i32>, String> {
        let ends = || "it ends before its last column".to_owned();
        let mode = self.heads.u8().ok_or_else(ends)?;
        let base = if mode < 2 { self.heads.u32().ok_or_else(ends)? as i32 } else { 0 };
        if mode == Mode::Constant as u8 {
            return Ok(vec![base; count]);
        }
        let table = Table::read(&mut self.heads).ok_or("the frequencies of a column do not add up")?;
        let classes = self.classes.take(count, &table).ok_or_else(ends)?;
        let mut values = Vec::with_capacity(count);
        let mut before = 0i32;
        for class in classes {
            let (least, bits) = least(class).ok_or("a class is none")?;
            let coded = least + self.bits.take(bits).ok_or("it ends before its last bits")?;
            before = match mode {
                1 => base.wrapping_add(coded as i32),
                2 => unfold(coded),
                3 => before.wrapping_add(unfold(coded)),
                _ => return Err(format!("a column has the unknown mode {mode}")),
            };
            values.push(before);
        }
        Ok(values)
    }

    /// That nothing is left over.
    pub fn end(self) -> Result<(), String> {
        if self.heads.remaining() == 0 && self.classes.is_at_end() && self.bits.is_at_end() {
            Ok(())
        } else {
            Err("its columns do not end where it does".into())
        }
    }
}

/// Bits, lowest first.
#[derive(Default)]
struct Bits {
    bytes: Vec<u8>,
    held: u64,
    count: u32,
}

impl Bits {
    /// Appends the lowest `count` bits of a number, 29 at most.
    fn put(&mut self, value: u32, count: u32) {
        self.held |= (u64::from(value) & ((1 << count) - 1)) << self.count;
        self.count += count;
        while self.count >= 8 {
            self.bytes.push(self.held as u8);
            self.held >>= 8;
            self.count -= 8;
        }
    }

    fn finish(mut self) -> Vec<u8> {
        if self.count > 0 {
            self.bytes.push(self.held as u8);
        }
        self.bytes
    }
}

struct BitReader<'a> {
    bytes: &'a [u8],
    at: usize,
    held: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, held: 0, count: 0 }
    }

    fn take(&mut self, count: u32) -> Option<u32> {
        while self.count < count {
            self.held |= u64::from(*self.bytes.get(self.at)?) << self.count;
            self.at += 1;
            self.count += 8;
        }
        let value = self.held & ((1 << count) - 1);
        self.held >>= count;
        self.count -= count;
        Some(value as u32)
    }

    /// Fewer than eight bits may be left, all 0.
    fn is_at_end(&self) -> bool {
        self.at == self.bytes.len() && self.count < 8 && self.held == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::testing::Random;

    #[test]
    fn classes_hold_every_number() {
        for value in
            (0..2000).chain((4..32).flat_map(|bit| [(1u32 << bit) - 1, 1 << bit, 1 << bit | 5])).chain([u32::MAX])
        {
            let (class, bits) = class(value);
            let (least, same) = least(class).unwrap();
            assert_eq!((bits, value - least < 1 << bits), (same, true), "{value}");
        }
        assert_eq!(class(u32::MAX).0, 127);
        assert_eq!(least(128), None);
    }

    #[test]
    fn columns_come_back() {
        let mut random = Random(1);
        let mut noise = |size: f64, count: usize| -> Vec<i32> {
            (0..count).map(|_| ((random.next() + random.next() - 1.0) * size) as i32).collect()
        };
        let mut columns = vec![vec![], vec![7], vec![-3; 4096], noise(3.0, 4096), noise(200.0, 4096), noise(4e9, 500)];
        columns.push((0..4096).map(|n| n * 1000).collect());
        columns.push(vec![i32::MIN, i32::MAX, 0, -1, 1]);
        let mut out = Columns::default();
        columns.iter().for_each(|column| out.push(column));
        let mut bytes = Vec::new();
        out.finish(&mut bytes);
        let mut planes = Planes::new(&bytes).unwrap();
        for column in &columns {
            assert_eq!(planes.column(column.len()).unwrap(), *column);
        }
        planes.end().unwrap();
    }

    #[test]
    fn a_column_takes_about_its_entropy() {
        let mut random = Random(2);
        let mut normal = || (0..12).map(|_| random.next()).sum::<f64>() - 6.0;
        for width in [2.0, 10.0, 50.0] {
            let values: Vec<i32> = (0..4096).map(|_| (normal() * width).round() as i32).collect();
            let mut columns = Columns::default();
            columns.push(&values);
            let mut bytes = Vec::new();
            columns.finish(&mut bytes);
            let entropy = 4096.0 / 8.0 * libm::log2(width * 4.1327);
            assert!((bytes.len() as f64) < entropy * 1.03 + 60.0, "{width}: {} bytes for {entropy}", bytes.len());
        }
    }
}

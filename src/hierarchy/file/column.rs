//! Encodes columns of integers as bytes.
//!
//! Every number is split into a class, which gives its size to a quarter of an octave, and its low
//! bits. Classes are entropy-coded. The low bits are nearly random and are stored directly.

use super::{
    entropy::{BitReader, Bits, Decoder, Encoder, SYMBOLS, Slots, Table},
    quantise::logarithm,
};
use crate::container::{Cursor, Put};

/// Added to the number of classes if a column stores differences.
const DIFFERENCES: u8 = 128;

const fn fold(value: i32) -> u32 {
    (value.wrapping_shl(1) ^ (value >> 31)) as u32
}

const fn unfold(value: u32) -> i32 {
    (value >> 1) as i32 ^ -((value & 1) as i32)
}

/// Returns the class of a number and how many low bits it has. Numbers below 16 are their own
/// class.
fn class(value: u32) -> (u8, u32) {
    if value < 16 {
        return (value as u8, 0);
    }
    let bits = value.ilog2() - 2;
    ((8 + bits * 4 + (value >> bits & 3)) as u8, bits)
}

/// The smallest number of each class, and its number of low bits.
const CLASSES: [(u32, u8); SYMBOLS] = {
    let mut classes = [(0, 0); SYMBOLS];
    let mut class = 0;
    while class < SYMBOLS {
        let number = class as u32;
        let bits = if number < 16 { 0 } else { (number - 8) / 4 };
        classes[class] = (if number < 16 { number } else { (4 | number & 3) << bits }, bits as u8);
        class += 1;
    }
    classes
};

/// Collects the columns of a page. Numbers and their differences have at most 30 bits.
#[derive(Default)]
pub struct Columns {
    /// The head of each column, with the values of constant ones.
    heads: Vec<u8>,
    classes: Vec<u8>,
    /// The length and the table of each column that is not constant.
    tables: Vec<(usize, Table)>,
    bits: Bits,
}

impl Columns {
    pub fn push(&mut self, values: &[i32]) {
        let first = values.first().copied().unwrap_or(0);
        if values.iter().all(|&value| value == first) {
            self.heads.push(0);
            let mut rest = fold(first);
            while rest >= 128 {
                self.heads.push(rest as u8 | 128);
                rest >>= 7;
            }
            self.heads.push(rest as u8);
            return;
        }
        let differences = is_shorter_in_differences(values);
        let start = self.classes.len();
        let mut counts = [0; SYMBOLS];
        let mut before = 0;
        // The table comes before the low bits, so classes are determined first.
        let coded = |value: i32, before: &mut i32| {
            let coded = fold(value - *before);
            *before = if differences { value } else { 0 };
            coded
        };
        for &value in values {
            let (class, _) = class(coded(value, &mut before));
            counts[usize::from(class)] += 1;
            self.classes.push(class);
        }
        let length = counts.iter().rposition(|&count| count > 0).unwrap_or(0) + 1;
        self.heads.push(length as u8 | if differences { DIFFERENCES } else { 0 });
        let table = Table::write(&counts, length, &mut self.bits);
        let mut before = 0;
        for (&value, &class) in values.iter().zip(&self.classes[start..]) {
            let coded = coded(value, &mut before);
            self.bits.put(coded, u32::from(CLASSES[usize::from(class)].1));
        }
        self.tables.push((values.len(), table));
    }

    /// Appends the encoded columns: their heads, all classes, then the low bits. The first two are
    /// preceded by their lengths.
    pub fn finish(self, out: &mut Vec<u8>) {
        let mut encoder = Encoder::new(self.classes.len());
        let mut end = self.classes.len();
        for (count, table) in self.tables.iter().rev() {
            encoder.put(&self.classes[end - count..end], table);
            end -= count;
        }
        out.u32(self.heads.len() as u32);
        out.extend(self.heads);
        let length = out.len();
        out.u32(0);
        encoder.finish(out);
        let classes = (out.len() - length - 4) as u32;
        out[length..length + 4].copy_from_slice(&classes.to_le_bytes());
        out.extend(self.bits.finish());
    }
}

/// Numbers of a column that are sampled to choose its encoding.
const SAMPLE: usize = 512;

/// Returns whether the differences between successive numbers need fewer bits than the numbers, by
/// the entropy of the classes.
fn is_shorter_in_differences(values: &[i32]) -> bool {
    // A sample is representative enough.
    let values = &values[values.len().saturating_sub(SAMPLE) / 2..][..values.len().min(SAMPLE)];
    let cost = |of: &dyn Fn(usize) -> i32| {
        let mut counts = [0u32; SYMBOLS];
        let mut below = 0;
        for at in 1..values.len() {
            let (class, bits) = class(fold(of(at)));
            counts[usize::from(class)] += 1;
            below += bits;
        }
        let total = logarithm(values.len() as f64);
        let bits = |&count: &u32| f64::from(count) * (total - logarithm(f64::from(count)));
        f64::from(below) + counts.iter().filter(|&&count| count > 0).map(bits).sum::<f64>()
    };
    cost(&|at| values[at] - values[at - 1]) < cost(&|at| values[at])
}

/// Reads the columns of a page one after another.
pub struct Planes<'a> {
    heads: Cursor<'a>,
    classes: Decoder<'a>,
    bits: BitReader<'a>,
    slots: Box<Slots>,
}

impl<'a> Planes<'a> {
    /// Opens the output of [`Columns::finish`], which `bytes` must end with.
    pub fn new(bytes: &'a [u8]) -> Result<Self, String> {
        let mut cursor = Cursor::new(bytes);
        let mut part = || {
            let length = cursor.u32()? as usize;
            cursor.take(length)
        };
        let (heads, classes) = part().zip(part()).ok_or("it ends inside its columns")?;
        let classes = Decoder::new(classes).ok_or("it has no classes")?;
        let bits = BitReader::new(cursor.take(cursor.remaining()).unwrap_or(&[]));
        Ok(Self { heads: Cursor::new(heads), classes, bits, slots: Box::new(Slots::new()) })
    }

    /// Returns the next column, of `count` numbers.
    pub fn column(&mut self, count: usize) -> Result<Vec<i32>, String> {
        let head = self.heads.u8().ok_or("it ends before its last column")?;
        if head == 0 {
            return Ok(vec![
                self.constant().ok_or("the value of a constant column is not valid")?;
                count
            ]);
        }
        let length = usize::from(head & !DIFFERENCES);
        let table = Table::read(length, &mut self.bits)
            .ok_or("the frequencies of a column are not valid")?;
        let mut values = vec![0; count];
        let mut places = values.iter_mut();
        let bits = &mut self.bits;
        let mut before = 0i32;
        let kept = if head & DIFFERENCES == 0 { 0 } else { -1 };
        let each = |class: u8| {
            let (least, below) = CLASSES[usize::from(class) % SYMBOLS];
            let value = before.wrapping_add(unfold(least + bits.take(u32::from(below))?));
            before = value & kept;
            *places.next()? = value;
            Some(())
        };
        self.classes.take(count, &table, &mut self.slots, each).ok_or("it ends inside a column")?;
        Ok(values)
    }

    /// Reads the value of a constant column: seven bits a byte, lowest first, with the highest bit
    /// set if more follow.
    fn constant(&mut self) -> Option<i32> {
        let mut folded = 0;
        for shift in (0..32).step_by(7) {
            let byte = self.heads.u8()?;
            folded |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Some(unfold(folded));
            }
        }
        None
    }

    /// Returns an error if bytes are left over.
    pub fn end(self) -> Result<(), String> {
        if self.heads.remaining() == 0 && self.classes.is_at_end() && self.bits.is_at_end() {
            Ok(())
        } else {
            Err("its columns do not end where the page does".into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hierarchy::testing::Random;

    #[test]
    fn classes_hold_every_number() {
        for value in
            (0..2000).chain((4..31).flat_map(|bit| [(1u32 << bit) - 1, 1 << bit, 1 << bit | 5]))
        {
            let (class, bits) = class(value);
            let (least, same) = CLASSES[usize::from(class)];
            assert_eq!((bits, value - least < 1 << bits), (u32::from(same), true), "{value}");
        }
    }

    #[test]
    fn columns_come_back() {
        let mut random = Random(1);
        let mut noise = |size: f64, count: usize| -> Vec<i32> {
            (0..count).map(|_| ((random.next() + random.next() - 1.0) * size) as i32).collect()
        };
        let mut columns = vec![
            vec![],
            vec![7],
            vec![-3; 4096],
            noise(3.0, 4096),
            noise(200.0, 4096),
            noise(2e8, 500),
        ];
        columns.push((0..4096).map(|n| n * 1000).collect());
        columns.push(vec![-1 << 28, 1 << 28, 0, -1, 1]);
        columns.push(vec![i32::MIN; 3]);
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
            assert!(
                (bytes.len() as f64) < entropy * 1.03 + 50.0,
                "{width}: {} bytes for {entropy}",
                bytes.len()
            );
        }
    }
}

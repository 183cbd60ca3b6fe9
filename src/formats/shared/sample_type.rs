//! Sample types of volume files, and how their bytes and texts become [`Samples`].

use crate::{parallel::prelude::*, volume::Samples};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The type of a sample in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum SampleType {
    /// 8 bits, unsigned.
    U8,
    /// 8 bits, signed.
    I8,
    /// 16 bits, unsigned.
    U16,
    /// 16 bits, signed.
    I16,
    /// 32 bits, unsigned.
    U32,
    /// 32 bits, signed.
    I32,
    /// 64 bits, unsigned.
    U64,
    /// 64 bits, signed.
    I64,
    /// 32 bits, floating point.
    F32,
    /// 64 bits, floating point.
    F64,
}

/// The byte order of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Endian {
    /// The lowest byte comes first.
    #[default]
    Little,
    /// The highest byte comes first.
    Big,
}

impl SampleType {
    /// Returns the type with a name such as `u8`, `i16` or `f32`.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "u8" => Self::U8,
            "i8" => Self::I8,
            "u16" => Self::U16,
            "i16" => Self::I16,
            "u32" => Self::U32,
            "i32" => Self::I32,
            "u64" => Self::U64,
            "i64" => Self::I64,
            "f32" => Self::F32,
            "f64" => Self::F64,
            _ => return None,
        })
    }

    /// Returns the name that [`from_name`](Self::from_name) accepts.
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::I8 => "i8",
            Self::U16 => "u16",
            Self::I16 => "i16",
            Self::U32 => "u32",
            Self::I32 => "i32",
            Self::U64 => "u64",
            Self::I64 => "i64",
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }

    /// Returns the bytes per sample.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// Returns the bytes of a block of samples; `None` if they exceed 64 bits.
    pub fn bytes_of(self, dims: [usize; 3]) -> Option<u64> {
        dims.iter().try_fold(self.bytes() as u64, |product, &n| product.checked_mul(n as u64))
    }

    /// Returns the maximum bytes that `size` bytes of samples take once they are
    /// [decoded](Self::decode).
    pub fn decoded_bytes(self, size: usize) -> u64 {
        let size = size as u64;
        match self {
            Self::I8 => size.saturating_mul(2),
            Self::U64 | Self::I64 | Self::F64 => size.div_ceil(2),
            _ => size,
        }
    }

    /// Decodes samples from their bytes; bytes after the last whole sample are ignored.
    ///
    /// Types that [`Samples`] does not have become the nearest one. Signed 8-bit integers become
    /// 16-bit integers. Unsigned 32-bit and all 64-bit integers become signed 32-bit integers if
    /// every value fits, else 32-bit floats (rounded to 24 bits). 64-bit floats become 32-bit
    /// floats.
    pub fn decode(self, bytes: Cow<'_, [u8]>, endian: Endian) -> Samples {
        match self {
            Self::U8 => Samples::U8(bytes.into_owned()),
            Self::I8 => Samples::I16(convert(&bytes, endian, i8::from_le_bytes, i16::from)),
            Self::U16 => Samples::U16(convert(&bytes, endian, u16::from_le_bytes, |v| v)),
            Self::I16 => Samples::I16(convert(&bytes, endian, i16::from_le_bytes, |v| v)),
            Self::I32 => Samples::I32(convert(&bytes, endian, i32::from_le_bytes, |v| v)),
            Self::U32 => integers(&bytes, endian, u32::from_le_bytes, |v| v as f32),
            Self::U64 => integers(&bytes, endian, u64::from_le_bytes, |v| v as f32),
            Self::I64 => integers(&bytes, endian, i64::from_le_bytes, |v| v as f32),
            Self::F32 => Samples::F32(convert(&bytes, endian, f32::from_le_bytes, |v| v)),
            Self::F64 => Samples::F32(convert(&bytes, endian, f64::from_le_bytes, |v| v as f32)),
        }
    }

    /// Decodes numbers from their bytes as doubles: exact, except for 64-bit integers beyond 2⁵³.
    /// Bytes after the last whole number are ignored.
    pub fn doubles(self, bytes: &[u8], endian: Endian) -> Vec<f64> {
        match self {
            Self::U8 => bytes.iter().map(|&v| f64::from(v)).collect(),
            Self::I8 => convert(bytes, endian, i8::from_le_bytes, f64::from),
            Self::U16 => convert(bytes, endian, u16::from_le_bytes, f64::from),
            Self::I16 => convert(bytes, endian, i16::from_le_bytes, f64::from),
            Self::U32 => convert(bytes, endian, u32::from_le_bytes, f64::from),
            Self::I32 => convert(bytes, endian, i32::from_le_bytes, f64::from),
            Self::U64 => convert(bytes, endian, u64::from_le_bytes, |v| v as f64),
            Self::I64 => convert(bytes, endian, i64::from_le_bytes, |v| v as f64),
            Self::F32 => convert(bytes, endian, f32::from_le_bytes, f64::from),
            Self::F64 => convert(bytes, endian, f64::from_le_bytes, |v| v),
        }
    }

    /// Parses `count` numbers of a text, separated by white space and commas, into their
    /// little-endian bytes. Memory grows with the numbers that are present.
    ///
    /// # Errors
    /// A message if a word is not a number of this type, or if the number of words is not `count`.
    pub fn parse(self, text: &str, count: usize) -> Result<Vec<u8>, String> {
        match self {
            Self::U8 => parse(text, count, u8::to_le_bytes),
            Self::I8 => parse(text, count, i8::to_le_bytes),
            Self::U16 => parse(text, count, u16::to_le_bytes),
            Self::I16 => parse(text, count, i16::to_le_bytes),
            Self::U32 => parse(text, count, u32::to_le_bytes),
            Self::I32 => parse(text, count, i32::to_le_bytes),
            Self::U64 => parse(text, count, u64::to_le_bytes),
            Self::I64 => parse(text, count, i64::to_le_bytes),
            Self::F32 => parse(text, count, f32::to_le_bytes),
            Self::F64 => parse(text, count, f64::to_le_bytes),
        }
    }
}

/// Decodes numbers of `N` bytes each: `read` decodes them, `turn` converts them to the samples'
/// type.
fn convert<const N: usize, T, U: Send>(
    bytes: &[u8],
    endian: Endian,
    read: impl Fn([u8; N]) -> T + Sync,
    turn: impl Fn(T) -> U + Sync,
) -> Vec<U> {
    let (numbers, _) = bytes.as_chunks::<N>();
    let swapped = |mut number: [u8; N]| {
        number.reverse();
        number
    };
    match endian {
        Endian::Little => numbers.par_iter().map(|&n| turn(read(n))).collect(),
        Endian::Big => numbers.par_iter().map(|&n| turn(read(swapped(n)))).collect(),
    }
}

/// Decodes wide integers: to 32-bit integers if all fit, to floats otherwise.
fn integers<const N: usize, T: TryInto<i32>>(
    bytes: &[u8],
    endian: Endian,
    read: impl Fn([u8; N]) -> T + Sync + Copy,
    round: impl Fn(T) -> f32 + Sync,
) -> Samples {
    let (numbers, _) = bytes.as_chunks::<N>();
    let fits = |&number: &[u8; N]| {
        let mut number = number;
        if endian == Endian::Big {
            number.reverse();
        }
        read(number).try_into().is_ok()
    };
    if numbers.par_iter().all(fits) {
        Samples::I32(convert(bytes, endian, read, |v| v.try_into().unwrap_or_default()))
    } else {
        Samples::F32(convert(bytes, endian, read, round))
    }
}

fn parse<const N: usize, T: std::str::FromStr>(
    text: &str,
    count: usize,
    write: impl Fn(T) -> [u8; N],
) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let words =
        text.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty());
    for (i, word) in words.enumerate() {
        if i == count {
            return Err(format!("there are more than the {count} numbers expected"));
        }
        let number = word.parse().map_err(|_| {
            let excerpt: String = word.chars().take(40).collect();
            format!(
                "number {i} is “{excerpt}”, which is not a valid {}",
                std::any::type_name::<T>()
            )
        })?;
        bytes.extend_from_slice(&write(number));
    }
    let numbers = bytes.len() / N;
    if numbers < count {
        return Err(format!("there are {numbers} numbers where {count} were expected"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [SampleType; 10] = [
        SampleType::U8,
        SampleType::I8,
        SampleType::U16,
        SampleType::I16,
        SampleType::U32,
        SampleType::I32,
        SampleType::U64,
        SampleType::I64,
        SampleType::F32,
        SampleType::F64,
    ];

    #[test]
    fn every_type_reads_text_and_bytes_in_both_orders() {
        for kind in ALL {
            assert_eq!(SampleType::from_name(kind.name()), Some(kind));
            let little = kind.parse(" 1 2,\n127\t0 ", 4).unwrap();
            assert_eq!(little.len(), 4 * kind.bytes());
            let big: Vec<u8> =
                little.chunks(kind.bytes()).flat_map(|n| n.iter().rev().copied()).collect();
            for (bytes, endian) in [(little, Endian::Little), (big, Endian::Big)] {
                let doubles = kind.doubles(&bytes, endian);
                let samples = kind.decode(bytes.into(), endian);
                assert_eq!(
                    (0..4).map(|i| samples.value(i)).collect::<Vec<_>>(),
                    [1.0, 2.0, 127.0, 0.0],
                    "{kind:?}"
                );
                assert_eq!(doubles, [1.0, 2.0, 127.0, 0.0], "{kind:?}");
            }
        }
    }

    #[test]
    fn wide_types_keep_what_they_can() {
        let of = |kind: SampleType, text: &str, count| {
            kind.decode(kind.parse(text, count).unwrap().into(), Endian::Little)
        };
        assert_eq!(of(SampleType::I8, "-128 127", 2), Samples::I16(vec![-128, 127]));
        assert_eq!(of(SampleType::U32, "0 2147483647", 2), Samples::I32(vec![0, i32::MAX]));
        assert_eq!(
            of(SampleType::U32, "1 4294967295", 2),
            Samples::F32(vec![1.0, 4_294_967_295.0])
        );
        assert_eq!(of(SampleType::I64, "-2147483648", 1), Samples::I32(vec![i32::MIN]));
        assert_eq!(of(SampleType::I64, "-2147483649", 1), Samples::F32(vec![-2_147_483_648.0]));
        assert_eq!(of(SampleType::F64, "0.1 1e3", 2), Samples::F32(vec![0.1, 1000.0]));
    }

    #[test]
    fn wrong_texts_are_told() {
        assert!(SampleType::U8.parse("1 256", 2).unwrap_err().contains("number 1 is “256”"));
        assert!(SampleType::I16.parse("1.5", 1).unwrap_err().contains("not a valid i16"));
        assert!(SampleType::U8.parse("1 2 3", 2).unwrap_err().contains("more than the 2"));
        assert!(SampleType::U8.parse("1 2", 1 << 50).unwrap_err().contains("2 numbers"));
    }
}

//! The header of a PCD file: lines of text. The last one is `DATA`.

use crate::{
    Result,
    input::{Source, copy},
};
use glam::DVec3;

/// The contents of the header.
pub struct Header {
    pub fields: Vec<Field>,
    pub points: u64,
    /// Rows of points; 1 if the points are unordered.
    pub height: u64,
    pub viewpoint: Option<DVec3>,
    pub data: Data,
    /// Where the header ends, in bytes and in lines.
    pub end: usize,
    pub lines: usize,
}

/// How the points are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Data {
    Text,
    Binary,
    Packed,
}

/// A field of every point.
pub struct Field {
    pub name: String,
    pub kind: NumberKind,
    /// Bytes per number.
    pub size: usize,
    /// Numbers per point.
    pub count: usize,
    /// Where it begins in a point, in bytes and in words of text.
    pub offset: usize,
    pub word: usize,
}

impl Field {
    /// Returns its bytes per point.
    pub fn bytes(&self) -> usize {
        self.size * self.count
    }
}

/// A number type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NumberKind {
    Signed,
    Unsigned,
    Float,
}

impl NumberKind {
    pub fn is_float(self) -> bool {
        self == Self::Float
    }

    /// Returns the number in these bytes, lowest first. There may be 1, 2, 4 or 8 bytes.
    pub fn number(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        let unused = 64 - 8 * bytes.len() as u32;
        match self {
            Self::Float if bytes.len() == 4 => {
                f64::from(f32::from_bits(u64::from_le_bytes(wide) as u32))
            }
            Self::Float => f64::from_le_bytes(wide),
            Self::Signed => (i64::from_le_bytes(wide) << unused >> unused) as f64,
            Self::Unsigned => u64::from_le_bytes(wide) as f64,
        }
    }
}

/// Maximum number of fields, and of numbers per point, that a header may claim.
const MOST_FIELDS: usize = 1 << 16;

/// Headers of real files are far shorter than this, in bytes.
const LONGEST: usize = 1 << 20;

pub fn read(source: &Source) -> Result<Header> {
    let mut words: [Vec<String>; ENTRIES.len()] = Default::default();
    let mut at = 0;
    let bytes = source.bytes();
    for number in 1.. {
        let place = || format!("line {number}");
        if at > LONGEST {
            return Err(source.error(place(), format!("the header is longer than {LONGEST} bytes")));
        }
        let window = &bytes[at..bytes.len().min(at + LONGEST)];
        let Some(length) = window.iter().position(|&b| b == b'\n') else {
            if at + window.len() < bytes.len() {
                return Err(
                    source.error(place(), format!("the line is longer than {LONGEST} bytes"))
                );
            }
            return Err(source.error(place(), "the header ends before its line “DATA”"));
        };
        let line = copy::lossy(&bytes[at..at + length]);
        at += length + 1;
        let mut parts = line.split_ascii_whitespace();
        let Some(name) = parts.next().filter(|name| !name.starts_with('#')) else { continue };
        let Some(entry) = ENTRIES.iter().position(|entry| *entry == name) else {
            let shown: String = name.chars().take(40).collect();
            return Err(source.error(place(), format!("“{shown}” is not an entry of a PCD header")));
        };
        words[entry] = parts.map(str::to_owned).collect();
        if entry == DATA {
            return finish(source, &words, at, number);
        }
    }
    unreachable!("a file has an end")
}

const ENTRIES: [&str; 10] = [
    "VERSION",
    "FIELDS",
    "SIZE",
    "TYPE",
    "COUNT",
    "WIDTH",
    "HEIGHT",
    "VIEWPOINT",
    "POINTS",
    "DATA",
];
const FIELDS: usize = 1;
const SIZE: usize = 2;
const TYPE: usize = 3;
const COUNT: usize = 4;
const WIDTH: usize = 5;
const HEIGHT: usize = 6;
const VIEWPOINT: usize = 7;
const POINTS: usize = 8;
const DATA: usize = 9;

fn finish(
    source: &Source,
    words: &[Vec<String>; ENTRIES.len()],
    end: usize,
    lines: usize,
) -> Result<Header> {
    let wrong = |entry: usize, message: &str| {
        source.error("header", format!("“{} {}” {message}", ENTRIES[entry], words[entry].join(" ")))
    };
    let number = |entry: usize| match words[entry].as_slice() {
        [] => Ok(None),
        [word] => word.parse::<u64>().map(Some).map_err(|_| wrong(entry, "is not a count")),
        _ => Err(wrong(entry, "is not a count")),
    };
    let data = match words[DATA].iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["ascii"] => Data::Text,
        ["binary"] => Data::Binary,
        ["binary_compressed"] => Data::Packed,
        _ => return Err(wrong(DATA, "is not ascii, binary or binary_compressed")),
    };
    let (width, height) = (number(WIDTH)?, number(HEIGHT)?);
    let product = width.map(|width| width.saturating_mul(height.unwrap_or(1)));
    let points = match (number(POINTS)?, product) {
        (Some(points), Some(product)) if points != product => {
            return Err(source.error(
                "header",
                format!("“POINTS” claims {points} points, but “WIDTH” × “HEIGHT” is {product}"),
            ));
        }
        (points, product) => points.or(product).ok_or_else(|| wrong(POINTS, "is missing"))?,
    };
    let names = &words[FIELDS];
    for entry in [SIZE, TYPE, COUNT] {
        if words[entry].len() != names.len() && !(entry == COUNT && words[entry].is_empty()) {
            return Err(wrong(entry, &format!("does not fit the {} fields", names.len())));
        }
    }
    let (mut offset, mut word) = (0usize, 0usize);
    let mut fields = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let kind = match words[TYPE][index].as_str() {
            "F" => NumberKind::Float,
            "U" => NumberKind::Unsigned,
            "I" => NumberKind::Signed,
            _ => return Err(wrong(TYPE, "has a type other than F, U and I")),
        };
        let size = match (words[SIZE][index].as_str(), kind) {
            ("4", _) => 4,
            ("8", _) => 8,
            ("1", NumberKind::Signed | NumberKind::Unsigned) => 1,
            ("2", NumberKind::Signed | NumberKind::Unsigned) => 2,
            _ => return Err(wrong(SIZE, "has a size that its type cannot have")),
        };
        let count = words[COUNT].get(index).map_or(Some(1), |count| count.parse::<usize>().ok());
        let fits =
            |count: &usize| word.checked_add(*count).is_some_and(|words| words <= MOST_FIELDS);
        let count = count.filter(|count| fits(count) && index < MOST_FIELDS);
        let count = count.ok_or_else(|| wrong(COUNT, "has an invalid count"))?;
        if count > 0 {
            fields.push(Field { name: name.clone(), kind, size, count, offset, word });
        }
        offset += size * count;
        word += count;
    }
    let viewpoint: Option<Vec<f64>> =
        words[VIEWPOINT].iter().map(|word| word.parse().ok()).collect();
    let viewpoint = match viewpoint.as_deref() {
        Some(&[x, y, z, ..]) => Some(DVec3::new(x, y, z)).filter(|place| place.is_finite()),
        _ => None,
    };
    Ok(Header { fields, points, height: height.unwrap_or(1), viewpoint, data, end, lines })
}

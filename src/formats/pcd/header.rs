//! The header of a PCD file: lines of text. The last one is `DATA`.

use crate::{
    Error, Result,
    input::{Source, copy, text::without_mark},
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
    let bytes = source.bytes();
    let mut at = bytes.len() - without_mark(bytes).len();
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
        // The name in versions up to 0.5.
        let name = if name == "COLUMNS" { "FIELDS" } else { name };
        let Some(entry) = ENTRIES.iter().position(|entry| *entry == name) else {
            let excerpt: String = name.chars().take(40).collect();
            return Err(
                source.error(place(), format!("“{excerpt}” is not an entry of a PCD header"))
            );
        };
        words[entry] = parts.map(str::to_owned).collect();
        if entry == DATA {
            return Entries { source, words: &words }.header(at, number);
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

/// The words of each entry.
struct Entries<'a> {
    source: &'a Source<'a>,
    words: &'a [Vec<String>; ENTRIES.len()],
}

impl Entries<'_> {
    /// Returns the header, which ends at this byte and has this number of lines.
    fn header(&self, end: usize, lines: usize) -> Result<Header> {
        let data = match self.words[DATA].join(" ").to_ascii_lowercase().as_str() {
            "ascii" => Data::Text,
            "binary" => Data::Binary,
            "binary_compressed" => Data::Packed,
            _ => return Err(self.wrong(DATA, "is not ascii, binary or binary_compressed")),
        };
        let (points, height) = self.points()?;
        let (fields, viewpoint) = (self.fields()?, self.viewpoint());
        Ok(Header { fields, points, height, viewpoint, data, end, lines })
    }

    fn wrong(&self, entry: usize, message: &str) -> Error {
        let line = format!("“{} {}”", ENTRIES[entry], self.words[entry].join(" "));
        self.source.error("header", format!("{line} {message}"))
    }

    /// Returns the count of an entry; `None` if the header has no such entry.
    fn number(&self, entry: usize) -> Result<Option<u64>> {
        match self.words[entry].as_slice() {
            [] => Ok(None),
            [word] => word.parse().map(Some).map_err(|_| self.wrong(entry, "is not a count")),
            _ => Err(self.wrong(entry, "is not a count")),
        }
    }

    /// Returns the number of points, and of rows.
    fn points(&self) -> Result<(u64, u64)> {
        let (width, height) = (self.number(WIDTH)?, self.number(HEIGHT)?);
        let height = height.unwrap_or(1);
        let product = width.map(|width| width.saturating_mul(height));
        let points = match (self.number(POINTS)?, product) {
            (Some(points), Some(product)) if points != product => {
                return Err(self.source.error(
                    "header",
                    format!("“POINTS” claims {points} points, but “WIDTH” × “HEIGHT” is {product}"),
                ));
            }
            (points, product) => points.or(product),
        };
        Ok((points.ok_or_else(|| self.wrong(POINTS, "is missing"))?, height))
    }

    /// Returns the fields of a point.
    fn fields(&self) -> Result<Vec<Field>> {
        let names = &self.words[FIELDS];
        for entry in [SIZE, TYPE, COUNT] {
            let count = self.words[entry].len();
            if count != names.len() && !(entry == COUNT && count == 0) {
                let message = format!("does not fit the {} fields", names.len());
                return Err(self.wrong(entry, &message));
            }
        }
        let (mut offset, mut word) = (0usize, 0usize);
        let mut fields = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let (kind, size) = self.number_type(index)?;
            let count = self.words[COUNT].get(index);
            let count = count.map_or(Some(1), |count| count.parse::<usize>().ok());
            let fits =
                |count: &usize| word.checked_add(*count).is_some_and(|words| words <= MOST_FIELDS);
            let count = count.filter(|count| fits(count) && index < MOST_FIELDS);
            let count = count.ok_or_else(|| self.wrong(COUNT, "has an invalid count"))?;
            if count > 0 {
                fields.push(Field { name: name.clone(), kind, size, count, offset, word });
            }
            offset += size * count;
            word += count;
        }
        Ok(fields)
    }

    /// Returns the type of a field's numbers, and the bytes of each.
    fn number_type(&self, index: usize) -> Result<(NumberKind, usize)> {
        let kind = match self.words[TYPE][index].as_str() {
            "F" => NumberKind::Float,
            "U" => NumberKind::Unsigned,
            "I" => NumberKind::Signed,
            _ => return Err(self.wrong(TYPE, "has a type other than F, U and I")),
        };
        let size = match (self.words[SIZE][index].as_str(), kind) {
            ("4", _) => 4,
            ("8", _) => 8,
            ("1", NumberKind::Signed | NumberKind::Unsigned) => 1,
            ("2", NumberKind::Signed | NumberKind::Unsigned) => 2,
            _ => return Err(self.wrong(SIZE, "has a size that its type cannot have")),
        };
        Ok((kind, size))
    }

    /// Returns the position of the scanner, if it is given and finite.
    fn viewpoint(&self) -> Option<DVec3> {
        let numbers: Option<Vec<f64>> =
            self.words[VIEWPOINT].iter().map(|word| word.parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y, z, ..]) => Some(DVec3::new(x, y, z)).filter(|place| place.is_finite()),
            _ => None,
        }
    }
}

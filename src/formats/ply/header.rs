//! The PLY header: elements, their columns and where the payload begins.
//!
//! ply-rs parses the grammar and the types. It refuses some headers of real files (Latin-1 in a
//! comment, a property named `scalar.x`) and merges properties with the same name. So it gets a
//! cleaned copy with the same lines but plain, unique names. The original names are restored
//! afterwards.

use crate::{
    Result,
    input::{Source, copy},
};
use ply_rs::{
    parser::Parser,
    ply::{DefaultElement, Encoding, PropertyType, ScalarType},
};

/// Headers of real files have far fewer bytes and columns than this.
const LONGEST: usize = 1 << 20;
const MOST_COLUMNS: usize = 4096;

pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// The pictures that `comment TextureFile` lines name.
    pub textures: Vec<String>,
    /// Offset of the first byte after the header.
    pub payload: usize,
}

pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub columns: Vec<Column>,
}

pub(super) struct Column {
    pub name: String,
    pub kind: PropertyType,
}

impl Element {
    /// Returns the bytes per row; `None` if a column is a list.
    pub fn stride(&self) -> Option<usize> {
        self.columns.iter().map(|column| column.width()).sum()
    }

    /// Returns the minimum bytes of a binary row: lists may be empty.
    pub fn least_bytes(&self) -> usize {
        let least = |column: &Column| match &column.kind {
            PropertyType::Scalar(kind) | PropertyType::List(kind, _) => width(kind),
        };
        self.columns.iter().map(least).sum()
    }

    pub fn column(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| self.columns.iter().position(|column| column.name == *name))
    }
}

impl Column {
    /// Returns the bytes of a scalar; `None` for a list.
    pub fn width(&self) -> Option<usize> {
        match &self.kind {
            PropertyType::Scalar(scalar) => Some(width(scalar)),
            PropertyType::List(..) => None,
        }
    }
}

/// Returns the bytes of one scalar.
pub(super) fn width(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// Reads the header of a file.
pub(super) fn read(source: &Source) -> Result<Header> {
    let bytes = source.bytes();
    let mut clean = String::new();
    let mut names: Vec<(String, Vec<String>)> = Vec::new();
    let mut textures = Vec::new();
    let (mut at, mut number, mut columns) = (0, 0, 0);
    loop {
        number += 1;
        let place = || format!("header line {number}");
        let rest = bytes.get(at..).unwrap_or(&[]);
        let window = &rest[..rest.len().min(LONGEST.saturating_sub(at))];
        let Some(end) = window.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
            if window.len() < rest.len() {
                let message = format!(
                    "the header is longer than {LONGEST} bytes and has no “end_header” line"
                );
                return Err(source.error(place(), message));
            }
            return Err(source.error(
                place(),
                "the header has no “end_header” line; the file is cut off or is not PLY",
            ));
        };
        let line = copy::lossy(&rest[..end]);
        // A lone carriage return ends a line too (old Macintosh files).
        at += end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            [] => clean.push_str("comment\n"),
            ["comment", "TextureFile", ..] => {
                textures
                    .extend(line.split_once("TextureFile").map(|(_, name)| name.trim().to_owned()));
                clean.push_str("comment\n");
            }
            ["comment" | "obj_info", ..] => clean.push_str("comment\n"),
            ["element", name, count] => {
                if count.parse::<usize>().is_err() {
                    let shown: String = count.chars().take(40).collect();
                    return Err(source.error(place(), format!("“{shown}” is not a row count")));
                }
                clean.push_str(&format!("element e{} {count}\n", names.len()));
                names.push(((*name).to_owned(), Vec::new()));
                columns += 1;
            }
            ["property", kind @ .., name] => {
                let Some((_, properties)) = names.last_mut() else {
                    return Err(source.error(
                        place(),
                        format!("the property “{name}” comes before any element"),
                    ));
                };
                clean.push_str(&format!("property {} p{}\n", kind.join(" "), properties.len()));
                properties.push((*name).to_owned());
                columns += 1;
            }
            other => {
                clean.push_str(&other.join(" "));
                clean.push('\n');
            }
        }
        if columns > MOST_COLUMNS {
            return Err(
                source.error(place(), format!("more than {MOST_COLUMNS} elements and properties"))
            );
        }
        if words == ["end_header"] {
            break;
        }
    }
    let parsed =
        Parser::<DefaultElement>::new().read_ply_header(&mut clean.as_bytes()).map_err(|e| {
            let place = e.line().map_or("header".into(), |line| format!("header line {line}"));
            source.error(place, e.to_string().replace(['\n', '\t'], " "))
        })?;
    let mut elements = Vec::new();
    for ((name, properties), definition) in names.into_iter().zip(parsed.elements.into_values()) {
        let columns = properties
            .into_iter()
            .zip(definition.properties.into_values())
            .map(|(name, property)| Column { name, kind: property.data_type })
            .collect();
        elements.push(Element { name, count: definition.count, columns });
    }
    Ok(Header { encoding: parsed.encoding, elements, textures, payload: at })
}

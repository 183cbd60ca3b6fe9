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
use std::sync::Arc;

/// Headers of real files have far fewer bytes and columns than this.
const LONGEST: usize = 1 << 20;
const MOST_COLUMNS: usize = 4096;

/// Elements that are read whatever the case of their names.
const KNOWN: [&str; 3] = ["vertex", "face", "tristrips"];

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

    /// Returns the column with one of these names. One that differs by case alone is accepted.
    pub fn column(&self, names: &[&str]) -> Option<usize> {
        let find = |is: &dyn Fn(&str, &str) -> bool| {
            names
                .iter()
                .find_map(|name| self.columns.iter().position(|column| is(&column.name, name)))
        };
        find(&|column, name| column == name).or_else(|| find(&str::eq_ignore_ascii_case))
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

/// Returns the header of a file, which is parsed once.
pub(super) fn read(source: &Source) -> Result<Arc<Header>> {
    source.parsed(parse)
}

fn parse(source: &Source) -> Result<Header> {
    let bytes = source.bytes();
    let mut clean = Clean::default();
    let mut at = 0;
    for number in 1.. {
        let wrong = |message: String| source.error(format!("header line {number}"), message);
        let rest = bytes.get(at..).unwrap_or(&[]);
        let end = line_end(rest, LONGEST.saturating_sub(at)).map_err(wrong)?;
        let line = copy::lossy(&rest[..end]);
        // A lone carriage return ends a line too (old Macintosh files).
        at += end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        clean.add(&line).map_err(wrong)?;
        if line.split_whitespace().eq(["end_header"]) {
            break;
        }
    }
    let parsed = Parser::<DefaultElement>::new()
        .read_ply_header(&mut clean.text.as_bytes())
        .map_err(|e| {
            let place = e.line().map_or("header".into(), |line| format!("header line {line}"));
            source.error(place, e.to_string().replace(['\n', '\t'], " "))
        })?;
    let mut elements = Vec::new();
    for ((name, properties), definition) in
        clean.names.into_iter().zip(parsed.elements.into_values())
    {
        let columns = properties
            .into_iter()
            .zip(definition.properties.into_values())
            .map(|(name, property)| Column { name, kind: property.data_type })
            .collect();
        elements.push(Element { name, count: definition.count, columns });
    }
    Ok(Header { encoding: parsed.encoding, elements, textures: clean.textures, payload: at })
}

/// Returns the length of the first line, which must end within `most` bytes.
fn line_end(rest: &[u8], most: usize) -> Result<usize, String> {
    let window = &rest[..rest.len().min(most)];
    window.iter().position(|b| matches!(b, b'\n' | b'\r')).ok_or_else(|| {
        if window.len() < rest.len() {
            format!("the header is longer than {LONGEST} bytes and has no “end_header” line")
        } else {
            "the header has no “end_header” line; the file is cut off or is not PLY".into()
        }
    })
}

/// A header with plain, unique names, and what it leaves out.
#[derive(Default)]
struct Clean {
    text: String,
    /// The original names of the elements and their properties.
    names: Vec<(String, Vec<String>)>,
    textures: Vec<String>,
    /// Number of elements and properties.
    columns: usize,
}

impl Clean {
    /// Adds a line of the header.
    fn add(&mut self, line: &str) -> Result<(), String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            [] => self.text.push_str("comment\n"),
            ["comment", "TextureFile", ..] => {
                let name = line.split_once("TextureFile").map(|(_, name)| name.trim().to_owned());
                self.textures.extend(name);
                self.text.push_str("comment\n");
            }
            ["comment" | "obj_info", ..] => self.text.push_str("comment\n"),
            ["element", name, count] => {
                if count.parse::<usize>().is_err() {
                    let excerpt: String = count.chars().take(40).collect();
                    return Err(format!("“{excerpt}” is not a row count"));
                }
                self.text.push_str(&format!("element e{} {count}\n", self.names.len()));
                let known = KNOWN.iter().find(|known| known.eq_ignore_ascii_case(name));
                self.names.push(((*known.unwrap_or(name)).to_owned(), Vec::new()));
                self.columns += 1;
            }
            ["property", kind @ .., name] => {
                let Some((_, properties)) = self.names.last_mut() else {
                    return Err(format!("the property “{name}” comes before any element"));
                };
                let number = properties.len();
                self.text.push_str(&format!("property {} p{number}\n", kind.join(" ")));
                properties.push((*name).to_owned());
                self.columns += 1;
            }
            other => {
                self.text.push_str(&other.join(" "));
                self.text.push('\n');
            }
        }
        if self.columns > MOST_COLUMNS {
            return Err(format!("more than {MOST_COLUMNS} elements and properties"));
        }
        Ok(())
    }
}

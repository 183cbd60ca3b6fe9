//! The rows of one element, in text or binary, with one way to read their values.
//!
//! ply-rs's own payload readers are not used. They hang on elements without properties, refuse
//! `nan` and blank lines in text, and build a map per row. That is many times slower than the plain
//! strides read here.

use super::header::{Element, width};
use crate::{
    Error, Result,
    input::{Source, copy},
    parallel::prelude::*,
};
use ply_rs::ply::{Encoding, PropertyType, ScalarType};

/// Returns a number of the file's type. `bytes` has at least the width of the type.
pub(super) fn number(bytes: &[u8], kind: &ScalarType, big: bool) -> f64 {
    macro_rules! take {
        ($t:ty) => {{
            let mut raw = [0; size_of::<$t>()];
            raw.copy_from_slice(&bytes[..size_of::<$t>()]);
            f64::from(if big { <$t>::from_be_bytes(raw) } else { <$t>::from_le_bytes(raw) })
        }};
    }
    match kind {
        ScalarType::Char => take!(i8),
        ScalarType::UChar => take!(u8),
        ScalarType::Short => take!(i16),
        ScalarType::UShort => take!(u16),
        ScalarType::Int => take!(i32),
        ScalarType::UInt => take!(u32),
        ScalarType::Float => take!(f32),
        ScalarType::Double => take!(f64),
    }
}

/// The rows of an element, located in the file but not yet decoded.
pub(super) enum Rows<'a> {
    /// Every row has the same number of bytes.
    Fixed { data: &'a [u8], stride: usize, big: bool },
    /// Rows with lists, and the offset of each row.
    Loose { data: &'a [u8], starts: Vec<usize>, big: bool },
    /// One line per row.
    Text { lines: Vec<&'a [u8]> },
}

/// Rows that are located between two checks of the time limit.
const ROWS: usize = 1 << 16;

/// The values of one list in a row.
pub(super) type List = [f64];

impl<'a> Rows<'a> {
    /// Locates the rows of the element at `at` and advances `at` past them. The bytes present bound
    /// what is allocated: a text row is a line, and a row with a list has a length of at least one
    /// byte.
    pub fn find(
        source: &'a Source,
        element: &Element,
        encoding: Encoding,
        at: &mut usize,
    ) -> Result<Self> {
        let bytes = source.bytes();
        if element.columns.is_empty() {
            return Ok(Rows::Fixed { data: &[], stride: 0, big: false });
        }
        let big = match encoding {
            Encoding::Ascii => return Self::find_lines(source, element, at),
            Encoding::BinaryBigEndian => true,
            Encoding::BinaryLittleEndian => false,
        };
        let rest = &bytes[*at..];
        if let Some(stride) = element.stride() {
            let size = element.count.checked_mul(stride).filter(|&size| size <= rest.len());
            let Some(size) = size else { return Err(cut(source, element, rest.len() / stride)) };
            *at += size;
            return Ok(Rows::Fixed { data: &rest[..size], stride, big });
        }
        if let Some(stride) = triangle_stride(element)
            && let Some(size) = element.count.checked_mul(stride).filter(|&size| size <= rest.len())
        {
            let (offset, count_kind) = list_place(element);
            let threes = rest[..size]
                .par_chunks_exact(stride)
                .all(|row| number(&row[offset..], count_kind, big) == 3.0);
            if threes {
                *at += size;
                return Ok(Rows::Fixed { data: &rest[..size], stride, big });
            }
        }
        let most = element.count.min(rest.len() / element.least_bytes());
        source.room::<usize>("the row offsets", most)?;
        let mut starts = Vec::with_capacity(most);
        let mut next = 0;
        for row in 0..element.count {
            if row.is_multiple_of(ROWS) {
                source.check_time()?;
            }
            starts.push(next);
            for column in &element.columns {
                next = end_of(rest, next, &column.kind, big).map_err(|problem| match problem {
                    Problem::Cut => cut(source, element, row),
                    Problem::Length(length) => source.error(
                        format!("element “{}”, row {row}, byte {}", element.name, *at + next),
                        format!("the list “{}” has the impossible length {length}", column.name),
                    ),
                })?;
            }
        }
        *at += next;
        Ok(Rows::Loose { data: &rest[..next], starts, big })
    }

    fn find_lines(source: &'a Source, element: &Element, at: &mut usize) -> Result<Self> {
        let bytes = source.bytes();
        // The last line may end with the file instead of a line end.
        let most = element.count.min((bytes.len() - *at) / (2 * element.columns.len()) + 1);
        source.room::<&[u8]>("the list of lines", most)?;
        let mut lines = Vec::with_capacity(most);
        let mut longest = 0;
        while lines.len() < element.count {
            if lines.len().is_multiple_of(ROWS) {
                source.check_time()?;
            }
            if *at >= bytes.len() {
                return Err(cut(source, element, lines.len()));
            }
            let rest = &bytes[*at..];
            let end = rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
            *at = (*at + end + 1).min(bytes.len());
            let line = rest[..end].trim_ascii();
            if !line.is_empty() {
                longest = longest.max(line.len());
                lines.push(line);
                // A list may be as long as its line, and every thread may read one.
                if lines.len() == lines.capacity() && lines.len() < element.count {
                    source.room::<&[u8]>("the list of lines", lines.len())?;
                }
            }
        }
        source.room::<f64>("the values of a line", longest / 2)?;
        Ok(Rows::Text { lines })
    }

    /// Calls `visit` for every value of a row in column order, with its column and a number or a
    /// list.
    pub fn visit(
        &self,
        source: &Source,
        element: &Element,
        row: usize,
        wanted: &[bool],
        visit: impl FnMut(usize, f64, Option<&List>),
    ) -> Result<()> {
        match self {
            Rows::Fixed { data, stride, big } => {
                walk(&data[row * stride..][..*stride], element, *big, wanted, visit);
            }
            Rows::Loose { data, starts, big } => {
                walk(&data[starts[row]..], element, *big, wanted, visit);
            }
            Rows::Text { lines } => {
                visit_line(source, element, row, lines[row], wanted, visit)?;
            }
        }
        Ok(())
    }

    /// Returns the place of a row, for an error.
    pub fn place(&self, source: &Source, element: &Element, row: usize) -> String {
        let start = source.bytes().as_ptr() as usize;
        let byte = match self {
            Rows::Fixed { data, stride, .. } => data.as_ptr() as usize + row * stride,
            Rows::Loose { data, starts, .. } => data.as_ptr() as usize + starts[row],
            Rows::Text { lines } => lines[row].as_ptr() as usize,
        };
        format!("element “{}”, row {row}, byte {}", element.name, byte.wrapping_sub(start))
    }
}

fn text_place(source: &Source, element: &Element, row: usize, line: &[u8]) -> String {
    let byte = (line.as_ptr() as usize).wrapping_sub(source.bytes().as_ptr() as usize);
    format!("element “{}”, row {row}, byte {byte}", element.name)
}

pub(super) fn cut(source: &Source, element: &Element, rows: usize) -> Error {
    source
        .error(
            format!("element “{}”, row {rows}, byte {}", element.name, source.bytes().len()),
            format!("the file ends, though the header claims {} rows", element.count),
        )
        .hint("the file is cut, or its header does not belong to it")
}

enum Problem {
    Cut,
    Length(f64),
}

/// Returns the offset after a value that begins at `at`.
fn end_of(data: &[u8], at: usize, kind: &PropertyType, big: bool) -> Result<usize, Problem> {
    let inside = |end: usize| if end <= data.len() { Ok(end) } else { Err(Problem::Cut) };
    match kind {
        PropertyType::Scalar(scalar) => inside(at + width(scalar)),
        PropertyType::List(count, item) => {
            let first = inside(at + width(count))?;
            let length = number(&data[at..], count, big);
            if !(length >= 0.0 && length.fract() == 0.0) {
                return Err(Problem::Length(length));
            }
            if length > (data.len() - first) as f64 {
                return Err(Problem::Cut);
            }
            inside(first + length as usize * width(item))
        }
    }
}

/// Visits a binary row. Its bytes were present when the rows were counted. If the file has shrunk
/// since, the row ends early, and the reader reports the change.
fn walk(
    row: &[u8],
    element: &Element,
    big: bool,
    wanted: &[bool],
    mut visit: impl FnMut(usize, f64, Option<&List>),
) {
    let mut list = Vec::new();
    let mut rest = row;
    let mut take = |size: usize| {
        let (part, behind) = rest.split_at_checked(size)?;
        rest = behind;
        Some(part)
    };
    for (index, column) in element.columns.iter().enumerate() {
        match &column.kind {
            PropertyType::Scalar(kind) => {
                let Some(bytes) = take(width(kind)) else { return };
                if wanted[index] {
                    visit(index, number(bytes, kind, big), None);
                }
            }
            PropertyType::List(count, item) => {
                let Some(bytes) = take(width(count)) else { return };
                let length = number(bytes, count, big);
                let Some(bytes) = take((length as usize).saturating_mul(width(item))) else {
                    return;
                };
                if wanted[index] {
                    list.clear();
                    list.extend(
                        bytes.chunks_exact(width(item)).map(|bytes| number(bytes, item, big)),
                    );
                    visit(index, length, Some(&list));
                }
            }
        }
    }
}

/// Visits a row of text, as [`Rows::visit`] does.
fn visit_line(
    source: &Source,
    element: &Element,
    row: usize,
    line: &[u8],
    wanted: &[bool],
    mut visit: impl FnMut(usize, f64, Option<&List>),
) -> Result<()> {
    let wrong = |message: String| source.error(text_place(source, element, row, line), message);
    let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    let mut next = |column: usize, parse: bool| -> Result<f64> {
        let name = &element.columns[column].name;
        let word = words
            .next()
            .ok_or_else(|| wrong(format!("the line ends before the value of “{name}”")))?;
        if !parse {
            return Ok(0.0);
        }
        copy::float(word).ok_or_else(|| {
            wrong(format!("“{}” is not a number (for “{name}”)", copy::excerpt(word)))
        })
    };
    let mut list = Vec::new();
    for (index, column) in element.columns.iter().enumerate() {
        let length = match column.kind {
            PropertyType::Scalar(_) => {
                visit(index, next(index, wanted[index])?, None);
                continue;
            }
            PropertyType::List(..) => next(index, true)?,
        };
        // A line cannot contain more values than bytes, so a longer list ends in the error above.
        if !(length >= 0.0 && length.fract() == 0.0) {
            let name = &column.name;
            return Err(wrong(format!("the list “{name}” has the impossible length {length}")));
        }
        list.clear();
        let mut left = length;
        while left > 0.0 {
            list.push(next(index, wanted[index])?);
            left -= 1.0;
        }
        visit(index, length, Some(&list));
    }
    if words.next().is_some() {
        return Err(wrong("the line has more values than the header names".into()));
    }
    Ok(())
}

/// Returns the bytes per row if its only list has three values.
pub(super) fn triangle_stride(element: &Element) -> Option<usize> {
    let lists = element.columns.iter().filter(|column| column.width().is_none()).count();
    (lists == 1).then(|| place_in_row(element, element.columns.len()))
}

/// Returns the offset of a column in rows of equal length, whose lists have three values.
pub(super) fn place_in_row(element: &Element, column: usize) -> usize {
    let bytes = |kind: &PropertyType| match kind {
        PropertyType::Scalar(kind) => width(kind),
        PropertyType::List(count, item) => width(count) + 3 * width(item),
    };
    element.columns[..column].iter().map(|before| bytes(&before.kind)).sum()
}

/// Returns the offset of an element's first list in the row, and the type of its length.
pub(super) fn list_place(element: &Element) -> (usize, &ScalarType) {
    let mut offset = 0;
    for column in &element.columns {
        match &column.kind {
            PropertyType::Scalar(kind) => offset += width(kind),
            PropertyType::List(count, _) => return (offset, count),
        }
    }
    (0, &ScalarType::UChar)
}

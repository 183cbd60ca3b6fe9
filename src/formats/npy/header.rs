//! The header of a NumPy array: a Python dictionary with the type, the order and the shape.

use crate::{
    Error, Result,
    formats::{Endian, SampleType, shared::grid::Element},
    input::{Source, copy},
};

/// The type and shape of an array, and where its numbers begin.
#[derive(Debug, Clone)]
pub struct Header {
    pub element: Element,
    pub endian: Endian,
    /// Whether the first axis is the fastest in memory, not the last.
    pub is_fortran: bool,
    pub shape: Vec<u64>,
    /// The offset of the first number in bytes.
    pub start: usize,
}

/// Axes that an array may have.
const MOST_AXES: usize = 64;

impl Header {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// [`Error::Input`] for a malformed header and for numbers of another type.
    pub fn of(source: &Source) -> Result<Self> {
        Self::within(source, source.bytes(), "header")
    }

    /// Reads the header of an array that is a part of a file.
    pub fn within(source: &Source, bytes: &[u8], place: &str) -> Result<Self> {
        let wrong = |message: String| source.error(place, message);
        let (text, start) = text(bytes).ok_or_else(|| {
            wrong("is cut off, is longer than 1 MiB, or is not a NumPy header".into())
        })?;
        let field =
            |name: &str| field(&text, name).ok_or_else(|| wrong(format!("has no “{name}”")));
        let (element, endian) = number_type(field("descr")?).ok_or_else(|| {
            let descr: String = field("descr").unwrap_or_default().chars().take(80).collect();
            wrong(format!("has the type {descr}, but numbers were expected, such as '<f4'"))
                .hint("write one array of numbers: numpy.save(file, array.astype('float32'))")
        })?;
        let is_fortran = match field("fortran_order")? {
            "False" => false,
            "True" => true,
            other => return Err(wrong(format!("has the order “{other}”, not True or False"))),
        };
        let shape = field("shape")?;
        let sizes = sizes(shape).filter(|sizes| sizes.len() <= MOST_AXES).ok_or_else(|| {
            let shape: String = shape.chars().take(80).collect();
            wrong(format!("has the shape {shape}, but a tuple of sizes was expected"))
        })?;
        Ok(Self { element, endian, is_fortran, shape: sizes, start })
    }

    /// Returns the shape as Python writes it.
    pub fn shape_text(&self) -> String {
        let sizes: Vec<String> = self.shape.iter().map(ToString::to_string).collect();
        match &sizes[..] {
            [one] => format!("({one},)"),
            _ => format!("({})", sizes.join(", ")),
        }
    }

    /// Returns the error for a shape that nothing can be drawn of.
    pub fn wrong_shape(&self, source: &Source) -> Error {
        let message = format!(
            "has the shape {}, but (z, y, x) was expected for a volume, (y, x) of at least 16 each \
             for a picture, (n, 3) for points, and (n, 4), (n, 5) or (n, 10) for samples",
            self.shape_text()
        );
        source.error("header", message).hint(
            "a sample is a row of x, y, z, value and then nothing, a radius, or xx, xy, xz, yy, \
             yz, zz",
        )
    }
}

/// Returns the type of numbers that a `descr` names.
fn number_type(descr: &str) -> Option<(Element, Endian)> {
    let inside = descr.trim_matches(['\'', '"']);
    let mut rest = inside.chars();
    let endian = match rest.next()? {
        '>' => Endian::Big,
        // Native order is that of the machine that wrote the file, nearly always this.
        '<' | '|' | '=' => Endian::Little,
        _ => return None,
    };
    let element = match rest.as_str() {
        "b1" => Element::Bool,
        "f2" => Element::Half,
        "c8" => Element::Complex(SampleType::F32),
        "c16" => Element::Complex(SampleType::F64),
        name => Element::Real(match name {
            "u1" => SampleType::U8,
            "i1" => SampleType::I8,
            "u2" => SampleType::U16,
            "i2" => SampleType::I16,
            "u4" => SampleType::U32,
            "i4" => SampleType::I32,
            "u8" => SampleType::U64,
            "i8" => SampleType::I64,
            "f4" => SampleType::F32,
            "f8" => SampleType::F64,
            _ => return None,
        }),
    };
    Some((element, endian))
}

/// Returns the numbers of a Python tuple.
fn sizes(shape: &str) -> Option<Vec<u64>> {
    let inside = shape.strip_prefix('(')?.strip_suffix(')')?.trim_end_matches([',', ' ']);
    if inside.is_empty() {
        return Some(Vec::new());
    }
    // Python 2 wrote `2L`.
    inside.split(',').map(|size| size.trim().trim_end_matches('L').parse().ok()).collect()
}

/// Returns the header's text, and the offset of the data.
fn text(bytes: &[u8]) -> Option<(String, usize)> {
    let version = bytes.strip_prefix(b"\x93NUMPY")?.first()?;
    let (length, start) = match version {
        1 => (usize::from(u16::from_le_bytes(*bytes.get(8..)?.first_chunk()?)), 10),
        2 | 3 => (u32::from_le_bytes(*bytes.get(8..)?.first_chunk()?) as usize, 12),
        _ => return None,
    };
    // Headers of real files are far shorter than this.
    let text = bytes.get(start..)?.get(..length).filter(|text| text.len() <= 1 << 20)?;
    Some((copy::lossy(text), start + length))
}

/// Returns the value of a name in the header, a Python dictionary: the text up to the next comma
/// outside brackets.
fn field<'a>(header: &'a str, name: &str) -> Option<&'a str> {
    let rest = header
        .split_once(&format!("'{name}':"))
        .or_else(|| header.split_once(&format!("\"{name}\":")))?
        .1;
    let mut depth = 0;
    let end = rest.find(|c| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth -= 1,
            _ => {}
        }
        depth == 0 && matches!(c, ',' | '}')
    })?;
    Some(rest[..end].trim())
}

//! VTK's XML image data (`.vti`): a volume as text, as base64 in place, or appended (raw or base64), packed by zlib or
//! not. After the file format's description in the VTK User's Guide.

use super::{
    Endian, SampleType, Source,
    vtk_array::{ArrayEncoding, from_base64},
};
use crate::{
    Error, Result,
    volume::{Lattice, Volume},
};
use glam::{DMat3, DVec3};
use quick_xml::{
    Reader, XmlVersion,
    events::{BytesStart, Event},
};
use std::{borrow::Cow, collections::HashMap};

/// Reads the active scalars of the points: the array that `Scalars` names, else the first with one component. Several
/// pieces are put together. World positions are the file's: `Origin` + `Direction` · (`Spacing` × index).
///
/// # Errors
/// [`Error::Input`] for what is no image data, packed by anything but zlib, without such scalars, cut off, or with samples
/// that are not finite; [`Error::Limit`] for extents over the limits.
pub fn read(source: &Source) -> Result<Volume> {
    let bytes = source.bytes();
    let end = b"</VTKFile>";
    if !bytes[bytes.len().saturating_sub(1024)..].windows(end.len()).any(|w| w == end) {
        return Err(source.error(format!("byte {}", bytes.len()), "the file ends before </VTKFile>"));
    }
    let (xml, appended) = Appended::split(source)?;
    let xml = std::str::from_utf8(xml)
        .map_err(|e| source.error(format!("byte {}", e.valid_up_to()), "the XML is not UTF-8 text"))?;
    let image = Image::read(source, xml)?;
    let lattice = image.lattice(source)?;
    let mut parts = Vec::new();
    for piece in &image.pieces {
        parts.push((piece.extent, image.samples(source, piece, appended.as_ref())?));
    }
    let part = assemble(source, image.extent, parts)?;
    let samples = part.kind.decode(part.bytes, part.endian);
    Volume::new(lattice, samples).map_err(|message| source.error("samples", message))
}

/// First and last index along each axis, both included.
type Extent = [[i64; 2]; 3];

/// The attributes of an element.
type Attributes = HashMap<String, String>;

/// What the XML says.
struct Image<'a> {
    encoding: ArrayEncoding,
    extent: Extent,
    origin: DVec3,
    spacing: DVec3,
    /// Row by row.
    direction: [f64; 9],
    pieces: Vec<Piece<'a>>,
    /// Where appended arrays begin, of points and cells.
    offsets: Vec<usize>,
}

struct Piece<'a> {
    extent: Extent,
    /// The name of the active scalars.
    scalars: Option<String>,
    /// The arrays of the points.
    arrays: Vec<Array<'a>>,
}

struct Array<'a> {
    attributes: Attributes,
    text: Cow<'a, str>,
}

/// The samples of a piece, as bytes.
struct Part<'a> {
    kind: SampleType,
    endian: Endian,
    bytes: Cow<'a, [u8]>,
}

impl<'a> Image<'a> {
    fn read(source: &Source, xml: &'a str) -> Result<Self> {
        let mut image = Self {
            encoding: ArrayEncoding { endian: Endian::Little, wide_counts: false, packed: false },
            extent: [[0, -1]; 3],
            origin: DVec3::ZERO,
            spacing: DVec3::ONE,
            direction: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            pieces: Vec::new(),
            offsets: Vec::new(),
        };
        let mut reader = Reader::from_str(xml);
        reader.config_mut().expand_empty_elements = true;
        let mut inside_points = false;
        // The array that is being read, and how many elements inside it are open.
        let mut array: Option<(Array, usize)> = None;
        loop {
            let at = reader.buffer_position();
            match reader.read_event().map_err(|e| source.error(format!("byte {at}"), format!("is no XML: {e}")))? {
                Event::Start(tag) => match &mut array {
                    Some((_, depth)) => *depth += 1,
                    None => {
                        let attributes = attributes(source, at, &tag)?;
                        let name = tag.name();
                        inside_points |= name.as_ref() == "PointData";
                        if name.as_ref() == "DataArray" {
                            if let Some(offset) = attributes.get("offset") {
                                image.offsets.push(number(source, "offset", offset)?);
                            }
                            array = Some((Array { attributes, text: Cow::Borrowed("") }, 0));
                        } else {
                            image.element(source, name.as_ref(), attributes)?;
                        }
                    }
                },
                Event::End(tag) => match array.take() {
                    Some((array, 0)) => {
                        if let Some(piece) = image.pieces.last_mut().filter(|_| inside_points) {
                            piece.arrays.push(array);
                        }
                    }
                    Some((inner, depth)) => array = Some((inner, depth - 1)),
                    None => inside_points &= tag.name().as_ref() != "PointData",
                },
                // Elements inside an array (its statistics) have texts of their own.
                Event::Text(text) => match &mut array {
                    Some((array, 0)) if array.text.is_empty() => array.text = text.into_inner(),
                    Some((array, 0)) => array.text.to_mut().push_str(&text),
                    _ => {}
                },
                Event::Eof => break,
                _ => {}
            }
        }
        if image.pieces.is_empty() {
            return Err(source.error("XML", "holds no piece of image data"));
        }
        Ok(image)
    }

    /// Takes what an element's attributes say.
    fn element(&mut self, source: &Source, name: &str, mut attributes: Attributes) -> Result<()> {
        match name {
            "VTKFile" => {
                let get = |name: &str| attributes.get(name).map_or("", String::as_str);
                let wrong = |name: &str| {
                    let message = format!("{name}=“{}” is not supported", get(name));
                    Err(source.error("VTKFile", message))
                };
                match get("type") {
                    "ImageData" => {}
                    _ => return wrong("type"),
                }
                self.encoding = ArrayEncoding {
                    endian: match get("byte_order") {
                        "" | "LittleEndian" => Endian::Little,
                        "BigEndian" => Endian::Big,
                        _ => return wrong("byte_order"),
                    },
                    wide_counts: match get("header_type") {
                        "" | "UInt32" => false,
                        "UInt64" => true,
                        _ => return wrong("header_type"),
                    },
                    packed: match get("compressor") {
                        "" => false,
                        "vtkZLibDataCompressor" => true,
                        _ => {
                            let hint = "write the file with the compressor vtkZLibDataCompressor, or none";
                            return wrong("compressor").map_err(|e| e.hint(hint));
                        }
                    },
                };
            }
            "ImageData" => {
                let text = attributes.get("WholeExtent");
                self.extent = extent(source, name, text.ok_or_else(|| source.error(name, "has no WholeExtent"))?)?;
                if let Some(text) = attributes.get("Origin") {
                    self.origin = DVec3::from_array(numbers(source, "Origin", text)?);
                }
                if let Some(text) = attributes.get("Spacing") {
                    self.spacing = DVec3::from_array(numbers(source, "Spacing", text)?);
                }
                if let Some(text) = attributes.get("Direction") {
                    self.direction = numbers(source, "Direction", text)?;
                }
            }
            "Piece" => {
                let text = attributes.get("Extent");
                let extent = extent(source, name, text.ok_or_else(|| source.error(name, "has no Extent"))?)?;
                self.pieces.push(Piece { extent, scalars: None, arrays: Vec::new() });
            }
            "PointData" => {
                if let Some(piece) = self.pieces.last_mut() {
                    piece.scalars = attributes.remove("Scalars");
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn lattice(&self, source: &Source) -> Result<Lattice> {
        let directions = DMat3::from_cols_array(&self.direction).transpose();
        let axes = directions * DMat3::from_diagonal(self.spacing);
        let first = DVec3::from_array(self.extent.map(|[first, _]| first as f64));
        let lattice = Lattice::cartesian(dims(source, &self.extent)?, self.origin + axes * first, axes);
        lattice.validate().map_err(|message| source.error("ImageData", message))?;
        Ok(lattice)
    }

    /// The active scalars of a piece.
    fn samples<'b>(&'b self, source: &Source, piece: &'b Piece, appended: Option<&Appended<'b>>) -> Result<Part<'b>> {
        let named =
            piece.arrays.iter().find(|array| piece.scalars.is_some() && array.get("Name") == piece.scalars.as_deref());
        let array = named.or_else(|| piece.arrays.iter().find(|array| array.components() == "1")).ok_or_else(|| {
            source
                .error("PointData", "holds no array with one number for each point")
                .hint("values of cells are not read; turn them into values of points")
        })?;
        let place = format!("DataArray “{}”", array.get("Name").unwrap_or_default());
        if array.components() != "1" {
            return Err(
                source.error(place, format!("has {} components, but a volume is made of scalars", array.components()))
            );
        }
        let name = array.get("type").unwrap_or_default();
        let kind = sample_type(name).ok_or_else(|| source.error(&place, format!("type “{name}” is not supported")))?;
        let needed = kind.bytes_of(dims(source, &piece.extent)?);
        let size = source.check_bytes("the size of the samples in bytes", needed.unwrap_or(u64::MAX))?;
        let mut endian = self.encoding.endian;
        let packed = match array.get("format").unwrap_or("ascii") {
            "ascii" => {
                endian = Endian::Little;
                let bytes =
                    kind.parse(&array.text, size / kind.bytes()).map_err(|message| source.error(&place, message))?;
                return Ok(Part { kind, endian, bytes: bytes.into() });
            }
            "binary" => from_base64(source, &place, array.text.as_bytes())?.into(),
            "appended" => {
                let appended = appended.ok_or_else(|| source.error(&place, "is appended, but nothing is"))?;
                let offset = array.get("offset").ok_or_else(|| source.error(&place, "has no offset"))?;
                appended.array(source, &place, number(source, &place, offset)?, &self.offsets)?
            }
            other => return Err(source.error(place, format!("format “{other}” is not supported"))),
        };
        Ok(Part { kind, endian, bytes: self.encoding.array(source, &place, packed, size)? })
    }
}

impl Array<'_> {
    fn get(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    fn components(&self) -> &str {
        self.get("NumberOfComponents").map_or("1", str::trim)
    }
}

/// The section behind the XML that arrays refer to by offsets.
struct Appended<'a> {
    base64: bool,
    data: &'a [u8],
}

impl<'a> Appended<'a> {
    /// Cuts a file before its appended section. That one is no XML where it is raw, so it is found by its bytes.
    fn split(source: &'a Source) -> Result<(&'a [u8], Option<Self>)> {
        let bytes = source.bytes();
        let mut tags = bytes.iter().enumerate().filter(|&(_, &b)| b == b'<').map(|(at, _)| at);
        let Some(at) = tags.find(|&at| bytes[at..].starts_with(b"<AppendedData")) else {
            return Ok((bytes, None));
        };
        let place = "AppendedData";
        let (xml, section) = bytes.split_at(at);
        let close = section.iter().position(|&b| b == b'>').ok_or_else(|| source.error(place, "is cut off"))?;
        let (tag, data) = section.split_at(close + 1);
        let tag = String::from_utf8_lossy(tag);
        let base64 = if tag.contains("\"raw\"") || tag.contains("'raw'") {
            false
        } else if tag.contains("\"base64\"") || tag.contains("'base64'") {
            true
        } else {
            return Err(source.error(place, format!("“{tag}” has an encoding that is neither raw nor base64")));
        };
        let end = b"</AppendedData";
        let end = data.windows(end.len()).rposition(|w| w == end);
        let data = data[..end.ok_or_else(|| source.error(place, "has no end"))?].trim_ascii_start();
        let data = data.strip_prefix(b"_").ok_or_else(|| source.error(place, "does not begin with an underscore"))?;
        Ok((xml, Some(Self { base64, data })))
    }

    /// The bytes from an offset on. Base64 ends with the section or where the next array begins, raw bytes say
    /// themselves how many there are.
    fn array(&self, source: &Source, place: &str, offset: usize, offsets: &[usize]) -> Result<Cow<'a, [u8]>> {
        let message = || format!("begins at offset {offset}, but the appended data have {} bytes", self.data.len());
        let data = self.data.get(offset..).ok_or_else(|| source.error(place, message()))?;
        if !self.base64 {
            return Ok(data.into());
        }
        let next = offsets.iter().filter(|&&other| other > offset).min().map_or(usize::MAX, |next| next - offset);
        Ok(from_base64(source, place, &data[..data.len().min(next)])?.into())
    }
}

/// Puts pieces together to the whole extent. Neighbouring pieces share the points between them.
fn assemble<'a>(source: &Source, whole: Extent, parts: Vec<(Extent, Part<'a>)>) -> Result<Part<'a>> {
    let wrong = |message: &str| source.error("Piece", message);
    let size = dims(source, &whole)?;
    let count: u64 = size.iter().map(|&n| n as u64).product();
    let mut held = 0u64;
    let (mut kind, mut endian) = (SampleType::U8, Endian::Little);
    for (i, (extent, part)) in parts.iter().enumerate() {
        let inside = extent.iter().zip(&whole).all(|(piece, whole)| whole[0] <= piece[0] && piece[1] <= whole[1]);
        if !inside {
            return Err(wrong(&format!("{i} reaches out of the whole extent")));
        }
        if i > 0 && (part.kind, part.endian) != (kind, endian) {
            return Err(wrong(&format!("{i} is written in another type or format than the first")));
        }
        (kind, endian) = (part.kind, part.endian);
        held += (part.bytes.len() / kind.bytes()) as u64;
    }
    // Before anything is allocated: the pieces must hold enough to fill the whole.
    if held < count {
        return Err(wrong(&format!("holds {held} points with all others, but the whole extent has {count}")));
    }
    if parts.len() == 1 {
        let mut parts = parts;
        return parts.pop().map(|(_, part)| part).ok_or_else(|| wrong("is missing"));
    }
    let width = kind.bytes();
    let mut bytes = vec![0; count as usize * width];
    let mut filled = vec![false; count as usize];
    for (extent, part) in &parts {
        let [nx, ny, nz] = dims(source, extent)?;
        let first: [usize; 3] = std::array::from_fn(|axis| (extent[axis][0] - whole[axis][0]) as usize);
        for (row, values) in part.bytes.chunks_exact(nx * width).enumerate().take(ny * nz) {
            let (j, k) = (first[1] + row % ny, first[2] + row / ny);
            let start = (k * size[1] + j) * size[0] + first[0];
            bytes[start * width..(start + nx) * width].copy_from_slice(values);
            filled[start..start + nx].fill(true);
        }
    }
    match filled.iter().position(|filled| !filled) {
        Some(index) => Err(wrong(&format!("is missing: no piece holds point {index}"))),
        None => Ok(Part { kind, endian, bytes: bytes.into() }),
    }
}

fn sample_type(name: &str) -> Option<SampleType> {
    Some(match name {
        "Int8" => SampleType::I8,
        "UInt8" => SampleType::U8,
        "Int16" => SampleType::I16,
        "UInt16" => SampleType::U16,
        "Int32" => SampleType::I32,
        "UInt32" => SampleType::U32,
        "Int64" => SampleType::I64,
        "UInt64" => SampleType::U64,
        "Float32" => SampleType::F32,
        "Float64" => SampleType::F64,
        _ => return None,
    })
}

fn attributes(source: &Source, at: u64, tag: &BytesStart) -> Result<Attributes> {
    let wrong = |e: String| source.error(format!("byte {at}"), format!("has a wrong attribute: {e}"));
    let mut attributes = Attributes::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|e| wrong(e.to_string()))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| wrong(e.to_string()))?;
        attributes.insert(attribute.key.as_ref().to_owned(), value.into_owned());
    }
    Ok(attributes)
}

fn number<T: std::str::FromStr>(source: &Source, place: &str, text: &str) -> Result<T> {
    text.trim().parse().map_err(|_| source.error(place, format!("“{text}” is not a number that fits here")))
}

fn numbers<const N: usize, T: std::str::FromStr>(source: &Source, place: &str, text: &str) -> Result<[T; N]> {
    let numbers: Result<Vec<T>> = text.split_ascii_whitespace().map(|word| number(source, place, word)).collect();
    numbers?.try_into().map_err(|_| source.error(place, format!("“{text}” is not a list of {N} numbers")))
}

fn extent(source: &Source, place: &str, text: &str) -> Result<Extent> {
    let [x0, x1, y0, y1, z0, z1] = numbers(source, place, text)?;
    Ok([[x0, x1], [y0, y1], [z0, z1]])
}

/// Points along each axis of an extent that holds some, no more of them than the limits allow.
fn dims(source: &Source, extent: &Extent) -> Result<[usize; 3]> {
    let mut dims = [0; 3];
    let mut points = 1u64;
    for (dim, [first, last]) in dims.iter_mut().zip(extent) {
        let length = last.checked_sub(*first).and_then(|n| n.checked_add(1)).and_then(|n| u64::try_from(n).ok());
        let length = length
            .filter(|&n| n > 0)
            .ok_or_else(|| -> Error { source.error("extent", format!("{first} to {last} holds no points")) })?;
        points = points.saturating_mul(length);
        *dim = source.check_bytes("the number of points", points).map(|_| length as usize)?;
    }
    Ok(dims)
}

#[cfg(test)]
mod tests;

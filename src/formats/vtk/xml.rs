//! VTK's XML files of any data set: pieces, their sections, and the arrays in them. Arrays may be
//! text, base64 in place, or appended (raw or base64), compressed or not. Follows the description
//! of the file formats in the VTK User's Guide.

use super::{
    super::{Endian, SampleType},
    array::{ArrayEncoding, Packing, from_base64},
};
use crate::{
    Error, Result,
    input::{Source, copy},
};
use quick_xml::{
    Reader, XmlVersion,
    events::{BytesStart, Event},
};
use std::{borrow::Cow, collections::HashMap};

/// Bytes per element with the names and places of a few attributes.
const ELEMENT: u64 = 1024;

/// First and last index along each axis, both inclusive.
pub type Extent = [[i64; 2]; 3];

/// The attributes of an element.
pub type Attributes = HashMap<String, String>;

/// The content of the XML.
pub struct Document<'a> {
    pub source: &'a Source<'a>,
    /// The kind of data set (`ImageData`, `PPolyData`, `vtkMultiBlockDataSet`, …).
    pub kind: String,
    /// The attributes of the data set's element.
    pub attributes: Attributes,
    pub pieces: Vec<Piece<'a>>,
    /// The attributes of the data sets of a collection, which lie in other files.
    pub references: Vec<Attributes>,
    encoding: ArrayEncoding,
    /// Offsets of appended arrays, in ascending order.
    offsets: Vec<usize>,
    appended: Option<Appended<'a>>,
}

/// A part of the data set.
pub struct Piece<'a> {
    pub attributes: Attributes,
    sections: Vec<Section<'a>>,
    empty: Section<'a>,
}

/// A group of arrays: `PointData`, `Points`, `Cells`, …
#[derive(Default)]
pub struct Section<'a> {
    name: String,
    pub attributes: Attributes,
    pub arrays: Vec<Array<'a>>,
}

/// An array; its `type` may be one that is not read, as `String` and `Bit`.
pub struct Array<'a> {
    attributes: Attributes,
    text: Cow<'a, str>,
}

/// The section that is being read, and the array in it with the number of open elements inside the
/// array.
#[derive(Default)]
struct Open<'a> {
    section: Option<Section<'a>>,
    array: Option<(Array<'a>, usize)>,
}

/// The numbers of an array, as bytes.
pub struct Part<'a> {
    pub kind: SampleType,
    pub endian: Endian,
    pub bytes: Cow<'a, [u8]>,
}

impl Part<'_> {
    /// Returns the number of numbers.
    pub fn len(&self) -> usize {
        self.bytes.len() / self.kind.bytes()
    }

    pub fn doubles(&self, source: &Source) -> Result<Vec<f64>> {
        source.room::<f64>("the numbers", self.len())?;
        Ok(self.kind.doubles(&self.bytes, self.endian))
    }
}

impl<'a> Document<'a> {
    /// Reads the XML of a file.
    ///
    /// # Errors
    /// [`Error::Input`] for a file that is not XML of VTK, has an unknown compressor, or is cut
    /// off.
    pub fn read(source: &'a Source<'a>) -> Result<Self> {
        let bytes = source.bytes();
        let end = b"</VTKFile>";
        if !bytes[bytes.len().saturating_sub(1024)..].windows(end.len()).any(|w| w == end) {
            return Err(
                source.error(format!("byte {}", bytes.len()), "the file ends before </VTKFile>")
            );
        }
        let (xml, appended) = Appended::split(source)?;
        let xml = source.keep_text(xml, "the XML")?;
        let mut document = Self {
            source,
            kind: String::new(),
            attributes: Attributes::new(),
            pieces: Vec::new(),
            references: Vec::new(),
            encoding: ArrayEncoding { endian: Endian::Little, wide_counts: false, packed: None },
            offsets: Vec::new(),
            appended,
        };
        document.walk(xml)?;
        document.offsets.sort_unstable();
        if document.pieces.is_empty() && document.references.is_empty() {
            let kind = &document.kind;
            return Err(source.error("XML", format!("contains no piece of {kind}")));
        }
        Ok(document)
    }

    fn walk(&mut self, xml: &'a str) -> Result<()> {
        let source = self.source;
        let mut reader = Reader::from_str(xml);
        reader.config_mut().expand_empty_elements = true;
        let mut depth = 0;
        let mut open = Open::default();
        loop {
            let at = reader.buffer_position();
            let event = reader.read_event();
            match &event {
                Ok(Event::Start(_)) => {
                    depth += 1;
                    source.check_depth(&format!("byte {at}"), depth)?;
                    source.spend("the size of the elements in bytes", ELEMENT)?;
                    source.check_time()?;
                }
                Ok(Event::End(_)) => depth -= 1,
                _ => {}
            }
            match event
                .map_err(|e| source.error(format!("byte {at}"), format!("is not valid XML: {e}")))?
            {
                Event::Start(tag) => self.start(&mut open, &tag, at)?,
                Event::End(tag) => self.end(&mut open, tag.name().as_ref()),
                // Elements inside an array (its statistics) have text of their own.
                Event::Text(text) => match &mut open.array {
                    Some((array, 0)) if array.text.is_empty() => array.text = text.into_inner(),
                    Some((array, 0)) => array.text.to_mut().push_str(&text),
                    _ => {}
                },
                Event::Eof => return Ok(()),
                _ => {}
            }
        }
    }

    /// Opens an element: an array, a section, or one of the document.
    fn start(&mut self, open: &mut Open<'a>, tag: &BytesStart, at: u64) -> Result<()> {
        if let Some((_, depth)) = &mut open.array {
            *depth += 1;
            return Ok(());
        }
        let attributes = attributes(self.source, at, tag)?;
        let name = tag.name();
        if matches!(name.as_ref(), "DataArray" | "Array") {
            if let Some(offset) = attributes.get("offset") {
                self.offsets.push(number(self.source, "offset", offset)?);
            }
            open.array = Some((Array { attributes, text: Cow::Borrowed("") }, 0));
        } else if open.section.is_none() && !self.element(name.as_ref(), &attributes)? {
            open.section =
                Some(Section { name: name.as_ref().into(), attributes, arrays: Vec::new() });
        }
        Ok(())
    }

    /// Closes an element. Stores it if it is an array or a section.
    fn end(&mut self, open: &mut Open<'a>, name: &str) {
        match open.array.take() {
            Some((array, 0)) => {
                if let Some(section) = &mut open.section {
                    section.arrays.push(array);
                }
            }
            Some((array, depth)) => open.array = Some((array, depth - 1)),
            None => {
                let ended = open.section.take_if(|section| section.name == name);
                if let (Some(section), Some(piece)) = (ended, self.pieces.last_mut()) {
                    piece.sections.push(section);
                }
            }
        }
    }

    /// Stores an element that is not a section. Returns whether it was one of these.
    fn element(&mut self, name: &str, attributes: &Attributes) -> Result<bool> {
        match name {
            "VTKFile" => {
                self.encoding = encoding(self.source, attributes)?;
                self.kind = attributes.get("type").cloned().unwrap_or_default();
            }
            "Piece" => self.pieces.push(Piece {
                attributes: attributes.clone(),
                sections: Vec::new(),
                empty: Section::default(),
            }),
            "DataSet" => self.references.push(attributes.clone()),
            "Block" | "Partitions" => {}
            _ if name == self.kind => self.attributes = attributes.clone(),
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Returns the `count` numbers of an array.
    pub fn part<'b>(&'b self, array: &'b Array, count: u64) -> Result<Part<'b>> {
        let source = self.source;
        let place = array.place();
        let name = array.get("type").unwrap_or_default();
        let kind = sample_type(name)
            .ok_or_else(|| source.error(&place, format!("type “{name}” is not supported")))?;
        let needed = count.checked_mul(kind.bytes() as u64);
        let size =
            source.check_bytes("the size of the samples in bytes", needed.unwrap_or(u64::MAX))?;
        let mut endian = self.encoding.endian;
        let packed = match array.get("format").unwrap_or("ascii") {
            "ascii" => {
                endian = Endian::Little;
                source.spend("the size of the numbers in bytes", size as u64)?;
                let bytes = kind
                    .parse(&array.text, size / kind.bytes())
                    .map_err(|message| source.error(&place, message))?;
                return Ok(Part { kind, endian, bytes: bytes.into() });
            }
            "binary" => from_base64(source, &place, array.text.as_bytes())?.into(),
            "appended" => {
                let appended = self.appended.as_ref();
                let appended = appended.ok_or_else(|| {
                    source.error(
                        &place,
                        "is appended, but the file has no \
                                                                 appended data",
                    )
                })?;
                let offset =
                    array.get("offset").ok_or_else(|| source.error(&place, "has no offset"))?;
                appended.array(source, &place, number(source, &place, offset)?, &self.offsets)?
            }
            other => return Err(source.error(place, format!("format “{other}” is not supported"))),
        };
        // Not all writers write counts for an empty array.
        let bytes = if size == 0 {
            Cow::Borrowed(&[][..])
        } else {
            self.encoding.array(source, &place, packed, size)?
        };
        Ok(Part { kind, endian, bytes })
    }
}

impl<'a> Piece<'a> {
    /// Returns a section; an empty one if the piece has none with this name.
    pub fn section(&self, name: &str) -> &Section<'a> {
        self.sections.iter().find(|section| section.name == name).unwrap_or(&self.empty)
    }

    /// Returns a number from the attributes; 0 if it is missing.
    pub fn count(&self, source: &Source, name: &str) -> Result<u64> {
        self.attributes.get(name).map_or(Ok(0), |text| number(source, name, text))
    }
}

impl<'a> Section<'a> {
    pub fn array(&self, name: &str) -> Option<&Array<'a>> {
        self.arrays.iter().find(|array| array.get("Name") == Some(name))
    }
}

impl Array<'_> {
    pub fn get(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    /// Returns the number of components; 0 if that is no number.
    pub fn components(&self) -> usize {
        self.get("NumberOfComponents").map_or(1, |text| text.trim().parse().unwrap_or(0))
    }

    /// Returns the type of its numbers; `None` for a type that is not read.
    pub fn sample_type(&self) -> Option<SampleType> {
        sample_type(self.get("type").unwrap_or_default())
    }

    /// Returns its name, for errors.
    pub fn place(&self) -> String {
        format!("DataArray “{}”", self.get("Name").unwrap_or_default())
    }
}

fn encoding(source: &Source, attributes: &Attributes) -> Result<ArrayEncoding> {
    let get = |name: &str| attributes.get(name).map_or("", String::as_str);
    let wrong = |name: &str| {
        let message = format!("{name}=“{}” is not supported", get(name));
        Err(source.error("VTKFile", message))
    };
    Ok(ArrayEncoding {
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
            "" => None,
            name => match Packing::from_name(name) {
                Some(packing) => Some(packing),
                None => {
                    let hint = "write the file with the compressor vtkZLibDataCompressor, or none";
                    return wrong("compressor").map_err(|e| e.hint(hint));
                }
            },
        },
    })
}

/// The section after the XML, to which arrays refer by offsets.
struct Appended<'a> {
    base64: bool,
    data: &'a [u8],
}

impl<'a> Appended<'a> {
    /// Splits a file before its appended section. A raw section is not XML, so the section is found
    /// by its bytes.
    fn split(source: &'a Source) -> Result<(&'a [u8], Option<Self>)> {
        let bytes = source.bytes();
        let mut tags = bytes.iter().enumerate().filter(|&(_, &b)| b == b'<').map(|(at, _)| at);
        let Some(at) = tags.find(|&at| bytes[at..].starts_with(b"<AppendedData")) else {
            return Ok((bytes, None));
        };
        let place = "AppendedData";
        let (xml, section) = bytes.split_at(at);
        let close = section
            .iter()
            .position(|&b| b == b'>')
            .ok_or_else(|| source.error(place, "is cut off"))?;
        let (tag, data) = section.split_at(close + 1);
        let tag = copy::lossy(tag);
        let base64 = if tag.contains("\"raw\"") || tag.contains("'raw'") {
            false
        } else if tag.contains("\"base64\"") || tag.contains("'base64'") {
            true
        } else {
            return Err(source
                .error(place, format!("“{tag}” has an encoding that is neither raw nor base64")));
        };
        let end = b"</AppendedData";
        let end = data.windows(end.len()).rposition(|w| w == end);
        let data = data[..end.ok_or_else(|| source.error(place, "has no end"))?].trim_ascii_start();
        let data = data
            .strip_prefix(b"_")
            .ok_or_else(|| source.error(place, "does not begin with an underscore"))?;
        Ok((xml, Some(Self { base64, data })))
    }

    /// Returns the bytes from an offset on. Base64 ends where the next array begins or with the
    /// section; raw bytes begin with their own size.
    fn array(
        &self,
        source: &Source,
        place: &str,
        offset: usize,
        offsets: &[usize],
    ) -> Result<Cow<'a, [u8]>> {
        let message = || {
            format!(
                "begins at offset {offset}, but the appended data have {} bytes",
                self.data.len()
            )
        };
        let data = self.data.get(offset..).ok_or_else(|| source.error(place, message()))?;
        if !self.base64 {
            return Ok(data.into());
        }
        let next = offsets.get(offsets.partition_point(|&other| other <= offset));
        let next = next.map_or(usize::MAX, |next| next - offset);
        Ok(from_base64(source, place, &data[..data.len().min(next)])?.into())
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

/// Maximum number of attributes of an element; VTK's elements have about a dozen.
const MOST_ATTRIBUTES: usize = 64;

fn attributes(source: &Source, at: u64, tag: &BytesStart) -> Result<Attributes> {
    let wrong =
        |e: String| source.error(format!("byte {at}"), format!("has an invalid attribute: {e}"));
    let mut attributes = Attributes::new();
    for attribute in tag.attributes() {
        // Each attribute is compared with all before it.
        if attributes.len() == MOST_ATTRIBUTES {
            return Err(wrong(format!("there are more than {MOST_ATTRIBUTES}")));
        }
        let attribute = attribute.map_err(|e| wrong(e.to_string()))?;
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|e| wrong(e.to_string()))?;
        attributes.insert(attribute.key.as_ref().to_owned(), value.into_owned());
    }
    Ok(attributes)
}

pub fn number<T: std::str::FromStr>(source: &Source, place: &str, text: &str) -> Result<T> {
    text.trim()
        .parse()
        .map_err(|_| source.error(place, format!("“{text}” is not a valid number here")))
}

pub fn numbers<const N: usize, T: std::str::FromStr>(
    source: &Source,
    place: &str,
    text: &str,
) -> Result<[T; N]> {
    let numbers: Result<Vec<T>> =
        text.split_ascii_whitespace().take(N + 1).map(|word| number(source, place, word)).collect();
    numbers?
        .try_into()
        .map_err(|_| source.error(place, format!("“{text}” is not a list of {N} numbers")))
}

pub fn extent(source: &Source, place: &str, text: &str) -> Result<Extent> {
    let [x0, x1, y0, y1, z0, z1] = numbers(source, place, text)?;
    Ok([[x0, x1], [y0, y1], [z0, z1]])
}

/// Returns the number of points along each axis of an extent. The extent must not be empty, and its
/// points must be within the limits.
pub fn dims(source: &Source, extent: &Extent) -> Result<[usize; 3]> {
    let mut dims = [0; 3];
    let mut points = 1u64;
    for (dim, [first, last]) in dims.iter_mut().zip(extent) {
        let length = last
            .checked_sub(*first)
            .and_then(|n| n.checked_add(1))
            .and_then(|n| u64::try_from(n).ok());
        let length = length.filter(|&n| n > 0).ok_or_else(|| -> Error {
            source.error("extent", format!("{first} to {last} is not a valid range of indices"))
        })?;
        points = points.saturating_mul(length);
        *dim = source.check_bytes("the number of points", points).map(|_| length as usize)?;
    }
    Ok(dims)
}

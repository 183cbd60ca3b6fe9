//! The pages of a file, decoded by the crate `tiff`, behind the limits.

use super::{Meaning, description, imagej::Block};
use crate::{
    Error, Result,
    formats::{
        Endian, SampleType,
        shared::grid::{Element, Grid},
    },
    input::{Source, isolate::isolated, watched::Watched},
};
use std::io::Cursor;
use tiff::{
    ColorType, TiffError,
    decoder::{Decoder, DecodingResult, Limits, ifd::Value},
    tags::{ByteOrder, Tag},
};

/// Bytes that a byte of a compressed page may unpack to. LZW and deflate stay below.
const MOST_UNPACKED: u64 = 1 << 13;

/// Bytes of a field of a directory. Places of strips and descriptions are the longest.
const MOST_FIELD: usize = 64 << 20;

/// How the pixels of a page are stored once they are unpacked. All pages of a stack share it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// Pixels along x and y.
    pub size: [usize; 2],
    element: Element,
    endian: Endian,
    /// Bits of a sample in the file.
    bits: u8,
    /// Samples of a pixel.
    pub components: usize,
    /// Whether the samples of a page are in planes, one after the other.
    in_planes: bool,
    /// Whether the first three samples of a pixel are red, green and blue.
    pub are_colors: bool,
}

/// The pages that are slices.
pub struct Stack {
    pub layout: Layout,
    /// Numbers of the directories; one directory may describe all pages.
    pages: Vec<usize>,
    /// The offset of the first pixel, and the number of pages, if one directory describes all.
    pub contiguous: Option<usize>,
    in_one: usize,
}

/// A decoded page.
pub struct Read {
    pub layout: Layout,
    pub data: Vec<u8>,
    pub meaning: Meaning,
}

/// The bytes of a file. The decoder reads them piece by piece.
type Stream<'a> = Watched<'a, Cursor<&'a [u8]>>;

/// The pages of an open file.
pub struct Pages<'a> {
    source: &'a Source<'a>,
    decoder: Decoder<Stream<'a>>,
    /// Pixels of the first page along x and y.
    size: [usize; 2],
    description: String,
    resolution: Option<[f64; 2]>,
    block: Block,
}

impl Stack {
    /// Returns the number of pages.
    pub fn count(&self) -> usize {
        if self.contiguous.is_some() { self.in_one } else { self.pages.len() }
    }
}

impl Layout {
    /// Returns the layout of pages that were decoded: their numbers are in the machine's order.
    pub fn decoded(self) -> Self {
        let is_big = cfg!(target_endian = "big");
        Self { endian: if is_big { Endian::Big } else { Endian::Little }, ..self }
    }

    /// Returns the block of this many pages.
    pub fn grid(&self, slices: usize) -> Grid {
        let [width, height] = self.size;
        let dims = [width, height, slices];
        let grid = Grid::interleaved(self.element, self.endian, dims, self.components);
        if !self.in_planes {
            return grid;
        }
        let plane = width.saturating_mul(height);
        let strides = [1, width, plane.saturating_mul(self.components)];
        Grid { strides, step: plane, ..grid }
    }

    /// Returns the message for a page of this layout among pages of another.
    pub fn differs(&self, expected: &Self) -> String {
        let of = |layout: &Self| {
            let [width, height] = layout.size;
            let samples = match layout.components {
                1 => String::new(),
                count => format!(" × {count}"),
            };
            format!("{width} × {height} pixels of {}{samples}", layout.element.name())
        };
        format!("has {}, but the first page has {}", of(self), of(expected))
    }
}

impl<'a> Pages<'a> {
    /// Opens a file and reads its first directory.
    pub fn open(source: &'a Source<'a>) -> Result<Self> {
        if !super::is_tiff(source.bytes()) {
            return Err(source.error("header", "is not that of a TIFF or BigTIFF file"));
        }
        let mut limits = Limits::default();
        let most = usize::try_from(source.limits.bytes).unwrap_or(usize::MAX);
        limits.decoding_buffer_size = most;
        limits.intermediate_buffer_size = most;
        limits.ifd_value_size = MOST_FIELD;
        let mut decoder = isolated(source, "page 0", || {
            Decoder::new(Watched::new(source, Cursor::new(source.bytes())))
                .map(|decoder| decoder.with_limits(limits))
                .map_err(|error| page_error(source, 0, &error))
        })?;
        let (description, resolution) = isolated(source, "page 0", || {
            let text = decoder.find_tag(Tag::ImageDescription).ok().flatten();
            let text = text.and_then(|value| value.into_string().ok()).unwrap_or_default();
            let mut ratio = |tag| decoder.find_tag(tag).ok().flatten().and_then(number);
            Ok((text, ratio(Tag::XResolution).zip(ratio(Tag::YResolution)).map(|(x, y)| [x, y])))
        })?;
        let (block, size) = isolated(source, "page 0", || {
            let size = decoder.dimensions().unwrap_or_default();
            Ok((block(&mut decoder), [size.0 as usize, size.1 as usize]))
        })?;
        Ok(Self { source, decoder, size, description, resolution, block })
    }

    /// Returns what the pages mean, as the first one describes them.
    pub fn meaning(&self) -> Meaning {
        description::meaning(&self.description, (self.size, self.resolution), &self.block)
    }

    /// Finds the pages that are slices. All others are previews.
    pub fn stack(&mut self, meaning: &Meaning) -> Result<Stack> {
        let layout = self.layout(0)?;
        let mut pages = Vec::new();
        for page in 0.. {
            self.source.check_time()?;
            let (is_preview, has_more) = self.with(page, |decoder| {
                // Bit 0 marks a reduced version of another page.
                let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType)?;
                Ok((kind.unwrap_or(0) & 1 == 1, decoder.more_images()))
            })?;
            if page == 0 || !is_preview {
                let other = self.layout(page)?;
                if other != layout {
                    let error = self.source.error(format!("page {page}"), other.differs(&layout));
                    return Err(error.hint("write the pages of one size to a file of their own"));
                }
                self.source.spend("the size of the list of pages in bytes", 64)?;
                pages.push(page);
            }
            if !has_more {
                break;
            }
            self.with(page, Decoder::next_image)?;
        }
        let contiguous = match meaning.in_one {
            Some(_) if pages.len() == 1 => self.contiguous()?,
            _ => None,
        };
        Ok(Stack { layout, pages, contiguous, in_one: meaning.in_one.unwrap_or(1) })
    }

    /// Returns where the pixels of the current page begin, if they are not compressed and whole
    /// bytes.
    fn contiguous(&mut self) -> Result<Option<usize>> {
        let layout = self.layout(0)?;
        let place = self.with(0, |decoder| {
            let compression = decoder.find_tag_unsigned::<u32>(Tag::Compression)?.unwrap_or(1);
            let strips = decoder.find_tag_unsigned_vec::<u64>(Tag::StripOffsets)?;
            Ok(strips.and_then(|all| all.first().copied()).filter(|_| compression == 1))
        })?;
        let is_whole = layout.bits >= 8 && !layout.in_planes;
        Ok(place.and_then(|place| usize::try_from(place).ok()).filter(|_| is_whole))
    }

    /// Uses the decoder behind the guard against panics.
    fn with<T>(
        &mut self,
        page: usize,
        work: impl FnOnce(&mut Decoder<Stream<'a>>) -> Result<T, TiffError>,
    ) -> Result<T> {
        let (source, decoder) = (self.source, &mut self.decoder);
        isolated(source, &format!("page {page}"), || {
            work(decoder).map_err(|error| page_error(source, page, &error))
        })
    }

    /// Returns the layout of the current page, and checks its size.
    fn layout(&mut self, page: usize) -> Result<Layout> {
        let (size, color, format, planes, order) = self.with(page, |decoder| {
            let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat)?;
            let planes = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration)?;
            let order = decoder.byte_order();
            Ok((decoder.dimensions()?, decoder.colortype()?, format, planes, order))
        })?;
        let place = || format!("page {page}");
        let (bits, components) = (color.bit_depth(), usize::from(color.num_samples()));
        let format = format.and_then(|all| all.first().copied()).unwrap_or(1);
        let element = number_type(bits, format).ok_or_else(|| {
            let message = format!(
                "has samples of {bits} bits and the format {format}, but integers of 1, 2, 4, 8, \
                 16, 32 or 64 bits or floats of 16, 32 or 64 bits were expected"
            );
            self.source.error(place(), message).hint("write the file with 8, 16 or 32 bits")
        })?;
        if bits < 8 && components > 1 {
            let message = format!("has {components} samples of {bits} bits in a pixel");
            return Err(self.source.error(place(), message).hint("write the file with 8 bits"));
        }
        if matches!(color, ColorType::CMYK(_) | ColorType::CMYKA(_)) {
            let message = "has colours of cyan, magenta, yellow and black";
            return Err(self.source.error(place(), message).hint("write the file in grey or RGB"));
        }
        let layout = Layout {
            size: [size.0 as usize, size.1 as usize],
            element,
            endian: if order == ByteOrder::BigEndian { Endian::Big } else { Endian::Little },
            bits,
            components,
            in_planes: planes == Some(2) && components > 1,
            are_colors: matches!(color, ColorType::RGB(_) | ColorType::RGBA(_)),
        };
        let bytes = layout.grid(1).bytes().unwrap_or(u64::MAX);
        self.source.check_bytes("the size of a page in bytes", bytes)?;
        let there = self.source.bytes().len() as u64;
        if bytes > there.saturating_mul(MOST_UNPACKED) {
            let message = format!("needs {bytes} bytes, but the file has only {there}");
            return Err(self.source.error(place(), message));
        }
        Ok(layout)
    }

    /// Decodes pages, one after the other: their samples in the order of the machine.
    pub fn read(&mut self, stack: &Stack, planes: &[usize]) -> Result<Vec<u8>> {
        let size = stack.layout.grid(1).check(self.source)?;
        let mut all = Vec::new();
        for &plane in planes {
            self.source.check_time()?;
            let page = stack.pages[plane];
            self.with(page, |decoder| decoder.seek_to_image(page))?;
            let data = self.page(page, &stack.layout, size)?;
            all.extend_from_slice(&data);
        }
        Ok(all)
    }

    /// Decodes the current page.
    fn page(&mut self, page: usize, layout: &Layout, size: usize) -> Result<Vec<u8>> {
        // By the decoder, and as samples.
        self.source.lend("the memory to unpack a page in bytes", 2 * size as u64)?;
        let mut result = self.with(page, |decoder| {
            let mut result = DecodingResult::U8(Vec::new());
            decoder.read_image_to_buffer(&mut result)?;
            Ok(result)
        })?;
        let mut buffer = result.as_buffer(0);
        let bytes = buffer.as_bytes_mut();
        let data = if layout.bits < 8 {
            unpacked(bytes, layout.bits, layout.size)
        } else {
            bytes.to_vec()
        };
        if data.len() != size {
            let message = format!("unpacks to {} bytes where {size} were expected", data.len());
            return Err(self.source.error(format!("page {page}"), message));
        }
        Ok(data)
    }
}

/// Reads a file of one page.
pub fn one(source: &Source) -> Result<Read> {
    let mut pages = Pages::open(source)?;
    let layout = pages.layout(0)?;
    let meaning = pages.meaning();
    if pages.with(0, |decoder| Ok(decoder.more_images()))? {
        let message = "has several pages, but each file of a folder is one slice";
        return Err(source.error("page 1", message).hint("name this file alone to read its pages"));
    }
    let size = layout.grid(1).check(source)?;
    let data = pages.page(0, &layout, size)?;
    Ok(Read { layout: layout.decoded(), data, meaning })
}

fn page_error(source: &Source, page: usize, error: &TiffError) -> Error {
    if let Err(error) = source.check_time() {
        return error;
    }
    let wrapped = source.error(format!("page {page}"), format!("cannot be read: {error}"));
    match error {
        TiffError::UnsupportedError(_) => {
            wrapped.hint("write it again without compression: tiffcp -c none IN.tif OUT.tif")
        }
        _ => wrapped,
    }
}

/// Tags of ImageJ: the lengths of the parts of its block of data, and the block.
const BLOCK: [u16; 2] = [50838, 50839];

/// Returns ImageJ's block of data; an empty one of other files.
fn block(decoder: &mut Decoder<Stream>) -> Block {
    let mut field = |tag| decoder.find_tag(Tag::Unknown(tag)).ok().flatten();
    let [lengths, bytes] = BLOCK.map(&mut field);
    let lengths = lengths.and_then(|value| value.into_u64_vec().ok()).unwrap_or_default();
    let bytes = bytes.and_then(|value| value.into_u8_vec().ok()).unwrap_or_default();
    Block { lengths, bytes, is_big: decoder.byte_order() == ByteOrder::BigEndian }
}

/// Returns the number of a field.
fn number(value: Value) -> Option<f64> {
    match value {
        Value::Rational(above, below) => Some(f64::from(above) / f64::from(below)),
        Value::List(values) => values.into_iter().next().and_then(number),
        Value::Float(value) => Some(value.into()),
        Value::Double(value) => Some(value),
        Value::Unsigned(value) => Some(value.into()),
        Value::Short(value) => Some(value.into()),
        _ => None,
    }
}

/// Returns the type of samples by their bits and TIFF's number of their format: 1 unsigned, 2
/// signed, 3 floats, 4 unknown.
fn number_type(bits: u8, format: u16) -> Option<Element> {
    Some(match (bits, format) {
        (16, 3) => Element::Half,
        (1 | 2 | 4 | 8, 1 | 4) => Element::Real(SampleType::U8),
        (8, 2) => Element::Real(SampleType::I8),
        (16, 1 | 4) => Element::Real(SampleType::U16),
        (16, 2) => Element::Real(SampleType::I16),
        (32, 1 | 4) => Element::Real(SampleType::U32),
        (32, 2) => Element::Real(SampleType::I32),
        (32, 3) => Element::Real(SampleType::F32),
        (64, 1 | 4) => Element::Real(SampleType::U64),
        (64, 2) => Element::Real(SampleType::I64),
        (64, 3) => Element::Real(SampleType::F64),
        _ => return None,
    })
}

/// Unpacks rows of samples of 1, 2 or 4 bits, the highest bits first.
fn unpacked(bytes: &[u8], bits: u8, [width, height]: [usize; 2]) -> Vec<u8> {
    let in_byte = 8 / usize::from(bits);
    let row = width.div_ceil(in_byte);
    let mask = (1u16 << bits) as u8 - 1;
    let sample = |row: &[u8], x: usize| {
        let shift = 8 - usize::from(bits) * (x % in_byte + 1);
        row[x / in_byte] >> shift & mask
    };
    let rows = bytes.chunks_exact(row.max(1)).take(height);
    rows.flat_map(|row| (0..width).map(move |x| sample(row, x))).collect()
}

//! Writes LAS 1.4 and LAZ, points with all their attributes, piece by piece.
//!
//! Points have the format 6, or 7 with colours. What that format has no field for goes to extra
//! bytes, which a record describes (LAS specification 1.4 R15, table 24). The coordinate reference
//! system of an input is copied.

use super::{
    super::{
        Attribute, NumberType, Records,
        points::{PointLayout, PointWriter, columns, encode},
    },
    Header, describe,
};
use crate::{
    Error, Result,
    disk::AtomicFile,
    input::{Limits, Source},
    math::keep::Keeper,
};
use glam::DVec3;
use laz::{LasZipCompressor, LazVlr, LazVlrBuilder, laszip::LazItemRecordBuilder};
use std::{
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Bytes of a write buffer.
const BUFFER: usize = 1 << 20;

/// Bytes of the header.
const HEADER: usize = 375;

/// Bytes of a point of format 6, and of its colour in format 7.
const POINT: usize = 30;
const COLOR: usize = 6;

/// The steps of positions, as a part of the largest extent.
const FINENESS: f64 = 1e-8;

/// Normals, by the names of CloudCompare.
const NORMAL: [&str; 3] = ["NormalX", "NormalY", "NormalZ"];

/// Records of coordinate reference systems: as text, and as keys with their numbers and names.
const TEXT: u16 = 2112;
const SYSTEMS: [u16; 4] = [TEXT, 34735, 34736, 34737];

/// A field of points of the format 6 or 7.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Field {
    Intensity,
    ReturnNumber,
    Returns,
    Classification,
    ScanAngle,
    UserData,
    PointSource,
    Time,
    Channel(usize),
}

/// The fields by the names of their attributes, with the types that they hold.
const FIELDS: [(&str, Field, NumberType); 11] = [
    ("intensity", Field::Intensity, NumberType::U16),
    ("return_number", Field::ReturnNumber, NumberType::U8),
    ("number_of_returns", Field::Returns, NumberType::U8),
    ("classification", Field::Classification, NumberType::U8),
    ("scan_angle", Field::ScanAngle, NumberType::F32),
    ("user_data", Field::UserData, NumberType::U8),
    ("point_source_id", Field::PointSource, NumberType::U16),
    ("gps_time", Field::Time, NumberType::F64),
    ("red", Field::Channel(0), NumberType::U16),
    ("green", Field::Channel(1), NumberType::U16),
    ("blue", Field::Channel(2), NumberType::U16),
];

impl Field {
    /// Returns the field that holds the values of an attribute, if one does.
    fn of(attribute: &Attribute) -> Option<Self> {
        let (_, field, kind) = FIELDS.iter().find(|(name, ..)| *name == attribute.name)?;
        let fits = match (attribute.kind.whole(), kind.whole()) {
            (Some([low, high]), Some([least, most])) => least <= low && high <= most,
            (None, None) => true,
            (Some([low, high]), None) => -32768.0 <= low && high <= 65535.0,
            _ => false,
        };
        fits.then_some(*field)
    }

    fn put(self, value: f64, point: &mut [u8]) {
        let value = if value.is_nan() { 0.0 } else { value };
        let short = (value.round() as u16).to_le_bytes();
        match self {
            Self::Intensity => point[12..14].copy_from_slice(&short),
            Self::ReturnNumber => point[14] |= short[0] & 15,
            Self::Returns => point[14] |= short[0] << 4,
            Self::Classification => point[16] = short[0],
            Self::UserData => point[17] = short[0],
            Self::ScanAngle => {
                let steps = (value / 0.006).round() as i16;
                point[18..20].copy_from_slice(&steps.to_le_bytes());
            }
            Self::PointSource => point[20..22].copy_from_slice(&short),
            Self::Time => point[22..30].copy_from_slice(&value.to_le_bytes()),
            Self::Channel(channel) => {
                point[POINT + 2 * channel..][..2].copy_from_slice(&short);
            }
        }
    }
}

/// Where the bytes of points go.
enum Points {
    Plain(BufWriter<AtomicFile>),
    Packed(Box<LasZipCompressor<'static, BufWriter<AtomicFile>>>),
}

/// What is the same for all points of a file.
struct Shape {
    layout: PointLayout,
    /// The field of each attribute; `None` for those in extra bytes.
    fields: Vec<Option<Field>>,
    has_colors: bool,
    /// The steps and the offset of positions.
    grid: [DVec3; 2],
    keeper: Keeper,
    /// Records before the points, each with its user, its number and its bytes.
    records: Vec<(&'static str, u16, Vec<u8>)>,
    is_packed: bool,
}

/// What the header says of the points.
struct Seen {
    /// The corners of the box around them.
    bounds: [DVec3; 2],
    count: u64,
    by_return: [u64; 15],
}

/// A LAS or LAZ file that is being written.
pub struct Writer {
    path: PathBuf,
    shape: Shape,
    seen: Seen,
    points: Points,
}

impl Writer {
    /// Begins a file.
    pub(crate) fn create(path: &Path, layout: PointLayout, is_packed: bool) -> Result<Self> {
        let wrong = |e| Error::output(path, e);
        let mut shape = Shape::new(layout, is_packed)?;
        let items = shape.items().map_err(wrong)?;
        if is_packed {
            let mut bytes = Vec::new();
            items.write_to(&mut bytes).map_err(wrong)?;
            shape.records.push((LazVlr::USER_ID, LazVlr::RECORD_ID, bytes));
        }
        let bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let seen = Seen { bounds, count: 0, by_return: [0; 15] };
        let mut out = BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?);
        let head = [shape.header(&seen), shape.record_bytes()].concat();
        out.write_all(&head).map_err(wrong)?;
        let points = if is_packed {
            let packed = LasZipCompressor::new(out, items);
            Points::Packed(Box::new(packed.map_err(|e| wrong(io::Error::other(e)))?))
        } else {
            Points::Plain(out)
        };
        Ok(Self { path: path.to_owned(), shape, seen, points })
    }

    fn end(self) -> io::Result<(AtomicFile, u64)> {
        let header = self.shape.header(&self.seen);
        let mut out = match self.points {
            Points::Plain(out) => out,
            Points::Packed(mut packed) => {
                packed.done()?;
                packed.into_inner()
            }
        };
        out.seek(SeekFrom::Start(0))?;
        out.write_all(&header)?;
        out.flush()?;
        Ok((out.into_inner().map_err(|error| error.into_error())?, self.seen.count))
    }
}

impl PointWriter for Writer {
    fn put(&mut self, records: &Records) -> Result<()> {
        let bytes = self.shape.encoded(records, &mut self.seen)?;
        let written = match &mut self.points {
            Points::Plain(out) => out.write_all(&bytes),
            Points::Packed(packed) => packed.compress_many(&bytes),
        };
        written.map_err(|e| Error::output(&self.path, e))
    }

    fn finish(self: Box<Self>) -> Result<u64> {
        let path = self.path.clone();
        let (file, count) = self.end().map_err(|e| Error::output(&path, e))?;
        file.commit()?;
        Ok(count)
    }
}

impl Shape {
    fn new(layout: PointLayout, is_packed: bool) -> Result<Self> {
        let fields: Vec<Option<Field>> = layout.attributes.iter().map(Field::of).collect();
        let has_colors =
            layout.has_colors || fields.iter().any(|f| matches!(f, Some(Field::Channel(_))));
        let mut records = match &layout.crs {
            Some(file) => systems(file)?,
            None => layout.code.into_iter().map(keys).collect(),
        };
        let extra = described(&layout, &fields);
        if !extra.is_empty() {
            records.push(("LASF_Spec", 4, extra));
        }
        let (grid, keeper) = (grid(&layout), Keeper::new("LAS", layout.bounds));
        Ok(Self { layout, fields, has_colors, grid, keeper, records, is_packed })
    }

    /// Returns the number of a point's extra bytes.
    fn extra(&self) -> usize {
        let others = self.layout.attributes.iter().zip(&self.fields);
        let others = others.filter(|(_, field)| field.is_none());
        let normals = if self.layout.has_normals { 12 } else { 0 };
        normals + others.map(|(attribute, _)| kind_of(attribute.kind).1).sum::<usize>()
    }

    fn format(&self) -> u8 {
        if self.has_colors { 7 } else { 6 }
    }

    fn size(&self) -> usize {
        POINT + if self.has_colors { COLOR } else { 0 } + self.extra()
    }

    /// Returns how points are packed.
    fn items(&self) -> io::Result<LazVlr> {
        let extra = self.extra() as u16;
        let items = LazItemRecordBuilder::default_for_point_format_id(self.format(), extra);
        Ok(LazVlrBuilder::new(items.map_err(io::Error::other)?).build())
    }

    fn record_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (user, id, data) in &self.records {
            bytes.extend([0; 2]);
            bytes.extend(padded::<16>(user));
            bytes.extend(id.to_le_bytes());
            bytes.extend((data.len() as u16).to_le_bytes());
            bytes.extend([0; 32]);
            bytes.extend(data);
        }
        bytes
    }

    fn header(&self, seen: &Seen) -> Vec<u8> {
        let mut out = Vec::with_capacity(HEADER);
        let has_text = self.records.iter().any(|(_, id, _)| *id == TEXT);
        out.extend(b"LASF\0\0");
        // Bit 4 says that the reference system is a text.
        out.extend((u16::from(has_text) << 4).to_le_bytes());
        out.extend([0; 16]);
        out.extend([1, 4]);
        out.extend(padded::<32>("EXTRACTION"));
        out.extend(padded::<32>(concat!("splatkit ", env!("CARGO_PKG_VERSION"))));
        out.extend([0; 4]);
        out.extend((HEADER as u16).to_le_bytes());
        out.extend(((HEADER + self.record_bytes().len()) as u32).to_le_bytes());
        out.extend((self.records.len() as u32).to_le_bytes());
        out.push(self.format() | if self.is_packed { 0x80 } else { 0 });
        out.extend((self.size() as u16).to_le_bytes());
        // The older counts stay 0 in these formats.
        out.extend([0; 24]);
        let [scale, offset] = self.grid;
        let [low, high] = if seen.count > 0 { seen.bounds } else { [DVec3::ZERO; 2] };
        let numbers = [scale, offset].into_iter().flat_map(|v| v.to_array());
        let ends = [0, 1, 2].into_iter().flat_map(|axis| [high[axis], low[axis]]);
        numbers.chain(ends).for_each(|number| out.extend(number.to_le_bytes()));
        out.extend([0; 20]);
        out.extend(seen.count.to_le_bytes());
        seen.by_return.iter().for_each(|count| out.extend(count.to_le_bytes()));
        debug_assert_eq!(out.len(), HEADER);
        out
    }

    /// Returns points as bytes, and adds them to what is known of all.
    fn encoded(&self, records: &Records, seen: &mut Seen) -> Result<Vec<u8>> {
        let (size, [scale, offset]) = (self.size(), self.grid);
        let columns = columns(records, &self.layout.attributes);
        let mut bytes = Vec::with_capacity(size * records.positions.len());
        for (row, place) in records.positions.iter().enumerate() {
            let start = bytes.len();
            let steps = ((*place - offset) / scale).round();
            if steps.abs().max_element() > f64::from(i32::MAX) {
                return Err(Error::Argument(format!(
                    "a point at {place} cannot be written: LAS positions are steps of {scale} \
                     from {offset}; write .points.ply"
                )));
            }
            let stored = steps * scale + offset;
            self.keeper.check(*place, stored - *place)?;
            seen.bounds = [seen.bounds[0].min(stored), seen.bounds[1].max(stored)];
            bytes.extend(steps.to_array().map(|step| (step as i32).to_le_bytes()).as_flattened());
            bytes.resize(start + POINT + if self.has_colors { COLOR } else { 0 }, 0);
            self.put_color(records.colors.get(row), &mut bytes[start..]);
            for (at, field) in self.fields.iter().enumerate() {
                let value = columns[at].map_or(f64::NAN, |column| column[row]);
                match field {
                    Some(field) => field.put(value, &mut bytes[start..]),
                    None => encode(self.layout.attributes[at].kind, value, &mut bytes),
                }
            }
            if self.layout.has_normals {
                let normal = records.normals.get(row).copied().unwrap_or_default().to_array();
                bytes.extend(normal.map(f32::to_le_bytes).as_flattened());
            }
            let number = usize::from(bytes[start + 14] & 15);
            if let Some(count) = number.checked_sub(1).and_then(|at| seen.by_return.get_mut(at)) {
                *count += 1;
            }
        }
        seen.count += records.positions.len() as u64;
        Ok(bytes)
    }

    /// Writes the colour of a point, unless attributes hold it in 16 bits.
    fn put_color(&self, color: Option<&[u8; 4]>, point: &mut [u8]) {
        if !self.has_colors || self.fields.contains(&Some(Field::Channel(0))) {
            return;
        }
        let color = color.copied().unwrap_or([255; 4]);
        for (channel, part) in color[..3].iter().enumerate() {
            Field::Channel(channel).put(257.0 * f64::from(*part), point);
        }
    }
}

/// Returns a text in `N` bytes.
fn padded<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    let length = text.len().min(N);
    bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
    bytes
}

/// Returns the number of a type in extra bytes, and its size.
fn kind_of(kind: NumberType) -> (u8, usize) {
    match kind {
        NumberType::U8 => (1, 1),
        NumberType::I8 => (2, 1),
        NumberType::U16 => (3, 2),
        NumberType::I16 => (4, 2),
        NumberType::U32 => (5, 4),
        NumberType::I32 => (6, 4),
        NumberType::U64 => (7, 8),
        NumberType::I64 => (8, 8),
        NumberType::F32 => (9, 4),
        NumberType::F64 => (10, 8),
    }
}

/// Returns the record that describes extra bytes; empty without any.
fn described(layout: &PointLayout, fields: &[Option<Field>]) -> Vec<u8> {
    let others = layout.attributes.iter().zip(fields).filter(|(_, field)| field.is_none());
    let others = others.map(|(attribute, _)| (attribute.name.as_str(), attribute.kind));
    let normals = NORMAL.iter().filter(|_| layout.has_normals);
    let all = others.chain(normals.map(|name| (*name, NumberType::F32)));
    let mut bytes = Vec::new();
    for (name, kind) in all {
        bytes.extend([0, 0, kind_of(kind).0, 0]);
        bytes.extend(padded::<32>(name));
        bytes.resize(bytes.len() + 192 - 36, 0);
    }
    bytes
}

/// Returns the steps and the offset of positions: those of the points if all fit.
fn grid(layout: &PointLayout) -> [DVec3; 2] {
    let [low, high] = layout.bounds;
    let fits = |[scale, offset]: &[DVec3; 2]| {
        let steps = ((low - *offset) / *scale).abs().max(((high - *offset) / *scale).abs());
        steps.max_element() < f64::from(i32::MAX)
    };
    layout.grid.filter(fits).unwrap_or_else(|| {
        let extent = (high - low).max_element().max(f64::MIN_POSITIVE);
        let step = 10f64.powf((extent * FINENESS).log10().ceil()).clamp(1e-12, 1e6);
        [DVec3::splat(step), low.floor()]
    })
}

/// Returns the record of a coordinate reference system that is known by its EPSG code: keys of
/// GeoTIFF.
fn keys((code, is_geographic): (u16, bool)) -> (&'static str, u16, Vec<u8>) {
    let (model, key) = if is_geographic { (2, 2048) } else { (1, 3072) };
    // A head, then the kind of system, pixels that are areas, and the code.
    let numbers = [[1, 1, 0, 3], [1024, 0, 1, model], [1025, 0, 1, 1], [key, 0, 1, code]];
    (
        "LASF_Projection",
        34735,
        numbers.as_flattened().iter().flat_map(|n: &u16| n.to_le_bytes()).collect(),
    )
}

/// Returns the records of a file's coordinate reference system; none for files of other formats.
fn systems(file: &Path) -> Result<Vec<(&'static str, u16, Vec<u8>)>> {
    let limits = Limits::default();
    let source = Source::open_in_parts(file, &limits)?;
    const USER: &str = "LASF_Projection";
    let Ok(header) = Header::read(&source) else { return Ok(Vec::new()) };
    let record = |id: u16| Some((USER, id, describe::record(&source, &header, USER, id)?));
    Ok(SYSTEMS.into_iter().filter_map(record).collect())
}

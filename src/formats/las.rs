//! Point clouds from airborne and terrestrial scanners: LAS, its compressed form LAZ, and COPC, a
//! kind of LAZ. Follows the LAS specification 1.4 R15 of the American Society for Photogrammetry
//! and Remote Sensing.
//!
//! The header and the points are read here, so that every count is checked against the bytes
//! present. The `laz` crate unpacks the chunks of points (`packed`).

mod attribute;
mod describe;
mod extra;
mod packed;
mod pieces;
#[cfg(test)]
mod tests;
mod time;
mod write;

pub(super) use pieces::Pieces;
pub(super) use write::Writer;

use super::shared::cloud::{Cloud, colors_of_16_bits, greys};
use crate::{Result, about::Orientation, input::Source, parallel::prelude::*, surface::Mesh};
use attribute::Attribute;
use glam::DVec3;
use std::ops::Range;

/// Reads a point cloud: positions and colours, or intensities as greys if there are no colours.
/// Points that are marked as withheld are left out.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header, fewer points than it counts, and
/// chunks that cannot be unpacked; [`Error::Limit`](crate::Error::Limit) for more points than the
/// limits allow.
pub fn read(source: &Source) -> Result<Mesh> {
    read_named(source, None)
}

/// As [`read`], with the values of the attribute that `scalar` names: `intensity`,
/// `classification`, `return_number`, …, and extra bytes by their names.
///
/// # Errors
/// Those of [`read`]; [`Error::Input`](crate::Error::Input) if the points have no such attribute.
pub fn read_named(source: &Source, scalar: Option<&str>) -> Result<Mesh> {
    let mut header = Header::read(source)?;
    let extras = describe::extras(source, &header);
    header.choose(source, scalar)?;
    let points =
        if header.packed { packed::read(source, &header)? } else { plain(source, &header)? };
    let left_out = header.points - points.len();
    if left_out > 0 {
        tracing::info!(points = left_out, "withheld points are left out");
    }
    source.spend("the size of the points in bytes", POINT * points.len() as u64)?;
    let positions = points.par_iter().map(|point| header.position(point)).collect();
    let mut cloud = Cloud { positions, ..Cloud::default() };
    if header.color_at.is_some() {
        cloud.colors =
            colors_of_16_bits(&points.par_iter().map(|p| p.color).collect::<Vec<[u16; 3]>>());
    }
    if cloud.colors.is_empty() {
        cloud.colors =
            greys(&points.par_iter().map(|p| f32::from(p.intensity)).collect::<Vec<f32>>());
    }
    if let Some(attribute) = &header.attribute {
        cloud.values = points.par_iter().map(|point| point.value).collect();
        cloud.about = attribute.about();
    }
    cloud.about.attributes = attribute::names(&header, &extras);
    cloud.about.crs = describe::crs(source, &header);
    cloud.about.layout = describe::layout(&header);
    cloud.about.orientation = Some(Orientation::SURVEY);
    cloud.into_mesh(source)
}

fn plain(source: &Source, header: &Header) -> Result<Vec<Point>> {
    let data = source.part(plain_bytes(source, header)?)?;
    source.room::<Point>("the points", header.points)?;
    Ok(data.par_chunks_exact(header.size).filter_map(|record| header.point(record)).collect())
}

/// Returns where the bytes of points that are not packed are.
fn plain_bytes(source: &Source, header: &Header) -> Result<Range<usize>> {
    let present = source.len() - header.start;
    let size = (header.points as u64).saturating_mul(header.size as u64);
    if (present as u64) < size {
        let message = format!(
            "counts {} points of {} bytes, {size} in all, but {present} bytes follow",
            header.points, header.size,
        );
        return Err(source.error("header", message).hint("the file is cut"));
    }
    Ok(header.start..header.start + size as usize)
}

/// Bytes per point besides `Point`: its position, its colour in 16 and in 8 bits, its intensity,
/// its value.
const POINT: u64 = 24 + 6 + 4 + 4 + 4;

/// The attributes of a point that are used.
struct Point {
    position: [i32; 3],
    color: [u16; 3],
    intensity: u16,
    /// The value of the attribute that the user names; NaN if none is named.
    value: f32,
}

/// The contents of the header.
struct Header {
    /// Offset of the points, their number, and the bytes of each.
    start: usize,
    points: usize,
    size: usize,
    /// The point format, 0 to 10.
    format: u8,
    packed: bool,
    /// The minor version: 0 to 4.
    minor: u8,
    scale: DVec3,
    offset: DVec3,
    /// Offset of the colour in a point.
    color_at: Option<usize>,
    /// The attribute that the user names.
    attribute: Option<Attribute>,
    /// Offset of the first variable length record, and the number of these records.
    records: (usize, u32),
}

/// Minimum bytes per point of each format.
const SIZES: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Bytes of the longest header, that of version 1.4.
const MOST_HEADER: usize = 375;

impl Header {
    fn read(source: &Source) -> Result<Self> {
        let bytes = source.part(0..source.len().min(MOST_HEADER))?;
        let wrong = |message: String| source.error("header", message);
        let (header, points) =
            Self::parse(&Fields { bytes: &bytes, place: "the header" }).map_err(wrong)?;
        header.check(source.len()).map_err(wrong)?;
        Ok(Self { points: source.check_points("the number of points", points)?, ..header })
    }

    /// Returns the header, still without points, and the number of points that it claims.
    fn parse(field: &Fields) -> Result<(Self, u64), String> {
        if !field.bytes.starts_with(b"LASF") {
            return Err("does not begin with “LASF”".into());
        }
        let header_size = usize::from(u16::from_le_bytes(field.at(94)?));
        let start = u32::from_le_bytes(field.at(96)?) as usize;
        let record_count = u32::from_le_bytes(field.at(100)?);
        let [format] = field.at(104)?;
        let size = usize::from(u16::from_le_bytes(field.at(105)?));
        let mut points = u64::from(u32::from_le_bytes(field.at(107)?));
        let double = |at: usize| field.at(at).map(f64::from_le_bytes);
        let three = |at: usize| -> Result<DVec3, String> {
            Ok(DVec3::new(double(at)?, double(at + 8)?, double(at + 16)?))
        };
        let (scale, offset) = (three(131)?, three(155)?);
        let [major, minor] = field.at(24)?;
        if major != 1 {
            return Err(format!("has version {major}.{minor}, but only 1.0 to 1.4 can be read"));
        }
        // Version 1.4 has a wider count. Writers still fill in the older one if it suffices.
        if minor >= 4 && header_size >= 255 {
            let wide = u64::from_le_bytes(field.at(247)?);
            points = if wide > 0 { wide } else { points };
        }
        let packed = format & 0xc0 != 0;
        let format = format & 0x3f;
        let header = Self {
            start,
            points: 0,
            size,
            format,
            packed,
            minor,
            scale,
            offset,
            color_at: attribute::color_at(format),
            attribute: None,
            records: (header_size, record_count),
        };
        Ok((header, points))
    }

    /// Reads the values of an attribute too, if one is named.
    fn choose(&mut self, source: &Source, name: Option<&str>) -> Result<()> {
        self.attribute = name.map(|name| Attribute::named(source, self, name)).transpose()?;
        Ok(())
    }

    /// Returns an error if points cannot be read as the header of a file of `length` bytes
    /// describes them.
    fn check(&self, length: usize) -> Result<(), String> {
        let Self { start, size, format, scale, offset, .. } = *self;
        let Some(&least) = SIZES.get(usize::from(format)) else {
            return Err(format!("has points of format {format}, but only 0 to 10 can be read"));
        };
        if size < least {
            return Err(format!(
                "has points of {size} bytes, but those of format {format} need {least}"
            ));
        }
        if !scale.is_finite() || !offset.is_finite() || scale.min_element() <= 0.0 {
            return Err(format!(
                "has the scale {scale} and the offset {offset}; both must be finite, and the \
                 scale above 0"
            ));
        }
        let (header_size, _) = self.records;
        if start < header_size || start > length {
            return Err(format!(
                "puts the points at byte {start}, but the file has {length} bytes"
            ));
        }
        Ok(())
    }

    /// Returns a point from its bytes; `None` if it is withheld.
    fn point(&self, record: &[u8]) -> Option<Point> {
        let short = |at: usize| u16::from_le_bytes([record[at], record[at + 1]]);
        let position =
            [0, 4, 8].map(|at| i32::from_le_bytes([0, 1, 2, 3].map(|byte| record[at + byte])));
        let withheld = if self.format < 6 { record[15] & 0x80 } else { record[15] & 0x04 };
        (withheld == 0).then(|| Point {
            position,
            color: self.color_at.map_or([0; 3], |at| [0, 2, 4].map(|channel| short(at + channel))),
            intensity: short(12),
            value: self
                .attribute
                .as_ref()
                .map_or(f32::NAN, |attribute| attribute.value(self.format, record) as f32),
        })
    }

    fn position(&self, point: &Point) -> DVec3 {
        DVec3::from_array(point.position.map(f64::from)) * self.scale + self.offset
    }
}

/// Reads numbers at offsets that may lie beyond the end.
struct Fields<'a> {
    bytes: &'a [u8],
    place: &'static str,
}

impl Fields<'_> {
    fn at<const N: usize>(&self, at: usize) -> Result<[u8; N], String> {
        let bytes = self.bytes.get(at..).and_then(|rest| rest.first_chunk()).copied();
        bytes.ok_or_else(|| {
            format!(
                "{} extends to byte {}, but only {} bytes are \
                     present",
                self.place,
                at + N,
                self.bytes.len()
            )
        })
    }
}

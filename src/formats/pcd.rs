//! PCD, the format of the Point Cloud Library: text, binary, and binary compressed by LZF.

mod header;
mod lzf;
#[cfg(test)]
mod tests;

use super::shared::{attribute, cloud::Cloud};
use crate::{
    Result,
    about::About,
    input::{Source, copy, growing::Growing, text::lines_of},
    parallel::prelude::*,
    surface::Mesh,
};
use glam::{DVec3, Vec3};
use header::{Data, Field, Header};
use std::borrow::Cow;

/// Bytes per point with every attribute, and its index.
const POINT: u64 = 8 + 24 + 12 + 4;

/// Reads a point cloud: `x`, `y`, `z`, and optionally `normal_x`, `normal_y`, `normal_z` (or `nx`,
/// …) and `rgb` or `rgba`. Opacity is ignored, since many writers leave it 0. The format marks
/// missing points by coordinates that are not finite; they are left out. The viewpoint is where the
/// scanner stood. A viewpoint at the origin counts only if the points are in rows and columns,
/// because writers also use it as the default.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header, another size than it claims, data
/// that cannot be unpacked, and lines of text that do not match the header.
/// [`Error::Limit`](crate::Error::Limit) for more points or bytes than the limits allow.
pub fn read(source: &Source) -> Result<Mesh> {
    read_named(source, None)
}

/// As [`read`], with the values of the field that `scalar` names.
///
/// # Errors
/// Those of [`read`]; [`Error::Input`](crate::Error::Input) if no field has the name.
pub fn read_named(source: &Source, scalar: Option<&str>) -> Result<Mesh> {
    let header = header::read(source)?;
    let count = source.check_points("the number of points", header.points)?;
    let find = |names: &[&str]| {
        let is = |field: &&Field| names.iter().any(|name| field.name.eq_ignore_ascii_case(name));
        header.fields.iter().find(is)
    };
    let triple = |names: [&[&str]; 3]| {
        let [a, b, c] = names.map(find);
        Some([a?, b?, c?])
    };
    let Some(position) = triple([&["x"], &["y"], &["z"]]) else {
        return Err(source.error("header", "has no fields “x”, “y” and “z”"));
    };
    let normal = triple([&["normal_x", "nx"], &["normal_y", "ny"], &["normal_z", "nz"]]);
    let color = find(&["rgb", "rgba"]);
    let names: Vec<&str> = header.fields.iter().map(|field| field.name.as_str()).collect();
    let value = scalar.map(|name| attribute::named(source, "header", name, &names)).transpose()?;
    let value = value.map(|at| &header.fields[at]);
    let rows = Rows::find(source, &header, count)?;
    source.spend("the size of the points in bytes", POINT * count as u64)?;
    let three = |row: usize, fields: [&Field; 3]| {
        DVec3::from_array(fields.map(|field| rows.number(row, field)))
    };
    let each = || (0..count).into_par_iter();
    let normals =
        normal.map(|fields| each().map(|row| three(row, fields).as_vec3()).collect::<Vec<Vec3>>());
    let colors = color.map(|field| {
        let bytes = |row| rows.bits(row, field).to_le_bytes();
        each().map(bytes).map(|[b, g, r, _]| [r, g, b, 255]).collect::<Vec<_>>()
    });
    let values = value.map(|field| each().map(|row| rows.number(row, field) as f32).collect());
    let sensor = header.viewpoint.filter(|place| *place != DVec3::ZERO || header.height > 1);
    let cloud = Cloud {
        positions: each().map(|row| three(row, position)).collect(),
        normals: normals.unwrap_or_default(),
        colors: colors.unwrap_or_default(),
        sensors: sensor.map(|place| (place, 0..count)).into_iter().collect(),
        values: values.unwrap_or_default(),
        about: About {
            attributes: {
                let known = [position, normal.unwrap_or(position)].concat();
                let known = |field: &Field| {
                    known.iter().chain(&color).any(|other| std::ptr::eq(*other, field))
                };
                let free = header.fields.iter().filter(|field| !known(field) && field.name != "_");
                free.map(|field| field.name.clone()).collect()
            },
            name: value.map_or(String::new(), |field| field.name.clone()),
            ..About::default()
        },
    };
    cloud.into_mesh(source)
}

/// Where the numbers are.
enum Rows<'a> {
    /// The numbers of a text file, point after point.
    Text { numbers: Vec<f64>, width: usize },
    /// The field of a row begins at `start` · offset + row · stride. If `stride` is `None`, it is
    /// the size of the field: each field is stored for all points in turn.
    Bytes { bytes: Cow<'a, [u8]>, start: usize, stride: Option<usize> },
}

impl<'a> Rows<'a> {
    fn find(source: &'a Source, header: &Header, count: usize) -> Result<Self> {
        let data = &source.bytes()[header.end..];
        let stride = header.fields.iter().map(Field::bytes).sum::<usize>();
        let size = source.check_bytes(
            "the size of the points in bytes",
            (count as u64).saturating_mul(stride as u64),
        )?;
        let sizes = |available: usize, wanted: usize| -> Result<()> {
            if available >= wanted {
                return Ok(());
            }
            Err(source.error(
                "data",
                format!("{available} bytes follow the header where {wanted} were expected"),
            ))
        };
        match header.data {
            Data::Text => Self::of_text(source, header, data, count),
            Data::Binary => {
                sizes(data.len(), size)?;
                Ok(Self::Bytes { bytes: data[..size].into(), start: 1, stride: Some(stride) })
            }
            Data::Packed => {
                sizes(data.len(), 8)?;
                let [packed, unpacked] = [0, 4].map(|at| {
                    u32::from_le_bytes([0, 1, 2, 3].map(|byte| data[at + byte])) as usize
                });
                sizes(data.len() - 8, packed)?;
                if unpacked != size {
                    return Err(source.error(
                        "data",
                        format!("unpacks to {unpacked} bytes where {size} were expected"),
                    ));
                }
                source.room::<u8>("the unpacked points", size)?;
                let bytes = lzf::unpack(&data[8..][..packed], size);
                let bytes = bytes.map_err(|(at, message)| {
                    source.error(
                        format!("byte {}", header.end + 8 + at),
                        format!("the packed data {message}"),
                    )
                })?;
                Ok(Self::Bytes { bytes: bytes.into(), start: count, stride: None })
            }
        }
    }

    fn of_text(source: &Source, header: &Header, data: &[u8], count: usize) -> Result<Self> {
        let width = header.fields.iter().map(|field| field.count).sum::<usize>();
        let mut numbers = Growing::new(source, "the numbers");
        let mut points = 0;
        for (number, line) in (header.lines + 1..).zip(lines_of(data)) {
            let before = numbers.len();
            for word in line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()) {
                let value: f64 = copy::float(word).ok_or_else(|| {
                    let excerpt = copy::excerpt(word);
                    source.error(format!("line {number}"), format!("“{excerpt}” is not a number"))
                })?;
                numbers.push(value)?;
            }
            match numbers.len() - before {
                0 => continue,
                words if words == width => points += 1,
                words => {
                    let message = format!("has {words} numbers where the fields need {width}");
                    return Err(source.error(format!("line {number}"), message));
                }
            }
            if points == count {
                break;
            }
        }
        if points < count {
            return Err(
                source.error("data", format!("has {points} points, but the header claims {count}"))
            );
        }
        Ok(Self::Text { numbers: numbers.into_inner(), width })
    }

    fn number(&self, row: usize, field: &Field) -> f64 {
        match self {
            Self::Text { numbers, width } => numbers[row * width + field.word],
            Self::Bytes { .. } => field.kind.number(self.bytes(row, field)),
        }
    }

    /// Returns the bits of a colour, which is stored as an unsigned number or as a float with the
    /// same bits.
    fn bits(&self, row: usize, field: &Field) -> u32 {
        match self {
            Self::Text { numbers, width } => {
                let number = numbers[row * width + field.word];
                if field.kind.is_float() { (number as f32).to_bits() } else { number as i64 as u32 }
            }
            Self::Bytes { .. } => {
                self.bytes(row, field).first_chunk().map_or(0, |&bytes| u32::from_le_bytes(bytes))
            }
        }
    }

    /// Returns the bytes of a field's first number.
    fn bytes(&self, row: usize, field: &Field) -> &[u8] {
        let Self::Bytes { bytes, start, stride } = self else { return &[] };
        &bytes[start * field.offset + row * stride.unwrap_or(field.bytes())..][..field.size]
    }
}

//! Writes PLY of points with all their attributes, piece by piece.

use super::super::{
    Attribute, NumberType, Records,
    points::{PointLayout, PointWriter, columns, encode},
};
use crate::{
    Error, Result,
    disk::AtomicFile,
    math::keep::{self, Keeper},
};
use std::{
    io::{BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Bytes of a write buffer.
const BUFFER: usize = 1 << 20;

/// Digits of the largest count.
const DIGITS: usize = 20;

/// The names of the channels of colours.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// A PLY file of points that is being written. Colours have 8 bits. Coordinates are 64-bit where 32
/// bits would lose some of them.
pub struct PointFile {
    path: PathBuf,
    out: BufWriter<AtomicFile>,
    layout: PointLayout,
    is_wide: bool,
    keeper: Keeper,
    count: u64,
}

impl PointFile {
    /// Begins a file.
    pub(crate) fn create(path: &Path, layout: PointLayout) -> Result<Self> {
        Self::begin(path, layout, AtomicFile::create(path)?)
    }

    /// Begins a file that holds points for a while. [`end`](Self::end) returns it.
    pub(crate) fn scratch(wanted: &Path, layout: PointLayout) -> Result<Self> {
        Self::begin(wanted, layout, AtomicFile::scratch(wanted, "ply")?)
    }

    fn begin(path: &Path, mut layout: PointLayout, file: AtomicFile) -> Result<Self> {
        if layout.has_colors {
            // Attributes with these names have 16 bits, of which other programs take the lower 8.
            layout.attributes.retain(|other| !CHANNELS.contains(&other.name.as_str()));
        }
        let is_wide = layout.needs_64_bits();
        let keeper = Keeper::new("PLY", layout.bounds);
        let out = BufWriter::with_capacity(BUFFER, file);
        let mut file = Self { path: path.to_owned(), out, layout, is_wide, keeper, count: 0 };
        let header = file.header();
        file.out.write_all(header.as_bytes()).map_err(|e| Error::output(path, e))?;
        Ok(file)
    }

    /// Returns the header, whose length is the same for all counts.
    fn header(&self) -> String {
        let count = self.count.to_string();
        let filling = ".".repeat(DIGITS - count.len());
        let mut text = format!(
            "ply\nformat binary_little_endian 1.0\ncomment splatkit {filling}\n\
             element vertex {count}\n"
        );
        let mut add = |kind: &str, names: &[&str]| {
            names.iter().for_each(|name| text += &format!("property {kind} {name}\n"));
        };
        add(if self.is_wide { "double" } else { "float" }, &["x", "y", "z"]);
        if self.layout.has_normals {
            add("float", &["nx", "ny", "nz"]);
        }
        if self.layout.has_colors {
            add("uchar", &["red", "green", "blue", "alpha"]);
        }
        for Attribute { name, kind } in &self.layout.attributes {
            add(type_name(*kind), &[&name.split_whitespace().collect::<Vec<_>>().join("_")]);
        }
        text + "end_header\n"
    }

    fn encoded(&self, records: &Records) -> Result<Vec<u8>> {
        let columns = columns(records, &self.layout.attributes);
        let mut bytes = Vec::new();
        for (row, place) in records.positions.iter().enumerate() {
            let kept = if self.is_wide { *place } else { keep::single(*place) };
            self.keeper.check(*place, kept - *place)?;
            for part in place.to_array() {
                encode(
                    if self.is_wide { NumberType::F64 } else { NumberType::F32 },
                    part,
                    &mut bytes,
                );
            }
            if self.layout.has_normals {
                let normal = records.normals.get(row).copied().unwrap_or_default().to_array();
                bytes.extend(normal.map(f32::to_le_bytes).as_flattened());
            }
            if self.layout.has_colors {
                bytes.extend(records.colors.get(row).copied().unwrap_or([255; 4]));
            }
            for (attribute, column) in self.layout.attributes.iter().zip(&columns) {
                let value = column.map_or(f64::NAN, |column| column[row]);
                encode(stored(attribute.kind), value, &mut bytes);
            }
        }
        Ok(bytes)
    }

    /// Writes the header again, with the count, and returns the file, which has no name yet.
    pub(crate) fn end(mut self) -> Result<(AtomicFile, u64)> {
        let header = self.header();
        let ended = (self.out.seek(SeekFrom::Start(0)))
            .and_then(|_| self.out.write_all(header.as_bytes()))
            .and_then(|()| self.out.flush());
        ended.map_err(|e| Error::output(&self.path, e))?;
        let file = self.out.into_inner();
        Ok((file.map_err(|e| Error::output(&self.path, e.into_error()))?, self.count))
    }
}

impl PointWriter for PointFile {
    fn put(&mut self, records: &Records) -> Result<()> {
        let bytes = self.encoded(records)?;
        self.count += records.positions.len() as u64;
        self.out.write_all(&bytes).map_err(|e| Error::output(&self.path, e))
    }

    fn finish(self: Box<Self>) -> Result<u64> {
        let (file, count) = self.end()?;
        file.commit()?;
        Ok(count)
    }
}

/// Returns the type that a number has in the file: PLY has no whole numbers of 64 bits.
fn stored(kind: NumberType) -> NumberType {
    match kind {
        NumberType::U64 | NumberType::I64 => NumberType::F64,
        other => other,
    }
}

fn type_name(kind: NumberType) -> &'static str {
    match kind {
        NumberType::U8 => "uchar",
        NumberType::I8 => "char",
        NumberType::U16 => "ushort",
        NumberType::I16 => "short",
        NumberType::U32 => "uint",
        NumberType::I32 => "int",
        NumberType::F32 => "float",
        NumberType::U64 | NumberType::I64 | NumberType::F64 => "double",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        formats::{Stream, points::write_points},
        input::{Limits, testing::*},
    };
    use glam::DVec3;

    fn written(folder: &Folder, layout: PointLayout, records: &Records) -> Result<PathBuf> {
        let path = folder.path("a.points.ply");
        let mut writer = write_points(&path, layout)?;
        writer.put(records)?;
        writer.finish()?;
        Ok(path)
    }

    fn header(path: &Path) -> String {
        let bytes = std::fs::read(path).unwrap();
        let text = crate::input::copy::lossy(&bytes);
        text.split_once("end_header").unwrap().0.to_owned()
    }

    #[test]
    fn colours_of_16_bits_become_bytes() {
        let folder = Folder::new();
        let attribute = |name: &str| Attribute { name: name.into(), kind: NumberType::U16 };
        let names = ["red", "green", "blue", "intensity"];
        let records = Records {
            positions: vec![DVec3::ZERO, DVec3::ONE],
            colors: vec![[1, 2, 3, 255], [255, 128, 0, 255]],
            attributes: names.map(attribute).to_vec(),
            columns: vec![vec![257.0, 65535.0]; 4],
            ..Records::default()
        };
        let layout = PointLayout {
            attributes: records.attributes.clone(),
            has_colors: true,
            bounds: [DVec3::ZERO, DVec3::ONE],
            ..PointLayout::default()
        };
        let path = written(&folder, layout, &records).unwrap();
        let text = header(&path);
        assert!(text.contains("property uchar red\n") && !text.contains("ushort red"), "{text}");
        assert!(text.contains("property ushort intensity\n"), "{text}");
        let limits = Limits::default();
        let mesh = crate::formats::load_mesh(&path, &limits, &Default::default()).unwrap();
        assert_eq!(mesh.colors, records.colors);
    }

    #[test]
    fn coordinates_keep_their_bits() {
        let folder = Folder::new();
        let exact = |kind: &str, value: f64| {
            let mut bytes = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty {kind} x\n\
                 property {kind} y\nproperty {kind} z\nend_header\n"
            )
            .into_bytes();
            for part in [value, 1.0, 1.0, 0.0, 0.0, 0.0] {
                encode(
                    if kind == "double" { NumberType::F64 } else { NumberType::F32 },
                    part,
                    &mut bytes,
                );
            }
            let path = folder.write("in.ply", bytes);
            let limits = Limits::default();
            let stream = Stream::open(&path, &limits).unwrap().unwrap();
            stream.is_wide()
        };
        assert!(exact("double", 0.1) && !exact("float", 0.1));
        let records = Records { positions: vec![DVec3::splat(0.1)], ..Records::default() };
        for (is_wide, name) in [(true, "property double x"), (false, "property float x")] {
            let bounds = [DVec3::ZERO, DVec3::ONE];
            let layout = PointLayout { is_wide, bounds, ..PointLayout::default() };
            let text = header(&written(&folder, layout, &records).unwrap());
            assert!(text.contains(name), "{text}");
        }
    }

    #[test]
    fn places_that_are_lost_are_an_error() {
        let folder = Folder::new();
        let records = Records { positions: vec![DVec3::X * f64::INFINITY], ..Records::default() };
        let error = written(&folder, PointLayout::default(), &records).unwrap_err().to_string();
        assert!(error.contains("PLY cannot hold"), "{error}");
        assert!(!folder.path("a.points.ply").exists());
    }
}

//! Writes PLY of points with all their attributes, piece by piece.

use super::super::{
    Attribute, NumberType, Records,
    points::{PointLayout, PointWriter, columns, encode},
};
use crate::{Error, Result, disk::AtomicFile};
use std::{
    io::{BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Bytes of a write buffer.
const BUFFER: usize = 1 << 20;

/// Digits of the largest count.
const DIGITS: usize = 20;

/// A PLY file of points that is being written. Coordinates are 64-bit where 32 bits would lose
/// some of them.
pub struct PointFile {
    path: PathBuf,
    out: BufWriter<AtomicFile>,
    layout: PointLayout,
    is_wide: bool,
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
        // Colours of 16 bits are attributes with the same names, and say more.
        let is_listed = |name: &str| layout.attributes.iter().any(|other| other.name == name);
        layout.has_colors &= !["red", "green", "blue"].into_iter().all(is_listed);
        let [low, high] = layout.bounds;
        let farthest = low.abs().max(high.abs()).max_element();
        let is_wide = layout.grid.is_some() || farthest > 2.0 * (high - low).max_element();
        let out = BufWriter::with_capacity(BUFFER, file);
        let mut file = Self { path: path.to_owned(), out, layout, is_wide, count: 0 };
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

    fn encoded(&self, records: &Records) -> Vec<u8> {
        let columns = columns(records, &self.layout.attributes);
        let mut bytes = Vec::new();
        for (row, place) in records.positions.iter().enumerate() {
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
        bytes
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
        let bytes = self.encoded(records);
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

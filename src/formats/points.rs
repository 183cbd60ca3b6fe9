//! Files of points with their attributes, written in pieces.

use super::{Attribute, Records};
use crate::{Error, Result};
use glam::DVec3;
use std::path::Path;

/// What a file of points holds.
#[derive(Debug, Clone, Default)]
pub(crate) struct PointLayout {
    /// The attributes of the points, in the order of the columns.
    pub attributes: Vec<Attribute>,
    pub has_normals: bool,
    pub has_colors: bool,
    /// The corners of a box around all points.
    pub bounds: [DVec3; 2],
    /// The steps and the offset of positions that are whole numbers, if the points have such.
    pub grid: Option<[DVec3; 2]>,
    /// Whether an input has coordinates that 32-bit floats do not hold.
    pub is_wide: bool,
    /// A file whose coordinate reference system is kept, if the format can hold it.
    pub crs: Option<std::path::PathBuf>,
    /// The EPSG code of the coordinate reference system, and whether that is geographic.
    pub code: Option<(u16, bool)>,
}

impl PointLayout {
    /// Returns whether floats of 32 bits would lose some of the coordinates.
    pub(super) fn needs_64_bits(&self) -> bool {
        let [low, high] = self.bounds;
        let farthest = low.abs().max(high.abs()).max_element();
        let is_far = farthest > 2.0 * (high - low).max_element() || farthest > f32::MAX.into();
        self.is_wide || self.grid.is_some() || is_far
    }
}

/// A file of points that is being written. It appears once it is finished.
pub(crate) trait PointWriter {
    /// Appends points.
    fn put(&mut self, records: &Records) -> Result<()>;

    /// Returns the names of attributes that the format has no place for.
    fn left_out(&self) -> &[String] {
        &[]
    }

    /// Ends the file, and returns the number of its points.
    fn finish(self: Box<Self>) -> Result<u64>;
}

/// Begins a file of points: `.las`, `.laz`, `.e57` or else PLY.
///
/// # Errors
/// [`Error::Output`] if it cannot be written; [`Error::Argument`] for a format that this build has
/// not.
pub(crate) fn write_points(path: &Path, layout: PointLayout) -> Result<Box<dyn PointWriter>> {
    let extension = path.extension().map(|text| text.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        #[cfg(feature = "las")]
        Some(extension @ ("las" | "laz")) => {
            Ok(Box::new(super::las::Writer::create(path, layout, extension == "laz")?))
        }
        #[cfg(feature = "e57")]
        Some("e57") => Ok(Box::new(super::e57::Writer::create(path, &layout)?)),
        #[cfg(feature = "ply")]
        Some("ply") => Ok(Box::new(super::ply::PointFile::create(path, layout)?)),
        _ => {
            // A build without these formats takes nothing.
            drop(layout);
            Err(Error::Argument(format!("{}: this build writes no such file", path.display())))
        }
    }
}

/// Returns the columns of points in the order of a layout; `None` for those that they lack.
pub(super) fn columns<'a>(
    records: &'a Records,
    attributes: &[Attribute],
) -> Vec<Option<&'a [f64]>> {
    let column = |attribute: &Attribute| {
        let at = records.attributes.iter().position(|known| known.name == attribute.name)?;
        Some(&records.columns[at][..])
    };
    attributes.iter().map(column).collect()
}

/// Returns a number as bytes of a type, the lowest first. Of whole types, the nearest number that
/// they hold; 0 for a missing value.
pub(super) fn encode(kind: super::NumberType, value: f64, out: &mut Vec<u8>) {
    use super::NumberType::*;
    let whole = value.round();
    match kind {
        U8 => out.push(whole as u8),
        I8 => out.extend((whole as i8).to_le_bytes()),
        U16 => out.extend((whole as u16).to_le_bytes()),
        I16 => out.extend((whole as i16).to_le_bytes()),
        U32 => out.extend((whole as u32).to_le_bytes()),
        I32 => out.extend((whole as i32).to_le_bytes()),
        U64 => out.extend((whole as u64).to_le_bytes()),
        I64 => out.extend((whole as i64).to_le_bytes()),
        F32 => out.extend((value as f32).to_le_bytes()),
        F64 => out.extend(value.to_le_bytes()),
    }
}

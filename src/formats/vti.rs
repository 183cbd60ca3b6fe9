//! VTK's XML image data (`.vti`): a volume in any of the encodings of vtk_xml.rs.

use super::{
    Endian, ReadOptions, SampleType,
    shared::holes,
    vtk_xml::{Document, Extent, Part, dims, extent, numbers},
};
use crate::{
    Result,
    input::Source,
    volume::{Lattice, Volume},
};
use glam::{DMat3, DVec3};

/// Reads the active scalars of the points: the array that `Scalars` names, else the first with one
/// component. Several pieces are joined. World positions are the file's: `Origin` + `Direction` ·
/// (`Spacing` × index).
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not image data, is compressed by
/// anything but zlib, has no such scalars, is cut off, or has samples that are not finite;
/// [`Error::Limit`](crate::Error::Limit) for extents over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let document = Document::read(source, "ImageData")?;
    let whole = whole_extent(source, &document, "ImageData")?;
    let lattice = lattice(source, &document, whole)?;
    let part = samples(source, &document, whole)?;
    source.spend("the size of the samples in bytes", part.kind.decoded_bytes(part.bytes.len()))?;
    let samples = part.kind.decode(part.bytes, part.endian);
    holes::volume(source, lattice, samples, options)
}

/// Returns the extent of all pieces together.
pub(super) fn whole_extent(source: &Source, document: &Document, kind: &str) -> Result<Extent> {
    let text = document
        .attributes
        .get("WholeExtent")
        .ok_or_else(|| source.error(kind, "has no WholeExtent"))?;
    extent(source, kind, text)
}

fn lattice(source: &Source, document: &Document, whole: Extent) -> Result<Lattice> {
    let vector = |name: &str, default: DVec3| match document.attributes.get(name) {
        Some(text) => numbers(source, name, text).map(DVec3::from_array),
        None => Ok(default),
    };
    let directions = match document.attributes.get("Direction") {
        Some(text) => DMat3::from_cols_array(&numbers(source, "Direction", text)?).transpose(),
        None => DMat3::IDENTITY,
    };
    let axes = directions * DMat3::from_diagonal(vector("Spacing", DVec3::ONE)?);
    let first = DVec3::from_array(whole.map(|[first, _]| first as f64));
    let lattice = Lattice::cartesian(
        dims(source, &whole)?,
        vector("Origin", DVec3::ZERO)? + axes * first,
        axes,
    );
    lattice.check().map_err(|message| source.error("ImageData", message))?;
    Ok(lattice)
}

/// Returns the active scalars of all pieces.
pub(super) fn samples<'a>(
    source: &Source,
    document: &'a Document,
    whole: Extent,
) -> Result<Part<'a>> {
    let mut parts = Vec::new();
    for piece in &document.pieces {
        let text =
            piece.attributes.get("Extent").ok_or_else(|| source.error("Piece", "has no Extent"))?;
        let extent = extent(source, "Piece", text)?;
        let array = piece.section("PointData").scalars().ok_or_else(|| {
            source
                .error("PointData", "contains no array with one number for each point")
                .hint("cell values are not read; convert them to point values")
        })?;
        if array.components() != "1" {
            let message =
                format!("has {} components, but a volume is made of scalars", array.components());
            return Err(source.error(array.place(), message));
        }
        let count = dims(source, &extent)?.iter().map(|&n| n as u64).product();
        parts.push((extent, document.part(array, count)?));
    }
    assemble(source, whole, parts)
}

/// Maximum average number of copies of a point. In pieces of a single cell, each point occurs eight
/// times, and more often if they overlap. Several pieces may share the same bytes of the file.
const MOST_TIMES: u64 = 64;

/// Joins pieces to the whole extent. Neighbouring pieces share the points between them.
fn assemble<'a>(
    source: &Source,
    whole: Extent,
    parts: Vec<(Extent, Part<'a>)>,
) -> Result<Part<'a>> {
    let wrong = |message: &str| source.error("Piece", message);
    let size = dims(source, &whole)?;
    let count: u64 = size.iter().map(|&n| n as u64).product();
    let mut held = 0u64;
    let (mut kind, mut endian) = (SampleType::U8, Endian::Little);
    for (i, (extent, part)) in parts.iter().enumerate() {
        let inside = extent
            .iter()
            .zip(&whole)
            .all(|(piece, whole)| whole[0] <= piece[0] && piece[1] <= whole[1]);
        if !inside {
            return Err(wrong(&format!("piece {i} extends beyond the whole extent")));
        }
        if i > 0 && (part.kind, part.endian) != (kind, endian) {
            return Err(wrong(&format!("piece {i} has another type or format than the first")));
        }
        (kind, endian) = (part.kind, part.endian);
        held += (part.bytes.len() / kind.bytes()) as u64;
    }
    // Checked before anything is allocated: the pieces must have enough points to fill the whole.
    if held < count {
        return Err(wrong(&format!(
            "all pieces together have {held} points, but the whole extent has {count}"
        )));
    }
    if held / MOST_TIMES > count {
        return Err(wrong(&format!(
            "all pieces together have {held} points, too many for an extent of {count}"
        )));
    }
    if parts.len() == 1 {
        let mut parts = parts;
        return parts.pop().map(|(_, part)| part).ok_or_else(|| wrong("is missing"));
    }
    let width = kind.bytes();
    // The bytes, and a flag per sample whether it is filled.
    source.spend("the size of the samples in bytes", count.saturating_mul(1 + width as u64))?;
    let mut bytes = vec![0; count as usize * width];
    let mut filled = vec![false; count as usize];
    for (extent, part) in &parts {
        source.check_time()?;
        let [nx, ny, nz] = dims(source, extent)?;
        let first: [usize; 3] =
            std::array::from_fn(|axis| (extent[axis][0] - whole[axis][0]) as usize);
        for (row, values) in part.bytes.chunks_exact(nx * width).enumerate().take(ny * nz) {
            let (j, k) = (first[1] + row % ny, first[2] + row / ny);
            let start = (k * size[1] + j) * size[0] + first[0];
            bytes[start * width..(start + nx) * width].copy_from_slice(values);
            filled[start..start + nx].fill(true);
        }
    }
    match filled.iter().position(|filled| !filled) {
        Some(index) => Err(wrong(&format!("no piece contains point {index}"))),
        None => Ok(Part { kind, endian, bytes: bytes.into() }),
    }
}

#[cfg(test)]
mod tests;

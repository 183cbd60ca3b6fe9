//! Image data and rectilinear grids: volumes, whose samples sit at the points or at the centres of
//! the cells.

use super::{
    super::{
        Endian, Place, ReadOptions, SampleType,
        shared::{choice, colors, holes},
    },
    data::{Block, Kind, cells_of, floats},
    files::{DataSet, visit},
    survey::Wanted,
    xml::{Extent, Part, dims},
};
use crate::{
    Result,
    input::Source,
    volume::{Arrangement, Lattice, Samples, Volume},
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// Reads a volume: the array that is wanted, of the only lattice of the file. Pieces are joined.
/// Values of cells become samples at the cells' centres. Colours are kept as such.
pub fn read(source: &Source, options: &ReadOptions, wanted: &Wanted) -> Result<Volume> {
    if !wanted.is_color {
        let (lattice, samples) = grid(source, options, wanted)?;
        let mut volume = holes::volume(source, lattice, samples, options)?;
        volume.about.name = wanted.part.caption(&wanted.array.name, wanted.array.components);
        return Ok(volume);
    }
    let channel = |at: usize| {
        let part = choice::Part::Component(at);
        grid(source, options, &Wanted { part, ..wanted.clone() })
    };
    let (lattice, first) = channel(0)?;
    let rest = (1..wanted.array.components).map(|at| Ok(channel(at)?.1));
    let channels = std::iter::once(Ok(first)).chain(rest).collect::<Result<Vec<_>>>()?;
    let colors = colors::of_channels(source, &channels)?;
    let brightness = colors::brightness(&colors);
    let mut volume = holes::volume(source, lattice, brightness, options)?;
    colors::attach(&mut volume, colors);
    volume.about.name.clone_from(&wanted.array.name);
    Ok(volume)
}

/// Reads the lattice of a file, with the samples of the array that is wanted.
fn grid(source: &Source, options: &ReadOptions, wanted: &Wanted) -> Result<(Lattice, Samples)> {
    let mut grid = Grid::default();
    visit(source, options, &mut |set| {
        if set.blocks.iter().any(Block::is_lattice) {
            grid.add(set, wanted)?;
        }
        Ok(true)
    })?;
    grid.finish(source, wanted.array.place)
}

/// The pieces of a lattice.
#[derive(Default)]
struct Grid {
    /// The indices of all points.
    whole: Option<Extent>,
    origin: DVec3,
    axes: DMat3,
    /// Coordinates along the axes of a rectilinear grid, with the first index of each list.
    places: [Vec<(i64, Vec<f64>)>; 3],
    is_rectilinear: bool,
    parts: Vec<(Extent, Part<'static>)>,
    /// The samples, if the first piece has all of them.
    all: Option<Samples>,
}

impl Grid {
    fn add(&mut self, set: &DataSet, wanted: &Wanted) -> Result<()> {
        let source = set.source;
        for block in &set.blocks {
            if block.point_count == 0 {
                continue;
            }
            let extent = match wanted.array.place {
                Place::Cells => cells_of(&block.extent),
                _ => block.extent,
            };
            let samples = samples(source, block, wanted)?;
            self.add_places(source, block)?;
            (self.origin, self.axes) = (block.origin, block.axes);
            self.whole = Some(match self.whole {
                None if set.is_piece => block.extent,
                None => block.whole,
                Some(whole) if set.is_piece => joined(&whole, &block.extent),
                Some(whole) => whole,
            });
            let is_all = set.blocks.len() == 1 && !set.is_piece && block.extent == block.whole;
            if is_all {
                let size = samples.kind.decoded_bytes(samples.bytes.len());
                source.spend("the size of the samples in bytes", size)?;
                self.all = Some(samples.kind.decode(samples.bytes, samples.endian));
                return Ok(());
            }
            let Part { kind, endian, bytes } = samples;
            if matches!(bytes, std::borrow::Cow::Borrowed(_)) {
                source.room::<u8>("the samples of a piece", bytes.len())?;
            }
            let part = Part { kind, endian, bytes: bytes.into_owned().into() };
            self.parts.push((extent, part));
        }
        Ok(())
    }

    fn add_places(&mut self, source: &Source, block: &Block) -> Result<()> {
        if block.kind != Kind::Rectilinear {
            return Ok(());
        }
        self.is_rectilinear = true;
        for (axis, numbers) in block.places.iter().enumerate() {
            let places = numbers.doubles(source)?;
            self.places[axis].push((block.extent[axis][0], places));
        }
        Ok(())
    }

    /// Returns the lattice and its samples.
    fn finish(mut self, source: &Source, place: Place) -> Result<(Lattice, Samples)> {
        let points = self.whole.ok_or_else(|| source.error("Piece", "contains no points"))?;
        let whole = if place == Place::Cells { cells_of(&points) } else { points };
        let samples = match self.all.take() {
            Some(samples) => samples,
            None => {
                let part = assemble(source, whole, std::mem::take(&mut self.parts))?;
                let size = part.kind.decoded_bytes(part.bytes.len());
                source.spend("the size of the samples in bytes", size)?;
                part.kind.decode(part.bytes, part.endian)
            }
        };
        // The samples were present, so the extent is true and the coordinates along its axes are
        // small beside them.
        Ok((self.lattice(source, (points, whole), place)?, samples))
    }

    fn lattice(
        &self,
        source: &Source,
        (points, whole): (Extent, Extent),
        place: Place,
    ) -> Result<Lattice> {
        // Cells lie half a step behind their first point, but along axes with a single point.
        let is_between = points.map(|[first, last]| place == Place::Cells && last > first);
        let counts = dims(source, &whole)?;
        let lattice = if self.is_rectilinear {
            let mut places = self.coordinates(source, points)?;
            for (places, is_between) in places.iter_mut().zip(is_between) {
                if is_between {
                    *places = places.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
                }
            }
            let arrangement = Arrangement::Rectilinear(Arc::new(places));
            Lattice { dims: counts, origin: DVec3::ZERO, axes: DMat3::IDENTITY, arrangement }
        } else {
            let first: [f64; 3] = std::array::from_fn(|axis| {
                points[axis][0] as f64 + if is_between[axis] { 0.5 } else { 0.0 }
            });
            let origin = self.origin + self.axes * DVec3::from_array(first);
            Lattice::cartesian(counts, origin, self.axes)
        };
        let what = if self.is_rectilinear { "RectilinearGrid" } else { "ImageData" };
        lattice.check().map_err(|message| source.error(what, message))?;
        Ok(lattice)
    }

    /// Returns the coordinates along each axis, joined from all pieces.
    fn coordinates(&self, source: &Source, whole: Extent) -> Result<[Vec<f64>; 3]> {
        let counts = dims(source, &whole)?;
        source.room::<f64>("the coordinates", counts.iter().sum())?;
        let mut joined = counts.map(|count| vec![f64::NAN; count]);
        for (axis, joined) in joined.iter_mut().enumerate() {
            for (first, places) in &self.places[axis] {
                // Pieces lie inside the whole: their samples were joined before.
                let first = (first - whole[axis][0]) as usize;
                joined[first..first + places.len()].copy_from_slice(places);
            }
        }
        Ok(joined)
    }
}

/// Returns the samples of a piece. Those of hidden points or cells are not numbers.
fn samples<'b>(source: &Source, block: &'b Block, wanted: &Wanted) -> Result<Part<'b>> {
    let about = &wanted.array;
    let field = block.field(about.place, &about.name);
    let field = field.filter(|field| field.about.components == about.components);
    let numbers = field
        .and_then(|field| field.numbers.as_ref())
        .ok_or_else(|| source.error("Piece", format!("lacks the array “{}”", about.name)))?;
    let part = numbers.part()?;
    let ghosts = block.ghosts(source, about.place)?;
    let hidden = |index: usize| {
        ghosts.as_ref().is_some_and(|ghosts| match about.place {
            Place::Cells => ghosts.is_hidden_cell(index),
            _ => ghosts.is_hidden_point(index),
        })
    };
    let count = part.len() / about.components.max(1);
    let has_hidden = ghosts.is_some() && (0..count).any(hidden);
    if wanted.part == choice::Part::Whole && !has_hidden {
        return Ok(part);
    }
    let mut values = wanted.part.values(part.doubles(source)?, about.components);
    for (index, value) in values.iter_mut().enumerate() {
        if hidden(index) {
            *value = f64::NAN;
        }
    }
    source.room::<f32>("the values", values.len())?;
    Ok(floats(&values))
}

/// Returns the smallest extent around two.
fn joined(a: &Extent, b: &Extent) -> Extent {
    std::array::from_fn(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])])
}

/// Maximum average number of copies of a point. In pieces of a single cell, each point occurs eight
/// times, and more often if they overlap. Several pieces may share the same bytes of the file.
const MOST_TIMES: u64 = 64;

/// Joins pieces to the whole extent. Neighbouring pieces share the points between them.
fn assemble(
    source: &Source,
    whole: Extent,
    parts: Vec<(Extent, Part<'static>)>,
) -> Result<Part<'static>> {
    let wrong = |message: &str| source.error("Piece", message);
    let size = dims(source, &whole)?;
    let count: u64 = size.iter().map(|&n| n as u64).product();
    let (kind, endian) = alike(source, &whole, count, &parts)?;
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

/// Checks pieces before anything is allocated for their whole: they lie in it, have enough samples
/// to fill it, and are all of one type, which is returned.
fn alike(
    source: &Source,
    whole: &Extent,
    count: u64,
    parts: &[(Extent, Part<'static>)],
) -> Result<(SampleType, Endian)> {
    let wrong = |message: &str| source.error("Piece", message);
    let mut held = 0u64;
    let (mut kind, mut endian) = (SampleType::U8, Endian::Little);
    for (i, (extent, part)) in parts.iter().enumerate() {
        let inside = extent
            .iter()
            .zip(whole)
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
    Ok((kind, endian))
}

#[cfg(test)]
mod tests;

//! VTK's legacy files (`.vtk`), in text and binary: structured points and rectilinear grids as
//! volumes; unstructured grids, polygons and structured grids as scattered samples. Follows the
//! format's description in the VTK User's Guide, and version 5.1 for its cells.

mod parser;
#[cfg(test)]
mod tests;

use super::{ReadOptions, shared::holes, vtk_cells::Cells, vtk_xml::Part, vtr};
use crate::{
    Error, Result,
    input::Source,
    scattered::Points,
    volume::{Lattice, Volume},
};
use glam::{DMat3, DVec3};
use parser::Parser;

/// Maximum number of words that are read from a line.
const MOST_WORDS: usize = 16;

/// A data set as in the file.
#[derive(Default)]
struct DataSet<'a> {
    /// `STRUCTURED_POINTS`, …
    kind: String,
    dims: [u64; 3],
    origin: DVec3,
    spacing: DVec3,
    /// Coordinates along x, y and z of a rectilinear grid.
    places: [Vec<f64>; 3],
    cells: Cells,
    points: Attributes<'a>,
    of_cells: Attributes<'a>,
}

/// The data of the points or of the cells: their count, and arrays of one component with their
/// names.
#[derive(Default)]
struct Attributes<'a> {
    count: usize,
    arrays: Vec<(String, Part<'a>)>,
}

/// Returns whether a file contains a volume: structured points or a rectilinear grid.
///
/// # Errors
/// [`Error::Input`] for a malformed header.
pub fn holds_volume(source: &Source) -> Result<bool> {
    let kind = Parser::open(source)?.1;
    Ok(is_volume(&kind))
}

fn is_volume(kind: &str) -> bool {
    matches!(kind, "STRUCTURED_POINTS" | "RECTILINEAR_GRID")
}

/// Reads structured points or a rectilinear grid: the first scalars of the points.
///
/// # Errors
/// [`Error::Input`] for another data set, missing scalars, a file that is cut off, or numbers that
/// are not finite; [`Error::Limit`] for counts over the limits.
pub fn read_volume(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let mut data = DataSet::read(source)?;
    if !is_volume(&data.kind) {
        return Err(source.error("DATASET", format!("is {}, which is not a volume", data.kind)));
    }
    if data.points.arrays.is_empty() {
        return Err(source
            .error("POINT_DATA", "contains no scalars")
            .hint("cell values are not read; convert them to point values"));
    }
    let (_, part) = data.points.arrays.swap_remove(0);
    source.spend("the size of the samples in bytes", part.kind.decoded_bytes(part.bytes.len()))?;
    let samples = part.kind.decode(part.bytes, part.endian);
    let lattice = if data.kind == "RECTILINEAR_GRID" {
        let found = data.places.each_ref().map(|places| places.len() as u64);
        if found != data.dims {
            let message = format!("there are {found:?} coordinates for {:?} points", data.dims);
            return Err(source.error("DIMENSIONS", message));
        }
        vtr::lattice(data.places)
    } else {
        let dims = data.dims.map(|count| count as usize);
        Lattice::cartesian(dims, data.origin, DMat3::from_diagonal(data.spacing))
    };
    holes::volume(source, lattice, samples, options)
}

/// Reads an unstructured grid, polygons or a structured grid, as [`vtu::read`](super::vtu::read)
/// does.
///
/// # Errors
/// Those of [`read_volume`]. Also [`Error::Input`] if no array is named `scalar`.
pub fn read_samples(source: &Source, options: &ReadOptions) -> Result<Points> {
    let scalar = options.scalar.as_deref();
    let data = DataSet::read(source)?;
    if is_volume(&data.kind) {
        return Err(source.error(
            "DATASET",
            format!(
                "is {}, which is a volume, not scattered \
                                             samples",
                data.kind
            ),
        ));
    }
    let wanted = |attributes: &Attributes| {
        let is = |name: &String| scalar.is_none_or(|scalar| scalar == name);
        attributes.arrays.iter().position(|(name, _)| is(name))
    };
    let count = |place: &str, there: usize, attributes: &Attributes| -> Result<(), Error> {
        let claim = attributes.count;
        if there == claim {
            Ok(())
        } else {
            Err(source.error(place, format!("claims {claim} values, but there are {there}")))
        }
    };
    if let Some(index) = wanted(&data.points) {
        count("POINT_DATA", data.cells.points.len(), &data.points)?;
        let values = data.points.arrays[index].1.doubles(source)?;
        return data.cells.samples_at_points(source, values, options);
    }
    if let Some(index) = wanted(&data.of_cells) {
        count("CELL_DATA", data.cells.ends.len(), &data.of_cells)?;
        let values = data.of_cells.arrays[index].1.doubles(source)?;
        return data.cells.samples_at_centres(source, values, options);
    }
    let arrays = data.points.arrays.iter().chain(&data.of_cells.arrays);
    let names: Vec<&str> = arrays.map(|(name, _)| name.as_str()).collect();
    let message = scalar.map_or("has no scalar".into(), |name| format!("has no scalar “{name}”"));
    let error = source.error("POINT_DATA and CELL_DATA", message);
    Err(error.hint(format!("name one of them: {}", names.join(", "))))
}

impl<'a> DataSet<'a> {
    fn read(source: &'a Source) -> Result<Self> {
        let (mut parser, kind) = Parser::open(source)?;
        let mut data = Self { kind, spacing: DVec3::ONE, ..Self::default() };
        // The data that attributes belong to: none yet, points (`false`) or cells (`true`).
        let mut of_cells: Option<bool> = None;
        while let Some((place, text)) = parser.line()? {
            // No keyword is followed by more words.
            let words: Vec<&str> = text.split_ascii_whitespace().take(MOST_WORDS).collect();
            source.check_time()?;
            let keyword = words[0].to_ascii_uppercase();
            let line = Line { place, keyword, words: &words[1..], text: &text };
            match (line.keyword.as_str(), line.words) {
                ("POINT_DATA", [count]) => {
                    data.points.count = parser.count(&line.place, count)?;
                    of_cells = Some(false);
                }
                ("CELL_DATA", [count]) => {
                    data.of_cells.count = parser.count(&line.place, count)?;
                    of_cells = Some(true);
                }
                ("METADATA", _) => parser.skip_to_blank()?,
                _ if data.geometry(source, &mut parser, &line)? => {}
                _ => data.attribute(source, &mut parser, &line, of_cells)?,
            }
        }
        data.check_count(source)?;
        Ok(data)
    }

    /// Reads the lattice, the points or the cells after their keyword. Returns whether the line is
    /// one of these.
    fn geometry(
        &mut self,
        source: &'a Source,
        parser: &mut Parser<'a>,
        line: &Line,
    ) -> Result<bool> {
        let place = &line.place;
        match (line.keyword.as_str(), line.words) {
            ("DIMENSIONS", sizes) => self.dims = parser.three(place, sizes)?,
            ("ORIGIN", numbers) => {
                self.origin = DVec3::from_array(parser.three(place, numbers)?);
            }
            ("SPACING" | "ASPECT_RATIO", numbers) => {
                self.spacing = DVec3::from_array(parser.three(place, numbers)?);
            }
            ("X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES", [count, kind]) => {
                let axis = usize::from(line.keyword.as_bytes()[0] - b'X');
                self.places[axis] =
                    parser.array(place, parser.count(place, count)?, kind)?.doubles(source)?;
            }
            // Cells that were already read refer to the points that were present then.
            ("POINTS", _) if !(self.cells.points.is_empty() && self.cells.corners.is_empty()) => {
                return Err(source.error(place, "POINTS are given twice, or after the cells"));
            }
            ("POINTS", [count, kind]) => {
                let count = parser.count(place, count)?;
                let numbers =
                    parser.array(place, count.saturating_mul(3), kind)?.doubles(source)?;
                source.room::<DVec3>("the points", count)?;
                self.cells.points = numbers.chunks_exact(3).map(DVec3::from_slice).collect();
            }
            ("CELLS" | "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS", [count, size]) => {
                let (count, size) = (parser.count(place, count)?, parser.count(place, size)?);
                let (corners, ends) = parser.cells(place, count, size)?;
                self.cells.room(source, corners.len(), ends.len())?;
                let added = self.cells.add(&corners, &ends, 0);
                added.map_err(|message| source.error(place, message))?;
            }
            ("CELL_TYPES", [count]) => {
                drop(parser.array(place, parser.count(place, count)?, "int")?);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Reads an attribute after its keyword. Keeps arrays of one component.
    fn attribute(
        &mut self,
        source: &'a Source,
        parser: &mut Parser<'a>,
        line: &Line,
        of_cells: Option<bool>,
    ) -> Result<()> {
        let place = &line.place;
        match (line.keyword.as_str(), line.words) {
            ("LOOKUP_TABLE", [_, count]) => {
                parser.skip_colors(place, parser.count(place, count)?, 4)
            }
            ("FIELD", [_, arrays]) => {
                for _ in 0..parser.count(place, arrays)? {
                    let (name, components, part) = parser.field()?;
                    if let Some(attributes) = self.attributes(of_cells)
                        && components == 1
                        && part.len() == attributes.count
                    {
                        attributes.arrays.push((name, part));
                    }
                }
                Ok(())
            }
            (keyword, [name, rest @ ..]) => {
                let Some(attributes) = self.attributes(of_cells) else {
                    let message = format!(
                        "“{keyword}” is not a known keyword before POINT_DATA or CELL_DATA"
                    );
                    return Err(source.error(place, message));
                };
                let count = attributes.count;
                if let ("COLOR_SCALARS", [components]) = (keyword, rest) {
                    return parser.skip_colors(place, count, parser.count(place, components)?);
                }
                let (components, kind) = layout(source, parser, line, rest)?;
                if keyword == "SCALARS" {
                    parser.expect("LOOKUP_TABLE")?;
                }
                let part = parser.array(place, count.saturating_mul(components), kind)?;
                if components == 1 && keyword == "SCALARS" {
                    attributes.arrays.push((parser::unescaped(name), part));
                }
                Ok(())
            }
            _ => {
                let shown: String = line.text.chars().take(40).collect();
                Err(source.error(place, format!("“{shown}” is not a known keyword")))
            }
        }
    }

    /// Returns an error if the scalars of the points have another number than the points.
    fn check_count(&self, source: &Source) -> Result<()> {
        let points = if self.cells.points.is_empty() {
            let product = self.dims.iter().try_fold(1u64, |product, &n| product.checked_mul(n));
            product.unwrap_or(u64::MAX)
        } else {
            self.cells.points.len() as u64
        };
        if !self.points.arrays.is_empty() && points != self.points.count as u64 {
            let message =
                format!("claims {} points, but the data set has {points}", self.points.count);
            return Err(source.error("POINT_DATA", message));
        }
        Ok(())
    }

    fn attributes(&mut self, of_cells: Option<bool>) -> Option<&mut Attributes<'a>> {
        of_cells.map(|of_cells| if of_cells { &mut self.of_cells } else { &mut self.points })
    }
}

/// A line with a keyword.
struct Line<'a> {
    place: String,
    /// In capitals.
    keyword: String,
    /// The words after the keyword.
    words: &'a [&'a str],
    text: &'a str,
}

/// Returns the number of components of an attribute, and the type of its numbers, from the words
/// after its name.
fn layout<'a>(
    source: &Source,
    parser: &Parser,
    line: &Line,
    rest: &[&'a str],
) -> Result<(usize, &'a str)> {
    Ok(match (line.keyword.as_str(), rest) {
        ("SCALARS" | "GLOBAL_IDS" | "PEDIGREE_IDS" | "EDGE_FLAGS", [kind]) => (1, *kind),
        ("SCALARS", [kind, components]) | ("TEXTURE_COORDINATES", [components, kind]) => {
            (parser.count(&line.place, components)?, *kind)
        }
        ("VECTORS" | "NORMALS", [kind]) => (3, *kind),
        ("TENSORS", [kind]) => (9, *kind),
        ("TENSORS6", [kind]) => (6, *kind),
        (keyword, _) => {
            let message = format!("“{keyword}” is not a known keyword");
            return Err(source.error(&line.place, message));
        }
    })
}

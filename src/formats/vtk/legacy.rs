//! VTK's legacy files (`.vtk`), in text and binary, up to version 5.1. Follows the format's
//! description in the VTK User's Guide.

mod parser;
#[cfg(test)]
mod tests;

use super::{
    super::{Place, shared::choice::Role},
    data::{Block, Corners, Faces, Field, Kind, List, ListKind, Numbers},
    xml::{Extent, Part},
};
use crate::{Result, input::Source};
use glam::{DMat3, DVec3};
use parser::Parser;

/// Maximum number of words that are read from a line.
const MOST_WORDS: usize = 16;

/// The kinds of data sets by their names in the file.
const KINDS: [(&str, Kind); 5] = [
    ("STRUCTURED_POINTS", Kind::Image),
    ("RECTILINEAR_GRID", Kind::Rectilinear),
    ("STRUCTURED_GRID", Kind::Structured),
    ("UNSTRUCTURED_GRID", Kind::Unstructured),
    ("POLYDATA", Kind::Poly),
];

/// The lists of cells of polygonal data, in the order in which cell data count them, with VTK's
/// type of them.
const POLYGONS: [(&str, u8); 4] =
    [("VERTICES", 2), ("LINES", 4), ("POLYGONS", 7), ("TRIANGLE_STRIPS", 6)];

/// Returns whether bytes begin as a legacy file.
pub fn is_legacy(bytes: &[u8]) -> bool {
    bytes.starts_with(b"# vtk DataFile Version")
}

/// Reads the data set of a file.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for another kind of data set and for a file that is cut
/// off; [`Error::Limit`](crate::Error::Limit) for counts over the limits.
pub fn block<'a>(source: &'a Source) -> Result<Block<'a>> {
    DataSet::read(source)?.block(source)
}

/// A data set as in the file.
struct DataSet<'a> {
    kind: Kind,
    /// The indices of the points along each axis.
    extent: Extent,
    origin: DVec3,
    spacing: DVec3,
    /// Coordinates along x, y and z of a rectilinear grid.
    places: [Option<Part<'a>>; 3],
    points: Option<Part<'a>>,
    /// The lists of cells, each with its place in `POLYGONS`.
    lists: Vec<(usize, Vec<f64>, Vec<f64>)>,
    types: Option<Part<'a>>,
    fields: Vec<Field<'a>>,
    /// The numbers of points and of cells that the file claims for its arrays.
    claims: [Option<usize>; 2],
}

impl<'a> DataSet<'a> {
    fn read(source: &'a Source) -> Result<Self> {
        let (mut parser, kind) = Parser::open(source, &KINDS.map(|(name, _)| name))?;
        let mut data = Self {
            kind: KINDS[kind].1,
            extent: [[0, -1]; 3],
            origin: DVec3::ZERO,
            spacing: DVec3::ONE,
            places: [None, None, None],
            points: None,
            lists: Vec::new(),
            types: None,
            fields: Vec::new(),
            claims: [None; 2],
        };
        // Where the attributes that follow sit: nowhere yet, at points or at cells.
        let mut at: Option<Place> = None;
        while let Some((place, text)) = parser.statement()? {
            // No keyword is followed by more words.
            let words: Vec<&str> = text.split_ascii_whitespace().take(MOST_WORDS).collect();
            source.check_time()?;
            let keyword = words[0].to_ascii_uppercase();
            let line = Line { place, keyword, words: &words[1..], text: &text };
            match (line.keyword.as_str(), line.words) {
                ("POINT_DATA", [count]) => {
                    data.claims[0] = Some(parser.count(&line.place, count)?);
                    at = Some(Place::Points);
                }
                ("CELL_DATA", [count]) => {
                    data.claims[1] = Some(parser.count(&line.place, count)?);
                    at = Some(Place::Cells);
                }
                ("METADATA", _) => parser.skip_to_blank()?,
                _ if data.geometry(source, &mut parser, &line)? => {}
                _ => data.attribute(source, &mut parser, &line, at)?,
            }
        }
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
            ("DIMENSIONS", sizes) => {
                let sizes: [i64; 3] = parser.numbers(place, sizes)?;
                self.extent = sizes.map(|size| [0, size.saturating_sub(1)]);
            }
            ("EXTENT", ends) => {
                let [x0, x1, y0, y1, z0, z1] = parser.numbers(place, ends)?;
                self.extent = [[x0, x1], [y0, y1], [z0, z1]];
            }
            ("ORIGIN", numbers) => {
                self.origin = DVec3::from_array(parser.numbers(place, numbers)?);
            }
            ("SPACING" | "ASPECT_RATIO", numbers) => {
                self.spacing = DVec3::from_array(parser.numbers(place, numbers)?);
            }
            ("X_COORDINATES" | "Y_COORDINATES" | "Z_COORDINATES", [count, kind]) => {
                let axis = usize::from(line.keyword.as_bytes()[0] - b'X');
                let count = parser.count(place, count)?;
                self.places[axis] = Some(parser.array(place, count, kind)?);
            }
            ("POINTS", _) if self.points.is_some() => {
                return Err(source.error(place, "POINTS are given twice"));
            }
            ("POINTS", [count, kind]) => {
                let count = parser.count(place, count)?;
                self.points = Some(parser.array(place, count.saturating_mul(3), kind)?);
            }
            ("CELLS" | "VERTICES" | "LINES" | "POLYGONS" | "TRIANGLE_STRIPS", [count, size]) => {
                let (count, size) = (parser.count(place, count)?, parser.count(place, size)?);
                let (corners, ends) = parser.cells(place, count, size)?;
                let order = POLYGONS.iter().position(|(name, _)| *name == line.keyword);
                self.lists.push((order.unwrap_or(0), corners, ends));
            }
            ("CELL_TYPES", [count]) => {
                self.types = Some(parser.array(place, parser.count(place, count)?, "int")?);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Reads an attribute after its keyword.
    fn attribute(
        &mut self,
        source: &'a Source,
        parser: &mut Parser<'a>,
        line: &Line,
        at: Option<Place>,
    ) -> Result<()> {
        let place = &line.place;
        match (line.keyword.as_str(), line.words) {
            ("LOOKUP_TABLE", [_, count]) => {
                parser.colors(place, parser.count(place, count)?, 4).map(drop)
            }
            ("FIELD", [_, arrays]) => {
                for _ in 0..parser.count(place, arrays)? {
                    let array = parser.field()?;
                    if let Some(at) = at {
                        self.add_field(at, array);
                    }
                }
                Ok(())
            }
            (keyword, [name, rest @ ..]) => {
                let Some(at) = at else {
                    let message = format!(
                        "“{keyword}” is not a known keyword before POINT_DATA or CELL_DATA"
                    );
                    return Err(source.error(place, message));
                };
                let count = self.claims[usize::from(at == Place::Cells)].unwrap_or(0);
                let name = parser::unescaped(name);
                if let ("COLOR_SCALARS", [components]) = (keyword, rest) {
                    let components = parser.count(place, components)?;
                    let part = parser.colors(place, count, components)?;
                    self.fields.push(Field::ready(name, at, components, Role::Scalars, part));
                    return Ok(());
                }
                let (components, kind) = layout(source, parser, line, rest)?;
                if keyword == "SCALARS" {
                    parser.skip_line_of("LOOKUP_TABLE")?;
                }
                let part = parser.values(place, count.saturating_mul(components), kind)?;
                self.fields.push(match part {
                    Some(part) => Field::ready(name, at, components, role(keyword), part),
                    None => Field::unread(name, at, kind.to_ascii_lowercase(), components),
                });
                Ok(())
            }
            _ => {
                let excerpt: String = line.text.chars().take(40).collect();
                Err(source.error(place, format!("“{excerpt}” is not a known keyword")))
            }
        }
    }

    /// Adds an array of a field, if it has one tuple for each point or cell.
    fn add_field(&mut self, at: Place, array: parser::FieldArray<'a>) {
        let parser::FieldArray { name, components, tuples, kind, part } = array;
        if self.claims[usize::from(at == Place::Cells)] != Some(tuples) {
            return;
        }
        self.fields.push(match part {
            Some(part) => Field::ready(name, at, components, Role::None, part),
            None => Field::unread(name, at, kind, components),
        });
    }

    /// Returns the whole as a block, once its counts agree.
    fn block(mut self, source: &Source) -> Result<Block<'a>> {
        let mut block = Block::new(self.kind);
        block.origin = self.origin;
        block.axes = DMat3::from_diagonal(self.spacing);
        block.whole = self.extent;
        if matches!(self.kind, Kind::Image | Kind::Rectilinear | Kind::Structured) {
            block.set_extent(source, self.extent)?;
        }
        if self.kind == Kind::Rectilinear {
            let counts = self.places.each_ref().map(|part| part.as_ref().map_or(0, Part::len));
            let expected = self.extent.map(|[first, last]| (last - first) as usize + 1);
            if counts != expected {
                let message = format!("there are {counts:?} coordinates for {expected:?} points");
                return Err(source.error("DIMENSIONS", message));
            }
            block.places = std::mem::take(&mut self.places)
                .into_iter()
                .flatten()
                .map(Numbers::Ready)
                .collect();
        }
        if !block.is_lattice() {
            let points = self.points.as_ref().map_or(0, |part| part.len() / 3);
            if self.kind == Kind::Structured && points != block.point_count {
                let message = format!("there are {points} POINTS for {} points", block.point_count);
                return Err(source.error("DIMENSIONS", message));
            }
            block.point_count = points;
            block.points = self.points.take().map(Numbers::Ready);
        }
        self.give_cells(source, &mut block)?;
        for (at, there, name) in
            [(0, block.point_count, "POINT_DATA"), (1, block.cell_count, "CELL_DATA")]
        {
            let place = [Place::Points, Place::Cells][at];
            let claim = self.claims[at].filter(|&claim| claim != there);
            if let Some(claim) = claim
                && self.fields.iter().any(|field| field.about.place == place)
            {
                let what = place.name();
                let message = format!("claims {claim} {what}, but the data set has {there}");
                return Err(source.error(name, message));
            }
        }
        block.fields = self.fields;
        Ok(block)
    }

    /// Moves the cells into a block.
    fn give_cells(&mut self, source: &Source, block: &mut Block<'a>) -> Result<()> {
        if self.kind == Kind::Unstructured {
            let lists = self.lists.drain(..).next();
            let types = match (&lists, self.types.take()) {
                (None, types) => types,
                (Some((_, _, ends)), Some(types)) if types.len() == ends.len() => Some(types),
                (Some((_, _, ends)), types) => {
                    let count = types.as_ref().map_or(0, Part::len);
                    let message = format!("there are {count} types for {} cells", ends.len());
                    return Err(source.error("CELL_TYPES", message));
                }
            };
            if let (Some((_, points, ends)), Some(types)) = (lists, types) {
                block.cell_count = ends.len();
                let cells = ListKind::Types { types: Numbers::Ready(types), faces: Faces::None };
                let corners = Corners::Ready { points, ends };
                block.lists.push(List { cells, count: block.cell_count, corners });
            }
        }
        if self.kind == Kind::Poly {
            self.lists.sort_by_key(|(order, ..)| *order);
            for (order, points, ends) in std::mem::take(&mut self.lists) {
                block.cell_count += ends.len();
                let (cells, count) = (ListKind::Of(POLYGONS[order].1), ends.len());
                block.lists.push(List { cells, count, corners: Corners::Ready { points, ends } });
            }
        }
        Ok(())
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

/// Returns what an attribute with a keyword is for.
fn role(keyword: &str) -> Role {
    match keyword {
        "SCALARS" | "COLOR_SCALARS" => Role::Scalars,
        "VECTORS" | "TENSORS" | "TENSORS6" => Role::Vectors,
        "NORMALS" | "TEXTURE_COORDINATES" => Role::Geometry,
        _ => Role::Identifiers,
    }
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

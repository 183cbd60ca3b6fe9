//! A VTK data set, or a piece of one, as its file describes it. Arrays are decoded when they are
//! needed.

use super::{
    super::{
        Endian, Place, SampleType,
        shared::choice::{Candidate, Role},
    },
    xml::{Array, Document, Extent, Part, dims},
};
use crate::{Result, input::Source};
use glam::{DMat3, DVec3};
use std::borrow::Cow;

/// The kinds of data sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Image,
    Rectilinear,
    Structured,
    Unstructured,
    Poly,
}

/// A data set or a piece of it.
pub struct Block<'a> {
    pub kind: Kind,
    /// The indices of all points of the data set, along the axes of a lattice or structured grid.
    pub whole: Extent,
    /// The indices of this piece.
    pub extent: Extent,
    /// Image data: the position of index (0, 0, 0), and the steps between points.
    pub origin: DVec3,
    pub axes: DMat3,
    /// Rectilinear grids: the coordinates along each axis.
    pub places: Vec<Numbers<'a>>,
    pub point_count: usize,
    pub cell_count: usize,
    /// The positions of the points, three numbers each; `None` for lattices, and if there are none.
    pub points: Option<Numbers<'a>>,
    pub lists: Vec<List<'a>>,
    pub fields: Vec<Field<'a>>,
}

/// An array of values.
pub struct Field<'a> {
    pub about: Candidate,
    pub numbers: Option<Numbers<'a>>,
}

/// Numbers in a file.
pub enum Numbers<'a> {
    Ready(Part<'a>),
    Xml { document: &'a Document<'a>, array: &'a Array<'a>, count: u64 },
}

/// A list of cells.
pub struct List<'a> {
    pub cells: ListKind<'a>,
    pub count: usize,
    /// The points of all cells, one cell after the other.
    pub corners: Corners<'a>,
}

/// What the cells of a list are.
pub enum ListKind<'a> {
    /// All are of this one of VTK's types.
    Of(u8),
    /// Each has its own, and polyhedra have faces.
    Types { types: Numbers<'a>, faces: Faces<'a> },
}

/// The points of cells.
pub enum Corners<'a> {
    /// The points, and where those of each cell end.
    Ready {
        points: Vec<f64>,
        ends: Vec<f64>,
    },
    Xml {
        document: &'a Document<'a>,
        points: &'a Array<'a>,
        ends: &'a Array<'a>,
    },
}

/// The faces of polyhedra.
pub enum Faces<'a> {
    None,
    /// For each polyhedron the number of faces, then for each face the number of its points and
    /// the points; and where each cell's stream ends, −1 for other cells.
    Stream {
        document: &'a Document<'a>,
        stream: &'a Array<'a>,
        ends: &'a Array<'a>,
    },
    /// Since VTK 9.4: the points of all faces and where each face ends, and the faces of all cells
    /// and where those of each cell end.
    Lists {
        document: &'a Document<'a>,
        arrays: [&'a Array<'a>; 4],
    },
}

impl Numbers<'_> {
    pub fn part(&self) -> Result<Part<'_>> {
        match self {
            Self::Ready(part) => {
                Ok(Part { kind: part.kind, endian: part.endian, bytes: Cow::Borrowed(&part.bytes) })
            }
            Self::Xml { document, array, count } => document.part(array, *count),
        }
    }

    pub fn doubles(&self, source: &Source) -> Result<Vec<f64>> {
        self.part()?.doubles(source)
    }
}

impl<'a> Block<'a> {
    /// An empty block.
    pub fn new(kind: Kind) -> Self {
        Self {
            kind,
            whole: [[0; 2]; 3],
            extent: [[0; 2]; 3],
            origin: DVec3::ZERO,
            axes: DMat3::IDENTITY,
            places: Vec::new(),
            point_count: 0,
            cell_count: 0,
            points: None,
            lists: Vec::new(),
            fields: Vec::new(),
        }
    }

    /// Sets the indices of the piece, and the counts that follow from them.
    pub fn set_extent(&mut self, source: &Source, extent: Extent) -> Result<()> {
        self.extent = extent;
        self.point_count = dims(source, &extent)?.iter().product();
        self.cell_count = dims(source, &cells_of(&extent))?.iter().product();
        Ok(())
    }

    /// Returns the field with this name at this place.
    pub fn field(&self, place: Place, name: &str) -> Option<&Field<'a>> {
        self.fields.iter().find(|field| field.about.place == place && field.about.name == name)
    }

    /// Returns the numbers of a field that says which points or cells are ghosts, with its name.
    pub fn ghosts(&self, source: &Source, place: Place) -> Result<Option<Ghosts>> {
        for name in ["vtkGhostType", "vtkGhostLevels"] {
            if let Some(Field { about, numbers: Some(numbers) }) = self.field(place, name)
                && about.components == 1
            {
                let of_bits = name == "vtkGhostType";
                return Ok(Some(Ghosts { of_bits, marks: numbers.doubles(source)? }));
            }
        }
        Ok(None)
    }

    pub fn is_lattice(&self) -> bool {
        matches!(self.kind, Kind::Image | Kind::Rectilinear)
    }
}

/// The marks of points or cells that belong to another piece, or are not shown.
pub struct Ghosts {
    of_bits: bool,
    marks: Vec<f64>,
}

impl Ghosts {
    /// Returns whether another piece has the same point or cell.
    pub fn is_copy(&self, index: usize) -> bool {
        let mark = self.marks[index];
        if self.of_bits { mark as u64 & 1 != 0 } else { mark > 0.0 }
    }

    /// Returns whether a point is not to be shown, nor the cells around it.
    pub fn is_hidden_point(&self, index: usize) -> bool {
        self.of_bits && self.marks[index] as u64 & 2 != 0
    }

    /// Returns whether a cell is not to be shown: one that is refined elsewhere, or hidden.
    pub fn is_hidden_cell(&self, index: usize) -> bool {
        self.of_bits && self.marks[index] as u64 & (8 | 32) != 0
    }
}

impl Field<'_> {
    /// Returns a field that cannot be read, of the file's own type.
    pub fn unread(name: String, place: Place, kind: String, components: usize) -> Self {
        let about =
            Candidate { name, place, kind, is_numeric: false, components, role: Role::None };
        Self { about, numbers: None }
    }
}

impl<'a> Field<'a> {
    /// Returns a field of decoded numbers.
    pub fn ready(
        name: String,
        place: Place,
        components: usize,
        role: Role,
        part: Part<'a>,
    ) -> Self {
        let about = Candidate {
            name,
            place,
            kind: part.kind.name().into(),
            is_numeric: true,
            components,
            role,
        };
        Self { about, numbers: Some(Numbers::Ready(part)) }
    }
}

/// Returns the indices of the cells between the points of an extent: one fewer along each axis, but
/// one along axes with a single point.
pub fn cells_of(extent: &Extent) -> Extent {
    extent.map(|[first, last]| [first, last.saturating_sub(1).max(first)])
}

/// Returns 32-bit floats as a part.
pub fn floats(values: &[f64]) -> Part<'static> {
    let bytes: Vec<u8> = values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect();
    Part { kind: SampleType::F32, endian: Endian::Little, bytes: bytes.into() }
}

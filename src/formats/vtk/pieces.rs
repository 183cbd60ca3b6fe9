//! The data sets in VTK's XML files, piece by piece.

use super::{
    super::{
        Place,
        shared::choice::{Candidate, Role},
    },
    data::{Block, Corners, Faces, Field, Kind, List, ListKind, Numbers},
    xml::{Array, Document, Piece, Section, extent, numbers},
};
use crate::{Result, input::Source};
use glam::{DMat3, DVec3};

/// The sections of polygonal data that contain cells, each with the attribute that counts its cells
/// and VTK's type of them. They are in the order in which cell data count them.
const POLYGONS: &[(&str, &str, u8)] = &[
    ("Verts", "NumberOfVerts", 2),
    ("Lines", "NumberOfLines", 4),
    ("Polys", "NumberOfPolys", 7),
    ("Strips", "NumberOfStrips", 6),
];

/// Returns the pieces of a file that holds a single data set.
pub fn blocks<'b>(document: &'b Document<'b>) -> Result<Vec<Block<'b>>> {
    let source = document.source;
    let kind = match document.kind.as_str() {
        "ImageData" => Kind::Image,
        "RectilinearGrid" => Kind::Rectilinear,
        "StructuredGrid" => Kind::Structured,
        "UnstructuredGrid" => Kind::Unstructured,
        "PolyData" => Kind::Poly,
        other => {
            return Err(source
                .error("VTKFile", format!("type=“{other}” is not supported"))
                .hint("convert it to an unstructured grid (.vtu) or to polygons (.vtp)"));
        }
    };
    document.pieces.iter().map(|piece| block(document, piece, kind)).collect()
}

fn block<'b>(document: &'b Document<'b>, piece: &'b Piece<'b>, kind: Kind) -> Result<Block<'b>> {
    let source = document.source;
    let mut block = Block::new(kind);
    match kind {
        Kind::Image | Kind::Rectilinear | Kind::Structured => {
            grid(document, piece, &mut block)?;
        }
        Kind::Unstructured | Kind::Poly => {
            let count = piece.count(source, "NumberOfPoints")?;
            block.point_count = source.check_points("the number of points", count)?;
            if kind == Kind::Unstructured {
                cells(document, piece, &mut block)?;
            } else {
                polygons(document, piece, &mut block)?;
            }
        }
    }
    if !block.is_lattice() && block.point_count > 0 {
        block.points = Some(points(document, piece, block.point_count)?);
    }
    for (name, place, count) in [
        ("PointData", Place::Points, block.point_count),
        ("CellData", Place::Cells, block.cell_count),
    ] {
        let section = piece.section(name);
        let fields =
            section.arrays.iter().map(|array| field(document, section, array, (place, count)));
        block.fields.extend(fields);
    }
    Ok(block)
}

/// Reads the indices of a piece of a lattice or structured grid, and where the lattice lies.
fn grid<'b>(document: &'b Document, piece: &'b Piece<'b>, block: &mut Block<'b>) -> Result<()> {
    let source = document.source;
    let whole = document
        .attributes
        .get("WholeExtent")
        .ok_or_else(|| source.error(document.kind.as_str(), "has no WholeExtent"))?;
    block.whole = extent(source, &document.kind, whole)?;
    let text =
        piece.attributes.get("Extent").ok_or_else(|| source.error("Piece", "has no Extent"))?;
    block.set_extent(source, extent(source, "Piece", text)?)?;
    if block.kind == Kind::Image {
        let vector = |name: &str, default: DVec3| match document.attributes.get(name) {
            Some(text) => numbers(source, name, text).map(DVec3::from_array),
            None => Ok(default),
        };
        let directions = match document.attributes.get("Direction") {
            Some(text) => DMat3::from_cols_array(&numbers(source, "Direction", text)?).transpose(),
            None => DMat3::IDENTITY,
        };
        block.origin = vector("Origin", DVec3::ZERO)?;
        block.axes = directions * DMat3::from_diagonal(vector("Spacing", DVec3::ONE)?);
    }
    if block.kind == Kind::Rectilinear {
        let arrays = &piece.section("Coordinates").arrays;
        if arrays.len() != 3 {
            let count = arrays.len();
            let message =
                format!("contains {count} arrays, but one for each of 3 axes was expected");
            return Err(source.error("Coordinates", message));
        }
        let counts = block.extent.map(|[first, last]| (last - first) as u64 + 1);
        let numbers = |(array, count)| Numbers::Xml { document, array, count };
        block.places = arrays.iter().zip(counts).map(numbers).collect();
    }
    Ok(())
}

fn points<'b>(
    document: &'b Document<'b>,
    piece: &'b Piece<'b>,
    count: usize,
) -> Result<Numbers<'b>> {
    let source = document.source;
    let Some(array) = piece.section("Points").arrays.first() else {
        return Err(source.error("Points", "contains no array of positions"));
    };
    if array.components() != 3 {
        let message = format!("has {} components, but positions have 3", array.components());
        return Err(source.error(array.place(), message));
    }
    Ok(Numbers::Xml { document, array, count: (count as u64).saturating_mul(3) })
}

fn cells<'b>(
    document: &'b Document<'b>,
    piece: &'b Piece<'b>,
    block: &mut Block<'b>,
) -> Result<()> {
    let source = document.source;
    let count = piece.count(source, "NumberOfCells")?;
    block.cell_count = source.check_points("the number of cells", count)?;
    if count == 0 {
        return Ok(());
    }
    let section = piece.section("Cells");
    let types = Numbers::Xml { document, array: need(source, section, "types")?, count };
    let faces = match (section.array("faces"), section.array("faceoffsets")) {
        (Some(stream), Some(ends)) => Faces::Stream { document, stream, ends },
        _ => {
            let names =
                ["face_connectivity", "face_offsets", "polyhedron_to_faces", "polyhedron_offsets"];
            match names.map(|name| section.array(name)) {
                [Some(a), Some(b), Some(c), Some(d)] => {
                    Faces::Lists { document, arrays: [a, b, c, d] }
                }
                _ => Faces::None,
            }
        }
    };
    let corners = corners(document, section)?;
    let cells = ListKind::Types { types, faces };
    block.lists.push(List { cells, count: block.cell_count, corners });
    Ok(())
}

fn polygons<'b>(
    document: &'b Document<'b>,
    piece: &'b Piece<'b>,
    block: &mut Block<'b>,
) -> Result<()> {
    let source = document.source;
    for &(name, attribute, kind) in POLYGONS {
        let count = piece.count(source, attribute)?;
        let all = count.saturating_add(block.cell_count as u64);
        block.cell_count = source.check_points("the number of cells", all)?;
        if count > 0 {
            let corners = corners(document, piece.section(name))?;
            block.lists.push(List { cells: ListKind::Of(kind), count: count as usize, corners });
        }
    }
    Ok(())
}

fn corners<'b>(document: &'b Document<'b>, section: &'b Section<'b>) -> Result<Corners<'b>> {
    let source = document.source;
    let points = need(source, section, "connectivity")?;
    let ends = need(source, section, "offsets")?;
    Ok(Corners::Xml { document, points, ends })
}

fn need<'b>(source: &Source, section: &'b Section<'b>, name: &str) -> Result<&'b Array<'b>> {
    section.array(name).ok_or_else(|| source.error("Cells", format!("have no array “{name}”")))
}

/// Returns an array of the points or cells, of which there are `count`.
fn field<'b>(
    document: &'b Document<'b>,
    section: &'b Section<'b>,
    array: &'b Array<'b>,
    (place, count): (Place, usize),
) -> Field<'b> {
    let name = array.get("Name").unwrap_or_default().to_owned();
    let components = array.components();
    let Some(kind) = array.sample_type() else {
        let kind = array.get("type").unwrap_or_default().to_ascii_lowercase();
        return Field::unread(name, place, kind, components);
    };
    let is = |role: &str| section.attributes.get(role).is_some_and(|active| *active == name);
    let role = if is("Scalars") {
        Role::Scalars
    } else if is("Vectors") || is("Tensors") {
        Role::Vectors
    } else if is("Normals") || is("TCoords") || is("Tangents") {
        Role::Geometry
    } else if ["GlobalIds", "PedigreeIds", "ProcessIds", "EdgeFlag"].iter().any(|role| is(role)) {
        Role::Identifiers
    } else {
        Role::None
    };
    let about = Candidate {
        name,
        place,
        kind: kind.name().into(),
        is_numeric: components > 0,
        components,
        role,
    };
    let count = (count as u64).saturating_mul(components as u64);
    Field { about, numbers: Some(Numbers::Xml { document, array, count }) }
}

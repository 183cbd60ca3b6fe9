//! VTK's files: legacy (`.vtk`), XML (`.vti`, `.vtr`, `.vts`, `.vtu`, `.vtp`), parallel (`.pvti`,
//! …) and collections of them (`.vtm`, `.vtpc`, `.vtpd`, `.pvd`).
//!
//! `files` walks over the data sets of a file and of those it refers to. `legacy` and `xml` with
//! `pieces` describe each data set as blocks (`data`) whose arrays are decoded on demand. `survey`
//! looks at all blocks and decides what is drawn, and by which array. Then `image` makes a volume
//! of them, or `grid` joins their cells and `surface` makes a mesh.

mod array;
mod data;
mod files;
mod grid;
mod image;
mod legacy;
mod pieces;
mod solid;
mod surface;
mod survey;
#[cfg(test)]
mod tests;
mod xml;

use super::{Array, Kind, Place, ReadOptions, shared::choice::Part};
use crate::{
    Error, Result, cells::Cells, input::Source, scattered::Points, surface::Mesh, volume::Volume,
};
use grid::Grid;
use survey::{Drawn, Survey, Wanted};

/// Returns the kind of data that a file holds:
/// - A single lattice (image data, a rectilinear grid) is a volume.
/// - Cells that fill space are cells, with or without values.
/// - Cells that are surfaces or lines, without others, are a mesh.
/// - Points without either are a point cloud, or samples if a scalar is named.
///
/// # Errors
/// [`Error::Input`] for a file that is not of VTK, is cut off, or lacks the array that is named.
pub fn kind(source: &Source, options: &ReadOptions) -> Result<Kind> {
    let (drawn, _) = Survey::of(source, options)?.drawn(source, options)?;
    Ok(match drawn {
        Drawn::Volume => Kind::Volume,
        Drawn::Cells | Drawn::Boundary => Kind::Cells,
        Drawn::Surface | Drawn::Cloud => Kind::Mesh,
        Drawn::Samples => Kind::Samples,
    })
}

/// Returns the arrays of all data sets, with their ranges. The one that is drawn is marked.
///
/// # Errors
/// Those of [`kind`].
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    Survey::of(source, options)?.arrays(source, options)
}

/// Reads the only lattice of a file as a volume, with the array that [`ReadOptions::scalar`] names.
/// Without it, the array is the file's active scalars, or the first that is not an identifier;
/// vectors show their length. Samples are at the points; those of cells are at the cells' centres.
/// World positions are the file's: `Origin` + `Direction` · (`Spacing` × index).
///
/// # Errors
/// [`Error::Input`] for another kind of data, a file that is cut off, an array that is missing, and
/// if no sample has a value; [`Error::Limit`] for extents over the limits.
pub fn read_volume(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let survey = Survey::of(source, options)?;
    match survey.drawn(source, options)? {
        (Drawn::Volume, Some(wanted)) => {
            survey.warn(source, options, Drawn::Volume);
            image::read(source, options, &wanted)
        }
        (drawn, _) => Err(other(source, drawn, "a volume")),
    }
}

/// Reads the surfaces and lines of a file, the boundary of its cells if they have no values, or its
/// points. The array is chosen as by [`read_volume`], and becomes the mesh's values; an array of
/// bytes with three or four components becomes its colours. Each face has one value if the array is
/// one of the cells.
///
/// # Errors
/// As [`read_volume`], also for cells that refer to missing points.
pub fn read_mesh(source: &Source, options: &ReadOptions) -> Result<Mesh> {
    let survey = Survey::of(source, options)?;
    let (drawn, wanted) = survey.drawn(source, options)?;
    survey.warn(source, options, drawn);
    if drawn == Drawn::Volume {
        return Err(other(source, drawn, "a mesh"));
    }
    let wanted = wanted.filter(|_| drawn != Drawn::Cells);
    let mut grid = Grid::read(source, options, wanted.as_ref())?;
    let mut mesh = match drawn {
        Drawn::Cells | Drawn::Boundary => {
            grid.weld(source, false)?;
            surface::boundary(source, &grid)?
        }
        Drawn::Surface => surface::mesh(source, &grid, wanted.as_ref())?,
        _ => surface::cloud(source, &grid, wanted.as_ref())?,
    };
    if mesh.positions.is_empty() {
        return Err(source.error("file", "contains no points that are not hidden"));
    }
    mesh.about.holes = mesh.values.iter().filter(|value| value.is_nan()).count() as u64;
    if let Some(wanted) = wanted.filter(|wanted| !wanted.is_color) {
        mesh.about.name = caption(&wanted);
    }
    Ok(mesh)
}

/// Reads the cells of a file that fill space, with their values if there are any, and the surfaces
/// beside them. The array is chosen as by [`read_volume`]. Cells of several data sets are joined;
/// lattices become hexahedra.
///
/// # Errors
/// As [`read_volume`], also for cells that refer to missing points.
pub fn read_cells(source: &Source, options: &ReadOptions) -> Result<Cells> {
    let survey = Survey::of(source, options)?;
    let (drawn, wanted) = survey.drawn(source, options)?;
    if !matches!(drawn, Drawn::Cells | Drawn::Boundary) {
        return Err(other(source, drawn, "a set of cells"));
    }
    survey.warn(source, options, drawn);
    let mut grid = Grid::read(source, options, wanted.as_ref())?;
    let of_points = wanted.as_ref().is_some_and(|wanted| wanted.array.place == Place::Points);
    grid.weld(source, !of_points)?;
    let mut cells = solid::cells(source, &grid, wanted.as_ref(), options)?;
    if let Some(wanted) = wanted {
        cells.about.name = caption(&wanted);
    }
    Ok(cells)
}

/// Reads the points of a file, or the cells as samples at their centres, with the array that
/// [`ReadOptions::scalar`] names. Samples of cells have radii from the cells' sizes. Copies of a
/// point that several pieces share have the weight of one sample together.
///
/// # Errors
/// As [`read_volume`], also for cells that refer to missing points.
pub fn read_samples(source: &Source, options: &ReadOptions) -> Result<Points> {
    let survey = Survey::of(source, options)?;
    let (drawn, wanted) = survey.drawn(source, options)?;
    if drawn == Drawn::Volume {
        return Err(other(source, drawn, "a set of scattered samples"));
    }
    survey.warn(source, options, drawn);
    let wanted = wanted.ok_or_else(|| {
        source.error("file", "contains no values that can be drawn").hint("read it as a mesh")
    })?;
    let wanted = Wanted { is_color: false, ..wanted };
    let grid = Grid::read(source, options, Some(&wanted))?;
    let mut points = solid::samples(source, grid, &wanted, options)?;
    points.about.name = caption(&wanted);
    Ok(points)
}

fn caption(wanted: &Wanted) -> String {
    let Wanted { array, part, .. } = wanted;
    match part {
        Part::Whole => array.name.clone(),
        _ => part.caption(&array.name, array.components),
    }
}

/// Returns the error for a file that holds other data than those wanted.
fn other(source: &Source, drawn: Drawn, wanted: &str) -> Error {
    let kind = match drawn {
        Drawn::Volume => "a volume",
        Drawn::Cells => "a set of cells",
        Drawn::Boundary | Drawn::Surface => "a surface",
        Drawn::Cloud | Drawn::Samples => "a set of points",
    };
    source.error("data set", format!("is {kind}, not {wanted}"))
}

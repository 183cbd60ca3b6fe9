//! Cells that fill space with their values, and samples at points or at the centres of cells.

use super::{
    super::{
        Place, ReadOptions,
        shared::{
            gather::{Columns, gather},
            holes::all_missing,
        },
    },
    grid::Grid,
    surface::{centre, cut},
    survey::{Wanted, dimension},
};
use crate::{
    Result,
    cells::{self, CellKind, Cells},
    input::{Source, positions},
    scattered::Points,
    warning,
};

/// Radius of a cell's sample, in units of the root mean square distance of its corners from its
/// centre: 1.2 edges for a cube. With two standard deviations per radius, that is the default
/// kernel of lattices.
const REACH: f64 = 1.4;

/// Returns the cells of a grid that fill space, and its surfaces. Points that they do not need are
/// left out. Without `wanted`, there are no values.
pub fn cells(
    source: &Source,
    grid: &Grid,
    wanted: Option<&Wanted>,
    options: &ReadOptions,
) -> Result<Cells> {
    let of_cells = wanted.is_some_and(|wanted| wanted.array.place == Place::Cells);
    source.room::<[u32; 2]>("the corners of the cells", grid.corners.len())?;
    source.room::<(usize, CellKind, f32)>("the cells", grid.types.len())?;
    source.room::<(u32, u32, f32)>("the points", grid.points.len())?;
    let mut cells = Cells::default();
    let mut used = Used { numbers: vec![u32::MAX; grid.points.len()], points: Vec::new() };
    let mut unplaced = 0;
    for cell in 0..grid.types.len() {
        let kind = CellKind::of_vtk(grid.types[cell].into());
        if kind.is_none() && dimension(grid.types[cell]) != Some(2) {
            continue;
        }
        if !grid.points_of(cell).all(|point| grid.points[point as usize].is_finite()) {
            unplaced += 1;
            continue;
        }
        match kind {
            Some(kind) => add_cell(grid, cell, kind, (&mut cells, &mut used)),
            None => cut(source, grid, cell, &mut |corners| {
                cells.faces.push(corners.iter().map(|&point| used.number(point)));
                Ok(())
            })?,
        }
        if of_cells {
            let value = grid.values[cell] as f32;
            cells.values.resize(cells.kinds.len(), value);
            cells.faces.values.resize(cells.faces.len(), value);
        }
    }
    check_unplaced(source, unplaced, cells.kinds.len())?;
    let used = used.points;
    if wanted.is_some() && !of_cells {
        cells.values = used.iter().map(|&point| grid.values[point as usize] as f32).collect();
    }
    let values = || cells.values.iter().chain(&cells.faces.values);
    let holes = values().filter(|value| value.is_nan()).count();
    if wanted.is_some() && holes == values().count() {
        return Err(source.error("samples", all_missing(holes, options.missing)));
    }
    let position = |row: usize| grid.points[used[row] as usize];
    (cells.origin, cells.points) =
        positions::settle(source, used.len(), position, |row| format!("point {}", used[row]))?;
    cells.place = if of_cells { cells::Place::Cells } else { cells::Place::Points };
    cells.about.holes = holes as u64;
    cells.validate().map_err(|error| source.error("Cells", error.to_string()))?;
    Ok(cells)
}

/// The points that cells use.
struct Used {
    /// The number of each point of the grid among those that are used.
    numbers: Vec<u32>,
    /// The points that are used, by their numbers in the grid.
    points: Vec<u32>,
}

impl Used {
    fn number(&mut self, point: u32) -> u32 {
        let number = &mut self.numbers[point as usize];
        if *number == u32::MAX {
            *number = self.points.len() as u32;
            self.points.push(point);
        }
        *number
    }
}

/// Adds a cell that fills space.
fn add_cell(grid: &Grid, cell: usize, kind: CellKind, (cells, used): (&mut Cells, &mut Used)) {
    let corners = grid.corners_of(cell);
    if kind != CellKind::Polyhedron {
        cells.push(kind, corners.iter().map(|&point| used.number(point)).collect::<Vec<u32>>());
        return;
    }
    let faces = super::grid::faces(corners).flat_map(|face| {
        let points: Vec<u32> = face.iter().map(|&point| used.number(point)).collect();
        std::iter::once(face.len() as u32).chain(points)
    });
    let stream: Vec<u32> = corners.first().copied().into_iter().chain(faces).collect();
    cells.push(kind, stream);
}

/// Says how many cells are left out because a corner is not at finite coordinates.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if none is left.
fn check_unplaced(source: &Source, unplaced: usize, left: usize) -> Result<()> {
    let what = "a corner that is not at finite coordinates";
    if unplaced > 0 && left == 0 {
        return Err(source.error("Cells", format!("each has {what}")));
    }
    if unplaced > 0 {
        let file = source.path.display();
        warning::give!("{file}: {unplaced} cells have {what}: they are left out");
    }
    Ok(())
}

/// Returns samples at the points of a grid, or at the centres of its cells. Ghosts are left out.
/// If any cell has no size, there are no radii.
pub fn samples(
    source: &Source,
    grid: Grid,
    wanted: &Wanted,
    options: &ReadOptions,
) -> Result<Points> {
    if wanted.array.place != Place::Cells {
        let kept: Vec<usize> =
            (0..grid.points.len()).filter(|&point| !grid.ghosts[point]).collect();
        let values = kept.iter().map(|&point| grid.values[point]).collect();
        let columns = Columns { values, ..Columns::default() };
        let place = |row: usize| format!("point {}", kept[row]);
        return gather(source, kept.len(), |row| grid.points[kept[row]], place, columns, options);
    }
    let count = grid.types.len();
    source.room::<(glam::DVec3, f32, f64)>("the samples", count)?;
    let (mut centres, mut radii) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for cell in 0..count {
        let (at, distance) = centre(&grid, cell);
        centres.push(at);
        radii.push((REACH * distance) as f32);
    }
    if !radii.iter().all(|radius| radius.is_normal()) {
        radii.clear();
    }
    let columns = Columns { values: grid.values, radii, ..Columns::default() };
    gather(source, count, |row| centres[row], |row| format!("cell {row}"), columns, options)
}

//! Cells of arrays.

use crate::{
    arrays::{numbers, positions},
    errors::wrong,
};
use pyo3::prelude::*;
use splatkit::{
    Error,
    about::About,
    cells::{CellKind, Cells, Place},
};

/// The arrays of cells.
#[derive(FromPyObject)]
pub struct CellArrays<'py> {
    #[pyo3(item)]
    positions: Bound<'py, PyAny>,
    /// The number of each cell's kind, as VTK has it.
    #[pyo3(item)]
    kinds: Bound<'py, PyAny>,
    /// Where the nodes of each cell begin, and where those of the last one end.
    #[pyo3(item)]
    offsets: Bound<'py, PyAny>,
    #[pyo3(item)]
    nodes: Bound<'py, PyAny>,
    #[pyo3(item)]
    values: Option<Bound<'py, PyAny>>,
    /// Whether the values are those of cells.
    #[pyo3(item)]
    of_cells: bool,
}

impl CellArrays<'_> {
    /// Returns the cells. Values that are not finite, or equal to `missing`, are holes.
    pub fn cells(&self, mut about: About, missing: Option<f64>) -> Result<Cells, Error> {
        let (origin, points) = positions(&self.positions)?;
        let kinds = numbers::<u8>(&self.kinds)?;
        let values = self.values.as_ref().map(numbers::<f32>).transpose()?;
        let has_values = values.is_some();
        let mut values = values.unwrap_or_default();
        let is_hole = |value: f32| !value.is_finite() || missing.is_some_and(|m| value == m as f32);
        for value in values.iter_mut().filter(|value| is_hole(**value)) {
            *value = f32::NAN;
            about.holes += 1;
        }
        let place = if self.of_cells { Place::Cells } else { Place::Points };
        let mut cells = Cells { origin, points, place, about, ..Cells::default() };
        let of_cells = self.of_cells && has_values;
        let offsets = numbers::<i64>(&self.offsets)?;
        let nodes = numbers::<u32>(&self.nodes)?;
        for (cell, number) in kinds.iter().enumerate() {
            let nodes = nodes_of(&offsets, &nodes, cell)?;
            let value = values.get(cell).copied().filter(|_| of_cells);
            match (*number, nodes) {
                // Triangles, polygons and quadrilaterals; the corners of pixels are in rows.
                (5 | 7 | 9, corners) => cells.faces.push(corners.iter().copied()),
                (8, &[a, b, c, d]) => cells.faces.push([a, b, d, c]),
                _ => {
                    cells.push(kind(*number)?, nodes.iter().copied());
                    cells.values.extend(value);
                    continue;
                }
            }
            cells.faces.values.extend(value);
        }
        if !of_cells {
            cells.values = values;
        }
        cells.validate()?;
        Ok(cells)
    }
}

/// Returns the nodes of a cell.
fn nodes_of<'a>(offsets: &[i64], nodes: &'a [u32], cell: usize) -> Result<&'a [u32], Error> {
    let ends = offsets.get(cell..cell + 2).and_then(|ends| {
        let [from, to] = [ends[0], ends[1]].map(|end| usize::try_from(end).ok());
        nodes.get(from?..to?)
    });
    ends.ok_or_else(|| wrong(format!("the offsets of cell {cell} do not fit the nodes")))
}

fn kind(number: u8) -> Result<CellKind, Error> {
    let kind = CellKind::of_vtk(number.into());
    kind.ok_or_else(|| wrong(format!("cells of VTK's type {number} do not fill space")))
}

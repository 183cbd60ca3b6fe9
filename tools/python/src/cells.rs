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
    values: Bound<'py, PyAny>,
    /// Whether the values are those of cells.
    #[pyo3(item)]
    of_cells: bool,
}

impl CellArrays<'_> {
    /// Returns the cells. Values that are not finite, or equal to `missing`, are holes.
    pub fn cells(&self, mut about: About, missing: Option<f64>) -> Result<Cells, Error> {
        let (origin, points) = positions(&self.positions)?;
        let kinds = numbers::<u8>(&self.kinds)?;
        let kinds: Vec<CellKind> =
            kinds.iter().map(|number| kind(*number)).collect::<Result<_, _>>()?;
        let offsets = numbers::<i64>(&self.offsets)?;
        let offsets = offsets.into_iter().map(|own| usize::try_from(own).unwrap_or(usize::MAX));
        let mut values = numbers::<f32>(&self.values)?;
        let is_hole = |value: f32| !value.is_finite() || missing.is_some_and(|m| value == m as f32);
        for value in values.iter_mut().filter(|value| is_hole(**value)) {
            *value = f32::NAN;
            about.holes += 1;
        }
        let place = if self.of_cells { Place::Cells } else { Place::Points };
        let nodes = numbers::<u32>(&self.nodes)?;
        let offsets = offsets.collect();
        let cells = Cells { origin, points, values, place, kinds, offsets, nodes, about };
        cells.validate()?;
        Ok(cells)
    }
}

fn kind(number: u8) -> Result<CellKind, Error> {
    let found = CellKind::of_vtk(number.into());
    found.ok_or_else(|| wrong(format!("cells of VTK's type {number} do not fill space")))
}

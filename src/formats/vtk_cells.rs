//! Points and cells of VTK files, and the samples made from them.

use super::{
    ReadOptions,
    shared::gather::{Columns, gather},
};
use crate::{Result, input::Source, scattered::Points};
use glam::DVec3;

/// Radius of a cell's sample, in units of the root mean square distance of its corners from its
/// centre: 1.2 edges for a cube. With two standard deviations per radius, that is the default
/// kernel of lattices.
const REACH: f64 = 1.4;

/// The points of a data set, and its cells as lists of points.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub points: Vec<DVec3>,
    /// The points of all cells, cell after cell.
    pub corners: Vec<usize>,
    /// The index in `corners` where each cell ends.
    pub ends: Vec<usize>,
}

impl Cells {
    /// Adds the memory of more cells to the budget, with the samples at their centres.
    pub fn room(&self, source: &Source, corners: usize, cells: usize) -> Result<()> {
        source.room::<[usize; 2]>("the corners of the cells", corners)?;
        source.room::<(usize, [DVec3; 2], f64)>("the cells", cells)
    }

    /// Adds cells by the numbers in a file: corners count from `first_point`, ends from the first
    /// of these corners.
    ///
    /// # Errors
    /// A message for ends that descend and for corners that are not points.
    pub fn add(&mut self, corners: &[f64], ends: &[f64], first_point: usize) -> Result<(), String> {
        let start = self.corners.len();
        for (cell, &end) in ends.iter().enumerate() {
            let before = self.ends.last().map_or(start, |&end| end.max(start)) - start;
            if !(end >= before as f64 && end <= corners.len() as f64 && end.fract() == 0.0) {
                return Err(format!(
                    "cell {cell} ends at corner {end}, but must end after {before} and at most at \
                     {}",
                    corners.len()
                ));
            }
            self.ends.push(start + end as usize);
        }
        for &corner in corners {
            let count = self.points.len() - first_point;
            if !(corner >= 0.0 && corner < count as f64 && corner.fract() == 0.0) {
                return Err(format!(
                    "a cell refers to point {corner}, but there are {count} points"
                ));
            }
            self.corners.push(first_point + corner as usize);
        }
        Ok(())
    }

    /// Returns samples at the points.
    pub fn samples_at_points(
        self,
        source: &Source,
        values: Vec<f64>,
        options: &ReadOptions,
    ) -> Result<Points> {
        let place = |row| format!("point {row}");
        gather(
            source,
            self.points.len(),
            |row| self.points[row],
            place,
            Columns { values, ..Columns::default() },
            options,
        )
    }

    /// Returns samples at the cells' centres, the means of their corners. Radii follow from the
    /// sizes of the cells; if any cell has no size, there are no radii.
    pub fn samples_at_centres(
        self,
        source: &Source,
        values: Vec<f64>,
        options: &ReadOptions,
    ) -> Result<Points> {
        let mut start = 0;
        let (mut centres, mut radii) = (Vec::new(), Vec::new());
        for (cell, &end) in self.ends.iter().enumerate() {
            let corners = || self.corners[start..end].iter().map(|&corner| self.points[corner]);
            if start == end {
                return Err(source.error(
                    format!("cell {cell}"),
                    "has no corners, so its value has no position",
                ));
            }
            let count = (end - start) as f64;
            let centre = corners().sum::<DVec3>() / count;
            let square =
                corners().map(|corner| corner.distance_squared(centre)).sum::<f64>() / count;
            centres.push(centre);
            radii.push((REACH * square.sqrt()) as f32);
            start = end;
        }
        if !radii.iter().all(|radius| radius.is_normal()) {
            radii.clear();
        }
        let columns = Columns { values, radii, ..Columns::default() };
        let place = |row| format!("cell {row}");
        gather(source, centres.len(), |row| centres[row], place, columns, options)
    }
}

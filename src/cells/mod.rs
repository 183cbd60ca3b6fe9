//! Cells: tetrahedra, hexahedra and their kin with a field inside, as solvers write them.

mod basis;
mod boundary;
mod cut;
mod division;
mod faces;
mod kind;
mod phantom;
mod sides;
mod solid;
mod split;
#[cfg(test)]
mod tests;
mod tetrahedra;

pub use faces::Faces;
pub use kind::CellKind;
pub use solid::{Solid, SolidOptions, Tint};
pub use split::CellOptions;
pub use tetrahedra::Tetrahedra;

use crate::{
    about::About,
    math::Bounds,
    parallel::prelude::*,
    volume::{TransferFunction, Volume},
};
use glam::{DVec3, Vec3};

/// Cells that fill space, with one value for each of their points or for each cell. Between the
/// nodes of a cell, the field is what the cell's kind interpolates. Values that are not numbers are
/// holes: nothing is drawn in a cell with a hole at a node.
///
/// ```
/// use glam::Vec3;
/// use splatkit::cells::{CellKind, Cells};
///
/// let cells = Cells {
///     points: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
///     values: vec![0.0, 1.0, 2.0, 3.0],
///     kinds: vec![CellKind::Tetrahedron],
///     offsets: vec![0, 4],
///     nodes: vec![0, 1, 2, 3],
///     ..Cells::default()
/// };
/// cells.validate()?;
/// assert_eq!((cells.len(), cells.range()), (1, [0.0, 3.0]));
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// World position that the points are relative to.
    pub origin: DVec3,
    /// The points that cells refer to, relative to `origin`.
    pub points: Vec<Vec3>,
    /// One value for each point or each cell, by `place`; empty if there are none. Without values,
    /// cells are drawn as a solid of one colour.
    pub values: Vec<f32>,
    /// Where the values sit.
    pub place: Place,
    /// The kind of each cell.
    pub kinds: Vec<CellKind>,
    /// Where the nodes of each cell begin in `nodes`, and at last where those of the last cell end:
    /// one entry more than there are cells.
    pub offsets: Vec<usize>,
    /// The points of all cells, cell after cell, in VTK's order.
    pub nodes: Vec<u32>,
    /// Surfaces beside the cells.
    pub faces: Faces,
    /// What the file says beyond the values.
    pub about: About,
}

/// Where the values of cells sit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Place {
    /// One a point; interpolated in between.
    #[default]
    Points,
    /// One a cell; the same everywhere in it.
    Cells,
}

impl Default for Cells {
    fn default() -> Self {
        Self {
            origin: DVec3::ZERO,
            points: Vec::new(),
            values: Vec::new(),
            place: Place::Points,
            kinds: Vec::new(),
            offsets: vec![0],
            nodes: Vec::new(),
            faces: Faces::default(),
            about: About::default(),
        }
    }
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Returns whether there are no cells.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Adds a cell.
    pub fn push(&mut self, kind: CellKind, nodes: impl IntoIterator<Item = u32>) {
        self.kinds.push(kind);
        self.nodes.extend(nodes);
        self.offsets.push(self.nodes.len());
    }

    /// Returns the nodes of a cell; for a polyhedron, the stream of its faces.
    ///
    /// # Panics
    /// If there is no such cell, or if [`validate`](Self::validate) would refuse the offsets.
    pub fn nodes_of(&self, cell: usize) -> &[u32] {
        &self.nodes[self.offsets[cell]..self.offsets[cell + 1]]
    }

    /// Returns the points of a cell. Those of a polyhedron repeat, face by face.
    pub(crate) fn points_of(&self, cell: usize) -> impl Iterator<Item = u32> {
        let nodes = self.nodes_of(cell);
        let is_stream = self.kinds[cell] == CellKind::Polyhedron;
        let stream = if is_stream { nodes } else { &[] };
        let nodes = if is_stream { &[] } else { nodes };
        let faces = kind::faces(stream).filter_map(Result::ok).flatten();
        nodes.iter().chain(faces).copied()
    }

    /// Checks that the cells are usable.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument), which names the first cell or point that is
    /// wrong. Causes are no cells, lists of different lengths, and more than 2³² points. Others are
    /// nodes that do not fit the kind of their cell, nodes without a point, and numbers that are
    /// not finite (except values that are holes).
    pub fn validate(&self) -> crate::Result<()> {
        self.check().map_err(crate::Error::Argument)
    }

    /// Like [`validate`](Self::validate). The error is a message, to which the caller adds the
    /// place.
    pub(crate) fn check(&self) -> Result<(), String> {
        self.check_lists()?;
        let (points, count) = (self.points.len(), self.len());
        let find = |range: usize, is_bad: &(dyn Fn(usize) -> bool + Sync)| {
            (0..range).into_par_iter().find_first(|&index| is_bad(index))
        };
        if let Some(point) = find(points, &|point| !self.points[point].is_finite()) {
            let at = self.points[point];
            return Err(format!("the position {at} of point {point} is not finite"));
        }
        if let Some(index) = find(self.values.len(), &|index| self.values[index].is_infinite()) {
            let of = if self.place == Place::Points { "point" } else { "cell" };
            return Err(format!("the value of {of} {index} is {}", self.values[index]));
        }
        if let Some(cell) =
            find(count, &|cell| self.kinds[cell].check(self.nodes_of(cell)).is_err())
        {
            let what = self.kinds[cell].check(self.nodes_of(cell)).err().unwrap_or_default();
            return Err(format!("cell {cell} {what}"));
        }
        let is_out = |node: &u32| *node as usize >= points;
        if let Some(cell) = find(count, &|cell| self.points_of(cell).any(|node| is_out(&node))) {
            let node = self.points_of(cell).find(is_out).unwrap_or_default();
            return Err(format!("cell {cell} refers to point {node} of {points}"));
        }
        let is_valued = self.place == Place::Cells && !self.values.is_empty();
        self.faces.check(points, is_valued)
    }

    /// Checks the lengths of the lists, and the offsets.
    fn check_lists(&self) -> Result<(), String> {
        let (points, count) = (self.points.len(), self.len());
        if count == 0 {
            return Err("there are no cells that fill space".into());
        }
        if u32::try_from(points.max(count)).is_err() {
            return Err(format!(
                "{count} cells of {points} points are more than 32 bits can count"
            ));
        }
        let (wanted, of) = match self.place {
            Place::Points => (points, "points"),
            Place::Cells => (count, "cells"),
        };
        if self.values.len() != wanted && !self.values.is_empty() {
            return Err(format!("there are {} values for {wanted} {of}", self.values.len()));
        }
        let ends = [self.offsets.first(), self.offsets.last()];
        let is_ascending = self.offsets.par_windows(2).all(|pair| pair[0] <= pair[1]);
        if !(self.offsets.len() == count + 1
            && ends == [Some(&0), Some(&self.nodes.len())]
            && is_ascending)
        {
            return Err(format!(
                "the offsets of {count} cells must be {} ascending numbers from 0 to {}",
                count + 1,
                self.nodes.len()
            ));
        }
        if !self.origin.is_finite() {
            return Err(format!("the origin {} is not finite", self.origin));
        }
        Ok(())
    }

    /// Returns the smallest and largest value; `[∞, −∞]` if there are none, or only holes.
    pub fn range(&self) -> [f64; 2] {
        let none = || [f32::INFINITY, f32::NEG_INFINITY];
        let ends = self
            .values
            .par_iter()
            .filter(|value| !value.is_nan())
            .fold(none, |[low, high], &value| [low.min(value), high.max(value)])
            .reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        let of_faces = self.faces.values.iter().filter(|value| !value.is_nan());
        of_faces.fold(ends, |[low, high], value| [low.min(*value), high.max(*value)]).map(f64::from)
    }

    /// Returns the smallest and largest world coordinates of the cells' nodes.
    pub fn bounds(&self) -> Bounds {
        let none = || [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let add = |[low, high]: [Vec3; 2], node: u32| {
            let at = self.points[node as usize];
            [low.min(at), high.max(at)]
        };
        let ends = (0..self.len())
            .into_par_iter()
            .fold(none, |ends, cell| self.points_of(cell).fold(ends, add))
            .reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        Bounds::between(self.origin, self.faces.corners.iter().copied().fold(ends, add))
    }

    /// Counts the values in each of `bins` equal parts of the range. The largest value counts in
    /// the last bin. If all values are equal, they fill the first bin.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for more than [`Volume::MAX_BINS`] bins.
    pub fn histogram(&self, bins: usize) -> crate::Result<Vec<u64>> {
        Volume::check_bins(bins)?;
        Ok(self.counts(bins))
    }

    /// The [`histogram`](Self::histogram), for a number of bins that is known to be allowed.
    fn counts(&self, bins: usize) -> Vec<u64> {
        let mut counts = vec![0; bins];
        let [low, high] = self.range();
        let scale = if high > low { bins as f64 / (high - low) } else { 0.0 };
        for &value in self.values.iter().filter(|value| bins > 0 && !value.is_nan()) {
            // Casts saturate, so the largest value stays in the last bin.
            counts[(((f64::from(value) - low) * scale) as usize).min(bins - 1)] += 1;
        }
        counts
    }

    /// Returns the cells with one value for each point. If there is one for each cell, a point
    /// takes the mean of the values of its cells.
    #[must_use]
    pub fn with_values_of_points(self) -> Self {
        if self.place == Place::Points || self.values.is_empty() {
            return self;
        }
        let mut sums = vec![(0.0, 0u32); self.points.len()];
        for (cell, value) in self.values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
            for node in self.points_of(cell) {
                let (sum, count) = &mut sums[node as usize];
                *sum += f64::from(*value);
                *count += 1;
            }
        }
        // A point of no cell with a value has none.
        let values = sums.into_iter().map(|(sum, count)| (sum / f64::from(count)) as f32).collect();
        let faces = Faces { values: Vec::new(), ..self.faces };
        Self { values, place: Place::Points, faces, ..self }
    }

    /// Derives a transfer function from the values. Colours span all but the outermost hundredths
    /// of the values, from dark blue over green to yellow (viridis: Smith & van der Walt 2015).
    /// Higher values are more opaque; the lowest remain visible, so that the whole body is seen.
    pub fn automatic_transfer(&self) -> TransferFunction {
        const COLORS: [[f64; 3]; 5] = [
            [0.267, 0.005, 0.329],
            [0.230, 0.322, 0.546],
            [0.128, 0.567, 0.551],
            [0.369, 0.789, 0.383],
            [0.993, 0.906, 0.144],
        ];
        let diagonal = self.bounds().diagonal();
        let unit = if diagonal > 0.0 { diagonal / 20.0 } else { 1.0 };
        let ends = self.inner_range();
        let Some([low, high]) = ends.filter(|[low, high]| low < high) else {
            let value = ends.map_or(0.0, |[low, _]| low);
            return TransferFunction {
                color: vec![(value, COLORS[2])],
                opacity: vec![(value, 0.3)],
                unit,
                ..TransferFunction::default()
            };
        };
        let place = |part: usize| low + (high - low) * part as f64 / (COLORS.len() - 1) as f64;
        let color = COLORS.iter().enumerate().map(|(part, color)| (place(part), *color));
        TransferFunction {
            color: color.collect(),
            opacity: vec![(low, 0.06), (place(2), 0.15), (high, 0.6)],
            unit,
            ..TransferFunction::default()
        }
    }

    /// Returns the range of the values without the lowest and the highest hundredth, or the whole
    /// range if the other values are all equal; `None` if there is no value.
    fn inner_range(&self) -> Option<[f64; 2]> {
        let mut values: Vec<f32> =
            self.values.iter().copied().filter(|value| !value.is_nan()).collect();
        let last = values.len().checked_sub(1)?;
        let mut at = |share: f64| {
            let place = (share * last as f64).round() as usize;
            f64::from(*values.select_nth_unstable_by(place, f32::total_cmp).1)
        };
        let inner = [at(0.01), at(0.99)];
        Some(if inner[0] < inner[1] { inner } else { self.range() })
    }
}

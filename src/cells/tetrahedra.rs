//! Tetrahedra with linear fields: what engines draw of cells.

use super::{Cells, Place};
use crate::{Error, Result, math::Bounds, parallel::prelude::*};
use glam::{DMat3, DVec3, Vec3};

/// Tetrahedra with one value for each point, linear in between, or one for each tetrahedron. They
/// are made of cells ([`Cells::tetrahedra`]).
#[derive(Debug, Clone)]
pub struct Tetrahedra {
    pub(crate) origin: DVec3,
    pub(crate) points: Vec<Vec3>,
    /// By `place`.
    pub(crate) values: Vec<f32>,
    pub(crate) place: Place,
    /// Corners, in ascending order: both tetrahedra at a face have its corners in the same order.
    pub(crate) corners: Vec<[u32; 4]>,
    /// The field's gradient at each point; empty for values of tetrahedra.
    pub(crate) gradients: Vec<Vec3>,
    range: [f64; 2],
    bounds: Bounds,
    spacing: f64,
}

/// A volume below this part of that of a cube over the longest edge is none.
const LEAST_VOLUME: f64 = 1e-10;

/// The share of the tetrahedra that may be smaller than the typical size.
const SMALLER: f64 = 0.2;

impl Tetrahedra {
    /// Number of tetrahedra.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// Returns whether there are no tetrahedra.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Returns where the values sit: at points, or one a tetrahedron.
    pub fn place(&self) -> Place {
        self.place
    }

    /// Returns the smallest and largest value.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// Returns the smallest and largest value in a tetrahedron.
    pub(crate) fn range_of(&self, number: usize) -> [f64; 2] {
        let values = match self.place {
            Place::Points => self.corners[number].map(|corner| self.values[corner as usize]),
            Place::Cells => [self.values[number]; 4],
        };
        let ends = values
            .into_iter()
            .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        ends.map(f64::from)
    }

    /// Returns the box around the tetrahedra, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Returns a typical length of an edge: a fifth of the tetrahedra are smaller.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }
}

/// Tetrahedra that are being collected.
pub(super) struct Builder {
    made: Tetrahedra,
}

impl Builder {
    /// Begins with the points of cells, and their values if there is one a point.
    pub fn new(cells: &Cells) -> Self {
        let values = match cells.place {
            // Without a field, it is 0 everywhere.
            Place::Points if cells.values.is_empty() => vec![0.0; cells.points.len()],
            Place::Points => cells.values.clone(),
            Place::Cells => Vec::new(),
        };
        Self {
            made: Tetrahedra {
                origin: cells.origin,
                points: cells.points.clone(),
                values,
                place: cells.place,
                corners: Vec::new(),
                gradients: Vec::new(),
                range: [0.0; 2],
                bounds: Bounds::EMPTY,
                spacing: 0.0,
            },
        }
    }

    /// Number of tetrahedra so far.
    pub fn len(&self) -> usize {
        self.made.len()
    }

    /// Adds a point and returns its number.
    pub fn point(&mut self, at: Vec3, value: f32) -> u32 {
        self.made.points.push(at);
        if self.made.place == Place::Points {
            self.made.values.push(value);
        }
        (self.made.points.len() - 1) as u32
    }

    /// Adds a tetrahedron, unless it has no volume. `value` counts if there is one a tetrahedron.
    pub fn add(&mut self, mut corners: [u32; 4], value: f32) {
        corners.sort_unstable();
        let edges = edges(&self.made.points, corners);
        let longest = edges.x_axis.length_squared().max(edges.y_axis.length_squared());
        let longest = longest.max(edges.z_axis.length_squared());
        let volume = edges.determinant();
        if volume.abs() <= LEAST_VOLUME * longest * longest.sqrt() {
            return;
        }
        self.made.corners.push(corners);
        if self.made.place == Place::Cells {
            self.made.values.push(value);
        }
    }

    /// Completes the tetrahedra. Without `has_gradients`, they have none, and cannot be lit.
    ///
    /// # Errors
    /// [`Error::Argument`] if there are none, or more points than 32 bits can count.
    pub fn finish(self, has_gradients: bool) -> Result<Tetrahedra> {
        let mut made = self.made;
        if made.is_empty() {
            return Err(Error::Argument(
                "no cell has a volume and values at all of its nodes".into(),
            ));
        }
        if u32::try_from(made.points.len().max(made.len())).is_err() {
            return Err(Error::Argument(format!(
                "{} tetrahedra of {} points are more than 32 bits can count",
                made.len(),
                made.points.len()
            )));
        }
        made.measure();
        if made.place == Place::Points && has_gradients {
            made.gradients = made.gradients_of_points();
        }
        Ok(made)
    }
}

/// Returns the edges from the first corner to the others, as columns.
fn edges(points: &[Vec3], corners: [u32; 4]) -> DMat3 {
    let [a, b, c, d] = corners.map(|corner| points[corner as usize].as_dvec3());
    DMat3::from_cols(b - a, c - a, d - a)
}

impl Tetrahedra {
    /// Sets the range, the bounds and the spacing.
    fn measure(&mut self) {
        let none = || ([f32::INFINITY, f32::NEG_INFINITY], [Vec3::INFINITY, Vec3::NEG_INFINITY]);
        let of_cells = self.place == Place::Cells;
        let add = |(range, bounds): ([f32; 2], [Vec3; 2]), at: usize| {
            let mut ends = (range, bounds);
            for corner in self.corners[at].map(|corner| corner as usize) {
                let value = self.values[if of_cells { at } else { corner }];
                let [low, high] = ends.0;
                ends.0 = [low.min(value), high.max(value)];
                let [low, high] = ends.1;
                ends.1 = [low.min(self.points[corner]), high.max(self.points[corner])];
            }
            ends
        };
        let join = |a: ([f32; 2], [Vec3; 2]), b: ([f32; 2], [Vec3; 2])| {
            let range = [a.0[0].min(b.0[0]), a.0[1].max(b.0[1])];
            (range, [a.1[0].min(b.1[0]), a.1[1].max(b.1[1])])
        };
        let (range, corners) = (0..self.len()).into_par_iter().fold(none, add).reduce(none, join);
        self.range = range.map(f64::from);
        self.bounds = Bounds::between(self.origin, corners);
        // The edge of a regular tetrahedron of the same volume is (√2·determinant)^⅓.
        let size = |corners: &[u32; 4]| {
            let volume = edges(&self.points, *corners).determinant().abs();
            (std::f64::consts::SQRT_2 * volume).cbrt() as f32
        };
        let mut sizes: Vec<f32> = self.corners.par_iter().map(size).collect();
        let typical = (SMALLER * (sizes.len() - 1) as f64) as usize;
        self.spacing = f64::from(*sizes.select_nth_unstable_by(typical, f32::total_cmp).1);
    }

    /// Returns the field's gradient at each point: the mean of those of the tetrahedra around it,
    /// weighted by their volumes.
    fn gradients_of_points(&self) -> Vec<Vec3> {
        let mut sums = vec![(DVec3::ZERO, 0.0); self.points.len()];
        for corners in &self.corners {
            let edges = edges(&self.points, *corners);
            let [a, b, c, d] = corners.map(|corner| f64::from(self.values[corner as usize]));
            let gradient = edges.inverse().transpose() * DVec3::new(b - a, c - a, d - a);
            let volume = edges.determinant().abs();
            for corner in corners {
                let sum = &mut sums[*corner as usize];
                sum.0 += volume * gradient;
                sum.1 += volume;
            }
        }
        let mean = |&(sum, all): &(DVec3, f64)| {
            let mean = (sum / all).as_vec3();
            // Of points without a tetrahedron, and of thin ones that are steeper than 32 bits hold.
            if mean.is_finite() { mean } else { Vec3::ZERO }
        };
        sums.par_iter().map(mean).collect()
    }
}

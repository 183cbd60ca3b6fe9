//! Derives from the nearest neighbours of a sample how much space it has, and how the values change
//! around it.

use super::Points;
use crate::{
    Deadline, Result,
    deadline::Clock,
    math::{eigen, neighbours::Neighbours},
    parallel::prelude::*,
};
use glam::{DMat3, DVec3, Vec3};
use std::f64::consts::PI;

/// Most neighbours that a sample may use.
pub(super) const MOST: usize = 64;

/// A direction has no significant extent if the variance of the neighbours along it is below this
/// fraction of the largest one. It gets no slope and does not count towards the spacing.
const FLAT: f64 = 1e-4;

/// A position that holds one sample, or several that coincide exactly.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    /// The number of samples at this position.
    pub samples: u32,
    /// The edge of the cube that belongs to the position; 0 if it is the only one.
    pub spacing: f64,
    /// Change of the value per world unit; 0 if it cannot be determined.
    pub gradient: DVec3,
    /// The range of the values of the neighbours and its own: largest minus smallest.
    pub width: f64,
}

/// Returns the distinct positions of all samples, and for each sample the index of its position.
/// Coincident samples share one, so the tree is only queried for distinct positions. A distance is
/// then never 0, and copies cannot fill all neighbours.
///
/// # Errors
/// [`Error::Timeout`](crate::Error::Timeout).
pub(super) fn places(
    points: &Points,
    neighbours: usize,
    deadline: Deadline,
) -> Result<(Vec<Place>, Vec<u32>)> {
    let first = Neighbours::first_of_equals(&points.positions);
    let mut place_of = vec![0; points.len()];
    let mut positions = Vec::new();
    let mut sums: Vec<(f64, u32)> = Vec::new();
    for (index, &first) in first.iter().enumerate() {
        if first as usize == index {
            place_of[index] = positions.len() as u32;
            positions.push(points.positions[index]);
            sums.push((0.0, 0));
        } else {
            place_of[index] = place_of[first as usize];
        }
        let sum = &mut sums[place_of[index] as usize];
        *sum = (sum.0 + f64::from(points.values[index]), sum.1 + 1);
    }
    let values: Vec<f64> = sums.iter().map(|(sum, count)| sum / f64::from(*count)).collect();
    let tree = Neighbours::new(&positions);
    let around = Surroundings { tree: &tree, positions: &positions, values: &values, neighbours };
    let order = tree.order();
    let clock = Clock::new(deadline);
    let place = |at: usize| {
        let is_over = clock.is_over(at);
        if is_over { Place::default() } else { around.place(order[at], sums[order[at] as usize].1) }
    };
    let in_order: Vec<Place> = (0..order.len()).into_par_iter().map(place).collect();
    clock.finish("finding the neighbours of samples")?;
    let mut places = in_order.clone();
    for (index, place) in order.into_iter().zip(in_order) {
        places[index as usize] = place;
    }
    Ok((places, place_of))
}

struct Surroundings<'a> {
    tree: &'a Neighbours<'a>,
    positions: &'a [Vec3],
    values: &'a [f64],
    neighbours: usize,
}

impl Surroundings<'_> {
    fn place(&self, index: u32, samples: u32) -> Place {
        let (center, value) = (self.positions[index as usize], self.values[index as usize]);
        let nearest =
            self.tree.of(index, self.neighbours).into_iter().map(|(distance, neighbour)| {
                let offset = (self.positions[neighbour as usize] - center).as_dvec3();
                (offset, self.values[neighbour as usize] - value, f64::from(distance))
            });
        let around: Vec<(DVec3, f64, f64)> = nearest.collect();
        let Some(&(.., farthest)) = around.last() else {
            return Place { samples, spacing: 0.0, gradient: DVec3::ZERO, width: 0.0 };
        };
        let fit = Fit::new(&around, farthest);
        let [low, high] = around
            .iter()
            .fold([0.0f64; 2], |[low, high], &(_, rise, _)| [low.min(rise), high.max(rise)]);
        // The ball, disc or line out to the k-th neighbour holds k samples besides the one in its
        // middle.
        let k = around.len() as f64;
        let spacing = match fit.dimensions {
            3 => (4.0 / 3.0 * PI / k).cbrt(),
            2 => (PI / k).sqrt(),
            _ => 2.0 / k,
        };
        // A few samples all lie on the boundary, and so have less space.
        let spacing = farthest * spacing.min(1.0);
        Place {
            samples,
            spacing,
            gradient: limited(fit.gradient, &around, [low, high]),
            width: high - low,
        }
    }
}

/// A linear function fitted to the values around a sample by weighted least squares.
struct Fit {
    /// The number of directions in which the samples spread.
    dimensions: usize,
    /// The slope; 0 along directions without extent.
    gradient: DVec3,
}

impl Fit {
    /// Takes offsets, value differences and distances of the neighbours, the farthest one last. The
    /// weights fall off with distance, but not to 0 at the farthest: on a lattice all may be
    /// equally far.
    fn new(around: &[(DVec3, f64, f64)], farthest: f64) -> Self {
        let weight = |distance: f64| 1.0 - 0.64 * (distance / farthest).powi(2);
        let middle = (DVec3::ZERO, 0.0, 0.0);
        let all = || {
            around
                .iter()
                .chain([&middle])
                .map(|&(offset, rise, distance)| (offset, rise, weight(distance)))
        };
        let (mut sum, mut mean, mut mean_rise) = (0.0, DVec3::ZERO, 0.0);
        for (offset, rise, weight) in all() {
            sum += weight;
            mean += weight * offset;
            mean_rise += weight * rise;
        }
        (mean, mean_rise) = (mean / sum, mean_rise / sum);
        let (mut scatter, mut trend) = (DMat3::ZERO, DVec3::ZERO);
        for (offset, rise, weight) in all() {
            let d = offset - mean;
            scatter += DMat3::from_cols(d * d.x, d * d.y, d * d.z) * weight;
            trend += d * (rise - mean_rise) * weight;
        }
        let trace: f64 = scatter.x_axis.x + scatter.y_axis.y + scatter.z_axis.z;
        // The product of the variances over the cube of their sum is at most the smallest over the
        // largest.
        if scatter.determinant() > FLAT * trace.powi(3) {
            return Self { dimensions: 3, gradient: scatter.inverse() * trend };
        }
        let (variances, axes) = eigen(scatter);
        let dimensions =
            variances.iter().filter(|&&variance| variance > FLAT * variances[0]).count();
        let along = |axis: usize| axes[axis] * (axes[axis].dot(trend) / variances[axis]);
        Self { dimensions, gradient: (0..dimensions).map(along).sum() }
    }
}

/// Shortens a gradient until its predictions at the neighbours' positions lie inside the range of
/// their values, widened by half its width (Barth & Jespersen 1989, except for the widening). A
/// linear field is never limited, not even at the border of the samples. A step is limited if its
/// gradient would overshoot far on both sides.
fn limited(gradient: DVec3, around: &[(DVec3, f64, f64)], [low, high]: [f64; 2]) -> DVec3 {
    let room = 0.5 * (high - low);
    let share = around.iter().map(|&(offset, ..)| {
        let rise = gradient.dot(offset);
        let bound = if rise > 0.0 { high + room } else { room - low };
        if rise.abs() > bound { bound / rise.abs() } else { 1.0 }
    });
    gradient * share.fold(1.0, f64::min)
}

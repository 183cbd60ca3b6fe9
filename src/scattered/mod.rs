//! Scattered samples: points in space with a scalar, in any order and at any density, and the
//! splats that draw them.
//!
//! The field between them is the weighted mean of what their kernels carry (Shepard 1968). Each
//! kernel carries its value and a slope (Franke & Nielson 1980, "Smooth interpolation of large sets
//! of scattered data").

mod merge;
mod neighbourhood;
mod splats;
#[cfg(test)]
mod tests;

pub(crate) use merge::merged;
pub use splats::SampleOptions;

use crate::{
    about::About,
    math::Bounds,
    parallel::prelude::*,
    volume::{TransferFunction, Volume},
};
use glam::{DVec3, Vec3};

/// Points with one value each, in the file's own unit, relative to `origin`, so that doubles far
/// from zero keep their precision in 32 bits. `radii` and `covariances` are either empty or as long
/// as `positions`.
///
/// Samples are drawn as splats that carry values:
///
/// ```
/// use glam::Vec3;
/// use splatkit::scattered::{Points, SampleOptions};
///
/// let grid = (0..64).map(|i| Vec3::new((i % 4) as f32, (i / 4 % 4) as f32, (i / 16) as f32));
/// let positions: Vec<Vec3> = grid.collect();
/// let values = positions.iter().map(|position| position.z).collect();
/// let points = Points { positions, values, ..Points::default() };
/// assert_eq!(points.range(), [0.0, 3.0]);
/// let splats = points.to_splats(&SampleOptions::default())?;
/// assert_eq!(splats.splats.len(), 64);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// World position that the positions are relative to.
    pub origin: DVec3,
    /// The positions of the samples, relative to `origin`.
    pub positions: Vec<Vec3>,
    /// The value of each sample.
    pub values: Vec<f32>,
    /// The reach of each sample, in world units: two standard deviations of its kernel, or as many
    /// as [`SampleOptions::deviations`] sets.
    pub radii: Vec<f32>,
    /// The covariance of each sample's kernel: xx, xy, xz, yy, yz, zz, in squared world units. It
    /// takes precedence over a radius.
    pub covariances: Vec<[f32; 6]>,
    /// What the file says beyond the values.
    pub about: About,
}

impl Points {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Checks that the points are usable.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument), which names the first point that is wrong.
    /// Causes are lists of different lengths, no points or more than 2³², numbers that are not
    /// finite, radii not above 0, and covariances that are not positive definite.
    pub fn validate(&self) -> crate::Result<()> {
        self.check().map_err(crate::Error::Argument)
    }

    /// Like [`validate`](Self::validate). The error is a message, to which the caller adds the
    /// place.
    pub(crate) fn check(&self) -> Result<(), String> {
        let count = self.len();
        if count == 0 {
            return Err("there are no samples".into());
        }
        if u32::try_from(count).is_err() {
            return Err(format!("{count} samples are more than 32 bits can count"));
        }
        let given = [("radii", self.radii.len()), ("covariances", self.covariances.len())];
        let mut lists = vec![("values", self.values.len())];
        lists.extend(given.iter().filter(|list| list.1 > 0));
        if let Some((name, length)) = lists.into_iter().find(|list| list.1 != count) {
            return Err(format!("there are {length} {name} for {count} positions"));
        }
        if !self.origin.is_finite() {
            return Err(format!("the origin {} is not finite", self.origin));
        }
        let first = |bad: &(dyn Fn(usize) -> bool + Sync)| {
            (0..count).into_par_iter().find_first(|&index| bad(index))
        };
        if let Some(index) = first(&|index| !self.positions[index].is_finite()) {
            return Err(format!(
                "the position {} of sample {index} is not finite",
                self.positions[index]
            ));
        }
        if let Some(index) = first(&|index| !self.values[index].is_finite()) {
            return Err(format!("the value of sample {index} is {}", self.values[index]));
        }
        if let Some(index) =
            self.radii.par_iter().position_first(|radius| !(radius.is_normal() && *radius > 0.0))
        {
            return Err(format!(
                "the radius of sample {index} is {}, but radii are above 0",
                self.radii[index]
            ));
        }
        if let Some(index) =
            self.covariances.par_iter().position_first(|terms| splats::factor(terms).is_none())
        {
            let terms = self.covariances[index];
            return Err(format!(
                "the covariance {terms:?} of sample {index} is not positive definite"
            ));
        }
        Ok(())
    }

    /// Returns the smallest and largest value.
    pub fn range(&self) -> [f64; 2] {
        let none = || [f32::INFINITY, f32::NEG_INFINITY];
        let ends = self
            .values
            .par_iter()
            .fold(none, |[low, high], &value| [low.min(value), high.max(value)])
            .reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        ends.map(f64::from)
    }

    /// Returns the smallest and largest world coordinates of the positions. Kernels reach further.
    pub fn bounds(&self) -> Bounds {
        let none = || [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let ends = self
            .positions
            .par_iter()
            .fold(none, |[low, high], &at| [low.min(at), high.max(at)])
            .reduce(none, |a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        Bounds::between(self.origin, ends)
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
    pub(crate) fn counts(&self, bins: usize) -> Vec<u64> {
        let mut counts = vec![0; bins];
        let [low, high] = self.range();
        let scale = if high > low { bins as f64 / (high - low) } else { 0.0 };
        for &value in self.values.iter().filter(|_| bins > 0) {
            // Casts saturate, so the largest value stays in the last bin.
            counts[(((f64::from(value) - low) * scale) as usize).min(bins - 1)] += 1;
        }
        counts
    }

    /// Derives a transfer function from the samples, as [`TransferFunction::automatic`] does from a
    /// volume ([`TransferFunction::of_values`]).
    pub fn automatic_transfer(&self) -> TransferFunction {
        TransferFunction::of_values(&self.values, self.bounds().diagonal(), &self.about)
    }
}

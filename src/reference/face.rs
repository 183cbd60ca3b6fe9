//! The field at a point, on the faces of sheets.

use super::{
    kernel::{Crossing, Sample},
    ray::Ray,
};
use glam::{DVec2, DVec3};

/// The sums over all kernels at one point of a ray, and the derivatives of the sums in view space.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Face {
    /// P
    weight: f64,
    /// Q
    value: f64,
    weight_gradient: DVec3,
    value_gradient: DVec3,
}

impl Face {
    /// A face at which the field is already known.
    pub fn new(value: f64, gradient: DVec3) -> Self {
        Self { weight: 1.0, value, weight_gradient: DVec3::ZERO, value_gradient: gradient }
    }

    /// Adds a kernel's contribution at distance s along the ray.
    pub fn add(&mut self, sample: &Sample, center: DVec3, crossing: &Crossing, ray: &Ray, s: f64) {
        let (h, gradient) = crossing.at(s);
        let carried = sample.value + sample.slope.dot(ray.point(s) - center);
        self.weight += sample.weight * h;
        self.value += sample.weight * carried * h;
        self.weight_gradient += sample.weight * gradient;
        self.value_gradient += sample.weight * (carried * gradient + h * sample.slope);
    }

    /// Returns Q/P, or `None` if the kernels add up to no more than `least`.
    pub fn value(&self, least: f64) -> Option<f64> {
        (self.weight > least).then(|| self.value / self.weight)
    }

    /// Returns the gradient of the value.
    pub fn gradient(&self, least: f64) -> Option<DVec3> {
        let value = self.value(least)?;
        Some((self.value_gradient - value * self.weight_gradient) / self.weight)
    }

    /// Returns the gradient of the value at distance s. Its components across the picture come from
    /// the values in the pixels to the left, right, above and below.
    pub fn central_gradient(
        &self,
        least: f64,
        ray: &Ray,
        s: f64,
        around: [Option<f64>; 4],
    ) -> Option<DVec3> {
        let along = self.gradient(least)?.dot(ray.direction);
        let [left, right, above, below] = around;
        let across = DVec2::new(
            slope([left, self.value(least), right]),
            slope([above, self.value(least), below]),
        );
        ray.gradient(s, across, along)
    }
}

/// Returns the slope at the middle one of three neighbours, any of which may lack a value. This is
/// the difference across both neighbours, the one-sided difference if there is only one, or 0
/// without neighbours.
fn slope([before, here, after]: [Option<f64>; 3]) -> f64 {
    match (before, here, after) {
        (Some(before), _, Some(after)) => 0.5 * (after - before),
        (None, Some(here), Some(after)) => after - here,
        (Some(before), Some(here), None) => here - before,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_take_the_neighbours_that_there_are() {
        assert_eq!(slope([Some(1.0), Some(9.0), Some(7.0)]), 3.0);
        assert_eq!(slope([None, Some(9.0), Some(7.0)]), -2.0);
        assert_eq!(slope([Some(1.0), Some(9.0), None]), 8.0);
        assert_eq!(slope([None, Some(9.0), None]), 0.0);
    }
}

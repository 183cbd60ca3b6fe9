//! The sums of the kernels in one sheet of one ray.

use super::{
    kernel::{Crossing, Radiance, Sample},
    ray::Ray,
};
use glam::DVec3;

/// Radiance in a sheet.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Light {
    /// Optical depth; then the sums of facing weights, colours and normals, each weighted by
    /// optical depth.
    pub depth: f64,
    pub facing: f64,
    pub color: DVec3,
    pub normal: DVec3,
    /// Whether some splat has a normal.
    pub has_normal: bool,
}

impl Light {
    pub fn add(&mut self, radiance: &Radiance, depth: f64) {
        let Radiance { color, normal, facing, .. } = *radiance;
        self.depth += depth;
        self.facing += depth * facing;
        self.color += depth * facing * color;
        self.normal += normal.map_or(DVec3::ZERO, |normal| depth * facing * normal);
        self.has_normal |= normal.is_some();
    }

    /// Adds other radiance in the same sheet.
    pub fn join(&mut self, other: &Self) {
        self.depth += other.depth;
        self.facing += other.facing;
        self.color += other.color;
        self.normal += other.normal;
        self.has_normal |= other.has_normal;
    }
}

/// The mean of a field over a sheet.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mean {
    /// W, a length.
    pub weight: f64,
    /// V
    value: f64,
}

impl Mean {
    /// The mean of a field whose integral over a length is known.
    pub fn new(length: f64, integral: f64) -> Self {
        Self { weight: length, value: integral }
    }

    /// Adds the part of a kernel that lies between two distances along the ray.
    pub fn add(
        &mut self,
        sample: &Sample,
        center: DVec3,
        crossing: &Crossing,
        ray: &Ray,
        part: [f64; 2],
    ) {
        let [length, first] = crossing.moments(part);
        let at_closest = sample.value + sample.slope.dot(ray.point(crossing.closest) - center);
        self.weight += sample.weight * length;
        self.value +=
            sample.weight * (at_closest * length + sample.slope.dot(ray.direction) * first);
    }

    /// Returns f̄, or `None` if next to no kernel reaches into the sheet.
    pub fn value(&self, least: f64, thickness: f64) -> Option<f64> {
        (self.weight > least * thickness).then(|| self.value / self.weight)
    }
}

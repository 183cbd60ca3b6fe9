//! A kernel in view space, and its intersection with a ray.

use super::{profile::Profile, ray::Ray};
use crate::splat::TRAINED_OPACITIES;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// The payload of a kernel.
#[derive(Debug, Clone, Copy)]
pub(super) enum Load {
    Radiance(Radiance),
    Sample(Sample),
}

/// The payload of a kernel that was classified before interpolation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Radiance {
    pub amount: Amount,
    pub color: DVec3,
    /// In view space.
    pub normal: Option<DVec3>,
    /// The weight by how much it faces the eye.
    pub facing: f64,
}

/// How much light a kernel absorbs.
#[derive(Debug, Clone, Copy)]
pub(super) enum Amount {
    /// This optical depth through the centre, in every direction.
    Depth(f64),
    /// Optical depth per length of the kernel's line integral.
    Extinction(f64),
    /// This share of a pixel through the centre, as trained.
    Opacity(f64),
}

/// A sample of a field: it carries value + slope·(x − centre) and has a weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub value: f64,
    pub weight: f64,
    /// In view space, per world unit.
    pub slope: DVec3,
}

/// A radial kernel in view space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel<'a> {
    pub center: DVec3,
    /// Maps kernel space to view space.
    factor: DMat3,
    /// Maps view space to kernel space: the inverse.
    whitening: DMat3,
    /// Radius of the footprint in kernel space.
    radius: f64,
    profile: Profile<'a>,
    pub load: Load,
}

/// A ray and a kernel that it meets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing<'a> {
    whitening: DMat3,
    profile: Profile<'a>,
    /// q: the point of the ray closest to the centre, in kernel space.
    offset: DVec3,
    /// β: the change of the kernel-space point per world unit along the ray.
    direction: DVec3,
    /// |β|
    density: f64,
    /// ρ = |q|
    rho: f64,
    /// s*: the distance of that point along the ray.
    pub closest: f64,
}

impl<'a> Kernel<'a> {
    pub fn new(
        center: DVec3,
        factor: DMat3,
        radius: f64,
        profile: Profile<'a>,
        load: Load,
    ) -> Self {
        Self { center, factor, whitening: factor.inverse(), radius, profile, load }
    }

    /// Returns the covariance between two directions.
    #[cfg(test)]
    pub fn covariance(&self, a: DVec3, b: DVec3) -> f64 {
        (self.factor.transpose() * a).dot(self.factor.transpose() * b)
    }

    /// Whether the plane of the points p with p·normal = offset meets the footprint's ellipsoid.
    pub fn meets_plane(&self, normal: DVec3, offset: f64) -> bool {
        let reach = self.radius * (self.factor.transpose() * normal).length();
        // Slightly more than the reach, so that rounding leaves out no kernel that a ray in the
        // plane meets.
        (self.center.dot(normal) - offset).abs() <= reach * (1.0 + 1e-9)
    }

    /// Returns the crossing of a ray with the kernel; `None` if the ray passes outside the
    /// footprint.
    pub fn cross(&self, ray: &Ray) -> Option<Crossing<'a>> {
        let alpha = self.whitening * (ray.origin - self.center);
        let direction = self.whitening * ray.direction;
        let density = direction.length();
        let rho = alpha.cross(direction).length() / density;
        let inside = rho <= self.radius;
        if !inside {
            return None;
        }
        let closest = -alpha.dot(direction) / (density * density);
        let offset = alpha + closest * direction;
        let Self { whitening, profile, .. } = *self;
        Some(Crossing { whitening, profile, offset, direction, density, rho, closest })
    }
}

impl Crossing<'_> {
    /// Returns the distances along the ray between which the kernel is not negligible.
    pub fn span(&self) -> [f64; 2] {
        let reach = self.profile.reach(self.rho) / self.density;
        [self.closest - reach, self.closest + reach]
    }

    /// Returns ∫ h ds and ∫ (s − s*)·h ds over a part of the ray, in world units.
    pub fn moments(&self, [from, to]: [f64; 2]) -> [f64; 2] {
        let place = |s: f64| self.density * (s - self.closest);
        let [length, first] = self.profile.moments(self.rho, [place(from), place(to)]);
        [length / self.density, first / (self.density * self.density)]
    }

    /// Returns h at a distance along the ray, and its gradient in view space. Gradients ignore the
    /// footprint's rim.
    pub fn at(&self, s: f64) -> (f64, DVec3) {
        let place = self.offset + (s - self.closest) * self.direction;
        let r = place.length();
        (self.profile.value(r), self.whitening.transpose() * (self.profile.slope(r) * place))
    }

    /// Returns the optical depth of the kernel over a part of the ray.
    pub fn optical_depth(&self, amount: Amount, part: [f64; 2]) -> f64 {
        let [length, _] = self.moments(part);
        match amount {
            // The length of a Gaussian through its centre is √(2π)/|β|.
            Amount::Depth(depth) => depth * length * self.density / (2.0 * PI).sqrt(),
            Amount::Extinction(extinction) => extinction * length,
            Amount::Opacity(opacity) => {
                let [whole, _] = self.moments([f64::NEG_INFINITY, f64::INFINITY]);
                let alpha = opacity * whole * self.density / (2.0 * PI).sqrt();
                let [least, most] = TRAINED_OPACITIES;
                let depth = if alpha < least { 0.0 } else { -(-alpha.min(most)).ln_1p() };
                // The part of the kernel's line integral.
                depth * length / whole
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{self, Camera, Projection, View};
    use glam::DVec2;

    fn views() -> [View; 2] {
        [Projection::Perspective { view_angle: 50.0 }, Projection::Orthographic { height: 3.0 }]
            .map(|projection| {
                let position = DVec3::new(2.0, -2.5, 1.0);
                let camera =
                    Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Z, projection };
                camera.view([40, 30]).unwrap()
            })
    }

    fn skewed<'a>(view: &View, radius: f64, profile: Profile<'a>) -> Kernel<'a> {
        let sharp = DMat3::from_cols(
            DVec3::new(0.5, -0.2, 0.4),
            DVec3::new(0.0, 0.3, 0.1),
            DVec3::new(0.0, 0.0, 0.25),
        );
        let center = view.to_view(DVec3::new(0.5, -0.1, 0.5));
        let load = Load::Sample(Sample { value: 1.0, weight: 1.0, slope: DVec3::ZERO });
        Kernel::new(center, view.rotation * sharp, radius, profile, load)
    }

    #[test]
    fn a_crossing_is_what_the_ray_meets_point_by_point() {
        let spline = math::Kernel::b_spline(2.0).unwrap();
        for view in views() {
            for (radius, profile) in [(8.0, Profile::Gaussian), (2.0, Profile::Compact(&spline))] {
                let kernel = skewed(&view, radius, profile);
                let ray = Ray::new(&view, DVec2::new(23.5, 13.5));
                let crossing = kernel.cross(&ray).unwrap();
                let value =
                    |p: DVec3| profile.value((kernel.whitening * (p - kernel.center)).length());
                let (largest, _) = crossing.at(crossing.closest);
                for s in [crossing.closest - 0.01, crossing.closest, crossing.closest + 0.2] {
                    let (height, gradient) = crossing.at(s);
                    let p = ray.point(s);
                    assert!((height - value(p)).abs() < 1e-12 && height <= largest);
                    let step = 1e-5;
                    for axis in DVec3::AXES {
                        let expected =
                            (value(p + step * axis) - value(p - step * axis)) / (2.0 * step);
                        assert!(
                            (gradient.dot(axis) - expected).abs() < 1e-7,
                            "{gradient} {expected}"
                        );
                    }
                }
                let part = [crossing.closest - 0.1, crossing.closest + 0.3];
                let steps = 100_000;
                let mut expected = [0.0; 2];
                for step in 0..steps {
                    let s =
                        part[0] + (part[1] - part[0]) * (f64::from(step) + 0.5) / f64::from(steps);
                    let h = value(ray.point(s)) * (part[1] - part[0]) / f64::from(steps);
                    (expected[0], expected[1]) =
                        (expected[0] + h, expected[1] + (s - crossing.closest) * h);
                }
                let moments = crossing.moments(part);
                assert!(
                    (moments[0] - expected[0]).abs() < 1e-9
                        && (moments[1] - expected[1]).abs() < 1e-9
                );
                let [from, to] = crossing.span();
                assert!(crossing.at(from - 1e-9).0 < 1e-15 && crossing.at(to + 1e-9).0 < 1e-15);
            }
        }
    }

    #[test]
    fn a_plane_that_a_ray_lies_in_meets_what_the_ray_meets() {
        for view in views() {
            let kernel = skewed(&view, 1.5, Profile::Gaussian);
            let mut met = 0;
            for row in -10..50 {
                let [left, right] =
                    [-50.0, 90.0].map(|x| Ray::new(&view, DVec2::new(x, f64::from(row) + 0.5)));
                let normal =
                    if view.perspective { left.direction.cross(right.direction) } else { DVec3::Y };
                let plane = kernel.meets_plane(normal, left.origin.dot(normal));
                let rays = (0..400).filter(|&i| {
                    let pixel = DVec2::new(-50.0 + 0.35 * f64::from(i), f64::from(row) + 0.5);
                    kernel.cross(&Ray::new(&view, pixel)).is_some()
                });
                let rays = rays.count();
                assert!(plane || rays == 0);
                // A plane that meets the ellipsoid does so in more than a point, unless it only
                // grazes it.
                met += usize::from(plane != (rays > 0));
            }
            assert!(met <= 2, "{met} rows were kept for nothing");
        }
    }
}

//! The kernels of a scene in view space, and what a ray meets of them.

use super::ray::Ray;
use crate::{
    math::View,
    scene::{Item, Scene},
    splat::{FOOTPRINT_BLUR, Payload, Splat, SplatSet, decode_normal},
};
use glam::{DMat3, DVec2, DVec3};

/// What a kernel carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Load {
    /// Optical depth through the centre, colour, view-space normal, and how much of it faces the eye.
    Radiance { strength: f64, color: DVec3, normal: Option<DVec3>, facing: f64 },
    /// The value of a sample.
    Scalar(f64),
}

/// An ellipsoidal Gaussian in view space.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel {
    center: DVec3,
    /// L with Σ = L·Lᵀ.
    factor: DMat3,
    /// M = L⁻¹, so that Σ⁻¹ = Mᵀ·M.
    whitening: DMat3,
    /// Radius of the footprint, in standard deviations.
    extent: f64,
    pub load: Load,
}

/// What a ray meets of a kernel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// e = exp(−ρ²/2), ρ the ray's distance from the centre in standard deviations.
    pub weight: f64,
    /// s*: where on the ray the kernel is largest.
    pub closest: f64,
    /// |β|: standard deviations that one world unit along the ray takes.
    pub density: f64,
    /// ½∂(ρ²) per pixel to the right and per pixel downward.
    pub across: DVec2,
}

/// How much the colour and normal of a splat count within a sheet: what faces the eye hides what faces away. The change
/// from one to the other is spread over a quarter of the cosine, and far sides keep enough to have a colour when alone.
fn facing(normal: DVec3, center: DVec3, view: &View) -> f64 {
    let ray = if view.perspective { center.normalize_or_zero() } else { DVec3::Z };
    (0.5 - 4.0 * normal.dot(ray)).clamp(1.0 / 255.0, 1.0)
}

impl Kernel {
    /// All kernels of a scene.
    pub fn gather(scene: &Scene, view: &View) -> Vec<Self> {
        let mut kernels = Vec::new();
        for item in &scene.items {
            match item {
                Item::Radiance(set) | Item::Scalar(set, _) => {
                    kernels.extend(set.splats.iter().filter_map(|splat| Self::from_splat(set, splat, view)));
                }
                Item::Volume(volume, shape, _) => {
                    let lattice = &volume.lattice;
                    let factor = view.rotation * lattice.axes * shape.unit();
                    let whitening = factor.inverse();
                    let extent = shape.radius();
                    let [nx, ny, _] = lattice.dims;
                    kernels.extend((0..lattice.len()).map(|at| {
                        let index = [at % nx, at / nx % ny, at / nx / ny].map(|i| i as f64);
                        let center = view.to_view(lattice.position(DVec3::from(index)));
                        Self { center, factor, whitening, extent, load: Load::Scalar(volume.value(at)) }
                    }));
                }
            }
        }
        kernels
    }

    /// A splat, widened so that it does not fall between pixels; `None` where it has no volume or is not finite.
    fn from_splat(set: &SplatSet, splat: &Splat, view: &View) -> Option<Self> {
        let center = view.to_view(set.origin + DVec3::from(splat.center.map(f64::from)));
        let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
        let columns = [DVec3::new(b00, b10, b20), DVec3::new(0.0, b11, b21), DVec3::new(0.0, 0.0, b22)];
        let sharp = view.rotation * DMat3::from_cols(columns[0], columns[1], columns[2]);
        let pixel = if view.perspective { center.length() } else { 1.0 } / view.scale;
        let blur = DMat3::from_diagonal(DVec3::splat((FOOTPRINT_BLUR * pixel).powi(2)));
        let factor = cholesky(sharp * sharp.transpose() + blur)?;
        let load = match set.payload {
            Payload::Scalar => Load::Scalar(splat.strength.into()),
            Payload::Radiance => {
                let [red, green, blue, opacity] = splat.color.to_le_bytes().map(|byte| f64::from(byte) / 255.0);
                let normal = decode_normal(splat.normal).map(|normal| view.rotation * normal.as_dvec3());
                Load::Radiance {
                    strength: f64::from(splat.strength) * opacity,
                    color: DVec3::new(red, green, blue),
                    normal,
                    facing: normal.map_or(1.0, |normal| facing(normal, center, view)),
                }
            }
        };
        Some(Self { center, factor, whitening: factor.inverse(), extent: set.extent.into(), load })
    }

    /// Whether the plane of the points p with p·normal = offset meets the footprint's ellipsoid.
    pub fn meets_plane(&self, normal: DVec3, offset: f64) -> bool {
        let reach = self.extent * (self.factor.transpose() * normal).length();
        // A hair more than the reach, so that rounding leaves out no kernel that a ray in the plane meets.
        (self.center.dot(normal) - offset).abs() <= reach * (1.0 + 1e-9)
    }

    /// What a ray meets of the kernel; `None` where it passes outside the footprint.
    pub fn cross(&self, ray: &Ray) -> Option<Crossing> {
        let alpha = self.whitening * (ray.origin - self.center);
        let beta = self.whitening * ray.direction;
        let squared = beta.length_squared();
        let rho_squared = alpha.cross(beta).length_squared() / squared;
        let inside = rho_squared <= self.extent * self.extent;
        if !inside {
            return None;
        }
        let closest = -alpha.dot(beta) / squared;
        // ρ² is the smallest |α + sβ|² along the ray. At a minimum, moving s changes nothing at first order, so only
        // the ray's own movement counts.
        let offset = alpha + closest * beta;
        let across = DVec2::from(ray.across(closest).map(|step| offset.dot(self.whitening * step)));
        Some(Crossing { weight: (-0.5 * rho_squared).exp(), closest, density: squared.sqrt(), across })
    }
}

/// The lower triangular L with L·Lᵀ = `matrix`; `None` where the matrix is not positive definite.
fn cholesky(matrix: DMat3) -> Option<DMat3> {
    let row = |r: usize, c: usize| matrix.col(c)[r];
    let pivot = |squared: f64| (squared > 0.0 && squared.is_finite()).then(|| squared.sqrt());
    let l00 = pivot(row(0, 0))?;
    let (l10, l20) = (row(1, 0) / l00, row(2, 0) / l00);
    let l11 = pivot(row(1, 1) - l10 * l10)?;
    let l21 = (row(2, 1) - l20 * l10) / l11;
    let l22 = pivot(row(2, 2) - l20 * l20 - l21 * l21)?;
    Some(DMat3::from_cols(DVec3::new(l00, l10, l20), DVec3::new(0.0, l11, l21), DVec3::new(0.0, 0.0, l22)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::{Camera, Projection},
        splat::NO_NORMAL,
    };

    fn skewed() -> SplatSet {
        let splat = Splat {
            center: [0.4, -0.3, 0.2],
            strength: 1.0,
            factor: [0.5, -0.2, 0.3, 0.4, 0.1, 0.25],
            color: u32::MAX,
            normal: NO_NORMAL,
        };
        SplatSet {
            origin: DVec3::new(0.1, 0.2, 0.3),
            payload: Payload::Radiance,
            splats: vec![splat],
            extent: 8.0,
            overlap: 1.0,
        }
    }

    fn views() -> [View; 2] {
        [Projection::Perspective { view_angle: 50.0 }, Projection::Orthographic { height: 3.0 }].map(|projection| {
            let position = DVec3::new(2.0, -2.5, 1.0);
            let camera = Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Z, projection };
            camera.view([40, 30]).unwrap()
        })
    }

    #[test]
    fn the_factor_gives_the_covariance_back() {
        let set = skewed();
        for view in views() {
            let kernel = Kernel::from_splat(&set, &set.splats[0], &view).unwrap();
            let identity = kernel.whitening * kernel.factor;
            assert!(identity.abs_diff_eq(DMat3::IDENTITY, 1e-12));
            // Σ₀₀ = b00² (world frame), without the widening of the footprint.
            let world = view.rotation.transpose() * kernel.factor;
            let covariance = world * world.transpose();
            let pixel = if view.perspective { kernel.center.length() } else { 1.0 } / view.scale;
            assert!((covariance.x_axis.x - 0.25 - (0.35 * pixel).powi(2)).abs() < 1e-9);
            assert!((covariance.x_axis.y + 0.1).abs() < 1e-7);
        }
        assert!(cholesky(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(cholesky(DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0))).is_none());
    }

    #[test]
    fn a_crossing_is_where_the_gaussian_is_largest_and_moves_as_its_derivative_says() {
        let set = skewed();
        for view in views() {
            let kernel = Kernel::from_splat(&set, &set.splats[0], &view).unwrap();
            let pixel = DVec2::new(23.5, 11.5);
            let ray = Ray::new(&view, pixel);
            let crossing = kernel.cross(&ray).unwrap();
            let value = |s: f64| (-0.5 * (kernel.whitening * (ray.point(s) - kernel.center)).length_squared()).exp();
            assert!((value(crossing.closest) - crossing.weight).abs() < 1e-12);
            assert!(
                value(crossing.closest + 1e-3) < crossing.weight && value(crossing.closest - 1e-3) < crossing.weight
            );
            // One world unit takes |β| standard deviations.
            let further = value(crossing.closest + 1.0 / crossing.density);
            assert!((further / crossing.weight - (-0.5_f64).exp()).abs() < 1e-12);
            let step = 1e-4;
            for (axis, derivative) in [DVec2::X, DVec2::Y].into_iter().zip(crossing.across.to_array()) {
                let [before, after] = [-step, step].map(|d| {
                    let weight = kernel.cross(&Ray::new(&view, pixel + d * axis)).unwrap().weight;
                    -weight.ln()
                });
                let expected = (after - before) / (2.0 * step);
                assert!(expected.abs() > 1e-3, "a test of nothing");
                assert!((expected - derivative).abs() < 1e-7 * expected.abs().max(1.0), "{expected} {derivative}");
            }
        }
    }

    #[test]
    fn a_plane_that_a_ray_lies_in_meets_what_the_ray_meets() {
        let set = skewed();
        for view in views() {
            let kernel = Kernel { extent: 1.5, ..Kernel::from_splat(&set, &set.splats[0], &view).unwrap() };
            let mut met = 0;
            for row in -10..50 {
                let [left, right] = [-50.0, 90.0].map(|x| Ray::new(&view, DVec2::new(x, f64::from(row) + 0.5)));
                let normal = if view.perspective { left.direction.cross(right.direction) } else { DVec3::Y };
                let plane = kernel.meets_plane(normal, left.origin.dot(normal));
                let rays = (0..400).filter(|&i| {
                    let pixel = DVec2::new(-50.0 + 0.35 * f64::from(i), f64::from(row) + 0.5);
                    kernel.cross(&Ray::new(&view, pixel)).is_some()
                });
                let rays = rays.count();
                assert!(plane || rays == 0);
                // The ellipsoid is met by the plane in more than a point, unless only just.
                met += usize::from(plane != (rays > 0));
            }
            assert!(met <= 2, "{met} rows were kept for nothing");
        }
    }
}

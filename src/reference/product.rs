//! The field of a volume whose kernel is a product of functions along the axes of its lattice.

use super::{face::Face, quadrature::quadrature, ray::Ray, sheet::Mean};
use crate::{
    math::{Kernel, Tensor, View, cosine::mirrored},
    volume::{Lattice, Volume},
};
use glam::{DMat3, DVec3};

/// A field of tensor products, in view space.
pub(super) struct Product<'a> {
    volume: &'a Volume,
    tensor: Tensor,
    /// The map from view space to steps, and the place of the first sample in view space.
    to_steps: DMat3,
    origin: DVec3,
}

/// The samples around a place along one axis: their indices, weights and derivatives of the
/// weights.
type Taps = [(usize, f64, f64); 4];

impl<'a> Product<'a> {
    /// Returns the field of a volume, or `None` if its kernel is not a tensor product.
    pub fn new(volume: &'a Volume, kernel: &Kernel, view: &View) -> Option<Self> {
        let Lattice { axes, origin, .. } = volume.lattice;
        let to_steps = (view.rotation * axes).inverse();
        Some(Self { volume, tensor: kernel.as_tensor()?, to_steps, origin: view.to_view(origin) })
    }

    /// Returns the value and the gradient at a point of view space.
    pub fn at(&self, point: DVec3) -> (f64, DVec3) {
        let (value, slopes) = self.at_steps(self.to_steps * (point - self.origin));
        (value, self.to_steps.transpose() * slopes)
    }

    /// Returns the value at a place in steps, and its change per step along each axis.
    pub fn at_steps(&self, steps: DVec3) -> (f64, DVec3) {
        let [nx, ny, _] = self.volume.lattice.dims;
        let [x, y, z] = [0, 1, 2].map(|axis| self.taps(steps[axis], axis));
        let (mut value, mut slopes) = (0.0, DVec3::ZERO);
        for (k, wz, dz) in z {
            for (j, wy, dy) in y {
                for (i, wx, dx) in x {
                    let sample = self.volume.drawn_value((k * ny + j) * nx + i);
                    value += wx * wy * wz * sample;
                    slopes += sample * DVec3::new(dx * wy * wz, wx * dy * wz, wx * wy * dz);
                }
            }
        }
        (value, slopes)
    }

    /// Returns the samples around a place along an axis. Beyond the lattice's ends, they are
    /// mirrored.
    fn taps(&self, place: f64, axis: usize) -> Taps {
        let count = self.volume.lattice.dims[axis];
        let first = place.floor() - 1.0;
        [0.0, 1.0, 2.0, 3.0].map(|tap| {
            let index = first + tap;
            let away = place - index;
            (mirrored(index as isize, count), self.tensor.value(away), self.tensor.slope(away))
        })
    }

    /// Returns the field at a distance along a ray.
    pub fn face(&self, ray: &Ray, s: f64) -> Face {
        let (value, gradient) = self.at(ray.point(s));
        Face::new(value, gradient)
    }

    /// Returns the integral of the field over a part of a ray. The field is a polynomial between
    /// planes of samples, of the ninth degree at most.
    pub fn mean(&self, ray: &Ray, [from, to]: [f64; 2]) -> Mean {
        let (start, way) =
            (self.to_steps * (ray.origin - self.origin), self.to_steps * ray.direction);
        let mut cuts = vec![from, to];
        for axis in 0..3 {
            let ends = [from, to].map(|s| start[axis] + s * way[axis]);
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            let planes = low.floor() as i64 + 1..high.ceil() as i64;
            cuts.extend(
                planes
                    .map(|plane| (plane as f64 - start[axis]) / way[axis])
                    .filter(|s| from < *s && *s < to),
            );
        }
        cuts.sort_by(f64::total_cmp);
        let parts = cuts
            .windows(2)
            .map(|part| quadrature([part[0], part[1]], |s| [self.at(ray.point(s)).0])[0]);
        Mean::new(to - from, parts.sum())
    }
}

#[cfg(test)]
mod tests {
    use super::{super::ray::tests::views, *};
    use crate::volume::Samples;
    use glam::DVec2;

    /// Three lattices: sheared, with two samples along an axis, and with one sample along an axis.
    fn volumes() -> [Volume; 3] {
        [[5, 4, 6], [2, 5, 3], [4, 1, 3]].map(|dims| {
            let axes = DMat3::from_cols(
                DVec3::new(0.3, 0.1, 0.0),
                DVec3::new(0.0, 0.2, 0.1),
                DVec3::new(0.05, 0.0, 0.4),
            );
            let lattice = Lattice::cartesian(dims, DVec3::new(0.1, 0.2, 0.3), axes);
            let values = (0..lattice.len()).map(|at| ((at * at) as f32).sin()).collect();
            Volume::new(lattice, Samples::F32(values)).unwrap()
        })
    }

    fn fields(volume: &Volume, view: &View, take: impl Fn(Tensor, &Product)) {
        for tensor in Tensor::ALL {
            let kernel = Kernel::tensor(tensor);
            let sharp = volume.clone().sharpened(&kernel).unwrap();
            take(tensor, &Product::new(&sharp, &kernel, view).unwrap());
        }
    }

    #[test]
    fn fields_pass_through_the_samples() {
        for volume in volumes() {
            for view in views() {
                fields(&volume, &view, |tensor, field| {
                    for at in 0..volume.len() {
                        // Not exactly at the sample, where rounding would choose the cell.
                        let place = view.to_view(volume.lattice.sample_position(at));
                        let (value, _) = field.at(place + DVec3::splat(1e-9));
                        assert!(
                            (value - volume.value(at)).abs() < 2e-6,
                            "{tensor:?} at {at}: {value}"
                        );
                    }
                });
            }
        }
    }

    #[test]
    fn gradients_are_those_of_the_values() {
        for volume in volumes() {
            for view in views() {
                fields(&volume, &view, |tensor, field| {
                    for at in 0..20 {
                        let place = |shift: f64| (f64::from(at) + shift).sin() * 0.4 + 0.5;
                        // Points beyond the samples too.
                        let point =
                            view.to_view(DVec3::new(place(0.3), place(1.7), place(4.0)) * 1.4);
                        let (_, gradient) = field.at(point);
                        // A linear field has the slopes of its differences over two steps.
                        let step = if tensor == Tensor::Linear { 1.0 } else { 1e-6 };
                        let axes = field.to_steps.inverse() * step;
                        for axis in [axes.x_axis, axes.y_axis, axes.z_axis] {
                            let [before, after] =
                                [-1.0, 1.0].map(|side| field.at(point + side * axis).0);
                            let expected = 0.5 * (after - before);
                            assert!(
                                (gradient.dot(axis) - expected).abs() < 1e-5 * axis.length(),
                                "{tensor:?}: {gradient} {expected}"
                            );
                        }
                    }
                });
            }
        }
    }

    #[test]
    fn means_are_what_many_points_sum_to() {
        let [volume, ..] = volumes();
        for view in views() {
            let ray = Ray::new(&view, DVec2::new(21.3, 14.2));
            fields(&volume, &view, |tensor, field| {
                for part in [[3.0, 3.1], [3.2, 4.4], [2.0, 5.0]] {
                    let steps = 20_000;
                    let place = |i: i32| {
                        part[0] + (part[1] - part[0]) * (f64::from(i) + 0.5) / f64::from(steps)
                    };
                    let sum: f64 = (0..steps).map(|i| field.at(ray.point(place(i))).0).sum();
                    let mean = field.mean(&ray, part).value(0.1, part[1] - part[0]).unwrap();
                    assert!(
                        (mean - sum / f64::from(steps)).abs() < 1e-6,
                        "{tensor:?} {part:?}: {mean}"
                    );
                }
            });
        }
    }
}

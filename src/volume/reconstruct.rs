//! The field between the samples, as the engine's splats draw it, evaluated at single positions.

use super::{Arrangement, Lattice, Volume, grid::weight};
use crate::{
    Error, Result,
    math::{Kernel, Tensor, cosine::mirrored},
};
use glam::{DMat3, DVec3};

/// The normalised kernel sum Σ c·h / Σ h over the values that a volume draws: its samples, or the
/// coefficients of a sharp volume.
#[derive(Debug, Clone)]
pub struct Reconstruction<'a> {
    volume: &'a Volume,
    kernel: &'a Kernel,
    /// Maps world positions to steps.
    inverse: DMat3,
}

impl<'a> Reconstruction<'a> {
    /// Prepares the reconstruction of a volume by a kernel.
    ///
    /// # Errors
    /// [`Error::Argument`] in these cases:
    ///
    /// - The lattice is rectilinear, or the kernel is a tensor product and the lattice is not
    ///   Cartesian.
    /// - The volume was made sharp for another kernel.
    /// - The volume or the kernel was built by hand and is inconsistent.
    pub fn new(volume: &'a Volume, kernel: &'a Kernel) -> Result<Self> {
        volume.validate().map_err(Error::Argument)?;
        Self::of_checked(volume, kernel)
    }

    /// Like [`new`](Self::new), for a volume that was checked before. Its samples are not looked
    /// at, so that a large volume is prepared at once.
    pub(crate) fn of_checked(volume: &'a Volume, kernel: &'a Kernel) -> Result<Self> {
        kernel.validate()?;
        if matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_)) {
            return Err(Error::Argument(
                "a rectilinear lattice cannot be reconstructed at single positions".into(),
            ));
        }
        if volume.coefficients.as_ref().is_some_and(|coefficients| coefficients.kernel != *kernel) {
            return Err(Error::Argument("the volume was made sharp for another kernel".into()));
        }
        if kernel.as_tensor().is_some() && volume.lattice.arrangement != Arrangement::Cartesian {
            return Err(Error::Argument(
                "tensor products can be used on Cartesian lattices only".into(),
            ));
        }
        Ok(Self { volume, kernel, inverse: volume.lattice.axes.inverse() })
    }

    /// Returns the value at a world position, or `None` if no kernel reaches it.
    pub fn value_at(&self, position: DVec3) -> Option<f64> {
        let lattice = self.volume.drawn_lattice();
        let steps = self.inverse * (position - lattice.origin);
        if let Some(tensor) = self.kernel.as_tensor() {
            return self.product_at(tensor, steps);
        }
        let body_centred = lattice.arrangement == Arrangement::BodyCentred;
        // Layers per step along the third axis (on a body-centred lattice every other one is
        // displaced), and a kernel unit in steps.
        let (layers, unit) = if body_centred { (2.0, lattice.unit([0; 3]).x) } else { (1.0, 1.0) };
        let reach = self.kernel.extent * unit + 1e-9;
        let (mut sum, mut weights) = (0.0, 0.0);
        for k in within(layers * steps.z, layers * reach, lattice.dims[2]) {
            let displaced = if body_centred { 0.5 * (k % 2) as f64 } else { 0.0 };
            for j in within(steps.y - displaced, reach, lattice.dims[1]) {
                for i in within(steps.x - displaced, reach, lattice.dims[0]) {
                    let share =
                        weight(self.kernel, lattice.steps([i, j, k]).distance(steps) / unit);
                    if share != 0.0 {
                        sum += share * self.volume.drawn_value(offset(lattice, [i, j, k]));
                        weights += share;
                    }
                }
            }
        }
        (weights != 0.0).then(|| sum / weights)
    }

    /// Returns the value of a tensor product at a position in steps, inside the box of the samples.
    fn product_at(&self, tensor: Tensor, steps: DVec3) -> Option<f64> {
        let lattice = &self.volume.lattice;
        let last = lattice.step_range().max;
        // An axis of one sample extends half a step to either side.
        let margin = DVec3::select(last.cmpgt(DVec3::ZERO), DVec3::splat(1e-9), DVec3::splat(0.5));
        if !(steps.cmpge(-margin).all() && steps.cmple(last + margin).all()) {
            return None;
        }
        let taps = [0, 1, 2].map(|axis| {
            let first = steps[axis].floor() as isize - 1;
            [0, 1, 2, 3].map(|tap| {
                let index = first + tap;
                (mirrored(index, lattice.dims[axis]), tensor.value(steps[axis] - index as f64))
            })
        });
        let mut sum = 0.0;
        for (k, z) in taps[2] {
            for (j, y) in taps[1] {
                for (i, x) in taps[0] {
                    sum += x * y * z * self.volume.drawn_value(offset(lattice, [i, j, k]));
                }
            }
        }
        Some(sum)
    }
}

fn offset(lattice: &Lattice, [i, j, k]: [usize; 3]) -> usize {
    (k * lattice.dims[1] + j) * lattice.dims[0] + i
}

/// Returns the indices below `count` that lie within `reach` of a position.
fn within(place: f64, reach: f64, count: usize) -> std::ops::Range<usize> {
    // Casts clamp negative values to 0.
    (place - reach).ceil() as usize..((place + reach + 1.0).floor() as usize).min(count)
}

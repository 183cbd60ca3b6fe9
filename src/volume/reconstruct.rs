//! The field between the samples, as the engine's splats draw it, at single positions.

use super::{Arrangement, Lattice, Volume, grid::weight};
use crate::{Error, Result, math::Kernel};
use glam::{DMat3, DVec3};

/// The normalised kernel sum Σ c·h / Σ h over what a volume draws: its samples, or where it is sharp its coefficients.
#[derive(Debug, Clone)]
pub struct Reconstruction<'a> {
    volume: &'a Volume,
    kernel: &'a Kernel,
    /// World positions to steps.
    inverse: DMat3,
}

impl<'a> Reconstruction<'a> {
    /// # Errors
    /// [`Error::Argument`] for a rectilinear lattice, for a volume that was made sharp for another kernel, and for a volume or a
    /// kernel that was put together by hand and contradicts itself.
    pub fn new(volume: &'a Volume, kernel: &'a Kernel) -> Result<Self> {
        volume.validate().map_err(Error::Argument)?;
        kernel.validate()?;
        if matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_)) {
            return Err(Error::Argument("a rectilinear lattice cannot be reconstructed at single positions".into()));
        }
        if volume.coefficients.as_ref().is_some_and(|coefficients| coefficients.kernel != *kernel) {
            return Err(Error::Argument("the volume was made sharp for another kernel".into()));
        }
        Ok(Self { volume, kernel, inverse: volume.lattice.axes.inverse() })
    }

    /// The value at a world position; `None` where no kernel reaches.
    pub fn value_at(&self, position: DVec3) -> Option<f64> {
        let lattice = self.volume.drawn_lattice();
        let steps = self.inverse * (position - lattice.origin);
        let body_centred = lattice.arrangement == Arrangement::BodyCentred;
        // Layers to the step along the third axis; layers in turn displaced; a kernel unit in steps.
        let (layers, unit) = if body_centred { (2.0, lattice.unit([0; 3]).x) } else { (1.0, 1.0) };
        let reach = self.kernel.extent * unit + 1e-9;
        let (mut sum, mut weights) = (0.0, 0.0);
        for k in within(layers * steps.z, layers * reach, lattice.dims[2]) {
            let displaced = if body_centred { 0.5 * (k % 2) as f64 } else { 0.0 };
            for j in within(steps.y - displaced, reach, lattice.dims[1]) {
                for i in within(steps.x - displaced, reach, lattice.dims[0]) {
                    let share = weight(self.kernel, lattice.steps([i, j, k]).distance(steps) / unit);
                    if share != 0.0 {
                        sum += share * self.volume.drawn_value(offset(lattice, [i, j, k]));
                        weights += share;
                    }
                }
            }
        }
        (weights != 0.0).then(|| sum / weights)
    }
}

fn offset(lattice: &Lattice, [i, j, k]: [usize; 3]) -> usize {
    (k * lattice.dims[1] + j) * lattice.dims[0] + i
}

/// The indices below `count` that lie within `reach` of a place.
fn within(place: f64, reach: f64, count: usize) -> std::ops::Range<usize> {
    // Casts cut to 0 and up.
    (place - reach).ceil() as usize..((place + reach + 1.0).floor() as usize).min(count)
}

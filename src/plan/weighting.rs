//! How the kernel of a lattice weights the samples around a place, if four weights an axis suffice.

use crate::math::{Kernel, Profile, Tensor};

/// Maximum weight of samples that count as out of reach, relative to 1 at the centre.
pub const LEAST_WEIGHT: f64 = 5e-3;
/// Minimum standard deviation of a kernel, in steps, whose weights fit 32 bits.
pub const LEAST_DEVIATION: f64 = 0.3;

/// How the samples around a place are weighted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weighting {
    /// By Gaussians with this standard deviation, in steps.
    Gaussian(f64),
    Tensor(Tensor),
    /// The label of the nearest sample, with the gradient of the label's mask, whose samples are
    /// weighted by Gaussians with a standard deviation of [`MASK_DEVIATION`].
    Labels,
}

/// Standard deviation, in steps, of the Gaussians that smooth a label's mask.
pub const MASK_DEVIATION: f64 = 0.7;

/// Returns the weighting of a kernel, or `None` if four weights an axis do not suffice.
pub fn weighting(kernel: &Kernel) -> Option<Weighting> {
    match kernel.profile {
        Profile::Gaussian(sigma) => {
            let at = |distance: f64| (-0.5 * (distance / sigma).powi(2)).exp();
            (at(kernel.extent.min(2.0)) <= LEAST_WEIGHT).then_some(Weighting::Gaussian(sigma))
        }
        Profile::Tensor(tensor) => Some(Weighting::Tensor(tensor)),
        Profile::BSpline | Profile::Hann | Profile::Table(_) => None,
    }
}

/// Returns the standard deviation, in steps, of a Gaussian for which four weights an axis suffice.
pub fn deviation(kernel: &Kernel) -> Option<f64> {
    if let Some(Weighting::Gaussian(sigma)) = weighting(kernel) { Some(sigma) } else { None }
}

//! Sums of kernels at a place, and their quotient, the field there.

use super::vector::{Lanes, three};
use crate::{
    math::{Kernel, Profile},
    plan::weighting::LEAST_WEIGHT,
};
use fearless_simd::{Simd, prelude::*};

/// Maximum number of samples along an axis that a place reads.
pub const MOST_TAPS: usize = 12;

/// Returns how far a kernel reaches, in samples. A Gaussian does not end along the rays; it reaches
/// as far as it has weight.
pub fn reach(kernel: &Kernel) -> f64 {
    match kernel.profile {
        Profile::Gaussian(sigma) => sigma * (-2.0 * LEAST_WEIGHT.ln()).sqrt(),
        _ => kernel.extent,
    }
}

/// Sums of the kernels at a place: weights and weighted values, and their changes per step along
/// the axes.
#[derive(Clone, Copy)]
pub struct Sums<S: Simd> {
    pub weight: Lanes<S>,
    pub value: Lanes<S>,
    pub weight_slopes: [Lanes<S>; 3],
    pub value_slopes: [Lanes<S>; 3],
}

/// The field at a place: its value and its change per step along each axis. `weight` is the excess
/// over the minimum sum of kernels; if it is not above 0, there is no field.
#[derive(Clone, Copy)]
pub struct Point<S: Simd> {
    pub value: Lanes<S>,
    pub slopes: [Lanes<S>; 3],
    pub weight: Lanes<S>,
}

impl<S: Simd> Point<S> {
    /// Returns a place without a field.
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let none = Lanes::splat(simd, 0.0);
        Self { value: none, slopes: [none; 3], weight: none }
    }

    /// Sets the value and its slopes.
    #[inline(always)]
    pub fn set(&mut self, (value, [x, y, z]): (Lanes<S>, [Lanes<S>; 3])) {
        self.value = value;
        self.slopes[0] = x;
        self.slopes[1] = y;
        self.slopes[2] = z;
    }
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            weight: self.weight + other.weight,
            value: self.value + other.value,
            weight_slopes: three!(I => self.weight_slopes[I] + other.weight_slopes[I]),
            value_slopes: three!(I => self.value_slopes[I] + other.value_slopes[I]),
        }
    }

    /// Returns the field. `scale` is the factor from the slopes of the sums to those of the field.
    #[inline(always)]
    pub fn quotient(&self, simd: S, scale: f32) -> Point<S> {
        // Where kernels of both signs nearly cancel, and far outside, the result does not matter.
        let inverse = Lanes::splat(simd, 1.0) / self.weight.max(Lanes::splat(simd, 1e-20));
        let value = self.value * inverse;
        let inverse = inverse * scale;
        let slopes = three!(I => (self.value_slopes[I] - value * self.weight_slopes[I]) * inverse);
        Point { value, slopes, weight: self.weight }
    }
}

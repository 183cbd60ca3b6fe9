//! The reconstruction kernel of lattice samples: a radial function, in units of the sample spacing.

use crate::{Error, Result};
use std::{f64::consts::PI, sync::Arc};

/// The shape of a kernel over the distance r from its sample, in sample spacings.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// exp(−r²/2σ²) with this σ. Its footprint ends at the extent; along the ray it is whole.
    Gaussian(f64),
    /// The cubic B-spline, stretched so that it ends at the extent (2 is its own).
    BSpline,
    /// The low-pass filter of a ball, 3(sin x − x cos x)/x³ at x = πr, under a Hann window that ends at the extent:
    /// cos²(πr / 2·extent). (A radial sin(πr)/πr is the filter of no band: over space it sums to less than nothing.)
    Hann,
    /// Values at evenly spaced radii from 0 to the extent, linear in between.
    Table(Arc<[f64]>),
}

/// A radial kernel that ends at `extent`.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    pub profile: Profile,
    /// Radius of the footprint, in sample spacings.
    pub extent: f64,
}

impl Default for Kernel {
    /// A Gaussian of σ = 0.6 with extent 2: its sum over a Cartesian lattice ripples by 1.3 %; dividing by that sum
    /// removes it from the picture.
    fn default() -> Self {
        Self { profile: Profile::Gaussian(0.6), extent: 2.0 }
    }
}

impl Kernel {
    /// The widest footprint that the engine takes, in sample spacings.
    pub const MAX_EXTENT: f64 = 16.0;
    /// The most values of a [`Profile::Table`].
    pub const MAX_TABLE: usize = 65_536;

    /// A Gaussian of standard deviation `sigma` cut at radius `extent`, both in sample spacings.
    pub fn gaussian(sigma: f64, extent: f64) -> Result<Self> {
        if !(sigma > 0.0 && sigma.is_finite()) {
            return Err(Error::Argument(format!("a kernel needs a sigma above 0, found {sigma}")));
        }
        let kernel = Self::with_extent(Profile::Gaussian(sigma), extent)?;
        if kernel.radius() < 1.0 {
            return Err(Error::Argument(format!(
                "a Gaussian of sigma {sigma} cut at {extent} samples is a block; cut it at {sigma} or more"
            )));
        }
        Ok(kernel)
    }

    /// A cubic B-spline that ends at `extent`.
    pub fn b_spline(extent: f64) -> Result<Self> {
        Self::with_extent(Profile::BSpline, extent)
    }

    /// A Hann-windowed sinc that ends at `extent`.
    pub fn hann(extent: f64) -> Result<Self> {
        Self::with_extent(Profile::Hann, extent)
    }

    /// A kernel of the caller's own: its values at evenly spaced radii from 0 to `extent`.
    pub fn table(values: Vec<f64>, extent: f64) -> Result<Self> {
        let (count, most) = (values.len(), Self::MAX_TABLE);
        if !(2..=most).contains(&count) || !values.iter().all(|value| value.is_finite()) {
            return Err(Error::Argument(format!("a kernel's table has 2 to {most} finite values, found {count}")));
        }
        let kernel = Self::with_extent(Profile::Table(values.into()), extent)?;
        if kernel.integral() <= 0.0 {
            return Err(Error::Argument("a kernel's values must add up to more than 0".into()));
        }
        Ok(kernel)
    }

    fn with_extent(profile: Profile, extent: f64) -> Result<Self> {
        // Below 0.71 samples (half the diagonal of a face) a ray can pass between the samples of a lattice.
        if !(0.71..=Self::MAX_EXTENT).contains(&extent) {
            let most = Self::MAX_EXTENT;
            return Err(Error::Argument(format!(
                "a kernel's extent must lie in 0.71 … {most} samples, found {extent}"
            )));
        }
        Ok(Self { profile, extent })
    }

    /// Checks what the constructors do, of a kernel that may have been put together by hand.
    pub(crate) fn validate(&self) -> Result<()> {
        match &self.profile {
            Profile::Gaussian(sigma) => Self::gaussian(*sigma, self.extent),
            Profile::Table(values) => Self::table(values.to_vec(), self.extent),
            profile => Self::with_extent(profile.clone(), self.extent),
        }
        .map(|_| ())
    }

    /// The length, in sample spacings, that kernel space counts in: σ of a Gaussian, one spacing of any other.
    pub fn unit(&self) -> f64 {
        match self.profile {
            Profile::Gaussian(sigma) => sigma,
            _ => 1.0,
        }
    }

    /// Radius of the footprint in kernel space.
    pub fn radius(&self) -> f64 {
        self.extent / self.unit()
    }

    /// The value at distance `r`, in sample spacings; 0 beyond the extent, 1 at the sample unless a table says otherwise.
    pub fn value(&self, r: f64) -> f64 {
        if r > self.extent {
            return 0.0;
        }
        match &self.profile {
            Profile::Gaussian(sigma) => (-0.5 * (r / sigma).powi(2)).exp(),
            Profile::BSpline => {
                let t = 2.0 * r / self.extent;
                if t < 1.0 { 1.0 - 1.5 * t * t + 0.75 * t * t * t } else { 0.25 * (2.0 - t).powi(3) }
            }
            Profile::Hann => {
                let x = PI * r;
                // Near 0 the difference cancels; the series does not.
                let filter = if x < 0.02 { 1.0 - 0.1 * x * x } else { 3.0 * (x.sin() - x * x.cos()) / x.powi(3) };
                filter * (0.5 * PI * r / self.extent).cos().powi(2)
            }
            Profile::Table(values) => {
                let Some(last) = values.len().checked_sub(1) else { return 0.0 };
                let at = r / self.extent * last as f64;
                let low = (at as usize).min(last.saturating_sub(1));
                values[low] + (values[last.min(low + 1)] - values[low]) * (at - low as f64)
            }
        }
    }

    /// Whether the kernel has negative values.
    pub fn is_signed(&self) -> bool {
        match &self.profile {
            Profile::Gaussian(_) | Profile::BSpline => false,
            Profile::Hann => self.extent > 1.43, // the filter's first zero
            Profile::Table(values) => values.iter().any(|value| *value < 0.0),
        }
    }

    /// What kernels must add up to at a point for it to have a value: where lobes of both signs all but cancel, at the edge
    /// of what is drawn, their mean would be of any size.
    pub fn least_sum(&self) -> f64 {
        if self.is_signed() { 0.3 * self.integral() } else { 1e-4 }
    }

    /// ∫ of the kernel over space, in cubed sample spacings: what its copies at every sample of a Cartesian lattice sum to
    /// on average. A Gaussian is cut by its footprint's cylinder alone.
    pub fn integral(&self) -> f64 {
        if let Profile::Gaussian(sigma) = self.profile {
            return (2.0 * PI).powf(1.5) * sigma.powi(3) * -(-0.5 * self.radius().powi(2)).exp_m1();
        }
        // Simpson's rule over the radius.
        let parts = 4096;
        let step = self.extent / f64::from(parts);
        let shell = |i: u32| {
            let r = f64::from(i) * step;
            4.0 * PI * r * r * self.value(r)
        };
        let weight = |i: u32| if i == 0 || i == parts { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
        (0..=parts).map(|i| weight(i) * shell(i)).sum::<f64>() * step / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_by_hand() {
        let gaussian = Kernel::gaussian(0.5, 2.0).unwrap();
        assert!((gaussian.value(0.5) - (-0.5f64).exp()).abs() < 1e-15 && gaussian.radius() == 4.0);
        let spline = Kernel::b_spline(2.0).unwrap();
        // ⅔, ⅙ and 0 over ⅔.
        assert_eq!([0.0, 1.0, 2.0].map(|r| spline.value(r)), [1.0, 0.25, 0.0]);
        let hann = Kernel::hann(3.0).unwrap();
        // 3/π² · cos²(π/6); beyond the first zero, at 1.43, it is negative.
        assert!((hann.value(1.0) - 2.25 / (PI * PI)).abs() < 1e-12 && hann.value(1.4) > 0.0 && hann.value(1.5) < 0.0);
        assert!((hann.value(0.02 / PI) - hann.value(0.019_999 / PI)).abs() < 1e-6);
        // 6/π without the window.
        assert!((hann.integral() - 6.0 / PI).abs() < 0.02);
        let table = Kernel::table(vec![1.0, 0.5, 0.0], 4.0).unwrap();
        assert_eq!([0.0, 1.0, 2.0, 3.0, 4.0, 4.1].map(|r| table.value(r)), [1.0, 0.75, 0.5, 0.25, 0.0, 0.0]);
        // A cone of height 1 and radius 4: its integral over a ball is π·4³/3.
        assert!((table.integral() / (PI * 64.0 / 3.0) - 1.0).abs() < 1e-6);
        // 4π (⅓ − 3/10 + ⅛ + 11/120)
        assert!((spline.integral() / PI - 1.0).abs() < 1e-9);
    }

    #[test]
    fn impossible_kernels_are_told() {
        let message = |kernel: Result<Kernel>| kernel.unwrap_err().to_string();
        assert!(message(Kernel::gaussian(0.0, 2.0)).contains("sigma above 0"));
        assert!(message(Kernel::gaussian(f64::NAN, 2.0)).contains("sigma above 0"));
        assert!(message(Kernel::gaussian(0.6, 1000.0)).contains("0.71 … 16"));
        assert!(message(Kernel::gaussian(3.0, 1.0)).contains("block"));
        assert!(message(Kernel::table(vec![1.0], 2.0)).contains("2 to"));
        assert!(message(Kernel::table(vec![-1.0, 0.0], 2.0)).contains("more than 0"));
        assert!(message(Kernel::table(vec![f64::NAN, 0.0], 2.0)).contains("finite"));
    }
}

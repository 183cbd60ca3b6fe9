//! The reconstruction kernel of lattice samples: a radial function in units of the sample spacing,
//! or a product of functions along the lattice's axes.

use crate::{Error, Result};
use std::{f64::consts::PI, sync::Arc};

/// The shape of a kernel over the distance r from its sample, in sample spacings.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// exp(−r²/2σ²) with this σ. Its footprint ends at the extent; along the ray it is not
    /// truncated.
    Gaussian(f64),
    /// The cubic B-spline, stretched so that it ends at the extent (its own is 2).
    BSpline,
    /// The low-pass filter whose pass band is a ball, 3(sin x − x cos x)/x³ at x = πr, under a Hann
    /// window that ends at the extent: cos²(πr / 2·extent). (A radial sin(πr)/πr is not a low-pass
    /// filter: its integral over space is negative.)
    Hann,
    /// Values at evenly spaced radii from 0 to the extent, linear in between.
    Table(Arc<[f64]>),
    /// A product of three functions, one of the steps along each axis of a Cartesian lattice.
    Tensor(Tensor),
}

/// A kernel that ends at `extent`.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// The shape of the kernel.
    pub profile: Profile,
    /// Radius of the footprint, in sample spacings; for a tensor product, half its width along each
    /// axis.
    pub extent: f64,
}

impl Default for Kernel {
    /// A Gaussian of σ = 0.6 with extent 2. Its sum over a Cartesian lattice ripples by 1.3 %;
    /// dividing by that sum removes the ripple from the picture.
    fn default() -> Self {
        Self { profile: Profile::Gaussian(0.6), extent: 2.0 }
    }
}

impl Kernel {
    /// The names of the kernels that need no table.
    pub const NAMES: [&str; 6] =
        ["gaussian", "b-spline", "hann", "linear", "catmull-rom", "cubic-b-spline"];
    /// The widest footprint that the engine accepts, in sample spacings.
    pub const MAX_EXTENT: f64 = 16.0;
    /// Most values of a [`Profile::Table`].
    pub const MAX_TABLE: usize = 65_536;

    /// Returns a kernel by its name ([`NAMES`](Self::NAMES)). By default, the Gaussian has the
    /// deviation of [`Kernel::default`], and footprints reach as far as is usual for the kernel.
    /// All lengths are in sample spacings.
    ///
    /// # Errors
    /// [`Error::Argument`] for a name that is none, and for lengths that the kernel does not have.
    pub fn named(name: &str, sigma: Option<f64>, extent: Option<f64>) -> Result<Self> {
        if sigma.is_some() && name != "gaussian" {
            let message = format!("sigma applies to the gaussian kernel only, not to {name}");
            return Err(Error::Argument(message));
        }
        if let Some(tensor) = Tensor::ALL.into_iter().find(|tensor| tensor.name() == name) {
            return match extent {
                Some(_) => {
                    let message = "has a fixed extent; leave out the extent";
                    Err(Error::Argument(format!("the kernel {name} {message}")))
                }
                None => Ok(Self::tensor(tensor)),
            };
        }
        match name {
            "gaussian" => {
                let default = Self::default();
                let sigma = sigma.unwrap_or(default.unit());
                // A wider kernel keeps its shape unless the caller sets the extent.
                let least = default.extent.max(default.radius() * sigma);
                Self::gaussian(sigma, extent.unwrap_or(least))
            }
            "b-spline" => Self::b_spline(extent.unwrap_or(2.0)),
            "hann" => Self::hann(extent.unwrap_or(3.0)),
            _ => {
                let names = Self::NAMES.join(", ");
                let message = format!("there is no kernel “{name}”; the kernels are {names}");
                Err(Error::Argument(message))
            }
        }
    }

    /// A Gaussian of standard deviation `sigma` truncated at radius `extent`, both in sample
    /// spacings.
    pub fn gaussian(sigma: f64, extent: f64) -> Result<Self> {
        if !(sigma > 0.0 && sigma.is_finite()) {
            return Err(Error::Argument(format!("a kernel needs a sigma above 0, found {sigma}")));
        }
        let kernel = Self::with_extent(Profile::Gaussian(sigma), extent)?;
        if kernel.radius() < 1.0 {
            return Err(Error::Argument(format!(
                "a Gaussian of sigma {sigma} cut at {extent} samples is a block; \
                 cut it at {sigma} or more"
            )));
        }
        Ok(kernel)
    }

    /// A cubic B-spline that ends at `extent`.
    pub fn b_spline(extent: f64) -> Result<Self> {
        Self::with_extent(Profile::BSpline, extent)
    }

    /// The low-pass filter of [`Profile::Hann`], which ends at `extent`.
    pub fn hann(extent: f64) -> Result<Self> {
        Self::with_extent(Profile::Hann, extent)
    }

    /// A kernel of your own: its values at evenly spaced radii from 0 to `extent`.
    pub fn table(values: Vec<f64>, extent: f64) -> Result<Self> {
        let (count, most) = (values.len(), Self::MAX_TABLE);
        if !(2..=most).contains(&count) || !values.iter().all(|value| value.is_finite()) {
            return Err(Error::Argument(format!(
                "a kernel's table has 2 to {most} finite values, found {count}"
            )));
        }
        let kernel = Self::with_extent(Profile::Table(values.into()), extent)?;
        if kernel.integral() <= 0.0 {
            return Err(Error::Argument("a kernel's values must add up to more than 0".into()));
        }
        Ok(kernel)
    }

    /// A tensor-product kernel, which has its own extent.
    pub fn tensor(tensor: Tensor) -> Self {
        Self { profile: Profile::Tensor(tensor), extent: tensor.extent() }
    }

    /// Returns the function along the axes, if the kernel is a tensor product.
    pub fn as_tensor(&self) -> Option<Tensor> {
        match self.profile {
            Profile::Tensor(tensor) => Some(tensor),
            _ => None,
        }
    }

    fn with_extent(profile: Profile, extent: f64) -> Result<Self> {
        // Below 0.71 samples (half the diagonal of a face) a ray can pass between the samples of a
        // lattice.
        if !(0.71..=Self::MAX_EXTENT).contains(&extent) {
            let most = Self::MAX_EXTENT;
            return Err(Error::Argument(format!(
                "a kernel's extent must lie in 0.71 … {most} samples, found {extent}"
            )));
        }
        Ok(Self { profile, extent })
    }

    /// Checks what the constructors check, for a kernel that may have been built by hand.
    pub(crate) fn validate(&self) -> Result<()> {
        match &self.profile {
            Profile::Gaussian(sigma) => Self::gaussian(*sigma, self.extent),
            Profile::Table(values) => Self::table(values.to_vec(), self.extent),
            Profile::Tensor(tensor) if self.extent != tensor.extent() => {
                let (name, expected, extent) = (tensor.name(), tensor.extent(), self.extent);
                Err(Error::Argument(format!(
                    "the extent of the kernel {name} is {expected} samples, found {extent}"
                )))
            }
            profile => Self::with_extent(profile.clone(), self.extent),
        }
        .map(|_| ())
    }

    /// The unit of length of kernel space, in sample spacings: σ for a Gaussian, one spacing for
    /// any other kernel.
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

    /// Returns the value at distance `r`, in sample spacings. It is 0 beyond the extent, and 1 at
    /// the sample unless a table says otherwise. For a tensor product this is the function along
    /// one axis.
    pub fn value(&self, r: f64) -> f64 {
        if r > self.extent {
            return 0.0;
        }
        match &self.profile {
            Profile::Gaussian(sigma) => (-0.5 * (r / sigma).powi(2)).exp(),
            Profile::BSpline => {
                let t = 2.0 * r / self.extent;
                if t < 1.0 {
                    1.0 - 1.5 * t * t + 0.75 * t * t * t
                } else {
                    0.25 * (2.0 - t).powi(3)
                }
            }
            Profile::Hann => {
                let x = PI * r;
                // Near 0 the difference suffers cancellation; the series does not.
                let filter = if x < 0.02 {
                    1.0 - 0.1 * x * x
                } else {
                    3.0 * (x.sin() - x * x.cos()) / x.powi(3)
                };
                filter * (0.5 * PI * r / self.extent).cos().powi(2)
            }
            Profile::Table(values) => {
                let Some(last) = values.len().checked_sub(1) else { return 0.0 };
                let at = r / self.extent * last as f64;
                let low = (at as usize).min(last.saturating_sub(1));
                values[low] + (values[last.min(low + 1)] - values[low]) * (at - low as f64)
            }
            Profile::Tensor(tensor) => tensor.value(r),
        }
    }

    /// Returns whether the kernel has negative values.
    pub fn is_signed(&self) -> bool {
        match &self.profile {
            Profile::Gaussian(_) | Profile::BSpline => false,
            Profile::Hann => self.extent > 1.43, // the filter's first zero
            Profile::Table(values) => values.iter().any(|value| *value < 0.0),
            Profile::Tensor(tensor) => *tensor == Tensor::CatmullRom,
        }
    }

    /// Returns the smallest kernel sum at which a point has a value. At the edge of the drawn
    /// region, lobes of both signs nearly cancel, and their mean could have any size. Tensor
    /// products sum to 1 everywhere.
    pub fn least_sum(&self) -> f64 {
        if self.is_signed() && self.as_tensor().is_none() { 0.3 * self.integral() } else { 1e-4 }
    }

    /// Returns ∫ of the kernel over space, in cubed sample spacings. That is the average sum of its
    /// copies at every sample of a Cartesian lattice. A Gaussian is truncated by its footprint's
    /// cylinder only.
    pub fn integral(&self) -> f64 {
        if let Profile::Gaussian(sigma) = self.profile {
            return (2.0 * PI).powf(1.5) * sigma.powi(3) * -(-0.5 * self.radius().powi(2)).exp_m1();
        }
        if self.as_tensor().is_some() {
            return 1.0;
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

/// A function of the steps along one axis of a Cartesian lattice. The kernel is the product of
/// three of them. Its copies at all samples sum to 1 everywhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Tensor {
    /// 1 − |x|: trilinear interpolation, of two samples along each axis.
    Linear,
    /// The cubic of Catmull and Rom ("A class of local interpolating splines", 1974). It equals
    /// that of Keys ("Cubic convolution interpolation for digital image processing", 1981) with a =
    /// −½. It passes through the samples; its slope is continuous.
    CatmullRom,
    /// The uniform cubic B-spline, whose curvature is continuous. It smooths the samples, unless
    /// the volume is made sharp for it ([`Volume::sharpened`](crate::volume::Volume::sharpened)).
    CubicBSpline,
}

impl Tensor {
    /// Every tensor-product kernel.
    pub const ALL: [Self; 3] = [Self::Linear, Self::CatmullRom, Self::CubicBSpline];

    /// Returns the name, as the command spells it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::CatmullRom => "catmull-rom",
            Self::CubicBSpline => "cubic-b-spline",
        }
    }

    /// Returns where the function ends, in steps.
    pub fn extent(self) -> f64 {
        if self == Self::Linear { 1.0 } else { 2.0 }
    }

    /// Returns whether the field passes through the samples.
    pub fn interpolates(self) -> bool {
        self != Self::CubicBSpline
    }

    /// Returns the largest sum of the weights' magnitudes at any position in space. It bounds how
    /// far the field may exceed the samples.
    pub fn lebesgue(self) -> f64 {
        // Halfway between samples the cubic of Catmull and Rom has the weights −1/16, 9/16, 9/16
        // and −1/16.
        if self == Self::CatmullRom { 1.25f64.powi(3) } else { 1.0 }
    }

    /// Returns the function at x steps from the sample.
    pub fn value(self, x: f64) -> f64 {
        let x = x.abs();
        match self {
            Self::Linear => (1.0 - x).max(0.0),
            Self::CatmullRom if x < 1.0 => (1.5 * x - 2.5) * x * x + 1.0,
            Self::CatmullRom if x < 2.0 => ((2.5 - 0.5 * x) * x - 4.0) * x + 2.0,
            Self::CubicBSpline if x < 1.0 => (0.5 * x - 1.0) * x * x + 2.0 / 3.0,
            Self::CubicBSpline if x < 2.0 => (2.0 - x).powi(3) / 6.0,
            Self::CatmullRom | Self::CubicBSpline => 0.0,
        }
    }

    /// Returns the slope of the function at x steps from the sample: its derivative. That of the
    /// linear kernel jumps at every sample. Its slope is half the difference of the values a step
    /// before and a step behind, which is continuous and reaches a step farther.
    pub fn slope(self, x: f64) -> f64 {
        let (r, sign) = (x.abs(), 1f64.copysign(x));
        match self {
            Self::Linear => 0.5 * (self.value(x + 1.0) - self.value(x - 1.0)),
            Self::CatmullRom if r < 1.0 => sign * (4.5 * r - 5.0) * r,
            Self::CatmullRom if r < 2.0 => sign * ((5.0 - 1.5 * r) * r - 4.0),
            Self::CubicBSpline if r < 1.0 => sign * (1.5 * r - 2.0) * r,
            Self::CubicBSpline if r < 2.0 => sign * -0.5 * (2.0 - r).powi(2),
            Self::CatmullRom | Self::CubicBSpline => 0.0,
        }
    }

    /// Returns the weights of four consecutive samples as polynomials in t. The position is t (0 to
    /// 1) steps after the second sample. For each sample these are the factors of 1, t, t² and t³.
    pub fn polynomials(self) -> [[f64; 4]; 4] {
        match self {
            Self::Linear => [[0.0; 4], [1.0, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0; 4]],
            Self::CatmullRom => [
                [0.0, -0.5, 1.0, -0.5],
                [1.0, 0.0, -2.5, 1.5],
                [0.0, 0.5, 2.0, -1.5],
                [0.0, 0.0, -0.5, 0.5],
            ],
            Self::CubicBSpline => [
                [1.0, -3.0, 3.0, -1.0],
                [4.0, 0.0, -6.0, 3.0],
                [1.0, 3.0, 3.0, -3.0],
                [0.0, 0.0, 0.0, 1.0],
            ]
            .map(|row| row.map(|factor| factor / 6.0)),
        }
    }

    /// Returns the slopes of the same weights ([`slope`](Self::slope)): for each sample, the
    /// factors of 1, t and t².
    pub fn slope_polynomials(self) -> [[f64; 3]; 4] {
        if self == Self::Linear {
            return [[-0.5, 0.5, 0.0], [0.0, -0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.5, 0.0]];
        }
        self.polynomials().map(|[_, b, c, d]| [b, 2.0 * c, 3.0 * d])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_along_an_axis_add_up_to_one_and_slopes_are_theirs() {
        for tensor in Tensor::ALL {
            for step in 0..=64 {
                let t = f64::from(step) / 64.0;
                let weights =
                    tensor.polynomials().map(|[a, b, c, d]| ((d * t + c) * t + b) * t + a);
                let by_value = [t + 1.0, t, t - 1.0, t - 2.0].map(|x| tensor.value(x));
                assert!(
                    (weights.iter().sum::<f64>() - 1.0).abs() < 1e-15,
                    "{tensor:?} at {t}: {weights:?}"
                );
                for (weight, value) in weights.iter().zip(by_value) {
                    assert!((weight - value).abs() < 1e-15, "{tensor:?} at {t}: {weight} {value}");
                }
                let slopes = tensor.slope_polynomials().map(|[a, b, c]| (c * t + b) * t + a);
                let by_place = [t + 1.0, t, t - 1.0, t - 2.0].map(|x| tensor.slope(x));
                for (slope, expected) in slopes.iter().zip(by_place) {
                    assert!((slope - expected).abs() < 1e-15, "{tensor:?} at {t}: {slopes:?}");
                }
                assert!(
                    weights.iter().map(|weight| weight.abs()).sum::<f64>().powi(3)
                        <= tensor.lebesgue() + 1e-12
                );
            }
            for x in [-2.3, -1.7, -1.2, -0.6, -0.1, 0.2, 0.5, 0.9, 1.1, 1.8, 2.1] {
                let step = if tensor == Tensor::Linear { 1.0 } else { 1e-6 };
                let expected = (tensor.value(x + step) - tensor.value(x - step)) / (2.0 * step);
                assert!((tensor.slope(x) - expected).abs() < 1e-8, "{tensor:?} at {x}: {expected}");
            }
            // If the field passes through the samples, the function is 1 at its own sample and 0 at
            // the others.
            let at_samples = [0.0, 1.0, 2.0].map(|x| tensor.value(x));
            assert_eq!(at_samples == [1.0, 0.0, 0.0], tensor.interpolates());
            let kernel = Kernel::tensor(tensor);
            kernel.validate().unwrap();
            assert!(kernel.integral() == 1.0 && kernel.least_sum() < 1e-3);
            assert!(
                Kernel { extent: 1.5, ..kernel }
                    .validate()
                    .unwrap_err()
                    .to_string()
                    .contains(tensor.name())
            );
        }
        // By hand: ⅔ and ⅙; 9/16 and −1/16.
        assert_eq!([0.0, 1.0].map(|x| Tensor::CubicBSpline.value(x)), [2.0 / 3.0, 1.0 / 6.0]);
        assert_eq!([0.5, 1.5].map(|x| Tensor::CatmullRom.value(x)), [0.5625, -0.0625]);
    }

    #[test]
    fn values_by_hand() {
        let gaussian = Kernel::gaussian(0.5, 2.0).unwrap();
        assert!((gaussian.value(0.5) - (-0.5f64).exp()).abs() < 1e-15 && gaussian.radius() == 4.0);
        let spline = Kernel::b_spline(2.0).unwrap();
        // ⅔, ⅙ and 0 over ⅔.
        assert_eq!([0.0, 1.0, 2.0].map(|r| spline.value(r)), [1.0, 0.25, 0.0]);
        let hann = Kernel::hann(3.0).unwrap();
        // 3/π² · cos²(π/6); beyond the first zero, at 1.43, it is negative.
        assert!(
            (hann.value(1.0) - 2.25 / (PI * PI)).abs() < 1e-12
                && hann.value(1.4) > 0.0
                && hann.value(1.5) < 0.0
        );
        assert!((hann.value(0.02 / PI) - hann.value(0.019_999 / PI)).abs() < 1e-6);
        // 6/π without the window.
        assert!((hann.integral() - 6.0 / PI).abs() < 0.02);
        let table = Kernel::table(vec![1.0, 0.5, 0.0], 4.0).unwrap();
        assert_eq!(
            [0.0, 1.0, 2.0, 3.0, 4.0, 4.1].map(|r| table.value(r)),
            [1.0, 0.75, 0.5, 0.25, 0.0, 0.0]
        );
        // A cone of height 1 and radius 4: its integral over a ball is π·4³/3.
        assert!((table.integral() / (PI * 64.0 / 3.0) - 1.0).abs() < 1e-6);
        // 4π (⅓ − 3/10 + ⅛ + 11/120)
        assert!((spline.integral() / PI - 1.0).abs() < 1e-9);
    }

    #[test]
    fn impossible_kernels_are_refused() {
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

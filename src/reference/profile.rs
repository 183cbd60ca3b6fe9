//! The profile h(r) of a kernel over the radius in kernel space, and its integrals along lines.

use super::quadrature::quadrature;
use crate::math;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Beyond this many standard deviations, less than 10⁻¹⁸ of a Gaussian is left: too little to
/// change a sum in double precision.
const TAIL: f64 = 9.0;

#[derive(Debug, Clone, Copy)]
pub(super) enum Profile<'a> {
    /// exp(−r²/2). Lines that pass beyond the radius miss it; along a line it is not cut.
    Gaussian,
    /// Any other profile; 0 beyond its extent, in all directions.
    Compact(&'a math::Kernel),
}

impl<'a> Profile<'a> {
    pub fn of(kernel: &'a math::Kernel) -> Self {
        match kernel.profile {
            math::Profile::Gaussian(_) => Self::Gaussian,
            _ => Self::Compact(kernel),
        }
    }

    /// h(r).
    pub fn value(self, r: f64) -> f64 {
        match self {
            Self::Gaussian => (-0.5 * r * r).exp(),
            Self::Compact(kernel) => kernel.value(r),
        }
    }

    /// Returns h′(r)/r. Times the place in kernel space, this is the gradient there. It is 0 at the
    /// centre of a kernel with a peak.
    pub fn slope(self, r: f64) -> f64 {
        let Self::Compact(kernel) = self else { return -self.value(r) };
        let extent = kernel.extent;
        if r > extent {
            return 0.0;
        }
        match &kernel.profile {
            math::Profile::Gaussian(_) => -self.value(r),
            math::Profile::BSpline => {
                // From 1 − 1.5t² + 0.75t³ and 0.25(2 − t)³ with t = 2r/extent.
                let t = 2.0 * r / extent;
                let over_t = if t < 1.0 { -3.0 + 2.25 * t } else { -0.75 * (2.0 - t).powi(2) / t };
                over_t * (2.0 / extent).powi(2)
            }
            math::Profile::Hann => {
                let w = 0.5 * PI / extent;
                let x = PI * r;
                if x < 1e-2 {
                    // The first terms of the series of both factors.
                    return -PI * PI / 5.0 - 2.0 * w * w;
                }
                let (sin, cos) = x.sin_cos();
                let filter = 3.0 * (sin - x * cos) / x.powi(3);
                let window = (w * r).cos().powi(2);
                (PI * (3.0 * sin / x.powi(2) - 3.0 * filter / x) * window
                    - filter * w * (2.0 * w * r).sin())
                    / r
            }
            math::Profile::Table(values) => {
                let scale = (values.len() - 1) as f64 / extent;
                let low = ((r * scale) as usize).min(values.len() - 2);
                if r > 0.0 { (values[low + 1] - values[low]) * scale / r } else { 0.0 }
            }
            // Not a radial function (product.rs).
            math::Profile::Tensor(_) => 0.0,
        }
    }

    /// Returns how far a line that passes at `rho` stays inside the kernel, to either side of its
    /// closest approach.
    pub fn reach(self, rho: f64) -> f64 {
        match self {
            Self::Gaussian => TAIL,
            Self::Compact(kernel) => (kernel.extent.powi(2) - rho * rho).max(0.0).sqrt(),
        }
    }

    /// Returns ∫ h dt and ∫ t·h dt over a part of a line that passes at `rho`, with t = 0 at its
    /// closest approach.
    pub fn moments(self, rho: f64, [from, to]: [f64; 2]) -> [f64; 2] {
        let Self::Compact(kernel) = self else {
            let peak = (-0.5 * rho * rho).exp();
            let bell = |t: f64| (-0.5 * t * t).exp();
            return [peak * (2.0 * PI).sqrt() * share(from, to), peak * (bell(from) - bell(to))];
        };
        let reach = self.reach(rho);
        let (from, to) = (from.max(-reach), to.min(reach));
        if from >= to {
            return [0.0; 2];
        }
        // Cut into smooth pieces of at most one unit.
        let mut cuts = vec![from, to];
        let kinks = kinks(kernel)
            .into_iter()
            .filter(|kink| *kink > rho)
            .map(|kink| (kink * kink - rho * rho).sqrt());
        let inner = kinks.flat_map(|t| [-t, t]).chain([0.0]).filter(|t| from < *t && *t < to);
        cuts.extend(inner);
        if let math::Profile::Table(_) = kernel.profile {
            // Tables may have a peak. Near it, r bends within a distance of ρ.
            let around = std::iter::successors(Some(rho.max(1e-3)), |t| Some(4.0 * t))
                .take_while(|t| *t < reach);
            cuts.extend(around.flat_map(|t| [-t, t]).filter(|t| from < *t && *t < to));
        }
        cuts.extend((from.floor() as i64 + 1..to.ceil() as i64).map(|t| t as f64));
        cuts.sort_by(f64::total_cmp);
        let mut sums = [0.0; 2];
        for piece in cuts.windows(2) {
            let moments = quadrature([piece[0], piece[1]], |t| {
                let h = self.value(rho.hypot(t));
                [h, t * h]
            });
            (0..2).for_each(|i| sums[i] += moments[i]);
        }
        sums
    }
}

/// Returns the radii inside a kernel's extent at which the kernel is not smooth.
fn kinks(kernel: &math::Kernel) -> Vec<f64> {
    match &kernel.profile {
        math::Profile::Gaussian(_) | math::Profile::Hann | math::Profile::Tensor(_) => Vec::new(),
        math::Profile::BSpline => vec![0.5 * kernel.extent],
        math::Profile::Table(values) => {
            let parts = values.len() - 1;
            (1..parts).map(|i| kernel.extent * i as f64 / parts as f64).collect()
        }
    }
}

/// Returns the share of the unit Gaussian between `from` and `to` (in standard deviations,
/// ascending): Φ(to) − Φ(from).
fn share(from: f64, to: f64) -> f64 {
    // Two numbers close to 1 would cancel, so each share is computed from the tail in which it
    // lies.
    let tail = |t: f64| 0.5 * libm::erfc(t * FRAC_1_SQRT_2);
    if from > 0.0 { tail(from) - tail(to) } else { tail(-to) - tail(-from) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [math::Kernel; 5] {
        [
            math::Kernel::default(),
            math::Kernel::b_spline(2.0).unwrap(),
            math::Kernel::b_spline(1.7).unwrap(),
            math::Kernel::hann(3.0).unwrap(),
            math::Kernel::table(vec![1.0, 0.7, 0.1, -0.1, 0.0], 2.5).unwrap(),
        ]
    }

    #[test]
    fn shares_of_the_gaussian() {
        // The shares within one, two and three standard deviations, and above six.
        for (from, to, expected) in [
            (-1.0, 1.0, 0.682_689_492_137_085_9),
            (-2.0, 2.0, 0.954_499_736_103_641_6),
            (-3.0, 3.0, 0.997_300_203_936_739_8),
            (6.0, f64::INFINITY, 9.865_876_450_376_98e-10),
            (f64::NEG_INFINITY, 0.0, 0.5),
        ] {
            assert!((share(from, to) / expected - 1.0).abs() < 1e-12, "{from} … {to}");
        }
        assert!(share(TAIL, f64::INFINITY) < 1e-18);
    }

    #[test]
    fn parts_of_a_line_sum_to_the_whole_and_are_what_many_points_sum_to() {
        for kernel in shapes() {
            let profile = Profile::of(&kernel);
            for rho in [0.0_f64, 0.01, 0.6, 1.3] {
                for [from, to] in [[-0.7, 1.1], [0.2, 0.5], [-3.0, 9.0], [1.0, 1.1]] {
                    let steps = 200_000;
                    let mut expected = [0.0; 2];
                    for step in 0..steps {
                        let t = from + (to - from) * (f64::from(step) + 0.5) / f64::from(steps);
                        let h = profile.value(rho.hypot(t)) * (to - from) / f64::from(steps);
                        (expected[0], expected[1]) = (expected[0] + h, expected[1] + t * h);
                    }
                    let moments = profile.moments(rho, [from, to]);
                    for i in 0..2 {
                        assert!(
                            (moments[i] - expected[i]).abs() < 2e-6,
                            "{kernel:?} {rho}: {moments:?} {expected:?}"
                        );
                    }
                }
                let whole = profile.moments(rho, [-30.0, 30.0]);
                let cuts = [-30.0, -1.4, -0.3, 0.0, 0.1, 2.2, 30.0];
                let parts: f64 =
                    cuts.windows(2).map(|cut| profile.moments(rho, [cut[0], cut[1]])[0]).sum();
                assert!((whole[0] - parts).abs() < 1e-6 && whole[1].abs() < 1e-12);
            }
        }
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        for kernel in shapes() {
            let profile = Profile::of(&kernel);
            for r in [3e-5, 2e-4, 0.3, 0.8, 1.1, 1.6] {
                let step = 1e-5;
                let expected = (profile.value(r + step) - profile.value(r - step)) / (2.0 * step);
                assert!(
                    (profile.slope(r) * r - expected).abs() < 1e-6,
                    "{kernel:?} at {r}: {expected}"
                );
            }
        }
    }
}

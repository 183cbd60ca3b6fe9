//! How much light a surface lets pass: from the opacity of a file, and of [`SurfelOptions`], to the
//! strengths of surfels.
//!
//! A file's opacity is the share of the light that the surface absorbs where a ray meets it once.
//! Surfels overlap, so none of them has the optical depth of the surface. Their depths add up to
//! that of the surface if each has this depth times the area that it stands for, divided by the
//! integral of its own kernel.

use super::SurfelOptions;
use std::f32::consts::TAU;

/// The optical depth from which on a surface is opaque: less than a thousandth of the light is
/// left. Opaque surfels are as strong as [`SurfelOptions::optical_depth`] says, so that nothing
/// shows where they overlap least.
pub(super) const OPAQUE: f32 = 7.0;

/// What one surfel absorbs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Absorbed {
    /// The [`strength`](crate::splat::Splat::strength) of the splat.
    pub strength: f32,
    /// The opacity in its colour: 1 if and only if the surface is opaque.
    pub alpha: f32,
}

impl SurfelOptions {
    /// Returns what a surfel absorbs where the surface has the opacity `alpha`. The surfel stands
    /// for `share` of the integral of its kernel over its plane.
    pub(super) fn absorbed(&self, alpha: f32, share: impl FnOnce() -> f32) -> Absorbed {
        let taken = alpha.clamp(0.0, 1.0) * -(-self.optical_depth).exp_m1();
        let depth = -(-taken).ln_1p();
        if depth >= OPAQUE {
            return Absorbed { strength: self.optical_depth, alpha: 1.0 };
        }
        if depth <= 0.0 {
            return Absorbed { strength: self.optical_depth, alpha: 0.0 };
        }
        // Eight bits of a colour hold the opacity roughly. The strength makes up for the rest.
        let alpha = (taken * 255.0).round().clamp(1.0, 254.0) / 255.0;
        Absorbed { strength: depth * share() / alpha, alpha }
    }
}

/// Returns the share of the integral of a Gaussian that covers an area as large as `area`. `sigmas`
/// is the product of its two standard deviations.
pub(super) fn share_of(area: f32, sigmas: f32) -> f32 {
    area / (TAU * sigmas)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_those_of_the_surface() {
        let options = SurfelOptions::default();
        let of = |alpha: f32| options.absorbed(alpha, || 0.5);
        assert_eq!(of(1.0), Absorbed { strength: 14.0, alpha: 1.0 });
        assert_eq!(of(0.0).alpha, 0.0);
        for alpha in [0.001, 0.3, 0.5, 254.0 / 255.0] {
            let absorbed = of(alpha);
            let depth = absorbed.strength * absorbed.alpha / 0.5;
            assert!((1.0 - (-depth).exp() - alpha).abs() < 1e-4, "{alpha}: {absorbed:?}");
            assert!(absorbed.alpha > 0.0 && absorbed.alpha < 1.0);
        }
        // The opacities of the file and of the options multiply.
        let half = SurfelOptions { optical_depth: 2f32.ln(), ..options };
        let absorbed = half.absorbed(0.5, || 1.0);
        assert!((absorbed.strength * absorbed.alpha + 0.75f32.ln()).abs() < 1e-5, "{absorbed:?}");
    }
}

//! How gradients are lit.

use super::TransferFunction;
use serde::{Deserialize, Serialize};

/// Phong's coefficients: ambient + diffuse·cos + specular·cosᵖᵒʷᵉʳ, and how light fades where the
/// gradient is uncertain.
///
/// A gradient that is mostly noise, or nothing at all, has no direction that means anything. There
/// the cosine counts as 1 and the highlight vanishes: the colour is that of a field without light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Shade {
    /// Light that reaches every surface, whatever its direction.
    pub ambient: f64,
    /// Light that depends on the angle between the surface's normal and the light.
    pub diffuse: f64,
    /// The highlight's brightness.
    pub specular: f64,
    /// How small the highlight is. Larger powers make smaller highlights.
    pub power: f64,
    /// The gradient's magnitudes (value per world length) up to which directions do not count, and
    /// from which they count in full. `None` takes magnitudes that are far below those of the data
    /// as a whole: 1/50 and 1/10 of the range that the transfer function changes over, per diagonal
    /// of the data. For surfaces it has no meaning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certain: Option<[f64; 2]>,
}

impl Default for Shade {
    fn default() -> Self {
        Self { ambient: 0.2, diffuse: 0.7, specular: 0.3, power: 10.0, certain: None }
    }
}

/// Magnitudes of gradients between which light fades in, in widths of the transfer function per
/// diagonal of the data. The lower one is 30 times the rounding of 32-bit sums in a volume of a
/// thousand samples per diagonal.
const FAINT: [f64; 2] = [0.02, 0.1];

impl Shade {
    /// Behind a clip, gradients count the more the deeper a place lies, in full from this depth on,
    /// in sample spacings along the ray. So a cut face shows its values, and not their noise.
    pub(crate) const BEHIND_CLIPS: f64 = 2.0;

    /// Checks that the numbers can be drawn. The error is a message.
    pub(crate) fn check(&self) -> Result<(), String> {
        let Self { ambient, diffuse, specular, power, certain } = self;
        if ![ambient, diffuse, specular, power].iter().all(|v| v.is_finite() && **v >= 0.0) {
            return Err(format!(
                "the shade's coefficients of light must be finite and not negative, found {self:?}"
            ));
        }
        if let Some([low, high]) = certain
            && !(*low >= 0.0 && low <= high && high.is_finite())
        {
            return Err(format!(
                "the shade's certain gradients are {low} to {high}, but they must ascend from 0 or \
                 more"
            ));
        }
        Ok(())
    }

    /// Returns the gradient's magnitudes, in value per world length, between which the light of a
    /// field fades in. The field's values are in `range`, and `diagonal` is that of its samples'
    /// box.
    pub(crate) fn certain_in(
        &self,
        transfer: &TransferFunction,
        range: [f64; 2],
        diagonal: f64,
    ) -> [f64; 2] {
        if let Some(certain) = self.certain {
            return certain;
        }
        let [low, high] = range;
        let [first, last] = transfer.span().map(|value| value.clamp(low.min(high), high));
        let width = if last > first { last - first } else { high - low };
        if width > 0.0 && diagonal > 0.0 {
            FAINT.map(|part| part * (width / diagonal))
        } else {
            [0.0; 2]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faint_gradients_follow_the_units_of_values_and_lengths() {
        let transfer = |scale: f64| TransferFunction {
            color: vec![(20.0 * scale, [0.0; 3]), (60.0 * scale, [1.0; 3])],
            opacity: vec![(20.0 * scale, 0.0), (900.0 * scale, 0.5)],
            ..TransferFunction::default()
        };
        let shade = Shade::default();
        let close = |actual: [f64; 2], expected: [f64; 2]| {
            let near = |i: usize| (actual[i] / expected[i] - 1.0).abs() < 1e-12;
            assert!(near(0) && near(1), "{actual:?} {expected:?}");
        };
        // The function changes from 20 to 120 where there are values.
        close(shade.certain_in(&transfer(1.0), [0.0, 120.0], 10.0), [0.2, 1.0]);
        close(shade.certain_in(&transfer(1e12), [0.0, 120e12], 1e-5), [0.2e18, 1e18]);
        // A function of one value takes the data's range; a constant or a single sample nothing.
        let constant =
            TransferFunction { opacity: vec![(0.0, 0.5)], ..TransferFunction::default() };
        close(shade.certain_in(&constant, [0.0, 50.0], 10.0), [0.1, 0.5]);
        assert_eq!(shade.certain_in(&constant, [5.0, 5.0], 10.0), [0.0; 2]);
        assert_eq!(shade.certain_in(&constant, [0.0, 5.0], 0.0), [0.0; 2]);
        let fixed = Shade { certain: Some([3.0, 4.0]), ..shade };
        assert_eq!(fixed.certain_in(&constant, [0.0, 50.0], 10.0), [3.0, 4.0]);
    }

    #[test]
    fn certain_gradients_ascend() {
        for certain in [[-1.0, 1.0], [2.0, 1.0], [0.0, f64::INFINITY], [f64::NAN, 1.0]] {
            let shade = Shade { certain: Some(certain), ..Shade::default() };
            assert!(shade.check().unwrap_err().contains("certain"), "{certain:?}");
        }
        Shade { certain: Some([0.0, 0.0]), ..Shade::default() }.check().unwrap();
    }
}

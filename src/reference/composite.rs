//! Compositing along a ray, front to back.

use glam::DVec3;

/// The optical depth and colour that one sheet adds to a ray.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Medium {
    /// Optical depth.
    pub depth: f64,
    /// Red, green and blue, each 0 … 1.
    pub color: DVec3,
}

impl Medium {
    /// Adds another medium in the same sheet. Optical depths add; colours mix in proportion to
    /// them.
    pub fn with(self, other: Self) -> Self {
        let depth = self.depth + other.depth;
        if depth > 0.0 {
            Self { depth, color: (self.depth * self.color + other.depth * other.color) / depth }
        } else {
            Self::default()
        }
    }
}

/// A part of a sheet in which optical depth grows evenly.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Infinite at an opaque surface.
    pub depth: f64,
    /// The distances along the ray at which the part begins and ends.
    pub span: [f64; 2],
}

/// What a field adds to a sheet, and its steps of optical depth.
pub(super) type Added = (Medium, Vec<Step>);

/// The light gathered along a ray so far, front to back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Composite {
    /// Colour multiplied by opacity.
    pub color: DVec3,
    pub opacity: f64,
    /// Accumulated optical depth.
    pub depth: f64,
    /// Distance along the ray at which half of the light is absorbed; infinite until then.
    pub half: f64,
}

impl Composite {
    pub const EMPTY: Self =
        Self { color: DVec3::ZERO, opacity: 0.0, depth: 0.0, half: f64::INFINITY };

    /// Adds a medium whose optical depth grows evenly between two distances.
    pub fn pass(&mut self, medium: Medium, span: [f64; 2]) {
        self.pass_in_steps(medium, &[Step { depth: medium.depth, span }]);
    }

    /// Adds an opaque surface at a distance, which fills a share of the pixel: it absorbs that
    /// share of the light, or as much as is left.
    pub fn cover(&mut self, [share, opacity]: [f64; 2], distance: f64, color: DVec3) {
        let before = self.opacity;
        let left = 1.0 - before;
        let share = (share * (left + before * opacity.powi(4))).min(left) * opacity;
        self.color += share * color;
        self.opacity += share;
        if before < 0.5 && self.opacity >= 0.5 {
            self.half = distance;
        }
        self.depth = self.depth.max(-(-self.opacity).ln_1p());
    }

    /// Adds a medium whose optical depth grows by these steps.
    pub fn pass_in_steps(&mut self, medium: Medium, steps: &[Step]) {
        let alpha = -(-medium.depth).exp_m1();
        let light = 1.0 - self.opacity;
        self.color += light * alpha * medium.color;
        self.opacity += light * alpha;
        let half = std::f64::consts::LN_2;
        let mut before = self.depth;
        for Step { depth, span: [from, to] } in steps {
            let after = before + depth;
            if before < half && after >= half {
                self.half = from + (half - before) / depth * (to - from);
            }
            before = after;
        }
        self.depth += medium.depth;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_of_one_medium_are_one_thick_sheet() {
        let color = DVec3::new(0.2, 0.4, 0.8);
        let mut composite = Composite::EMPTY;
        for k in 0..100 {
            let k = f64::from(k);
            composite.pass(Medium { depth: 0.02, color }, [10.0 + 0.1 * k, 10.1 + 0.1 * k]);
        }
        let opacity = 1.0 - (-2.0_f64).exp();
        assert!((composite.opacity - opacity).abs() < 1e-12);
        assert!((composite.color - opacity * color).length() < 1e-12);
        // Optical depth 0.2 per unit of length reaches ln 2 after 5 ln 2.
        assert!((composite.half - (10.0 + 5.0 * std::f64::consts::LN_2)).abs() < 1e-9);
    }

    #[test]
    fn thin_media_never_take_half_of_the_light() {
        let mut composite = Composite::EMPTY;
        composite.pass(Medium { depth: 0.69, color: DVec3::ONE }, [1.0, 2.0]);
        assert_eq!(composite.half, f64::INFINITY);
        composite.pass(Medium::default(), [2.0, 3.0]);
        composite.pass(Medium { depth: 9.0, color: DVec3::ONE }, [3.0, 4.0]);
        assert!(composite.half > 3.0 && composite.half < 3.001);
    }

    #[test]
    fn media_mix_by_their_optical_depths() {
        let red = Medium { depth: 1.0, color: DVec3::X };
        let blue = Medium { depth: 3.0, color: DVec3::Z };
        let both = red.with(blue);
        assert_eq!((both.depth, both.color), (4.0, DVec3::new(0.25, 0.0, 0.75)));
        assert_eq!(Medium::default().with(Medium::default()).color, DVec3::ZERO);
    }
}

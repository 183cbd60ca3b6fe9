//! Diverging colour maps: from one hue over a light grey to another (Moreland 2009, “Diverging
//! color maps for scientific visualization”).

use super::{
    Points,
    lab::{of_lab, to_lab},
};
use std::f64::consts::FRAC_PI_3;

/// The number of points of a map, odd so that one is the middle.
const POINTS: usize = 65;

/// A colour in the polar form of CIELAB: magnitude, saturation (the angle from grey) and hue.
#[derive(Debug, Clone, Copy)]
struct Msh {
    magnitude: f64,
    saturation: f64,
    hue: f64,
}

/// Returns the map from one display colour to another. Both must be saturated and of different
/// hues.
pub fn points(ends: [[f64; 3]; 2]) -> Points {
    let [first, last] = ends.map(Msh::of);
    let middle = first.magnitude.max(last.magnitude).max(88.0);
    let gray = |hue| Msh { magnitude: middle, saturation: 0.0, hue };
    let (left, right) = (gray(first.spun(middle)), gray(last.spun(middle)));
    let color = |i: usize| {
        let share = i as f64 / (POINTS - 1) as f64;
        let color = match share < 0.5 {
            true => first.mixed(left, 2.0 * share),
            false => right.mixed(last, 2.0 * share - 1.0),
        };
        (share, color.rgb())
    };
    let mut points: Points = (0..POINTS).map(color).collect();
    // Exact, without the rounding of two conversions.
    (points[0].1, points[POINTS - 1].1) = (ends[0], ends[1]);
    points
}

impl Msh {
    fn of(rgb: [f64; 3]) -> Self {
        let [l, a, b] = to_lab(rgb);
        let magnitude = (l * l + a * a + b * b).sqrt();
        Self { magnitude, saturation: (l / magnitude).acos(), hue: b.atan2(a) }
    }

    /// Returns the hue with which a grey of this magnitude leads to the colour. It is turned so
    /// that the way looks even.
    fn spun(self, magnitude: f64) -> f64 {
        if self.magnitude >= magnitude {
            return self.hue;
        }
        let spin = self.saturation * (magnitude.powi(2) - self.magnitude.powi(2)).sqrt()
            / (self.magnitude * self.saturation.sin());
        // Away from purple.
        if self.hue > -FRAC_PI_3 { self.hue + spin } else { self.hue - spin }
    }

    fn mixed(self, other: Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * t;
        Self {
            magnitude: mix(self.magnitude, other.magnitude),
            saturation: mix(self.saturation, other.saturation),
            hue: mix(self.hue, other.hue),
        }
    }

    fn rgb(self) -> [f64; 3] {
        let l = self.magnitude * self.saturation.cos();
        let a = self.magnitude * self.saturation.sin() * self.hue.cos();
        let b = self.magnitude * self.saturation.sin() * self.hue.sin();
        of_lab([l, a, b])
    }
}

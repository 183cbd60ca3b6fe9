//! Diverging colour maps: from one hue over a light grey to another (Moreland 2009, “Diverging
//! color maps for scientific visualization”).

use super::Points;
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

/// The white of sRGB, D65, in CIE XYZ.
const WHITE: [f64; 3] = [0.95047, 1.0, 1.08883];

/// Linear sRGB to CIE XYZ, and back.
const TO_XYZ: [[f64; 3]; 3] = [
    [0.4124564, 0.3575761, 0.1804375],
    [0.2126729, 0.7151522, 0.0721750],
    [0.0193339, 0.1191920, 0.9503041],
];
const TO_RGB: [[f64; 3]; 3] = [
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
];

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
        let linear =
            rgb.map(
                |part| {
                    if part > 0.04045 { ((part + 0.055) / 1.055).powf(2.4) } else { part / 12.92 }
                },
            );
        let xyz = times(TO_XYZ, linear);
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let share = xyz[axis] / WHITE[axis];
            if share > 0.008856 { share.cbrt() } else { 7.787 * share + 16.0 / 116.0 }
        });
        let (l, a, b) = (116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z));
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
        let y = (l + 16.0) / 116.0;
        let parts = [y + a / 500.0, y, y - b / 200.0];
        let xyz = [0, 1, 2].map(|axis| {
            let part: f64 = parts[axis];
            let share =
                if part.powi(3) > 0.008856 { part.powi(3) } else { (part - 16.0 / 116.0) / 7.787 };
            share * WHITE[axis]
        });
        times(TO_RGB, xyz).map(|part| {
            let display =
                if part > 0.0031308 { 1.055 * part.powf(1.0 / 2.4) - 0.055 } else { 12.92 * part };
            display.clamp(0.0, 1.0)
        })
    }
}

fn times(matrix: [[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

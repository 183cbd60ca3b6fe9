//! Two Gaussians as one, and how much that changes pictures.
//!
//! Seen along an axis, a Gaussian is a flat one: its opacity at the centre falls off by the
//! covariance without that axis. Two of them cover a₁G₁ + a₂G₂ − a₁a₂G₁G₂ of a pixel. The last part
//! is what the front one hides; it has the mean colour of both. The error is the integral of the
//! squared difference to the merged one, over three pictures along the axes. Products of Gaussians
//! have closed integrals (Williams and Maybeck 2003).

use glam::{DMat2, DMat3, DVec2, DVec3};
use std::f64::consts::TAU;

/// A Gaussian without its colour.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    pub center: DVec3,
    pub covariance: DMat3,
    pub opacity: f64,
}

/// Inner products of the colours of two Gaussians.
#[derive(Debug, Clone, Copy)]
pub struct Products {
    pub aa: f64,
    pub ab: f64,
    pub bb: f64,
}

/// Two Gaussians as one.
#[derive(Debug, Clone, Copy)]
pub struct Merged {
    pub shape: Shape,
    /// The part of the first one in the colour.
    pub part: f64,
    /// The squared difference of pictures.
    pub error: f64,
}

/// A Gaussian on a plane, 1 at its centre.
#[derive(Debug, Clone, Copy)]
struct Flat {
    center: DVec2,
    covariance: DMat2,
    /// The root of the covariance's determinant.
    area: f64,
}

impl Flat {
    fn new(center: DVec2, covariance: DMat2) -> Self {
        Self { center, covariance, area: covariance.determinant().max(0.0).sqrt() }
    }

    /// Returns a Gaussian as it is seen along an axis.
    fn along(shape: &Shape, axis: usize) -> Self {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let m = shape.covariance;
        let covariance =
            DMat2::from_cols_array(&[m.col(u)[u], m.col(u)[v], m.col(u)[v], m.col(v)[v]]);
        Self::new(DVec2::new(shape.center[u], shape.center[v]), covariance)
    }

    /// Returns the inverse of the sum of both covariances, and its determinant.
    fn inverse_of_sum(&self, other: &Self) -> (DMat2, f64) {
        let sum = self.covariance + other.covariance;
        let trace = sum.x_axis.x + sum.y_axis.y;
        // Never singular: what is seen from its edge has some thickness.
        let least = f64::MIN_POSITIVE.sqrt().max(1e-9 * trace);
        let sum = sum + DMat2::from_diagonal(DVec2::splat(least));
        (sum.inverse(), sum.determinant().recip())
    }

    /// Returns the integral of the product with another one.
    fn times(&self, other: &Self) -> f64 {
        let (inverse, determinant) = self.inverse_of_sum(other);
        let away = other.center - self.center;
        let height = (-0.5 * away.dot(inverse * away)).exp();
        TAU * self.area * other.area * determinant.sqrt() * height
    }

    /// Returns the product with another one, and its height.
    fn product(&self, other: &Self) -> (Self, f64) {
        let (inverse, _) = self.inverse_of_sum(other);
        let away = other.center - self.center;
        let height = (-0.5 * away.dot(inverse * away)).exp();
        let gain = self.covariance * inverse;
        let covariance = gain * other.covariance;
        (Self::new(self.center + gain * away, covariance), height)
    }
}

impl Shape {
    /// Returns its area in three pictures.
    pub fn area(&self) -> f64 {
        TAU * (0..3).map(|axis| Flat::along(self, axis).area).sum::<f64>()
    }
}

/// Returns two Gaussians as one of their mean and covariance, weighted by what they cover. It
/// covers as much as both, even if one hides a part of the other: many overlap, and fewer must not
/// let more light through.
pub fn merge(a: &Shape, b: &Shape, colors: &Products) -> Merged {
    let (of_a, of_b) = (a.opacity * a.area(), b.opacity * b.area());
    let all = of_a + of_b;
    let part = if all > 0.0 { of_a / all } else { 0.5 };
    let center = a.center.lerp(b.center, 1.0 - part);
    let spread = |shape: &Shape| {
        let away = shape.center - center;
        shape.covariance + DMat3::from_cols(away * away.x, away * away.y, away * away.z)
    };
    let covariance = spread(a) * part + spread(b) * (1.0 - part);
    let mut shape = Shape { center, covariance, opacity: 1.0 };
    shape.opacity = (all / shape.area().max(f64::MIN_POSITIVE)).min(1.0);
    let views = [0, 1, 2].map(|axis| View::new(a, b, &shape, axis));
    let error = views.iter().map(|view| view.error([a, b, &shape], part, colors)).sum();
    Merged { shape, part, error }
}

/// Two Gaussians, where both are, and what they become, along an axis.
struct View {
    a: Flat,
    b: Flat,
    both: Flat,
    /// The height of `both`.
    height: f64,
    merged: Flat,
}

impl View {
    fn new(a: &Shape, b: &Shape, merged: &Shape, axis: usize) -> Self {
        let [a, b, merged] = [a, b, merged].map(|shape| Flat::along(shape, axis));
        let (both, height) = a.product(&b);
        Self { a, b, both, height, merged }
    }

    /// Returns the squared difference.
    fn error(&self, [a, b, merged]: [&Shape; 3], part: f64, colors: &Products) -> f64 {
        let hidden = -0.5 * a.opacity * b.opacity * self.height;
        let of_merged = [-merged.opacity * part, -merged.opacity * (1.0 - part)];
        // Each with its amounts of both colours.
        let terms = [
            (&self.a, [a.opacity, 0.0]),
            (&self.b, [0.0, b.opacity]),
            (&self.both, [hidden, hidden]),
            (&self.merged, of_merged),
        ];
        let mut sum = 0.0;
        for (index, (one, [a, b])) in terms.iter().enumerate() {
            for (count, (other, [c, d])) in terms[index..].iter().enumerate() {
                let color = a * c * colors.aa + (a * d + b * c) * colors.ab + b * d * colors.bb;
                let twice = if count > 0 { 2.0 } else { 1.0 };
                sum += twice * color * one.times(other);
            }
        }
        sum.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, EulerRot};

    fn shape(center: [f64; 3], scales: [f64; 3], turn: f64, opacity: f64) -> Shape {
        let turn = DQuat::from_euler(EulerRot::XYZ, turn, 2.0 * turn, -turn);
        let axes = DMat3::from_quat(turn) * DMat3::from_diagonal(scales.into());
        Shape { center: center.into(), covariance: axes * axes.transpose(), opacity }
    }

    /// The squared difference by pictures of many pixels.
    fn drawn(a: &Shape, b: &Shape, [of_a, of_b]: [f64; 2]) -> f64 {
        let colors = Products { aa: of_a * of_a, ab: of_a * of_b, bb: of_b * of_b };
        let merged = merge(a, b, &colors);
        let mixed = of_a * merged.part + of_b * (1.0 - merged.part);
        let mut sum = 0.0;
        let step = 0.05;
        for axis in 0..3 {
            let [a, b, merged] = [a, b, &merged.shape].map(|s| (Flat::along(s, axis), s.opacity));
            for pixel in 0..400 * 400 {
                let at = DVec2::new(f64::from(pixel % 400), f64::from(pixel / 400));
                let at = (at - 199.5) * step;
                let cover = |(flat, opacity): &(Flat, f64)| {
                    let away = at - flat.center;
                    opacity * (-0.5 * away.dot(flat.covariance.inverse() * away)).exp()
                };
                let [a, b, merged] = [&a, &b, &merged].map(cover);
                let before = a * of_a + b * of_b - a * b * 0.5 * (of_a + of_b);
                sum += (before - merged * mixed).powi(2) * step * step;
            }
        }
        sum
    }

    #[test]
    fn errors_are_those_of_pictures() {
        let cases = [
            (
                shape([0.0; 3], [1.0, 0.5, 0.3], 0.4, 0.9),
                shape([1.0, 0.4, 0.2], [0.8; 3], 0.0, 0.5),
            ),
            (shape([0.0; 3], [1.0; 3], 0.0, 1.0), shape([0.0; 3], [1.0; 3], 0.0, 1.0)),
            (
                shape([-3.0, 0.0, 0.0], [0.5; 3], 0.0, 0.2),
                shape([3.0, 1.0, 0.0], [1.0, 0.4, 0.4], 1.0, 1.0),
            ),
        ];
        for (a, b) in cases {
            for [of_a, of_b] in [[1.0, 1.0], [0.2, 1.0], [1.0, -0.5]] {
                let colors = Products { aa: of_a * of_a, ab: of_a * of_b, bb: of_b * of_b };
                let error = merge(&a, &b, &colors).error;
                let drawn = drawn(&a, &b, [of_a, of_b]);
                assert!((error - drawn).abs() < 1e-3 * drawn + 1e-6, "{error} {drawn}");
            }
        }
    }

    #[test]
    fn two_halves_are_the_whole() {
        // One Gaussian of half the opacity twice, at one place.
        let half = shape([1.0, 2.0, 3.0], [1.0, 0.5, 0.1], 0.7, 0.3);
        let colors = Products { aa: 1.0, ab: 1.0, bb: 1.0 };
        let Merged { shape: whole, part, .. } = merge(&half, &half, &colors);
        assert!((whole.opacity - 0.6).abs() < 1e-9 && (part - 0.5).abs() < 1e-9);
        assert!(whole.center.distance(half.center) < 1e-9);
        assert!(whole.covariance.abs_diff_eq(half.covariance, 1e-9));
    }
}

//! The ellipses of surfels: symmetric 2×2 tensors, and covariances in space.

use glam::{DVec2, DVec3};

/// Where a triangle's corners carry Gaussians of covariance `SPREAD` · Σ e·eᵀ over its edges e, their sum is at least
/// 0.767 times the strength of one, everywhere on the triangle. An affine map takes any triangle to the equilateral one
/// of side 1, where Σ e·eᵀ is 3/2 of the identity and this makes the standard deviation 0.35; there the sum is smallest
/// at the centre of a side (0.768) and at the centroid (0.770).
pub(super) const SPREAD: f64 = 0.35 * 0.35 * 2.0 / 3.0;

/// The thickness of a surfel, in its smaller tangent standard deviation.
const THICKNESS: f64 = 0.12;

/// A symmetric tensor (xx, xy, yy) in a tangent plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tensor {
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
}

impl Tensor {
    pub fn disc(variance: f64) -> Self {
        Self { xx: variance, xy: 0.0, yy: variance }
    }

    /// The covariance that a triangle with these edges asks of its corners, never thinner than 1 : 1000.
    pub fn of_triangle(edges: [DVec2; 3]) -> Self {
        let [xx, xy, yy] =
            edges.iter().fold([0.0; 3], |[xx, xy, yy], e| [xx + e.x * e.x, xy + e.x * e.y, yy + e.y * e.y]);
        let least = (xx + yy) * 1e-6;
        Self { xx: (xx + least) * SPREAD, xy: xy * SPREAD, yy: (yy + least) * SPREAD }
    }

    /// A small tensor that is, in every direction, at least as wide as both: the wider of the two along the axes that
    /// both share after the map that makes `self` the unit circle.
    pub fn join(self, other: Self) -> Self {
        // self = L·Lᵀ; other in the frame of L.
        let l00 = self.xx.sqrt();
        let l10 = self.xy / l00;
        let l11 = (self.yy - l10 * l10).max(self.yy * 1e-12).sqrt();
        let w00 = other.xx / (l00 * l00);
        let half = (other.xy - l10 * other.xx / l00) / l00;
        let w01 = half / l11;
        let w11 = (other.yy - 2.0 * l10 * other.xy / l00 + l10 * l10 * w00) / (l11 * l11);
        let ([large, small], axis) = Tensor { xx: w00, xy: w01, yy: w11 }.axes();
        if large <= 1.0 {
            return self;
        }
        let (large, small) = (large, small.max(1.0));
        let column = |x: f64, y: f64| DVec2::new(l00 * x, l10 * x + l11 * y);
        let (u, v) = (column(axis.x, axis.y), column(-axis.y, axis.x));
        Self {
            xx: large * u.x * u.x + small * v.x * v.x,
            xy: large * u.x * u.y + small * v.x * v.y,
            yy: large * u.y * u.y + small * v.y * v.y,
        }
    }

    /// The larger and the smaller eigenvalue, and the unit axis of the larger.
    pub fn axes(self) -> ([f64; 2], DVec2) {
        let mean = (self.xx + self.yy) * 0.5;
        let half = (self.xx - self.yy) * 0.5;
        let root = half.hypot(self.xy);
        let (a, b) = (DVec2::new(half + root, self.xy), DVec2::new(self.xy, root - half));
        let axis = if half >= 0.0 { a } else { b };
        ([mean + root, mean - root], axis.try_normalize().unwrap_or(DVec2::X))
    }
}

/// The lower triangular factor B of a surfel's covariance (rows: b00, b10, b11, b20, b21, b22), from its ellipse in the
/// tangent plane of the axes `x`, `y` and its unit `normal`.
pub(super) fn factor(tensor: Tensor, x: DVec3, y: DVec3, normal: DVec3) -> [f32; 6] {
    let ([large, small], axis) = tensor.axes();
    let small = small.max(large * 1e-6);
    let (a, b) = (x * axis.x + y * axis.y, y * axis.x - x * axis.y);
    lower([a * large.sqrt(), b * small.sqrt(), normal * (THICKNESS * small.sqrt())])
}

/// The lower triangular factor of R·Rᵀ, R having these columns (Cholesky).
pub(super) fn lower(columns: [DVec3; 3]) -> [f32; 6] {
    let sum = |i: usize, j: usize| columns.iter().map(|c| c[i] * c[j]).sum::<f64>();
    let b00 = sum(0, 0).sqrt();
    let (b10, b20) = (sum(1, 0) / b00, sum(2, 0) / b00);
    let b11 = (sum(1, 1) - b10 * b10).max(sum(1, 1) * 1e-14).sqrt();
    let b21 = (sum(2, 1) - b20 * b10) / b11;
    let b22 = (sum(2, 2) - b20 * b20 - b21 * b21).max(sum(2, 2) * 1e-14).sqrt();
    [b00, b10, b11, b20, b21, b22].map(|value| value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smallest eigenvalue of wide − narrow.
    fn margin(wide: Tensor, narrow: Tensor) -> f64 {
        Tensor { xx: wide.xx - narrow.xx, xy: wide.xy - narrow.xy, yy: wide.yy - narrow.yy }.axes().0[1]
    }

    #[test]
    fn a_join_is_as_wide_as_both() {
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(random >> 8) / f64::from(1 << 24) * 2.0 - 1.0
        };
        for _ in 0..1000 {
            let mut tensor = || {
                let edges = [DVec2::new(next(), next()), DVec2::new(next(), next())];
                Tensor::of_triangle([edges[0], edges[1], edges[1] - edges[0]])
            };
            let (a, b) = (tensor(), tensor());
            let joined = a.join(b);
            let size = joined.xx + joined.yy;
            assert!(margin(joined, a) > -1e-9 * size, "{a:?} {b:?} {joined:?}");
            assert!(margin(joined, b) > -1e-9 * size, "{a:?} {b:?} {joined:?}");
            assert!(size <= (a.xx + a.yy + b.xx + b.yy) * (1.0 + 1e-9), "no wider than the sum");
        }
    }

    #[test]
    fn the_spread_covers_a_triangle() {
        let corners = [DVec2::new(0.0, 0.0), DVec2::new(1.0, 0.0), DVec2::new(0.5, 0.75f64.sqrt())];
        let least = (0..=50)
            .flat_map(|i| (0..=50 - i).map(move |j| (f64::from(i) / 50.0, f64::from(j) / 50.0)))
            .map(|(u, v)| {
                let point = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v;
                corners.iter().map(|c| (-c.distance_squared(point) / (2.0 * 0.35 * 0.35)).exp()).sum::<f64>()
            })
            .fold(f64::INFINITY, f64::min);
        assert!((0.767..0.77).contains(&least), "{least}");
    }

    #[test]
    fn a_factor_gives_back_its_covariance() {
        let (x, y, n) = (DVec3::X, DVec3::Y, DVec3::Z);
        let b = factor(Tensor { xx: 4.0, xy: 1.0, yy: 2.0 }, x, y, n).map(f64::from);
        assert!((b[0] * b[0] - 4.0).abs() < 1e-5);
        assert!((b[0] * b[1] - 1.0).abs() < 1e-5);
        assert!((b[1] * b[1] + b[2] * b[2] - 2.0).abs() < 1e-5);
        let small = 3.0 - 2f64.sqrt();
        assert!((b[3] * b[3] + b[4] * b[4] + b[5] * b[5] - 0.12 * 0.12 * small).abs() < 1e-5);
    }
}

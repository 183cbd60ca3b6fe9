//! The ellipse of a surfel: fitted to a piece of surface, then widened until it covers what it has
//! to.

use crate::math::lower;
use glam::{Vec2, Vec3};

/// The moments of triangles that share a corner, in a tangent plane with its origin there.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    area: f32,
    /// Integrals of the position and of its products.
    place: Vec2,
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Moments {
    /// Adds a triangle from the origin along two edges.
    pub fn add(&mut self, area: f32, a: Vec2, b: Vec2) {
        let c = a + b;
        self.area += area;
        self.place += area / 3.0 * c;
        let twelfth = area / 12.0;
        self.xx += twelfth * (a.x * a.x + b.x * b.x + c.x * c.x);
        self.xy += twelfth * (a.x * a.y + b.x * b.y + c.x * c.y);
        self.yy += twelfth * (a.y * a.y + b.y * b.y + c.y * c.y);
    }

    /// The area of all triangles.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// Returns the ellipse of these moments times `spread`, around the mean position or around the
    /// corner.
    pub fn ellipse(&self, around_mean: bool, spread: f32) -> Ellipse {
        let share = spread / self.area;
        let center = if around_mean { self.place / self.area } else { Vec2::ZERO };
        let (xx, yy) = (
            self.xx * share - spread * center.x * center.x,
            self.yy * share - spread * center.y * center.y,
        );
        // Never thinner than 1 : 300, even if rounding flattened a needle further.
        let least = (xx + yy).max(0.0) * 1e-5 + f32::MIN_POSITIVE;
        let xy = self.xy * share - spread * center.x * center.y;
        Ellipse { center, xx: xx + least, xy, yy: yy + least }
    }
}

/// A Gaussian in a tangent plane: its mean and covariance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ellipse {
    pub center: Vec2,
    xx: f32,
    xy: f32,
    yy: f32,
}

impl Ellipse {
    fn determinant(&self) -> f32 {
        // For a needle, rounding can cancel the determinant completely.
        (self.xx * self.yy - self.xy * self.xy).max(self.xx * self.yy * 1e-6)
    }

    /// Widens the ellipse towards a point, by just enough that its squared distance, in standard
    /// deviations, is at most `most`.
    pub fn reach(&mut self, point: Vec2, most: f32) {
        let d = point - self.center;
        let square = self.yy * d.x * d.x - 2.0 * self.xy * d.x * d.y + self.xx * d.y * d.y;
        let determinant = self.determinant();
        if square > most * determinant {
            // Adding m·d·dᵀ to the covariance changes the squared distance q to q / (1 + m·q)
            // (Sherman & Morrison 1950).
            let more = 1.0 / most - determinant / square;
            self.xx += more * d.x * d.x;
            self.xy += more * d.x * d.y;
            self.yy += more * d.y * d.y;
        }
    }

    /// The product of the two standard deviations.
    pub fn sigmas(&self) -> f32 {
        self.determinant().sqrt()
    }

    /// The smaller standard deviation.
    pub fn narrowest(&self) -> f32 {
        let determinant = self.determinant();
        let mean = 0.5 * (self.xx + self.yy);
        (determinant / (mean + (mean * mean - determinant).max(0.0).sqrt())).sqrt()
    }

    /// Returns the lower triangular factor B of a surfel's covariance B·Bᵀ (rows: b00, b10, b11,
    /// b20, b21, b22). The ellipse lies in the plane of `x` and `y`, scaled by `scale`, and is
    /// `thickness` thick along `normal`.
    pub fn factor(&self, [x, y, normal]: [Vec3; 3], scale: f32, thickness: f32) -> [f32; 6] {
        let determinant = self.determinant();
        // Columns of some factor R.
        let l00 = self.xx.sqrt() * scale;
        let l10 = self.xy / self.xx * l00;
        let l11 = (determinant / self.xx).sqrt() * scale;
        let (u, v, w) = (x * l00 + y * l10, y * l11, normal * thickness);
        // R = B·Q with Q a rotation: orthogonalise the rows of R one after the other.
        let row = |i: usize| Vec3::new(u[i], v[i], w[i]);
        let (r0, r1, r2) = (row(0), row(1), row(2));
        let b00 = r0.length();
        let q0 = r0 / b00;
        let b10 = r1.dot(q0);
        let rest = r1 - b10 * q0;
        let b11 = rest.length();
        let q1 = rest / b11;
        // The volume gives the last entry more precisely than the remainder of a row.
        let factor = [b00, b10, b11, r2.dot(q0), r2.dot(q1), l00 * l11 * thickness / (b00 * b11)];
        if factor.iter().all(|v| v.is_finite()) {
            return factor;
        }
        // A needle may vanish in 32 bits, and the volume of a huge surfel overflows them.
        lower([u, v, w].map(Vec3::as_dvec3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles: a square with its corner at the origin.
    fn square() -> Moments {
        let mut moments = Moments::default();
        moments.add(0.5, Vec2::X, Vec2::ONE);
        moments.add(0.5, Vec2::ONE, Vec2::Y);
        moments
    }

    #[test]
    fn moments_of_a_square() {
        let mean = square().ellipse(true, 1.0);
        assert!((mean.center - 0.5).length() < 1e-6);
        let twelfth = 1.0 / 12.0;
        assert!(
            (mean.xx - twelfth).abs() < 1e-5
                && (mean.yy - twelfth).abs() < 1e-5
                && mean.xy.abs() < 1e-6
        );
        let corner = square().ellipse(false, 0.5);
        assert_eq!(corner.center, Vec2::ZERO);
        assert!((corner.xx - 1.0 / 6.0).abs() < 1e-5 && (corner.xy - 0.125).abs() < 1e-6);
    }

    #[test]
    fn an_ellipse_reaches_just_so_far() {
        let mut ellipse = square().ellipse(true, 1.0);
        let before = ellipse;
        ellipse.reach(Vec2::new(0.6, 0.4), 1.0);
        assert_eq!(ellipse.xx, before.xx);
        let point = Vec2::new(2.0, -1.0);
        ellipse.reach(point, 4.0);
        let d = point - ellipse.center;
        let square = ellipse.yy * d.x * d.x - 2.0 * ellipse.xy * d.x * d.y + ellipse.xx * d.y * d.y;
        assert!((square / ellipse.determinant() - 4.0).abs() < 1e-4);
        // Across that direction its width is unchanged.
        let across = d.perp().normalize();
        let wide = |e: &Ellipse| {
            e.xx * across.x * across.x
                + 2.0 * e.xy * across.x * across.y
                + e.yy * across.y * across.y
        };
        assert!((wide(&ellipse) - wide(&before)).abs() < 1e-5);
    }

    #[test]
    fn a_factor_gives_back_its_covariance() {
        let normal = Vec3::new(0.6, 0.0, 0.8);
        let (x, y) = normal.any_orthonormal_pair();
        let ellipse = Ellipse { center: Vec2::ZERO, xx: 4.0, xy: 1.0, yy: 2.0 };
        assert!((ellipse.narrowest().powi(2) - (3.0 - 2f32.sqrt())).abs() < 1e-5);
        let b = ellipse.factor([x, y, normal], 3.0, 0.5);
        let rows =
            [Vec3::new(b[0], 0.0, 0.0), Vec3::new(b[1], b[2], 0.0), Vec3::new(b[3], b[4], b[5])];
        for i in 0..3 {
            for j in 0..3 {
                let flat = 4.0 * x[i] * x[j] + x[i] * y[j] + y[i] * x[j] + 2.0 * y[i] * y[j];
                let expected = 9.0 * flat + 0.25 * normal[i] * normal[j];
                assert!((rows[i].dot(rows[j]) - expected).abs() < 1e-4, "{i} {j}");
            }
        }
    }
}

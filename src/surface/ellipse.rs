//! The ellipses of a point cloud's surfels: symmetric 2×2 tensors, and covariances in space.

use crate::math::lower;
use glam::{DVec2, DVec3};

/// The thickness of a surfel, as a multiple of its smaller tangent standard deviation.
const THICKNESS: f64 = 0.12;

/// A symmetric tensor (xx, xy, yy) in a tangent plane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tensor {
    pub xx: f64,
    pub xy: f64,
    pub yy: f64,
}

impl Tensor {
    /// Returns the larger and the smaller eigenvalue, and the unit axis of the larger.
    pub fn axes(self) -> ([f64; 2], DVec2) {
        let mean = (self.xx + self.yy) * 0.5;
        let half = (self.xx - self.yy) * 0.5;
        let root = half.hypot(self.xy);
        let (a, b) = (DVec2::new(half + root, self.xy), DVec2::new(self.xy, root - half));
        let axis = if half >= 0.0 { a } else { b };
        ([mean + root, mean - root], axis.try_normalize().unwrap_or(DVec2::X))
    }
}

/// Returns the lower triangular factor B of a surfel's covariance (rows: b00, b10, b11, b20, b21,
/// b22). The ellipse lies in the tangent plane of the axes `x` and `y`, with unit normal `normal`.
pub(super) fn factor(tensor: Tensor, x: DVec3, y: DVec3, normal: DVec3) -> [f32; 6] {
    let ([large, small], axis) = tensor.axes();
    let small = small.max(large * 1e-6);
    let (a, b) = (x * axis.x + y * axis.y, y * axis.x - x * axis.y);
    lower([a * large.sqrt(), b * small.sqrt(), normal * (THICKNESS * small.sqrt())])
}

#[cfg(test)]
mod tests {
    use super::*;

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

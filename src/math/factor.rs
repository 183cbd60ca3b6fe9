//! The factor of a covariance.

use glam::DVec3;

/// Returns the lower triangular factor of R·Rᵀ, where R has these columns (Cholesky), row by row:
/// b00, b10, b11, b20, b21, b22.
pub(crate) fn lower<const N: usize>(columns: [DVec3; N]) -> [f32; 6] {
    let sum = |i: usize, j: usize| columns.iter().map(|c| c[i] * c[j]).sum::<f64>();
    let b00 = sum(0, 0).sqrt();
    let (b10, b20) = (sum(1, 0) / b00, sum(2, 0) / b00);
    let b11 = (sum(1, 1) - b10 * b10).max(sum(1, 1) * 1e-14).sqrt();
    let b21 = (sum(2, 1) - b20 * b10) / b11;
    let b22 = (sum(2, 2) - b20 * b20 - b21 * b21).max(sum(2, 2) * 1e-14).sqrt();
    [b00, b10, b11, b20, b21, b22].map(|value| value as f32)
}

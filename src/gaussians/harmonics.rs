//! Real spherical harmonics of degree 0 to 3, as trainers of Gaussian scenes use them. The order of
//! the terms is −m … m in each degree, and the signs are those of the Condon–Shortley phase (Sloan
//! 2013, Kerbl et al. 2023).

use glam::Vec3;

/// The constant term, 1 / (2·√π).
pub const CONSTANT: f32 = 0.282_094_8;

/// Most terms of one colour.
pub const MOST_TERMS: usize = 16;

/// Returns the number of terms up to a degree, (degree + 1)².
pub fn terms(degree: u32) -> usize {
    let side = degree as usize + 1;
    side * side
}

/// Returns the degree that has this number of terms; `None` if none up to 3 has.
pub fn degree_of(count: usize) -> Option<u32> {
    (0..=3).find(|&degree| terms(degree) == count)
}

/// Returns the coefficient of the constant term that gives this colour, from 0 to 1, in all
/// directions.
pub fn constant_of(color: f32) -> f32 {
    (color - 0.5) / CONSTANT
}

/// Returns the values of the terms in a direction of unit length. Those above the degree are 0.
pub fn basis(degree: u32, direction: Vec3) -> [f32; MOST_TERMS] {
    let Vec3 { x, y, z } = direction;
    let mut basis = [0.0; MOST_TERMS];
    basis[0] = CONSTANT;
    if degree >= 1 {
        const C: f32 = 0.488_602_5;
        basis[1..4].copy_from_slice(&[-C * y, C * z, -C * x]);
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= 2 {
        const C: [f32; 3] = [1.092_548_4, 0.315_391_57, 0.546_274_2];
        basis[4..9].copy_from_slice(&[
            C[0] * x * y,
            -C[0] * y * z,
            C[1] * (2.0 * zz - xx - yy),
            -C[0] * x * z,
            C[2] * (xx - yy),
        ]);
    }
    if degree >= 3 {
        const C: [f32; 5] = [0.590_043_6, 2.890_611_4, 0.457_045_8, 0.373_176_34, 1.445_305_7];
        basis[9..16].copy_from_slice(&[
            -C[0] * y * (3.0 * xx - yy),
            C[1] * x * y * z,
            -C[2] * y * (4.0 * zz - xx - yy),
            C[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
            -C[2] * x * (4.0 * zz - xx - yy),
            C[4] * z * (xx - yy),
            -C[0] * x * (xx - 3.0 * yy),
        ]);
    }
    basis
}

/// Returns the colour of a Gaussian that is seen along a direction of unit length, from the eye to
/// its centre: ½ + Σ coefficient · term, and 0 where that is negative. Colours above 1 stay.
pub fn color(degree: u32, coefficients: &[[f32; 3]], direction: Vec3) -> [f32; 3] {
    let basis = basis(degree, direction);
    let mut sum = [0.5; 3];
    for (term, coefficient) in basis.iter().zip(coefficients) {
        for (sum, part) in sum.iter_mut().zip(coefficient) {
            *sum += term * part;
        }
    }
    sum.map(|v| v.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions that are spread evenly over the sphere.
    fn directions() -> impl Iterator<Item = Vec3> {
        const COUNT: usize = 20_000;
        (0..COUNT).map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / COUNT as f64;
            let turn = i as f64 * std::f64::consts::PI * (3.0 - 5f64.sqrt());
            let r = (1.0 - z * z).sqrt();
            Vec3::new((r * turn.cos()) as f32, (r * turn.sin()) as f32, z as f32)
        })
    }

    #[test]
    fn terms_are_orthonormal() {
        let mut products = [[0f64; MOST_TERMS]; MOST_TERMS];
        let count = directions().count() as f64;
        for direction in directions() {
            let basis = basis(3, direction).map(f64::from);
            for (row, a) in products.iter_mut().zip(basis) {
                row.iter_mut().zip(basis).for_each(|(sum, b)| *sum += a * b);
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, sum) in row.iter().enumerate() {
                let product = sum * 4.0 * std::f64::consts::PI / count;
                let wanted = f64::from(u8::from(i == j));
                assert!((product - wanted).abs() < 1e-3, "terms {i} and {j}: {product}");
            }
        }
    }

    #[test]
    fn lower_degrees_are_the_first_terms() {
        let direction = Vec3::new(0.36, -0.48, 0.8);
        let all = basis(3, direction);
        for degree in 0..3 {
            let count = terms(degree);
            assert_eq!(basis(degree, direction)[..count], all[..count]);
            assert!(basis(degree, direction)[count..].iter().all(|v| *v == 0.0));
            assert_eq!(degree_of(count), Some(degree));
        }
        assert_eq!(degree_of(5), None);
    }

    #[test]
    fn constants_are_colours_and_none_is_negative() {
        let terms = [[constant_of(0.25), constant_of(1.5), constant_of(-1.0)]];
        let [r, g, b] = color(0, &terms, Vec3::Z);
        assert!((r - 0.25).abs() < 1e-6 && (g - 1.5).abs() < 1e-6 && b == 0.0);
    }
}

//! Turns the colours of Gaussians with their scene.
//!
//! The terms of one degree turn among themselves. As they are orthonormal, the matrix of a turn is
//! the integral of the products of turned and unturned terms over the sphere. A few directions with
//! weights give these integrals exactly.

use super::{Gaussians, MOST_DEGREE, harmonics::terms};
use crate::{about::Orientation, parallel::prelude::*};
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::PI;

/// Most terms.
const MOST_TERMS: usize = 16;

/// Most terms of one degree.
const WIDEST: usize = 7;

/// The number of directions.
const DIRECTIONS: usize = 32;

/// A turn of the colours. [`turn`] makes it.
#[derive(Debug, Clone)]
pub struct Turn {
    degree: u32,
    /// For each turned term after the constant one, its parts of the terms of the same degree.
    /// `None` changes nothing.
    rows: Option<[[f64; WIDEST]; MOST_TERMS - 1]>,
}

/// Returns the turn of colours up to a degree, at most [`MOST_DEGREE`]. `rotation` is orthogonal;
/// it may mirror. A colour seen along d before is seen along `rotation` · d after.
pub fn turn(degree: u32, rotation: DMat3) -> Turn {
    let degree = degree.min(MOST_DEGREE);
    if rotation == DMat3::IDENTITY {
        return Turn { degree, rows: None };
    }
    let mut rows = [[0.0; WIDEST]; MOST_TERMS - 1];
    let back = rotation.transpose();
    for (direction, weight) in directions() {
        let (after, before) = (basis(direction), basis(back * direction));
        for degree in 1..=degree {
            let range = terms(degree - 1)..terms(degree);
            for (row, after) in rows[range.start - 1..].iter_mut().zip(&after[range.clone()]) {
                for (part, before) in row.iter_mut().zip(&before[range.clone()]) {
                    *part += weight * after * before;
                }
            }
        }
    }
    Turn { degree, rows: Some(rows) }
}

impl Turn {
    /// Turns the colour of one Gaussian. Terms above the degree of the turn are unchanged; there
    /// may be fewer.
    pub fn apply(&self, coefficients: &mut [[f32; 3]]) {
        let Some(rows) = &self.rows else { return };
        for degree in 1..=self.degree {
            let range = terms(degree - 1)..terms(degree);
            let Some(part) = coefficients.get_mut(range.clone()) else { return };
            let mut old = [[0.0; 3]; WIDEST];
            for (old, term) in old.iter_mut().zip(part.iter()) {
                *old = term.map(f64::from);
            }
            for (term, row) in part.iter_mut().zip(&rows[range.start - 1..]) {
                *term = [0, 1, 2].map(|channel| {
                    let parts = row.iter().zip(&old).map(|(part, old)| part * old[channel]);
                    parts.sum::<f64>() as f32
                });
            }
        }
    }
}

impl Gaussians {
    /// Turns a scene of a known orientation in the world, so that it has another one.
    pub fn stand(&mut self, wanted: Orientation) {
        let Some(orientation) =
            self.about.orientation.replace(wanted).filter(|orientation| *orientation != wanted)
        else {
            return;
        };
        self.turn(orientation.turn_to(wanted));
    }

    /// Turns the world about its origin: the Gaussians, and the colours that they show in each
    /// direction.
    pub(crate) fn turn(&mut self, rotation: DMat3) {
        let (quat, colors) = (DQuat::from_mat3(&rotation), turn(self.degree, rotation));
        self.origin = rotation * self.origin;
        self.centers.par_iter_mut().for_each(|center| {
            *center = (rotation * center.as_dvec3()).as_vec3();
        });
        self.rotations.par_iter_mut().for_each(|quaternion| {
            *quaternion = (quat * quaternion.as_dquat()).normalize().as_quat();
        });
        let terms = terms(self.degree);
        self.harmonics.par_chunks_mut(terms).for_each(|harmonics| colors.apply(harmonics));
    }
}

/// Applies a function to the colours of one Gaussian in all directions. What the terms that are
/// there cannot express is lost.
pub(crate) fn map_colors(coefficients: &mut [[f32; 3]], map: impl Fn([f32; 3]) -> [f32; 3]) {
    let mut sums = [[0.0; 3]; MOST_TERMS];
    for (direction, weight) in directions() {
        let basis = basis(direction);
        let mut color = [0.5; 3];
        for (term, coefficient) in basis.iter().zip(coefficients.iter()) {
            for (sum, part) in color.iter_mut().zip(coefficient) {
                *sum += term * f64::from(*part);
            }
        }
        let color = map(color.map(|v| v.max(0.0) as f32));
        for (sum, term) in sums.iter_mut().zip(basis) {
            for (sum, value) in sum.iter_mut().zip(color) {
                *sum += weight * term * (f64::from(value) - 0.5);
            }
        }
    }
    for (coefficient, sum) in coefficients.iter_mut().zip(sums) {
        *coefficient = sum.map(|v| v as f32);
    }
}

/// Returns directions with weights, which integrate polynomials up to degree 7 over the sphere: the
/// heights are those of Gauss and Legendre, and each circle has eight directions.
fn directions() -> impl Iterator<Item = (DVec3, f64)> {
    const AROUND: usize = 8;
    let (inner, root) = (2.0 / 7.0 * 1.2f64.sqrt(), 30f64.sqrt());
    let (low, high) = ((3.0 / 7.0 - inner).sqrt(), (3.0 / 7.0 + inner).sqrt());
    let (low_weight, high_weight) = ((18.0 + root) / 36.0, (18.0 - root) / 36.0);
    let heights =
        [(-high, high_weight), (-low, low_weight), (low, low_weight), (high, high_weight)];
    (0..DIRECTIONS).map(move |at| {
        let (z, weight) = heights[at / AROUND];
        let around = 2.0 * PI / AROUND as f64;
        let (sin, cos) = (around * (at % AROUND) as f64).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        (DVec3::new(radius * cos, radius * sin, z), weight * around)
    })
}

/// As [`harmonics::basis`](super::harmonics::basis), of degree 3 and in 64 bits.
fn basis(DVec3 { x, y, z }: DVec3) -> [f64; MOST_TERMS] {
    const ONE: f64 = 0.488_602_511_902_919_9;
    const TWO: [f64; 3] =
        [1.092_548_430_592_079_2, 0.315_391_565_252_520_05, 0.546_274_215_296_039_6];
    const THREE: [f64; 5] = [
        0.590_043_589_926_643_5,
        2.890_611_442_640_554,
        0.457_045_799_464_465_8,
        0.373_176_332_590_115_4,
        1.445_305_721_320_277,
    ];
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        0.282_094_791_773_878_14,
        -ONE * y,
        ONE * z,
        -ONE * x,
        TWO[0] * x * y,
        -TWO[0] * y * z,
        TWO[1] * (2.0 * zz - xx - yy),
        -TWO[0] * x * z,
        TWO[2] * (xx - yy),
        -THREE[0] * y * (3.0 * xx - yy),
        THREE[1] * x * y * z,
        -THREE[2] * y * (4.0 * zz - xx - yy),
        THREE[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
        -THREE[2] * x * (4.0 * zz - xx - yy),
        THREE[4] * z * (xx - yy),
        -THREE[0] * x * (xx - 3.0 * yy),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    #[test]
    fn a_scene_stands_anew_and_looks_the_same() {
        let mut set = Gaussians {
            origin: DVec3::new(10.0, 20.0, 30.0),
            centers: vec![Vec3::new(1.0, 2.0, 3.0)],
            scales: vec![Vec3::new(0.1, 0.2, 0.3)],
            rotations: vec![Quat::from_rotation_x(0.7)],
            opacities: vec![0.5],
            degree: 1,
            harmonics: vec![[0.0; 3], [0.1; 3], [0.2; 3], [0.3; 3]],
            ..Gaussians::default()
        };
        set.about.orientation = Some(Orientation::Y_UP);
        let before = set.clone();
        set.stand(Orientation::Y_DOWN);
        assert_eq!(set.about.orientation, Some(Orientation::Y_DOWN));
        assert_eq!(set.origin, DVec3::new(10.0, -20.0, -30.0));
        assert!((set.centers[0] - Vec3::new(1.0, -2.0, -3.0)).length() < 1e-6);
        let seen = |set: &Gaussians, from: Vec3| {
            super::super::harmonics::color(1, set.harmonics_of(0), from.normalize())
        };
        let [old, new] =
            [seen(&before, Vec3::new(1.0, 2.0, -3.0)), seen(&set, Vec3::new(1.0, -2.0, 3.0))];
        assert!(old.iter().zip(new).all(|(a, b)| (a - b).abs() < 1e-5), "{old:?} {new:?}");
        set.stand(Orientation::Y_UP);
        assert!((set.axes(0) - before.axes(0)).to_cols_array().iter().all(|v| v.abs() < 1e-6));
        // Without an orientation there is nothing to turn from.
        set.about.orientation = None;
        let centers = set.centers.clone();
        set.stand(Orientation::Y_DOWN);
        assert_eq!(set.centers, centers);
    }
    use crate::gaussians::harmonics::{self, color, constant_of};
    use glam::DQuat;

    /// Coefficients without a pattern, small enough that no colour is negative.
    fn coefficients(degree: u32) -> Vec<[f32; 3]> {
        let value = |at: usize| ((at * 37 + 11) % 29) as f32 / 29.0 * 0.12 - 0.06;
        (0..terms(degree)).map(|term| [0, 1, 2].map(|channel| value(3 * term + channel))).collect()
    }

    fn rotations() -> [DMat3; 5] {
        let turned = DMat3::from_quat(DQuat::from_xyzw(0.1, -0.7, 0.3, 0.4).normalize());
        let quarter = DMat3::from_rotation_x(PI / 2.0);
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        [turned, quarter, mirror, turned * mirror, -DMat3::IDENTITY]
    }

    #[test]
    fn colours_are_the_same_in_turned_directions() {
        for rotation in rotations() {
            for degree in 0..=MOST_DEGREE {
                let before = coefficients(degree);
                let mut after = before.clone();
                turn(degree, rotation).apply(&mut after);
                for (direction, _) in directions() {
                    // Directions that the matrix was not made from.
                    let direction = (direction + DVec3::new(0.3, -0.2, 0.1)).normalize();
                    let wanted = color(degree, &before, direction.as_vec3());
                    let turned = color(degree, &after, (rotation * direction).as_vec3());
                    for (actual, wanted) in turned.iter().zip(wanted) {
                        assert!((actual - wanted).abs() < 2e-6, "degree {degree}, {rotation}");
                    }
                }
            }
        }
    }

    #[test]
    fn known_turns() {
        // A quarter turn about z brings x to y: the term of x, −C·x, becomes that of y, −C·y.
        let mut colors = [[0.0; 3]; 4];
        colors[3] = [1.0, 2.0, 3.0];
        turn(1, DMat3::from_rotation_z(PI / 2.0)).apply(&mut colors);
        for (actual, wanted) in colors[1].iter().zip([1.0, 2.0, 3.0]) {
            assert!((actual - wanted).abs() < 1e-6, "{colors:?}");
        }
        assert!(colors[2..].as_flattened().iter().all(|v| v.abs() < 1e-6), "{colors:?}");
        // A point reflection changes the sign of the odd degrees.
        let before = coefficients(3);
        let mut after = before.clone();
        turn(3, -DMat3::IDENTITY).apply(&mut after);
        for (term, (after, before)) in after.iter().zip(&before).enumerate() {
            let sign = if (1..4).contains(&term) || term >= 9 { -1.0 } else { 1.0 };
            assert!((after[0] - sign * before[0]).abs() < 1e-6, "term {term}");
        }
    }

    #[test]
    fn terms_that_do_not_turn_are_unchanged() {
        let before = coefficients(3);
        let mut after = before.clone();
        turn(3, DMat3::IDENTITY).apply(&mut after);
        assert_eq!(after, before);
        // A turn of degree 3 for a colour of degree 1, and the reverse.
        let turned = DMat3::from_rotation_y(1.0);
        let mut short = before[..4].to_vec();
        turn(3, turned).apply(&mut short);
        turn(1, turned).apply(&mut after);
        assert_eq!((after[0], &after[4..]), (before[0], &before[4..]));
        assert_eq!(short, after[..4]);
    }

    #[test]
    fn terms_are_those_of_the_colours() {
        for (direction, _) in directions() {
            let wanted = harmonics::basis(3, direction.as_vec3());
            for (actual, wanted) in basis(direction).iter().zip(wanted) {
                assert!((actual - f64::from(wanted)).abs() < 1e-6, "{direction}");
            }
        }
    }

    #[test]
    fn colours_are_mapped_in_all_directions() {
        // The terms express what is linear.
        let before = coefficients(2);
        let mut after = before.clone();
        map_colors(&mut after, |color| color.map(|v| 0.25 + 0.5 * v));
        for (after, before) in after.iter().zip(&before) {
            for (after, before) in after.iter().zip(before) {
                assert!((after - 0.5 * before).abs() < 1e-6, "{after} is not half of {before}");
            }
        }
        let mut constant = [[constant_of(0.25), constant_of(0.5), constant_of(1.0)]];
        map_colors(&mut constant, |color| color.map(f32::sqrt));
        let mapped = color(0, &constant, glam::Vec3::X);
        for (actual, wanted) in mapped.iter().zip([0.5, 0.5f32.sqrt(), 1.0]) {
            assert!((actual - wanted).abs() < 1e-6, "{actual} is not {wanted}");
        }
    }
}

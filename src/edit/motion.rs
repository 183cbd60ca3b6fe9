//! Affine motions of scenes.

use crate::{
    Error,
    math::{eigen, keep},
};
use glam::{DMat3, DVec3};
use std::str::FromStr;

/// A linear map and a shift: x becomes L·x + t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// The linear map L, which can be inverted.
    linear: DMat3,
    /// The shift t.
    shift: DVec3,
}

/// How much a similarity may miss, as a part of its scale.
const EXACT: f64 = 1e-9;

impl Motion {
    /// Returns the motion by this much.
    pub fn translation(by: DVec3) -> Self {
        Self { linear: DMat3::IDENTITY, shift: by }
    }

    /// Returns the turn about an axis through the world's origin, counter-clockwise for an eye that
    /// looks against it. An axis without length is z.
    pub fn rotation(axis: DVec3, degrees: f64) -> Self {
        let linear = DMat3::from_axis_angle(axis.normalize_or(DVec3::Z), degrees.to_radians());
        Self { linear, shift: DVec3::ZERO }
    }

    /// Returns the scaling about the world's origin by a factor above 0.
    pub fn scale(factor: f64) -> Self {
        Self { linear: DMat3::from_diagonal(DVec3::splat(factor)), shift: DVec3::ZERO }
    }

    /// Returns the motion of a matrix of four rows.
    ///
    /// # Errors
    /// A message for matrices that are not affine or cannot be inverted.
    pub fn matrix(rows: [f64; 16]) -> Result<Self, String> {
        if !rows.iter().all(|number| number.is_finite()) {
            return Err("the numbers must be finite".into());
        }
        if rows[12..] != [0.0, 0.0, 0.0, 1.0] {
            return Err("the last row of the matrix must be 0,0,0,1".into());
        }
        let [x, y, z] = [0, 4, 8].map(|at| DVec3::new(rows[at], rows[at + 1], rows[at + 2]));
        let linear = DMat3::from_cols(x, y, z).transpose();
        let ([largest, _, least], _) = eigen(linear.transpose() * linear);
        if least <= largest * 1e-20 || largest == 0.0 {
            return Err("the matrix flattens space: it cannot be inverted".into());
        }
        Ok(Self { linear, shift: DVec3::new(rows[3], rows[7], rows[11]) })
    }

    /// Returns where a point is moved to.
    pub fn place(&self, point: DVec3) -> DVec3 {
        self.linear * point + self.shift
    }

    /// Checks that a scene in a box keeps its shape, and returns the corners of the box around it.
    ///
    /// # Errors
    /// [`Error::Argument`] for a place where 64 bits do not hold it.
    pub(crate) fn check(&self, from: [DVec3; 2]) -> Result<[DVec3; 2], Error> {
        let [low, high] = from;
        if !(low.cmple(high).all() && (high - low).is_finite()) {
            return Ok(from);
        }
        let corner = |at: usize| {
            let share = DVec3::from_array([at & 1, at >> 1 & 1, at >> 2].map(|bit| bit as f64));
            low + share * (high - low)
        };
        let to = keep::around((0..8).map(|at| self.place(corner(at))));
        let sides = [0, 1, 2].map(|axis| self.linear.row(axis).abs().dot(high - low));
        keep::check_move(from, to, sides.into_iter().fold(0.0, f64::max))?;
        Ok(to)
    }

    /// Returns the linear map.
    pub fn linear(&self) -> DMat3 {
        self.linear
    }

    /// Returns the scale and the turn, if the motion has no others; the turn may mirror.
    pub fn similarity(&self) -> Option<(f64, DMat3)> {
        let square = self.linear.transpose() * self.linear;
        let scale = (square.x_axis.x + square.y_axis.y + square.z_axis.z) / 3.0;
        let miss = square - DMat3::from_diagonal(DVec3::splat(scale));
        let is_exact = miss.to_cols_array().iter().all(|part| part.abs() <= EXACT * scale);
        is_exact.then(|| (scale.sqrt(), self.linear * scale.sqrt().recip()))
    }

    /// Returns the turn that is nearest to the linear map; it may mirror.
    pub fn turn(&self) -> DMat3 {
        if let Some((_, turn)) = self.similarity() {
            return turn;
        }
        // L = R·S, and S² = Lᵀ·L.
        let (squares, [a, b, c]) = eigen(self.linear.transpose() * self.linear);
        let axes = DMat3::from_cols(a, b, c);
        let inverse = DMat3::from_diagonal(DVec3::from(squares.map(|square| 1.0 / square.sqrt())));
        self.linear * axes * inverse * axes.transpose()
    }

    /// Returns the mean factor on lengths.
    pub fn mean_scale(&self) -> f64 {
        self.linear.determinant().abs().cbrt()
    }

    /// Returns a normal of a surface after the motion.
    pub fn normal(&self, normal: DVec3) -> DVec3 {
        (self.linear.inverse().transpose() * normal).normalize_or_zero()
    }
}

impl FromStr for Motion {
    type Err = String;

    /// Reads a turn about an axis, `z:90` or `1,1,0:-30`, in degrees.
    fn from_str(text: &str) -> Result<Self, String> {
        let form = "the form is AXIS:DEGREES, such as z:90 or 1,1,0:-30";
        let number = |text: &str| {
            let number = text.trim().parse().ok().filter(|number: &f64| number.is_finite());
            number.ok_or(form)
        };
        let (axis, degrees) = text.split_once(':').ok_or(form)?;
        let axis = match axis.trim() {
            "x" | "X" | "+x" | "+X" => DVec3::X,
            "y" | "Y" | "+y" | "+Y" => DVec3::Y,
            "z" | "Z" | "+z" | "+Z" => DVec3::Z,
            "-x" | "-X" => DVec3::NEG_X,
            "-y" | "-Y" => DVec3::NEG_Y,
            "-z" | "-Z" => DVec3::NEG_Z,
            axis => {
                let parts: Vec<f64> = axis.split(',').map(number).collect::<Result<_, _>>()?;
                DVec3::from_array(parts.try_into().map_err(|_| form)?)
            }
        };
        if axis.try_normalize().is_none() {
            return Err("an axis needs a length above 0".into());
        }
        Ok(Self::rotation(axis, number(degrees)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_move_points_and_normals() {
        let quarter = Motion::rotation(DVec3::Z, 90.0);
        assert!((quarter.place(DVec3::X) - DVec3::Y).length() < 1e-12);
        assert_eq!(Motion::scale(2.0).similarity(), Some((2.0, DMat3::IDENTITY)));
        let rows = [
            2.0, 0.0, 0.0, 5.0, //
            0.0, 1.0, 0.0, 6.0, //
            0.0, 0.5, 1.0, 7.0, //
            0.0, 0.0, 0.0, 1.0,
        ];
        let sheared = Motion::matrix(rows).unwrap();
        assert_eq!(sheared.place(DVec3::ONE), DVec3::new(7.0, 7.0, 8.5));
        assert_eq!(sheared.similarity(), None);
        let turn = sheared.turn();
        assert!(
            (turn * turn.transpose() - DMat3::IDENTITY)
                .to_cols_array()
                .iter()
                .all(|v| v.abs() < 1e-9)
        );
        // A normal stays perpendicular to what moves with the surface.
        let (normal, along) = (DVec3::Z, [DVec3::X, DVec3::Y]);
        for along in along {
            assert!(sheared.normal(normal).dot(sheared.linear() * along).abs() < 1e-12);
        }
        assert!((sheared.mean_scale() - 2f64.cbrt()).abs() < 1e-12);
    }

    #[test]
    fn wrong_matrices_are_named() {
        let mut rows = [0.0; 16];
        assert!(Motion::matrix(rows).unwrap_err().contains("last row"));
        rows[15] = 1.0;
        assert!(Motion::matrix(rows).unwrap_err().contains("flattens"));
        rows[0] = f64::NAN;
        assert!(Motion::matrix(rows).unwrap_err().contains("finite"));
    }
}

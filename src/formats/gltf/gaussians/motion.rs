//! How the transform of a node moves Gaussians.

use crate::{
    formats::shared::trained::Trained,
    gaussians::{
        MOST_DEGREE,
        turn::{Turn, turn},
    },
    math::eigen,
};
use glam::{DMat3, DMat4, DQuat, DVec3, Vec3};

/// The transform of a node, prepared for Gaussians.
pub(super) struct Motion {
    transform: DMat4,
    linear: DMat3,
    /// The rotation and the scale, if the scale is the same along all axes. A reflection through
    /// the centre is left out: it changes no shape.
    similar: Option<(DQuat, f64)>,
    /// Turns the colours.
    pub turn: Turn,
}

impl Motion {
    /// Returns `None` for a transform with numbers that are too large or not finite.
    pub fn new(transform: DMat4) -> Option<Self> {
        let linear = DMat3::from_mat4(transform);
        if !transform.is_finite() || !(linear.transpose() * linear).is_finite() {
            return None;
        }
        let (rotation, scale) = factors(linear);
        let proper = if rotation.determinant() < 0.0 { -rotation } else { rotation };
        let similar = scale.map(|scale| (DQuat::from_mat3(&proper).normalize(), scale));
        Some(Self { transform, linear, similar, turn: turn(MOST_DEGREE, rotation) })
    }

    /// Moves the place and the shape of a Gaussian.
    pub fn apply(&self, one: Trained) -> Trained {
        let center = self.transform.transform_point3(one.center);
        let (turn, scale) = (one.rotation.as_dquat(), one.scale.as_dvec3());
        if let Some((rotation, factor)) = self.similar {
            let rotation = (rotation * turn).as_quat();
            return Trained { center, scale: (scale * factor).as_vec3(), rotation, ..one };
        }
        let axes = self.linear * DMat3::from_quat(turn.normalize()) * DMat3::from_diagonal(scale);
        let covariance = axes * axes.transpose();
        // The caller leaves out Gaussians without a scale.
        if !covariance.is_finite() || one.scale.min_element() < 0.0 {
            return Trained { center, scale: Vec3::NAN, ..one };
        }
        let (squares, [first, second, _]) = eigen(covariance);
        let axes = DMat3::from_cols(first, second, first.cross(second));
        let scale = DVec3::from_array(squares.map(f64::sqrt)).as_vec3();
        Trained { center, scale, rotation: DQuat::from_mat3(&axes).normalize().as_quat(), ..one }
    }
}

/// Returns the orthogonal factor of a matrix (polar decomposition), and the scale if it is the same
/// along all axes. The factor mirrors if the matrix does.
fn factors(linear: DMat3) -> (DMat3, Option<f64>) {
    const SAME: f64 = 1e-6;
    let (squares, axes) = eigen(linear.transpose() * linear);
    let [largest, _, smallest] = squares;
    let Some(first) = (linear * axes[0]).try_normalize() else {
        return (DMat3::IDENTITY, Some(0.0));
    };
    let second = (linear * axes[1]).reject_from(first).try_normalize();
    let second = second.unwrap_or_else(|| first.any_orthonormal_vector());
    let before = DMat3::from_cols(axes[0], axes[1], axes[2]);
    let mirrors = (before.determinant() < 0.0) != (linear.determinant() < 0.0);
    let third = first.cross(second) * if mirrors { -1.0 } else { 1.0 };
    let rotation = DMat3::from_cols(first, second, third) * before.transpose();
    let is_same = largest - smallest <= SAME * largest;
    let mean = (squares.iter().sum::<f64>() / 3.0).sqrt();
    (rotation, is_same.then_some(mean))
}

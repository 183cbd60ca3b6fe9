//! Rigid motions of items.

use super::{Bounds, Clip, ClipShape, View};
use crate::{Error, Result};
use glam::{DMat3, DMat4, DQuat, DVec3};

/// A rigid motion: a rotation about the world's origin, then a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The rotation, of unit length.
    pub rotation: DQuat,
    /// The translation, in world units.
    pub translation: DVec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Pose {
    /// The motion that leaves everything where it is.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// Returns the motion of a matrix, which may be one of 32-bit numbers.
    ///
    /// # Errors
    /// [`Error::Argument`] if the matrix scales, shears or mirrors, projects, or has a number that
    /// is not finite.
    pub fn from_matrix(matrix: DMat4) -> Result<Self> {
        const TOLERANCE: f64 = 1e-4;
        let turn = DMat3::from_mat4(matrix);
        let is_rigid = (turn * turn.transpose()).abs_diff_eq(DMat3::IDENTITY, TOLERANCE)
            && turn.determinant() > 0.0
            && matrix.row(3).abs_diff_eq(glam::DVec4::W, TOLERANCE);
        if !(is_rigid && matrix.is_finite()) {
            return Err(Error::Argument(format!(
                "an item can be turned and moved, but the matrix {matrix} does something else; \
                 scale the item's data before it is added"
            )));
        }
        let rotation = DQuat::from_mat3(&turn).normalize();
        Ok(Self { rotation, translation: matrix.w_axis.truncate() })
    }

    /// Returns where a point is moved to.
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// Returns the motion back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, translation: rotation * -self.translation }
    }

    /// Returns this motion after another one.
    #[must_use]
    pub fn after(&self, first: &Self) -> Self {
        Self {
            rotation: self.rotation * first.rotation,
            translation: self.apply(first.translation),
        }
    }

    /// Returns the box around a moved box.
    pub fn bounds(&self, bounds: &Bounds) -> Bounds {
        if *self == Self::IDENTITY || bounds.is_empty() {
            return *bounds;
        }
        Bounds::around(bounds.corners().map(|corner| self.apply(corner)))
    }

    /// Returns a view as it is from an item that is moved. Lengths and view-space coordinates stay
    /// the same.
    pub(crate) fn view(&self, view: &View) -> View {
        let position = self.inverse().apply(view.position);
        View { position, rotation: view.rotation * DMat3::from_quat(self.rotation), ..view.clone() }
    }

    /// Returns clips as they are from an item that is moved. A box to keep becomes its six faces if
    /// it is turned.
    ///
    /// # Errors
    /// [`Error::Argument`] for a box to cut out that is turned.
    pub(crate) fn clips(&self, clips: &[Clip]) -> Result<Vec<Clip>> {
        if *self == Self::IDENTITY {
            return Ok(clips.to_vec());
        }
        let back = self.inverse();
        let half_space = |normal: DVec3, offset: f64| ClipShape::HalfSpace {
            normal: back.rotation * normal,
            offset: offset - normal.dot(self.translation),
        };
        let is_turned = self.rotation.w.abs() < 1.0;
        let mut moved = Vec::new();
        for &Clip { shape, inside } in clips {
            match shape {
                ClipShape::HalfSpace { normal, offset } => {
                    moved.push(Clip { shape: half_space(normal, offset), inside });
                }
                ClipShape::Box(bounds) if !is_turned => {
                    moved.push(Clip { shape: ClipShape::Box(back.bounds(&bounds)), inside });
                }
                ClipShape::Box(_) if !inside => {
                    return Err(Error::Argument(
                        "a box cannot be cut out of solid cells that are turned; cut by planes, or \
                         turn the cells before they are added"
                            .into(),
                    ));
                }
                ClipShape::Box(Bounds { min, max }) => {
                    let faces = DVec3::AXES
                        .into_iter()
                        .flat_map(|axis| [(axis, axis.dot(max)), (-axis, -axis.dot(min))]);
                    moved.extend(faces.map(|(normal, offset)| Clip {
                        shape: half_space(normal, offset),
                        inside: true,
                    }));
                }
            }
        }
        Ok(moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Camera;

    fn pose() -> Pose {
        let rotation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
        Pose { rotation, translation: DVec3::new(3.0, -1.0, 0.5) }
    }

    #[test]
    fn a_view_from_a_moved_item_sees_its_points_at_the_same_places() {
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
        let camera = Camera::framing(&bounds, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, 1.0);
        let view = camera.view([10, 10]).unwrap();
        let point = DVec3::new(0.3, -0.2, 0.9);
        let [moved, expected] =
            [pose().view(&view).to_view(point), view.to_view(pose().apply(point))];
        assert!(moved.abs_diff_eq(expected, 1e-12), "{moved} {expected}");
    }

    #[test]
    fn clips_keep_the_same_points_of_a_moved_item() {
        let bounds = Bounds { min: DVec3::new(2.0, -2.0, 0.0), max: DVec3::new(4.0, 0.5, 1.0) };
        let normal = DVec3::new(0.5, 1.0, 2.0);
        let clips = [
            Clip { shape: ClipShape::Box(bounds), inside: true },
            Clip { shape: ClipShape::HalfSpace { normal, offset: 1.2 }, inside: false },
        ];
        let moved = pose().clips(&clips).unwrap();
        for number in 0..1000 {
            let at = [7, 11, 13].map(|prime| f64::from(number * prime % 41) / 10.0 - 2.03);
            let point = pose().inverse().apply(DVec3::from_array(at) + pose().translation);
            let place = pose().apply(point);
            let kept = moved.iter().all(|clip| clip.keeps(point));
            assert_eq!(kept, clips.iter().all(|clip| clip.keeps(place)), "{place}");
        }
        let hole = Clip { shape: ClipShape::Box(bounds), inside: false };
        assert!(pose().clips(&[hole]).unwrap_err().to_string().contains("planes"));
        let shift = Pose { rotation: DQuat::IDENTITY, ..pose() };
        assert!(shift.clips(&[hole]).is_ok());
    }

    #[test]
    fn matrices_that_are_no_motion_are_refused() {
        let rigid = DMat4::from_rotation_translation(pose().rotation, pose().translation);
        let again = Pose::from_matrix(rigid).unwrap();
        assert!(again.apply(DVec3::X).abs_diff_eq(pose().apply(DVec3::X), 1e-12));
        assert!(again.after(&again.inverse()).translation.length() < 1e-12);
        for wrong in [
            DMat4::from_scale(DVec3::splat(2.0)),
            DMat4::NAN,
            DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)),
        ] {
            assert!(Pose::from_matrix(wrong).is_err(), "{wrong}");
        }
    }
}

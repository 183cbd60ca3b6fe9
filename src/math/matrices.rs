//! Views from the matrices of a host application.

use super::View;
use crate::{Error, Result};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Vec4Swizzles};

/// The largest difference between the sides of a pixel, between an axis and its perpendicular, and
/// so on, relative to their size. Matrices of 32-bit numbers are well within it.
const TOLERANCE: f64 = 1e-3;

impl View {
    /// Returns the view of a host's camera for a picture of `size` pixels (width, height).
    ///
    /// `view` maps world coordinates to the camera's, whose origin is the eye. `projection` maps
    /// these to clip space with x to the right and y up, as wgpu, Metal, Direct3D and OpenGL have
    /// it. The world is right-handed; the host of a left-handed one flips an axis of it. Matrices
    /// without perspective do not show whether they mirror the world.
    ///
    /// Any range of depths is fine: 0 to 1, −1 to 1, reversed, infinite. The optical axis may lie
    /// anywhere in the picture: eyes side by side, parts of a wall of screens, and jitter by parts
    /// of a pixel are possible.
    ///
    /// ```
    /// use splatkit::{glam::{DVec3, dcamera::rh}, math::View};
    ///
    /// let view = rh::view::look_at_mat4(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y);
    /// let projection = rh::proj::directx::perspective(0.8, 640.0 / 480.0, 0.1, 100.0);
    /// let view = View::from_matrices(view, projection, [640, 480])?;
    /// assert!((view.position - DVec3::Z * 5.0).length() < 1e-9);
    /// # Ok::<(), splatkit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`] if a number is not finite, if the matrices shear or mirror the world, or
    /// if pixels are not square.
    pub fn from_matrices(view: DMat4, projection: DMat4, size: [u32; 2]) -> Result<Self> {
        let wrong = |what: &str| {
            Err(Error::Argument(format!(
                "the matrices of the view {what}; view {view}, projection {projection}"
            )))
        };
        if size.contains(&0) {
            return Err(Error::Argument(format!(
                "a picture of {}x{} has no pixels",
                size[0], size[1]
            )));
        }
        let clip = projection * view;
        if !(clip.is_finite() && view.is_finite()) {
            return wrong("contain a number that is not finite");
        }
        let half = 0.5 * DVec2::from_array(size.map(f64::from));
        let rows = clip.transpose();
        let w = rows.w_axis;
        let perspective = w.xyz().length() > TOLERANCE * TOLERANCE * w.w.abs();
        // View-space z is the fourth coordinate of clip space, in units of the world.
        let per_unit = if perspective { w.xyz().length() } else { w.w };
        if per_unit == 0.0 || (!perspective && per_unit < 0.0) {
            return wrong("map all points to infinity");
        }
        // Pixel coordinates are across · (point, 1), in perspective divided by z.
        let across = [half.x * (rows.x_axis + w) / per_unit, half.y * (w - rows.y_axis) / per_unit];
        let forward = if perspective { w.xyz() / per_unit } else { DVec3::ZERO };
        let shift = DVec2::from_array(across.map(|row| row.xyz().dot(forward)));
        let [right, down] = [0, 1].map(|axis| across[axis].xyz() - shift[axis] * forward);
        let scale = 0.5 * (right.length() + down.length());
        let is_even = (right.length() - down.length()).abs() <= TOLERANCE * scale;
        if !(scale > 0.0 && scale.is_finite()) {
            return wrong("map the whole world to a line");
        }
        let (right, down) = (right.normalize(), down.normalize());
        let forward = if perspective { forward } else { right.cross(down) };
        if right.dot(down).abs() > TOLERANCE {
            return wrong("shear the world");
        }
        if !is_even {
            return wrong(
                "have pixels that are not square; the aspect must be that of the picture",
            );
        }
        if right.cross(down).dot(forward) < 0.0 {
            return wrong("mirror the world, which is right-handed");
        }
        let right = (right - right.dot(forward) * forward).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let (position, center) = match perspective {
            true => (eye([across[0], across[1], w / per_unit]), shift),
            false => {
                let position = view.inverse().w_axis.xyz();
                (position, DVec2::from_array(across.map(|row| row.dot(position.extend(1.0)))))
            }
        };
        if !(position.is_finite() && center.is_finite()) {
            return wrong("have no inverse");
        }
        Ok(Self { position, rotation, perspective, scale, center, size })
    }
}

/// Returns the point at which three planes (n, d) meet: n·p + d = 0.
fn eye(planes: [DVec4; 3]) -> DVec3 {
    let [a, b, c] = planes.map(|plane| plane.xyz());
    let offsets = DVec3::from_array(planes.map(|plane| -plane.w));
    DMat3::from_cols(a, b, c).transpose().inverse() * offsets
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};
    use glam::dcamera::{
        lh, rh,
        rh::proj::{directx, opengl},
    };

    const EYE: DVec3 = DVec3::new(3.0, -7.0, 2.0);
    const TARGET: DVec3 = DVec3::new(0.5, 1.0, -1.0);

    fn is_near(a: &View, b: &View) {
        assert_eq!((a.size, a.perspective), (b.size, b.perspective));
        assert!(a.position.abs_diff_eq(b.position, 1e-4), "{} {}", a.position, b.position);
        assert!(a.rotation.abs_diff_eq(b.rotation, 1e-5), "{} {}", a.rotation, b.rotation);
        assert!((a.scale - b.scale).abs() < 1e-4 * b.scale, "{} {}", a.scale, b.scale);
        assert!(a.center.abs_diff_eq(b.center, 1e-3), "{} {}", a.center, b.center);
    }

    fn camera(projection: Projection) -> View {
        let camera = Camera { position: EYE, focal_point: TARGET, view_up: DVec3::Z, projection };
        camera.view([640, 480]).unwrap()
    }

    #[test]
    fn matrices_of_every_convention_give_the_cameras_view() {
        let expected = camera(Projection::Perspective { view_angle: 40.0 });
        let (angle, aspect) = (40f64.to_radians(), 640.0 / 480.0);
        let right = rh::view::look_at_mat4(EYE, TARGET, DVec3::Z);
        let reversed = directx::perspective_infinite_reverse(angle, aspect, 0.1);
        for (view, projection) in [
            (right, directx::perspective(angle, aspect, 0.1, 50.0)),
            (right, opengl::perspective(angle, aspect, 0.1, 50.0)),
            (right, directx::perspective_infinite(angle, aspect, 0.1)),
            (right, reversed),
            // In 32 bits, and scaled.
            (right.as_mat4().as_dmat4(), reversed.as_mat4().as_dmat4()),
            (DMat4::from_scale(DVec3::splat(0.01)) * right, reversed),
        ] {
            is_near(&View::from_matrices(view, projection, [640, 480]).unwrap(), &expected);
        }
        let flat = camera(Projection::Orthographic { height: 6.0 });
        for projection in [
            directx::orthographic(-4.0, 4.0, -3.0, 3.0, 0.1, 50.0),
            directx::orthographic(-4.0, 4.0, -3.0, 3.0, 50.0, 0.1),
        ] {
            is_near(&View::from_matrices(right, projection, [640, 480]).unwrap(), &flat);
        }
    }

    #[test]
    fn the_axis_of_a_view_may_lie_anywhere() {
        for projection in
            [Projection::Perspective { view_angle: 25.0 }, Projection::Orthographic { height: 6.0 }]
        {
            let view = View { center: DVec2::new(-100.25, 501.0), ..camera(projection) };
            let clip = view.clip_from_world(0.5, 20.0);
            let rigid = DMat4::from_mat3(view.rotation) * DMat4::from_translation(-view.position);
            let again = View::from_matrices(rigid, clip * rigid.inverse(), view.size).unwrap();
            is_near(&again, &view);
        }
    }

    #[test]
    fn matrices_that_are_no_view_are_named() {
        let view = rh::view::look_at_mat4(EYE, TARGET, DVec3::Z);
        let projection = directx::perspective(0.7, 640.0 / 480.0, 0.1, 50.0);
        let error = |view, projection, size| {
            View::from_matrices(view, projection, size).unwrap_err().to_string()
        };
        let size = [640, 480];
        assert!(error(view, projection, [600, 480]).contains("not square"));
        assert!(error(view, projection, [0, 480]).contains("no pixels"));
        let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        assert!(error(view, mirror * projection, size).contains("mirror"));
        let left = lh::view::look_at_mat4(EYE, TARGET, DVec3::Z);
        let of_left = lh::proj::directx::perspective(0.7, 640.0 / 480.0, 0.1, 50.0);
        assert!(error(left, of_left, size).contains("mirror"));
        let mut shear = DMat4::IDENTITY;
        shear.y_axis.x = 0.3;
        assert!(error(view, shear * projection, size).contains("shear"));
        assert!(error(view * f64::NAN, projection, size).contains("not finite"));
        assert!(error(DMat4::ZERO, projection, size).contains("infinity"));
    }
}

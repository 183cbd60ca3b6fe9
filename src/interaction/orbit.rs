//! A camera that a hand moves: turned about a point, moved along the picture, brought closer to
//! what is under the cursor, or flown.

use crate::math::{Camera, Projection, View};
use glam::{DQuat, DVec2, DVec3};

/// Degrees that a drag over the picture's height turns the camera by.
const TURN: f64 = 180.0;
/// The camera comes no closer to a pole than this, in degrees, so that it never rolls over.
const POLE: f64 = 0.1;
/// The nearest and the farthest distance of the focal point, as shares of the scene's size.
const REACH: [f64; 2] = [1e-6, 1e4];

/// A camera that a hand moves. Its horizon stays level: the axis `up` is upright in the picture.
///
/// Drags are in pixels of the picture, x to the right and y down. A cursor is the place of a pixel,
/// from the picture's upper left corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Orbit {
    camera: Camera,
    up: DVec3,
    /// The diagonal of the scene, in world units.
    scene: f64,
}

impl Orbit {
    /// Takes a camera. `up` is the scene's way up, `scene` its diagonal in world units.
    pub fn new(camera: Camera, up: DVec3, scene: f64) -> Self {
        let up = up.try_normalize().unwrap_or(DVec3::Y);
        Self { camera, up, scene: scene.max(f64::MIN_POSITIVE) }
    }

    /// Returns the camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Sets the camera.
    pub fn set_camera(&mut self, camera: Camera) {
        self.camera = camera;
    }

    fn forward(&self) -> DVec3 {
        (self.camera.focal_point - self.camera.position).try_normalize().unwrap_or(DVec3::NEG_Z)
    }

    fn distance(&self) -> f64 {
        (self.camera.focal_point - self.camera.position).length()
    }

    /// Turns the camera about its focal point by a drag.
    pub fn turn(&mut self, drag: DVec2, size: [u32; 2]) {
        let turn = self.turned_by(drag, size);
        let camera = &mut self.camera;
        camera.position = camera.focal_point + turn * (camera.position - camera.focal_point);
        camera.view_up = self.up;
    }

    /// Turns the camera about its own position by a drag, as one looks around.
    pub fn look_around(&mut self, drag: DVec2, size: [u32; 2]) {
        let turn = self.turned_by(drag, size);
        let camera = &mut self.camera;
        camera.focal_point = camera.position + turn * (camera.focal_point - camera.position);
        camera.view_up = self.up;
    }

    /// Returns the turn of a drag: about the way up, then about the picture's horizontal axis, up
    /// to the poles.
    fn turned_by(&self, drag: DVec2, size: [u32; 2]) -> DQuat {
        let degrees = drag * (TURN / f64::from(size[1].max(1)));
        let about_up = DQuat::from_axis_angle(self.up, -degrees.x.to_radians());
        let forward = self.forward();
        let right = forward.cross(self.up).try_normalize();
        // At a pole, the picture's own way up says where right is.
        let right = right
            .or_else(|| forward.cross(self.camera.view_up).try_normalize())
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        let height = forward.dot(self.up).clamp(-1.0, 1.0).asin().to_degrees();
        let most = 90.0 - POLE;
        let tilted = (height - degrees.y).clamp(-most, most);
        // A camera already closer to the pole than allowed turns away from it only.
        let tilt = if height.abs() > most && tilted.signum() == height.signum() {
            (-degrees.y * height.signum()).min(0.0) * height.signum()
        } else {
            tilted - height
        };
        about_up * DQuat::from_axis_angle(right, tilt.to_radians())
    }

    /// Moves the camera along the picture, so that a point at this view-space depth, in world
    /// units, follows the cursor. Without a depth, the focal plane does.
    ///
    /// # Errors
    /// Those of [`Camera::view`].
    pub fn pan(&mut self, drag: DVec2, size: [u32; 2], depth: Option<f64>) -> crate::Result<()> {
        let view = self.camera.view(size)?;
        let depth = depth.unwrap_or_else(|| self.distance());
        let per_pixel = if view.perspective { depth / view.scale } else { 1.0 / view.scale };
        let step = view.rotation.transpose() * (drag * -per_pixel).extend(0.0);
        self.camera.position += step;
        self.camera.focal_point += step;
        Ok(())
    }

    /// Brings the camera closer by a factor, or away if it is below 1. The world point at this
    /// view-space depth under the cursor stays there. Without a depth, the point on the focal plane
    /// does.
    ///
    /// # Errors
    /// Those of [`Camera::view`].
    pub fn zoom(
        &mut self,
        factor: f64,
        cursor: DVec2,
        size: [u32; 2],
        depth: Option<f64>,
    ) -> crate::Result<()> {
        let view = self.camera.view(size)?;
        let depth = depth.filter(|depth| depth.is_finite() && *depth > 0.0);
        let fixed = point_at(&view, cursor, depth.unwrap_or_else(|| self.distance()));
        let [least, most] = REACH.map(|reach| reach * self.scene);
        let distance = (self.distance() / factor).clamp(least, most);
        let share = distance / self.distance();
        let camera = &mut self.camera;
        if let Projection::Orthographic { height } = &mut camera.projection {
            *height *= share;
        }
        let closer = |point: DVec3| fixed + (point - fixed) * share;
        (camera.position, camera.focal_point) =
            (closer(camera.position), closer(camera.focal_point));
        Ok(())
    }

    /// Makes a point the one that the camera looks at and turns about. The direction of view stays.
    pub fn center(&mut self, point: DVec3) {
        let step = point - self.camera.focal_point;
        self.camera.position += step;
        self.camera.focal_point += step;
    }

    /// Moves the camera through the scene by a length in world units, to the right, up and forward.
    pub fn fly(&mut self, step: DVec3) {
        let forward = self.forward();
        let right = forward.cross(self.up).try_normalize().unwrap_or(DVec3::ZERO);
        let step = right * step.x + self.up * step.y + forward * step.z;
        self.camera.position += step;
        self.camera.focal_point += step;
    }

    /// Switches between perspective and parallel rays. What is on the focal plane keeps its size.
    pub fn set_orthographic(&mut self, wanted: bool) {
        match (wanted, self.camera.projection) {
            (true, _) => self.camera.make_orthographic(),
            (false, Projection::Orthographic { height }) => {
                let half = (0.5 * height / self.distance()).atan().to_degrees();
                self.camera.projection = Projection::Perspective { view_angle: 2.0 * half };
            }
            (false, Projection::Perspective { .. }) => {}
        }
    }
}

/// Returns the world point under a cursor at a view-space depth.
pub fn point_at(view: &View, cursor: DVec2, depth: f64) -> DVec3 {
    let beside = (cursor - view.center) / view.scale;
    let beside = if view.perspective { beside * depth } else { beside };
    view.position + view.rotation.transpose() * beside.extend(depth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Bounds;

    const SIZE: [u32; 2] = [640, 480];

    fn orbit() -> Orbit {
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::new(3.0, 2.0, 5.0) };
        let camera = Camera::framing(&bounds, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, 4.0 / 3.0);
        Orbit::new(camera, DVec3::Z, bounds.diagonal())
    }

    fn pixel_of(orbit: &Orbit, point: DVec3) -> DVec2 {
        let view = orbit.camera().view(SIZE).unwrap();
        let p = view.to_view(point);
        let depth = if view.perspective { p.z } else { 1.0 };
        p.truncate() * view.scale / depth + view.center
    }

    #[test]
    fn a_turn_keeps_the_distance_and_a_level_horizon() {
        let mut orbit = orbit();
        let (before, distance) = (orbit.camera().clone(), orbit.distance());
        for _ in 0..50 {
            orbit.turn(DVec2::new(37.0, 61.0), SIZE);
            let view = orbit.camera().view(SIZE).unwrap();
            // The picture's right is level.
            assert!(view.rotation.row(0).z.abs() < 1e-9);
            assert!((orbit.distance() - distance).abs() < 1e-9);
            assert_eq!(orbit.camera().focal_point, before.focal_point);
        }
        // Fifty drags downwards end at a pole, not behind it.
        let height = orbit.forward().z.asin().to_degrees();
        assert!((height.abs() - (90.0 - POLE)).abs() < 1e-6, "{height}");
        orbit.turn(DVec2::new(0.0, -480.0), SIZE);
        assert!(orbit.forward().z.asin().to_degrees().abs() > 80.0);
    }

    #[test]
    fn a_drag_over_the_height_turns_half_around() {
        let mut orbit = orbit();
        let before = orbit.forward();
        orbit.turn(DVec2::new(480.0, 0.0), SIZE);
        let after = orbit.forward();
        assert!((after.z - before.z).abs() < 1e-12);
        assert!((after.truncate() + before.truncate()).length() < 1e-12);
    }

    #[test]
    fn the_point_under_the_cursor_stays_there() {
        for orthographic in [false, true] {
            let mut orbit = orbit();
            orbit.set_orthographic(orthographic);
            let view = orbit.camera().view(SIZE).unwrap();
            let (cursor, depth) = (DVec2::new(123.0, 300.0), 0.7 * orbit.distance());
            let point = point_at(&view, cursor, depth);
            assert!((pixel_of(&orbit, point) - cursor).length() < 1e-9);
            orbit.zoom(3.0, cursor, SIZE, Some(depth)).unwrap();
            assert!((pixel_of(&orbit, point) - cursor).length() < 1e-6);
            let depth = orbit.camera().view(SIZE).unwrap().to_view(point).z;
            orbit.pan(DVec2::new(40.0, -25.0), SIZE, Some(depth)).unwrap();
            let moved = cursor + DVec2::new(40.0, -25.0);
            assert!((pixel_of(&orbit, point) - moved).length() < 1e-6);
        }
    }

    #[test]
    fn zooming_never_ends_at_the_focal_point() {
        let mut orbit = orbit();
        for _ in 0..2000 {
            orbit.zoom(1.5, DVec2::new(320.0, 240.0), SIZE, None).unwrap();
        }
        assert!(orbit.camera().view(SIZE).is_ok() && orbit.distance() >= 1e-7 * orbit.scene);
        for _ in 0..2000 {
            orbit.zoom(0.5, DVec2::new(0.0, 0.0), SIZE, None).unwrap();
        }
        assert!(orbit.distance() <= 1.1e4 * orbit.scene);
    }

    #[test]
    fn flying_and_looking_around_keep_the_horizon() {
        let mut orbit = orbit();
        let (position, forward) = (orbit.camera().position, orbit.forward());
        orbit.fly(DVec3::new(0.0, 0.0, 2.0));
        assert!((orbit.camera().position - position - 2.0 * forward).length() < 1e-12);
        let position = orbit.camera().position;
        orbit.look_around(DVec2::new(30.0, 20.0), SIZE);
        assert_eq!(orbit.camera().position, position);
        assert!(orbit.camera().view(SIZE).unwrap().rotation.row(0).z.abs() < 1e-9);
        // A drag to the right looks to the right.
        assert!(orbit.forward().dot(forward.cross(DVec3::Z)) > 0.0);
    }

    #[test]
    fn the_projection_changes_and_comes_back() {
        let mut orbit = orbit();
        let before = orbit.camera().clone();
        orbit.set_orthographic(true);
        orbit.set_orthographic(true);
        orbit.set_orthographic(false);
        let Projection::Perspective { view_angle } = orbit.camera().projection else { panic!() };
        assert!((view_angle - Camera::DEFAULT_VIEW_ANGLE).abs() < 1e-9);
        assert_eq!(orbit.camera().position, before.position);
    }
}

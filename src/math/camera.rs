//! Cameras and the view frame.
//!
//! World frame: right-handed, any unit. View frame: x to the right of the picture, y **down**, z
//! away from the viewer, with the origin at the camera's position. A view-space point projects to
//! pixel (cx + f·x/z, cy + f·y/z). Rows are counted from the top, and pixel centres are at
//! half-integers.

use crate::{Error, Result};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4, Vec3};

/// A box along the axes: of the world, where nothing else is said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The smallest coordinates.
    pub min: DVec3,
    /// The largest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box of no points. Its union with a point is that point.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Returns the smallest box around these points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points
            .into_iter()
            .fold(Self::EMPTY, |all, point| all.union(Self { min: point, max: point }))
    }

    /// Returns the box between two corners that are relative to an origin.
    pub(crate) fn between(origin: DVec3, [low, high]: [Vec3; 2]) -> Self {
        Self { min: origin + low.as_dvec3(), max: origin + high.as_dvec3() }
    }

    /// Returns whether all coordinates are finite.
    pub fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// Returns whether a point lies in the box or on its border.
    pub fn contains(&self, point: DVec3) -> bool {
        (point.cmpge(self.min) & point.cmple(self.max)).all()
    }

    /// Returns the box widened by `margin` to all sides.
    #[must_use]
    pub fn widened(&self, margin: DVec3) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Returns whether the box contains no point. A NaN makes it empty.
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max)).all()
    }

    /// Returns the smallest box that contains both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the centre of the box.
    pub fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Returns the lengths of the sides.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// Whether the box is so large that no camera has all of it in reach
    /// ([`View::validate_for`]), wherever it stands.
    pub(crate) fn is_beyond_cameras(&self) -> bool {
        // From the middle, the corners are nearest.
        0.5 * self.diagonal() > FARTHEST
    }

    /// Returns the corners: x varies fastest, then y, then z.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            DVec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    /// Returns the distances from `point` to the nearest and the farthest point of the box.
    pub fn distances(&self, point: DVec3) -> [f64; 2] {
        let nearest = point.clamp(self.min, self.max);
        let farthest = (point - self.min).abs().max((point - self.max).abs());
        [(point - nearest).length(), farthest.length()]
    }
}

/// How points are projected onto the picture plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Rays start at the eye.
    Perspective {
        /// Full vertical view angle in degrees.
        view_angle: f64,
    },
    /// Rays are parallel.
    Orthographic {
        /// World height that the picture's height shows.
        height: f64,
    },
}

/// Where the picture is taken from, in world units.
///
/// The usual camera looks at the whole of a scene, and is turned around it:
///
/// ```
/// use glam::DVec3;
/// use splatkit::math::{Bounds, Camera};
///
/// let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::ONE };
/// // Looks along −z at the whole box, with +y upwards.
/// let mut camera = Camera::framing(&bounds, DVec3::NEG_Z, DVec3::Y, 640.0 / 480.0);
/// camera.azimuth(30.0);
/// let view = camera.view([640, 480])?;
/// // In view space x is right, y down and z forward.
/// let center = view.to_view(bounds.center());
/// assert!(center.x.abs() < 1e-9 && center.y.abs() < 1e-9 && center.z > 1.0);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The position of the eye.
    pub position: DVec3,
    /// The point that the camera looks at. It is in the middle of the picture.
    pub focal_point: DVec3,
    /// The direction that points up in the picture. It need not be perpendicular to the view, nor
    /// of unit length.
    pub view_up: DVec3,
    /// How far the view reaches sideways.
    pub projection: Projection,
}

impl Camera {
    /// VTK's default, so that the same scene has the same size in both.
    pub const DEFAULT_VIEW_ANGLE: f64 = 30.0;

    /// Looks along `direction` at the whole of `bounds`: its bounding sphere fits the shorter side
    /// of the picture.
    pub fn framing(bounds: &Bounds, direction: DVec3, view_up: DVec3, aspect: f64) -> Self {
        Self::framing_with(bounds, direction, view_up, aspect, Self::DEFAULT_VIEW_ANGLE)
    }

    /// Like [`framing`](Self::framing), with a vertical view angle in degrees, between 0 and 180.
    pub fn framing_with(
        bounds: &Bounds,
        direction: DVec3,
        view_up: DVec3,
        aspect: f64,
        view_angle: f64,
    ) -> Self {
        // The camera is far enough from a single point that the two differ in their coordinates.
        let least = f64::MIN_POSITIVE.sqrt().max(1e-13 * bounds.center().abs().max_element());
        let radius = (0.5 * bounds.diagonal()).max(least);
        let half = (0.5 * view_angle).to_radians();
        // The horizontal half angle is the narrower one in a portrait picture.
        let narrow = (half.tan() * aspect.min(1.0)).atan();
        let distance = radius / narrow.sin();
        Self {
            position: bounds.center() - distance * direction.normalize(),
            focal_point: bounds.center(),
            view_up,
            projection: Projection::Perspective { view_angle },
        }
    }

    /// Narrows or widens the view until the corners of `bounds` just fit a picture of `size`
    /// pixels, with a margin of `margin` times its sides. Does nothing if a corner is not in front
    /// of the camera.
    ///
    /// # Errors
    /// As [`view`](Self::view).
    pub fn tighten(&mut self, bounds: &Bounds, size: [u32; 2], margin: f64) -> Result<()> {
        let view = self.view(size)?;
        let mut widest: f64 = 0.0;
        for corner in bounds.corners() {
            let p = view.to_view(corner);
            if view.perspective && p.z <= 0.0 {
                return Ok(());
            }
            let depth = if view.perspective { p.z } else { 1.0 };
            widest =
                widest.max((view.scale * p.truncate() / depth / view.center).abs().max_element());
        }
        let factor = (1.0 - 2.0 * margin) / widest;
        if factor.is_finite() && factor > 0.0 {
            match &mut self.projection {
                // The picture's size follows the tangent of half the angle.
                Projection::Perspective { view_angle } => {
                    let half = (0.5 * *view_angle).to_radians().tan() / factor;
                    *view_angle = 2.0 * half.atan().to_degrees();
                }
                Projection::Orthographic { height } => *height /= factor,
            }
        }
        Ok(())
    }

    /// Turns the camera about the focal point around the view-up axis, in degrees (VTK's Azimuth).
    pub fn azimuth(&mut self, degrees: f64) {
        // Without an axis nothing turns; `view` reports it.
        let Some(axis) = self.view_up.try_normalize() else { return };
        let turn = glam::DQuat::from_axis_angle(axis, degrees.to_radians());
        self.position = self.focal_point + turn * (self.position - self.focal_point);
    }

    /// Turns the camera about the focal point around the picture's horizontal axis, in degrees
    /// (VTK's Elevation).
    pub fn elevation(&mut self, degrees: f64) {
        let Some(forward) = (self.focal_point - self.position).try_normalize() else { return };
        // Along the view-up axis any horizontal axis will do.
        let right = forward
            .cross(self.view_up)
            .try_normalize()
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        let turn = glam::DQuat::from_axis_angle(right, -degrees.to_radians());
        self.position = self.focal_point + turn * (self.position - self.focal_point);
        // Past a pole the old view-up could point along the view; the turned one never does.
        self.view_up = turn * self.view_up;
    }

    /// Narrows the view by a factor (VTK's Zoom).
    pub fn zoom(&mut self, factor: f64) {
        match &mut self.projection {
            Projection::Perspective { view_angle } => *view_angle /= factor,
            Projection::Orthographic { height } => *height /= factor,
        }
    }

    /// Switches to the same view without perspective: objects in the focal plane keep their size.
    pub fn make_orthographic(&mut self) {
        if let Projection::Perspective { view_angle } = self.projection {
            let distance = (self.focal_point - self.position).length();
            self.projection = Projection::Orthographic {
                height: 2.0 * distance * (0.5 * view_angle).to_radians().tan(),
            };
        }
    }

    /// Resolves the camera for a picture of `size` pixels (width, height).
    ///
    /// # Errors
    /// [`Error::Argument`] for a picture without pixels, a coordinate that is not finite, a camera
    /// at its own focal point, and a view angle or height outside its range.
    pub fn view(&self, size: [u32; 2]) -> Result<View> {
        let bad = |what: &str| Err(Error::Argument(format!("the camera {what}")));
        if size[0] == 0 || size[1] == 0 {
            return Err(Error::Argument(format!(
                "a picture of {}x{} has no pixels",
                size[0], size[1]
            )));
        }
        if !(self.position.is_finite() && self.focal_point.is_finite() && self.view_up.is_finite())
        {
            return bad("has a coordinate that is not a finite number");
        }
        let forward = match (self.focal_point - self.position).try_normalize() {
            Some(forward) => forward,
            None => return bad("is at its own focal point"),
        };
        // A view-up along the view direction has no meaning. Any perpendicular one serves better
        // than an error.
        let right = (forward.cross(self.view_up).try_normalize())
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        let down = forward.cross(right);
        let height = f64::from(size[1]);
        let (perspective, scale) = match self.projection {
            Projection::Perspective { view_angle } if view_angle > 0.0 && view_angle < 180.0 => {
                (true, 0.5 * height / (0.5 * view_angle).to_radians().tan())
            }
            Projection::Orthographic { height: world } if world > 0.0 && world.is_finite() => {
                (false, height / world)
            }
            Projection::Perspective { .. } => {
                return bad("needs a view angle between 0 and 180 degrees");
            }
            Projection::Orthographic { .. } => return bad("needs a height above 0"),
        };
        Ok(View {
            position: self.position,
            rotation: DMat3::from_cols(right, down, forward).transpose(),
            perspective,
            scale,
            center: 0.5 * DVec2::new(f64::from(size[0]), height),
            size,
        })
    }
}

/// A camera resolved for a picture's size.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// World position of the view frame's origin.
    pub position: DVec3,
    /// Rotates world directions to view space.
    pub rotation: DMat3,
    /// Whether rays start at the eye; otherwise they are parallel.
    pub perspective: bool,
    /// Perspective: focal length in pixels. Orthographic: pixels per world unit.
    pub scale: f64,
    /// Pixel coordinates of the optical axis.
    pub center: DVec2,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
}

/// What a picture is taken from: a [`Camera`], or a [`View`] that a host has made of its matrices.
pub trait Viewpoint {
    /// Resolves the viewpoint for a picture of `size` pixels (width, height).
    ///
    /// # Errors
    /// [`Error::Argument`] for a camera without a picture, and for a view of another size.
    fn view(&self, size: [u32; 2]) -> Result<View>;
}

impl Viewpoint for Camera {
    fn view(&self, size: [u32; 2]) -> Result<View> {
        Self::view(self, size)
    }
}

impl Viewpoint for View {
    fn view(&self, size: [u32; 2]) -> Result<View> {
        if self.size == size {
            return Ok(self.clone());
        }
        Err(Error::Argument(format!(
            "the view is that of a picture of {}x{} pixels, the settings ask for {}x{}",
            self.size[0], self.size[1], size[0], size[1]
        )))
    }
}

/// The largest distance from the camera, and the most pixels for a length of 1. Its inverse is the
/// fewest. The squares fit in 32 bits.
const FARTHEST: f64 = 1e18;

impl View {
    /// Checks that 32-bit numbers can hold the positions in the picture of everything in `bounds`.
    ///
    /// # Errors
    /// [`Error::Argument`] for a camera that is too far away, and for one whose pixels are too
    /// large or too small.
    pub fn validate_for(&self, bounds: &Bounds) -> Result<()> {
        let [_, far] = bounds.distances(self.position);
        let wrong = |message: String| Err(Error::Argument(format!("the camera {message}")));
        // NaN is refused too.
        if far.is_nan() || far > FARTHEST {
            return wrong(format!(
                "is {far:e} away from the far side of the scene; {FARTHEST:e} is the most"
            ));
        }
        if !(1.0 / FARTHEST..=FARTHEST).contains(&self.scale) {
            let least = 1.0 / FARTHEST;
            return wrong(format!(
                "shows a length of 1 with {:e} pixels; {least:e} to {FARTHEST:e} are allowed",
                self.scale
            ));
        }
        Ok(())
    }

    /// Returns the smallest cosine between a ray of the picture and the view's axis.
    pub(crate) fn smallest_cosine(&self) -> f64 {
        let size = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]));
        [DVec2::ZERO, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y), size]
            .map(|corner| self.ray(corner).1.z)
            .into_iter()
            .fold(1.0, f64::min)
    }

    /// Returns the view-space position of a world point.
    pub fn to_view(&self, world: DVec3) -> DVec3 {
        self.rotation * (world - self.position)
    }

    /// Returns the matrix from world coordinates to wgpu's clip space, for a host application that
    /// draws its own geometry in the same view. Depths run from 0 at the view-space z `near` to 1
    /// at `far`.
    ///
    /// ```
    /// use splatkit::{glam::{DVec3, DVec4}, math::{Camera, Projection}};
    ///
    /// let camera = Camera {
    ///     position: DVec3::Z * 5.0,
    ///     focal_point: DVec3::ZERO,
    ///     view_up: DVec3::Y,
    ///     projection: Projection::Perspective { view_angle: 90.0 },
    /// };
    /// let view = camera.view([200, 100])?;
    /// let clip = view.clip_from_world(1.0, 9.0) * DVec4::new(0.0, 5.0, 0.0, 1.0);
    /// // The middle of the upper side.
    /// assert!((clip / clip.w - DVec4::new(0.0, 1.0, 0.9, 1.0)).length() < 1e-12);
    /// # Ok::<(), splatkit::Error>(())
    /// ```
    pub fn clip_from_world(&self, near: f64, far: f64) -> DMat4 {
        // Columns of the projection: x, y and z of view space, where y points down, and 1.
        let [width, height] = self.size.map(f64::from);
        let sides = DVec2::new(2.0 / width, -2.0 / height);
        let (scale, shift) = (self.scale * sides, self.center * sides + DVec2::new(-1.0, 1.0));
        let depth = 1.0 / (far - near);
        let projection = if self.perspective {
            DMat4::from_cols(
                DVec4::new(scale.x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, scale.y, 0.0, 0.0),
                DVec4::new(shift.x, shift.y, far * depth, 1.0),
                DVec4::new(0.0, 0.0, -far * near * depth, 0.0),
            )
        } else {
            DMat4::from_cols(
                DVec4::new(scale.x, 0.0, 0.0, 0.0),
                DVec4::new(0.0, scale.y, 0.0, 0.0),
                DVec4::new(0.0, 0.0, depth, 0.0),
                DVec4::new(shift.x, shift.y, -near * depth, 1.0),
            )
        };
        projection * DMat4::from_mat3(self.rotation) * DMat4::from_translation(-self.position)
    }

    /// Returns the planes through the picture's four sides, moved outwards by `pixels`. A plane is
    /// (n, d) with n of unit length. Points whose view-space positions p have n·p + d < 0 for one
    /// of the planes are outside the picture.
    pub fn sides(&self, pixels: f64) -> [(DVec3, f64); 4] {
        let [width, height] = self.size.map(f64::from);
        let ends = [
            (DVec3::X, self.center.x + pixels),
            (-DVec3::X, width - self.center.x + pixels),
            (DVec3::Y, self.center.y + pixels),
            (-DVec3::Y, height - self.center.y + pixels),
        ];
        ends.map(|(axis, reach)| {
            if self.perspective {
                ((axis * self.scale + DVec3::Z * reach).normalize(), 0.0)
            } else {
                (axis, reach / self.scale)
            }
        })
    }

    /// Returns the ray of a point of the picture: view-space origin and unit direction. Distances
    /// along rays are measured from this origin: from the eye in perspective, from the plane z = 0
    /// in orthographic views.
    pub fn ray(&self, pixel: DVec2) -> (DVec3, DVec3) {
        let p = (pixel - self.center) / self.scale;
        if self.perspective {
            (DVec3::ZERO, p.extend(1.0).normalize())
        } else {
            (p.extend(0.0), DVec3::Z)
        }
    }

    /// Returns the smallest and largest distance of a box from the view's origin (perspective) or
    /// from its plane (orthographic).
    pub fn distances(&self, bounds: &Bounds) -> [f64; 2] {
        if self.perspective {
            return bounds.distances(self.position);
        }
        bounds.corners().iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[near, far], &corner| {
            let z = self.to_view(corner).z;
            [near.min(z), far.max(z)]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::new(3.0, 2.0, 5.0) };
        Camera::framing(&bounds, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, 4.0 / 3.0)
    }

    #[test]
    fn the_framing_camera_shows_every_corner() {
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::new(3.0, 2.0, 5.0) };
        for size in [[640, 480], [480, 640]] {
            let aspect = f64::from(size[0]) / f64::from(size[1]);
            let camera = Camera::framing(&bounds, DVec3::new(1.0, 2.0, -0.5), DVec3::Z, aspect);
            let view = camera.view(size).unwrap();
            for corner in bounds.corners() {
                let p = view.to_view(corner);
                let pixel = view.center + view.scale * p.truncate() / p.z;
                assert!(pixel.x >= 0.0 && pixel.x <= f64::from(size[0]), "{pixel}");
                assert!(pixel.y >= 0.0 && pixel.y <= f64::from(size[1]), "{pixel}");
            }
        }
    }

    #[test]
    fn a_fitted_camera_touches_the_margin() {
        let bounds = Bounds { min: DVec3::splat(-1.0), max: DVec3::new(3.0, 2.0, 5.0) };
        for orthographic in [false, true] {
            let mut camera = camera();
            if orthographic {
                camera.make_orthographic();
            }
            camera.tighten(&bounds, [640, 480], 0.05).unwrap();
            let view = camera.view([640, 480]).unwrap();
            let reach = bounds.corners().map(|corner| {
                let p = view.to_view(corner);
                (view.scale * p.truncate() / if orthographic { 1.0 } else { p.z } / view.center)
                    .abs()
                    .max_element()
            });
            let widest = reach.into_iter().fold(0.0, f64::max);
            assert!((widest - 0.9).abs() < 1e-9, "{widest}");
        }
    }

    #[test]
    fn the_view_frame_is_right_down_forward() {
        let view = camera().view([64, 64]).unwrap();
        let rows = view.rotation.transpose();
        assert!((view.rotation.determinant() - 1.0).abs() < 1e-12);
        assert!(rows.y_axis.dot(DVec3::Z) < 0.0, "down points against view-up");
        let center = view.to_view(camera().focal_point);
        assert!(center.truncate().length() < 1e-9 && center.z > 0.0);
    }

    #[test]
    fn an_orthographic_copy_keeps_the_focal_plane() {
        let mut flat = camera();
        let sharp = camera().view([200, 100]).unwrap();
        flat.make_orthographic();
        let flat = flat.view([200, 100]).unwrap();
        let distance = (camera().focal_point - camera().position).length();
        assert!((flat.scale - sharp.scale / distance).abs() < 1e-9 * flat.scale);
    }

    #[test]
    fn cameras_without_a_picture_are_refused() {
        let mut c = camera();
        assert!(c.view([0, 5]).is_err());
        c.focal_point = c.position;
        assert!(c.view([5, 5]).is_err());
        c = camera();
        c.projection = Projection::Perspective { view_angle: 180.0 };
        assert!(c.view([5, 5]).is_err());
    }
    #[test]
    fn a_single_point_is_looked_at() {
        for place in
            [DVec3::ZERO, DVec3::new(1.0, -2.0, 3.0), DVec3::splat(1e8), DVec3::splat(-1e150)]
        {
            let bounds = Bounds { min: place, max: place };
            let camera = Camera::framing(&bounds, DVec3::Y, DVec3::Z, 1.5);
            assert_eq!(camera.focal_point, place);
            assert!(camera.view([30, 20]).is_ok(), "{camera:?}");
        }
    }
}

//! Cameras that see the whole of a set of points.

use super::{Camera, Projection};
use crate::Result;
use glam::DVec3;

/// The nearest that a camera comes to the points that it is fitted to, as a share of their extent.
const NEAREST: f64 = 0.05;

/// How far points reach in the camera's frame.
struct Reach {
    /// Tangents of half the view angle, across and down, without the margin. In orthographic views
    /// half of the width and the height, in world units.
    slopes: [f64; 2],
    /// The share of the picture's sides inside the margins.
    inner: f64,
    /// The smallest and the largest coordinates: right, down, forward.
    low: DVec3,
    high: DVec3,
}

impl Camera {
    /// Moves the camera, without turning it, until `points` just fit a picture of `size` pixels
    /// with a margin of `margin` times its sides. In perspective the view angle stays as it is; in
    /// orthographic views the height changes. The focal point becomes the middle of the points, on
    /// the optical axis. Without points, nothing changes.
    ///
    /// In the larger direction the points fill the picture up to the margins: each side of the
    /// view's pyramid touches a point, and the pyramid's apex is as far forward as both allow.
    ///
    /// # Errors
    /// As [`view`](Self::view).
    pub fn fit_points(&mut self, points: &[DVec3], size: [u32; 2], margin: f64) -> Result<()> {
        let Some(reach) = self.reach(points, size, margin)? else { return Ok(()) };
        let view = self.view(size)?;
        let to_frame = |point: DVec3| view.rotation * point;
        let mut eye = 0.5 * (reach.low + reach.high);
        match &mut self.projection {
            Projection::Perspective { .. } => {
                let mut nearest = reach.least_forward();
                for axis in 0..2 {
                    let slope = reach.slopes[axis];
                    // The largest offset from the axis, less what the pyramid is wide there.
                    let most = |sign: f64| {
                        let beyond = |p: &DVec3| {
                            let p = to_frame(*p);
                            sign * p[axis] - slope * p.z
                        };
                        points.iter().map(beyond).fold(f64::NEG_INFINITY, f64::max)
                    };
                    let (above, below) = (most(1.0), most(-1.0));
                    eye[axis] = 0.5 * (above - below);
                    nearest = nearest.min(-0.5 * (above + below) / slope);
                }
                eye.z = nearest;
            }
            Projection::Orthographic { height } => {
                *height = reach.height_around(eye);
                // Nothing is drawn behind the eye.
                eye.z = reach.low.z - 0.5 * (reach.high - reach.low).length();
            }
        }
        let middle = 0.5 * (reach.low.z + reach.high.z);
        let back = view.rotation.transpose();
        self.position = back * eye;
        self.focal_point = back * eye.with_z(middle);
        Ok(())
    }

    /// Returns the distance from the focal point at which `points` just fit the picture, as for
    /// [`fit_points`](Self::fit_points), if the camera neither turns nor moves sideways. In
    /// orthographic views it is the height of the picture instead. `None` without points.
    ///
    /// A turntable takes the largest of all its frames
    /// ([`set_distance`](Self::set_distance)).
    ///
    /// # Errors
    /// As [`view`](Self::view).
    pub fn distance_to_fit(
        &self,
        points: &[DVec3],
        size: [u32; 2],
        margin: f64,
    ) -> Result<Option<f64>> {
        let Some(reach) = self.reach(points, size, margin)? else { return Ok(None) };
        let view = self.view(size)?;
        let focus = view.rotation * self.focal_point;
        if !view.perspective {
            return Ok(Some(reach.height_around(focus)));
        }
        let needed = |point: &DVec3| {
            let p = view.rotation * *point - focus;
            let [x, y] = [0, 1].map(|axis| p[axis].abs() / reach.slopes[axis] - p.z);
            x.max(y)
        };
        let least = focus.z - reach.least_forward();
        Ok(Some(points.iter().map(needed).fold(least, f64::max)))
    }

    /// Moves the camera along its view direction to this distance from the focal point, in world
    /// units. In orthographic views, the distance is the height of the picture instead.
    pub fn set_distance(&mut self, distance: f64) {
        let away = (self.position - self.focal_point).normalize_or(DVec3::Z);
        match &mut self.projection {
            Projection::Perspective { .. } => self.position = self.focal_point + distance * away,
            Projection::Orthographic { height } => *height = distance,
        }
    }

    /// Returns how far points reach; `None` if there are none.
    fn reach(&self, points: &[DVec3], size: [u32; 2], margin: f64) -> Result<Option<Reach>> {
        let view = self.view(size)?;
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let grow = |(low, high): (DVec3, DVec3), point: &DVec3| {
            let p = view.rotation * *point;
            (low.min(p), high.max(p))
        };
        let (mut low, mut high) = points.iter().fold(none, grow);
        if !low.cmple(high).all() {
            return Ok(None);
        }
        // A single point needs some room: enough that the camera differs from it.
        let least = (1e-13 * low.abs().max(high.abs()).max_element()).max(1e-150);
        if (high - low).max_element() < least {
            (low, high) = (low - least, high + least);
        }
        let inner = 1.0 - 2.0 * margin;
        let slopes = [0, 1].map(|axis| inner * view.center[axis] / view.scale);
        Ok(Some(Reach { slopes, inner, low, high }))
    }
}

impl Reach {
    /// Returns how far forward the eye may be: some way before the nearest point.
    fn least_forward(&self) -> f64 {
        self.low.z - NEAREST * (self.high - self.low).length()
    }

    /// Returns the height of the orthographic picture around a middle that shows everything.
    fn height_around(&self, middle: DVec3) -> f64 {
        let half = (self.high - middle).max(middle - self.low);
        let [across, down] = self.slopes;
        2.0 * half.y.max(half.x * down / across) / self.inner
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Bounds;

    const SIZE: [u32; 2] = [640, 480];

    fn bounds() -> Bounds {
        Bounds { min: DVec3::new(-1.0, 4.0, -3.0), max: DVec3::new(3.0, 5.0, 5.0) }
    }

    fn camera(orthographic: bool) -> Camera {
        let mut camera =
            Camera::framing(&bounds(), DVec3::new(1.0, 2.0, -0.5), DVec3::Z, 4.0 / 3.0);
        if orthographic {
            camera.make_orthographic();
        }
        camera
    }

    /// The ends of the points in the picture, as shares of its half sides from its middle.
    fn ends(camera: &Camera, points: &[DVec3]) -> [[f64; 2]; 2] {
        let view = camera.view(SIZE).unwrap();
        let place = |point: &DVec3| {
            let p = view.to_view(*point);
            assert!(p.z > 0.0);
            view.scale * p.truncate() / if view.perspective { p.z } else { 1.0 } / view.center
        };
        [0, 1].map(|axis| {
            let all = points.iter().map(|point| place(point)[axis]);
            all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], at| [a.min(at), b.max(at)])
        })
    }

    #[test]
    fn points_fill_the_picture_up_to_the_margins() {
        let points = bounds().corners();
        for orthographic in [false, true] {
            let mut camera = camera(orthographic);
            let before = (camera.focal_point - camera.position).normalize();
            camera.fit_points(&points, SIZE, 0.04).unwrap();
            let after = (camera.focal_point - camera.position).normalize();
            assert!((before - after).length() < 1e-9, "the camera does not turn");
            let [across, down] = ends(&camera, &points);
            let widths = [across, down].map(|[low, high]| 0.5 * (high - low));
            let most = widths[0].max(widths[1]);
            assert!((most - 0.92).abs() < 1e-3, "{across:?} {down:?}");
            for [low, high] in [across, down] {
                assert!(low > -0.93 && high < 0.93, "{across:?} {down:?}");
            }
        }
    }

    #[test]
    fn one_distance_fits_all_turns() {
        let points = bounds().corners();
        for orthographic in [false, true] {
            let turned = |turn: f64| {
                let mut camera = camera(orthographic);
                camera.azimuth(turn);
                camera
            };
            let needed = |turn| turned(turn).distance_to_fit(&points, SIZE, 0.04).unwrap().unwrap();
            let turns = (0..36).map(|turn| f64::from(turn) * 10.0);
            let most = turns.clone().map(needed).fold(0.0, f64::max);
            let mut widest: f64 = 0.0;
            for turn in turns {
                let mut camera = turned(turn);
                camera.set_distance(most);
                let all = ends(&camera, &points).concat();
                widest = all.into_iter().fold(widest, |widest, end| widest.max(end.abs()));
            }
            assert!((widest - 0.92).abs() < 1e-9, "{widest}");
        }
    }

    #[test]
    fn a_point_and_nothing_are_fitted() {
        for orthographic in [false, true] {
            let mut one = camera(orthographic);
            one.fit_points(&[DVec3::new(1e6, 2.0, 3.0)], SIZE, 0.04).unwrap();
            assert!(one.view(SIZE).is_ok() && one.position.is_finite());
            let mut none = camera(orthographic);
            none.fit_points(&[], SIZE, 0.04).unwrap();
            assert_eq!(none, camera(orthographic));
        }
    }
}

//! Views of a scene: from far to inside, around it, through other lenses.

use glam::DVec3;
use splatkit::math::{Bounds, Camera};
use splatkit::session::{Framing, Subject};

/// From far away to the centre, in multiples of the distance at which the sphere around the scene
/// fills the picture. The sphere's surface lies at 0.26.
pub const DISTANCES: [f64; 13] =
    [8.0, 4.0, 2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.06, 0.0];

/// Azimuths and elevations in degrees: along axes, in planes of two axes, and along the diagonal of
/// all three.
pub const ANGLES: [[f64; 2]; 14] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [5.0, 0.0],
    [15.0, 0.0],
    [30.0, 0.0],
    [45.0, 0.0],
    [60.0, 0.0],
    [85.0, 0.0],
    [90.0, 0.0],
    [90.0, 20.0],
    [60.0, 30.0],
    [45.0, DIAGONAL],
    [45.0, 60.0],
    [45.0, 90.0],
];

/// The elevation of a cube's diagonal, in degrees.
const DIAGONAL: f64 = 35.264_389_682_754_654;

/// View angles of lenses, in degrees.
pub const LENSES: [f64; 8] = [5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0, 120.0];

/// Factors that enlarge the middle of the picture.
pub const ZOOMS: [f64; 8] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// Returns the camera of `bench`.
pub fn usual(bounds: &Bounds, up: DVec3) -> Camera {
    Framing::default().turned(&Subject::new(*bounds, up), [1; 2], 0.0)
}

/// Returns the same camera at `times` the distance, which may be 0. The direction stays.
pub fn at_distance(times: f64, bounds: &Bounds, up: DVec3) -> Camera {
    let mut camera = usual(bounds, up);
    let away = camera.position - camera.focal_point;
    camera.position = camera.focal_point + times * away;
    camera.focal_point -= away;
    camera
}

/// Returns a camera at an azimuth and an elevation. The sphere around the scene fills the picture.
pub fn from_angle([azimuth, elevation]: [f64; 2], bounds: &Bounds) -> Camera {
    let mut camera = Camera::framing(bounds, DVec3::Y, DVec3::Z, 1.0);
    camera.azimuth(azimuth);
    camera.elevation(elevation);
    camera
}

/// Returns a camera with a view angle, at the distance at which the sphere around the scene fills
/// the picture.
pub fn through_lens(view_angle: f64, bounds: &Bounds) -> Camera {
    let usual = usual(bounds, DVec3::Z);
    Camera::framing_with(bounds, usual.focal_point - usual.position, usual.view_up, 1.0, view_angle)
}

/// Returns the camera of `bench` with a lens that enlarges the picture; the camera stays.
pub fn zoomed(factor: f64, bounds: &Bounds) -> Camera {
    let mut camera = usual(bounds, DVec3::Z);
    // The size of the picture follows the tangent of half the view angle.
    let half = (0.5 * Camera::DEFAULT_VIEW_ANGLE).to_radians().tan() / factor;
    camera.projection =
        splatkit::math::Projection::Perspective { view_angle: 2.0 * half.atan().to_degrees() };
    camera
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };

    #[test]
    fn cameras_go_into_the_middle() {
        let away = |times| at_distance(times, &BOUNDS, DVec3::Z).position.length();
        assert!(away(0.0) < 1e-9 && (away(2.0) / away(1.0) - 2.0).abs() < 1e-9);
        for times in DISTANCES {
            at_distance(times, &BOUNDS, DVec3::Z).view([9; 2]).unwrap();
        }
    }

    #[test]
    fn cameras_go_around() {
        let along = |angle| (-from_angle(angle, &BOUNDS).position).normalize();
        assert!((along([0.0, 0.0]) - DVec3::Y).length() < 1e-9);
        assert!((along([90.0, 0.0]).x.abs() - 1.0).abs() < 1e-9);
        assert!((along([45.0, 90.0]) - DVec3::NEG_Z).length() < 1e-9);
        assert!(
            (along([45.0, DIAGONAL]).abs() - DVec3::splat(3f64.sqrt().recip())).length() < 1e-9
        );
    }

    #[test]
    fn lenses_keep_the_size() {
        for angle in LENSES {
            let view = through_lens(angle, &BOUNDS).view([100; 2]).unwrap();
            // The sine of half the angle is the sphere's radius over its distance.
            let distance = view.to_view(DVec3::ZERO).z;
            assert!((distance * (0.5 * angle).to_radians().sin() - 3f64.sqrt()).abs() < 1e-9);
        }
        assert!(
            (zoomed(1.0, &BOUNDS).view([64; 2]).unwrap().scale * 4.0
                - zoomed(4.0, &BOUNDS).view([64; 2]).unwrap().scale)
                .abs()
                < 1e-9
        );
    }
}

//! The ray of a pixel, and its derivatives from pixel to pixel.

use crate::math::View;
use glam::{DMat3, DVec2, DVec3};

/// A ray in view space: the points `origin + s·direction`, and their derivatives per pixel to the
/// right and per pixel downward.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// Derivative of the origin per pixel to the right and per pixel downward.
    origin_across: [DVec3; 2],
    /// Derivative of the direction, likewise.
    direction_across: [DVec3; 2],
}

impl Ray {
    /// Returns the ray through a point of the picture, in pixels.
    pub fn new(view: &View, pixel: DVec2) -> Self {
        let (origin, direction) = view.ray(pixel);
        let steps = [DVec3::X, DVec3::Y].map(|axis| axis / view.scale);
        if !view.perspective {
            return Self {
                origin,
                direction,
                origin_across: steps,
                direction_across: [DVec3::ZERO; 2],
            };
        }
        // The direction is b/|b| with b = (x, y, 1). Its derivative is the component of b's
        // derivative that is perpendicular to it.
        let inverse_length = direction.z;
        let direction_across =
            steps.map(|step| inverse_length * (step - direction * direction.dot(step)));
        Self { origin, direction, origin_across: [DVec3::ZERO; 2], direction_across }
    }

    pub fn point(&self, s: f64) -> DVec3 {
        self.origin + s * self.direction
    }

    /// Returns the derivative of the point at distance s, in world units per pixel to the right and
    /// per pixel downward.
    pub fn across(&self, s: f64) -> [DVec3; 2] {
        [0, 1].map(|i| self.origin_across[i] + s * self.direction_across[i])
    }

    /// Returns the gradient (view space, per world unit) from its derivatives at distance s: per
    /// pixel to the right, per pixel downward, and per world unit along the ray.
    pub fn gradient(&self, s: f64, across: DVec2, along: f64) -> Option<DVec3> {
        let [right, down] = self.across(s);
        let slopes = across.extend(along);
        // A derivative is the dot product of the gradient and a step; three of them form a linear
        // system.
        let steps = DMat3::from_cols(right, down, self.direction).transpose();
        Some(steps.inverse() * slopes).filter(|gradient| gradient.is_finite())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::math::{Camera, Projection};

    /// Both projections, seen from an oblique angle.
    pub fn views() -> [View; 2] {
        let projections = [
            Projection::Perspective { view_angle: 70.0 },
            Projection::Orthographic { height: 3.0 },
        ];
        projections.map(|projection| {
            let camera = Camera {
                position: DVec3::new(3.0, -2.0, 1.0),
                focal_point: DVec3::new(0.5, 0.5, 0.5),
                view_up: DVec3::Z,
                projection,
            };
            camera.view([40, 30]).unwrap()
        })
    }

    #[test]
    fn points_move_across_the_picture_as_the_derivative_says() {
        for view in views() {
            let pixel = DVec2::new(33.5, 4.5);
            let ray = Ray::new(&view, pixel);
            let step = 1e-5;
            for (axis, moved) in [DVec2::X, DVec2::Y].into_iter().zip(ray.across(2.5)) {
                let [before, after] =
                    [-step, step].map(|d| Ray::new(&view, pixel + d * axis).point(2.5));
                assert!(((after - before) / (2.0 * step) - moved).length() < 1e-8);
            }
        }
    }

    #[test]
    fn gradients_come_back_from_their_derivatives() {
        let gradient = DVec3::new(0.3, -2.0, 1.5);
        for view in views() {
            let ray = Ray::new(&view, DVec2::new(2.5, 25.5));
            let s = 4.0;
            let across = DVec2::from(ray.across(s).map(|step| gradient.dot(step)));
            let along = gradient.dot(ray.direction);
            let restored = ray.gradient(s, across, along).unwrap();
            assert!((restored - gradient).length() < 1e-9, "{restored}");
            if view.perspective {
                // The same, solved by hand: r = |b| = 1/b̂_z.
                let b = ray.direction;
                let k = view.scale / (b.z * s);
                let (x, y) = (across[0] * k + along * b.x, across[1] * k + along * b.y);
                let by_hand = DVec3::new(x, y, (along - x * b.x - y * b.y) / b.z);
                assert!((restored - by_hand).length() < 1e-9, "{by_hand}");
            }
        }
    }
}

//! Rods: the share of a pixel that each fills, and where the pixel's ray meets it.

use super::ray::Ray;
use crate::{
    facet::{OVERLAP, Relief, Rod},
    math::View,
};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Where the ray of a pixel meets a facet, and the share of the pixel that the facet fills.
pub(super) struct Place {
    pub share: f64,
    pub distance: f64,
    pub color: DVec3,
    /// Of any length; zero for a colour that is not lit.
    pub normal: DVec3,
}

/// A rod in view space.
pub(super) struct Body {
    ends: [DVec3; 2],
    radii: [f64; 2],
    pixels: f64,
    colors: [DVec3; 2],
    is_round: bool,
    /// The normal of a flat rod; zero if there is none.
    normal: DVec3,
    /// The direction of the rod before; zero if there is none. Whether another rod follows.
    joints: (DVec3, bool),
}

impl Body {
    pub fn new(rod: &Rod, origin: DVec3, view: &View) -> Self {
        let (is_round, normal) = match rod.relief {
            Relief::Round => (true, None),
            Relief::Flat(normal) => (false, normal),
        };
        Self {
            ends: rod.ends.map(|end| view.to_view(origin + end.as_dvec3())),
            radii: rod.radii.map(f64::from),
            pixels: f64::from(rod.pixels),
            colors: rod.colors.map(|color| DVec3::from(color.map(f64::from)) / 255.0),
            is_round,
            normal: normal.map_or(DVec3::ZERO, |normal| view.rotation * normal.as_dvec3()),
            joints: (
                rod.joints.0.map_or(DVec3::ZERO, |before| view.rotation * before.as_dvec3()),
                rod.joints.1,
            ),
        }
    }

    /// Returns the first and the last row of pixels that the rod may meet.
    pub fn rows(&self, view: &View) -> [f64; 2] {
        if view.perspective && self.ends.iter().any(|end| end.z <= 0.0) {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let bounds = [0, 1].map(|i| {
            let (end, scale) = (self.ends[i], view.scale);
            let size = if view.perspective { end.length() } else { 1.0 };
            let reach = self.radii[i].max(self.pixels * size / scale);
            if !view.perspective {
                return [-1.0, 1.0].map(|side| view.center.y + (end.y + side * reach) * scale);
            }
            if end.z <= reach {
                return [f64::NEG_INFINITY, f64::INFINITY];
            }
            // A box around the ball.
            let places = [-1.0, 1.0].map(|side| {
                [-1.0, 1.0].map(|near| (end.y + side * reach) / (end.z + near * reach))
            });
            let all = places.as_flattened();
            [
                all.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
                all.iter().fold(-1e300, |a, b| a.max(*b)),
            ]
            .map(|place| view.center.y + place * scale)
        });
        [bounds[0][0].min(bounds[1][0]) - 1.0, bounds[0][1].max(bounds[1][1]) + 1.0]
    }

    /// Returns the share of the pixel that the rod fills, and where its ray meets the rod.
    pub fn at(&self, ray: &Ray, view: &View) -> Option<Place> {
        let [a, b] = self.ends;
        let along = b - a;
        let across = |v: DVec3| v - ray.direction * ray.direction.dot(v);
        let (from, side) = (across(a - ray.origin), across(along));
        let part = -from.dot(side) / side.length_squared();
        let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 };
        let aside = from + part * side;
        let away = aside.length();
        let before = ray.direction.dot(a + part * along - ray.origin);
        if view.perspective && before <= 0.0 {
            return None;
        }
        let pixel = if view.perspective { before * ray.direction.z } else { 1.0 } / view.scale;
        let radius =
            (self.radii[0] + part * (self.radii[1] - self.radii[0])).max(self.pixels * pixel);
        // The part of a strip of the rod's width, beside the middle of a pixel.
        let within = |edge: f64| (edge / pixel + 0.5).clamp(0.0, 1.0);
        let strip = (within(radius - away) + within(radius + away) - 1.0).max(0.0);
        let share = strip * ((FRAC_PI_2 * radius + side.length()) / pixel).min(1.0);
        let color = |part: f64| self.colors[0].lerp(self.colors[1], part);
        if !self.is_round {
            return Some(Place {
                share,
                distance: before,
                color: color(part),
                normal: self.normal,
            });
        }
        // On the outline of round ends at joints, the outline is that of the other rod.
        let slack = OVERLAP * pixel;
        let is_beyond = self.joints.1 && -(from + side).dot(side) > slack * side.length();
        let is_before = from.dot(side) > 0.0 && from.dot(self.joints.0) > slack;
        if share < 1.0 && (is_beyond || is_before) {
            return None;
        }
        // The middle of what the pixel sees of the rod across.
        let half = 0.5 * pixel;
        let middle = 0.5 * ((away + half).min(radius) + (away - half).max(-radius));
        let moved = if away > 0.0 { aside * (1.0 - middle / away) } else { DVec3::ZERO };
        let start = ray.origin + moved;
        let (distance, part) = enter(start, ray.direction, [a, b], radius)?;
        let normal = start + distance * ray.direction - (a + part * along);
        Some(Place { share, distance, color: color(part), normal })
    }
}

/// Returns the distance at which a ray enters a rod of one radius, and how far along the rod that
/// place lies, from 0 to 1. The first of three surfaces counts: the side and the balls around both
/// ends.
fn enter(start: DVec3, way: DVec3, [a, b]: [DVec3; 2], radius: f64) -> Option<(f64, f64)> {
    let along = b - a;
    let length2 = along.length_squared();
    let ball = |center: DVec3, part: f64| {
        let to = center - start;
        let depth = to.dot(way);
        let left = radius * radius - (to - depth * way).length_squared();
        // Rays along the outline touch it, whatever is rounded off.
        (left > -1e-9 * radius * radius).then(|| (depth - left.max(0.0).sqrt(), part))
    };
    let side = || {
        // The ray and the segment across the rod.
        let flat = |v: DVec3| v - along * (v.dot(along) / length2);
        let (to, step) = (flat(a - start), flat(way));
        let square = step.length_squared();
        if length2 == 0.0 || square < 1e-20 {
            return None;
        }
        let depth = to.dot(step) / square;
        let left = radius * radius - (to - depth * step).length_squared();
        let distance = depth - (left.max(0.0) / square).sqrt();
        let part = (start + distance * way - a).dot(along) / length2;
        (left > -1e-9 * radius * radius && (0.0..=1.0).contains(&part)).then_some((distance, part))
    };
    let all = [side(), ball(a, 0.0), ball(b, 1.0)];
    all.into_iter().flatten().min_by(|(a, _), (b, _)| a.total_cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};
    use glam::{DVec2, Vec3};

    fn view(projection: Projection) -> View {
        let camera = Camera {
            position: DVec3::new(0.0, 0.0, -5.0),
            focal_point: DVec3::ZERO,
            view_up: DVec3::Y,
            projection,
        };
        camera.view([32, 32]).unwrap()
    }

    /// Shares are those of many rays, for rods of many widths, also thinner than a pixel.
    #[test]
    fn shares_are_those_of_many_rays() {
        for projection in
            [Projection::Perspective { view_angle: 30.0 }, Projection::Orthographic { height: 3.0 }]
        {
            let view = view(projection);
            for (radius, to) in
                [(0.6, 0.0), (0.2, 0.0), (0.2, 0.5), (0.04, 0.5), (0.03, 0.0), (0.01, 0.7)]
            {
                let rod = Rod {
                    ends: [
                        Vec3::new(0.1, 0.05, 0.0),
                        Vec3::new(0.1 + to, 0.05 + 0.4 * to, 0.3 * to),
                    ],
                    radii: [radius; 2],
                    ..Rod::ball(Vec3::ZERO, radius, [0; 3])
                };
                let body = Body::new(&rod, DVec3::ZERO, &view);
                let (mut all, mut truth) = (0.0, 0.0);
                for (row, column) in
                    (0..32).flat_map(|row| (0..32).map(move |column| (row, column)))
                {
                    let pixel = DVec2::new(f64::from(column), f64::from(row)) + 0.5;
                    let filled =
                        body.at(&Ray::new(&view, pixel), &view).map_or(0.0, |place| place.share);
                    let rays = (0..256).map(|at| {
                        let at = DVec2::new(f64::from(at % 16), f64::from(at / 16));
                        Ray::new(&view, pixel - 0.5 + (at + 0.5) / 16.0)
                    });
                    let hits = rays.filter(|ray| {
                        enter(ray.origin, ray.direction, body.ends, f64::from(radius)).is_some()
                    });
                    let share = hits.count() as f64 / 256.0;
                    assert!((filled - share).abs() < 0.2, "{radius} {to}: {filled} {share}");
                    (all, truth) = (all + filled, truth + share);
                }
                // 256 rays meet a rod thinner than a quarter of a pixel too seldom to tell more.
                let most = if radius < 0.02 { 0.08 } else { 0.06 };
                assert!((all / truth - 1.0).abs() < most, "{radius} {to}: {all} {truth}");
            }
        }
    }
}

//! Facets: the part of a pixel that each fills, and what they add to its sheets. Rods are facets
//! whose part and place is found in `rods`.

use super::{
    Frame, clip,
    ray::Ray,
    rods::{Body, Place},
};
use crate::{
    facet::{FacetSet, Image, NEARER, Sides},
    math::View,
    scene::{Item, Scene, Settings},
};
use glam::{DVec2, DVec3, Vec2};

/// Within a sheet, facets further behind its front than this, over the length by which nearness is
/// measured, count as this far.
const FARTHEST: f64 = 60.0;

/// Rays along each side of a pixel that see an image.
const RAYS: usize = 16;

/// A facet in view space.
pub(super) enum Facet<'a> {
    Triangle(Triangle<'a>),
    Rod { body: Body, rows: [f64; 2] },
}

/// A triangle in view space.
pub(super) struct Triangle<'a> {
    /// The image that it shows, and the corners' places there.
    image: Option<(&'a Image, [Vec2; 3])>,
    corners: [DVec3; 3],
    normals: [DVec3; 3],
    colors: [DVec3; 3],
    is_front: bool,
    /// Whether the facet ends at the clips already.
    is_cut: bool,
    /// The area of the triangle of the directions to the corners, or its sign: negative if the
    /// front is seen.
    turn: f64,
    /// The first and the last row of pixels that it meets.
    rows: [f64; 2],
}

/// The facets of one sheet of one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cover {
    /// The shares that fronts and backs fill. Rods count as backs, and of several the largest.
    shares: [f64; 2],
    /// The shares of what is seen of their images.
    seen: f64,
    /// Lit colours times shares that are seen.
    color: DVec3,
    /// Weights; distances and lit colours times weights.
    weight: f64,
    distance: f64,
    nearest: DVec3,
}

impl Cover {
    /// Returns the share of the pixel that is filled, at most all of it, its opacity, and the mean
    /// distance and colour; `None` without facets.
    pub fn mean(&self) -> Option<([f64; 2], f64, DVec3)> {
        let [front, back] = self.shares;
        let all = (front + back).max(self.seen);
        let hidden = (all - 1.0).clamp(0.0, 1.0);
        let color = (self.color / self.seen).lerp(self.nearest / self.weight, hidden * hidden);
        let share = front.max(back).min(1.0);
        let filled = [share, (self.seen / share).min(1.0)];
        (self.weight > 0.0).then(|| (filled, self.distance / self.weight, color))
    }
}

/// Returns the facets of a scene that a view shows.
pub(super) fn gather<'a>(scene: &'a Scene, view: &View, settings: &Settings) -> Vec<Facet<'a>> {
    let mut facets = Vec::new();
    for (item_number, item) in scene.items.iter().enumerate() {
        let Item::Facets(set) = item else { continue };
        let view = &*scene.view_of(item_number, view);
        let is_culled = settings.culls(set.sides == Sides::Closed, &set.bounds(), view);
        for number in 0..set.facets.len() {
            if let Some(rod) = set.facets[number].rod() {
                let body = Body::new(&rod, set.origin, view);
                let rows = body.rows(view);
                facets.push(Facet::Rod { body, rows });
                continue;
            }
            let triangle = Triangle::new(number, set, view);
            let seen = triangle.filter(|triangle| triangle.turn < 0.0 || !is_culled);
            facets.extend(seen.map(Facet::Triangle));
        }
    }
    facets
}

impl Facet<'_> {
    /// Whether the facet may fill a part of a pixel of a row.
    pub fn meets_row(&self, row: i64) -> bool {
        let (Self::Triangle(Triangle { rows, .. }) | Self::Rod { rows, .. }) = self;
        rows[0] <= row as f64 + 1.0 && rows[1] >= row as f64
    }
}

impl<'a> Triangle<'a> {
    fn new(number: usize, set: &'a FacetSet, view: &View) -> Option<Self> {
        let facet = &set.facets[number];
        let corners = facet
            .corners
            .map(|corner| view.to_view(set.origin + DVec3::from(corner.map(f64::from))));
        let [a, b, c] = corners;
        let across = (b - a).cross(c - a);
        let turn = if view.perspective { across.dot(a) } else { across.z };
        let rows = polygon(view, corners)?.into_iter().map(|place| place.y);
        let rows = rows
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)]);
        Some(Self {
            image: set.image_of(number),
            corners,
            normals: facet.decoded_normals().map(|normal| view.rotation * normal.as_dvec3()),
            colors: facet.colors.map(|color| {
                let [red, green, blue, _] = color.to_le_bytes().map(|byte| f64::from(byte) / 255.0);
                DVec3::new(red, green, blue)
            }),
            is_front: turn < 0.0 || set.sides == Sides::Mixed,
            is_cut: set.whole.is_some(),
            turn: if turn < 0.0 { -1.0 } else { 1.0 },
            rows,
        })
    }

    /// Returns where the ray of a pixel meets the triangle's plane, and the share that the triangle
    /// fills.
    fn at(&self, ray: &Ray, [column, row]: [i64; 2], view: &View) -> Option<Place> {
        let share = share(&polygon(view, self.corners)?, column, row);
        let weights = self.weights(ray, view);
        let of = |parts: [DVec3; 3]| {
            parts.iter().zip(weights).map(|(part, weight)| *part * weight).sum::<DVec3>()
        };
        let distance = of(self.corners).z / ray.direction.z;
        let normal = if self.normals == [DVec3::ZERO; 3] { DVec3::ZERO } else { of(self.normals) };
        Some(Place { share, distance, color: of(self.colors), normal })
    }

    /// Returns the mean colour of the image over a facet's part of a pixel, and the share that is
    /// seen, from many rays. Without an image, it is white.
    fn tint(&self, ray: impl Fn(DVec2) -> Ray, view: &View) -> (DVec3, f64) {
        let Some((image, places)) = self.image else { return (DVec3::ONE, 1.0) };
        let sample = |weights: [f64; 3]| {
            let uv = (0..3).map(|i| places[i].as_dvec2() * weights[i]).sum::<DVec2>();
            let [r, g, b, a] = image.texture().sample(uv.as_vec2()).map(f64::from);
            (a * DVec3::new(r, g, b), a)
        };
        let (mut sum, mut seen, mut count) = (DVec3::ZERO, 0.0, 0.0);
        for number in 0..RAYS * RAYS {
            let at = DVec2::new((number % RAYS) as f64, (number / RAYS) as f64);
            let ray = ray((at + 0.5) / RAYS as f64 - 0.5);
            if self.edges(&ray, view).iter().all(|edge| *edge >= 0.0) {
                let (color, opacity) = sample(self.weights(&ray, view));
                (sum, seen, count) = (sum + color, seen + opacity, count + 1.0);
            }
        }
        if count == 0.0 {
            ((sum, seen), count) = (sample(self.weights(&ray(DVec2::ZERO), view)), 1.0);
        }
        (if seen > 0.0 { sum / seen } else { DVec3::ZERO }, seen / count)
    }

    /// Returns the weights of the corners where a ray meets the facet's plane. If that is outside
    /// the facet, weights below 0 count as 0.
    fn weights(&self, ray: &Ray, view: &View) -> [f64; 3] {
        let weights = self.edges(ray, view).map(|edge| edge.max(0.0));
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 { weights.map(|weight| weight / sum) } else { [1.0 / 3.0; 3] }
    }

    /// Returns on which side of each edge a ray passes: positive within the facet. The edges lie
    /// opposite to the corners, and the numbers are the corners' weights up to a common factor.
    fn edges(&self, ray: &Ray, view: &View) -> [f64; 3] {
        let place = |i: usize| {
            let corner = self.corners[i % 3];
            if view.perspective { corner } else { corner - ray.origin }
        };
        [0, 1, 2].map(|i| {
            let cross = place(i + 1).cross(place(i + 2));
            self.turn * if view.perspective { cross.dot(ray.direction) } else { cross.z }
        })
    }
}

/// Returns the outline of a triangle in the picture, in pixels; `None` if nothing of it lies in
/// front of the eye.
fn polygon(view: &View, corners: [DVec3; 3]) -> Option<Vec<DVec2>> {
    let project = |place: DVec3| {
        let z = if view.perspective { place.z } else { 1.0 };
        view.center + place.truncate() * (view.scale / z)
    };
    if !view.perspective {
        return Some(corners.map(project).to_vec());
    }
    let near = 1e-9 * corners.iter().map(|place| place.length()).fold(0.0, f64::max);
    let ahead = cut(&corners, |place| place.z - near, |a, b, part| a.lerp(b, part));
    (!ahead.is_empty()).then(|| ahead.into_iter().map(project).collect())
}

/// Cuts a convex polygon at a line: the part where `inside` is not negative (Sutherland & Hodgman
/// 1974).
fn cut<P: Copy>(
    polygon: &[P],
    inside: impl Fn(P) -> f64,
    between: impl Fn(P, P, f64) -> P,
) -> Vec<P> {
    let mut rest = Vec::new();
    for (at, &from) in polygon.iter().enumerate() {
        let to = polygon[(at + 1) % polygon.len()];
        let (a, b) = (inside(from), inside(to));
        if a >= 0.0 {
            rest.push(from);
        }
        if (a >= 0.0) != (b >= 0.0) {
            rest.push(between(from, to, a / (a - b)));
        }
    }
    rest
}

/// Returns the share of a pixel that a polygon fills.
fn share(polygon: &[DVec2], column: i64, row: i64) -> f64 {
    let [left, top] = [column as f64, row as f64];
    let lerp = |a: DVec2, b: DVec2, part: f64| a.lerp(b, part);
    let part = cut(polygon, |p| p.x - left, lerp);
    let part = cut(&part, |p| left + 1.0 - p.x, lerp);
    let part = cut(&part, |p| p.y - top, lerp);
    let part = cut(&part, |p| top + 1.0 - p.y, lerp);
    let corner = DVec2::new(left, top);
    let twice: f64 = (0..part.len())
        .map(|at| (part[at] - corner).perp_dot(part[(at + 1) % part.len()] - corner))
        .sum();
    twice.abs() / 2.0
}

impl Frame<'_> {
    /// Sums the facets over the sheets of a pixel.
    pub(super) fn covers(&self, [column, row]: [i64; 2], facets: &[&Facet]) -> Vec<Cover> {
        let mut covers = vec![Cover::default(); self.count()];
        if facets.is_empty() {
            return covers;
        }
        let view = &self.view;
        let ray = self.ray(column, row);
        let allowed = clip::allowed(&ray, view, &self.clips);
        for facet in facets {
            let place = match facet {
                Facet::Triangle(triangle) => triangle.at(&ray, [column, row], view),
                Facet::Rod { body, .. } => body.at(&ray, view),
            };
            let Some(Place { share, distance, color, normal }) = place else { continue };
            let sheet = self.planes.partition_point(|&plane| plane <= distance);
            let within = 1..self.planes.len();
            let is_cut = matches!(facet, Facet::Triangle(triangle) if triangle.is_cut);
            let is_kept = is_cut || clip::contains(&allowed, distance);
            if share <= 0.0 || !within.contains(&sheet) || !is_kept {
                continue;
            }
            let front = self.planes[sheet - 1];
            let pixel = if view.perspective { front } else { 1.0 } / view.scale;
            let behind = (NEARER * (distance - front) / pixel).clamp(0.0, FARTHEST);
            let pixel = DVec2::new(column as f64, row as f64) + 0.5;
            let (tint, seen) = match facet {
                Facet::Triangle(triangle) => triangle.tint(|at| Ray::new(view, pixel + at), view),
                Facet::Rod { .. } => (DVec3::ONE, 1.0),
            };
            let (color, seen) = (color * tint, share * seen);
            let weight = seen * (-behind).exp();
            let color = match &self.shade {
                // Facets without normals keep their colours.
                Some(shade) if normal != DVec3::ZERO => {
                    self.lit_surface(color, normal, (&ray, distance), shade)
                }
                _ => color,
            };
            let cover = &mut covers[sheet - 1];
            if seen <= 0.0 {
                continue;
            }
            match facet {
                Facet::Triangle(triangle) => cover.shares[usize::from(!triangle.is_front)] += share,
                Facet::Rod { .. } => cover.shares[1] = cover.shares[1].max(share),
            }
            cover.seen += seen;
            cover.weight += weight;
            cover.distance += weight * distance;
            cover.color += seen * color;
            cover.nearest += weight * color;
        }
        covers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_a_triangle_are_its_area() {
        let polygon = [DVec2::new(1.3, 0.2), DVec2::new(6.1, 2.4), DVec2::new(2.2, 5.7)];
        let area = (polygon[1] - polygon[0]).perp_dot(polygon[2] - polygon[0]) / 2.0;
        let pixels = (0..8).flat_map(|row| (0..8).map(move |column| (column, row)));
        let shares: Vec<f64> = pixels.map(|(column, row)| share(&polygon, column, row)).collect();
        assert!((shares.iter().sum::<f64>() - area).abs() < 1e-12);
        assert!(shares.iter().all(|share| (0.0..=1.0 + 1e-12).contains(share)));
        assert!((shares[2 * 8 + 3] - 1.0).abs() < 1e-12);
    }
}

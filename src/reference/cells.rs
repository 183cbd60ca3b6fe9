//! The field of tetrahedra along a ray, found by brute force.

use super::{
    Frame, clip,
    composite::{Added, Medium, Step},
    field::{ClippedLayer, Field, Layer},
    ray::Ray,
};
use crate::{
    cells::{Place, Tetrahedra},
    math::View,
};
use glam::{DMat3, DVec3, DVec4};

/// Tetrahedra in view space.
pub(super) struct Solids {
    solids: Vec<Solid>,
    place: Place,
}

/// A tetrahedron with a linear field.
struct Solid {
    /// The first corner, and the map from places around it to the coordinates of the other three.
    origin: DVec3,
    to_coordinates: DMat3,
    values: DVec4,
    gradients: [DVec3; 4],
}

/// The part of a ray in a tetrahedron: the distances of its ends, and the field there.
#[derive(Clone, Copy)]
struct Part {
    span: [f64; 2],
    values: [f64; 2],
    gradients: [DVec3; 2],
}

impl Solids {
    /// Returns the tetrahedra of which the field shows some value, or all of them.
    pub fn new(tetrahedra: &Tetrahedra, view: &View, field: &Field, all: bool) -> Self {
        let shows = |solid: &Solid| {
            let (low, high) = (solid.values.min_element(), solid.values.max_element());
            all || field.shows([low, high])
        };
        let solids = (0..tetrahedra.len()).map(|number| solid(tetrahedra, view, number));
        Self { solids: solids.filter(shows).collect(), place: tetrahedra.place() }
    }

    /// Returns where the values are.
    pub fn place(&self) -> Place {
        self.place
    }

    /// Returns the parts of a ray in all tetrahedra.
    fn parts(&self, ray: &Ray) -> Vec<Part> {
        self.solids.iter().filter_map(|solid| solid.part(ray)).collect()
    }
}

fn solid(tetrahedra: &Tetrahedra, view: &View, number: usize) -> Solid {
    let corners = tetrahedra.corners[number].map(|corner| corner as usize);
    let [a, b, c, d] = corners
        .map(|corner| view.to_view(tetrahedra.origin + tetrahedra.points[corner].as_dvec3()));
    let (values, gradients) = match tetrahedra.place {
        Place::Points => (
            corners.map(|corner| f64::from(tetrahedra.values[corner])),
            corners.map(|corner| view.rotation * tetrahedra.gradients[corner].as_dvec3()),
        ),
        Place::Cells => ([f64::from(tetrahedra.values[number]); 4], [DVec3::ZERO; 4]),
    };
    Solid {
        origin: a,
        to_coordinates: DMat3::from_cols(b - a, c - a, d - a).inverse(),
        values: values.into(),
        gradients,
    }
}

impl Solid {
    /// Returns the barycentric coordinates at a point, and along a direction.
    fn coordinates(&self, ray: &Ray) -> [DVec4; 2] {
        let at = self.to_coordinates * (ray.origin - self.origin);
        let along = self.to_coordinates * ray.direction;
        [
            DVec4::new(1.0 - at.element_sum(), at.x, at.y, at.z),
            DVec4::new(-along.element_sum(), along.x, along.y, along.z),
        ]
    }

    /// Returns the part of a ray where no coordinate is negative.
    fn part(&self, ray: &Ray) -> Option<Part> {
        let [at, along] = self.coordinates(ray);
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for corner in 0..4 {
            let end = -at[corner] / along[corner];
            if along[corner] > 0.0 {
                from = from.max(end);
            } else if along[corner] < 0.0 {
                to = to.min(end);
            } else if at[corner] < 0.0 {
                return None;
            }
        }
        let ends = [from, to].map(|s| at + s * along);
        let gradient = |end: DVec4| (0..4).map(|corner| end[corner] * self.gradients[corner]).sum();
        (from < to).then(|| Part {
            span: [from, to],
            values: ends.map(|end| end.dot(self.values)),
            gradients: ends.map(gradient),
        })
    }
}

impl Part {
    /// Returns what of the part lies between two distances.
    fn within(&self, [from, to]: [f64; 2]) -> Option<Self> {
        let span = [self.span[0].max(from), self.span[1].min(to)];
        let share = span.map(|s| (s - self.span[0]) / (self.span[1] - self.span[0]));
        let [first, last] = self.values;
        let [front, back] = self.gradients;
        (span[0] < span[1]).then(|| Self {
            span,
            values: share.map(|share| first + share * (last - first)),
            gradients: share.map(|share| front + share * (back - front)),
        })
    }

    fn length(&self) -> f64 {
        self.span[1] - self.span[0]
    }
}

/// Parts of a sheet that are shorter, as a share of its thickness, hold no field.
const LEAST_PART: f64 = 1e-4;

/// Returns the field of the parts in a sheet.
fn layer(parts: &[Part], thickness: f64) -> Option<Layer> {
    let first = parts.iter().min_by(|a, b| a.span[0].total_cmp(&b.span[0]))?;
    let last = parts.iter().max_by(|a, b| a.span[1].total_cmp(&b.span[1]))?;
    let covered: f64 = parts.iter().map(Part::length).sum();
    let integral: f64 =
        parts.iter().map(|part| part.length() * 0.5 * (part.values[0] + part.values[1])).sum();
    let span = [first.span[0], last.span[1]];
    (covered > LEAST_PART * thickness).then(|| Layer {
        span,
        mean: integral / covered,
        faces: [Some(first.values[0]), Some(last.values[1])],
        gradients: [Some(first.gradients[0]), Some(last.gradients[1])],
        middle: Some(0.5 * (first.gradients[0] + last.gradients[1])),
        filling: (covered / (span[1] - span[0])).min(1.0),
        clipped: None,
    })
}

impl Solids {
    /// Returns the parts of a ray in each sheet.
    fn parts_of_sheets(&self, frame: &Frame, ray: &Ray) -> Vec<Vec<Part>> {
        let parts = self.parts(ray);
        let of_sheet =
            |k: usize| parts.iter().filter_map(|part| part.within(frame.span(k))).collect();
        (0..frame.count()).map(of_sheet).collect()
    }

    /// Returns the field in each sheet of a ray of which the clips leave parts, with values at the
    /// points.
    pub fn layers(
        &self,
        frame: &Frame,
        ray: &Ray,
        allowed: &[[f64; 2]],
    ) -> Vec<Option<ClippedLayer>> {
        let clipped = |(k, parts): (usize, Vec<Part>)| {
            let [from, to] = frame.span(k);
            let layer = layer(&parts, to - from)?;
            Some((layer, clip::intersection(allowed, Some(layer.span))))
        };
        self.parts_of_sheets(frame, ray).into_iter().enumerate().map(clipped).collect()
    }

    /// Returns what tetrahedra that have one value each add to the sheets of a ray.
    pub fn media(
        &self,
        frame: &Frame,
        field: &Field,
        ray: &Ray,
        allowed: &[[f64; 2]],
    ) -> Vec<Option<Added>> {
        let added = |(k, parts): (usize, Vec<Part>)| {
            let mut medium = Medium::default();
            for part in parts {
                let (extinction, color) = field.classifier.at(part.values[0]);
                let factor = field.classifier.transfer.gradient_factor(0.0);
                let pieces = clip::intersection(allowed, Some(part.span));
                let length: f64 = pieces.iter().map(|[from, to]| to - from).sum();
                medium = medium.with(Medium { depth: extinction * factor * length, color });
            }
            Some((medium, vec![Step { depth: medium.depth, span: frame.span(k) }]))
        };
        self.parts_of_sheets(frame, ray).into_iter().enumerate().map(added).collect()
    }

    /// Returns the largest value on a ray of tetrahedra that have one value each.
    pub fn largest(&self, frame: &Frame, ray: &Ray, allowed: &[[f64; 2]]) -> Option<f64> {
        let parts = self.parts_of_sheets(frame, ray).into_iter().flatten();
        let is_seen = |part: &Part| !clip::intersection(allowed, Some(part.span)).is_empty();
        let seen = parts.filter(is_seen);
        seen.map(|part| part.values[0]).reduce(f64::max)
    }
}

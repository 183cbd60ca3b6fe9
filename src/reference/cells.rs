//! The field of tetrahedra along a ray, found by brute force.

use super::{
    Frame,
    composite::{Composite, Medium, Step},
    facets::Cover,
    field::{Field, Layer},
    ray::Ray,
    sheet::Sheet,
};
use crate::{
    cells::{Place, Tetrahedra},
    math::View,
    scene::{Item, Optics, Scene},
};
use glam::{DMat3, DVec3, DVec4};

/// The tetrahedra of a scene, in view space.
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
    /// Returns the tetrahedra of a scene of which the field shows some value.
    pub fn of(scene: &Scene, view: &View, field: Option<&Field>, all: bool) -> Option<Self> {
        let (tetrahedra, _) = scene.items.iter().find_map(|item| match item {
            Item::Cells(tetrahedra, transfer) => Some((tetrahedra, transfer)),
            _ => None,
        })?;
        let shows = |solid: &Solid| {
            let (low, high) = (solid.values.min_element(), solid.values.max_element());
            field.is_some_and(|field| all || field.shows([low, high]))
        };
        let solids = (0..tetrahedra.len()).map(|number| solid(tetrahedra, view, number));
        Some(Self { solids: solids.filter(shows).collect(), place: tetrahedra.place() })
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
    })
}

impl Frame<'_> {
    /// Colours and composites the sheets of a pixel in a scene with cells. `sheets` have the
    /// radiance, `covers` the facets; the clips leave the parts `allowed` of the ray.
    pub(super) fn pixel_of_cells(
        &self,
        solids: &Solids,
        field: &Field,
        ray: &Ray,
        (sheets, covers): (&[Sheet], &[Cover]),
        allowed: &[[f64; 2]],
    ) -> Composite {
        let parts = solids.parts(ray);
        let of_sheet = |k: usize| -> Vec<Part> {
            parts.iter().filter_map(|part| part.within(self.span(k))).collect()
        };
        let thickness = |k: usize| self.span(k)[1] - self.span(k)[0];
        let pieces = |span: [f64; 2]| super::clip::intersection(allowed, Some(span)).into_iter();
        if self.optics == Optics::Maximum {
            let largest = |k: usize| match solids.place {
                Place::Points => {
                    let layer = layer(&of_sheet(k), thickness(k))?;
                    layer.largest(field, &pieces(layer.span).collect::<Vec<_>>())
                }
                Place::Cells => {
                    let parts = of_sheet(k).into_iter();
                    let parts = parts.filter(|part| pieces(part.span).next().is_some());
                    parts.map(|part| part.values[0]).reduce(f64::max)
                }
            };
            return (0..self.count())
                .filter_map(largest)
                .reduce(f64::max)
                .map_or(Composite::EMPTY, |value| self.largest(field, value));
        }
        self.composite(sheets, covers, ray, |k| {
            let (mut medium, steps) = match solids.place {
                Place::Points => {
                    let layer = layer(&of_sheet(k), thickness(k))?;
                    let pieces: Vec<[f64; 2]> = pieces(layer.span).collect();
                    layer.shine(field, ray.direction, &pieces)
                }
                Place::Cells => {
                    let mut medium = Medium::default();
                    for part in of_sheet(k) {
                        let (extinction, color) = field.classifier.at(part.values[0]);
                        let factor = field.classifier.transfer.gradient_factor(0.0);
                        let length: f64 = pieces(part.span).map(|[from, to]| to - from).sum();
                        medium = medium.with(Medium { depth: extinction * factor * length, color });
                    }
                    (medium, vec![Step { depth: medium.depth, span: self.span(k) }])
                }
            };
            if self.optics == Optics::XRay {
                medium.color = DVec3::ONE;
            }
            Some((medium, steps))
        })
    }
}

//! The colour and optical depth of a field in one sheet of a ray.

use super::{
    classify::Classifier,
    composite::{Medium, Step},
    lamps::Lamps,
    ray::Ray,
    shade::{self, Lit, Reaching},
};
use crate::{
    scene::Lighting,
    volume::{Isosurface, Lattice, Shade},
};
use glam::DVec3;

/// The scalar field of a scene, classified after interpolation.
pub(super) struct Field<'a> {
    pub classifier: Classifier<'a>,
    /// The samples' lattice; `None` for scattered samples.
    pub lattice: Option<&'a Lattice>,
    pub shade: Option<Shade>,
    /// Isosurfaces.
    pub surfaces: &'a [Isosurface],
    /// Whether the values inside a sheet are classified, rather than their mean.
    pub inside: bool,
}

/// The field in one sheet of a ray. Places in the sheet run from 0 at the front to 1 at the back.
#[derive(Clone, Copy)]
pub(super) struct Layer {
    /// The distances of the sheet's faces.
    pub span: [f64; 2],
    pub mean: f64,
    /// The values at the faces.
    pub faces: [Option<f64>; 2],
    pub gradients: [Option<DVec3>; 2],
    /// The gradient in the middle, in fields that have one there.
    pub middle: Option<DVec3>,
    /// Factor on the extinction.
    pub filling: f64,
    /// The distance of the last clip before the end of the sheet, and the depth behind it from
    /// which gradients count in full. `None` without clips before.
    pub clipped: Option<[f64; 2]>,
}

/// The field in a sheet, and the parts of the ray where it counts.
pub(super) type ClippedLayer = (Layer, Vec<[f64; 2]>);

/// How a field is lit in a sheet: by light that is linear between what reaches the sheet's faces.
struct LitBy<'a> {
    shade: Option<&'a Shade>,
    lamps: Option<(Lighting, [Reaching; 2])>,
}

impl<'a> LitBy<'a> {
    fn new(layer: &Layer, field: &'a Field, (ray, lamps): (&Ray, Option<&Lamps>)) -> Self {
        let shade = field.shade.as_ref();
        let lamps = lamps.zip(shade).map(|(lamps, shade)| {
            let gradient = layer.towards_eye(ray.direction);
            let gradient = (gradient, layer.share());
            let at = |u| lamps.reaching(gradient, (ray, layer.distance(u)), shade);
            (lamps.lighting, [at(0.0), at(1.0)])
        });
        Self { shade, lamps }
    }

    /// Returns the light at a place.
    fn at(&self, u: f64) -> Lit {
        self.lamps.map(|(lighting, [front, back])| (lighting, front.mixed(&back, u)))
    }

    /// Returns a colour at a place with a gradient.
    fn one(&self, color: DVec3, gradient: (DVec3, f64), (u, direction): (f64, DVec3)) -> DVec3 {
        self.shade.map_or(color, |shade| {
            shade::with_light(color, shade::light(gradient, (direction, None), shade, &self.at(u)))
        })
    }
}

/// A part of a sheet: the places of its ends, and the values there.
struct Part {
    places: [f64; 2],
    values: [f64; 2],
}

/// Number of parts of a piece; values are taken as linear within a part.
const PARTS: u32 = 3;

/// Number of places in a part at which its light is taken.
const LIGHTS: u32 = 4;

/// Less light than this counts as this much, so that optical depths stay finite.
const LEAST_LIGHT: f64 = 1e-9;

impl Field<'_> {
    /// Whether gradients affect the picture.
    pub fn needs_gradients(&self) -> bool {
        self.shade.is_some() || !self.classifier.transfer.gradient.is_empty()
    }

    /// Whether any value between two values is visible.
    pub fn shows(&self, [low, high]: [f64; 2]) -> bool {
        let is_met = |surface: &Isosurface| low <= surface.value && surface.value <= high;
        self.classifier.between(low, high).0 > 0.0 || self.surfaces.iter().any(is_met)
    }

    /// Returns the surfaces that a part crosses, each with its share of the part, in the order of
    /// crossing.
    fn met(&self, [a, b]: [f64; 2]) -> Vec<(f64, &Isosurface)> {
        let crossed =
            self.surfaces.iter().filter(|surface| (a < surface.value) != (b < surface.value));
        let mut met: Vec<_> =
            crossed.map(|surface| ((surface.value - a) / (b - a), surface)).collect();
        // The sort is stable: equal values stay in the order of the list.
        met.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        met
    }
}

impl Layer {
    /// Returns the value at a place, from the parabola that has the faces' values and the mean.
    pub fn value(&self, u: f64) -> f64 {
        let [front, back] = self.faces.map(|face| face.unwrap_or(self.mean));
        let middle = 1.5 * self.mean - 0.25 * (front + back);
        front * (1.0 - u) * (1.0 - 2.0 * u)
            + 4.0 * middle * u * (1.0 - u)
            + back * u * (2.0 * u - 1.0)
    }

    /// Returns the gradient at a place: the parabola through those at the faces and in the middle,
    /// if there are all three. Otherwise interpolated between the faces' gradients across the ray,
    /// and the derivative of the values' parabola along it.
    fn gradient(&self, u: f64, direction: DVec3) -> DVec3 {
        if let ([Some(front), Some(back)], Some(middle)) = (self.gradients, self.middle) {
            return (1.0 - u) * (1.0 - 2.0 * u) * front
                + 4.0 * u * (1.0 - u) * middle
                + u * (2.0 * u - 1.0) * back;
        }
        let mixed = match self.gradients {
            [Some(front), Some(back)] => (1.0 - u) * front + u * back,
            [Some(only), None] | [None, Some(only)] => only,
            [None, None] => DVec3::ZERO,
        };
        let [front, back] = self.faces.map(|face| face.unwrap_or(self.mean));
        let middle = 1.5 * self.mean - 0.25 * (front + back);
        let slope = front * (4.0 * u - 3.0) + middle * (4.0 - 8.0 * u) + back * (4.0 * u - 1.0);
        let along = slope / (self.span[1] - self.span[0]);
        mixed + (along - mixed.dot(direction)) * direction
    }

    /// Returns the mean of the gradients at the front, in the middle and at the back, each turned
    /// towards the eye.
    fn towards_eye(&self, direction: DVec3) -> DVec3 {
        let turned = |place: f64| {
            let gradient = self.gradient(place, direction);
            if gradient.dot(direction) > 0.0 { -gradient } else { gradient }
        };
        (turned(0.0) + turned(0.5) + turned(1.0)) / 3.0
    }

    /// Returns the colour of a part between two places in its mean light: gradients change more
    /// within a part than values do.
    fn lit(&self, lit: &LitBy, color: DVec3, [start, end]: [f64; 2], direction: DVec3) -> DVec3 {
        let Some(shade) = lit.shade else { return color };
        let mut sums = [0.0; 2];
        for number in 0..LIGHTS {
            let share = (f64::from(number) + 0.5) / f64::from(LIGHTS);
            let at = start + share * (end - start);
            let gradient = (self.gradient(at, direction), self.share());
            let light = shade::light(gradient, (direction, None), shade, &lit.at(at));
            (0..2).for_each(|i| sums[i] += light[i] / f64::from(LIGHTS));
        }
        shade::with_light(color, sums)
    }

    /// Returns how far the gradient counts: by the depth of the sheet's middle behind a clip.
    fn share(&self) -> f64 {
        let middle = self.distance(0.5);
        let behind = |[clip, depth]: [f64; 2]| ((middle - clip) / depth).clamp(0.0, 1.0);
        self.clipped.map_or(1.0, behind)
    }

    fn distance(&self, u: f64) -> f64 {
        self.span[0] + u * (self.span[1] - self.span[0])
    }

    /// Divides pieces of the ray into parts.
    fn parts(&self, field: &Field, pieces: &[[f64; 2]]) -> Vec<Part> {
        let count = if field.inside || !field.surfaces.is_empty() { PARTS } else { 1 };
        let [front, back] = self.span;
        let parts = pieces.iter().flat_map(|&[from, to]| {
            let place = move |i: u32| {
                let share = f64::from(i) / f64::from(count);
                ((1.0 - share) * from + share * to - front) / (back - front)
            };
            (0..count).map(move |i| {
                let places = [place(i), place(i + 1)];
                Part { places, values: places.map(|u| self.value(u)) }
            })
        });
        parts.collect()
    }

    /// Returns the largest value at the ends of all parts, or the mean if only the mean is
    /// classified.
    pub fn largest(&self, field: &Field, pieces: &[[f64; 2]]) -> Option<f64> {
        if !field.inside {
            return (!pieces.is_empty()).then_some(self.mean);
        }
        self.parts(field, pieces).iter().flat_map(|part| part.values).reduce(f64::max)
    }

    /// Returns the medium of all pieces of the ray together, and the steps of optical depth one
    /// after another.
    pub fn shine(
        &self,
        field: &Field,
        (ray, lamps): (&Ray, Option<&Lamps>),
        pieces: &[[f64; 2]],
    ) -> (Medium, Vec<Step>) {
        let direction = ray.direction;
        let lit_by = LitBy::new(self, field, (ray, lamps));
        let mut steps = Vec::new();
        let mut light = 1.0;
        // Lit colours, weighted by opacity.
        let mut color = DVec3::ZERO;
        for Part { places: [start, end], values: [a, b] } in self.parts(field, pieces) {
            let gradient = self.gradient(0.5 * (start + end), direction);
            let (extinction, medium) = if field.inside {
                field.classifier.between(a, b)
            } else {
                field.classifier.at(self.mean)
            };
            let factor = field.classifier.transfer.gradient_factor(gradient.length());
            let medium = self.lit(&lit_by, medium, [start, end], direction);
            let length = self.distance(end) - self.distance(start);
            let depth = extinction * factor * length * self.filling;
            let at = |share: f64| start + share * (end - start);
            let mut before = 0.0;
            let surfaces_met =
                field.met([a, b]).into_iter().map(|(share, surface)| (share, Some(surface)));
            for (share, surface) in surfaces_met.chain([(1.0, None)]) {
                let depth = depth * (share - before);
                let alpha = -(-depth).exp_m1();
                color += light * alpha * medium;
                light *= 1.0 - alpha;
                steps.push(Step {
                    depth,
                    span: [before, share].map(|share| self.distance(at(share))),
                });
                if let Some(surface) = surface {
                    let gradient = (self.gradient(at(share), direction), self.share());
                    let on = (at(share), direction);
                    let lit = lit_by.one(DVec3::from(surface.color), gradient, on);
                    color += light * surface.opacity * lit;
                    light *= 1.0 - surface.opacity;
                    let depth = -(1.0 - surface.opacity).ln();
                    steps.push(Step { depth, span: [self.distance(at(share)); 2] });
                }
                before = share;
            }
        }
        let taken = 1.0 - light;
        if taken <= 0.0 {
            return (Medium::default(), Vec::new());
        }
        (Medium { depth: -light.max(LEAST_LIGHT).ln(), color: color / taken }, steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::View, volume::TransferFunction};
    use glam::{DMat3, DVec2};

    fn layer(faces: [Option<f64>; 2], mean: f64) -> Layer {
        Layer {
            span: [3.0, 5.0],
            mean,
            faces,
            gradients: [None; 2],
            middle: None,
            filling: 1.0,
            clipped: None,
        }
    }

    #[test]
    fn the_parabola_has_its_faces_and_its_mean() {
        for (faces, mean) in [
            ([Some(1.0), Some(3.0)], 2.0),
            ([Some(-1.0), Some(0.5)], 4.0),
            ([None, Some(7.0)], 2.0),
        ] {
            let layer = layer(faces, mean);
            let steps = 1000;
            let sum: f64 =
                (0..steps).map(|i| layer.value((f64::from(i) + 0.5) / f64::from(steps))).sum();
            assert!((sum / f64::from(steps) - mean).abs() < 1e-5);
            assert!((layer.value(0.0) - faces[0].unwrap_or(mean)).abs() < 1e-12);
            assert!((layer.value(1.0) - faces[1].unwrap_or(mean)).abs() < 1e-12);
        }
        assert!(
            (layer([Some(1.0), Some(3.0)], 2.0).value(0.25) - 1.5).abs() < 1e-12,
            "a line stays a line"
        );
    }

    #[test]
    fn surfaces_and_medium_by_hand() {
        // The extinction is 1 everywhere. A value from 0 to 8 crosses two surfaces, listed in the
        // opposite order.
        let surface =
            |value: f64, color: [f64; 3], opacity: f64| Isosurface { value, color, opacity };
        let transfer = TransferFunction {
            color: vec![(0.0, [0.0, 0.0, 1.0])],
            opacity: vec![(0.0, 1.0 - (-1.0_f64).exp())],
            isosurfaces: vec![
                surface(6.0, [0.0, 1.0, 0.0], 1.0),
                surface(2.0, [1.0, 0.0, 0.0], 0.5),
            ],
            ..TransferFunction::default()
        };
        let field = |inside: bool| Field {
            classifier: Classifier::new(&transfer),
            lattice: None,
            shade: None,
            surfaces: &transfer.isosurfaces,
            inside,
        };
        let layer = layer([Some(0.0), Some(8.0)], 4.0);
        let view = View {
            position: DVec3::ZERO,
            rotation: DMat3::IDENTITY,
            perspective: false,
            scale: 1.0,
            center: DVec2::ZERO,
            size: [1; 2],
        };
        let ray = Ray::new(&view, DVec2::ZERO);
        for inside in [true, false] {
            let (medium, steps) = layer.shine(&field(inside), (&ray, None), &[[3.0, 5.0]]);
            assert!((medium.depth + 1e-9_f64.ln()).abs() < 1e-12);
            let through = (-0.5_f64).exp();
            let red = through * 0.5;
            let green = red * (-1.0_f64).exp();
            let blue = 1.0 - through + red * (1.0 - (-1.0_f64).exp());
            assert!(
                (medium.color - DVec3::new(red, green, blue)).length() < 1e-12,
                "{}",
                medium.color
            );
            let places: Vec<f64> = steps
                .iter()
                .filter(|s| s.span[0] == s.span[1] && s.depth > 0.0)
                .map(|s| s.span[0])
                .collect();
            assert_eq!(places, [3.5, 4.5]);
            // Backwards, and cut to the second half.
            let (back, _) = Layer { faces: [Some(8.0), Some(0.0)], ..layer }.shine(
                &field(inside),
                (&ray, None),
                &[[4.0, 5.0]],
            );
            assert!((back.depth - 1.0 - 2.0_f64.ln()).abs() < 1e-12);
        }
    }

    #[test]
    fn surfaces_are_met_in_order() {
        let surface =
            |value: f64, red: f64| Isosurface { value, color: [red, 0.0, 0.0], opacity: 1.0 };
        let surfaces = [surface(3.0, 0.1), surface(2.0, 0.2), surface(2.0, 0.3), surface(5.0, 0.4)];
        let transfer = TransferFunction::default();
        let classifier = Classifier::new(&transfer);
        let field =
            Field { classifier, lattice: None, shade: None, surfaces: &surfaces, inside: true };
        let met = |ends: [f64; 2]| -> Vec<(f64, f64)> {
            field.met(ends).into_iter().map(|(share, surface)| (share, surface.color[0])).collect()
        };
        assert_eq!(met([1.0, 5.0]), [(0.25, 0.2), (0.25, 0.3), (0.5, 0.1), (1.0, 0.4)]);
        assert_eq!(met([5.0, 1.0]), [(0.0, 0.4), (0.5, 0.1), (0.75, 0.2), (0.75, 0.3)]);
        // If the value of an end equals a surface's value, only one of the two parts that share the
        // end crosses the surface.
        assert_eq!(met([2.0, 2.5]), []);
    }
}

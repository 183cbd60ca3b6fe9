//! Image-aligned sheets: the pixels of [`Mode::Sheets`](crate::scene::Mode::Sheets).

use super::{
    Frame, LEAST_DEPTH, clip,
    composite::{Composite, Medium, Step},
    face::Face,
    facets::{Cover, Facet},
    field::{Field, Layer},
    kernel::{Kernel, Load},
    ray::Ray,
    sheet::Sheet,
};
use crate::scene::{Gradient, Optics};
use glam::DVec3;

/// The values at a pixel's faces in the pixels to the left, right, above and below.
type Around = [Vec<Option<f64>>; 4];

impl Frame<'_> {
    /// Draws a row.
    pub(super) fn row_of_sheets(&self, row: i64) -> Vec<Composite> {
        let kernels = self.kernels_of_row(row);
        let facets: Vec<&Facet> = self.facets.iter().filter(|facet| facet.meets_row(row)).collect();
        let central = self.gradient == Gradient::Central
            && self.field.as_ref().is_some_and(Field::needs_gradients);
        let beside = central.then(|| [row - 1, row + 1].map(|row| self.kernels_of_row(row)));
        let pixel = |column: i64| {
            let ray = self.ray(column, row);
            let around = beside.as_ref().map(|[above, below]| {
                let neighbours = [
                    (column - 1, row, &kernels),
                    (column + 1, row, &kernels),
                    (column, row - 1, above),
                    (column, row + 1, below),
                ];
                neighbours.map(|(column, row, kernels)| {
                    self.faces(&self.ray(column, row), kernels, &self.planes)
                        .iter()
                        .map(|face| face.value(self.least_sum))
                        .collect()
                })
            });
            let covers = self.covers([column, row], &facets);
            self.pixel_of_sheets(&ray, &kernels, around, &covers)
        };
        (0..i64::from(self.view.size[0])).map(pixel).collect()
    }

    /// Sums the kernels over the sheets of a ray.
    fn sheets(&self, ray: &Ray, kernels: &[&Kernel], allowed: &[[f64; 2]]) -> Vec<Sheet> {
        let mut sheets = vec![Sheet::default(); self.count()];
        for kernel in kernels {
            let Some(crossing) = kernel.cross(ray) else { continue };
            let [from, to] = crossing.span();
            let first = self.planes[1..].partition_point(|&plane| plane < from);
            let past = self.planes.partition_point(|&plane| plane < to).min(self.count());
            for (k, sheet) in sheets.iter_mut().enumerate().take(past).skip(first) {
                let part = self.span(k);
                match &kernel.load {
                    Load::Radiance(radiance) if clip::contains(allowed, crossing.closest) => {
                        sheet.light.add(radiance, crossing.optical_depth(radiance.amount, part));
                    }
                    Load::Radiance(_) => {}
                    Load::Sample(sample) => {
                        sheet.mean.add(sample, kernel.center, &crossing, ray, part);
                    }
                }
            }
        }
        sheets
    }

    /// Sums the samples at distances along a ray, in ascending order: the faces of its sheets, or
    /// their middles.
    pub(super) fn faces(&self, ray: &Ray, kernels: &[&Kernel], planes: &[f64]) -> Vec<Face> {
        let mut faces = vec![Face::default(); planes.len()];
        if self.field.is_none() {
            return faces;
        }
        if let Some(product) = &self.product {
            return planes.iter().map(|&plane| product.face(ray, plane)).collect();
        }
        for kernel in kernels {
            let Load::Sample(sample) = &kernel.load else { continue };
            let Some(crossing) = kernel.cross(ray) else { continue };
            let [from, to] = crossing.span();
            let first = planes.partition_point(|&plane| plane < from);
            let past = planes.partition_point(|&plane| plane <= to);
            for (face, &plane) in faces.iter_mut().zip(planes).take(past).skip(first) {
                face.add(sample, kernel.center, &crossing, ray, plane);
            }
        }
        faces
    }

    /// Sums the samples in the middles of a ray's sheets, if their gradients count there.
    fn middles(&self, ray: &Ray, kernels: &[&Kernel]) -> Vec<Face> {
        if !self.has_middles || !self.field.as_ref().is_some_and(Field::needs_gradients) {
            return Vec::new();
        }
        let places: Vec<f64> = (0..self.count())
            .map(|sheet| {
                let [from, to] = self.span(sheet);
                0.5 * (from + to)
            })
            .collect();
        self.faces(ray, kernels, &places)
    }

    /// Colours a pixel's sheets and composites them.
    pub(super) fn pixel_of_sheets(
        &self,
        ray: &Ray,
        kernels: &[&Kernel],
        around: Option<Around>,
        covers: &[Cover],
    ) -> Composite {
        let allowed = clip::allowed(ray, &self.view, &self.clips);
        let sheets = self.sheets(ray, kernels, &allowed);
        let Some(field) = &self.field else {
            return self.composite(&sheets, covers, ray, |_| None);
        };
        if let Some(solids) = &self.solids {
            return self.pixel_of_cells(solids, field, ray, (&sheets, covers), &allowed);
        }
        let faces = self.faces(ray, kernels, &self.planes);
        let middles = self.middles(ray, kernels);
        let gradients = self.gradients(ray, &faces, around);
        let held = match field.lattice {
            Some(lattice) => {
                clip::intersection(&allowed, clip::sample_box(ray, &self.view, lattice))
            }
            None => allowed,
        };
        let layer = |k: usize| {
            let [from, to] = self.span(k);
            let pieces = clip::intersection(&held, Some([from, to]));
            let mean = match &self.product {
                Some(_) if pieces.is_empty() => return None,
                Some(product) => product.mean(ray, [from, to]),
                None => sheets[k].mean,
            };
            let filling =
                if field.lattice.is_some() { 1.0 } else { (mean.weight / (to - from)).min(1.0) };
            let layer = Layer {
                span: [from, to],
                mean: mean.value(self.least_sum, to - from)?,
                faces: [&faces[k], &faces[k + 1]].map(|face| face.value(self.least_sum)),
                gradients: [gradients[k], gradients[k + 1]],
                middle: middles.get(k).and_then(|face| face.gradient(self.least_sum)),
                filling,
            };
            Some((layer, pieces))
        };
        if self.optics == Optics::Maximum {
            let values = (0..self.count())
                .filter_map(|k| layer(k).and_then(|(layer, pieces)| layer.largest(field, &pieces)));
            return values
                .reduce(f64::max)
                .map_or(Composite::EMPTY, |value| self.largest(field, value));
        }
        self.composite(&sheets, covers, ray, |k| {
            let (layer, pieces) = layer(k)?;
            let (mut medium, steps) = layer.shine(field, ray.direction, &pieces);
            if self.optics == Optics::XRay {
                medium.color = DVec3::ONE;
            }
            Some((medium, steps))
        })
    }

    /// Returns the gradients at the faces of a ray's sheets.
    fn gradients(&self, ray: &Ray, faces: &[Face], around: Option<Around>) -> Vec<Option<DVec3>> {
        let Some(around) = around else {
            return faces.iter().map(|face| face.gradient(self.least_sum)).collect();
        };
        let places = faces.iter().zip(&self.planes).enumerate();
        places
            .map(|(i, (face, &plane))| {
                let beside = around.each_ref().map(|values| values[i]);
                face.central_gradient(self.least_sum, ray, plane, beside)
            })
            .collect()
    }

    /// Composites the sheets of a ray, front to back: the radiance in each, and the medium of the
    /// field with its steps of optical depth.
    pub(super) fn composite(
        &self,
        sheets: &[Sheet],
        covers: &[Cover],
        ray: &Ray,
        medium: impl Fn(usize) -> Option<(Medium, Vec<Step>)>,
    ) -> Composite {
        let mut composite = Composite::EMPTY;
        for (k, sheet) in sheets.iter().enumerate() {
            let surface = self.surface(sheet, ray);
            match medium(k) {
                Some((medium, _)) if surface.depth > 0.0 => {
                    composite.pass(surface.with(medium), self.span(k));
                }
                Some((medium, steps)) => composite.pass_in_steps(medium, &steps),
                None => composite.pass(surface, self.span(k)),
            }
            if let Some((share, distance, color)) = covers.get(k).and_then(Cover::mean) {
                composite.cover(share, distance, color);
            }
        }
        composite
    }

    /// Returns the colour of the largest value on a ray.
    pub(super) fn largest(&self, field: &Field, value: f64) -> Composite {
        let transfer = field.classifier.transfer;
        let opacity = transfer.opacity(value);
        Composite {
            color: opacity * DVec3::from(transfer.color(value)),
            opacity,
            ..Composite::EMPTY
        }
    }

    /// Returns the radiance of a sheet, lit once.
    pub(super) fn surface(&self, sheet: &Sheet, ray: &Ray) -> Medium {
        if sheet.light.depth < LEAST_DEPTH {
            Medium::default()
        } else {
            self.lit(&sheet.light, ray)
        }
    }
}

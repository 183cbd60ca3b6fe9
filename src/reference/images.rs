//! Image-aligned sheets: the pixels of [`Mode::Sheets`](crate::scene::Mode::Sheets).

use super::{
    Frame, LEAST_DEPTH, clip,
    composite::{Added, Composite, Medium},
    facets::{Cover, Facet},
    field::Field,
    fields::{Around, Drawn, Through},
    kernel::{Kernel, Load},
    ray::Ray,
    sheet::Light,
};
use crate::scene::{Gradient, Optics};
use glam::DVec3;
use std::ops::Range;

/// What the rays of a row may meet.
pub(super) struct Row<'f> {
    number: i64,
    kernels: Vec<&'f Kernel<'f>>,
    facets: Vec<&'f Facet<'f>>,
    fields: Vec<FieldRow<'f>>,
}

/// The samples of a field that the rays of a row may meet.
struct FieldRow<'f> {
    kernels: Vec<&'f Kernel<'f>>,
    /// Those of the rows above and below, if gradients are differences of pixels.
    beside: Option<[Vec<&'f Kernel<'f>>; 2]>,
}

impl Frame<'_> {
    /// Draws a row.
    pub(super) fn row_of_sheets(&self, number: i64) -> Vec<Composite> {
        let row = self.met_by_row(number);
        (0..i64::from(self.view.size[0])).map(|column| self.pixel_of_sheets(column, &row)).collect()
    }

    /// Returns what the rays of a row may meet.
    pub(super) fn met_by_row(&self, number: i64) -> Row<'_> {
        Row {
            number,
            kernels: self.kernels_of_row(&self.kernels, number),
            facets: self.facets.iter().filter(|facet| facet.meets_row(number)).collect(),
            fields: self.fields.iter().map(|drawn| self.field_row(drawn, number)).collect(),
        }
    }

    fn field_row<'f>(&self, drawn: &'f Drawn<'f>, number: i64) -> FieldRow<'f> {
        let central = self.gradient == Gradient::Central && drawn.field.needs_gradients();
        let in_row = |number: i64| self.kernels_of_row(&drawn.kernels, number);
        FieldRow {
            kernels: in_row(number),
            beside: central.then(|| [number - 1, number + 1].map(in_row)),
        }
    }

    /// Returns the sheets between two distances, all that they touch.
    pub(super) fn sheets_between(&self, [from, to]: [f64; 2]) -> Range<usize> {
        let first = self.planes[1..].partition_point(|&plane| plane < from);
        let past = self.planes.partition_point(|&plane| plane < to).min(self.count());
        first..past.max(first)
    }

    /// Sums the radiance over the sheets of a ray.
    fn lights(&self, ray: &Ray, kernels: &[&Kernel], allowed: &[[f64; 2]]) -> Vec<Light> {
        let mut lights = vec![Light::default(); self.count()];
        for kernel in kernels {
            let Load::Radiance(radiance) = &kernel.load else { continue };
            let Some(crossing) = kernel.cross(ray) else { continue };
            if !clip::contains(allowed, crossing.closest) {
                continue;
            }
            for k in self.sheets_between(crossing.span()) {
                let depth = crossing.optical_depth(radiance.amount, self.span(k));
                lights[k].add(radiance, depth);
            }
        }
        lights
    }

    /// Returns the values beside a pixel's faces, if gradients are their differences.
    fn around(
        &self,
        drawn: &Drawn,
        field_row: &FieldRow,
        [column, row]: [i64; 2],
    ) -> Option<Around> {
        let [above, below] = field_row.beside.as_ref()?;
        let neighbours = [
            (column - 1, row, &field_row.kernels),
            (column + 1, row, &field_row.kernels),
            (column, row - 1, above),
            (column, row + 1, below),
        ];
        Some(neighbours.map(|(column, row, kernels)| {
            drawn
                .faces(&self.ray(column, row), kernels, &self.planes)
                .iter()
                .map(|face| face.value(drawn.least_sum))
                .collect()
        }))
    }

    /// Colours a pixel's sheets and composites them.
    pub(super) fn pixel_of_sheets(&self, column: i64, row: &Row) -> Composite {
        let ray = self.ray(column, row.number);
        let allowed = clip::allowed(&ray, &self.view, &self.clips);
        let both = self.fields.iter().zip(&row.fields);
        let rays: Vec<Through> = both
            .map(|(drawn, field_row)| {
                let around = self.around(drawn, field_row, [column, row.number]);
                Through { ray: &ray, kernels: &field_row.kernels, around, allowed: &allowed }
            })
            .collect();
        let mut fields = self.fields.iter().zip(&rays);
        if self.optics == Optics::Maximum {
            // There is one field at most.
            let largest = fields
                .next()
                .and_then(|(drawn, on)| Some(self.largest(&drawn.field, drawn.largest(self, on)?)));
            return largest.unwrap_or(Composite::EMPTY);
        }
        let media: Vec<_> = fields.map(|(drawn, on)| drawn.media(self, on)).collect();
        let lights = self.lights(&ray, &row.kernels, &allowed);
        let covers = self.covers([column, row.number], &row.facets);
        self.composite(&ray, &lights, &media, &covers)
    }

    /// Composites the sheets of a ray, front to back: in each the radiance and the media of the
    /// fields, then the facets.
    fn composite(
        &self,
        ray: &Ray,
        lights: &[Light],
        media: &[Vec<Option<Added>>],
        covers: &[Cover],
    ) -> Composite {
        let mut composite = Composite::EMPTY;
        for (k, light) in lights.iter().enumerate() {
            let surface = self.surface(light, ray);
            let present = media.iter().filter_map(|sheets| sheets[k].as_ref());
            let present: Vec<&Added> = present.filter(|(medium, _)| medium.depth > 0.0).collect();
            match present[..] {
                [(medium, steps)] if surface.depth <= 0.0 => {
                    composite.pass_in_steps(*medium, steps);
                }
                _ => {
                    let all = present.iter().fold(surface, |all, (medium, _)| all.with(*medium));
                    composite.pass(all, self.span(k));
                }
            }
            if let Some((filled, distance, color)) = covers.get(k).and_then(Cover::mean) {
                composite.cover(filled, distance, color);
            }
        }
        composite
    }

    /// Returns the colour of the largest value on a ray.
    fn largest(&self, field: &Field, value: f64) -> Composite {
        let transfer = field.classifier.transfer;
        let opacity = transfer.opacity(value);
        Composite {
            color: opacity * DVec3::from(transfer.color(value)),
            opacity,
            ..Composite::EMPTY
        }
    }

    /// Returns the radiance of a sheet, lit once.
    pub(super) fn surface(&self, light: &Light, ray: &Ray) -> Medium {
        if light.depth < LEAST_DEPTH { Medium::default() } else { self.lit(light, ray) }
    }
}

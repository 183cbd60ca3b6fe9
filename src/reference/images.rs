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

/// What a pixel's ray meets in a sheet.
pub(super) struct PixelSheet {
    surface: Medium,
    /// The media of fields, before the facets and behind them.
    media: Vec<[Option<Added>; 2]>,
    cover: Cover,
}

impl PixelSheet {
    /// Composites the sheet, which lies between two distances: the radiance and the media of the
    /// fields, and the facets where they lie.
    pub fn add(&self, composite: &mut Composite, [from, to]: [f64; 2]) {
        let Some((filled, distance, color)) = self.cover.mean() else {
            return self.pass(composite, 0, [from, to], 1.0);
        };
        let place = distance.clamp(from, to);
        let share = (place - from) / (to - from);
        self.pass(composite, 0, [from, place], share);
        composite.cover(filled, distance, color);
        self.pass(composite, 1, [place, to], 1.0 - share);
    }

    /// Composites what lies in a part of the sheet, with its share of the radiance.
    fn pass(&self, composite: &mut Composite, part: usize, span: [f64; 2], share: f64) {
        let present = self.media.iter().filter_map(|parts| parts[part].as_ref());
        let present: Vec<&Added> = present.filter(|(medium, _)| medium.depth > 0.0).collect();
        let surface = Medium { depth: self.surface.depth * share, ..self.surface };
        match present[..] {
            [(medium, steps)] if surface.depth <= 0.0 => composite.pass_in_steps(*medium, steps),
            _ => {
                let all = present.iter().fold(surface, |all, (medium, _)| all.with(*medium));
                composite.pass(all, span);
            }
        }
    }
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
        if self.optics == Optics::Maximum {
            return self.largest_of_pixel(column, row);
        }
        let mut composite = Composite::EMPTY;
        for (k, sheet) in self.sheets_of_pixel(column, row).iter().enumerate() {
            sheet.add(&mut composite, self.span(k));
        }
        composite
    }

    /// Returns what a pixel's ray meets of the fields.
    fn with_fields<T>(
        &self,
        column: i64,
        row: &Row,
        value: impl FnOnce(&Ray, &[[f64; 2]], &[(&Drawn, Through)]) -> T,
    ) -> T {
        let ray = self.ray(column, row.number);
        let allowed = clip::allowed(&ray, &self.view, &self.clips);
        let both = self.fields.iter().zip(&row.fields);
        let fields: Vec<(&Drawn, Through)> = both
            .map(|(drawn, field_row)| {
                let around = self.around(drawn, field_row, [column, row.number]);
                let kernels = &field_row.kernels;
                (drawn, Through { ray: &ray, kernels, around, allowed: &allowed })
            })
            .collect();
        value(&ray, &allowed, &fields)
    }

    /// Returns the sheets of a pixel: in each the radiance and the media of the fields, and the
    /// facets.
    pub(super) fn sheets_of_pixel(&self, column: i64, row: &Row) -> Vec<PixelSheet> {
        self.with_fields(column, row, |ray, allowed, fields| {
            let covers = self.covers([column, row.number], &row.facets);
            let place = |cover: &Cover| cover.mean().map(|(_, distance, _)| distance);
            let mut places: Vec<Option<f64>> = covers.iter().map(place).collect();
            places.resize(self.count(), None);
            let of_field = |(drawn, on): &(&Drawn, Through)| drawn.media(self, on, &places);
            let mut media: Vec<_> = fields.iter().map(of_field).map(Vec::into_iter).collect();
            let lights = self.lights(ray, &row.kernels, allowed);
            let mut covers = covers.into_iter();
            let sheet = |(k, light): (usize, &Light)| PixelSheet {
                surface: self.surface(light, (ray, 0.5 * (self.planes[k] + self.planes[k + 1]))),
                media: media.iter_mut().filter_map(Iterator::next).collect(),
                cover: covers.next().unwrap_or_default(),
            };
            lights.iter().enumerate().map(sheet).collect()
        })
    }

    /// Returns the colour of the largest value on a pixel's ray. There is one field at most.
    fn largest_of_pixel(&self, column: i64, row: &Row) -> Composite {
        self.with_fields(column, row, |_, _, fields| {
            let largest = fields
                .first()
                .and_then(|(drawn, on)| Some(self.largest(&drawn.field, drawn.largest(self, on)?)));
            largest.unwrap_or(Composite::EMPTY)
        })
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

    /// Returns the radiance of a sheet, lit once, at a distance along a ray.
    pub(super) fn surface(&self, light: &Light, at: (&Ray, f64)) -> Medium {
        if light.depth < LEAST_DEPTH { Medium::default() } else { self.lit(light, at) }
    }
}

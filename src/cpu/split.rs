//! A sheet with facets: what lies before them counts in front of them, and the rest behind.

use super::{
    close::Media,
    sums::Cover,
    vector::{Lanes, four},
};
use fearless_simd::{Simd, prelude::*};

/// Where the facets of a sheet divide it at eight pixels.
pub struct Split<S: Simd> {
    /// The distances of the sheet's front, of its facets, and of its back.
    places: [Lanes<S>; 3],
    /// The parts of the sheet: one without facets, two with them.
    pub parts: usize,
}

impl<S: Simd> Split<S> {
    #[inline(always)]
    pub fn new(simd: S, planes: [f32; 2], facets: Option<&Cover<S>>) -> Self {
        let [start, stop] = planes.map(|plane| Lanes::splat(simd, plane));
        let place = facets.map_or(stop, |facets| facets.place(simd, planes));
        Self { places: [start, place, stop], parts: if facets.is_some() { 2 } else { 1 } }
    }

    /// Returns what lies in each part, before fields are added to it. Radiance is spread evenly
    /// over the sheet.
    #[inline(always)]
    pub fn media(&self, simd: S, radiance: Option<[Lanes<S>; 4]>) -> [Media<S>; 2] {
        let [start, place, stop] = self.places;
        let Some(all) = radiance.filter(|_| self.parts > 1) else {
            return [Media::new(simd, radiance), Media::new(simd, None)];
        };
        let share = (place - start) / (stop - start);
        let before = four!(I => all[I] * share);
        [Media::new(simd, Some(before)), Media::new(simd, Some(four!(I => all[I] - before[I])))]
    }

    /// Returns the distances between which a part lies.
    #[inline(always)]
    pub fn span(&self, part: usize) -> [Lanes<S>; 2] {
        let [start, place, stop] = self.places;
        if part == 0 { [start, place] } else { [place, stop] }
    }

    /// Returns the part of a ray between two distances that lies in a part.
    #[inline(always)]
    pub fn within(&self, part: usize, [begin, end]: [Lanes<S>; 2]) -> [Lanes<S>; 2] {
        let [from, to] = self.span(part);
        [begin.max(from), end.min(to)]
    }
}

//! Facets coloured by values that are linear in between: cut where the colours of a scale bend, so
//! that large facets show the colours of their values, not mixtures of their corners' colours.

use crate::{color::ColorScale, facet::Facet};
use glam::Vec3;

/// Facets whose values span less of the scale than this are not cut. In between, colours bend too
/// little to be seen.
const LEAST_SPAN: f64 = 1.0 / 16.0;

/// Most facets that the levels may lead to; of more, every second, third, … level is used.
const MOST: usize = 1 << 23;

/// A scale of colours, and the values at which its colours bend.
#[derive(Debug, Clone)]
pub(crate) struct Bands {
    scale: ColorScale,
    /// Ascending values.
    levels: Vec<f32>,
    /// The span of shares of the scale from which on facets are cut.
    span: f64,
}

/// A corner of a polygon.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Corner {
    /// Relative to the origin of the facets.
    pub place: Vec3,
    pub normal: Vec3,
    pub value: f32,
}

impl Bands {
    /// Returns the bands of a scale for about this number of facets.
    pub fn new(scale: ColorScale, count: usize) -> Self {
        let mut shares: Vec<f64> = scale.map.points().into_iter().map(|point| point.0).collect();
        if scale.is_log {
            shares.extend((0..32).map(|step| f64::from(step) / 32.0));
            shares.sort_by(f64::total_cmp);
        }
        if scale.map.is_categorical() {
            shares.clear();
        }
        let every = shares.len().div_ceil((MOST / count.max(1)).max(1)).max(1);
        let levels: Vec<f32> =
            shares.into_iter().step_by(every).map(|share| scale.value(share) as f32).collect();
        let span = LEAST_SPAN.max(1.0 / levels.len().max(1) as f64);
        Self { scale, levels, span }
    }

    /// Returns the colour of a value.
    fn color(&self, value: f32) -> [u8; 3] {
        self.scale.color(value.into()).map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8)
    }

    /// Adds the facets of a flat convex polygon whose value is linear.
    pub fn add(&self, polygon: &[Corner], add: &mut impl FnMut(Facet)) {
        let values = || polygon.iter().map(|corner| corner.value);
        let [low, high] =
            [values().fold(f32::INFINITY, f32::min), values().fold(f32::NEG_INFINITY, f32::max)];
        let share = |value: f32| self.scale.share(value.into()).clamp(0.0, 1.0);
        // NaN is not wide.
        let is_wide = share(high) - share(low) > self.span;
        if !is_wide || values().any(f32::is_nan) {
            return self.fan(polygon, add);
        }
        let mut rest = polygon.to_vec();
        for level in self.levels.iter().filter(|level| low < **level && **level < high) {
            let (below, above) = split(&rest, *level);
            self.fan(&below, add);
            rest = above;
        }
        self.fan(&rest, add);
    }

    fn fan(&self, polygon: &[Corner], add: &mut impl FnMut(Facet)) {
        for step in 1..polygon.len().saturating_sub(1) {
            let corners = [polygon[0], polygon[step], polygon[step + 1]];
            let [a, b, c] = corners.map(|corner| corner.place.as_dvec3());
            if (b - a).cross(c - a).length_squared() > 0.0 {
                add(Facet::new(
                    corners.map(|corner| corner.place),
                    corners.map(|corner| corner.normal.normalize_or_zero()),
                    corners.map(|corner| self.color(corner.value)),
                ));
            }
        }
    }
}

/// Cuts a polygon into the parts below and above a value.
fn split(polygon: &[Corner], level: f32) -> (Vec<Corner>, Vec<Corner>) {
    let (mut below, mut above) = (Vec::new(), Vec::new());
    for (at, a) in polygon.iter().enumerate() {
        let b = &polygon[(at + 1) % polygon.len()];
        if a.value <= level {
            below.push(*a);
        }
        if a.value >= level {
            above.push(*a);
        }
        if (a.value < level && b.value > level) || (a.value > level && b.value < level) {
            // The same place for both polygons at an edge.
            let (low, high) = if a.value < b.value { (a, b) } else { (b, a) };
            let part = (level - low.value) / (high.value - low.value);
            let corner = Corner {
                place: low.place.lerp(high.place, part),
                normal: low.normal.lerp(high.normal, part),
                value: level,
            };
            below.push(corner);
            above.push(corner);
        }
    }
    (below, above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorMap;

    fn triangle(values: [f32; 3]) -> Vec<Corner> {
        let places = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let corner = |i: usize| Corner { place: places[i], normal: Vec3::Z, value: values[i] };
        (0..3).map(corner).collect()
    }

    fn facets(scale: ColorScale, count: usize, values: [f32; 3]) -> Vec<Facet> {
        let mut facets = Vec::new();
        Bands::new(scale, count).add(&triangle(values), &mut |facet| facets.push(facet));
        facets
    }

    fn area(facets: &[Facet]) -> f32 {
        let one = |facet: &Facet| {
            let [a, b, c] = facet.corners.map(Vec3::from);
            0.5 * (b - a).cross(c - a).z
        };
        facets.iter().map(one).sum()
    }

    #[test]
    fn colours_between_the_corners_are_those_of_the_values() {
        let scale = ColorScale::new(ColorMap::named("turbo").unwrap());
        let facets = facets(scale, 1, [0.0, 1.0, 0.0]);
        assert!((area(&facets) - 0.5).abs() < 1e-5, "{}", area(&facets));
        // Along the first edge, the value is x.
        for facet in &facets {
            for (corner, color) in facet.corners.iter().zip(facet.colors) {
                let [red, green, blue, _] = color.to_le_bytes();
                let right = scale.color(corner[0].into()).map(|part| (part * 255.0).round() as i16);
                let actual = [red, green, blue].map(i16::from);
                assert!((0..3).all(|c| (actual[c] - right[c]).abs() <= 1), "{actual:?} {right:?}");
            }
            let [low, high] = [f32::min, f32::max]
                .map(|end| facet.corners.iter().map(|at| at[0]).reduce(end).unwrap());
            assert!(high - low < 0.1, "{low} {high}");
        }
    }

    #[test]
    fn small_spans_are_not_cut_and_many_facets_less() {
        let scale = ColorScale::new(ColorMap::VIRIDIS);
        assert_eq!(facets(scale, 1, [0.5, 0.52, 0.51]).len(), 1);
        assert_eq!(facets(scale, 1, [0.5, f32::NAN, 0.0]).len(), 1);
        let [few, many] = [1, 1 << 21].map(|count| facets(scale, count, [0.0, 1.0, 0.5]).len());
        assert!(many < few && many <= 9, "{many} {few}");
    }
}

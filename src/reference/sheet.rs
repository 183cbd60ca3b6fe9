//! What the kernels add up to in one sheet of one ray.

use super::{
    kernel::{Crossing, Load},
    section::section,
};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The sums over all kernels in one sheet of one ray.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sheet {
    /// Radiance: optical depth, and colour and normal weighted by it.
    pub depth: f64,
    pub color: DVec3,
    pub normal: DVec3,
    /// Whether some splat in the sheet has a normal.
    pub has_normal: bool,
    /// Scalars: W, the length of the sections in world units.
    pub length: f64,
    /// Σ f·s, the values weighted by their sections.
    value: f64,
    /// H = Σ s·½∂(ρ²) and G = Σ f·s·½∂(ρ²), per pixel to the right and per pixel downward.
    length_across: DVec2,
    value_across: DVec2,
}

impl Sheet {
    /// Adds the part of a kernel that lies between the distances `from` and `to` along the ray.
    pub fn add(&mut self, load: &Load, crossing: &Crossing, [from, to]: [f64; 2]) {
        let Crossing { weight, closest, density, across } = *crossing;
        let share = weight * section(density * (from - closest), density * (to - closest));
        match *load {
            Load::Radiance { strength, color, normal } => {
                let depth = strength * share;
                self.depth += depth;
                self.color += depth * color;
                self.normal += normal.map_or(DVec3::ZERO, |normal| depth * normal);
                self.has_normal |= normal.is_some();
            }
            Load::Scalar(value) => {
                let length = (2.0 * PI).sqrt() * share / density;
                self.length += length;
                self.value += value * length;
                self.length_across += length * across;
                self.value_across += value * length * across;
            }
        }
    }

    /// The field's value f̄; none where next to no kernel reaches into the sheet.
    pub fn value(&self, thickness: f64) -> Option<f64> {
        (self.length > 1e-6 * thickness).then(|| self.value / self.length)
    }

    /// The derivatives of the value f̄ per pixel to the right and per pixel downward: from the footprints, with the sections
    /// along the ray held fixed; or, where the values `around` are given (in the same sheet of the pixels to the left,
    /// right, above and below), from their differences.
    pub fn across(&self, value: f64, around: Option<[Option<f64>; 4]>) -> DVec2 {
        match around {
            None => (value * self.length_across - self.value_across) / self.length,
            Some([left, right, above, below]) => {
                let central = |before, after| slope([-1.0, 0.0, 1.0], [before, Some(value), after]);
                DVec2::new(central(left, right), central(above, below))
            }
        }
    }
}

/// The slope, at the middle one of three places, of what may have a value at each: from neighbour to neighbour, from the
/// middle to the only neighbour, or 0 without neighbours.
pub(super) fn slope(places: [f64; 3], values: [Option<f64>; 3]) -> f64 {
    let between = |i: usize, j: usize| Some((values[j]? - values[i]?) / (places[j] - places[i]));
    between(0, 2).or(between(1, 2)).or(between(0, 1)).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_take_the_neighbours_that_there_are() {
        let places = [1.0, 2.0, 4.0];
        assert_eq!(slope(places, [Some(1.0), Some(9.0), Some(7.0)]), 2.0);
        assert_eq!(slope(places, [Some(1.0), None, Some(7.0)]), 2.0);
        assert_eq!(slope(places, [None, Some(9.0), Some(7.0)]), -1.0);
        assert_eq!(slope(places, [Some(1.0), Some(9.0), None]), 8.0);
        assert_eq!(slope(places, [None, Some(9.0), None]), 0.0);
    }

    #[test]
    fn a_kernel_cut_in_sheets_is_the_whole_kernel() {
        let crossing = Crossing { weight: 0.4, closest: 3.0, density: 2.0, across: DVec2::new(0.5, -0.25) };
        let cuts = [-20.0, 1.0, 2.5, 3.1, 3.2, 6.0, 30.0];
        let sum = |load: Load| {
            let mut sheet = Sheet::default();
            cuts.windows(2).for_each(|cut| sheet.add(&load, &crossing, [cut[0], cut[1]]));
            sheet
        };
        let color = DVec3::new(0.1, 0.2, 0.3);
        let surface = sum(Load::Radiance { strength: 5.0, color, normal: Some(DVec3::Z) });
        assert!((surface.depth - 2.0).abs() < 1e-12);
        assert!((surface.color / surface.depth - color).length() < 1e-12);
        assert!(surface.has_normal && (surface.normal.z - 2.0).abs() < 1e-12);
        // ∫ exp(−(2s)²/2) ds = √(2π)/2.
        let field = sum(Load::Scalar(7.0));
        assert!((field.length - 0.4 * (2.0 * PI).sqrt() / 2.0).abs() < 1e-12);
        assert!((field.value(1.0).unwrap() - 7.0).abs() < 1e-12);
        assert!(field.across(7.0, None).length() < 1e-12, "one value has no slope");
        assert!(field.value(1e9).is_none());
        let around = [Some(5.0), Some(6.0), None, Some(4.0)];
        assert_eq!(field.across(7.0, Some(around)), DVec2::new(0.5, -3.0));
    }
}

//! Which way a figure looks: an animal on four legs, or a person on two.
//!
//! Both are alike on both sides of an upright plane, and look along it. An animal's head is higher
//! than its body and reaches beyond its front feet; a person's feet point forward. Chairs, beds and
//! cars have neither, and keep the front of the convention, as do figures without feet.

use super::{Shape, across, contacts};
use glam::{DVec2, DVec3};

/// How badly the halves of a figure may fit each other, as a share of its diagonal, and as a share
/// of how badly they do across the other upright plane.
const ALIKE: f64 = 0.06;
const CLEARLY: f64 = 0.7;

/// How much longer than wide an animal is at least.
const LONG: f64 = 1.3;

/// How much further an animal's head reaches beyond its feet than its tail does, as a share of the
/// distance from its front to its hind feet.
const REACH: f64 = 0.2;

/// How far the toes are ahead of the ankles, as a share of a person's height.
const TOES: f64 = 0.02;

impl Shape {
    /// Returns the direction that a figure looks in if it stands on `axis`, with that sign up.
    pub(super) fn front(&self, axis: usize, sign: f64) -> Option<DVec3> {
        let [u, v] = across(axis);
        let side = if self.skew[u] < self.skew[v] { u } else { v };
        let along = if side == u { v } else { u };
        if self.skew[side] > ALIKE.min(CLEARLY * self.skew[along]) {
            return None;
        }
        // Heights from 0 to 1, and places: along the plane of symmetry, and across it.
        let height = self.high[axis] - self.low[axis];
        let places: Vec<(f64, DVec2)> = self
            .above_ground(axis, sign)
            .zip(&self.samples)
            .map(|((above, _), sample)| (above / height, DVec2::new(sample[along], sample[side])))
            .collect();
        let feet: Vec<DVec2> =
            places.iter().filter(|(above, _)| *above < 0.03).map(|(_, place)| *place).collect();
        let sides = self.high - self.low;
        let sizes = contacts(&feet, (sides[along] * sides[side]).sqrt() / 30.0)?;
        if sizes.iter().max()? > &(3 * sizes.iter().min()?) {
            return None;
        }
        let ahead = match sizes.as_slice() {
            [_, _] => toes(&places, height)?,
            [_, _, _, _] => self.head(&places, &feet, [along, side])?,
            _ => return None,
        };
        Some(ahead * DVec3::AXES[along])
    }

    /// Returns the sign of the direction in which the head of an animal lies.
    fn head(
        &self,
        places: &[(f64, DVec2)],
        feet: &[DVec2],
        [along, side]: [usize; 2],
    ) -> Option<f64> {
        let sides = self.high - self.low;
        if sides[along] < LONG * sides[side] {
            return None;
        }
        let range = |places: &mut dyn Iterator<Item = f64>| {
            places.fold((f64::MAX, f64::MIN), |(low, high), at| (low.min(at), high.max(at)))
        };
        let (hind, fore) = range(&mut feet.iter().map(|place| place.x));
        let upper = places.iter().filter(|(above, _)| *above > 0.5);
        let (low, high) = range(&mut upper.map(|(_, place)| place.x));
        let further = (high - fore).max(0.0) - (hind - low).max(0.0);
        let top = mean(places, 0.9..=1.0)? - 0.5 * (hind + fore);
        let is_head = further.abs() > REACH * (fore - hind) && further * top > 0.0;
        is_head.then_some(further.signum())
    }
}

/// Returns the sign of the direction in which a person's toes point.
fn toes(places: &[(f64, DVec2)], height: f64) -> Option<f64> {
    let ahead = mean(places, 0.0..=0.03)? - mean(places, 0.06..=0.14)?;
    (ahead.abs() > TOES * height).then_some(ahead.signum())
}

/// Returns the mean place along the plane of symmetry, of the samples at these heights.
fn mean(places: &[(f64, DVec2)], heights: std::ops::RangeInclusive<f64>) -> Option<f64> {
    let chosen = places.iter().filter(|(above, _)| heights.contains(above));
    let (sum, count) = chosen.fold((0.0, 0), |(sum, count), (_, p)| (sum + p.x, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

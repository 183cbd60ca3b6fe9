//! The field of a sheet at eight pixels: a parabola along each ray.

use super::vector::Lanes;
use fearless_simd::{Simd, prelude::*};

/// Number of parts of a sheet in which the transfer function is integrated.
pub const PARTS: usize = 3;
/// A sheet that takes at most this share of the light is integrated as one piece, if its field is
/// straight enough.
const FAINT: f32 = 0.2;
/// A field is straight if its mean deviates little from that of its ends. The square of that, in
/// entries of the table, times the share of the light that its sheet takes is at most this.
const EVEN: f32 = 128.0;

/// The field on a plane between two sheets: its value, in entries of the table, and its gradient
/// across the ray.
#[derive(Clone, Copy)]
pub struct Face<S: Simd> {
    pub value: Lanes<S>,
    pub across: [Lanes<S>; 3],
}

impl<S: Simd> Face<S> {
    /// Copies another one vector by vector. At once, the copy would wait until all are written.
    #[inline(always)]
    pub fn set(&mut self, other: &Self) {
        self.value = other.value;
        self.across[0] = other.across[0];
        self.across[1] = other.across[1];
        self.across[2] = other.across[2];
    }
}

/// The field of a sheet at eight pixels.
pub struct Layer<S: Simd> {
    pub front: Face<S>,
    pub back: Face<S>,
    /// The value in the middle.
    pub middle: Lanes<S>,
    /// The sheet's start and thickness, and the part of the rays that counts.
    pub start: Lanes<S>,
    pub thickness: Lanes<S>,
    pub begin: Lanes<S>,
    pub end: Lanes<S>,
    /// The filled fraction of the sheet.
    pub filling: Lanes<S>,
    /// About the share of a pixel's light that the sheet takes, at most 1: how much detail counts.
    pub weight: Lanes<S>,
    pub direction: [Lanes<S>; 3],
    /// The gradients in view space at the front, in the middle and at the back, in entries per
    /// thickness of a sheet. `None` where only those of the faces are known, and only across.
    pub sections: Option<Sections<S>>,
    /// How far gradients count behind a clip, from 0 to 1; `None` without clips.
    pub share: Option<Lanes<S>>,
}

/// Gradients at three places of a sheet.
pub type Sections<S> = [[Lanes<S>; 3]; 3];

impl<S: Simd> Layer<S> {
    /// Returns the field of a sheet that is filled, with a value in the middle.
    #[inline(always)]
    pub fn new(
        simd: S,
        direction: [Lanes<S>; 3],
        [front, back]: [Face<S>; 2],
        middle: Lanes<S>,
        [start, thickness]: [Lanes<S>; 2],
        [begin, end]: [Lanes<S>; 2],
    ) -> Self {
        Self {
            front,
            back,
            middle,
            start,
            thickness,
            begin,
            end,
            filling: Lanes::splat(simd, 1.0),
            weight: Lanes::splat(simd, 1.0),
            direction,
            sections: None,
            share: None,
        }
    }

    #[inline(always)]
    pub fn parabola(&self, u: Lanes<S>) -> Lanes<S> {
        let v = 1.0 - u;
        let w = v - u;
        self.front.value * v * w + self.middle * u * v * 4.0 - self.back.value * u * w
    }

    /// Returns the largest value between a place and the place `length` behind it.
    #[inline(always)]
    pub fn peak(&self, place: Lanes<S>, length: Lanes<S>, is_curved: bool) -> Lanes<S> {
        if !is_curved {
            return self.mean();
        }
        let step = length * (1.0 / PARTS as f32);
        let (mut place, mut peak) = (place, self.parabola(place));
        for _ in 0..PARTS {
            place += step;
            peak = peak.max(self.parabola(place));
        }
        peak
    }

    /// Returns the ends of a straight line with the mean of the field between two places. `None` if
    /// the parabola is better, because the sheet takes too much light.
    #[inline(always)]
    pub fn straight(&self, [from, to]: [Lanes<S>; 2]) -> Option<[Lanes<S>; 2]> {
        let (a, c) = (self.parabola(from), self.parabola(to));
        let bend = (self.parabola((from + to) * 0.5) * 2.0 - (a + c)) * (1.0 / 3.0);
        let is_faint = self.weight.simd_le(FAINT) & (bend * bend * self.weight).simd_le(EVEN);
        is_faint.all_true().then_some([a + bend, c + bend])
    }

    #[inline(always)]
    pub fn mean(&self) -> Lanes<S> {
        (self.front.value + self.middle * 4.0 + self.back.value) * (1.0 / 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::vector::lanes;
    use fearless_simd::Level;

    /// A layer with these values, which takes this share of the light.
    fn layer<S: Simd>(simd: S, [front, middle, back]: [f32; 3], weight: f32) -> Layer<S> {
        let lanes = |value: f32| Lanes::splat(simd, value);
        let face = |value: f32| Face { value: lanes(value), across: [lanes(0.0); 3] };
        let ends = [lanes(0.0), lanes(1.0)];
        let faces = [face(front), face(back)];
        let layer = Layer::new(simd, [lanes(0.0); 3], faces, lanes(middle), ends, ends);
        Layer { weight: lanes(weight), ..layer }
    }

    fn first<S: Simd>(lanes: Lanes<S>) -> f32 {
        <[f32; 8]>::from(lanes)[0]
    }

    /// Returns the ends of the line of a layer between two places, and the parabola's mean there,
    /// summed in small steps.
    fn line(values: [f32; 3], weight: f32, [from, to]: [f32; 2]) -> (Option<[f32; 2]>, f32) {
        lanes!(Level::new(), simd => {
            let layer = layer(simd, values, weight);
            let ends = layer.straight([Lanes::splat(simd, from), Lanes::splat(simd, to)]);
            let steps = 1000;
            let sum: f32 = (0..steps)
                .map(|step| (step as f32 + 0.5) / steps as f32)
                .map(|u| first(layer.parabola(Lanes::splat(simd, from + (to - from) * u))))
                .sum();
            (ends.map(|ends| ends.map(first)), sum / steps as f32)
        })
    }

    #[test]
    fn a_line_has_the_mean_of_the_parabola() {
        for (values, places) in [
            ([10.0, 40.0, 20.0], [0.0, 1.0]),
            ([10.0, 40.0, 20.0], [0.25, 0.5]),
            ([-3.0, -3.0, 9.0], [0.0, 0.7]),
        ] {
            let (ends, mean) = line(values, 0.1, places);
            let [front, back] = ends.expect("a line");
            assert!((0.5 * (front + back) - mean).abs() < 1e-3, "{values:?} {places:?}: {mean}");
        }
    }

    #[test]
    fn sheets_that_take_much_light_stay_parabolas() {
        let even = [10.0, 15.0, 20.0];
        assert!(line(even, FAINT, [0.0, 1.0]).0.is_some());
        assert!(line(even, 1.01 * FAINT, [0.0, 1.0]).0.is_none());
        // The more a field bends, the less light its sheet may take.
        let bent = [0.0, 60.0, 0.0];
        assert!(line(bent, 0.05, [0.0, 1.0]).0.is_some());
        assert!(line(bent, 0.15, [0.0, 1.0]).0.is_none());
    }
}

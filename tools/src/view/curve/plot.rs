//! Where numbers lie in a plot.

use eframe::egui::{Pos2, Rect, pos2};

/// The heights of shares from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// In proportion.
    Linear,
    /// By the square root: small opacities, which decide over the depth that is seen, have room.
    Root,
}

/// A rectangle with numbers from left to right, and shares from 0 to 1 upwards.
#[derive(Debug, Clone, Copy)]
pub struct Plot {
    pub rect: Rect,
    /// The numbers at the left and the right side. The second is larger.
    pub range: [f64; 2],
    pub scale: Scale,
}

impl Plot {
    pub fn x(&self, value: f64) -> f32 {
        let [low, high] = self.range;
        let share = (value - low) / (high - low);
        // Places far outside stay within 32 bits.
        self.rect.left() + self.rect.width() * share.clamp(-1e3, 1e3) as f32
    }

    pub fn y(&self, share: f64) -> f32 {
        let height = match self.scale {
            Scale::Linear => share,
            Scale::Root => share.max(0.0).sqrt(),
        };
        self.rect.bottom() - self.rect.height() * height as f32
    }

    pub fn at(&self, (value, share): (f64, f64)) -> Pos2 {
        pos2(self.x(value), self.y(share))
    }

    pub fn value(&self, x: f32) -> f64 {
        let [low, high] = self.range;
        let share = f64::from((x - self.rect.left()) / self.rect.width());
        low + (high - low) * share
    }

    /// Returns the share at a height, within 0 … 1.
    pub fn share(&self, y: f32) -> f64 {
        let height = f64::from((self.rect.bottom() - y) / self.rect.height()).clamp(0.0, 1.0);
        match self.scale {
            Scale::Linear => height,
            Scale::Root => height * height,
        }
    }

    /// Returns the left and the right side of narrow columns that fill the plot.
    pub fn columns(&self) -> impl Iterator<Item = [f32; 2]> + use<> {
        let (left, right) = (self.rect.left(), self.rect.right());
        let count = ((right - left) / 2.0).ceil().max(1.0) as usize;
        (0..count).map(move |column| {
            let start = left + 2.0 * column as f32;
            [start, (start + 2.0).min(right)]
        })
    }
}

/// The part of a range that is shown.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zoom(Option<[f64; 2]>);

/// How far a range can be zoomed in and out.
const FACTORS: [f64; 2] = [1e-6, 100.0];

impl Zoom {
    /// Returns the part that is shown of a range. A range without width is widened.
    pub fn range(&self, whole: [f64; 2]) -> [f64; 2] {
        self.0.unwrap_or_else(|| widened(whole))
    }

    /// Shows more (factor below 1) or less around a place, which stays where it is.
    pub fn zoom(&mut self, whole: [f64; 2], about: f64, factor: f64) {
        let [low, high] = self.range(whole);
        let [first, last] = widened(whole);
        let width = high - low;
        let limits = FACTORS.map(|limit| limit * (last - first));
        let factor = width / (width / factor).clamp(limits[0], limits[1]);
        if factor.is_finite() && factor > 0.0 {
            self.set([about - (about - low) / factor, about + (high - about) / factor]);
        }
    }

    /// Moves the part that is shown.
    pub fn pan(&mut self, whole: [f64; 2], by: f64) {
        let [low, high] = self.range(whole);
        self.set([low + by, high + by]);
    }

    /// Shows all.
    pub fn reset(&mut self) {
        self.0 = None;
    }

    fn set(&mut self, [low, high]: [f64; 2]) {
        if low.is_finite() && high.is_finite() && low < high {
            self.0 = Some([low, high]);
        }
    }
}

fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    if low < high {
        return [low, high];
    }
    let half = (0.5 * low.abs()).max(0.5);
    [low - half, low + half]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_numbers_are_inverse() {
        let rect = Rect::from_min_max(pos2(10.0, 20.0), pos2(210.0, 120.0));
        for scale in [Scale::Linear, Scale::Root] {
            let plot = Plot { rect, range: [-1000.0, 3000.0], scale };
            let at = plot.at((1000.0, 0.25));
            assert_eq!(at.x, 110.0);
            assert_eq!(at.y, if scale == Scale::Linear { 95.0 } else { 70.0 });
            assert!((plot.value(at.x) - 1000.0).abs() < 1e-3);
            assert!((plot.share(at.y) - 0.25).abs() < 1e-6);
            assert_eq!((plot.share(-50.0), plot.share(500.0)), (1.0, 0.0));
            assert!(plot.x(1e300).is_finite());
        }
    }

    #[test]
    fn zooming_keeps_the_place_and_has_limits() {
        let (mut zoom, whole) = (Zoom::default(), [0.0, 100.0]);
        zoom.zoom(whole, 25.0, 2.0);
        assert_eq!(zoom.range(whole), [12.5, 62.5]);
        zoom.pan(whole, 10.0);
        assert_eq!(zoom.range(whole), [22.5, 72.5]);
        zoom.zoom(whole, 50.0, 1e30);
        let [low, high] = zoom.range(whole);
        assert!(low < 50.0 && 50.0 < high && high - low > 0.9e-4);
        zoom.reset();
        assert_eq!((zoom.range(whole), zoom.range([7.0; 2])), (whole, [3.5, 10.5]));
    }
}

//! Chooses how fine hierarchies are drawn, to keep a frame time: finer after a frame that took
//! less, coarser after one that took more (reactive, in the terms of Funkhouser & Séquin 1993).
//! While the view rests, it becomes finer frame by frame, down to the leaves.

use crate::math::View;

/// The finest cut while the view moves, in pixels.
const FINEST: f64 = 0.5;

/// The coarsest cut while the view moves, in pixels.
const COARSEST: f64 = 64.0;

/// Factor on a resting view's cut from frame to frame (as in QSplat).
const RESTING: f64 = 0.7;

/// The smallest cut of a resting view, in pixels. Below it, the leaves are drawn.
const LEAST: f64 = 0.25;

/// The cuts and the view of the last frames.
#[derive(Debug, Default)]
pub struct Pace {
    /// The cut of the last frame while the view moved, in pixels.
    moving: Option<f64>,
    /// The cut of the last frame.
    last: f64,
    view: Option<View>,
}

impl Pace {
    /// Returns the cut of the next frame, in pixels.
    pub fn next(&mut self, view: &View) -> f64 {
        let rests = self.view.as_ref() == Some(view);
        self.view = Some(view.clone());
        let moving = *self.moving.get_or_insert(2.0);
        self.last = match rests {
            false => moving,
            true if self.last * RESTING < LEAST => 0.0,
            true => self.last * RESTING,
        };
        self.last
    }

    /// Records the time of a frame, and the time that was wanted, in milliseconds.
    pub fn took(&mut self, milliseconds: f64, wanted: f64) {
        let Some(moving) = &mut self.moving else { return };
        if self.last == *moving {
            // The number of splats is proportional to 1 over the square of their size.
            let factor = (milliseconds / wanted.max(1e-3)).sqrt().clamp(0.6, 1.7);
            *moving = (*moving * factor).clamp(FINEST, COARSEST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Bounds, Camera};
    use glam::DVec3;

    fn view(turn: f64) -> View {
        let bounds = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
        let mut camera = Camera::framing(&bounds, DVec3::Z, DVec3::Y, 1.0);
        camera.azimuth(turn);
        camera.view([64, 64]).expect("a view")
    }

    #[test]
    fn frames_that_take_too_long_become_coarser_until_they_fit() {
        let mut pace = Pace::default();
        // A machine that takes 90 ms at one pixel.
        let mut cut = 0.0;
        for turn in 0..40 {
            cut = pace.next(&view(f64::from(turn)));
            pace.took(90.0 / (cut * cut), 10.0);
        }
        assert!((cut - 3.0).abs() < 0.05, "{cut}");
    }

    #[test]
    fn a_resting_view_gets_its_leaves_and_a_moving_one_its_pace_again() {
        let mut pace = Pace::default();
        let first = pace.next(&view(0.0));
        pace.took(10.0, 10.0);
        let cuts: Vec<f64> = (0..20).map(|_| pace.next(&view(0.0))).collect();
        assert!(cuts.windows(2).all(|pair| pair[1] <= pair[0]) && cuts[19] == 0.0, "{cuts:?}");
        assert_eq!(pace.next(&view(5.0)), first);
    }
}

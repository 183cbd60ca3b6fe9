//! How much effort a frame takes: little while the view moves, more and more while it rests, up to
//! the exact picture.

use crate::{hierarchy::Detail, scene::Settings};

/// Widest pixels of a moving picture, in pixels of the exact one.
const WIDEST: f64 = 8.0;
/// Largest factor on the width of splats and the thickness of sheets.
const COARSEST: f64 = 4.0;
/// The most times that a frame is asked to be faster than the exact picture.
const FASTEST: f64 = WIDEST * WIDEST * COARSEST;
/// A frame within these shares of the wanted time changes nothing.
const STEADY: [f64; 2] = [0.7, 1.0];
/// Largest change of the effort from one moving frame to the next.
const CHANGE: [f64; 2] = [0.5, 3.0];
/// A frame that takes this many times the wanted time marks its effort as too fine.
const TOO_SLOW: f64 = 1.5;
/// How much coarser than such an effort the next frames stay, and the share of that bound which
/// remains after each of them: it is tried again after about 40 frames. A cut of a hierarchy may
/// have ten times the splats of the next coarser one, and trying it all the time would stutter.
const COARSER: f64 = 1.25;
const FORGOTTEN: f64 = 0.995;
/// Wide pixels must pay: a moving frame with pixels of width `w` must be `w` to this power times
/// faster than the exact one. Many small splats take their time at every width, and would be
/// shown as blocks for nothing.
const PAYS: f64 = 0.6;
/// Ratio of the pixel widths of two steps of a resting view.
const FINER: f64 = 2.0;

/// How much less than the exact picture a frame is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// The width of a pixel, in pixels of the exact picture; 1 or more.
    pub pixel: f64,
    /// A factor on the width of splats and on the thickness of sheets; 1 or more.
    pub coarseness: f64,
}

/// The smallest map of shadows of a moving view, in pixels.
const LEAST_SHADOWS: u32 = 64;

impl Effort {
    /// That of the exact picture.
    pub const EXACT: Self = Self { pixel: 1.0, coarseness: 1.0 };

    /// Returns the settings of a frame from those of the exact picture. With
    /// [`EXACT`](Self::EXACT), they are the same. `sheet` is the thickness of the exact picture's
    /// sheets, in world units, if the scene's fields decide it.
    pub fn settings(self, exact: &Settings, sheet: Option<f64>) -> Settings {
        let mut settings = exact.clone();
        if self == Self::EXACT {
            return settings;
        }
        settings.size =
            exact.size.map(|side| ((f64::from(side) / self.pixel).round() as u32).max(1));
        // Where pixels are wide, thin sheets show nothing more.
        let thicker = self.coarseness * self.pixel.min(2.0);
        settings.sheet_thickness = sheet.map(|sheet| sheet * thicker);
        // The map of shadows is drawn for each turn of the view.
        if let Some(key) = settings.lighting.key.as_mut().filter(|key| key.shadows > 0) {
            key.shadows = ((f64::from(key.shadows) / self.pixel) as u32).max(LEAST_SHADOWS);
        }
        if let Detail::Pixels(pixels) = exact.detail {
            settings.detail = Detail::Pixels(pixels * self.coarseness);
        }
        settings
    }

    /// The effort that takes about this many times less than the exact picture.
    fn faster(factor: f64) -> Self {
        let pixel = factor.sqrt().clamp(1.0, WIDEST);
        let coarseness = (factor / (WIDEST * WIDEST)).clamp(1.0, COARSEST);
        Self { pixel, coarseness }
    }
}

/// Chooses the effort of each frame. It has no clock: the caller tells it what a frame took, so it
/// does the same again for the same times.
#[derive(Debug, Clone)]
pub struct Pace {
    /// The wanted time of a moving frame, in milliseconds.
    wanted: f64,
    /// How many times faster than the exact picture a moving frame must be, as far as known.
    factor: f64,
    /// The least factor for now, because a smaller one was too slow.
    least: f64,
    /// The largest factor for now, because a larger one did not pay.
    most: f64,
    /// The time of the last exact picture, in milliseconds.
    exact: Option<f64>,
    /// The effort of the last frame of the current view.
    last: Option<Effort>,
}

impl Pace {
    /// A pace that keeps moving frames within a time in milliseconds.
    pub fn new(wanted: f64) -> Self {
        // The first frame is coarse. If it was faster than wanted, the next ones are finer.
        let wanted = wanted.max(1.0);
        Self { wanted, factor: 16.0, least: 1.0, most: FASTEST, exact: None, last: None }
    }

    /// Something changed: the last frame no longer shows the current view.
    pub fn changed(&mut self) {
        self.last = None;
    }

    /// Returns the effort of the next frame. `None`: the exact picture is shown.
    pub fn next(&self) -> Option<Effort> {
        match self.last {
            None => Some(Effort::faster(self.factor)),
            Some(Effort::EXACT) => None,
            // Finer in every respect than the last frame.
            Some(last) => {
                let pixel = last.pixel / FINER;
                Some(if pixel < FINER.sqrt() {
                    Effort::EXACT
                } else {
                    Effort { pixel, coarseness: 1.0 }
                })
            }
        }
    }

    /// Records a frame of the current view, and the time it took in milliseconds.
    pub fn took(&mut self, effort: Effort, milliseconds: f64) {
        if self.last.is_none() {
            let share = milliseconds / self.wanted;
            self.least = (self.least * FORGOTTEN).max(1.0);
            if share > TOO_SLOW {
                self.least = self.least.max(self.factor * COARSER);
            }
            if !(STEADY[0]..=STEADY[1]).contains(&share) {
                // A little below the wanted time.
                let change = (share / 0.85).clamp(CHANGE[0], CHANGE[1]);
                self.factor *= change;
            }
            self.most = match self.pays(effort, milliseconds) {
                true => (self.most / FORGOTTEN).min(FASTEST),
                false => (effort.pixel * effort.pixel / FINER).max(1.0),
            };
            self.factor = self.factor.clamp(self.least.min(self.most), self.most);
        }
        if effort == Effort::EXACT {
            self.exact = Some(milliseconds);
        }
        self.last = Some(effort);
    }

    /// Returns whether the pixels of a moving frame are no wider than its time is worth.
    fn pays(&self, effort: Effort, milliseconds: f64) -> bool {
        let worth = effort.pixel.powf(PAYS);
        self.exact.is_none_or(|exact| effort.pixel <= 1.0 || exact >= milliseconds * worth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The time of a frame on a machine that takes this long for the exact picture, with a part
    /// that no effort changes.
    fn time(effort: Effort, exact: f64) -> f64 {
        3.0 + exact / (effort.pixel * effort.pixel * effort.coarseness)
    }

    #[test]
    fn moving_frames_come_to_take_the_wanted_time() {
        for exact in [1.0, 40.0, 400.0, 4000.0] {
            let mut pace = Pace::new(40.0);
            let mut last = 0.0;
            for frame in 0..20 {
                pace.changed();
                let effort = pace.next().expect("a moving view needs a frame");
                last = time(effort, exact);
                pace.took(effort, last);
                assert!(frame < 6 || last <= 40.0, "{exact}: frame {frame} took {last}");
            }
            // No coarser than it must be.
            assert!(last > 20.0 || pace.factor == 1.0, "{exact}: {last}");
        }
    }

    #[test]
    fn pixels_are_no_wider_than_they_pay() {
        // Splats that take their time at every width, and a few that do not.
        for (fixed, of_pixels, widest) in
            [(100.0, 38.0, 1.5), (30.0, 108.0, 6.0), (5.0, 400.0, 8.0)]
        {
            let time = |effort: Effort| fixed + of_pixels / effort.pixel;
            let mut pace = Pace::new(30.0);
            pace.took(Effort::EXACT, time(Effort::EXACT));
            let mut pixels = Vec::new();
            for _ in 0..40 {
                pace.changed();
                let effort = pace.next().expect("a moving view needs a frame");
                pixels.push(effort.pixel);
                pace.took(effort, time(effort));
            }
            let last = pixels[20..].iter().copied().fold(0.0, f64::max);
            assert!(last <= widest && last > 0.4 * widest, "{fixed} + {of_pixels}: {last}");
        }
    }

    #[test]
    fn a_jump_of_the_time_is_not_tried_all_the_time() {
        let mut pace = Pace::new(30.0);
        let mut slow = 0;
        for frame in 0..200 {
            pace.changed();
            let effort = pace.next().expect("a frame");
            // A finer cut takes ten times as long.
            let took = if effort.pixel < 4.5 { 90.0 } else { 9.0 };
            pace.took(effort, took);
            slow += usize::from(took > 30.0 && frame > 20);
        }
        assert!((1..=6).contains(&slow), "{slow} slow frames");
    }

    #[test]
    fn a_resting_view_becomes_exact_and_no_step_is_worse() {
        let mut pace = Pace::new(40.0);
        pace.factor = 200.0;
        let mut steps = Vec::new();
        while let Some(effort) = pace.next() {
            pace.took(effort, time(effort, 5000.0));
            steps.push(effort);
            assert!(steps.len() < 10);
        }
        assert_eq!(steps.last(), Some(&Effort::EXACT));
        assert!(steps.windows(2).all(|pair| {
            pair[1].pixel < pair[0].pixel && pair[1].coarseness <= pair[0].coarseness
        }));
        assert_eq!(pace.next(), None);
        pace.changed();
        assert!(pace.next().is_some_and(|effort| effort.pixel > 4.0));
    }

    #[test]
    fn a_fast_machine_moves_in_exact_pictures() {
        let mut pace = Pace::new(40.0);
        for _ in 0..10 {
            pace.changed();
            let effort = pace.next().expect("a frame");
            pace.took(effort, time(effort, 5.0));
        }
        pace.changed();
        assert_eq!(pace.next(), Some(Effort::EXACT));
    }

    #[test]
    fn the_exact_effort_changes_no_setting() {
        let exact = Settings { sheet_thickness: Some(0.5), ..Settings::new([300, 200]) };
        let same = Effort::EXACT.settings(&exact, Some(7.0));
        assert_eq!(format!("{same:?}"), format!("{exact:?}"));
        let coarse = Effort { pixel: 4.0, coarseness: 2.0 }.settings(&exact, Some(0.5));
        assert_eq!((coarse.size, coarse.sheet_thickness), ([75, 50], Some(2.0)));
    }
}

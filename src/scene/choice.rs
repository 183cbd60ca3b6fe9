//! Which bricks of the scene's volume a picture needs.

use super::{Item, Region, Scene, Settings};
use crate::{
    bricks::{self, Choice, Wish},
    hierarchy::Detail,
    math::{Bounds, View},
    volume::reach::{EVERYTHING, first_visible},
};

/// Width of a sample's footprint at half its height, in sample spacings. The exact width is 1.8 for
/// a B-spline and 1.65 for the usual Gaussian.
const SAMPLE_WIDTH: f64 = 2.0;

impl Scene {
    /// Returns the bricks of the scene's volume that a view shows, within the settings' memory.
    /// Returns `None` if the scene has no volume in bricks. A detail in splats also limits the
    /// bricks to that number of samples. There are at most `most` bricks. `bounds` are the scene's.
    pub(crate) fn choice(
        &self,
        view: &View,
        settings: &Settings,
        detail: Detail,
        most: usize,
        bounds: &Bounds,
    ) -> Option<Choice> {
        let choice_of = |item: &Item| match item {
            Item::Bricks(bricks, kernel, transfer) => {
                let room = settings.controls.page_memory / bricks::slot_bytes(bricks);
                let (pixels, room) = match detail {
                    Detail::Pixels(pixels) => (pixels, room),
                    Detail::Splats(splats) => {
                        (Detail::PIXELS, room.min(splats / bricks::SIDE.pow(3) as u64))
                    }
                    Detail::Milliseconds(_) => (Detail::PIXELS, room),
                };
                let most = usize::try_from(room).unwrap_or(usize::MAX).min(most).max(1);
                // Thick sheets average the field beyond the faces of a region.
                let beyond = settings.sheet_thickness.unwrap_or(0.0);
                let region =
                    settings.region.map(|Region { bounds: Bounds { min, max }, .. }| Bounds {
                        min: min - beyond,
                        max: max + beyond,
                    });
                let least = settings.region.map_or(0.0, |region| region.level);
                let wish = Wish { pixels: pixels / SAMPLE_WIDTH, most, least, region };
                let choose = |visible: &[u16; 256]| {
                    bricks::choice(bricks, view, kernel.extent, visible, &wish)
                };
                // If kernels reach further than the ranges of blocks cover, the ranges cannot
                // exclude bricks.
                if kernel.extent > bricks::REACH as f64 {
                    return Some(choose(&EVERYTHING));
                }
                let choice = choose(&first_visible(transfer, bricks.header().range));
                let sheets = self.sheets_of(view, settings, std::slice::from_ref(&choice), bounds);
                Some(if self.mixes_afar(settings, &sheets, Some(&choice)) {
                    choose(&EVERYTHING)
                } else {
                    choice
                })
            }
            _ => None,
        };
        self.items.iter().find_map(choice_of)
    }
}

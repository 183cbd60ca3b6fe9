//! The same scene at another time.

use super::{AppearanceEntry, Description, Loaded, LoadedInput, TransferEntry};
use crate::{scene::Item, volume::TransferFunction};

impl Description {
    /// Returns the description of this scene at another time. The inputs that have several times
    /// are read at this one.
    ///
    /// Values look as they do in `loaded`, which was made of this description at its own time.
    /// Neither transfer functions nor ranges of colours are made anew, so that pictures of several
    /// times can be compared.
    pub fn at_time(&self, loaded: &Loaded, time: usize) -> Self {
        let mut scene = self.clone();
        let visible = scene.inputs.iter_mut().filter(|input| input.visible);
        for (input, known) in visible.zip(&loaded.inputs) {
            input.appearance = self.appearance_of(input);
            if known.times.is_some() {
                input.reading.time = Some(time);
                input.appearance.keep(loaded, known);
            }
        }
        // Each input says all by itself now.
        scene.appearance = AppearanceEntry::default();
        scene
    }
}

impl AppearanceEntry {
    /// Takes what was made for the values of an input: its transfer function, or the range of its
    /// colours.
    fn keep(&mut self, loaded: &Loaded, input: &LoadedInput) {
        for number in input.items.clone() {
            if let Some(transfer) = transfer_of(&loaded.scene.items[number]) {
                self.transfer = Some(TransferEntry::Whole(transfer.clone()));
                // The function has them already.
                (self.range, self.opacity_unit) = (None, None);
                (self.isosurfaces, self.gradient_opacity) = (None, None);
                return;
            }
            let legend = loaded.captions.legends.iter().find(|(item, _)| *item == number);
            if let Some((_, legend)) = legend {
                self.range = Some(legend.scale.range);
            }
        }
    }
}

/// Returns the transfer function of a field.
fn transfer_of(item: &Item) -> Option<&TransferFunction> {
    match item {
        Item::Volume(_, _, transfer) | Item::Bricks(_, _, transfer) => Some(transfer),
        Item::Scalar(_, transfer) | Item::Cells(_, transfer) => Some(transfer),
        _ => None,
    }
}

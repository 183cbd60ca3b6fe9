//! The transfer function of the field.

use super::Ask;
use crate::view::{
    curve::{self, Edit},
    window::Window,
};
use eframe::egui::{Ui, Vec2};
use std::sync::Arc;

pub fn show(window: &mut Window, ui: &mut Ui) {
    let (Some(mut transfer), Some(stage), Some(mut curve)) = (
        window.transfer(),
        window.shown.as_ref().map(|shown| Arc::clone(&shown.stage)),
        window.panels.curve.take(),
    ) else {
        return;
    };
    ui.horizontal(|ui| {
        if ui.button("Load…").clicked() {
            window.panels.ask(Ask::OpenTransfer);
        }
        if ui.button("Save…").clicked() {
            window.panels.ask(Ask::SaveTransfer);
        }
    });
    let histogram = stage.histogram.as_ref();
    let edit = curve.show(ui, histogram, &mut transfer, stage.values());
    window.panels.curve = Some(curve);
    if edit == Edit::Unchanged {
        return;
    }
    // A drag is one step.
    let before = window.panels.before_edit.take();
    let before = before.unwrap_or_else(|| window.document.scene().clone());
    window.set_transfer(&transfer);
    match edit {
        Edit::Committed => window.document.keep(before),
        _ => window.panels.before_edit = Some(before),
    }
}

/// Moves and widens the transfer function as a hand drags.
pub fn window_level(window: &mut Window, drag: Vec2) {
    let Some(mut transfer) = window.transfer() else { return };
    let Some(values) = window.shown.as_ref().map(|shown| shown.stage.values()) else { return };
    curve::window_level(&mut transfer, drag, values);
    window.set_transfer(&transfer);
}

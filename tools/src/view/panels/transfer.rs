//! The transfer functions of the fields, of which one is edited.

use super::Ask;
use crate::view::{
    curve::{self, Edit},
    window::Window,
};
use eframe::egui::{ComboBox, Ui, Vec2};
use std::sync::Arc;

pub fn show(window: &mut Window, ui: &mut Ui) {
    let field = choose(window, ui);
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
    let histogram = stage.histogram(field);
    let edit =
        ui.push_id(field, |ui| curve.show(ui, histogram, &mut transfer, stage.values(field)));
    let edit = edit.inner;
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

/// Lets one of several fields be chosen. Returns the item whose field is edited.
fn choose(window: &mut Window, ui: &mut Ui) -> usize {
    let Some(shown) = &mut window.shown else { return 0 };
    let fields = shown.fields();
    if fields.len() > 1 {
        let own = fields.iter().find(|(item, _)| *item == shown.field);
        let own = own.map_or("", |(_, name)| name);
        ui.horizontal(|ui| {
            let label = ui.label("Field");
            let choice = ComboBox::from_id_salt("field").selected_text(own);
            let list = choice.show_ui(ui, |ui| {
                for (item, name) in &fields {
                    ui.selectable_value(&mut shown.field, *item, name);
                }
            });
            list.response.labelled_by(label.id);
        });
    }
    shown.field
}

/// Moves and widens the transfer function as a hand drags.
pub fn window_level(window: &mut Window, drag: Vec2) {
    let Some(mut transfer) = window.transfer() else { return };
    let values = window.shown.as_ref().map(|shown| shown.stage.values(shown.field));
    let Some(values) = values else { return };
    curve::window_level(&mut transfer, drag, values);
    window.set_transfer(&transfer);
}

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
        window.scene_view.as_ref().map(|scene_view| Arc::clone(&scene_view.stage)),
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
    let Some(scene_view) = &mut window.scene_view else { return 0 };
    let fields = scene_view.fields();
    if fields.len() > 1 {
        let current = fields.iter().find(|(item, _)| *item == scene_view.field);
        let current = current.map_or("", |(_, name)| name);
        ui.horizontal(|ui| {
            let label = ui.label("Field");
            let choice = ComboBox::from_id_salt("field").selected_text(current);
            let list = choice.show_ui(ui, |ui| {
                for (item, name) in &fields {
                    ui.selectable_value(&mut scene_view.field, *item, name);
                }
            });
            list.response.labelled_by(label.id);
        });
    }
    scene_view.field
}

/// Moves and widens the transfer function as a hand drags.
pub fn window_level(window: &mut Window, drag: Vec2) {
    let Some(mut transfer) = window.transfer() else { return };
    let values =
        window.scene_view.as_ref().map(|scene_view| scene_view.stage.values(scene_view.field));
    let Some(values) = values else { return };
    curve::window_level(&mut transfer, drag, values);
    window.set_transfer(&transfer);
}

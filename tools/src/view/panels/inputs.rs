//! The inputs: which are drawn, and the colours and opacities of surfaces.

use super::{Ask, appearance::edited};
use crate::{given, view::window::Window};
use eframe::egui::{DragValue, Ui};
use splatkit::session::InputEntry;

pub fn show(window: &mut Window, ui: &mut Ui) {
    let entries = window.document.scene().inputs.clone();
    let kinds = window.scene_view.as_ref().map_or(Vec::new(), |s| s.stage.loaded.kinds());
    let mut kinds = kinds.into_iter();
    for (number, entry) in entries.iter().enumerate() {
        // Kinds are known of what is loaded.
        let kind = if entry.visible { kinds.next() } else { None };
        ui.push_id(number, |ui| {
            let mut changed = entry.clone();
            if head(ui, &mut changed) {
                window.document.change(|scene| {
                    scene.inputs.remove(number);
                });
                return;
            }
            if kind.is_some_and(|kind| kind & (given::MESH | given::CLOUD) != 0) {
                surface(ui, &mut changed);
            }
            if changed != *entry {
                window.document.change(|scene| scene.inputs[number] = changed);
            }
        });
    }
    if ui.button("Add…").clicked() {
        window.panels.ask(Ask::Open);
    }
}

/// Shows the name of an input. Returns whether it is to be removed.
fn head(ui: &mut Ui, entry: &mut InputEntry) -> bool {
    let name = entry.file.file_name().unwrap_or(entry.file.as_os_str());
    let name = name.to_string_lossy().into_owned();
    let path = entry.file.display().to_string();
    let row = ui.horizontal(|ui| {
        ui.checkbox(&mut entry.visible, &*name).on_hover_text(path);
        ui.small_button("×").on_hover_text(format!("Remove {name}")).clicked()
    });
    row.inner
}

/// Shows the colour and the opacity of a surface.
fn surface(ui: &mut Ui, entry: &mut InputEntry) {
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        let text = entry.appearance.color.as_ref().map(ToString::to_string).unwrap_or_default();
        let hint = "colour, attribute, height, …";
        if let Some(color) = edited(ui, "color", "Own colour", &text, hint) {
            entry.appearance.color = color.parse().ok();
        }
    });
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        let id = ui.scope_id().with("opacity");
        let current = f64::from(entry.appearance.opacity.unwrap_or(1.0));
        let mut opacity = ui.data(|data| data.get_temp::<f64>(id)).unwrap_or(current);
        let label = ui.label("Opacity");
        let field = DragValue::new(&mut opacity).range(0.01..=1.0).speed(0.005);
        let response = ui.add(field.update_while_editing(false)).labelled_by(label.id);
        // The splats are made anew: once, at the end of a drag.
        if response.dragged() {
            ui.data_mut(|data| data.insert_temp(id, opacity));
        } else {
            ui.data_mut(|data| data.remove::<f64>(id));
            if opacity != current {
                entry.appearance.opacity = Some(opacity as f32).filter(|value| *value < 1.0);
            }
        }
    });
}

//! How the scene looks: background, light, texts, and flags with values.

use crate::view::window::Window;
use eframe::egui::{self, Grid, Ui};
use serde_json::Value;

/// Backgrounds to choose from.
const BACKGROUNDS: [&str; 5] = ["black", "white", "#10141c", "gray", "none"];

/// Returns an option as a text.
fn text_option(window: &Window, name: &str) -> String {
    match window.document.scene().options.get(name) {
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
        None => String::new(),
    }
}

/// Sets or removes an option as a step.
fn set_option(window: &mut Window, name: &str, value: Option<Value>) {
    window.document.change(|scene| match value {
        Some(value) => {
            scene.options.insert(name.to_owned(), value);
        }
        None => {
            scene.options.remove(name);
        }
    });
}

/// Shows a switch for a flag without a value.
fn switch(window: &mut Window, ui: &mut Ui, name: &str, label: &str) {
    let mut on = window.document.scene().options.contains_key(name);
    if ui.checkbox(&mut on, label).changed() {
        set_option(window, name, on.then_some(Value::Bool(true)));
    }
}

/// Shows a text that counts once it is left. Returns it if it changed.
pub fn edited(ui: &mut Ui, name: &str, label: &str, own: &str, hint: &str) -> Option<String> {
    let id = ui.scope_id().with(name);
    let held = ui.data(|data| data.get_temp::<String>(id));
    let mut text = held.unwrap_or_else(|| own.to_owned());
    let label = ui.label(label);
    let response = ui.add(egui::TextEdit::singleline(&mut text).hint_text(hint));
    let response = response.labelled_by(label.id);
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
        return None;
    }
    ui.data_mut(|data| data.remove::<String>(id));
    (response.lost_focus() && text != own).then(|| text.trim().to_owned())
}

/// Shows a field for a flag with a value.
fn field(window: &mut Window, ui: &mut Ui, name: &str, label: &str, hint: &str) {
    let own = text_option(window, name);
    if let Some(text) = edited(ui, name, label, &own, hint) {
        set_option(window, name, Some(text).filter(|text| !text.is_empty()).map(Value::String));
    }
    ui.end_row();
}

pub fn show(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let label = ui.label("Background");
        let own = text_option(window, "background");
        let own = if own.is_empty() { "black".to_owned() } else { own };
        let choice = egui::ComboBox::from_id_salt("background").selected_text(&own);
        let shown = choice.show_ui(ui, |ui| {
            for name in BACKGROUNDS {
                if ui.selectable_label(own == name, name).clicked() {
                    set_option(window, "background", Some(Value::String(name.into())));
                }
            }
        });
        shown.response.labelled_by(label.id);
    });
    switch(window, ui, "no-shade", "Without light");
    switch(window, ui, "axes", "Axes");
    switch(window, ui, "scale-bar", "Scale bar");
    switch(window, ui, "scalar-bar", "Scalar bar");
    Grid::new("look").num_columns(2).show(ui, |ui| {
        field(window, ui, "color", "Colour", "a colour, a map, height, …");
        field(window, ui, "scalar", "Array", "the file's first");
        field(window, ui, "range", "Range", "LOW,HIGH");
        field(window, ui, "iso", "Isosurface", "VALUE or 50%");
        field(window, ui, "radius-scale", "Radius", "1");
        field(window, ui, "cut", "Cut (pixels)", "2");
        field(window, ui, "up", "Up", "+Z");
        field(window, ui, "caption", "Caption", "");
    });
}

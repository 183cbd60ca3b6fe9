//! How the scene looks: background, light, texts, and flags with values.

use crate::{
    parse,
    show::surface,
    view::{window::Window, words::surfaces},
};
use eframe::egui::{self, Grid, Ui};
use splatkit::{
    about::direction_name,
    session::{Background, Description},
};

/// Backgrounds to choose from.
const BACKGROUNDS: [&str; 5] = ["black", "white", "#10141c", "gray", "none"];

/// Shows a switch.
fn switch(
    window: &mut Window,
    ui: &mut Ui,
    label: &str,
    is_on: bool,
    set: impl FnOnce(&mut Description, bool),
) {
    let mut on = is_on;
    if ui.checkbox(&mut on, label).changed() {
        window.document.change(|scene| set(scene, on));
    }
}

/// Shows a text that counts once it is left. Returns it if it changed.
pub fn edited(ui: &mut Ui, name: &str, label: &str, current: &str, hint: &str) -> Option<String> {
    let id = ui.scope_id().with(name);
    let held = ui.data(|data| data.get_temp::<String>(id));
    let mut text = held.unwrap_or_else(|| current.to_owned());
    let label = ui.label(label);
    let response = ui.add(egui::TextEdit::singleline(&mut text).hint_text(hint));
    let response = response.labelled_by(label.id);
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
        return None;
    }
    ui.data_mut(|data| data.remove::<String>(id));
    (response.lost_focus() && text != current).then(|| text.trim().to_owned())
}

/// A value that is edited as a text.
struct Field {
    name: &'static str,
    label: &'static str,
    hint: &'static str,
    /// Returns the text; an empty one stands for nothing.
    text: fn(&Description) -> String,
    /// Takes a text that is not empty, or nothing.
    set: fn(&mut Description, Option<&str>) -> Result<(), String>,
}

const FIELDS: [Field; 8] = [
    Field {
        name: "color",
        label: "Colour",
        hint: "a colour, height, an attribute, …",
        text: |scene| text_of(&scene.appearance.color),
        set: |scene, text| taken(text, str::parse, &mut scene.appearance.color),
    },
    Field {
        name: "scalar",
        label: "Array",
        hint: "the file's first",
        text: |scene| text_of(&scene.reading.scalar),
        set: |scene, text| taken(text, |text| Ok(text.to_owned()), &mut scene.reading.scalar),
    },
    Field {
        name: "range",
        label: "Range",
        hint: "LOW,HIGH",
        text: |scene| {
            scene.appearance.range.map_or(String::new(), |[low, high]| format!("{low},{high}"))
        },
        set: |scene, text| taken(text, parse::range, &mut scene.appearance.range),
    },
    Field {
        name: "iso",
        label: "Isosurface",
        hint: "VALUE or 50%",
        text: |scene| scene.appearance.isosurfaces.as_deref().map_or(String::new(), surfaces),
        set: |scene, text| {
            let all = |text: &str| text.split(',').map(surface).collect();
            taken(text, all, &mut scene.appearance.isosurfaces)
        },
    },
    Field {
        name: "radius-scale",
        label: "Radius",
        hint: "1",
        text: |scene| text_of(&scene.appearance.radius_scale),
        set: |scene, text| taken(text, parse::radius_scale, &mut scene.appearance.radius_scale),
    },
    Field {
        name: "cut",
        label: "Cut (pixels)",
        hint: "2",
        text: |scene| text_of(&scene.picture.cut),
        set: |scene, text| taken(text, parse::not_negative, &mut scene.picture.cut),
    },
    Field {
        name: "up",
        label: "Up",
        hint: "+Z",
        text: |scene| scene.framing.up.map_or(String::new(), direction_name),
        set: |scene, text| taken(text, parse::direction, &mut scene.framing.up),
    },
    Field {
        name: "caption",
        label: "Caption",
        hint: "",
        text: |scene| text_of(&scene.overlay.caption),
        set: |scene, text| taken(text, |text| Ok(text.to_owned()), &mut scene.overlay.caption),
    },
];

fn text_of(value: &Option<impl ToString>) -> String {
    value.as_ref().map(ToString::to_string).unwrap_or_default()
}

/// Puts what a text stands for in its place.
fn taken<T>(
    text: Option<&str>,
    parse: impl Fn(&str) -> Result<T, String>,
    place: &mut Option<T>,
) -> Result<(), String> {
    *place = text.map(parse).transpose()?;
    Ok(())
}

/// Shows a value that is edited as a text.
fn field(window: &mut Window, ui: &mut Ui, field: &Field) {
    let current = (field.text)(window.document.scene());
    if let Some(text) = edited(ui, field.name, field.label, &current, field.hint) {
        let text = Some(text.as_str()).filter(|text| !text.is_empty());
        let mut changed = window.document.scene().clone();
        match (field.set)(&mut changed, text) {
            Ok(()) => window.document.change(|scene| *scene = changed),
            Err(message) => window.say(format!("{}: {message}", field.label), true),
        }
    }
    ui.end_row();
}

pub fn show(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let label = ui.label("Background");
        let current = window.document.scene().picture.background;
        let is_current = |name: &str| name.parse::<Background>().ok() == current;
        let name = BACKGROUNDS.into_iter().find(|name| is_current(name)).unwrap_or(match current {
            None => "black",
            Some(_) => "another colour",
        });
        let choice = egui::ComboBox::from_id_salt("background").selected_text(name);
        let list = choice.show_ui(ui, |ui| {
            for choice in BACKGROUNDS {
                if ui.selectable_label(choice == name, choice).clicked() {
                    window.document.change(|scene| scene.picture.background = choice.parse().ok());
                }
            }
        });
        list.response.labelled_by(label.id);
    });
    let scene = window.document.scene();
    let (overlay, is_dark) = (scene.overlay.clone(), scene.picture.shade == Some(false));
    switch(window, ui, "Without light", is_dark, |scene, on| {
        scene.picture.shade = on.then_some(false);
    });
    switch(window, ui, "Axes", overlay.axes, |scene, on| scene.overlay.axes = on);
    switch(window, ui, "Scale bar", overlay.scale_bar, |scene, on| scene.overlay.scale_bar = on);
    switch(window, ui, "Scalar bar", overlay.scalar_bar, |scene, on| scene.overlay.scalar_bar = on);
    Grid::new("look").num_columns(2).show(ui, |ui| {
        FIELDS.iter().for_each(|entry| field(window, ui, entry));
    });
}

//! Lists to choose from, and colours to pick.

use crate::view::curve::swatch;
use eframe::egui::{ComboBox, Id, Ui};
use splatkit::color::ColorMap;

/// Height of a list in points, at most.
const HEIGHT: f32 = 400.0;

/// Shows a list. Returns the entry that was chosen, if it is another than the current one.
pub fn choice<T: PartialEq>(
    ui: &mut Ui,
    label: &str,
    entries: impl IntoIterator<Item = (String, T)>,
    current: &T,
    current_name: Option<&str>,
) -> Option<T> {
    let entries: Vec<(String, T)> = entries.into_iter().collect();
    let listed = entries.iter().find(|(_, entry)| entry == current);
    let name = listed.map(|(name, _)| name.as_str()).or(current_name).unwrap_or("another");
    let label = ui.label(label);
    let list = ComboBox::from_id_salt(label.id).selected_text(name).truncate().height(HEIGHT);
    let mut chosen = None;
    let list = list.show_ui(ui, |ui| {
        for (name, entry) in entries {
            let is_current = entry == *current;
            if ui.selectable_label(is_current, name).clicked() && !is_current {
                chosen = Some(entry);
            }
        }
    });
    list.response.labelled_by(label.id);
    chosen
}

/// Shows a list of the colour maps, with their colours. Returns what was chosen, if it is another
/// than the current one.
pub fn map(ui: &mut Ui, label: &str, current: Option<ColorMap>) -> Option<Option<ColorMap>> {
    let label = ui.label(label);
    let name = current.map_or_else(|| "automatic".to_owned(), |map| map.to_string());
    let mut chosen = None;
    let list = ComboBox::from_id_salt(label.id).selected_text(name).height(HEIGHT);
    let list = list.show_ui(ui, |ui| {
        if ui.selectable_label(current.is_none(), "automatic").clicked() {
            chosen = Some(None);
        }
        for map in ColorMap::NAMES.into_iter().filter_map(|name| ColorMap::named(name).ok()) {
            ui.horizontal(|ui| {
                swatch(ui, map);
                if ui.selectable_label(current == Some(map), map.to_string()).clicked() {
                    chosen = Some(Some(map));
                    ui.close();
                }
            });
        }
    });
    list.response.labelled_by(label.id);
    chosen.filter(|map| *map != current)
}

/// Shows a colour as a button that opens a picker. Returns another colour once the hand rests, so
/// that what is costly to colour is coloured once.
pub fn color(ui: &mut Ui, name: &str, current: [f32; 3]) -> Option<[f32; 3]> {
    let bytes = current.map(|part| (part * 255.0).round() as u8);
    let picked = held(ui, name, bytes, |ui, bytes| {
        let button = ui.color_edit_button_srgb(bytes);
        button.accessible_name(name);
    });
    picked.map(|bytes| bytes.map(|part| f32::from(part) / 255.0))
}

/// Shows a widget that edits a value. Returns another value once no button of the pointer is held.
pub fn held<T: Clone + PartialEq + Send + Sync + 'static>(
    ui: &mut Ui,
    name: &str,
    current: T,
    edit: impl FnOnce(&mut Ui, &mut T),
) -> Option<T> {
    let id: Id = ui.scope_id().with(("held", name));
    let mut value = ui.data(|data| data.get_temp::<T>(id)).unwrap_or_else(|| current.clone());
    edit(ui, &mut value);
    if value == current {
        ui.data_mut(|data| data.remove::<T>(id));
        return None;
    }
    if ui.input(|input| input.pointer.any_down()) {
        ui.data_mut(|data| data.insert_temp(id, value));
        return None;
    }
    ui.data_mut(|data| data.remove::<T>(id));
    Some(value)
}

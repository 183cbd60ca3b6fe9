//! The menu of functions and colour maps by name.

use super::{plain, plot::Zoom, swatch};
use eframe::egui::{Button, Ui};
use splatkit::{color::ColorMap, session::visible_range_of, volume::TransferFunction};

/// The Hounsfield units that are spread over the values of other data: from air to dense bone.
const HOUNSFIELD: [f64; 2] = [-1000.0, 1200.0];

/// The data that a function is chosen for.
pub struct Data {
    /// The smallest and the largest value.
    pub values: [f64; 2],
    /// The diagonal of the data's box, in world units.
    pub diagonal: f64,
    pub is_hounsfield: bool,
}

/// Shows the menu. A function by name replaces all but the factors of the gradient. A colour map
/// replaces the colours of the values that are shown. Returns what is to be said about the choice.
pub fn menu(
    ui: &mut Ui,
    transfer: &mut TransferFunction,
    data: &Data,
    zoom: &mut Zoom,
) -> Option<String> {
    let mut note = None;
    ui.menu_button("Presets", |ui| {
        let [low, high] = data.values.map(plain);
        if !data.is_hounsfield {
            ui.weak("The values are not in Hounsfield units:");
            ui.weak("presets of CT are spread over their range.");
        }
        for name in TransferFunction::NAMES {
            let Some(named) = preset(name, data) else { continue };
            let button = ui.add_enabled(shows(&named, data.values), Button::new(name));
            let empty = format!("{name} shows no value between {low} and {high}");
            if button.on_disabled_hover_text(empty).clicked() {
                let gradient = std::mem::take(&mut transfer.gradient);
                *transfer = TransferFunction { gradient, ..named };
                note = is_spread(name, data).then(|| {
                    format!(
                        "{name}: the values are not in Hounsfield units; the preset is spread \
                         over {low} to {high}"
                    )
                });
                zoom.reset();
                ui.close();
            }
        }
        ui.separator();
        ui.menu_button("Colours", |ui| colors(ui, transfer, data.values));
        if ui.button("Reverse colours").clicked() {
            reverse(transfer);
            ui.close();
        }
    });
    note
}

/// Shows the colour maps.
fn colors(ui: &mut Ui, transfer: &mut TransferFunction, values: [f64; 2]) {
    for map in ColorMap::NAMES.into_iter().filter_map(|name| ColorMap::named(name).ok()) {
        ui.horizontal(|ui| {
            swatch(ui, map);
            if ui.button(map.to_string()).clicked() {
                spread(transfer, map, values);
                ui.close();
            }
        });
    }
}

/// Returns whether a preset for Hounsfield units is spread over the values of other data.
fn is_spread(name: &str, data: &Data) -> bool {
    name.starts_with("ct-") && !data.is_hounsfield
}

/// Returns the function of a name for the data; `None` if their range is none.
fn preset(name: &str, data: &Data) -> Option<TransferFunction> {
    let mut named = TransferFunction::named(name, data.values).ok()?.for_size(data.diagonal);
    if is_spread(name, data) {
        let [low, high] = data.values;
        let scale = (high - low) / (HOUNSFIELD[1] - HOUNSFIELD[0]);
        let place = |value: f64| low + (value - HOUNSFIELD[0]) * scale;
        named.color.iter_mut().for_each(|point| point.0 = place(point.0));
        named.opacity.iter_mut().for_each(|point| point.0 = place(point.0));
    }
    Some(named)
}

/// Returns whether a function gives any of the values an opacity.
fn shows(transfer: &TransferFunction, [low, high]: [f64; 2]) -> bool {
    let inside = transfer.opacity.iter().map(|point| point.0).filter(|v| (low..=high).contains(v));
    let mut values = inside.chain([low, high]);
    values.any(|value| transfer.opacity(value) > 0.0)
}

/// Spreads a colour map over the values that the function shows.
fn spread(transfer: &mut TransferFunction, map: ColorMap, values: [f64; 2]) {
    let [low, high] = visible_range_of(transfer, values);
    let point = |(share, color)| (low + (high - low) * share, color);
    transfer.color = map.points().into_iter().map(point).collect();
}

/// Turns the colours around; their values stay.
fn reverse(transfer: &mut TransferFunction) {
    let colors: Vec<[f64; 3]> = transfer.color.iter().rev().map(|point| point.1).collect();
    transfer.color.iter_mut().zip(colors).for_each(|(point, color)| point.1 = color);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(values: [f64; 2], is_hounsfield: bool) -> Data {
        Data { values, diagonal: 350.0, is_hounsfield }
    }

    #[test]
    fn presets_of_ct_fit_values_that_are_not_hounsfield_units() {
        for values in [[0.0, 255.0], [0.0, 65535.0], [-1.0, 1.0]] {
            for name in TransferFunction::NAMES {
                let fitted = preset(name, &data(values, false)).expect("a preset");
                fitted.validate().expect("valid");
                assert!(shows(&fitted, values), "{name} shows nothing of {values:?}");
                let inside = |point: &(f64, f64)| (values[0]..=values[1]).contains(&point.0);
                assert!(fitted.opacity.iter().all(inside), "{name}: {:?}", fitted.opacity);
            }
        }
        let bone = preset("ct-bone", &data([0.0, 2200.0], false)).expect("a preset");
        assert_eq!(bone.opacity[0].0, 1150.0);
    }

    #[test]
    fn hounsfield_units_stay_what_they_are() {
        let values = [-1024.0, 3071.0];
        let bone = preset("ct-bone", &data(values, true)).expect("a preset");
        assert_eq!(bone, TransferFunction::named("ct-bone", values).expect("a preset"));
        let lung = preset("ct-lung", &data([0.0, 3000.0], true)).expect("a preset");
        assert!(!shows(&lung, [0.0, 3000.0]), "air is not among these values");
    }

    #[test]
    fn maps_span_what_is_shown() {
        let mut transfer = TransferFunction {
            opacity: vec![(20.0, 0.0), (40.0, 0.5), (60.0, 0.0)],
            ..TransferFunction::default()
        };
        spread(&mut transfer, ColorMap::GRAY, [0.0, 255.0]);
        assert_eq!(transfer.color, [(20.0, [0.0; 3]), (60.0, [1.0; 3])]);
        reverse(&mut transfer);
        assert_eq!(transfer.color, [(20.0, [1.0; 3]), (60.0, [0.0; 3])]);
    }
}

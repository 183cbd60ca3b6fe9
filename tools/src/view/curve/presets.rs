//! The menu of functions and colour maps by name.

use super::plot::Zoom;
use eframe::egui::Ui;
use splatkit::{color::ColorMap, session::visible_range_of, volume::TransferFunction};

/// Shows the menu. A function by name replaces all but the factors of the gradient; `diagonal` is
/// that of the data's box. A colour map replaces the colours of the values that are shown.
pub fn menu(
    ui: &mut Ui,
    transfer: &mut TransferFunction,
    values: [f64; 2],
    diagonal: f64,
    zoom: &mut Zoom,
) {
    ui.menu_button("Presets", |ui| {
        for name in TransferFunction::NAMES {
            if ui.button(name).clicked()
                && let Ok(named) = TransferFunction::named(name, values)
            {
                let gradient = std::mem::take(&mut transfer.gradient);
                *transfer = TransferFunction { gradient, ..named.for_size(diagonal) };
                zoom.reset();
                ui.close();
            }
        }
        ui.separator();
        ui.menu_button("Colours", |ui| {
            for name in ColorMap::NAMES {
                if ui.button(name).clicked()
                    && let Ok(map) = ColorMap::named(name)
                {
                    spread(transfer, map, values);
                    ui.close();
                }
            }
        });
        if ui.button("Reverse colours").clicked() {
            reverse(transfer);
            ui.close();
        }
    });
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

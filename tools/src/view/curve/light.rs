//! The light on gradients, and the length that opacities hold for.

use super::number::number;
use eframe::egui::{CollapsingHeader, Grid, Ui};
use splatkit::volume::{Shade, TransferFunction};

/// Shows the light and the opacity unit, folded at first: few people change them. `last` is the
/// light that comes back when it is switched on.
pub fn show(ui: &mut Ui, transfer: &mut TransferFunction, last: &mut Shade) {
    CollapsingHeader::new("Light, opacity unit").show(ui, |ui| numbers(ui, transfer, last));
}

fn numbers(ui: &mut Ui, transfer: &mut TransferFunction, last: &mut Shade) {
    let mut is_lit = transfer.shade.is_some();
    if ui.checkbox(&mut is_lit, "Light").changed() {
        transfer.shade = is_lit.then_some(*last);
    }
    if let Some(shade) = &mut transfer.shade {
        Grid::new("light").num_columns(4).show(ui, |ui| {
            number(ui, "Ambient", &mut shade.ambient, 0.0..=2.0, 0.005);
            number(ui, "Diffuse", &mut shade.diffuse, 0.0..=2.0, 0.005);
            ui.end_row();
            number(ui, "Specular", &mut shade.specular, 0.0..=2.0, 0.005);
            number(ui, "Power", &mut shade.power, 0.0..=500.0, 0.2);
        });
        *last = *shade;
    }
    ui.horizontal_wrapped(|ui| {
        let speed = 0.005 * transfer.unit;
        number(ui, "Opacity unit", &mut transfer.unit, 1e-12..=1e12, speed)
            .on_hover_text("The world length that the opacities hold for");
    });
}

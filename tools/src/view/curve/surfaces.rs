//! The isosurfaces: vertical lines in the plot, and a list.

use super::{
    number::{color, field},
    plot::Plot,
    points::{Change, sense},
};
use eframe::egui::{Color32, Slider, SliderClamping, Ui, Vec2, pos2};
use splatkit::volume::{Isosurface, TransferFunction};

/// Draws each surface as a vertical line, which can be dragged by its upper end and removed there.
pub fn lines(ui: &Ui, plot: &Plot, surfaces: &mut Vec<Isosurface>, grab: &mut Vec2) {
    let handle = |surface: &Isosurface| pos2(plot.x(surface.value), plot.rect.top() + 7.0);
    let handles: Vec<_> = surfaces.iter().map(handle).collect();
    let painter = ui.painter_at(plot.rect);
    for (surface, at) in surfaces.iter().zip(&handles) {
        let [r, g, b] = surface.color.map(|part| (part * 255.0).round() as u8);
        let color = Color32::from_rgb(r, g, b);
        painter.vline(at.x, plot.rect.y_range(), (2.0, color));
        painter.circle(*at, 4.0, color, (1.0, ui.visuals().strong_text_color()));
    }
    match sense(ui, "Isosurface", &handles, plot.rect, grab) {
        Some(Change::Move(i, pointer)) => surfaces[i].value = plot.value(pointer.x),
        Some(Change::Remove(i)) => drop(surfaces.remove(i)),
        Some(Change::Select(_)) | None => {}
    }
}

/// Shows value, colour and opacity of each surface. `range`: the values in the plot.
pub fn list(ui: &mut Ui, transfer: &mut TransferFunction, range: [f64; 2]) {
    let mut removed = None;
    for (i, surface) in transfer.isosurfaces.iter_mut().enumerate() {
        let of = format!("of isosurface {}", i + 1);
        ui.horizontal(|ui| {
            color(ui, &format!("Colour {of}"), &mut surface.color);
            let slider = Slider::new(&mut surface.value, range[0]..=range[1])
                .clamping(SliderClamping::Edits)
                .show_value(false);
            ui.add(slider).accessible_name(format!("Slider {of}"));
            let speed = (range[1] - range[0]) / 500.0;
            ui.add(field(&mut surface.value, f64::MIN..=f64::MAX, speed))
                .accessible_name(format!("Value {of}"));
            ui.add(field(&mut surface.opacity, 0.001..=1.0, 0.005))
                .accessible_name(format!("Opacity {of}"))
                .on_hover_text("The fraction of light that the surface absorbs");
            let remove = ui.button("Remove").accessible_name(format!("Removal {of}"));
            if remove.clicked() {
                removed = Some(i);
            }
        });
    }
    if let Some(i) = removed {
        transfer.isosurfaces.remove(i);
    }
    let has_room = transfer.isosurfaces.len() < TransferFunction::MAX_ISOSURFACES;
    ui.add_enabled_ui(has_room, |ui| {
        if ui.button("Add isosurface").clicked() {
            let value = 0.5 * (range[0] + range[1]);
            let color = transfer.color(value);
            transfer.isosurfaces.push(Isosurface { value, color, opacity: 1.0 });
        }
    });
}

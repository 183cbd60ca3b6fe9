//! The colours of a map, as a bar beside its name.

use eframe::egui::{Color32, Mesh, Rect, Sense, Ui, pos2, vec2};
use splatkit::color::ColorMap;

/// Size of the bar in points, and the number of its colours.
const BAR: [f32; 2] = [72.0, 12.0];
const PARTS: usize = 36;

/// Shows the colours of a map.
pub fn swatch(ui: &mut Ui, map: ColorMap) {
    let (rect, _) = ui.allocate_exact_size(vec2(BAR[0], BAR[1]), Sense::hover());
    let mut mesh = Mesh::default();
    let width = rect.width() / PARTS as f32;
    for part in 0..PARTS {
        let share = (part as f64 + 0.5) / PARTS as f64;
        let [r, g, b] = map.color(share).map(|part| (part * 255.0).round() as u8);
        let left = rect.left() + width * part as f32;
        let column = Rect::from_min_max(pos2(left, rect.top()), pos2(left + width, rect.bottom()));
        mesh.add_colored_rect(column, Color32::from_rgb(r, g, b));
    }
    ui.painter().add(mesh);
}

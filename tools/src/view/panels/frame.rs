//! What the frame that is shown has cost.

use crate::view::painter::Frame;
use eframe::egui::{Grid, Ui};

/// Shows the counts and the times of a frame. `delay`: how long after its order it was here, in
/// milliseconds.
pub fn show(ui: &mut Ui, frame: &Frame, delay: f64, device: &str) {
    let stats = &frame.stats;
    let [width, height] = [frame.picture.width, frame.picture.height];
    Grid::new("frame").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        };
        row("Pixels", format!("{width} × {height}"));
        row("Splats", stats.splats.to_string());
        row("Hidden", stats.hidden.to_string());
        row("Entries", stats.entries.to_string());
        row("Passes", stats.passes.to_string());
        row("Missing pages", stats.missing_pages.to_string());
        row("Memory", format!("{:.1} MiB", stats.gpu_bytes as f64 / f64::from(1 << 20)));
        row("Frame", format!("{:.1} ms", frame.milliseconds));
        row("Behind the hand", format!("{delay:.1} ms"));
        row("Device", device.to_owned());
    });
}

//! The histograms behind the curves.

use super::plot::Plot;
use eframe::egui::{Color32, ColorImage, Mesh, Rect, TextureHandle, TextureOptions, Ui, pos2};
use splatkit::interaction::{Histogram, Joint};

/// Draws how often each value is. The highest bar that is shown fills the plot.
pub fn bars(ui: &Ui, plot: &Plot, histogram: &Histogram, is_log: bool) {
    let [low, high] = histogram.range;
    let bins = histogram.counts.len();
    if bins == 0 {
        return;
    }
    let bin = |value: f64| {
        let scale = if high > low { bins as f64 / (high - low) } else { 0.0 };
        // Casts clamp negative numbers to 0.
        (((value - low) * scale) as usize).min(bins - 1)
    };
    let most = |[left, right]: [f32; 2]| {
        let (from, to) = (plot.value(left), plot.value(right));
        let apart = to < low || from > high;
        if apart {
            0
        } else {
            histogram.counts[bin(from)..=bin(to)].iter().copied().max().unwrap_or(0)
        }
    };
    let columns: Vec<([f32; 2], u64)> = plot.columns().map(|sides| (sides, most(sides))).collect();
    let largest = columns.iter().map(|column| column.1).max().unwrap_or(0);
    let color = ui.visuals().weak_text_color().gamma_multiply(0.5);
    let mut mesh = Mesh::default();
    for ([left, right], count) in columns.into_iter().filter(|column| column.1 > 0) {
        let top = plot.rect.bottom() - plot.rect.height() * height(count, largest, is_log);
        let bar = Rect::from_min_max(pos2(left, top), pos2(right, plot.rect.bottom()));
        mesh.add_colored_rect(bar, color);
    }
    ui.painter_at(plot.rect).add(mesh);
}

/// Returns the height of a count as a share of the largest one's.
fn height(count: u64, largest: u64, is_log: bool) -> f32 {
    let [count, largest] = [count, largest].map(|count| count as f64);
    let share = if is_log { count.ln_1p() / largest.ln_1p() } else { count / largest };
    if share.is_finite() { share as f32 } else { 0.0 }
}

/// The picture of a joint histogram: magnitudes to the right, values up.
#[derive(Default)]
pub struct JointPicture {
    drawn: Option<(u64, TextureHandle)>,
}

impl JointPicture {
    /// Draws the part of the counts that the plot's magnitudes show.
    pub fn show(&mut self, ui: &Ui, plot: &Plot, joint: &Joint, is_log: bool) {
        let color = ui.visuals().weak_text_color();
        let key = key(joint, is_log, color);
        if self.drawn.as_ref().is_none_or(|(drawn, _)| *drawn != key) {
            let image = picture(joint, is_log, color);
            let texture = ui.ctx().load_texture("joint histogram", image, TextureOptions::LINEAR);
            self.drawn = Some((key, texture));
        }
        let Some((_, texture)) = &self.drawn else { return };
        let right = plot.x(joint.magnitude);
        let (left, rect) = (plot.x(0.0), plot.rect);
        if right > left {
            let place = Rect::from_min_max(pos2(left, rect.top()), pos2(right, rect.bottom()));
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter_at(rect).image(texture.id(), place, whole, Color32::WHITE);
        }
    }
}

/// A number that changes with what is drawn.
fn key(joint: &Joint, is_log: bool, color: Color32) -> u64 {
    let start = u64::from(u32::from_le_bytes(color.to_array())) << 1 | u64::from(is_log);
    let mix = |key: u64, count: &u64| key.wrapping_mul(0x0100_0000_01b3).wrapping_add(*count);
    joint.counts.iter().fold(start, mix)
}

fn picture(joint: &Joint, is_log: bool, color: Color32) -> ColorImage {
    let (rows, bins) = (Joint::ROWS, Histogram::BINS);
    let largest = joint.counts.iter().copied().max().unwrap_or(0);
    let pixel = |at: usize| {
        let (row, bin) = (at % rows, bins - 1 - at / rows);
        let count = joint.counts.get(row * bins + bin).copied().unwrap_or(0);
        color.gamma_multiply(height(count, largest, is_log))
    };
    ColorImage::new([rows, bins], (0..rows * bins).map(pixel).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_become_heights() {
        assert_eq!((height(5, 10, false), height(0, 10, true)), (0.5, 0.0));
        assert!((height(9, 99, true) - 0.5).abs() < 1e-6);
        assert_eq!(height(0, 0, false), 0.0);
    }

    #[test]
    fn the_picture_has_values_up_and_magnitudes_to_the_right() {
        let mut joint = Joint { magnitude: 1.0, counts: vec![0; Joint::ROWS * Histogram::BINS] };
        joint.counts[2 * Histogram::BINS + 255] = 7;
        let image = picture(&joint, false, Color32::WHITE);
        assert_eq!(image.pixels[2], Color32::WHITE);
        assert_eq!(image.pixels.iter().filter(|pixel| pixel.a() > 0).count(), 1);
        let before = key(&joint, false, Color32::WHITE);
        joint.counts[0] = 1;
        assert_ne!(key(&joint, false, Color32::WHITE), before);
        assert_ne!(key(&joint, true, Color32::WHITE), key(&joint, false, Color32::WHITE));
    }
}

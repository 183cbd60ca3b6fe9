//! Scalar bars: the colours of values, with ticks at round numbers and a title.

use super::{
    canvas::{Align, Area, Canvas},
    ticks::{labels, ticks},
};
use glam::DVec2;
use splatkit::session::Legend;

/// Sizes in heights of letters.
const WIDTH: f64 = 0.9;
const TICK: f64 = 0.3;
const GAP: f64 = 0.35;
/// Distance of the lines of a list of labels.
const LINE: f64 = 1.5;

/// A bar with its ticks, laid out for a canvas.
pub struct Laid<'a> {
    bar: &'a Legend,
    ticks: Vec<(f64, String)>,
    /// The lines of the title.
    title: Vec<String>,
    /// The labels that are listed instead of a bar, and the text behind them.
    labels: Vec<([f32; 3], String)>,
    rest: String,
    /// How wide the bar with its labels and its title is.
    pub width: f64,
}

impl<'a> Laid<'a> {
    /// Lays out a bar that is so high, and with its title at most so wide.
    pub fn new(canvas: &Canvas, bar: &'a Legend, height: f64, most: f64) -> Self {
        let count = (height / (2.2 * canvas.size)).clamp(2.0, 10.0) as usize;
        let is_classes = bar.scale.map.is_categorical();
        let values = ticks(bar.scale.range, count, bar.scale.is_log);
        let texts = match bar.scale.is_log || is_classes {
            true => values.iter().flat_map(|value| labels(&[*value])).collect(),
            false => labels(&values),
        };
        let ticks: Vec<(f64, String)> = values.into_iter().zip(texts).collect();
        let widest = ticks.iter().map(|tick| canvas.text_width(&tick.1)).fold(0.0, f64::max);
        let (labels, rest) = Self::listed(bar, (height / (LINE * canvas.size)) as usize);
        let ticks = if labels.is_empty() { ticks } else { Vec::new() };
        let names = labels.iter().map(|label| canvas.text_width(&label.1));
        let widest = names.fold(widest, f64::max).max(canvas.text_width(&rest));
        let title = canvas.wrapped(&bar.title, most, 2);
        let of_title = title.iter().map(|line| canvas.text_width(line)).fold(0.0, f64::max);
        let width = ((WIDTH + TICK + GAP) * canvas.size + widest).max(of_title);
        Self { bar, ticks, title, labels, rest, width }
    }

    /// Returns the labels for which there is room, and a text about the others.
    fn listed(bar: &Legend, room: usize) -> (Vec<([f32; 3], String)>, String) {
        let count = bar.labels.len();
        if count <= room {
            return (bar.labels.clone(), String::new());
        }
        let kept = room.saturating_sub(1).max(1);
        (bar.labels[..kept].to_vec(), format!("… {} more", count - kept))
    }

    /// Draws the list of labels below the title.
    fn list(&self, canvas: &mut Canvas, area: Area, top: f64) {
        let (size, line) = (canvas.size, canvas.line_width());
        let left = area.right - self.width;
        for (place, (color, name)) in self.labels.iter().enumerate() {
            let y = top + (0.5 + place as f64 * LINE) * size;
            let half = 0.5 * WIDTH * size;
            let patch = Area { left, top: y - half, right: left + 2.0 * half, bottom: y + half };
            let ink = canvas.ink;
            canvas.fill(patch.grown(line), |_, _| (ink.color, 1.0));
            canvas.fill(patch, |_, _| (*color, 1.0));
            canvas.text(name, DVec2::new(patch.right + GAP * size, y), Align::Left);
        }
        let y = top + (0.5 + self.labels.len() as f64 * LINE) * size;
        canvas.text(&self.rest, DVec2::new(left, y), Align::Left);
    }

    /// Draws it with its right side at the right side of an area. The title takes the upper lines.
    pub fn draw(&self, canvas: &mut Canvas, area: Area, title_lines: usize) {
        let size = canvas.size;
        for (line, text) in self.title.iter().enumerate() {
            let missing = title_lines - self.title.len();
            let y = area.top + (0.5 + (line + missing) as f64 * 1.3) * size;
            canvas.text(text, DVec2::new(area.right, y), Align::Right);
        }
        let top = area.top + (title_lines as f64 * 1.3 + 0.5) * size;
        if !self.labels.is_empty() {
            self.list(canvas, area, top);
            return;
        }
        let labels = self.ticks.iter().map(|tick| canvas.text_width(&tick.1)).fold(0.0, f64::max);
        let right = area.right - labels - (TICK + GAP) * size;
        let bar = Area { left: right - WIDTH * size, top, right, bottom: area.bottom - 0.5 * size };
        let line = canvas.line_width();
        let (ink, edge) = (canvas.ink, canvas.edge_width());
        canvas.fill(bar.grown(line + edge), |_, _| (ink.edge, 0.85));
        canvas.fill(bar.grown(line), |_, _| (ink.color, 1.0));
        let colors = &self.bar.colors;
        canvas.fill(bar, |_, down| {
            let place = ((1.0 - down) * colors.len() as f64) as usize;
            (colors[place.min(colors.len() - 1)], 1.0)
        });
        for (value, text) in &self.ticks {
            let y = bar.bottom - self.bar.scale.share(*value) * bar.height();
            let from = DVec2::new(bar.right + 0.5 * line, y);
            canvas.lines(&[[from, from + DVec2::X * TICK * size]], line, ink.color);
            let at = from + DVec2::X * (TICK + GAP) * size;
            canvas.text(text, at, Align::Left);
        }
    }

    pub fn title_lines(&self) -> usize {
        self.title.len()
    }

    /// Returns what is drawn, for --json.
    pub fn to_json(&self) -> serde_json::Value {
        if !self.bar.labels.is_empty() {
            let names: Vec<&str> = self.bar.labels.iter().map(|label| label.1.as_str()).collect();
            return serde_json::json!({ "title": self.bar.title, "labels": names });
        }
        let ticks: Vec<f64> = self.ticks.iter().map(|tick| tick.0).collect();
        serde_json::json!({
            "title": self.bar.title,
            "range": self.bar.scale.range,
            "log": self.bar.scale.is_log,
            "ticks": ticks,
        })
    }
}

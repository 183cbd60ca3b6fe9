//! Scalar bars: the colours of values, with ticks at round numbers and a title.

use super::{
    canvas::{Align, Area, Canvas},
    ticks::{labels, ticks},
};
use crate::color::Bar;
use glam::DVec2;

/// Sizes in heights of letters.
const WIDTH: f64 = 0.9;
const TICK: f64 = 0.3;
const GAP: f64 = 0.35;

/// A bar with its ticks, laid out for a canvas.
pub struct Laid<'a> {
    bar: &'a Bar,
    ticks: Vec<(f64, String)>,
    /// The lines of the title.
    title: Vec<String>,
    /// How wide the bar with its labels and its title is.
    pub width: f64,
}

impl<'a> Laid<'a> {
    /// Lays out a bar that is so high, and with its title at most so wide.
    pub fn new(canvas: &Canvas, bar: &'a Bar, height: f64, most: f64) -> Self {
        let count = (height / (2.2 * canvas.size)).clamp(2.0, 10.0) as usize;
        let is_classes = bar.scale.map.is_categorical();
        let values = ticks(bar.scale.range, count, bar.scale.is_log);
        let texts = match bar.scale.is_log || is_classes {
            true => values.iter().flat_map(|value| labels(&[*value])).collect(),
            false => labels(&values),
        };
        let ticks: Vec<(f64, String)> = values.into_iter().zip(texts).collect();
        let widest = ticks.iter().map(|tick| canvas.text_width(&tick.1)).fold(0.0, f64::max);
        let title = canvas.wrapped(&bar.title, most, 2);
        let of_title = title.iter().map(|line| canvas.text_width(line)).fold(0.0, f64::max);
        let width = ((WIDTH + TICK + GAP) * canvas.size + widest).max(of_title);
        Self { bar, ticks, title, width }
    }

    /// Draws it with its right side at the right side of an area. The title takes the upper lines.
    pub fn draw(&self, canvas: &mut Canvas, area: Area, title_lines: usize) {
        let size = canvas.size;
        for (line, text) in self.title.iter().enumerate() {
            let missing = title_lines - self.title.len();
            let y = area.top + (0.5 + (line + missing) as f64 * 1.3) * size;
            canvas.text(text, DVec2::new(area.right, y), Align::Right);
        }
        let labels = self.ticks.iter().map(|tick| canvas.text_width(&tick.1)).fold(0.0, f64::max);
        let right = area.right - labels - (TICK + GAP) * size;
        let top = area.top + (title_lines as f64 * 1.3 + 0.5) * size;
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
        let ticks: Vec<f64> = self.ticks.iter().map(|tick| tick.0).collect();
        serde_json::json!({
            "title": self.bar.title,
            "range": self.bar.scale.range,
            "log": self.bar.scale.is_log,
            "ticks": ticks,
        })
    }
}

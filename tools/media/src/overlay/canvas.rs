//! Draws shapes and texts over a picture.

use super::text::{Face, Mask, Pen};
use glam::DVec2;
use splatkit::picture::Picture;

/// The colours of what is drawn over a picture: that of letters and lines, and that of the edge
/// around them, so that they show on anything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    pub color: [f32; 3],
    pub edge: [f32; 3],
}

/// A picture to draw on.
pub struct Canvas<'a> {
    pub picture: &'a mut Picture,
    pub face: &'a Face,
    pub ink: Ink,
    /// The height of letters in pixels, from which all other sizes follow.
    pub size: f64,
}

/// A rectangle in pixels: its left, top, right and bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

/// Where a text lies along a line: its share of the text's width that is left of the point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Align {
    Left,
    Middle,
    Right,
}

/// How opaque the edge around letters and lines is.
const EDGE: f32 = 0.85;

impl Ink {
    /// Returns white ink for dark backgrounds and for transparent ones, and dark ink for light
    /// ones.
    pub fn over(background: Option<[f32; 3]>) -> Self {
        let [r, g, b] = background.unwrap_or([0.0; 3]);
        // Luma of Rec. 709.
        if 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.5 {
            Self { color: [0.07; 3], edge: [1.0; 3] }
        } else {
            Self { color: [0.97; 3], edge: [0.0; 3] }
        }
    }
}

impl Area {
    pub fn width(&self) -> f64 {
        self.right - self.left
    }

    pub fn height(&self) -> f64 {
        self.bottom - self.top
    }

    pub fn grown(&self, by: f64) -> Self {
        Self {
            left: self.left - by,
            top: self.top - by,
            right: self.right + by,
            bottom: self.bottom + by,
        }
    }
}

impl Canvas<'_> {
    /// Returns the width of lines.
    pub fn line_width(&self) -> f64 {
        (self.size / 10.0).max(1.0)
    }

    /// Returns how far the edge reaches around letters and lines.
    pub fn edge_width(&self) -> f64 {
        (self.size / 9.0).max(1.0)
    }

    /// Lays a colour over a pixel, if it is in the picture.
    fn blend(&mut self, x: i64, y: i64, color: [f32; 3], opacity: f32) {
        let (width, height) = (i64::from(self.picture.width), i64::from(self.picture.height));
        if opacity <= 0.0 || x < 0 || y < 0 || x >= width || y >= height {
            return;
        }
        let pixel = &mut self.picture.color[(y * width + x) as usize];
        for (channel, color) in color.into_iter().enumerate() {
            pixel[channel] = color * opacity + pixel[channel] * (1.0 - opacity);
        }
        pixel[3] = opacity + pixel[3] * (1.0 - opacity);
    }

    /// Fills a rectangle; `color` returns the colour of a place in it, as shares of its width and
    /// height. Pixels that it covers in part are mixed.
    pub fn fill(&mut self, area: Area, color: impl Fn(f64, f64) -> ([f32; 3], f32)) {
        let covered = |low: f64, high: f64, at: i64| {
            ((at as f64 + 1.0).min(high) - (at as f64).max(low)).clamp(0.0, 1.0)
        };
        for y in area.top.floor() as i64..area.bottom.ceil() as i64 {
            for x in area.left.floor() as i64..area.right.ceil() as i64 {
                let share = covered(area.left, area.right, x) * covered(area.top, area.bottom, y);
                let across = (x as f64 + 0.5 - area.left) / area.width().max(1e-9);
                let down = (y as f64 + 0.5 - area.top) / area.height().max(1e-9);
                let (rgb, opacity) = color(across.clamp(0.0, 1.0), down.clamp(0.0, 1.0));
                self.blend(x, y, rgb, opacity * share as f32);
            }
        }
    }

    /// Draws straight lines with round ends, with one edge around all of them.
    pub fn lines(&mut self, lines: &[[DVec2; 2]], width: f64, color: [f32; 3]) {
        let edge = self.ink.edge;
        self.stroke(lines, 0.5 * width + self.edge_width(), edge, EDGE);
        self.stroke(lines, 0.5 * width, color, 1.0);
    }

    fn stroke(&mut self, lines: &[[DVec2; 2]], radius: f64, color: [f32; 3], opacity: f32) {
        let reach = radius + 1.0;
        let points = || lines.iter().flatten();
        let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = points().fold(none, |(low, high), p| (low.min(*p), high.max(*p)));
        let (low, high) = (low - reach, high + reach);
        if !(low.is_finite() && high.is_finite()) {
            return;
        }
        for y in low.y.floor() as i64..high.y.ceil() as i64 {
            for x in low.x.floor() as i64..high.x.ceil() as i64 {
                let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let far = lines.iter().map(|line| distance(at, *line)).fold(f64::MAX, f64::min);
                let share = (radius + 0.5 - far).clamp(0.0, 1.0);
                self.blend(x, y, color, opacity * share as f32);
            }
        }
    }

    /// Returns the width of a text, in pixels.
    pub fn text_width(&self, text: &str) -> f64 {
        self.face.width(text, self.size)
    }

    /// Cuts a line that is too wide. It ends with “…” then.
    pub fn shortened(&self, line: String, most: f64) -> String {
        let (mut pen, mut end) = (Pen::default(), None);
        for (at, letter) in line.char_indices() {
            // What fits with the mark of a cut behind it.
            let mut cut = pen;
            self.face.advance(&mut cut, '…', self.size);
            if f64::from(cut.width) <= most {
                end = Some(at);
            }
            self.face.advance(&mut pen, letter, self.size);
            if f64::from(pen.width) > most {
                return end.map_or_else(String::new, |end| format!("{}…", &line[..end]));
            }
        }
        line
    }

    /// Draws a line of text; `at` is where its middle line meets the point that `align` says.
    pub fn text(&mut self, text: &str, at: DVec2, align: Align) {
        let color = self.ink.color;
        self.colored_text(text, at, align, color);
    }

    /// As [`text`](Self::text), in a colour of its own.
    pub fn colored_text(&mut self, text: &str, at: DVec2, align: Align, color: [f32; 3]) {
        // Files name some texts, and letters beside the picture would take memory.
        let text = &self.shortened(text.to_owned(), f64::from(self.picture.width));
        let left = match align {
            Align::Left => at.x,
            Align::Middle => at.x - 0.5 * self.text_width(text),
            Align::Right => at.x - self.text_width(text),
        };
        let edge = self.edge_width();
        let mask =
            self.face.mask(text, DVec2::new(left, at.y), self.size, 2 * edge.ceil() as usize + 2);
        let around = mask.widened(edge);
        self.stamp(&around, self.ink.edge, EDGE);
        self.stamp(&mask, color, 1.0);
    }

    fn stamp(&mut self, mask: &Mask, color: [f32; 3], opacity: f32) {
        for (row, line) in mask.coverage.chunks_exact(mask.width.max(1)).enumerate() {
            for (column, share) in line.iter().enumerate() {
                let (x, y) = (mask.left + column as i64, mask.top + row as i64);
                self.blend(x, y, color, opacity * share);
            }
        }
    }
}

/// Returns the distance of a point from a line.
fn distance(point: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let way = to - from;
    let length = way.length_squared();
    let share = if length > 0.0 { ((point - from).dot(way) / length).clamp(0.0, 1.0) } else { 0.0 };
    point.distance(from + way * share)
}

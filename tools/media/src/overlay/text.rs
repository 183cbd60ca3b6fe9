//! Letters, drawn with the Ubuntu font (Ubuntu Font Licence 1.0).

use ab_glyph::{Font, FontRef, GlyphId, PxScale, ScaleFont};
use glam::DVec2;

/// The font, opened once.
pub struct Face {
    font: FontRef<'static>,
}

/// Where the next letter of a text begins.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pen {
    pub width: f32,
    before: Option<GlyphId>,
}

/// How much of each pixel of a rectangle a text covers, 0 to 1, row by row.
pub struct Mask {
    pub left: i64,
    pub top: i64,
    pub width: usize,
    pub coverage: Vec<f32>,
}

/// The light strokes of the font are widened by this part of the letters' height.
const BOLDER: f64 = 0.02;

impl Face {
    /// Opens the font that is built in; `None` if it is damaged.
    pub fn open() -> Option<Self> {
        FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok().map(|font| Self { font })
    }

    /// Returns the width of a text whose letters have this height.
    pub fn width(&self, text: &str, size: f64) -> f64 {
        let mut pen = Pen::default();
        text.chars().for_each(|letter| self.advance(&mut pen, letter, size));
        pen.width.into()
    }

    /// Moves a pen behind the next letter of a text.
    pub fn advance(&self, pen: &mut Pen, letter: char, size: f64) {
        let font = self.font.as_scaled(PxScale::from(size as f32));
        let glyph = font.glyph_id(letter);
        pen.width += pen.before.map_or(0.0, |before| font.kern(before, glyph));
        pen.width += font.h_advance(glyph);
        pen.before = Some(glyph);
    }

    /// Draws a text that begins at the left of a line; `at.y` is the middle of its capitals.
    /// Letters that the font lacks appear as boxes. The rectangle has a margin of so many pixels.
    pub fn mask(&self, text: &str, at: DVec2, size: f64, margin: usize) -> Mask {
        let scale = PxScale::from(size as f32);
        let font = self.font.as_scaled(scale);
        let margin = margin as f64;
        // Capitals of the font are 0.69 of its size high.
        let baseline = at.y + 0.5 * CAPITALS * size;
        let (left, top) = ((at.x - margin).floor(), (baseline - size - margin).floor());
        let width = (self.width(text, size) + 2.0 * margin + size).ceil() as usize;
        let height = (1.4 * size + 2.0 * margin).ceil() as usize;
        let mut mask =
            Mask { left: left as i64, top: top as i64, width, coverage: vec![0.0; width * height] };
        let mut pen = at.x as f32;
        let mut before = None;
        for letter in text.chars() {
            let id = font.glyph_id(letter);
            pen += before.map_or(0.0, |before| font.kern(before, id));
            let place = ab_glyph::point(pen - left as f32, (baseline - top) as f32);
            let glyph = id.with_scale_and_position(scale, place);
            if let Some(outline) = self.font.outline_glyph(glyph) {
                let corner = outline.px_bounds().min;
                outline.draw(|x, y, share| {
                    let (x, y) = (corner.x as i64 + i64::from(x), corner.y as i64 + i64::from(y));
                    mask.add(x, y, share);
                });
            }
            pen += font.h_advance(id);
            before = Some(id);
        }
        mask.widened((BOLDER * size).clamp(0.35, 8.0))
    }
}

/// The height of capitals, as a part of a font's size.
const CAPITALS: f64 = 0.69;

/// The largest radius, in pixels, by which strokes are widened offset by offset.
const FEW: f64 = 3.5;

impl Mask {
    fn add(&mut self, x: i64, y: i64, share: f32) {
        let height = self.coverage.len() / self.width.max(1);
        if x >= 0 && y >= 0 && (x as usize) < self.width && (y as usize) < height {
            let at = &mut self.coverage[y as usize * self.width + x as usize];
            *at = at.max(share.clamp(0.0, 1.0));
        }
    }

    /// Returns the mask with every stroke wider by a radius on each side.
    pub fn widened(&self, radius: f64) -> Self {
        if radius > FEW {
            return self.widened_much(radius);
        }
        let mut wider = Self { coverage: self.coverage.clone(), ..*self };
        let reach = radius.ceil() as i64;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let far = ((dx * dx + dy * dy) as f64).sqrt();
                let share = (radius + 1.0 - far).clamp(0.0, 1.0) as f32;
                if share > 0.0 && far > 0.0 {
                    wider.lay(self, dx, dy, share);
                }
            }
        }
        wider
    }

    /// As [`widened`](Self::widened), in a time that grows with the radius and not with its square:
    /// the largest coverage of each row of a disc is looked up in tables of runs.
    fn widened_much(&self, radius: f64) -> Self {
        let mut wider = Self { coverage: self.coverage.clone(), ..*self };
        let reach = radius.round() as i64;
        // Runs of 1, 2, 4, … pixels that begin at each pixel.
        let mut runs = vec![self.coverage.clone()];
        while 1 << runs.len() <= 2 * reach + 1 {
            let (last, half) = (&runs[runs.len() - 1], 1 << (runs.len() - 1));
            let longer = last.iter().enumerate();
            let next = |at: usize| if at < last.len() { last[at] } else { 0.0 };
            runs.push(longer.map(|(at, run)| run.max(next(at + half))).collect());
        }
        let (width, height) = (self.width as i64, (self.coverage.len() / self.width.max(1)) as i64);
        for dy in -reach..=reach {
            let half = ((radius + 0.5).powi(2) - (dy * dy) as f64).max(0.0).sqrt() as i64;
            let level = (2 * half + 1).ilog2() as usize;
            let other = 2 * half + 1 - (1 << level);
            for y in dy.max(0)..(height + dy).min(height) {
                // The margin is twice as wide as strokes reach, so runs keep to their row.
                for x in half..width - half {
                    let from = ((y - dy) * width + x - half) as usize;
                    let run = &runs[level];
                    let most = run[from].max(run[from + other as usize]);
                    let pixel = &mut wider.coverage[(y * width + x) as usize];
                    *pixel = pixel.max(most);
                }
            }
        }
        wider
    }

    /// Takes the larger of the own coverage and that of another mask, moved and weakened.
    fn lay(&mut self, other: &Self, dx: i64, dy: i64, share: f32) {
        let width = self.width as i64;
        let height = self.coverage.len() as i64 / width.max(1);
        for y in dy.max(0)..(height + dy).min(height) {
            let (from, to) = (dx.max(0), (width + dx).min(width));
            if from >= to {
                continue;
            }
            let row = &mut self.coverage[(y * width) as usize..][from as usize..to as usize];
            let source = &other.coverage[((y - dy) * width) as usize..]
                [(from - dx) as usize..(to - dx) as usize];
            for (pixel, other) in row.iter_mut().zip(source) {
                *pixel = pixel.max(other * share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_edges_are_as_wide_as_narrow_ones() {
        let mut mask = Mask { left: 0, top: 0, width: 80, coverage: vec![0.0; 6400] };
        mask.add(40, 40, 1.0);
        for radius in [2.0, 3.0, 6.0, 11.0] {
            let wider = mask.widened(radius);
            let area: f32 = wider.coverage.iter().sum();
            let disc = std::f64::consts::PI * (radius + 0.5).powi(2);
            assert!((f64::from(area) / disc - 1.0).abs() < 0.16, "{radius}: {area}, {disc}");
            let at = |x: usize, y: usize| wider.coverage[y * 80 + x];
            let far = radius as usize + 2;
            assert_eq!((at(40 + radius as usize, 40), at(40, 40 + far)), (1.0, 0.0));
            assert_eq!((at(40, 40 - radius as usize), at(40 - far, 40)), (1.0, 0.0));
        }
    }
}

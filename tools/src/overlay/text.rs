//! Letters, drawn with the Ubuntu font (Ubuntu Font Licence 1.0).

use ab_glyph::{Font, FontRef, PxScale, ScaleFont};
use glam::DVec2;

/// The font, opened once.
pub struct Face {
    font: FontRef<'static>,
}

/// How much of each pixel of a rectangle a text covers, 0 to 1, row by row.
pub struct Mask {
    pub left: i64,
    pub top: i64,
    pub width: usize,
    pub coverage: Vec<f32>,
}

/// The light strokes of the font are widened by this part of the letters' height.
const BOLDER: f64 = 0.045;

impl Face {
    /// Opens the font that is built in; `None` if it is damaged.
    pub fn open() -> Option<Self> {
        FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).ok().map(|font| Self { font })
    }

    /// Returns the width of a text whose letters have this height.
    pub fn width(&self, text: &str, size: f64) -> f64 {
        let font = self.font.as_scaled(PxScale::from(size as f32));
        let mut width = 0.0;
        let mut before = None;
        for letter in text.chars() {
            let glyph = font.glyph_id(letter);
            width += before.map_or(0.0, |before| font.kern(before, glyph));
            width += font.h_advance(glyph);
            before = Some(glyph);
        }
        f64::from(width)
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
        mask.widened((BOLDER * size).clamp(0.25, 8.0))
    }
}

/// The height of capitals, as a part of a font's size.
const CAPITALS: f64 = 0.69;

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
            for (own, other) in row.iter_mut().zip(source) {
                *own = own.max(other * share);
            }
        }
    }
}

//! What is written over a finished picture: scalar bars, axes, a scale bar and a caption. All sizes
//! follow the picture's, so that a picture of 200 pixels and one of 8000 look alike.

mod axes;
mod bar;
mod canvas;
mod ruler;
mod text;
mod ticks;

use crate::Failure;
use axes::Names;
use bar::Laid;
use canvas::{Align, Area, Canvas, Ink};
use glam::DVec2;
use ruler::Ruler;
use serde_json::{Value, json};
use splatkit::{
    Error,
    math::Camera,
    picture::Picture,
    session::{Captions, OverlayEntry, Panel},
};
use text::{Face, Pen};

/// The texts of pictures.
pub struct Overlay {
    entry: OverlayEntry,
    captions: Captions,
    face: Face,
    page: Page,
    ink: Ink,
}

/// The page that texts are written on.
#[derive(Debug, Clone, Copy, Default)]
pub struct Page {
    /// The colour behind the picture, red, green and blue in 0 … 1; `None` for transparency.
    pub background: Option<[f32; 3]>,
    /// Pixels an inch, which set the height of texts; else the picture's size sets it.
    pub dpi: Option<f64>,
    /// Whether parts of the picture have labels.
    pub has_labels: bool,
}

/// A part of a picture, or the whole of it.
pub struct Part<'a> {
    /// Where it is.
    pub panel: Panel,
    /// The camera that it was taken with.
    pub camera: &'a Camera,
    /// The text in its corner, if it is not empty.
    pub label: String,
}

/// The height of letters of pictures with a resolution, in points.
const POINTS: f64 = 8.0;

/// The smallest height of letters, in pixels.
const LEAST: f64 = 8.5;

/// Most scalar bars; more would hide the picture.
const MOST_BARS: usize = 4;
/// The space between bars, in heights of letters.
const BETWEEN: f64 = 1.2;
/// Most lines of a caption.
const CAPTION_LINES: usize = 3;
/// The most of a picture's width that is left free at each side.
const MOST_ROOM: f64 = 0.25;

impl Overlay {
    /// Returns the texts to draw over pictures of a page; `None` if none are asked for. A text that
    /// has nothing to say is an error.
    ///
    /// # Errors
    /// [`Failure::Usage`] for a scalar bar where nothing is coloured by values.
    pub fn open(
        entry: &OverlayEntry,
        captions: &Captions,
        page: Page,
    ) -> Result<Option<Self>, Failure> {
        if *entry == OverlayEntry::default() && !page.has_labels {
            return Ok(None);
        }
        if entry.scalar_bar && captions.legends.is_empty() {
            return Err(Failure::Usage(
                "--scalar-bar has nothing to show, because nothing here is coloured by values; \
                 --color with height or with an attribute of the file colours surfaces"
                    .into(),
            ));
        }
        let face = Face::open();
        let face = face.ok_or_else(|| Error::Argument("the built-in font is damaged".into()))?;
        let (entry, captions) = (entry.clone(), captions.clone());
        Ok(Some(Self { entry, captions, face, page, ink: Ink::over(page.background) }))
    }

    /// Returns how many pixels at its left and at its right a scene that is fitted to a picture
    /// leaves free, so that bars do not hide it.
    pub fn room(&self, [width, height]: [u32; 2]) -> u32 {
        if !self.entry.scalar_bar {
            return 0;
        }
        let mut blank = Picture { width, height, color: Vec::new(), depth: Vec::new() };
        let (canvas, area) = self.canvas(&mut blank);
        let (bars, _) = self.laid(&canvas, area);
        let bars: f64 = bars.iter().map(|bar| bar.width + BETWEEN * canvas.size).sum();
        (bars + area.left).min(MOST_ROOM * f64::from(width)) as u32
    }

    /// Returns the part of a picture that the caption and the scalar bars leave free for panels.
    pub fn free(&self, size: [u32; 2]) -> Panel {
        let [width, height] = size;
        let mut blank = Picture { width, height, color: Vec::new(), depth: Vec::new() };
        let (canvas, area) = self.canvas(&mut blank);
        let caption = self.entry.caption.as_ref().map_or(0.0, |text| {
            area.top + canvas.lines_height(canvas.wrapped(text, area.width(), CAPTION_LINES).len())
        });
        let top = caption.min(MOST_ROOM * f64::from(height)) as u32;
        Panel { at: [0, top], size: [width - self.room(size), height - top] }
    }

    /// Returns the colours of all scalar bars.
    pub fn bar_colors(&self) -> Vec<[f32; 3]> {
        self.captions.legends.iter().flat_map(|(_, bar)| bar.colors.clone()).collect()
    }

    /// Returns a picture to draw on, and its area without a margin.
    fn canvas<'a>(&'a self, picture: &'a mut Picture) -> (Canvas<'a>, Area) {
        let (width, height) = (f64::from(picture.width), f64::from(picture.height));
        let shorter = width.min(height);
        let size = self.page.dpi.map_or(shorter / 34.0, |dpi| POINTS / 72.0 * dpi);
        let size = size.min(shorter / 8.0).max(LEAST);
        let margin = (0.9 * size).min(0.1 * shorter);
        let area = Area { left: 0.0, top: 0.0, right: width, bottom: height }.grown(-margin);
        (Canvas { picture, face: &self.face, ink: self.ink, size }, area)
    }

    /// Draws the texts over a picture, and returns what was drawn.
    pub fn draw(&self, picture: &mut Picture, camera: &Camera) -> Value {
        let panel = Panel::whole([picture.width, picture.height]);
        self.draw_parts(picture, &[Part { panel, camera, label: String::new() }])
    }

    /// Draws the texts over a picture of several parts, and returns what was drawn. The parts have
    /// one scale: the scale bar is in the last one. Axes and labels are in each.
    pub fn draw_parts(&self, picture: &mut Picture, parts: &[Part<'_>]) -> Value {
        let (mut canvas, mut area) = self.canvas(picture);
        let mut drawn = json!({});
        if let Some(text) = &self.entry.caption {
            drawn["caption"] = json!(text);
            area.top += self.caption(&mut canvas, area, text);
        }
        for part in parts {
            self.label(&mut canvas, part);
            // Smaller panels have smaller axes.
            let side = if parts.len() > 1 { 4.5 } else { 7.0 } * canvas.size;
            if self.entry.axes && self.axes(&mut canvas, part, side) {
                drawn["axes"] = json!(self.names().concat().concat());
            }
        }
        let last = parts.last().filter(|_| self.entry.scale_bar);
        if let Some((ruler, place)) = last.and_then(|part| self.ruler(&canvas, part)) {
            ruler.draw(&mut canvas, place);
            if place.right == area.right {
                area.bottom -= 2.4 * canvas.size;
            }
            let Ruler { length, pixels, text } = ruler;
            drawn["scale_bar"] = json!({ "length": length, "pixels": pixels, "text": text });
        }
        if self.entry.scalar_bar {
            drawn["scalar_bars"] = self.bars(&mut canvas, area);
        }
        drawn
    }

    /// Returns the area of a part without a margin.
    fn area_of(&self, canvas: &Canvas, Panel { at, size }: Panel) -> Area {
        let [left, top] = at.map(f64::from);
        let [width, height] = size.map(f64::from);
        let whole = [canvas.picture.width, canvas.picture.height].map(f64::from);
        let margin = (0.9 * canvas.size).min(0.1 * whole[0].min(whole[1]));
        Area { left, top, right: left + width, bottom: top + height }.grown(-margin)
    }

    /// Writes the label of a part into its upper left corner.
    fn label(&self, canvas: &mut Canvas, part: &Part<'_>) {
        let area = self.area_of(canvas, part.panel);
        let label = canvas.shortened(part.label.clone(), area.width());
        let at = DVec2::new(area.left, area.top + 0.5 * canvas.size);
        canvas.text(&label, at, Align::Left);
    }

    /// Draws the axes into the lower left corner of a part, in a square with a side of so many
    /// pixels. Returns whether there is a view.
    fn axes(&self, canvas: &mut Canvas, part: &Part<'_>, side: f64) -> bool {
        let area = self.area_of(canvas, part.panel);
        let side = side.min(0.42 * area.width()).min(area.height());
        let (right, top) = (area.left + side, area.bottom - side);
        let Ok(view) = part.camera.view(part.panel.size) else { return false };
        axes::draw(canvas, Area { right, top, ..area }, view.rotation, self.names());
        true
    }

    /// Returns the scale bar of a part, and the area at whose lower right it lies.
    fn ruler(&self, canvas: &Canvas, part: &Part<'_>) -> Option<(Ruler, Area)> {
        let area = self.area_of(canvas, part.panel);
        let [_, height] = part.panel.size;
        let ruler = Ruler::new(part.camera, height, 0.3 * area.width(), &self.captions.length)?;
        Some((ruler, area))
    }

    /// Returns the names of the axes: those of patients for the frames of patients.
    fn names(&self) -> Names {
        if self.captions.is_patient { axes::RAS } else { axes::PLAIN }
    }

    /// Draws the caption, and returns the height that it takes.
    fn caption(&self, canvas: &mut Canvas, area: Area, text: &str) -> f64 {
        let lines = canvas.wrapped(text, area.width(), CAPTION_LINES);
        let middle = 0.5 * (area.left + area.right);
        for (line, text) in lines.iter().enumerate() {
            let y = area.top + (0.5 + 1.3 * line as f64) * canvas.size;
            canvas.text(text, DVec2::new(middle, y), Align::Middle);
        }
        canvas.lines_height(lines.len())
    }

    /// Lays out the bars, and returns their height, too.
    fn laid(&self, canvas: &Canvas, area: Area) -> (Vec<Laid<'_>>, f64) {
        let size = canvas.size;
        let height = (0.62 * area.height()).max(8.0 * size).min(area.height());
        let count = self.captions.legends.len().min(MOST_BARS);
        let most = (0.5 * area.width() / count as f64).max(5.0 * size);
        let bars = self.captions.legends.iter().map(|(_, bar)| bar).take(MOST_BARS);
        (bars.map(|bar| Laid::new(canvas, bar, height, most)).collect(), height)
    }

    /// Draws the bars from right to left.
    fn bars(&self, canvas: &mut Canvas, area: Area) -> Value {
        let size = canvas.size;
        let (laid, height) = self.laid(canvas, area);
        let top = area.top + 0.5 * (area.height() - height);
        let lines = laid.iter().map(Laid::title_lines).max().unwrap_or(0);
        let mut right = area.right;
        for bar in laid.iter().rev() {
            let bar_area = Area { left: area.left, top, right, bottom: top + height };
            bar.draw(canvas, bar_area, lines);
            right -= bar.width + BETWEEN * size;
        }
        laid.iter().map(Laid::to_json).collect()
    }
}

impl Canvas<'_> {
    /// Returns the height that some lines of text take, with the space below them.
    fn lines_height(&self, count: usize) -> f64 {
        (1.3 * count as f64 + 0.4) * self.size
    }

    /// Returns the lines of a text, none wider than `most` pixels and at most so many. What does
    /// not fit ends with “…”.
    pub(self) fn wrapped(&self, text: &str, most: f64, count: usize) -> Vec<String> {
        let mut lines = Vec::new();
        let text = text.replace("\\n", "\n");
        // Each letter is looked at a few times, however long the text is.
        'text: for paragraph in text.lines() {
            let (mut line, mut pen) = (String::new(), Pen::default());
            for word in paragraph.split_whitespace() {
                let before = (line.len(), pen);
                let space = (!line.is_empty()).then_some(' ');
                for letter in space.into_iter().chain(word.chars()) {
                    line.push(letter);
                    self.face.advance(&mut pen, letter, self.size);
                }
                if before.0 > 0 && f64::from(pen.width) > most {
                    line.truncate(before.0);
                    lines.push(std::mem::replace(&mut line, word.into()));
                    if lines.len() > count {
                        break 'text;
                    }
                    pen = Pen::default();
                    word.chars().for_each(|letter| self.face.advance(&mut pen, letter, self.size));
                }
            }
            lines.push(line);
            if lines.len() > count {
                break;
            }
        }
        if lines.len() > count {
            lines.truncate(count);
            lines.iter_mut().next_back().into_iter().for_each(|last| last.push('…'));
        }
        lines.into_iter().map(|line| self.shortened(line, most)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatkit::{
        color::{ColorMap, ColorScale},
        glam::DVec3,
        math::Bounds,
        session::Legend,
    };

    const SIZES: [[u32; 2]; 4] = [[200, 200], [320, 200], [640, 900], [1600, 1200]];

    fn captions(is_patient: bool) -> Captions {
        let range = [-1024.0, 3071.0];
        let scale = ColorScale { range, ..ColorScale::new(ColorMap::VIRIDIS) };
        let color = |i: usize| scale.color(scale.value(i as f64 / 255.0));
        let colors: Vec<[f32; 3]> = (0..256).map(color).collect();
        let title = Legend::title("Radiodensity", "HU");
        let legend = Legend { title, scale, colors, labels: Vec::new() };
        Captions { legends: vec![(0, legend)], length: "mm".into(), is_patient }
    }

    fn overlay(which: [bool; 4], is_patient: bool, background: Option<[f32; 3]>) -> Overlay {
        let [scalar_bar, axes, scale_bar, has_caption] = which;
        let caption = has_caption.then(|| "A chest, from the front".to_owned());
        let entry = OverlayEntry { scalar_bar, axes, scale_bar, caption };
        let page = Page { background, ..Page::default() };
        Overlay::open(&entry, &captions(is_patient), page).unwrap().unwrap()
    }

    fn drawn(which: [bool; 4], size: [u32; 2], background: Option<[f32; 3]>) -> Picture {
        let [width, height] = size;
        let count = (width * height) as usize;
        let (color, depth) = (vec![[0.0; 4]; count], vec![f32::INFINITY; count]);
        let mut picture = Picture { width, height, color, depth };
        let bounds = Bounds { min: DVec3::splat(-150.0), max: DVec3::splat(150.0) };
        let mut camera = Camera::framing(&bounds, DVec3::Y, DVec3::Z, 1.0);
        camera.azimuth(30.0);
        camera.elevation(20.0);
        overlay(which, true, background).draw(&mut picture, &camera);
        picture
    }

    #[test]
    fn texts_keep_apart_at_every_size() {
        for size in SIZES {
            let mut taken = vec![false; (size[0] * size[1]) as usize];
            for one in 0..4 {
                let all = drawn([true; 4], size, None);
                // What one flag draws beside all others, which may move it.
                let mut others = [true; 4];
                others[one] = false;
                let without = drawn(others, size, None);
                let changed = |at: &usize| all.color[*at] != without.color[*at];
                let pixels: Vec<usize> = (0..taken.len()).filter(changed).collect();
                assert!(pixels.len() > 60, "{size:?}: {one} draws {} pixels", pixels.len());
            }
            // The bar, the axes and the scale bar, which nothing else moves if there is no caption.
            for one in 0..3 {
                let mut which = [false; 4];
                which[one] = true;
                which[2] |= one == 0;
                let picture = drawn(which, size, None);
                let ruler = drawn([false, false, true, false], size, None);
                for (at, taken) in taken.iter_mut().enumerate() {
                    let is_ruler = one == 0 && ruler.color[at][3] > 0.0;
                    if picture.color[at][3] > 0.05 && !is_ruler {
                        assert!(!*taken, "{size:?}: {one} covers another at {at}");
                        *taken = true;
                    }
                }
            }
        }
    }

    #[test]
    fn bars_lie_in_the_room_that_is_left_to_them() {
        let overlay = overlay([true, false, false, false], false, None);
        for size in SIZES {
            let room = overlay.room(size);
            assert!(room > 20 && room <= size[0] / 4, "{size:?}: {room}");
            if room == size[0] / 4 {
                continue;
            }
            let picture = drawn([true, false, false, false], size, None);
            let is_drawn = |at: &usize| picture.color[*at][3] > 0.05;
            let columns = (0..picture.color.len()).filter(is_drawn).map(|at| at as u32 % size[0]);
            let first = columns.min().unwrap();
            assert!(first >= size[0] - room, "{size:?}: {first} with a room of {room}");
        }
    }

    #[test]
    fn texts_show_on_every_background() {
        for background in [None, Some([0.0; 3]), Some([1.0; 3]), Some([0.5, 0.9, 0.4])] {
            let picture = drawn([true; 4], [640, 480], background);
            let ink = Ink::over(background);
            for color in [ink.color, ink.edge] {
                let is = |pixel: &&[f32; 4]| {
                    (0..3).all(|c| (pixel[c] - color[c]).abs() < 0.16) && pixel[3] > 0.84
                };
                let count = picture.color.iter().filter(is).count();
                assert!(count > 200, "{background:?}: {count} pixels of {color:?}");
            }
        }
    }

    #[test]
    fn bars_have_the_colours_of_the_ends_where_they_belong() {
        let picture = drawn([true, false, false, false], [600, 400], None);
        let scale = ColorScale::new(ColorMap::VIRIDIS);
        let near = |pixel: &[f32; 4], wanted: [f32; 3]| {
            (0..3).all(|c| (pixel[c] - wanted[c]).abs() < 0.02) && pixel[3] > 0.99
        };
        let rows = |share: f64| {
            let wanted = scale.color(share);
            let pixels = (0..picture.color.len()).filter(|&at| near(&picture.color[at], wanted));
            pixels.map(|at| at / 600).collect::<Vec<_>>()
        };
        let (low, high) = (rows(0.0), rows(1.0));
        assert!(!low.is_empty() && !high.is_empty());
        assert!(low.iter().min() > high.iter().max(), "the highest value is on top");
        assert!(low.iter().max() < Some(&340) && high.iter().min() > Some(&60));
    }

    #[test]
    fn patients_have_letters_and_other_things_axes() {
        let names = |is_patient| overlay([false, true, false, false], is_patient, None).names();
        assert_eq!(names(true), [["R", "L"], ["A", "P"], ["S", "I"]]);
        assert_eq!(names(false)[2], ["Z", ""]);
    }

    #[test]
    fn long_texts_are_wrapped_and_cut() {
        let face = Face::open().unwrap();
        let mut picture = Picture { width: 1, height: 1, color: vec![[0.0; 4]], depth: vec![0.0] };
        let ink = Ink::over(None);
        let canvas = Canvas { picture: &mut picture, face: &face, ink, size: 20.0 };
        let lines = canvas.wrapped("one two three four five six seven eight", 120.0, 2);
        assert!(lines.len() == 2 && lines[1].ends_with('…'), "{lines:?}");
        assert!(lines.iter().all(|line| canvas.text_width(line) <= 120.0), "{lines:?}");
        assert_eq!(canvas.wrapped("a\\nb", 120.0, 3), ["a", "b"]);
        assert!(canvas.wrapped("Donaudampfschifffahrt", 60.0, 1)[0].ends_with('…'));
    }

    #[test]
    fn texts_of_any_length_are_drawn() {
        // Files name values and labels. A text of this length took days.
        let (long, face) = ("A".repeat(1 << 20), Face::open().unwrap());
        let count = 80 * 40;
        let (color, depth) = (vec![[0.0; 4]; count], vec![0.0; count]);
        let mut picture = Picture { width: 80, height: 40, color, depth };
        let ink = Ink::over(None);
        let mut canvas = Canvas { picture: &mut picture, face: &face, ink, size: 20.0 };
        for text in [long.clone(), "A ".repeat(1 << 19), "\u{300}".repeat(1 << 20)] {
            let lines = canvas.wrapped(&text, 60.0, 2);
            assert!(lines.len() <= 2);
            assert!(lines.iter().all(|line| canvas.text_width(line) <= 60.0), "{lines:?}");
        }
        canvas.text(&long, DVec2::new(0.0, 20.0), Align::Left);
        assert!(canvas.picture.color.iter().any(|pixel| pixel[3] > 0.5));
    }
}

//! How a picture is drawn, as a description says it.

use super::{Background, ClipEntry, ColorEntry, LightName, PaperLength, appearance::Wrong};
use crate::{
    Error, Result,
    hierarchy::Detail,
    picture::{DPI, wrong_dpi},
    scene::{Classification, Clip, Evaluate, Gradient, Item, Mode, Optics, Order, Scene, Settings},
    session::{Panel, PanelLabels, Side, Subject},
};
use serde::{Deserialize, Serialize};

/// How a picture is drawn. What is not given is as usual.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct PictureEntry {
    /// Width and height in pixels; by default [`SIZE`](Self::SIZE), or square panels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// The printed width, instead of `size`. Needs `dpi`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub width: Option<PaperLength>,
    /// The printed height, instead of `size`. Needs `dpi`. By default the width gives it, and the
    /// other way round.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<PaperLength>,
    /// Pixels an inch. Files store it, and texts are then as high as on paper.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dpi: Option<f64>,
    /// Sides that the picture shows beside each other, in panels of one scale.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<Side>,
    /// The number of panels in a row; by default all of up to four, else about a square of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<u32>,
    /// What is written into the corner of each panel; by default the name of its side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panel_labels: Option<PanelLabels>,
    /// The colour behind the picture; by default black.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub background: Option<Background>,
    /// Pixels that are drawn for each pixel and averaged; by default more for small pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<Samples>,
    /// What is composited; by default sheets.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<Composite>,
    /// Whether single splats are composited from back to front.
    #[serde(skip_serializing_if = "is_false")]
    pub back_to_front: bool,
    /// When values become colour and opacity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classify: Option<Classification>,
    /// The quantity that a ray computes from a field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optics: Option<Optics>,
    /// How the gradient across the picture is computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradient: Option<Gradient>,
    /// How the samples of a volume are summed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evaluate: Option<Evaluate>,
    /// Whether volumes are lit even if their transfer functions have no light (true), or volumes
    /// and surfaces are shown without light (false).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shade: Option<bool>,
    /// Where light comes from; by default from the eye.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light: Option<LightName>,
    /// Whether the lamp of the light `key` or `studio` casts shadows; by default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadows: Option<bool>,
    /// How far light is dimmed where things around a place keep it away: from 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ambient_occlusion: Option<f64>,
    /// How far pixels are dimmed where others beside them are nearer: eye-dome lighting, for clouds
    /// without normals. By default 1 for a scene of dots without normals alone, else 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub eye_dome: Option<f64>,
    /// The width of lines along the outlines of what stands in front of something farther away, in
    /// pixels; by default none are drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outline: Option<f64>,
    /// Their colour; by default black, or white on a dark background.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outline_color: Option<ColorEntry>,
    /// The largest thickness of a sheet, in world units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet_thickness: Option<f64>,
    /// Hierarchies and bricks: the largest width of a splat at half its height, in pixels; by
    /// default [`Detail::PIXELS`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut: Option<f64>,
    /// Hierarchies and bricks: about the number of splats of a picture, instead of `cut`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget: Option<u64>,
    /// Hierarchies and bricks: about the milliseconds of a frame, instead of `cut`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_time: Option<f64>,
    /// Bytes for the pages of each hierarchy, or for the bricks of a volume. Only the user says
    /// what may be taken: a file may not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<u64>,
    /// Hierarchies: whether splats that face away are left out; by default as the surface allows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cull_backfaces: Option<bool>,
    /// Whether what opaque parts hide is left out, which changes no picture; by default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occlusion: Option<bool>,
    /// Shapes that cut the scene, at most [`Settings::MAX_CLIPS`].
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<ClipEntry>,
}

/// What is composited into a picture: [`Mode`] without its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Composite {
    /// [`Mode::Sheets`].
    Sheets,
    /// [`Mode::AxisSheets`].
    AxisSheets,
    /// [`Mode::Splats`].
    Splats,
}

/// Pixels that are drawn for each pixel of a picture, and averaged to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "SamplesText", into = "SamplesText")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "SamplesText"))]
pub enum Samples {
    /// More for smaller pictures. In JSON `auto`.
    Auto,
    /// This many along each side. In JSON the number of pixels: 1, 4, 9, 16 or 64.
    Factor(u32),
}

/// [`Samples`] in JSON.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
enum SamplesText {
    Count(u32),
    Name(String),
}

impl TryFrom<SamplesText> for Samples {
    type Error = String;

    fn try_from(text: SamplesText) -> std::result::Result<Self, String> {
        match text {
            SamplesText::Count(count) => count.to_string().parse(),
            SamplesText::Name(name) => name.parse(),
        }
    }
}

impl From<Samples> for SamplesText {
    fn from(samples: Samples) -> Self {
        match samples {
            Samples::Auto => Self::Name("auto".into()),
            Samples::Factor(factor) => Self::Count(factor * factor),
        }
    }
}

impl std::str::FromStr for Samples {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "1" => Ok(Self::Factor(1)),
            "4" => Ok(Self::Factor(2)),
            "9" => Ok(Self::Factor(3)),
            "16" => Ok(Self::Factor(4)),
            "64" => Ok(Self::Factor(8)),
            _ => Err("use auto, 1, 4, 9, 16 or 64".into()),
        }
    }
}

impl Samples {
    /// Most pixels drawn if the picture's size decides.
    const MOST_PIXELS: u64 = 1 << 18;

    /// Returns how many pixels are drawn along each side of a pixel. Explicit splats have edges and
    /// are widened, which takes more pixels than a volume does.
    pub fn factor(self, [width, height]: [u32; 2], has_splats: bool) -> u32 {
        let pixels = u64::from(width) * u64::from(height);
        let drawn = |factor: u32| u64::from(factor * factor).saturating_mul(pixels);
        let most = if has_splats { 8 } else { 4 };
        match self {
            Self::Auto => {
                (2..=most).rev().find(|factor| drawn(*factor) <= Self::MOST_PIXELS).unwrap_or(1)
            }
            Self::Factor(factor) => factor,
        }
    }
}

fn is_false(flag: &bool) -> bool {
    !flag
}

impl PictureEntry {
    /// The size of a picture of which nobody says it.
    pub const SIZE: [u32; 2] = [1280, 720];

    /// The width and the height of a panel of a picture of which nobody says the size.
    const PANEL: u32 = 640;

    /// Most panels of a picture.
    pub const MOST_VIEWS: usize = 64;

    /// The largest side of a picture that is given as a length, in pixels.
    const MOST_PIXELS: f64 = 1e6;

    /// Checks what does not depend on the scene.
    ///
    /// # Errors
    /// [`Error::Argument`] with the name of the field that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|(field, message)| Error::Argument(format!("{field}: {message}")))
    }

    pub(super) fn check(&self) -> std::result::Result<(), Wrong> {
        if self.size.is_some_and(|size| size.contains(&0)) {
            return Err(("size", "a picture needs a width and a height above 0".into()));
        }
        self.check_page()?;
        self.check_light()?;
        if self.back_to_front && self.mode != Some(Composite::Splats) {
            let message =
                "needs the mode splats (--mode splats): it sets the order of single splats";
            return Err(("back_to_front", message.into()));
        }
        let lengths = [("sheet_thickness", self.sheet_thickness), ("frame_time", self.frame_time)];
        let is_length = |length: &f64| *length > 0.0 && length.is_finite();
        if let Some((name, _)) = lengths.iter().find(|(_, length)| !length.iter().all(is_length)) {
            return Err((*name, "must be a number above 0".into()));
        }
        if self.cut.is_some_and(|cut| !(cut >= 0.0 && cut.is_finite())) {
            return Err(("cut", "must be a number of at least 0".into()));
        }
        if self.budget == Some(0) {
            return Err(("budget", "must be a number above 0".into()));
        }
        let details = [self.cut.is_some(), self.budget.is_some(), self.frame_time.is_some()];
        if details.into_iter().filter(|is_given| *is_given).count() > 1 {
            return Err(("budget", "only one of cut, budget and frame_time can be given".into()));
        }
        let (count, most) = (self.clips.len(), Settings::MAX_CLIPS);
        if count > most {
            return Err(("clips", format!("{count} shapes are given; at most {most} are allowed")));
        }
        self.clips.iter().try_for_each(ClipEntry::check).map_err(|message| ("clips", message))
    }

    /// Checks the size, the resolution and the panels.
    fn check_page(&self) -> std::result::Result<(), Wrong> {
        if self.dpi.is_some_and(|dpi| !DPI.contains(&dpi)) {
            return Err(("dpi", wrong_dpi().replacen("dpi: ", "", 1)));
        }
        for (name, length) in [("width", self.width), ("height", self.height)] {
            let Some(length) = length else { continue };
            let Some(dpi) = self.dpi else {
                let message = "a length on paper needs the pixels an inch (--dpi, in JSON dpi)";
                return Err((name, message.into()));
            };
            if self.size.is_some() {
                let message = "the size in pixels (--size) and a length are both given: leave out \
                               one of them";
                return Err((name, message.into()));
            }
            let pixels = length.pixels(dpi);
            if !(0.5..=Self::MOST_PIXELS).contains(&pixels) {
                let message = format!("{length} at {dpi} pixels an inch are {pixels:.1} pixels");
                return Err((name, message));
            }
        }
        let (count, most) = (self.views.len(), Self::MOST_VIEWS);
        if count > most {
            let message = format!("{count} sides are given; at most {most} are allowed");
            return Err(("views", message));
        }
        let without = count == 0 && (self.columns.is_some() || self.panel_labels.is_some());
        if without {
            let name = if self.columns.is_some() { "columns" } else { "panel_labels" };
            return Err((name, "needs several views (--views): it says how they lie".into()));
        }
        match self.columns {
            Some(0) => Err(("columns", "must be a number above 0".into())),
            _ => Ok(()),
        }
    }

    /// Returns the number of panels in a row and in a column.
    fn cells(&self) -> [u32; 2] {
        let count = self.views.len().max(1) as u32;
        let usual = Panel::usual_columns(count);
        let columns = self.columns.unwrap_or(usual).clamp(1, count);
        [columns, count.div_ceil(columns)]
    }

    /// Returns width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        let usual = match self.views.is_empty() {
            true => Self::SIZE,
            false => self.cells().map(|count| count * Self::PANEL),
        };
        let dpi = self.dpi.unwrap_or(0.0);
        let pixels = |length: PaperLength| length.pixels(dpi);
        let [wide, high] = usual.map(f64::from);
        let sides = match (self.width.map(pixels), self.height.map(pixels)) {
            (None, None) => return self.size.unwrap_or(usual),
            (Some(width), Some(height)) => [width, height],
            (Some(width), None) => [width, width * high / wide],
            (None, Some(height)) => [height * wide / high, height],
        };
        sides.map(|side| side.round().clamp(1.0, Self::MOST_PIXELS) as u32)
    }

    /// Returns the panels of a picture of several views, with their sides, within the part of the
    /// picture that texts leave free; none for a picture of one view.
    ///
    /// # Errors
    /// [`Error::Argument`] if the panels would have no pixels.
    pub fn panels(&self, free: Panel) -> Result<Vec<(Side, Panel)>> {
        let panels = free.grid(self.views.len() as u32, self.cells()[0])?;
        Ok(self.views.iter().copied().zip(panels).collect())
    }

    /// Returns the width of the edges of meshes, in pixels: a pixel, and more in large pictures; on
    /// paper half a point.
    pub fn edge_width(&self) -> f64 {
        let width = match self.dpi {
            Some(dpi) => 0.5 / 72.0 * dpi,
            None => f64::from(self.size()[1]) / 720.0,
        };
        width.max(1.0)
    }

    /// Returns the colour behind the picture: red, green and blue in 0 … 1; `None` for
    /// transparency.
    pub fn background(&self) -> Option<[f32; 3]> {
        self.background.map_or(Some([0.0; 3]), Background::color)
    }

    /// Returns how many pixels are drawn along each side of a pixel of the picture. Outlines follow
    /// the depths, which have smooth edges only if there are several for a pixel.
    pub fn factor(&self, scene: &Scene) -> u32 {
        let factor = self.samples.unwrap_or(Samples::Auto).factor(self.size(), scene.has_splats());
        let has_lines = self.outlines().is_some() && self.samples.is_none();
        if has_lines { factor.max(2) } else { factor }
    }

    /// Returns whether meshes can be drawn as facets: in sheets that emit and absorb light.
    pub fn draws_facets(&self) -> bool {
        self.mode() == Mode::Sheets && self.optics.unwrap_or_default() == Optics::EmissionAbsorption
    }

    fn mode(&self) -> Mode {
        let order = if self.back_to_front { Order::BackToFront } else { Order::FrontToBack };
        match self.mode {
            None | Some(Composite::Sheets) => Mode::Sheets,
            Some(Composite::AxisSheets) => Mode::AxisSheets,
            Some(Composite::Splats) => Mode::Splats(order),
        }
    }

    /// Returns the settings of the picture of a scene, before it is averaged down.
    ///
    /// # Errors
    /// Those of [`Scene::validate_settings`]; [`Error::NothingToDraw`]
    /// for a clip that leaves nothing of the scene.
    pub fn settings(&self, scene: &Scene, subject: &Subject) -> Result<Settings> {
        let factor = self.factor(scene);
        let mut settings = Settings::new(self.size().map(|side| side.saturating_mul(factor)));
        settings.mode = self.mode();
        settings.classification = self.classify.unwrap_or_default();
        settings.optics = self.optics.unwrap_or_default();
        settings.gradient = self.gradient.unwrap_or_default();
        settings.evaluate = self.evaluate.unwrap_or_default();
        settings.sheet_thickness = self.sheet_thickness;
        // Explicit extra pixels do not change sheets and cuts: thinner sheets would separate splats
        // that overlap on a surface. If their number is automatic, a small picture is drawn like a
        // larger one.
        let wider =
            if let Some(Samples::Factor(_)) = self.samples { f64::from(factor) } else { 1.0 };
        settings.sheet_pixels *= wider;
        settings.occlusion = self.occlusion.unwrap_or(true);
        self.shade(scene, &mut settings);
        settings.lighting = self.lighting(subject.orientation.up);
        settings.detail = match (self.budget, self.frame_time) {
            (Some(splats), _) => Detail::Splats(splats),
            (_, Some(milliseconds)) => Detail::Milliseconds(milliseconds),
            _ => Detail::Pixels(self.cut.unwrap_or(Detail::PIXELS) * wider),
        };
        settings.cull_backfaces = self.cull_backfaces;
        settings.controls.page_memory = self.memory.unwrap_or(settings.controls.page_memory);
        settings.clips = self.clips_of(scene, subject)?;
        scene.validate_settings(&settings)?;
        Ok(settings)
    }

    /// Returns the clips of the picture of a scene.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`] for a clip that leaves nothing of the scene.
    pub fn clips_of(&self, scene: &Scene, subject: &Subject) -> Result<Vec<Clip>> {
        // Footprints reach beyond the samples, so something may be left there.
        ClipEntry::all(&self.clips, &subject.bounds, &scene.bounds())
    }

    fn shade(&self, scene: &Scene, settings: &mut Settings) {
        match self.shade {
            None => {}
            Some(false) => {
                settings.volume_shade = Some(None);
                settings.surface_shade = None;
            }
            Some(true) => {
                let fields = scene.items.iter().filter_map(Item::transfer);
                let mut shade = fields.clone().find_map(|field| field.shade).unwrap_or_default();
                if fields.count() > 1 {
                    // Each field knows itself which of its gradients are certain.
                    shade.certain = None;
                }
                settings.volume_shade = Some(Some(shade));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the picture of a JSON text.
    fn picture(text: &str) -> PictureEntry {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn lengths_on_paper_and_panels_give_the_size() {
        let size = |text: &str| picture(text).size();
        assert_eq!(size("{}"), [1280, 720]);
        assert_eq!(size(r#"{"width": "85mm", "dpi": 300}"#), [1004, 565]);
        assert_eq!(size(r#"{"width": "4in", "height": "72pt", "dpi": 100}"#), [400, 100]);
        assert_eq!(size(r#"{"views": ["front", "left", "top"]}"#), [1920, 640]);
        assert_eq!(size(r#"{"views": ["front", "left", "top"], "columns": 2}"#), [1280, 1280]);
        let wide = r#"{"views": ["front", "left", "top"], "width": "6in", "dpi": 300}"#;
        assert_eq!(size(wide), [1800, 600]);
        assert_eq!(picture(wide).panels(Panel::whole([1800, 600])).unwrap()[2].1.at, [1200, 0]);
        let five = r#"{"views": ["iso", "left", "top", "back", "right"], "size": [300, 200]}"#;
        let panels = picture(five).panels(Panel::whole([300, 200])).unwrap();
        assert_eq!(panels[4], (Side::Right, Panel { at: [100, 100], size: [100, 100] }));
        let text = serde_json::to_string(&picture(wide)).unwrap();
        assert_eq!(picture(&text), picture(wide));
    }

    #[test]
    fn pages_that_cannot_be_are_refused() {
        for (text, field, says) in [
            (r#"{"width": "85mm"}"#, "width", "needs the pixels an inch"),
            (r#"{"height": "1in", "dpi": 90, "size": [9, 9]}"#, "height", "leave out"),
            (r#"{"width": "900in", "dpi": 9000}"#, "width", "8100000.0 pixels"),
            (r#"{"width": "0.001pt", "dpi": 9}"#, "width", "0.0 pixels"),
            (r#"{"dpi": 0}"#, "dpi", "1 to 10000 pixels an inch"),
            (r#"{"columns": 2}"#, "columns", "several views"),
            (r#"{"panel_labels": "none"}"#, "panel_labels", "several views"),
            (r#"{"columns": 0, "views": ["iso"]}"#, "columns", "above 0"),
        ] {
            let (place, message) = picture(text).check().unwrap_err();
            assert!(place == field && message.contains(says), "{text}: {place} {message}");
        }
        let many = PictureEntry { views: vec![Side::Top; 65], ..PictureEntry::default() };
        assert_eq!(many.check().unwrap_err().0, "views");
    }

    #[test]
    fn small_pictures_take_more_pixels() {
        let factor =
            |text: &str, size| text.parse().map(|samples: Samples| samples.factor(size, true));
        assert_eq!(factor("auto", [1, 1]), Ok(8));
        assert_eq!(factor("auto", [64, 64]), Ok(8));
        assert_eq!(factor("auto", [128, 128]), Ok(4));
        assert_eq!(Samples::Auto.factor([64, 64], false), 4);
        assert_eq!(factor("auto", [160, 160]), Ok(3));
        assert_eq!(factor("auto", [256, 256]), Ok(2));
        assert_eq!(factor("auto", [257, 256]), Ok(1));
        assert_eq!(factor("auto", [u32::MAX, u32::MAX]), Ok(1));
        assert_eq!(factor("9", [2000, 2000]), Ok(3));
        assert!(factor("2", [1, 1]).is_err());
        for samples in [Samples::Auto, Samples::Factor(3)] {
            let json = serde_json::to_string(&samples).unwrap();
            assert_eq!(serde_json::from_str::<Samples>(&json).unwrap(), samples);
        }
    }
}

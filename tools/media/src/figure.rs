//! Pictures of several views beside each other, with one set of texts over them.

use crate::overlay::{Overlay, Part};
use serde_json::{Value, json};
use splatkit::{
    Result,
    math::Camera,
    picture::Picture,
    session::{Framing, Panel, PanelLabels, PictureEntry, Subject},
};

/// A picture of several views. Its panels have one size and one scale.
#[derive(Debug, Clone)]
pub struct Figure {
    size: [u32; 2],
    panels: Vec<Panel>,
    /// What each panel shows: a side, or a time.
    names: Vec<String>,
    labels: Vec<String>,
    cameras: Vec<Camera>,
}

impl Figure {
    /// Returns the figure that a picture with several views is; `None` for other pictures. The
    /// panels lie beside the texts, and their cameras are fitted to the subject.
    ///
    /// # Errors
    /// Those of [`PictureEntry::panels`] and [`Framing::views`].
    pub fn new(
        picture: &PictureEntry,
        overlay: Option<&Overlay>,
        (framing, subject): (&Framing, &Subject),
    ) -> Result<Option<Self>> {
        if picture.views.is_empty() {
            return Ok(None);
        }
        let size = picture.size();
        let free = overlay.map_or(Panel::whole(size), |overlay| overlay.free(size));
        let panels = picture.panels(free)?;
        let cameras = framing.views(subject, panels[0].1.size, &picture.views)?;
        let names = picture.views.iter().map(|side| side.name().to_owned()).collect();
        let panels = panels.into_iter().map(|(_, panel)| panel).collect();
        let labels = picture.panel_labels.unwrap_or_default();
        Ok(Some(Self::named((size, labels), panels, names, cameras)))
    }

    /// Returns the figure whose panels, such as times or channels, are all seen by one camera.
    /// Without a number of `columns`, up to four are in a row, and more in about a square.
    ///
    /// # Errors
    /// Those of [`Panel::grid`] and [`Framing::camera`].
    pub fn of_panels(
        picture: &PictureEntry,
        overlay: Option<&Overlay>,
        (framing, subject): (&Framing, &Subject),
        (names, columns, labels): (Vec<String>, Option<u32>, PanelLabels),
    ) -> Result<Self> {
        let size = picture.size();
        let free = overlay.map_or(Panel::whole(size), |overlay| overlay.free(size));
        let count = names.len() as u32;
        let columns = columns.unwrap_or_else(|| Panel::usual_columns(count));
        let panels = free.grid(count, columns)?;
        let camera = framing.camera(subject, panels[0].size)?;
        let cameras = vec![camera; names.len()];
        Ok(Self::named((size, labels), panels, names, cameras))
    }

    fn named(
        (size, labels): ([u32; 2], PanelLabels),
        panels: Vec<Panel>,
        names: Vec<String>,
        cameras: Vec<Camera>,
    ) -> Self {
        let label = |(number, name): (usize, &String)| labels.text(number, name);
        let labels = names.iter().enumerate().map(label).collect();
        Self { size, panels, names, labels, cameras }
    }

    /// Returns the size of each panel, in pixels.
    pub fn panel_size(&self) -> [u32; 2] {
        self.panels[0].size
    }

    /// Returns the cameras, in the order of the views.
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// Draws all panels and the texts. `draw` returns the finished picture of a camera, of the
    /// panels' size. Also returns what the texts say.
    ///
    /// # Errors
    /// Those of `draw`.
    pub fn draw<E: From<splatkit::Error>>(
        &self,
        overlay: Option<&Overlay>,
        mut draw: impl FnMut(&Camera) -> std::result::Result<Picture, E>,
    ) -> std::result::Result<(Picture, Value), E> {
        let mut whole = Picture::blank(self.size);
        for (panel, camera) in self.panels.iter().zip(&self.cameras) {
            whole.paste(&draw(camera)?, panel.at)?;
        }
        let parts = self.panels.iter().zip(&self.cameras).zip(&self.labels);
        let parts = parts.map(|((panel, camera), label)| Part {
            panel: *panel,
            camera,
            label: label.clone(),
        });
        let parts: Vec<Part<'_>> = parts.collect();
        let texts = overlay.map_or(Value::Null, |it| it.draw_parts(&mut whole, &parts));
        Ok((whole, texts))
    }

    /// Returns where each panel is and what it shows; `camera` is a camera as JSON.
    pub fn to_json(&self, camera: impl Fn(&Camera) -> Value) -> Value {
        let panels = self.panels.iter().zip(&self.cameras).zip(&self.names);
        let facts = panels.map(|((panel, of), view)| {
            let camera = camera(of);
            json!({ "view": view, "at": panel.at, "size": panel.size, "camera": camera })
        });
        facts.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::overlay::Page;
    use splatkit::{
        Error,
        glam::DVec3,
        math::Bounds,
        session::{Captions, OverlayEntry},
    };

    /// Draws a figure of black panels with these texts.
    fn drawn(text: &str, entry: &OverlayEntry) -> (Picture, Value, Vec<Panel>) {
        let picture: PictureEntry = serde_json::from_str(text).unwrap();
        let subject = Subject::new(Bounds { min: DVec3::ZERO, max: DVec3::ONE }, DVec3::Z);
        let page = Page { dpi: picture.dpi, has_labels: true, ..Page::default() };
        let captions = Captions { legends: Vec::new(), length: "mm".into(), is_patient: false };
        let overlay = Overlay::open(entry, &captions, page).unwrap();
        let figure =
            Figure::new(&picture, overlay.as_ref(), (&Framing::default(), &subject)).unwrap();
        let figure = figure.unwrap();
        let [width, height] = figure.panel_size();
        let black = |_: &Camera| {
            let count = (width * height) as usize;
            Ok::<_, Error>(Picture {
                width,
                height,
                color: vec![[0.0, 0.0, 0.0, 1.0]; count],
                depth: vec![1.0; count],
            })
        };
        let (whole, texts) = figure.draw(overlay.as_ref(), black).unwrap();
        (whole, texts, figure.panels)
    }

    /// Returns how many pixels of a part of a picture the letters fill.
    fn bright(picture: &Picture, [left, top]: [u32; 2], [width, height]: [u32; 2]) -> f32 {
        let share = |at: u32| picture.color[at as usize][0];
        let row = |y: u32| (y * picture.width + left)..(y * picture.width + left + width);
        (top..top + height).flat_map(row).map(share).sum()
    }

    #[test]
    fn each_panel_has_its_label_and_the_last_one_the_scale_bar() {
        let text = r#"{"views": ["front", "left", "top"], "size": [900, 300]}"#;
        let bare = OverlayEntry { scale_bar: true, ..OverlayEntry::default() };
        let (picture, texts, panels) = drawn(text, &bare);
        assert_eq!(
            panels.iter().map(|panel| panel.at).collect::<Vec<_>>(),
            [[0, 0], [300, 0], [600, 0]]
        );
        for panel in &panels {
            assert!(bright(&picture, panel.at, [100, 40]) > 15.0, "{panel:?}");
        }
        let corner = |panel: &Panel| bright(&picture, [panel.at[0] + 150, 240], [150, 60]);
        assert_eq!((corner(&panels[0]), corner(&panels[1])), (0.0, 0.0));
        assert!(corner(&panels[2]) > 15.0);
        assert!(texts["scale_bar"]["text"].as_str().unwrap().ends_with("mm"), "{texts}");
        let none = text.replacen('{', r#"{"panel_labels": "none", "#, 1);
        let (picture, ..) = drawn(&none, &bare);
        assert_eq!(bright(&picture, [0, 0], [300, 300]), 0.0);
    }

    #[test]
    fn captions_lie_above_the_panels() {
        let caption = Some("A cube".to_owned());
        let entry = OverlayEntry { caption, ..OverlayEntry::default() };
        let text = r#"{"views": ["front", "left"], "size": [600, 400]}"#;
        let (picture, _, panels) = drawn(text, &entry);
        let top = panels[0].at[1];
        assert!((15..60).contains(&top), "{top}");
        assert!(panels.iter().all(|panel| panel.at[1] == top && panel.size == [300, 400 - top]));
        assert!(bright(&picture, [0, 0], [600, top]) > 25.0);
    }

    #[test]
    fn letters_are_as_high_on_paper_at_every_resolution() {
        let letters = |dpi: u32| {
            let text = format!(r#"{{"views": ["front"], "width": "2in", "dpi": {dpi}}}"#);
            let (picture, ..) = drawn(&text, &OverlayEntry::default());
            bright(&picture, [0, 0], [picture.width, picture.height])
        };
        let ratio = letters(600) / letters(300);
        assert!((3.4..4.6).contains(&ratio), "{ratio}");
    }
}

//! Drawing a loaded scene as its description says.

use super::{Device, Renderer};
use crate::{
    Result,
    math::Camera,
    picture::Picture,
    plan::FrameStats,
    session::{Description, Loaded},
};

impl Loaded {
    /// Draws the picture that a description asks for, by its camera or by one that is fitted to the
    /// scene. The description may be another than the one that was loaded, if it has the same
    /// inputs. Texts over the picture ([`OverlayEntry`](crate::session::OverlayEntry)) are not
    /// drawn. A host that draws many pictures keeps a [`Renderer`] instead.
    ///
    /// ```no_run
    /// use splatkit::{Device, picture::{Encoding, PictureFormat}, session::Description};
    ///
    /// let scene = Description::read("scene.json", &Default::default())?;
    /// let mut loaded = scene.load(&|step| println!("{step}"))?;
    /// loaded.warnings.iter().for_each(|warning| println!("warning: {warning}"));
    /// let (picture, _) = loaded.draw(&scene, &Device::automatic())?;
    /// std::fs::write("scene.png", picture.encode(&Encoding::new(PictureFormat::Png))?)
    ///     .expect("a folder that can be written");
    /// # Ok::<(), splatkit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`PictureEntry::settings`](crate::session::PictureEntry::settings), of
    /// [`Framing::camera`](crate::session::Framing::camera) and of [`Renderer::render`];
    /// [`Error::NothingToDraw`](crate::Error::NothingToDraw) for an empty picture.
    pub fn draw(
        &mut self,
        description: &Description,
        device: &Device,
    ) -> Result<(Picture, FrameStats)> {
        let drawing = self.drawing(&description.picture)?;
        let camera = self.camera(description)?;
        let mut renderer = Renderer::new(device, &self.scene)?;
        let (picture, stats) = renderer
            .render(&camera, &drawing.settings)
            .map_err(|error| self.undrawn(error, &camera, drawing.settings.size).0)?;
        description.picture.require_content(&picture)?;
        Ok((drawing.reduced(picture, &self.items, &camera)?, stats))
    }

    /// Returns the camera of the picture that a description asks for.
    ///
    /// # Errors
    /// Those of [`draw`](Self::draw) that come before anything is drawn.
    pub fn camera(&mut self, description: &Description) -> Result<Camera> {
        let drawing = self.drawing(&description.picture)?;
        let framing = description.framing()?;
        self.find_seen(&framing, &drawing.settings)?;
        framing.camera(&self.subject, drawing.free(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Error, input::testing::Folder, session::PictureEntry};

    #[test]
    fn a_described_picture_is_drawn() {
        let folder = Folder::new();
        let mesh = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
        let mut scene = Description::new([folder.write("a.obj", mesh.as_bytes())]);
        scene.picture = PictureEntry { size: Some([12, 10]), ..PictureEntry::default() };
        let mut loaded = scene.load(&|_| {}).expect("a scene");
        let (picture, stats) = loaded.draw(&scene, &Device::Cpu).expect("a picture");
        // Small pictures are averaged of more pixels.
        assert_eq!((picture.width, picture.height), (12, 10));
        assert!(stats.splats > 0 && picture.color[5 * 12 + 6][3] > 0.9);
        let side = serde_json::json!({"side": {"axis": "z", "below": true, "at": -1}});
        scene.picture.clips = vec![serde_json::from_value(side).expect("a clip")];
        let error = loaded.draw(&scene, &Device::Cpu).expect_err("nothing is left");
        assert!(matches!(error, Error::NothingToDraw(_)), "{error}");
    }
}

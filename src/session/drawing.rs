//! The way from a described picture to the finished one. It begins with the settings that an engine
//! draws by, and with the part of the picture that a camera is fitted to. It ends with what is done
//! to the drawn pixels.
//!
//! Every host takes this way. Texts over pictures are drawn by the hosts, because they need fonts.

use super::{Items, PictureEntry, Subject};
use crate::{
    Error, Result,
    math::Camera,
    picture::{Outlines, Picture},
    scene::{Item, Scene, Settings},
};

/// How a picture of a scene is drawn and finished.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// The settings of the drawn picture, before it is averaged down.
    pub settings: Settings,
    /// Pixels that are drawn along each side of a pixel of the finished picture.
    pub factor: u32,
    /// The width of edges, in pixels of the finished picture.
    pub edge_width: f64,
    /// The strength of eye-dome lighting; 0 without it.
    pub eye_dome: f64,
    /// Lines along outlines, in pixels of the finished picture.
    pub outlines: Option<Outlines>,
}

/// The smallest opacity that a file of 8 bits keeps.
const LEAST_OPACITY: f32 = 0.5 / 255.0;

impl PictureEntry {
    /// Returns how the picture of a scene is drawn and finished.
    ///
    /// # Errors
    /// Those of [`settings`](Self::settings).
    pub fn drawing(&self, scene: &Scene, subject: &Subject) -> Result<Drawing> {
        Ok(Drawing {
            settings: self.settings(scene, subject)?,
            factor: self.factor(scene),
            edge_width: self.edge_width(),
            eye_dome: self.eye_dome.unwrap_or_else(|| usual_eye_dome(scene)),
            outlines: self.outlines(),
        })
    }

    /// Refuses a drawn picture that shows nothing.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`].
    pub fn require_content(&self, picture: &Picture) -> Result<()> {
        if picture.color.iter().any(|pixel| pixel[3] >= LEAST_OPACITY) {
            return Ok(());
        }
        let clips: Vec<String> = self.clips.iter().map(ToString::to_string).collect();
        let left = match &clips[..] {
            [] => String::new(),
            clips => format!(" after clipping by {}", clips.join(" ")),
        };
        Err(Error::NothingToDraw(format!(
            "the picture is empty: the camera sees no splat that has opacity{left}"
        )))
    }
}

/// Returns the strength of eye-dome lighting that a scene has by itself: 1 if it is of dots without
/// normals alone, in which nothing else shows depth.
fn usual_eye_dome(scene: &Scene) -> f64 {
    let is_of_dots = |item: &Item| matches!(item, Item::Facets(set) if set.is_unlit());
    let is_all = !scene.items.is_empty() && scene.items.iter().all(is_of_dots);
    if is_all { 1.0 } else { 0.0 }
}

impl Drawing {
    /// Returns the size of the part of the drawn picture that a camera is fitted to. It is the
    /// middle, between margins of `room` pixels of the finished picture at the left and the right.
    pub fn free(&self, room: u32) -> [u32; 2] {
        let [width, height] = self.settings.size;
        let margins = room.saturating_mul(self.factor).saturating_mul(2);
        [width.saturating_sub(margins).max(1), height]
    }

    /// Lights a drawn picture by its depths, outlines what it shows, and averages it down. Then it
    /// draws the edges of its items over it.
    ///
    /// # Errors
    /// Those of [`Camera::view`], of [`Picture::reduced`] and of [`Items::draw_edges`].
    pub fn reduced(&self, mut picture: Picture, items: &Items, camera: &Camera) -> Result<Picture> {
        let view = camera.view([picture.width, picture.height])?;
        if self.eye_dome > 0.0 {
            // As wide in large pictures as in usual ones.
            let radius = (picture.height / 720).max(self.factor).max(1);
            picture = picture.with_eye_dome(&view, self.eye_dome, radius);
        }
        if let Some(Outlines { width, color }) = self.outlines {
            let outlines = Outlines { width: width * f64::from(self.factor), color };
            picture = picture.with_outlines(&view, &outlines);
        }
        let mut picture = if self.factor > 1 { picture.reduced(self.factor)? } else { picture };
        let edges = (&self.settings.clips[..], self.edge_width);
        items.draw_edges(&mut picture, camera, edges)?;
        Ok(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        facet::{FacetSet, Relief, Rod},
        math::Bounds,
        session::ClipEntry,
    };
    use glam::{DVec3, Vec3};

    fn picture(opacity: f32) -> Picture {
        let (color, depth) = (vec![[opacity; 4]; 16], vec![1.0; 16]);
        Picture { width: 4, height: 4, color, depth }
    }

    #[test]
    fn a_camera_is_fitted_beside_bars() {
        let drawing = Drawing {
            settings: Settings::new([40, 20]),
            factor: 2,
            edge_width: 1.0,
            eye_dome: 0.0,
            outlines: None,
        };
        assert_eq!(drawing.free(0), [40, 20]);
        assert_eq!(drawing.free(3), [28, 20]);
        // Something is always left.
        assert_eq!(drawing.free(u32::MAX), [1, 20]);
        let around = Bounds { min: DVec3::ZERO, max: DVec3::ONE };
        let camera = Camera::framing(&around, DVec3::NEG_Z, DVec3::Y, 1.0);
        let small = drawing.reduced(picture(1.0), &Items::default(), &camera);
        assert_eq!(small.map(|picture| [picture.width, picture.height]).ok(), Some([2, 2]));
    }

    #[test]
    fn dots_without_normals_have_eye_dome_lighting() {
        let dot = |relief: Relief| Rod { relief, ..Rod::ball(Vec3::ZERO, 1.0, [9; 3]) }.into();
        let scene = |reliefs: &[Relief]| {
            let facets = reliefs.iter().map(|relief| dot(*relief)).collect();
            Scene::new().with_facets(FacetSet::of_rods(DVec3::ZERO, facets))
        };
        let (flat, lit) = (Relief::Flat(None), Relief::Flat(Some(Vec3::Z)));
        assert_eq!(usual_eye_dome(&scene(&[flat, flat])), 1.0);
        for others in [&[flat, lit][..], &[Relief::Round], &[]] {
            assert_eq!(usual_eye_dome(&scene(others)), 0.0);
        }
    }

    #[test]
    fn empty_pictures_are_refused_with_the_clips() {
        let side = serde_json::json!({"side": {"axis": "x", "below": true, "at": "50%"}});
        let clip: ClipEntry = serde_json::from_value(side).expect("a clip");
        let entry = PictureEntry { clips: vec![clip], ..PictureEntry::default() };
        assert!(entry.require_content(&picture(0.5)).is_ok());
        let error = entry.require_content(&picture(0.001)).expect_err("an error").to_string();
        assert!(error.ends_with("opacity after clipping by --clip 'x<50%'"), "{error}");
    }
}

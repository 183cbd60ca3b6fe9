//! Layers of a picture beside its colours and depths, for programs that composite or denoise it.
//!
//! They are made of other pictures of the same view, so every engine has them. The albedo is the
//! picture without light. Normals follow from six pictures in the light of one lamp each, along the
//! axes of the view (photometric stereo: Woodham 1980). Identifiers follow from pictures of each
//! input alone.

use super::Drawing;
use crate::{
    Result,
    math::Camera,
    picture::{Layers, Picture},
    scene::{KeyLight, Lighting, Scene, Settings},
    volume::Shade,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// A layer of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Layer {
    /// [`Layers::normals`].
    Normals,
    /// [`Layers::albedo`].
    Albedo,
    /// [`Layers::identifiers`].
    Identifiers,
}

impl Layer {
    /// All layers.
    pub const ALL: [Self; 3] = [Self::Normals, Self::Albedo, Self::Identifiers];

    /// Returns the name of the layer.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normals => "normals",
            Self::Albedo => "albedo",
            Self::Identifiers => "identifiers",
        }
    }
}

/// Light that the lamps of two opposite directions leave between them, below which a pixel has no
/// normal: less than a hundredth of what a file of 8 bits keeps.
const LEAST_LIGHT: f64 = 4e-5;

/// The smallest opacity that a file of 8 bits keeps.
const LEAST_OPACITY: f32 = 0.5 / 255.0;

/// Draws a scene, or if there is none the whole scene of the picture, with these settings.
pub type DrawLayer<'a> = dyn FnMut(Option<&Scene>, &Settings) -> Result<Picture> + 'a;

impl Drawing {
    /// Draws layers of the picture of a scene. `inputs` are the numbers of the items of each input.
    ///
    /// # Errors
    /// Those of `draw`, and of [`Camera::view`]. Normals need lamps, so they need image-aligned
    /// sheets of emission and absorption.
    pub fn layers(
        &self,
        wanted: &[Layer],
        camera: &Camera,
        (scene, inputs): (&Scene, &[Range<usize>]),
        draw: &mut DrawLayer<'_>,
    ) -> Result<Layers> {
        let mut layers = Layers::default();
        if wanted.contains(&Layer::Normals) {
            layers.normals = Some(self.normals(camera, draw)?);
        }
        if wanted.contains(&Layer::Albedo) {
            let settings = Settings {
                volume_shade: Some(None),
                surface_shade: None,
                lighting: Lighting::default(),
                ..self.settings.clone()
            };
            layers.albedo = Some(draw(None, &settings)?.reduced(self.factor)?.color);
        }
        if wanted.contains(&Layer::Identifiers) {
            layers.identifiers = Some(self.identifiers((scene, inputs), draw)?);
        }
        Ok(layers)
    }

    /// Returns the normals. A surface that is lit along an axis alone is as bright as its normal is
    /// long on that axis; lamps from both ends give the sign.
    fn normals(&self, camera: &Camera, draw: &mut DrawLayer<'_>) -> Result<Vec<[f32; 3]>> {
        let shade = Shade { ambient: 0.0, diffuse: 1.0, specular: 0.0, power: 1.0, certain: None };
        let mut lit_from = |direction: DVec3| {
            let key = Some(KeyLight { direction, share: 1.0, shadows: 0 });
            let settings = Settings {
                volume_shade: Some(Some(shade)),
                surface_shade: Some(shade),
                lighting: Lighting { head: 0.0, key, ..Lighting::head() },
                ..self.settings.clone()
            };
            draw(None, &settings)?.reduced(self.factor)
        };
        let light = |pixel: &[f32; 4]| pixel[..3].iter().map(|part| f64::from(*part)).sum::<f64>();
        let mut sums: Vec<DVec3> = Vec::new();
        for axis in DVec3::AXES {
            let (bright, dark) = (lit_from(axis)?, lit_from(-axis)?);
            sums.resize(bright.color.len(), DVec3::ZERO);
            let pixels = bright.color.iter().zip(&dark.color);
            for (sum, (bright, dark)) in sums.iter_mut().zip(pixels) {
                *sum += axis * (light(bright) - light(dark));
            }
        }
        let to_world = camera.view(self.settings.size)?.rotation.transpose();
        let normal = |sum: DVec3| match sum.length() {
            length if length > LEAST_LIGHT => (to_world * sum / length).as_vec3().to_array(),
            _ => [0.0; 3],
        };
        Ok(sums.into_iter().map(normal).collect())
    }

    /// Returns the number of the input that is seen at each pixel: the nearest one that absorbs
    /// half of the light by itself, or if none does, the one that absorbs most.
    fn identifiers(
        &self,
        (scene, inputs): (&Scene, &[Range<usize>]),
        draw: &mut DrawLayer<'_>,
    ) -> Result<Vec<u32>> {
        let mut seen: Vec<(u32, f32, f32)> = Vec::new();
        for (number, items) in (1..).zip(inputs) {
            if items.is_empty() {
                continue;
            }
            let alone = scene.filtered(|item| items.contains(&item));
            let picture = draw(Some(&alone), &self.settings)?.reduced(self.factor)?;
            seen.resize(picture.color.len(), (0, f32::INFINITY, LEAST_OPACITY));
            let pixels = picture.color.iter().zip(&picture.depth);
            for ((nearest, depth, opacity), (color, place)) in seen.iter_mut().zip(pixels) {
                let is_seen = match (place.is_finite(), depth.is_finite()) {
                    (true, _) => place < depth,
                    (false, false) => color[3] >= *opacity,
                    (false, true) => false,
                };
                if is_seen {
                    (*nearest, *depth, *opacity) = (number, *place, color[3].max(LEAST_OPACITY));
                }
            }
        }
        Ok(seen.into_iter().map(|(number, ..)| number).collect())
    }
}

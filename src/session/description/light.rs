//! The light and the lines of a picture, as a description says them.

use super::{ColorEntry, PictureEntry, appearance::Wrong};
use crate::{
    picture::Outlines,
    scene::{Lighting, Occlusion},
};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Where light comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum LightName {
    /// Surfaces get it from the eye and from beside it, volumes from the eye
    /// ([`Lighting::default`]).
    #[default]
    Soft,
    /// From the eye.
    Head,
    /// From a lamp at the upper left before the scene, which casts shadows ([`Lighting::key`]).
    Key,
    /// From that lamp and from all sides ([`Lighting::studio`]).
    Studio,
    /// From all sides, more from above ([`Lighting::sky`]).
    Sky,
}

/// On backgrounds whose red, green and blue add up to less, outlines are white.
const DARK: f32 = 1.2;

impl PictureEntry {
    pub(super) fn check_light(&self) -> Result<(), Wrong> {
        if self.ambient_occlusion.is_some_and(|strength| !(0.0..=1.0).contains(&strength)) {
            return Err(("ambient_occlusion", "must be a number from 0 to 1".into()));
        }
        if self.eye_dome.is_some_and(|strength| !(0.0..=100.0).contains(&strength)) {
            return Err(("eye_dome", "must be a number from 0 to 100".into()));
        }
        if self.outline.is_some_and(|width| !(0.0..=100.0).contains(&width)) {
            return Err(("outline", "must be a number of pixels from 0 to 100".into()));
        }
        if self.outline_color.is_some() && self.outline.is_none() {
            return Err(("outline_color", "needs the width of the outlines (--outline)".into()));
        }
        let is_key = matches!(self.light, Some(LightName::Key | LightName::Studio));
        if self.shadows == Some(true) && !is_key {
            let message = "needs a lamp that casts them: the light key or studio (--light key)";
            return Err(("shadows", message.into()));
        }
        Ok(())
    }

    /// Returns the outlines of the picture; `None` if there are none.
    pub(in crate::session) fn outlines(&self) -> Option<Outlines> {
        let width = self.outline.filter(|width| *width > 0.0)?;
        let dark = self.background().is_some_and(|parts| parts.iter().sum::<f32>() < DARK);
        let usual = if dark { [1.0; 3] } else { [0.0; 3] };
        Some(Outlines { width, color: self.outline_color.map_or(usual, |ColorEntry(color)| color) })
    }

    /// Returns the light of a picture whose scene stands with this direction up.
    pub(super) fn lighting(&self, up: DVec3) -> Lighting {
        let lighting = match self.light.unwrap_or_default() {
            LightName::Soft => Lighting::default(),
            LightName::Head => Lighting::head(),
            LightName::Key => Lighting::key(),
            LightName::Studio => Lighting::studio(up),
            LightName::Sky => Lighting::sky(up),
        };
        let mut lighting = lighting.with_shadows(self.shadows.unwrap_or(true));
        if let Some(strength) = self.ambient_occlusion {
            let usual = lighting.occlusion.unwrap_or_default();
            lighting.occlusion = (strength > 0.0).then_some(Occlusion { strength, ..usual });
        }
        lighting
    }
}

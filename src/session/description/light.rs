//! The light of a picture, as a description says it.

use super::{PictureEntry, appearance::Wrong};
use crate::scene::{Lighting, Occlusion};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Where light comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum LightName {
    /// From the eye.
    #[default]
    Head,
    /// From a lamp at the upper left before the scene, which casts shadows ([`Lighting::key`]).
    Key,
    /// From that lamp and from all sides ([`Lighting::studio`]).
    Studio,
    /// From all sides, more from above ([`Lighting::sky`]).
    Sky,
}

impl PictureEntry {
    pub(super) fn check_light(&self) -> Result<(), Wrong> {
        if self.ambient_occlusion.is_some_and(|strength| !(0.0..=1.0).contains(&strength)) {
            return Err(("ambient_occlusion", "must be a number from 0 to 1".into()));
        }
        if self.eye_dome.is_some_and(|strength| !(0.0..=100.0).contains(&strength)) {
            return Err(("eye_dome", "must be a number from 0 to 100".into()));
        }
        let is_key = matches!(self.light, Some(LightName::Key | LightName::Studio));
        if self.shadows == Some(true) && !is_key {
            let message = "needs a lamp that casts them: the light key or studio (--light key)";
            return Err(("shadows", message.into()));
        }
        Ok(())
    }

    /// Returns the light of a picture whose scene stands with this direction up.
    pub(super) fn lighting(&self, up: DVec3) -> Lighting {
        let lighting = match self.light.unwrap_or_default() {
            LightName::Head => Lighting::default(),
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

//! Maximum intensity pictures of several fields ([`Optics::Maximum`](crate::scene::Optics)): each
//! field is drawn alone while the others are hidden, and the light of the pictures is added.

use super::{ItemId, Renderer};
use crate::{
    Result,
    math::Viewpoint,
    picture::Picture,
    plan::FrameStats,
    scene::{Optics, Settings},
};

/// The pictures so far.
#[derive(Default)]
struct Sum(Option<(Picture, FrameStats)>);

impl Sum {
    fn add(&mut self, (picture, stats): (Picture, FrameStats)) {
        match &mut self.0 {
            Some((sum, all)) => {
                sum.add_light(&picture);
                all.add(stats);
            }
            none => *none = Some((picture, stats)),
        }
    }

    fn done(self) -> (Picture, FrameStats) {
        self.0.expect("there are several fields")
    }
}

impl Renderer {
    /// Returns whether a picture is the sum of pictures of single fields.
    pub(super) fn adds_maxima(&self, settings: &Settings) -> bool {
        settings.optics == Optics::Maximum && self.scene.fields().len() > 1
    }

    pub(super) fn render_maxima(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        self.scene.validate_settings(settings)?;
        let (fields, mut sum) = (self.visible(), Sum::default());
        for &field in &fields {
            let drawn =
                self.show_only(field, &fields).and_then(|()| self.render_once(viewpoint, settings));
            match drawn {
                Ok(drawn) => sum.add(drawn),
                Err(error) => return Err(self.show_all(&fields).err().unwrap_or(error)),
            }
        }
        self.show_all(&fields)?;
        Ok(sum.done())
    }

    pub(super) async fn render_maxima_async(
        &mut self,
        viewpoint: &impl Viewpoint,
        settings: &Settings,
    ) -> Result<(Picture, FrameStats)> {
        self.scene.validate_settings(settings)?;
        let (fields, mut sum) = (self.visible(), Sum::default());
        for &field in &fields {
            let drawn = match self.show_only(field, &fields) {
                Ok(()) => Box::pin(self.render_async(viewpoint, settings)).await,
                Err(error) => Err(error),
            };
            match drawn {
                Ok(drawn) => sum.add(drawn),
                Err(error) => return Err(self.show_all(&fields).err().unwrap_or(error)),
            }
        }
        self.show_all(&fields)?;
        Ok(sum.done())
    }

    fn visible(&self) -> Vec<ItemId> {
        let is_visible = |id: &ItemId| self.is_visible(*id).unwrap_or(false);
        self.items().filter(is_visible).collect()
    }

    /// Shows one of some items, and hides the others.
    fn show_only(&mut self, field: ItemId, fields: &[ItemId]) -> Result<()> {
        self.set_visible(field, true)?;
        let mut others = fields.iter().filter(|other| **other != field);
        others.try_for_each(|other| self.set_visible(*other, false))
    }

    fn show_all(&mut self, fields: &[ItemId]) -> Result<()> {
        fields.iter().try_for_each(|field| self.set_visible(*field, true))
    }
}

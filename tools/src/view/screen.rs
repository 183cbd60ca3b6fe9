//! Where points of the world are on the screen.

use eframe::egui::{Pos2, Rect, Vec2};
use glam::DVec3;
use splatkit::math::View;

/// A view, and the area of the window that shows it.
pub struct Screen {
    pub view: View,
    pub area: Rect,
    /// Pixels of the view in a point of the screen.
    pub scale: f32,
}

impl Screen {
    /// Returns where a point of the world is shown; `None` if it is behind the camera.
    pub fn place(&self, point: DVec3) -> Option<Pos2> {
        let p = self.view.to_view(point);
        let depth = if self.view.perspective { p.z } else { 1.0 };
        let at = p.truncate() * self.view.scale / depth + self.view.center;
        (depth > 0.0).then(|| self.area.min + Vec2::new(at.x as f32, at.y as f32) / self.scale)
    }
}

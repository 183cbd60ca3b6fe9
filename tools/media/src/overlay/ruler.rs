//! Scale bars: a round length as it appears in the picture.

use super::{
    canvas::{Align, Area, Canvas},
    ticks::{plain, round_below},
};
use glam::DVec2;
use splatkit::math::{Camera, Projection};

/// A length in the world and in the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Ruler {
    pub length: f64,
    pub pixels: f64,
    pub text: String,
}

impl Ruler {
    /// Returns the longest round length that is at most `most` pixels long. Of a camera with
    /// perspective, it holds at the distance of the point that the camera looks at.
    pub fn new(camera: &Camera, height: u32, most: f64, unit: &str) -> Option<Self> {
        let visible = match camera.projection {
            Projection::Orthographic { height } => height,
            Projection::Perspective { view_angle } => {
                let distance = camera.position.distance(camera.focal_point);
                2.0 * distance * (0.5 * view_angle.to_radians()).tan()
            }
        };
        let scale = f64::from(height) / visible;
        let length = round_below(most / scale);
        let pixels = length * scale;
        let fits = pixels.is_finite() && length.is_finite() && length > 0.0 && pixels <= most;
        let text = match unit {
            "" => plain(length),
            unit => format!("{} {unit}", plain(length)),
        };
        fits.then_some(Self { length, pixels, text })
    }

    /// Draws it at the lower right of an area.
    pub fn draw(&self, canvas: &mut Canvas, area: Area) {
        let (size, line) = (canvas.size, canvas.line_width());
        let right = DVec2::new(area.right, area.bottom - 0.3 * size);
        let left = right - DVec2::X * self.pixels;
        let end = DVec2::Y * 0.3 * size;
        let lines = [[left, right], [left - end, left + end], [right - end, right + end]];
        let color = canvas.ink.color;
        canvas.lines(&lines, 1.4 * line, color);
        let middle = 0.5 * (left + right);
        // A text wider than the bar keeps inside the picture.
        let half = 0.5 * canvas.text_width(&self.text);
        let x = middle.x.min(area.right - half);
        canvas.text(&self.text, DVec2::new(x, right.y - 0.95 * size), Align::Middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatkit::{glam::DVec3, math::Bounds};

    #[test]
    fn rulers_are_round_and_true() {
        let bounds = Bounds { min: DVec3::splat(-50.0), max: DVec3::splat(50.0) };
        let mut camera = Camera::framing(&bounds, DVec3::NEG_Z, DVec3::Y, 1.0);
        let near = Ruler::new(&camera, 500, 120.0, "mm").unwrap();
        camera.make_orthographic();
        let flat = Ruler::new(&camera, 500, 120.0, "mm").unwrap();
        // Making a camera orthographic keeps the size at the focal point.
        assert!((near.pixels / flat.pixels - 1.0).abs() < 1e-9 && near.text == flat.text);
        let view = camera.view([500; 2]).unwrap();
        assert!((flat.length * view.scale - flat.pixels).abs() < 1e-6);
        assert!(flat.pixels <= 120.0 && flat.pixels > 40.0, "{flat:?}");
        let digit = flat.length / 10f64.powf(flat.length.log10().floor());
        assert!([1.0, 2.0, 5.0].iter().any(|round| (digit - round).abs() < 1e-9), "{flat:?}");
    }
}

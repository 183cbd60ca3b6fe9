//! The sheets: an ascending list of distances along the rays that divides the scene into layers.
//!
//! Distances are measured along each pixel's ray. Sheets are therefore planes parallel to the
//! picture in orthographic views, and shells around the eye in perspective. Shells keep a sheet
//! equally thick for every pixel and in place when the camera turns on the spot. They also make the
//! sections of an isotropic kernel the same for all pixels of its footprint. With planes, the
//! sections shift towards the picture's corners, because the rays are slanted. See docs/engine.md.

use super::View;

/// Boundaries s₀ < s₁ < … of the sheets; sheet k reaches from `planes[k]` to `planes[k + 1]`.
///
/// Up to `turn`, each sheet is thicker than the one before it by the factor `ratio`: a fixed number
/// of pixels, for surfaces in perspective. From there on all are `step` thick, for lattices.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheets {
    /// The boundaries, in world units along the ray from the view's origin.
    pub planes: Vec<f64>,
    /// Growth of the geometric part; 1 if there is none.
    pub ratio: f64,
    /// Number of geometric sheets.
    pub turn: usize,
    /// Thickness of the uniform part, in world units.
    pub step: f64,
}

impl Sheets {
    /// Most sheets of a scene. If more are needed, sheets become thicker instead.
    pub const MAX: usize = 4093;

    /// Returns sheets from `near` to `far` (world units), at most `thickness` thick and at most
    /// `pixels` pixels thick (`None`: no such bound). At least one of the two must be set.
    pub fn new(
        view: &View,
        [near, far]: [f64; 2],
        thickness: Option<f64>,
        pixels: Option<f64>,
    ) -> Self {
        let far = far.max(near + f64::EPSILON * near.abs().max(1.0));
        let mut coarser = 1.0;
        loop {
            let sheets = Self::with_bounds(view, [near, far], thickness, pixels, coarser);
            match sheets {
                Some(sheets) => return sheets,
                None => coarser *= 1.25,
            }
        }
    }

    fn with_bounds(
        view: &View,
        [near, far]: [f64; 2],
        thickness: Option<f64>,
        pixels: Option<f64>,
        coarser: f64,
    ) -> Option<Self> {
        let uniform = thickness.map_or(f64::INFINITY, |t| t * coarser);
        let per_pixel = pixels.map_or(f64::INFINITY, |p| p * coarser / view.scale);
        let mut planes = vec![near];
        let mut ratio = 1.0;
        let step;
        if view.perspective && per_pixel.is_finite() {
            ratio = 1.0 + per_pixel;
            let mut s = near;
            while s < far && s * per_pixel < uniform {
                s *= ratio;
                planes.push(s);
                if planes.len() > Self::MAX {
                    return None;
                }
            }
            step = if uniform.is_finite() { uniform } else { s * per_pixel };
        } else {
            step = uniform.min(if view.perspective { f64::INFINITY } else { per_pixel });
        }
        // The values that the step is compared with lie between the bounds.
        let step = step.min(far - near);
        let turn = planes.len() - 1;
        let start = planes[turn];
        let more = ((far - start) / step).ceil().max(if turn == 0 { 1.0 } else { 0.0 });
        if more + turn as f64 > Self::MAX as f64 {
            return None;
        }
        planes.extend((1..=more as usize).map(|i| start + step * i as f64));
        Some(Self { planes, ratio, turn, step })
    }

    /// Number of sheets.
    pub fn count(&self) -> usize {
        self.planes.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};
    use glam::DVec3;

    fn view(perspective: bool) -> View {
        let projection = if perspective {
            Projection::Perspective { view_angle: 30.0 }
        } else {
            Projection::Orthographic { height: 10.0 }
        };
        let camera =
            Camera { position: DVec3::ZERO, focal_point: DVec3::X, view_up: DVec3::Z, projection };
        camera.view([100, 100]).unwrap()
    }

    #[test]
    fn sheets_are_monotone_cover_the_range_and_keep_both_bounds() {
        for perspective in [false, true] {
            let view = view(perspective);
            for (thickness, pixels) in
                [(Some(0.5), None), (None, Some(4.0)), (Some(0.5), Some(4.0))]
            {
                let sheets = Sheets::new(&view, [2.0, 50.0], thickness, pixels);
                assert!(sheets.planes[0] <= 2.0 && *sheets.planes.last().unwrap() >= 50.0 - 1e-9);
                for pair in sheets.planes.windows(2) {
                    let step = pair[1] - pair[0];
                    assert!(step > 0.0);
                    if let Some(t) = thickness {
                        assert!(step <= t * (1.0 + 1e-9));
                    }
                    if let Some(p) = pixels {
                        let distance = if perspective { pair[0] } else { 1.0 };
                        assert!(step <= p * distance / view.scale * (1.0 + 1e-9));
                    }
                }
            }
        }
    }

    #[test]
    fn a_deep_scene_gets_thicker_sheets_and_not_too_many() {
        let sheets = Sheets::new(&view(true), [1e-3, 1e6], Some(1.0), Some(1.0));
        assert!(sheets.count() <= Sheets::MAX);
        assert!(*sheets.planes.last().unwrap() >= 1e6);
    }
}

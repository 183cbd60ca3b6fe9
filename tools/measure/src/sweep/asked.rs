//! The work that a picture asks for, independent of the engine: pixels, positions on their rays,
//! and samples.
//!
//! The engine decides only which pixels are covered.

use glam::{DVec2, DVec3};
use splatkit::{
    Result,
    math::{Bounds, Camera, Kernel, View},
    picture::Picture,
    scene::Settings,
    volume::{TransferFunction, phantoms::Phantom},
};
use std::sync::Arc;

/// Rays along each side of the picture, and positions on the diagonal of a volume's box, for
/// estimating the positions on rays.
const RAYS: u32 = 40;
const PLACES: f64 = 160.0;
/// Positions along each side of the box, for estimating the samples in view.
const SAMPLES: u32 = 24;
/// The optical depth behind which nothing is visible.
const OPAQUE: f64 = 7.6;
/// About how many splats may cover a pixel at a cut of one pixel: neighbouring splats overlap, and
/// near sides lie in front of far ones.
const SPLATS_OF_PIXEL: f64 = 4.0;
/// Least opacity that shows in a picture of 8 bits.
const COVERED: f32 = 0.5 / 255.0;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Asked {
    /// Number of pixels that show something.
    pub pixels: f64,
    /// Samples along the rays of all pixels: those that show something, up to where a ray is
    /// opaque. Sheets count instead if they are set thinner. Kernels count by how many samples they
    /// reach; the default kernel counts as 1. 0 for surfaces.
    pub on_rays: f64,
    /// Samples in view that show something, counted likewise. For surfaces, the points in view; a
    /// hierarchy counts at most as many as its cut asks for.
    pub in_view: f64,
}

impl Asked {
    /// Returns how many times as much this asks for as `other`, in the quantity that grows most; at
    /// least 1.
    pub fn times(&self, other: &Self) -> f64 {
        let ratio =
            |value: f64, other: f64| if value > 0.0 && other > 0.0 { value / other } else { 1.0 };
        let ratios = [
            ratio(self.pixels, other.pixels),
            ratio(self.on_rays, other.on_rays),
            ratio(self.in_view, other.in_view),
        ];
        ratios.into_iter().fold(1.0, f64::max)
    }
}

/// The content of a scene, as far as it decides what pictures ask for.
pub enum Content {
    Field(Box<Field>),
    Surface(Surface),
}

/// A phantom on a lattice.
pub struct Field {
    pub phantom: Phantom,
    /// The value of a sample where the phantom is 1.
    pub scale: f64,
    pub transfer: TransferFunction,
    pub bounds: Bounds,
    pub samples: usize,
    /// Samples per unit length along each axis.
    pub density: DVec3,
    /// The kernel's reach in samples.
    pub extent: f64,
}

/// A model of many points.
pub struct Surface {
    /// A selection of the points.
    pub points: Arc<[DVec3]>,
    pub count: u64,
    /// The cut in pixels.
    pub cut: f64,
}

impl Content {
    pub fn asked(&self, camera: &Camera, settings: &Settings, picture: &Picture) -> Result<Asked> {
        let view = camera.view(settings.size)?;
        let pixels = picture.color.iter().filter(|color| color[3] >= COVERED).count() as f64;
        Ok(match self {
            Self::Field(field) => {
                // A kernel that reaches twice as far adds up eight times as many samples.
                let kernel = (field.extent / Kernel::default().extent).powi(3);
                Asked {
                    pixels,
                    on_rays: kernel * field.on_rays(&view, settings.sheet_thickness),
                    in_view: kernel * field.in_view(&view),
                }
            }
            Self::Surface(surface) => {
                Asked { pixels, on_rays: 0.0, in_view: surface.in_view(&view, pixels) }
            }
        })
    }
}

impl Field {
    fn extinction(&self, place: DVec3) -> f64 {
        self.transfer.extinction(self.phantom.value(place) * self.scale)
    }

    fn on_rays(&self, view: &View, thickness: Option<f64>) -> f64 {
        let step = self.bounds.diagonal() / PLACES;
        let turn = view.rotation.transpose();
        let [width, height] = view.size.map(f64::from);
        let mut sum = 0.0;
        for at in 0..RAYS * RAYS {
            let part =
                (DVec2::new(f64::from(at % RAYS), f64::from(at / RAYS)) + 0.5) / f64::from(RAYS);
            let (start, direction) = view.ray(part * DVec2::new(width, height));
            let (start, direction) = (view.position + turn * start, turn * direction);
            let Some([near, far]) = within(&self.bounds, start, direction) else { continue };
            // Sheets that are thicker than samples do not reduce the samples on a ray.
            let density = (self.density * direction)
                .length()
                .max(thickness.map_or(0.0, |length| 1.0 / length));
            let mut depth = 0.0;
            let mut distance = near + 0.5 * step;
            while distance < far && depth < OPAQUE {
                let extinction = self.extinction(start + distance * direction);
                if extinction > 0.0 {
                    sum += step * density;
                }
                depth += step * extinction;
                distance += step;
            }
        }
        sum * width * height / f64::from(RAYS * RAYS)
    }

    fn in_view(&self, view: &View) -> f64 {
        let Self { bounds, .. } = self;
        let place = |at: u32| {
            let index = [at % SAMPLES, at / SAMPLES % SAMPLES, at / SAMPLES.pow(2)].map(f64::from);
            bounds.min + bounds.size() * (DVec3::from(index) + 0.5) / f64::from(SAMPLES)
        };
        let seen = (0..SAMPLES.pow(3))
            .map(place)
            .filter(|&place| is_in(view, place) && self.extinction(place) > 0.0);
        self.samples as f64 * seen.count() as f64 / f64::from(SAMPLES.pow(3))
    }
}

impl Surface {
    fn in_view(&self, view: &View, pixels: f64) -> f64 {
        let seen = self.points.iter().filter(|&&point| is_in(view, point)).count();
        let all = self.count as f64 * seen as f64 / self.points.len().max(1) as f64;
        // The finest level always asks for all of its points.
        if self.cut > 0.0 { all.min(SPLATS_OF_PIXEL * pixels / self.cut.powi(2)) } else { all }
    }
}

/// Whether a position is in the picture.
fn is_in(view: &View, place: DVec3) -> bool {
    let place = view.to_view(place);
    if view.perspective && place.z <= 0.0 {
        return false;
    }
    let pixel = view.scale * place.truncate() / if view.perspective { place.z } else { 1.0 };
    pixel.abs().cmple(view.center).all()
}

/// Returns the distances at which a ray enters and leaves a box, from the ray's origin on.
fn within(bounds: &Bounds, start: DVec3, direction: DVec3) -> Option<[f64; 2]> {
    let (first, second) = ((bounds.min - start) / direction, (bounds.max - start) / direction);
    let near = first.min(second).max_element().max(0.0);
    let far = first.max(second).min_element();
    (near < far).then_some([near, far])
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatkit::volume::TransferFunction;

    const SIZE: [u32; 2] = [80, 80];

    fn field() -> Field {
        Field {
            phantom: Phantom::Constant(1.0),
            scale: 1.0,
            transfer: TransferFunction {
                color: vec![(0.0, [1.0; 3])],
                opacity: vec![(0.0, 0.01)],
                unit: 1.0,
                ..TransferFunction::default()
            },
            bounds: Bounds { min: DVec3::splat(-1.0), max: DVec3::splat(1.0) },
            samples: 1000,
            density: DVec3::splat(5.0),
            extent: 2.0,
        }
    }

    /// Returns a view without perspective that sees the cube in half the picture's width.
    fn view() -> View {
        let mut camera = Camera::framing(&field().bounds, DVec3::Y, DVec3::Z, 1.0);
        camera.projection = splatkit::math::Projection::Orthographic { height: 4.0 };
        camera.view(SIZE).unwrap()
    }

    #[test]
    fn places_on_rays_are_counted() {
        let near = |actual: f64, wanted: f64| {
            assert!((actual / wanted - 1.0).abs() < 0.05, "{actual} {wanted}");
        };
        // 40 × 40 pixels of 10 samples each.
        near(field().on_rays(&view(), None), 16_000.0);
        near(field().on_rays(&view(), Some(1.0)), 16_000.0);
        near(field().on_rays(&view(), Some(0.1)), 32_000.0);
        near(field().in_view(&view()), 1000.0);
        // Opaque after half of the way.
        let transfer =
            TransferFunction { opacity: vec![(0.0, 1.0 - (-OPAQUE).exp())], ..field().transfer };
        near(Field { transfer, ..field() }.on_rays(&view(), None), 8_000.0);
        let transfer = TransferFunction { opacity: vec![(0.0, 0.0)], ..field().transfer };
        assert_eq!(Field { transfer, ..field() }.on_rays(&view(), None), 0.0);
    }

    #[test]
    fn a_cut_asks_for_no_more_than_it_shows() {
        let points: Arc<[DVec3]> = [DVec3::ZERO, DVec3::splat(9.0)].into();
        let surface = |cut| Surface { points: points.clone(), count: 1000, cut };
        assert_eq!(surface(0.0).in_view(&view(), 10.0), 500.0);
        assert_eq!(surface(1.0).in_view(&view(), 10.0), 40.0);
        assert_eq!(surface(2.0).in_view(&view(), 1e6), 500.0);
    }

    #[test]
    fn what_grows_most_explains() {
        let one = Asked { pixels: 10.0, on_rays: 100.0, in_view: 7.0 };
        let other = Asked { pixels: 20.0, on_rays: 300.0, in_view: 1.0 };
        assert_eq!((other.times(&one), one.times(&other)), (3.0, 7.0));
        assert_eq!(Asked { pixels: 5.0, ..Asked::default() }.times(&one), 1.0);
    }
}

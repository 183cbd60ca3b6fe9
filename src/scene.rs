//! What is drawn and how: a scene of splat sets and volumes, and the settings of a picture.

use crate::{
    Error, Result,
    math::{Bounds, Kernel, Sheets, View},
    splat::{FOOTPRINT_BLUR, Payload, SplatSet},
    volume::{Shade, TransferFunction, Volume},
};
use std::sync::Arc;

/// One thing in a scene.
#[derive(Debug, Clone)]
pub enum Item {
    /// Surfels, 3D Gaussians: splats that carry their own colour and optical depth.
    Radiance(Arc<SplatSet>),
    /// Scattered samples: splats that carry a value, shown by a transfer function.
    Scalar(Arc<SplatSet>, TransferFunction),
    /// Samples on a lattice, each the centre of one kernel, shown by a transfer function.
    Volume(Arc<Volume>, Kernel, TransferFunction),
}

/// The items of a picture. All are drawn together by the same sheets.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    pub items: Vec<Item>,
}

impl Scene {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds splats that carry radiance.
    #[must_use]
    pub fn with_splats(mut self, set: impl Into<Arc<SplatSet>>) -> Self {
        self.items.push(Item::Radiance(set.into()));
        self
    }

    /// Adds scattered samples.
    #[must_use]
    pub fn with_samples(mut self, set: impl Into<Arc<SplatSet>>, transfer: TransferFunction) -> Self {
        self.items.push(Item::Scalar(set.into(), transfer));
        self
    }

    /// Adds a volume.
    #[must_use]
    pub fn with_volume(mut self, volume: impl Into<Arc<Volume>>, kernel: Kernel, transfer: TransferFunction) -> Self {
        self.items.push(Item::Volume(volume.into(), kernel, transfer));
        self
    }

    /// The box around everything that can be seen, footprints included.
    pub fn bounds(&self) -> Bounds {
        self.items.iter().fold(Bounds::EMPTY, |all, item| all.union(item.bounds()))
    }

    /// Checks that the engine can draw the scene: payloads that fit their items, and one scalar field at most (the
    /// densities of two fields under two transfer functions cannot be added in one sheet).
    pub fn validate(&self) -> Result<()> {
        let mut fields = 0;
        for item in &self.items {
            let (set, payload) = match item {
                Item::Radiance(set) => (set, Payload::Radiance),
                Item::Scalar(set, _) => (set, Payload::Scalar),
                Item::Volume(..) => {
                    fields += 1;
                    continue;
                }
            };
            fields += usize::from(payload == Payload::Scalar);
            if set.payload != payload {
                return Err(Error::Argument(format!("a set of {:?} splats was added as {payload:?}", set.payload)));
            }
            if !(set.extent > 0.0 && set.extent <= SplatSet::MAX_EXTENT) {
                let most = SplatSet::MAX_EXTENT;
                return Err(Error::Argument(format!("a splat set's extent must lie in 0 … {most}, is {}", set.extent)));
            }
        }
        if fields > 1 {
            return Err(Error::Argument(format!("a picture takes one volume or sample set, the scene has {fields}")));
        }
        if self.bounds().is_empty() {
            return Err(Error::NothingToDraw("the scene holds no splats".into()));
        }
        Ok(())
    }

    /// The largest extent of the scene's splat sets, in standard deviations; 0 without any.
    fn widest_extent(&self) -> f64 {
        let extents = self.items.iter().map(|item| match item {
            Item::Radiance(set) | Item::Scalar(set, _) => f64::from(set.extent),
            Item::Volume(..) => 0.0,
        });
        extents.fold(0.0, f64::max)
    }

    /// The sheets of a picture of this scene: as thick as two thirds of a kernel's radius for volumes (a kernel meets at
    /// most four), a few pixels for surfaces, the finer of both where the scene holds both.
    pub fn sheets(&self, view: &View, settings: &Settings) -> Sheets {
        let bounds = self.bounds();
        let [mut near, mut far] = view.distances(&bounds);
        // Widened footprints reach beyond the bounds: a flat surface seen from the front would lie in sheets far thinner
        // than itself.
        let reach = FOOTPRINT_BLUR * self.widest_extent() / view.scale;
        if view.perspective {
            (near, far) = (near * (1.0 - reach), far * (1.0 + reach));
            near = near.max(settings.near.unwrap_or(1e-3 * bounds.diagonal()));
        } else {
            (near, far) = (near - reach, far + reach);
        }
        let mut thickness = settings.sheet_thickness;
        let mut pixels = None;
        for item in &self.items {
            match item {
                Item::Volume(volume, kernel, _) if settings.sheet_thickness.is_none() => {
                    let spacing = volume.lattice.axes.determinant().abs().cbrt();
                    let step = 2.0 / 3.0 * kernel.extent * spacing;
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Volume(..) => {}
                Item::Radiance(_) | Item::Scalar(..) => pixels = Some(settings.sheet_pixels),
            }
        }
        Sheets::new(view, [near, far], thickness, pixels)
    }
}

impl Item {
    /// The box around the item, footprints included.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Radiance(set) | Self::Scalar(set, _) => set.bounds(),
            Self::Volume(volume, kernel, _) => {
                let axes = volume.lattice.axes;
                let reach =
                    kernel.extent * glam::DVec3::new(axes.row(0).length(), axes.row(1).length(), axes.row(2).length());
                let [low, high] = volume.bounds();
                Bounds { min: low - reach, max: high + reach }
            }
        }
    }
}

/// How the gradient across the picture is found; along the ray it is always the difference of neighbouring sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradient {
    /// Derivative of the footprints.
    #[default]
    Analytic,
    /// Differences of neighbouring pixels of a sheet (Mueller, Möller & Crawfis 1999, and the GPU sheet buffers after it).
    Central,
}

/// The settings of a picture.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub gradient: Gradient,
    /// Light on volumes, instead of the transfer function's own; `Some(None)` for none.
    pub volume_shade: Option<Option<Shade>>,
    /// Light on splats with normals; `None` draws their colours as they are.
    pub surface_shade: Option<Shade>,
    /// Largest thickness of a sheet in world units; chosen from the scene where `None`.
    pub sheet_thickness: Option<f64>,
    /// Largest thickness of a sheet in pixels, where the scene holds explicit splats.
    pub sheet_pixels: f64,
    /// Perspective views show nothing nearer than this (world units); a thousandth of the scene where `None`.
    pub near: Option<f64>,
}

impl Settings {
    /// The defaults for a picture of `size` pixels (width, height).
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            size,
            gradient: Gradient::default(),
            volume_shade: None,
            surface_shade: Some(Shade { ambient: 0.2, diffuse: 0.75, specular: 0.15, power: 24.0 }),
            sheet_thickness: None,
            sheet_pixels: 4.0,
            near: None,
        }
    }

    /// The light on a volume that `transfer` shows.
    pub fn shade_of(&self, transfer: &TransferFunction) -> Option<Shade> {
        self.volume_shade.unwrap_or(transfer.shade)
    }
}

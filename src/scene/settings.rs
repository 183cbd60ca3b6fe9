//! The settings of a picture: its size and the methods that draw it.

use super::Lighting;
use crate::{
    Stop,
    hierarchy::Detail,
    math::{Bounds, Clip, View},
    volume::{Shade, TransferFunction},
};
use serde::{Deserialize, Serialize};

/// The layers that are composited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Image-aligned sheets (Mueller & Crawfis 1998): sheets parallel to the picture cut every
    /// kernel into sections. Trained Gaussians alone are not cut: each counts whole at the depth of
    /// its centre, divided between two thin sheets.
    #[default]
    Sheets,
    /// Axis-aligned sheets (Westover 1990): slices of the data across the data's axis nearest to
    /// the view direction. Each kernel is added whole to the slice that contains its centre.
    /// Samples are classified before they are added.
    AxisSheets,
    /// Single splats (Westover 1989): each is composited whole, in the order of the distances of
    /// their centres. Samples are classified first.
    Splats(Order),
}

/// The order in which single splats are composited. Both orders give the same picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Order {
    /// The nearest splat first.
    #[default]
    FrontToBack,
    /// The farthest splat first.
    BackToFront,
}

/// When the values of a field are mapped to colour and opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Classification {
    /// Everywhere along the ray inside a sheet. The values at its two faces and its mean define a
    /// parabola, over which the transfer function is integrated. Thin shells keep their look in
    /// thick sheets.
    #[default]
    PreIntegrated,
    /// Once per sheet, for its mean (Mueller, Möller & Crawfis 1999).
    Post,
    /// Once per sample, before interpolation (Westover 1990). Blurs edges; for comparison.
    Pre,
}

/// How a ray through a field becomes the colour of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum Optics {
    /// Emission and absorption (Max 1995). In JSON `light`.
    #[default]
    #[serde(rename = "light")]
    EmissionAbsorption,
    /// The colour and opacity of the largest value on the ray. The light of several fields is
    /// added.
    Maximum,
    /// The light that the field absorbs, in white: opacity only, without colour and lighting.
    #[serde(rename = "x-ray")]
    XRay,
}

/// The part of a picture that one of several machines draws. At each pixel it consists of the
/// sheets whose middle lies in a box. The parts of boxes that fill space, composited in the order
/// of their distances from the eye, are the picture of the whole scene. Sheets, levels and culling
/// are those of the whole, and only what a region needs is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// The box, in world coordinates. Samples and nodes beyond its faces are read as far as kernels
    /// and sheets reach.
    pub bounds: Bounds,
    /// The finest level of volumes in bricks, in the unit of
    /// [`FrameStats::lambda`](crate::FrameStats). Set it to the finest level that fits the memory
    /// of every machine, so that all draw the same one.
    pub level: f64,
}

/// How the gradient across the picture is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Gradient {
    /// From the derivative of the kernels.
    #[default]
    Analytic,
    /// From differences of neighbouring pixels of a sheet (Mueller, Möller & Crawfis 1999, and the
    /// GPU sheet buffers after it).
    Central,
}

/// How the field of a lattice is evaluated in a sheet. The pictures agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Evaluate {
    /// Gathers a volume if possible, and scatters everything else.
    #[default]
    Auto,
    /// Each pixel adds up the kernels that reach its ray, which is the faster way. The fields of
    /// the scene must be volumes, at least one, and there may be surfaces too. On the GPU engine,
    /// the volume needs a Cartesian lattice and a Gaussian kernel. Other scenes are an error.
    Gather,
    /// Each splat is added to the pixels that it covers.
    Scatter,
}

/// The settings of a picture.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How splats are gathered into layers.
    pub mode: Mode,
    /// When a field's values become colour and opacity.
    pub classification: Classification,
    /// How the values along a ray become one colour.
    pub optics: Optics,
    /// Clips that cut the scene, at most [`Settings::MAX_CLIPS`].
    pub clips: Vec<Clip>,
    /// The part of the picture to draw, by the CPU engine in the mode [`Mode::Sheets`]. `None`
    /// draws the whole.
    pub region: Option<Region>,
    /// How the gradients of fields are found, for light and for `gradient` of transfer functions.
    pub gradient: Gradient,
    /// How the field of a lattice is evaluated in a sheet.
    pub evaluate: Evaluate,
    /// Lighting of volumes, instead of the transfer function's own. `Some(None)` turns it off.
    pub volume_shade: Option<Option<Shade>>,
    /// Lighting of splats with normals. `None` draws their colours unlit.
    pub surface_shade: Option<Shade>,
    /// Where light comes from, and what keeps it away. In other ways than image-aligned sheets of
    /// emission and absorption, all light comes from the eye.
    pub lighting: Lighting,
    /// Maximum thickness of a sheet in world units. `None` derives it from the scene.
    pub sheet_thickness: Option<f64>,
    /// Maximum thickness of a sheet in pixels, if the scene contains explicit splats.
    pub sheet_pixels: f64,
    /// Whether splats behind opaque parts are left out. The picture differs only where less than
    /// 0.0005 of the light passes. Turn it off to compare the cost of a frame.
    pub occlusion: bool,
    /// Level of detail of hierarchies and volumes in bricks. A sample of a volume counts as two
    /// sample spacings wide.
    pub detail: Detail,
    /// Whether nodes of hierarchies that face away from the eye are left out. This saves time where
    /// the front hides them, and loses parts of the picture where it does not. `None` leaves them
    /// out if the source was solid, is seen from outside its bounds, and is not clipped.
    pub cull_backfaces: Option<bool>,
    /// Nearest distance that perspective views show, in world units; at least a millionth of the
    /// scene's size. `None` is a thousandth of that size.
    pub near: Option<f64>,
    /// What limits the drawing of the picture.
    pub controls: Controls,
}

/// What limits the drawing of a picture: the picture that it should be stays the same.
#[derive(Debug, Clone)]
pub struct Controls {
    /// Whether drawing is to end before the picture is finished.
    pub stop: Stop,
    /// GPU memory, in bytes, for the pages of each hierarchy and for the bricks of a volume. The
    /// lists that frames make from bricks take more.
    pub page_memory: u64,
}

impl Default for Controls {
    fn default() -> Self {
        Self { stop: Stop::default(), page_memory: 1 << 30 }
    }
}

impl Settings {
    /// Maximum number of clips in a picture.
    pub const MAX_CLIPS: usize = 8;
    /// Maximum number of pixels in a picture. Each takes 20 bytes of memory.
    pub const MAX_PIXELS: u64 = 1 << 29;

    /// Returns the defaults for a picture of `size` pixels (width, height).
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            size,
            mode: Mode::default(),
            classification: Classification::default(),
            optics: Optics::default(),
            clips: Vec::new(),
            region: None,
            gradient: Gradient::default(),
            evaluate: Evaluate::default(),
            volume_shade: None,
            surface_shade: Some(Shade {
                // In full light, a surface has its own colour.
                ambient: 0.25,
                diffuse: 0.75,
                specular: 0.15,
                power: 24.0,
                certain: None,
            }),
            lighting: Lighting::default(),
            sheet_thickness: None,
            sheet_pixels: 8.0,
            occlusion: true,
            detail: Detail::default(),
            cull_backfaces: None,
            near: None,
            controls: Controls::default(),
        }
    }

    /// Whether samples are classified before they are added: on request, or because whole splats
    /// are composited.
    pub fn classifies_samples(&self) -> bool {
        self.mode != Mode::Sheets || self.classification == Classification::Pre
    }

    /// Whether nearer parts may hide farther ones. They do not if all values on a ray count alike,
    /// nor if the farthest comes first.
    pub fn hides(&self) -> bool {
        self.optics != Optics::Maximum && self.mode != Mode::Splats(Order::BackToFront)
    }

    /// Whether nodes that face away are left out of a hierarchy with these bounds. `closed` says
    /// whether the hierarchy bounds a solid.
    pub(crate) fn culls(&self, closed: bool, bounds: &Bounds, view: &View) -> bool {
        let is_outside =
            || !view.perspective || view.distances(bounds)[0] > self.near.unwrap_or(0.0);
        self.cull_backfaces.unwrap_or_else(|| closed && self.clips.is_empty() && is_outside())
    }

    /// Returns the lighting of a volume that `transfer` shows. Gradients are certain from the
    /// magnitudes on that the settings give, else from the transfer function's own.
    pub fn shade_of(&self, transfer: &TransferFunction) -> Option<Shade> {
        let certain = transfer.shade.and_then(|shade| shade.certain);
        match self.volume_shade {
            None => transfer.shade,
            Some(shade) => shade.map(|shade| Shade { certain: shade.certain.or(certain), ..shade }),
        }
    }

    /// Returns how a field is lit, with the gradients that are certain ([`Shade::certain`]), from
    /// the range of its samples and the diagonal of the box around them. `None` if it is not lit.
    pub(crate) fn light_of(
        &self,
        transfer: &TransferFunction,
        range: [f64; 2],
        diagonal: f64,
    ) -> Option<Shade> {
        let shade = self.shade_of(transfer)?;
        Some(Shade { certain: Some(shade.certain_in(transfer, range, diagonal)), ..shade })
    }
}

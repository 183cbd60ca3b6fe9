//! Where light comes from: the eye and beside it, a key light, the sky; and what keeps it away.

use super::{Gradient, Mode, Optics, Scene, Settings};
use crate::{
    hierarchy::Detail,
    math::{Bounds, View},
};
use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Where the light of a picture comes from. [`Shade`](crate::volume::Shade) says how much of it a
/// surface reflects; the shares here say how its diffuse part and its highlight are divided.
///
/// Trained Gaussians, and splats and facets without normals, carry their light in their colours.
/// They cast shadows and receive none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Lighting {
    /// The share of the light from the eye.
    pub head: f64,
    /// How surfaces get a part of that light from beside the eye. `None` lights them as fields are
    /// lit, from the eye alone.
    pub aside: Option<Aside>,
    /// A lamp far away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub key: Option<KeyLight>,
    /// Light from all sides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sky: Option<Sky>,
    /// Ambient occlusion: what lies around a place keeps light from all sides away. It dims the
    /// ambient part of the light, that of the sky and that of the eye.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub occlusion: Option<Occlusion>,
}

/// A lamp beside the eye, which moves with the camera and casts no shadows. It is not behind the
/// scene.
///
/// With light from the eye alone, faces that are turned by equal angles from the eye look alike,
/// and the edge between them is lost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Aside {
    /// The direction towards the lamp in view space: right, down, forward.
    #[cfg_attr(test, schemars(with = "[f64; 3]"))]
    pub direction: DVec3,
    /// The part of the eye's light that comes from there: from 0 to 1. The brightest part of a ball
    /// stays as bright as without the lamp.
    pub share: f64,
}

/// A lamp far away, which moves with the camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct KeyLight {
    /// The direction towards the lamp in view space: right, down, forward.
    #[cfg_attr(test, schemars(with = "[f64; 3]"))]
    pub direction: DVec3,
    /// Its share of the light.
    pub share: f64,
    /// The size of the map of its shadows, in pixels; 0 for a lamp that casts none.
    pub shadows: u32,
}

/// Light from all sides, brighter from above: 1 + d·up from the direction d.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Sky {
    /// The direction of the zenith in the world, of any length.
    #[cfg_attr(test, schemars(with = "[f64; 3]"))]
    pub up: DVec3,
    /// Its share of the light.
    pub share: f64,
}

/// Ambient occlusion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Occlusion {
    /// How far light is dimmed where none comes in: from 0 to 1, in full.
    pub strength: f64,
    /// How far away things count, as a share of the diagonal of the scene.
    pub radius: f64,
    /// Number of axes along which light comes in, from both ends.
    pub axes: u32,
    /// The size of the maps, in pixels.
    pub resolution: u32,
}

impl Default for Lighting {
    fn default() -> Self {
        Self { head: 1.0, aside: Some(Aside::default()), key: None, sky: None, occlusion: None }
    }
}

impl Default for Aside {
    fn default() -> Self {
        // 30 degrees to the left, and 30 degrees up.
        Self { direction: DVec3::new(-0.433, -0.5, -0.75), share: 0.5 }
    }
}

impl Default for Occlusion {
    fn default() -> Self {
        Self { strength: 1.0, radius: 0.1, axes: 8, resolution: 96 }
    }
}

/// Number of pixels of the map of shadows.
const SHADOWS: u32 = 256;

/// The largest size of a map, in pixels.
const MOST_PIXELS: u32 = 512;
/// The largest number of axes.
const MOST_AXES: u32 = 256;

impl Lighting {
    /// How far before a surface its light is taken, along its normal, in steps of the map or the
    /// lattice. A surface must not shade itself, and what lies behind it must not count. A map
    /// blurs a surface by two steps along the light, and by one and a half across it.
    pub(crate) const AHEAD: f64 = 2.5;

    /// All light from the eye.
    pub fn head() -> Self {
        Self { aside: None, ..Self::default() }
    }

    /// A lamp at the upper left before the scene, and some light from the eye in its shadows.
    pub fn key() -> Self {
        Self { head: 0.3, key: Some(KeyLight::upper_left(0.8)), ..Self::head() }
    }

    /// As photographers light: a key light, some light from all sides, and some from the eye.
    pub fn studio(up: DVec3) -> Self {
        // Together they are little more than the light from the eye alone, so that bright
        // surfaces keep their shapes.
        let sky = Some(Sky { up, share: 0.3 });
        let occlusion = Some(Occlusion::default());
        Self { head: 0.1, key: Some(KeyLight::upper_left(0.5)), sky, occlusion, ..Self::head() }
    }

    /// Light from all sides, brighter from above.
    pub fn sky(up: DVec3) -> Self {
        let occlusion = Occlusion { radius: 1.0, ..Occlusion::default() };
        let sky = Some(Sky { up, share: 0.9 });
        Self { head: 0.1, sky, occlusion: Some(occlusion), ..Self::head() }
    }

    /// Returns the same light, whose lamp casts shadows or not.
    #[must_use]
    pub fn with_shadows(mut self, casts: bool) -> Self {
        if let Some(key) = &mut self.key {
            key.shadows = if casts { SHADOWS } else { 0 };
        }
        self
    }

    /// Whether all light comes from the eye and from beside it, and nothing keeps it away.
    pub fn is_plain(&self) -> bool {
        Self { aside: None, ..*self } == Self::head()
    }

    /// Checks that settings can draw this light. The error is a message.
    pub(crate) fn check(&self, settings: &Settings) -> Result<(), String> {
        if let Some(Aside { share, direction }) = self.aside {
            if !(0.0..=1.0).contains(&share) {
                return Err(format!("the share of the light `aside` is {share}, not 0 to 1"));
            }
            if direction.z > 0.0 {
                return Err("the lamp of the light `aside` is behind the scene".into());
            }
        }
        let shares = [
            ("head", self.head),
            ("key", self.key.map_or(0.0, |key| key.share)),
            ("sky", self.sky.map_or(0.0, |sky| sky.share)),
        ];
        for (name, share) in shares {
            if !(0.0..=10.0).contains(&share) {
                return Err(format!("the share of the light `{name}` is {share}, not 0 to 10"));
            }
        }
        let directions = [
            ("aside", self.aside.map(|aside| aside.direction)),
            ("key", self.key.map(|key| key.direction)),
            ("sky", self.sky.map(|sky| sky.up)),
        ];
        for (name, direction) in directions {
            if direction.is_some_and(|direction| direction.try_normalize().is_none()) {
                return Err(format!("the direction of the light `{name}` has no length"));
            }
        }
        if let Some(Occlusion { strength, radius, axes, resolution }) = self.occlusion {
            if !(0.0..=1.0).contains(&strength) {
                return Err(format!("the strength of ambient occlusion is {strength}, not 0 to 1"));
            }
            if !(radius > 0.0 && radius <= 10.0) {
                return Err(format!("the radius of ambient occlusion is {radius}, not 0 to 10"));
            }
            if !(1..=MOST_AXES).contains(&axes) || !(8..=MOST_PIXELS).contains(&resolution) {
                return Err(format!(
                    "ambient occlusion takes 1 to {MOST_AXES} axes and maps of 8 to {MOST_PIXELS} \
                     pixels, found {axes} and {resolution}"
                ));
            }
        }
        let shadows = self.key.map_or(0, |key| key.shadows);
        if shadows != 0 && !(8..=MOST_PIXELS).contains(&shadows) {
            return Err(format!("a map of shadows has 8 to {MOST_PIXELS} pixels, found {shadows}"));
        }
        self.check_methods(settings)
    }

    fn check_methods(&self, settings: &Settings) -> Result<(), String> {
        let what = if self.is_plain() {
            return Ok(());
        } else if settings.mode != Mode::Sheets {
            "sheets that are parallel to the picture"
        } else if settings.classifies_samples() {
            "values that are classified after interpolation"
        } else if settings.optics != Optics::EmissionAbsorption {
            "emission and absorption"
        } else if settings.region.is_some() && self.needs_maps() {
            "the whole scene, not a region of it"
        } else {
            return Ok(());
        };
        Err(format!("lights other than that from the eye, and their shadows, need {what}"))
    }

    /// Whether maps of what the scene absorbs are needed.
    pub(crate) fn needs_maps(&self) -> bool {
        self.occlusion.is_some() || self.key.is_some_and(|key| key.shadows > 0)
    }
}

impl KeyLight {
    /// A lamp with shadows at the upper left before the scene.
    fn upper_left(share: f64) -> Self {
        Self { direction: DVec3::new(-0.5, -0.65, -0.75), share, shadows: SHADOWS }
    }
}

impl Scene {
    /// Whether light changes the picture of any item: of fields that are lit, and of surfaces whose
    /// splats may have normals.
    pub(crate) fn is_lit(&self, settings: &Settings) -> bool {
        self.items.iter().any(|item| match item.transfer() {
            Some(transfer) => settings.shade_of(transfer).is_some(),
            None => settings.surface_shade.is_some() && !item.is_trained(),
        })
    }
}

/// A parallel view of a scene along the light, for a map of the optical depth in front of each
/// place (Yuksel & Keyser 2008: deep opacity maps). It is a cube around the scene of as many
/// planes as pixels, at the same distances.
#[derive(Debug, Clone)]
pub(crate) struct MapView {
    pub view: View,
    /// Pixels along each side, and number of steps between planes.
    pub size: u32,
    /// The length of a pixel, and of a step.
    pub step: f64,
}

impl MapView {
    /// Returns the view of light that travels in a direction in the world.
    pub fn along(direction: DVec3, bounds: &Bounds, size: u32) -> Self {
        let forward = direction.normalize();
        let right = forward.any_orthonormal_vector();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        let step = bounds.diagonal().max(f64::MIN_POSITIVE) / f64::from(size - 4);
        let view = View {
            position: bounds.center(),
            rotation,
            perspective: false,
            scale: 1.0 / step,
            center: DVec2::splat(0.5 * f64::from(size)),
            size: [size; 2],
        };
        Self { view, size, step }
    }

    /// Returns the distances of the planes.
    pub fn planes(&self) -> Vec<f64> {
        (0..=self.size).map(|plane| self.step * (f64::from(plane) - self.half())).collect()
    }

    /// Returns the place of a point of the world in the map: columns and rows, counted from the
    /// middle of the first pixel, and planes.
    pub fn place(&self, world: DVec3) -> DVec3 {
        let place = self.view.rotation * (world - self.view.position) / self.step;
        place + DVec3::new(self.half() - 0.5, self.half() - 0.5, self.half())
    }

    fn half(&self) -> f64 {
        0.5 * f64::from(self.size)
    }

    /// Returns the settings with which the map of a picture's scene is drawn. Its sheets are no
    /// thicker than its steps: an opaque surface blurs by a sheet along the light.
    pub fn settings(&self, scene: &Scene, settings: &Settings) -> Settings {
        let usual = self.usual_settings(settings);
        let thickness = scene.sheets(&self.view, &usual).step.min(self.step);
        Settings { sheet_thickness: Some(thickness), ..usual }
    }

    fn usual_settings(&self, settings: &Settings) -> Settings {
        Settings {
            size: self.view.size,
            lighting: Lighting::default(),
            volume_shade: Some(None),
            surface_shade: None,
            gradient: Gradient::Analytic,
            // Coarser pictures of a moving view have the maps of the exact ones.
            sheet_thickness: None,
            sheet_pixels: 1.0,
            detail: Detail::default(),
            occlusion: false,
            // A map serves the light from both ends of its axis.
            cull_backfaces: Some(false),
            near: None,
            ..settings.clone()
        }
    }
}

/// The places at which ambient occlusion is known: the nodes of a lattice around a scene.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OcclusionBox {
    pub origin: DVec3,
    pub step: f64,
    pub size: [usize; 3],
}

impl OcclusionBox {
    /// Nodes beyond the scene, at both ends together: light is taken before its surfaces.
    const MARGIN: f64 = 8.0;

    /// Returns a box whose steps are those of a map of this size.
    pub fn around(bounds: &Bounds, resolution: u32) -> Self {
        let step = bounds.diagonal().max(f64::MIN_POSITIVE) / f64::from(resolution - 4);
        let size = (bounds.size() / step).ceil() + Self::MARGIN;
        let origin = bounds.center() - 0.5 * step * (size - 1.0);
        Self { origin, step, size: size.to_array().map(|side| side as usize) }
    }

    /// Returns the place of a node in the world.
    pub fn node(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        self.origin + self.step * DVec3::new(i as f64, j as f64, k as f64)
    }
}

impl Occlusion {
    /// Returns the axes along which light comes in: those of points of a spiral from the pole of a
    /// hemisphere to its rim, at equal angles of the golden section.
    pub(crate) fn directions(&self) -> Vec<DVec3> {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let count = self.axes;
        let axis = |number: u32| {
            let z = 1.0 - (f64::from(number) + 0.5) / f64::from(count);
            let (sine, cosine) = (golden * f64::from(number)).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            DVec3::new(radius * cosine, radius * sine, z)
        };
        (0..count).map(axis).collect()
    }
}

impl Sky {
    /// Returns the brightness of the sky in a direction.
    pub(crate) fn brightness(&self, direction: DVec3) -> f64 {
        1.0 + direction.dot(self.up.normalize_or_zero())
    }
}

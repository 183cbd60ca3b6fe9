//! Rods: segments with a radius and round ends, drawn as balls, discs and tubes.

use super::{Facet, FacetSet, Sides};
use crate::{
    Error, Result,
    math::lower,
    parallel::prelude::*,
    splat::{NO_NORMAL, Splat, Surfels, decode_normal, encode_normal},
};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A segment with a radius and round ends. With both ends at one place it is a ball.
///
/// A rod is stored as a [`Facet`]: its outline is exact at any distance, and rods meet where their
/// surfaces do. The radius may be one of the world, one of the picture, or the larger of both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rod {
    /// The ends of the segment in world units, relative to the set's origin.
    pub ends: [Vec3; 2],
    /// The radius at each end, in world units.
    pub radii: [f32; 2],
    /// The least radius in the picture, in pixels: a rod that would be thinner is drawn this wide.
    pub pixels: f32,
    /// The colours at the ends: red, green and blue.
    pub colors: [[u8; 3]; 2],
    /// How the rod is lit.
    pub relief: Relief,
    /// The unit direction of the rod that ends where this one starts, if there is one, and whether
    /// another starts where this one ends. At such joints only one of both has an outline, where
    /// their round ends would overlap. Flat rods have none.
    pub joints: (Option<Vec3>, bool),
}

/// How a rod looks from the eye.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Relief {
    /// As a body: lit by the normal of its surface, which has its own depth.
    #[default]
    Round,
    /// As a flat band or disc that faces the eye: lit by one unit normal, or not at all.
    Flat(Option<Vec3>),
}

/// The last normal of a facet that is a rod. No unit vector is encoded like this, and as a float it
/// is a usual one, which no device changes. rods.wgsl has the same number.
pub(crate) const ROD: u32 = 0x4000_8000;

/// The second normal of a facet that is a rod: a flat one, a round one, and a round one that
/// another rod continues. rods.wgsl and src/cpu/rods.rs read them as numbers.
const FLAT: u32 = 0;
const ROUND: u32 = 1;
const JOINED: u32 = 2;

/// How far rods reach beyond a joint where they have an outline, in pixels, so that no gap opens by
/// rounding. rods.wgsl has the same number.
pub(crate) const OVERLAP: f64 = 0.25;

/// How many standard deviations of a splat its opaque part reaches.
pub(crate) const REACH: f32 = 2.4;

/// A diameter or width, of the world or of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SizeText", into = "SizeText")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "SizeText"))]
pub enum Size {
    /// In world units.
    World(f32),
    /// In pixels, however near the eye is.
    Pixels(f32),
}

/// [`Size`] in JSON: a number of world units, or a text such as `3px`.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
enum SizeText {
    World(f32),
    Text(String),
}

impl TryFrom<SizeText> for Size {
    type Error = String;

    fn try_from(text: SizeText) -> std::result::Result<Self, String> {
        match text {
            SizeText::World(size) => {
                let size = Self::World(size);
                size.validate("the size").map_err(|error| error.to_string())?;
                Ok(size)
            }
            SizeText::Text(text) => text.parse(),
        }
    }
}

impl From<Size> for SizeText {
    fn from(size: Size) -> Self {
        match size {
            Size::World(size) => Self::World(size),
            Size::Pixels(size) => Self::Text(format!("{size}px")),
        }
    }
}

impl Size {
    /// The most pixels.
    pub const MOST_PIXELS: f32 = 1000.0;

    /// The size of a pixel, as a part of the diagonal of what is drawn, where sizes must be those
    /// of the world: in hierarchies, and where only splats are drawn.
    pub(crate) const PIXEL: f32 = 1e-3;

    /// Checks that the size is a positive number that pictures can show.
    ///
    /// # Errors
    /// [`Error::Argument`], which calls the size by this name.
    pub fn validate(self, name: &str) -> Result<()> {
        let (size, most, unit) = match self {
            Self::World(size) => (size, 1e18, ""),
            Self::Pixels(size) => (size, Self::MOST_PIXELS, " pixels"),
        };
        if size > 0.0 && size <= most {
            return Ok(());
        }
        Err(Error::Argument(format!(
            "{name} is {size}{unit}; a number above 0, at most {most}, is needed"
        )))
    }
}

impl FromStr for Size {
    type Err = String;

    /// Reads `0.02`, a size of the world, or `3px`.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let text = text.trim();
        let number = |text: &str| text.trim().parse::<f32>().ok();
        let size = match text.strip_suffix("px") {
            Some(pixels) => number(pixels).map(Self::Pixels),
            None => number(text).map(Self::World),
        };
        let form = "a size is a number of world units, such as 0.02, or of pixels, such as 3px";
        let size = size.ok_or(form)?;
        size.validate("the size").map_err(|error| error.to_string())?;
        Ok(size)
    }
}

impl Rod {
    /// Returns a ball.
    pub fn ball(center: Vec3, radius: f32, color: [u8; 3]) -> Self {
        Self {
            ends: [center; 2],
            radii: [radius; 2],
            pixels: 0.0,
            colors: [color; 2],
            relief: Relief::Round,
            joints: (None, false),
        }
    }
}

impl From<Rod> for Facet {
    fn from(rod: Rod) -> Self {
        let Rod { ends: [a, b], radii: [first, last], pixels, colors, relief, joints } = rod;
        let encoded = |normal: Option<Vec3>| normal.map_or(NO_NORMAL, encode_normal);
        let (normal, form) = match relief {
            Relief::Flat(normal) => (encoded(normal), FLAT),
            Relief::Round => (encoded(joints.0), if joints.1 { JOINED } else { ROUND }),
        };
        let [from, to] =
            colors.map(|[red, green, blue]| u32::from_le_bytes([red, green, blue, 255]));
        Self {
            corners: [a.to_array(), b.to_array(), [first, last, pixels]],
            normals: [normal, form, ROD],
            colors: [from, to, to],
        }
    }
}

impl Facet {
    /// Whether the facet is a rod instead of a triangle.
    pub fn is_rod(&self) -> bool {
        self.normals[2] == ROD
    }

    /// Returns the rod that is stored in the facet; `None` for a triangle.
    pub fn rod(&self) -> Option<Rod> {
        if !self.is_rod() {
            return None;
        }
        let [a, b, [first, last, pixels]] = self.corners;
        let [normal, form, _] = self.normals;
        let color = |packed: u32| {
            let [red, green, blue, _] = packed.to_le_bytes();
            [red, green, blue]
        };
        Some(Rod {
            ends: [a.into(), b.into()],
            radii: [first, last],
            pixels,
            colors: [color(self.colors[0]), color(self.colors[1])],
            relief: if form == FLAT { Relief::Flat(decode_normal(normal)) } else { Relief::Round },
            joints: match form {
                FLAT => (None, false),
                _ => (decode_normal(normal), form == JOINED),
            },
        })
    }

    /// Returns the box around the facet, without the least radius in pixels of a rod.
    pub(crate) fn around(&self) -> [Vec3; 2] {
        let [a, b, c] = self.corners.map(Vec3::from);
        if self.is_rod() {
            let [first, last] = [c.x, c.y].map(Vec3::splat);
            return [(a - first).min(b - last), (a + first).max(b + last)];
        }
        [a.min(b).min(c), a.max(b).max(c)]
    }
}

impl FacetSet {
    /// Makes a set of facets, of which some are rods, around an origin.
    pub fn of_rods(origin: DVec3, facets: Vec<Facet>) -> Self {
        let pixels = |facet: &Facet| if facet.is_rod() { facet.corners[2][2] } else { -1.0 };
        let most = facets.par_iter().map(pixels).reduce(|| -1.0, f32::max);
        let rods = (most >= 0.0).then_some(most);
        Self { origin, facets, sides: Sides::Mixed, rods, ..Self::default() }
    }

    /// Returns whether the set is of flat dots or bands that are not lit.
    pub(crate) fn is_unlit(&self) -> bool {
        let is_unlit = |facet: &Facet| facet.normals == [NO_NORMAL, FLAT, ROD];
        !self.facets.is_empty() && self.facets.par_iter().all(is_unlit)
    }
}

/// The pieces of a rod that splats stand for are this many radii long, unless there were more than
/// [`MOST_PIECES`] of them.
const PIECE: f32 = 2.0;
const MOST_PIECES: f32 = 256.0;
/// The optical depth of an opaque splat.
const OPAQUE: f32 = 14.0;

impl FacetSet {
    /// Returns splats that stand for the rods of the set, for methods that draw no facets. A pixel
    /// is a thousandth of the set's diagonal. The splats are not lit.
    pub fn rod_splats(&self) -> Surfels {
        let pixel = self.bounds().diagonal() as f32 * Size::PIXEL;
        let rods = self.facets.par_iter().filter_map(Facet::rod);
        Surfels {
            origin: self.origin,
            splats: rods.flat_map_iter(|rod| rod.splats(pixel)).collect(),
            extent: 3.0,
        }
    }
}

impl Rod {
    /// Returns splats that stand for the rod where a pixel has this size.
    pub(crate) fn splats(&self, pixel: f32) -> impl Iterator<Item = Splat> + use<> {
        let Self { ends: [a, b], radii, colors: [from, to], .. } = *self;
        let [first, last] = radii.map(|radius| radius.max(self.pixels * pixel));
        let length = a.distance(b);
        let way = (b - a).normalize_or_zero();
        let thickest = first.max(last).max(f32::MIN_POSITIVE);
        let count = (length / (PIECE * thickest)).ceil().clamp(1.0, MOST_PIECES);
        let mix = move |part: f32| {
            [0, 1, 2].map(move |i: usize| {
                let [from, to] = [from[i], to[i]].map(f32::from);
                (from + part * (to - from)).round() as u8
            })
        };
        (0..count as usize).map(move |piece| {
            let part = (piece as f32 + 0.5) / count;
            let width = (first + part * (last - first)).max(f32::MIN_POSITIVE) / REACH;
            // Half a piece is one standard deviation: neighbours add up to an even strength.
            let along = way * (0.5 * length / count).max(0.0);
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * f64::from(width));
            let [red, green, blue] = mix(part);
            Splat {
                center: a.lerp(b, part).to_array(),
                strength: OPAQUE,
                factor: lower([axes[0], axes[1], axes[2], along.as_dvec3()]),
                color: u32::from_le_bytes([red, green, blue, 255]),
                normal: NO_NORMAL,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_facet_gives_back_its_rod() {
        let normal = decode_normal(encode_normal(Vec3::new(0.0, 0.6, 0.8)));
        for relief in [Relief::Round, Relief::Flat(None), Relief::Flat(normal)] {
            let rod = Rod {
                ends: [Vec3::X, Vec3::new(1.0, 2.0, 3.0)],
                radii: [0.5, 0.25],
                pixels: 1.5,
                colors: [[1, 2, 3], [255, 0, 7]],
                relief,
                joints: if relief == Relief::Round { (normal, true) } else { (None, false) },
            };
            let facet = Facet::from(rod);
            assert_eq!(facet.rod(), Some(rod));
            assert_eq!(facet.around(), [Vec3::new(0.5, -0.5, -0.5), Vec3::new(1.5, 2.25, 3.25)]);
        }
        let triangle = Facet::new([Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::Z; 3], [[0; 3]; 3]);
        assert_eq!(triangle.rod(), None);
    }

    #[test]
    fn no_normal_reads_as_a_rod() {
        for i in 0..100_000u32 {
            let at = |scale: f32| (i as f32 * scale).sin();
            assert_ne!(encode_normal(Vec3::new(at(0.7), at(1.3), at(2.9))), ROD);
        }
        assert!(f32::from_bits(ROD).is_normal() && NO_NORMAL != ROD);
    }
}

//! Splats whose outline is exact at any distance: triangles, and [rods](Rod) with round ends.

mod baked;
mod image;
mod rod;
mod texture;

pub use image::Image;
pub(crate) use rod::{OVERLAP, REACH};
pub use rod::{Relief, Rod, Size};
pub(crate) use texture::Mean;
pub use texture::Texture;

use crate::{
    math::Bounds,
    parallel::prelude::*,
    splat::{NO_NORMAL, decode_normal, encode_normal},
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// A triangle as stored in memory and on the GPU (60 bytes): a splat whose footprint in the picture
/// is the triangle itself. Round splats approximate flat faces, creases and boundaries; a facet has
/// them exactly.
///
/// A pixel is covered by the share of its area that the triangle fills. The shares of neighbouring
/// facets add up, so that no edge between them shows, and outlines are smooth.
///
/// A facet may also store a [`Rod`]; the corners and normals then have other meanings.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Facet {
    /// World positions of the corners, relative to the set's origin, counter-clockwise from
    /// outside.
    pub corners: [[f32; 3]; 3],
    /// The unit normals at the corners, by which the facet is lit; octahedral
    /// ([`encode_normal`]). Between the corners they are interpolated (Phong 1975). A facet without
    /// normals ([`NO_NORMAL`]) is not lit.
    pub normals: [u32; 3],
    /// The colours at the corners: red, green and blue, 8 bits each, red in the lowest bits. The
    /// highest 8 bits are not used: a facet is opaque.
    pub colors: [u32; 3],
}

impl Facet {
    /// Makes a facet. Normals without a length become that of the triangle.
    pub fn new(corners: [Vec3; 3], normals: [Vec3; 3], colors: [[u8; 3]; 3]) -> Self {
        let [a, b, c] = corners;
        let face_normal = (b - a).cross(c - a).normalize_or(Vec3::Z);
        Self {
            corners: corners.map(|corner| corner.to_array()),
            normals: normals.map(|normal| match encode_normal(normal) {
                NO_NORMAL => encode_normal(face_normal),
                normal => normal,
            }),
            colors: colors.map(|[red, green, blue]| u32::from_le_bytes([red, green, blue, 255])),
        }
    }

    /// Returns the facet without normals. It is drawn in its own colours, whatever the light.
    pub fn unlit(self) -> Self {
        Self { normals: [NO_NORMAL; 3], ..self }
    }

    /// Returns the unit normals at the corners; zero if there are none.
    pub fn decoded_normals(&self) -> [Vec3; 3] {
        self.normals.map(|normal| decode_normal(normal).unwrap_or(Vec3::ZERO))
    }
}

/// What a facet shows of an image. The image's colours are multiplied with those of the corners,
/// and a pixel is covered less where less of the image is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureCoordinates {
    /// The number of the image; [`PLAIN`](Self::PLAIN) if the facet shows none.
    pub image: u32,
    /// The places of the corners in the image; (0, 0) is its top left corner, (1, 1) the bottom
    /// right one.
    pub places: [Vec2; 3],
}

impl TextureCoordinates {
    /// Stands for no image.
    pub const PLAIN: u32 = u32::MAX;
}

/// Which sides of facets are seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sides {
    /// The facets enclose something: their backs are never seen from outside.
    Closed,
    /// Neighbouring facets wind the same way. At a fold, fronts and backs cover the same pixels and
    /// count once.
    Oriented,
    /// Facets wind in any way.
    #[default]
    Mixed,
}

/// Facets around a common origin: triangles, rods, or both.
#[derive(Debug, Clone, Default)]
pub struct FacetSet {
    /// World position that the corners are relative to.
    pub origin: DVec3,
    /// The facets, in any order.
    pub facets: Vec<Facet>,
    /// Which of their sides are seen.
    pub sides: Sides,
    /// The images that facets show.
    pub images: Vec<Arc<Image>>,
    /// What each facet shows of them; empty if none shows anything.
    pub texture_coordinates: Vec<TextureCoordinates>,
    /// The box around the whole, in world coordinates, if the facets are what clips left of it.
    /// They end at the clips exactly, and no clip is applied to them again.
    pub whole: Option<Bounds>,
    /// The largest [`Rod::pixels`] of the facets that are rods; `None` if all are triangles.
    pub rods: Option<f32>,
}

impl FacetSet {
    /// Returns the image that a facet shows, and the places of its corners there.
    pub(crate) fn image_of(&self, facet: usize) -> Option<(&Image, [Vec2; 3])> {
        let mapping = self.texture_coordinates.get(facet)?;
        Some((self.images.get(mapping.image as usize)?, mapping.places))
    }

    /// Returns the box around all facets, in world coordinates: also around those that clips
    /// removed, so that a picture's sheets do not depend on its clips.
    pub fn bounds(&self) -> Bounds {
        if let Some(whole) = self.whole {
            return whole;
        }
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let grow = |all: (Vec3, Vec3), facet: &Facet| {
            let [low, high] = facet.around();
            (all.0.min(low), all.1.max(high))
        };
        let both = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        let (low, high) = self.facets.par_iter().fold(|| none, grow).reduce(|| none, both);
        Bounds::between(self.origin, [low, high])
    }
}

/// Of surfaces behind each other in one sheet, each counts less by the factor e to the power of
/// minus this for every pixel that another is nearer.
pub(crate) const NEARER: f64 = 4.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn set() -> FacetSet {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let facet = Facet::new(corners, [Vec3::ZERO; 3], [[255, 0, 7]; 3]);
        FacetSet {
            origin: DVec3::Y,
            facets: vec![facet],
            sides: Sides::Oriented,
            ..FacetSet::default()
        }
    }

    #[test]
    fn a_facet_without_normals_has_that_of_its_triangle() {
        assert_eq!(set().facets[0].decoded_normals(), [Vec3::Z; 3]);
        assert_eq!(set().facets[0].colors[0].to_le_bytes(), [255, 0, 7, 255]);
        assert_eq!(set().facets[0].unlit().decoded_normals(), [Vec3::ZERO; 3]);
    }
}

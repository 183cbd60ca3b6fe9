//! Facets that show images, cut into plain ones: for devices that have no room for the images.

use super::{Facet, FacetSet, Image};
use crate::parallel::prelude::*;
use glam::{Vec2, Vec3};
use std::borrow::Cow;

/// A plain facet is about this many texels wide.
const TEXELS: f64 = 1.5;

/// Most plain facets; more would not fit many GPUs.
const MOST: f64 = 4e6;

/// Shares of an image of which less is seen are left out.
const LEAST_SEEN: f32 = 0.5;

impl FacetSet {
    /// Returns the facets with the images in their corners' colours: those that show an image are
    /// cut to about its texels, or larger parts if there would be millions.
    pub(crate) fn baked(&self) -> Cow<'_, Self> {
        if self.texture_coordinates.is_empty() {
            return Cow::Borrowed(self);
        }
        let numbers = || (0..self.facets.len()).into_par_iter();
        let all: f64 = numbers().map(|number| self.parts(number, TEXELS).powi(2)).sum();
        let texels = TEXELS * (all / MOST).max(1.0).sqrt();
        let cut = |number: usize| {
            let parts = self.parts(number, texels) as usize;
            self.cut(number, parts)
        };
        let facets = numbers().flat_map_iter(cut).collect();
        Cow::Owned(Self {
            origin: self.origin,
            facets,
            sides: self.sides,
            rods: self.rods,
            ..Self::default()
        })
    }

    /// Returns in how many parts each side of a facet is cut.
    fn parts(&self, number: usize, texels: f64) -> f64 {
        let Some((image, places)) = self.image_of(number) else { return 1.0 };
        let size = Vec2::new(image.texture().width as f32, image.texture().height as f32);
        let side = |i: usize| ((places[(i + 1) % 3] - places[i]) * size).length();
        let longest = f64::from(side(0).max(side(1)).max(side(2)));
        // NaN gives one.
        (longest / texels).ceil().clamp(1.0, 2048.0)
    }

    /// Returns a facet in `parts`² pieces.
    fn cut(&self, number: usize, parts: usize) -> Vec<Facet> {
        let facet = &self.facets[number];
        let Some((image, places)) = self.image_of(number) else { return vec![*facet] };
        let corner = |column: usize, row: usize| {
            let [b, c] = [column, row].map(|at| at as f32 / parts as f32);
            Corner::at(facet, (image, places), [1.0 - b - c, b, c], parts as f32)
        };
        let mut pieces = Vec::with_capacity(parts * parts);
        for row in 0..parts {
            for column in 0..parts - row {
                let [a, b, c] = [[column, row], [column + 1, row], [column, row + 1]]
                    .map(|[column, row]| corner(column, row));
                pieces.extend(piece([&a, &b, &c], facet));
                if column + row + 1 < parts {
                    let last = corner(column + 1, row + 1);
                    pieces.extend(piece([&b, &last, &c], facet));
                }
            }
        }
        pieces
    }
}

/// A corner of a piece.
struct Corner {
    place: Vec3,
    normal: Vec3,
    /// Red, green, blue, and the share that is seen.
    color: [f32; 4],
}

impl Corner {
    /// Returns the corner where a facet's own corners have these weights.
    fn at(
        facet: &Facet,
        (image, places): (&Image, [Vec2; 3]),
        weights: [f32; 3],
        parts: f32,
    ) -> Self {
        let of = |values: [Vec3; 3]| (0..3).map(|i| values[i] * weights[i]).sum::<Vec3>();
        let uv = (0..3).map(|i| places[i] * weights[i]).sum();
        let [across, down] = [1, 2].map(|i| (places[i] - places[0]) / parts);
        let mut color = image.mean(uv, across, down);
        let corner_colors = facet.colors.map(|color| {
            let [red, green, blue, _] = color.to_le_bytes().map(|part| f32::from(part) / 255.0);
            Vec3::new(red, green, blue)
        });
        let tint = of(corner_colors).to_array();
        color.iter_mut().zip(tint).for_each(|(part, factor)| *part *= factor);
        Self {
            place: of(facet.corners.map(Vec3::from)),
            normal: of(facet.decoded_normals()),
            color,
        }
    }
}

/// Returns the piece between corners, if enough of it is seen.
fn piece(corners: [&Corner; 3], facet: &Facet) -> Option<Facet> {
    let seen: f32 = corners.iter().map(|corner| corner.color[3]).sum();
    if seen < 3.0 * LEAST_SEEN {
        return None;
    }
    let byte = |part: f32| (part.clamp(0.0, 1.0) * 255.0).round() as u8;
    let color = |corner: &Corner| [0, 1, 2].map(|i| byte(corner.color[i]));
    let piece = Facet::new(
        corners.map(|corner| corner.place),
        corners.map(|corner| corner.normal),
        corners.map(color),
    );
    let is_unlit = facet.decoded_normals() == [Vec3::ZERO; 3];
    Some(if is_unlit { piece.unlit() } else { piece })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::{Texture, TextureCoordinates};
    use std::sync::Arc;

    #[test]
    fn pieces_have_the_colours_and_the_area_of_the_whole() {
        let texel = |i: usize| [(10 * (i % 16)) as u8, (10 * (i / 16)) as u8, 0, 255];
        let texels = (0..256).map(texel).collect();
        let image = Image::new(&Arc::new(Texture { width: 16, height: 16, texels }));
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let facet = Facet::new(corners, [Vec3::Z; 3], [[255, 255, 0]; 3]);
        let plain = Facet::new(corners.map(|at| at + Vec3::Z), [Vec3::Z; 3], [[9; 3]; 3]);
        let places = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let set = FacetSet {
            facets: vec![facet, plain],
            images: vec![Arc::new(image)],
            texture_coordinates: [0, TextureCoordinates::PLAIN]
                .map(|image| TextureCoordinates { image, places })
                .to_vec(),
            ..FacetSet::default()
        };
        let baked = set.baked();
        let parts = (16.0 * 2f32.sqrt() / 1.5).ceil() as usize;
        assert_eq!(baked.facets.len(), parts * parts + 1);
        assert!(baked.facets.contains(&plain) && baked.texture_coordinates.is_empty());
        let area = |facet: &Facet| {
            let [a, b, c] = facet.corners.map(Vec3::from);
            (b - a).cross(c - a).z
        };
        let total: f32 = baked.facets.iter().filter(|facet| **facet != plain).map(area).sum();
        assert!((total - 1.0).abs() < 1e-4, "{total}");
        let near = baked.facets.iter().find(|facet| {
            let [x, y, _] = facet.corners[0];
            (x - 0.5).abs() < 0.05 && (y - 0.25).abs() < 0.05
        });
        let [red, green, blue, _] = near.unwrap().colors[0].to_le_bytes();
        assert!(red.abs_diff(75) < 15 && green.abs_diff(35) < 15 && blue == 0, "{red} {green}");
    }
}

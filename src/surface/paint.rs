//! The colour of a mesh at a corner: vertex colour × material colour × texture.

use super::{Material, Mesh};
use crate::{
    Error, Result,
    color::{ColorScale, Spread},
    facet::Texture,
    parallel::prelude::*,
    splat::decode_normal,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The colour of a mesh that defines none.
pub(super) const NEUTRAL: [f32; 4] = [0.8, 0.8, 0.8, 1.0];

/// What colours a surface instead of its file's colours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Paint {
    /// One colour: red, green and blue in 0 … 1.
    Plain([f32; 3]),
    /// Values at the vertices, which are mixed before they become colours.
    Values {
        /// Which values.
        of: Values,
        /// Their colours.
        scale: ColorScale,
        /// Which of the values the scale spans, in place of its own range.
        spread: Option<Spread>,
    },
}

/// Values that may colour a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Values {
    /// [`Mesh::values`], which the reader has filled.
    Own,
    /// The world coordinate along a direction of unit length.
    Height(DVec3),
}

impl Paint {
    /// Checks numbers that come from a file.
    pub(crate) fn check(&self) -> std::result::Result<(), String> {
        let is_direction = |of: &DVec3| of.is_finite() && (of.length() - 1.0).abs() < 1e-6;
        match self {
            Self::Plain(color) if !color.iter().all(|part| (0.0..=1.0).contains(part)) => {
                Err(format!("the colour {color:?} is not in 0 … 1"))
            }
            Self::Values { of: Values::Height(up), .. } if !is_direction(up) => {
                Err(format!("the direction {up} has not the length 1"))
            }
            Self::Values { scale, .. }
                if !(scale.range.iter().all(|value| value.is_finite())
                    && scale.missing.iter().all(|part| (0.0..=1.0).contains(part))) =>
            {
                Err(format!("the scale {scale:?} has numbers that no scale has"))
            }
            _ => Ok(()),
        }
    }

    /// Returns a colour as a mesh has it.
    pub(crate) fn bytes([r, g, b]: [f32; 3]) -> [u8; 4] {
        let [r, g, b] = [r, g, b].map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
        [r, g, b, 255]
    }
}

impl Mesh {
    /// Colours the mesh by a paint. Its own colours, materials and opacity are dropped.
    ///
    /// ```
    /// use splatkit::{
    ///     color::{ColorMap, ColorScale, Spread},
    ///     glam::DVec3,
    ///     surface::{Mesh, Paint, Values},
    /// };
    ///
    /// let mut ball = Mesh::sphere(2);
    /// let scale = ColorScale::new(ColorMap::VIRIDIS);
    /// let of = Values::Height(DVec3::Z);
    /// ball.paint(&Paint::Values { of, scale, spread: Some(Spread::Full) })?;
    /// let [low, high] = ball.scale.expect("a scale").range;
    /// assert!((low + 1.0).abs() < 1e-6 && (high - 1.0).abs() < 1e-6);
    /// # Ok::<(), splatkit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Argument`] if there are no values that the scale could span.
    pub fn paint(&mut self, paint: &Paint) -> Result<()> {
        let scale = match paint {
            Paint::Plain(_) => None,
            Paint::Values { of, scale, spread } => {
                if let Values::Height(up) = of {
                    let height =
                        |place: &glam::Vec3| (self.origin + place.as_dvec3()).dot(*up) as f32;
                    self.values = self.positions.par_iter().map(height).collect();
                }
                let mut scale = *scale;
                if let Some(spread) = spread {
                    scale.range = spread.range(&self.values, scale.is_log).ok_or_else(|| {
                        let which = if scale.is_log { " above 0" } else { "" };
                        Error::Argument(format!("there are no values{which} to colour by"))
                    })?;
                }
                Some(scale)
            }
        };
        self.colors = match paint {
            Paint::Plain(color) => vec![Paint::bytes(*color); self.positions.len()],
            Paint::Values { .. } => Vec::new(),
        };
        self.scale = scale;
        self.uvs.clear();
        self.triangle_materials.clear();
        self.materials.clear();
        Ok(())
    }

    /// Returns whether vertices have colours.
    pub(super) fn is_painted(&self) -> bool {
        !self.colors.is_empty() || self.scale.is_some() && !self.values.is_empty()
    }

    /// Returns the colour of a vertex; `None` if vertices have no colours.
    pub(super) fn vertex_color(&self, vertex: usize) -> Option<[u8; 4]> {
        match (self.scale, self.values.get(vertex)) {
            (Some(scale), Some(&value)) => Some(Paint::bytes(scale.color(f64::from(value)))),
            _ => self.colors.get(vertex).copied(),
        }
    }
}

/// Returns the colour of a triangle around one of its corners; channels in 0 … 1.
pub(super) fn corner_color(mesh: &Mesh, triangle: usize, corner: usize) -> [f32; 4] {
    let [vertex, next, last] =
        [0, 1, 2].map(|i| mesh.triangles[triangle][(corner + i) % 3] as usize);
    let mut color = corner_tint(mesh, triangle, corner);
    if let (Some(texture), Some(&uv)) = (texture_of(mesh, triangle), mesh.uvs.get(vertex)) {
        let [a, b] = [next, last].map(|other| (mesh.uvs[other] - uv) * 0.5);
        color.iter_mut().zip(texture.mean(uv, a, b)).for_each(|(part, by)| *part *= by);
    }
    color
}

/// Returns the colour of a corner of a triangle without its texture; channels in 0 … 1.
pub(super) fn corner_tint(mesh: &Mesh, triangle: usize, corner: usize) -> [f32; 4] {
    let vertex = mesh.triangles[triangle][corner] as usize;
    let material =
        mesh.triangle_materials.get(triangle).map(|&index| &mesh.materials[index as usize]);
    let mut color = base_color(mesh, material);
    if let Some(tint) = mesh.vertex_color(vertex) {
        let tint = tint.map(|part| f32::from(part) / 255.0);
        color.iter_mut().zip(tint).for_each(|(part, by)| *part *= by);
    }
    color
}

/// Returns the texture of a triangle.
pub(super) fn texture_of(mesh: &Mesh, triangle: usize) -> Option<&Arc<Texture>> {
    let material = mesh.triangle_materials.get(triangle)?;
    mesh.materials[*material as usize].texture.as_ref()
}

/// Returns the colour at a position in a triangle, given by barycentric coordinates; channels in 0
/// … 1.
pub(crate) fn color_at(mesh: &Mesh, triangle: usize, weights: [f32; 3]) -> [f32; 4] {
    let vertices = mesh.triangles[triangle].map(|vertex| vertex as usize);
    let material =
        mesh.triangle_materials.get(triangle).map(|&index| &mesh.materials[index as usize]);
    let mut color = base_color(mesh, material);
    let mut multiply = |by: [f32; 4]| color.iter_mut().zip(by).for_each(|(part, by)| *part *= by);
    if let Some(scale) = mesh.scale.filter(|_| !mesh.values.is_empty()) {
        let value: f32 =
            vertices.iter().zip(weights).map(|(&v, weight)| weight * mesh.values[v]).sum();
        let [r, g, b] = scale.color(f64::from(value));
        multiply([r, g, b, 1.0]);
    } else if !mesh.colors.is_empty() {
        let part = |i: usize, v: usize| f32::from(mesh.colors[v][i]) / 255.0;
        multiply(std::array::from_fn(|i| {
            vertices.iter().zip(weights).map(|(&v, weight)| weight * part(i, v)).sum()
        }));
    }
    let texture = material.and_then(|material| material.texture.as_ref());
    if let Some(texture) = texture.filter(|_| !mesh.uvs.is_empty()) {
        multiply(
            texture.sample(
                vertices.iter().zip(weights).map(|(&v, weight)| weight * mesh.uvs[v]).sum(),
            ),
        );
    }
    color
}

fn base_color(mesh: &Mesh, material: Option<&Material>) -> [f32; 4] {
    match material {
        Some(material) => material.color,
        None if !mesh.is_painted() => NEUTRAL,
        None => [1.0; 4],
    }
}

/// Returns the colour of a point that belongs to no triangle.
pub(super) fn point_color(mesh: &Mesh, vertex: usize) -> [f32; 4] {
    mesh.vertex_color(vertex).map_or(NEUTRAL, |color| color.map(|part| f32::from(part) / 255.0))
}

/// Returns the colour of a packed normal: its coordinates from −1 to 1 as red, green and blue.
pub(super) fn of_normal(packed: u32) -> [f32; 4] {
    decode_normal(packed).map_or(NEUTRAL, |normal| {
        let [r, g, b] = (normal * 0.5 + 0.5).to_array();
        [r, g, b, 1.0]
    })
}

/// Packs a colour into 32 bits, red lowest.
pub(super) fn pack(color: [f32; 4]) -> u32 {
    u32::from_le_bytes(color.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8))
}

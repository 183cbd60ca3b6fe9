//! The colour of a mesh at a corner: vertex colour × material colour × texture.

use super::{Material, Mesh, Texture};
use crate::{
    Error, Result,
    color::{ColorScale, Spread},
    parallel::prelude::*,
    splat::decode_normal,
};
use glam::{DVec3, Vec2};
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

/// A mean of colours. Each counts by how much of it is seen, so that what a mask hides tints
/// nothing.
#[derive(Debug, Default)]
pub(super) struct Mean {
    sum: [f32; 4],
    seen: [f32; 3],
    weight: f32,
}

impl Mean {
    pub fn add(&mut self, color: [f32; 4], weight: f32) {
        self.sum.iter_mut().zip(color).for_each(|(sum, part)| *sum += part * weight);
        self.seen.iter_mut().zip(color).for_each(|(sum, part)| *sum += part * color[3] * weight);
        self.weight += weight;
    }

    /// Returns the mean times the sum of all weights.
    pub fn color(&self) -> [f32; 4] {
        let opacity = self.sum[3];
        if opacity == self.weight || opacity <= 0.0 {
            return self.sum;
        }
        let [red, green, blue] = self.seen.map(|part| part / opacity * self.weight);
        [red, green, blue, opacity]
    }
}

impl Texture {
    /// Returns the mean colour over the parallelogram from `uv` along `a` and `b`. Samples are
    /// about two texels apart, but at most 8 in each direction.
    fn mean(&self, uv: Vec2, a: Vec2, b: Vec2) -> [f32; 4] {
        let size = Vec2::new(self.width as f32, self.height as f32);
        let steps = |edge: Vec2| (((edge * size).length() / 2.0) as u32).clamp(1, 8);
        let (rows, columns) = (steps(a), steps(b));
        if rows == 1 && columns == 1 {
            return self.sample(uv);
        }
        let mut mean = Mean::default();
        for i in 0..rows {
            for j in 0..columns {
                let at = uv
                    + a * ((i as f32 + 0.5) / rows as f32)
                    + b * ((j as f32 + 0.5) / columns as f32);
                mean.add(self.sample(at), 1.0);
            }
        }
        mean.color().map(|part| part / (rows * columns) as f32)
    }

    /// Returns the colour at `uv`, interpolated between the four nearest texels, with the texture
    /// repeated in both directions. A texel counts by how much of it is seen. Channels are in
    /// 0 … 1. Missing texels, in a texture built by hand, are transparent. Coordinates that are not
    /// finite count as 0.
    pub fn sample(&self, uv: Vec2) -> [f32; 4] {
        let axis = |part: f32, size: u32| {
            let part = if part.is_finite() { part - part.floor() } else { 0.0 };
            // From −0.5 to half a texel before the end, where the first texel follows the last.
            let at = part * size as f32 - 0.5;
            let first = at.floor();
            let last = size.max(1) - 1;
            let from = if first < 0.0 { last } else { (first as u32).min(last) };
            let to = if from == last { 0 } else { from + 1 };
            (from as usize, to as usize, at - first)
        };
        let (x0, x1, fx) = axis(uv.x, self.width);
        let (y0, y1, fy) = axis(uv.y, self.height);
        let texel = |x: usize, y: usize| {
            let index = y * self.width as usize + x;
            self.texels.get(index).copied().unwrap_or_default().map(f32::from)
        };
        let (a, b, c, d) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
        if [b, c, d].iter().any(|texel| texel[3] != a[3]) {
            let mut mean = Mean::default();
            for (texel, weight) in [
                (a, (1.0 - fx) * (1.0 - fy)),
                (b, fx * (1.0 - fy)),
                (c, (1.0 - fx) * fy),
                (d, fx * fy),
            ] {
                mean.add(texel.map(|part| part / 255.0), weight);
            }
            return mean.color();
        }
        std::array::from_fn(|i| {
            let top = a[i] + (b[i] - a[i]) * fx;
            let bottom = c[i] + (d[i] - c[i]) * fx;
            (top + (bottom - top) * fy) / 255.0
        })
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
    if let Some(own) = mesh.vertex_color(vertex) {
        let own = own.map(|part| f32::from(part) / 255.0);
        color.iter_mut().zip(own).for_each(|(part, by)| *part *= by);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_that_contradict_themselves_are_clear() {
        let clear = [0.0; 4];
        for (width, height, count) in [(0, 0, 0), (0, 3, 3), (3, 0, 3), (u32::MAX, u32::MAX, 1)] {
            let texture = Texture { width, height, texels: vec![[255; 4]; count] };
            let found = [0.0, 0.9].map(|at| texture.sample(Vec2::splat(at)));
            assert!(
                found.iter().all(|color| color.iter().all(|part| (0.0..=1.0).contains(part))),
                "{found:?}"
            );
        }
        let short = Texture { width: 2, height: 2, texels: vec![[255; 4]; 1] };
        assert_eq!(
            (short.sample(Vec2::splat(0.25)), short.sample(Vec2::splat(0.75))),
            ([1.0; 4], clear)
        );
        let whole = Texture { width: 3, height: 2, texels: vec![[51; 4]; 6] };
        for uv in [f32::NAN, f32::INFINITY, f32::MAX, -1e-30] {
            assert_eq!(whole.sample(Vec2::splat(uv)), [0.2; 4], "{uv}");
        }
    }
}

//! The colour of a mesh at a corner: vertex colour × material colour × texture.

use super::{Mesh, Texture};
use glam::Vec2;

/// Drawn where a mesh says nothing of its colour.
const NEUTRAL: [f32; 4] = [0.8, 0.8, 0.8, 1.0];

impl Texture {
    /// The colour at `uv`, between the four nearest texels, repeated in both directions; channels in 0 … 1.
    pub fn sample(&self, uv: Vec2) -> [f32; 4] {
        let axis = |part: f32, size: u32| {
            let part = if part.is_finite() { part - part.floor() } else { 0.0 };
            let at = part * size as f32 - 0.5;
            let first = at.floor();
            let wrap = |i: f32| (i as i64).rem_euclid(i64::from(size)) as usize;
            (wrap(first), wrap(first + 1.0), at - first)
        };
        let (x0, x1, fx) = axis(uv.x, self.width);
        let (y0, y1, fy) = axis(uv.y, self.height);
        let texel = |x: usize, y: usize| self.texels[y * self.width as usize + x].map(f32::from);
        let (a, b, c, d) = (texel(x0, y0), texel(x1, y0), texel(x0, y1), texel(x1, y1));
        std::array::from_fn(|i| {
            let top = a[i] + (b[i] - a[i]) * fx;
            let bottom = c[i] + (d[i] - c[i]) * fx;
            (top + (bottom - top) * fy) / 255.0
        })
    }
}

/// The colour that triangle `triangle` shows at `vertex`, one of its corners; channels in 0 … 1.
pub(super) fn corner_color(mesh: &Mesh, triangle: usize, vertex: usize) -> [f32; 4] {
    let material = mesh.triangle_materials.get(triangle).map(|&index| &mesh.materials[index as usize]);
    let mut color = match material {
        Some(material) => material.color,
        None if mesh.colors.is_empty() => NEUTRAL,
        None => [1.0; 4],
    };
    let mut multiply = |by: [f32; 4]| color.iter_mut().zip(by).for_each(|(part, by)| *part *= by);
    if let Some(own) = mesh.colors.get(vertex) {
        multiply(own.map(|part| f32::from(part) / 255.0));
    }
    if let (Some(texture), Some(&uv)) = (material.and_then(|material| material.texture.as_ref()), mesh.uvs.get(vertex))
    {
        multiply(texture.sample(uv));
    }
    color
}

/// The colour of a point that belongs to no triangle.
pub(super) fn point_color(mesh: &Mesh, vertex: usize) -> [f32; 4] {
    mesh.colors.get(vertex).map_or(NEUTRAL, |color| color.map(|part| f32::from(part) / 255.0))
}

/// A colour in 32 bits, red lowest.
pub(super) fn pack(color: [f32; 4]) -> u32 {
    u32::from_le_bytes(color.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8))
}

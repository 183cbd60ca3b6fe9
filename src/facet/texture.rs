//! Decoded pictures, and the colours between their texels.

use glam::Vec2;

/// A decoded picture, rows from the top; `uv` (0, 0) is its top left corner.
#[derive(Debug, Clone)]
pub struct Texture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue and opacity of each pixel, as displayed (not linear light).
    pub texels: Vec<[u8; 4]>,
}

/// A mean of colours. Each counts by how much of it is seen, so that what a mask hides tints
/// nothing.
#[derive(Debug, Default)]
pub(crate) struct Mean {
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
    pub(crate) fn mean(&self, uv: Vec2, a: Vec2, b: Vec2) -> [f32; 4] {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textures_that_contradict_themselves_are_clear() {
        let clear = [0.0; 4];
        for (width, height, count) in [(0, 0, 0), (0, 3, 3), (3, 0, 3), (u32::MAX, u32::MAX, 1)] {
            let texture = Texture { width, height, texels: vec![[255; 4]; count] };
            let colors = [0.0, 0.9].map(|at| texture.sample(Vec2::splat(at)));
            assert!(
                colors.iter().all(|color| color.iter().all(|part| (0.0..=1.0).contains(part))),
                "{colors:?}"
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

//! Images on facets, and their means over pixels.

use super::Texture;
use crate::parallel::prelude::*;
use glam::Vec2;
use std::sync::Arc;

/// An image in levels of halved width and height (Williams 1983), repeated in both directions. Its
/// colours are as displayed, and each counts by how much of it is seen.
#[derive(Debug)]
pub struct Image {
    finest: Arc<Texture>,
    coarser: Vec<Texture>,
}

/// Most means along the longer side of a pixel's part of an image; a longer part is taken from
/// coarser levels, and blurs.
const MOST_ALONG: f32 = 32.0;

impl Image {
    /// Makes the levels of a texture.
    pub fn new(finest: &Arc<Texture>) -> Self {
        let mut coarser: Vec<Texture> = Vec::new();
        // A texture that lacks texels has one level.
        if finest.texels.len() == finest.width as usize * finest.height as usize {
            loop {
                let last = coarser.last().unwrap_or(finest);
                if last.width.max(last.height) <= 1 {
                    break;
                }
                coarser.push(halved(last));
            }
        }
        Self { finest: finest.clone(), coarser }
    }

    /// Returns the bytes of the levels besides the texture itself.
    pub fn bytes(&self) -> u64 {
        self.coarser.iter().map(|level| 4 * level.texels.len() as u64).sum()
    }

    /// Returns the levels, the texture itself first.
    pub fn levels(&self) -> impl Iterator<Item = &Texture> {
        std::iter::once(&*self.finest).chain(&self.coarser)
    }

    /// Returns the texture itself.
    pub fn texture(&self) -> &Texture {
        &self.finest
    }

    /// Returns the mean colour over a pixel: over the parallelogram around `uv` with the sides
    /// `across` and `down`. Channels are in 0 … 1: red, green, blue, and the share that is seen.
    ///
    /// The parallelogram is divided into parts of about one texel of a level, at least three along
    /// its shorter side. Each is interpolated between four texels. A pixel seen at a slant has many
    /// parts in a row (after Heckbert 1989).
    pub fn mean(&self, uv: Vec2, across: Vec2, down: Vec2) -> [f32; 4] {
        let size = Vec2::new(self.finest.width as f32, self.finest.height as f32);
        let [wide, high] = [across, down].map(|side| (side * size).length());
        let (least, most) = (wide.min(high), wide.max(high));
        // Written so that NaN gives the finest level.
        let level = (least / 3.0).max(most / MOST_ALONG).log2().floor();
        let level = if level > 0.0 { (level as usize).min(self.coarser.len()) } else { 0 };
        let texel = (1u32 << level.min(31)) as f32;
        let texture = if level == 0 { &*self.finest } else { &self.coarser[level - 1] };
        let parts = |side: f32| (side / texel).ceil().clamp(1.0, MOST_ALONG) as u32;
        let (columns, rows) = (parts(wide), parts(high));
        if (columns, rows) == (1, 1) {
            return texture.sample(uv);
        }
        let (mut sum, mut seen) = ([0.0f32; 3], 0.0);
        let (right, below) = (across / columns as f32, down / rows as f32);
        let first = uv - 0.5 * (across + down) + 0.5 * (right + below);
        for row in 0..rows {
            for column in 0..columns {
                let [r, g, b, alpha] =
                    texture.sample(first + row as f32 * below + column as f32 * right);
                seen += alpha;
                sum[0] += r * alpha;
                sum[1] += g * alpha;
                sum[2] += b * alpha;
            }
        }
        if seen <= 0.0 {
            return [0.0; 4];
        }
        let [r, g, b] = sum.map(|part| part / seen);
        [r, g, b, seen / (columns * rows) as f32]
    }
}

/// Returns an image of half the width and height, rounded up, in which each texel is the mean of
/// what it covers.
fn halved(image: &Texture) -> Texture {
    let [width, height] = [image.width, image.height].map(|side| side.div_ceil(2));
    let (columns, rows) = (covered(image.width, width), covered(image.height, height));
    let row = |y: usize| {
        let columns = &columns;
        let rows = &rows[y];
        (0..width as usize).map(move |x| {
            let (mut sum, mut seen, mut all) = ([0.0f32; 3], 0.0f32, 0.0f32);
            for &(v, tall) in rows {
                for &(u, wide) in &columns[x] {
                    let [r, g, b, a] = image.texels[v * image.width as usize + u].map(f32::from);
                    let weight = tall * wide;
                    all += weight;
                    seen += weight * a;
                    sum[0] += weight * a * r;
                    sum[1] += weight * a * g;
                    sum[2] += weight * a * b;
                }
            }
            let [r, g, b] =
                sum.map(|part| if seen > 0.0 { (part / seen).round() as u8 } else { 0 });
            [r, g, b, (seen / all).round() as u8]
        })
    };
    Texture {
        width,
        height,
        texels: (0..height as usize).into_par_iter().flat_map_iter(row).collect(),
    }
}

/// Returns, for each of `count` texels, which of `from` texels it covers, and the shares of them.
fn covered(from: u32, count: u32) -> Vec<Vec<(usize, f32)>> {
    let step = f64::from(from) / f64::from(count);
    let of = |i: u32| {
        let (low, high) = (f64::from(i) * step, f64::from(i + 1) * step);
        let last = (high.ceil() as u32).min(from);
        let share = |at: u32| (high.min(f64::from(at + 1)) - low.max(f64::from(at))) as f32;
        let all = (low.floor() as u32..last).map(|at| (at as usize, share(at)));
        all.filter(|(_, share)| *share > 1e-6).collect()
    };
    (0..count).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let texels = texels.map(|(x, y)| texel(x, y)).collect();
        Image::new(&Arc::new(Texture { width, height, texels }))
    }

    #[test]
    fn levels_keep_the_mean() {
        let picture = image(37, 20, |x, y| [(x * 6) as u8, (y * 12) as u8, 7, 255]);
        let sizes: Vec<[u32; 2]> =
            picture.coarser.iter().map(|level| [level.width, level.height]).collect();
        assert_eq!(sizes, [[19, 10], [10, 5], [5, 3], [3, 2], [2, 1], [1, 1]]);
        let last = picture.coarser.last().unwrap().texels[0];
        for (actual, wanted) in last.into_iter().zip([108.0, 114.0, 7.0, 255.0]) {
            assert!((f64::from(actual) - wanted).abs() <= 2.0, "{last:?}");
        }
    }

    /// However large and slanted a pixel is, its colour is about the mean of many texels, and what
    /// is not seen tints nothing.
    #[test]
    fn means_are_those_of_many_samples() {
        let wave = |at: u32, by: u32| 128.0 + 100.0 * (at as f32 / by as f32).sin();
        let picture = image(256, 128, |x, y| {
            let hidden = (x / 9 + y / 7) % 3 == 0;
            let tint = if hidden { [255; 3] } else { [wave(x, 5) as u8, wave(y, 3) as u8, 40] };
            [tint[0], tint[1], tint[2], if hidden { 0 } else { 255 }]
        });
        let mut worst = 0.0f32;
        for number in 0..200 {
            let part = |by: u32| ((number * by) % 97) as f32 / 97.0;
            let uv = Vec2::new(part(31), part(17));
            let long = 0.002 + 0.2 * part(41) * part(53);
            let (across, down) =
                (Vec2::new(long, 0.3 * long * part(7)), Vec2::new(0.0, 0.02 * part(11)));
            let mean = picture.mean(uv, across, down);
            let (mut sum, mut seen) = ([0.0; 3], 0.0);
            for i in 0..64 * 64 {
                let place = Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5) / 64.0 - 0.5;
                let [r, g, b, a] = picture.finest.sample(uv + across * place.x + down * place.y);
                seen += a / 4096.0;
                for (sum, part) in sum.iter_mut().zip([r, g, b]) {
                    *sum += part * a / 4096.0;
                }
            }
            // What is seen: colours times their shares.
            let error = (0..3).map(|i| (mean[i] * mean[3] - sum[i]).abs()).fold(0.0, f32::max);
            worst = worst.max(error).max((mean[3] - seen).abs());
        }
        assert!(worst < 0.12, "{worst}");
    }

    #[test]
    fn odd_coordinates_give_colours() {
        let picture = image(4, 4, |x, _| [(60 * x) as u8, 0, 0, 255]);
        let one = Vec2::ONE;
        for uv in [f32::NAN, f32::INFINITY, 1e30, -1e-30] {
            for side in [0.0, 1e-30, 1e30, f32::NAN, f32::INFINITY] {
                let color = picture.mean(one * uv, one * side, Vec2::new(-side, side));
                assert!(
                    color.iter().all(|part| (0.0..=1.0).contains(part)),
                    "{uv} {side} {color:?}"
                );
            }
        }
        let none = image(0, 0, |_, _| [0; 4]);
        assert_eq!(none.mean(one, one, one), [0.0; 4]);
    }
}

//! A finished picture: colour, opacity and depth of every pixel.

use crate::{Error, Result};
use std::path::Path;

/// A picture as a renderer leaves it. Rows from the top.
#[derive(Debug, Clone)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Red, green, blue multiplied by opacity, and opacity, 0 … 1, as displayed (not linear light).
    pub color: Vec<[f32; 4]>,
    /// View-space z at which half of the light is taken, in world units; infinite where the ray stays brighter.
    pub depth: Vec<f32>,
}

impl Picture {
    /// 8 bits a channel over a background colour; `None` keeps the opacity (not premultiplied).
    pub fn to_rgba8(&self, background: Option<[f32; 3]>) -> Vec<u8> {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        let mut out = Vec::with_capacity(4 * self.color.len());
        for &[r, g, b, a] in &self.color {
            out.extend(match background {
                Some(back) => {
                    let over = |c: f32, under: f32| byte(c + (1.0 - a) * under);
                    [over(r, back[0]), over(g, back[1]), over(b, back[2]), 255]
                }
                None if a > 0.0 => [byte(r / a), byte(g / a), byte(b / a), byte(a)],
                None => [0; 4],
            });
        }
        out
    }

    /// Averages blocks of `factor` × `factor` pixels: the second half of supersampling. Depth takes the nearest.
    pub fn reduced(&self, factor: u32) -> Self {
        let (width, height) = (self.width / factor, self.height / factor);
        let mut color = Vec::with_capacity((width * height) as usize);
        let mut depth = Vec::with_capacity(color.capacity());
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0f32; 4];
                let mut nearest = f32::INFINITY;
                for i in 0..factor * factor {
                    let (px, py) = (x * factor + i % factor, y * factor + i / factor);
                    let at = (py * self.width + px) as usize;
                    (0..4).for_each(|c| sum[c] += self.color[at][c]);
                    nearest = nearest.min(self.depth[at]);
                }
                color.push(sum.map(|v| v / (factor * factor) as f32));
                depth.push(nearest);
            }
        }
        Self { width, height, color, depth }
    }

    /// Writes a PNG or JPEG, chosen by the extension. JPEG has no opacity: without a background it gets black.
    pub fn save(&self, path: &Path, background: Option<[f32; 3]>) -> Result<()> {
        let format = image::ImageFormat::from_path(path)
            .map_err(|_| Error::Argument(format!("{}: unknown picture format, use .png or .jpg", path.display())))?;
        let failed = |e: image::ImageError| Error::file(path, "write", std::io::Error::other(e));
        let rgba = |back| image::RgbaImage::from_raw(self.width, self.height, self.to_rgba8(back));
        let too_large = || Error::Argument("the picture is too large to be stored".into());
        if format == image::ImageFormat::Jpeg {
            let picture = rgba(background.or(Some([0.0; 3]))).ok_or_else(too_large)?;
            return image::DynamicImage::from(picture).to_rgb8().save_with_format(path, format).map_err(failed);
        }
        rgba(background).ok_or_else(too_large)?.save_with_format(path, format).map_err(failed)
    }
}

//! A finished picture: colour, opacity and depth of every pixel.

use crate::{Error, Result, disk};
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

    /// Refuses a picture that has not as many colours as pixels.
    pub(crate) fn check_colors(&self) -> Result<()> {
        self.check("colours", self.color.len())
    }

    fn check_depths(&self) -> Result<()> {
        self.check("depths", self.depth.len())
    }

    fn check(&self, what: &str, found: usize) -> Result<()> {
        let Self { width, height, .. } = self;
        if found as u64 == u64::from(*width) * u64::from(*height) {
            return Ok(());
        }
        Err(Error::Argument(format!(
            "a picture of {width}x{height} pixels cannot have {found} {what}"
        )))
    }

    /// Averages blocks of `factor` × `factor` pixels: the second half of supersampling. Depth takes the nearest. Rows and
    /// columns beyond the last whole block are left out.
    ///
    /// # Errors
    /// [`Error::Argument`] for a factor of 0, and where the picture has not as many colours and depths as pixels.
    pub fn reduced(&self, factor: u32) -> Result<Self> {
        self.check_colors()?;
        self.check_depths()?;
        if factor == 0 {
            return Err(Error::Argument("a picture cannot be reduced by a factor of 0".into()));
        }
        let (width, height) = (self.width / factor, self.height / factor);
        let mut color = Vec::with_capacity(width as usize * height as usize);
        let mut depth = Vec::with_capacity(color.capacity());
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0f32; 4];
                let mut nearest = f32::INFINITY;
                for row in y * factor..(y + 1) * factor {
                    let first = row as usize * self.width as usize + (x * factor) as usize;
                    for at in first..first + factor as usize {
                        (0..4).for_each(|c| sum[c] += self.color[at][c]);
                        nearest = nearest.min(self.depth[at]);
                    }
                }
                color.push(sum.map(|v| v / (factor as f32 * factor as f32)));
                depth.push(nearest);
            }
        }
        Ok(Self { width, height, color, depth })
    }

    /// Writes a PNG or JPEG, chosen by the extension. JPEG has no opacity: without a background it gets black.
    ///
    /// # Errors
    /// [`Error::Argument`] for another extension, [`Error::Output`] where the file cannot be written.
    pub fn save(&self, path: &Path, background: Option<[f32; 3]>) -> Result<()> {
        let bytes = self.encode(PictureFormat::of(path)?, background)?;
        disk::write(path, &bytes)
    }

    /// The bytes of a picture file. JPEG has no opacity: without a background it gets black.
    ///
    /// # Errors
    /// [`Error::Argument`] for a picture that the format cannot hold, or that has not as many colours as pixels.
    pub fn encode(&self, format: PictureFormat, background: Option<[f32; 3]>) -> Result<Vec<u8>> {
        self.check_colors()?;
        let rgba = |back| {
            let picture = image::RgbaImage::from_raw(self.width, self.height, self.to_rgba8(back));
            picture.map(image::DynamicImage::from).ok_or_else(too_large)
        };
        match format {
            PictureFormat::Png => encode(&rgba(background)?, image::ImageFormat::Png),
            PictureFormat::Jpeg => {
                let opaque = rgba(background.or(Some([0.0; 3])))?.to_rgb8();
                encode(&opaque.into(), image::ImageFormat::Jpeg)
            }
        }
    }

    /// The depths as a grey PNG of 16 bits: 65535 at the nearest depth of the picture, falling evenly to 1 at the farthest;
    /// 0 where there is none.
    ///
    /// # Errors
    /// [`Error::Argument`] for a picture that the format cannot hold, or that has not as many depths as pixels.
    pub fn encode_depth(&self) -> Result<Vec<u8>> {
        self.check_depths()?;
        let finite = self.depth.iter().copied().filter(|d| d.is_finite());
        let [near, far] = finite
            .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], d| [low.min(d), high.max(d)]);
        let grey = |&depth: &f32| match (far - depth) / (far - near) {
            _ if !depth.is_finite() => 0,
            share if share.is_finite() => 1 + (65534.0 * share).round() as u16,
            // All depths are the same.
            _ => u16::MAX,
        };
        let pixels: Vec<u16> = self.depth.iter().map(grey).collect();
        let picture =
            image::ImageBuffer::<image::Luma<u16>, _>::from_raw(self.width, self.height, pixels);
        encode(&picture.ok_or_else(too_large)?.into(), image::ImageFormat::Png)
    }
}

/// A kind of picture file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    Png,
    Jpeg,
}

impl PictureFormat {
    /// The format that a file's extension names.
    ///
    /// # Errors
    /// [`Error::Argument`] where it names none of these.
    pub fn of(path: &Path) -> Result<Self> {
        match image::ImageFormat::from_path(path) {
            Ok(image::ImageFormat::Png) => Ok(Self::Png),
            Ok(image::ImageFormat::Jpeg) => Ok(Self::Jpeg),
            _ => Err(Error::Argument(format!(
                "{}: unknown picture format, use .png or .jpg",
                path.display()
            ))),
        }
    }
}

fn too_large() -> Error {
    Error::Argument("the picture is too large to be stored".into())
}

fn encode(picture: &image::DynamicImage, format: image::ImageFormat) -> Result<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, format)
        .map_err(|e| Error::Argument(format!("the picture cannot be stored: {e}")))?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_span_sixteen_bits() {
        let depth = vec![2.0, 4.0, f32::INFINITY, 3.0];
        let picture = Picture { width: 4, height: 1, color: vec![[0.0; 4]; 4], depth };
        let read = image::load_from_memory(&picture.encode_depth().unwrap()).unwrap().to_luma16();
        assert_eq!(read.into_raw(), [65535, 1, 0, 32768]);
        let flat = Picture {
            width: 2,
            height: 1,
            color: vec![[0.0; 4]; 2],
            depth: vec![1.0, f32::INFINITY],
        };
        let read = image::load_from_memory(&flat.encode_depth().unwrap()).unwrap().to_luma16();
        assert_eq!(read.into_raw(), [65535, 0]);
    }

    #[test]
    fn pictures_that_contradict_themselves_are_refused() {
        let refused =
            |result: Result<()>| assert!(matches!(result, Err(Error::Argument(_))), "{result:?}");
        for (size, colors, depths) in [(2, 3, 4), (2, 9, 9), (2, 4, 0), (0, 1, 1), (u32::MAX, 1, 1)]
        {
            let color = vec![[0.5; 4]; colors];
            let picture = Picture { width: size, height: size, color, depth: vec![1.0; depths] };
            refused(picture.reduced(2).map(|_| ()));
            if colors != 4 {
                refused(picture.encode(PictureFormat::Png, None).map(|_| ()));
                refused(crate::compare::compare_pictures(&picture, &picture).map(|_| ()));
            }
            if depths != 4 {
                refused(picture.encode_depth().map(|_| ()));
            }
        }
        let picture =
            Picture { width: 2, height: 3, color: vec![[0.5; 4]; 6], depth: vec![1.0; 6] };
        refused(picture.reduced(0).map(|_| ()));
        let reduced = picture.reduced(2).unwrap();
        assert_eq!((reduced.width, reduced.height, reduced.color), (1, 1, vec![[0.5; 4]]));
        assert!(picture.reduced(9).unwrap().color.is_empty());
        refused(crate::compare::compare(&[], &[], [u32::MAX; 2]).map(|_| ()));
    }

    #[test]
    fn formats_are_known_by_extension() {
        assert_eq!(PictureFormat::of(Path::new("a.PNG")).unwrap(), PictureFormat::Png);
        assert_eq!(PictureFormat::of(Path::new("a.jpeg")).unwrap(), PictureFormat::Jpeg);
        assert!(PictureFormat::of(Path::new("a.gif")).is_err());
        assert!(PictureFormat::of(Path::new("a")).is_err());
    }
}

//! A finished picture: colour, opacity and depth of every pixel.

mod edges;
mod encoding;
#[cfg(feature = "pictures")]
mod exr;
mod eye_dome;
mod layers;
mod outlines;

pub use edges::Edges;
pub(crate) use encoding::{DPI, wrong_dpi};
pub use encoding::{Encoding, PictureFormat};
pub use layers::Layers;
pub use outlines::Outlines;

use crate::{Error, Result, disk};
use std::path::Path;

/// A rendered picture, with rows from the top.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green and blue multiplied by opacity, then opacity; 0 … 1, as displayed (not linear
    /// light). Trained Gaussians may be brighter than 1; pictures are saved with at most 1.
    pub color: Vec<[f32; 4]>,
    /// View-space z, in world units, at which half of the light is absorbed; infinite if less than
    /// half is absorbed along the ray.
    pub depth: Vec<f32>,
}

impl Picture {
    /// Converts the picture to 8 bits a channel over a background colour. `None` keeps the opacity
    /// (not premultiplied).
    pub fn to_rgba8(&self, background: Option<[f32; 3]>) -> Vec<u8> {
        self.quantised(background, |v| (v * 255.0).round() as u8)
    }

    /// As [`to_rgba8`](Self::to_rgba8), with 16 bits a channel.
    pub fn to_rgba16(&self, background: Option<[f32; 3]>) -> Vec<u16> {
        self.quantised(background, |v| (v * 65535.0).round() as u16)
    }

    /// Returns all channels as whole numbers, which `round` makes of 0 … 1.
    fn quantised<T: Copy>(&self, background: Option<[f32; 3]>, round: impl Fn(f32) -> T) -> Vec<T> {
        let whole = |v: f32| round(v.clamp(0.0, 1.0));
        let mut out = Vec::with_capacity(4 * self.color.len());
        for &[r, g, b, a] in &self.color {
            out.extend(match background {
                Some(back) => {
                    let over = |c: f32, under: f32| whole(c + (1.0 - a) * under);
                    [over(r, back[0]), over(g, back[1]), over(b, back[2]), whole(1.0)]
                }
                None if a > 0.0 => [whole(r / a), whole(g / a), whole(b / a), whole(a)],
                None => [whole(0.0); 4],
            });
        }
        out
    }

    /// Returns an error if the number of colours is not the number of pixels.
    pub(crate) fn check_colors(&self) -> Result<()> {
        self.check("colours", self.color.len())
    }

    fn check_depths(&self) -> Result<()> {
        self.check("depths", self.depth.len())
    }

    fn check(&self, what: &str, count: usize) -> Result<()> {
        let Self { width, height, .. } = self;
        if count as u64 == u64::from(*width) * u64::from(*height) {
            return Ok(());
        }
        Err(Error::Argument(format!(
            "a picture of {width}x{height} pixels cannot have {count} {what}"
        )))
    }

    /// Averages blocks of `factor` × `factor` pixels, the second half of supersampling. The depth
    /// of a block is its nearest depth. Rows and columns beyond the last whole block are dropped.
    ///
    /// # Errors
    /// [`Error::Argument`] if the factor is 0, or if the picture does not have one colour and one
    /// depth for each pixel.
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

    /// Writes a picture file, whose extension says the format. Without a background, a JPEG, which
    /// has no opacity, is drawn over black.
    ///
    /// # Errors
    /// [`Error::Argument`] for other extensions, and [`Error::Output`] if the file cannot be
    /// written.
    pub fn save(&self, path: impl AsRef<Path>, background: Option<[f32; 3]>) -> Result<()> {
        let path = path.as_ref();
        self.save_as(path, &Encoding { background, ..Encoding::new(PictureFormat::of(path)?) })
    }

    /// Writes a picture file with these options, whatever its extension.
    ///
    /// # Errors
    /// Those of [`encode`](Self::encode), and [`Error::Output`] if the file cannot be written.
    pub fn save_as(&self, path: impl AsRef<Path>, encoding: &Encoding) -> Result<()> {
        disk::write(path.as_ref(), &self.encode(encoding)?)
    }

    /// Pastes another picture over a part of this one. Colours and depths are replaced.
    ///
    /// # Errors
    /// [`Error::Argument`] if the other picture reaches beyond this one, or if one of them does not
    /// have a colour and a depth for each pixel.
    pub fn paste(&mut self, other: &Self, [left, top]: [u32; 2]) -> Result<()> {
        for picture in [&*self, other] {
            picture.check_colors()?;
            picture.check_depths()?;
        }
        let ends = [left.checked_add(other.width), top.checked_add(other.height)];
        if ends[0].is_none_or(|end| end > self.width) || ends[1].is_none_or(|end| end > self.height)
        {
            return Err(Error::Argument("a picture is pasted beyond the sides of another".into()));
        }
        let [wide, from] = [self.width as usize, left as usize];
        let width = other.width as usize;
        for row in 0..other.height as usize {
            let at = (top as usize + row) * wide + from;
            let source = row * width;
            self.color[at..at + width].copy_from_slice(&other.color[source..source + width]);
            self.depth[at..at + width].copy_from_slice(&other.depth[source..source + width]);
        }
        Ok(())
    }

    /// Adds the light of a picture of the same size: colours add up to at most 1, and what the
    /// pictures let through is multiplied.
    pub(crate) fn add_light(&mut self, other: &Self) {
        for (pixel, other) in self.color.iter_mut().zip(&other.color) {
            let through = (1.0 - pixel[3]) * (1.0 - other[3]);
            for channel in 0..3 {
                pixel[channel] = (pixel[channel] + other[channel]).min(1.0);
            }
            pixel[3] = 1.0 - through;
        }
    }

    /// Returns a picture that shows nothing.
    pub fn blank([width, height]: [u32; 2]) -> Self {
        let count = width as usize * height as usize;
        Self { width, height, color: vec![[0.0; 4]; count], depth: vec![f32::INFINITY; count] }
    }

    /// Encodes the depths as a 16-bit grey PNG. The nearest depth of the picture is 65535, falling
    /// linearly to 1 at the farthest. Pixels without a depth are 0.
    ///
    /// # Errors
    /// [`Error::Argument`] if the format cannot store the picture, or if the picture does not have
    /// one depth for each pixel.
    pub fn encode_depth(&self) -> Result<Vec<u8>> {
        self.check_depths()?;
        let finite = self.depth.iter().copied().filter(|d| d.is_finite());
        let [near, far] = finite
            .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], d| [low.min(d), high.max(d)]);
        let grey = |&depth: &f32| match (far - depth) / (far - near) {
            _ if !depth.is_finite() => 0,
            share if share.is_finite() => 1 + (65534.0 * share).round() as u16,
            // All depths are equal.
            _ => u16::MAX,
        };
        let pixels: Vec<u16> = self.depth.iter().map(grey).collect();
        let bytes: Vec<u8> = pixels.into_iter().flat_map(u16::to_be_bytes).collect();
        let kind = (png::ColorType::Grayscale, png::BitDepth::Sixteen);
        encoding::png(&bytes, [self.width, self.height], kind, None)
    }
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
                refused(picture.encode(&Encoding::new(PictureFormat::Png)).map(|_| ()));
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
    fn pictures_are_pasted_into_others_and_not_beyond() {
        let mut whole = Picture::blank([3, 2]);
        let part = Picture { width: 2, height: 1, color: vec![[0.5; 4]; 2], depth: vec![7.0; 2] };
        whole.paste(&part, [1, 1]).unwrap();
        let places: Vec<usize> = (0..6).filter(|at| whole.color[*at][3] > 0.0).collect();
        assert_eq!((places, whole.depth[4], whole.depth[3]), (vec![4, 5], 7.0, f32::INFINITY));
        for at in [[2, 0], [0, 2], [u32::MAX, 0]] {
            assert!(matches!(whole.paste(&part, at), Err(Error::Argument(_))), "{at:?}");
        }
    }
}

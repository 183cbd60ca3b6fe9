//! Measures how much two pictures differ, or two scenes ([`compare_scenes`]).
//!
//! Colours are compared premultiplied by opacity, so invisible colours do not count. Opacity is
//! compared as a fourth channel unless both pictures are opaque everywhere. A NaN counts as an
//! infinite difference.

mod scenes;

pub use scenes::{Distances, SceneComparison, ValueDifference, compare_scenes};

use crate::{
    Error, Result,
    formats::decode_picture,
    input::{Limits, Source},
    picture::Picture,
    surface::Texture,
};
use std::{collections::VecDeque, path::Path, sync::Arc};

/// The result of [`compare`] and its variants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Peak signal-to-noise ratio in decibels, 10·log₁₀(1 / mean squared difference) for channels
    /// of 0 … 1; `None` if the pictures are identical.
    pub psnr: Option<f64>,
    /// Structural similarity of the pictures' brightness, at most 1 (Wang, Bovik, Sheikh &
    /// Simoncelli 2004). It is the mean over all Gaussian windows of 11 × 11 pixels that lie inside
    /// the picture, with σ = 1.5, K₁ = 0.01 and K₂ = 0.03. Brightness is 0.299 red + 0.587 green +
    /// 0.114 blue, over black.
    pub ssim: f64,
    /// The largest difference in any channel, for channels of 0 … 1.
    pub max_difference: f64,
    /// The number of pixels in which a channel differs by more than half an 8-bit step.
    pub different_pixels: u64,
}

/// Compares two pictures of `size` pixels (width, height). Both have rows from the top and 8 bits
/// each of red, green, blue and opacity, not premultiplied.
///
/// # Errors
/// [`Error::Argument`] if a picture's length does not match the size, or if the size has no pixels.
pub fn compare(a: &[u8], b: &[u8], size: [u32; 2]) -> Result<Comparison> {
    let bytes = 4 * u128::from(size[0]) * u128::from(size[1]);
    for (name, length) in [("first", a.len()), ("second", b.len())] {
        if length as u128 != bytes {
            let [width, height] = size;
            return Err(Error::Argument(format!(
                "the {name} picture has {length} bytes, but {width}x{height} pixels need {bytes}"
            )));
        }
    }
    let premultiplied = |bytes: &[u8], at: usize| {
        let [r, g, b, a] = [0, 1, 2, 3].map(|channel| f64::from(bytes[4 * at + channel]) / 255.0);
        [r * a, g * a, b * a, a]
    };
    compare_pixels(|at| premultiplied(a, at), |at| premultiplied(b, at), size)
}

/// Compares the colours and opacities of two pictures, but not their depths.
///
/// # Errors
/// [`Error::Argument`] if the sizes differ, or if a picture does not have one colour for each
/// pixel.
pub fn compare_pictures(a: &Picture, b: &Picture) -> Result<Comparison> {
    let size = same_size([a.width, a.height], [b.width, b.height])?;
    a.check_colors()?;
    b.check_colors()?;
    compare_pixels(|at| a.color[at].map(f64::from), |at| b.color[at].map(f64::from), size)
}

/// Compares two PNG or JPEG files at 8 bits a channel; their content decides the format. The limits
/// apply to both files together.
///
/// # Errors
/// [`Error::File`], [`Error::Input`] and [`Error::Limit`] if a file is not a readable picture;
/// [`Error::Argument`] if the sizes differ.
pub fn compare_files(a: &Path, b: &Path, limits: &Limits) -> Result<Comparison> {
    let first = Source::open(a, limits)?;
    let a = picture(&first)?;
    let b = picture(&first.open_beside(b)?)?;
    let size = same_size([a.width, a.height], [b.width, b.height])?;
    compare(a.texels.as_flattened(), b.texels.as_flattened(), size)
}

fn picture(source: &Source) -> Result<Arc<Texture>> {
    let hint = |error: Error| error.hint("pictures are PNG or JPEG files");
    source.unless_changed(decode_picture(source, "picture", source.bytes()).map_err(hint))
}

fn same_size(a: [u32; 2], b: [u32; 2]) -> Result<[u32; 2]> {
    if a == b {
        return Ok(a);
    }
    let [[aw, ah], [bw, bh]] = [a, b];
    Err(Error::Argument(format!("pictures of {aw}x{ah} and {bw}x{bh} pixels cannot be compared")))
}

/// Compares two pictures, each given by a function from a pixel's index to its channels.
fn compare_pixels(
    a: impl Fn(usize) -> [f64; 4],
    b: impl Fn(usize) -> [f64; 4],
    size: [u32; 2],
) -> Result<Comparison> {
    let [width, height] = size.map(|side| side as usize);
    let count = width.saturating_mul(height);
    if count == 0 {
        return Err(Error::Argument(format!(
            "pictures of {width}x{height} pixels have no pixels to compare"
        )));
    }
    let channels = if (0..count).all(|at| a(at)[3] == 1.0 && b(at)[3] == 1.0) { 3 } else { 4 };
    let mut comparison =
        Comparison { psnr: None, ssim: 0.0, max_difference: 0.0, different_pixels: 0 };
    let mut squares = 0.0;
    for (a, b) in (0..count).map(|at| (a(at), b(at))) {
        let mut largest: f64 = 0.0;
        for channel in 0..channels {
            let difference = (a[channel] - b[channel]).abs();
            let difference = if difference.is_nan() { f64::INFINITY } else { difference };
            squares += difference * difference;
            largest = largest.max(difference);
        }
        comparison.max_difference = comparison.max_difference.max(largest);
        comparison.different_pixels += u64::from(largest > 0.5 / 255.0);
    }
    let mean = squares / (count * channels) as f64;
    comparison.psnr = (mean > 0.0).then(|| -10.0 * mean.log10());
    let brightness = |[r, g, b, _]: [f64; 4]| 0.299 * r + 0.587 * g + 0.114 * b;
    comparison.ssim =
        structural_similarity(|at| [brightness(a(at)), brightness(b(at))], [width, height]);
    Ok(comparison)
}

/// The mean structural similarity of two pictures of one channel of 0 … 1. `pixel` returns both
/// values of a pixel.
fn structural_similarity(pixel: impl Fn(usize) -> [f64; 2], [width, height]: [usize; 2]) -> f64 {
    // The Gaussian is separable: filter along x, then along y.
    let [across, down] = [window(width), window(height)];
    let columns = width + 1 - across.len();
    let (c1, c2) = (0.01 * 0.01, 0.03 * 0.03);
    // The last rows, as many as the window is high. Each contains the averages along x of both
    // values, their squares and their product.
    let mut rows: VecDeque<Vec<[f64; 5]>> = VecDeque::with_capacity(down.len());
    let mut terms = Vec::with_capacity(width);
    let mut sum = 0.0;
    for y in 0..height {
        terms.clear();
        terms.extend((0..width).map(|x| {
            let [a, b] = pixel(y * width + x);
            [a, b, a * a, b * b, a * b]
        }));
        let mut row = if rows.len() == down.len() {
            rows.pop_front().unwrap_or_default()
        } else {
            Vec::new()
        };
        row.clear();
        row.extend((0..columns).map(|x| average(&across, terms[x..].iter())));
        rows.push_back(row);
        if rows.len() < down.len() {
            continue;
        }
        for x in 0..columns {
            let [a, b, square_a, square_b, mixed] = average(&down, rows.iter().map(|row| &row[x]));
            let (variance_a, variance_b, covariance) =
                (square_a - a * a, square_b - b * b, mixed - a * b);
            sum += (2.0 * a * b + c1) * (2.0 * covariance + c2)
                / ((a * a + b * b + c1) * (variance_a + variance_b + c2));
        }
    }
    sum / (columns * (height + 1 - down.len())) as f64
}

/// Returns the weighted sum of the values.
fn average<'a>(window: &[f64], values: impl Iterator<Item = &'a [f64; 5]>) -> [f64; 5] {
    window
        .iter()
        .zip(values)
        .fold([0.0; 5], |sum, (weight, value)| std::array::from_fn(|i| sum[i] + weight * value[i]))
}

/// The weights, summing to 1, of a window along an axis of `length` pixels: 11, or `length` if that
/// is smaller.
fn window(length: usize) -> Vec<f64> {
    let taps = length.min(11);
    let weight = |i: usize| {
        let distance = i as f64 - 0.5 * (taps as f64 - 1.0);
        (-0.5 * (distance / 1.5).powi(2)).exp()
    };
    let sum: f64 = (0..taps).map(weight).sum();
    (0..taps).map(|i| weight(i) / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::Folder;

    /// A grey, opaque picture with the given values.
    fn texture(size: [usize; 2], value: impl Fn(usize, usize) -> u8) -> Vec<u8> {
        let pixels = (0..size[0] * size[1]).map(|i| value(i % size[0], i / size[0]));
        pixels.flat_map(|v| [v, v, v, 255]).collect()
    }

    fn close(value: f64, expected: f64) {
        assert!((value - expected).abs() < 1e-9, "{value} is not {expected}");
    }

    #[test]
    fn the_same_picture_is_the_same() {
        let a = texture([20, 15], |x, y| (x * 31 + y * 17) as u8);
        let comparison = compare(&a, &a, [20, 15]).unwrap();
        assert_eq!(
            (comparison.psnr, comparison.max_difference, comparison.different_pixels),
            (None, 0.0, 0)
        );
        close(comparison.ssim, 1.0);
    }

    #[test]
    fn constant_pictures_by_hand() {
        let [a, b] = [100u8, 110].map(|v| texture([16, 16], |_, _| v));
        let comparison = compare(&a, &b, [16, 16]).unwrap();
        close(comparison.psnr.unwrap(), 20.0 * 25.5_f64.log10());
        close(comparison.max_difference, 10.0 / 255.0);
        assert_eq!(comparison.different_pixels, 256);
        // Without variance, SSIM is its first factor.
        let (a, b) = (100.0 / 255.0, 110.0 / 255.0);
        close(comparison.ssim, (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4));
    }

    #[test]
    fn one_wrong_channel_by_hand() {
        let a = texture([4, 5], |_, _| 50);
        let mut b = a.clone();
        b[4 * 7 + 1] = 101;
        let comparison = compare(&a, &b, [4, 5]).unwrap();
        assert_eq!(comparison.different_pixels, 1);
        close(comparison.max_difference, 0.2);
        // 0.2² in one of 60 channels: opacity does not count, because all pixels are opaque.
        close(comparison.psnr.unwrap(), 10.0 * (60.0 / 0.04_f64).log10());
    }

    #[test]
    fn similarity_agrees_with_an_independent_implementation() {
        // The expected values come from a direct evaluation of Wang et al.'s formula with NumPy (2D
        // windows, no separation), rounded to 10 digits.
        let size = [24usize, 17];
        let a = texture(size, |x, y| ((x * x * 7 + y * 29 + x * y * 3) % 251) as u8);
        let b = texture(size, |x, y| {
            ((x * x * 7 + y * 29 + x * y * 3) % 251 / 2 + (x * 5 + y * 3) % 60) as u8
        });
        let comparison = compare(&a, &b, [24, 17]).unwrap();
        close(comparison.ssim, 0.745_384_820_6);
        close(comparison.psnr.unwrap(), 14.008_331_670_7);
        assert!(comparison.ssim < 0.999);
    }

    #[test]
    fn unseen_colours_do_not_count() {
        let clear = |v: u8| [v, v, v, 0].repeat(4);
        assert_eq!(compare(&clear(3), &clear(200), [2, 2]).unwrap().psnr, None);
        let half = [10, 10, 10, 128].repeat(4);
        close(compare(&clear(3), &half, [2, 2]).unwrap().max_difference, 128.0 / 255.0);
    }

    #[test]
    fn pictures_of_numbers_and_of_none() {
        let picture = |v: f32| Picture {
            width: 3,
            height: 1,
            color: vec![[v, 0.0, 0.0, 1.0]; 3],
            depth: vec![1.0; 3],
        };
        let comparison = compare_pictures(&picture(0.25), &picture(0.25 + 0.001)).unwrap();
        assert_eq!(comparison.different_pixels, 0);
        assert!((comparison.psnr.unwrap() - (60.0 + 10.0 * 3.0_f64.log10())).abs() < 1e-3);
        let broken = compare_pictures(&picture(0.25), &picture(f32::NAN)).unwrap();
        assert_eq!((broken.psnr, broken.max_difference), (Some(f64::NEG_INFINITY), f64::INFINITY));
    }

    #[test]
    fn what_cannot_be_compared_is_told() {
        assert!(matches!(compare(&[0; 16], &[0; 12], [2, 2]), Err(Error::Argument(_))));
        assert!(matches!(compare(&[], &[], [0, 2]), Err(Error::Argument(_))));
        let picture = |width: u32| Picture {
            width,
            height: 1,
            color: vec![[0.0; 4]; width as usize],
            depth: Vec::new(),
        };
        assert!(matches!(compare_pictures(&picture(2), &picture(3)), Err(Error::Argument(_))));
    }

    #[test]
    fn files_are_read_within_limits() {
        let folder = Folder::new();
        let [png, jpeg, text] = ["a.png", "a.jpg", "a.txt"].map(|name| folder.path(name));
        let color = (0..64 * 48).map(|i| [i as f32 / 3072.0, 0.5, 0.25, 1.0]).collect();
        let picture = Picture { width: 64, height: 48, color, depth: Vec::new() };
        picture.save(&png, None).unwrap();
        picture.save(&jpeg, None).unwrap();
        std::fs::write(&text, "no picture").unwrap();
        let limits = Limits::default();
        assert_eq!(compare_files(&png, &png, &limits).unwrap().psnr, None);
        assert!(compare_files(&png, &jpeg, &limits).unwrap().psnr.unwrap() > 30.0);
        assert!(matches!(compare_files(&png, &text, &limits), Err(Error::Input { .. })));
        assert!(matches!(
            compare_files(&folder.path("none.png"), &png, &limits),
            Err(Error::File { .. })
        ));
        let small = Limits { texels: 64 * 47, ..Limits::default() };
        assert!(matches!(compare_files(&png, &png, &small), Err(Error::Limit { .. })));
        // Limits for one picture, and for both: a pixel counts as 16 bytes while it is decoded.
        let of_one = std::fs::metadata(&png).unwrap().len() + 16 * 64 * 48;
        for (bytes, fits) in [(of_one - 1, false), (2 * of_one - 1, false), (2 * of_one, true)] {
            let result = compare_files(&png, &png, &Limits { bytes, ..limits.clone() });
            assert!(
                if fits { result.is_ok() } else { matches!(result, Err(Error::Limit { .. })) },
                "{bytes}: {result:?}"
            );
        }
    }
}

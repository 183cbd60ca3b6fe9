//! The 256 colours of a frame of a GIF: chosen by k-means, then dithered.

use rayon::prelude::*;
use std::{array, mem};

/// A colour: red, green and blue.
pub type Color = [u8; 3];

/// Bits of each channel by which colours are counted. Each count keeps the exact mean.
const BITS: u32 = 6;
/// Rounds of k-means. Later rounds hardly change a palette.
const ROUNDS: usize = 8;
/// The share of an error that dithering passes on. With all of it, errors build up to specks.
const PASSED: f32 = 0.875;
/// Cells along each channel that know which colours can be nearest in them.
const CELLS: usize = 32;

/// The mean of similar colours, and how many pixels have them.
#[derive(Clone, Copy)]
struct Kind {
    color: [f32; 3],
    count: f32,
}

/// Returns at most `most` colours for the pixels.
pub fn chosen(pixels: &[Color], most: usize) -> Vec<Color> {
    let kinds = kinds(pixels);
    let mut means = boxes(&kinds, most);
    for _ in 0..ROUNDS {
        let at: Vec<usize> =
            kinds.par_iter().map(|kind| nearest(&means, 0..means.len(), kind.color)).collect();
        let mut sums = vec![([0.0; 3], 0.0); means.len()];
        for (kind, at) in kinds.iter().zip(at) {
            let (sum, count) = &mut sums[at];
            *sum = array::from_fn(|c| sum[c] + f64::from(kind.color[c]) * f64::from(kind.count));
            *count += f64::from(kind.count);
        }
        for (mean, (sum, count)) in means.iter_mut().zip(sums) {
            if count > 0.0 {
                *mean = sum.map(|channel| (channel / count) as f32);
            }
        }
    }
    means.into_iter().map(|mean| mean.map(|channel| channel.round() as u8)).collect()
}

/// Counts the colours, those that share their upper bits together.
fn kinds(pixels: &[Color]) -> Vec<Kind> {
    let mut sums = vec![([0u64; 3], 0u64); 1 << (3 * BITS)];
    for pixel in pixels {
        let at = pixel.iter().fold(0, |at, c| (at << BITS) | usize::from(c >> (8 - BITS)));
        let (sum, count) = &mut sums[at];
        *sum = array::from_fn(|c| sum[c] + u64::from(pixel[c]));
        *count += 1;
    }
    let kind = |(sum, count): ([u64; 3], u64)| Kind {
        color: sum.map(|channel| (channel as f64 / count as f64) as f32),
        count: count as f32,
    };
    sums.into_iter().filter(|(_, count)| *count > 0).map(kind).collect()
}

/// A part of the colours.
struct Part {
    kinds: Vec<Kind>,
    mean: [f32; 3],
    /// The sum of squared distances from the mean, by channel.
    spread: [f64; 3],
}

impl Part {
    fn of(kinds: Vec<Kind>) -> Self {
        let sum =
            |of: &dyn Fn(&Kind) -> f32| kinds.iter().map(|kind| f64::from(of(kind))).sum::<f64>();
        let count = sum(&|kind| kind.count);
        let mean = array::from_fn(|c| (sum(&|kind| kind.color[c] * kind.count) / count) as f32);
        let spread =
            array::from_fn(|c| sum(&|kind| kind.count * (kind.color[c] - mean[c]).powi(2)));
        Self { kinds, mean, spread }
    }

    fn spread(&self) -> f64 {
        self.spread.iter().sum()
    }

    /// Splits the part at the mean of its widest channel.
    fn split(self) -> [Self; 2] {
        let Self { kinds, mean, spread } = self;
        let widest = |a: usize, b: usize| if spread[b] > spread[a] { b } else { a };
        let channel = (1..3).fold(0, widest);
        let is_low = |kind: &Kind| kind.color[channel] < mean[channel];
        let (low, high) = kinds.into_iter().partition(is_low);
        [low, high].map(Self::of)
    }
}

/// Splits the part of the widest spread again and again. Returns the means.
fn boxes(kinds: &[Kind], most: usize) -> Vec<[f32; 3]> {
    let mut parts = vec![Part::of(kinds.to_vec())];
    while parts.len() < most {
        let spread = |at: usize| parts[at].spread();
        let widest = |a: usize, b: usize| if spread(b) > spread(a) { b } else { a };
        let at = (1..parts.len()).fold(0, widest);
        // One colour cannot be split, and rounding gives it a spread.
        if parts[at].kinds.len() < 2 {
            break;
        }
        let part = parts.swap_remove(at);
        parts.extend(part.split());
    }
    parts.iter().map(|part| part.mean).collect()
}

/// Returns which of these colours is nearest.
fn nearest(colors: &[[f32; 3]], among: impl Iterator<Item = usize>, wanted: [f32; 3]) -> usize {
    let mut best = (f32::INFINITY, 0);
    for at in among {
        let away = distance(colors[at], wanted);
        if away < best.0 {
            best = (away, at);
        }
    }
    best.1
}

/// The squared distance of two colours.
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)
}

/// Finds nearest colours, looking only at those that can be nearest in a cell of the cube.
struct Finder {
    colors: Vec<[f32; 3]>,
    /// Empty where no colour was looked for yet.
    cells: Vec<Vec<u8>>,
}

impl Finder {
    fn new(palette: &[Color]) -> Self {
        let colors = palette.iter().map(|color| color.map(f32::from)).collect();
        Self { colors, cells: vec![Vec::new(); CELLS.pow(3)] }
    }

    fn nearest(&mut self, wanted: [f32; 3]) -> usize {
        let side = 256.0 / CELLS as f32;
        let place = wanted.map(|channel| (channel / side) as usize);
        let cell = &mut self.cells[place.iter().fold(0, |at, c| CELLS * at + c)];
        if cell.is_empty() {
            let middle = place.map(|channel| side * (channel as f32 + 0.5));
            let away = |at: usize| distance(self.colors[at], middle).sqrt();
            let least = (0..self.colors.len()).map(away).fold(f32::INFINITY, f32::min);
            // No point of the cell is farther from its middle than half a diagonal.
            let most = least + 3f32.sqrt() * side;
            cell.extend((0..self.colors.len()).filter(|at| away(*at) <= most).map(|at| at as u8));
        }
        nearest(&self.colors, cell.iter().map(|at| usize::from(*at)), wanted)
    }
}

/// Returns the index of a colour of the palette for each pixel. Errors go to the pixels that
/// follow (Floyd and Steinberg).
pub fn dithered(pixels: &[Color], palette: &[Color], width: usize) -> Vec<u8> {
    let mut finder = Finder::new(palette);
    let mut indices = Vec::with_capacity(pixels.len());
    // The errors of a row, and of a pixel at each side of it.
    let mut below = vec![[0.0; 3]; width + 2];
    for row in pixels.chunks(width) {
        let errors = mem::replace(&mut below, vec![[0.0; 3]; width + 2]);
        let mut ahead = [0.0; 3];
        for (x, pixel) in row.iter().enumerate() {
            let wanted: [f32; 3] = array::from_fn(|c| {
                (f32::from(pixel[c]) + errors[x + 1][c] + ahead[c]).clamp(0.0, 255.0)
            });
            let at = finder.nearest(wanted);
            indices.push(at as u8);
            for c in 0..3 {
                let error = PASSED / 16.0 * (wanted[c] - finder.colors[at][c]);
                ahead[c] = 7.0 * error;
                below[x][c] += 3.0 * error;
                below[x + 1][c] += 5.0 * error;
                below[x + 2][c] += error;
            }
        }
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a smooth picture of thousands of colours.
    fn smooth(width: usize) -> Vec<Color> {
        let pixel = |at: usize| {
            let [x, y] = [at % width, at / width].map(|place| place as f32 / width as f32);
            [x, y, 0.5 + 0.5 * (6.0 * x * y).sin()].map(|channel| (255.0 * channel) as u8)
        };
        (0..width * width).map(pixel).collect()
    }

    #[test]
    fn a_smooth_picture_stays_alike() {
        let width = 128;
        let pixels = smooth(width);
        let palette = chosen(&pixels, 256);
        assert!(palette.len() == 256);
        let indices = dithered(&pixels, &palette, width);
        let apart = |a: Color, b: Color| distance(a.map(f32::from), b.map(f32::from));
        let pairs = pixels.iter().zip(&indices);
        let sum: f32 = pairs.map(|(pixel, at)| apart(*pixel, palette[usize::from(*at)])).sum();
        let rms = (sum / (3 * pixels.len()) as f32).sqrt();
        assert!(rms < 7.0, "{rms}");
        // The mean of each channel over a block is kept better than that of a pixel.
        let mean = |color: &dyn Fn(usize) -> Color, c: usize| {
            let block = (0..64).map(|i| (40 + i / 8) * width + 40 + i % 8);
            block.map(|at| f32::from(color(at)[c])).sum::<f32>() / 64.0
        };
        for c in 0..3 {
            let average = mean(&|at| palette[usize::from(indices[at])], c);
            assert!((average - mean(&|at| pixels[at], c)).abs() < 1.0, "channel {c}");
        }
    }

    #[test]
    fn cells_find_the_nearest_color() {
        let palette = chosen(&smooth(64), 200);
        let mut finder = Finder::new(&palette);
        for color in smooth(50) {
            let wanted = color.map(f32::from);
            let colors = finder.colors.clone();
            let [by_cells, all] =
                [finder.nearest(wanted), nearest(&colors, 0..colors.len(), wanted)];
            assert_eq!(distance(colors[by_cells], wanted), distance(colors[all], wanted));
        }
    }

    #[test]
    fn few_colors_are_kept() {
        let pixels = [[0, 0, 0], [9, 99, 199], [255, 255, 255], [9, 99, 199]];
        let mut palette = chosen(&pixels, 256);
        palette.sort_unstable();
        assert_eq!(palette, [[0, 0, 0], [9, 99, 199], [255, 255, 255]]);
        assert_eq!(dithered(&pixels, &palette, 2), [0, 1, 2, 1]);
    }
}

//! Orthogonal slices of a volume.

use super::field::{Field, check};
use crate::{
    Error, Result,
    color::{ColorMap, ColorScale},
    math::Kernel,
    parallel::prelude::*,
    volume::{Arrangement, Lattice, TransferFunction, Volume},
};
use glam::{DVec2, DVec3};

/// How the values of a slice become colours.
#[derive(Debug, Clone, Copy)]
pub enum Shading<'a> {
    /// Grey: black up to the first value, white from the second one on.
    Window([f64; 2]),
    /// The colours of a transfer function, whatever its opacities are.
    Transfer(&'a TransferFunction),
}

/// A cut through a volume along two axes of its lattice, at one place of the third.
///
/// Rows are counted from the top. Cuts across axis 2 have axis 0 to the right and axis 1 **down**,
/// as images of a scanner. In cuts across axis 1, axis 0 points to the right and axis 2 up; in cuts
/// across axis 0, axis 1 points to the right and axis 2 up.
///
/// ```
/// use splatkit::{interaction::{Shading, Slice}, math::Kernel, volume::phantoms::Phantom};
///
/// let volume = Phantom::Ball.sample_bytes([30, 20, 10])?;
/// let slice = Slice::of_volume(&volume, &Kernel::default(), 2, 5, Shading::Window([0.0, 255.0]))?;
/// assert_eq!((slice.size, slice.rgba.len()), ([30, 20], 4 * 30 * 20));
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Pixels to the right and down: samples of the volume on a Cartesian lattice.
    pub size: [usize; 2],
    /// World lengths of a pixel to the right and down.
    pub spacing: [f64; 2],
    /// Red, green, blue and opacity of each pixel, rows from the top. The opacity is 255, or 0
    /// where the volume has no value.
    pub rgba: Vec<u8>,
    /// The value of each pixel, in the data's unit; NaN where the volume has none.
    pub values: Vec<f32>,
    /// World position of the middle of the first pixel.
    pub origin: DVec3,
    /// World vectors from a pixel to the next one to the right and down.
    pub steps: [DVec3; 2],
}

/// Most pixels along an axis of a rectilinear lattice, per sample.
const FINEST: usize = 4;

/// Pixels that one thread handles in one go.
const LEAST: usize = 4096;

impl Slice {
    /// Returns the number of slices across an axis (0, 1 or 2). It is the number of samples. On a
    /// body-centred lattice there are two slices for each edge of a cell, so that each sample lies
    /// in one.
    ///
    /// # Panics
    /// If `axis` is over 2.
    pub fn count(lattice: &Lattice, axis: usize) -> usize {
        match lattice.arrangement {
            Arrangement::BodyCentred if axis < 2 => 2 * lattice.dims[axis],
            _ => lattice.dims[axis],
        }
    }

    /// Returns the slice across an axis that is nearest to a world position.
    ///
    /// # Panics
    /// As [`count`](Self::count).
    pub fn nearest(lattice: &Lattice, axis: usize, world: DVec3) -> usize {
        let steps = (lattice.axes.inverse() * (world - lattice.origin))[axis];
        let last = Self::count(lattice, axis) - 1;
        match &lattice.arrangement {
            // Casts clamp negative values to 0.
            Arrangement::Cartesian => (steps.round() as usize).min(last),
            Arrangement::BodyCentred => ((2.0 * steps).round() as usize).min(last),
            Arrangement::Rectilinear(places) => {
                let places = &places[axis];
                let after = places.partition_point(|place| *place < steps).min(last);
                let before = after.saturating_sub(1);
                if steps - places[before] <= places[after] - steps { before } else { after }
            }
        }
    }

    /// Returns a world position moved along an axis of the lattice onto slice `index` across that
    /// axis. An index beyond the last slice is the last one.
    ///
    /// # Panics
    /// As [`count`](Self::count).
    pub fn moved_onto(lattice: &Lattice, axis: usize, index: usize, world: DVec3) -> DVec3 {
        let mut steps = lattice.axes.inverse() * (world - lattice.origin);
        steps[axis] = place(lattice, axis, index.min(Self::count(lattice, axis) - 1));
        lattice.position(steps)
    }

    /// Cuts a volume across an axis (0, 1 or 2) at slice `index`, below [`count`](Self::count) (in
    /// parallel). On Cartesian lattices a pixel is a sample. Rectilinear ones are resampled to
    /// equal distances, linearly; body-centred ones to half the edges of their cells, by the
    /// kernel.
    ///
    /// # Errors
    /// [`Error::Argument`] for an axis or an index that there is not, samples that do not fill the
    /// lattice, and, on body-centred lattices, those of
    /// [`Reconstruction::new`](crate::volume::Reconstruction::new).
    pub fn of_volume(
        volume: &Volume,
        kernel: &Kernel,
        axis: usize,
        index: usize,
        shading: Shading,
    ) -> Result<Self> {
        let lattice = &volume.lattice;
        check(volume)?;
        if axis > 2 || index >= Self::count(lattice, axis) {
            return Err(Error::Argument(format!("there is no slice {index} across axis {axis}")));
        }
        let grid = Grid::new(lattice, axis, index);
        let values = if lattice.arrangement == Arrangement::Cartesian {
            let [nx, ny, _] = lattice.dims;
            grid.values(|pixel| {
                let [i, j, k] = grid.sample(pixel);
                Some(volume.value(i + nx * (j + ny * k)))
            })
        } else {
            let field = Field::new(volume, kernel)?;
            grid.values(|pixel| field.value_at(lattice.position(grid.steps(pixel))))
        };
        let rgba = colors(&values, shading);
        let steps = grid.sides.map(|side| lattice.axes * side);
        let spacing = steps.map(DVec3::length);
        let origin = lattice.position(grid.origin);
        Ok(Self { size: grid.counts, spacing, rgba, values, origin, steps })
    }

    /// Returns the world position of a point of the slice, in pixels from its upper left corner.
    pub fn position(&self, pixel: DVec2) -> DVec3 {
        let [right, down] = self.steps;
        self.origin + (pixel.x - 0.5) * right + (pixel.y - 0.5) * down
    }

    /// Returns the point of the slice that is nearest to a world position, in pixels from its upper
    /// left corner. It may lie outside the slice.
    pub fn pixel(&self, world: DVec3) -> DVec2 {
        // The normal equations, because the sides need not be perpendicular.
        let [right, down] = self.steps;
        let offset = world - self.origin;
        let (a, b, c) = (right.dot(right), right.dot(down), down.dot(down));
        let (x, y) = (right.dot(offset), down.dot(offset));
        DVec2::new(c * x - b * y, a * y - b * x) / (a * c - b * b) + 0.5
    }
}

/// The pixels of a slice, in steps of the lattice.
struct Grid {
    axes: [usize; 2],
    counts: [usize; 2],
    /// Whether the second axis points up.
    is_up: bool,
    /// The index across the slice.
    across: (usize, usize),
    /// Steps of the middle of the first pixel.
    origin: DVec3,
    /// Steps from a pixel to the next one to the right and down.
    sides: [DVec3; 2],
}

impl Grid {
    fn new(lattice: &Lattice, axis: usize, index: usize) -> Self {
        let axes = [[1, 2], [0, 2], [0, 1]][axis];
        let is_up = axis < 2;
        let mut origin = DVec3::ZERO;
        origin[axis] = place(lattice, axis, index);
        let lines = axes.map(|axis| Line::of(lattice, axis));
        let mut sides = [DVec3::ZERO; 2];
        for side in 0..2 {
            let Line { first, step, count } = lines[side];
            let is_turned = is_up && side == 1;
            let last = first + step * (count - 1) as f64;
            origin[axes[side]] = if is_turned { last } else { first };
            sides[side][axes[side]] = if is_turned { -step } else { step };
        }
        let counts = lines.map(|line| line.count);
        Self { axes, counts, is_up, across: (axis, index), origin, sides }
    }

    fn steps(&self, [x, y]: [usize; 2]) -> DVec3 {
        self.origin + x as f64 * self.sides[0] + y as f64 * self.sides[1]
    }

    /// Returns the sample of a Cartesian lattice at a pixel.
    fn sample(&self, [x, y]: [usize; 2]) -> [usize; 3] {
        let mut index = [0; 3];
        index[self.across.0] = self.across.1;
        index[self.axes[0]] = x;
        index[self.axes[1]] = if self.is_up { self.counts[1] - 1 - y } else { y };
        index
    }

    /// Returns the values of all pixels, row by row; NaN for none.
    fn values(&self, of: impl Fn([usize; 2]) -> Option<f64> + Sync) -> Vec<f32> {
        let [width, height] = self.counts;
        let value = |at: usize| of([at % width, at / width]).map_or(f32::NAN, |value| value as f32);
        (0..width * height).into_par_iter().with_min_len(LEAST).map(value).collect()
    }
}

/// Places at equal distances along an axis of the lattice, in steps.
struct Line {
    first: f64,
    step: f64,
    count: usize,
}

impl Line {
    fn of(lattice: &Lattice, axis: usize) -> Self {
        let count = Slice::count(lattice, axis);
        match &lattice.arrangement {
            Arrangement::Cartesian => Self { first: 0.0, step: 1.0, count },
            Arrangement::BodyCentred => Self { first: 0.0, step: 0.5, count },
            Arrangement::Rectilinear(places) => match places[axis][..] {
                [first, .., last] => {
                    let gaps = places[axis].windows(2).map(|pair| pair[1] - pair[0]);
                    let least = gaps.fold(f64::INFINITY, f64::min);
                    // Rounding must not add a pixel to even places.
                    let parts = ((last - first) / least - 1e-9).ceil();
                    let parts = (parts as usize).clamp(count - 1, FINEST * count);
                    Self { first, step: (last - first) / parts as f64, count: parts + 1 }
                }
                _ => Self { first: places[axis][0], step: 1.0, count: 1 },
            },
        }
    }
}

/// Returns where a slice across an axis lies on it, in steps.
fn place(lattice: &Lattice, axis: usize, index: usize) -> f64 {
    match &lattice.arrangement {
        Arrangement::Cartesian => index as f64,
        Arrangement::BodyCentred => 0.5 * index as f64,
        Arrangement::Rectilinear(places) => places[axis][index],
    }
}

/// Returns red, green, blue and opacity of values.
fn colors(values: &[f32], shading: Shading) -> Vec<u8> {
    let range = if let Shading::Window(range) = shading { range } else { [0.0, 1.0] };
    let gray = ColorScale { range, ..ColorScale::new(ColorMap::GRAY) };
    let color = |value: f64| match shading {
        Shading::Window(_) => gray.color(value).map(f64::from),
        Shading::Transfer(transfer) => transfer.color(value),
    };
    let mut rgba = vec![0; 4 * values.len()];
    rgba.par_chunks_mut(4 * LEAST).zip(values.par_chunks(LEAST)).for_each(|(pixels, values)| {
        for (pixel, value) in pixels.chunks_exact_mut(4).zip(values) {
            if !value.is_nan() {
                let [r, g, b] = color(f64::from(*value)).map(|part| (part * 255.0).round() as u8);
                pixel.copy_from_slice(&[r, g, b, 255]);
            }
        }
    });
    rgba
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Samples, phantoms::Phantom};
    use glam::DMat3;
    use std::sync::Arc;

    const WINDOW: Shading = Shading::Window([0.0, 255.0]);

    /// Samples whose value is 1 + i + 10 j + 100 k.
    fn counted() -> Volume {
        let lattice = Lattice::with_spacing([3, 4, 2], DVec3::new(1.0, 2.0, 5.0));
        let value = |at| {
            let [i, j, k] = lattice.index(at);
            (1 + i + 10 * j + 100 * k) as u8
        };
        let samples = (0..lattice.len()).map(value).collect();
        Volume::new(lattice, Samples::U8(samples)).unwrap()
    }

    fn cut(volume: &Volume, axis: usize, index: usize) -> Slice {
        Slice::of_volume(volume, &Kernel::default(), axis, index, WINDOW).unwrap()
    }

    fn reds(slice: &Slice) -> Vec<u8> {
        slice.rgba.chunks(4).map(|pixel| pixel[0]).collect()
    }

    #[test]
    fn pixels_of_cartesian_slices_are_samples() {
        let volume = counted();
        let slice = cut(&volume, 2, 1);
        assert_eq!((slice.size, slice.spacing), ([3, 4], [1.0, 2.0]));
        let expected = [101, 102, 103, 111, 112, 113, 121, 122, 123, 131, 132, 133];
        assert_eq!(reds(&slice), expected);
        assert_eq!(slice.values, expected.map(f32::from));
        // Axis 2 points up.
        let slice = cut(&volume, 0, 2);
        assert_eq!((slice.size, slice.spacing), ([4, 2], [2.0, 5.0]));
        assert_eq!(reds(&slice), [103, 113, 123, 133, 3, 13, 23, 33]);
        assert_eq!(reds(&cut(&volume, 1, 3)), [131, 132, 133, 31, 32, 33]);
        for (axis, index) in [(0, 3), (1, 4), (2, 2), (3, 0)] {
            assert!(Slice::of_volume(&volume, &Kernel::default(), axis, index, WINDOW).is_err());
        }
    }

    #[test]
    fn places_and_pixels_are_inverse() {
        let skewed = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z * 3.0);
        let lattice = Lattice::cartesian([5, 6, 7], DVec3::new(1.0, 2.0, 3.0), skewed);
        let volume = Volume::new(lattice.clone(), Samples::U8(vec![0; 210])).unwrap();
        for axis in 0..3 {
            let slice = cut(&volume, axis, 2);
            let pixel = DVec2::new(1.25, 3.5);
            let place = slice.position(pixel);
            assert!(slice.pixel(place).distance(pixel) < 1e-12);
            assert_eq!(Slice::nearest(&lattice, axis, place), 2);
            let moved = Slice::moved_onto(&lattice, axis, 2, place + lattice.axes.col(axis) * 9.0);
            assert!(moved.distance(place) < 1e-12);
        }
        // The first pixel of an upright slice is the last sample along axis 2.
        let slice = cut(&volume, 1, 2);
        let sample = lattice.sample_position((6 * 6 + 2) * 5);
        assert!(slice.position(DVec2::splat(0.5)).distance(sample) < 1e-12);
        assert_eq!(Slice::nearest(&lattice, 0, DVec3::splat(-99.0)), 0);
        assert_eq!(Slice::nearest(&lattice, 2, DVec3::splat(99.0)), 6);
    }

    #[test]
    fn windows_and_transfer_functions_give_the_colours() {
        let volume = counted();
        let of = |shading| Slice::of_volume(&volume, &Kernel::default(), 2, 0, shading).unwrap();
        // Values 1, 2, 3, 11, …
        assert_eq!(reds(&of(Shading::Window([2.0, 4.0])))[..4], [0, 0, 128, 255]);
        let transfer = TransferFunction {
            color: vec![(1.0, [1.0, 0.0, 0.0]), (3.0, [0.0, 0.0, 1.0])],
            ..TransferFunction::default()
        };
        let slice = of(Shading::Transfer(&transfer));
        assert_eq!(slice.rgba[..12], [255, 0, 0, 255, 128, 0, 128, 255, 0, 0, 255, 255]);
    }

    #[test]
    fn rectilinear_slices_have_equal_distances() {
        let places = [vec![0.0, 1.0, 4.0], vec![0.0, 2.0], vec![0.0, 1.0, 1.5]];
        let lattice = Lattice {
            dims: [3, 2, 3],
            origin: DVec3::ZERO,
            axes: DMat3::IDENTITY,
            arrangement: Arrangement::Rectilinear(Arc::new(places)),
        };
        let value = |at| (50.0 * lattice.sample_position(at).x) as f32;
        let samples = (0..18).map(value).collect();
        let volume = Volume::new(lattice.clone(), Samples::F32(samples)).unwrap();
        let slice = cut(&volume, 2, 1);
        assert_eq!((slice.size, slice.spacing), ([5, 2], [1.0, 2.0]));
        assert_eq!(reds(&slice)[..5], [0, 50, 100, 150, 200]);
        assert_eq!(slice.origin.z, 1.0);
        assert_eq!(Slice::nearest(&lattice, 0, DVec3::X * 2.4), 1);
        assert_eq!(Slice::nearest(&lattice, 0, DVec3::X * 2.6), 2);
    }

    #[test]
    fn body_centred_slices_are_reconstructed() {
        let edge = 2.0 / 16.0;
        let axes = DMat3::from_diagonal(DVec3::splat(edge));
        let lattice = Lattice::body_centred([16, 16, 32], DVec3::splat(-1.0), axes);
        let volume = Phantom::Ball.sample_on(lattice.clone()).unwrap();
        let (kernel, unit) = (Kernel::default(), Shading::Window([0.0, 1.0]));
        assert_eq!([0, 1, 2].map(|axis| Slice::count(&lattice, axis)), [32; 3]);
        for axis in 0..3 {
            let middle = Slice::nearest(&lattice, axis, DVec3::ZERO);
            let slice = Slice::of_volume(&volume, &kernel, axis, middle, unit).unwrap();
            assert_eq!((slice.size, slice.spacing), ([32; 2], [0.5 * edge; 2]));
            for (at, red) in reds(&slice).into_iter().enumerate() {
                let pixel = DVec2::new((at % 32) as f64 + 0.5, (at / 32) as f64 + 0.5);
                let expected = 255.0 * Phantom::Ball.value(slice.position(pixel));
                assert!((f64::from(red) - expected).abs() < 16.0, "{red} {expected} at {pixel}");
            }
        }
    }
}

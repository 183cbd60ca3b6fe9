//! What the automatic transfer function knows of a field: how often its values are, how steep the
//! field is at them, how noisy it is, and what surrounds it.

use crate::{
    parallel::prelude::*,
    volume::{Lattice, Scalar, Volume, each_type},
};
use glam::DVec3;

/// Most bins of a histogram.
const BINS: usize = 256;
/// About so many samples of a volume are looked at.
const SAMPLES: f64 = 2e6;
/// Share of the values that may be outliers, at either end.
const OUTLIERS: f64 = 5e-4;
/// Most values that may be labels.
const LABELS: usize = 64;
/// The 25th percentile of the magnitude of a normal variable, in standard deviations.
const QUARTER: f64 = 0.318_639;

/// The findings. Histograms have the same bins, which divide `window` evenly.
#[derive(Debug, Clone)]
pub struct Survey {
    /// The smallest and the largest value.
    pub range: [f64; 2],
    /// The values without outliers.
    pub window: [f64; 2],
    /// Number of samples by value.
    pub counts: Vec<f64>,
    /// Number of those whose gradient may be noise alone.
    pub flat: Vec<f64>,
    /// Mean magnitude of the gradient by value, in value per world length; 0 if unknown.
    pub slopes: Vec<f64>,
    /// Number of samples along the edges of the volume's box.
    pub edges: Vec<f64>,
    /// Number of samples at each face of the box.
    pub faces: [Vec<f64>; 6],
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Distance between samples along the axis on which it is smallest, in world units.
    pub spacing: f64,
    /// Diagonal of the samples' box.
    pub diagonal: f64,
    /// The values, if they are labels.
    pub labels: Vec<f64>,
}

/// What is known of one sample.
#[derive(Debug, Clone, Copy)]
struct Sample {
    value: f64,
    /// Magnitude of the gradient, in value per world length.
    slope: f64,
    /// The response to Immerkær's mask, in standard deviations of white noise per unit of value.
    /// `None` at the border.
    mask: Option<f64>,
    /// The next value along the first axis.
    next: f64,
    /// Whether the sample lies at the low and the high face of the box along each axis.
    faces: [bool; 6],
}

impl Survey {
    /// Surveys a volume, which must be valid. A window replaces the values without outliers.
    pub fn of_volume(volume: &Volume, window: Option<[f64; 2]>) -> Self {
        let lattice = &volume.lattice;
        let samples = each_type!(volume.samples, values => {
            samples(lattice, |at: usize| f64::from(values[at]))
        });
        let spacing = lattice.spacing();
        let wide = DVec3::from_array(lattice.dims.map(|n| if n > 1 { 1.0 } else { f64::INFINITY }));
        let spacing = match (spacing * wide).min_element() {
            finest if finest.is_finite() && finest > 0.0 => finest,
            _ => spacing.max_element(),
        };
        let is_float = volume.samples.scalar() == Scalar::F32;
        let mut survey = Self::of_samples(&samples, volume.range, window, is_float);
        (survey.spacing, survey.diagonal) = (spacing, volume.bounds().diagonal());
        survey.add_slopes(&samples);
        survey
    }

    /// Surveys values at unknown distances from each other, in a box with this diagonal.
    pub fn of_values(
        values: &[f32],
        range: [f64; 2],
        window: Option<[f64; 2]>,
        diagonal: f64,
    ) -> Self {
        let step = (values.len() as f64 / SAMPLES).ceil().max(1.0) as usize;
        let sample = |value: &f32| Sample {
            value: f64::from(*value),
            slope: 0.0,
            mask: None,
            next: f64::NAN,
            faces: [false; 6],
        };
        let finite = values.iter().step_by(step).filter(|value| value.is_finite());
        let samples: Vec<Sample> = finite.map(sample).collect();
        let mut survey = Self::of_samples(&samples, range, window, true);
        (survey.diagonal, survey.spacing) = (diagonal, diagonal / 100.0);
        survey.flat.clone_from(&survey.counts);
        survey
    }

    /// Fills the histograms of values.
    fn of_samples(
        samples: &[Sample],
        range: [f64; 2],
        window: Option<[f64; 2]>,
        is_float: bool,
    ) -> Self {
        let mut values: Vec<f64> = samples.iter().map(|sample| sample.value).collect();
        values.par_sort_unstable_by(f64::total_cmp);
        let extremes = [values.first(), values.last()].map(|end| end.copied().unwrap_or(0.0));
        let is_whole = !is_float || values.iter().all(|value| value.fract() == 0.0);
        let window = window.unwrap_or_else(|| without_outliers(&values, range));
        let (window, bins) = bins(window, is_whole);
        let labels = if is_whole { labels(&values, samples) } else { Vec::new() };
        let mut survey = Self {
            range,
            window,
            counts: vec![0.0; bins],
            flat: vec![0.0; bins],
            slopes: vec![0.0; bins],
            edges: vec![0.0; bins],
            faces: std::array::from_fn(|_| vec![0.0; bins]),
            noise: noise(samples, extremes, is_whole && !is_float),
            spacing: 1.0,
            diagonal: 1.0,
            labels,
        };
        for sample in samples {
            let bin = survey.bin(sample.value);
            survey.counts[bin] += 1.0;
            for (face, _) in survey.faces.iter_mut().zip(sample.faces).filter(|(_, is_at)| *is_at) {
                face[bin] += 1.0;
            }
            let axes = [0, 2, 4].map(|face| sample.faces[face] || sample.faces[face + 1]);
            let is_edge = axes.iter().filter(|is_at| **is_at).count() >= 2;
            survey.edges[bin] += f64::from(u8::from(is_edge));
        }
        survey
    }

    /// Fills the histograms that need gradients.
    fn add_slopes(&mut self, samples: &[Sample]) {
        let [low, high] = self.window;
        let flat = (2.0 * self.noise_slope()).max(0.01 * (high - low) / self.spacing);
        for sample in samples {
            let bin = self.bin(sample.value);
            self.slopes[bin] += sample.slope;
            self.flat[bin] += f64::from(u8::from(sample.slope <= flat));
        }
        for (slope, count) in self.slopes.iter_mut().zip(&self.counts) {
            *slope /= count.max(1.0);
        }
    }

    /// The root mean square of the gradient that noise alone has, by central differences.
    fn noise_slope(&self) -> f64 {
        1.5_f64.sqrt() * self.noise / self.spacing
    }

    /// Returns the bin of a value.
    pub fn bin(&self, value: f64) -> usize {
        let [low, high] = self.window;
        let bins = self.counts.len();
        // Casts saturate.
        (((value - low) / (high - low) * bins as f64) as usize).min(bins - 1)
    }

    /// Returns the value in the middle of a bin, or at a place between bins.
    pub fn value(&self, bin: f64) -> f64 {
        let [low, high] = self.window;
        low + (high - low) * (bin + 0.5) / self.counts.len() as f64
    }

    /// The width of a bin, in value.
    pub fn width(&self) -> f64 {
        (self.window[1] - self.window[0]) / self.counts.len() as f64
    }
}

/// Returns samples that are evenly spread over a lattice.
fn samples(lattice: &Lattice, value: impl Fn(usize) -> f64 + Sync) -> Vec<Sample> {
    let dims = lattice.dims;
    let step = (lattice.len() as f64 / SAMPLES).cbrt().ceil().max(1.0) as usize;
    // Steps that divide the number of samples of a row would look at one column only.
    let count = |axis: usize| dims[axis].div_ceil(if dims[axis] < 2 * step { 1 } else { step });
    let counts = [0, 1, 2].map(count);
    let place = |axis: usize, number: usize| match counts[axis] {
        1 => 0,
        count => number * (dims[axis] - 1) / (count - 1),
    };
    let row = |number: usize| {
        let (j, k) = (place(1, number % counts[1]), place(2, number / counts[1]));
        (0..counts[0]).map(|i| sample(lattice, [place(0, i), j, k], &value)).collect::<Vec<_>>()
    };
    (0..counts[1] * counts[2]).into_par_iter().flat_map_iter(row).collect()
}

/// Returns one sample. On a body-centred lattice, its neighbours are those of its own cubic
/// lattice.
fn sample(lattice: &Lattice, index: [usize; 3], value: impl Fn(usize) -> f64) -> Sample {
    let [nx, ny, _] = lattice.dims;
    let is_centred = matches!(lattice.arrangement, crate::volume::Arrangement::BodyCentred);
    let strides: [usize; 3] = if is_centred { [1, 1, 2] } else { [1; 3] };
    let at = |[i, j, k]: [usize; 3]| value(i + nx * (j + ny * k));
    let here = at(index);
    let moved = |axis: usize, by: isize| {
        let place = index[axis].checked_add_signed(by * strides[axis] as isize)?;
        let mut index = index;
        index[axis] = place;
        (place < lattice.dims[axis]).then_some(index)
    };
    let mut squared = 0.0;
    for axis in 0..3 {
        let [before, after] = [-1, 1].map(|by| moved(axis, by).unwrap_or(index));
        if before != after {
            let steps = lattice.steps(after) - lattice.steps(before);
            squared += ((at(after) - at(before)) / (lattice.axes * steps).length()).powi(2);
        }
    }
    let faces = std::array::from_fn(|face| {
        let (axis, margin) = (face / 2, (lattice.dims[face / 2] / 32).max(1));
        let from_face =
            if face % 2 == 0 { index[axis] } else { lattice.dims[axis] - 1 - index[axis] };
        from_face < margin
    });
    Sample {
        value: here,
        slope: squared.sqrt(),
        mask: mask(lattice, index, strides, at),
        next: moved(0, 1).map_or(f64::NAN, at),
        faces,
    }
}

/// Returns the response to the mask of Immerkær (1996, "Fast noise variance estimation"), here of
/// three dimensions: the second difference along each axis, one after another. It is 0 where the
/// field is linear along some axis, and 1 for white noise of standard deviation 1.
fn mask(
    lattice: &Lattice,
    index: [usize; 3],
    strides: [usize; 3],
    at: impl Fn([usize; 3]) -> f64,
) -> Option<f64> {
    let is_long: [bool; 3] = std::array::from_fn(|axis| lattice.dims[axis] > 2 * strides[axis]);
    let fits = |axis: usize| {
        !is_long[axis]
            || index[axis] >= strides[axis] && index[axis] + strides[axis] < lattice.dims[axis]
    };
    if !(fits(0) && fits(1) && fits(2)) || is_long == [false; 3] {
        return None;
    }
    let mut sum = 0.0;
    let along = |axis: usize| if is_long[axis] { 0..3usize } else { 1..2 };
    for c in along(2) {
        for b in along(1) {
            for a in along(0) {
                let offset = [a, b, c];
                let place = std::array::from_fn(|axis| {
                    index[axis] + offset[axis] * strides[axis] - strides[axis]
                });
                let weight = |axis: usize| match (is_long[axis], offset[axis]) {
                    (true, 1) => -2.0,
                    _ => 1.0,
                };
                sum += weight(0) * weight(1) * weight(2) * at(place);
            }
        }
    }
    // The squares of 1, −2 and 1 add up to 6.
    let axes = is_long.iter().filter(|is_long| **is_long).count();
    Some(sum.abs() / 6f64.powi(axes as i32).sqrt())
}

/// Returns the standard deviation of the noise, of values whose least and largest one are given. It
/// is taken from a low percentile of the mask, because structure raises the high ones. Values that
/// are saturated or padding have no noise.
fn noise(samples: &[Sample], [low, high]: [f64; 2], is_integer: bool) -> f64 {
    let is_saturated =
        |sample: &Sample| (sample.value == low || sample.value == high) && sample.mask == Some(0.0);
    let unsaturated = samples.iter().filter(|sample| !is_saturated(sample));
    let mut responses: Vec<f64> = unsaturated.filter_map(|sample| sample.mask).collect();
    // The deviation of numbers that were rounded to integers.
    let rounding = if is_integer { 12f64.sqrt().recip() } else { 0.0 };
    // Where most of a volume is saturated, the rest is structure.
    if responses.len() < (samples.len() / 20).max(16) {
        return rounding;
    }
    let quarter = responses.len() / 4;
    (*responses.select_nth_unstable_by(quarter, f64::total_cmp).1 / QUARTER).max(rounding)
}

/// Returns the range without outliers, of values in ascending order. A range that outliers do not
/// make twice as wide stays.
fn without_outliers(values: &[f64], range: [f64; 2]) -> [f64; 2] {
    let last = values.len().saturating_sub(1) as f64;
    let at = |share: f64| values.get((share * last).round() as usize).copied().unwrap_or(range[0]);
    let inner = [at(OUTLIERS), at(1.0 - OUTLIERS)];
    let width = |[low, high]: [f64; 2]| high - low;
    if width(inner) > 0.0 && 2.0 * width(inner) < width(range) { inner } else { range }
}

/// Returns the window and the number of bins over a range. If the values are whole, every bin holds
/// equally many of them.
fn bins([low, high]: [f64; 2], is_whole: bool) -> ([f64; 2], usize) {
    if high <= low {
        return ([low - 0.5, low + 0.5], 1);
    }
    let count = high - low + 1.0;
    if !is_whole || count > 1e9 {
        return ([low, high], BINS);
    }
    let each = (count / BINS as f64).ceil();
    let bins = (count / each).ceil();
    ([low - 0.5, low - 0.5 + bins * each], bins as usize)
}

/// Returns the distinct values, of whole values in ascending order, if they look like labels: few,
/// constant over regions, and with neighbours of any difference.
fn labels(values: &[f64], samples: &[Sample]) -> Vec<f64> {
    let mut distinct = values.to_vec();
    distinct.dedup();
    let (mut equal, mut near, mut far) = (0u64, 0u64, 0u64);
    if distinct.len() > LABELS || distinct.len() < 2 {
        return Vec::new();
    }
    let rank = |value: f64| distinct.partition_point(|label| *label < value);
    for sample in samples.iter().filter(|sample| sample.next.is_finite()) {
        match rank(sample.value).abs_diff(rank(sample.next)) {
            0 => equal += 1,
            1 => near += 1,
            _ => far += 1,
        }
    }
    let (all, unequal) = ((equal + near + far) as f64, (near + far) as f64);
    let is_even = equal as f64 > 0.75 * all;
    let is_abrupt = far as f64 > 0.3 * unequal;
    let are_few = distinct.len() <= 4 && equal as f64 > 0.9 * all;
    if distinct.len() == 2 || is_even && (is_abrupt || are_few) { distinct } else { Vec::new() }
}

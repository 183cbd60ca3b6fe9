//! What the automatic transfer function knows of a field: how often its values are, how steep the
//! field is at them, how noisy it is, and what surrounds it.

use crate::{
    parallel::prelude::*,
    volume::{Arrangement, Lattice, Scalar, Volume, each_type},
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
    /// Not a number at the border.
    mask: f64,
}

/// Samples that are evenly spread over a box, those of the first axis next to each other.
struct Spread {
    samples: Vec<Sample>,
    /// For each place along each axis, whether it lies at the low and at the high face of the box.
    faces: [Vec<[bool; 2]>; 3],
}

impl Survey {
    /// Surveys a volume, which must be valid. A window replaces the values without outliers.
    pub fn of_volume(volume: &Volume, window: Option<[f64; 2]>) -> Self {
        let lattice = &volume.lattice;
        let spread = each_type!(volume.samples, values => {
            Spread::of(lattice, |at: usize| f64::from(values[at]))
        });
        let spacing = lattice.spacing();
        let wide = DVec3::from_array(lattice.dims.map(|n| if n > 1 { 1.0 } else { f64::INFINITY }));
        let spacing = match (spacing * wide).min_element() {
            finest if finest.is_finite() && finest > 0.0 => finest,
            _ => spacing.max_element(),
        };
        let order = Order::of(&spread.samples, volume.samples.scalar());
        let neighbours = || {
            each_type!(volume.samples, values => {
                neighbours(lattice, |at: usize| f64::from(values[at]))
            })
        };
        let is_float = volume.samples.scalar() == Scalar::F32;
        let labels = if order.is_whole { labels(&order, neighbours) } else { Vec::new() };
        let mut survey = Self::of_samples(&spread, &order, volume.range, window);
        survey.labels = labels;
        survey.noise = noise(&spread.samples, order.ends(), order.is_whole && !is_float);
        (survey.spacing, survey.diagonal) = (spacing, volume.bounds().diagonal());
        survey.add_slopes(&spread.samples);
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
        let sample = |value: &f32| Sample { value: f64::from(*value), slope: 0.0, mask: f64::NAN };
        let finite = values.iter().step_by(step).filter(|value| value.is_finite());
        let samples: Vec<Sample> = finite.map(sample).collect();
        let nowhere = |count: usize| vec![[false; 2]; count];
        let faces = [nowhere(samples.len()), nowhere(1), nowhere(1)];
        let order = Order::of(&samples, Scalar::F32);
        let labels = if order.is_whole { labels(&order, Vec::new) } else { Vec::new() };
        let mut survey = Self::of_samples(&Spread { samples, faces }, &order, range, window);
        survey.labels = labels;
        (survey.diagonal, survey.spacing) = (diagonal, diagonal / 100.0);
        survey.flat.clone_from(&survey.counts);
        survey
    }

    /// Fills the histograms of values.
    fn of_samples(
        spread: &Spread,
        order: &Order,
        range: [f64; 2],
        window: Option<[f64; 2]>,
    ) -> Self {
        let window = window.unwrap_or_else(|| without_outliers(order, range));
        let (window, bins) = bins(window, order.is_whole);
        let mut survey = Self {
            range,
            window,
            counts: vec![0.0; bins],
            flat: vec![0.0; bins],
            slopes: vec![0.0; bins],
            edges: vec![0.0; bins],
            faces: std::array::from_fn(|_| vec![0.0; bins]),
            noise: 0.0,
            spacing: 1.0,
            diagonal: 1.0,
            labels: Vec::new(),
        };
        let [along_x, along_y, along_z] = &spread.faces;
        let mut samples = spread.samples.iter();
        for z in along_z {
            for y in along_y {
                for (x, sample) in along_x.iter().zip(&mut samples) {
                    survey.count(sample.value, [*x, *y, *z]);
                }
            }
        }
        survey
    }

    /// Counts a value that lies at these faces of the box.
    fn count(&mut self, value: f64, faces: [[bool; 2]; 3]) {
        let bin = self.bin(value);
        self.counts[bin] += 1.0;
        let axes = faces.iter().filter(|[low, high]| *low || *high).count();
        if axes == 0 {
            return;
        }
        for (face, _) in self.faces.iter_mut().zip(faces.as_flattened()).filter(|(_, at)| **at) {
            face[bin] += 1.0;
        }
        self.edges[bin] += f64::from(u8::from(axes >= 2));
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

impl Spread {
    fn of(lattice: &Lattice, value: impl Fn(usize) -> f64 + Sync) -> Self {
        let places = places(lattice);
        let [along_x, along_y, along_z] = &places;
        let none = Sample { value: 0.0, slope: 0.0, mask: f64::NAN };
        let mut samples = vec![none; along_x.len() * along_y.len() * along_z.len()];
        let stencil = Stencil::new(lattice, &value);
        samples.par_chunks_mut(along_x.len().max(1)).enumerate().for_each(|(number, row)| {
            let (j, k) = (along_y[number % along_y.len()], along_z[number / along_y.len()]);
            for (sample, &i) in row.iter_mut().zip(along_x) {
                *sample = stencil.sample([i, j, k]);
            }
        });
        let faces = std::array::from_fn(|axis| {
            let margin = (lattice.dims[axis] / 32).max(1);
            let is_at = |place: &usize| [*place < margin, lattice.dims[axis] - 1 - *place < margin];
            places[axis].iter().map(is_at).collect()
        });
        Self { samples, faces }
    }
}

/// Returns the places along each axis of a lattice at which samples are looked at.
fn places(lattice: &Lattice) -> [Vec<usize>; 3] {
    let step = (lattice.len() as f64 / SAMPLES).cbrt().ceil().max(1.0) as usize;
    lattice.dims.map(|along| {
        // Steps that divide the number of samples of a row would look at one column only.
        match along.div_ceil(if along < 2 * step { 1 } else { step }) {
            1 => vec![0],
            count => (0..count).map(|number| number * (along - 1) / (count - 1)).collect(),
        }
    })
}

/// Returns the distance between neighbours along each axis. On a body-centred lattice, the
/// neighbours of a sample are those of its own cubic lattice.
fn strides(lattice: &Lattice) -> [usize; 3] {
    match lattice.arrangement {
        Arrangement::BodyCentred => [1, 1, 2],
        _ => [1; 3],
    }
}

/// Returns the values of samples and of their next neighbours along the first axis.
fn neighbours(lattice: &Lattice, value: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
    let [nx, ny, _] = lattice.dims;
    let [along_x, along_y, along_z] = &places(lattice);
    let mut pairs = Vec::new();
    for &k in along_z {
        for &j in along_y {
            let row = nx * (j + ny * k);
            let inner = along_x.iter().filter(|i| **i + 1 < nx);
            pairs.extend(inner.map(|i| [value(row + i), value(row + i + 1)]));
        }
    }
    pairs
}

/// What is computed from a sample and its neighbours.
struct Stencil<'a, V> {
    lattice: &'a Lattice,
    value: &'a V,
    strides: [usize; 3],
    /// For a Cartesian lattice of at least three samples along each axis, the distances between
    /// the two neighbours of a sample, in world units.
    distances: Option<[f64; 3]>,
}

impl<'a, V: Fn(usize) -> f64> Stencil<'a, V> {
    fn new(lattice: &'a Lattice, value: &'a V) -> Self {
        let is_even = matches!(lattice.arrangement, Arrangement::Cartesian);
        let is_even = is_even && lattice.dims.iter().all(|along| *along > 2);
        let distance = |axis: usize| {
            let moved = |to: usize| {
                let mut index = [1; 3];
                index[axis] = to;
                lattice.steps(index)
            };
            (lattice.axes * (moved(2) - moved(0))).length()
        };
        let distances = is_even.then(|| [0, 1, 2].map(distance));
        Self { lattice, value, strides: strides(lattice), distances }
    }

    /// Returns the value at a sample.
    fn at(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [nx, ny, _] = self.lattice.dims;
        (self.value)(i + nx * (j + ny * k))
    }

    fn sample(&self, index: [usize; 3]) -> Sample {
        let is_inner =
            (0..3).all(|axis| index[axis] > 0 && index[axis] + 1 < self.lattice.dims[axis]);
        match self.distances.filter(|_| is_inner) {
            Some(distances) => self.inner_sample(index, distances),
            None => self.any_sample(index),
        }
    }

    /// As [`any_sample`](Self::any_sample), for a sample of a Cartesian lattice that has all
    /// neighbours. The result has the same bits, because the terms are added in the same order.
    fn inner_sample(&self, [i, j, k]: [usize; 3], distances: [f64; 3]) -> Sample {
        let [nx, ny, _] = self.lattice.dims;
        let (row, slice) = (nx, nx * ny);
        let here = i + nx * (j + ny * k);
        let mut squared = 0.0;
        for (step, distance) in [1, row, slice].into_iter().zip(distances) {
            let difference = (self.value)(here + step) - (self.value)(here - step);
            squared += (difference / distance).powi(2);
        }
        let first = here - slice - row - 1;
        let mut sum = 0.0;
        for (c, outer) in [1.0, -2.0, 1.0].into_iter().enumerate() {
            for (b, middle) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                let (at, weight) = (first + c * slice + b * row, outer * middle);
                sum += weight * (self.value)(at);
                sum += -2.0 * weight * (self.value)(at + 1);
                sum += weight * (self.value)(at + 2);
            }
        }
        Sample { value: (self.value)(here), slope: squared.sqrt(), mask: response(sum, 3) }
    }

    /// Computes what is known of any sample of any lattice.
    fn any_sample(&self, index: [usize; 3]) -> Sample {
        let lattice = self.lattice;
        let moved = |axis: usize, by: isize| {
            let place = index[axis].checked_add_signed(by * self.strides[axis] as isize)?;
            let mut index = index;
            index[axis] = place;
            (place < lattice.dims[axis]).then_some(index)
        };
        let mut squared = 0.0;
        for axis in 0..3 {
            let [before, after] = [-1, 1].map(|by| moved(axis, by).unwrap_or(index));
            if before != after {
                let steps = lattice.steps(after) - lattice.steps(before);
                let difference = self.at(after) - self.at(before);
                squared += (difference / (lattice.axes * steps).length()).powi(2);
            }
        }
        let mask = mask(lattice, index, self.strides, |index| self.at(index));
        Sample { value: self.at(index), slope: squared.sqrt(), mask: mask.unwrap_or(f64::NAN) }
    }
}

/// Returns the standard deviations of white noise that a sum over the mask of some axes stands for.
fn response(sum: f64, axes: i32) -> f64 {
    // The squares of 1, −2 and 1 add up to 6.
    sum.abs() / 6f64.powi(axes).sqrt()
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
    Some(response(sum, is_long.iter().filter(|is_long| **is_long).count() as i32))
}

/// Returns the standard deviation of the noise, of values whose least and largest one are given. It
/// is taken from a low percentile of the mask, because structure raises the high ones. Values that
/// are saturated or padding have no noise.
fn noise(samples: &[Sample], [low, high]: [f64; 2], is_integer: bool) -> f64 {
    let is_saturated =
        |sample: &Sample| (sample.value == low || sample.value == high) && sample.mask == 0.0;
    let unsaturated = samples.iter().filter(|sample| !is_saturated(sample));
    let responses = unsaturated.map(|sample| sample.mask).filter(|mask| !mask.is_nan());
    let mut responses: Vec<f64> = responses.collect();
    // The deviation of numbers that were rounded to integers.
    let rounding = if is_integer { 12f64.sqrt().recip() } else { 0.0 };
    // Where most of a volume is saturated, the rest is structure.
    if responses.len() < (samples.len() / 20).max(16) {
        return rounding;
    }
    let quarter = responses.len() / 4;
    (*responses.select_nth_unstable_by(quarter, f64::total_cmp).1 / QUARTER).max(rounding)
}

/// Values in ascending order, each once.
struct Order {
    values: Vec<f64>,
    /// For each value, the number of samples that have it or a smaller one.
    sums: Vec<usize>,
    /// Whether all values are whole.
    is_whole: bool,
}

impl Order {
    fn of(samples: &[Sample], scalar: Scalar) -> Self {
        /// The smallest value of 8 or 16 bits, which is counted first.
        const LOWEST: i64 = i16::MIN as i64;
        let mut order = Self { values: Vec::new(), sums: Vec::new(), is_whole: true };
        if matches!(scalar, Scalar::U8 | Scalar::U16 | Scalar::I16) {
            let mut counts = vec![0; (i64::from(u16::MAX) - LOWEST) as usize + 1];
            samples.iter().for_each(|sample| counts[(sample.value as i64 - LOWEST) as usize] += 1);
            for (number, count) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
                order.push((number as i64 + LOWEST) as f64, count);
            }
            return order;
        }
        let mut values: Vec<f64> = samples.iter().map(|sample| sample.value).collect();
        values.par_sort_unstable_by(f64::total_cmp);
        values.chunk_by(|a, b| a == b).for_each(|equal| order.push(equal[0], equal.len()));
        order.is_whole =
            scalar != Scalar::F32 || order.values.iter().all(|value| value.fract() == 0.0);
        order
    }

    /// Adds the next value, which so many samples have.
    fn push(&mut self, value: f64, count: usize) {
        self.values.push(value);
        self.sums.push(count + self.sums.last().copied().unwrap_or(0));
    }

    /// Returns the smallest and the largest value, or 0 if there is none.
    fn ends(&self) -> [f64; 2] {
        [self.values.first(), self.values.last()].map(|end| end.copied().unwrap_or(0.0))
    }

    /// Returns the value of the sample at a share of the way from the smallest to the largest.
    fn at(&self, share: f64) -> Option<f64> {
        let last = self.sums.last()?.saturating_sub(1) as f64;
        let number = (share * last).round() as usize;
        self.values.get(self.sums.partition_point(|sum| *sum <= number)).copied()
    }
}

/// Returns the range without outliers. A range that outliers do not make twice as wide stays.
fn without_outliers(order: &Order, range: [f64; 2]) -> [f64; 2] {
    let inner = [OUTLIERS, 1.0 - OUTLIERS].map(|share| order.at(share).unwrap_or(range[0]));
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

/// Returns the values, which are whole, if they look like labels: few, constant over regions, and
/// with neighbours of any difference. `neighbours` returns pairs of values next to each other.
fn labels(order: &Order, neighbours: impl FnOnce() -> Vec<[f64; 2]>) -> Vec<f64> {
    let distinct = &order.values;
    let (mut equal, mut near, mut far) = (0u64, 0u64, 0u64);
    if distinct.len() > LABELS || distinct.len() < 2 {
        return Vec::new();
    }
    let rank = |value: f64| distinct.partition_point(|label| *label < value);
    for [value, next] in neighbours() {
        match rank(value).abs_diff(rank(next)) {
            0 => equal += 1,
            1 => near += 1,
            _ => far += 1,
        }
    }
    let (all, unequal) = ((equal + near + far) as f64, (near + far) as f64);
    let is_even = equal as f64 > 0.75 * all;
    let is_abrupt = far as f64 > 0.3 * unequal;
    let are_few = distinct.len() <= 4 && equal as f64 > 0.9 * all;
    if distinct.len() == 2 || is_even && (is_abrupt || are_few) {
        distinct.clone()
    } else {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// Values that look random, in −0.5 … 0.5.
    fn noise_at(at: usize) -> f64 {
        (at as f64 * 0.754_877_666).fract() - 0.5
    }

    #[test]
    fn inner_samples_have_the_bits_of_any_sample() {
        let axes = DMat3::from_cols_array(&[0.7, 0.1, 0.0, -0.2, 1.3, 0.3, 0.0, 0.4, 2.1]);
        let lattice = Lattice::cartesian([5, 6, 4], DVec3::new(0.3, -7.0, 1.1), axes);
        let stencil = Stencil::new(&lattice, &noise_at);
        let distances = stencil.distances.expect("three samples along each axis");
        for index in (0..3 * 4 * 2).map(|at| [1 + at % 3, 1 + at / 3 % 4, 1 + at / 12]) {
            let bits = |sample: Sample| [sample.value, sample.slope, sample.mask].map(f64::to_bits);
            let inner = stencil.inner_sample(index, distances);
            assert_eq!(bits(inner), bits(stencil.any_sample(index)), "{index:?}");
            assert!(inner.mask > 0.0 && inner.slope > 0.0);
        }
        // A flat lattice has no inner samples.
        let flat = Lattice::cartesian([5, 6, 2], DVec3::ZERO, axes);
        assert_eq!(Stencil::new(&flat, &noise_at).distances, None);
    }

    #[test]
    fn counted_values_are_in_the_order_of_sorted_ones() {
        let sample = |at: usize| Sample {
            value: (noise_at(at) * 900.0).round(),
            slope: 0.0,
            mask: f64::NAN,
        };
        let samples: Vec<Sample> = (0..3000).map(sample).collect();
        let [counted, sorted] =
            [Scalar::I16, Scalar::F32].map(|scalar| Order::of(&samples, scalar));
        assert_eq!(counted.values, sorted.values);
        assert_eq!(counted.sums, sorted.sums);
        assert!(counted.is_whole && sorted.is_whole);
        let mut values: Vec<f64> = samples.iter().map(|sample| sample.value).collect();
        values.sort_by(f64::total_cmp);
        for share in [0.0, 0.0005, 0.25, 0.9995, 1.0] {
            assert_eq!(counted.at(share), Some(values[(share * 2999.0).round() as usize]));
        }
        assert_eq!(Order::of(&[], Scalar::U8).at(0.5), None);
        assert_eq!(Order::of(&[], Scalar::F32).ends(), [0.0; 2]);
    }
}

//! The values of a volume, in the sample type of their file.

use super::{
    Lattice, SampleSlice, Scalar, SharedSamples, overshoot::Overshoot, reach::neighbourhood_ranges,
};
use crate::{
    Error, Result,
    about::About,
    math::{Bounds, Kernel, Tensor},
    parallel::{self, prelude::*},
};
use std::{borrow::Cow, sync::Arc};

/// Samples in the type of their file, first axis fastest.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Samples {
    /// 8 bits, unsigned.
    U8(Vec<u8>),
    /// 16 bits, unsigned.
    U16(Vec<u16>),
    /// 16 bits, signed.
    I16(Vec<i16>),
    /// 32 bits, signed.
    I32(Vec<i32>),
    /// 32 bits, floating point.
    F32(Vec<f32>),
    /// Samples of any of these types in memory that something else owns.
    Shared(SharedSamples),
}

/// Samples as a list of their type, which can be changed.
pub(crate) enum SampleVecs<'a> {
    U8(&'a mut Vec<u8>),
    U16(&'a mut Vec<u16>),
    I16(&'a mut Vec<i16>),
    I32(&'a mut Vec<i32>),
    F32(&'a mut Vec<f32>),
}

/// Evaluates one expression on the slice of samples, whatever its type. With `mut`, on the list.
macro_rules! each_type {
    (mut $samples:expr, $values:ident => $body:expr) => {
        match $samples.vecs_mut() {
            $crate::volume::SampleVecs::U8($values) => $body,
            $crate::volume::SampleVecs::U16($values) => $body,
            $crate::volume::SampleVecs::I16($values) => $body,
            $crate::volume::SampleVecs::I32($values) => $body,
            $crate::volume::SampleVecs::F32($values) => $body,
        }
    };
    ($samples:expr, $values:ident => $body:expr) => {
        match $samples.as_slice() {
            $crate::volume::SampleSlice::U8($values) => $body,
            $crate::volume::SampleSlice::U16($values) => $body,
            $crate::volume::SampleSlice::I16($values) => $body,
            $crate::volume::SampleSlice::I32($values) => $body,
            $crate::volume::SampleSlice::F32($values) => $body,
        }
    };
}
pub(crate) use each_type;

/// Samples per task of a parallel pass: about 10 µs of work.
const CHUNK: usize = 1 << 16;

impl Samples {
    /// Returns the samples as a slice of their type.
    pub fn as_slice(&self) -> SampleSlice<'_> {
        match self {
            Self::U8(values) => SampleSlice::U8(values),
            Self::U16(values) => SampleSlice::U16(values),
            Self::I16(values) => SampleSlice::I16(values),
            Self::I32(values) => SampleSlice::I32(values),
            Self::F32(values) => SampleSlice::F32(values),
            Self::Shared(shared) => shared.as_slice(),
        }
    }

    /// Returns the samples as a list that can be changed. Shared samples are copied first.
    pub(crate) fn vecs_mut(&mut self) -> SampleVecs<'_> {
        if let Self::Shared(shared) = self {
            *self = Self::from_bytes(shared.scalar(), shared.bytes());
        }
        match self {
            Self::U8(values) => SampleVecs::U8(values),
            Self::U16(values) => SampleVecs::U16(values),
            Self::I16(values) => SampleVecs::I16(values),
            Self::I32(values) => SampleVecs::I32(values),
            Self::F32(values) => SampleVecs::F32(values),
            Self::Shared(_) => unreachable!("shared samples were copied"),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        each_type!(self, values => values.len())
    }

    /// Returns whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the value of a sample, exact for every type.
    ///
    /// # Panics
    /// If `index` is not below [`len`](Self::len).
    pub fn value(&self, index: usize) -> f64 {
        each_type!(self, values => f64::from(values[index]))
    }

    /// Returns the type of the samples.
    pub fn scalar(&self) -> Scalar {
        match self {
            Self::U8(_) => Scalar::U8,
            Self::U16(_) => Scalar::U16,
            Self::I16(_) => Scalar::I16,
            Self::I32(_) => Scalar::I32,
            Self::F32(_) => Scalar::F32,
            Self::Shared(shared) => shared.scalar(),
        }
    }

    /// Returns the name of the type, as the command spells it.
    pub fn type_name(&self) -> &'static str {
        self.scalar().name()
    }

    /// Bytes per sample.
    pub fn sample_bytes(&self) -> usize {
        self.scalar().bytes()
    }

    /// Builds samples from bytes in native byte order. An incomplete sample at the end is dropped.
    pub(crate) fn from_bytes(scalar: Scalar, bytes: &[u8]) -> Self {
        let bytes = &bytes[..bytes.len() / scalar.bytes() * scalar.bytes()];
        match scalar {
            Scalar::U8 => Self::U8(bytes.to_vec()),
            Scalar::U16 => Self::U16(bytemuck::pod_collect_to_vec(bytes)),
            Scalar::I16 => Self::I16(bytemuck::pod_collect_to_vec(bytes)),
            Scalar::I32 => Self::I32(bytemuck::pod_collect_to_vec(bytes)),
            Scalar::F32 => Self::F32(bytemuck::pod_collect_to_vec(bytes)),
        }
    }

    /// The bytes of the samples, in native byte order.
    pub fn bytes(&self) -> &[u8] {
        each_type!(self, values => bytemuck::cast_slice(values))
    }

    /// Returns the smallest and largest value. The error says why there is none: no samples, or
    /// samples that are not finite.
    pub(crate) fn range(&self) -> Result<[f64; 2], String> {
        fn extremes<T: Copy + PartialOrd + Send + Sync + Into<f64>>(
            values: &[T],
            first: T,
        ) -> [f64; 2] {
            // Many extremes side by side, which vector instructions find at once.
            const LANES: usize = 32;
            let smaller = |a: T, b: T| if b < a { b } else { a };
            let larger = |a: T, b: T| if b > a { b } else { a };
            let of_chunk = |chunk: &[T]| {
                let (mut low, mut high) = ([first; LANES], [first; LANES]);
                let (whole, rest) = chunk.as_chunks::<LANES>();
                for values in whole {
                    low.iter_mut().zip(values).for_each(|(low, v)| *low = smaller(*low, *v));
                    high.iter_mut().zip(values).for_each(|(high, v)| *high = larger(*high, *v));
                }
                let low = low.into_iter().chain(rest.iter().copied()).fold(first, smaller);
                let high = high.into_iter().chain(rest.iter().copied()).fold(first, larger);
                [low, high]
            };
            let join = |a: [T; 2], b: [T; 2]| [smaller(a[0], b[0]), larger(a[1], b[1])];
            let ends = values.par_chunks(CHUNK).map(of_chunk).reduce(|| [first, first], join);
            ends.map(Into::into)
        }
        if let SampleSlice::F32(values) = self.as_slice() {
            let bad = |v: &f32| !v.is_finite();
            let count: usize =
                values.par_chunks(CHUNK).map(|chunk| chunk.iter().filter(|v| bad(v)).count()).sum();
            if let Some(first) = values.iter().position(bad).filter(|_| count > 0) {
                return Err(format!(
                    "{count} of {} samples are not finite, the first is sample {first} ({})",
                    values.len(),
                    values[first]
                ));
            }
        }
        each_type!(self, values => match values.first() {
            Some(&first) => Ok(extremes(values, first)),
            None => Err("there are no samples".into()),
        })
    }
}

/// Samples are equal if their types and values are, whoever owns them.
impl PartialEq for Samples {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

/// A volume: a lattice and one scalar per sample. Values are finite; `range` holds the smallest and
/// the largest.
///
/// A volume of 2 × 3 × 4 bytes, whose slices are 2.5 units apart:
///
/// ```
/// use glam::DVec3;
/// use splatkit::volume::{Lattice, Samples, Volume};
///
/// let lattice = Lattice::with_spacing([2, 3, 4], DVec3::new(1.0, 1.0, 2.5));
/// let volume = Volume::new(lattice, Samples::U8((0..24).collect()))?;
/// assert_eq!(volume.range, [0.0, 23.0]);
/// // The first axis is the fastest in memory.
/// assert_eq!(volume.value(1 + 2 * 2 + 3 * 6), 23.0);
/// assert_eq!(volume.bounds().max, DVec3::new(1.0, 2.0, 7.5));
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Volume {
    /// The places of the samples.
    pub lattice: Lattice,
    /// The samples, in the lattice's memory order.
    pub samples: Samples,
    /// The smallest and the largest sample.
    pub range: [f64; 2],
    /// If set, kernels carry these values instead of the samples, so that their sum passes through
    /// the samples ([`Volume::sharpened`]).
    pub coefficients: Option<Arc<Coefficients>>,
    /// The colour of each sample, if the file has colours: display colours and opacity, 8 bits a
    /// channel. The samples are then their brightness ([`Volume::colored_splats`]).
    pub colors: Option<Arc<[[u8; 4]]>>,
    /// The further channels that were read ([`ReadOptions::channels`]), on the same lattice.
    ///
    /// [`ReadOptions::channels`]: crate::formats::ReadOptions::channels
    pub more_channels: Vec<Self>,
    /// The values of another array on the same lattice that say how opaque the samples are.
    pub opacities: Option<Arc<Self>>,
    /// What the file says beyond the values.
    pub about: About,
}

/// Values for kernels on a lattice, chosen so that their normalised sum passes through a volume's
/// samples.
#[derive(Debug, Clone)]
pub struct Coefficients {
    /// The volume's lattice, extended on all sides as far as the kernel reaches. For a tensor
    /// product, the volume's own lattice.
    pub lattice: Lattice,
    /// One value per sample of that lattice, of either sign. Values may lie outside the range of
    /// the samples.
    pub values: Vec<f32>,
    /// For each value, bounds on the normalised sum within reach of its kernel: smallest and
    /// largest. The unit is 1/255 of the volume's range (as in [`neighbourhood_ranges`]), and the
    /// bounds are clamped to that range.
    pub ranges: Vec<[u8; 2]>,
    /// The kernel that these values were computed for.
    pub kernel: Kernel,
}

impl Volume {
    /// Most bins of a [`histogram`](Self::histogram). There is a limit because every thread counts
    /// in bins of its own.
    pub const MAX_BINS: usize = 1 << 20;

    /// Puts samples on a lattice and measures their range (in parallel).
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for an invalid lattice ([`Lattice::validate`]),
    /// a number of samples that does not match the lattice, and NaN or infinite samples (the
    /// message gives their number and the first).
    pub fn new(lattice: Lattice, samples: Samples) -> crate::Result<Self> {
        Self::checked(lattice, samples).map_err(crate::Error::Argument)
    }

    /// Like [`new`](Self::new). The error is a message, to which the caller adds the place.
    pub(crate) fn checked(lattice: Lattice, samples: Samples) -> Result<Self, String> {
        lattice.check()?;
        if samples.len() != lattice.len() {
            let [nx, ny, nz] = lattice.dims;
            return Err(format!(
                "{} samples do not fill a volume of {nx} × {ny} × {nz}",
                samples.len()
            ));
        }
        let range = samples.range()?;
        Ok(Self {
            lattice,
            samples,
            range,
            coefficients: None,
            colors: None,
            more_channels: Vec::new(),
            opacities: None,
            about: About::default(),
        })
    }

    /// Checks what [`new`](Self::new) checks, and what may have changed since then. Call it first
    /// in every function that takes a volume, because the volume may have been built by hand. The
    /// error is a message.
    pub(crate) fn validate(&self) -> Result<(), String> {
        self.lattice.check()?;
        if self.samples.len() != self.lattice.len() {
            return Err(format!(
                "{} samples do not fill a lattice of {}",
                self.samples.len(),
                self.lattice.len()
            ));
        }
        let [low, high] = self.samples.range()?;
        let [stated_low, stated_high] = self.range;
        if !(stated_low <= low && high <= stated_high && (stated_high - stated_low).is_finite()) {
            return Err(format!(
                "the range is {stated_low} … {stated_high}, but values are in {low} … {high}"
            ));
        }
        self.coefficients
            .as_ref()
            .map_or(Ok(()), |coefficients| coefficients.validate(&self.lattice))
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Returns whether the volume has no samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Returns the value of the sample at an index in memory order (first axis fastest).
    ///
    /// # Panics
    /// If `index` is not below [`len`](Self::len).
    pub fn value(&self, index: usize) -> f64 {
        self.samples.value(index)
    }

    /// The lattice on which kernels are drawn: that of the coefficients if there are any, else the
    /// volume's.
    pub fn drawn_lattice(&self) -> &Lattice {
        self.coefficients.as_ref().map_or(&self.lattice, |coefficients| &coefficients.lattice)
    }

    /// Returns the value that the kernel at a sample of [`drawn_lattice`](Self::drawn_lattice)
    /// carries.
    ///
    /// # Panics
    /// If `index` is not below that lattice's number of samples.
    pub fn drawn_value(&self, index: usize) -> f64 {
        self.coefficients
            .as_ref()
            .map_or_else(|| self.value(index), |drawn| f64::from(drawn.values[index]))
    }

    /// Returns the range of the values around each sample of
    /// [`drawn_lattice`](Self::drawn_lattice), as far as the kernel reaches
    /// ([`neighbourhood_ranges`]).
    ///
    /// # Panics
    /// If the samples do not fill the lattice.
    pub fn drawn_ranges(&self, kernel: &Kernel) -> Cow<'_, [[u8; 2]]> {
        match &self.coefficients {
            Some(coefficients) => Cow::Borrowed(&coefficients.ranges),
            None if kernel.as_tensor().is_some() => {
                let mut ranges = neighbourhood_ranges(self, self.lattice.reach(kernel.extent));
                // Weights of both signs can leave the range of the samples in reach, by a known
                // factor.
                let lebesgue = kernel.as_tensor().map_or(1.0, Tensor::lebesgue);
                if lebesgue > 1.0 {
                    let overshoot = Overshoot { lebesgue, tails: Vec::new() };
                    ranges
                        .par_iter_mut()
                        .for_each(|range| *range = overshoot.widen([*range].into_iter()));
                }
                Cow::Owned(ranges)
            }
            // Signed kernels overshoot, so a sample that is left out can still influence its
            // surroundings: use twice the reach.
            None => {
                let extent = if kernel.is_signed() { 2.0 * kernel.extent } else { kernel.extent };
                Cow::Owned(neighbourhood_ranges(self, self.lattice.reach(extent)))
            }
        }
    }

    /// Returns the smallest and largest world coordinates of the sample positions.
    pub fn bounds(&self) -> Bounds {
        self.lattice.bounds()
    }

    /// Counts the samples in each of `bins` equal parts of the range. A value on a boundary counts
    /// in the bin above it, the largest value in the last bin. A constant volume fills the first
    /// bin.
    ///
    /// # Errors
    /// [`Error::Argument`] for more than [`MAX_BINS`](Self::MAX_BINS) bins.
    pub fn histogram(&self, bins: usize) -> Result<Vec<u64>> {
        Self::check_bins(bins)?;
        Ok(self.counts(bins))
    }

    /// Refuses more bins than a histogram may have.
    pub(crate) fn check_bins(bins: usize) -> Result<()> {
        if bins > Self::MAX_BINS {
            return Err(Error::Argument(format!(
                "a histogram of {bins} bins is too large: the most is {}",
                Self::MAX_BINS
            )));
        }
        Ok(())
    }

    /// The [`histogram`](Self::histogram), for a number of bins that is known to be allowed.
    pub(super) fn counts(&self, bins: usize) -> Vec<u64> {
        if bins == 0 {
            return Vec::new();
        }
        let count = |range: std::ops::Range<usize>| {
            let mut counts = vec![0u64; bins];
            each_type!(self.samples, values => for &v in &values[range] {
                counts[self.bin(f64::from(v), bins)] += 1;
            });
            counts
        };
        let add = |mut a: Vec<u64>, b: Vec<u64>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        let chunk = self.len().div_ceil(4 * parallel::current_num_threads()).max(CHUNK);
        (0..self.len().div_ceil(chunk))
            .into_par_iter()
            .map(|c| count(c * chunk..self.len().min((c + 1) * chunk)))
            .reduce(|| vec![0; bins], add)
    }

    /// Returns the bin of [`histogram`](Self::histogram) that a value falls into.
    pub fn bin(&self, value: f64, bins: usize) -> usize {
        let [low, high] = self.range;
        let scale = if high > low { bins as f64 / (high - low) } else { 0.0 };
        // Casts saturate, so values outside the range land in the outer bins.
        (((value - low) * scale) as usize).min(bins.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn volume(dims: [usize; 3], samples: Samples) -> Result<Volume, String> {
        Volume::checked(Lattice::with_spacing(dims, DVec3::ONE), samples)
    }

    #[test]
    fn range_and_histogram() {
        let v = volume([2, 3, 1], Samples::I16(vec![-4, 0, 4, 4, 1, 2])).unwrap();
        assert_eq!(v.range, [-4.0, 4.0]);
        assert_eq!(v.histogram(4).unwrap(), [1, 0, 2, 3]);
        assert_eq!(v.value(4), 1.0);
        assert_eq!((v.samples.type_name(), v.samples.sample_bytes()), ("i16", 2));
        let large =
            volume([300, 300, 3], Samples::F32((0..270_000).map(|i| i as f32).collect())).unwrap();
        assert_eq!(large.range, [0.0, 269_999.0]);
        assert_eq!(large.histogram(3).unwrap().iter().sum::<u64>(), 270_000);
        assert!(v.histogram(0).unwrap().is_empty());
        assert_eq!(v.histogram(Volume::MAX_BINS).unwrap().iter().sum::<u64>(), 6);
        assert!(matches!(v.histogram(usize::MAX), Err(Error::Argument(_))));
    }

    #[test]
    fn constant_volumes_are_fine() {
        let v = volume([1, 1, 2], Samples::U8(vec![7, 7])).unwrap();
        assert_eq!((v.range, v.histogram(3).unwrap()), ([7.0, 7.0], vec![2, 0, 0]));
    }

    #[test]
    fn bad_samples_are_told() {
        assert!(volume([2, 2, 2], Samples::U8(vec![0; 7])).unwrap_err().contains("7 samples"));
        let message = volume([2, 2, 1], Samples::F32(vec![0.0, f32::NAN, 1.0, f32::NEG_INFINITY]))
            .unwrap_err();
        assert_eq!(message, "2 of 4 samples are not finite, the first is sample 1 (NaN)");
    }
}

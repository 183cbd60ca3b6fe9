//! Transfer functions that need no file: presets by name, and one derived from a volume's
//! histogram.

use super::{Shade, TransferFunction, Volume, each_type};
use crate::{Error, Result};

/// The points of a preset: value, red, green, blue, opacity.
type Points = &'static [[f64; 5]];

/// Values in Hounsfield units, opacity per millimetre.
const CT_BONE: Points = &[
    [150.0, 0.55, 0.25, 0.15, 0.0],
    [250.0, 0.80, 0.55, 0.38, 0.06],
    [500.0, 0.93, 0.84, 0.68, 0.35],
    [1200.0, 1.0, 0.98, 0.93, 0.8],
];
const CT_SOFT_TISSUE: Points = &[
    [-250.0, 0.55, 0.35, 0.25, 0.0],
    [-90.0, 0.85, 0.65, 0.45, 0.02],
    [20.0, 0.78, 0.38, 0.30, 0.10],
    [120.0, 0.85, 0.45, 0.36, 0.25],
    [300.0, 0.95, 0.88, 0.75, 0.5],
    [1200.0, 1.0, 1.0, 0.96, 0.8],
];
const CT_LUNG: Points = &[
    [-950.0, 0.15, 0.25, 0.45, 0.0],
    [-850.0, 0.25, 0.45, 0.70, 0.01],
    [-600.0, 0.55, 0.70, 0.85, 0.05],
    [-450.0, 0.85, 0.70, 0.65, 0.02],
    [-300.0, 0.85, 0.60, 0.55, 0.0],
];
const CT_ANGIOGRAPHY: Points = &[
    [120.0, 0.45, 0.05, 0.05, 0.0],
    [200.0, 0.75, 0.12, 0.08, 0.15],
    [400.0, 0.95, 0.40, 0.20, 0.55],
    [600.0, 0.98, 0.85, 0.70, 0.4],
    [1200.0, 1.0, 0.98, 0.93, 0.7],
];
/// Values as fractions of the range.
const MRI: Points = &[
    [0.08, 0.20, 0.18, 0.22, 0.0],
    [0.25, 0.55, 0.42, 0.38, 0.04],
    [0.50, 0.80, 0.68, 0.58, 0.2],
    [1.00, 1.00, 0.97, 0.92, 0.6],
];
const GENERIC: Points = &[
    [0.10, 0.20, 0.05, 0.10, 0.0],
    [0.30, 0.70, 0.28, 0.15, 0.05],
    [0.60, 0.92, 0.68, 0.35, 0.25],
    [1.00, 1.00, 0.98, 0.92, 0.7],
];

/// Bins of the histogram that [`TransferFunction::automatic`] analyses.
pub const BINS: usize = 256;

impl TransferFunction {
    /// The names that [`named`](Self::named) accepts.
    pub const NAMES: [&'static str; 6] =
        ["ct-bone", "ct-soft-tissue", "ct-lung", "ct-angiography", "mri", "generic"];

    /// Returns a preset. The CT presets expect Hounsfield units and millimetres. "mri" and
    /// "generic" spread over `range`, and their opacity is per world unit. For these two, set
    /// `unit` if the world units are neither millimetres nor voxels.
    ///
    /// # Errors
    /// [`Error::Argument`] if `name` is not one of [`NAMES`](Self::NAMES), or if `range` is not
    /// finite or descends.
    pub fn named(name: &str, range: [f64; 2]) -> Result<Self> {
        let [low, high] = range;
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(Error::Argument(format!(
                "{low} to {high} is not a range of values: both ends must be finite and ascend"
            )));
        }
        let (points, low, width) = match name {
            "ct-bone" => (CT_BONE, 0.0, 1.0),
            "ct-soft-tissue" => (CT_SOFT_TISSUE, 0.0, 1.0),
            "ct-lung" => (CT_LUNG, 0.0, 1.0),
            "ct-angiography" => (CT_ANGIOGRAPHY, 0.0, 1.0),
            "mri" => (MRI, low, high - low),
            "generic" => (GENERIC, low, high - low),
            _ => {
                let names = Self::NAMES.join(", ");
                return Err(Error::Argument(format!(
                    "there is no transfer function “{name}”; there are {names}"
                )));
            }
        };
        Ok(Self {
            color: points.iter().map(|&[v, r, g, b, _]| (low + v * width, [r, g, b])).collect(),
            opacity: points.iter().map(|&[v, .., opacity]| (low + v * width, opacity)).collect(),
            unit: 1.0,
            shade: Some(Shade::default()),
            ..Self::default()
        })
    }

    /// Derives a transfer function for any volume from its histogram. Otsu's threshold (1979, "A
    /// threshold selection method from gray-level histograms") splits the values in two. The
    /// background is the high side if at least nine tenths of the volume's border lie there, and
    /// the low side otherwise. Opacity begins three standard deviations from the background's mode
    /// and rises over the threshold and the quantiles above it. The opacities hold for a hundredth
    /// of the volume's diagonal. Thin structures therefore show and thick ones do not turn into
    /// fog, whatever the sampling.
    ///
    /// A constant volume is shown as a faint haze. So is a volume that was built by hand and is
    /// inconsistent: whatever draws that volume returns the error.
    pub fn automatic(volume: &Volume) -> Self {
        if volume.validate().is_err() {
            return Self::of_histogram(Vec::new(), [0.0; 2], 1.0, false);
        }
        let [first, last] = volume.bounds();
        let diagonal = (last - first).length();
        let unit =
            if diagonal > 0.0 { diagonal / 100.0 } else { volume.lattice.spacing().max_element() };
        let counts = volume.counts(BINS);
        let bright = bright_border(volume, otsu(&counts));
        Self::of_histogram(counts, volume.range, unit, bright)
    }

    /// Builds the function from a histogram: counts of values in equal parts of their range. The
    /// background's values are the low ones, or the high ones if `bright`.
    pub(crate) fn of_histogram(
        mut counts: Vec<u64>,
        range: [f64; 2],
        unit: f64,
        bright: bool,
    ) -> Self {
        let shade = Some(Shade::default());
        let [low, high] = range;
        if low >= high {
            return Self {
                color: vec![(low, [0.9, 0.8, 0.7])],
                opacity: vec![(low, 0.05)],
                unit,
                shade,
                ..Self::default()
            };
        }
        // A bright background is a dark one seen from the other end of the range.
        if bright {
            counts.reverse();
        }
        let mut points: Vec<(f64, f64)> = ramp(&counts)
            .into_iter()
            .map(|(bin, opacity)| {
                let share = bin / BINS as f64;
                (low + (high - low) * if bright { 1.0 - share } else { share }, opacity)
            })
            .collect();
        let colors =
            [[0.25, 0.06, 0.05], [0.70, 0.28, 0.15], [0.92, 0.66, 0.36], [1.0, 0.98, 0.92]];
        let mut color: Vec<_> = points.iter().zip(colors).map(|(p, rgb)| (p.0, rgb)).collect();
        if bright {
            points.reverse();
            color.reverse();
        }
        Self { color, opacity: points, unit, shade, ..Self::default() }
    }
}

/// Returns the bin above which Otsu's method separates best: the one with the largest variance
/// between the two classes.
fn otsu(counts: &[u64]) -> usize {
    let total: f64 = counts.iter().map(|&n| n as f64).sum();
    let sum: f64 = counts.iter().enumerate().map(|(i, &n)| i as f64 * n as f64).sum();
    let (mut below, mut sum_below, mut best, mut best_at) = (0.0, 0.0, -1.0, 0);
    for (i, &n) in counts.iter().enumerate() {
        below += n as f64;
        sum_below += i as f64 * n as f64;
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let between = below * above * (sum_below / below - (sum - sum_below) / above).powi(2);
            if between > best {
                (best, best_at) = (between, i);
            }
        }
    }
    best_at
}

/// Returns whether at least nine tenths of the samples on the volume's faces lie above a bin.
fn bright_border(volume: &Volume, threshold: usize) -> bool {
    let [nx, ny, nz] = volume.lattice.dims;
    let (mut above, mut total) = (0u64, 0u64);
    let mut count = |index: usize| {
        let value = each_type!(&volume.samples, values => f64::from(values[index]));
        above += u64::from(volume.bin(value, BINS) > threshold);
        total += 1;
    };
    for k in 0..nz {
        for j in 0..ny {
            let row = (k * ny + j) * nx;
            if k == 0 || k == nz - 1 || j == 0 || j == ny - 1 {
                (row..row + nx).for_each(&mut count);
            } else {
                [row, row + nx - 1].into_iter().for_each(&mut count);
            }
        }
    }
    above * 10 >= total * 9
}

/// Returns four points (bin, opacity), ascending, for a background in the low bins.
fn ramp(counts: &[u64]) -> [(f64, f64); 4] {
    let threshold = otsu(counts);
    let (background, rest) = counts.split_at(threshold + 1);
    let total = background.iter().sum::<u64>() as f64;
    let mean =
        background.iter().enumerate().map(|(i, &n)| i as f64 * n as f64).sum::<f64>() / total;
    let variance = background
        .iter()
        .enumerate()
        .map(|(i, &n)| (i as f64 - mean).powi(2) * n as f64)
        .sum::<f64>()
        / total;
    let mode = background.iter().enumerate().max_by_key(|&(_, &n)| n).map_or(0, |(i, _)| i);
    // At least one bin above the mode, so that the background itself is clear, and at most the
    // threshold's upper edge.
    let start = (mode as f64 + 1.0 + 3.0 * variance.sqrt()).min(threshold as f64 + 1.0);
    let quantile = |share: f64| {
        let wanted = share * rest.iter().sum::<u64>() as f64;
        let mut seen = 0.0;
        let at = rest.iter().position(|&n| {
            seen += n as f64;
            seen >= wanted
        });
        (threshold + 1 + at.unwrap_or(0)) as f64 + 0.5
    };
    let (half, top) = (quantile(0.5), quantile(0.99));
    [(start, 0.0), (threshold as f64 + 1.0, 0.08), (half, 0.4), (top, 0.85)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};
    use glam::DVec3;

    /// A ball of one value inside another value, with deterministic noise.
    fn ball(inside: u8, outside: u8) -> Volume {
        let n = 24usize;
        let value = |i: usize| {
            let p = DVec3::new((i % n) as f64, (i / n % n) as f64, (i / n / n) as f64)
                - DVec3::splat(11.5);
            let noise = (i.wrapping_mul(2_654_435_761) >> 13) % 7;
            (if p.length() < 8.0 { inside } else { outside }) + noise as u8
        };
        let lattice = Lattice::with_spacing([n; 3], DVec3::splat(0.5));
        Volume::new(lattice, Samples::U8((0..n * n * n).map(value).collect())).unwrap()
    }

    #[test]
    fn every_preset_is_valid() {
        for name in TransferFunction::NAMES {
            for range in [[-1024.0, 3071.0], [5.0, 5.0]] {
                let t = TransferFunction::named(name, range).unwrap();
                t.validate().unwrap();
            }
        }
        assert!(
            TransferFunction::named("bone", [0.0, 1.0])
                .unwrap_err()
                .to_string()
                .contains("ct-bone")
        );
        assert!(TransferFunction::named("mri", [f64::NAN, 1.0]).is_err());
        let t = TransferFunction::named("generic", [100.0, 200.0]).unwrap();
        assert_eq!((t.opacity(110.0), t.opacity(200.0)), (0.0, 0.7));
    }

    #[test]
    fn the_background_is_found_on_either_side() {
        for (inside, outside) in [(200, 20), (20, 200), (120, 100)] {
            let t = TransferFunction::automatic(&ball(inside, outside));
            t.validate().unwrap();
            let of = |base: u8| (0..7).map(|n| t.opacity(f64::from(base + n))).fold(0.0, f64::max);
            assert_eq!(of(outside), 0.0, "{inside} in {outside}: {t:?}");
            assert!(of(inside) > 0.1, "{inside} in {outside}: {t:?}");
        }
    }

    #[test]
    fn opacity_follows_the_world_size() {
        let mut volume = ball(200, 20);
        let before = TransferFunction::automatic(&volume);
        volume.lattice.axes *= 1000.0;
        let after = TransferFunction::automatic(&volume);
        assert!((after.unit / before.unit - 1000.0).abs() < 1e-6);
        assert_eq!(after.opacity, before.opacity);
    }

    #[test]
    fn constants_and_single_samples_have_one_too() {
        for dims in [[3, 3, 3], [1, 1, 1]] {
            let lattice = Lattice::with_spacing(dims, DVec3::ONE);
            let count = lattice.len();
            let t = TransferFunction::automatic(
                &Volume::new(lattice, Samples::I16(vec![-5; count])).unwrap(),
            );
            t.validate().unwrap();
            assert!(t.visible([-5.0, -5.0]));
        }
        let lattice = Lattice::with_spacing([2, 1, 1], DVec3::ONE);
        TransferFunction::automatic(&Volume::new(lattice, Samples::U8(vec![0, 1])).unwrap())
            .validate()
            .unwrap();
    }
}

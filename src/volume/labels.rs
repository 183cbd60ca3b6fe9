//! Label maps: volumes whose values name things. A place has the label of the nearest sample, so
//! nothing is mixed, and no label lies between two others. Light follows the shares of labels
//! around samples ([`label_shares`]), which change smoothly where the labels change in steps.

use super::{Arrangement, Isosurface, Samples, Shade, TransferFunction, Volume, each_type};
use crate::{
    about::{Label, Labels},
    parallel::prelude::*,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
};

/// Most labels, from the smallest to the largest value. The table of colours has an entry for each
/// value between.
const MOST_SPAN: i64 = 1 << 16;
/// Most distinct values of a volume that is taken for a label map although its file does not say
/// so, and most of one whose regions are small.
const MOST_GUESSED: usize = 4096;
const FEW: usize = 64;
/// Number of pairs of neighbours that are looked at, and of the passes in which they are read.
const PAIRS: usize = 1 << 19;
const PASSES: usize = 16;
/// The optical depth of a label over the least distance of samples.
const SOLID: f64 = 12.0;
/// The distance over which a translucent label has its opacity, in least distances of samples.
const TRANSLUCENT: f64 = 4.0;
/// Magnitudes of a mask's gradient from which on it has a direction, and from which on it counts in
/// full, per least distance of samples.
const CERTAIN: [f64; 2] = [0.02, 0.15];

impl Volume {
    /// Returns whether the values are drawn as labels: each place has the value of the nearest
    /// sample.
    pub fn is_label_map(&self) -> bool {
        self.about.labels.is_some()
            && self.lattice.arrangement == Arrangement::Cartesian
            && self.coefficients.is_none()
            && self.range[1] - self.range[0] < MOST_SPAN as f64
    }

    /// Makes a label map of the volume. `table` is what is known about its labels. Values become
    /// the nearest whole numbers. Values too far apart to be looked up are numbered from 1 on; the
    /// names of these labels are their values. 0 is the background, which is not drawn.
    ///
    /// Lattices other than Cartesian ones stay volumes of quantities.
    #[must_use]
    pub fn with_labels(mut self, table: Vec<Label>) -> Self {
        if self.lattice.arrangement != Arrangement::Cartesian || self.is_empty() {
            return self;
        }
        let values: Vec<i32> = distinct(&self.samples).into_iter().collect();
        let span = i64::from(values[values.len() - 1]) - i64::from(values[0]);
        let (present, table) = if span < MOST_SPAN {
            if matches!(self.samples.as_slice(), super::SampleSlice::F32(_)) {
                self.samples = Samples::I32(mapped(&self.samples, |value| value));
            }
            (values, table)
        } else {
            self.renumbered(&values, table)
        };
        self.range = [f64::from(present[0]), f64::from(present[present.len() - 1])];
        let background = present.contains(&0).then_some(0);
        self.about.labels = Some(Labels { present, table, background });
        self
    }

    /// Numbers labels in their order, 0 staying 0. Returns the numbers and what is known of them.
    fn renumbered(&mut self, values: &[i32], table: Vec<Label>) -> (Vec<i32>, Vec<Label>) {
        let others: Vec<i32> = values.iter().copied().filter(|&value| value != 0).collect();
        // With very many labels, some share a number, and so a colour.
        let most = MOST_SPAN as usize - 1;
        let number = |value: i32| match value {
            0 => 0,
            _ => (others.partition_point(|&other| other < value) % most) as i32 + 1,
        };
        self.samples = Samples::I32(mapped(&self.samples, number));
        let mut known: BTreeMap<i32, Label> =
            table.into_iter().map(|label| (label.value, label)).collect();
        let table = others.iter().take(most).map(|&value| {
            let label = known.remove(&value).unwrap_or_default();
            let name = if label.name.is_empty() { value.to_string() } else { label.name };
            Label { value: number(value), name, ..label }
        });
        let table = table.collect();
        let numbers: BTreeSet<i32> = values.iter().map(|&value| number(value)).collect();
        (numbers.into_iter().collect(), table)
    }

    /// Makes a label map of a volume whose values look like labels: three or more whole numbers
    /// that are constant over regions, and whose neighbours differ by any number of steps. A
    /// volume of two values stays a mask, whose border is smooth.
    #[must_use]
    pub fn with_guessed_labels(self) -> Self {
        if self.about.labels.is_some() || !self.looks_like_labels() {
            return self;
        }
        let mut volume = self.with_labels(Vec::new());
        let corner = volume.corner_value();
        if let Some(labels) = &mut volume.about.labels
            && labels.background.is_none()
        {
            labels.background = corner.filter(|value| labels.present.contains(value));
        }
        volume
    }

    /// Gives a label map what a table says about its labels. Another volume becomes a label map if
    /// the table has all of its values, apart from 0.
    #[must_use]
    pub fn with_label_table(mut self, table: &[Label]) -> Self {
        if table.is_empty() {
            return self;
        }
        if let Some(labels) = &mut self.about.labels {
            // The file's own names stay for what the table leaves out.
            let known: BTreeSet<i32> = table.iter().map(|label| label.value).collect();
            labels.table.retain(|label| !known.contains(&label.value));
            labels.table.extend_from_slice(table);
            return self;
        }
        let mut known: BTreeSet<i32> = table.iter().map(|label| label.value).collect();
        known.insert(0);
        let [low, high] = self.range;
        let may_be = [low, high].iter().all(|value| value.fract() == 0.0)
            && known.contains(&(low as i32))
            && known.contains(&(high as i32));
        let is_whole = |samples: &Samples| match samples.as_slice() {
            super::SampleSlice::F32(values) => values.par_iter().all(|value| value.fract() == 0.0),
            _ => true,
        };
        if may_be && is_whole(&self.samples) && distinct(&self.samples).is_subset(&known) {
            return self.with_labels(table.to_vec());
        }
        self
    }

    /// Returns the commonest value at the corners of the lattice.
    fn corner_value(&self) -> Option<i32> {
        let [nx, ny, nz] = self.lattice.dims;
        let mut counts = BTreeMap::<i32, usize>::new();
        for corner in 0..8 {
            let along =
                |bit: usize, count: usize| if corner >> bit & 1 == 1 { count - 1 } else { 0 };
            let at = (along(2, nz) * ny + along(1, ny)) * nx + along(0, nx);
            *counts.entry(self.value(at).round() as i32).or_default() += 1;
        }
        counts.into_iter().max_by_key(|(_, count)| *count).map(|(value, _)| value)
    }

    /// Whether pairs of neighbours along rows look like those of a label map.
    fn looks_like_labels(&self) -> bool {
        let [nx, ny, nz] = self.lattice.dims;
        if self.lattice.arrangement != Arrangement::Cartesian || nx < 2 {
            return false;
        }
        // Whole rows, evenly spread. The first of the passes rules out most scans.
        let rows = ny * nz;
        let step = (rows * (nx - 1)).div_ceil(PAIRS).max(1);
        let mut pairs = Vec::new();
        let add = |passes: Range<usize>, pairs: &mut Vec<[f64; 2]>| {
            for row in passes.flat_map(|pass| (pass * step..rows).step_by(PASSES * step)) {
                let at = |x: usize| self.value(row * nx + x);
                pairs.extend((1..nx).map(|x| [at(x - 1), at(x)]));
            }
        };
        add(0..1, &mut pairs);
        let values = values_of(&pairs);
        if values.len() > FEW && !are_labels(&values, &pairs) {
            return false;
        }
        add(1..PASSES, &mut pairs);
        are_labels(&values_of(&pairs), &pairs)
    }
}

/// Returns the values of pairs, in ascending order and without repetition.
fn values_of(pairs: &[[f64; 2]]) -> Vec<f64> {
    let mut values = pairs.as_flattened().to_vec();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    values
}

/// Whether values, in ascending order and without repetition, look like labels by pairs of
/// neighbours.
fn are_labels(values: &[f64], pairs: &[[f64; 2]]) -> bool {
    let are_whole = values.iter().all(|value| value.fract() == 0.0);
    if !are_whole || !(3..=MOST_GUESSED).contains(&values.len()) {
        return false;
    }
    let rank = |value: f64| values.partition_point(|other| *other < value);
    let mut counts = vec![0u64; values.len()];
    let ranks: Vec<[usize; 2]> = pairs.iter().map(|pair| pair.map(rank)).collect();
    ranks.iter().for_each(|pair| counts[pair[0]] += 1);
    let common = (0..counts.len()).max_by_key(|&rank| counts[rank]).unwrap_or(0);
    let (mut equal, mut near, mut far) = (0u64, 0u64, 0u64);
    let (mut inside, mut equal_inside) = (0u64, 0u64);
    for &[a, b] in &ranks {
        match a.abs_diff(b) {
            0 => equal += 1,
            1 => near += 1,
            _ => far += 1,
        }
        if a != common && b != common {
            inside += 1;
            equal_inside += u64::from(a == b);
        }
    }
    let (all, unequal) = ((equal + near + far) as f64, (near + far) as f64);
    let is_even = equal as f64 > 0.75 * all;
    // Quantities pass through the values between; names don't.
    let is_abrupt = far as f64 > 0.3 * unequal || are_abrupt(&ranks, common, values.len());
    // In regions beside the commonest value, which may be the air around a scan.
    let are_regions = equal_inside as f64 > 0.75 * inside as f64;
    match values.len() {
        3..=4 => is_even && (is_abrupt || equal as f64 > 0.9 * all),
        5..=FEW => is_even && is_abrupt,
        _ => is_even && is_abrupt && are_regions,
    }
}

/// Whether most values that are not next to the commonest one border on values far from their own,
/// by rank. A large region next to the commonest value then does not count for all.
fn are_abrupt(ranks: &[[usize; 2]], common: usize, count: usize) -> bool {
    let mut borders = vec![[0u64; 2]; count];
    for &[a, b] in ranks.iter().filter(|[a, b]| a != b) {
        for rank in [a, b] {
            borders[rank][0] += 1;
            borders[rank][1] += u64::from(a.abs_diff(b) > 1);
        }
    }
    let others = (0..count).filter(|rank| rank.abs_diff(common) > 1 && borders[*rank][0] > 0);
    let shares = others.map(|rank| borders[rank][1] as f64 / borders[rank][0] as f64);
    let mut shares: Vec<f64> = shares.collect();
    shares.sort_by(f64::total_cmp);
    shares.get(shares.len() / 2).is_some_and(|middle| *middle > 0.5)
}

/// Returns the distinct values, rounded.
fn distinct(samples: &Samples) -> BTreeSet<i32> {
    let chunks = 1 << 18;
    let merged = |sets: Vec<BTreeSet<i32>>| sets.into_iter().flatten().collect();
    each_type!(samples, values => {
        let of_chunk = |chunk: &[_]| {
            let mut set = BTreeSet::new();
            let mut before = None;
            for &value in chunk {
                let value = f64::from(value).round() as i32;
                // Labels are constant over regions.
                if before != Some(value) {
                    set.insert(value);
                    before = Some(value);
                }
            }
            set
        };
        merged(values.par_chunks(chunks).map(of_chunk).collect())
    })
}

/// Returns the samples, rounded and changed.
fn mapped(samples: &Samples, change: impl Fn(i32) -> i32 + Sync) -> Vec<i32> {
    each_type!(samples, values => {
        values.par_iter().map(|&value| change(f64::from(value).round() as i32)).collect()
    })
}

/// Standard deviation, in steps, of the Gaussian that a sample's own label is weighted with, and
/// how far it reaches along each axis.
pub const OWN_DEVIATION: f64 = 1.2;
pub const OWN_REACH: usize = 2;

/// Returns, for each sample of a label map, the share of its own label around it, 255 for all. This
/// is the mean of the label's mask under a Gaussian over the samples within [`OWN_REACH`] steps.
pub fn label_shares(volume: &Volume) -> Vec<u8> {
    each_type!(volume.samples, values => shares_of(volume.lattice.dims, values))
}

fn shares_of<T: PartialEq + Sync>([nx, ny, nz]: [usize; 3], values: &[T]) -> Vec<u8> {
    let weight = |away: usize| (-0.5 * (away as f64 / OWN_DEVIATION).powi(2)).exp();
    let weights: [f64; OWN_REACH + 1] = std::array::from_fn(weight);
    let around =
        |at: usize, count: usize| at.saturating_sub(OWN_REACH)..(at + OWN_REACH + 1).min(count);
    let mut shares = vec![255u8; values.len()];
    shares.par_chunks_mut((nx * ny).max(1)).enumerate().for_each(|(k, slice)| {
        for (place, share) in slice.iter_mut().enumerate() {
            let (i, j) = (place % nx, place / nx);
            let label = &values[(k * ny + j) * nx + i];
            let (columns, rows, slices) = (around(i, nx), around(j, ny), around(k, nz));
            let row = |y: usize, z: usize| &values[(z * ny + y) * nx..][columns.clone()];
            // Most samples lie inside a region.
            let is_own = |z: usize| rows.clone().all(|y| row(y, z).iter().all(|v| v == label));
            if slices.clone().all(is_own) {
                continue;
            }
            let (mut sum, mut all) = (0.0, 0.0);
            for z in slices {
                for y in rows.clone() {
                    let beside = weights[z.abs_diff(k)] * weights[y.abs_diff(j)];
                    let row = row(y, z);
                    for (x, value) in columns.clone().zip(row) {
                        let weight = beside * weights[x.abs_diff(i)];
                        all += weight;
                        sum += if value == label { weight } else { 0.0 };
                    }
                }
            }
            *share = (255.0 * sum / all).round() as u8;
        }
    });
    shares
}

/// What a label is drawn with.
#[derive(Debug, Clone, Copy)]
struct Style {
    value: i32,
    color: [f64; 3],
    opacity: f64,
}

impl TransferFunction {
    /// Makes the function of a label map: each label is a solid with a colour of its own, that of
    /// the table if it has one. Colours depend on the label alone, so they are the same in other
    /// files. The background is clear.
    pub(super) fn of_labels(volume: &Volume, labels: &Labels) -> Self {
        let spacing = least_spacing(volume);
        let unit = if spacing > 0.0 { spacing } else { 1.0 };
        let styles = labels.present.iter().map(|&value| {
            let known = labels.get(value);
            let color = known.and_then(|label| label.color).unwrap_or_else(|| color_of(value));
            let opacity = match known.and_then(|label| label.opacity) {
                _ if labels.background == Some(value) => 0.0,
                Some(opacity) => over(opacity, 1.0 / TRANSLUCENT),
                None => solid(),
            };
            Style { value, color, opacity }
        });
        let styles: Vec<Style> = styles.collect();
        let certain = CERTAIN.map(|magnitude| magnitude / unit);
        let shade = Shade { certain: Some(certain), ..Shade::default() };
        Self { unit, shade: Some(shade), ..steps(&styles) }
    }

    /// Returns the function with a step for each label of a label map, so that each has what the
    /// function shows of its value. An isosurface shows the label with its value.
    pub(crate) fn over_labels(&self, volume: &Volume) -> Self {
        let Some(labels) = &volume.about.labels else { return self.clone() };
        let share = self.unit / (TRANSLUCENT * least_spacing(volume)).max(f64::MIN_POSITIVE);
        let styles = labels.present.iter().map(|&value| {
            let number = f64::from(value);
            let is_met = |surface: &&Isosurface| (surface.value - number).abs() <= 0.5;
            match self.isosurfaces.iter().rfind(is_met) {
                Some(surface) if surface.opacity >= 1.0 => Style {
                    value,
                    color: surface.color,
                    opacity: over(solid(), TRANSLUCENT * share),
                },
                Some(surface) => {
                    Style { value, color: surface.color, opacity: over(surface.opacity, share) }
                }
                None => Style { value, color: self.color(number), opacity: self.opacity(number) },
            }
        });
        let styles: Vec<Style> = styles.collect();
        let certain = CERTAIN.map(|magnitude| magnitude / least_spacing(volume));
        Self {
            unit: self.unit,
            shade: self.shade.map(|shade| Shade { certain: Some(certain), ..shade }),
            gradient: self.gradient.clone(),
            ..steps(&styles)
        }
    }
}

/// Returns the opacity over a multiple of the length that an opacity holds for.
fn over(opacity: f64, length: f64) -> f64 {
    1.0 - (1.0 - opacity.clamp(0.0, 1.0 - (-SOLID).exp())).powf(length)
}

/// The opacity of a solid over the least distance of samples.
fn solid() -> f64 {
    1.0 - (-SOLID).exp()
}

/// Returns the least distance of samples along an axis that has several.
fn least_spacing(volume: &Volume) -> f64 {
    let (spacing, dims) = (volume.lattice.spacing(), volume.lattice.dims);
    let along = (0..3).filter(|&axis| dims[axis] > 1).map(|axis| spacing[axis]);
    let least = along.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { spacing.min_element() }
}

/// Returns a function that is constant around each label, up to the middle between neighbours.
fn steps(styles: &[Style]) -> TransferFunction {
    let (mut color, mut opacity) = (Vec::new(), Vec::new());
    for (place, style) in styles.iter().enumerate() {
        let (value, before, after) = (
            f64::from(style.value),
            place.checked_sub(1).map(|at| &styles[at]),
            styles.get(place + 1),
        );
        let touches =
            |other: Option<&Style>| other.is_some_and(|o| o.value.abs_diff(style.value) == 1);
        let [low, high] = [value - 0.5, value + 0.5];
        color.extend([(low, style.color), (high, style.color)]);
        if !touches(before) {
            opacity.push((low, 0.0));
        }
        opacity.extend([(low, style.opacity), (high, style.opacity)]);
        if !touches(after) {
            opacity.push((high, 0.0));
        }
    }
    TransferFunction { color, opacity, ..TransferFunction::default() }
}

/// Returns the colour of a label without one. Hues of successive labels are a golden angle apart,
/// and two of three are paler or darker.
fn color_of(value: i32) -> [f64; 3] {
    super::automatic::label_color(value.wrapping_sub(1).rem_euclid(1 << 20) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Lattice;
    use glam::DVec3;

    const SIDE: usize = 24;

    /// A volume of a function of the place from -1 to 1.
    fn volume(value: impl Fn(DVec3) -> f64) -> Volume {
        let lattice = Lattice::with_spacing([SIDE; 3], DVec3::ONE);
        let at = |i: usize| 2.0 * lattice.sample_position(i) / (SIDE as f64 - 1.0) - 1.0;
        let values = (0..lattice.len()).map(|i| value(at(i)) as f32).collect();
        Volume::new(lattice, Samples::F32(values)).unwrap()
    }

    fn balls(values: [f64; 4]) -> Volume {
        let centers = [[0.0, 0.0, 0.0], [0.6, 0.0, 0.5], [-0.6, 0.0, 0.5], [0.0, 0.7, 0.0]];
        volume(|at| {
            let mut value = 0.0;
            for (inside, (center, radius)) in
                values.iter().zip(centers.iter().zip([0.6, 0.3, 0.3, 0.25]))
            {
                if (at - DVec3::from(*center)).length() < radius {
                    value = *inside;
                }
            }
            value
        })
    }

    fn present(volume: &Volume) -> Option<&[i32]> {
        volume.about.labels.as_ref().map(|labels| &labels.present[..])
    }

    #[test]
    fn labels_are_told_from_quantities() {
        for values in [
            [1.0, 2.0, 3.0, 1.0],
            [1000.0, 2000.0, 3000.0, 1000.0],
            [3.0, 17.0, 1003.0, 2035.0],
            [300.0, 300.0, 900.0, 1200.0],
        ] {
            let volume = balls(values).with_guessed_labels();
            let mut expected: Vec<i32> = values.iter().map(|v| *v as i32).chain([0]).collect();
            expected.sort_unstable();
            expected.dedup();
            assert_eq!(present(&volume), Some(&expected[..]), "{values:?}");
            assert_eq!(volume.about.labels.as_ref().unwrap().background, Some(0));
            assert!(volume.is_label_map());
            assert!(!matches!(volume.samples, Samples::F32(_)));
        }
        // A mask, a smooth field in whole numbers, noise, and fractions are none.
        let noise =
            |at: DVec3| ((at.x * 91.7 + at.y * 57.3 + at.z * 33.1).sin() * 1e4).rem_euclid(97.0);
        let quantities: [&dyn Fn(DVec3) -> f64; 5] = [
            &|at| f64::from(u8::from(at.length() < 0.6)) * 255.0,
            &|at| (9.0 * (-2.0 * at.length_squared()).exp()).round(),
            &|at| (900.0 * (-2.0 * at.length_squared()).exp()).round(),
            &|at| noise(at).round(),
            &|at| 0.5 + f64::from(u8::from(at.x > 0.0)) + f64::from(u8::from(at.y > 0.0)),
        ];
        for (number, quantity) in quantities.into_iter().enumerate() {
            assert_eq!(present(&volume(quantity).with_guessed_labels()), None, "{number}");
        }
    }

    #[test]
    fn many_labels_are_told_from_a_scan() {
        // Regions of hundreds of labels without order, and a scan in air.
        let hash = |x: f64| (x * 7919.0).rem_euclid(997.0).floor();
        let cells = volume(|at| {
            let cell = (at * 2.5).floor();
            if at.length() < 0.9 {
                1.0 + hash(cell.x + 11.0 * cell.y + 101.0 * cell.z)
            } else {
                0.0
            }
        });
        assert!(present(&cells.with_guessed_labels()).unwrap().len() > FEW);
        let scan = volume(|at| {
            let inside = (at * 17.0).to_array().map(f64::sin).iter().sum::<f64>();
            if at.length() < 0.5 { (100.0 + 60.0 * inside).round() } else { 0.0 }
        });
        assert_eq!(present(&scan.with_guessed_labels()), None);
    }

    #[test]
    fn labels_too_far_apart_are_numbered() {
        let volume = balls([5.0, 70_000_000.0, -9.0, 5.0]).with_labels(Vec::new());
        let labels = volume.about.labels.as_ref().unwrap();
        assert_eq!((&labels.present[..], volume.range), (&[0, 1, 2, 3][..], [0.0, 3.0]));
        assert_eq!([1, 2, 3].map(|n| labels.name(n)), ["-9", "5", "70000000"]);
        assert!(volume.is_label_map());
    }

    #[test]
    fn a_table_makes_a_label_map_of_a_mask() {
        let mask = || volume(|at| if at.length() < 0.6 { 7.0 } else { 0.0 });
        let ear = |value| Label { value, name: "ear".into(), ..Label::default() };
        assert!(present(&mask().with_label_table(&[ear(8)])).is_none());
        let named = mask().with_label_table(&[ear(7)]);
        assert_eq!(named.about.labels.unwrap().name(7), "ear");
    }

    #[test]
    fn each_label_has_a_colour_of_its_own() {
        let colour = Some([0.2, 0.4, 0.6]);
        let table = vec![
            Label { value: 2, color: colour, ..Label::default() },
            Label { value: 3, opacity: Some(0.0), ..Label::default() },
        ];
        let volume = balls([1.0, 2.0, 3.0, 1000.0]).with_labels(table);
        let transfer = TransferFunction::automatic(&volume);
        transfer.validate().unwrap();
        assert_eq!(transfer.color(2.0), [0.2, 0.4, 0.6]);
        let is_solid = |value: f64| transfer.opacity(value) > 0.99;
        assert!(is_solid(1.0) && is_solid(2.0) && is_solid(1000.0));
        assert!(transfer.opacity(0.0) == 0.0 && transfer.opacity(3.0) == 0.0);
        assert_eq!(transfer.opacity(500.0), 0.0);
        // The colour does not depend on the other labels of the file.
        let alone = balls([1.0, 1.0, 1.0, 1000.0]).with_labels(Vec::new());
        let other = TransferFunction::automatic(&alone);
        assert_eq!(other.color(1000.0), transfer.color(1000.0));
        // An isosurface shows a label.
        let surface = Isosurface { value: 3.0, color: [1.0, 0.0, 0.0], opacity: 1.0 };
        let iso = TransferFunction { isosurfaces: vec![surface], ..TransferFunction::default() };
        let iso = iso.over_labels(&volume);
        assert!(iso.isosurfaces.is_empty() && iso.opacity(3.0) > 0.99 && iso.opacity(2.0) == 0.0);
        assert_eq!(iso.color(3.0), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn own_shares_fall_towards_borders() {
        let volume = volume(|at| if at.x < 0.0 { 1.0 } else { 2.0 }).with_labels(Vec::new());
        let shares = label_shares(&volume);
        let at = |x: usize| shares[(SIDE / 2 * SIDE + SIDE / 2) * SIDE + x];
        assert_eq!((at(0), at(SIDE - 1)), (255, 255));
        assert!(at(SIDE / 2) == at(SIDE / 2 - 1) && at(SIDE / 2) < 190 && at(SIDE / 2) > 127);
    }
}

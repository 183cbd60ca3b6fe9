//! Statistics of the values of scenes.

use super::Editable;
use crate::parallel::prelude::*;

/// The number of bins of a histogram.
pub const BINS: usize = 32;

/// What is known of the values of one name.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistics {
    /// The name of the values.
    pub name: String,
    /// How many there are, without missing ones.
    pub count: u64,
    /// How many are missing: NaN or infinite.
    pub missing: u64,
    /// The least and the greatest value; `None` if all are missing.
    pub range: Option<[f64; 2]>,
    /// The mean; 0 if all are missing.
    pub mean: f64,
    /// The standard deviation from the mean; 0 if all are missing.
    pub deviation: f64,
    /// How many values lie in each of [`BINS`] parts of the range, of equal width. The greatest
    /// value belongs to the last part.
    pub histogram: Vec<u64>,
}

impl Statistics {
    /// Returns the statistics of values.
    pub fn new(name: impl Into<String>, values: &[f64]) -> Self {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let count = finite().count() as u64;
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let range = finite().fold(none, |[low, high], value| [low.min(value), high.max(value)]);
        let [low, high] = if count > 0 { range } else { [0.0; 2] };
        // Sums of differences from the lowest value keep their precision.
        let sum: f64 = finite().map(|value| value - low).sum();
        let mean = if count > 0 { low + sum / count as f64 } else { 0.0 };
        let squares: f64 = finite().map(|value| (value - mean).powi(2)).sum();
        let mut histogram = vec![0; BINS];
        let width = high - low;
        for value in finite() {
            let part = if width > 0.0 { (value - low) / width } else { 0.0 };
            histogram[((part * BINS as f64) as usize).min(BINS - 1)] += 1;
        }
        Self {
            name: name.into(),
            count,
            missing: values.len() as u64 - count,
            range: (count > 0).then_some([low, high]),
            mean,
            deviation: if count > 0 { (squares / count as f64).sqrt() } else { 0.0 },
            histogram,
        }
    }
}

/// Returns the statistics of the coordinates of a scene in the world, and of all its values.
pub fn statistics(scene: &dyn Editable) -> Vec<Statistics> {
    let coordinates = ["x", "y", "z"].into_iter().enumerate().map(|(axis, name)| {
        let at = |index: usize| scene.place(index)[axis];
        let values: Vec<f64> = (0..scene.count()).into_par_iter().map(at).collect();
        Statistics::new(name, &values)
    });
    let names = scene.names().into_iter();
    let others = names.filter_map(|name| Some((scene.column(&name)?, name)));
    coordinates.chain(others.map(|(values, name)| Statistics::new(name, &values))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_summed_up() {
        let values = [1e9, 1e9 + 1.0, 1e9 + 2.0, f64::NAN, 1e9 + 1.0];
        let statistics = Statistics::new("t", &values);
        assert_eq!((statistics.count, statistics.missing), (4, 1));
        assert_eq!(statistics.range, Some([1e9, 1e9 + 2.0]));
        assert_eq!((statistics.mean, statistics.deviation), (1e9 + 1.0, 0.5f64.sqrt()));
        let bins = [0, BINS / 2, BINS - 1].map(|bin| statistics.histogram[bin]);
        assert_eq!((bins, statistics.histogram.iter().sum::<u64>()), ([1, 2, 1], 4));
        let none = Statistics::new("t", &[f64::NAN]);
        assert_eq!((none.count, none.range, none.mean), (0, None, 0.0));
    }
}

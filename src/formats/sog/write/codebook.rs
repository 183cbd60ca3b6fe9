//! Codebooks: up to 256 numbers that stand for many.
//!
//! The sum of squared errors is the least that a codebook of this size can have, up to a division
//! of the values into bins. Each number of the codebook is the mean of a range of the sorted
//! values. Dynamic programming finds where the ranges end (Wang & Song 2011). What the bins have
//! cost, Lloyd's iterations gain back.

/// Numbers of a codebook.
pub const LEVELS: usize = 256;

/// Bins that the values are divided into, half of them with as many values each, and half of them
/// with the same width.
const BINS: usize = 4096;

/// Values that a codebook is made of, at most.
const MOST: usize = 1 << 22;

/// Iterations after the bins.
const ITERATIONS: usize = 20;

/// Sorted numbers that stand for others.
#[derive(Debug, Clone, PartialEq)]
pub struct Codebook(Vec<f32>);

impl Codebook {
    /// Makes the codebook of finite values, each with its weight. There must be one.
    pub fn of(values: impl Iterator<Item = (f32, f32)>) -> Self {
        let mut values: Vec<(f32, f64)> = values.map(|(v, w)| (v, f64::from(w))).collect();
        values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        values.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 += if is_same { next.1 } else { 0.0 };
            is_same
        });
        if values.len() <= LEVELS {
            return Self(values.into_iter().map(|(value, _)| value).collect());
        }
        let sums = Sums::of(&values);
        let mut cuts = sums.best_cuts(&bins(&values));
        let mut levels = sums.means(&cuts);
        for _ in 0..ITERATIONS {
            // Each number of the codebook stands for the values that it is nearest to.
            let middles = levels.windows(2).map(|pair| f64::midpoint(pair[0], pair[1]));
            let inner = middles.map(|m| values.partition_point(|(value, _)| f64::from(*value) < m));
            let mut moved: Vec<usize> = [0].into_iter().chain(inner).collect();
            moved.push(values.len());
            moved.dedup();
            if moved == cuts {
                break;
            }
            levels = sums.means(&moved);
            cuts = moved;
        }
        Self(levels.into_iter().map(|level| level as f32).collect())
    }

    /// Makes the codebook of many values with their weights, by a sample of them and by the
    /// smallest and the largest.
    pub fn of_sample(count: usize, value: impl Fn(usize) -> (f32, f32)) -> Self {
        let step = count.div_ceil(MOST).max(1);
        let [low, high] = (1..count).fold([value(0); 2], |[low, high], at| {
            let this = value(at);
            [if this.0 < low.0 { this } else { low }, if this.0 > high.0 { this } else { high }]
        });
        Self::of((0..count).step_by(step).map(&value).chain([low, high]))
    }

    /// Returns the place of the number that is nearest to a value.
    pub fn nearest(&self, value: f32) -> u8 {
        let above = self.0.partition_point(|&level| level < value);
        let [below, above] = [above.saturating_sub(1), above.min(self.0.len() - 1)];
        let is_below = value - self.0[below] <= self.0[above] - value;
        if is_below { below as u8 } else { above as u8 }
    }

    /// Returns the numbers. The last one is repeated, so that there are as many as readers expect.
    pub fn levels(&self) -> Vec<f32> {
        let last = self.0.last().copied().unwrap_or_default();
        let mut levels = self.0.clone();
        levels.resize(LEVELS, last);
        levels
    }
}

/// Returns where bins of sorted values begin and end.
fn bins(values: &[(f32, f64)]) -> Vec<usize> {
    let count = values.len();
    let half = BINS / 2;
    let [low, high] = [values[0].0, values[count - 1].0].map(f64::from);
    let of_width = (1..half).map(|bin| {
        let cut = low + (high - low) * bin as f64 / half as f64;
        values.partition_point(|(value, _)| f64::from(*value) < cut)
    });
    let mut cuts: Vec<usize> = (0..=half).map(|bin| count * bin / half).chain(of_width).collect();
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

/// The sums over all values before each.
struct Sums {
    /// Of weights, of weighted values, and of weighted squares.
    sums: Vec<[f64; 3]>,
    /// What the values are relative to, so that the squares are small.
    middle: f64,
}

impl Sums {
    fn of(values: &[(f32, f64)]) -> Self {
        let middle = f64::midpoint(values[0].0.into(), values[values.len() - 1].0.into());
        let mut sums = vec![[0.0; 3]];
        let mut all = [0.0; 3];
        for &(value, weight) in values {
            let value = f64::from(value) - middle;
            all = [all[0] + weight, all[1] + weight * value, all[2] + weight * value * value];
            sums.push(all);
        }
        Self { sums, middle }
    }

    /// Returns the sum of squared distances of values from their mean.
    fn cost(&self, start: usize, end: usize) -> f64 {
        let [weight, sum, squares] = self.between(start, end);
        if weight > 0.0 { (squares - sum * sum / weight).max(0.0) } else { 0.0 }
    }

    fn between(&self, start: usize, end: usize) -> [f64; 3] {
        let [start, end] = [self.sums[start], self.sums[end]];
        [0, 1, 2].map(|at| end[at] - start[at])
    }

    /// Returns the means of the values between successive cuts.
    fn means(&self, cuts: &[usize]) -> Vec<f64> {
        let mean = |pair: &[usize]| {
            let [weight, sum, _] = self.between(pair[0], pair[1]);
            self.middle + sum / weight
        };
        cuts.windows(2).map(mean).collect()
    }

    /// Returns the cuts, among the ends of bins, between which the values are nearest to their
    /// means: as many ranges as a codebook has numbers.
    fn best_cuts(&self, bins: &[usize]) -> Vec<usize> {
        let count = bins.len() - 1;
        // The least cost of the first bins, in one range more at a time.
        let mut costs: Vec<f64> = (0..=count).map(|end| self.cost(0, bins[end])).collect();
        let mut begins = Vec::new();
        for ranges in 2..=LEVELS.min(count) {
            let mut next = (costs.clone(), vec![0u16; count + 1]);
            let whole = [ranges, count, ranges - 1, count - 1];
            self.fill(bins, &costs, whole, &mut next);
            costs = next.0;
            begins.push(next.1);
        }
        let mut cuts = vec![count];
        for begins in begins.iter().rev() {
            cuts.push(usize::from(begins[cuts[cuts.len() - 1]]));
        }
        cuts.push(0);
        cuts.into_iter().rev().map(|bin| bins[bin]).collect()
    }

    /// Finds the bin where the last range of the first bins begins, for all numbers of bins from
    /// `low` to `high`. It lies between `first` and `last`, and moves in one direction.
    fn fill(
        &self,
        bins: &[usize],
        costs: &[f64],
        [low, high, first, last]: [usize; 4],
        next: &mut (Vec<f64>, Vec<u16>),
    ) {
        if low > high {
            return;
        }
        let middle = usize::midpoint(low, high);
        let mut best = (f64::INFINITY, first);
        for begin in first..=last.min(middle - 1) {
            let cost = costs[begin] + self.cost(bins[begin], bins[middle]);
            if cost < best.0 {
                best = (cost, begin);
            }
        }
        next.0[middle] = best.0;
        next.1[middle] = best.1 as u16;
        self.fill(bins, costs, [low, middle - 1, first, best.1], next);
        self.fill(bins, costs, [middle + 1, high, best.1, last], next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(book: &Codebook, values: &[f32]) -> f64 {
        let miss = |value: f32| f64::from(value - book.0[usize::from(book.nearest(value))]);
        values.iter().map(|&value| miss(value).powi(2)).sum()
    }

    fn of(values: &[f32]) -> Codebook {
        Codebook::of(values.iter().map(|&value| (value, 1.0)))
    }

    #[test]
    fn few_values_are_kept() {
        let values: Vec<f32> = (0..256).map(|i| (i as f32 * 0.7).sin()).collect();
        let book = of(&values);
        assert_eq!((error(&book, &values), book.levels().len()), (0.0, 256));
        assert_eq!(of(&[3.0, 3.0, -1.0]).levels()[..3], [-1.0, 3.0, 3.0]);
        assert_eq!(of(&[2.0]).nearest(-9.0), 0);
    }

    #[test]
    fn the_error_is_that_of_the_best_codebook() {
        // The best codebook of many numbers has the cube of the integral of the cube root of the
        // density as its error, over 12 · 256² (Panter & Dite 1951): for exp(−|x|) / 2, 108.
        let count = 200_000;
        let size = |i: i32| -(1.0 - (i as f32 + 0.5) / count as f32).ln();
        let values: Vec<f32> =
            (0..count).map(|i| if i % 2 == 0 { size(i) } else { -size(i) }).collect();
        let miss = error(&of(&values), &values) / f64::from(count);
        let least = 108.0 / (12.0 * 65536.0);
        assert!(miss < least * 1.05, "{miss:e} {least:e}");
        let high = values.iter().copied().fold(0.0, f32::max);
        let steps = Codebook((0..256).map(|i| high * (i as f32 / 127.5 - 1.0)).collect());
        assert!(miss < 0.4 * error(&steps, &values) / f64::from(count));
    }

    #[test]
    fn weights_count() {
        let values = |heavy: f32| {
            let all = (0..2000).map(|i| i as f32);
            Codebook::of(all.map(move |v| (v, if v < 1000.0 { heavy } else { 1.0 })))
        };
        let below = |book: Codebook| book.0.iter().filter(|&&level| level < 1000.0).count();
        let (even, heavy) = (below(values(1.0)), below(values(1000.0)));
        assert!(even.abs_diff(128) < 4 && heavy > 200, "{even} {heavy}");
    }

    #[test]
    fn the_nearest_is_found() {
        let book = Codebook(vec![-1.0, 0.0, 4.0]);
        let places = [-9.0, -0.6, -0.4, 1.9, 2.1, 99.0].map(|value| book.nearest(value));
        assert_eq!(places, [0, 0, 1, 1, 2, 2]);
        let value = |at: usize| if at == 77 { 1e6 } else { at as f32 / 8192.0 };
        let far = Codebook::of_sample(1 << 12, |at| (value(at), 1.0));
        assert_eq!(far.levels()[255], 1e6);
    }
}

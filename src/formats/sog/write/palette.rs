//! The palette of harmonics: up to 65,536 rows of terms that stand for those of all Gaussians.
//!
//! The palette is a tree of k-means (MacQueen 1967; Nistér & Stewénius 2006): Gaussians are divided
//! into a few groups around their means, and each group is divided again. Groups get as many
//! entries as their errors ask for. Then each Gaussian takes the nearest entry of the groups
//! nearest to it, and each entry becomes the mean of its Gaussians. That takes time in proportion
//! to the number of Gaussians and to the square root of the number of entries.

use super::super::MOST_ENTRIES;
use crate::{
    gaussians::{Gaussians, harmonics::terms},
    parallel::prelude::*,
};

/// Gaussians that a palette is made of, at most. All others take entries of it.
const MOST_ROWS: usize = 1 << 20;

/// Groups of a division, at most.
const MOST_GROUPS: usize = 256;

/// Rows for each group, at most, that the means of groups are made of.
const ROWS_OF_GROUP: usize = 64;

/// Iterations of k-means.
const ITERATIONS: usize = 8;

/// Divisions on the way to an entry, at most.
const MOST_DEPTH: usize = 6;

/// Groups in which a Gaussian looks for its entry.
const NEAR: usize = 4;

/// The entries, and which of them each Gaussian has.
pub struct Palette {
    /// The entries, one after the other, each as in [`Gaussians::harmonics`].
    pub entries: Vec<f32>,
    pub labels: Vec<u16>,
    /// How many Gaussians have each entry.
    pub uses: Vec<u32>,
}

/// The terms of Gaussians above the constant one.
#[derive(Clone, Copy)]
struct Rows<'a> {
    set: &'a Gaussians,
    width: usize,
}

impl<'a> Rows<'a> {
    fn row(self, index: usize) -> &'a [f32] {
        self.set.harmonics_of(index)[1..].as_flattened()
    }
}

/// Returns the largest number of entries for a number of Gaussians: a power of two from 1024 on, of
/// which there are no more than Gaussians.
fn most_entries(count: usize) -> usize {
    if count < 1024 { count } else { (1 << count.ilog2()).min(MOST_ENTRIES) }
}

impl Palette {
    /// Makes the palette of Gaussians, whose degree is at least 1.
    pub fn of(set: &Gaussians) -> Self {
        let rows = Rows { set, width: 3 * (terms(set.degree) - 1) };
        let step = set.len().div_ceil(MOST_ROWS);
        let sample: Vec<usize> = (0..set.len()).step_by(step).collect();
        let mut count = 0;
        let tree = Tree::of(rows, &sample, most_entries(set.len()), 0, &mut count);
        let labels: Vec<u32> =
            (0..set.len()).into_par_iter().map(|i| tree.entry(rows.row(i), NEAR).1).collect();
        let means = Means::of(rows, (0..set.len()).zip(labels.iter().copied()), count);
        // Entries that no Gaussian has are left out.
        let mut places = vec![0u16; count];
        let used = places.iter_mut().zip(&means.counts).filter(|(_, count)| **count > 0);
        used.enumerate().for_each(|(kept, (place, _))| *place = kept as u16);
        Self {
            entries: means.rows(rows.width),
            labels: labels.into_iter().map(|label| places[label as usize]).collect(),
            uses: means.counts.into_iter().filter(|&count| count > 0).collect(),
        }
    }
}

/// Sums of rows, by the group that they belong to.
struct Means {
    sums: Vec<f64>,
    counts: Vec<u32>,
}

impl Means {
    fn of(rows: Rows, members: impl Iterator<Item = (usize, u32)>, groups: usize) -> Self {
        let (mut sums, mut counts) = (vec![0.0; groups * rows.width], vec![0; groups]);
        for (index, group) in members {
            let group = group as usize;
            counts[group] += 1;
            let sum = &mut sums[group * rows.width..][..rows.width];
            sum.iter_mut().zip(rows.row(index)).for_each(|(sum, part)| *sum += f64::from(*part));
        }
        Self { sums, counts }
    }

    /// Returns the means of the groups that have members.
    fn rows(&self, width: usize) -> Vec<f32> {
        let groups = self.sums.chunks_exact(width).zip(&self.counts);
        let groups = groups.filter(|(_, count)| **count > 0);
        groups.flat_map(|(sum, &n)| sum.iter().map(move |s| (s / f64::from(n)) as f32)).collect()
    }
}

/// A division of rows into groups.
struct Tree {
    /// The means of the groups, one after the other.
    centers: Vec<f32>,
    groups: Vec<Group>,
}

enum Group {
    /// The number of an entry.
    Entry(u32),
    Divided(Tree),
}

impl Tree {
    /// Divides rows until there are `most` entries, and adds their number to `count`.
    fn of(rows: Rows, members: &[usize], most: usize, depth: usize, count: &mut usize) -> Self {
        let is_last = most <= MOST_GROUPS || depth == MOST_DEPTH;
        let wanted = if is_last { most.min(MOST_GROUPS) } else { (most as f64).sqrt() as usize };
        let centers = k_means(rows, members, wanted);
        let nearest = nearest_of(rows, members, &centers);
        let groups = centers.len() / rows.width;
        let mut parts = vec![(Vec::new(), 0.0f64); groups];
        for (&index, (distance, group)) in members.iter().zip(nearest) {
            let part = &mut parts[group as usize];
            part.0.push(index);
            part.1 += f64::from(distance);
        }
        let shares = if is_last { vec![1; groups] } else { shares(rows.width, &parts, most) };
        let groups = parts.into_iter().zip(shares).map(|((members, error), share)| {
            if share > 1 && error > 0.0 {
                return Group::Divided(Self::of(rows, &members, share, depth + 1, count));
            }
            *count += 1;
            Group::Entry(*count as u32 - 1)
        });
        let groups = groups.collect();
        Self { centers, groups }
    }

    /// Returns the nearest entry to a row in the `count` groups nearest to it, up to [`NEAR`], with
    /// its squared distance. Only the nearest of their parts is looked into.
    fn entry(&self, row: &[f32], count: usize) -> (f32, u32) {
        let mut near = [(f32::INFINITY, 0); NEAR];
        let near = &mut near[..count];
        for (group, center) in self.centers.chunks_exact(row.len()).enumerate() {
            let distance = distance(row, center);
            if distance < near[count - 1].0 {
                let place = near.partition_point(|other| other.0 <= distance);
                near[place..].rotate_right(1);
                near[place] = (distance, group);
            }
        }
        let near = near.iter().filter(|(distance, _)| distance.is_finite());
        let entries = near.map(|&(distance, group)| match &self.groups[group] {
            Group::Entry(number) => (distance, *number),
            Group::Divided(tree) => tree.entry(row, 1),
        });
        entries.reduce(|a, b| if b.0 < a.0 { b } else { a }).unwrap_or((0.0, 0))
    }
}

/// Returns how many entries each group gets, in proportion to its error raised to the power that
/// makes the sum of errors the least (Zador 1982). None has more entries than members.
fn shares(width: usize, parts: &[(Vec<usize>, f64)], most: usize) -> Vec<usize> {
    let power = width as f64 / (width as f64 + 2.0);
    let weights: Vec<f64> = parts.iter().map(|(_, error)| error.powf(power)).collect();
    let share = |factor: f64, group: usize| {
        let members = parts[group].0.len().max(1);
        ((factor * weights[group]) as usize).clamp(1, members)
    };
    let sum = |factor: f64| (0..parts.len()).map(|group| share(factor, group)).sum::<usize>();
    let [mut low, mut high] = [0.0, most as f64 / weights.iter().sum::<f64>().max(1e-300)];
    // Groups with few members leave entries to the others.
    for _ in 0..64 {
        if sum(high) > most || !high.is_finite() {
            break;
        }
        [low, high] = [high, 2.0 * high];
    }
    for _ in 0..64 {
        let middle = f64::midpoint(low, high);
        let fits = sum(middle) <= most;
        [low, high] = if fits { [middle, high] } else { [low, middle] };
    }
    (0..parts.len()).map(|group| share(low, group)).collect()
}

/// Returns the means of at most this many groups of rows, one after the other.
fn k_means(rows: Rows, members: &[usize], groups: usize) -> Vec<f32> {
    let step = members.len().div_ceil(groups * ROWS_OF_GROUP).max(1);
    let sample: Vec<usize> = members.iter().copied().step_by(step).collect();
    let groups = groups.min(sample.len());
    let first = (0..groups).map(|group| sample[group * sample.len() / groups]);
    let mut centers: Vec<f32> = first.flat_map(|index| rows.row(index)).copied().collect();
    for _ in 0..ITERATIONS {
        let nearest = nearest_of(rows, &sample, &centers);
        let labels = sample.iter().copied().zip(nearest.iter().map(|(_, group)| *group));
        let means = Means::of(rows, labels, centers.len() / rows.width);
        let lost = means.counts.iter().filter(|&&count| count == 0).count();
        centers = means.rows(rows.width);
        // Groups without rows begin anew, where the errors are the largest.
        let mut worst: Vec<(f32, usize)> =
            nearest.iter().zip(&sample).map(|((miss, _), &index)| (*miss, index)).collect();
        worst.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let worst = worst.into_iter().take(lost).filter(|(miss, _)| *miss > 0.0);
        centers.extend(worst.flat_map(|(_, index)| rows.row(index)));
    }
    centers
}

/// Returns the nearest centre to each row, with its squared distance.
fn nearest_of(rows: Rows, members: &[usize], centers: &[f32]) -> Vec<(f32, u32)> {
    let nearest = |&index: &usize| {
        let row = rows.row(index);
        let mut best = (f32::INFINITY, 0);
        for (group, center) in centers.chunks_exact(rows.width).enumerate() {
            let distance = distance(row, center);
            if distance < best.0 {
                best = (distance, group as u32);
            }
        }
        best
    };
    members.par_iter().map(nearest).collect()
}

/// Returns the squared distance of two rows. Eight sums at once let the compiler use wide
/// registers.
fn distance(a: &[f32], b: &[f32]) -> f32 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0f32; 8];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            let miss = a[lane] - b[lane];
            sums[lane] += miss * miss;
        }
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| (a - b) * (a - b));
    sums.iter().sum::<f32>() + rest.sum::<f32>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gaussians of degree 1 whose terms are near one of a few rows.
    fn set(count: usize, rows: usize, noise: f32) -> Gaussians {
        let term = |i: usize, t: usize| {
            let part = |c: usize| {
                let wide = ((i % rows * 31 + t * 7 + c * 3) as f32).sin();
                wide + noise * ((i * 17 + t * 5 + c) as f32 * 1.7).sin()
            };
            [part(0), part(1), part(2)]
        };
        Gaussians {
            centers: vec![glam::Vec3::ZERO; count],
            degree: 1,
            harmonics: (0..4 * count).map(|at| term(at / 4, at % 4)).collect(),
            ..Gaussians::default()
        }
    }

    /// Returns the mean squared error of a palette.
    fn error(set: &Gaussians, palette: &Palette) -> f64 {
        let width = 3 * (terms(set.degree) - 1);
        let rows = Rows { set, width };
        let miss = |(index, &label): (usize, &u16)| {
            f64::from(distance(
                rows.row(index),
                &palette.entries[usize::from(label) * width..][..width],
            ))
        };
        palette.labels.iter().enumerate().map(miss).sum::<f64>() / set.len() as f64
    }

    #[test]
    fn few_rows_are_kept() {
        for (count, rows) in [(1, 1), (900, 900), (5000, 1), (5000, 700)] {
            let set = set(count, rows, 0.0);
            let palette = Palette::of(&set);
            assert_eq!(palette.uses.iter().sum::<u32>() as usize, count);
            assert_eq!(palette.entries.len(), 9 * palette.uses.len());
            let miss = error(&set, &palette);
            assert!(miss < 1e-6, "{count} {rows}: {miss}");
            assert!(palette.uses.len() <= count && palette.uses.iter().all(|&n| n > 0));
        }
    }

    #[test]
    fn entries_are_near_their_gaussians() {
        let set = set(20_000, 20_000, 0.0);
        let palette = Palette::of(&set);
        assert!((8192..=16384).contains(&palette.uses.len()), "{}", palette.uses.len());
        // One Gaussian of each power of two, as an entry of the others: far worse.
        let none = Palette {
            entries: palette.entries[..9].to_vec(),
            labels: vec![0; 20_000],
            uses: vec![20_000],
        };
        assert!(error(&set, &palette) < 0.01 * error(&set, &none));
        assert_eq!(
            [1023, 1024, 2047, 60_000, 1 << 30].map(most_entries),
            [1023, 1024, 1024, 32768, 65536]
        );
    }

    #[test]
    fn groups_share_entries_by_their_errors() {
        let part = |count: usize, error: f64| (vec![0; count], error);
        let parts = [part(1000, 1.0), part(1000, 1.0), part(1000, 0.0), part(3, 50.0)];
        let shares = shares(9, &parts, 104);
        assert_eq!(shares, [50, 50, 1, 3]);
    }
}

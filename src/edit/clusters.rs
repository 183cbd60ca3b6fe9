//! Clusters of points: those that a chain of near neighbours joins.
//!
//! Two of the eight nearest neighbours are joined if they are no farther apart than a few times the
//! usual distance around either, or if they reach each other. A cluster of few points far from all
//! others is a floater.
//!
//! Strays that are evenly scattered have each other as neighbours, at a distance that is usual
//! among them. So what is usual around nearly all points bounds how far points are joined. Nearly
//! all: the parts of a scan that are far from its scanner are sparse.

use super::Context;
use crate::{
    Error, Result,
    math::{neighbours::Neighbours, sets::Sets},
    parallel::prelude::*,
};
use glam::Vec3;

/// The number of neighbours.
const COUNT: usize = 8;
/// Neighbours are joined up to this many times the mean distance around either.
const REACH: f32 = 4.0;
/// Neighbours are joined up to this many times the mean distance that this share of all points does
/// not exceed.
const MOST_REACH: f32 = 6.0;
const NEARLY_ALL: f64 = 0.98;
/// A cluster of fewer points is a floater, or of less than this share of all points if there are
/// few.
const FEWEST: u64 = 64;
const LEAST_SHARE: u64 = 100;

/// Bytes of memory for each point.
const OF_POINT: u64 = 220;

/// Refuses an edit that needs more memory than it may use.
pub fn check_memory(edit: &str, count: usize, context: &Context) -> Result<()> {
    let need = OF_POINT.saturating_mul(count as u64);
    if need <= context.memory {
        return Ok(());
    }
    let [need, most] = [need, context.memory].map(|bytes| bytes.div_ceil(1 << 20));
    Err(Error::Argument(format!(
        "--{edit} compares {count} points, which takes about {need} MiB, but only {most} MiB may \
         be used; --memory allows more, and --thin before it leaves fewer points"
    )))
}

/// The clusters of points.
pub struct Clusters {
    /// The cluster of each point, by its first point.
    of: Vec<u32>,
    /// The number of points in the cluster of each first point.
    counts: Vec<u32>,
}

impl Clusters {
    /// Finds the clusters of places, of which each reaches some way around. `pairs` belong together
    /// in any case.
    pub fn new(places: &[Vec3], reaches: &[f32], pairs: &[[u32; 2]]) -> Self {
        let first = Neighbours::first_of_equals(places);
        let kept: Vec<u32> =
            (0..).zip(&first).filter(|(index, first)| index == *first).map(|(at, _)| at).collect();
        let points: Vec<Vec3> = kept.par_iter().map(|&at| places[at as usize]).collect();
        let mut sets = Sets::new(places.len());
        if points.len() > 1 {
            let tree = Neighbours::new(&points);
            let near = |at: usize| {
                let mut near = [(f32::INFINITY, u32::MAX); COUNT];
                near.iter_mut().zip(tree.of(at as u32, COUNT)).for_each(|(slot, of)| *slot = of);
                near
            };
            let near: Vec<[(f32, u32); COUNT]> =
                (0..points.len()).into_par_iter().map(near).collect();
            let usual = |near: &[(f32, u32); COUNT]| {
                let there = near.iter().filter(|(_, other)| *other != u32::MAX);
                let count = there.clone().count().max(1) as f32;
                there.map(|(distance, _)| distance).sum::<f32>() / count
            };
            let usual: Vec<f32> = near.par_iter().map(usual).collect();
            let bound = MOST_REACH * quantile(usual.clone(), NEARLY_ALL);
            for (at, near) in near.iter().enumerate() {
                for &(distance, other) in near.iter().filter(|(_, other)| *other != u32::MAX) {
                    let other = other as usize;
                    let ends = [kept[at], kept[other]].map(|point| reaches[point as usize]);
                    let usual = (REACH * usual[at].min(usual[other])).min(bound);
                    let most = usual.max(2.0 * (ends[0] + ends[1]));
                    if distance <= most {
                        sets.join(kept[at], kept[other]);
                    }
                }
            }
        }
        first.iter().zip(0..).for_each(|(first, point)| sets.join(*first, point));
        pairs.iter().for_each(|[one, other]| sets.join(*one, *other));
        let of: Vec<u32> = (0..places.len() as u32).map(|point| sets.root(point)).collect();
        let mut counts = vec![0; places.len()];
        of.iter().for_each(|root| counts[*root as usize] += 1);
        Self { of, counts }
    }

    /// Returns which points are in clusters that are no floaters. The largest cluster is none.
    pub fn without_floaters(&self) -> Vec<bool> {
        let least = FEWEST.min(self.of.len() as u64 / LEAST_SHARE) as u32;
        let largest = self.counts.iter().copied().max().unwrap_or(0);
        let least = least.max(2).min(largest);
        self.of.iter().map(|root| self.counts[*root as usize] >= least).collect()
    }

    /// Returns which points are in the largest clusters, this many. Of clusters of the same size,
    /// that with the first point counts.
    pub fn largest(&self, count: usize) -> Vec<bool> {
        let mut roots: Vec<u32> =
            (0..self.counts.len() as u32).filter(|root| self.counts[*root as usize] > 0).collect();
        roots.sort_by_key(|root| (std::cmp::Reverse(self.counts[*root as usize]), *root));
        let mut is_kept = vec![false; self.counts.len()];
        roots.iter().take(count).for_each(|root| is_kept[*root as usize] = true);
        self.of.iter().map(|root| is_kept[*root as usize]).collect()
    }
}

/// Returns the number that this share of some numbers does not exceed. There is at least one.
fn quantile(mut numbers: Vec<f32>, share: f64) -> f32 {
    let rank = (numbers.len() as f64 * share).ceil() as usize;
    let at = rank.clamp(1, numbers.len()) - 1;
    *numbers.select_nth_unstable_by(at, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    /// A square grid of points around a place.
    fn grid(side: usize, step: f32, at: Vec3) -> Vec<Vec3> {
        let point = |index: usize| Vec3::new((index % side) as f32, (index / side) as f32, 0.0);
        (0..side * side).map(|index| at + step * point(index)).collect()
    }

    fn count(kept: &[bool]) -> usize {
        kept.iter().filter(|kept| **kept).count()
    }

    #[test]
    fn floaters_are_few_points_far_from_others() {
        let mut places = grid(40, 0.1, Vec3::ZERO);
        // A coarser part of the surface touches the fine one. A distant wall is a cluster.
        places.extend(grid(10, 0.2, Vec3::new(4.05, 0.0, 0.0)));
        places.extend(grid(10, 1.0, Vec3::new(50.0, 0.0, 0.0)));
        let whole = places.len();
        places.extend([Vec3::new(1.0, 1.0, 2.0), Vec3::new(1.0, 1.0, 2.0), Vec3::splat(-9.0)]);
        places.extend(grid(3, 0.05, Vec3::new(0.0, 0.0, 8.0)));
        let clusters = Clusters::new(&places, &vec![0.0; places.len()], &[]);
        let kept = clusters.without_floaters();
        assert!(kept[..whole].iter().all(|kept| *kept) && kept[whole..].iter().all(|kept| !kept));
        assert_eq!(count(&clusters.largest(1)), 1700);
        assert_eq!(count(&clusters.largest(2)), 1800);
        assert_eq!(count(&clusters.largest(99)), places.len());
        // Pairs and large Gaussians join what is far apart.
        let joined = Clusters::new(&places, &vec![0.0; places.len()], &[[0, whole as u32 + 2]]);
        assert!(joined.without_floaters()[whole + 2]);
        let mut reaches = vec![0.0; places.len()];
        reaches[whole] = 2.0;
        assert!(Clusters::new(&places, &reaches, &[]).without_floaters()[whole]);
    }

    #[test]
    fn evenly_scattered_strays_are_floaters() {
        // Ground around a scanner, whose points are the sparser the farther they are.
        let turn = |index: usize| (index as f32 * 0.618_034).fract() * std::f32::consts::TAU;
        let away = |index: usize| 1.5 * 30f32.powf(index as f32 / 20_000.0);
        let ground = |index: usize| (Vec2::from_angle(turn(index)) * away(index)).extend(0.0);
        let mut places: Vec<Vec3> = (0..20_000).map(ground).collect();
        let scan = places.len();
        let part = |index: usize, by: f64| (index as f64 * by).fract() as f32 - 0.5;
        let place = |index: usize| {
            let parts = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|by| part(index, by));
            200.0 * Vec3::from(parts) + Vec3::new(0.0, 0.0, 120.0)
        };
        places.extend((0..300).map(place));
        let clusters = Clusters::new(&places, &vec![0.0; places.len()], &[]);
        let kept = clusters.without_floaters();
        assert_eq!((count(&kept[..scan]), count(&kept[scan..])), (scan, 0));
    }

    #[test]
    fn few_points_are_never_all_floaters() {
        for count in 1..4 {
            let places = &[Vec3::ZERO, Vec3::X, Vec3::splat(100.0)][..count];
            let clusters = Clusters::new(places, &vec![0.0; count], &[]);
            assert!(clusters.without_floaters().contains(&true), "{count}");
        }
    }
}

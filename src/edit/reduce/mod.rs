//! Fewer Gaussians that look alike: two near ones become one, the cheapest pair first.
//!
//! A greedy reduction of a mixture (Runnalls 2007). What a pair costs is the error of pictures
//! ([`pair`]) with three factors, which were found by trying (docs/editing.md):
//!
//! - the square of the number of Gaussians that become one, because errors of one sign add up where
//!   many overlap;
//! - one over the root of the pair's area, between the error of a picture and that of a close view;
//! - colours that differ cost more, because no later merge brings them back.

mod pair;

use super::thin::Thin;
use crate::{
    Result,
    gaussians::{
        Gaussians,
        harmonics::{CONSTANT, terms},
        shape_of,
    },
    math::{eigen, neighbours::Neighbours},
    memory,
    parallel::prelude::*,
};
use glam::Vec3;
use pair::{Merged, Products, Shape};
use std::{cmp::Ordering, collections::BinaryHeap};

/// The number of neighbours with which a Gaussian may be merged.
const COUNT: usize = 10;

/// What an opacity counts beside the colour: backgrounds from black to white.
const BACKGROUND: f64 = 0.5;

/// How much more a pair costs whose colours differ, for each square of the difference.
const COLOR: f64 = 100.0;

/// The full width at half maximum of a Gaussian, in deviations.
const FULL_WIDTH: f64 = 2.354_820_045;

/// Bytes of memory for each Gaussian: its shape, its neighbours and their pairs.
const MEMORY: usize = size_of::<Shape>() + 12 * COUNT + 36 + COUNT * size_of::<Pair>();

/// A pair that may be merged.
#[derive(Clone, Copy)]
struct Pair {
    cost: f32,
    ends: [u32; 2],
    /// How many Gaussians the ends stood for when the cost was found.
    counts: [u32; 2],
}

impl PartialEq for Pair {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Pair {}

impl PartialOrd for Pair {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Pair {
    /// Cheaper pairs are greater. Of pairs of the same cost, the earlier one is.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.ends.cmp(&self.ends))
    }
}

/// A scene while its Gaussians are merged.
pub struct Reduction {
    set: Gaussians,
    shapes: Vec<Shape>,
    /// How many Gaussians each stands for.
    counts: Vec<u32>,
    /// The neighbours of each, some of which may have become part of another.
    near: Vec<Vec<u32>>,
    /// What each became part of: itself, or another that may be part of a third one.
    whole: Vec<u32>,
    pairs: BinaryHeap<Pair>,
    left: usize,
}

impl Reduction {
    /// Begins with a scene.
    pub fn new(set: Gaussians) -> Self {
        let shape = |index: usize| {
            let axes = set.axes(index).as_dmat3();
            Shape {
                center: set.centers[index].as_dvec3(),
                covariance: axes * axes.transpose(),
                opacity: set.opacities[index].into(),
            }
        };
        let count = set.len();
        let shapes = (0..count).into_par_iter().map(shape).collect();
        Self {
            set,
            shapes,
            counts: vec![1; count],
            near: vec![Vec::new(); count],
            whole: (0..count as u32).collect(),
            pairs: BinaryHeap::new(),
            left: count,
        }
    }

    /// Returns those that are part of no other.
    fn kept(&self) -> Vec<u32> {
        let all = (0..).zip(&self.whole).filter(|(index, whole)| index == *whole);
        all.map(|(index, _)| index).collect()
    }

    /// Finds the pairs of what is left.
    fn find_pairs(&mut self) {
        let kept = self.kept();
        let place = |&index: &u32| self.shapes[index as usize].center.as_vec3();
        let places: Vec<Vec3> = kept.iter().map(place).collect();
        for (&index, near) in kept.iter().zip(neighbours(&places)) {
            self.near[index as usize] = near.into_iter().map(|at| kept[at as usize]).collect();
        }
        let of_one = |index: &u32| {
            let near = self.near[*index as usize].iter().filter(|other| *other > index);
            near.map(|&other| self.pair(*index, other)).collect::<Vec<_>>()
        };
        let pairs: Vec<Pair> = kept.par_iter().flat_map_iter(of_one).collect();
        self.pairs = pairs.into();
    }

    /// Returns the inner product of two colours, as seen from all directions.
    fn product(&self, a: u32, b: u32) -> f64 {
        let [a, b] = [a, b].map(|index| self.set.harmonics_of(index as usize));
        let dot = |(a, b): (&[f32; 3], &[f32; 3])| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let sum: f32 = a.iter().zip(b).map(dot).sum();
        // The mean of a term's square over all directions.
        f64::from(sum * CONSTANT * CONSTANT) + BACKGROUND * BACKGROUND
    }

    fn merged(&self, a: u32, b: u32) -> Merged {
        let products =
            Products { aa: self.product(a, a), ab: self.product(a, b), bb: self.product(b, b) };
        pair::merge(&self.shapes[a as usize], &self.shapes[b as usize], &products)
    }

    fn pair(&self, a: u32, b: u32) -> Pair {
        let ends = [a.min(b), a.max(b)];
        let of_ends = ends.map(|end| self.counts[end as usize]);
        let areas: f64 = ends.map(|end| self.shapes[end as usize].area()).iter().sum();
        let [first, second] = ends;
        let apart = self.product(first, first) - 2.0 * self.product(first, second)
            + self.product(second, second);
        let count = f64::from(of_ends[0]) + f64::from(of_ends[1]);
        let factor = count * count * (1.0 + COLOR * apart.max(0.0));
        let cost = factor * self.merged(first, second).error / areas.max(f64::MIN_POSITIVE).sqrt();
        Pair { cost: cost as f32, ends, counts: of_ends }
    }

    /// Returns what a Gaussian became part of.
    fn whole(&mut self, index: u32) -> u32 {
        let mut at = index;
        while self.whole[at as usize] != at {
            let above = self.whole[self.whole[at as usize] as usize];
            self.whole[at as usize] = above;
            at = above;
        }
        at
    }

    /// Merges pairs until no more are left than this, or none that is narrower than `widest`: the
    /// full width at half maximum, along the longest axis.
    pub fn reduce(&mut self, count: usize, widest: f64) {
        if self.pairs.is_empty() {
            self.find_pairs();
        }
        while self.left > count.max(1) {
            let Some(Pair { ends, counts, .. }) = self.pairs.pop() else {
                if widest.is_finite() {
                    return;
                }
                // Parts of the scene that are far from each other.
                self.find_pairs();
                continue;
            };
            let is_current = |at: usize| {
                let end = ends[at] as usize;
                self.whole[end] == ends[at] && self.counts[end] == counts[at]
            };
            let is_narrow = || {
                let merged = self.merged(ends[0], ends[1]).shape;
                FULL_WIDTH * eigen(merged.covariance).0[0].max(0.0).sqrt() <= widest
            };
            if is_current(0) && is_current(1) && (widest.is_infinite() || is_narrow()) {
                self.join(ends);
            }
        }
    }

    /// Merges two: the first one is both.
    fn join(&mut self, [a, b]: [u32; 2]) {
        let Merged { shape, part, .. } = self.merged(a, b);
        self.shapes[a as usize] = shape;
        let terms = terms(self.set.degree);
        let (first, second) = self.set.harmonics.split_at_mut(b as usize * terms);
        let colors = first[a as usize * terms..][..terms].iter_mut().zip(&second[..terms]);
        for (color, other) in colors {
            for (value, other) in color.iter_mut().zip(other) {
                *value = (part as f32).mul_add(*value - other, *other);
            }
        }
        self.whole[b as usize] = a;
        self.counts[a as usize] += self.counts[b as usize];
        self.left -= 1;
        let mut near = std::mem::take(&mut self.near[b as usize]);
        near.append(&mut self.near[a as usize]);
        near.iter_mut().for_each(|other| *other = self.whole(*other));
        near.sort_unstable();
        near.dedup();
        near.retain(|&other| other != a);
        let mut pairs: Vec<Pair> = near.iter().map(|&other| self.pair(a, other)).collect();
        // The most expensive ones are left out.
        pairs.sort_unstable_by(|one, other| other.cmp(one));
        pairs.truncate(COUNT);
        self.near[a as usize] = pairs.iter().map(|p| p.ends[usize::from(p.ends[0] == a)]).collect();
        for pair in pairs {
            let other = pair.ends[usize::from(pair.ends[0] == a)];
            self.near[other as usize].push(a);
            self.pairs.push(pair);
        }
    }

    /// Returns what is left.
    pub fn left(&self) -> Gaussians {
        let kept = self.kept();
        let mut set = self.set.chosen(&kept);
        for (at, &index) in kept.iter().enumerate() {
            if self.counts[index as usize] > 1 {
                let Shape { center, covariance, opacity } = self.shapes[index as usize];
                (set.scales[at], set.rotations[at]) = shape_of(covariance);
                set.centers[at] = center.as_vec3();
                set.opacities[at] = opacity as f32;
            }
        }
        set
    }
}

/// Returns the nearest neighbours of each place. Those at one place are neighbours in a row.
fn neighbours(places: &[Vec3]) -> Vec<Vec<u32>> {
    let first = Neighbours::first_of_equals(places);
    let kept: Vec<u32> =
        (0..).zip(&first).filter(|(index, first)| index == *first).map(|(at, _)| at).collect();
    let points: Vec<Vec3> = kept.par_iter().map(|&at| places[at as usize]).collect();
    let mut near = vec![Vec::new(); places.len()];
    if points.len() > 1 {
        let tree = Neighbours::new(&points);
        let of_one = |at: usize| {
            let near = tree.of(at as u32, COUNT).into_iter();
            near.map(|(_, other)| kept[other as usize]).collect::<Vec<_>>()
        };
        let all: Vec<Vec<u32>> = (0..points.len()).into_par_iter().map(of_one).collect();
        for (&at, others) in kept.iter().zip(all) {
            for &other in &others {
                near[other as usize].push(at);
            }
            near[at as usize].extend(others);
        }
    }
    let mut last: Vec<u32> = (0..places.len() as u32).collect();
    for (index, &first) in (0..).zip(&first).filter(|(index, first)| index != *first) {
        let before = std::mem::replace(&mut last[first as usize], index);
        near[before as usize].push(index);
        near[index as usize].push(before);
    }
    for list in &mut near {
        list.sort_unstable();
        list.dedup();
    }
    near
}

/// Merges Gaussians until there are as many as wanted, or those narrower than a distance.
///
/// # Errors
/// [`Error::Memory`](crate::Error::Memory); then the scene is as it was.
pub fn thin(set: &mut Gaussians, thin: &Thin) -> Result<()> {
    let (count, widest) = match *thin {
        Thin::Distance(distance) => (1, distance),
        _ => (thin.count(set.len() as u64) as usize, f64::INFINITY),
    };
    if count < set.len() {
        room(set.len())?;
        let mut reduction = Reduction::new(std::mem::take(set));
        reduction.reduce(count, widest);
        *set = reduction.left();
    }
    Ok(())
}

/// Returns a scene in levels of detail, the scene itself first. Each level has a quarter of the
/// Gaussians of the one before, so that they are about twice as wide.
///
/// # Errors
/// [`Error::Memory`](crate::Error::Memory).
pub fn levels(set: Gaussians) -> Result<Vec<Gaussians>> {
    /// The fewest Gaussians of a merged level.
    const LEAST: usize = 1 << 12;
    let counts = (1..32).map(|level| set.len() >> (2 * level));
    let counts: Vec<usize> = counts.take_while(|&count| count >= LEAST).collect();
    if counts.is_empty() {
        return Ok(vec![set]);
    }
    room(set.len())?;
    let mut reduction = Reduction::new(set.clone());
    let mut levels = vec![set];
    for count in counts {
        reduction.reduce(count, f64::INFINITY);
        levels.push(reduction.left());
    }
    Ok(levels)
}

/// Checks that there is memory to merge so many Gaussians.
fn room(count: usize) -> Result<()> {
    memory::room("merging Gaussians", (MEMORY * count) as u64)
}

//! Stacks: the slices of one volume in order, and the lattice that they lie on.

use super::{
    frames::{Frame, MARKS, Mark},
    head::Head,
};
use crate::volume::{Arrangement, Lattice};
use glam::{DMat3, DVec3};
use std::{cmp::Ordering, sync::Arc};

/// Slices whose distance from an even stack is below this part of a step lie on it.
const EVEN: f64 = 0.05;

/// A slice: the number of its file, and its frame.
#[derive(Clone)]
pub struct Slice {
    pub file: usize,
    pub frame: Frame,
}

/// The slices of one volume, in order.
pub struct Stack {
    pub slices: Vec<Slice>,
    /// What was left out or is uneven, as sentences.
    pub words: Vec<String>,
}

impl Slice {
    /// Returns where the slice lies along the normal of its stack; its order if it says nothing.
    fn depth(&self, normal: DVec3) -> f64 {
        self.frame.position.map_or(self.frame.order, |position| position.dot(normal))
    }
}

/// Returns the stacks of a series: the largest set of parallel slices of one size, divided by time,
/// echo and so on. Localizers and slices across the others are left out.
pub fn stacks(heads: &[Head]) -> Vec<Stack> {
    let mut words = Vec::new();
    let slices = main_slices(heads, &mut words);
    let Some(first) = slices.first() else { return Vec::new() };
    let normal = first.frame.normal();
    let mut parts = Vec::new();
    divide(slices, normal, 0, &mut parts);
    let of = |mut slices: Vec<Slice>| {
        slices.sort_by(|a, b| order(a, b, normal));
        let mut words = words.clone();
        let before = slices.len();
        slices.dedup_by(|later, earlier| is_at_one_place(later, earlier, normal));
        match before - slices.len() {
            0 => {}
            1 => words.push("1 slice lies where another does, and is left out".into()),
            more => words.push(format!("{more} slices lie where others do, and are left out")),
        }
        Stack { slices, words }
    };
    parts.into_iter().map(of).collect()
}

fn order(a: &Slice, b: &Slice, normal: DVec3) -> Ordering {
    let key = |slice: &Slice| [slice.depth(normal), slice.frame.order];
    key(a).partial_cmp(&key(b)).unwrap_or(Ordering::Equal).then(a.file.cmp(&b.file))
}

/// Returns whether two neighbouring slices lie at one place. Slices without a position never do.
fn is_at_one_place(a: &Slice, b: &Slice, normal: DVec3) -> bool {
    let positions = a.frame.position.zip(b.frame.position);
    positions.is_some_and(|(a, b)| (a - b).dot(normal).abs() < 1e-3)
}

/// Returns the largest set of parallel slices of one size.
fn main_slices(heads: &[Head], words: &mut Vec<String>) -> Vec<Slice> {
    let mut groups: Vec<Vec<Slice>> = Vec::new();
    for (file, head) in heads.iter().enumerate() {
        for frame in &head.frames {
            let slice = Slice { file, frame: frame.clone() };
            let fits = |group: &&mut Vec<Slice>| {
                let first = &heads[group[0].file];
                let size = |head: &Head| (head.layout.columns, head.layout.rows);
                size(first) == size(head)
                    && first.layout.channels == head.layout.channels
                    && first.nature.is_localizer == head.nature.is_localizer
                    && group[0].frame.is_parallel(&slice.frame)
            };
            match groups.iter_mut().find(fits) {
                Some(group) => group.push(slice),
                None => groups.push(vec![slice]),
            }
        }
    }
    let all: usize = groups.iter().map(Vec::len).sum();
    let weight = |group: &Vec<Slice>| (!heads[group[0].file].nature.is_localizer, group.len());
    // Of groups that are equal, the first.
    let best = groups.into_iter().rev().max_by_key(weight).unwrap_or_default();
    match all - best.len() {
        0 => {}
        1 => words.push("1 picture of another size or direction is left out".into()),
        more => words.push(format!("{more} pictures of other sizes or directions are left out")),
    }
    best
}

/// Divides slices until no two of a part lie at one place: by the first mark that tells some of
/// them apart, or evenly by their order.
fn divide(mut slices: Vec<Slice>, normal: DVec3, mark: usize, parts: &mut Vec<Vec<Slice>>) {
    slices.sort_by(|a, b| order(a, b, normal));
    let places = slices.chunk_by(|a, b| is_at_one_place(b, a, normal));
    let counts: Vec<usize> = places.map(<[Slice]>::len).collect();
    let (most, least) =
        (counts.iter().max().copied().unwrap_or(0), counts.iter().min().copied().unwrap_or(0));
    let in_time = slices.iter().any(|slice| slice.frame.position.is_none())
        && slices.iter().any(|slice| slice.frame.marks[0] != Mark::None);
    if most <= 1 && !in_time {
        parts.push(slices);
        return;
    }
    for at in mark..MARKS {
        let key = |slice: &Slice| slice.frame.marks[at].clone();
        let mut sorted = slices.clone();
        sorted.sort_by(|a, b| compare(&key(a), &key(b)));
        let groups: Vec<Vec<Slice>> =
            sorted.chunk_by(|a, b| key(a) == key(b)).map(<[Slice]>::to_vec).collect();
        let tells_apart = groups.len() > 1
            && groups.iter().all(|group| {
                in_time || crowded(group, normal) < most && group.len() > counts.len() / 2
            });
        if tells_apart {
            groups.into_iter().for_each(|group| divide(group, normal, at + 1, parts));
            return;
        }
    }
    if most == least && most > 1 {
        for time in 0..most {
            parts.push(slices.iter().skip(time).step_by(most).cloned().collect());
        }
    } else {
        parts.push(slices);
    }
}

/// Returns the most slices at one place.
fn crowded(slices: &[Slice], normal: DVec3) -> usize {
    let mut slices = slices.to_vec();
    slices.sort_by(|a, b| order(a, b, normal));
    let places = slices.chunk_by(|a, b| is_at_one_place(b, a, normal));
    places.map(<[Slice]>::len).max().unwrap_or(0)
}

fn compare(a: &Mark, b: &Mark) -> Ordering {
    match (a, b) {
        (Mark::Number(a), Mark::Number(b)) => a.partial_cmp(b).unwrap_or(Ordering::Equal),
        (Mark::Word(a), Mark::Word(b)) => a.cmp(b),
        (Mark::None, Mark::None) => Ordering::Equal,
        (Mark::None, _) | (Mark::Number(_), Mark::Word(_)) => Ordering::Less,
        _ => Ordering::Greater,
    }
}

impl Stack {
    /// Returns the lattice that the slices lie on: an even one, also sheared, if the slices lie at
    /// even distances along a line, else a rectilinear one. Adds what is uneven to the words.
    ///
    /// Slices whose positions lead away from the normal of their planes, as those of a tilted
    /// gantry, give a sheared lattice. Nothing is resampled.
    pub fn lattice(&mut self, columns: usize, rows: usize) -> Lattice {
        let first = &self.slices[0];
        let [x, y] = first.frame.axes();
        let normal = first.frame.normal();
        let [dx, dy] = first.frame.spacing.unwrap_or([1.0, 1.0]);
        let count = self.slices.len();
        let dims = [columns, rows, count];
        let fallback = first.frame.step.unwrap_or(dx);
        let places: Option<Vec<DVec3>> =
            self.slices.iter().map(|slice| slice.frame.position).collect();
        let places = places.unwrap_or_else(|| {
            let start = first.frame.position.unwrap_or(DVec3::ZERO);
            (0..count).map(|i| start + normal * (fallback * i as f64)).collect()
        });
        let origin = places[0];
        let depths: Vec<f64> = places.iter().map(|place| (*place - origin).dot(normal)).collect();
        let length = depths[count - 1];
        let along = match count {
            1 => normal * fallback,
            _ => (places[count - 1] - origin) / length,
        };
        let axes = |z: DVec3| DMat3::from_cols(x * dx, y * dy, z);
        if count == 1 {
            return Lattice::cartesian(dims, origin, axes(along));
        }
        self.tell_displaced(&places, along, dx.min(dy));
        let step = length / (count - 1) as f64;
        let is_even =
            depths.iter().enumerate().all(|(i, d)| (d - step * i as f64).abs() < EVEN * step);
        if is_even {
            return Lattice::cartesian(dims, origin, axes(along * step));
        }
        self.tell_uneven(&depths, normal);
        let even = |n: usize| (0..n).map(|i| i as f64).collect();
        let coordinates = [even(columns), even(rows), depths];
        let arrangement = Arrangement::Rectilinear(Arc::new(coordinates));
        Lattice { dims, origin, axes: axes(along), arrangement }
    }

    /// Says how far slices lie from the line through the first and the last.
    fn tell_displaced(&mut self, places: &[DVec3], along: DVec3, pixel: f64) {
        let normal = self.slices[0].frame.normal();
        let far = |place: &DVec3| {
            let offset = *place - places[0];
            (offset - along * offset.dot(normal)).length()
        };
        let most = places.iter().map(far).fold(0.0, f64::max);
        if most > 0.5 * pixel {
            self.words.push(format!(
                "slices lie up to {most:.1} beside a straight line, and are drawn on it"
            ));
        }
    }

    /// Says where slices are missing, or that their distances differ.
    fn tell_uneven(&mut self, depths: &[f64], normal: DVec3) {
        let gaps: Vec<f64> = depths.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = gaps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[sorted.len() / 2];
        let missing = |gap: f64| {
            let steps = (gap / usual).round();
            let is_whole = (gap / usual - steps).abs() < 0.1;
            if is_whole && steps >= 2.0 { steps as usize - 1 } else { 0 }
        };
        let is_usual = |gap: f64| (gap / usual - 1.0).abs() < 0.1;
        let count: usize = gaps.iter().map(|&gap| missing(gap)).sum();
        if count > 0 && gaps.iter().all(|&gap| is_usual(gap) || missing(gap) > 0) {
            let at = gaps.iter().position(|&gap| missing(gap) > 0).unwrap_or(0);
            let start = self.slices[0].depth(normal);
            let (from, to) = (start + depths[at], start + depths[at + 1]);
            let (are, more) = match count {
                1 => ("1 slice is".to_owned(), ""),
                _ => (format!("{count} slices are"), ", and elsewhere"),
            };
            let more =
                if gaps.iter().filter(|&&gap| missing(gap) > 0).count() > 1 { more } else { "" };
            self.words.push(format!(
                "{are} missing, between {from:.2} and {to:.2} along the axis{more}; the gap is \
                 filled from its neighbours"
            ));
        } else {
            let (least, most) = (sorted[0], sorted[sorted.len() - 1]);
            self.words.push(format!(
                "the distances between slices are {least:.2} to {most:.2}; each is drawn where it \
                 lies"
            ));
        }
    }
}

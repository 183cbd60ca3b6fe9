//! Fewer points, evenly spread: none is nearer to another than a distance (Poisson discs).
//!
//! Points are visited in their order. A point is kept if no point kept before it is within the
//! distance. For a wanted count, the distance is found by trying.

use crate::{Error, Result, memory};
use glam::{IVec3, Vec3};
use std::str::FromStr;

/// How many points are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Thin {
    /// No two are nearer to each other than this, in world units. Of splats: those narrower than
    /// this are merged.
    Distance(f64),
    /// This many, or all if there are fewer.
    Count(u64),
    /// This share of them, above 0 and at most 1.
    Share(f64),
}

impl FromStr for Thin {
    type Err = String;

    /// Reads a distance in world units (`0.05` or `2m`), a count (`100000pts`), or a share (`10%`).
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        const FORM: &str = "the form is a distance such as 0.05, a share such as 10%, or a number \
                            of points such as 100000pts";
        let number = |text: &str| {
            let number = text.trim().parse().ok();
            number.filter(|number: &f64| *number > 0.0 && number.is_finite()).ok_or(FORM)
        };
        if let Some(share) = text.strip_suffix('%') {
            let share = number(share)? / 100.0;
            return if share <= 1.0 { Ok(Self::Share(share)) } else { Err(FORM.into()) };
        }
        if let Some(count) = text.strip_suffix("pts") {
            let count = number(count)?;
            return if count >= 1.0 { Ok(Self::Count(count as u64)) } else { Err(FORM.into()) };
        }
        Ok(Self::Distance(number(text)?))
    }
}

/// The name of this module's work in errors.
const WORK: &str = "thinning points";

/// Bytes of memory for each kept point.
const OF_KEPT: u64 = 40;

/// How many more points than wanted a distance may keep, as a part of those wanted. The surplus is
/// left out evenly.
const SURPLUS: f64 = 0.02;

/// The most distances that are tried.
const TRIES: usize = 24;

impl Thin {
    /// Returns which of these points are kept.
    ///
    /// # Errors
    /// [`Error::Memory`]; [`Error::Argument`] for distances that 32 bits do not hold.
    pub(super) fn kept(&self, places: &[Vec3]) -> Result<Vec<bool>> {
        let wanted = match self {
            Self::Distance(distance) => {
                let mut discs = Discs::new(*distance)?;
                return Ok(places.iter().map(|place| discs.keep(*place)).collect());
            }
            _ => self.count(places.len() as u64),
        };
        if wanted >= places.len() as u64 {
            return Ok(vec![true; places.len()]);
        }
        memory::room(WORK, OF_KEPT.saturating_mul(wanted))?;
        let mut kept = spread(places, wanted);
        let surplus = kept.iter().filter(|kept| **kept).count() as u64 - wanted;
        leave_out(&mut kept, surplus);
        Ok(kept)
    }

    /// Returns the number to keep of these many; all for a distance.
    pub(super) fn count(&self, all: u64) -> u64 {
        match self {
            Self::Distance(_) => all,
            Self::Count(count) => all.min(*count),
            Self::Share(share) => ((all as f64 * share).round() as u64).max(1),
        }
    }
}

/// Returns the discs that keep at least the wanted number of points, and only a few more.
fn spread(places: &[Vec3], wanted: u64) -> Vec<bool> {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = places.iter().fold(none, |(low, high), at| (low.min(*at), high.max(*at)));
    let most = (wanted as f64 * (1.0 + SURPLUS)) as u64;
    // Distances that keep too many and too few points. Without any, all points are kept.
    let mut ends = [(0.0, places.len() as u64), (f64::from((high - low).length()), 1)];
    let mut best: Option<Vec<bool>> = None;
    // The points of a surface fill an area.
    let mut distance = ends[1].0 / (wanted as f64).sqrt();
    for _ in 0..TRIES {
        let Ok(mut discs) = Discs::new(distance) else { break };
        let mut count = 0;
        let mut kept = vec![false; places.len()];
        for (kept, place) in kept.iter_mut().zip(places) {
            *kept = discs.keep(*place);
            count += u64::from(*kept);
            // Where far too many are kept, the rest need not be tried.
            if count > 4 * wanted {
                break;
            }
        }
        if count > 4 * wanted {
            ends[0].0 = distance;
            distance = between(ends[0].0, ends[1].0, distance * 2.0);
            continue;
        }
        let is_enough = count >= wanted;
        ends[usize::from(!is_enough)] = (distance, count);
        if is_enough {
            best = Some(kept);
            if count <= most {
                break;
            }
        }
        // Counts fall with about the square of the distance.
        let guess = distance * (count as f64 / (wanted as f64 * (1.0 + 0.5 * SURPLUS))).sqrt();
        distance = between(ends[0].0, ends[1].0, guess);
    }
    best.unwrap_or_else(|| vec![true; places.len()])
}

/// Returns a guess if it lies between two distances, or else their mean.
fn between(low: f64, high: f64, guess: f64) -> f64 {
    if guess > low && guess < high { guess } else { 0.5 * (low + high) }
}

/// Leaves out this many of the kept points, spread over all.
fn leave_out(kept: &mut [bool], surplus: u64) {
    let all = kept.iter().filter(|kept| **kept).count() as u64;
    let mut rank = 0;
    for kept in kept.iter_mut().filter(|kept| **kept) {
        // Ranks at which the share of those left out passes a whole number.
        let passes = |rank: u64| (u128::from(rank) * u128::from(surplus) / u128::from(all)) as u64;
        *kept = passes(rank + 1) == passes(rank);
        rank += 1;
    }
}

/// No more places in a list.
const END: u32 = u32::MAX;

/// The points kept so far, by the cells of a grid as wide as the distance.
pub(super) struct Discs {
    distance: f32,
    cells: Cells,
    places: Vec<Vec3>,
    /// The next point in the cell of each.
    next: Vec<u32>,
}

impl Discs {
    /// # Errors
    /// [`Error::Argument`] for a distance that 32 bits do not hold.
    pub fn new(distance: f64) -> Result<Self> {
        if !(distance as f32).is_normal() || !((distance * distance) as f32).is_normal() {
            return Err(Error::Argument(format!("points cannot be {distance} apart")));
        }
        let (cells, places, next) = (Cells::new(), Vec::new(), Vec::new());
        Ok(Self { distance: distance as f32, cells, places, next })
    }

    /// Returns whether a point is far enough from all kept before, and keeps it then.
    pub fn keep(&mut self, place: Vec3) -> bool {
        let scaled = place / self.distance;
        let cell = scaled.floor();
        let inside = scaled - cell;
        let cell = cell.as_ivec3();
        // The point's own cell is the likeliest to hold a near one.
        if self.is_near(cell, place) {
            return false;
        }
        let mut near = self.around(cell, inside).into_iter().flatten();
        if near.any(|cell| self.is_near(cell, place)) {
            return false;
        }
        let head = self.cells.entry(key(cell));
        self.next.push(std::mem::replace(head, self.places.len() as u32));
        self.places.push(place);
        true
    }

    /// Returns the cells around one that a disc reaches whose centre lies at `inside`, from 0 to 1.
    fn around(&self, cell: IVec3, inside: Vec3) -> [Option<IVec3>; 26] {
        let mut all = [None; 26];
        let mut at = 0;
        for z in -1..=1 {
            for y in -1..=1 {
                for x in -1..=1 {
                    let step = IVec3::new(x, y, z);
                    if step == IVec3::ZERO {
                        continue;
                    }
                    let gap = |step: i32, inside: f32| match step {
                        -1 => inside,
                        1 => 1.0 - inside,
                        _ => 0.0,
                    };
                    let gap = Vec3::new(gap(x, inside.x), gap(y, inside.y), gap(z, inside.z));
                    // A margin, because places are rounded.
                    if gap.length_squared() <= 1.001 {
                        all[at] = Some(cell.wrapping_add(step));
                    }
                    at += 1;
                }
            }
        }
        all
    }

    fn is_near(&self, cell: IVec3, place: Vec3) -> bool {
        let most = self.distance * self.distance;
        let mut at = self.cells.get(key(cell));
        while at != END {
            if self.places[at as usize].distance_squared(place) < most {
                return true;
            }
            at = self.next[at as usize];
        }
        false
    }
}

/// Returns a number of a cell. Two cells may have the same: then both are searched.
fn key(cell: IVec3) -> u64 {
    let [x, y, z] = cell.to_array().map(|part| u64::from(part as u32));
    let mixed = x.wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(21)
        ^ z.wrapping_mul(0x1656_67b1_9e37_79f9).rotate_left(42);
    // The lowest bits choose the place in the table.
    (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 7 | 1
}

/// A table from keys above 0 to the first point of each.
struct Cells {
    keys: Vec<u64>,
    heads: Vec<u32>,
    used: usize,
}

impl Cells {
    fn new() -> Self {
        Self { keys: vec![0; 64], heads: vec![END; 64], used: 0 }
    }

    fn slot(keys: &[u64], key: u64) -> usize {
        let mask = keys.len() - 1;
        let mut at = key as usize & mask;
        while keys[at] != key && keys[at] != 0 {
            at = (at + 1) & mask;
        }
        at
    }

    fn get(&self, key: u64) -> u32 {
        self.heads[Self::slot(&self.keys, key)]
    }

    fn entry(&mut self, key: u64) -> &mut u32 {
        if 8 * (self.used + 1) > 5 * self.keys.len() {
            self.grow();
        }
        let at = Self::slot(&self.keys, key);
        self.used += usize::from(self.keys[at] == 0);
        self.keys[at] = key;
        &mut self.heads[at]
    }

    fn grow(&mut self) {
        let (mut keys, mut heads) = (vec![0; 2 * self.keys.len()], vec![END; 2 * self.keys.len()]);
        for (key, head) in self.keys.iter().zip(&self.heads).filter(|(key, _)| **key != 0) {
            let at = Self::slot(&keys, *key);
            (keys[at], heads[at]) = (*key, *head);
        }
        (self.keys, self.heads) = (keys, heads);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a bumpy sheet, without an order.
    fn sheet(count: usize) -> Vec<Vec3> {
        let part = |index: usize, by: f64| ((index as f64 * by).fract() * 10.0) as f32;
        let point = |index: usize| {
            let (x, y) = (part(index, 0.754_877_666), part(index, 0.569_840_291));
            Vec3::new(x - 5.0, y - 5.0, x.sin() * y.cos())
        };
        (0..count).map(point).collect()
    }

    fn chosen(places: &[Vec3], kept: &[bool]) -> Vec<Vec3> {
        places.iter().zip(kept).filter(|(_, kept)| **kept).map(|(place, _)| *place).collect()
    }

    #[test]
    fn no_two_are_near_and_every_point_has_one_near() {
        let places = sheet(5000);
        for distance in [0.05, 0.4, 3.0] {
            let kept = chosen(&places, &Thin::Distance(distance).kept(&places).unwrap());
            let least = (distance * distance) as f32;
            for (index, one) in kept.iter().enumerate() {
                let is_far = |other: &Vec3| one.distance_squared(*other) >= least;
                assert!(kept[..index].iter().all(is_far), "{distance}: {one}");
            }
            let has_near = |place: &Vec3| kept.iter().any(|k| k.distance_squared(*place) < least);
            assert!(places.iter().all(has_near), "{distance}");
        }
    }

    #[test]
    fn counts_and_shares_are_exact() {
        let places = sheet(20_000);
        for wanted in [1, 10, 777, 10_000, 19_999] {
            let kept = chosen(&places, &Thin::Count(wanted).kept(&places).unwrap());
            assert_eq!(kept.len() as u64, wanted);
        }
        let kept = chosen(&places, &Thin::Share(0.1).kept(&places).unwrap());
        assert_eq!(kept.len(), 2000);
        // They are evenly spread: a random choice has points at a hundredth of this distance.
        let nearest = |at: usize| {
            let others = kept.iter().enumerate().filter(|(other, _)| *other != at);
            others.map(|(_, other)| other.distance(kept[at])).fold(f32::INFINITY, f32::min)
        };
        let least = (0..kept.len()).map(nearest).fold(f32::INFINITY, f32::min);
        assert!(least > 0.12, "{least}");
        assert_eq!(Thin::Count(30_000).kept(&places).unwrap(), [true; 20_000]);
        // Points at one place cannot be spread.
        let same = vec![Vec3::ONE; 100];
        assert_eq!(chosen(&same, &Thin::Count(7).kept(&same).unwrap()).len(), 7);
    }

    #[test]
    fn texts_are_read() {
        assert_eq!("0.05".parse(), Ok(Thin::Distance(0.05)));
        assert_eq!("10 %".parse(), Ok(Thin::Share(0.1)));
        assert_eq!("1e5pts".parse(), Ok(Thin::Count(100_000)));
        for bad in ["0", "-1", "x", "110%", "0.5pts", "", "nan"] {
            let message = bad.parse::<Thin>().unwrap_err();
            assert!(message.contains("100000pts"), "{bad}: {message}");
        }
    }
}

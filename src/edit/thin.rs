//! Fewer points, evenly spread: none is nearer to another than a distance (Poisson discs).
//!
//! Points are visited in their order. A point is kept if no point kept before it is within the
//! distance. For a wanted count, the distance is found by trying.

use crate::{Error, Result, memory};
use glam::{IVec3, UVec3, Vec3};
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

/// Bytes of memory for each kept point of one slab: its cell, in a table that may have just been
/// doubled.
const OF_KEPT: u64 = 110;

/// How many more points than wanted a distance may keep, as a part of those wanted. The surplus is
/// left out evenly.
const SURPLUS: f64 = 0.05;

/// The most distances that are tried.
const TRIES: usize = 24;

/// Points on which a distance is tried before it is on all: those in some blocks of space.
const SAMPLE: usize = 1 << 20;

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
        let Found { mut kept, .. } = spread(places, wanted);
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
fn spread(places: &[Vec3], wanted: u64) -> Found {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = places.iter().fold(none, |(low, high), at| (low.min(*at), high.max(*at)));
    let size = high - low;
    let edge = (size.max_element() / BLOCKS as f32).max(f32::MIN_POSITIVE);
    let blocks = Blocks { low, edge, along: size.max_position() };
    // Block by block, the cells around a point are in the processor's cache.
    let order = &blocks.order(places);
    // The points of a surface fill an area.
    let mut guess = f64::from(size.length()) / (wanted as f64).sqrt();
    let largest = f64::from(size.length());
    let every = places.len().div_ceil(SAMPLE) as u32;
    if every > 1 {
        let is_in =
            |at: &&u32| blocks.of(places[**at as usize]).wrapping_mul(HASH).is_multiple_of(every);
        let sample: Vec<u32> = order.iter().filter(is_in).copied().collect();
        if sample.len() > SAMPLE / 4 {
            let share = sample.len() as f64 / places.len() as f64;
            let of_sample = (wanted as f64 * share).ceil() as u64;
            guess = search((places, &blocks), &sample, of_sample, [guess, largest]).distance;
        }
    }
    search((places, &blocks), order, wanted, [guess, largest])
}

/// Blocks of space, in a grid of slabs. What was kept two slabs before is not needed any more.
struct Blocks {
    low: Vec3,
    edge: f32,
    /// The axis along which slabs follow each other: the longest.
    along: usize,
}

/// Blocks along the longest side of all points.
const BLOCKS: u32 = 64;

/// Mixes the numbers of blocks.
const HASH: u32 = 0x9e37_79b1;

impl Blocks {
    /// Returns the number of a point's block.
    fn of(&self, place: Vec3) -> u32 {
        let cell = ((place - self.low) / self.edge).as_uvec3().min(UVec3::splat(BLOCKS - 1));
        let [slab, row, column] = [0, 1, 2].map(|step| cell[(self.along + step) % 3]);
        (slab * BLOCKS + row) * BLOCKS + column
    }

    /// Returns the number of the slab that a block lies in.
    fn slab(block: u32) -> u32 {
        block / (BLOCKS * BLOCKS)
    }

    /// Returns the indices of points, block by block. In a block they keep their order.
    fn order(&self, places: &[Vec3]) -> Vec<u32> {
        let mut starts = vec![0u32; (BLOCKS * BLOCKS * BLOCKS) as usize + 1];
        places.iter().for_each(|place| starts[self.of(*place) as usize + 1] += 1);
        for block in 1..starts.len() {
            starts[block] += starts[block - 1];
        }
        let mut order = vec![0; places.len()];
        for (place, index) in places.iter().zip(0..) {
            let next = &mut starts[self.of(*place) as usize];
            order[*next as usize] = index;
            *next += 1;
        }
        order
    }
}

/// A distance that keeps enough points and few more.
struct Found {
    distance: f64,
    /// Which of all points it keeps.
    kept: Vec<bool>,
    /// The number of distances that were tried.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests count them"))]
    tries: usize,
}

/// Tries distances of some points, from a guess on and below a largest one.
fn search(
    (places, blocks): (&[Vec3], &Blocks),
    order: &[u32],
    wanted: u64,
    [guess, largest]: [f64; 2],
) -> Found {
    let most = (wanted as f64 * (1.0 + SURPLUS)) as u64;
    let mut trials = Trials::new(wanted as f64 * (1.0 + 0.5 * SURPLUS), 2.0 * largest);
    let mut kept = vec![false; places.len()];
    let (mut distance, mut tries) = (guess, 0);
    while tries < TRIES && !trials.is_narrow() {
        let Some(count) = keep((places, blocks), order, distance, 4 * wanted, &mut kept) else {
            break;
        };
        tries += 1;
        if (wanted..=most).contains(&count) {
            return Found { distance, kept, tries };
        }
        distance = trials.next(distance, count, count <= 4 * wanted);
    }
    // Without a distance, all are kept.
    let [best, _] = trials.ends;
    if keep((places, blocks), order, best, u64::MAX, &mut kept).is_none() {
        order.iter().for_each(|at| kept[*at as usize] = true);
    }
    Found { distance: best, kept, tries }
}

/// Distances that were tried.
struct Trials {
    wanted: f64,
    /// A distance that keeps too many, and one that keeps too few.
    ends: [f64; 2],
    /// The logarithms of the last distance and of its count, unless counting ended early.
    last: Option<[f64; 2]>,
    count: usize,
}

/// The powers of the distance with which counts may fall.
const FALL: [f64; 2] = [0.5, 16.0];

/// Between distances that are so near to each other, the count jumps: points of a grid are all as
/// far apart.
const NARROW: f64 = 1.01;

impl Trials {
    fn new(wanted: f64, largest: f64) -> Self {
        Self { wanted, ends: [0.0, largest], last: None, count: 0 }
    }

    fn is_narrow(&self) -> bool {
        self.ends[1] < NARROW * self.ends[0]
    }

    /// Adds a distance with its count, and returns the one to try next. `is_whole` says that all
    /// were counted.
    fn next(&mut self, distance: f64, count: u64, is_whole: bool) -> f64 {
        self.ends[usize::from((count as f64) < self.wanted)] = distance;
        self.count += 1;
        let here = [distance.ln(), (count as f64).max(1.0).ln()];
        // Of points on a surface, counts fall with the square of the distance. Where it is hardly
        // larger than the points are apart already, they fall otherwise.
        let fall = self.last.map_or(2.0, |last| (last[1] - here[1]) / (here[0] - last[0]));
        let fall = if fall.is_finite() { fall.clamp(FALL[0], FALL[1]) } else { 2.0 };
        self.last = is_whole.then_some(here);
        let [low, high] = self.ends;
        // Every third time, the range is halved.
        if low > 0.0 && self.count.is_multiple_of(3) {
            return (low * high).sqrt();
        }
        between(low, high, distance * (count as f64 / self.wanted).powf(1.0 / fall))
    }
}

/// Marks the points that a distance keeps, until there are more than some. Returns their number;
/// `None` for a distance that 32 bits do not hold. The order is that of the blocks.
fn keep(
    (places, blocks): (&[Vec3], &Blocks),
    order: &[u32],
    distance: f64,
    most: u64,
    kept: &mut [bool],
) -> Option<u64> {
    let mut discs = Discs::new(distance).ok()?;
    let (mut count, mut slab) = (0, 0);
    for at in order {
        let at = *at as usize;
        let next = Blocks::slab(blocks.of(places[at]));
        if next > slab && blocks.edge > discs.distance {
            let start = blocks.low[blocks.along] + next as f32 * blocks.edge;
            discs.enter((blocks.along, start), next == slab + 1);
            slab = next;
        }
        kept[at] = discs.keep(places[at]);
        count += u64::from(kept[at]);
        if count > most {
            break;
        }
    }
    Some(count)
}

/// Returns a guess if it lies between two distances, or else their mean.
fn between(low: f64, high: f64, guess: f64) -> f64 {
    if guess > low && guess < high { guess } else { 0.5 * (low + high) }
}

/// Leaves out this many of the kept points, spread over all.
fn leave_out(kept: &mut [bool], surplus: u64) {
    let all = kept.iter().filter(|kept| **kept).count() as u64;
    // Ranks at which the share of those left out passes a whole number.
    let passed = |rank: u64| (u128::from(rank) * u128::from(surplus) / u128::from(all)) as u64;
    for (kept, rank) in kept.iter_mut().filter(|kept| **kept).zip(0..) {
        *kept = passed(rank + 1) == passed(rank);
    }
}

/// The points kept so far, by the cells of a grid as wide as the distance.
pub(super) struct Discs {
    distance: f32,
    cells: Cells,
    /// Those of the slab before, and from where on along which axis none of them is near. What was
    /// kept before that is forgotten.
    behind: Option<(Cells, usize, f32)>,
}

impl Discs {
    /// # Errors
    /// [`Error::Argument`] for a distance that 32 bits do not hold.
    pub fn new(distance: f64) -> Result<Self> {
        if !(distance as f32).is_normal() || !((distance * distance) as f32).is_normal() {
            return Err(Error::Argument(format!("points cannot be {distance} apart")));
        }
        let distance = distance as f32;
        Ok(Self { distance, cells: Cells::new(distance, FEWEST), behind: None })
    }

    /// Begins a slab of space, thicker than the distance, from this place on along this axis. No
    /// point comes before it any more. `is_next` says that it touches the slab before.
    fn enter(&mut self, (axis, start): (usize, f32), is_next: bool) {
        let slots = self.cells.slots.len();
        let before = std::mem::replace(&mut self.cells, Cells::new(self.distance, slots));
        // A margin, because places are rounded.
        self.behind = is_next.then_some((before, axis, start + 1.001 * self.distance));
    }

    /// Whether a cell holds a point that is nearer to a place than the root of `least`.
    fn has_near(&self, key: u64, place: Vec3, least: f32) -> bool {
        let is_behind = |(cells, axis, end): &(Cells, usize, f32)| {
            place[*axis] < *end && cells.has_near(key, place, least)
        };
        self.cells.has_near(key, place, least) || self.behind.as_ref().is_some_and(is_behind)
    }

    /// Returns whether a point is far enough from all kept before, and keeps it then.
    pub fn keep(&mut self, place: Vec3) -> bool {
        let scaled = place / self.distance;
        let corner = scaled.floor();
        let (inside, cell) = (scaled - corner, corner.as_ivec3());
        let least = self.distance * self.distance;
        // The point's own cell is the likeliest to hold a near one.
        if self.has_near(key(cell), place, least) {
            return false;
        }
        // The sides to which the point is nearer come first.
        let toward = inside.map(|part| if part < 0.5 { -1.0 } else { 1.0 }).as_ivec3();
        let near = inside.min(1.0 - inside);
        for steps in STEPS {
            let gap = |step: i32, near: f32| match step {
                0 => 0.0,
                1 => near,
                _ => 1.0 - near,
            };
            let [x, y, z] = steps;
            let gap = Vec3::new(gap(x, near.x), gap(y, near.y), gap(z, near.z));
            // A margin, because places are rounded.
            if gap.length_squared() > 1.001 {
                continue;
            }
            let cell = cell.wrapping_add(toward * IVec3::from_array(steps));
            if self.has_near(key(cell), place, least) {
                return false;
            }
        }
        self.cells.put(key(cell), place);
        true
    }
}

/// The steps to the cells around one, in units of the side to which a point is nearer: those that
/// are likelier to hold a near point first.
const STEPS: [[i32; 3]; 26] = {
    let mut steps = [[0; 3]; 26];
    let mut at = 0;
    // By the number of steps back, then by the number of all steps.
    let mut rank = 1;
    while rank < 16 {
        let mut index = 0;
        while index < 27 {
            let step = [index % 3, index / 3 % 3, index / 9];
            let (mut back, mut all, mut axis) = (0, 0, 0);
            while axis < 3 {
                back += (step[axis] == 2) as usize;
                all += (step[axis] != 0) as usize;
                axis += 1;
            }
            if 4 * back + all == rank {
                let mut signed = [0; 3];
                axis = 0;
                while axis < 3 {
                    signed[axis] = if step[axis] == 2 { -1 } else { step[axis] };
                    axis += 1;
                }
                steps[at] = signed;
                at += 1;
            }
            index += 1;
        }
        rank += 1;
    }
    steps
};

/// Returns a number of a cell. Two cells may have the same: then both are searched.
fn key(cell: IVec3) -> u64 {
    let [x, y, z] = cell.to_array().map(|part| u64::from(part as u32));
    let mixed = x.wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f).rotate_left(21)
        ^ z.wrapping_mul(0x1656_67b1_9e37_79f9).rotate_left(42);
    // The lowest bits choose the place in the table.
    ((mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 7) + 1
}

/// Some points of one cell, in half a line of the processor's cache.
#[derive(Clone, Copy, Default)]
#[repr(align(32))]
struct Slot {
    /// A part of the cell's number; 0 for an unused slot.
    tag: u32,
    count: u32,
    places: [[f32; 3]; IN_SLOT],
}

const IN_SLOT: usize = 2;

/// Slots of a table at first.
const FEWEST: usize = 64;

/// A table of slots. A cell with more points than a slot holds has several. At most half of the
/// slots are used, so that cells without points are soon known to be.
struct Cells {
    distance: f32,
    slots: Vec<Slot>,
    used: usize,
}

impl Cells {
    /// An empty table of a power of two of slots.
    fn new(distance: f32, slots: usize) -> Self {
        Self { distance, slots: vec![Slot::default(); slots], used: 0 }
    }

    /// Returns the cell of a place.
    fn cell(&self, place: Vec3) -> IVec3 {
        (place / self.distance).floor().as_ivec3()
    }

    fn has_near(&self, key: u64, place: Vec3, least: f32) -> bool {
        let mask = self.slots.len() - 1;
        let (mut at, tag) = (key as usize & mask, tag(key));
        loop {
            let slot = &self.slots[at];
            if slot.tag == 0 {
                return false;
            }
            if slot.tag == tag {
                let places = &slot.places[..slot.count as usize];
                if places.iter().any(|o| Vec3::from(*o).distance_squared(place) < least) {
                    return true;
                }
            }
            at = (at + 1) & mask;
        }
    }

    fn put(&mut self, key: u64, place: Vec3) {
        if 2 * (self.used + 1) > self.slots.len() {
            let larger = vec![Slot::default(); 2 * self.slots.len()];
            self.used = 0;
            for slot in std::mem::replace(&mut self.slots, larger) {
                for place in &slot.places[..slot.count as usize] {
                    let place = Vec3::from(*place);
                    self.put(self::key(self.cell(place)), place);
                }
            }
        }
        let tag = tag(key);
        let at = self.free(key, |slot| slot.tag == tag && (slot.count as usize) < IN_SLOT);
        let slot = &mut self.slots[at];
        self.used += usize::from(slot.tag == 0);
        slot.tag = tag;
        slot.places[slot.count as usize] = place.to_array();
        slot.count += 1;
    }

    /// Returns the first slot for a key that is unused, or that has room.
    fn free(&self, key: u64, has_room: impl Fn(&Slot) -> bool) -> usize {
        let mask = self.slots.len() - 1;
        let mut at = key as usize & mask;
        while self.slots[at].tag != 0 && !has_room(&self.slots[at]) {
            at = (at + 1) & mask;
        }
        at
    }
}

/// Returns a part of a cell's number that is never 0.
fn tag(key: u64) -> u32 {
    (key >> 25) as u32 | 1
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
        // They are evenly spread, also where a slab ends: a random choice has points at a hundredth
        // of this distance.
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
    fn few_distances_are_tried() {
        let part = |index: usize, by: f64| (index as f64 * by).fract() as f32 - 0.5;
        // From a grid, whose points are kept by jumps, to points without an order.
        for noise in [0.0, 0.1, 0.5, 20.0] {
            let place = |index: usize| {
                let grid = Vec3::new((index % 200) as f32, (index / 200) as f32, 0.0);
                grid + noise * Vec3::new(part(index, 0.754_877_7), part(index, 0.569_840_3), 0.0)
            };
            let places: Vec<Vec3> = (0..40_000).map(place).collect();
            let mut all = 0;
            for wanted in [100, 1000, 5000, 9000, 12_000, 20_000, 30_000] {
                let Found { kept, tries, .. } = spread(&places, wanted);
                let count = kept.iter().filter(|kept| **kept).count() as u64;
                assert!(count >= wanted, "{noise}: {count} of {wanted}");
                all += tries;
            }
            assert!(all <= 60, "{noise}: {all} tries");
        }
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

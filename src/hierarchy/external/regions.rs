//! Regions with about equally many points each: ranges of cells along the space-filling curve of
//! Morton (1966).
//!
//! Cells are subdivided until none contains more points than a region may, so that crowded points
//! are split as evenly as others. Only points at the same position, or nearly, stay together
//! however many there are.

use super::{
    super::partition::{Cube, FINE_BITS, fine_cell, fine_key_of},
    field::check,
};
use crate::Result;
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// Bits of a fine key below those of a coarse cell.
const BELOW_COARSE: u32 = 3 * (FINE_BITS - 7);
/// The number of coarse cells.
pub const CELLS: u64 = 1 << (3 * FINE_BITS - BELOW_COARSE);
/// Bits by which a cell is subdivided at a time.
const CUT: u32 = 12;
/// How far the neighbours of a point may be, in mean spacings of the points in its cell. Their
/// spacing is estimated as on a surface …
const REACH_ON_SURFACE: f32 = 6.0;
/// … and as in a solid, and the larger distance counts.
const REACH_IN_SOLID: f32 = 2.0;
/// The cell used is the smallest with at least this many points.
const ENOUGH: u64 = 64;
/// Distance to the sixth neighbour, by which points are judged, in mean spacings. For random points
/// on a surface with one point per unit area, the sixth lies in a circle of area 6 around a point.
const SIXTH: f32 = 1.382;
/// In the table of coarse cells: the cell is split among several regions.
const SEVERAL: u32 = u32::MAX;

/// The regions of the points in a cube.
pub struct Regions {
    cube: Cube,
    ranges: Ranges,
    /// The region of each coarse cell.
    coarse: Vec<u32>,
    /// How far the neighbours of the points in each coarse cell may be. Negative for subdivided
    /// cells, whose reach is in `cut`.
    reach: Vec<f32>,
    cut: BTreeMap<u64, f32>,
    /// The largest reach.
    farthest: f32,
}

/// Where regions begin, and what they hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ranges {
    /// The first key of each region.
    pub starts: Vec<u64>,
    /// The number of points in each.
    pub points: Vec<u64>,
    /// Approximate median distance to the neighbour by which points are judged, estimated as on a
    /// surface.
    pub spacing: f32,
}

impl Ranges {
    /// Checks the regions of this many points in a box.
    pub fn check(&self, points: u64, [low, high]: [Vec3; 2]) -> Result<(), String> {
        let Self { starts, points: counts, spacing } = self;
        let regions = starts.len();
        check(
            regions > 0 && u32::try_from(regions).is_ok(),
            "starts",
            regions,
            "no number of them",
        )?;
        check(starts[0] == 0, "starts[0]", starts[0], "0 is expected")?;
        if let Some(at) = (1..regions).find(|&at| starts[at] <= starts[at - 1]) {
            return check(false, format!("starts[{at}]"), starts[at], "they must ascend");
        }
        let last = starts[regions - 1];
        let end = 1u64 << (3 * FINE_BITS);
        check(last < end, format!("starts[{}]", regions - 1), last, format!("{end} is the end"))?;
        let wanted = format!("there are {regions} regions");
        check(counts.len() == regions, "the number of points", counts.len(), wanted)?;
        let sum: u128 = counts.iter().copied().map(u128::from).sum();
        check(sum == points.into(), "the sum of points", sum, format!("{points} are expected"))?;
        // Points at one place have none.
        let is_length = *spacing >= 0.0 && spacing.is_finite();
        let is_small = Cube::around(low, high).edge() < 1e-30;
        check(
            is_length && (*spacing > 0.0 || points == 0 || is_small),
            "spacing",
            spacing,
            "a length above 0 is expected",
        )
    }

    /// Checks how far the neighbours of points in a box may be.
    pub fn check_reaches(&self, [low, high]: [Vec3; 2], reaches: &[Reach]) -> Result<(), String> {
        let (regions, edge) = (self.starts.len(), Cube::around(low, high).edge());
        let wanted = format!("there are {regions} regions");
        check(
            reaches.is_empty() == (regions == 1),
            "the number of reaches",
            reaches.len(),
            wanted,
        )?;
        let is_sound = |Reach { start, below, reach }: &Reach| {
            let is_whole = *below == BELOW_COARSE && start.is_multiple_of(1 << BELOW_COARSE);
            *start < 1 << (3 * FINE_BITS)
                && (is_whole || *below == 0)
                && *reach >= 0.0
                && *reach <= edge * 1.001
        };
        match reaches.iter().find(|reach| !is_sound(reach)) {
            Some(reach) => check(false, "a reach", reach, "it is of no cell, or too far"),
            None => Ok(()),
        }
    }
}

/// How far the neighbours of the points in a cell may be.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Reach {
    start: u64,
    /// `BELOW_COARSE` for a whole coarse cell; less for a cell inside one.
    below: u32,
    reach: f32,
}

/// A cell that is not subdivided further.
pub struct Cell {
    start: u64,
    /// The number of key bits below the cell's own.
    below: u32,
    count: u64,
}

impl Regions {
    /// Splits the cube into cells of at most `most` points, as far as they lie apart. `pass` calls
    /// its argument with the fine keys of all points, in parts.
    pub fn count_cells(
        most: u64,
        mut pass: impl FnMut(&mut dyn FnMut(&[u64])) -> Result<()>,
    ) -> Result<Vec<Cell>> {
        let mut coarse = vec![0u64; 1 << (3 * FINE_BITS - BELOW_COARSE)];
        pass(&mut |keys| keys.iter().for_each(|key| coarse[(key >> BELOW_COARSE) as usize] += 1))?;
        let mut cells = Vec::new();
        let mut open = Vec::new();
        let mut sort = |cell: Cell, open: &mut Vec<Cell>| match cell.count {
            0 => {}
            count if count > most && cell.below > 0 => open.push(cell),
            _ => cells.push(cell),
        };
        for (index, count) in (0u64..).zip(coarse) {
            sort(Cell { start: index << BELOW_COARSE, below: BELOW_COARSE, count }, &mut open);
        }
        // All open cells have the same number of bits below.
        while let Some(below) = open.first().map(|cell| cell.below) {
            let next = below.saturating_sub(CUT);
            let mut inside: HashMap<u64, Vec<u64>> = open
                .drain(..)
                .map(|cell| (cell.start >> below, vec![0; 1 << (below - next)]))
                .collect();
            pass(&mut |keys| {
                for key in keys {
                    if let Some(counts) = inside.get_mut(&(key >> below)) {
                        counts[(key >> next & ((1 << (below - next)) - 1)) as usize] += 1;
                    }
                }
            })?;
            for (prefix, counts) in inside {
                for (index, count) in (0u64..).zip(counts) {
                    sort(
                        Cell { start: prefix << below | index << next, below: next, count },
                        &mut open,
                    );
                }
            }
        }
        cells.sort_unstable_by_key(|cell| cell.start);
        Ok(cells)
    }

    /// Joins cells to regions of at most `most` points, all of about the same number.
    pub fn of_cells(cube: Cube, most: u64, cells: &[Cell]) -> Self {
        let total: u64 = cells.iter().map(|cell| cell.count).sum();
        let regions = total.div_ceil(most.max(1)).max(1);
        let (mut starts, mut points) = (vec![0], vec![0]);
        let mut before = 0;
        let mut reaches = Vec::with_capacity(cells.len());
        let mut typical = Vec::with_capacity(cells.len());
        let larger = Larger::of(cells);
        for cell in cells {
            let held = points[points.len() - 1];
            // The share of all points that the middle of the cell has reached.
            let reached = u128::from(before + cell.count / 2) * u128::from(regions);
            let is_next = reached / u128::from(total) >= points.len() as u128;
            if held > 0 && (is_next || held + cell.count > most) {
                starts.push(cell.start);
                points.push(0);
            }
            *points.last_mut().expect("a region") += cell.count;
            before += cell.count;
            let (below, count) = larger.enough(cell);
            let edge = cube.edge() / (1u64 << (FINE_BITS - below / 3)) as f32;
            let spacings = (REACH_ON_SURFACE / (count as f32).sqrt())
                .max(REACH_IN_SOLID / (count as f32).cbrt());
            let reach = edge * spacings.min(1.0);
            // Coincident points count as one.
            typical
                .push((edge / (count as f32).sqrt(), if cell.below > 0 { cell.count } else { 1 }));
            reaches.push(Reach { start: cell.start, below: cell.below, reach });
        }
        if starts.len() == 1 {
            // One region needs no tables. With many files, they would take much memory.
            reaches.clear();
        }
        Self::new(cube, Ranges { starts, points, spacing: SIXTH * middle(typical) }, &reaches)
    }

    /// Puts regions together of what [`ranges`](Self::ranges) and [`reaches`](Self::reaches) gave.
    pub fn new(cube: Cube, ranges: Ranges, reaches: &[Reach]) -> Self {
        let is_whole = reaches.is_empty();
        let cells = if is_whole { 0 } else { 1 << (3 * FINE_BITS - BELOW_COARSE) };
        let mut reach = vec![0.0; cells];
        let mut cut = BTreeMap::new();
        for cell in reaches {
            let coarse = &mut reach[(cell.start >> BELOW_COARSE) as usize];
            if cell.below == BELOW_COARSE {
                *coarse = cell.reach;
            } else {
                *coarse = -1.0;
                cut.insert(cell.start, cell.reach);
            }
        }
        let coarse = table(&ranges.starts, cells);
        let farthest = reaches.iter().map(|cell| cell.reach).fold(0.0, f32::max);
        Self { cube, ranges, coarse, reach, cut, farthest }
    }

    /// Returns where the regions begin, and what they hold.
    pub fn ranges(&self) -> &Ranges {
        &self.ranges
    }

    /// Returns how far the neighbours of points in each cell may be; nothing for a single region.
    pub fn reaches(&self) -> Vec<Reach> {
        let whole = (0u64..).zip(&self.reach).filter(|(_, reach)| **reach > 0.0);
        let whole = whole.map(|(index, &reach)| Reach {
            start: index << BELOW_COARSE,
            below: BELOW_COARSE,
            reach,
        });
        let cut = self.cut.iter().map(|(&start, &reach)| Reach { start, below: 0, reach });
        whole.chain(cut).collect()
    }

    /// Returns a distance beyond which the points in a box have no neighbours.
    pub fn reach_in(&self, [low, high]: [Vec3; 2]) -> f32 {
        /// Cells that are looked at; in a larger box, the largest reach of all counts.
        const MOST: usize = 1 << 12;
        if self.reach.is_empty() {
            return 0.0;
        }
        let shift = BELOW_COARSE / 3;
        let [low, high] =
            [low, high].map(|corner| fine_cell(self.cube.fine_key(corner)).map(|at| at >> shift));
        let axis = |axis: usize| low[axis]..=high[axis];
        let count: usize = (0..3).map(|at| axis(at).count()).product();
        if count > MOST {
            return self.farthest;
        }
        let cells =
            axis(0).flat_map(|x| axis(1).flat_map(move |y| axis(2).map(move |z| [x, y, z])));
        let reach = cells.map(|cell| {
            let key = fine_key_of(cell.map(|at| at << shift));
            match self.reach[(key >> BELOW_COARSE) as usize] {
                reach if reach < 0.0 => {
                    let inside = self.cut.range(key..key + (1 << BELOW_COARSE));
                    inside.map(|(_, &reach)| reach).fold(0.0, f32::max)
                }
                reach => reach,
            }
        });
        reach.fold(0.0, f32::max)
    }

    /// Returns boxes that cover a region. What lies outside the cube belongs to the nearest cells.
    pub fn boxes(&self, region: u32) -> Vec<[Vec3; 2]> {
        let starts = &self.ranges.starts;
        let end = starts.get(region as usize + 1).copied().unwrap_or(1 << (3 * FINE_BITS));
        let mut at = starts[region as usize];
        let mut boxes = Vec::new();
        while at < end {
            // The largest cell that begins here and ends within the region.
            let fits = |below: &u32| at.is_multiple_of(1 << below) && at + (1 << below) <= end;
            let below = (0..=FINE_BITS).rev().map(|level| 3 * level).find(fits).unwrap_or(0);
            boxes.push(self.cube.cell(at, below));
            at += 1 << below;
        }
        boxes
    }

    /// Returns the distance from a centre within which all points of the cells lie. The points lie
    /// in a box.
    pub fn radius(cube: Cube, cells: &[Cell], [low, high]: [Vec3; 2], center: DVec3) -> f64 {
        let farthest = |cell: &Cell| {
            let [a, b] = cube.cell(cell.start, cell.below);
            let [a, b] = [a.max(low), b.min(high)].map(|corner| corner.as_dvec3() - center);
            a.abs().max(b.abs()).length()
        };
        cells.iter().map(farthest).fold(0.0, f64::max)
    }

    /// Returns the number of regions, at least 1.
    pub fn count(&self) -> usize {
        self.ranges.starts.len()
    }

    fn search(&self, key: u64) -> u32 {
        self.ranges.starts.partition_point(|&start| start <= key) as u32 - 1
    }

    /// Returns the region of a position.
    pub fn of(&self, place: Vec3) -> u32 {
        self.of_key(self.cube.fine_key(place))
    }

    fn of_key(&self, key: u64) -> u32 {
        if self.ranges.starts.len() == 1 {
            return 0;
        }
        match self.coarse[(key >> BELOW_COARSE) as usize] {
            SEVERAL => self.search(key),
            region => region,
        }
    }

    /// Finds the other regions in which a point at this position may be a neighbour.
    pub fn around(&self, place: Vec3, regions: &mut Vec<u32>) {
        regions.clear();
        if self.ranges.starts.len() == 1 {
            return;
        }
        let key = self.cube.fine_key(place);
        let owner = self.of_key(key);
        let mut reach = self.reach[(key >> BELOW_COARSE) as usize];
        if reach < 0.0 {
            reach = self.cut.range(..=key).next_back().map_or(0.0, |(_, &reach)| reach);
        }
        // If coarse cells are at least as wide as the reach, three positions on each axis miss no
        // cell of that size. Where points are sparse, more positions are tried.
        let steps: &[f32] = if reach <= self.cube.edge() / 128.0 {
            &[-1.0, 0.0, 1.0]
        } else {
            &[-1.0, -0.5, 0.0, 0.5, 1.0]
        };
        for &x in steps {
            for &y in steps {
                for &z in steps {
                    let region = self.of(place + Vec3::new(x, y, z) * reach);
                    if region != owner && !regions.contains(&region) {
                        regions.push(region);
                    }
                }
            }
        }
    }
}

/// Returns the region of each coarse cell, given the first key of each region.
fn table(starts: &[u64], cells: usize) -> Vec<u32> {
    // A cell keeps `SEVERAL` if a region begins inside it.
    let mut table = vec![SEVERAL; cells];
    for (region, &start) in (0..).zip(starts) {
        let first = start.div_ceil(1 << BELOW_COARSE) as usize;
        let end =
            starts.get(region as usize + 1).map_or(cells, |&next| (next >> BELOW_COARSE) as usize);
        if first < end {
            table[first..end].fill(region);
        }
    }
    table
}

/// Returns the median of weighted values.
fn middle(mut values: Vec<(f32, u64)>) -> f32 {
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = values.iter().map(|(_, count)| count).sum::<u64>() / 2;
    let at = values.iter().find(|(_, count)| {
        let is_here = *count > left;
        left = left.saturating_sub(*count);
        is_here
    });
    at.map_or(0.0, |(value, _)| *value)
}

/// The number of points in the cells larger than the coarse ones, by level: one cell, eight, …
struct Larger(Vec<Vec<u64>>);

impl Larger {
    fn of(cells: &[Cell]) -> Self {
        let levels = (3 * FINE_BITS - BELOW_COARSE) / 3;
        let count = |level: u32| {
            let mut counts = vec![0; 1 << (3 * level)];
            cells.iter().for_each(|cell| {
                counts[(cell.start >> (3 * (FINE_BITS - level))) as usize] += cell.count;
            });
            counts
        };
        Self((0..levels).map(count).collect())
    }

    /// Returns the smallest cell, this one or one around it, with enough points to estimate their
    /// spacing. The result is its number of key bits below, and its number of points.
    fn enough(&self, cell: &Cell) -> (u32, u64) {
        let around = self.0.iter().enumerate().rev().map(|(level, counts)| {
            let below = 3 * (FINE_BITS - level as u32);
            (below, counts[(cell.start >> below) as usize])
        });
        let mut sizes = std::iter::once((cell.below, cell.count))
            .chain(around.filter(|size| size.0 > cell.below));
        sizes.find(|size| size.1 >= ENOUGH).unwrap_or((3 * FINE_BITS, cell.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn regions(places: &[Vec3], most: u64) -> Regions {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = places.iter().fold(none, |(low, high), &p| (low.min(p), high.max(p)));
        let cube = Cube::around(low, high);
        let keys: Vec<u64> = places.iter().map(|&place| cube.fine_key(place)).collect();
        let cells = Regions::count_cells(most, |count| {
            count(&keys);
            Ok(())
        });
        Regions::of_cells(cube, most, &cells.unwrap())
    }

    fn counts(places: &[Vec3], regions: &Regions) -> Vec<u64> {
        let mut counts = vec![0; regions.count()];
        places.iter().for_each(|&place| counts[regions.of(place) as usize] += 1);
        counts
    }

    fn spread(count: u32) -> impl Iterator<Item = Vec3> {
        (0..count).map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32))
    }

    #[test]
    fn none_holds_more_than_it_may() {
        let even: Vec<Vec3> = spread(1000).collect();
        // All but two points are in one coarse cell.
        let crowded: Vec<Vec3> =
            even.iter().map(|p| p * 1e-4).chain([Vec3::ONE, -Vec3::ONE]).collect();
        for places in [even, crowded] {
            let regions = regions(&places, 100);
            let counts = counts(&places, &regions);
            assert!(
                counts.iter().all(|&count| (1..=100).contains(&count)) && counts.len() <= 25,
                "{counts:?}"
            );
            for (index, &region) in (0u64..).zip(&regions.coarse) {
                let [first, last] = [index << BELOW_COARSE, ((index + 1) << BELOW_COARSE) - 1]
                    .map(|key| regions.search(key));
                assert_eq!(region, if first == last { first } else { SEVERAL }, "cell {index}");
            }
        }
    }

    #[test]
    fn points_at_one_place_stay_together() {
        let places: Vec<Vec3> = (0..1000).map(|_| Vec3::ONE).chain(spread(100)).collect();
        let sizes = counts(&places, &regions(&places, 10));
        assert!(
            sizes.iter().filter(|&&count| count > 10).count() == 1
                && sizes.iter().sum::<u64>() == 1100
        );
        let alone = vec![Vec3::ONE; 100];
        assert_eq!(counts(&alone, &regions(&alone, 10)), [100]);
    }

    #[test]
    fn what_is_near_a_border_is_known_beyond_it() {
        let places: Vec<Vec3> = spread(1000).collect();
        let regions = regions(&places, 100);
        let mut near = Vec::new();
        for &place in &places {
            regions.around(place, &mut near);
            assert!(!near.contains(&regions.of(place)));
        }
        let mut apart = 0;
        for &place in places.iter().filter(|place| place.x < 9.0) {
            let other = regions.of(place + Vec3::X);
            regions.around(place, &mut near);
            apart += u32::from(other != regions.of(place) && !near.contains(&other));
        }
        assert_eq!(apart, 0);
    }
}

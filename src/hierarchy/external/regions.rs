//! Regions of about as many points each: runs of cells along the curve that Morton (1966) drew through space.
//!
//! Cells are halved until none holds more than a region may, so that points that are crowded are cut as evenly as others.
//! Only points at one place, or nearly, are more: they stay together.

use super::super::partition::{Cube, FINE_BITS};
use crate::Result;
use glam::Vec3;
use std::collections::{BTreeMap, HashMap};

/// Bits of a fine key below those of a coarse cell.
const BELOW_COARSE: u32 = 3 * (FINE_BITS - 7);
/// Bits by which a cell is cut at a time.
const CUT: u32 = 12;
/// Neighbours of a point lie within so many mean spacings of the points of its cell, taken as those of a surface …
const REACH_ON_SURFACE: f32 = 6.0;
/// … or as those of a solid, whichever is farther …
const REACH_IN_SOLID: f32 = 2.0;
/// … where it is a cell of as many points.
const ENOUGH: u64 = 64;
/// The distance of the neighbour that points are judged by, the sixth, in mean spacings: of points strewn on a surface the sixth
/// lies in a circle of area 6 around a point, of one each.
const SIXTH: f32 = 1.382;
/// In the table of cells, one that is in several regions, or that is cut.
const SEVERAL: u32 = u32::MAX;

/// Which region a place is in.
pub struct Regions {
    cube: Cube,
    /// The first key of each region.
    starts: Vec<u64>,
    /// The region of each coarse cell.
    coarse: Vec<u32>,
    /// How far the neighbours of the points in each coarse cell may be; of cut ones in `cut`.
    reach: Vec<f32>,
    cut: BTreeMap<u64, f32>,
    /// About the median distance of the neighbours that points are judged by, taken as those of a surface.
    pub spacing: f32,
}

/// A cell that is not cut any further.
struct Cell {
    start: u64,
    /// Bits of keys in it.
    below: u32,
    count: u64,
}

impl Regions {
    /// Cuts the cube in regions of at most `most` points. `pass` calls what it is given with the fine keys of all points.
    pub fn cut(
        cube: Cube,
        most: u64,
        mut pass: impl FnMut(&mut dyn FnMut(&[u64])) -> Result<()>,
    ) -> Result<Self> {
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
        // All that are open have the same number of bits below.
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
        Ok(Self::of_cells(cube, most, &cells))
    }

    fn of_cells(cube: Cube, most: u64, cells: &[Cell]) -> Self {
        let mut starts = vec![0];
        let mut held = 0;
        let mut reach = vec![0.0; 1 << (3 * FINE_BITS - BELOW_COARSE)];
        let mut cut = BTreeMap::new();
        let mut typical = Vec::with_capacity(cells.len());
        let larger = Larger::of(cells);
        for cell in cells {
            if held > 0 && held + cell.count > most {
                starts.push(cell.start);
                held = 0;
            }
            held += cell.count;
            let (below, count) = larger.enough(cell);
            let edge = cube.edge() / (1u64 << (FINE_BITS - below / 3)) as f32;
            let spacings = (REACH_ON_SURFACE / (count as f32).sqrt())
                .max(REACH_IN_SOLID / (count as f32).cbrt());
            let own = edge * spacings.min(1.0);
            // Points at one place count as one.
            typical
                .push((edge / (count as f32).sqrt(), if cell.below > 0 { cell.count } else { 1 }));
            if cell.below == BELOW_COARSE {
                reach[(cell.start >> BELOW_COARSE) as usize] = own;
            } else {
                reach[(cell.start >> BELOW_COARSE) as usize] = -1.0;
                cut.insert(cell.start, own);
            }
        }
        if starts.len() == 1 {
            // Nothing is to be looked up; many files together would take much memory for that.
            (reach, cut) = (Vec::new(), BTreeMap::new());
        }
        let coarse = table(&starts, reach.len());
        Self { cube, starts, coarse, reach, cut, spacing: SIXTH * middle(typical) }
    }

    /// How many regions there are, 1 at least.
    pub fn count(&self) -> usize {
        self.starts.len()
    }

    fn search(&self, key: u64) -> u32 {
        self.starts.partition_point(|&start| start <= key) as u32 - 1
    }

    /// The region that a place is in.
    pub fn of(&self, place: Vec3) -> u32 {
        self.of_key(self.cube.fine_key(place))
    }

    fn of_key(&self, key: u64) -> u32 {
        if self.starts.len() == 1 {
            return 0;
        }
        match self.coarse[(key >> BELOW_COARSE) as usize] {
            SEVERAL => self.search(key),
            region => region,
        }
    }

    /// The other regions that a point at a place may be a neighbour in.
    pub fn around(&self, place: Vec3, found: &mut Vec<u32>) {
        found.clear();
        if self.starts.len() == 1 {
            return;
        }
        let key = self.cube.fine_key(place);
        let own = self.of_key(key);
        let mut reach = self.reach[(key >> BELOW_COARSE) as usize];
        if reach < 0.0 {
            reach = self.cut.range(..=key).next_back().map_or(0.0, |(_, &reach)| reach);
        }
        // Where the cell of the point is no narrower than the reach, none of its size is missed between three places along
        // each axis. Where points are few, more are looked at.
        let steps: &[f32] = if reach <= self.cube.edge() / 128.0 {
            &[-1.0, 0.0, 1.0]
        } else {
            &[-1.0, -0.5, 0.0, 0.5, 1.0]
        };
        for &x in steps {
            for &y in steps {
                for &z in steps {
                    let region = self.of(place + Vec3::new(x, y, z) * reach);
                    if region != own && !found.contains(&region) {
                        found.push(region);
                    }
                }
            }
        }
    }
}

/// The region of each of so many coarse cells, of the first keys of the regions.
fn table(starts: &[u64], cells: usize) -> Vec<u32> {
    // Cells that no region has as a whole are those that a region begins within.
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

/// The median of values that count so many times.
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

/// How many points there are in the cells larger than the coarse ones, by level: one cell, eight, …
struct Larger(Vec<Vec<u64>>);

impl Larger {
    fn of(cells: &[Cell]) -> Self {
        let levels = (3 * FINE_BITS - BELOW_COARSE) / 3;
        let count = |level: u32| {
            let mut counts = vec![0; 1 << (3 * level)];
            cells.iter().for_each(|cell| {
                counts[(cell.start >> (3 * (FINE_BITS - level))) as usize] += cell.count
            });
            counts
        };
        Self((0..levels).map(count).collect())
    }

    /// The smallest cell around one, or itself, that holds enough points to tell their spacing: the bits below it, and how
    /// many it holds.
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
        Regions::cut(cube, most, |count| {
            count(&keys);
            Ok(())
        })
        .unwrap()
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
        // All but two in one coarse cell.
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
        let found = counts(&places, &regions(&places, 10));
        assert!(
            found.iter().filter(|&&count| count > 10).count() == 1
                && found.iter().sum::<u64>() == 1100
        );
        let alone = vec![Vec3::ONE; 100];
        assert_eq!(counts(&alone, &regions(&alone, 10)), [100]);
    }

    #[test]
    fn what_is_near_a_border_is_known_beyond_it() {
        let places: Vec<Vec3> = spread(1000).collect();
        let regions = regions(&places, 100);
        let mut found = Vec::new();
        for &place in &places {
            regions.around(place, &mut found);
            assert!(!found.contains(&regions.of(place)));
        }
        let mut apart = 0;
        for &place in places.iter().filter(|place| place.x < 9.0) {
            let other = regions.of(place + Vec3::X);
            regions.around(place, &mut found);
            apart += u32::from(other != regions.of(place) && !found.contains(&other));
        }
        assert_eq!(apart, 0);
    }
}

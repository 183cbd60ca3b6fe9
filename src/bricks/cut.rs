//! Cutting bricks out of slices, with the ranges of their blocks.

use super::{BLOCK, BLOCKS, BRICK_BLOCKS, EMPTY, Level, REACH, SIDE, joined};
use crate::volume::{Scalar, steps::Steps};

/// A brick as it is read.
#[derive(Debug, Clone, PartialEq)]
pub struct Brick {
    /// The bytes of its 32³ samples in native byte order, first axis fastest. Samples beyond the
    /// volume's border are copies of the border's.
    pub samples: Vec<u8>,
    /// For each block of 4³ samples, first axis fastest, the smallest and the largest value among
    /// them and within [`REACH`](super::REACH) samples around. As in
    /// [`neighbourhood_ranges`](crate::volume::reach::neighbourhood_ranges), they are in steps of
    /// 1/255 of the volume's range, rounded outwards. Blocks beyond the border are [`EMPTY`].
    pub blocks: Box<[[u8; 2]; BRICK_BLOCKS]>,
}

impl Brick {
    /// Returns the range that contains those of all blocks.
    pub fn range(&self) -> [u8; 2] {
        self.blocks.iter().fold(EMPTY, |all, &block| joined(all, block))
    }
}

/// Consecutive slices of a level, or of a part of it.
#[derive(Clone, Copy)]
pub struct Slices<'a> {
    pub level: Level,
    pub scalar: Scalar,
    /// The first sample present along each axis.
    pub first: [usize; 3],
    /// Samples of a row, and rows of a slice.
    pub row: usize,
    pub rows: usize,
    /// The bytes of the samples of all slices present.
    pub samples: &'a [u8],
}

/// Samples along each axis that affect a brick's ranges.
const AROUND: usize = SIDE + 2 * REACH;

impl<'a> Slices<'a> {
    /// Takes whole slices of a level, of which `first` is the first.
    pub fn whole(level: Level, scalar: Scalar, first: usize, samples: &'a [u8]) -> Self {
        let [row, rows, _] = level.dims;
        Self { level, scalar, first: [0, 0, first], row, rows, samples }
    }
}

impl Slices<'_> {
    /// Returns the brick at a position in the grid of bricks. Its samples must be present, and
    /// [`REACH`] more on all sides as far as the level has them.
    pub fn brick(&self, place: [usize; 3], steps: &Steps) -> Brick {
        Brick { samples: self.samples_of(place), blocks: self.blocks(place, steps) }
    }

    /// Returns samples of the row at positions along y and z, clamped to the level.
    fn row(&self, [from, to]: [usize; 2], j: isize, k: isize) -> &[u8] {
        let [_, ny, nz] = self.level.dims;
        let (j, k) = (inside(j, ny) - self.first[1], inside(k, nz) - self.first[2]);
        let start = (k * self.rows + j) * self.row;
        let at = |x: usize| (start + x - self.first[0]) * self.scalar.bytes();
        &self.samples[at(from)..at(to)]
    }

    fn samples_of(&self, place: [usize; 3]) -> Vec<u8> {
        let size = self.scalar.bytes();
        let [x, y, z] = place.map(|at| at * SIDE);
        let there = SIDE.min(self.level.dims[0] - x);
        let mut out = Vec::with_capacity(SIDE * SIDE * SIDE * size);
        for (k, j) in (0..SIDE).flat_map(|k| (0..SIDE).map(move |j| (k, j))) {
            let row = self.row([x, x + there], (y + j) as isize, (z + k) as isize);
            out.extend_from_slice(row);
            for _ in there..SIDE {
                out.extend_from_slice(&row[(there - 1) * size..]);
            }
        }
        out
    }

    /// Returns the ranges of the blocks. The extremes of a box are computed one axis after the
    /// other.
    pub fn blocks(&self, place: [usize; 3], steps: &Steps) -> Box<[[u8; 2]; BRICK_BLOCKS]> {
        let [x, y, z] = place.map(|at| (at * SIDE) as isize - REACH as isize);
        // The samples present along x, and how many copies of the first one precede it.
        let (from, to) = (
            inside(x, self.level.dims[0]),
            inside(x + AROUND as isize - 1, self.level.dims[0]) + 1,
        );
        let before = (from as isize - x) as usize;
        let mut row = [[0u8; 2]; AROUND];
        let mut along_y = [[[255u8; 2]; BLOCKS]; AROUND];
        let mut along_z = vec![[[[255u8; 2]; BLOCKS]; BLOCKS]; AROUND];
        for (k, done) in along_z.iter_mut().enumerate() {
            for (j, done) in along_y.iter_mut().enumerate() {
                let samples = self.row([from, to], y + j as isize, z + k as isize);
                let end = before + to - from;
                steps.write(samples, &mut row[before..end]);
                let [first, last] = [row[before], row[end - 1]];
                row[..before].fill(first);
                row[end..].fill(last);
                for (block, done) in done.iter_mut().enumerate() {
                    *done = least(&row[block * BLOCK..][..BLOCK + 2 * REACH]);
                }
            }
            for (block, done) in done.iter_mut().enumerate() {
                let rows = &along_y[block * BLOCK..][..BLOCK + 2 * REACH];
                *done = std::array::from_fn(|i| least_of(rows.iter().map(|row| row[i])));
            }
        }
        let there = std::array::from_fn::<_, 3, _>(|axis| {
            (self.level.dims[axis] - place[axis] * SIDE).div_ceil(BLOCK).min(BLOCKS)
        });
        let mut blocks = Box::new([EMPTY; BRICK_BLOCKS]);
        for k in 0..there[2] {
            let slices = &along_z[k * BLOCK..][..BLOCK + 2 * REACH];
            for (j, i) in (0..there[1]).flat_map(|j| (0..there[0]).map(move |i| (j, i))) {
                let [low, high] = least_of(slices.iter().map(|slice| slice[j][i]));
                blocks[(k * BLOCKS + j) * BLOCKS + i] = [low, 255 - high];
            }
        }
        blocks
    }
}

/// Clamps a position to the nearest of `count`.
fn inside(at: isize, count: usize) -> usize {
    at.clamp(0, count as isize - 1) as usize
}

fn least(steps: &[[u8; 2]]) -> [u8; 2] {
    least_of(steps.iter().copied())
}

fn least_of(steps: impl Iterator<Item = [u8; 2]>) -> [u8; 2] {
    steps.fold([255; 2], |a, b| [a[0].min(b[0]), a[1].min(b[1])])
}

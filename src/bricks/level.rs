//! The levels of a volume: their sizes, and where their samples lie.

use super::SIDE;
use crate::volume::{Arrangement, Lattice};
use glam::{DMat3, DVec3};

/// Bricks of a group along each axis. Groups are listed together.
const GROUP: usize = 8;

/// The size of a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Level {
    /// Samples along each axis.
    pub dims: [usize; 3],
    /// Bricks along each axis, first axis fastest.
    pub brick_dims: [usize; 3],
}

impl Level {
    pub(super) fn new(dims: [usize; 3]) -> Self {
        Self { dims, brick_dims: dims.map(|n| n.div_ceil(SIDE)) }
    }

    /// Number of bricks.
    pub fn bricks(&self) -> usize {
        self.brick_dims.iter().product()
    }

    /// Returns the position of a brick in the grid of bricks, along each axis.
    pub fn place(&self, brick: u32) -> [usize; 3] {
        let ([nx, ny, _], brick) = (self.brick_dims, brick as usize);
        [brick % nx, brick / nx % ny, brick / nx / ny]
    }

    /// Returns the number of a brick among those of its level, in groups of 8³ that are cut at the
    /// border. The first axis is fastest, among groups and in each.
    pub(super) fn rank(&self, brick: u32) -> u32 {
        let [nx, ny, nz] = self.brick_dims;
        let [x, y, z] = self.place(brick);
        let [x0, y0, z0] = [x, y, z].map(|at| at / GROUP * GROUP);
        let [w, h, d] = [nx - x0, ny - y0, nz - z0].map(|rest| rest.min(GROUP));
        let before = z0 * nx * ny + y0 * nx * d + x0 * h * d;
        (before + ((z - z0) * h + y - y0) * w + x - x0) as u32
    }

    /// Returns the brick with a number from [`rank`](Self::rank).
    pub(super) fn brick(&self, rank: u32) -> u32 {
        let [nx, ny, nz] = self.brick_dims;
        let rank = rank as usize;
        let z0 = rank / (nx * ny * GROUP) * GROUP;
        let (rank, d) = (rank - z0 * nx * ny, (nz - z0).min(GROUP));
        let y0 = rank / (nx * d * GROUP) * GROUP;
        let (rank, h) = (rank - y0 * nx * d, (ny - y0).min(GROUP));
        let x0 = rank / (h * d * GROUP) * GROUP;
        let (rank, w) = (rank - x0 * h * d, (nx - x0).min(GROUP));
        let [x, y, z] = [x0 + rank % w, y0 + rank / w % h, z0 + rank / w / h];
        ((z * ny + y) * nx + x) as u32
    }

    /// Returns the first and the last brick of each group along each axis.
    pub(super) fn groups(&self) -> Vec<[[usize; 3]; 2]> {
        let [nx, ny, nz] = self.brick_dims;
        let along = |n: usize| (0..n).step_by(GROUP);
        let first = along(nz).flat_map(|z| along(ny).map(move |y| (y, z)));
        let first = first.flat_map(|(y, z)| along(nx).map(move |x| [x, y, z]));
        let last = |first: [usize; 3]| {
            [0, 1, 2].map(|axis| (first[axis] + GROUP).min(self.brick_dims[axis]) - 1)
        };
        first.map(|first| [first, last(first)]).collect()
    }

    /// Samples of a slice across the last axis.
    pub(super) fn slice(&self) -> usize {
        self.dims[0] * self.dims[1]
    }
}

/// Returns the levels of a volume, finest first. The last one fits in a brick.
pub fn levels(dims: [usize; 3]) -> Vec<Level> {
    let halved =
        |level: &Level| (level.bricks() > 1).then(|| Level::new(level.dims.map(|n| n.div_ceil(2))));
    std::iter::successors(Some(Level::new(dims)), halved).collect()
}

/// Returns an error, as a message, if a lattice cannot have bricks. Only Cartesian lattices can,
/// with at most as many bricks as 32 bits can count.
pub fn refusal(lattice: &Lattice) -> Result<(), String> {
    let name = match lattice.arrangement {
        Arrangement::Cartesian if are_countable(lattice.dims) => {
            return Ok(());
        }
        Arrangement::Cartesian => {
            let [nx, ny, nz] = lattice.dims;
            return Err(format!(
                "{nx} × {ny} × {nz} samples need more bricks than 32 bits can count"
            ));
        }
        Arrangement::BodyCentred => "body-centred",
        Arrangement::Rectilinear(_) => "rectilinear",
    };
    Err(format!("its lattice is {name}, but only volumes on Cartesian lattices are cut in bricks"))
}

/// Returns whether 32 bits can count the bricks of all levels.
fn are_countable(dims: [usize; 3]) -> bool {
    let bricks = levels(dims)
        .into_iter()
        .map(|level| level.brick_dims.iter().try_fold(1usize, |all, n| all.checked_mul(*n)));
    let count = bricks.into_iter().try_fold(0usize, |all, bricks| all.checked_add(bricks?));
    count.is_some_and(|count| u32::try_from(count).is_ok())
}

/// Returns the lattice of a level. Every halving of an axis doubles its step and moves its first
/// sample to the middle of the first two. An axis of one sample is not halved.
pub fn lattice(fine: &Lattice, level: usize) -> Lattice {
    let mut dims = fine.dims;
    let (mut scale, mut shift) = (DVec3::ONE, DVec3::ZERO);
    for _ in 0..level {
        for (axis, n) in dims.iter_mut().enumerate().filter(|(_, n)| **n > 1) {
            *n = n.div_ceil(2);
            shift[axis] += 0.5 * scale[axis];
            scale[axis] *= 2.0;
        }
    }
    Lattice::cartesian(dims, fine.position(shift), fine.axes * DMat3::from_diagonal(scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_end_with_one_brick() {
        let dims = |of| levels(of).iter().map(|level| level.dims).collect::<Vec<_>>();
        assert_eq!(dims([32, 1, 7]), [[32, 1, 7]]);
        assert_eq!(dims([33, 32, 100]), [[33, 32, 100], [17, 16, 50], [9, 8, 25]]);
        let level = Level::new([33, 32, 100]);
        assert_eq!((level.brick_dims, level.bricks(), level.place(7)), ([2, 1, 4], 8, [1, 0, 3]));
        assert_eq!(levels([1024; 3]).len(), 6);
    }

    #[test]
    fn groups_number_all_bricks() {
        for dims in [[1, 1, 1], [8, 8, 8], [9, 3, 17], [20, 11, 8], [16, 16, 16]] {
            let level = Level::new(dims.map(|n| n * SIDE));
            let mut ranks: Vec<u32> =
                (0..level.bricks() as u32).map(|brick| level.rank(brick)).collect();
            assert!((0..).zip(&ranks).all(|(brick, rank)| level.brick(*rank) == brick), "{dims:?}");
            let mut next = 0;
            for [first, last] in level.groups() {
                let members = (0..level.bricks() as u32).filter(|brick| {
                    let at = level.place(*brick);
                    (0..3).all(|axis| (first[axis]..=last[axis]).contains(&at[axis]))
                });
                let mut members: Vec<u32> = members.map(|brick| level.rank(brick)).collect();
                members.sort_unstable();
                assert!(members.iter().copied().eq(next..next + members.len() as u32), "{dims:?}");
                next += members.len() as u32;
            }
            ranks.sort_unstable();
            assert!(ranks.into_iter().eq(0..level.bricks() as u32));
        }
    }

    #[test]
    fn samples_of_a_level_lie_amid_those_below() {
        let axes = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 2.0, 0.0), DVec3::Z * 3.0);
        let fine = Lattice::cartesian([100, 70, 1], DVec3::new(5.0, 6.0, 7.0), axes);
        for (level, size) in levels(fine.dims).iter().enumerate() {
            let coarse = lattice(&fine, level);
            assert_eq!(coarse.dims, size.dims);
            let middle = (f64::from(1 << level) - 1.0) / 2.0;
            assert_eq!(coarse.origin, fine.position(DVec3::new(middle, middle, 0.0)));
            let step = f64::from(1 << level);
            assert_eq!(coarse.axes, axes * DMat3::from_diagonal(DVec3::new(step, step, 1.0)));
        }
    }

    #[test]
    fn other_lattices_are_refused() {
        let bcc = Lattice::body_centred([4; 3], DVec3::ZERO, DMat3::IDENTITY);
        assert!(refusal(&bcc).unwrap_err().contains("body-centred"));
        let places = Arrangement::Rectilinear([vec![0.0], vec![0.0], vec![0.0]].into());
        assert!(
            refusal(&Lattice { arrangement: places, ..bcc }).unwrap_err().contains("rectilinear")
        );
        let huge = Lattice::with_spacing([1 << 21; 3], DVec3::ONE);
        assert!(refusal(&huge).unwrap_err().contains("32 bits"));
        assert!(refusal(&Lattice::with_spacing([4; 3], DVec3::ONE)).is_ok());
    }
}

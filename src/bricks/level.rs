//! The levels of a volume: their sizes, and where their samples lie.

use super::SIDE;
use crate::volume::{Arrangement, Lattice};
use glam::{DMat3, DVec3};

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
        Arrangement::Cartesian if u32::try_from(Level::new(lattice.dims).bricks()).is_ok() => {
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

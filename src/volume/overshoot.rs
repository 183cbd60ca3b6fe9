//! How far a sharp reconstruction leaves the range of the samples around it.

use super::grid::{Grid, Response, weight};
use crate::{
    math::{Kernel, cosine::mirrored},
    parallel::prelude::*,
};

/// Points along an axis of the grid on which the cardinal function is measured. The function falls
/// by a third per sample or more, so nothing remains of it at the border.
const SIDE: usize = 33;
/// Boxes grow until the samples beyond the last one contribute at most this much, relative to their
/// range: 0.01, or two and a half of 255 steps. Few transfer functions show that. The rest is
/// accounted for too, so this choice affects how tight the bound is, not whether it holds.
const NEGLECTED: f64 = 0.01;
/// Factor on the maxima, which are searched at quarters of points. The sums are flat at their
/// maxima and rise by less than this in between.
const MARGIN: f64 = 1.02;

/// Bounds on the cardinal function L of a kernel on a lattice: the reconstruction of a single
/// sample of 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Overshoot {
    /// The Lebesgue constant: the maximum over space of Σ |L|. If samples differ from a value by at
    /// most d, their reconstruction differs from it by at most lebesgue · d (Powell, "Approximation
    /// theory and methods", 1981).
    pub lebesgue: f64,
    /// Growing distances in kernel units, each with the maximum over space of Σ |L| over the
    /// samples that lie further away.
    pub tails: Vec<(f64, f64)>,
}

impl Overshoot {
    /// Measures the kernel on a small lattice of a grid's arrangement.
    pub fn new(grid: Grid, kernel: &Kernel) -> Self {
        let grid = grid.cube(SIDE);
        let centre = [SIDE / 2; 3];
        let mut impulse = vec![0.0; SIDE.pow(3)];
        impulse[grid.offset(centre)] = 1.0;
        Response::new(grid, kernel).divide(&mut impulse);
        // Mirroring the lattice or permuting its axes does not change it.
        let quarters = || {
            (0..=4)
                .map(|quarter| f64::from(quarter) / 4.0)
                .filter(|&at| at <= grid.symmetric_part())
        };
        let places: Vec<[f64; 3]> = quarters()
            .flat_map(|x| quarters().flat_map(move |y| quarters().map(move |z| [x, y, z])))
            .filter(|[x, y, z]| x <= y && y <= z)
            .collect();
        let sums = places.into_par_iter().map(|place| shells(grid, kernel, &impulse, place));
        let most = |mut a: [f64; SIDE], b: [f64; SIDE]| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(b));
            a
        };
        let sums = sums.reduce(|| [0.0; SIDE], most).map(|sum| MARGIN * sum);
        let mut tails = Vec::new();
        for radius in [1, 2, 4, 8, 16, SIDE - 1] {
            tails.push((radius as f64, sums[radius]));
            if sums[radius] <= NEGLECTED {
                break;
            }
        }
        Self { lebesgue: sums[0].max(1.0), tails }
    }

    /// Returns the range of the reconstruction from the ranges of the samples in boxes. There is
    /// one box for each of the [`tails`](Self::tails), extended by that distance around the place.
    /// All are in steps of 1/255 of the range of all samples.
    ///
    /// Let d₁ ≤ d₂ ≤ … be the largest differences of the samples in the boxes from the middle of
    /// the first box. The reconstruction differs from it by at most lebesgue · d₁ + tail₁ · (d₂ −
    /// d₁) + tail₂ · (d₃ − d₂) + …
    pub fn widen(&self, boxes: impl Iterator<Item = [u8; 2]>) -> [u8; 2] {
        let mut boxes = boxes.map(|ends| ends.map(f64::from)).chain([[0.0, 255.0]]);
        let Some([low, high]) = boxes.next() else { return [0, 255] };
        let middle = 0.5 * (low + high);
        let mut inner = high - middle;
        let mut most = self.lebesgue * inner;
        for ([low, high], (_, tail)) in boxes.zip(&self.tails) {
            let outer = (high - middle).max(middle - low);
            most += tail * (outer - inner);
            inner = outer;
        }
        // Casts clamp to 0 … 255.
        [(middle - most).floor() as u8, (middle + most).ceil() as u8]
    }
}

/// Returns, for a place relative to a sample, the sums of |L| over the samples at a distance of `n`
/// or more, for each n.
fn shells(grid: Grid, kernel: &Kernel, impulse: &[f64], place: [f64; 3]) -> [f64; SIDE] {
    let step = grid.step();
    let reach = (kernel.extent / step) as isize + 2;
    let mut weights = Vec::new();
    let mut sum = 0.0;
    for k in -reach..=reach {
        for j in -reach..=reach {
            for i in (-reach..=reach).filter(|&i| grid.connects([i, j, k])) {
                let away = [i, j, k].map(|at| at as f64);
                let share = weight(kernel, step * distance(away, place));
                sum += share;
                // Weights below rounding are left out: wide truncated kernels have thousands of
                // them.
                if share.abs() > 1e-12 {
                    weights.push(([i, j, k], share));
                }
            }
        }
    }
    let mut sums = [0.0; SIDE];
    let (middle, half) = ([SIDE as isize / 2; 3], SIDE as isize / 2);
    for k in -half..=half {
        for j in -half..=half {
            for i in (-half..=half).filter(|&i| grid.connects([i, j, k])) {
                let from = [i, j, k];
                let value = |&(offset, share): &([isize; 3], f64)| {
                    let point = std::array::from_fn(|axis| {
                        mirrored(middle[axis] + from[axis] + offset[axis], SIDE)
                    });
                    share * impulse[grid.offset(point)]
                };
                let value = weights.iter().map(value).sum::<f64>() / sum;
                // L(from + place) is the weight of the sample at −from in the value at `place`.
                let away = step * distance(from.map(|at| -at as f64), place);
                sums[(away as usize).min(SIDE - 1)] += value.abs();
            }
        }
    }
    for shell in (1..SIDE).rev() {
        sums[shell - 1] += sums[shell];
    }
    sums
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Lattice;
    use glam::{DMat3, DVec3};

    #[test]
    fn a_kernel_that_interpolates_by_itself_is_its_own_cardinal_function() {
        // A cone of radius 1 reaches no other sample. Its normalised sum is a weighted mean of
        // samples and never overshoots.
        let cone = Kernel::table(vec![1.0, 0.0], 1.0).unwrap();
        let grid = Grid::of(&Lattice::cartesian([4; 3], DVec3::ZERO, DMat3::IDENTITY)).unwrap();
        let overshoot = Overshoot::new(grid, &cone);
        assert!(
            (overshoot.lebesgue - MARGIN).abs() < 1e-9 && overshoot.tails.last().unwrap().1 == 0.0,
            "{overshoot:?}"
        );
    }

    #[test]
    fn widening_by_hand() {
        let overshoot = |lebesgue| Overshoot { lebesgue, tails: vec![(1.0, 0.1), (2.0, 0.01)] };
        // 30 ± (2·10 + 0.1·(20 − 10) + 0.01·(225 − 20))
        assert_eq!(overshoot(2.0).widen([[20, 40], [10, 45]].into_iter()), [6, 54]);
        assert_eq!(overshoot(2.0).widen([[20, 40], [20, 40]].into_iter()), [7, 53]);
        assert_eq!(overshoot(3.0).widen([[20, 200], [20, 200]].into_iter()), [0, 255]);
    }

    #[test]
    fn gaussians_ring_more_the_wider_they_are() {
        let lebesgue = |sigma: f64, lattice: &Lattice| {
            let overshoot = Overshoot::new(
                Grid::of(lattice).unwrap(),
                &Kernel::gaussian(sigma, 4.0 * sigma).unwrap(),
            );
            println!("σ {sigma}: {overshoot:?}");
            assert!(overshoot.tails.windows(2).all(|pair| pair[0].1 >= pair[1].1));
            overshoot.lebesgue
        };
        let cartesian = Lattice::cartesian([4; 3], DVec3::ZERO, DMat3::IDENTITY);
        let body_centred = Lattice::body_centred([4; 3], DVec3::ZERO, DMat3::IDENTITY);
        for lattice in [&cartesian, &body_centred] {
            assert!(
                lebesgue(0.5, lattice) < lebesgue(0.6, lattice)
                    && lebesgue(0.6, lattice) < lebesgue(0.7, lattice)
            );
        }
        assert!(lebesgue(0.6, &body_centred) < lebesgue(0.6, &cartesian));
    }
}

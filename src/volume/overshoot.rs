//! How far a sharp reconstruction leaves the range of the samples around it.

use super::grid::{Grid, Response, weight};
use crate::math::{Kernel, cosine::mirrored};
use rayon::prelude::*;

/// Points along an axis of the grid that the cardinal function is looked at on: it falls by a third per sample or more, so
/// that nothing of it is left at the border.
const SIDE: usize = 33;
/// The share of a far sample that may be neglected when the box around a place is chosen: two and a half of 255 steps of the
/// range, which few transfer functions show. It is accounted for, so that the choice decides tightness and not truth.
const NEGLECTED: f64 = 0.01;
/// The maxima are looked for at quarters of points. Between these the sums, which are flat at their maxima, rise by less.
const MARGIN: f64 = 1.02;

/// Bounds on the cardinal function L of a kernel on a lattice: what a single sample of 1 is reconstructed to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overshoot {
    /// The Lebesgue constant: the maximum over space of Σ |L|. Samples in an interval of width w have a reconstruction
    /// that leaves it by at most (lebesgue − 1)/2 · w on either side (Powell, "Approximation theory and methods", 1981).
    pub lebesgue: f64,
    /// The same sum over the samples more than `radius` away.
    pub tail: f64,
    /// A distance in kernel units.
    pub radius: f64,
}

impl Overshoot {
    /// Measures the kernel on a small lattice of a grid's arrangement.
    pub fn new(grid: Grid, kernel: &Kernel) -> Self {
        let grid = grid.cube(SIDE);
        let centre = [SIDE / 2; 3];
        let mut impulse = vec![0.0; SIDE.pow(3)];
        impulse[grid.offset(centre)] = 1.0;
        Response::new(grid, kernel).divide(&mut impulse);
        // Mirrors at the planes of points, and the axes in any order, leave the lattice as it is.
        let quarters = || (0..=4).map(|quarter| f64::from(quarter) / 4.0);
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
        let radius = sums.iter().position(|&tail| tail <= NEGLECTED).unwrap_or(SIDE - 1);
        Self { lebesgue: sums[0].max(1.0), tail: sums[radius], radius: radius as f64 }
    }

    /// Widens the range of the samples in a box, both ends in steps of 1/255 of the range of all.
    pub fn widen(&self, [low, high]: [u8; 2]) -> [u8; 2] {
        let (low, high) = (f64::from(low), f64::from(high));
        let more = 0.5 * (self.lebesgue - 1.0) * (high - low) + 255.0 * self.tail;
        // Casts cut to 0 … 255.
        [(low - more).floor() as u8, (high + more).ceil() as u8]
    }
}

/// For a place relative to a sample the sums of |L| over the samples at a distance of `n` or more, for each n.
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
                // What rounds away is left out: wide cuts hold thousands of such samples.
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
                    let point = std::array::from_fn(|axis| mirrored(middle[axis] + from[axis] + offset[axis], SIDE));
                    share * impulse[grid.offset(point)]
                };
                let value = weights.iter().map(value).sum::<f64>() / sum;
                // L(from + place) is the share of the sample at −from in the value at `place`.
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
        // A cone of radius 1 reaches no other sample. Its normalised sum is a mean of them, which overshoots nowhere.
        let cone = Kernel::table(vec![1.0, 0.0], 1.0).unwrap();
        let grid = Grid::of(&Lattice::cartesian([4; 3], DVec3::ZERO, DMat3::IDENTITY)).unwrap();
        let found = Overshoot::new(grid, &cone);
        assert!((found.lebesgue - MARGIN).abs() < 1e-9 && found.tail == 0.0 && found.radius <= 2.0, "{found:?}");
        assert_eq!(Overshoot { lebesgue: 2.0, tail: 0.01, radius: 3.0 }.widen([20, 40]), [7, 53]);
        assert_eq!(Overshoot { lebesgue: 3.0, tail: 0.0, radius: 3.0 }.widen([20, 200]), [0, 255]);
    }

    #[test]
    fn measured() {
        for (name, lattice) in [
            ("cartesian", Lattice::cartesian([4; 3], DVec3::ZERO, DMat3::IDENTITY)),
            ("bcc", Lattice::body_centred([4; 3], DVec3::ZERO, DMat3::IDENTITY)),
        ] {
            let grid = Grid::of(&lattice).unwrap();
            for kernel in [
                Kernel::gaussian(0.5, 2.0),
                Kernel::gaussian(0.6, 2.0),
                Kernel::gaussian(0.7, 3.0),
                Kernel::b_spline(2.0),
            ] {
                let kernel = kernel.unwrap();
                let start = std::time::Instant::now();
                println!(
                    "{name} {:?} {:?} least {} {:?}",
                    kernel.profile,
                    Overshoot::new(grid, &kernel),
                    Response::new(grid.cube(33), &kernel).least(),
                    start.elapsed()
                );
            }
        }
    }
}

//! The evenly spaced grid that contains the samples of a lattice, and the frequency response of a
//! kernel on it.

use super::{Arrangement, Lattice, Samples, each_type};
use crate::{
    Error, Result,
    math::{
        Kernel,
        cosine::{self, frequency, mirrored},
    },
    parallel::prelude::*,
};

/// A grid that continues mirrored on all sides. A Cartesian lattice is a grid itself. The samples
/// of a body-centred lattice are the points of a grid twice as fine whose indices are all even or
/// all odd. Mirrors at points keep the parities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    pub dims: [usize; 3],
    body_centred: bool,
}

impl Grid {
    /// Returns the grid that contains the samples of a lattice.
    ///
    /// # Errors
    /// [`Error::Argument`] for a rectilinear lattice, and for a body-centred lattice of a single
    /// layer, whose mirror image would coincide with itself.
    pub fn of(lattice: &Lattice) -> Result<Self> {
        let [nx, ny, nz] = lattice.dims;
        match lattice.arrangement {
            Arrangement::Cartesian => Ok(Self { dims: lattice.dims, body_centred: false }),
            Arrangement::BodyCentred if nz < 2 => Err(Error::Argument(
                "a body-centred lattice needs at least two layers of samples".into(),
            )),
            Arrangement::BodyCentred => Ok(Self { dims: [2 * nx, 2 * ny, nz], body_centred: true }),
            Arrangement::Rectilinear(_) => Err(Error::Argument(
                "samples at uneven distances (a rectilinear lattice) have no frequency response to \
                 divide by"
                    .into(),
            )),
        }
    }

    /// Returns a grid of `side` points along each axis, with the same arrangement.
    pub fn cube(self, side: usize) -> Self {
        Self { dims: [side; 3], ..self }
    }

    /// Number of points.
    pub fn len(self) -> usize {
        self.dims.iter().fold(1, |all, &n| all.saturating_mul(n))
    }

    /// The distance between points in the lattice's kernel units. On a body-centred lattice that is
    /// half an edge, and a unit is √½ of an edge.
    pub fn step(self) -> f64 {
        if self.body_centred { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 }
    }

    /// The distance from a sample to the lattice's next planes of mirror symmetry, in points.
    pub fn symmetric_part(self) -> f64 {
        if self.body_centred { 1.0 } else { 0.5 }
    }

    /// Returns whether the point at this offset from a sample is a sample too.
    pub fn connects(self, [i, j, k]: [isize; 3]) -> bool {
        !self.body_centred || ((i ^ k) | (j ^ k)) & 1 == 0
    }

    /// Returns the point within the grid that mirrors the sample at an index, which may lie outside
    /// the lattice.
    pub fn point(self, [i, j, k]: [isize; 3]) -> [usize; 3] {
        let odd = k & 1;
        let place = if self.body_centred { [2 * i + odd, 2 * j + odd, k] } else { [i, j, k] };
        std::array::from_fn(|axis| mirrored(place[axis], self.dims[axis]))
    }

    /// Returns the index of the sample at a point.
    pub fn index(self, [i, j, k]: [usize; 3]) -> [usize; 3] {
        if self.body_centred { [i / 2, j / 2, k] } else { [i, j, k] }
    }

    /// Returns the offset of a point in memory.
    pub fn offset(self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    /// Returns the samples at their points, and 0 elsewhere.
    pub fn fill(self, samples: &Samples) -> Vec<f64> {
        if !self.body_centred {
            return each_type!(samples, values => {
                values.par_iter().map(|&value| f64::from(value)).collect()
            });
        }
        let [nx, ny, _] = self.dims;
        let mut points = vec![0.0; self.dims.iter().product()];
        points.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
            let (j, k) = (row % ny, row / ny);
            if j % 2 == k % 2 {
                let first = (k * ny + j) / 2 * (nx / 2);
                each_type!(samples, values => {
                    let row = &values[first..][..nx / 2];
                    let points = out[k % 2..].iter_mut().step_by(2);
                    points.zip(row).for_each(|(out, &value)| *out = f64::from(value));
                });
            }
        });
        points
    }
}

/// Returns the value of a kernel at a distance in kernel units. A truncated kernel jumps at the
/// edge of its footprint. There the value is the mean of both sides, so that rounding does not
/// decide.
pub fn weight(kernel: &Kernel, distance: f64) -> f64 {
    if (distance - kernel.extent).abs() < 1e-9 {
        0.5 * kernel.value(kernel.extent)
    } else {
        kernel.value(distance)
    }
}

/// The sum of a kernel times a wave over a lattice's samples, for every wave that a grid can
/// represent. It is 1 for a constant.
pub struct Response {
    grid: Grid,
    /// Points that the kernel reaches along an axis, including the centre.
    reach: usize,
    /// Weights of the points (i, j, k) ≥ 0, first axis fastest. Each includes the weights of its
    /// mirror images.
    weights: Vec<f64>,
    /// For each axis and frequency, the cosines at the points that the kernel reaches.
    cosines: [Vec<f64>; 3],
}

impl Response {
    pub fn new(grid: Grid, kernel: &Kernel) -> Self {
        let reach = (kernel.extent / grid.step()) as usize + 1;
        let mut weights = Vec::with_capacity(reach.pow(3));
        for k in 0..reach {
            for j in 0..reach {
                for i in 0..reach {
                    let images = [i, j, k]
                        .iter()
                        .fold(1.0, |images, &at| if at > 0 { 2.0 * images } else { images });
                    let distance = ((i * i + j * j + k * k) as f64).sqrt() * grid.step();
                    let inside = grid.connects([i, j, k].map(|at| at as isize));
                    weights.push(if inside { images * weight(kernel, distance) } else { 0.0 });
                }
            }
        }
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|weight| *weight /= sum);
        let cosines = grid.dims.map(|count| {
            (0..count)
                .flat_map(|at| (0..reach).map(move |m| (m as f64 * frequency(at, count)).cos()))
                .collect()
        });
        Self { grid, reach, weights, cosines }
    }

    /// Calls `take` with the responses at the frequencies (0 …, j, k).
    fn row<T>(
        &self,
        [j, k]: [usize; 2],
        take: impl FnOnce(&mut dyn Iterator<Item = f64>) -> T,
    ) -> T {
        let reach = self.reach;
        let [x, y, z] = &self.cosines;
        let (y, z) = (&y[j * reach..][..reach], &z[k * reach..][..reach]);
        let mut along = vec![0.0; reach];
        for (row, weights) in self.weights.chunks(reach).enumerate() {
            let wave = y[row % reach] * z[row / reach];
            along.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += wave * weight);
        }
        take(&mut x.chunks(reach).map(|x| x.iter().zip(&along).map(|(x, weight)| x * weight).sum()))
    }

    /// Returns the smallest response: the fraction that the kernel leaves of the wave that it damps
    /// most.
    pub fn least(&self) -> f64 {
        let [_, ny, nz] = self.grid.dims;
        let row = |row: usize| {
            self.row([row % ny, row / ny], |responses| responses.fold(f64::INFINITY, f64::min))
        };
        (0..ny * nz).into_par_iter().map(row).reduce(|| f64::INFINITY, f64::min)
    }

    /// Divides a field on the grid by the response.
    pub fn divide(&self, values: &mut [f64]) {
        cosine::filter(values, self.grid.dims, |place, spectrum| {
            self.row(place, |responses| {
                spectrum.iter_mut().zip(responses).for_each(|(value, part)| *value /= part);
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    #[test]
    fn body_centred_samples_are_points_of_a_finer_grid() {
        let lattice = Lattice::body_centred([2, 3, 5], DVec3::ZERO, DMat3::IDENTITY);
        let grid = Grid::of(&lattice).unwrap();
        let samples = Samples::I16((1..=30).collect());
        let points = grid.fill(&samples);
        assert_eq!(points.iter().filter(|&&value| value != 0.0).count(), 30);
        for sample in 0..30 {
            let index = lattice.index(sample);
            let point = grid.point(index.map(|at| at as isize));
            assert_eq!(grid.index(point), index);
            assert_eq!(points[grid.offset(point)], samples.value(sample));
            let steps = lattice.steps(index) * 2.0;
            assert_eq!(steps, DVec3::from_array(point.map(|at| at as f64)));
        }
        // Beyond the border lie mirror images of the same parity.
        assert_eq!(grid.point([-1, 0, -1]), [1, 1, 1]);
        assert_eq!(grid.point([2, -1, 6]), [2, 2, 2]);
        assert!(Grid::of(&Lattice::body_centred([2, 3, 1], DVec3::ZERO, DMat3::IDENTITY)).is_err());
    }
}

//! The cosine transform of a field that continues mirrored beyond its first and last samples along
//! every axis (DCT-I: whole-sample symmetry; Martucci, "Symmetric convolution and the discrete sine
//! and cosine transforms", 1994).

use crate::parallel::prelude::*;
use rustfft::{Fft, FftPlanner, num_complex::Complex};
use std::{f64::consts::PI, sync::Arc};

/// Columns that one task gathers at a time, two for each complex line: as many as a cache line
/// holds.
const TILE: usize = 8;

/// Filters a field of `dims` samples, first axis fastest: `factor` multiplies each row of its
/// spectrum. The row (j, k) holds the frequencies [`frequency`]`(i, dims[0])`, `(j, dims[1])`, `(k,
/// dims[2])` for all i.
///
/// A period is 2(n − 1) samples long. The spectrum of a mirrored field is real, so one complex line
/// carries two real ones. The transform is its own inverse except for a factor of the period.
/// Memory beside the field: some lines per thread.
///
/// # Panics
/// If the field has another number of samples.
pub fn filter(
    values: &mut [f64],
    dims: [usize; 3],
    factor: impl Fn([usize; 2], &mut [f64]) + Sync,
) {
    assert_eq!(values.len(), dims.iter().product::<usize>(), "a field of {dims:?} samples");
    if values.is_empty() {
        return;
    }
    let mut planner = FftPlanner::new();
    let plans = dims.map(|n| (n > 1).then(|| planner.plan_fft_forward(2 * (n - 1))));
    let [nx, ny, _] = dims;
    transform(values, dims, &plans);
    let scale = plans.iter().flatten().map(|plan| plan.len() as f64).product::<f64>().recip();
    values.par_chunks_mut(nx).enumerate().for_each(|(row, spectrum)| {
        factor([row % ny, row / ny], spectrum);
        spectrum.iter_mut().for_each(|value| *value *= scale);
    });
    transform(values, dims, &plans);
}

/// Returns the angle per sample of the `index`-th frequency of an axis of `count` samples.
pub fn frequency(index: usize, count: usize) -> f64 {
    if count > 1 { PI * index as f64 / (count - 1) as f64 } else { 0.0 }
}

/// Returns the sample that a mirrored axis of `count` samples has at a position on or beyond it.
pub fn mirrored(place: isize, count: usize) -> usize {
    let last = count - 1;
    let around = place.unsigned_abs() % (2 * last).max(1);
    around.min((2 * last).saturating_sub(around))
}

type Plan = Option<Arc<dyn Fft<f64>>>;

fn transform(values: &mut [f64], [nx, ny, _]: [usize; 3], plans: &[Plan; 3]) {
    if let Some(plan) = &plans[0] {
        values.par_chunks_mut(2 * nx).for_each(|rows| {
            let (first, second) = rows.split_at_mut(nx);
            let value = |at: usize| Complex::new(first[at], second.get(at).copied().unwrap_or(0.0));
            let mut line = vec![Complex::ZERO; plan.len()];
            mirror(&mut line, nx, value);
            plan.process(&mut line);
            first.iter_mut().zip(&line).for_each(|(out, value)| *out = value.re);
            second.iter_mut().zip(&line).for_each(|(out, value)| *out = value.im);
        });
    }
    if let Some(plan) = &plans[1] {
        values
            .par_chunks_mut(nx * ny)
            .for_each(|slice| across(plan.as_ref(), slice.chunks_mut(nx).collect()));
    }
    if let Some(plan) = &plans[2] {
        let mut planes: Vec<Vec<&mut [f64]>> = (0..ny).map(|_| Vec::new()).collect();
        for slice in values.chunks_mut(nx * ny) {
            planes.iter_mut().zip(slice.chunks_mut(nx)).for_each(|(plane, row)| plane.push(row));
        }
        planes.into_par_iter().for_each(|plane| across(plan.as_ref(), plane));
    }
}

/// Transforms every column of the rows.
fn across(plan: &dyn Fft<f64>, mut rows: Vec<&mut [f64]>) {
    let (count, width, period) = (rows.len(), rows[0].len(), plan.len());
    let mut tile = vec![Complex::ZERO; TILE.div_ceil(2) * period];
    let mut scratch = vec![Complex::ZERO; plan.get_inplace_scratch_len()];
    for start in (0..width).step_by(TILE) {
        let columns = start..(start + TILE).min(width);
        let lines = &mut tile[..columns.len().div_ceil(2) * period];
        for (index, line) in lines.chunks_mut(period).enumerate() {
            let column = start + 2 * index;
            let value = |at: usize| {
                let row: &[f64] = rows[at];
                Complex::new(row[column], row.get(column + 1).copied().unwrap_or(0.0))
            };
            mirror(line, count, value);
        }
        plan.process_with_scratch(lines, &mut scratch);
        for (at, row) in rows.iter_mut().enumerate() {
            for (index, pair) in row[columns.clone()].chunks_mut(2).enumerate() {
                let value = lines[index * period + at];
                pair.iter_mut().zip([value.re, value.im]).for_each(|(out, value)| *out = value);
            }
        }
    }
}

/// Fills a period of a line from its first `count` values.
fn mirror(line: &mut [Complex<f64>], count: usize, value: impl Fn(usize) -> Complex<f64>) {
    for at in 0..count {
        line[at] = value(at);
        line[(line.len() - at) % line.len()] = line[at];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrors_keep_the_ends_single() {
        assert_eq!(
            [-5, -4, -1, 0, 2, 3, 4, 5, 6, 7].map(|at| mirrored(at, 4)),
            [1, 2, 1, 0, 2, 3, 2, 1, 0, 1]
        );
        assert_eq!([-3, 0, 2].map(|at| mirrored(at, 1)), [0; 3]);
    }

    /// Filtering the spectrum equals convolution with mirrored borders, whatever the lengths of the
    /// axes.
    #[test]
    fn filters_as_convolution_does() {
        let weights = [0.5, 0.25, -0.125];
        for dims in [[7, 6, 5], [1, 9, 2], [2, 1, 3], [1, 1, 1], [11, 8, 1]] {
            let field: Vec<f64> =
                (0..dims.iter().product()).map(|i: usize| ((i * i) as f64 * 0.37).sin()).collect();
            let at = |place: [isize; 3]| {
                let [i, j, k] = std::array::from_fn(|axis| mirrored(place[axis], dims[axis]));
                field[(k * dims[1] + j) * dims[0] + i]
            };
            for axis in 0..3 {
                let mut filtered = field.clone();
                filter(&mut filtered, dims, |[j, k], row| {
                    for (i, value) in row.iter_mut().enumerate() {
                        let angle = frequency([i, j, k][axis], dims[axis]);
                        *value *= (0..3)
                            .map(|m| {
                                f64::from(1 + i32::from(m > 0))
                                    * weights[m]
                                    * (m as f64 * angle).cos()
                            })
                            .sum::<f64>();
                    }
                });
                for (index, value) in filtered.into_iter().enumerate() {
                    let place =
                        [index % dims[0], index / dims[0] % dims[1], index / dims[0] / dims[1]];
                    let expected: f64 = (-2..=2isize)
                        .map(|m| {
                            let mut place = place.map(|at| at as isize);
                            place[axis] += m;
                            weights[m.unsigned_abs()] * at(place)
                        })
                        .sum();
                    assert!(
                        (value - expected).abs() < 1e-12,
                        "{dims:?}, axis {axis}, sample {index}"
                    );
                }
            }
        }
    }
}

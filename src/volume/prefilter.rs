//! The coefficients of a cubic B-spline that passes through the samples of a Cartesian lattice.
//!
//! The weights of the spline at the samples are ⅙, ⅔ and ⅙ along each axis. The inverse of that
//! filter is one forward and one backward recursion, both with the pole √3 − 2. See Unser, Aldroubi
//! & Eden, "Fast B-spline transforms for continuous image representation and interpolation", 1991.
//! See also Thévenaz, Blu & Unser, "Interpolation revisited", 2000. The samples continue mirrored
//! at the outermost ones, and so do the coefficients.

use super::{Samples, each_type};
use crate::{math::cosine::mirrored, parallel::prelude::*};

/// The pole of the recursions.
const POLE: f32 = -0.267_949_2;
/// The gain of the inverse filter: (1 − pole) · (1 − 1/pole) = 6.
const GAIN: f32 = 6.0;
/// Rows that are filtered side by side.
const LINES: usize = 8;
/// Samples that the first forward term sums. The rest would contribute 10⁻¹⁰.
const HORIZON: usize = 18;

/// Returns the coefficients of samples on a lattice of `dims`, first axis fastest.
pub fn cubic(samples: &Samples, dims: [usize; 3]) -> Vec<f32> {
    let [nx, ny, nz] = dims;
    let mut values: Vec<f32> = each_type!(samples, values => {
        values.par_iter().map(|value| f64::from(*value) as f32).collect()
    });
    values.par_chunks_mut(nx * ny).for_each(|slice| {
        let mut rows = slice.chunks_exact_mut(LINES * nx);
        rows.by_ref().for_each(|rows| along_rows::<LINES>(rows, nx));
        rows.into_remainder().chunks_mut(nx).for_each(|row| along_rows::<1>(row, nx));
        across_rows(&mut slice.chunks_mut(nx).collect::<Vec<_>>());
    });
    // Groups the rows of all slices that lie behind each other.
    let mut columns: Vec<Vec<&mut [f32]>> = (0..ny).map(|_| Vec::with_capacity(nz)).collect();
    for (number, row) in values.chunks_mut(nx).enumerate() {
        columns[number % ny].push(row);
    }
    columns.par_iter_mut().for_each(|rows| across_rows(rows));
    values
}

/// Returns the terms of the first forward value on a mirrored axis: a sample, and the factor (a
/// power of the pole) on it.
fn first_terms(count: usize) -> impl Iterator<Item = (usize, f32)> {
    let period = 2 * (count - 1);
    let (terms, whole) =
        if period <= HORIZON { (period, 1.0 - POLE.powi(period as i32)) } else { (HORIZON, 1.0) };
    (0..terms).map(move |at| (mirrored(at as isize, count), GAIN * POLE.powi(at as i32) / whole))
}

/// The factor on the last forward term in the first backward one.
fn turn() -> f32 {
    POLE / (POLE * POLE - 1.0)
}

/// Filters rows of `count` values along themselves. Each term depends on the one before it, so
/// several independent rows are interleaved.
fn along_rows<const ROWS: usize>(values: &mut [f32], count: usize) {
    let mut rows: [&mut [f32]; ROWS] = std::array::from_fn(|_| Default::default());
    rows.iter_mut().zip(values.chunks_exact_mut(count)).for_each(|(slot, row)| *slot = row);
    if count < 2 || rows.iter().any(|row| row.len() != count) {
        return;
    }
    let mut last = [0f32; ROWS];
    for (last, row) in last.iter_mut().zip(&mut rows) {
        *last = first_terms(count).map(|(at, factor)| factor * row[at]).sum();
        row[0] = *last;
    }
    for at in 1..count {
        for (last, row) in last.iter_mut().zip(&mut rows) {
            *last = POLE * *last + GAIN * row[at];
            row[at] = *last;
        }
    }
    for (last, row) in last.iter_mut().zip(&mut rows) {
        *last = turn() * (*last + POLE * row[count - 2]);
        row[count - 1] = *last;
    }
    for at in (0..count - 1).rev() {
        for (last, row) in last.iter_mut().zip(&mut rows) {
            *last = POLE * (*last - row[at]);
            row[at] = *last;
        }
    }
}

/// Filters from row to row.
fn across_rows(rows: &mut [&mut [f32]]) {
    let count = rows.len();
    if count < 2 {
        return;
    }
    let mut first = vec![0.0; rows[0].len()];
    for (at, factor) in first_terms(count) {
        first.iter_mut().zip(&*rows[at]).for_each(|(sum, value)| *sum += factor * value);
    }
    rows[0].copy_from_slice(&first);
    for at in 1..count {
        if let [.., before, row] = &mut rows[..=at] {
            row.iter_mut()
                .zip(&**before)
                .for_each(|(value, before)| *value = POLE * before + GAIN * *value);
        }
    }
    if let [.., before, last] = rows {
        last.iter_mut()
            .zip(&**before)
            .for_each(|(value, before)| *value = turn() * (*value + POLE * before));
    }
    for at in (0..count - 1).rev() {
        if let [row, after, ..] = &mut rows[at..] {
            row.iter_mut()
                .zip(&**after)
                .for_each(|(value, after)| *value = POLE * (after - *value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spline_passes_through_the_samples() {
        for dims in
            [[1, 1, 1], [2, 1, 3], [1, 2, 1], [3, 2, 2], [4, 10, 11], [40, 3, 9], [5, 33, 12]]
        {
            let [nx, ny, nz] = dims;
            let value = |at: usize| ((at * at) as f32).sin() * 100.0 + 50.0;
            let samples = Samples::F32((0..nx * ny * nz).map(value).collect());
            let coefficients = cubic(&samples, dims);
            let mut most = 0f64;
            for at in 0..nx * ny * nz {
                let place = [at % nx, at / nx % ny, at / nx / ny];
                let mut sum = 0.0;
                for tap in 0..27 {
                    let shift = [tap % 3, tap / 3 % 3, tap / 9];
                    let weight: f64 = shift
                        .iter()
                        .map(|&by| if by == 1 { 2.0 / 3.0 } else { 1.0 / 6.0 })
                        .product();
                    let [i, j, k] =
                        [0, 1, 2].map(|n| mirrored((place[n] + shift[n]) as isize - 1, dims[n]));
                    sum += weight * f64::from(coefficients[(k * ny + j) * nx + i]);
                }
                most = most.max((sum - samples.value(at)).abs());
            }
            assert!(most < 1e-4, "{dims:?}: {most}");
        }
    }
}

//! Computes a level from the one below: means of 2×2×2 samples.

use crate::{parallel::prelude::*, volume::Scalar};
use bytemuck::Pod;

/// A sample type that has means.
trait Mean: Pod + Send + Sync {
    /// Returns the mean, rounded to the nearest value of the type, halves away from zero.
    fn mean(of: [Self; 8]) -> Self;
}

macro_rules! whole {
    ($($number:ty),*) => {$(
        impl Mean for $number {
            fn mean(of: [Self; 8]) -> Self {
                let sum: i64 = of.iter().map(|&value| i64::from(value)).sum();
                ((sum + 4 * sum.signum()) / 8) as Self
            }
        }
    )*};
}
whole!(u8, u16, i16, i32);

impl Mean for f32 {
    fn mean(of: [Self; 8]) -> Self {
        (of.iter().map(|&value| f64::from(value)).sum::<f64>() / 8.0) as Self
    }
}

/// Returns the bytes of the means of slices of `dims` samples. At the end of an odd axis, the last
/// samples count twice.
pub fn halve(scalar: Scalar, samples: &[u8], dims: [usize; 3]) -> Vec<u8> {
    match scalar {
        Scalar::U8 => means::<u8>(samples, dims),
        Scalar::U16 => means::<u16>(samples, dims),
        Scalar::I16 => means::<i16>(samples, dims),
        Scalar::I32 => means::<i32>(samples, dims),
        Scalar::F32 => means::<f32>(samples, dims),
    }
}

fn means<T: Mean>(samples: &[u8], dims: [usize; 3]) -> Vec<u8> {
    let size = size_of::<T>();
    let [nx, ny, nz] = dims;
    let [cx, cy, cz] = dims.map(|n| n.div_ceil(2));
    let at =
        |row: &[u8], i: usize| bytemuck::pod_read_unaligned::<T>(&row[i * size..(i + 1) * size]);
    let mut out = vec![0; cx * cy * cz * size];
    out.par_chunks_mut(cx * size).enumerate().for_each(|(row, out)| {
        let (j, k) = (2 * (row % cy), 2 * (row / cy));
        let row = |dj: usize, dk: usize| {
            let start = ((k + dk).min(nz - 1) * ny + (j + dj).min(ny - 1)) * nx * size;
            &samples[start..start + nx * size]
        };
        let rows = [row(0, 0), row(1, 0), row(0, 1), row(1, 1)];
        for (i, out) in out.chunks_exact_mut(size).enumerate() {
            let (left, right) = (2 * i, (2 * i + 1).min(nx - 1));
            let [a, b, c, d] = rows.map(|row| [at(row, left), at(row, right)]);
            out.copy_from_slice(bytemuck::bytes_of(&T::mean([
                a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1],
            ])));
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_round_away_from_zero() {
        assert_eq!(u8::mean([0, 0, 0, 0, 1, 1, 1, 1]), 1);
        assert_eq!(u8::mean([255; 8]), 255);
        assert_eq!(i16::mean([0, 0, 0, 0, -1, -1, -1, -1]), -1);
        assert_eq!(i16::mean([0, 0, 0, 0, 0, -1, -1, -1]), 0);
        assert_eq!(i32::mean([i32::MIN; 8]), i32::MIN);
        assert_eq!(f32::mean([f32::MAX; 8]), f32::MAX);
    }

    #[test]
    fn borders_count_again() {
        // 3 × 1 × 2: the mean of a pair of columns, then of the last column counted twice.
        assert_eq!(halve(Scalar::U8, &[0, 10, 20, 20, 30, 41], [3, 1, 2]), [15, 31]);
    }
}

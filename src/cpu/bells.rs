//! Sums of Gaussians over the samples in reach, as products along the axes or cut at a distance
//! from the ray.

use super::{
    kernel_sums::{MOST_TAPS, Sums},
    vector::{Lanes, dot, exp2, three},
};
use fearless_simd::{Simd, prelude::*};

/// Returns the sums over samples at the distances `away` along the axes from a place. The values of
/// a row are adjacent. `log` is log₂ of the weight of a sample at distance 1. Samples further than
/// `radius` from the ray, whose direction is `way`, have no weight.
pub fn sums<S: Simd>(
    simd: S,
    log: f32,
    radius: Option<f32>,
    way: [Lanes<S>; 3],
    away: [&[Lanes<S>]; 3],
    values: &[Lanes<S>],
) -> Sums<S> {
    simd.vectorize(
        #[inline(always)]
        || {
            let none = Lanes::splat(simd, 0.0);
            let mut weights = [[none; MOST_TAPS]; 3];
            for axis in 0..3 {
                for (weight, away) in weights[axis].iter_mut().zip(away[axis]) {
                    *weight = exp2(simd, *away * *away * log);
                }
            }
            let weights = three!(I => &weights[I][..away[I].len()]);
            let mut sums = match radius {
                None => products(simd, weights, away, values),
                Some(radius) => cut(simd, radius, way, weights, away, values),
            };
            // The derivative of a Gaussian, from its first moment.
            let scale = 2.0 * std::f32::consts::LN_2 * log;
            sums.weight_slopes = three!(I => sums.weight_slopes[I] * scale);
            sums.value_slopes = three!(I => sums.value_slopes[I] * scale);
            sums
        },
    )
}

/// Returns the sums with the first moments in place of the slopes.
#[inline(always)]
fn products<S: Simd>(
    simd: S,
    weights: [&[Lanes<S>]; 3],
    away: [&[Lanes<S>]; 3],
    values: &[Lanes<S>],
) -> Sums<S> {
    let none = Lanes::splat(simd, 0.0);
    let mut moments = [[none; MOST_TAPS]; 3];
    let (mut all, mut means) = ([none; 3], [none; 3]);
    for axis in 0..3 {
        for ((moment, weight), away) in moments[axis].iter_mut().zip(weights[axis]).zip(away[axis])
        {
            *moment = *weight * *away;
            all[axis] += *weight;
            means[axis] += *moment;
        }
    }
    let [x, y, z] = weights;
    let (mut value, mut value_slopes) = (none, [none; 3]);
    let mut rows = values.chunks_exact(x.len());
    for (z, moment_z) in z.iter().zip(&moments[2]) {
        let (mut slice, mut slice_x, mut slice_y) = (none, none, none);
        for (y, moment_y) in y.iter().zip(&moments[1]) {
            let Some(row) = rows.next() else { break };
            let (mut sum, mut sum_x) = (none, none);
            for ((x, moment_x), sample) in x.iter().zip(&moments[0]).zip(row) {
                sum = x.mul_add(*sample, sum);
                sum_x = moment_x.mul_add(*sample, sum_x);
            }
            slice = y.mul_add(sum, slice);
            slice_x = y.mul_add(sum_x, slice_x);
            slice_y = moment_y.mul_add(sum, slice_y);
        }
        value = z.mul_add(slice, value);
        value_slopes[0] = z.mul_add(slice_x, value_slopes[0]);
        value_slopes[1] = z.mul_add(slice_y, value_slopes[1]);
        value_slopes[2] = moment_z.mul_add(slice, value_slopes[2]);
    }
    let weight_slopes =
        [means[0] * all[1] * all[2], all[0] * means[1] * all[2], all[0] * all[1] * means[2]];
    Sums { weight: all[0] * all[1] * all[2], value, weight_slopes, value_slopes }
}

/// Returns the same for samples no further than `radius` from the ray.
#[inline(always)]
fn cut<S: Simd>(
    simd: S,
    radius: f32,
    way: [Lanes<S>; 3],
    [x, y, z]: [&[Lanes<S>]; 3],
    away: [&[Lanes<S>]; 3],
    values: &[Lanes<S>],
) -> Sums<S> {
    let none = Lanes::splat(simd, 0.0);
    let inverse = Lanes::splat(simd, 1.0) / dot(way, way).sqrt();
    let way = three!(I => way[I] * inverse);
    let squared = Lanes::splat(simd, radius * radius);
    let (mut weight, mut value) = (none, none);
    let (mut weight_slopes, mut value_slopes) = ([none; 3], [none; 3]);
    let mut rows = values.chunks_exact(x.len());
    for (z, away_z) in z.iter().zip(away[2]) {
        for (y, away_y) in y.iter().zip(away[1]) {
            let Some(row) = rows.next() else { break };
            let aside = away_y.mul_add(*away_y, *away_z * *away_z);
            let along = away_y.mul_add(way[1], *away_z * way[2]);
            let both = *y * *z;
            let (mut sum, mut weighted_sum) = (none, none);
            for ((x, away_x), sample) in x.iter().zip(away[0]).zip(row) {
                let along = away_x.mul_add(way[0], along);
                let beside = away_x.mul_add(*away_x, aside) - along * along;
                let h = beside.simd_le(squared).select(both * *x, none);
                let weighted = h * *sample;
                sum += h;
                weighted_sum += weighted;
                weight_slopes[0] = h.mul_add(*away_x, weight_slopes[0]);
                value_slopes[0] = weighted.mul_add(*away_x, value_slopes[0]);
            }
            weight += sum;
            value += weighted_sum;
            weight_slopes[1] = sum.mul_add(*away_y, weight_slopes[1]);
            value_slopes[1] = weighted_sum.mul_add(*away_y, value_slopes[1]);
            weight_slopes[2] = sum.mul_add(*away_z, weight_slopes[2]);
            value_slopes[2] = weighted_sum.mul_add(*away_z, value_slopes[2]);
        }
    }
    Sums { weight, value, weight_slopes, value_slopes }
}

//! Radial kernels as functions of the squared distance from their sample, eight at a time, and
//! their sums over the samples in reach.

use super::{
    kernel_sums::Sums,
    vector::{Lanes, each, three},
    window::pairs,
};
use crate::math::{Kernel, Profile};
use fearless_simd::{Simd, i32x8, prelude::*};
use std::f64::consts::PI;

/// Maximum error of a polynomial and of its slope, relative to a kernel whose largest value is 1.
const LEAST_ERRORS: [f64; 2] = [2e-6, 3e-5];
/// Number of pieces of the table for a kernel that no polynomial fits.
const PIECES: u32 = 4096;

/// A radial kernel, in units of samples.
#[derive(Debug)]
pub enum Radial {
    Spline(Spline),
    Low(Even<9>),
    Middle(Even<12>),
    High(Even<16>),
    Table(Table),
}

/// The cubic B-spline: the inverse of its half extent.
#[derive(Debug)]
pub struct Spline {
    per_knot: f32,
}

/// A polynomial in the squared distance, up to an extent: its coefficients of 1, v, v², …, where v
/// runs from −1 at the sample to 1 at the extent.
#[derive(Debug)]
pub struct Even<const N: usize> {
    factors: [f32; N],
    /// The square of the extent, and 2 over that square.
    last: f32,
    scale: f32,
}

/// Values at equal distances, and their differences to the next value.
#[derive(Debug)]
pub struct Table {
    pairs: Vec<[f32; 2]>,
    per_step: f32,
}

/// Returns kernel values and h′(r)/r at squared distances. h′(r)/r times the offset from the sample
/// is the gradient.
trait Weigh {
    fn weigh<S: Simd>(&self, simd: S, squared: Lanes<S>) -> [Lanes<S>; 2];
}

impl Radial {
    pub fn new(kernel: &Kernel) -> Self {
        match &kernel.profile {
            Profile::BSpline => Self::Spline(Spline { per_knot: (2.0 / kernel.extent) as f32 }),
            Profile::Table(values) => Self::Table(Table::new(values, kernel.extent)),
            _ => {
                if let Some(even) = Even::new(kernel) {
                    return Self::Low(even);
                }
                if let Some(even) = Even::new(kernel) {
                    return Self::Middle(even);
                }
                if let Some(even) = Even::new(kernel) {
                    return Self::High(even);
                }
                let value =
                    |at: u32| kernel.value(kernel.extent * f64::from(at) / f64::from(PIECES));
                Self::Table(Table::new(&(0..=PIECES).map(value).collect::<Vec<_>>(), kernel.extent))
            }
        }
    }

    /// Returns the sums over samples at the distances `away` along the axes from a place, in
    /// samples. The values of a row are adjacent.
    pub fn sums<S: Simd>(
        &self,
        simd: S,
        away: [&[Lanes<S>]; 3],
        values: &[Lanes<S>],
        extent: f32,
    ) -> Sums<S> {
        let squared = extent * extent;
        // A separate function for each form.
        match self {
            Self::Spline(form) => simd.vectorize(
                #[inline(always)]
                || sums(simd, form, away, values, squared),
            ),
            Self::Low(form) => simd.vectorize(
                #[inline(always)]
                || sums(simd, form, away, values, squared),
            ),
            Self::Middle(form) => simd.vectorize(
                #[inline(always)]
                || sums(simd, form, away, values, squared),
            ),
            Self::High(form) => simd.vectorize(
                #[inline(always)]
                || sums(simd, form, away, values, squared),
            ),
            Self::Table(form) => simd.vectorize(
                #[inline(always)]
                || sums(simd, form, away, values, squared),
            ),
        }
    }
}

#[inline(always)]
fn sums<S: Simd>(
    simd: S,
    kernel: &impl Weigh,
    [x, y, z]: [&[Lanes<S>]; 3],
    values: &[Lanes<S>],
    squared_extent: f32,
) -> Sums<S> {
    let none = Lanes::splat(simd, 0.0);
    let (mut weight, mut value) = (none, none);
    let (mut weight_slopes, mut value_slopes) = ([none; 3], [none; 3]);
    let mut rows = values.chunks_exact(x.len());
    for z in z {
        let (mut slope_z, mut value_z) = (none, none);
        for y in y {
            let Some(row) = rows.next() else { break };
            let aside = y.mul_add(*y, *z * *z);
            if aside.simd_ge(squared_extent).all_true() {
                continue;
            }
            let (mut slope, mut value_slope) = (none, none);
            for (x, sample) in x.iter().zip(row) {
                let [h, s] = kernel.weigh(simd, x.mul_add(*x, aside));
                let s_sample = s * *sample;
                weight += h;
                value = h.mul_add(*sample, value);
                slope += s;
                value_slope += s_sample;
                weight_slopes[0] = s.mul_add(*x, weight_slopes[0]);
                value_slopes[0] = s_sample.mul_add(*x, value_slopes[0]);
            }
            weight_slopes[1] = slope.mul_add(*y, weight_slopes[1]);
            value_slopes[1] = value_slope.mul_add(*y, value_slopes[1]);
            slope_z += slope;
            value_z += value_slope;
        }
        weight_slopes[2] = slope_z.mul_add(*z, weight_slopes[2]);
        value_slopes[2] = value_z.mul_add(*z, value_slopes[2]);
    }
    Sums {
        weight,
        value,
        weight_slopes: three!(I => weight_slopes[I]),
        value_slopes: three!(I => value_slopes[I]),
    }
}

impl Weigh for Spline {
    #[inline(always)]
    fn weigh<S: Simd>(&self, simd: S, squared: Lanes<S>) -> [Lanes<S>; 2] {
        let none = Lanes::splat(simd, 0.0);
        // In half extents: ¼(2 − t)³ − (1 − t)³, each clamped at 0.
        let t = (squared.sqrt() * self.per_knot).max(Lanes::splat(simd, 1e-4));
        let outer = (Lanes::splat(simd, 2.0) - t).max(none);
        let inner = (Lanes::splat(simd, 1.0) - t).max(none);
        let (outer_squared, inner_squared) = (outer * outer, inner * inner);
        let value = outer_squared * outer * 0.25 - inner_squared * inner;
        let slope = (inner_squared * 3.0 - outer_squared * 0.75) / t;
        [value, slope * (self.per_knot * self.per_knot)]
    }
}

impl<const N: usize> Even<N> {
    /// Returns the polynomial for a kernel, or `None` if its error is too large.
    fn new(kernel: &Kernel) -> Option<Self> {
        let last = kernel.extent * kernel.extent;
        let radius = |v: f64| (0.5 * (v + 1.0) * last).max(0.0).sqrt();
        // The Chebyshev coefficients, from the values at the zeros of a polynomial of higher
        // degree.
        const NODES: usize = 64;
        let angle = |node: usize| PI * (node as f64 + 0.5) / NODES as f64;
        let values: Vec<f64> =
            (0..NODES).map(|node| kernel.value(radius(angle(node).cos()))).collect();
        let mut factors = [0.0; N];
        let (mut before, mut current) = ([0.0; N], [0.0; N]);
        current[0] = 1.0;
        for degree in 0..N {
            let sum: f64 = values
                .iter()
                .enumerate()
                .map(|(node, v)| v * (degree as f64 * angle(node)).cos())
                .sum();
            let share = sum * if degree == 0 { 1.0 } else { 2.0 } / NODES as f64;
            factors.iter_mut().zip(current).for_each(|(factor, part)| *factor += share * part);
            let mut next = [0.0; N];
            for power in 0..N - 1 {
                next[power + 1] = current[power] * if degree == 0 { 1.0 } else { 2.0 };
            }
            next.iter_mut().zip(before).for_each(|(next, before)| *next -= before);
            (before, current) = (current, next);
        }
        let largest = kernel.value(0.0).abs();
        let at = |v: f64| {
            factors
                .iter()
                .rev()
                .fold([0.0, 0.0], |[sum, slope], factor| [sum * v + factor, slope * v + sum])
        };
        let is_near = (0..=1000).all(|step| {
            let v = f64::from(step) / 500.0 - 1.0;
            let [value, slope] = at(v);
            let difference = 1e-5;
            let (low, high) = ((v - difference).max(-1.0), (v + difference).min(1.0));
            let expected = (kernel.value(radius(high)) - kernel.value(radius(low))) / (high - low);
            let r = radius(v);
            (value - kernel.value(r)).abs() <= LEAST_ERRORS[0] * largest
                && (slope - expected).abs() * 4.0 / last * r <= LEAST_ERRORS[1] * largest
        });
        let (last, scale) = (last as f32, (2.0 / last) as f32);
        is_near.then(|| Self { factors: factors.map(|factor| factor as f32), last, scale })
    }
}

impl<const N: usize> Weigh for Even<N> {
    #[inline(always)]
    fn weigh<S: Simd>(&self, simd: S, squared: Lanes<S>) -> [Lanes<S>; 2] {
        let one = Lanes::splat(simd, 1.0);
        let v = squared
            .min(Lanes::splat(simd, self.last))
            .mul_add(Lanes::splat(simd, self.scale), -one);
        let mut value = Lanes::splat(simd, self.factors[N - 1]);
        let mut slope = value;
        for power in (1..N - 1).rev() {
            value = value.mul_add(v, Lanes::splat(simd, self.factors[power]));
            slope = slope.mul_add(v, value);
        }
        [value.mul_add(v, Lanes::splat(simd, self.factors[0])), slope * (2.0 * self.scale)]
    }
}

impl Table {
    fn new(values: &[f64], extent: f64) -> Self {
        let next = |at: usize| values.get(at + 1).map_or(0.0, |next| next - values[at]) as f32;
        let mut pairs: Vec<_> =
            (0..values.len() - 1).map(|at| [values[at] as f32, next(at)]).collect();
        // Zero beyond the extent.
        pairs.push([0.0; 2]);
        Self { pairs, per_step: ((values.len() - 1) as f64 / extent) as f32 }
    }
}

impl Weigh for Table {
    #[inline(always)]
    fn weigh<S: Simd>(&self, simd: S, squared: Lanes<S>) -> [Lanes<S>; 2] {
        let end = Lanes::splat(simd, (self.pairs.len() - 1) as f32);
        let at = (squared.sqrt() * self.per_step).min(end);
        let low = at.floor();
        let places: [i32; 8] = i32x8::truncate_from(low).into();
        let entries = each!([0, 1, 2, 3, 4, 5, 6, 7], L => self.pairs[places[L] as usize]);
        let [value, rise] = pairs(simd, entries);
        let per_squared = self.per_step * self.per_step;
        [(at - low).mul_add(rise, value), rise / at.max(Lanes::splat(simd, 1e-6)) * per_squared]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::vector::lanes;
    use fearless_simd::Level;

    #[test]
    fn weights_are_those_of_the_kernels() {
        let table = Kernel::table(vec![1.0, 0.7, 0.1, -0.1, 0.2], 2.5).unwrap();
        let mut kernels =
            vec![table, Kernel::b_spline(2.0).unwrap(), Kernel::b_spline(1.3).unwrap()];
        kernels.extend([1.3, 2.0, 2.7, 3.0, 4.0].map(|extent| Kernel::hann(extent).unwrap()));
        fn at<S: Simd>(simd: S, kernel: &impl Weigh, squared: [f32; 8]) -> [[f32; 8]; 2] {
            kernel.weigh(simd, squared.simd_into(simd)).map(Into::into)
        }
        let level = Level::new();
        for kernel in kernels {
            let radial = Radial::new(&kernel);
            assert!(
                !matches!((&radial, &kernel.profile), (Radial::Table(_), Profile::Hann)),
                "{kernel:?}"
            );
            for step in 0..100 {
                let radius =
                    |lane: usize| (step * 8 + lane) as f64 / 799.0 * (kernel.extent + 0.4) + 1e-3;
                let radii: [f64; 8] = std::array::from_fn(radius);
                let squared = radii.map(|r| (r * r) as f32);
                let [values, slopes] = match &radial {
                    Radial::Spline(form) => lanes!(level, simd => at(simd, form, squared)),
                    Radial::Low(form) => lanes!(level, simd => at(simd, form, squared)),
                    Radial::Middle(form) => lanes!(level, simd => at(simd, form, squared)),
                    Radial::High(form) => lanes!(level, simd => at(simd, form, squared)),
                    Radial::Table(form) => lanes!(level, simd => at(simd, form, squared)),
                };
                for ((r, value), slope) in radii.into_iter().zip(values).zip(slopes) {
                    let expected = kernel.value(r);
                    let close = 1e-5;
                    let rise = (kernel.value(r + close) - kernel.value(r - close)) / (2.0 * close);
                    // Not across the ends of a table's pieces.
                    let at = r / kernel.extent * 4.0;
                    if matches!(radial, Radial::Table(_)) && (at - at.round()).abs() < 1e-4 {
                        continue;
                    }
                    assert!(
                        (f64::from(value) - expected).abs() < 1e-5,
                        "{kernel:?} at {r}: {value} {expected}"
                    );
                    let slope = f64::from(slope) * r;
                    assert!(
                        (slope - rise).abs() < 1e-4,
                        "slope of {kernel:?} at {r}: {slope} {rise}"
                    );
                }
            }
        }
    }
}

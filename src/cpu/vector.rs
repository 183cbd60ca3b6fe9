//! Functions of eight numbers at once that the vector library lacks.

use fearless_simd::{Simd, f32x4, f32x8, i32x8, prelude::*};

/// An array with an expression for each index. A closure would do the same, but the compiler may
/// not inline it. Then every vector operation becomes a call, because a function uses only the
/// processor instructions that its caller's attributes name.
macro_rules! each {
    ([$($number:literal),+], $index:ident => $value:expr) => {
        [$({
            const $index: usize = $number;
            $value
        }),+]
    };
}
/// The same for three axes or channels.
macro_rules! three {
    ($index:ident => $value:expr) => {
        $crate::cpu::vector::each!([0, 1, 2], $index => $value)
    };
}
/// The same for colours with extinction.
macro_rules! four {
    ($index:ident => $value:expr) => {
        $crate::cpu::vector::each!([0, 1, 2, 3], $index => $value)
    };
}
/// A vector of 32-bit words, with an expression for each lane.
macro_rules! words {
    ($simd:expr, $lane:ident => $word:expr) => {{
        let words: [u32; 8] = $crate::cpu::vector::each!([0, 1, 2, 3, 4, 5, 6, 7], $lane => $word);
        let words: fearless_simd::u32x8<S> = fearless_simd::SimdInto::simd_into(words, $simd);
        words
    }};
}
/// Runs code with the processor's vectors, like `fearless_simd::dispatch`, but with one copy of the
/// code fewer. Processors from before 2013, with SSE4.2 but no AVX2, use the SSE2 copy. Builds with
/// debug assertions and unit tests have one copy each, because the copies are most of what there is
/// to compile. The tests that draw pictures use the processor's best one.
macro_rules! lanes {
    ($level:expr, $simd:ident => $of_lanes:expr) => {{
        #[cfg(all(target_arch = "x86_64", any(debug_assertions, test)))]
        {
            let level: fearless_simd::Level = $level;
            #[cfg(not(test))]
            let $simd = level.as_sse2().expect("every x86-64 processor has SSE2");
            #[cfg(test)]
            let $simd = level.as_avx2().expect("the unit tests need a processor with AVX2");
            fearless_simd::Simd::vectorize(
                $simd,
                #[inline(always)]
                || $of_lanes,
            )
        }
        #[cfg(all(target_arch = "x86_64", not(any(debug_assertions, test))))]
        {
            let level: fearless_simd::Level = $level;
            if let Some($simd) = level.as_avx512() {
                fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $of_lanes,
                )
            } else if let Some($simd) = level.as_avx2() {
                fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $of_lanes,
                )
            } else if let Some($simd) = level.as_sse2() {
                fearless_simd::Simd::vectorize(
                    $simd,
                    #[inline(always)]
                    || $of_lanes,
                )
            } else {
                unreachable!("every x86-64 processor has SSE2")
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            fearless_simd::dispatch!($level, $simd => $of_lanes)
        }
    }};
}
pub(super) use {each, four, lanes, three, words};

/// Runs a part of the code of a tile as a function of its own. As one function, all of it would be
/// so long that compilers take minutes for it.
#[inline(never)]
pub fn apart<S: Simd, R>(simd: S, part: impl FnOnce() -> R) -> R {
    simd.vectorize(part)
}

/// Eight numbers.
pub type Lanes<S> = f32x8<S>;

/// Returns 2 to the power x, within a relative error of 4·10⁻⁷, for x from −126 to 126; beyond
/// that, the value at these ends.
#[inline(always)]
pub fn exp2<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    exp2_within(simd, x.max(Lanes::splat(simd, -126.0)).min(Lanes::splat(simd, 126.0)))
}

/// Returns 2 to the power x, for x from −126 to 126 only.
#[inline(always)]
pub fn exp2_within<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    let whole = (x + 0.5).floor();
    let part = x - whole;
    // The Taylor series of 2^part for |part| ≤ ½.
    let mut sum = Lanes::splat(simd, 1.540_353e-4);
    for term in [1.333_355_8e-3, 9.618_129e-3, 5.550_411e-2, 2.402_265e-1, 6.931_472e-1, 1.0] {
        sum = sum.mul_add(part, Lanes::splat(simd, term));
    }
    let exponent = (i32x8::truncate_from(whole) + 127) << 23;
    sum * exponent.bitcast::<Lanes<S>>()
}

/// Returns e to the power x.
#[inline(always)]
pub fn exp<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    exp2(simd, x * std::f32::consts::LOG2_E)
}

/// Returns the logarithm of x > 0 to the base 2, within 10⁻⁵.
#[inline(always)]
pub fn log2<S: Simd>(simd: S, x: Lanes<S>) -> Lanes<S> {
    let bits = x.bitcast::<i32x8<S>>();
    let exponent = Lanes::float_from((bits >> 23) - 127);
    let mantissa = ((bits & 0x007f_ffff) | 0x3f80_0000).bitcast::<Lanes<S>>();
    // log₂ m = 2/ln 2 · artanh((m − 1)/(m + 1)), m from 1 to 2.
    let z = (mantissa - 1.0) / (mantissa + 1.0);
    let z2 = z * z;
    let mut sum = Lanes::splat(simd, 2.0 / 9.0);
    for term in [2.0 / 7.0, 2.0 / 5.0, 2.0 / 3.0, 2.0] {
        sum = sum.mul_add(z2, Lanes::splat(simd, term));
    }
    exponent + z * sum * std::f32::consts::LOG2_E
}

/// Returns x to a power, for x from 10⁻⁶ to 1 and a power of at least 0.
#[inline(always)]
pub fn power<S: Simd>(simd: S, x: Lanes<S>, power: f32) -> Lanes<S> {
    let [result] = powers(simd, [x], power);
    result
}

/// Returns several numbers to the same power. Together, they take hardly longer than one: each
/// multiplication waits for the one before.
#[inline(always)]
pub fn powers<S: Simd, const N: usize>(simd: S, x: [Lanes<S>; N], power: f32) -> [Lanes<S>; N] {
    const MOST: f32 = 255.0;
    let mut products = [Lanes::splat(simd, 1.0); N];
    if power.fract() != 0.0 || power > MOST {
        for (product, x) in products.iter_mut().zip(x) {
            *product = exp2(simd, log2(simd, x) * power);
        }
        return products;
    }
    // Multiply the powers x^(2^i) for the bits i of the exponent.
    let (mut rest, mut squares) = (power as u32, x);
    loop {
        if rest & 1 != 0 {
            for (product, square) in products.iter_mut().zip(&squares) {
                *product *= *square;
            }
        }
        rest >>= 1;
        if rest == 0 {
            return products;
        }
        for square in &mut squares {
            *square *= *square;
        }
    }
}

/// Transposes eight pixels with four channels into four channels with eight pixels.
#[inline(always)]
pub fn columns<S: Simd>(simd: S, rows: [f32x4<S>; 8]) -> [Lanes<S>; 4] {
    let [low, high] = each!([0, 4], I => {
        let (ac, bd) = (rows[I].zip_low(rows[I + 2]), rows[I + 1].zip_low(rows[I + 3]));
        let (ac_high, bd_high) = (rows[I].zip_high(rows[I + 2]), rows[I + 1].zip_high(rows[I + 3]));
        [ac.zip_low(bd), ac.zip_high(bd), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
    });
    four!(I => simd.combine_f32x4(low[I], high[I]))
}

/// Returns the dot product of two vectors.
#[inline(always)]
pub fn dot<S: Simd>(a: [Lanes<S>; 3], b: [Lanes<S>; 3]) -> Lanes<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The same with one vector for all lanes.
#[inline(always)]
pub fn dot_with<S: Simd, const N: usize>(a: [f32; N], b: [Lanes<S>; 3]) -> Lanes<S> {
    b[0] * a[0] + b[1] * a[1] + b[2] * a[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::Level;

    #[test]
    fn powers_and_logarithms_are_near() {
        let numbers: Vec<f32> = (0..8000).map(|i| (i as f32 - 4000.0) * 0.01).collect();
        for eight in numbers.chunks_exact(8) {
            let x: [f32; 8] = std::array::from_fn(|i| eight[i]);
            let powers: [f32; 8] =
                lanes!(Level::new(), simd => exp2(simd, x.simd_into(simd)).into());
            for (x, power) in x.iter().zip(powers) {
                let truth = f64::from(*x).exp2();
                assert!((f64::from(power) / truth - 1.0).abs() < 4e-7, "2^{x}: {power}");
            }
            let back: [f32; 8] =
                lanes!(Level::new(), simd => log2(simd, powers.simd_into(simd)).into());
            for (x, back) in x.iter().zip(back) {
                assert!((x - back).abs() < 2e-5, "{x} {back}");
            }
        }
    }
}

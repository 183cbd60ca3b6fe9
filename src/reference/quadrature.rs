//! Numerical integration of smooth functions.

/// Places in −1 … 1 and weights of the Gauss–Legendre rule with eight points (Abramowitz & Stegun
/// 1964, table 25.4). Each place is used on both sides of 0. Exact for polynomials of the 15th
/// degree.
const RULE: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_5),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_3),
];

/// Integrates several functions at once between `from` and `to`. They are not evaluated at the
/// ends.
pub(super) fn quadrature<const N: usize>(
    [from, to]: [f64; 2],
    values: impl Fn(f64) -> [f64; N],
) -> [f64; N] {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut sums = [0.0; N];
    for (place, weight) in RULE {
        for value in [values(middle - half * place), values(middle + half * place)] {
            (0..N).for_each(|i| sums[i] += half * weight * value[i]);
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_exact() {
        let [one, odd, even] = quadrature([-1.0, 3.0], |x| [1.0, x.powi(15), x.powi(14)]);
        assert!((one - 4.0).abs() < 1e-13);
        assert!((odd / ((3.0_f64.powi(16) - 1.0) / 16.0) - 1.0).abs() < 1e-13);
        assert!((even / ((3.0_f64.powi(15) + 1.0) / 15.0) - 1.0).abs() < 1e-13);
    }
}

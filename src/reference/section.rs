//! How much of a Gaussian lies between two places.

use std::f64::consts::FRAC_1_SQRT_2;

/// Beyond this many standard deviations less than 10⁻¹⁸ of a Gaussian is left: nothing that double precision could add
/// to the rest.
pub(super) const TAIL: f64 = 9.0;

/// The share of the unit Gaussian between `from` and `to` (in standard deviations, ascending): Φ(to) − Φ(from).
pub(super) fn section(from: f64, to: f64) -> f64 {
    // Two numbers close to 1 would cancel, so each section is taken from the tail that it lies in.
    if from > 0.0 { tail(from) - tail(to) } else { tail(-to) - tail(-from) }
}

/// The share of the unit Gaussian above `t`: 1 − Φ(t).
fn tail(t: f64) -> f64 {
    0.5 * libm::erfc(t * FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        // The shares within one, two and three standard deviations, and above six.
        for (from, to, share) in [
            (-1.0, 1.0, 0.682_689_492_137_085_9),
            (-2.0, 2.0, 0.954_499_736_103_641_6),
            (-3.0, 3.0, 0.997_300_203_936_739_8),
            (6.0, f64::INFINITY, 9.865_876_450_376_98e-10),
            (f64::NEG_INFINITY, 0.0, 0.5),
        ] {
            assert!((section(from, to) / share - 1.0).abs() < 1e-12, "{from} … {to}");
        }
        assert!(section(TAIL, f64::INFINITY) < 1e-18);
    }

    #[test]
    fn sections_sum_to_the_whole_kernel() {
        for thickness in [0.01, 0.37, 2.5, 40.0] {
            for start in [-60.0, -41.3] {
                let count = (100.0_f64 / thickness).ceil() as usize;
                let at = |k: usize| start + thickness * k as f64;
                let sum: f64 = (0..count).map(|k| section(at(k), at(k + 1))).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{thickness} from {start}: {sum}");
            }
        }
    }
}

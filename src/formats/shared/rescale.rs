//! Values that a file stores with a slope and an intercept.

use crate::{
    parallel::prelude::*,
    volume::{Samples, each_type},
};

/// Returns `slope · value + intercept` of all samples. Integers stay integers if the slope is 1 and
/// the intercept whole; the results of all others are 32-bit floats, computed in 64 bits.
pub fn rescaled(samples: Samples, slope: f64, intercept: f64) -> Samples {
    if slope == 1.0 && intercept == 0.0 {
        return samples;
    }
    let is_whole = slope == 1.0 && intercept.fract() == 0.0;
    match (&samples, samples.range()) {
        (Samples::F32(_), _) | (_, Err(_)) => floats(&samples, slope, intercept),
        (_, Ok(range)) if is_whole => {
            let [low, high] = range.map(|value| value + intercept);
            let fits = |least: f64, most: f64| least <= low && high <= most;
            if fits(i16::MIN.into(), i16::MAX.into()) {
                Samples::I16(turned(&samples, |value| (value + intercept) as i16))
            } else if fits(0.0, u16::MAX.into()) {
                Samples::U16(turned(&samples, |value| (value + intercept) as u16))
            } else if fits(i32::MIN.into(), i32::MAX.into()) {
                Samples::I32(turned(&samples, |value| (value + intercept) as i32))
            } else {
                floats(&samples, slope, intercept)
            }
        }
        _ => floats(&samples, slope, intercept),
    }
}

fn floats(samples: &Samples, slope: f64, intercept: f64) -> Samples {
    Samples::F32(turned(samples, |value| (slope * value + intercept) as f32))
}

fn turned<T: Send>(samples: &Samples, turn: impl Fn(f64) -> T + Sync) -> Vec<T> {
    each_type!(samples, values => values.par_iter().map(|&value| turn(f64::from(value))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_values_stay_whole() {
        let of = |slope, intercept| rescaled(Samples::U16(vec![0, 7, 40_000]), slope, intercept);
        assert_eq!(of(1.0, 0.0), Samples::U16(vec![0, 7, 40_000]));
        assert_eq!(of(1.0, -10_000.0), Samples::I16(vec![-10_000, -9993, 30_000]));
        assert_eq!(of(1.0, 5.0), Samples::U16(vec![5, 12, 40_005]));
        assert_eq!(of(1.0, -40_960.0), Samples::I32(vec![-40_960, -40_953, -960]));
        assert_eq!(of(1.0, 0.5), Samples::F32(vec![0.5, 7.5, 40_000.5]));
        assert_eq!(of(1.0, 1e12), Samples::F32(vec![1e12, 1e12, 1e12 + 65_536.0]));
        assert_eq!(of(-2.0, 1.0), Samples::F32(vec![1.0, -13.0, -79_999.0]));
    }
}

//! Round numbers for scales.

/// Returns round values within a range, at most about `most`: multiples of 1, 2 or 5 times a power
/// of ten. Of a logarithmic range, powers of ten, or their 1, 2 and 5 times.
pub fn ticks([low, high]: [f64; 2], most: usize, is_log: bool) -> Vec<f64> {
    let most = most.max(2);
    if !(low < high && (high - low).is_finite()) {
        return vec![low];
    }
    if is_log && low > 0.0 {
        let values = log_ticks([low, high], most);
        if values.len() > 1 {
            return values;
        }
    }
    let step = round_above((high - low) / most as f64);
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    if !(first.is_finite() && last.is_finite() && last - first < 1e3) {
        return vec![low, high];
    }
    (0..=(last - first) as usize).map(|i| clean((first + i as f64) * step, step)).collect()
}

fn log_ticks([low, high]: [f64; 2], most: usize) -> Vec<f64> {
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let within = |value: &f64| *value >= low * (1.0 - 1e-9) && *value <= high * (1.0 + 1e-9);
    let of = |digits: &'static [f64]| -> Vec<f64> {
        let each = (first..=last).flat_map(|power| digits.iter().map(move |d| (power, *d)));
        each.map(|(power, digit)| digit * 10f64.powi(power)).filter(within).collect()
    };
    let fine = of(&[1.0, 2.0, 5.0]);
    if fine.len() <= most {
        return fine;
    }
    let whole = of(&[1.0]);
    let step = whole.len().div_ceil(most).max(1);
    whole.into_iter().step_by(step).collect()
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is not below a number above 0.
pub fn round_above(number: f64) -> f64 {
    let power = 10f64.powf(number.log10().floor());
    let digit = number / power;
    let rounds = [1.0, 2.0, 5.0, 10.0];
    power * rounds.into_iter().find(|round| digit <= round * (1.0 + 1e-9)).unwrap_or(10.0)
}

/// Returns the largest of 1, 2 and 5 times a power of ten that is not above a number above 0.
pub fn round_below(number: f64) -> f64 {
    let power = 10f64.powf(number.log10().floor());
    let digit = number / power;
    let rounds = [10.0, 5.0, 2.0, 1.0];
    power * rounds.into_iter().find(|round| digit >= round * (1.0 - 1e-9)).unwrap_or(1.0)
}

/// A multiple of a step that is 0 but for rounding is 0.
fn clean(value: f64, step: f64) -> f64 {
    if value.abs() < 1e-6 * step { 0.0 } else { value }
}

/// Returns the values as texts with the same number of decimals, or with powers of ten if they are
/// very large or very small.
pub fn labels(values: &[f64]) -> Vec<String> {
    if let [value] = values
        && (*value == 0.0 || (1e-3..1e6).contains(&value.abs()))
    {
        return vec![plain(*value).replace('-', "−")];
    }
    let largest = values.iter().fold(0.0f64, |most, value| most.max(value.abs()));
    let apart = |pair: &[f64]| (pair[1] - pair[0]).abs();
    let step = values.windows(2).map(apart).fold(f64::INFINITY, f64::min);
    let step = if step.is_finite() && step > 0.0 { step } else { largest.max(1e-300) };
    let is_spread = largest > 1e3 * step;
    if largest != 0.0 && !(1e-3..1e6).contains(&largest) || is_spread && step < 1e-4 {
        return values.iter().map(|value| scientific(*value, step, largest)).collect();
    }
    let decimals = (-(step * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 9.0) as usize;
    let short = |value: &f64| {
        let text = format!("{value:.decimals$}");
        match text.trim_start_matches('-').bytes().all(|byte| matches!(byte, b'0' | b'.')) {
            true => text.trim_start_matches('-').to_owned(),
            false => text.replace('-', "−"),
        }
    };
    values.iter().map(short).collect()
}

/// Returns a number with up to six digits.
pub fn plain(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    format!("{rounded}")
}

/// Returns “2.5e−12”.
fn scientific(value: f64, step: f64, largest: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = (largest.log10().floor() - step.log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$e}");
    let (number, power) = text.split_once('e').unwrap_or((&text, "0"));
    let number = match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.'),
        false => number,
    };
    format!("{number}e{power}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(range: [f64; 2], most: usize, is_log: bool) -> Vec<String> {
        labels(&ticks(range, most, is_log))
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(of([0.0, 255.0], 6, false), ["0", "50", "100", "150", "200", "250"]);
        assert_eq!(of([-0.3, 0.31], 4, false), ["−0.2", "0.0", "0.2"]);
        assert_eq!(of([-1024.0, 3071.0], 5, false), ["−1000", "0", "1000", "2000", "3000"]);
        assert_eq!(of([0.0, 3e-12], 4, false), ["0", "1e−12", "2e−12", "3e−12"]);
        assert_eq!(of([0.0, 2.5e7], 5, false), ["0", "5e6", "1e7", "1.5e7", "2e7", "2.5e7"]);
        assert_eq!(of([2.5, 2.5], 4, false), ["2.5"]);
        assert_eq!(ticks([1.0, 1000.0], 5, true), [1.0, 10.0, 100.0, 1000.0]);
        assert_eq!(ticks([1.0, 10.0], 5, true), [1.0, 2.0, 5.0, 10.0]);
        for (number, above, below) in [(0.3, 0.5, 0.2), (7.0, 10.0, 5.0), (20.0, 20.0, 20.0)] {
            let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
            assert!(near(round_above(number), above) && near(round_below(number), below));
        }
    }

    #[test]
    fn ranges_at_the_ends_of_numbers_have_ticks() {
        for range in [[-1.5e308, 1.5e308], [1.0, 1.0 + 1e-15], [0.0, 5e-324], [1e300, 1e301]] {
            for is_log in [false, true] {
                let values = ticks(range, 5, is_log);
                assert!((1..=12).contains(&values.len()), "{range:?}: {values:?}");
                assert_eq!(labels(&values).len(), values.len());
            }
        }
    }
}

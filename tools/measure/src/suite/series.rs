//! How time follows a number, over cases that differ in that number only.

use super::measure::Measured;
use serde_json::{Value, json};
use std::fmt;

/// The exponent with which time grows as a power of a number.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    name: &'static str,
    of: &'static str,
    pub power: f64,
}

/// Returns the slope of each series of at least two cases: the logarithm of the median time over
/// the logarithm of the number.
pub fn slopes<'a>(cases: impl Iterator<Item = &'a Measured>) -> impl Iterator<Item = Slope> {
    let mut all: Vec<(Slope, Vec<[f64; 2]>)> = Vec::new();
    for (series, time) in cases.filter_map(|case| Some((case.series.as_ref()?, case.times.median)))
    {
        let point = [series.value.ln(), time.ln()];
        match all.iter_mut().find(|(slope, _)| slope.name == series.name) {
            Some((_, points)) => points.push(point),
            None => all.push((Slope { name: series.name, of: series.of, power: 0.0 }, vec![point])),
        }
    }
    all.into_iter()
        .filter(|(_, points)| points.len() > 1)
        .map(|(slope, points)| Slope { power: fit(&points), ..slope })
}

/// Returns the slope of the least-squares line.
fn fit(points: &[[f64; 2]]) -> f64 {
    let mean =
        |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let sum = |of: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(of).sum::<f64>();
    sum(&|point| (point[0] - x) * (point[1] - y)) / sum(&|point| (point[0] - x).powi(2))
}

impl Slope {
    pub fn json(&self) -> Value {
        json!({ "name": self.name, "of": self.of, "power": self.power })
    }
}

impl fmt::Display for Slope {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "The {} grows as {} to the power of {:.2}.", self.name, self.of, self.power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_found() {
        let points = [1.0f64, 4.0, 64.0].map(|x| [x.ln(), (3.0 * x.powf(0.6)).ln()]);
        assert!((fit(&points) - 0.6).abs() < 1e-12);
        assert!((fit(&[[0.0, 1.0], [1.0, 1.0]])).abs() < 1e-12);
    }
}

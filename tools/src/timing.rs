//! Frame times.

use std::time::Instant;

/// Degrees between frames, as in VTK's benchmark of the same view.
pub const STEP: f64 = 5.0;

/// Returns the milliseconds since an instant.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// Statistics of frame times, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    pub min: f64,
    pub median: f64,
    pub max: f64,
}

impl Times {
    /// Returns the statistics of at least one time.
    pub fn of(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let middle = times.len() / 2;
        let median = if times.len() % 2 == 1 {
            times[middle]
        } else {
            0.5 * (times[middle - 1] + times[middle])
        };
        Self { min: times[0], median, max: times[times.len() - 1] }
    }

    pub fn json(self) -> serde_json::Value {
        serde_json::json!({ "min": self.min, "median": self.median, "max": self.max })
    }
}

/// Returns the steps of a frame and their times, as JSON.
pub fn steps(steps: &[(&'static str, f64)]) -> serde_json::Value {
    steps.iter().map(|(name, ms)| serde_json::json!({ "name": name, "ms": ms })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(Times::of(vec![5.0, 1.0, 2.0]), Times { min: 1.0, median: 2.0, max: 5.0 });
        assert_eq!(Times::of(vec![4.0, 1.0, 2.0, 9.0]).median, 3.0);
    }
}

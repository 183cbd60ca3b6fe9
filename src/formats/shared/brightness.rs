//! Which number means full brightness in colours that a file stores as wide numbers.
//!
//! Some programs write bytes as 16-bit numbers or as floats. Then no value exceeds 255, or 1. A
//! single value may be wrong, so 99 of 100 colours decide.

/// The limits that are told apart: fractions, fractions somewhat brighter than 1, and bytes.
const LIMITS: [f64; 3] = [1.0, 16.0, 255.0];

/// A limit counts as exceeded if more than one colour in this many does. Black ones do not count.
const RARE: u64 = 100;

/// Counts the colours of a file by their largest channels.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Brightness {
    colors: u64,
    above: [u64; 3],
    largest: f64,
}

impl Brightness {
    /// Adds a colour by its largest channel.
    pub fn add(&mut self, largest: f64) {
        if largest > 0.0 {
            self.colors += 1;
            self.above
                .iter_mut()
                .zip(LIMITS)
                .for_each(|(n, limit)| *n += u64::from(largest > limit));
            self.largest = self.largest.max(largest);
        }
    }

    /// Adds other colours of the same file.
    pub fn with(mut self, other: Self) -> Self {
        self.colors += other.colors;
        self.above.iter_mut().zip(other.above).for_each(|(count, other)| *count += other);
        self.largest = self.largest.max(other.largest);
        self
    }

    /// Returns the largest channel of all colours, or the largest limit below that hardly any
    /// colour exceeds; 0 if all are black.
    pub fn largest(&self) -> f64 {
        let is_exceeded = |above: u64| above * RARE > self.colors;
        let kept = LIMITS.into_iter().zip(self.above).find(|(_, above)| !is_exceeded(*above));
        kept.map_or(self.largest, |(limit, _)| self.largest.min(limit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_colour_decides_nothing() {
        let of = |values: &[(f64, usize)]| {
            let mut seen = Brightness::default();
            for &(value, count) in values {
                (0..count).for_each(|_| seen.add(value));
            }
            let twice = seen.with(seen);
            assert_eq!(seen.largest(), twice.largest());
            seen.largest()
        };
        assert_eq!(of(&[(200.0, 1000), (60_000.0, 1)]), 255.0);
        assert_eq!(of(&[(0.0, 100_000), (200.0, 1000), (60_000.0, 30)]), 60_000.0);
        assert_eq!(of(&[(0.7, 1000), (3.0, 5)]), 1.0);
        assert_eq!(of(&[(0.7, 1000), (3.0, 500)]), 3.0);
        assert_eq!((of(&[(200.0, 9)]), of(&[(0.5, 9)]), of(&[(0.0, 9)])), (200.0, 0.5, 0.0));
        // Of a few colours, each one counts.
        assert_eq!(of(&[(200.0, 9), (300.0, 1)]), 300.0);
    }
}

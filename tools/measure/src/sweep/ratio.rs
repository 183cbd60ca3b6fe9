//! Whether a step costs more than the work it asks for explains.

use super::asked::Asked;

/// A step with more than this excess cost is a cliff: it costs that many times what its work
/// explains.
pub const CLIFF: f64 = 2.0;

/// The cost of a step beside that of its neighbour. The comparison is made for the more expensive
/// of the two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// The step's time over its neighbour's.
    pub time: f64,
    /// How many times as much work the more expensive of the two asks for; at least 1.
    pub asked: f64,
}

impl Ratio {
    /// Compares a step with its neighbour. Each is given by its milliseconds and its work.
    pub fn of(step: (f64, &Asked), neighbour: (f64, &Asked)) -> Self {
        let time = step.0 / neighbour.0;
        let asked = if time > 1.0 { step.1.times(neighbour.1) } else { neighbour.1.times(step.1) };
        Self { time, asked }
    }

    /// Returns the excess cost of the more expensive of the two: its ratio of time over its ratio
    /// of work.
    pub fn beyond(self) -> f64 {
        self.time.max(1.0 / self.time) / self.asked
    }

    pub fn is_cliff(self) -> bool {
        self.beyond() > CLIFF
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(pixels: f64) -> Asked {
        Asked { pixels, ..Asked::default() }
    }

    #[test]
    fn time_that_is_explained_is_no_cliff() {
        let ratio = Ratio::of((40.0, &asked(100.0)), (10.0, &asked(25.0)));
        assert_eq!(
            (ratio.time, ratio.asked, ratio.beyond(), ratio.is_cliff()),
            (4.0, 4.0, 1.0, false)
        );
        // A step that asks for less may cost as much, because every frame has a fixed cost.
        assert!(!Ratio::of((10.0, &asked(1.0)), (10.0, &asked(25.0))).is_cliff());
    }

    #[test]
    fn time_beyond_that_is_a_cliff_up_and_down() {
        let (dear, cheap) = ((50.0, &asked(10.0)), (10.0, &asked(20.0)));
        for ratio in [Ratio::of(dear, cheap), Ratio::of(cheap, dear)] {
            assert_eq!(ratio.asked, 1.0);
            assert!((ratio.beyond() - 5.0).abs() < 1e-12 && ratio.is_cliff());
        }
        assert!(!Ratio::of((20.0, &asked(1.0)), (10.0, &asked(1.0))).is_cliff());
    }
}

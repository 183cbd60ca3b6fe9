//! Which of an input's times are drawn.

use crate::failure::Failure;
use std::{ops::RangeInclusive, str::FromStr};

/// Most frames of a film of times.
const MOST: usize = 100_000;

/// Times of the inputs, counted from 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Times {
    All,
    These(Vec<usize>),
}

impl Times {
    /// Returns the first one.
    pub fn first(&self) -> usize {
        match self {
            Self::All => 0,
            Self::These(times) => times[0],
        }
    }

    /// Returns the numbers of the times, where the input with the most has `count`.
    pub fn numbers(&self, count: u64) -> Result<Vec<usize>, Failure> {
        let wrong = |message: String| Err(Failure::Usage(format!("--times: {message}")));
        if count < 2 {
            return wrong(
                "no input has several times; `splatkit info` tells those of a file".into(),
            );
        }
        match self {
            Self::All if count > MOST as u64 => {
                wrong(format!("{count} times are too many frames; {MOST} are the most"))
            }
            Self::All => Ok((0..count as usize).collect()),
            Self::These(times) => match times.iter().find(|time| **time as u64 >= count) {
                Some(time) => {
                    wrong(format!("there is no time {time}: choose from 0 to {}", count - 1))
                }
                None => Ok(times.clone()),
            },
        }
    }
}

impl FromStr for Times {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("all") {
            return Ok(Self::All);
        }
        let mut times = Vec::new();
        for part in text.split(',') {
            let (range, step) = range(part.trim()).ok_or_else(|| {
                format!("“{part}” is no time: write all, or times such as 0,4,8 or 0..20:2")
            })?;
            if (range.end() - range.start()) / step >= MOST - times.len() {
                return Err(format!("these are too many frames; {MOST} are the most"));
            }
            times.extend(range.step_by(step));
        }
        Ok(Self::These(times))
    }
}

/// `4`, `0..20` or `0..20:2`. The second end belongs to the range.
fn range(text: &str) -> Option<(RangeInclusive<usize>, usize)> {
    let Some((first, rest)) = text.split_once("..") else {
        let time = text.parse().ok()?;
        return Some((time..=time, 1));
    };
    let (last, step) = rest.split_once(':').unwrap_or((rest, "1"));
    let (first, last, step) = (first.parse().ok()?, last.parse().ok()?, step.parse().ok()?);
    (first <= last && step > 0).then_some((first..=last, step))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_numbers_and_ranges() {
        let times = |text: &str| match text.parse() {
            Ok(Times::These(times)) => times,
            other => panic!("{text}: {other:?}"),
        };
        assert_eq!(times("3"), [3]);
        assert_eq!(times("0..3, 7"), [0, 1, 2, 3, 7]);
        assert_eq!(times("1..8:3"), [1, 4, 7]);
        assert_eq!("All".parse(), Ok(Times::All));
        for wrong in ["", "x", "3..1", "0..4:0", "-1", "1,,2", "0..200000", "0..=3"] {
            let error = wrong.parse::<Times>().expect_err(wrong);
            assert!(error.contains("times such as") || error.contains("the most"), "{error}");
        }
    }

    #[test]
    fn times_must_be_there() {
        assert_eq!(Times::All.numbers(3).unwrap(), [0, 1, 2]);
        assert_eq!(Times::These(vec![2, 0]).numbers(3).unwrap(), [2, 0]);
        let error = |times: Times, count| format!("{:?}", times.numbers(count).unwrap_err());
        assert!(error(Times::These(vec![3]), 3).contains("choose from 0 to 2"));
        assert!(error(Times::All, 1).contains("several times"));
    }
}

//! Time limits for work on an input.

use crate::{Error, Result};
use std::{
    sync::atomic::{AtomicBool, Ordering::Relaxed},
    time::Duration,
};
use web_time::Instant;

/// The moment by which work on an input must be done. By default there is none.
///
/// The options of every step between a file and its splats contain a deadline, so that a file of a
/// few bytes cannot keep a program busy. The steps check the clock every few thousand items, and
/// end with [`Error::Timeout`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadline {
    end: Option<Instant>,
    seconds: u64,
}

impl Deadline {
    /// No deadline.
    pub const NEVER: Self = Self { end: None, seconds: u64::MAX };

    /// A deadline this many seconds from now.
    pub fn after(seconds: u64) -> Self {
        Self { end: Instant::now().checked_add(Duration::from_secs(seconds)), seconds }
    }

    /// Returns the earlier of two deadlines.
    #[must_use]
    pub fn or_earlier(self, other: Self) -> Self {
        match (self.end, other.end) {
            (Some(end), Some(other_end)) if other_end < end => other,
            (None, Some(_)) => other,
            _ => self,
        }
    }

    /// Returns the seconds that it allowed when it was made.
    pub(crate) fn seconds(&self) -> u64 {
        self.seconds
    }

    /// Returns the time that is left; `None` if there is no end.
    pub(crate) fn left(&self) -> Option<Duration> {
        self.end.map(|end| end.saturating_duration_since(Instant::now()))
    }

    /// Returns whether the deadline has passed.
    pub fn is_over(&self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }

    /// Returns an error if the deadline has passed; `what` names the work in the error.
    ///
    /// # Errors
    /// [`Error::Timeout`].
    pub fn check(&self, what: &str) -> Result<()> {
        if self.is_over() { Err(self.error(what)) } else { Ok(()) }
    }

    /// Returns the error for work that was stopped at the deadline; `what` names it.
    pub(crate) fn error(&self, what: &str) -> Error {
        Error::Timeout { what: what.into(), limit: self.seconds }
    }
}

impl Default for Deadline {
    fn default() -> Self {
        Self::NEVER
    }
}

/// Items between two checks of the clock.
const ITEMS: usize = 1 << 8;

/// A deadline shared by the threads of a parallel loop. Once it has passed, every thread skips its
/// remaining items.
pub(crate) struct Clock {
    deadline: Deadline,
    is_over: AtomicBool,
}

impl Clock {
    pub fn new(deadline: Deadline) -> Self {
        Self { deadline, is_over: AtomicBool::new(false) }
    }

    /// Returns whether to skip the item with this number. Only some items read the system's clock.
    pub fn is_over(&self, item: usize) -> bool {
        if item.is_multiple_of(ITEMS) && self.deadline.is_over() {
            self.is_over.store(true, Relaxed);
        }
        self.is_over.load(Relaxed)
    }

    /// Ends the loop. If this returns an error, the loop's result is incomplete.
    pub fn finish(self, what: &str) -> Result<()> {
        if self.is_over.into_inner() { Err(self.deadline.error(what)) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_runs_out() {
        let over = Deadline::after(0);
        assert!(
            over.is_over()
                && !Deadline::after(1000).is_over()
                && !Deadline::after(u64::MAX).is_over()
        );
        assert!(Deadline::default().check("nothing").is_ok());
        let [soon, later] = [7, 70].map(Deadline::after);
        for (one, other) in [(soon, later), (later, soon), (soon, Deadline::NEVER)] {
            assert_eq!(one.or_earlier(other), soon);
        }
        assert_eq!(Deadline::NEVER.or_earlier(later), later);
        let message = over.check("cutting triangles").unwrap_err().to_string();
        assert_eq!(message, "cutting triangles takes longer than the limit of 0 s");
        let clock = Clock::new(over);
        assert!(!clock.is_over(1) && clock.is_over(ITEMS) && clock.is_over(1));
        assert!(clock.finish("work").is_err());
        assert!(Clock::new(over).finish("no work").is_ok());
    }
}

//! What reading one input has used so far: bytes, time and files. All files of one model share a
//! budget.

use super::Limits;
use crate::{Error, Result, error::LimitKind};
use std::{
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    time::Duration,
};
use web_time::Instant;

/// The bytes used, the time reading began, the files opened, and the times that they hold.
pub(crate) struct Budget {
    spent: AtomicU64,
    created: Instant,
    /// Nanoseconds from `created` to the start of the interval that the time limit applies to.
    begun: AtomicU64,
    /// The files opened so far.
    files: Mutex<Vec<PathBuf>>,
    /// The number of times that the files hold, and the one that is read.
    times: Mutex<Option<(u64, usize)>>,
}

impl Budget {
    pub fn new() -> Self {
        Self {
            spent: AtomicU64::new(0),
            created: Instant::now(),
            begun: AtomicU64::new(0),
            files: Mutex::default(),
            times: Mutex::default(),
        }
    }

    /// Adds bytes to the sum; `what` names their use. Nothing is given back: arrays that are
    /// dropped while a file is read still count. So the sum never falls below the memory in use.
    pub fn spend(&self, limits: &Limits, file: &Path, what: &str, bytes: u64) -> Result<()> {
        limits.check(LimitKind::Bytes, file, what, bytes)?;
        let before = self.spent.fetch_add(bytes, Relaxed);
        let (total, wraps) = before.overflowing_add(bytes);
        let total = if wraps { u64::MAX } else { total };
        if total > limits.bytes {
            self.spent.fetch_sub(bytes, Relaxed);
            let what = format!("{what} together with what was read before");
            return limits.check(LimitKind::Bytes, file, what, total);
        }
        Ok(())
    }

    /// Checks bytes that a step takes and gives back when it ends: they may not exceed the limit
    /// beside those that were spent, but are not added to them.
    pub fn lend(&self, limits: &Limits, file: &Path, what: &str, bytes: u64) -> Result<()> {
        limits.check(LimitKind::Bytes, file, what, bytes)?;
        let total = self.spent.load(Relaxed).saturating_add(bytes);
        let what = format!("{what} together with what was read before");
        limits.check(LimitKind::Bytes, file, what, total)
    }

    /// Records the path of an opened file.
    pub fn opened(&self, file: &Path) {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).push(file.to_owned());
    }

    /// Returns the files opened so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Records the number of times that a file holds, and the one that is read. The file with the
    /// most times counts.
    pub fn choose_time(&self, count: u64, time: usize) {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        if times.is_none_or(|(before, _)| before <= count) {
            *times = Some((count, time));
        }
    }

    /// Returns the number of times that the files hold, and the one that is read; `None` if no
    /// reader has come across times.
    pub fn times(&self) -> Option<(u64, usize)> {
        *self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns an error if reading has taken longer than the limit.
    pub fn check_time(&self, limits: &Limits, file: &Path) -> Result<()> {
        let taken = self.taken();
        if taken > Duration::from_secs(limits.seconds) {
            let what = "the reading time in seconds";
            return limits.check(LimitKind::Seconds, file, what, taken.as_secs() + 1);
        }
        if !limits.until.is_over() {
            return Ok(());
        }
        let limit = limits.until.seconds();
        let what = "the time for all inputs together in seconds".into();
        let (kind, seconds) = (LimitKind::Seconds, limit.saturating_add(1));
        Err(Error::Limit { file: file.to_owned(), what, kind, found: seconds, limit })
    }

    /// Returns the time that is left for reading.
    pub fn left(&self, limits: &Limits) -> Duration {
        let remaining = Duration::from_secs(limits.seconds).saturating_sub(self.taken());
        limits.until.left().map_or(remaining, |left| left.min(remaining))
    }

    fn taken(&self) -> Duration {
        let begun = Duration::from_nanos(self.begun.load(Relaxed));
        self.created.elapsed().saturating_sub(begun)
    }

    /// Restarts the clock of the time limit.
    pub fn restart(&self) {
        self.begun.store(self.created.elapsed().as_nanos() as u64, Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Deadline;

    #[test]
    fn inputs_end_with_the_time_of_all() {
        let (budget, file) = (Budget::new(), Path::new("a.ply"));
        let limits = Limits::default();
        assert!(budget.check_time(&limits, file).is_ok() && !budget.left(&limits).is_zero());
        // Other inputs have used it up.
        let limits = Limits { until: Deadline::after(0), ..limits };
        assert!(budget.left(&limits).is_zero());
        let error = budget.check_time(&limits, file).unwrap_err().to_string();
        assert!(error.contains("a.ply: the time for all inputs together"), "{error}");
        budget.restart();
        assert!(budget.check_time(&limits, file).is_err());
    }

    #[test]
    fn what_is_lent_is_not_spent() {
        let (budget, file) = (Budget::new(), Path::new("a.ply"));
        let limits = Limits { bytes: 100, ..Limits::default() };
        budget.spend(&limits, file, "this", 60).unwrap();
        for _ in 0..9 {
            budget.lend(&limits, file, "that", 40).unwrap();
        }
        assert!(budget.lend(&limits, file, "that", 41).is_err());
        assert!(budget.lend(&limits, file, "that", u64::MAX).is_err());
        budget.spend(&limits, file, "this", 40).unwrap();
    }
}

//! What reading one input has used so far: bytes, time and files. All files of one model share a
//! budget.

use super::Limits;
use crate::{Result, error::LimitKind};
use std::{
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    time::Duration,
};
use web_time::Instant;

/// The bytes used, the time reading began, and the files opened.
pub(crate) struct Budget {
    spent: AtomicU64,
    created: Instant,
    /// Nanoseconds from `created` to the start of the interval that the time limit applies to.
    begun: AtomicU64,
    /// The files opened so far.
    files: Mutex<Vec<PathBuf>>,
}

impl Budget {
    pub fn new() -> Self {
        Self {
            spent: AtomicU64::new(0),
            created: Instant::now(),
            begun: AtomicU64::new(0),
            files: Mutex::default(),
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

    /// Records the path of an opened file.
    pub fn opened(&self, file: &Path) {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).push(file.to_owned());
    }

    /// Returns the files opened so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Returns an error if reading has taken longer than the limit.
    pub fn check_time(&self, limits: &Limits, file: &Path) -> Result<()> {
        let begun = Duration::from_nanos(self.begun.load(Relaxed));
        let taken = self.created.elapsed().saturating_sub(begun);
        if taken <= Duration::from_secs(limits.seconds) {
            return Ok(());
        }
        limits.check(LimitKind::Seconds, file, "the reading time in seconds", taken.as_secs() + 1)
    }

    /// Restarts the clock of the time limit.
    pub fn restart(&self) {
        self.begun.store(self.created.elapsed().as_nanos() as u64, Relaxed);
    }
}

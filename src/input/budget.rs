//! What reading one input has taken so far: bytes, time and files. The files of one model share a budget.

use super::Limits;
use crate::{Result, error::LimitKind};
use std::{
    path::{Path, PathBuf},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering::Relaxed},
    },
    time::{Duration, Instant},
};

/// Bytes that were taken, and when reading began.
pub(crate) struct Budget {
    spent: AtomicU64,
    created: Instant,
    /// Nanoseconds from then to the beginning of what the limit of time holds for.
    begun: AtomicU64,
    /// The files that were opened.
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

    /// Takes bytes for `what`. Nothing is given back: what is dropped while a file is read counts as well, so the sum is
    /// never below what is held at any time.
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

    /// Keeps the path of a file that was opened.
    pub fn opened(&self, file: &Path) {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).push(file.to_owned());
    }

    /// The files that were opened so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Refuses to go on where reading took too long.
    pub fn check_time(&self, limits: &Limits, file: &Path) -> Result<()> {
        let begun = Duration::from_nanos(self.begun.load(Relaxed));
        let taken = self.created.elapsed().saturating_sub(begun);
        if taken <= Duration::from_secs(limits.seconds) {
            return Ok(());
        }
        limits.check(
            LimitKind::Seconds,
            file,
            "the time for reading, in seconds,",
            taken.as_secs() + 1,
        )
    }

    /// Lets the time begin again.
    pub fn restart(&self) {
        self.begun.store(self.created.elapsed().as_nanos() as u64, Relaxed);
    }
}

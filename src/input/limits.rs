//! What a reader may spend on one input. Allocation follows the bytes present, not the counts claimed.

use crate::{Deadline, Error, Result, error::LimitKind};
use std::path::Path;

/// Bounds for every reader. The defaults take the largest scans and volumes that a workstation handles and stop
/// what a hostile or broken file claims beyond that.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Vertices, points or faces of one file.
    pub points: u64,
    /// Bytes that one input may occupy: its file, the files that it refers to, and all arrays that are made of them until
    /// it is read, those that are dropped on the way among them.
    pub bytes: u64,
    /// Nesting of scene nodes and of elements.
    pub depth: usize,
    /// Pixels of one picture.
    pub texels: u64,
    /// Seconds that reading may take. Of a file that is read in pieces, those that a batch of pieces may take. The steps
    /// that follow reading take a [`deadline`](Self::deadline).
    pub seconds: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { points: 1 << 31, bytes: 32 << 30, depth: 64, texels: 1 << 28, seconds: 600 }
    }
}

impl Limits {
    /// The deadline of work that begins now and may take [`seconds`](Self::seconds).
    pub fn deadline(&self) -> Deadline {
        Deadline::after(self.seconds)
    }

    /// For what was never a file.
    pub(crate) fn none() -> Self {
        Self {
            points: u64::MAX,
            bytes: u64::MAX,
            depth: usize::MAX,
            texels: u64::MAX,
            seconds: u64::MAX,
        }
    }

    /// One of the limits.
    pub fn of(&self, kind: LimitKind) -> u64 {
        match kind {
            LimitKind::Points => self.points,
            LimitKind::Bytes => self.bytes,
            LimitKind::Depth => self.depth as u64,
            LimitKind::Texels => self.texels,
            LimitKind::Seconds => self.seconds,
        }
    }

    /// Refuses what is over one of the limits; `what` names it in the error.
    pub(crate) fn check(
        &self,
        kind: LimitKind,
        file: &Path,
        what: impl Into<String>,
        found: u64,
    ) -> Result<()> {
        let limit = self.of(kind);
        if found <= limit {
            return Ok(());
        }
        Err(Error::Limit { file: file.to_owned(), what: what.into(), kind, found, limit })
    }
}

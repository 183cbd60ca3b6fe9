//! Limits on what a reader may spend on one input. Readers allocate by the bytes that are present,
//! not by the counts that a file claims.

use crate::{Deadline, Error, Result, error::LimitKind};
use std::path::Path;

/// Limits for every reader. The defaults admit the largest scans and volumes that a workstation can
/// handle. They refuse larger claims of broken or hostile files.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Maximum number of vertices, points or faces in one file.
    pub points: u64,
    /// Maximum number of bytes that one input may occupy. This counts the file, the files that it
    /// refers to, and every array made while it is read, including arrays that are dropped on the
    /// way.
    pub bytes: u64,
    /// Maximum nesting depth of scene nodes and of XML elements.
    pub depth: usize,
    /// Maximum number of pixels in one picture.
    pub texels: u64,
    /// Maximum time for reading, in seconds. For a file that is read in pieces, it applies to each
    /// batch of pieces. The steps that follow reading take a [`deadline`](Self::deadline).
    pub seconds: u64,
    /// The moment by which everything that is read within these limits must be done, however many
    /// inputs there are. By default there is none, and each input has its own
    /// [`seconds`](Self::seconds).
    pub until: Deadline,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            points: 1 << 31,
            bytes: 32 << 30,
            depth: 64,
            texels: 1 << 28,
            seconds: 600,
            until: Deadline::NEVER,
        }
    }
}

impl Limits {
    /// Returns the deadline of work that begins now and may take [`seconds`](Self::seconds), but
    /// not beyond [`until`](Self::until).
    pub fn deadline(&self) -> Deadline {
        Deadline::after(self.seconds).or_earlier(self.until)
    }

    /// Returns limits that allow everything, for data that never was a file.
    pub(crate) fn none() -> Self {
        Self {
            points: u64::MAX,
            bytes: u64::MAX,
            depth: usize::MAX,
            texels: u64::MAX,
            seconds: u64::MAX,
            until: Deadline::NEVER,
        }
    }

    /// Returns one of the limits.
    pub fn of(&self, kind: LimitKind) -> u64 {
        match kind {
            LimitKind::Points => self.points,
            LimitKind::Bytes => self.bytes,
            LimitKind::Depth => self.depth as u64,
            LimitKind::Texels => self.texels,
            LimitKind::Seconds => self.seconds,
        }
    }

    /// Returns an error if `value` exceeds the limit of this kind. `what` names the quantity in the
    /// error.
    pub(crate) fn check(
        &self,
        kind: LimitKind,
        file: &Path,
        what: impl Into<String>,
        value: u64,
    ) -> Result<()> {
        let limit = self.of(kind);
        if value <= limit {
            return Ok(());
        }
        Err(Error::Limit { file: file.to_owned(), what: what.into(), kind, found: value, limit })
    }
}

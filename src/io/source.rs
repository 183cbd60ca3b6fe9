//! The guarded opening: every format reads its bytes through a [`Source`], which maps the file, holds the limits
//! and gives errors that name the file.

use super::{LimitKind, Limits, budget::Budget};
use crate::{Error, Result};
use std::{fs::File, io::Read, path::Path, sync::Arc};

/// Gives the pages of a map of a file to the system.
pub(super) fn release(map: &memmap2::Mmap) {
    #[cfg(unix)]
    // SAFETY: the map is of a file and read only, so what is dropped reads again as it was. Where the advice is not taken,
    // nothing is lost.
    unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) }.ok();
    #[cfg(not(unix))]
    let _ = map;
}

/// Bytes that are unpacked between two looks at the clock.
const PORTION: u64 = 16 << 20;

/// An opened input: its path, its bytes (mapped) and the limits that hold for it.
pub struct Source<'a> {
    pub path: &'a Path,
    pub limits: &'a Limits,
    bytes: Option<memmap2::Mmap>,
    /// What is read in place of a file.
    memory: Option<&'a [u8]>,
    /// Shared by all files of a model.
    budget: Arc<Budget>,
}

impl<'a> Source<'a> {
    /// Opens and maps a regular file. Directories, devices, missing files and files over the byte limit are errors.
    pub fn open(path: &'a Path, limits: &'a Limits) -> Result<Self> {
        Self::open_within(path, limits, Arc::new(Budget::new()))
    }

    /// Opens a file that this one refers to, at a path from [`neighbour`](Self::neighbour): both count as one.
    pub(super) fn open_beside<'b>(&self, path: &'b Path) -> Result<Source<'b>>
    where
        'a: 'b,
    {
        Source::open_within(path, self.limits, self.budget.clone())
    }

    fn open_within(path: &'a Path, limits: &'a Limits, budget: Arc<Budget>) -> Result<Self> {
        // Opening a pipe would wait for its other end, and opening a device may start it: so look first.
        let look = std::fs::metadata(path).map_err(|e| Error::file(path, "open", e))?;
        let regular = |meta: &std::fs::Metadata| {
            if meta.is_file() { Ok(()) } else { Err(Error::input(path, "path", "is not a regular file")) }
        };
        regular(&look)?;
        let file = File::open(path).map_err(|e| Error::file(path, "open", e))?;
        let meta = file.metadata().map_err(|e| Error::file(path, "read", e))?;
        regular(&meta)?;
        budget.spend(limits, path, "the file's size in bytes", meta.len())?;
        // SAFETY: the map is read only and lives as long as the source. A file that another process shortens while it
        // is mapped would raise SIGBUS; the readers copy what they need and drop the map right away.
        let bytes = if meta.len() == 0 {
            None
        } else {
            Some(unsafe { memmap2::Mmap::map(&file) }.map_err(|e| Error::file(path, "map", e))?)
        };
        Ok(Self { path, limits, bytes, memory: None, budget })
    }

    /// Takes bytes in place of a file: of a program that has them from elsewhere. `name` is what errors call them, and its
    /// extension tells their format where that is asked for. There is no folder around them, so what they refer to is not
    /// read: missing materials and pictures are left out with a warning, missing data are an error.
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes than the limits allow.
    pub fn from_bytes(name: &'a Path, bytes: &'a [u8], limits: &'a Limits) -> Result<Self> {
        let budget = Arc::new(Budget::new());
        budget.spend(limits, name, "the file's size in bytes", bytes.len() as u64)?;
        Ok(Self { path: name, limits, bytes: None, memory: Some(bytes), budget })
    }

    /// Whether this is no file but bytes from elsewhere, which have no neighbours.
    pub(super) fn is_in_memory(&self) -> bool {
        self.memory.is_some()
    }

    /// The whole file.
    pub fn bytes(&self) -> &[u8] {
        self.memory.or(self.bytes.as_deref()).unwrap_or(&[])
    }

    /// Gives the pages of the map that were read back to the system: those who go through a file larger than memory do so
    /// now and then. They are read again where they are asked for again.
    pub(super) fn release(&self) {
        self.bytes.iter().for_each(release);
    }

    /// The map itself, for those who read from it later; `None` for an empty file. While it is held, the file must not be
    /// shortened: a new one has to take its name instead.
    pub(crate) fn into_map(self) -> Option<memmap2::Mmap> {
        self.bytes
    }

    /// An input error at a place of this file (`"line 12"`, `"byte 407"`, `"header"`).
    pub fn error(&self, place: impl Into<String>, message: impl Into<String>) -> Error {
        Error::input(self.path, place, message)
    }

    /// Checks a claimed count against [`Limits::points`].
    pub fn check_points(&self, what: &str, count: u64) -> Result<usize> {
        self.check(LimitKind::Points, what, count)
    }

    /// Checks a claimed number of bytes against [`Limits::bytes`], without taking them.
    pub fn check_bytes(&self, what: &str, bytes: u64) -> Result<usize> {
        self.check(LimitKind::Bytes, what, bytes)
    }

    /// Checks a depth of nesting against [`Limits::depth`].
    pub(super) fn check_depth(&self, place: &str, depth: usize) -> Result<()> {
        self.limits.check(LimitKind::Depth, self.path, format!("{place}: the depth of nesting"), depth as u64)
    }

    /// Checks that there is still time ([`Limits::seconds`]).
    pub(super) fn check_time(&self) -> Result<()> {
        self.budget.check_time(self.limits, self.path)
    }

    /// Lets the time begin again, for the next pieces of a file that is read in pieces.
    pub(super) fn restart_time(&self) {
        self.budget.restart();
    }

    /// Takes so many bytes from what this input may occupy ([`Limits::bytes`]).
    pub(super) fn spend(&self, what: &str, bytes: u64) -> Result<()> {
        self.budget.spend(self.limits, self.path, what, bytes)
    }

    /// As [`spend`](Self::spend), for an array: `what` names what it holds.
    pub(super) fn room<T>(&self, what: &str, count: usize) -> Result<()> {
        self.spend(&format!("the size of {what} in bytes"), (count as u64).saturating_mul(size_of::<T>() as u64))
    }

    fn check(&self, kind: LimitKind, what: &str, found: u64) -> Result<usize> {
        self.limits.check(kind, self.path, what, found)?;
        // A 32-bit machine counts less than a limit may allow.
        usize::try_from(found).map_err(|_| self.error(what, format!("is {found}, more than this machine can count")))
    }

    /// Unpacks a stream whose unpacked size is known. A stream that ends early or holds more than `expected` is an
    /// error; memory grows with what was really unpacked, so a lying size allocates nothing.
    pub fn unpack(&self, place: &str, mut stream: impl Read, expected: usize) -> Result<Vec<u8>> {
        self.spend("the unpacked size in bytes", expected as u64)?;
        let mut out = Vec::new();
        loop {
            self.check_time()?;
            let before = out.len();
            let most = PORTION.min(expected as u64 + 1 - before as u64);
            let read = stream.by_ref().take(most).read_to_end(&mut out);
            read.map_err(|e| self.error(place, format!("cannot be unpacked after {} bytes: {e}", out.len())))?;
            if out.len() == before || out.len() > expected {
                break;
            }
        }
        if out.len() != expected {
            let found = if out.len() > expected { "more".to_owned() } else { out.len().to_string() };
            return Err(self.error(place, format!("unpacks to {found} bytes where {expected} were expected")));
        }
        Ok(out)
    }
}

//! The guarded opening: every format reads its bytes through a [`Source`], which maps the file, holds the limits
//! and gives errors that name the file.

use super::Limits;
use crate::{Error, Result};
use std::{
    fs::File,
    io::Read,
    path::{Component, Path, PathBuf},
};

/// Gives the pages of a map of a file to the system.
pub(super) fn release(map: &memmap2::Mmap) {
    #[cfg(unix)]
    // SAFETY: the map is of a file and read only, so what is dropped reads again as it was. Where the advice is not taken,
    // nothing is lost.
    unsafe { map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) }.ok();
    #[cfg(not(unix))]
    let _ = map;
}

/// An opened input: its path, its bytes (mapped) and the limits that hold for it.
pub struct Source<'a> {
    pub path: &'a Path,
    pub limits: &'a Limits,
    bytes: Option<memmap2::Mmap>,
    /// What is read in place of a file.
    memory: Option<&'a [u8]>,
}

impl<'a> Source<'a> {
    /// Opens and maps a regular file. Directories, missing files and files over the byte limit are errors.
    pub fn open(path: &'a Path, limits: &'a Limits) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::file(path, "open", e))?;
        let meta = file.metadata().map_err(|e| Error::file(path, "read", e))?;
        if !meta.is_file() {
            return Err(Error::input(path, "path", "is not a regular file"));
        }
        if meta.len() > limits.bytes {
            return Err(Error::Limit {
                file: path.to_owned(),
                what: "the file's size in bytes".into(),
                found: meta.len(),
                limit: limits.bytes,
            });
        }
        // SAFETY: the map is read only and lives as long as the source. A file that another process shortens while it
        // is mapped would raise SIGBUS; the readers copy what they need and drop the map right away.
        let bytes = if meta.len() == 0 {
            None
        } else {
            Some(unsafe { memmap2::Mmap::map(&file) }.map_err(|e| Error::file(path, "map", e))?)
        };
        Ok(Self { path, limits, bytes, memory: None })
    }

    /// Takes bytes in place of a file: of a program that has them from elsewhere. `name` is what errors call them, and its
    /// extension tells their format where that is asked for. There is no folder around them, so what they refer to is not
    /// read: missing materials and pictures are left out with a warning, missing data are an error.
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes than the limits allow.
    pub fn from_bytes(name: &'a Path, bytes: &'a [u8], limits: &'a Limits) -> Result<Self> {
        let source = Self { path: name, limits, bytes: None, memory: Some(bytes) };
        source.check_bytes("the file's size in bytes", bytes.len() as u64)?;
        Ok(source)
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
        self.check(what, count, self.limits.points)
    }

    /// Checks a claimed number of bytes against [`Limits::bytes`].
    pub fn check_bytes(&self, what: &str, bytes: u64) -> Result<usize> {
        self.check(what, bytes, self.limits.bytes)
    }

    fn check(&self, what: &str, found: u64, limit: u64) -> Result<usize> {
        match usize::try_from(found) {
            Ok(n) if found <= limit => Ok(n),
            _ => Err(Error::Limit { file: self.path.to_owned(), what: what.into(), found, limit }),
        }
    }

    /// Unpacks a stream whose unpacked size is known. A stream that ends early or holds more than `expected` is an
    /// error; memory grows with what was really unpacked, so a lying size allocates nothing.
    pub fn unpack(&self, place: &str, mut stream: impl Read, expected: usize) -> Result<Vec<u8>> {
        self.check_bytes("the unpacked size in bytes", expected as u64)?;
        let mut out = Vec::new();
        stream
            .by_ref()
            .take(expected as u64 + 1)
            .read_to_end(&mut out)
            .map_err(|e| self.error(place, format!("cannot be unpacked after {} bytes: {e}", out.len())))?;
        if out.len() != expected {
            let found = if out.len() > expected { "more".to_owned() } else { out.len().to_string() };
            return Err(self.error(place, format!("unpacks to {found} bytes where {expected} were expected")));
        }
        Ok(out)
    }

    /// The path of a file that this file refers to: relative, and inside this file's folder after links are resolved.
    pub fn neighbour(&self, place: &str, reference: &str) -> Result<PathBuf> {
        if self.is_in_memory() {
            return Err(self
                .error(
                    place,
                    format!("refers to “{reference}”, but was read from memory, where there are no other files"),
                )
                .hint("open the file by its path, beside those that it refers to"));
        }
        let relative = Path::new(reference);
        let plain = relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !plain || reference.contains("://") {
            return Err(self
                .error(place, format!("refers to “{reference}”, which is not a path inside the file's own folder"))
                .hint("put the file beside the one that names it and refer to it by a relative path"));
        }
        let folder = self.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let target = folder.join(relative);
        let real = target.canonicalize().map_err(|e| self.error(place, format!("refers to “{reference}”: {e}")))?;
        let home = folder.canonicalize().map_err(|e| Error::file(folder, "resolve", e))?;
        if !real.starts_with(&home) {
            return Err(self.error(place, format!("refers to “{reference}”, a link that leaves the file's own folder")));
        }
        Ok(target)
    }
}

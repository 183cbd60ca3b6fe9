//! The guarded opening: every format reads its bytes through a [`Source`], which maps the file, holds the limits
//! and gives errors that name the file.

use super::{Limits, mapping::Mapping};
use crate::{Error, Result};
use std::{
    fs::File,
    io::Read,
    path::{Component, Path, PathBuf},
};

/// An opened input: its path, its bytes (mapped) and the limits that hold for it.
pub struct Source<'a> {
    pub path: &'a Path,
    pub limits: &'a Limits,
    bytes: Mapping,
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
        let bytes = Mapping::new(file).map_err(|e| Error::file(path, "map", e))?;
        Ok(Self { path, limits, bytes })
    }

    /// The whole file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// An error if the file is not the one that was opened any more, so that what was read may be neither the old nor the
    /// new. The readers of whole files ask when they are done.
    ///
    /// # Errors
    /// [`Error::Input`] with what has become of the file.
    pub fn intact(&self) -> Result<()> {
        intact(&self.bytes, self.path)
    }

    /// What was made of the file, or why it was not; and where the file was changed meanwhile, that alone.
    pub(crate) fn unless_changed<T>(&self, found: Result<T>) -> Result<T> {
        self.intact().and(found)
    }

    /// See [`Mapping::release`].
    pub(super) fn release(&self) {
        self.bytes.release();
    }

    /// The mapping itself, for those who read from it later.
    pub(crate) fn into_mapping(self) -> Mapping {
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

/// An error if a file is not the one that was mapped any more.
pub(crate) fn intact(mapping: &Mapping, path: &Path) -> Result<()> {
    let Some(change) = mapping.change() else { return Ok(()) };
    Err(Error::input(path, "file", format!("changed while it was read: {change}"))
        .hint("try again when nothing writes to it; programs that write a new file and rename it do no harm"))
}

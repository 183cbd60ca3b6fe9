//! The bytes of a file that is read in parts: a mapped file, bytes in memory, a remote object, or
//! parts that the program hands in.

use super::{Limits, Mapping, Parts, address::is_remote, intact, remote::Remote, source::Source};
use crate::{Error, Result, error::LimitKind, memory};
use std::{borrow::Cow, ops::Range, path::Path};

/// Bytes that are hashed at a time.
const PORTION: u64 = 8 << 20;

/// Bytes that are fetched again if the header or the directory is damaged. Only huge files have
/// longer ones.
const BEGINNING: u64 = 64 << 20;

/// The bytes of a file that is read in parts. Any number of threads may read from it.
pub(crate) enum Bytes {
    Mapped(Mapping),
    Held(Vec<u8>),
    Remote(Remote),
    Parts(Parts),
}

impl Bytes {
    /// Opens a file, or a remote object.
    pub fn open(path: &Path, limits: &Limits) -> Result<Self> {
        if !is_remote(path) {
            return Ok(Self::Mapped(Source::map(path, limits)?));
        }
        let remote = Remote::open(path, limits)?;
        limits.check(LimitKind::Bytes, path, "the object's size in bytes", remote.len())?;
        Ok(Self::Remote(remote))
    }

    /// As [`open`](Self::open); `None` if there is no such file or object. A server may refuse
    /// access to objects that it does not have.
    #[cfg(feature = "zarr")]
    pub fn open_if_there(path: &Path, limits: &Limits) -> Result<Option<Self>> {
        if !is_remote(path) {
            return if path.is_file() { Self::open(path, limits).map(Some) } else { Ok(None) };
        }
        let Some(remote) = Remote::open_if_there(path, limits)? else { return Ok(None) };
        limits.check(LimitKind::Bytes, path, "the object's size in bytes", remote.len())?;
        Ok(Some(Self::Remote(remote).ready()))
    }

    /// Says that the beginning was read. Until then, all requests to a server together may take
    /// the limit of seconds, and then each.
    pub fn ready(mut self) -> Self {
        if let Self::Remote(remote) = &mut self {
            remote.ready();
        }
        self
    }

    /// The number of all bytes.
    pub fn len(&self) -> u64 {
        match self {
            Self::Mapped(map) => map.len() as u64,
            Self::Held(bytes) => bytes.len() as u64,
            Self::Remote(remote) => remote.len(),
            Self::Parts(parts) => parts.len(),
        }
    }

    /// Returns the beginning: all bytes of a file, and of a remote object those that came when it
    /// was opened, or more if `least` is more.
    pub fn beginning(&self, least: u64) -> Result<Cow<'_, [u8]>> {
        match self {
            Self::Mapped(map) => Ok(Cow::Borrowed(map)),
            Self::Held(bytes) => Ok(Cow::Borrowed(bytes)),
            Self::Remote(remote) => {
                let head = remote.head()?;
                let least = least.min(remote.len());
                if head.len() as u64 >= least {
                    return Ok(Cow::Owned(head.into()));
                }
                memory::room("reading the beginning of an object", 2 * least)?;
                Ok(Cow::Owned(remote.read(0..least)?.into()))
            }
            Self::Parts(parts) => {
                let least = least.max(Parts::BLOCK).min(parts.len());
                memory::room("reading the beginning of a file", 2 * least)?;
                Ok(Cow::Owned(parts.read(0..least)?))
            }
        }
    }

    /// Reads the beginning. If it is damaged, that of a remote object is fetched again once.
    pub fn begun<T>(&self, begin: impl Fn(&Self) -> Result<T>) -> Result<T> {
        match (self, begin(self)) {
            (Self::Remote(remote), Err(Error::Input { .. })) => {
                remote.forget(0..BEGINNING.min(remote.len()));
                begin(self)
            }
            (_, result) => result,
        }
    }

    /// Returns a range of bytes, which must lie within the file.
    fn read(&self, range: Range<u64>) -> Result<Cow<'_, [u8]>> {
        let within = || range.start as usize..range.end as usize;
        match self {
            Self::Mapped(map) => Ok(Cow::Borrowed(&map[within()])),
            Self::Held(bytes) => Ok(Cow::Borrowed(&bytes[within()])),
            Self::Remote(remote) => Ok(Cow::Owned(remote.read(range)?.into())),
            Self::Parts(parts) => Ok(Cow::Owned(parts.read(range)?)),
        }
    }

    /// Says that these ranges are read soon, so that those of a remote object are fetched together.
    pub fn fetch(&self, ranges: impl Iterator<Item = Range<u64>>) -> Result<()> {
        match self {
            Self::Mapped(_) | Self::Held(_) => Ok(()),
            Self::Remote(remote) => remote.fetch(&ranges.collect::<Vec<_>>()),
            Self::Parts(parts) => {
                ranges.for_each(|range| parts.want(&range));
                Ok(())
            }
        }
    }

    /// Returns what a range, which must lie within the file, is decoded to. If that fails, a range
    /// of a remote object is fetched again once. `decode` gets a copy: if another program writes to
    /// the file, the bytes that it decodes are still those that it has verified. It returns a
    /// message if they are damaged.
    ///
    /// # Errors
    /// The inner error is the message of `decode`; the outer one says why nothing was fetched.
    pub fn decoded<T>(
        &self,
        range: Range<u64>,
        decode: impl Fn(&[u8]) -> Result<T, String>,
    ) -> Result<Result<T, String>> {
        let copy = self.read(range.clone())?.into_owned();
        match (self, decode(&copy)) {
            (Self::Remote(remote), Err(message)) => {
                let object = remote.name().display();
                tracing::warn!(%object, "bytes {range:?} are wrong, fetched again: {message}");
                remote.forget(range.clone());
                let again = decode(&self.read(range.clone())?);
                if again.is_err() {
                    remote.forget(range);
                }
                Ok(again.map_err(|message| format!("{message}, also when it is fetched again")))
            }
            (Self::Parts(parts), Err(message)) => match parts.distrust(&range) {
                true => Err(Error::Absent { start: range.start, end: range.end }),
                false => Ok(Err(format!("{message}, also when it is fetched again"))),
            },
            (_, result) => Ok(result),
        }
    }

    /// Returns the parts of a file that comes in parts.
    pub fn parts(&self) -> Option<&Parts> {
        match self {
            Self::Parts(parts) => Some(parts),
            _ => None,
        }
    }

    /// Returns whether the bytes from `end` on are the hash of those before.
    pub fn is_hashed(&self, end: u64) -> Result<bool> {
        let mut hash = blake3::Hasher::new();
        let mut start = 0;
        while start < end {
            let next = (start + PORTION).min(end);
            hash.update(&self.read(start..next)?);
            start = next;
        }
        Ok(*self.read(end..self.len())? == *hash.finalize().as_bytes())
    }

    /// Finds the cause of an error. A failed checksum shows damage, but not whether the file was
    /// changed while it was read.
    pub fn why(&self, path: &Path, error: Error) -> Error {
        match self {
            Self::Mapped(map) => intact(map, path).err().unwrap_or(error),
            Self::Held(_) | Self::Remote(_) | Self::Parts(_) => error,
        }
    }
}

/// Returns the size in bytes of a file or of a remote object.
///
/// # Errors
/// [`Error::File`] for a file that cannot be opened; [`Error::Input`] for an object that the server
/// does not give.
pub fn size(path: impl AsRef<Path>) -> Result<u64> {
    let path = path.as_ref();
    if is_remote(path) {
        return Remote::size(path);
    }
    let metadata = path.metadata().map_err(|error| Error::file(path, "read", error))?;
    Ok(metadata.len())
}

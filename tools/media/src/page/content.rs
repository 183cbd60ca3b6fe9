//! The files of a page: bytes in memory, or files on this machine that are read in parts.

use crate::Failure;
use splatkit::{
    Error,
    disk::{self, TemporaryFolder},
};
use std::{
    borrow::Cow,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

/// The content of a file of a page.
#[derive(Debug, Clone)]
pub enum Content {
    /// Bytes in memory.
    Held(Vec<u8>),
    /// A file on this machine. It may be larger than memory.
    Kept(PathBuf),
    /// A file that was made for the page, in a folder that goes with it.
    Made(PathBuf, Arc<TemporaryFolder>),
}

impl Content {
    /// Returns a file that was made for the page.
    pub fn made(folder: TemporaryFolder, path: PathBuf) -> Self {
        Self::Made(path, Arc::new(folder))
    }

    /// Returns the file on this machine, unless the bytes are in memory.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Held(_) => None,
            Self::Kept(path) | Self::Made(path, _) => Some(path),
        }
    }

    /// Returns the number of bytes.
    ///
    /// # Errors
    /// For a file that is gone.
    pub fn size(&self) -> Result<u64, Failure> {
        match self {
            Self::Held(bytes) => Ok(bytes.len() as u64),
            Self::Kept(path) | Self::Made(path, _) => {
                let meta = path.metadata().map_err(|source| unread(path, &source))?;
                Ok(meta.len())
            }
        }
    }

    /// Returns all bytes.
    ///
    /// # Errors
    /// For a file that cannot be read.
    pub fn bytes(&self) -> Result<Cow<'_, [u8]>, Failure> {
        match self {
            Self::Held(bytes) => Ok(bytes.into()),
            Self::Kept(path) | Self::Made(path, _) => {
                Ok(fs::read(path).map_err(|source| unread(path, &source))?.into())
            }
        }
    }

    /// Writes the bytes to a file, portion by portion. Returns their number.
    ///
    /// # Errors
    /// For a file that cannot be read or written.
    pub fn write(&self, to: &Path) -> Result<u64, Failure> {
        match self {
            Self::Held(bytes) => disk::write(to, bytes)?,
            Self::Kept(path) | Self::Made(path, _) => {
                let mut from = File::open(path).map_err(|source| unread(path, &source))?;
                disk::write_with(to, |out| io::copy(&mut from, out).map(drop))?;
            }
        }
        self.size()
    }
}

/// The error for a file that cannot be read.
pub fn unread(file: &Path, source: &io::Error) -> Error {
    Error::input(file, "file", format!("cannot be read: {source}"))
}

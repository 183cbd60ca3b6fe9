//! Scratch space on disk for data that does not fit in memory.

use super::{
    folder,
    step::{Step, step, write_step},
};
use crate::{Error, Result};
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
};
#[cfg(feature = "files")]
use tempfile::tempfile_in as nameless;

/// A file without a name. The system removes it when the process ends, however it ends.
pub struct Scratch(File);

impl Scratch {
    /// Creates one beside the file that is to be written, because that disk must have room for
    /// about as many bytes anyway.
    ///
    /// # Errors
    /// [`Error::Output`], naming the file that is to be written.
    pub fn beside(wanted: &Path) -> Result<Self> {
        let file = step(Step::Create).and_then(|()| nameless(folder(wanted)));
        file.map(Self).map_err(|e| Error::output(wanted, e))
    }
}

#[cfg(not(feature = "files"))]
fn nameless(_: &Path) -> io::Result<File> {
    let message = "scratch files come with the feature “files” of the crate splatkit, and this \
                   program was built without";
    Err(io::Error::new(io::ErrorKind::Unsupported, message))
}

impl Write for Scratch {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        write_step(&self.0, bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        step(Step::Flush)?;
        self.0.flush()
    }
}

impl Read for Scratch {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        step(Step::Read)?;
        self.0.read(bytes)
    }
}

impl Seek for Scratch {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.0.seek(to)
    }
}

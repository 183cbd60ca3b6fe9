//! Room on the disk for what does not fit in memory.

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

/// A file without a name: the system takes it away with the process, whatever ends that.
pub struct Scratch(File);

impl Scratch {
    /// Beside a file that is to be, where there must be room for about as much.
    ///
    /// # Errors
    /// [`Error::Output`] for the file that is to be.
    pub fn beside(wanted: &Path) -> Result<Self> {
        let file = step(Step::Create).and_then(|()| tempfile::tempfile_in(folder(wanted)));
        file.map(Self).map_err(|e| Error::output(wanted, e))
    }
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

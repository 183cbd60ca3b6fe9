//! Files that appear whole or not at all.

use super::{
    BUFFER, folder,
    live::Part,
    step::{Step, step, write_step},
};
use crate::{Error, Result};
use std::{
    fs::File,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

/// A file on its way: written beside the one that is wanted, whose name it takes by [`commit`](Self::commit). Dropped before,
/// it is removed.
pub struct AtomicFile {
    wanted: PathBuf,
    part: Part,
}

impl AtomicFile {
    /// Begins a file.
    ///
    /// # Errors
    /// [`Error::Output`] where nothing can be written beside `wanted`, and where `wanted` is something else than a file.
    pub fn create(wanted: &Path) -> Result<Self> {
        let fail = |e| Error::output(wanted, e);
        if wanted.metadata().is_ok_and(|found| !found.is_file()) {
            return Err(fail(io::Error::new(
                io::ErrorKind::InvalidInput,
                "there is something of that name that is no file",
            )));
        }
        Ok(Self { wanted: wanted.to_owned(), part: Part::create(wanted).map_err(fail)? })
    }

    /// Gives the file its name, once all of it is on the disk.
    ///
    /// # Errors
    /// [`Error::Output`]; then nothing is left of the file.
    pub fn commit(self) -> Result<()> {
        let Self { wanted, part } = self;
        let fail = |e| Error::output(&wanted, e);
        // Who may read a file does not change because its content does.
        if let Ok(old) = wanted.metadata() {
            part.file().set_permissions(old.permissions()).map_err(fail)?;
        }
        // A name that gets to the disk before the content would, after a power cut, be that of a file with holes.
        sync(part.file(), Step::Sync).map_err(fail)?;
        part.rename(&wanted).map_err(fail)?;
        // The name, too, must get there. Where a folder cannot be synced, the system sees to it.
        if let Ok(folder) = File::open(folder(&wanted)) {
            sync(&folder, Step::SyncFolder).ok();
        }
        Ok(())
    }
}

/// Waits until something is on the disk. Tests pull no plugs, and do it a thousand times.
fn sync(file: &File, what: Step) -> io::Result<()> {
    step(what)?;
    if cfg!(test) { Ok(()) } else { file.sync_all() }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        write_step(self.part.file(), bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        step(Step::Flush)?;
        self.part.file().flush()
    }
}

/// Writes a file as a whole.
///
/// # Errors
/// [`Error::Output`]; then the file is as it was.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |out| out.write_all(bytes))
}

/// Writes a file by a function.
///
/// # Errors
/// As of [`write`](write()).
pub fn write_with(path: &Path, write: impl FnOnce(&mut BufWriter<AtomicFile>) -> io::Result<()>) -> Result<()> {
    let mut out = BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?);
    write(&mut out).and_then(|()| out.flush()).map_err(|e| Error::output(path, e))?;
    out.into_inner().map_err(|e| Error::output(path, e.into_error()))?.commit()
}

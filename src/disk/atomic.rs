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
///
/// Where the wanted file is a symbolic link, the link stays: the file that it leads to is the one that is written, beside
/// which the new one is made. A link that leads nowhere is an error.
pub struct AtomicFile {
    /// The name that errors use.
    wanted: PathBuf,
    /// The file that it leads to.
    target: PathBuf,
    part: Part,
}

impl AtomicFile {
    /// Begins a file.
    ///
    /// # Errors
    /// [`Error::Output`] where nothing can be written beside `wanted`, and where `wanted` is something else than a file, or
    /// leads nowhere.
    pub fn create(wanted: &Path) -> Result<Self> {
        let fail = |e| Error::output(wanted, e);
        if wanted.metadata().is_ok_and(|found| !found.is_file()) {
            return Err(fail(io::Error::new(
                io::ErrorKind::InvalidInput,
                "there is something of that name that is no file",
            )));
        }
        let target = target(wanted).map_err(fail)?;
        let part = Part::create(&target).map_err(fail)?;
        Ok(Self { wanted: wanted.to_owned(), target, part })
    }

    /// Gives the file its name, once all of it is on the disk.
    ///
    /// # Errors
    /// [`Error::Output`]; then nothing is left of the file.
    pub fn commit(self) -> Result<()> {
        let Self { wanted, target, part } = self;
        let fail = |e| Error::output(&wanted, e);
        // Who may read a file does not change because its content does; it may have changed since the part was made.
        if let Ok(old) = target.metadata() {
            part.file().set_permissions(old.permissions()).map_err(fail)?;
        }
        // A name that gets to the disk before the content would, after a power cut, be that of a file with holes.
        sync(part.file(), Step::Sync).map_err(fail)?;
        part.rename(&target).map_err(fail)?;
        // The name, too, must get there. Where a folder cannot be synced, the system sees to it.
        if let Ok(folder) = File::open(folder(&target)) {
            sync(&folder, Step::SyncFolder).ok();
        }
        Ok(())
    }
}

/// The file that a name leads to: itself, but for symbolic links.
fn target(wanted: &Path) -> io::Result<PathBuf> {
    if !wanted.is_symlink() {
        return Ok(wanted.to_owned());
    }
    wanted.canonicalize().map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is a symbolic link to a file that does not exist",
        ),
        _ => error,
    })
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
pub fn write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<AtomicFile>) -> io::Result<()>,
) -> Result<()> {
    let mut out = BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?);
    write(&mut out).and_then(|()| out.flush()).map_err(|e| Error::output(path, e))?;
    out.into_inner().map_err(|e| Error::output(path, e.into_error()))?.commit()
}

//! Files that appear whole or not at all.

use super::{
    BUFFER, folder,
    live::Part,
    new::{is_done, is_replaceable, taken},
    step::{Step, step, write_step},
};
use crate::{Error, Result};
use std::{
    fs::File,
    io::{self, BufWriter, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// A file being written. Its bytes go to a temporary file beside the requested one;
/// [`commit`](Self::commit) renames it to the requested name. If it is dropped before that, it is
/// removed.
///
/// If the requested path is a symbolic link, the link remains. The file that it points to is
/// replaced, and the temporary file is created beside that one. A dangling link is an error.
pub struct AtomicFile {
    /// The requested path, as errors name it.
    wanted: PathBuf,
    /// The path after following symbolic links.
    target: PathBuf,
    /// Whether it may replace what has its name by then.
    may_replace: bool,
    part: Part,
}

impl AtomicFile {
    /// Creates the temporary file.
    ///
    /// # Errors
    /// [`Error::Output`] if nothing can be written beside `wanted`, or if `wanted` is not a regular
    /// file or is a dangling link.
    pub fn create(wanted: &Path) -> Result<Self> {
        let fail = |e| Error::output(wanted, e);
        if wanted.metadata().is_ok_and(|metadata| !metadata.is_file()) {
            return Err(fail(io::Error::new(
                io::ErrorKind::InvalidInput,
                "something of this name exists that is not a regular file",
            )));
        }
        let may_replace = is_replaceable(wanted);
        let target = if may_replace {
            target(wanted).map_err(fail)?
        } else if wanted.symlink_metadata().is_err() {
            wanted.to_owned()
        } else {
            return Err(fail(taken()));
        };
        let part = Part::create(&target).map_err(fail)?;
        Ok(Self { wanted: wanted.to_owned(), target, may_replace, part })
    }

    /// Creates a temporary file beside `wanted` whose name has this extension, for data that is
    /// read by its path and never gets another name.
    ///
    /// # Errors
    /// [`Error::Output`] if nothing can be written beside `wanted`.
    pub(crate) fn scratch(wanted: &Path, extension: &str) -> Result<Self> {
        let part = Part::with_extension(wanted, Some(extension));
        let part = part.map_err(|e| Error::output(wanted, e))?;
        let [wanted, target] = [wanted, wanted].map(Path::to_owned);
        Ok(Self { wanted, target, may_replace: false, part })
    }

    /// Returns the path of the temporary file, for another program that writes it. The program must
    /// keep the file and not put another one in its place.
    pub fn part(&self) -> &Path {
        self.part.path()
    }

    /// Gives the file its name, once its whole content is on disk.
    ///
    /// # Errors
    /// [`Error::Output`], also if something has the name and may not be replaced
    /// ([`may_replace`](super::may_replace)); then the temporary file is removed.
    pub fn commit(self) -> Result<()> {
        let Self { wanted, target, may_replace, part } = self;
        let fail = |e| Error::output(&wanted, e);
        // New content must not change who may read a file. The permissions may have changed since
        // the temporary file was created.
        if let Some(old) = may_replace.then(|| target.metadata().ok()).flatten() {
            part.file().set_permissions(old.permissions()).map_err(fail)?;
        }
        // If the name reached the disk before the content, a power cut could leave a file with
        // holes under it.
        sync(part.file(), Step::Sync).map_err(fail)?;
        part.rename(&target, may_replace).map_err(fail)?;
        is_done(&wanted);
        // The name must reach the disk too. If a folder cannot be synced, that is left to the
        // system.
        if let Ok(folder) = File::open(folder(&target)) {
            sync(&folder, Step::SyncFolder).ok();
        }
        Ok(())
    }
}

/// Follows symbolic links to the file that is to be written.
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

/// Waits until a file or folder is on disk. Tests skip the wait: they cut no power, and sync
/// thousands of times.
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

/// Reads what was written, for formats that go back and change it.
impl Read for AtomicFile {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.part.file().read(bytes)
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        self.part.file().seek(place)
    }
}

/// Writes a whole file.
///
/// # Errors
/// [`Error::Output`]; then the file is unchanged.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_with(path, |out| out.write_all(bytes))
}

/// Writes a file with a function.
///
/// # Errors
/// The same as [`write`](write()).
pub fn write_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<AtomicFile>) -> io::Result<()>,
) -> Result<()> {
    let mut out = BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?);
    write(&mut out).and_then(|()| out.flush()).map_err(|e| Error::output(path, e))?;
    out.into_inner().map_err(|e| Error::output(path, e.into_error()))?.commit()
}

//! Results that may replace nothing: whatever appears under their names meanwhile stays.

use std::{
    collections::BTreeSet,
    io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

static NEW: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn new() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    NEW.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says whether this process may replace a file that exists when its result is done. By default it
/// may. If it may not, and something has the name by then, the result is an error and what is there
/// stays. This holds until the result has its name.
///
/// The path must be written as it is given to the writer.
pub fn may_replace(path: impl Into<PathBuf>, may: bool) {
    let path = path.into();
    match may {
        true => drop(new().remove(&path)),
        false => drop(new().insert(path)),
    }
}

/// Returns whether a result may replace what has its name.
pub fn is_replaceable(path: &Path) -> bool {
    !new().contains(path)
}

/// The result has its name. From now on it is an ordinary file.
pub(super) fn is_done(path: &Path) {
    new().remove(path);
}

/// The error for a result whose name is taken.
pub(super) fn taken() -> io::Error {
    let message = "something of this name appeared while it was made, and stays as it is";
    io::Error::new(io::ErrorKind::AlreadyExists, message)
}

/// Renames a file; with `may_replace`, whatever has the new name is replaced.
///
/// # Errors
/// Those of renaming, and [`io::ErrorKind::AlreadyExists`].
pub fn rename(from: &Path, to: &Path, may_replace: bool) -> io::Result<()> {
    if may_replace {
        return std::fs::rename(from, to);
    }
    rename_new(from, to).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => taken(),
        _ => error,
    })
}

/// Renames a file to a name that nothing has, in one step.
fn rename_new(from: &Path, to: &Path) -> io::Result<()> {
    let error = match in_one_step(from, to) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => error,
        other => return other,
    };
    // File systems that can do neither (some in user space): another writer could still come
    // between these two steps.
    if to.symlink_metadata().is_ok() {
        return Err(taken());
    }
    std::fs::rename(from, to).map_err(|_| error)
}

/// `renameat2`, or a hard link.
#[cfg(feature = "files")]
fn in_one_step(from: &Path, to: &Path) -> io::Result<()> {
    let mut part = tempfile::TempPath::try_from_path(from)?;
    // Who made the file removes it.
    part.disable_cleanup(true);
    part.persist_noclobber(to).map_err(|failed| failed.error)
}

#[cfg(not(feature = "files"))]
fn in_one_step(from: &Path, to: &Path) -> io::Result<()> {
    std::fs::hard_link(from, to)?;
    std::fs::remove_file(from).ok();
    Ok(())
}

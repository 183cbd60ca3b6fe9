//! The temporary files of this process that have names: made, renamed and removed under one lock, so that one call can do
//! away with all of them.

use super::{
    folder,
    step::{Step, step},
};
use std::{
    collections::BTreeMap,
    fs::{File, Metadata, Permissions, TryLockError},
    io,
    path::{Path, PathBuf},
    sync::{
        Mutex, MutexGuard,
        atomic::{AtomicU64, Ordering},
    },
};

/// Those that are there, by a number of their own: names come again.
type Live = BTreeMap<u64, PathBuf>;

static LIVE: Mutex<Live> = Mutex::new(Live::new());

/// How their names end.
const EXTENSION: &str = "splatkit-part";

/// So many files of one name may be on their way at once.
const MOST: u32 = 100;

fn live() -> MutexGuard<'static, Live> {
    // Whoever panicked left a list that is right.
    LIVE.lock().unwrap_or_else(|e| e.into_inner())
}

/// While it lives, no file takes its name and no new one begins: whoever tries waits.
pub struct Abandoned {
    _held: MutexGuard<'static, Live>,
}

/// Removes all files that are on their way, for a process that is about to end without unwinding: a handler of Ctrl-C calls
/// this and then exits, with the result still in its hands.
#[must_use = "files that are dropped while the process ends must not come up again"]
pub fn abandon() -> Abandoned {
    let mut held = live();
    for path in std::mem::take(&mut *held).into_values() {
        std::fs::remove_file(path).ok();
    }
    Abandoned { _held: held }
}

/// A temporary file, locked as long as its process lives: what is not locked was left behind by one that was killed.
pub struct Part {
    number: u64,
    path: PathBuf,
    file: File,
}

impl Part {
    /// Makes one beside the file that is wanted. Nobody may read it who may not read the file that it replaces.
    pub fn create(wanted: &Path) -> io::Result<Self> {
        // Names may be too long already.
        let name: String =
            wanted.file_name().unwrap_or_default().to_string_lossy().chars().take(50).collect();
        let permissions = wanted.metadata().ok().map(|found| found.permissions());
        let mut live = live();
        step(Step::Create)?;
        for try_number in 0..MOST {
            let path = folder(wanted).join(format!(".{name}.{try_number}.{EXTENSION}"));
            remove_stale(&path);
            // Never one that is there, nor one that a link leads to.
            match create_new(&path, permissions.as_ref()) {
                Ok(file) => {
                    race("created", &path);
                    // Where files cannot be locked, none is taken for stale.
                    if matches!(file.try_lock(), Err(TryLockError::WouldBlock))
                        || !names(&path, &file)
                    {
                        // Another process held it for stale before it was locked, and may have made its own.
                        continue;
                    }
                    static NEXT: AtomicU64 = AtomicU64::new(0);
                    let number = NEXT.fetch_add(1, Ordering::Relaxed);
                    live.insert(number, path.clone());
                    let part = Self { number, path, file };
                    drop(live);
                    // Not all systems take permissions as a file is made, and some take fewer than were asked for.
                    if let Some(permissions) = permissions {
                        part.file.set_permissions(permissions)?;
                    }
                    return Ok(part);
                }
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        Err(io::Error::new(io::ErrorKind::AlreadyExists, format!("{MOST} others are writing it")))
    }

    pub fn file(&self) -> &File {
        &self.file
    }

    /// Takes the place of the file that is wanted.
    pub fn rename(self, wanted: &Path) -> io::Result<()> {
        let mut live = live();
        step(Step::Rename)?;
        if !names(&self.path, &self.file) {
            let message =
                format!("{} was removed or replaced by another program", self.path.display());
            return Err(io::Error::other(message));
        }
        std::fs::rename(&self.path, wanted)?;
        live.remove(&self.number);
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let mut live = live();
        // What was renamed or abandoned is not listed, and whatever has the name now is not this one.
        if live.remove(&self.number).is_some()
            && step(Step::Remove).is_ok()
            && names(&self.path, &self.file)
        {
            std::fs::remove_file(&self.path).ok();
        }
    }
}

/// Makes a file that is not there yet, with no more permissions than these from its first moment on.
fn create_new(path: &Path, permissions: Option<&Permissions>) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    if let Some(permissions) = permissions {
        use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
        // Its owner must be able to write it.
        options.mode(permissions.mode() & 0o777 | 0o600);
    }
    #[cfg(not(unix))]
    let _ = permissions;
    options.open(path)
}

/// Removes a temporary file that no living process holds.
fn remove_stale(path: &Path) {
    if path.symlink_metadata().is_ok_and(|found| found.is_file())
        && let Ok(file) = File::open(path)
        && file.try_lock().is_ok()
    {
        race("locked", path);
        // While it was not locked, its writer may have finished it, and another one may have made a new file of its name. Once
        // it is locked, nobody else removes it or takes it for its own.
        if names(path, &file) {
            std::fs::remove_file(path).ok();
        }
    }
}

/// Whether a path is the name of an open file.
fn names(path: &Path, file: &File) -> bool {
    match (path.symlink_metadata(), file.metadata()) {
        (Ok(named), Ok(open)) => is_same(&named, &open),
        _ => false,
    }
}

#[cfg(unix)]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Elsewhere an open file keeps its name: it can be neither removed nor replaced.
#[cfg(not(unix))]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    a.is_file() && b.is_file()
}

#[cfg(not(test))]
fn race(_: &str, _: &Path) {}

#[cfg(test)]
use super::step::faults::race;

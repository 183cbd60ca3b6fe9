//! The named temporary files of this process. They are created, renamed and removed under one lock,
//! so that one call can remove all of them.

use super::{
    folder,
    new::rename,
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

/// The existing temporary files, by a unique number, because names are reused.
type Live = BTreeMap<u64, PathBuf>;

static LIVE: Mutex<Live> = Mutex::new(Live::new());

/// The extension of temporary files.
const EXTENSION: &str = "splatkit-part";

/// The most files with the same name that can be in progress at once.
const MOST: u32 = 100;

fn live() -> MutexGuard<'static, Live> {
    // A thread that panicked with the lock still left a correct list.
    LIVE.lock().unwrap_or_else(|e| e.into_inner())
}

/// While this exists, no file is renamed and none is created: threads that try wait.
pub struct Abandoned {
    _held: MutexGuard<'static, Live>,
}

/// Removes all files in progress, for a process that is about to end without unwinding. A Ctrl-C
/// handler calls this and then exits while it still holds the result.
#[must_use = "dropping this lets other threads create files again while the process ends"]
pub fn abandon() -> Abandoned {
    let mut held = live();
    for path in std::mem::take(&mut *held).into_values() {
        remove(&path);
    }
    Abandoned { _held: held }
}

/// Removes a file, or a folder with all in it.
fn remove(path: &Path) {
    if std::fs::remove_file(path).is_err() {
        std::fs::remove_dir_all(path).ok();
    }
}

/// Returns a number that no other entry of the list has.
fn next_number() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// A folder for files that go with it: when it is dropped, and when the process is interrupted
/// ([`abandon`]). Nobody else can read it.
#[derive(Debug)]
pub struct TemporaryFolder {
    number: u64,
    path: PathBuf,
}

impl TemporaryFolder {
    /// Makes a folder among the system's temporary files.
    ///
    /// # Errors
    /// [`Error::Output`](crate::Error::Output), such as on a full disk.
    pub fn new() -> crate::Result<Self> {
        let place = std::env::temp_dir();
        let mut live = live();
        let (number, process) = (next_number(), std::process::id());
        for try_number in 0..MOST {
            let path = place.join(format!("splatkit-{process}-{number}-{try_number}"));
            match create_private(&path) {
                Ok(()) => {
                    live.insert(number, path.clone());
                    return Ok(Self { number, path });
                }
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(crate::Error::output(&place, error)),
            }
        }
        let error = io::Error::new(io::ErrorKind::AlreadyExists, "no name is free");
        Err(crate::Error::output(&place, error))
    }

    /// Returns where the folder is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Makes a folder that nobody else can read.
#[cfg(unix)]
fn create_private(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    std::fs::DirBuilder::new().mode(0o700).create(path)
}

/// Makes a folder. Those of the system's temporary files are the user's own here.
#[cfg(not(unix))]
fn create_private(path: &Path) -> io::Result<()> {
    std::fs::create_dir(path)
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        if live().remove(&self.number).is_some() {
            std::fs::remove_dir_all(&self.path).ok();
        }
    }
}

/// A temporary file, locked while its process lives. An unlocked one was left behind by a process
/// that was killed.
pub struct Part {
    number: u64,
    path: PathBuf,
    file: File,
}

impl Part {
    /// Creates one beside the requested file. Nobody can read it who may not read the file that it
    /// replaces.
    pub fn create(wanted: &Path) -> io::Result<Self> {
        Self::with_extension(wanted, None)
    }

    /// As [`create`](Self::create), with a further extension that says what the file holds.
    pub fn with_extension(wanted: &Path, extension: Option<&str>) -> io::Result<Self> {
        // The full name may leave no room for the suffix.
        let name: String =
            wanted.file_name().unwrap_or_default().to_string_lossy().chars().take(50).collect();
        let permissions = wanted.metadata().ok().map(|metadata| metadata.permissions());
        let mut live = live();
        step(Step::Create)?;
        for try_number in 0..MOST {
            let end = extension.map_or(String::new(), |extension| format!(".{extension}"));
            let path = folder(wanted).join(format!(".{name}.{try_number}.{EXTENSION}{end}"));
            remove_stale(&path);
            // Never opens an existing file, nor one behind a link.
            match create_new(&path, permissions.as_ref()) {
                Ok(file) => {
                    race("created", &path);
                    // Where files cannot be locked, none is treated as stale.
                    if matches!(file.try_lock(), Err(TryLockError::WouldBlock))
                        || !names(&path, &file)
                    {
                        // Another process took it for stale before it was locked, and may have
                        // created its own file under this name.
                        continue;
                    }
                    let number = next_number();
                    live.insert(number, path.clone());
                    let part = Self { number, path, file };
                    drop(live);
                    // Not all systems set permissions on creation, and some set fewer than
                    // requested.
                    if let Some(permissions) = permissions {
                        part.file.set_permissions(permissions)?;
                    }
                    return Ok(part);
                }
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
        Err(io::Error::new(
            io::ErrorKind::AlreadyExists,
            format!("{MOST} other writers have begun this file"),
        ))
    }

    pub fn file(&self) -> &File {
        &self.file
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Renames the file to the requested path.
    pub fn rename(self, wanted: &Path, may_replace: bool) -> io::Result<()> {
        let mut live = live();
        step(Step::Rename)?;
        if !names(&self.path, &self.file) {
            let message =
                format!("{} was removed or replaced by another program", self.path.display());
            return Err(io::Error::other(message));
        }
        rename(&self.path, wanted, may_replace)?;
        live.remove(&self.number);
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let mut live = live();
        // A renamed or abandoned file is not listed. Any file that has its name now is a different
        // one.
        if live.remove(&self.number).is_some()
            && step(Step::Remove).is_ok()
            && names(&self.path, &self.file)
        {
            std::fs::remove_file(&self.path).ok();
        }
    }
}

/// Creates a file that must not exist yet, with no more than these permissions from the first
/// moment on.
fn create_new(path: &Path, permissions: Option<&Permissions>) -> io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true).create_new(true);
    #[cfg(unix)]
    if let Some(permissions) = permissions {
        use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
        // The owner must be able to write it.
        options.mode(permissions.mode() & 0o777 | 0o600);
    }
    #[cfg(not(unix))]
    let _ = permissions;
    options.open(path)
}

/// Removes a temporary file that no living process holds.
fn remove_stale(path: &Path) {
    if path.symlink_metadata().is_ok_and(|metadata| metadata.is_file())
        && let Ok(file) = File::open(path)
        && file.try_lock().is_ok()
    {
        race("locked", path);
        // Before it was locked, its writer may have finished it, and another one may have created a
        // new file with the same name. Once it is locked, nobody else removes or reuses it.
        if names(path, &file) {
            std::fs::remove_file(path).ok();
        }
    }
}

/// Returns whether the path still names the open file.
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

/// On other systems an open file keeps its name: it can be neither removed nor replaced.
#[cfg(not(unix))]
fn is_same(a: &Metadata, b: &Metadata) -> bool {
    a.is_file() && b.is_file()
}

#[cfg(not(test))]
fn race(_: &str, _: &Path) {}

#[cfg(test)]
use super::step::faults::race;

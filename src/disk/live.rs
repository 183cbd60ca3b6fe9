//! The temporary files of this process that have names: made, renamed and removed under one lock, so that one call can do
//! away with all of them.

use super::{
    folder,
    step::{Step, step},
};
use std::{
    collections::BTreeMap,
    fs::{File, TryLockError},
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
    /// Makes one beside the file that is wanted.
    pub fn create(wanted: &Path) -> io::Result<Self> {
        // Names may be too long already.
        let name: String = wanted.file_name().unwrap_or_default().to_string_lossy().chars().take(50).collect();
        let mut live = live();
        step(Step::Create)?;
        for try_number in 0..MOST {
            let path = folder(wanted).join(format!(".{name}.{try_number}.{EXTENSION}"));
            remove_stale(&path);
            // Never one that is there, nor one that a link leads to.
            match File::options().read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    // Where files cannot be locked, none is taken for stale.
                    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) || !path.exists() {
                        // Another process held it for stale before it was locked.
                        continue;
                    }
                    static NEXT: AtomicU64 = AtomicU64::new(0);
                    let number = NEXT.fetch_add(1, Ordering::Relaxed);
                    live.insert(number, path.clone());
                    return Ok(Self { number, path, file });
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
        std::fs::rename(&self.path, wanted)?;
        live.remove(&self.number);
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        let mut live = live();
        // What was renamed or abandoned is not listed, and whatever has the name now is not this one.
        if live.remove(&self.number).is_some() && step(Step::Remove).is_ok() {
            std::fs::remove_file(&self.path).ok();
        }
    }
}

/// Removes a temporary file that no living process holds.
fn remove_stale(path: &Path) {
    if path.symlink_metadata().is_ok_and(|found| found.is_file())
        && let Ok(file) = File::open(path)
        && file.try_lock().is_ok()
    {
        std::fs::remove_file(path).ok();
    }
}

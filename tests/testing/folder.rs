//! Temporary folders. The tests of the library, of the command and the fuzz targets share them.

use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder for one test, removed at its end.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        let made = tempfile::Builder::new().prefix("splatkit-").tempdir();
        Self(made.expect("a place for temporary files"))
    }

    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file and returns its path.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        // Some file systems wait for the disk when a file is truncated and rewritten, but not for a
        // new file.
        std::fs::remove_file(&path).ok();
        std::fs::write(&path, bytes).expect("a file");
        path
    }

    /// Returns the names of everything in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self).expect("the folder");
        let name = |entry: std::fs::DirEntry| entry.file_name().into_string().expect("a name");
        let mut names: Vec<_> = entries.map(|entry| name(entry.expect("an entry"))).collect();
        names.sort();
        names
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        self.0.path()
    }
}

//! Folders as inputs: the files of a series of pictures.

use super::{Limits, Source, address::is_remote};
use crate::{Error, Result};
use std::{
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
};

/// Most files of a folder, with those of the folders inside it.
const MOST_FILES: usize = 1 << 18;

/// Bytes that looking into a file counts at most, if the file is not read as a whole.
const LOOK: u64 = 64 << 10;

/// Most levels of folders inside a folder.
const MOST_LEVELS: usize = 16;

impl<'a> Source<'a> {
    /// Opens a file, or lists the files of a folder ([`folder`](Self::folder)). A folder has no
    /// bytes of its own; its files are opened one by one, within the same limits.
    ///
    /// # Errors
    /// Those of [`open`](Self::open) for a file; [`Error::File`] for a folder that cannot be
    /// listed; [`Error::Input`] for a folder of too many files.
    pub fn open_any(path: &'a Path, limits: &'a Limits) -> Result<Self> {
        if is_store(path) {
            // Its files may be millions.
            return Ok(Self::of_folder(without_metadata(path), limits, Vec::new()));
        }
        if path.is_dir() {
            Ok(Self::of_folder(path, limits, list(path)?))
        } else {
            Self::open(path, limits)
        }
    }

    /// Opens another file of this input to look at its beginning. It counts at most 64 KiB, because
    /// a mapped file takes memory only where it is read. [`files`](Self::files) does not list it.
    pub(crate) fn peek_beside<'b>(&self, path: &'b Path) -> Result<Source<'b>>
    where
        'a: 'b,
    {
        self.check_time()?;
        let limits = self.limits;
        let mapping = Self::map(path, limits)?;
        self.spend("the size of a file's header in bytes", LOOK.min(mapping.len() as u64))?;
        Ok(self.beside(path, mapping))
    }
}

/// The files of metadata in a store of Zarr.
const METADATA: [&str; 4] = ["zarr.json", ".zattrs", ".zgroup", ".zarray"];

/// Returns whether a path is a store of Zarr: a folder with its metadata, or an address of one, or
/// of a node inside.
pub(crate) fn is_store(path: &Path) -> bool {
    let ends_in = |name: &OsStr| Path::new(name).extension().is_some_and(|end| end == "zarr");
    if is_remote(path) {
        let is_node = path.extension().is_none() && path.iter().any(ends_in);
        return is_node || path.file_name().is_some_and(ends_in) || path_is_metadata(path);
    }
    path.is_dir()
        && (path.file_name().is_some_and(ends_in)
            || METADATA.iter().any(|name| path.join(name).is_file()))
}

fn path_is_metadata(path: &Path) -> bool {
    METADATA.iter().any(|name| path.ends_with(name))
}

/// Returns the address of a store if a path is the address of its metadata; else the path.
fn without_metadata(path: &Path) -> &Path {
    let is_metadata = is_remote(path) && path_is_metadata(path);
    path.parent().filter(|_| is_metadata).unwrap_or(path)
}

/// Returns the regular files in a folder and in the folders inside it, ordered by their paths.
/// Hidden files are left out, and so are links that leave the folder and links to folders.
fn list(folder: &Path) -> Result<Vec<PathBuf>> {
    let wrong = |error| Error::file(folder, "list", error);
    let home = folder.canonicalize().map_err(wrong)?;
    let (mut files, mut open) = (Vec::new(), vec![(folder.to_owned(), 0)]);
    while let Some((inner, level)) = open.pop() {
        for entry in fs::read_dir(&inner).map_err(|error| Error::file(&inner, "list", error))? {
            let entry = entry.map_err(|error| Error::file(&inner, "list", error))?;
            let (path, kind) = (entry.path(), entry.file_type().map_err(wrong)?);
            if entry.file_name().to_string_lossy().starts_with('.') {
                continue;
            }
            if kind.is_dir() && level < MOST_LEVELS {
                open.push((path, level + 1));
            } else if kind.is_file() || kind.is_symlink() && leads_to_a_file(&path, &home) {
                files.push(path);
            }
            if files.len() + open.len() > MOST_FILES {
                let message = format!("holds more than {MOST_FILES} files");
                let hint = "name a folder that holds one study or series";
                return Err(Error::input(folder, "path", message).hint(hint));
            }
        }
    }
    files.sort();
    Ok(files)
}

fn leads_to_a_file(link: &Path, home: &Path) -> bool {
    link.canonicalize().is_ok_and(|real| real.starts_with(home) && real.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::Folder;

    #[test]
    fn a_folder_lists_its_files_in_order() {
        let folder = Folder::new();
        fs::create_dir_all(folder.path("b/c")).unwrap();
        for name in ["z", "b/c/1", "b/0", "a.dcm", ".hidden"] {
            folder.write(name, "bytes");
        }
        let limits = Limits::default();
        let source = Source::open_any(folder.as_ref(), &limits).unwrap();
        let names: Vec<_> = ["a.dcm", "b/0", "b/c/1", "z"].map(|name| folder.path(name)).into();
        assert_eq!(source.folder(), Some(&names[..]));
        assert!(source.bytes().is_empty() && source.intact().is_ok());
        let peeked = source.peek_beside(&names[1]).unwrap();
        assert_eq!((peeked.bytes(), source.files().len()), (&b"bytes"[..], 0));
        assert_eq!(source.open_beside(&names[1]).unwrap().bytes(), b"bytes");
        assert_eq!(source.files(), [names[1].clone()]);
        let file = Source::open_any(&names[0], &limits).unwrap();
        assert!(file.folder().is_none() && !file.bytes().is_empty());
        assert!(Source::open_any(&folder.path("none"), &limits).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_in_the_folder() {
        use std::os::unix::fs::symlink;
        let folder = Folder::new();
        let inside = folder.path("study");
        fs::create_dir(&inside).unwrap();
        folder.write("outside", "bytes");
        folder.write("study/local", "bytes");
        symlink(folder.path("outside"), inside.join("out")).unwrap();
        symlink("local", inside.join("in")).unwrap();
        symlink("..", inside.join("up")).unwrap();
        symlink("/dev/zero", inside.join("zero")).unwrap();
        let limits = Limits::default();
        let source = Source::open_any(&inside, &limits).unwrap();
        assert_eq!(source.folder(), Some(&[inside.join("in"), inside.join("local")][..]));
    }
}

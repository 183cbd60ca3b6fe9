//! References from one file to another: relative, and inside the folder of the referring file.

use super::{Source, address::is_remote};
use crate::{Error, Result};
use std::path::{Path, PathBuf};

impl Source<'_> {
    /// Returns the path of a file that this file refers to. The reference must be relative and,
    /// after links are resolved, inside this file's folder.
    ///
    /// A reference that any system would take for a path elsewhere is refused on all systems. So a
    /// model that loads on one machine loads on every other.
    pub fn neighbour(&self, place: &str, reference: &str) -> Result<PathBuf> {
        let refuse = |reason: &str| {
            let excerpt: String = reference.chars().take(80).collect();
            self.error(place, format!("refers to “{excerpt}”, {reason}")).hint(
                "put the file beside the one that names it and refer to it by a relative path",
            )
        };
        if let Some(reason) = refusal(reference) {
            return Err(refuse(reason));
        }
        if self.is_alone() {
            let from = if is_remote(self.path) { "an address" } else { "memory" };
            let message = format!(
                "refers to “{reference}”, but was read from {from}, where there are no other files"
            );
            return Err(self
                .error(place, message)
                .hint("open the file by its path, beside those that it refers to"));
        }
        let folder =
            self.path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let target = folder.join(reference);
        let real = target
            .canonicalize()
            .map_err(|e| self.error(place, format!("refers to “{reference}”: {e}")))?;
        let home = folder.canonicalize().map_err(|e| Error::file(folder, "resolve", e))?;
        if !real.starts_with(&home) {
            return Err(refuse("a link that leaves the file's own folder"));
        }
        if self.path.canonicalize().is_ok_and(|path| path == real) {
            return Err(refuse("the file itself"));
        }
        if !real.is_file() {
            return Err(refuse("which is not a regular file"));
        }
        Ok(target)
    }
}

/// Returns whether a reference is a path inside a folder, by its text alone.
pub(crate) fn is_inside(reference: &str) -> bool {
    refusal(reference).is_none()
}

/// Returns why a reference leads out of a folder, by its text or by its links; `home` is the
/// folder without links. What does not exist leads nowhere.
pub(crate) fn leaves(folder: &Path, home: &Path, reference: &str) -> Option<&'static str> {
    refusal(reference).or_else(|| {
        let real = folder.join(reference).canonicalize().ok()?;
        (!real.starts_with(home)).then_some("a link that leaves the file's own folder")
    })
}

/// Returns why a reference cannot be a file inside the folder, by its text alone.
fn refusal(reference: &str) -> Option<&'static str> {
    let parts = || reference.split(['/', '\\']);
    if reference.trim().is_empty() {
        return Some("which names no file");
    }
    if reference.contains('\0') {
        return Some("which is not a valid path");
    }
    // “C:” is a drive, “file:” and “http:” are schemes; no portable name has a colon.
    if reference.contains(':') {
        return Some("an address or a drive; only files in the same folder or below it are read");
    }
    if reference.starts_with(['/', '\\']) {
        return Some("an absolute path; only files in the same folder or below it are read");
    }
    if parts().any(|part| part == "..") {
        return Some("which leads out of the file's own folder");
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{Limits, testing::Folder};

    #[test]
    fn references_stay_in_their_folder() {
        let folder = Folder::new();
        let inside = folder.path("model");
        std::fs::create_dir_all(inside.join("below")).unwrap();
        let path = inside.join("a.gltf");
        for file in ["a.gltf", "b.bin", "below/c.bin", "two words.bin", "x..y.bin"] {
            std::fs::write(inside.join(file), "bytes").unwrap();
        }
        folder.write("outside.bin", "bytes");
        let limits = Limits::default();
        let source = Source::open(&path, &limits).unwrap();
        for name in
            ["b.bin", "./b.bin", "below/c.bin", "below/./c.bin", "two words.bin", "x..y.bin"]
        {
            assert!(source.neighbour("buffer 0", name).is_ok(), "{name}");
        }
        let outside = folder.path("outside.bin");
        for (reference, reason) in [
            ("../outside.bin", "leads out of the file's own folder"),
            ("below/../../outside.bin", "leads out of the file's own folder"),
            ("..", "leads out of the file's own folder"),
            ("..\\outside.bin", "leads out of the file's own folder"),
            ("below\\..\\..\\outside.bin", "leads out of the file's own folder"),
            (outside.to_str().unwrap(), "an absolute path"),
            ("/etc/hostname", "an absolute path"),
            ("\\\\server\\share\\b.bin", "an absolute path"),
            ("\\b.bin", "an absolute path"),
            ("C:\\b.bin", "an address or a drive"),
            ("C:b.bin", "an address or a drive"),
            ("file:///etc/hostname", "an address or a drive"),
            ("file:b.bin", "an address or a drive"),
            ("http://example.org/b.bin", "an address or a drive"),
            ("b.bin:stream", "an address or a drive"),
            ("", "names no file"),
            ("  ", "names no file"),
            ("b\0.bin", "is not a valid path"),
            ("below", "not a regular file"),
            (".", "not a regular file"),
            ("a.gltf", "the file itself"),
            ("below/../a.gltf", "leads out"),
            ("none.bin", "No such file"),
        ] {
            let message = source.neighbour("buffer 0", reference).unwrap_err().to_string();
            assert!(message.contains(reason), "{reference}: {message}");
            assert!(message.contains("a.gltf: buffer 0: refers to"), "{message}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_and_pipes_are_looked_through() {
        use std::os::unix::fs::symlink;
        let folder = Folder::new();
        let inside = folder.path("model");
        std::fs::create_dir(&inside).unwrap();
        let path = inside.join("a.gltf");
        std::fs::write(&path, "{}").unwrap();
        std::fs::write(inside.join("b.bin"), "bytes").unwrap();
        let outside = folder.write("outside.bin", "bytes");
        symlink(&outside, inside.join("out.bin")).unwrap();
        symlink(&folder, inside.join("up")).unwrap();
        symlink("b.bin", inside.join("in.bin")).unwrap();
        symlink("a.gltf", inside.join("self.bin")).unwrap();
        symlink("/dev/zero", inside.join("zero.bin")).unwrap();
        symlink("loop.bin", inside.join("loop.bin")).unwrap();
        let limits = Limits::default();
        let source = Source::open(&path, &limits).unwrap();
        assert!(source.neighbour("buffer 0", "in.bin").is_ok());
        for (reference, reason) in [
            ("out.bin", "a link that leaves the file's own folder"),
            ("up/outside.bin", "a link that leaves the file's own folder"),
            ("zero.bin", "a link that leaves the file's own folder"),
            ("self.bin", "the file itself"),
            ("loop.bin", "symbolic links"),
        ] {
            let message = source.neighbour("buffer 0", reference).unwrap_err().to_string();
            assert!(message.contains(reason), "{reference}: {message}");
        }
        // Files that wait for another process or have no end are not opened.
        let pipe = inside.join("pipe.bin");
        if std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .is_ok_and(|status| status.success())
        {
            let message = source.neighbour("buffer 0", "pipe.bin").unwrap_err().to_string();
            assert!(message.contains("not a regular file"), "{message}");
            assert!(Source::open(&pipe, &limits).is_err());
        }
        assert!(Source::open(Path::new("/dev/zero"), &limits).is_err());
        assert!(Source::open(folder.as_ref(), &limits).is_err());
    }
}

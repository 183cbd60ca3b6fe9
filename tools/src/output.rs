//! Where results go: stdout, and files that appear whole or not at all.

use crate::{
    failure::Failure,
    terminal::{safe_json, safe_lines},
};
use splatkit::{disk, picture::PictureFormat};
use std::{
    io::Write,
    path::{Path, PathBuf},
};

/// The destination of a picture.
#[derive(Debug, Clone)]
pub enum Target {
    /// A PNG on stdout.
    Stdout,
    File(PathBuf, PictureFormat),
}

impl Target {
    /// Returns the target that `-o` names. An existing file is an error unless `overwrite` is set.
    pub fn new(path: &Path, overwrite: bool) -> Result<Self, Failure> {
        if path.as_os_str() == "-" {
            return Ok(Self::Stdout);
        }
        let format = PictureFormat::of(path)?;
        check(path, overwrite)?;
        Ok(Self::File(path.to_owned(), format))
    }

    /// Returns the format of the picture.
    pub fn format(&self) -> PictureFormat {
        match self {
            Self::Stdout => PictureFormat::Png,
            Self::File(_, format) => *format,
        }
    }

    pub fn name(&self) -> String {
        match self {
            Self::Stdout => "-".into(),
            Self::File(path, _) => path.display().to_string(),
        }
    }

    /// Returns the file, or `None` for stdout.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Stdout => None,
            Self::File(path, _) => Some(path),
        }
    }

    pub fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        match self {
            Self::Stdout => stdout(bytes),
            Self::File(path, _) => Ok(disk::write(path, bytes)?),
        }
    }
}

/// Refuses, before the work is done, an existing file without `overwrite` and a folder that does
/// not exist. Without `overwrite`, a file that appears while the work is done is not replaced
/// either.
pub fn check(path: &Path, overwrite: bool) -> Result<(), Failure> {
    let refuse = |message: &str, hint| {
        Err(Failure::Output { file: path.to_owned(), message: message.into(), hint: Some(hint) })
    };
    if path.is_dir() {
        return refuse("is a folder", "give the name of a file");
    }
    if path.metadata().is_ok_and(|metadata| !metadata.is_file()) {
        return refuse("is not a regular file", "give the name of a file");
    }
    if !overwrite && path.symlink_metadata().is_ok() {
        return refuse("exists already", "give --overwrite, or another name");
    }
    if !folder(path).is_dir() {
        return refuse("cannot be written: its folder does not exist", "make the folder first");
    }
    disk::may_replace(path, overwrite);
    Ok(())
}

/// Checks, before the work is done, that a file can be written and is not one of the inputs.
pub fn try_writing(path: &Path, inputs: &[PathBuf]) -> Result<(), Failure> {
    check_unread(path, inputs, "is an input too")?;
    drop(disk::AtomicFile::create(path)?);
    Ok(())
}

/// Refuses a file that inputs and flags refer to. Loading the inputs lists these files in `read`.
pub fn check_unneeded(path: &Path, read: &[PathBuf]) -> Result<(), Failure> {
    check_unread(path, read, "is read too: an input or a flag refers to it")
}

/// Refuses a file that was read, with this message.
fn check_unread(path: &Path, read: &[PathBuf], message: &str) -> Result<(), Failure> {
    let Ok(real) = path.canonicalize() else { return Ok(()) };
    if read.iter().any(|file| file.canonicalize().is_ok_and(|file| file == real)) {
        return Err(Failure::Output {
            file: path.to_owned(),
            message: message.into(),
            hint: Some("give another name"),
        });
    }
    Ok(())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Writes to stdout. It is no error if the reader has closed it.
pub fn stdout(bytes: &[u8]) -> Result<(), Failure> {
    offer(bytes).map(drop)
}

/// Writes to stdout. Returns whether somebody still reads it.
pub fn offer(bytes: &[u8]) -> Result<bool, Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(Failure::output(Path::new("stdout"), error)),
    }
}

/// Writes one or more lines to stdout.
pub fn line(text: impl std::fmt::Display) -> Result<(), Failure> {
    stdout(format!("{}\n", safe_lines(&text.to_string())).as_bytes())
}

/// Writes JSON to stdout, on one line.
pub fn json(value: &serde_json::Value) -> Result<(), Failure> {
    stdout(format!("{}\n", safe_json(value)).as_bytes())
}

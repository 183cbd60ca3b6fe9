//! Where pages wait until the directory before them is known, and how a file appears whole or not at all.

use crate::{Error, Result};
use std::{
    fs::File,
    io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// A hidden file beside the one that is wanted, removed when dropped unless it took that one's place.
pub struct Part {
    path: PathBuf,
    wanted: PathBuf,
    file: Option<File>,
}

impl Part {
    pub fn create(wanted: &Path, extension: &str) -> Result<Self> {
        let mut name = std::ffi::OsString::from(".");
        name.push(wanted.file_name().unwrap_or_default());
        name.push(format!(".{}.{extension}", std::process::id()));
        let path = folder(wanted).join(name);
        let options = File::options().read(true).write(true).create(true).truncate(true).open(&path);
        let file = options.map_err(|e| Error::file(wanted, "create", e))?;
        Ok(Self { path, wanted: wanted.to_owned(), file: Some(file) })
    }

    /// Takes the file's name away where a system lets files live without: then nothing is left of it whatever happens.
    pub fn hide(self) -> Self {
        #[cfg(unix)]
        std::fs::remove_file(&self.path).ok();
        self
    }

    pub fn file(&mut self) -> &mut File {
        self.file.as_mut().expect("is there until the part is dropped")
    }

    /// Gives the file its name, once all of it is on the disk.
    pub fn rename(mut self) -> Result<()> {
        let fail = |e| Error::file(&self.wanted, "write", e);
        let file = self.file.take().expect("is there until the part is dropped");
        file.sync_all().map_err(fail)?;
        drop(file);
        std::fs::rename(&self.path, &self.wanted).map_err(fail)?;
        // The name, too, must survive a crash; where a folder cannot be synced, the system sees to it.
        if let Ok(folder) = File::open(folder(&self.wanted)) {
            folder.sync_all().ok();
        }
        Ok(())
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // Renamed parts have nothing left to close, nor any file of that name.
        drop(self.file.take());
        std::fs::remove_file(&self.path).ok();
    }
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Pages in the order in which they came.
pub enum Spill {
    Memory(Vec<u8>),
    Disk { part: BufWriter<PartFile>, length: u64 },
}

/// A part as something to write to.
pub struct PartFile(Part);

impl Write for PartFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.file().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.file().flush()
    }
}

impl Spill {
    /// Beside a file that is to be.
    pub fn beside(wanted: &Path) -> Result<Self> {
        let part = BufWriter::with_capacity(1 << 20, PartFile(Part::create(wanted, "pages")?.hide()));
        Ok(Self::Disk { part, length: 0 })
    }

    /// Appends bytes and tells where they stand.
    pub fn push(&mut self, bytes: &[u8]) -> std::io::Result<u64> {
        match self {
            Self::Memory(all) => {
                all.extend_from_slice(bytes);
                Ok((all.len() - bytes.len()) as u64)
            }
            Self::Disk { part, length } => {
                part.write_all(bytes)?;
                *length += bytes.len() as u64;
                Ok(*length - bytes.len() as u64)
            }
        }
    }

    /// Hands out pieces, given by place and length, in the order of `pieces`.
    pub fn replay(
        self,
        pieces: impl Iterator<Item = (u64, u32)>,
        mut each: impl FnMut(&[u8]) -> std::io::Result<()>,
    ) -> std::io::Result<()> {
        match self {
            Self::Memory(all) => {
                for (offset, length) in pieces {
                    each(&all[offset as usize..offset as usize + length as usize])?;
                }
            }
            Self::Disk { part, .. } => {
                let mut part = part.into_inner().map_err(std::io::IntoInnerError::into_error)?;
                let mut file = BufReader::with_capacity(1 << 16, part.0.file());
                let mut at = 0;
                let mut bytes = Vec::new();
                file.seek(SeekFrom::Start(0))?;
                for (offset, length) in pieces {
                    // Most pages follow one another, and a relative step keeps what was read ahead.
                    file.seek_relative(offset as i64 - at as i64)?;
                    bytes.resize(length as usize, 0);
                    file.read_exact(&mut bytes)?;
                    at = offset + u64::from(length);
                    each(&bytes)?;
                }
            }
        }
        Ok(())
    }
}

/// Where a finished file goes.
pub enum Target {
    Memory(Vec<u8>),
    Disk(BufWriter<PartFile>),
}

impl Target {
    pub fn at(path: &Path) -> Result<Self> {
        Ok(Self::Disk(BufWriter::with_capacity(1 << 20, PartFile(Part::create(path, "part")?))))
    }

    /// Ends the file: the bytes where it was written to memory, none where it has its name now.
    pub fn end(self) -> Result<Vec<u8>> {
        match self {
            Self::Memory(bytes) => Ok(bytes),
            Self::Disk(out) => {
                let part = out.into_inner().map_err(|e| {
                    let (error, out) = e.into_parts();
                    Error::file(&out.get_ref().0.wanted, "write", error)
                })?;
                part.0.rename()?;
                Ok(Vec::new())
            }
        }
    }
}

impl Write for Target {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        match self {
            Self::Memory(all) => all.write(bytes),
            Self::Disk(out) => out.write(bytes),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match self {
            Self::Memory(_) => Ok(()),
            Self::Disk(out) => out.flush(),
        }
    }
}

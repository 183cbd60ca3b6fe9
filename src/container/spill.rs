//! Temporary storage of pages until their places are known, and the destination of a
//! finished file.

use crate::{
    Error, Result,
    disk::{AtomicFile, BUFFER, Scratch},
};
use std::{
    fs::File,
    io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// Files that reading keeps open at once; systems allow about a thousand.
const MOST_OPEN: usize = 64;

/// Pages in the order in which they were added.
pub enum Spill {
    Memory(Vec<u8>),
    Disk {
        /// Files whose bytes precede those that are added.
        before: Vec<Section>,
        file: BufWriter<Scratch>,
        length: u64,
    },
}

/// A finished file, as a section of the pages.
pub struct Section {
    path: PathBuf,
    /// Position of its first byte among the pages.
    start: u64,
}

impl Spill {
    /// Creates the storage beside the file that is to be written.
    pub fn beside(wanted: &Path) -> Result<Self> {
        Ok(Self::over(Scratch::beside(wanted)?, 0))
    }

    /// Takes a file that holds this many bytes already.
    pub fn over(file: Scratch, length: u64) -> Self {
        let file = BufWriter::with_capacity(BUFFER, file);
        Self::Disk { before: Vec::new(), file, length }
    }

    /// Creates the storage beside the file that is to be written, after the bytes of finished
    /// files, given by path and length. Also returns where each of these begins.
    pub fn after(files: &[(PathBuf, u64)], wanted: &Path) -> Result<(Self, Vec<u64>)> {
        let mut length = 0;
        let section = |(path, bytes): &(PathBuf, u64)| {
            length += bytes;
            Section { path: path.clone(), start: length - bytes }
        };
        let before: Vec<Section> = files.iter().map(section).collect();
        let starts = before.iter().map(|section| section.start).collect();
        let file = BufWriter::with_capacity(BUFFER, Scratch::beside(wanted)?);
        Ok((Self::Disk { before, file, length }, starts))
    }

    /// Appends bytes, and returns their position.
    pub fn push(&mut self, bytes: &[u8]) -> io::Result<u64> {
        match self {
            Self::Memory(all) => {
                all.extend_from_slice(bytes);
                Ok((all.len() - bytes.len()) as u64)
            }
            Self::Disk { file, length, .. } => {
                file.write_all(bytes)?;
                *length += bytes.len() as u64;
                Ok(*length - bytes.len() as u64)
            }
        }
    }

    /// Ends the storage, to read from it.
    pub fn end(self) -> io::Result<Spilled> {
        Ok(match self {
            Self::Memory(all) => Spilled::Memory(all),
            Self::Disk { before, file, length } => {
                let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
                let start = length - file.seek(SeekFrom::End(0))?;
                let others = Readers { sections: before, open: Vec::new() };
                Spilled::Disk { others, file: Reader::new(file)?, start }
            }
        })
    }
}

/// Finished temporary storage. It is read fastest at increasing positions.
pub enum Spilled {
    Memory(Vec<u8>),
    Disk {
        others: Readers,
        file: Reader<Scratch>,
        /// Position of the first byte in `file`.
        start: u64,
    },
}

impl Spilled {
    /// Reads the bytes at a position.
    pub fn read(&mut self, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        match self {
            Self::Memory(all) => {
                let start = offset as usize;
                let source = all.get(start..start + bytes.len());
                bytes.copy_from_slice(source.ok_or(io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
            Self::Disk { others, file, start } => match offset.checked_sub(*start) {
                Some(offset) => file.read(offset, bytes),
                None => others.read(offset, bytes),
            },
        }
    }
}

/// A file that is read at increasing positions, mostly.
pub struct Reader<R> {
    file: BufReader<R>,
    at: u64,
}

impl<R: Read + Seek> Reader<R> {
    fn new(mut file: R) -> io::Result<Self> {
        file.seek(SeekFrom::Start(0))?;
        Ok(Self { file: BufReader::with_capacity(1 << 16, file), at: 0 })
    }

    fn read(&mut self, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        // Most pages are adjacent, and a relative seek keeps the read-ahead buffer.
        self.file.seek_relative(offset as i64 - self.at as i64)?;
        self.file.read_exact(bytes)?;
        self.at = offset + bytes.len() as u64;
        Ok(())
    }
}

/// The files of sections. Those used last are open.
pub struct Readers {
    sections: Vec<Section>,
    /// With the number of the section, the one used last at the end.
    open: Vec<(usize, Reader<File>)>,
}

impl Readers {
    fn read(&mut self, offset: u64, bytes: &mut [u8]) -> io::Result<()> {
        let section = self.sections.partition_point(|section| section.start <= offset) - 1;
        let Section { path, start } = &self.sections[section];
        let mut reader = match self.open.iter().position(|(open, _)| *open == section) {
            Some(at) => self.open.remove(at).1,
            None => Reader::new(File::open(path)?)?,
        };
        if self.open.len() == MOST_OPEN {
            self.open.remove(0);
        }
        let read = reader.read(offset - start, bytes);
        self.open.push((section, reader));
        read
    }
}

/// The destination of a finished file.
pub enum Target {
    Memory(Vec<u8>),
    Disk(BufWriter<AtomicFile>),
}

impl Target {
    pub fn at(path: &Path) -> Result<Self> {
        Ok(Self::Disk(BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?)))
    }

    /// Finishes the file. Returns its bytes if it was written to memory; otherwise gives it its
    /// name and returns no bytes.
    pub fn end(self, wanted: &Path) -> Result<Vec<u8>> {
        match self {
            Self::Memory(bytes) => Ok(bytes),
            Self::Disk(out) => {
                out.into_inner().map_err(|e| Error::output(wanted, e.into_error()))?.commit()?;
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

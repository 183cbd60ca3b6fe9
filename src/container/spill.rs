//! Temporary storage of pages until the directory before them is known, and the destination of a
//! finished file.

use crate::{
    Error, Result,
    disk::{AtomicFile, BUFFER, Scratch},
};
use std::{
    io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write},
    path::Path,
};

/// Pages in the order in which they were added.
pub enum Spill {
    Memory(Vec<u8>),
    Disk { file: BufWriter<Scratch>, length: u64 },
}

impl Spill {
    /// Creates the storage beside the file that is to be written.
    pub fn beside(wanted: &Path) -> Result<Self> {
        Ok(Self::Disk {
            file: BufWriter::with_capacity(BUFFER, Scratch::beside(wanted)?),
            length: 0,
        })
    }

    /// Appends bytes, and returns their position.
    pub fn push(&mut self, bytes: &[u8]) -> std::io::Result<u64> {
        match self {
            Self::Memory(all) => {
                all.extend_from_slice(bytes);
                Ok((all.len() - bytes.len()) as u64)
            }
            Self::Disk { file, length } => {
                file.write_all(bytes)?;
                *length += bytes.len() as u64;
                Ok(*length - bytes.len() as u64)
            }
        }
    }

    /// Calls `each` with pieces, given by position and length, in the order of `pieces`.
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
            Self::Disk { file, .. } => {
                let file = file.into_inner().map_err(std::io::IntoInnerError::into_error)?;
                let mut file = BufReader::with_capacity(1 << 16, file);
                let mut at = 0;
                let mut bytes = Vec::new();
                file.seek(SeekFrom::Start(0))?;
                for (offset, length) in pieces {
                    // Most pages are adjacent, and a relative seek keeps the read-ahead buffer.
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

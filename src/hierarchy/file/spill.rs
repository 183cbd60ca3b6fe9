//! Where pages wait until the directory before them is known, and where a finished file goes.

use crate::{
    Error, Result,
    disk::{AtomicFile, BUFFER, Scratch},
};
use std::{
    io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write},
    path::Path,
};

/// Pages in the order in which they came.
pub enum Spill {
    Memory(Vec<u8>),
    Disk { file: BufWriter<Scratch>, length: u64 },
}

impl Spill {
    /// Beside a file that is to be.
    pub fn beside(wanted: &Path) -> Result<Self> {
        Ok(Self::Disk {
            file: BufWriter::with_capacity(BUFFER, Scratch::beside(wanted)?),
            length: 0,
        })
    }

    /// Appends bytes and tells where they stand.
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
            Self::Disk { file, .. } => {
                let file = file.into_inner().map_err(std::io::IntoInnerError::into_error)?;
                let mut file = BufReader::with_capacity(1 << 16, file);
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
    Disk(BufWriter<AtomicFile>),
}

impl Target {
    pub fn at(path: &Path) -> Result<Self> {
        Ok(Self::Disk(BufWriter::with_capacity(BUFFER, AtomicFile::create(path)?)))
    }

    /// Ends the file that is wanted: the bytes where it was written to memory, none where it has its name now.
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

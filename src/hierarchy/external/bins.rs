//! Records sorted into bins as they arrive, in a file without a name.

use crate::{Error, Result, disk::Scratch};
use bytemuck::Pod;
use std::{
    io::{Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

/// The maximum size, in bytes, of the buffers of all bins together.
const MOST_WAITING: u64 = 64 << 20;

/// Bins of records. Each keeps its records in the order of arrival.
pub struct Bins<T> {
    file: Scratch,
    /// The file beside which the scratch file is, for errors.
    wanted: PathBuf,
    /// Length of the scratch file.
    end: u64,
    waiting: Vec<Vec<T>>,
    /// The maximum number of buffered records in a bin.
    most: usize,
    /// For each bin, the position of each batch in the file and its number of records.
    runs: Vec<Vec<(u64, usize)>>,
    counts: Vec<usize>,
}

impl<T: Pod> Bins<T> {
    /// Creates empty bins in a file beside `wanted`. Their buffers use up to an eighth of `memory`.
    ///
    /// # Errors
    /// [`Error::Output`] if the file cannot be created.
    pub fn beside(wanted: &Path, bins: usize, memory: u64) -> Result<Self> {
        let waiting = (memory / 8).min(MOST_WAITING) as usize;
        let most = (waiting / bins.max(1) / size_of::<T>()).clamp(64, 1 << 16);
        let file = Scratch::beside(wanted)?;
        let (waiting, runs) = (vec![Vec::new(); bins], vec![Vec::new(); bins]);
        Ok(Self {
            file,
            wanted: wanted.to_owned(),
            end: 0,
            waiting,
            most,
            runs,
            counts: vec![0; bins],
        })
    }

    pub fn push(&mut self, bin: u32, record: T) -> Result<()> {
        self.waiting[bin as usize].push(record);
        self.counts[bin as usize] += 1;
        if self.waiting[bin as usize].len() >= self.most {
            self.flush(bin as usize)
        } else {
            Ok(())
        }
    }

    fn flush(&mut self, bin: usize) -> Result<()> {
        let waiting = &mut self.waiting[bin];
        if waiting.is_empty() {
            return Ok(());
        }
        let bytes: &[u8] = bytemuck::cast_slice(waiting);
        let file = &mut self.file;
        let written = file.seek(SeekFrom::Start(self.end)).and_then(|_| file.write_all(bytes));
        written.map_err(|e| Error::output(&self.wanted, e))?;
        self.runs[bin].push((self.end, waiting.len()));
        self.end += bytes.len() as u64;
        waiting.clear();
        Ok(())
    }

    /// Writes all buffered records, and frees the buffers.
    pub fn settle(&mut self) -> Result<()> {
        for bin in 0..self.waiting.len() {
            self.flush(bin)?;
            self.waiting[bin] = Vec::new();
        }
        Ok(())
    }

    /// Returns the number of records in a bin.
    pub fn count(&self, bin: u32) -> usize {
        self.counts[bin as usize]
    }

    /// Returns the records of a bin.
    pub fn read(&mut self, bin: u32) -> Result<Vec<T>> {
        let mut records = vec![T::zeroed(); self.count(bin)];
        let (file, mut next) = (&mut self.file, 0);
        for &(at, count) in &self.runs[bin as usize] {
            let run = bytemuck::cast_slice_mut(&mut records[next..next + count]);
            let read = file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(run));
            read.map_err(|e| Error::file(&self.wanted, "read the temporary file beside it", e))?;
            next += count;
        }
        records[next..].copy_from_slice(&self.waiting[bin as usize]);
        Ok(records)
    }
}

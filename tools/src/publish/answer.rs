//! The body of an answer: bytes in memory, or a part of a file, which is read while it is sent.

use hyper::body::{Body, Bytes, Frame, SizeHint};
use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    ops::Range,
    pin::Pin,
    task::{Context, Poll},
};

/// Bytes that are read at a time.
const PORTION: u64 = 256 << 10;

/// The body of an answer.
#[derive(Default)]
pub struct Answer {
    file: Option<File>,
    held: Bytes,
    /// The bytes that are left to send.
    rest: u64,
}

impl Answer {
    /// Answers with bytes in memory.
    pub fn held(bytes: Bytes) -> Self {
        Self { file: None, rest: bytes.len() as u64, held: bytes }
    }

    /// Answers with all bytes of a file, which has this many.
    pub fn of_file(file: File, bytes: u64) -> Self {
        Self { file: Some(file), held: Bytes::new(), rest: bytes }
    }

    /// Leaves only a range, which must lie within.
    ///
    /// # Errors
    /// For a file in which no place can be sought.
    pub fn cut(&mut self, range: Range<u64>) -> io::Result<()> {
        match &mut self.file {
            Some(file) => file.seek(SeekFrom::Start(range.start)).map(drop)?,
            None => self.held = self.held.slice(range.start as usize..range.end as usize),
        }
        self.rest = range.end - range.start;
        Ok(())
    }

    /// Returns the next portion.
    fn next(&mut self) -> Option<io::Result<Bytes>> {
        if self.rest == 0 {
            return None;
        }
        let Some(file) = &mut self.file else {
            self.rest = 0;
            return Some(Ok(std::mem::take(&mut self.held)));
        };
        let mut portion = vec![0; PORTION.min(self.rest) as usize];
        // A file that became shorter ends the connection: the client sees that bytes are missing.
        let read = file.read_exact(&mut portion);
        self.rest = if read.is_ok() { self.rest - portion.len() as u64 } else { 0 };
        Some(read.map(|()| portion.into()))
    }

    /// Returns all bytes.
    #[cfg(test)]
    pub fn taken(mut self) -> Vec<u8> {
        let portions = std::iter::from_fn(|| self.next());
        portions.flat_map(|portion| portion.expect("a portion")).collect()
    }
}

impl Body for Answer {
    type Data = Bytes;
    type Error = io::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        _: &mut Context<'_>,
    ) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        Poll::Ready(self.next().map(|portion| portion.map(Frame::data)))
    }

    fn is_end_stream(&self) -> bool {
        self.rest == 0
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.rest)
    }
}

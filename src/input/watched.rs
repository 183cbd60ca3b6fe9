//! Bytes that end when the time for reading is over.

use super::Source;
use std::io::{self, Read, Seek, SeekFrom};

/// A stream for decoders that ask for their bytes piece by piece. Each piece is a chance to stop:
/// the error is then that of [`Source::check_time`].
pub(crate) struct Watched<'a, R> {
    source: &'a Source<'a>,
    inner: R,
}

impl<'a, R> Watched<'a, R> {
    pub fn new(source: &'a Source<'a>, inner: R) -> Self {
        Self { source, inner }
    }
}

impl<R: Read> Read for Watched<'_, R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.source.time_left().is_zero() {
            return Err(io::Error::other("the time for reading is over"));
        }
        self.inner.read(out)
    }
}

impl<R: Seek> Seek for Watched<'_, R> {
    fn seek(&mut self, place: SeekFrom) -> io::Result<u64> {
        self.inner.seek(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;
    use std::path::Path;

    #[test]
    fn streams_end_with_the_time() {
        for (seconds, count) in [(600, Some(3)), (0, None)] {
            let limits = Limits { seconds, ..Limits::default() };
            let source = Source::from_bytes(Path::new("a"), &[1, 2, 3], &limits).unwrap();
            let mut out = Vec::new();
            let read = Watched::new(&source, source.bytes()).read_to_end(&mut out);
            assert_eq!(read.ok(), count);
        }
    }
}

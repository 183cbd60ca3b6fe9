//! The part of a file that HDF5 takes, as its superblock states it. A file that ends before is cut
//! off, whatever can still be read of it.

use crate::{Result, input::Source};

const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

/// What the superblock says.
#[derive(Debug, PartialEq)]
pub struct Span {
    /// The place of the first byte behind all data; `None` if the superblock is not known.
    end: Option<u64>,
    /// The size of the file.
    there: u64,
}

impl Span {
    pub fn of(bytes: &[u8]) -> Self {
        Self { end: start(bytes).and_then(|block| end(&bytes[block..])), there: bytes.len() as u64 }
    }

    /// Refuses a file that ends before its data.
    pub fn check(&self, source: &Source) -> Result<()> {
        match self.end {
            Some(end) if end > self.there => {
                let message = format!(
                    "is cut off: its header says that it has {end} bytes, but it has {}",
                    self.there
                );
                Err(source.error("file", message).hint("copy or download it again"))
            }
            _ => Ok(()),
        }
    }
}

/// Returns where the superblock begins: at 0, or at a power of two from 512, behind other content.
fn start(bytes: &[u8]) -> Option<usize> {
    let places = std::iter::successors(Some(512usize), |place| place.checked_mul(2));
    let places = std::iter::once(0).chain(places.take_while(|&place| place < bytes.len()));
    places.into_iter().find(|&place| bytes[place..].starts_with(MAGIC))
}

/// Returns the end of the file that a superblock states. It is counted from the begin of the file.
fn end(block: &[u8]) -> Option<u64> {
    let byte = |at: usize| block.get(at).copied().map(usize::from);
    // How wide places in the file are, and where the first is. The third is the end.
    let (width, first) = match byte(8)? {
        0 => (byte(13)?, 24),
        1 => (byte(13)?, 28),
        2 | 3 => (byte(9)?, 12),
        _ => return None,
    };
    let number = block.get(first + 2 * width..)?.get(..width)?;
    let mut wide = [0; 8];
    wide.get_mut(..width)?.copy_from_slice(number);
    // All bits mean that the end is not known.
    Some(u64::from_le_bytes(wide)).filter(|_| number.iter().any(|&byte| byte != u8::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A superblock of a version, for a file of 1000 bytes.
    fn block(version: u8, width: u8) -> Vec<u8> {
        let mut block = MAGIC.to_vec();
        block.push(version);
        let first = match version {
            0 => 24,
            1 => 28,
            _ => 12,
        };
        block.resize(first, 0);
        block[if version < 2 { 13 } else { 9 }] = width;
        for place in [0u64, u64::MAX, 1000] {
            block.extend(&place.to_le_bytes()[..width.into()]);
        }
        block
    }

    #[test]
    fn superblocks_state_the_end() {
        for version in 0..4 {
            for width in [2, 4, 8] {
                for before in [0, 512, 4096] {
                    let mut file = vec![0; before];
                    file.extend(block(version, width));
                    let there = file.len() as u64;
                    assert_eq!(Span::of(&file), Span { end: Some(1000), there }, "{version}");
                }
            }
        }
        assert_eq!(Span::of(&block(9, 8)).end, None);
        assert_eq!(Span::of(&[0; 700]).end, None);
        assert_eq!(Span::of(&block(2, 8)[..30]).end, None);
        let mut open = block(0, 4);
        open[32..36].fill(u8::MAX);
        assert_eq!(Span::of(&open).end, None);
    }
}

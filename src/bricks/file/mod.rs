//! The file of a bricked volume, `.splv`: bricks, coarse levels first, and a directory in pages
//! with the size and the range of values of each brick. docs/splv.md describes the file byte by
//! byte.

#![deny(clippy::disallowed_methods)]

mod brick;
mod check;
mod directory;
mod header;
mod write;

pub use check::check;
pub use write::{WriteOptions, convert, memory_of, write};

pub(super) use brick::decode;
pub(super) use directory::{Entry, Listing, Numbers, too_short};
pub(super) use header::{Refusal, Stored};
#[cfg(test)]
pub(super) use write::{to_bytes, with_changes};

/// How a file begins: a name, and line ends that a transfer as text would change.
const MAGIC: [u8; 8] = *b"SPLV\r\n\x1a\n";

/// The version of the files.
pub(super) const VERSION: u32 = 2;

/// Bytes of the BLAKE3 hash at the end of a file.
pub(super) const HASH: usize = 32;

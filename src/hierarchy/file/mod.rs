//! The file of a hierarchy, `.splk`: pages of nodes, coarse ones first, after a directory with
//! their positions. docs/splk.md describes it byte by byte.
//!
//! [`write`](write()) and [`Writer`] write it, [`Hierarchy`] reads it page by page or as a whole,
//! and [`check`](check()) looks for damage.

#![deny(clippy::disallowed_methods)]

mod bounds;
mod check;
mod column;
mod cones;
mod direction;
mod directory;
mod entropy;
mod header;
mod lossless;
mod lossy;

mod page;
mod pages;
mod quantise;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use check::check;
pub use directory::PageEntry;
pub use header::Header;
pub use read::{CutSphere, Hierarchy, NO_PAGE, Page};
pub use write::{Top, Whole, WriteOptions, Writer, to_bytes, write};

/// The maximum number of nodes in a page.
pub const PAGE_NODES: usize = 4096;

/// The first bytes of a file: a name, and line ends that a transfer as text would change.
const MAGIC: [u8; 8] = *b"SPLK\r\n\x1a\n";

/// The version that is written.
const VERSION: u32 = 1;

/// The version of files of trained Gaussians, whose pages have colours of their own.
const TRAINED_VERSION: u32 = 2;

/// Bytes of the BLAKE3 hash at the end of a file.
const HASH: usize = 32;

pub(in crate::hierarchy) use cones::joint_angle;
#[cfg(test)]
pub(in crate::hierarchy) use page::enclose;
pub(in crate::hierarchy) use pages::{in_order, reach};

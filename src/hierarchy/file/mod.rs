//! The file of a hierarchy, `.splk`: pages of nodes, coarse ones first, and a directory with their
//! positions, which is divided into pages too. docs/splk.md describes it byte by byte.
//!
//! [`write`](write()) and [`Writer`] write it, [`Hierarchy`] reads it page by page or as a whole,
//! and [`check`](check()) looks for damage.

#![deny(clippy::disallowed_methods)]

mod bounds;
mod check;
mod column;
mod cones;
mod direction;
mod drafts;
mod entropy;
mod entry;
mod header;
mod lossless;
mod lossy;

mod page;
mod pages;
mod parts;
mod quantise;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use check::check;
#[doc(hidden)]
pub use entry::PageEntry;
pub use header::Header;
pub(crate) use parts::there;
pub use read::Hierarchy;
#[doc(hidden)]
pub use read::{CutSphere, NO_PAGE, Page};
pub use write::{Top, Whole, WriteOptions, Writer, to_bytes, write};

/// The maximum number of nodes in a page.
pub const PAGE_NODES: usize = 4096;

/// The maximum number of nodes in the first page of a block that is written. Each page after it may
/// have [`GROWTH`] times as many as the page before, up to [`MOST_NODES`]: a view that needs some
/// nodes of a block then needs few others with them. Shorter pages need less memory still, but the
/// tables and the record of each take about 250 bytes of the file.
const FIRST_NODES: usize = 64;
const MOST_NODES: usize = 1024;
const GROWTH: usize = 4;

/// The first bytes of a file: a name, and line ends that a transfer as text would change.
const MAGIC: [u8; 8] = *b"SPLK\r\n\x1a\n";

/// The version of the files.
const VERSION: u32 = 3;

/// Bytes of the BLAKE3 hash at the end of a file.
const HASH: usize = 32;

pub(in crate::hierarchy) use cones::joint_angle;
#[cfg(test)]
pub(in crate::hierarchy) use page::enclose;
pub(in crate::hierarchy) use pages::{Around, Run, in_order, reach};
pub(in crate::hierarchy) use write::{Contents, Placed, encode};

//! Code that the files of hierarchies (`.splk`) and of volumes in bricks (`.splv`) share. It has
//! numbers as bytes, the directory in pages, pages that wait until their places are known, and the
//! findings of a check.

mod bytes;
pub(crate) mod directory;
mod findings;
pub(crate) mod pack;
mod spill;

pub(crate) use bytes::{Cursor, Put};
pub(crate) use findings::Findings;
pub use findings::{Finding, Report, Severity};
pub(crate) use spill::{Spill, Spilled, Target};

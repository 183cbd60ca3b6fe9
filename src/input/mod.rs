//! What guards every input: how a file is opened, mapped and bounded.
//!
//! A [`Source`] is an open file, the files of a folder, or bytes in memory. It checks each request
//! against the [`Limits`] and notices when the file changes while it is read. Readers of single
//! formats are in [`formats`](crate::formats).

#![deny(clippy::disallowed_methods)]

mod budget;
pub(crate) mod copy;
mod folder;
pub(crate) mod growing;
pub(crate) mod isolate;
mod limits;
mod mapping;
pub(crate) mod neighbour;
pub(crate) mod positions;
mod source;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod text;

pub use limits::Limits;
pub(crate) use mapping::Mapping;
pub use source::Source;
pub(crate) use source::intact;

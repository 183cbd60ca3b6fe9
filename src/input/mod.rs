//! What guards every input: how a file is opened, mapped and bounded.
//!
//! A [`Source`] is an open file, the files of a folder, or bytes in memory. It checks each request
//! against the [`Limits`] and notices when the file changes while it is read. Readers of single
//! formats are in [`formats`](crate::formats).
//!
//! A path may also be the [`address`] of a remote object (`https`, `http`, `s3`, `gs`, `az`; with
//! the feature `remote`). Hierarchies and volumes in bricks are fetched in ranges, as a picture
//! needs them. Objects of other formats are fetched as a whole into the cache ([`remote`]).
//!
//! Programs that cannot wait for bytes, such as browsers, hand them in as [`Parts`].

#![deny(clippy::disallowed_methods)]

mod address;
mod budget;
mod bytes;
pub(crate) mod copy;
mod fingerprint;
mod folder;
pub(crate) mod growing;
pub(crate) mod isolate;
mod limits;
mod mapping;
pub(crate) mod neighbour;
mod parts;
pub(crate) mod positions;
#[cfg(feature = "remote")]
pub mod remote;
#[cfg(not(feature = "remote"))]
#[path = "remote/absent.rs"]
mod remote;
mod source;
#[cfg(test)]
pub(crate) mod testing;
pub(crate) mod text;
#[cfg(feature = "tiff")]
pub(crate) mod watched;

#[cfg(feature = "zarr")]
pub(crate) use address::below;
pub(crate) use address::is_whole;
pub use address::{address, is_remote};
pub(crate) use bytes::Bytes;
pub use bytes::size;
pub(crate) use fingerprint::fingerprint;
pub(crate) use folder::is_store;
pub use limits::Limits;
pub(crate) use mapping::Mapping;
pub use parts::Parts;
pub use source::Source;
#[cfg(feature = "hdf5")]
pub(crate) use source::Watch;
pub(crate) use source::intact;

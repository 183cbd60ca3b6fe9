//! How results are written to disk. Files appear whole or not at all ([`AtomicFile`]). Scratch
//! files for data that does not fit in memory leave nothing behind (`Scratch`).
//!
//! Whatever ends a process, a file under the requested name is the old one or the new one. If the
//! process could clean up (after an error, a panic, or a signal that it catches and answers with
//! [`abandon`]), nothing else remains. If it could not (a kill, a power cut), a file may remain
//! whose name begins with a dot and ends in `.splatkit-part`. The next process to write the same
//! file removes it.
//!
//! A result replaces a file of its name, unless [`may_replace`] forbids it.

mod atomic;
mod live;
mod new;
mod scratch;
mod step;
#[cfg(test)]
mod tests;

pub use atomic::{AtomicFile, write, write_with};
pub use live::{Abandoned, TemporaryFolder, abandon};
#[cfg(feature = "sog")]
pub(crate) use new::is_replaceable;
pub use new::{may_replace, rename};
pub(crate) use scratch::Scratch;
#[cfg(test)]
pub(crate) use step::faults;

use std::path::Path;

/// Size of write buffers in bytes. Tests need many writes.
pub(crate) const BUFFER: usize = if cfg!(test) { 1 << 8 } else { 1 << 20 };

/// Returns the folder that contains a file.
pub(crate) fn folder(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

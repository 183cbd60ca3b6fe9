//! How results get to the disk: files that appear whole or not at all ([`AtomicFile`]), and room for what does not fit in
//! memory, of which nothing stays (`Scratch`).
//!
//! Whatever ends a process, a file under the name that was asked for is the old one or the new one. Where the process could
//! clean up (an error, a panic, a signal that it catches and answers by [`abandon`]), nothing else is left. Where it could
//! not (a kill, a power cut), a file may stay whose name begins with a dot and ends in `.splatkit-part`; the next one to
//! write the same file removes it.

mod atomic;
mod live;
mod scratch;
mod step;
#[cfg(test)]
mod tests;

pub use atomic::{AtomicFile, write, write_with};
pub use live::{Abandoned, abandon};
pub(crate) use scratch::Scratch;
#[cfg(test)]
pub(crate) use step::faults;

use std::path::Path;

/// Bytes that wait in memory before they are written. Tests want many writes.
pub(crate) const BUFFER: usize = if cfg!(test) { 1 << 8 } else { 1 << 20 };

/// The folder that a file is in.
fn folder(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

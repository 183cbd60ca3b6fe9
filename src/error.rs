//! The one error type of the library. Every message names the file and the place in it, what was
//! found and what was expected; the hint says what to do.

use std::path::{Path, PathBuf};

pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Matched by its variants; the words of a message may change.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that does not follow its format.
    #[error("{}: {place}: {message}", file.display())]
    Input { file: PathBuf, place: String, message: String, hint: Option<String> },

    /// A file, or a value stated in it, that exceeds the [`Limits`](crate::input::Limits).
    #[error("{}: {what} is {found}, over the limit of {limit}", file.display())]
    Limit { file: PathBuf, what: String, kind: LimitKind, found: u64, limit: u64 },

    /// The operating system could not open, read or write a file.
    #[error("{}: cannot {action}: {source}", file.display())]
    File { file: PathBuf, action: &'static str, source: std::io::Error },

    /// The operating system could not write a result. A file that was there before is unchanged.
    #[error("{}: cannot be written: {source}", file.display())]
    Output { file: PathBuf, source: std::io::Error },

    /// An argument from which no picture can be made (a size of 0, a kernel of no width, …).
    #[error("{0}")]
    Argument(String),

    /// A transfer function that cannot be used, or that does not fit the values of its item.
    #[error("{0}")]
    Transfer(String),

    /// Work on an input took longer than its [`Deadline`](crate::Deadline) allows.
    #[error("{what} takes longer than the limit of {limit} s")]
    Timeout { what: String, limit: u64 },

    /// The operating system refused memory. It was requested before the work began, so nothing is
    /// half done.
    #[error("{what} needs {bytes} bytes of memory, which the system refused")]
    Memory { what: String, bytes: u64 },

    /// The scene contains nothing visible.
    #[error("nothing to draw: {0}")]
    NothingToDraw(String),

    /// There is no adapter, or none with the requested name.
    #[error("no usable GPU: {0}")]
    NoAdapter(String),

    /// The driver reported an error, ran out of memory or did not answer in time. Unless the error
    /// repeats, the device can still be used.
    #[error("GPU: {0}")]
    Driver(String),

    /// One sheet of a picture has more entries, pairs of a splat and a tile, than a depth pass may
    /// have ([`Budget::entries`](crate::gpu::Budget::entries)).
    #[error(
        "GPU: one sheet of the picture needs more than the budget of {budget} entries; raise the \
         budget"
    )]
    EntriesExhausted { budget: u32 },

    /// The scene needs more memory, in bytes, than it may take on this adapter
    /// ([`Gpu::with_memory`](crate::gpu::Gpu::with_memory)).
    #[error(
        "GPU: the scene needs at least {} MiB of memory on {adapter}, of which {} MiB may be taken",
        needed.div_ceil(1 << 20), limit.div_ceil(1 << 20)
    )]
    MemoryBound { adapter: String, needed: u64, limit: u64 },

    /// The device is lost, with all its resources
    /// ([`Gpu::reopened`](crate::gpu::Gpu::reopened)).
    #[error("GPU: {0}")]
    DeviceLost(String),
}

/// Which of the [`Limits`](crate::input::Limits) was met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    Points,
    Bytes,
    Depth,
    Texels,
    Seconds,
}

impl Error {
    /// Creates an [`Error::Input`] without a hint.
    pub fn input(file: &Path, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Input {
            file: file.to_owned(),
            place: place.into(),
            message: message.into(),
            hint: None,
        }
    }

    /// Creates an [`Error::File`].
    pub fn file(file: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::File { file: file.to_owned(), action, source }
    }

    /// Creates an [`Error::Output`].
    pub fn output(file: &Path, source: std::io::Error) -> Self {
        Self::Output { file: file.to_owned(), source }
    }

    /// Adds the file's name to errors that do not contain one.
    #[must_use]
    pub fn in_file(self, file: &Path) -> Self {
        let named = |what: String| format!("{}: {what}", file.display());
        match self {
            Self::NothingToDraw(what) => Self::NothingToDraw(named(what)),
            Self::Timeout { what, limit } => Self::Timeout { what: named(what), limit },
            Self::Memory { what, bytes } => Self::Memory { what: named(what), bytes },
            other => other,
        }
    }

    /// Adds what the user can do about an [`Error::Input`]. Other errors are returned unchanged.
    #[must_use]
    pub fn hint(mut self, text: impl Into<String>) -> Self {
        if let Self::Input { hint, .. } = &mut self {
            *hint = Some(text.into());
        }
        self
    }
}

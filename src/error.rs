//! The one error type of the library. Every message names the file and the place in it, what was
//! found and what was expected; the hint says what to do.

use std::path::{Path, PathBuf};

/// The result of a function of this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Why a function of this library failed. The message is for people; the variant says what a
/// program can do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that does not follow its format.
    #[error("{}: {place}: {message}", file.display())]
    Input {
        /// The file.
        file: PathBuf,
        /// The place in the file: a line, an element, a byte.
        place: String,
        /// What was found there and what was expected.
        message: String,
        /// What the user can do about it.
        hint: Option<String>,
    },

    /// A file, or a value stated in it, that exceeds the [`Limits`](crate::input::Limits).
    #[error("{}: {what} is {found}, over the limit of {limit}", file.display())]
    Limit {
        /// The file.
        file: PathBuf,
        /// The quantity that exceeds the limit.
        what: String,
        /// The limit that is exceeded.
        kind: LimitKind,
        /// The value of the quantity, in the unit of the limit.
        found: u64,
        /// The limit.
        limit: u64,
    },

    /// A part of a file that comes in [`Parts`](crate::input::Parts) has not come yet. Hand it in,
    /// and try again.
    #[error("the bytes {start} to {end} of a file have not come yet")]
    Absent {
        /// The first byte.
        start: u64,
        /// The byte behind the last one.
        end: u64,
    },

    /// The operating system could not open, read or write a file.
    #[error("{}: cannot {action}: {source}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What was tried, such as “open”.
        action: &'static str,
        /// The system's error.
        source: std::io::Error,
    },

    /// The operating system could not write a result. A file that was there before is unchanged.
    #[error("{}: cannot be written: {source}", file.display())]
    Output {
        /// The file that was to be written.
        file: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },

    /// An argument of a caller from which no picture can be made (a size of 0, a kernel of no
    /// width, …). If a file states the value, [`stated_in`](Self::stated_in) says so.
    #[error("{0}")]
    Argument(String),

    /// A transfer function that cannot be used, or that does not fit the values of its item.
    #[error("{0}")]
    Transfer(String),

    /// Work on an input took longer than its [`Deadline`](crate::Deadline) allows.
    #[error("{what} takes longer than the limit of {limit} s")]
    Timeout {
        /// The work that was stopped.
        what: String,
        /// The limit in seconds.
        limit: u64,
    },

    /// The operating system refused memory. It was requested before the work began, so nothing is
    /// half done.
    #[error("{what} needs {bytes} bytes of memory, which the system refused")]
    Memory {
        /// The work that needs the memory.
        what: String,
        /// The number of bytes that were requested.
        bytes: u64,
    },

    /// The scene contains nothing visible.
    #[error("nothing to draw: {0}")]
    NothingToDraw(String),

    /// Drawing was stopped ([`Stop`](crate::Stop)).
    #[error("the picture was stopped before it was finished")]
    Stopped,

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
    EntriesExhausted {
        /// The entries that a depth pass may have.
        budget: u32,
    },

    /// The scene needs more memory, in bytes, than it may take on this adapter
    /// ([`Gpu::with_memory`](crate::gpu::Gpu::with_memory)).
    #[error(
        "GPU: the scene needs at least {} MiB of memory on {adapter}, of which {} MiB may be taken",
        needed.div_ceil(1 << 20), limit.div_ceil(1 << 20)
    )]
    MemoryBound {
        /// The name of the adapter.
        adapter: String,
        /// The bytes that the scene needs at least.
        needed: u64,
        /// The bytes that it may take.
        limit: u64,
    },

    /// The device is lost, with all its resources
    /// ([`Gpu::reopened`](crate::gpu::Gpu::reopened)).
    #[error("GPU: {0}")]
    DeviceLost(String),
}

/// Which of the [`Limits`](crate::input::Limits) was met.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind {
    /// Vertices, points or faces of a file.
    Points,
    /// Bytes of an input and of everything made from it.
    Bytes,
    /// Nesting of scene nodes and of XML elements.
    Depth,
    /// Pixels of one picture.
    Texels,
    /// Seconds of reading.
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

    /// Makes wrong values the fault of the file that states them: an [`Error::Argument`] or an
    /// [`Error::Transfer`] becomes an [`Error::Input`] at this place of the file. Callers that hand
    /// on what a file says use this where they still know the file. Other errors are as
    /// [`in_file`](Self::in_file) returns them.
    #[must_use]
    pub fn stated_in(self, file: &Path, place: impl Into<String>) -> Self {
        match self {
            Self::Argument(what) | Self::Transfer(what) => Self::input(file, place, what),
            other => other.in_file(file),
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

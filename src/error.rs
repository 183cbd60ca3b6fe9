//! The one error type of the library. Every message names the file and the place in it, what was found and what
//! was expected; the hint says what to do.

use std::path::{Path, PathBuf};

pub type Result<T, E = Error> = std::result::Result<T, E>;

#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file that does not hold what its format promises.
    #[error("{}: {place}: {message}", file.display())]
    Input { file: PathBuf, place: String, message: String, hint: Option<String> },

    /// A file (or a claim in it) larger than the [`Limits`](crate::input::Limits) allow.
    #[error("{}: {what} is {found}, over the limit of {limit}", file.display())]
    Limit { file: PathBuf, what: String, kind: LimitKind, found: u64, limit: u64 },

    /// The operating system could not open, read or write a file.
    #[error("{}: cannot {action}: {source}", file.display())]
    File { file: PathBuf, action: &'static str, source: std::io::Error },

    /// A result that the operating system did not take; what was there before is there still.
    #[error("{}: cannot be written: {source}", file.display())]
    Output { file: PathBuf, source: std::io::Error },

    /// A value given by the caller that makes no picture (a size of 0, a kernel with no width, …).
    #[error("{0}")]
    Argument(String),

    /// Work on an input that takes longer than its [`Deadline`](crate::Deadline) allows.
    #[error("{what} takes longer than the limit of {limit} s")]
    Timeout { what: String, limit: u64 },

    /// Memory that the operating system refuses. It was asked for before the work began, so nothing is half done.
    #[error("{what} needs {bytes} bytes of memory, which the system does not give")]
    Memory { what: String, bytes: u64 },

    /// The scene holds nothing that could be seen.
    #[error("nothing to draw: {0}")]
    NothingToDraw(String),

    /// No adapter, or none of the wanted name.
    #[error("no usable GPU: {0}")]
    NoAdapter(String),

    /// The device ran out of memory, or could not do what was asked of it. It can be used further.
    #[error("GPU: {0}")]
    Gpu(String),

    /// The device is gone, with all that lay on it ([`Gpu::reopened`](crate::engine::Gpu::reopened)).
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
    /// An [`Error::Input`] without a hint.
    pub fn input(file: &Path, place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Input {
            file: file.to_owned(),
            place: place.into(),
            message: message.into(),
            hint: None,
        }
    }

    /// An [`Error::File`].
    pub fn file(file: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::File { file: file.to_owned(), action, source }
    }

    /// An [`Error::Output`].
    pub fn output(file: &Path, source: std::io::Error) -> Self {
        Self::Output { file: file.to_owned(), source }
    }

    /// Names the file that an error is about, where the error does not know it.
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

    /// Adds what the user can do about an [`Error::Input`]; other errors pass unchanged.
    #[must_use]
    pub fn hint(mut self, text: impl Into<String>) -> Self {
        if let Self::Input { hint, .. } = &mut self {
            *hint = Some(text.into());
        }
        self
    }
}

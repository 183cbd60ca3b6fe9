//! The errors of the command, their exit codes, and how they are printed.

use crate::{
    limits,
    terminal::{safe, safe_lines},
};
use console::{Term, style};
use splatkit::Error;
use std::{
    borrow::Cow,
    fmt,
    io::{self, ErrorKind, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Columns before the texts of an error: `error: …` and `  help: …`.
const ERROR: usize = 7;
const HELP: usize = 8;

/// Why the command ends without success.
#[derive(Debug)]
pub enum Failure {
    /// An error of the library.
    Library(Error),
    /// Arguments that are wrong or cannot be combined.
    Usage(String),
    /// A result that could not be written.
    Output { file: PathBuf, message: String, hint: Option<&'static str> },
    /// Threads that the system could not start.
    Threads(String),
    /// A file that `check` found damaged. The findings are printed already.
    Damaged { file: PathBuf, findings: usize },
    /// Cases of a suite or a sweep that could not be measured. The tables give the reason for each.
    /// `kept` is the file that was not written for that reason.
    Incomplete { failed: usize, kept: Option<PathBuf> },
    /// Pictures that differ by more than the user allows.
    Comparison(String),
}

impl Failure {
    /// Returns the failure of a result that the operating system could not write.
    pub fn output(file: &Path, error: impl fmt::Display) -> Self {
        splatkit_media::Failure::output(file, error).into()
    }

    pub fn code(&self) -> u8 {
        match self {
            Self::Output { .. }
            | Self::Library(Error::Output { .. })
            | Self::Incomplete { .. }
            | Self::Threads(_) => 1,
            Self::Usage(_) | Self::Library(Error::Argument(_) | Error::Transfer(_)) => 2,
            Self::Library(
                Error::NoAdapter(_)
                | Error::Driver(_)
                | Error::EntriesExhausted { .. }
                | Error::MemoryBound { .. }
                | Error::DeviceLost(_)
                | Error::Memory { .. },
            ) => 4,
            Self::Library(
                Error::Input { .. }
                | Error::Limit { .. }
                | Error::Timeout { .. }
                | Error::File { .. }
                | Error::NothingToDraw(_),
            ) => 3,
            // An error that this command does not know yet.
            Self::Library(_) => 1,
            Self::Damaged { .. } => 3,
            Self::Comparison(_) => 5,
        }
    }

    pub fn hint(&self) -> Option<Cow<'_, str>> {
        let hint = match self {
            Self::Library(Error::Input { hint, .. }) => hint.as_deref(),
            Self::Library(Error::Output { source, .. }) => room(source),
            Self::Library(Error::Limit { file, kind, found: amount, .. }) => {
                return Some(limits::hint(file, *kind, *amount).into());
            }
            Self::Library(Error::Timeout { .. }) => Some("raise --limit-seconds"),
            Self::Library(Error::Memory { .. }) => Some(
                "close other programs, raise the process's limits (`ulimit -v`), or convert the \
                 file to .splk with less --memory",
            ),
            Self::Library(Error::NoAdapter(_)) => {
                Some("`splatkit gpus` lists the adapters; --engine cpu and --reference need no GPU")
            }
            Self::Library(Error::EntriesExhausted { .. }) => {
                Some("raise --pass-entries, or draw a smaller --size")
            }
            Self::Library(Error::MemoryBound { .. }) => Some(
                "raise --gpu-memory, or convert the input to .splk or .splv (`splatkit convert`) \
                 and draw less of it with --cut or --budget",
            ),
            Self::Library(Error::Driver(_)) => Some(
                "try a smaller --size, another --gpu (such as `software`), or a longer \
                 --gpu-timeout",
            ),
            Self::Library(Error::DeviceLost(_)) => Some(
                "the driver was reset, or its memory ran out: try again, a smaller --size, or \
                 another --gpu (such as `software`)",
            ),
            Self::Library(Error::NothingToDraw(_)) => Some(
                "`splatkit info` prints what a file contains; --transfer, --range, --clip and the \
                 camera decide what is visible",
            ),
            Self::Library(Error::Argument(_) | Error::Transfer(_)) | Self::Usage(_) => {
                Some("`splatkit help` lists the options")
            }
            Self::Library(_) | Self::Comparison(_) => None,
            Self::Damaged { .. } => Some("make it again from its source, or download it again"),
            Self::Threads(_) => {
                Some("end other programs, raise `ulimit -u`, or set RAYON_NUM_THREADS=1")
            }
            Self::Incomplete { .. } => Some("the tables give the reason for each"),
            Self::Output { hint, .. } => *hint,
        };
        hint.map(Cow::Borrowed)
    }

    /// Prints the failure to stderr. A terminal gets lines that are wrapped at its width; other
    /// readers, such as logs, get whole lines.
    pub fn report(self) -> ExitCode {
        let width = Term::stderr().size_checked().map(|(_, columns)| usize::from(columns));
        let Printed { message, hint } = Printed::of(&self);
        let wrapped = |text: &str, indent| wrapped(text, indent, width.unwrap_or(usize::MAX));
        let label = style("error:").for_stderr().red().bold();
        let mut text = format!("{label} {}\n", wrapped(&message, ERROR));
        if let Some(hint) = hint {
            let label = style("help:").for_stderr().cyan();
            text += &format!("  {label} {}\n", wrapped(&hint, HELP));
        }
        // The reader of stderr may be gone already.
        io::stderr().write_all(text.as_bytes()).ok();
        ExitCode::from(self.code())
    }

    /// Whether the message comes from the GPU's driver or library, whose messages have several
    /// lines. Other messages have one line, and a line break in them comes from a file's text.
    fn has_lines(&self) -> bool {
        matches!(self, Self::Library(Error::NoAdapter(_) | Error::Driver(_) | Error::DeviceLost(_)))
    }
}

/// A failure that is safe to print: a terminal obeys no text in it.
struct Printed {
    message: String,
    hint: Option<String>,
}

impl Printed {
    fn of(failure: &Failure) -> Self {
        let message = failure.to_string();
        let message = if failure.has_lines() { safe_lines(&message) } else { safe(&message) };
        Self {
            message: message.into_owned(),
            hint: failure.hint().map(|hint| safe(&hint).into_owned()),
        }
    }
}

/// Returns a text in lines. Each line that is longer than a width is broken between words, and
/// goes on below the first word: `indent` columns from the left.
fn wrapped(text: &str, indent: usize, width: usize) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut column = indent;
        for (at, word) in line.split(' ').enumerate() {
            let letters = word.chars().count();
            if at > 0 && column + 1 + letters > width {
                out += &format!("\n{}", " ".repeat(indent));
                column = indent;
            } else if at > 0 {
                out.push(' ');
                column += 1;
            }
            out += word;
            column += letters;
        }
        out += &format!("\n{}", " ".repeat(indent));
    }
    out.truncate(out.trim_end().len());
    out
}

/// Returns what the user can do if the operating system could not write a result.
fn room(error: &io::Error) -> Option<&'static str> {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            Some("make room there, or write to another disk; the old file is unchanged")
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            Some("write to another folder, or change the folder's permissions")
        }
        ErrorKind::NotFound => Some("make the folder first"),
        ErrorKind::AlreadyExists => Some("give --overwrite, or another name"),
        _ => None,
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Library(error)
    }
}

impl From<splatkit_media::Failure> for Failure {
    fn from(failure: splatkit_media::Failure) -> Self {
        match failure {
            splatkit_media::Failure::Library(error) => Self::Library(error),
            splatkit_media::Failure::Usage(message) => Self::Usage(message),
            splatkit_media::Failure::Output { file, message, hint } => {
                Self::Output { file, message, hint }
            }
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Library(error) => error.fmt(out),
            Self::Usage(message) | Self::Comparison(message) => out.write_str(message),
            Self::Threads(reason) => write!(out, "no threads can be started: {reason}"),
            Self::Damaged { file, findings } => {
                write!(out, "{}: {findings} findings", file.display())
            }
            Self::Incomplete { failed, kept } => {
                write!(out, "{failed} of the cases could not be drawn")?;
                kept.iter().try_for_each(|file| write!(out, "; {} is unchanged", file.display()))
            }
            Self::Output { file, message, .. } => write!(out, "{}: {message}", file.display()),
        }
    }
}

impl std::error::Error for Failure {}

#[cfg(test)]
mod tests {
    use super::wrapped;

    #[test]
    fn lines_are_broken_between_words() {
        assert_eq!(wrapped("a bc def", 2, 6), "a bc\n  def");
        assert_eq!(wrapped("a bc def", 2, usize::MAX), "a bc def");
        // A word that is too long has a line of its own, and the text's own lines stay.
        assert_eq!(wrapped("a https://b c\nd e", 1, 5), "a\n https://b\n c\n d e");
        assert_eq!(wrapped("", 3, 5), "");
    }
}

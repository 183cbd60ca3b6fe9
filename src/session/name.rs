//! What inputs are called, and whose fault their values are.

use crate::Error;
use std::path::Path;

/// What an input is called in messages.
#[derive(Debug, Clone, PartialEq)]
pub struct Name {
    /// The name itself.
    pub text: String,
    /// Whether it is the path of a file. Otherwise the values are the caller's.
    pub is_file: bool,
}

impl Name {
    /// Returns the name of a file.
    pub fn of_file(path: &Path) -> Self {
        Self { text: path.display().to_string(), is_file: true }
    }

    /// Returns an error that the values cause: the fault of the file, or of the caller.
    pub(super) fn fault(&self, error: Error) -> Error {
        match self.is_file {
            true => error.stated_in(self.text.as_ref(), "content"),
            false => error.in_file(self.text.as_ref()),
        }
    }

    /// Returns the error for something that an input cannot be used for.
    pub(super) fn unfit(&self, place: &str, message: &str, hint: &str) -> Error {
        match self.is_file {
            true => Error::input(self.text.as_ref(), place, message).hint(hint),
            false => Error::Argument(format!("{}: {message}", self.text)),
        }
    }
}

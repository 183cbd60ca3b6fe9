//! What becomes of pictures and scenes beside pictures: films, several views in one, texts over
//! them, and pages for browsers. The command and the Python package share it.

pub mod figure;
pub mod overlay;
pub mod page;
pub mod video;

use splatkit::Error;
use std::{
    fmt,
    path::{Path, PathBuf},
};

/// Why a film or a text was not made.
#[derive(Debug)]
pub enum Failure {
    /// An error of the library.
    Library(Error),
    /// Something that was asked for and cannot be.
    Usage(String),
    /// A film that could not be written.
    Output {
        /// The file of the film.
        file: PathBuf,
        /// What went wrong.
        message: String,
        /// What to do about it.
        hint: Option<&'static str>,
    },
}

impl Failure {
    /// Returns the failure of a file that could not be written.
    pub fn output(file: &Path, error: impl fmt::Display) -> Self {
        Self::Output {
            file: file.to_owned(),
            message: format!("cannot be written: {error}"),
            hint: None,
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Library(error)
    }
}

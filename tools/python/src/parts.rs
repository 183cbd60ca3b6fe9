//! The parts of a description, as Python says them: JSON with the names of the arguments.

use crate::errors::options;
use splatkit::{
    Error,
    session::{AppearanceEntry, PictureEntry, ReadingEntry},
};

/// Reads how files are read.
pub fn reading(text: &str) -> Result<ReadingEntry, Error> {
    let entry: ReadingEntry = options(text)?;
    entry.validate()?;
    Ok(entry)
}

/// Reads how an item is shown.
pub fn appearance(text: &str) -> Result<AppearanceEntry, Error> {
    let entry: AppearanceEntry = options(text)?;
    entry.validate()?;
    Ok(entry)
}

/// Reads how a picture is drawn.
pub fn picture(text: &str) -> Result<PictureEntry, Error> {
    let entry: PictureEntry = options(text)?;
    entry.validate()?;
    Ok(entry)
}

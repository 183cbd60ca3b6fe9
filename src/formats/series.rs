//! The series of a folder: what may be read of it.

use super::{FORMATS, ReadOptions, format::find};
use crate::{Result, input::Source};

/// A series of pictures in the files of a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its number in the study.
    pub number: Option<i64>,
    /// Its unique identifier.
    pub identifier: String,
    /// What the series shows, in the words of those who took it; empty if they do not say.
    pub description: String,
    /// The code of what measured it, as in “CT” or “MR”; empty if the files do not say.
    pub modality: String,
    /// Columns and rows of a picture.
    pub size: [usize; 2],
    /// The number of pictures.
    pub pictures: usize,
    /// Why it cannot be drawn; `None` if it can.
    pub obstacle: Option<String>,
    /// Whether the options of reading choose it.
    pub is_drawn: bool,
}

impl Series {
    /// Returns a text that names the series among others: its number, what it shows, what measured
    /// it, and how many pictures it has.
    pub fn title(&self) -> String {
        let Self { description, modality, pictures, .. } = self;
        let number = self.number.map(|number| number.to_string());
        let words = [number.as_deref().unwrap_or("–"), modality, description];
        let words: Vec<&str> = words.into_iter().filter(|word| !word.is_empty()).collect();
        let noun = if *pictures == 1 { "picture" } else { "pictures" };
        format!("{} ({pictures} {noun})", words.join(" "))
    }
}

/// Returns the series of a folder, or of a file that lists others, in the order of their numbers.
/// [`ReadOptions::series`] chooses one of them. Empty if the format knows no series.
///
/// # Errors
/// Those of the format's reader.
pub fn series(source: &Source, options: &ReadOptions) -> Result<Vec<Series>> {
    match find(FORMATS, source, |_| true)?.and_then(|format| format.series) {
        Some(list) => source.unless_changed(list(source, options)),
        None => Ok(Vec::new()),
    }
}

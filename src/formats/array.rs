//! The arrays of a file that holds several: what may be drawn of it.

use super::{FORMATS, ReadOptions, format::find};
use crate::{Result, input::Source};

/// One of the arrays, columns, properties or data sets of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// The name by which [`ReadOptions::scalar`] or [`ReadOptions::dataset`] chooses it.
    pub name: String,
    /// Where its values sit.
    pub place: Place,
    /// The type of its numbers, as in `u8` or `f32`; or `string`, `bit` or the file's own word.
    pub kind: String,
    /// The number of components of each value: 1 for scalars, 3 for vectors.
    pub components: usize,
    /// The lowest and the highest value, of a vector's magnitude; `None` if it has no numbers.
    pub range: Option<[f64; 2]>,
    /// Whether the options of reading choose it.
    pub is_drawn: bool,
}

/// Where the values of an array sit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// At points, vertices or samples.
    Points,
    /// One a cell or a face.
    Cells,
    /// Neither: they belong to the file as a whole.
    File,
}

impl Place {
    /// Returns its name in tables: `points`, `cells` or `file`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Cells => "cells",
            Self::File => "file",
        }
    }
}

/// Returns the arrays of a file, in its own order. Empty if its format holds only one.
///
/// # Errors
/// Those of the format's reader.
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    match find(FORMATS, source, |_| true)?.and_then(|format| format.arrays) {
        Some(list) => source.unless_changed(list(source, options)),
        None => Ok(Vec::new()),
    }
}

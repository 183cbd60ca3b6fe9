//! The times of a file that holds several volumes.

use crate::input::Source;

/// How many times a file holds, and which of them is read. What the file calls echoes, members or
/// volumes counts as times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Times {
    /// The number of times, 2 or more.
    pub count: u64,
    /// The time that is read, from 0, as [`ReadOptions::time`](super::ReadOptions::time) names it.
    pub read: usize,
}

/// Returns the times of a file that was read; `None` if it holds only one.
pub fn times(source: &Source) -> Option<Times> {
    let (count, read) = source.times()?;
    (count > 1).then_some(Times { count, read })
}

//! What is wrong with a field of a plan, of its tables or its parts, and what was expected.

use std::fmt::{Debug, Display};

/// Refuses a field's value unless it is sound.
pub fn check(
    is_sound: bool,
    field: impl Display,
    value: impl Debug,
    wanted: impl Display,
) -> Result<(), String> {
    if is_sound { Ok(()) } else { Err(format!("{field} is {value:?}; {wanted}")) }
}

/// Adds where the field of an error is.
pub fn within<T>(place: impl Display, result: Result<T, String>) -> Result<T, String> {
    result.map_err(|message| format!("{place}.{message}"))
}

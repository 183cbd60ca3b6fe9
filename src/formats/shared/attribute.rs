//! Chooses one of the attributes that points have, by its name.

use crate::{Result, input::Source};

/// Returns the index of a name. A name that differs by case alone is accepted, and one that
/// CloudCompare wrote with `scalar_` before it.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for another name, with the names that there are.
pub(crate) fn named(
    source: &Source,
    place: &str,
    name: &str,
    names: &[impl AsRef<str>],
) -> Result<usize> {
    let alike = |known: &str| {
        let known = known.trim();
        known.eq_ignore_ascii_case(name)
            || known.strip_prefix("scalar_").is_some_and(|rest| rest.eq_ignore_ascii_case(name))
    };
    let exact = names.iter().position(|known| known.as_ref() == name);
    exact.or_else(|| names.iter().position(|known| alike(known.as_ref()))).ok_or_else(|| {
        let error = source.error(place, format!("has no attribute “{name}”"));
        let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
        if names.is_empty() {
            return error.hint("it has no attributes besides positions");
        }
        error.hint(format!("name one of them: {}", names.join(", ")))
    })
}

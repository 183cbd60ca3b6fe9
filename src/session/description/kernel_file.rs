//! Files of kernels: values at even distances.

use crate::{
    Result,
    input::{Limits, Source},
    math::Kernel,
};
use std::path::Path;

/// Largest size of a kernel's file, in bytes.
const MOST_BYTES: usize = 4 << 20;

/// The form of the file, for hints.
const FORM: &str = "the form is a JSON array, or one number per line";

/// Reads a kernel from a file that is a JSON array, or has one number per line. The last value is
/// that at the distance `extent`, in samples.
///
/// # Errors
/// [`Error::Input`] for other content, and for values that are no kernel.
pub(super) fn read(path: &Path, extent: f64, limits: &Limits) -> Result<Kernel> {
    let kernel = Kernel::table(values(path, limits)?, extent);
    kernel.map_err(|error| error.stated_in(path, "content").hint(FORM))
}

fn values(path: &Path, limits: &Limits) -> Result<Vec<f64>> {
    let source = Source::open(path, limits)?;
    let text = source.small_text("the table of a kernel", MOST_BYTES)?;
    if text.trim_start().starts_with('[') {
        return serde_json::from_str(&text).map_err(|e| source.error("kernel", e.to_string()));
    }
    // Old editors end lines with a carriage return only.
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let number = |(at, line): (usize, &str)| {
        let value = line.trim().parse().ok().filter(|value: &f64| value.is_finite());
        let message = || format!("“{}” is not a number", line.trim());
        value.ok_or_else(|| source.error(format!("line {}", at + 1), message()).hint(FORM))
    };
    lines.map(number).collect()
}

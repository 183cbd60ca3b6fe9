//! Builds scattered samples from the rows of a file.

use crate::{
    Error, Result,
    input::{Source, positions},
    parallel::prelude::*,
    scattered::Points,
};
use glam::DVec3;

/// The columns of the rows besides their positions. All but the values may be empty.
#[derive(Debug, Default)]
pub(crate) struct Columns {
    pub values: Vec<f64>,
    pub radii: Vec<f32>,
    pub covariances: Vec<[f32; 6]>,
}

impl Columns {
    /// Bytes per row with all columns.
    pub const ROW: u64 = 8 + 4 + 24;
}

/// Builds `count` samples. `place` names a row in an error.
pub(crate) fn gather(
    source: &Source,
    count: usize,
    position: impl Fn(usize) -> DVec3 + Sync,
    place: impl Fn(usize) -> String,
    columns: Columns,
) -> Result<Points> {
    if count == 0 {
        return Err(source.error("file", "contains no samples"));
    }
    let wrong = |&value: &f64| !(value as f32).is_finite();
    if let Some(row) = columns.values.par_iter().position_first(wrong) {
        let message = format!("the value {} is not finite in 32 bits", columns.values[row]);
        return Err(source
            .error(place(row), message)
            .hint("remove the sample, or write the file without it"));
    }
    let (origin, positions) = positions::settle(source, count, position, place)?;
    source.room::<f32>("the values", columns.values.len())?;
    let values = columns.values.into_par_iter().map(|value| value as f32).collect();
    let points = Points {
        origin,
        positions,
        values,
        radii: columns.radii,
        covariances: columns.covariances,
        ..Points::default()
    };
    points.check().map_err(|message| source.error("samples", message))?;
    Ok(points)
}

/// Returns the error for a file in which the scalar is missing or ambiguous; `names` are those
/// available.
pub(crate) fn which_scalar(
    source: &Source,
    place: &str,
    wanted: Option<&str>,
    names: &[&str],
) -> Error {
    let message = match wanted {
        Some(name) => format!("has no scalar “{name}”"),
        None if names.is_empty() => "has no scalar".to_owned(),
        None => format!("has {} scalars to choose from", names.len()),
    };
    let error = source.error(place, message);
    if names.is_empty() {
        error
    } else {
        error.hint(format!("name one of them: {}", names.join(", ")))
    }
}

/// Returns the index of the requested name, or of the only one.
pub(crate) fn choose(
    source: &Source,
    place: &str,
    wanted: Option<&str>,
    names: &[&str],
) -> Result<usize> {
    let found = match wanted {
        Some(wanted) => names.iter().position(|name| *name == wanted),
        None => (names.len() == 1).then_some(0),
    };
    found.ok_or_else(|| which_scalar(source, place, wanted, names))
}

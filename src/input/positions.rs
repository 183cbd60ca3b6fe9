//! Converts the double-precision positions of a file to 32-bit positions around an origin.

use super::Source;
use crate::{Error, Result, parallel::prelude::*};
use glam::{DVec3, Vec3};

/// The squares of coordinates up to this size still fit in 32-bit floats.
const LARGEST: f64 = 1e18;

/// Chooses an origin and returns it with the positions relative to it. The origin is zero unless
/// the coordinates are large compared with the extent of the whole. Then it is the centre, rounded
/// to whole numbers. `place` names a row in an error.
pub(crate) fn settle(
    source: &Source,
    count: usize,
    position: impl Fn(usize) -> DVec3 + Sync,
    place: impl Fn(usize) -> String,
) -> Result<(DVec3, Vec<Vec3>)> {
    source.check_time()?;
    source.room::<Vec3>("the positions", count)?;
    let bad = (0..count).into_par_iter().find_first(|&row| !position(row).is_finite());
    if let Some(row) = bad {
        return Err(not_finite(source, place(row), position(row)));
    }
    if count == 0 {
        return Ok((DVec3::ZERO, Vec::new()));
    }
    let start = position(0);
    let (low, high) = (0..count)
        .into_par_iter()
        .map(|row| (position(row), position(row)))
        .reduce(|| (start, start), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let origin = origin(source, low, high)?;
    Ok((origin, (0..count).into_par_iter().map(|row| (position(row) - origin).as_vec3()).collect()))
}

/// Returns the origin for positions between two corners.
pub(crate) fn origin(source: &Source, low: DVec3, high: DVec3) -> Result<DVec3> {
    let (center, extent) = (low * 0.5 + high * 0.5, (high * 0.5 - low * 0.5).max_element());
    let origin =
        if center.abs().max_element() > 16.0 * extent { center.round() } else { DVec3::ZERO };
    if (low - origin).abs().max((high - origin).abs()).max_element() > LARGEST {
        return Err(source.error(
            "positions",
            format!(
                "range from {:?} to {:?}, too wide for 32-bit coordinates",
                low.to_array(),
                high.to_array()
            ),
        ));
    }
    Ok(origin)
}

/// Returns the error for a position that is not finite.
pub(crate) fn not_finite(source: &Source, place: String, position: DVec3) -> Error {
    source
        .error(place, format!("the position {position} is not finite"))
        .hint("remove the point, or write the file again without undefined coordinates")
}

/// Returns a normal of unit length, or zero if the file's normal is unusable.
pub(crate) fn unit(normal: Vec3) -> Vec3 {
    normal.as_dvec3().normalize_or_zero().as_vec3()
}

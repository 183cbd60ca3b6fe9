//! Converts the double-precision positions of a file to 32-bit positions around an origin.

use super::Source;
use crate::{Error, Result, parallel::prelude::*};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// The squares of coordinates up to this size still fit in 32-bit floats.
const LARGEST: f64 = 1e18;

/// As [`settle`], but rows whose position is not finite may occur: theirs become NaN. The origin is
/// that of the others.
///
/// # Errors
/// Those of [`settle`]; [`Error::Input`] if there are rows, but none has a finite position.
pub(crate) fn settle_some(
    source: &Source,
    count: usize,
    position: impl Fn(usize) -> DVec3 + Sync,
) -> Result<(DVec3, Vec<Vec3>)> {
    source.check_time()?;
    source.room::<Vec3>("the positions", count)?;
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let both = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
    let (mut low, mut high) = none;
    for rows in batches(count) {
        source.check_time()?;
        let bounds = rows
            .into_par_iter()
            .map(&position)
            .filter(|position| position.is_finite())
            .map(|position| (position, position))
            .reduce(|| none, both);
        (low, high) = both((low, high), bounds);
    }
    if count == 0 {
        return Ok((DVec3::ZERO, Vec::new()));
    }
    if low.x > high.x {
        return Err(source.error(
            "positions",
            format!("none of the {count} points has coordinates that are finite numbers"),
        ));
    }
    let step = count.div_ceil(MOST_SAMPLED);
    let sampled = (0..count).step_by(step).map(&position);
    let sampled: Vec<DVec3> = sampled.filter(|position| position.is_finite()).collect();
    let origin = origin(source, [low, high], &sampled)?;
    let relative = |row| match position(row) {
        position if position.is_finite() => (position - origin).as_vec3(),
        _ => Vec3::NAN,
    };
    Ok((origin, collected(source, count, relative)?))
}

/// Rows between two checks of the time limit.
const BATCH: usize = 1 << 22;

fn batches(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count).step_by(BATCH).map(move |start| start..count.min(start + BATCH))
}

/// Returns what is made of each row, in their order, unless the time for reading is over before.
pub(crate) fn collected<T: Send>(
    source: &Source,
    count: usize,
    one: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>> {
    source.check_time()?;
    if count <= BATCH {
        return Ok((0..count).into_par_iter().map(one).collect());
    }
    let mut all = Vec::with_capacity(count);
    for rows in batches(count) {
        source.check_time()?;
        all.extend(rows.into_par_iter().map(&one).collect::<Vec<T>>());
    }
    Ok(all)
}

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
    if count == 0 {
        return Ok((DVec3::ZERO, Vec::new()));
    }
    let start = position(0);
    let both = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0.min(b.0), a.1.max(b.1));
    let (mut low, mut high) = (start, start);
    for rows in batches(count) {
        source.check_time()?;
        let bad = rows.clone().into_par_iter().find_first(|&row| !position(row).is_finite());
        if let Some(row) = bad {
            return Err(not_finite(source, place(row), position(row)));
        }
        let bounds = rows
            .into_par_iter()
            .map(|row| (position(row), position(row)))
            .reduce(|| (start, start), both);
        (low, high) = both((low, high), bounds);
    }
    let step = count.div_ceil(MOST_SAMPLED);
    let sampled: Vec<DVec3> = (0..count).step_by(step).map(&position).collect();
    let origin = origin(source, [low, high], &sampled)?;
    Ok((origin, collected(source, count, |row| (position(row) - origin).as_vec3())?))
}

/// Returns the origin for positions between two corners, given some of the positions, spread evenly
/// over all.
///
/// If nine tenths of these lie together in a box a hundredth as large as the whole along each axis,
/// or smaller, that box decides. One point far away must not take the precision of the others.
pub(crate) fn origin(source: &Source, [low, high]: [DVec3; 2], sampled: &[DVec3]) -> Result<DVec3> {
    let around = |[low, high]: [DVec3; 2]| {
        let center = low * 0.5 + high * 0.5;
        let is_far = center.abs().max_element() > 16.0 * half([low, high]);
        if is_far { center.round() } else { DVec3::ZERO }
    };
    let usual = usual(sampled).filter(|_| are_crowded(sampled, [low, high]));
    let origin = around(usual.unwrap_or([low, high]));
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

/// Returns whether nine tenths of some positions lie in a box a hundredth as large as the whole.
pub(crate) fn are_crowded(sampled: &[DVec3], whole: [DVec3; 2]) -> bool {
    usual(sampled).is_some_and(|usual| 100.0 * half(usual) < half(whole))
}

/// Returns half of the longest side of a box.
fn half([low, high]: [DVec3; 2]) -> f64 {
    (high * 0.5 - low * 0.5).max_element()
}

/// Positions that are looked at for an origin, and how few say nothing about the others.
pub(crate) const MOST_SAMPLED: usize = 1 << 14;
const FEWEST: usize = 20;

/// Returns the box between the 5th and the 95th percentile along each axis.
fn usual(sampled: &[DVec3]) -> Option<[DVec3; 2]> {
    if sampled.len() < FEWEST {
        return None;
    }
    let cut = sampled.len() / 20;
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        let mut along: Vec<f64> = sampled.iter().map(|place| place[axis]).collect();
        let mut at = |index: usize| *along.select_nth_unstable_by(index, f64::total_cmp).1;
        (low[axis], high[axis]) = (at(cut), at(sampled.len() - 1 - cut));
    }
    Some([low, high])
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::Limits;

    #[test]
    fn one_point_far_away_does_not_choose_the_origin() {
        let limits = Limits::default();
        let source = Source::from_bytes("a.xyz".as_ref(), b"", &limits).unwrap();
        let at = |row: usize| DVec3::new(5e5, 5e6, 100.0) + DVec3::splat(row as f64 % 7.3);
        let settled = |stray: Option<usize>| {
            let place = |row| if Some(row) == stray { DVec3::ZERO } else { at(row) };
            settle(&source, 1000, place, |row| row.to_string()).unwrap()
        };
        let (origin, all) = settled(None);
        assert!(origin.distance(at(0)) < 10.0, "{origin}");
        for stray in [0, 500, 999] {
            let (origin, places) = settled(Some(stray));
            assert!(origin.distance(at(0)) < 10.0, "{origin}");
            assert_eq!(places.len(), all.len());
            let position = origin + places[7].as_dvec3();
            assert!(position.distance(at(7)) < 1e-5, "{position}");
            assert!((origin + places[stray].as_dvec3()).length() < 1.0);
        }
        // Two parts that are both substantial lie around the usual origin.
        let parts = |row: usize| if row.is_multiple_of(9) { DVec3::ZERO } else { at(row) };
        assert_eq!(settle(&source, 1000, parts, |row| row.to_string()).unwrap().0, DVec3::ZERO);
    }
}

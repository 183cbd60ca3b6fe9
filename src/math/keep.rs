//! Whether numbers keep where things are.
//!
//! One rule holds for all files that are written and for all moves: no place is rounded by more
//! than a small part of the scene's size. Otherwise what lay apart would become one.

use crate::{Error, Result};
use glam::DVec3;

/// The fewest steps of rounded places along a scene's longest side.
const STEPS: f64 = 128.0;

/// A scene of a size that is written in a format.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Keeper {
    format: &'static str,
    /// The longest side of the box around all places; 0 for one place.
    size: f64,
}

impl Keeper {
    /// Takes the corners of the box around all places.
    pub fn new(format: &'static str, [low, high]: [DVec3; 2]) -> Self {
        let size = (high - low).max_element();
        Self { format, size: if size.is_finite() { size } else { 0.0 } }
    }

    /// Checks a place, and how far from it is what the format stores.
    ///
    /// # Errors
    /// [`Error::Argument`] for a place that the format does not hold, or rounds too much.
    pub fn check(&self, place: DVec3, miss: DVec3) -> Result<()> {
        let Self { format, size } = self;
        let miss = miss.abs().max_element();
        if !place.is_finite() || !miss.is_finite() {
            let place = place.to_array();
            let message = format!("a position is {place:?}, which {format} cannot hold");
            return Err(Error::Argument(message));
        }
        if *size > 0.0 && 2.0 * miss * STEPS > *size {
            let (place, [miss, size]) = (place.to_array(), [miss, *size].map(|side| side as f32));
            return Err(Error::Argument(format!(
                "{format} would round the position {place:?} by {miss:?}, but the scene is only \
                 {size:?} wide; move it nearer to the origin (--translate)"
            )));
        }
        Ok(())
    }
}

/// Returns a place in 32 bits.
pub(crate) fn single(place: DVec3) -> DVec3 {
    place.as_vec3().as_dvec3()
}

/// Returns the corners of the box around places.
pub(crate) fn around(places: impl IntoIterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    places.into_iter().fold(none, |[low, high], at| [low.min(at), high.max(at)])
}

/// Checks that a scene that is moved from one box to another keeps its places in 64 bits. Its size
/// after the move is not that of the other box, whose corners are rounded.
///
/// # Errors
/// [`Error::Argument`].
pub(crate) fn check_move(from: [DVec3; 2], to: [DVec3; 2], size: f64) -> Result<()> {
    let step = |[low, high]: [DVec3; 2]| low.abs().max(high.abs()).max_element() * f64::EPSILON;
    let is_lost = |step: f64, size: f64| !step.is_finite() || size > 0.0 && step * STEPS > size;
    let was_lost = is_lost(step(from), (from[1] - from[0]).max_element());
    if was_lost || !is_lost(step(to), size) {
        return Ok(());
    }
    let (place, size) = (to[0].to_array(), size as f32);
    Err(Error::Argument(format!(
        "the scene is moved to {place:?}, where 64 bits do not hold its shape: it is only {size:?} \
         wide"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_may_be_rounded_by_a_small_part_of_the_size() {
        let keeper = Keeper::new("this", [DVec3::ZERO, DVec3::new(1.0, 25.6, 2.0)]);
        assert!(keeper.check(DVec3::ONE, DVec3::splat(0.0999)).is_ok());
        let error = keeper.check(DVec3::ONE, DVec3::splat(-0.11)).unwrap_err().to_string();
        assert!(error.contains("this would round") && error.contains("25.6 wide"), "{error}");
        for wrong in [DVec3::X * f64::NAN, DVec3::X * f64::INFINITY] {
            assert!(keeper.check(wrong, DVec3::ZERO).is_err());
            assert!(keeper.check(DVec3::ZERO, wrong).is_err());
        }
        // One place is nowhere else.
        assert!(Keeper::new("this", [DVec3::X; 2]).check(DVec3::X, DVec3::X).is_ok());
    }

    #[test]
    fn moves_keep_the_shape_in_64_bits() {
        let from = [DVec3::ZERO, DVec3::ONE];
        let check =
            |from: [DVec3; 2], far: f64| check_move(from, from.map(|at| at + DVec3::X * far), 1.0);
        assert!(check(from, 1e9).is_ok());
        let error = check(from, 1e15).unwrap_err().to_string();
        assert!(error.contains("is moved to") && error.contains("only 1.0 wide"), "{error}");
        assert!(check(from, 1e39).is_err() && check(from, f64::MAX * 2.0).is_err());
        // What was lost before is not lost by the move.
        assert!(check([DVec3::splat(1e16), DVec3::splat(1e16 + 2.0)], 1e15).is_ok());
    }
}

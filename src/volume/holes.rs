//! Samples without a value: those that are not finite, and those equal to the number that stands
//! for “no value”. They are holes, not errors.

use super::{Lattice, SampleVecs, Samples, Scalar, Volume, each_type};
use crate::parallel::prelude::*;

/// Samples per task.
const CHUNK: usize = 1 << 16;

impl Volume {
    /// Like [`new`](Self::new), for samples of which some may have no value: those that are not
    /// finite, and those equal to `missing`. They are read as the lowest value of the others, and
    /// counted in [`About::holes`](crate::about::About::holes). If there are any, shared samples
    /// are copied.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for an invalid lattice, a number of samples that
    /// does not match the lattice, and samples of which none has a value.
    pub fn with_missing(
        lattice: Lattice,
        samples: Samples,
        missing: Option<f64>,
    ) -> crate::Result<Self> {
        Self::filled(lattice, samples, missing).map_err(crate::Error::Argument)
    }

    /// Like [`with_missing`](Self::with_missing). The error is a message, to which the caller adds
    /// the place.
    pub(crate) fn filled(
        lattice: Lattice,
        mut samples: Samples,
        missing: Option<f64>,
    ) -> Result<Self, String> {
        let holes = fill(&mut samples, missing)?;
        let mut volume = Self::checked(lattice, samples)?;
        volume.about.holes = holes;
        Ok(volume)
    }
}

/// Returns whether a number is no value.
pub(crate) fn is_hole(value: f64, missing: Option<f64>) -> bool {
    // Numbers are compared as they are stored: 1e20 in 32 bits is not exactly 1e20.
    let is_missing = |missing: f64| value == missing || value as f32 == missing as f32;
    !(value as f32).is_finite() || missing.is_some_and(is_missing)
}

/// Replaces samples without a value by the lowest value of the others. Returns their number. The
/// error, if no sample has a value, is a message.
fn fill(samples: &mut Samples, missing: Option<f64>) -> Result<u64, String> {
    if missing.is_none() && samples.scalar() != Scalar::F32 {
        return Ok(0);
    }
    let (holes, range) = measure(samples, missing);
    if holes > 0 {
        let [lowest, _] = range.ok_or_else(|| all_missing(samples.len(), missing))?;
        fill_with(samples, missing, lowest);
    }
    Ok(holes)
}

/// Returns the number of samples without a value, and the range of the others.
pub(crate) fn measure(samples: &Samples, missing: Option<f64>) -> (u64, Option<[f64; 2]>) {
    each_type!(samples, values => measure_values(values, missing))
}

/// Replaces samples without a value by a value of the samples.
pub(crate) fn fill_with(samples: &mut Samples, missing: Option<f64>, value: f64) {
    match samples.vecs_mut() {
        SampleVecs::U8(values) => replace(values, missing, value as u8),
        SampleVecs::U16(values) => replace(values, missing, value as u16),
        SampleVecs::I16(values) => replace(values, missing, value as i16),
        SampleVecs::I32(values) => replace(values, missing, value as i32),
        SampleVecs::F32(values) => replace(values, missing, value as f32),
    }
}

fn replace<T: Copy + Send + Sync + Into<f64>>(values: &mut [T], missing: Option<f64>, by: T) {
    values.par_chunks_mut(CHUNK).for_each(|chunk| {
        let holes = chunk.iter_mut().filter(|value| is_hole((**value).into(), missing));
        holes.for_each(|value| *value = by);
    });
}

fn measure_values<T: Copy + Send + Sync + Into<f64>>(
    values: &[T],
    missing: Option<f64>,
) -> (u64, Option<[f64; 2]>) {
    let join = |a: Option<[f64; 2]>, b: Option<[f64; 2]>| match (a, b) {
        (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
        (a, b) => a.or(b),
    };
    let of_chunk = |chunk: &[T]| {
        chunk.iter().fold((0u64, None), |(holes, range), &value| {
            let value: f64 = value.into();
            if is_hole(value, missing) {
                (holes + 1, range)
            } else {
                (holes, join(range, Some([value, value])))
            }
        })
    };
    values.par_chunks(CHUNK).map(of_chunk).reduce(|| (0, None), |a, b| (a.0 + b.0, join(a.1, b.1)))
}

/// Returns the message for samples of which none has a value.
pub(crate) fn all_missing(count: usize, missing: Option<f64>) -> String {
    let or = missing.map_or(String::new(), |missing| format!(" or equal {missing}"));
    format!("none of the {count} samples has a value: all are not finite{or}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(samples: Samples, missing: Option<f64>) -> (Samples, u64) {
        let mut samples = samples;
        let holes = fill(&mut samples, missing).unwrap();
        (samples, holes)
    }

    #[test]
    fn holes_have_the_lowest_value() {
        let values = vec![f32::NAN, 3.0, -2.0, f32::INFINITY, 1e20, f32::NEG_INFINITY];
        let (samples, holes) = filled(Samples::F32(values.clone()), Some(1e20));
        assert_eq!(samples, Samples::F32(vec![-2.0, 3.0, -2.0, -2.0, -2.0, -2.0]));
        assert_eq!(holes, 4);
        assert_eq!(filled(Samples::F32(values), None).1, 3);
        let bytes = Samples::I16(vec![-32768, 5, -1, 7]);
        assert_eq!(filled(bytes.clone(), Some(-32768.0)).0, Samples::I16(vec![-1, 5, -1, 7]));
        assert_eq!(filled(bytes.clone(), None), (bytes, 0));
        let many: Vec<f32> =
            (0..200_000).map(|i| if i % 3 == 0 { f32::NAN } else { 7.0 }).collect();
        let (samples, holes) = filled(Samples::F32(many), None);
        assert_eq!((samples, holes), (Samples::F32(vec![7.0; 200_000]), 66_667));
    }

    #[test]
    fn nothing_but_holes_is_an_error() {
        let message = fill(&mut Samples::F32(vec![f32::NAN; 3]), None).unwrap_err();
        assert_eq!(message, "none of the 3 samples has a value: all are not finite");
        let message = fill(&mut Samples::U8(vec![9; 2]), Some(9.0)).unwrap_err();
        assert!(message.ends_with("or equal 9"), "{message}");
        assert!(is_hole(1e39, None) && !is_hole(0.0, Some(1.0)));
    }
}

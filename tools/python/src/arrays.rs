//! NumPy arrays as lists of the library. The Python half of the package has made them contiguous,
//! and has chosen one of the types here.

use crate::errors::wrong;
use numpy::{Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use splatkit::{
    Error,
    glam::{DVec3, Vec3},
    volume::{Lattice, Samples, Volume},
};

/// The squares of coordinates up to this size fit in 32 bits.
const LARGEST: f64 = 1e18;

/// Returns the numbers of an array.
pub fn numbers<T: Element + Copy>(array: &Bound<'_, PyAny>) -> Result<Vec<T>, Error> {
    let array = array.cast::<PyArrayDyn<T>>().map_err(|error| wrong(error.to_string()))?;
    let view: PyReadonlyArrayDyn<'_, T> =
        array.try_readonly().map_err(|error| wrong(error.to_string()))?;
    let slice = view.as_slice().map_err(|error| wrong(error.to_string()))?;
    let mut list = Vec::new();
    reserve(&mut list, slice.len())?;
    list.extend_from_slice(slice);
    Ok(list)
}

/// Returns the rows of an array of two axes, which has this many columns.
pub fn rows<T: Element + Copy, const N: usize>(
    array: &Bound<'_, PyAny>,
) -> Result<Vec<[T; N]>, Error> {
    let array = array.cast::<PyArrayDyn<T>>().map_err(|error| wrong(error.to_string()))?;
    if array.shape().last() != Some(&N) {
        return Err(wrong(format!("rows of {N} numbers are needed, not {:?}", array.shape())));
    }
    let view = array.try_readonly().map_err(|error| wrong(error.to_string()))?;
    let slice = view.as_slice().map_err(|error| wrong(error.to_string()))?;
    let (rows, _) = slice.as_chunks::<N>();
    let mut list = Vec::new();
    reserve(&mut list, rows.len())?;
    list.extend_from_slice(rows);
    Ok(list)
}

fn reserve<T>(list: &mut Vec<T>, count: usize) -> Result<(), Error> {
    let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
    let what = "a copy of the array".into();
    list.try_reserve_exact(count).map_err(|_| Error::Memory { what, bytes })
}

/// Returns positions around an origin. As in readers of files, the origin is zero unless the
/// coordinates are large compared with the extent of the whole.
pub fn positions(array: &Bound<'_, PyAny>) -> Result<(DVec3, Vec<Vec3>), Error> {
    if array.cast::<PyArrayDyn<f32>>().is_ok() {
        let rows = rows::<f32, 3>(array)?;
        return settled(&rows, |row| Vec3::from_array(*row).as_dvec3());
    }
    settled(&rows::<f64, 3>(array)?, |row| DVec3::from_array(*row))
}

fn settled<T>(rows: &[T], place: impl Fn(&T) -> DVec3) -> Result<(DVec3, Vec<Vec3>), Error> {
    if let Some(row) = rows.iter().position(|row| !place(row).is_finite()) {
        let found = place(&rows[row]);
        return Err(wrong(format!("the position {found} in row {row} is not finite")));
    }
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let grow = |(low, high): (DVec3, DVec3), row: &T| (low.min(place(row)), high.max(place(row)));
    let (low, high) = rows.iter().fold(none, grow);
    if rows.is_empty() {
        return Err(wrong("the array holds no positions"));
    }
    let (center, extent) = (low * 0.5 + high * 0.5, (high * 0.5 - low * 0.5).max_element());
    let is_far = center.abs().max_element() > 16.0 * extent;
    let origin = if is_far { center.round() } else { DVec3::ZERO };
    if (low - origin).abs().max((high - origin).abs()).max_element() > LARGEST {
        return Err(wrong(format!(
            "positions from {low} to {high} are too wide for 32-bit coordinates"
        )));
    }
    Ok((origin, rows.iter().map(|row| (place(row) - origin).as_vec3()).collect()))
}

/// Returns the samples of an array, with the number of samples along x, y and z, which are the
/// array's last, middle and first axis.
pub fn samples(array: &Bound<'_, PyAny>) -> Result<([usize; 3], Samples), Error> {
    let untyped = array.cast::<numpy::PyUntypedArray>();
    let untyped = untyped.map_err(|error| wrong(error.to_string()))?;
    let &[nz, ny, nx] = untyped.shape() else {
        return Err(wrong(format!("a volume has three axes, not {:?}", untyped.shape())));
    };
    let is = |name: &str| untyped.dtype().str().is_ok_and(|own| own.to_string().ends_with(name));
    let samples = match () {
        () if is("uint8") => Samples::U8(numbers(array)?),
        () if is("uint16") => Samples::U16(numbers(array)?),
        () if is("int16") => Samples::I16(numbers(array)?),
        () if is("int32") => Samples::I32(numbers(array)?),
        () => Samples::F32(numbers(array)?),
    };
    Ok(([nx, ny, nz], samples))
}

/// Puts samples on a lattice. Samples that are not finite, or equal to `missing`, are read as the
/// lowest value of the others, as by readers of files.
pub fn volume(
    lattice: Lattice,
    mut samples: Samples,
    missing: Option<f64>,
) -> Result<Volume, Error> {
    let holes = match &mut samples {
        Samples::U8(values) => fill(values, missing),
        Samples::U16(values) => fill(values, missing),
        Samples::I16(values) => fill(values, missing),
        Samples::I32(values) => fill(values, missing),
        Samples::F32(values) => fill(values, missing),
        _ => Ok(0),
    }?;
    let mut volume = Volume::new(lattice, samples)?;
    volume.about.holes = holes;
    Ok(volume)
}

/// Replaces values that are missing by the lowest of the others, and returns their number.
fn fill<T>(values: &mut [T], missing: Option<f64>) -> Result<u64, Error>
where
    T: Copy + PartialOrd + Into<f64>,
{
    let is_hole = |value: T| {
        let value: f64 = value.into();
        !value.is_finite() || missing.is_some_and(|m| value == m || value as f32 == m as f32)
    };
    let holes = values.iter().filter(|value| is_hole(**value)).count();
    if holes == 0 {
        return Ok(0);
    }
    let lower = |a: Option<T>, &b: &T| match a {
        Some(a) if a <= b => Some(a),
        _ => Some(b),
    };
    let Some(lowest) = values.iter().filter(|value| !is_hole(**value)).fold(None, lower) else {
        return Err(wrong(format!(
            "none of the {} values is a finite number that is not missing",
            values.len()
        )));
    };
    values.iter_mut().filter(|value| is_hole(**value)).for_each(|value| *value = lowest);
    Ok(holes as u64)
}

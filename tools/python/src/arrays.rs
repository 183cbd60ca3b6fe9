//! NumPy arrays as lists of the library. The Python half of the package has made them contiguous,
//! and has chosen one of the types here.

use crate::errors::wrong;
use bytes::Bytes;
use numpy::{
    Element, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::{buffer::PyUntypedBuffer, prelude::*};
use splatkit::{
    Error,
    glam::{DVec3, Vec3},
    volume::{Samples, Scalar, SharedSamples},
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
        let position = place(&rows[row]);
        return Err(wrong(format!("the position {position} in row {row} is not finite")));
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

/// The memory of an array, which stays in place as long as this lives.
struct Memory(PyUntypedBuffer);

impl AsRef<[u8]> for Memory {
    #[expect(unsafe_code, reason = "reading an array where it is, without the interpreter's lock")]
    fn as_ref(&self) -> &[u8] {
        if self.0.len_bytes() == 0 {
            return &[];
        }
        // SAFETY: the buffer is contiguous, as `samples` has checked, and its owner keeps it until
        // it is released. That nobody writes to it is asked of the caller of `add_volume`; the
        // library takes no value of a sample as an address.
        unsafe { std::slice::from_raw_parts(self.0.buf_ptr().cast(), self.0.len_bytes()) }
    }
}

/// Returns the samples of an array, which are not copied, with the number of samples along x, y and
/// z, which are the array's last, middle and first axis.
pub fn samples(array: &Bound<'_, PyAny>) -> Result<([usize; 3], Samples), Error> {
    let untyped = array.cast::<PyUntypedArray>().map_err(|error| wrong(error.to_string()))?;
    let &[nz, ny, nx] = untyped.shape() else {
        return Err(wrong(format!("a volume has three axes, not {:?}", untyped.shape())));
    };
    let dtype = untyped.dtype().str().map(|name| name.to_string()).unwrap_or_default();
    let scalar = match dtype.as_str() {
        "uint8" => Scalar::U8,
        "uint16" => Scalar::U16,
        "int16" => Scalar::I16,
        "int32" => Scalar::I32,
        "float32" => Scalar::F32,
        _ => return Err(wrong(format!("samples of the type {dtype} are not drawn"))),
    };
    let buffer = PyUntypedBuffer::get(array).map_err(|error| wrong(error.to_string()))?;
    if !buffer.is_c_contiguous() {
        return Err(wrong("the samples are not contiguous"));
    }
    let shared = SharedSamples::new(scalar, Bytes::from_owner(Memory(buffer)))?;
    Ok(([nx, ny, nz], Samples::Shared(shared)))
}

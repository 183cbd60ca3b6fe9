//! Samples in memory that something else owns.

use super::Scalar;
use crate::{Error, Result};
use bytes::Bytes;

/// Samples as a slice of their type, whoever owns them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SampleSlice<'a> {
    /// 8 bits, unsigned.
    U8(&'a [u8]),
    /// 16 bits, unsigned.
    U16(&'a [u16]),
    /// 16 bits, signed.
    I16(&'a [i16]),
    /// 32 bits, signed.
    I32(&'a [i32]),
    /// 32 bits, floating point.
    F32(&'a [f32]),
}

/// Samples in memory that something else owns, such as an array of another language or a mapped
/// file. They are drawn where they are; clones share them.
///
/// ```
/// use splatkit::volume::{Lattice, Samples, Scalar, SharedSamples, Volume};
///
/// // Anything with bytes can own them: `Bytes::from_owner`.
/// let owner = bytes::Bytes::from_static(&[0; 24]);
/// let samples = SharedSamples::new(Scalar::U8, owner)?;
/// let lattice = Lattice::with_spacing([2, 3, 4], glam::DVec3::ONE);
/// let volume = Volume::new(lattice, Samples::Shared(samples))?;
/// assert_eq!(volume.range, [0.0, 0.0]);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct SharedSamples {
    scalar: Scalar,
    /// Whole samples, aligned for their type.
    bytes: Bytes,
}

impl SharedSamples {
    /// Takes samples of a type, in native byte order. Their owner must not change them: pictures of
    /// changed samples are undetermined.
    ///
    /// # Errors
    /// [`Error::Argument`] for bytes that are not whole samples, or that start at an address which
    /// is no multiple of the size of a sample.
    pub fn new(scalar: Scalar, bytes: Bytes) -> Result<Self> {
        let size = scalar.bytes();
        if !bytes.len().is_multiple_of(size) || !bytes.as_ptr().addr().is_multiple_of(size) {
            return Err(Error::Argument(format!(
                "{} bytes at {:p} are no aligned samples of {size} bytes",
                bytes.len(),
                bytes.as_ptr()
            )));
        }
        Ok(Self { scalar, bytes })
    }

    /// Returns the type of the samples.
    pub fn scalar(&self) -> Scalar {
        self.scalar
    }

    /// The bytes of the samples, in native byte order.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Returns the samples as a slice of their type.
    pub fn as_slice(&self) -> SampleSlice<'_> {
        match self.scalar {
            Scalar::U8 => SampleSlice::U8(&self.bytes),
            Scalar::U16 => SampleSlice::U16(bytemuck::cast_slice(&self.bytes)),
            Scalar::I16 => SampleSlice::I16(bytemuck::cast_slice(&self.bytes)),
            Scalar::I32 => SampleSlice::I32(bytemuck::cast_slice(&self.bytes)),
            Scalar::F32 => SampleSlice::F32(bytemuck::cast_slice(&self.bytes)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples, Volume};
    use glam::DVec3;

    /// Owns floats as bytes.
    struct Floats(Vec<f32>);

    impl AsRef<[u8]> for Floats {
        fn as_ref(&self) -> &[u8] {
            bytemuck::cast_slice(&self.0)
        }
    }

    fn shared(values: Vec<f32>) -> Samples {
        let bytes = Bytes::from_owner(Floats(values));
        Samples::Shared(SharedSamples::new(Scalar::F32, bytes).unwrap())
    }

    #[test]
    fn shared_samples_equal_their_copy() {
        let values = vec![1.0, -2.5, 0.0, 7.0];
        let (samples, copy) = (shared(values.clone()), Samples::F32(values));
        assert_eq!(samples, copy);
        assert_eq!((samples.scalar(), samples.len()), (Scalar::F32, 4));
        assert_eq!((samples.value(1), samples.bytes()), (-2.5, copy.bytes()));
        assert_ne!(samples, Samples::I16(vec![1, -2, 0, 7]));
    }

    #[test]
    fn volumes_share_them_unless_values_are_missing() {
        let lattice = Lattice::with_spacing([2, 2, 1], DVec3::ONE);
        let samples = shared(vec![1.0, -2.5, 0.0, 7.0]);
        let start = samples.bytes().as_ptr();
        let volume = Volume::with_missing(lattice.clone(), samples, Some(9.0)).unwrap();
        assert_eq!(volume.samples.bytes().as_ptr(), start);
        assert_eq!((volume.range, volume.about.holes), ([-2.5, 7.0], 0));
        let holes = shared(vec![1.0, f32::NAN, 0.0, 9.0]);
        let volume = Volume::with_missing(lattice, holes, Some(9.0)).unwrap();
        assert_eq!(volume.samples, Samples::F32(vec![1.0, 0.0, 0.0, 0.0]));
        assert_eq!(volume.about.holes, 2);
    }

    #[test]
    fn parts_of_samples_are_refused() {
        let bytes = Bytes::from_owner(Floats(vec![0.0; 4]));
        for part in [bytes.slice(..7), bytes.slice(2..6)] {
            let error = SharedSamples::new(Scalar::F32, part).unwrap_err();
            assert!(error.to_string().contains("no aligned samples"), "{error}");
        }
        assert!(SharedSamples::new(Scalar::I16, bytes.slice(2..6)).is_ok());
    }
}

//! Samples on a regular lattice.

use glam::{DMat3, DVec3};

/// Where the samples of a volume lie: sample (i, j, k) is at `origin + axes · (i, j, k)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Samples along each axis, first axis fastest in memory.
    pub dims: [usize; 3],
    /// World position of sample (0, 0, 0).
    pub origin: DVec3,
    /// Columns are the steps between neighbouring samples (spacing times direction), in world units.
    pub axes: DMat3,
}

impl Lattice {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// World position of a (fractional) index.
    pub fn position(&self, index: DVec3) -> DVec3 {
        self.origin + self.axes * index
    }
}

/// The samples in the type of their file, first axis fastest.
#[derive(Debug, Clone)]
pub enum Samples {
    U8(Vec<u8>),
    U16(Vec<u16>),
    I16(Vec<i16>),
    I32(Vec<i32>),
    F32(Vec<f32>),
}

/// A volume: a lattice and one scalar per sample. Values are finite; `range` holds their smallest and largest.
#[derive(Debug, Clone)]
pub struct Volume {
    pub lattice: Lattice,
    pub samples: Samples,
    pub range: [f64; 2],
}

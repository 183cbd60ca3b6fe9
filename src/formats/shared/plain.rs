//! Where a file holds its samples, in order and uncompressed.

use super::sample_type::{Endian, SampleType};
use crate::{about::Frame, volume::Lattice};
use std::path::PathBuf;

/// Location and layout of the samples in a file: contiguous and not compressed.
pub(crate) struct Plain {
    /// The file that contains the samples.
    pub path: PathBuf,
    /// The byte offset of the first sample.
    pub start: usize,
    pub sample_type: SampleType,
    pub endian: Endian,
    pub lattice: Lattice,
    pub frame: Frame,
}

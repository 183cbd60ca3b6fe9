//! What a caller chooses when a file is read.

use super::RawLayout;
use crate::about::Label;
use glam::DVec3;

/// Which of a file's data to read, and what its bytes mean if it does not say so itself. A format
/// ignores what does not concern it.
///
/// ```
/// use splatkit::formats::ReadOptions;
///
/// let options = ReadOptions { scalar: Some("pressure".into()), ..ReadOptions::default() };
/// assert!(options.raw.is_none());
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// The name of the values to read if a file has several: an array, a column, a property. For
    /// arrays, also one component (`name:x`, `name:1`), the length of a vector (`name:magnitude`),
    /// or an array of the cells (`cell:name`).
    pub scalar: Option<String>,
    /// The layout of a raw volume.
    pub raw: Option<RawLayout>,
    /// Which of several volumes at different times to read, from 0. `None` reads the first.
    pub time: Option<usize>,
    /// Which series of a DICOM folder to read: its number, its UID, or a part of its description.
    pub series: Option<String>,
    /// Which data set of an HDF5 file, or which array of an NPZ archive, to read.
    pub dataset: Option<String>,
    /// The distances between samples along the axes of a volume on a Cartesian lattice, in world
    /// units. They replace those of the file, for files that say none or wrong ones; directions
    /// and the position of the first sample stay. A raw volume has them in its layout.
    pub spacing: Option<DVec3>,
    /// A value that stands for “no value”. Samples of this value are holes, as samples that are
    /// not numbers are.
    pub missing: Option<f64>,
    /// Which channels of a volume of several to read, by their names or their numbers from 0; all
    /// if none is named. `None` reads the first, or the one that [`scalar`](Self::scalar) names.
    pub channels: Option<Vec<String>>,
    /// What is known about labels ([`read_labels`](super::read_labels)). It is for label maps, and
    /// for volumes whose values are all in the table, apart from 0.
    pub labels: Vec<Label>,
}

impl ReadOptions {
    /// Returns options that give only the layout of a raw volume, if there is one.
    pub fn raw(layout: Option<&RawLayout>) -> Self {
        Self { raw: layout.cloned(), ..Self::default() }
    }

    /// Returns options that name only the values to read, if they do.
    pub fn scalar(name: Option<&str>) -> Self {
        Self { scalar: name.map(Into::into), ..Self::default() }
    }
}

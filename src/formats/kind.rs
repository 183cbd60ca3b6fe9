//! Which kind of data a file contains: determined by its extension, and by its content if the
//! extension does not decide.

use super::{
    FORMATS, ReadOptions,
    format::{Format, Which, by_extension, by_magic, find},
};
use crate::{
    Result,
    input::{self, Bytes, Limits, Parts, Source, is_remote},
};
use std::path::Path;

/// The kinds of inputs, each with the function that reads it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// [`load_mesh`](super::load_mesh)
    Mesh,
    /// [`load_volume`](super::load_volume)
    Volume,
    /// [`load_samples`](super::load_samples)
    Samples,
    /// [`load_cells`](super::load_cells)
    Cells,
    /// [`load_gaussians`](super::load_gaussians)
    Gaussians,
    /// [`Hierarchy::open`](crate::hierarchy::Hierarchy::open)
    Hierarchy,
    /// [`Bricks::open`](crate::bricks::Bricks::open)
    Bricks,
}

impl Kind {
    /// Returns the kind of a file, or `None` if neither its name nor its first bytes determine it.
    /// A PLY file with faces is a mesh. A PLY file without faces is a point cloud, or samples if
    /// the caller asks for a scalar ([`ReadOptions::scalar`]), or trained Gaussians if it has their
    /// properties and the caller asks for none. Legacy VTK files are volumes or
    /// samples, depending on their data set.
    ///
    /// Text tables (`.xyz`, `.pts`, `.asc`, `.csv`, `.txt`) are samples if the caller asks for a
    /// scalar. Otherwise `.xyz`, `.pts` and `.asc` are point clouds. `.csv` and `.txt` are point
    /// clouds in these cases, and samples in all others:
    /// - The first line names a colour or a normal but no `value` or `scalar`.
    /// - The first line names nothing but `x`, `y`, `z`.
    /// - The first line has no names and 3, 6 to 9, or 11 and more numbers, or one number: the
    ///   count of points that `.pts` files begin with.
    ///
    /// `.xyzv` files are samples.
    ///
    /// # Errors
    /// Those of opening the file; [`Error::Input`](crate::Error::Input) for a PLY file or a legacy
    /// VTK file with a malformed header, and for a format that this build leaves out.
    pub fn of(
        path: impl AsRef<Path>,
        limits: &Limits,
        options: &ReadOptions,
    ) -> Result<Option<Self>> {
        let path = path.as_ref();
        match Self::at_once(path, limits)? {
            Some(kind) => Ok(Some(kind)),
            None => Self::of_source(&Source::open_any(path, limits)?, options),
        }
    }

    /// Returns the kind of an input if its name or its first bytes determine it, so that a remote
    /// object need not be fetched, and a large file need not fit in memory.
    pub(crate) fn at_once(path: &Path, limits: &Limits) -> Result<Option<Self>> {
        let is_remote = is_remote(path);
        if input::is_store(path) || !is_remote && !path.is_file() {
            return Ok(None);
        }
        let format = match by_extension(FORMATS, path, |_| true) {
            Some(format) => Some(format),
            None => by_magic(FORMATS, &Bytes::open(path, limits)?.beginning(0)?, |_| true),
        };
        let format = format.filter(|format| !format.is_left_out());
        Ok(format.and_then(|format| match format.kind {
            Which::Always(kind @ (Self::Hierarchy | Self::Bricks)) => Some(kind),
            Which::Always(kind) if is_remote => Some(kind),
            Which::Always(_) | Which::Rule(_) => None,
        }))
    }

    /// Returns the kind of a file that comes in parts, by its first bytes, if it can be read in
    /// parts.
    ///
    /// # Errors
    /// [`Error::Absent`](crate::Error::Absent) until they have come.
    pub(crate) fn of_parts(parts: &Parts) -> Result<Option<Self>> {
        let format = by_magic(FORMATS, &Bytes::Parts(parts.clone()).beginning(0)?, |_| true);
        Ok(format.and_then(|format| match format.kind {
            Which::Always(kind @ (Self::Hierarchy | Self::Bricks)) => Some(kind),
            Which::Always(_) | Which::Rule(_) => None,
        }))
    }

    /// As [`of`](Self::of), but reads from an open source, which may be in memory
    /// ([`Source::from_bytes`]).
    ///
    /// # Errors
    /// Those of [`of`](Self::of), except those of opening the file.
    pub fn of_source(source: &Source, options: &ReadOptions) -> Result<Option<Self>> {
        source.unless_changed(Self::find(FORMATS, source, options))
    }

    /// As [`of_source`](Self::of_source), in the formats of a table, but does not check whether the
    /// file changed meanwhile.
    pub(super) fn find(
        table: &[Format],
        source: &Source,
        options: &ReadOptions,
    ) -> Result<Option<Self>> {
        let format = find(table, source, |_| true)?;
        format.map(|format| format.kind.of(source, options)).transpose()
    }
}

//! The single entry point for all formats of scattered samples.

use super::{csv, npy, ply, vtk, vtu};
use crate::{
    Result,
    input::{Limits, Source},
    scattered::Points,
};
use std::path::Path;

/// Reads scattered samples: PLY, VTU, VTP, legacy VTK, NPY, and text tables (CSV, TXT, XYZV). The
/// file's extension selects the format; for other extensions, the first bytes do. `scalar` names
/// the values to read if a file has several.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file of none of these
/// formats.
pub fn load_samples(path: &Path, limits: &Limits, scalar: Option<&str>) -> Result<Points> {
    read_samples(&Source::open(path, limits)?, scalar)
}

/// As [`load_samples`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_samples`], except those of opening the file.
pub fn read_samples(source: &Source, scalar: Option<&str>) -> Result<Points> {
    let _span = tracing::info_span!("load_samples", file = %source.path.display()).entered();
    source.unless_changed(read(source, scalar))
}

/// As [`read_samples`], but does not check whether the file changed meanwhile.
pub(super) fn read(source: &Source, scalar: Option<&str>) -> Result<Points> {
    let extension =
        source.path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let start = &source.bytes()[..source.bytes().len().min(1024)];
    match extension.as_str() {
        "ply" => ply::read_samples(source, scalar),
        "vtu" | "vtp" => vtu::read(source, scalar),
        "vtk" => vtk::read_samples(source, scalar),
        "npy" => npy::read(source),
        "csv" | "txt" | "xyzv" | "xyz" | "pts" | "asc" => csv::read(source, scalar),
        _ if start.starts_with(b"ply") => ply::read_samples(source, scalar),
        _ if start.windows(8).any(|w| w == b"<VTKFile") => vtu::read(source, scalar),
        _ if start.starts_with(b"# vtk DataFile") => vtk::read_samples(source, scalar),
        _ if start.starts_with(b"\x93NUMPY") => npy::read(source),
        _ => Err(source
            .error(
                "path",
                format!("“.{extension}” is not a format of scattered samples that can be read"),
            )
            .hint(
                "scattered samples are read from .ply, .vtu, .vtp, .vtk, .npy, .csv, .txt and \
                 .xyzv",
            )),
    }
}

//! One door for all formats of scattered samples.

use super::{Limits, Source, csv, npy, ply, vtk, vtu};
use crate::{Result, scattered::Points};
use std::path::Path;

/// Reads scattered samples: PLY, VTU, VTP, legacy VTK, NPY, and tables as text (CSV, TXT, XYZV), by the file's extension, or
/// by its first bytes where that is another. `scalar` names the values where a file has several.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file of none of these formats.
pub fn load_samples(path: &Path, limits: &Limits, scalar: Option<&str>) -> Result<Points> {
    let source = Source::open(path, limits)?;
    let _span = tracing::info_span!("load_samples", file = %path.display()).entered();
    source.unless_changed(read(&source, scalar))
}

/// As [`load_samples`], of a file that is open.
pub(super) fn read(source: &Source, scalar: Option<&str>) -> Result<Points> {
    let extension = source.path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
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
            .error("path", format!("“.{extension}” is no format of scattered samples that can be read"))
            .hint("scattered samples are read from .ply, .vtu, .vtp, .vtk, .npy, .csv, .txt and .xyzv")),
    }
}

//! The entry points for all formats: meshes and point clouds, volumes, scattered samples, cells,
//! trained Gaussians.

use super::{
    FORMATS, ReadOptions,
    foreign::advice,
    format::{Format, VolumeReader, extensions, find, find_volume, listed},
    shared::{anatomy, visible::keep_visible},
};
use crate::{
    Error, Result,
    cells::Cells,
    gaussians::Gaussians,
    input::{Limits, Source},
    scattered::Points,
    surface::Mesh,
    volume::Volume,
};
use std::path::Path;

/// Reads a mesh or point cloud. The file's extension selects the format; for other extensions, the
/// first bytes do. [`FORMATS`] lists the formats.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file that is in no
/// format of meshes or point clouds.
pub fn load_mesh(path: impl AsRef<Path>, limits: &Limits, options: &ReadOptions) -> Result<Mesh> {
    read_mesh(&Source::open_any(path.as_ref(), limits)?, options)
}

/// As [`load_mesh`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_mesh`], except those of opening the file.
pub fn read_mesh(source: &Source, options: &ReadOptions) -> Result<Mesh> {
    let _span = tracing::info_span!("load_mesh", file = %source.path.display()).entered();
    let mut mesh = source.unless_changed(mesh_of(FORMATS, source, options))?;
    if let Some(anatomy) =
        anatomy::stated(source.bytes()).filter(|_| mesh.about.orientation.is_none())
    {
        anatomy.place_mesh(&mut mesh);
    }
    Ok(mesh)
}

/// As [`read_mesh`], in the formats of a table, but does not check whether the file changed
/// meanwhile.
pub(super) fn mesh_of(table: &[Format], source: &Source, options: &ReadOptions) -> Result<Mesh> {
    let may = |format: &Format| format.mesh.is_some();
    match find(table, source, may)?.and_then(|format| format.mesh) {
        Some(read) => {
            let mut mesh = read(source, options)?;
            keep_visible(source, &mut mesh);
            Ok(mesh)
        }
        None => Err(foreign(table, source).unwrap_or_else(|| {
            let message = format!("“.{}” is not a mesh format that can be read", named(source));
            source
                .error("path", message)
                .hint(format!("meshes and point clouds are read from {}", extensions(table, may)))
        })),
    }
}

/// Reads a volume. The extension selects the format if it is one of a volume. Any other file is
/// read as raw if the options give its layout, and otherwise by its first bytes. World units are
/// those of the file. [`FORMATS`] lists the formats.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not such a volume,
/// [`Error::Limit`](crate::Error::Limit) and [`Error::File`](crate::Error::File) as for every
/// input.
pub fn load_volume(
    path: impl AsRef<Path>,
    limits: &Limits,
    options: &ReadOptions,
) -> Result<Volume> {
    read_volume(&Source::open_any(path.as_ref(), limits)?, options)
}

/// As [`load_volume`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_volume`], except those of opening the file.
pub fn read_volume(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let volume = source.unless_changed(volume_of(FORMATS, source, options))?;
    let volume = volume.with_guessed_labels().with_label_table(&options.labels);
    if !options.labels.is_empty() && volume.about.labels.is_none() {
        tracing::warn!(
            "{}: the table of labels is not used: it lacks some of the values, or they are no \
             whole numbers",
            source.path.display()
        );
    }
    Ok(volume)
}

/// As [`read_volume`], in the formats of a table, but does not check whether the file changed
/// meanwhile.
pub(super) fn volume_of(
    table: &[Format],
    source: &Source,
    options: &ReadOptions,
) -> Result<Volume> {
    let format = find_volume(table, source, options.raw.is_some())?;
    match (format.and_then(|format| format.volume), &options.raw) {
        (Some(VolumeReader::Plain(read)), _) => spaced(source, read(source, options)?, options),
        (Some(VolumeReader::Described(read)), Some(layout)) => read(source, layout, options),
        _ => {
            if let Some(error) = foreign(table, source) {
                return Err(error);
            }
            let describes_itself =
                |format: &&Format| matches!(format.volume, Some(VolumeReader::Plain(_)));
            let names = table.iter().filter(describes_itself).map(|format| format.name.into());
            let names = listed(names.collect(), "or");
            Err(source
                .error("file", format!("is not a volume that can be read ({names})"))
                .hint("to read a raw file, give its dimensions and its sample type"))
        }
    }
}

/// Sets the distances between samples that the options give.
fn spaced(source: &Source, mut volume: Volume, options: &ReadOptions) -> Result<Volume> {
    if let Some(spacing) = options.spacing {
        let lattice = volume.lattice.with_steps_of(spacing);
        volume.lattice = lattice.map_err(|message| source.error("spacing", message))?;
    }
    Ok(volume)
}

/// Reads scattered samples. The file's extension selects the format; for other extensions, the
/// first bytes do. [`FORMATS`] lists the formats.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file that is in no
/// format of scattered samples.
pub fn load_samples(
    path: impl AsRef<Path>,
    limits: &Limits,
    options: &ReadOptions,
) -> Result<Points> {
    read_samples(&Source::open_any(path.as_ref(), limits)?, options)
}

/// As [`load_samples`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_samples`], except those of opening the file.
pub fn read_samples(source: &Source, options: &ReadOptions) -> Result<Points> {
    let _span = tracing::info_span!("load_samples", file = %source.path.display()).entered();
    source.unless_changed(samples_of(FORMATS, source, options))
}

/// As [`read_samples`], in the formats of a table, but does not check whether the file changed
/// meanwhile.
pub(super) fn samples_of(
    table: &[Format],
    source: &Source,
    options: &ReadOptions,
) -> Result<Points> {
    let may = |format: &Format| format.samples.is_some();
    match find(table, source, may)?.and_then(|format| format.samples) {
        Some(read) => read(source, options),
        None => {
            if let Some(error) = foreign(table, source) {
                return Err(error);
            }
            let named = named(source);
            Err(source
                .error(
                    "path",
                    format!("“.{named}” is not a format of scattered samples that can be read"),
                )
                .hint(format!("scattered samples are read from {}", extensions(table, may))))
        }
    }
}

/// Reads cells. The file's extension selects the format; for other extensions, the first bytes do.
/// [`FORMATS`] lists the formats.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file that is in no
/// format of cells.
pub fn load_cells(path: impl AsRef<Path>, limits: &Limits, options: &ReadOptions) -> Result<Cells> {
    read_cells(&Source::open(path.as_ref(), limits)?, options)
}

/// As [`load_cells`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_cells`], except those of opening the file.
pub fn read_cells(source: &Source, options: &ReadOptions) -> Result<Cells> {
    let _span = tracing::info_span!("load_cells", file = %source.path.display()).entered();
    source.unless_changed(cells_of(FORMATS, source, options))
}

/// As [`read_cells`], in the formats of a table, but does not check whether the file changed
/// meanwhile.
pub(super) fn cells_of(table: &[Format], source: &Source, options: &ReadOptions) -> Result<Cells> {
    let may = |format: &Format| format.cells.is_some();
    match find(table, source, may)?.and_then(|format| format.cells) {
        Some(read) => read(source, options),
        None => Err(source
            .error(
                "path",
                format!("“.{}” is not a format of cells that can be read", named(source)),
            )
            .hint(format!("cells are read from {}", extensions(table, may)))),
    }
}

/// Reads trained 3D Gaussians. The file's extension selects the format; for other extensions, the
/// first bytes do. [`FORMATS`] lists the formats.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file that is in no
/// format of Gaussians.
pub fn load_gaussians(
    path: impl AsRef<Path>,
    limits: &Limits,
    options: &ReadOptions,
) -> Result<Gaussians> {
    read_gaussians(&Source::open(path.as_ref(), limits)?, options)
}

/// As [`load_gaussians`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_gaussians`], except those of opening the file.
pub fn read_gaussians(source: &Source, options: &ReadOptions) -> Result<Gaussians> {
    let _span = tracing::info_span!("load_gaussians", file = %source.path.display()).entered();
    source.unless_changed(gaussians_of(FORMATS, source, options))
}

/// As [`read_gaussians`], in the formats of a table, but does not check whether the file changed
/// meanwhile.
pub(super) fn gaussians_of(
    table: &[Format],
    source: &Source,
    options: &ReadOptions,
) -> Result<Gaussians> {
    let may = |format: &Format| format.gaussians.is_some();
    match find(table, source, may)?.and_then(|format| format.gaussians) {
        Some(read) => read(source, options),
        None => {
            let named = named(source);
            let message = format!("“.{named}” is not a format of trained Gaussians");
            let hint = format!("trained Gaussians are read from {}", extensions(table, may));
            Err(source.error("path", message).hint(hint))
        }
    }
}

/// Returns the error for a file of a kind that is known, but not read. Files of a format of the
/// table, of which another function reads them, are none.
fn foreign(table: &[Format], source: &Source) -> Option<Error> {
    let is_read = find(table, source, |_| true).ok().flatten().is_some();
    let advice = advice(source).filter(|_| !is_read)?;
    let message = format!("is {}, which is not read", advice.what);
    Some(source.error("file", message).hint(advice.hint))
}

/// Returns a file's extension in lower case, for messages.
fn named(source: &Source) -> String {
    source.path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase()
}

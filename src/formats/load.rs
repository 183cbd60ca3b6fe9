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
    warning,
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
    let names = ["a mesh format", "meshes and point clouds"];
    let mut mesh = reader(table, source, names, |format| format.mesh)?(source, options)?;
    keep_visible(source, &mut mesh);
    Ok(mesh)
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
        warning::give!(
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
    let names = ["a format of scattered samples", "scattered samples"];
    reader(table, source, names, |format| format.samples)?(source, options)
}

/// Reads cells. The file's extension selects the format; for other extensions, the first bytes do.
/// [`FORMATS`] lists the formats.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file that is in no
/// format of cells.
pub fn load_cells(path: impl AsRef<Path>, limits: &Limits, options: &ReadOptions) -> Result<Cells> {
    read_cells(&Source::open_any(path.as_ref(), limits)?, options)
}

/// As [`load_cells`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_cells`], except those of opening the file.
pub fn read_cells(source: &Source, options: &ReadOptions) -> Result<Cells> {
    let _span = tracing::info_span!("load_cells", file = %source.path.display()).entered();
    let read = reader(FORMATS, source, ["a format of cells", "cells"], |format| format.cells);
    source.unless_changed(read.and_then(|read| read(source, options)))
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
    read_gaussians(&Source::open_any(path.as_ref(), limits)?, options)
}

/// As [`load_gaussians`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_gaussians`], except those of opening the file.
pub fn read_gaussians(source: &Source, options: &ReadOptions) -> Result<Gaussians> {
    let _span = tracing::info_span!("load_gaussians", file = %source.path.display()).entered();
    let names = ["a format of trained Gaussians", "trained Gaussians"];
    let read = reader(FORMATS, source, names, |format| format.gaussians);
    source.unless_changed(read.and_then(|read| read(source, options)))
}

/// Returns the reader of a kind of data that a table has for a file. `names` are what a format of
/// the kind and what such data are called.
fn reader<R>(
    table: &[Format],
    source: &Source,
    names: [&str; 2],
    of: impl Fn(&Format) -> Option<R>,
) -> Result<R> {
    let may = |format: &Format| of(format).is_some();
    if let Some(read) = find(table, source, may)?.and_then(&of) {
        return Ok(read);
    }
    Err(foreign(table, source).unwrap_or_else(|| {
        let [format, data] = names;
        let message = format!("“.{}” is not {format} that can be read", named(source));
        let hint = format!("{data} are read from {}", extensions(table, may));
        source.error("path", message).hint(hint)
    }))
}

/// Returns the error for a file of a kind that is known, but not read. There is none for files that
/// another function reads.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{error::Error, input::testing::Folder};

    /// Each function opens files and folders, and says in the same way what it does not read.
    #[test]
    fn all_kinds_refuse_what_they_do_not_read() {
        let (limits, options) = (Limits::default(), ReadOptions::default());
        let folder = Folder::new();
        let file = folder.write("a.xcf", b"gimp xcf v011");
        let all = |path: &Path| {
            [
                load_mesh(path, &limits, &options).map(drop),
                load_samples(path, &limits, &options).map(drop),
                load_cells(path, &limits, &options).map(drop),
                load_gaussians(path, &limits, &options).map(drop),
            ]
        };
        let data = ["meshes and point clouds", "scattered samples", "cells", "trained Gaussians"];
        for (result, data) in all(&file).into_iter().zip(data) {
            let Err(Error::Input { message, hint, .. }) = result else { panic!("{data}") };
            assert!(message.starts_with("“.xcf” is not a ") && message.ends_with("can be read"));
            assert!(hint.is_some_and(|hint| hint.starts_with(data)), "{message}");
        }
        let folder = file.parent().expect("a folder");
        let errors = all(folder).map(|result| result.expect_err("a folder").to_string());
        assert!(errors.iter().all(|error| !error.contains("regular file")), "{errors:?}");
    }
}

//! Readers and writers of files, one module per format.
//!
//! [`load_mesh`], [`load_volume`] and [`load_samples`] look at the name and the first bytes, and
//! return a mesh (or point cloud), a volume or scattered samples; [`Kind`] says which of them a
//! file needs. [`read_mesh`], [`read_volume`] and [`read_samples`] do the same with bytes in memory
//! ([`Source::from_bytes`]). All of them read through a [`Source`], within its [`Limits`].

#![deny(clippy::disallowed_methods)]

pub mod csv;
pub mod e57;
pub mod gltf;
mod kind;
pub mod las;
mod load_mesh;
mod load_samples;
pub mod npy;
pub mod nrrd;
pub mod obj;
pub mod pcd;
pub mod ply;
pub mod raw;
mod shared;
pub mod stl;
mod stream;
#[cfg(all(test, any(target_os = "linux", target_os = "macos")))]
mod vanishing;
mod volume_stream;
pub mod vti;
pub mod vtk;
mod vtk_array;
mod vtk_cells;
mod vtk_xml;
pub mod vtr;
pub mod vtu;
pub mod xyz;

pub use kind::Kind;
pub use load_mesh::{load_mesh, read_mesh};
pub use load_samples::{load_samples, read_samples};
pub use raw::RawLayout;
pub use shared::sample_type::{Endian, SampleType};
pub(crate) use shared::texture::decode as decode_picture;
pub(crate) use stream::StreamPoint;
pub use stream::{Counts, Stream};
pub use volume_stream::VolumeStream;

use crate::{
    Result,
    input::{Limits, Source},
    volume::Volume,
};
use std::path::Path;

/// Reads a volume. The extensions `.vti`, `.vtr`, `.vtk`, `.nrrd` and `.nhdr` select the format.
/// Any other file is read as raw if `raw` gives its layout, and otherwise by its first bytes. World
/// units are those of the file.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a file that is not such a volume,
/// [`Error::Limit`](crate::Error::Limit) and [`Error::File`](crate::Error::File) as for every
/// input.
pub fn load_volume(path: &Path, limits: &Limits, raw: Option<&RawLayout>) -> Result<Volume> {
    read_volume(&Source::open(path, limits)?, raw)
}

/// As [`load_volume`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_volume`], except those of opening the file.
pub fn read_volume(source: &Source, raw: Option<&RawLayout>) -> Result<Volume> {
    source.unless_changed(volume_of(source, raw))
}

/// As [`read_volume`], but does not check whether the file changed meanwhile.
fn volume_of(source: &Source, raw: Option<&RawLayout>) -> Result<Volume> {
    let extension = source.path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let beginning = &source.bytes()[..source.bytes().len().min(1024)];
    match (extension.as_deref(), raw) {
        (Some("vti"), _) => vti::read(source),
        (Some("vtr"), _) => vtr::read(source),
        (Some("vtk"), _) => vtk::read_volume(source),
        (Some("nrrd" | "nhdr"), _) => nrrd::read(source),
        (_, Some(layout)) => raw::read(source, layout),
        _ if beginning.starts_with(b"NRRD") => nrrd::read(source),
        _ if beginning.starts_with(b"# vtk DataFile") => vtk::read_volume(source),
        _ if beginning.windows(15).any(|w| w == b"RectilinearGrid") => vtr::read(source),
        _ if beginning.windows(8).any(|w| w == b"<VTKFile") => vti::read(source),
        _ => Err(source
            .error("file", "is not a volume that can be read (VTI, VTR, VTK or NRRD)")
            .hint("to read a raw file, give its dimensions and its sample type")),
    }
}

/// Returns the error for texture coordinates that are not finite in 32 bits.
fn uv_error(source: &Source, place: impl Into<String>, uv: glam::Vec2) -> crate::Error {
    let message =
        format!("the texture coordinates {uv} are not finite; numbers up to 3e38 are expected");
    source
        .error(place, message)
        .hint("write the file again with finite texture coordinates, or without its pictures")
}

//! Readers and writers of files, one module per format. [`FORMATS`] is the table of all formats.
//!
//! [`load_mesh`], [`load_volume`], [`load_samples`], [`load_cells`] and [`load_gaussians`] look at
//! the name and the first bytes. They return a mesh (or point cloud), a volume, scattered samples,
//! cells or trained Gaussians. [`Kind`] says which of them a file needs. [`read_mesh`],
//! [`read_volume`], [`read_samples`], [`read_cells`] and [`read_gaussians`] do the same with bytes
//! in memory ([`Source::from_bytes`]). All of them read through a [`Source`], within its
//! [`Limits`](crate::input::Limits).

#![deny(clippy::disallowed_methods)]

mod array;
pub mod csv;
#[cfg(feature = "dicom")]
pub mod dicom;
#[cfg(feature = "e57")]
pub mod e57;
mod foreign;
mod form;
mod format;
#[cfg(feature = "gltf")]
pub mod gltf;
#[cfg(feature = "hdf5")]
pub mod hdf5;
mod kind;
pub mod ksplat;
mod label_table;
#[cfg(feature = "las")]
pub mod las;
mod load;
pub mod mhd;
pub mod mrc;
pub mod nifti;
pub mod npy;
#[cfg(feature = "npz")]
pub mod npz;
pub mod nrrd;
#[cfg(feature = "obj")]
pub mod obj;
pub mod off;
mod options;
pub mod pcd;
pub mod picture;
#[cfg(feature = "ply")]
pub mod ply;
mod points;
pub mod raw;
mod series;
mod shared;
#[cfg(feature = "sog")]
pub mod sog;
pub mod splat;
pub mod spz;
pub mod stl;
mod stream;
mod table;
#[cfg(feature = "tiff")]
pub mod tiff;
mod times;
#[cfg(all(test, any(target_os = "linux", target_os = "macos")))]
mod vanishing;
mod volume_stream;
#[cfg(feature = "vtk")]
pub mod vtk;
mod vtu_write;
pub mod xyz;
#[cfg(feature = "zarr")]
pub mod zarr;

pub use array::{Array, Place, arrays};
pub use foreign::{Advice, advice};
pub(crate) use form::StreamPoint;
pub use form::{Attribute, Counts, NumberType, Records};
pub use format::{Content, Format, Holding};
pub use kind::Kind;
pub use label_table::read_labels;
pub use load::{
    load_cells, load_gaussians, load_mesh, load_samples, load_volume, read_cells, read_gaussians,
    read_mesh, read_samples, read_volume,
};
pub use options::ReadOptions;
pub(crate) use points::{PointLayout, PointWriter, write_points};
pub use raw::RawLayout;
pub use series::{Series, series};
pub use shared::sample_type::{Endian, SampleType};
pub(crate) use shared::texture::decode as decode_picture;
pub(crate) use stream::Settled;
pub use stream::Stream;
pub use table::FORMATS;
pub use times::{Times, times};
pub use volume_stream::VolumeStream;
pub use vtu_write::write_cells;

use crate::input::Source;

/// Returns the error for texture coordinates that are not finite in 32 bits.
fn uv_error(source: &Source, place: impl Into<String>, uv: glam::Vec2) -> crate::Error {
    let message =
        format!("the texture coordinates {uv} are not finite; numbers up to 3e38 are expected");
    source
        .error(place, message)
        .hint("write the file again with finite texture coordinates, or without its pictures")
}

//! The single entry point for all mesh and point cloud formats.

use super::{e57, gltf, las, obj, pcd, ply, stl, xyz};
use crate::{
    Result,
    input::{Limits, Source},
    surface::Mesh,
};
use std::path::Path;

/// Reads a mesh or point cloud: PLY, OBJ, glTF, GLB, STL, LAS, LAZ, E57, PCD, or a text table (XYZ,
/// PTS, ASC, CSV, TXT). The file's extension selects the format; for other extensions, the first
/// bytes do.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file of none of these
/// formats.
pub fn load_mesh(path: &Path, limits: &Limits) -> Result<Mesh> {
    read_mesh(&Source::open(path, limits)?)
}

/// As [`load_mesh`], but reads from an open source, which may be in memory
/// ([`Source::from_bytes`]).
///
/// # Errors
/// Those of [`load_mesh`], except those of opening the file.
pub fn read_mesh(source: &Source) -> Result<Mesh> {
    let _span = tracing::info_span!("load_mesh", file = %source.path.display()).entered();
    source.unless_changed(read(source))
}

/// As [`read_mesh`], but does not check whether the file changed meanwhile.
pub(super) fn read(source: &Source) -> Result<Mesh> {
    let extension =
        source.path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let start = source.bytes().trim_ascii_start();
    match extension.as_str() {
        "ply" => ply::read(source),
        "obj" => obj::read(source),
        "gltf" | "glb" => gltf::read(source),
        "stl" => stl::read(source),
        "las" | "laz" => las::read(source),
        "e57" => e57::read(source),
        "pcd" => pcd::read(source),
        "xyz" | "pts" | "asc" | "csv" | "txt" => xyz::read(source),
        _ if start.starts_with(b"ply") => ply::read(source),
        _ if start.starts_with(b"glTF") || start.starts_with(b"{") => gltf::read(source),
        _ if start.starts_with(b"LASF") => las::read(source),
        _ if start.starts_with(b"ASTM-E57") => e57::read(source),
        _ if start.starts_with(b"# .PCD") => pcd::read(source),
        _ if start.starts_with(b"solid ") => stl::read(source),
        _ => Err(source
            .error("path", format!("“.{extension}” is not a mesh format that can be read"))
            .hint(
                "meshes and point clouds are read from .ply, .obj, .gltf, .glb, .stl, .las, .laz, \
                 .e57, .pcd, .xyz, .pts, .asc, .csv and .txt",
            )),
    }
}

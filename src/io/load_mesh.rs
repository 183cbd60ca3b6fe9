//! One door for all mesh and cloud formats.

use super::{Limits, Source, gltf, obj, ply};
use crate::{Result, surface::Mesh};
use std::path::Path;

/// Reads a mesh or cloud: PLY, OBJ, glTF or GLB, by the file's extension, or by its first bytes where that is another.
///
/// # Errors
/// Those of the format's reader; [`Error::Input`](crate::Error::Input) for a file of none of these formats.
pub fn load_mesh(path: &Path, limits: &Limits) -> Result<Mesh> {
    let source = Source::open(path, limits)?;
    let _span = tracing::info_span!("load_mesh", file = %path.display()).entered();
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let start = source.bytes().trim_ascii_start();
    match extension.as_str() {
        "ply" => ply::read(&source),
        "obj" => obj::read(&source),
        "gltf" | "glb" => gltf::read(&source),
        _ if start.starts_with(b"ply") => ply::read(&source),
        _ if start.starts_with(b"glTF") || start.starts_with(b"{") => gltf::read(&source),
        _ => Err(source
            .error("path", format!("“.{extension}” is no mesh format that can be read"))
            .hint("meshes and clouds are read from .ply, .obj, .gltf and .glb")),
    }
}

//! Which kind of data a file contains: determined by its extension, and by its content if the
//! extension does not decide.

use super::{ply, vtk, xyz};
use crate::{
    Result,
    input::{Limits, Source},
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
    /// [`Hierarchy::open`](crate::hierarchy::Hierarchy::open)
    Hierarchy,
    /// [`Bricks::open`](crate::bricks::Bricks::open)
    Bricks,
}

/// The first bytes of LAS, E57 and PCD files, and of STL text files.
const MESHES: [&[u8]; 4] = [b"LASF", b"ASTM-E57", b"# .PCD", b"solid "];

impl Kind {
    /// Returns the kind of a file, or `None` if neither its name nor its first bytes determine it.
    /// A PLY file with faces is a mesh. A PLY file without faces is a point cloud, or samples if
    /// the caller asks for a scalar (`with_scalar`). Legacy VTK files are volumes or samples,
    /// depending on their data set.
    ///
    /// Text tables (`.xyz`, `.pts`, `.asc`, `.csv`, `.txt`) are samples if the caller asks for a
    /// scalar. Otherwise `.xyz`, `.pts` and `.asc` are point clouds. `.csv` and `.txt` are point
    /// clouds in these cases, and samples in all others:
    /// - The first line names a colour or a normal but no `value` or `scalar`.
    /// - The first line names nothing but `x`, `y`, `z`.
    /// - The first line has no names and 3, 6, 7 or 9 numbers, or one number: the count of points
    ///   that `.pts` files begin with.
    ///
    /// `.xyzv` files are samples.
    ///
    /// # Errors
    /// Those of opening the file; [`Error::Input`](crate::Error::Input) for a PLY file or a legacy
    /// VTK file with a malformed header.
    pub fn of(path: &Path, limits: &Limits, with_scalar: bool) -> Result<Option<Self>> {
        Self::of_source(&Source::open(path, limits)?, with_scalar)
    }

    /// As [`of`](Self::of), but reads from an open source, which may be in memory
    /// ([`Source::from_bytes`]).
    ///
    /// # Errors
    /// Those of [`of`](Self::of), except those of opening the file.
    pub fn of_source(source: &Source, with_scalar: bool) -> Result<Option<Self>> {
        source.unless_changed(Self::find(source, with_scalar))
    }

    fn find(source: &Source, with_scalar: bool) -> Result<Option<Self>> {
        let extension = source.path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let start = &source.bytes()[..source.bytes().len().min(1024)];
        let has = |word: &[u8]| start.windows(word.len()).any(|w| w == word);
        let of_ply = || {
            Ok(Some(if with_scalar && !ply::has_faces(source)? {
                Self::Samples
            } else {
                Self::Mesh
            }))
        };
        let of_vtk =
            || Ok(Some(if vtk::holds_volume(source)? { Self::Volume } else { Self::Samples }));
        match extension.as_deref() {
            Some("ply") => return of_ply(),
            Some("vtk") => return of_vtk(),
            Some("splk") => return Ok(Some(Self::Hierarchy)),
            Some("splv") => return Ok(Some(Self::Bricks)),
            Some("obj" | "gltf" | "glb" | "stl" | "las" | "laz" | "e57" | "pcd") => {
                return Ok(Some(Self::Mesh));
            }
            Some("xyz" | "pts" | "asc") => {
                return Ok(Some(if with_scalar { Self::Samples } else { Self::Mesh }));
            }
            Some("csv" | "txt") if !with_scalar && xyz::is_cloud(source) => {
                return Ok(Some(Self::Mesh));
            }
            Some("vti" | "vtr" | "nrrd" | "nhdr") => return Ok(Some(Self::Volume)),
            Some("vtu" | "vtp" | "csv" | "txt" | "xyzv" | "npy") => return Ok(Some(Self::Samples)),
            _ => {}
        }
        if start.starts_with(b"SPLK") {
            return Ok(Some(Self::Hierarchy));
        }
        if start.starts_with(b"SPLV") {
            return Ok(Some(Self::Bricks));
        }
        let text = start.trim_ascii_start();
        if text.starts_with(b"ply") {
            return of_ply();
        }
        if start.starts_with(b"# vtk DataFile") {
            return of_vtk();
        }
        Ok(if has(b"<VTKFile") {
            Some(if has(b"UnstructuredGrid") || has(b"PolyData") {
                Self::Samples
            } else {
                Self::Volume
            })
        } else if start.starts_with(b"NRRD") {
            Some(Self::Volume)
        } else if start.starts_with(b"\x93NUMPY") {
            Some(Self::Samples)
        } else if text.starts_with(b"glTF")
            || text.starts_with(b"{")
            || MESHES.iter().any(|m| start.starts_with(m))
        {
            Some(Self::Mesh)
        } else {
            None
        })
    }
}

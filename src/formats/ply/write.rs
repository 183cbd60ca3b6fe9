//! Writes PLY: binary, little-endian, positions as 32-bit floats.

use crate::{Error, Result, disk, surface::Mesh};
use std::{io::Write, path::Path};

/// Writes positions, normals, colours and triangles. Positions include the mesh's origin and are
/// rounded to 32 bits. Texture coordinates and materials are not written.
///
/// # Errors
/// [`Error::Output`] if the file cannot be written; [`Error::Argument`] for attributes whose number
/// does not match the positions.
pub fn write(mesh: &Mesh, path: impl AsRef<Path>) -> Result<()> {
    let count = mesh.positions.len();
    for (name, length) in [("normals", mesh.normals.len()), ("colors", mesh.colors.len())] {
        if length != 0 && length != count {
            return Err(Error::Argument(format!(
                "the mesh has {length} {name} where {count} are needed"
            )));
        }
    }
    disk::write_with(path.as_ref(), |out| write_to(mesh, out))
}

fn write_to(mesh: &Mesh, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    if !mesh.normals.is_empty() {
        writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
    }
    if !mesh.colors.is_empty() {
        writeln!(
            out,
            "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha"
        )?;
    }
    if !mesh.triangles.is_empty() {
        writeln!(
            out,
            "element face {}\nproperty list uchar uint vertex_indices",
            mesh.triangles.len()
        )?;
    }
    writeln!(out, "end_header")?;
    for (index, position) in mesh.positions.iter().enumerate() {
        out.write_all(bytemuck::bytes_of(
            &(mesh.origin + position.as_dvec3()).as_vec3().to_array().map(little),
        ))?;
        if let Some(normal) = mesh.normals.get(index) {
            out.write_all(bytemuck::bytes_of(&normal.to_array().map(little)))?;
        }
        if let Some(color) = mesh.colors.get(index) {
            out.write_all(color)?;
        }
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        out.write_all(bytemuck::bytes_of(&triangle.map(u32::to_le_bytes)))?;
    }
    Ok(())
}

fn little(value: f32) -> [u8; 4] {
    value.to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        formats::{ReadOptions, ply},
        input::testing::*,
    };

    #[test]
    fn what_is_written_reads_back() {
        let folder = Folder::new();
        for mesh in
            [Mesh::knot(20, 5), Mesh::cube(2.0), Mesh { triangles: Vec::new(), ..Mesh::sphere(1) }]
        {
            let path = folder.write("mesh.ply", b"");
            write(&mesh, &path).unwrap();
            let read =
                read_with(&path, |source| ply::read(source, &ReadOptions::default())).unwrap();
            assert_eq!(read.triangles, mesh.triangles);
            assert_eq!(read.colors, mesh.colors);
            assert_eq!(read.normals.len(), mesh.normals.len());
            for (a, b) in read.positions.iter().zip(&mesh.positions) {
                assert!(((read.origin + a.as_dvec3()) - b.as_dvec3()).length() < 1e-6);
            }
        }
    }
}

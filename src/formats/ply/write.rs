//! Writes PLY: binary, little-endian.

use crate::{
    Error, Result, disk,
    math::keep::{self, Keeper},
    surface::Mesh,
};
use glam::DVec3;
use std::{io::Write, path::Path};

/// The property of the radii.
pub const RADIUS: &str = "radius";

/// Returns the name of the property that [`write()`] gives the values of a mesh: their own, without
/// spaces.
pub fn value_name(mesh: &Mesh) -> String {
    match mesh.about.name.trim() {
        "" => "value".into(),
        name => name.split_whitespace().collect::<Vec<_>>().join("_"),
    }
}

/// Writes positions, normals, colours, values, radii and triangles. Positions include the mesh's
/// origin. They have 64 bits if that is not 0, else 32. Texture coordinates, materials and lines
/// are not written.
///
/// # Errors
/// [`Error::Output`] if the file cannot be written; [`Error::Argument`] for attributes whose number
/// does not match the positions, and for positions that the file rounds too much.
pub fn write(mesh: &Mesh, path: impl AsRef<Path>) -> Result<()> {
    let count = mesh.positions.len();
    let lists = [
        ("normals", mesh.normals.len()),
        ("colors", mesh.colors.len()),
        ("values", mesh.values.len()),
        ("radii", mesh.radii.len()),
    ];
    for (name, length) in lists {
        if length != 0 && length != count {
            return Err(Error::Argument(format!(
                "the mesh has {length} {name} where {count} are needed"
            )));
        }
    }
    let ends = keep::around(mesh.positions.iter().map(|place| place.as_dvec3()));
    let keeper = Keeper::new("PLY", ends);
    mesh.positions.iter().map(|place| place.as_dvec3()).try_for_each(|place| {
        let there = mesh.origin + place;
        let written = if is_far(mesh) { there } else { keep::single(there) };
        keeper.check(there, (written - mesh.origin) - place)
    })?;
    disk::write_with(path.as_ref(), |out| write_to(mesh, out))
}

/// Returns whether positions have 64 bits.
fn is_far(mesh: &Mesh) -> bool {
    mesh.origin != DVec3::ZERO
}

fn write_to(mesh: &Mesh, out: &mut impl Write) -> std::io::Result<()> {
    write_header(mesh, out)?;
    let is_far = is_far(mesh);
    for (index, position) in mesh.positions.iter().enumerate() {
        match is_far {
            true => out.write_all(bytemuck::bytes_of(
                &(mesh.origin + position.as_dvec3()).to_array().map(f64::to_le_bytes),
            ))?,
            false => out.write_all(bytemuck::bytes_of(&position.to_array().map(little)))?,
        }
        if let Some(normal) = mesh.normals.get(index) {
            out.write_all(bytemuck::bytes_of(&normal.to_array().map(little)))?;
        }
        if let Some(color) = mesh.colors.get(index) {
            out.write_all(color)?;
        }
        for value in [mesh.values.get(index), mesh.radii.get(index)].into_iter().flatten() {
            out.write_all(&little(*value))?;
        }
    }
    for triangle in &mesh.triangles {
        out.write_all(&[3])?;
        out.write_all(bytemuck::bytes_of(&triangle.map(u32::to_le_bytes)))?;
    }
    Ok(())
}

fn write_header(mesh: &Mesh, out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    let kind = if is_far(mesh) { "double" } else { "float" };
    writeln!(out, "property {kind} x\nproperty {kind} y\nproperty {kind} z")?;
    if !mesh.normals.is_empty() {
        writeln!(out, "property float nx\nproperty float ny\nproperty float nz")?;
    }
    if !mesh.colors.is_empty() {
        writeln!(
            out,
            "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha"
        )?;
    }
    if !mesh.values.is_empty() {
        writeln!(out, "property float {}", value_name(mesh))?;
    }
    if !mesh.radii.is_empty() {
        writeln!(out, "property float {RADIUS}")?;
    }
    if !mesh.triangles.is_empty() {
        let count = mesh.triangles.len();
        writeln!(out, "element face {count}\nproperty list uchar uint vertex_indices")?;
    }
    writeln!(out, "end_header")
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

    /// A scan far from the origin keeps its millimetres, and values and radii come with it.
    #[test]
    fn far_points_values_and_radii_read_back() {
        let folder = Folder::new();
        let mut cloud = Mesh { triangles: Vec::new(), ..Mesh::sphere(1) };
        cloud.origin = DVec3::new(500_000.125, 4_600_000.5, -3.0);
        cloud.values = (0..cloud.positions.len()).map(|at| at as f32).collect();
        cloud.radii = cloud.values.iter().map(|value| 0.5 * value).collect();
        cloud.about.name = "mean curvature".into();
        let path = folder.write("far.ply", b"");
        write(&cloud, &path).unwrap();
        let options = ReadOptions { scalar: Some(value_name(&cloud)), ..ReadOptions::default() };
        let read = read_with(&path, |source| ply::read(source, &options)).unwrap();
        for (a, b) in read.positions.iter().zip(&cloud.positions) {
            let offset = (read.origin + a.as_dvec3()) - (cloud.origin + b.as_dvec3());
            assert!(offset.length() < 1e-6, "{offset}");
        }
        assert_eq!((read.about.name.as_str(), read.values), ("mean_curvature", cloud.values));
        let options = ReadOptions::scalar(Some(RADIUS));
        let read = read_with(&path, |source| ply::read(source, &options)).unwrap();
        assert_eq!(read.values, cloud.radii);
    }
}

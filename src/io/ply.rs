//! PLY, in text and binary of either byte order: meshes and clouds, with normals, colours and texture coordinates.
//!
//! The header gives every element's columns (`header`); the rows are found without decoding (`rows`); then the
//! columns that mean something here are decoded in parallel. Other elements and columns are passed over. A text file
//! that ends within its very last number cannot be told from a whole one and reads as that shorter number.

mod gaussians;
mod header;
mod pieces;
mod rows;
mod samples;
mod table;
#[cfg(test)]
mod tests;
mod write;

use super::{Source, growing::Growing, positions, texture};
use crate::{
    Result,
    surface::{Material, Mesh},
};
pub use gaussians::{write_gaussian_leaves, write_gaussians};
use glam::{DVec3, Vec2, Vec3};
use header::{Element, width};
pub(super) use pieces::Pieces;
use ply_rs::ply::{PropertyType, ScalarType};
use rayon::prelude::*;
use rows::Rows;
pub use samples::{has_faces, read_samples};
use table::Table;
pub use write::write;

/// Rows of one parallel task.
const CHUNK: usize = 1 << 14;

/// Reads a PLY file.
///
/// Faces of more than three corners are cut into fans, and `tristrips` into triangles. Colours are bytes, 16-bit
/// numbers or fractions of 1.
///
/// # Errors
/// A malformed header, a file that ends before its last row, positions that are not finite, and face indices without a
/// vertex are [`Error::Input`](crate::Error::Input); more vertices or faces than the limits allow are
/// [`Error::Limit`](crate::Error::Limit).
pub fn read(source: &Source) -> Result<Mesh> {
    let header = header::read(source)?;
    let vertices = header.elements.iter().find(|element| element.name == "vertex");
    let vertex_count = vertices.map_or(0, |element| element.count);
    let mut mesh = Mesh::default();
    let mut at = header.payload;
    for element in &header.elements {
        let is_face = matches!(element.name.as_str(), "face" | "tristrips");
        if is_face || element.name == "vertex" {
            source.check_points(&format!("the count of element “{}”", element.name), element.count as u64)?;
        }
        let rows = Rows::find(source, element, header.encoding, &mut at)?;
        if vertices.is_some_and(|vertices| std::ptr::eq(vertices, element)) {
            read_vertices(source, element, &rows, &mut mesh)?;
        } else if is_face {
            mesh.triangles.append(&mut read_faces(source, element, &rows, vertex_count)?);
        }
    }
    source.check_points("the number of triangles", mesh.triangles.len() as u64)?;
    if mesh.positions.is_empty() {
        return Err(source.error("header", "has no element “vertex” with at least one row"));
    }
    if let Some(name) = header.texture.filter(|_| !mesh.uvs.is_empty() && !mesh.triangles.is_empty()) {
        let texture = texture::read_reference(source, "comment TextureFile", &name)?;
        source.room::<u32>("the materials of the triangles", mesh.triangles.len())?;
        mesh.triangle_materials = vec![0; mesh.triangles.len()];
        mesh.materials = vec![Material { name, color: [1.0; 4], texture }];
    }
    Ok(mesh)
}

/// The columns of a vertex that mean something here, in the order of [`Role`].
const ROLES: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["red", "diffuse_red", "r"],
    &["green", "diffuse_green", "g"],
    &["blue", "diffuse_blue", "b"],
    &["alpha", "diffuse_alpha", "a"],
    &["s", "u", "texture_u"],
    &["t", "v", "texture_v"],
];
const POSITION: usize = 0;
const NORMAL: usize = 3;
const COLOR: usize = 6;
const ALPHA: usize = 9;
const UV: usize = 10;

fn read_vertices(source: &Source, element: &Element, rows: &Rows, mesh: &mut Mesh) -> Result<()> {
    let columns = ROLES.map(|names| element.column(names).filter(|&c| element.columns[c].width().is_some()));
    if let Some(missing) = (POSITION..POSITION + 3).find(|&role| columns[role].is_none()) {
        let name = ROLES[missing][0];
        return Err(source.error("header", format!("the element “vertex” has no scalar property “{name}”")));
    }
    let table = Table::read(source, element, rows, &columns)?;
    fill(source, element, rows, &columns, |row, role| table.value(row, role), mesh)
}

/// Fills the mesh from the value of a row and a role.
fn fill(
    source: &Source,
    element: &Element,
    rows: &Rows,
    columns: &[Option<usize>; ROLES.len()],
    value: impl Fn(usize, usize) -> f64 + Sync,
    mesh: &mut Mesh,
) -> Result<()> {
    let count = element.count;
    let position = |row| DVec3::new(value(row, POSITION), value(row, POSITION + 1), value(row, POSITION + 2));
    (mesh.origin, mesh.positions) = positions::settle(source, count, position, |row| rows.place(source, element, row))?;
    let has = |from: usize, number: usize| columns[from..from + number].iter().all(Option::is_some);
    if has(NORMAL, 3) {
        source.room::<Vec3>("the normals", count)?;
        let normal = |row| Vec3::from_array([0, 1, 2].map(|axis| value(row, NORMAL + axis) as f32));
        mesh.normals = (0..count).into_par_iter().map(|row| positions::unit(normal(row))).collect();
    }
    if has(COLOR, 3) {
        source.room::<[u8; 4]>("the colours", count)?;
        let scale = color_scale(element, columns);
        let channel = |row, channel: usize| match scale[channel] {
            Some(scale) => (value(row, COLOR + channel) * scale).round() as u8,
            None => 255,
        };
        mesh.colors = (0..count).into_par_iter().map(|row| [0, 1, 2, 3].map(|c| channel(row, c))).collect();
    }
    if has(UV, 2) {
        source.room::<Vec2>("the texture coordinates", count)?;
        // PLY counts v from the bottom of the picture.
        let uv = |row| Vec2::new(value(row, UV) as f32, 1.0 - value(row, UV + 1) as f32);
        mesh.uvs = (0..count).into_par_iter().map(uv).collect();
    }
    Ok(())
}

/// What makes a byte of each channel of colour; none for one that there is not.
fn color_scale(element: &Element, columns: &[Option<usize>; ROLES.len()]) -> [Option<f64>; 4] {
    debug_assert_eq!(COLOR + 3, ALPHA);
    [0, 1, 2, 3].map(|channel| {
        columns[COLOR + channel].map(|column| match &element.columns[column].kind {
            PropertyType::Scalar(ScalarType::Float | ScalarType::Double) => 255.0,
            PropertyType::Scalar(ScalarType::UShort | ScalarType::Short) => 255.0 / 65535.0,
            _ => 1.0,
        })
    })
}

fn read_faces(source: &Source, element: &Element, rows: &Rows, vertices: usize) -> Result<Vec<[u32; 3]>> {
    let index_column = element
        .column(&["vertex_indices", "vertex_index"])
        .filter(|&column| matches!(element.columns[column].kind, PropertyType::List(..)));
    let Some(column) = index_column else {
        if element.count == 0 {
            return Ok(Vec::new());
        }
        return Err(source.error("header", format!("the element “{}” has no list “vertex_indices”", element.name)));
    };
    // Once as they are found, once in their place.
    if let Rows::Fixed { .. } = rows {
        source.room::<[[u32; 3]; 2]>("the triangles", element.count)?;
    }
    if let Some(triangles) = read_triangles(element, rows, column, vertices) {
        return Ok(triangles);
    }
    let mut wanted = vec![false; element.columns.len()];
    wanted[column] = true;
    let strips = element.name == "tristrips";
    let chunks = element.count.div_ceil(CHUNK);
    let parts: Vec<Vec<[u32; 3]>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let mut triangles = Growing::new(source, "the triangles");
            for row in chunk * CHUNK..((chunk + 1) * CHUNK).min(element.count) {
                let mut wrong = None;
                rows.visit(source, element, row, &wanted, |at, _, list| {
                    if let Some(list) = list.filter(|_| at == column) {
                        let cut = if strips { strip } else { fan };
                        wrong = cut(list, vertices, &mut triangles).transpose();
                    }
                })?;
                if let Some(index) = wrong.transpose()? {
                    return Err(source.error(
                        rows.place(source, element, row),
                        format!(
                            "refers to vertex {index}, but there are {vertices} (0 … {})",
                            vertices.saturating_sub(1)
                        ),
                    ));
                }
            }
            Ok(triangles.into_inner())
        })
        .collect::<Result<_>>()?;
    source.room::<[[u32; 3]; 2]>("the triangles", parts.iter().map(Vec::len).sum())?;
    Ok(parts.concat())
}

/// The common case: binary rows of one list of three 32-bit indices. `None` where it is another, or an index is wrong
/// (the general way then finds the row).
fn read_triangles(element: &Element, rows: &Rows, column: usize, vertices: usize) -> Option<Vec<[u32; 3]>> {
    let (Rows::Fixed { data, stride, big }, PropertyType::List(count, item)) = (rows, &element.columns[column].kind)
    else {
        return None;
    };
    if !matches!(item, ScalarType::Int | ScalarType::UInt) || element.name == "tristrips" || *stride == 0 {
        return None;
    }
    let offset: Option<usize> = element.columns[..column].iter().map(|before| before.width()).sum();
    let offset = offset? + width(count);
    let triangles: Vec<[u32; 3]> = data
        .par_chunks_exact(*stride)
        .map(|row| {
            [0, 4, 8].map(|at| {
                let bytes = [0, 1, 2, 3].map(|byte| row[offset + at + byte]);
                if *big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
            })
        })
        .collect();
    triangles.par_iter().all(|t| t.iter().all(|&index| (index as usize) < vertices)).then_some(triangles)
}

fn vertex(value: f64, vertices: usize) -> Option<u32> {
    (value >= 0.0 && value < vertices as f64 && value.fract() == 0.0).then_some(value as u32)
}

/// Cuts a polygon into a fan; gives the first index that names no vertex.
fn fan(list: &[f64], vertices: usize, triangles: &mut Growing<[u32; 3]>) -> Result<Option<f64>> {
    if let Some(&wrong) = list.iter().find(|&&value| vertex(value, vertices).is_none()) {
        return Ok(Some(wrong));
    }
    for i in 2..list.len() {
        triangles.push([list[0] as u32, list[i - 1] as u32, list[i] as u32])?;
    }
    Ok(None)
}

/// Cuts strips, separated by −1, into triangles; gives the first index that names no vertex.
fn strip(list: &[f64], vertices: usize, triangles: &mut Growing<[u32; 3]>) -> Result<Option<f64>> {
    for run in list.split(|&value| value == -1.0) {
        if let Some(&wrong) = run.iter().find(|&&value| vertex(value, vertices).is_none()) {
            return Ok(Some(wrong));
        }
        for i in 2..run.len() {
            let (a, b) = if i % 2 == 0 { (i - 2, i - 1) } else { (i - 1, i - 2) };
            triangles.push([run[a] as u32, run[b] as u32, run[i] as u32])?;
        }
    }
    Ok(None)
}

//! PLY, in text and binary of either byte order: meshes and point clouds, with normals, colours and
//! texture coordinates, and trained 3D Gaussians.
//!
//! The header lists every element's columns (`header`). The rows are located without decoding them
//! (`rows`). Then the relevant columns are decoded in parallel. Other elements and columns are
//! skipped. A text file that ends within its very last number cannot be distinguished from a whole
//! one; it is read with the shorter number.

mod faces;
mod gaussians;
mod header;
mod pieces;
mod points;
mod rows;
mod samples;
mod table;
#[cfg(test)]
mod tests;
mod write;

use super::{
    ReadOptions,
    shared::{brightness::Brightness, holes::is_hole, texture, unplaced},
};
use crate::{
    Result,
    input::{Source, positions},
    parallel::prelude::*,
    surface::{Material, Mesh},
    warning,
};
use faces::Faces;
pub use gaussians::{holds_gaussians, read_gaussians, write_compressed_gaussians, write_gaussians};
use glam::{DVec3, Vec2, Vec3};
use header::Element;
pub(super) use pieces::Pieces;
use ply_rs::ply::{PropertyType, ScalarType};
pub(crate) use points::PointFile;
use rows::Rows;
pub use samples::{arrays, has_faces, read_samples};
use table::Table;
pub use write::{RADIUS, value_name, write};

/// Rows per parallel task.
const CHUNK: usize = 1 << 14;

/// Reads a PLY file.
///
/// Faces with more than three corners are cut into triangles, and so are `tristrips`. Texture
/// coordinates are those of the vertices, or else those that faces have for their corners
/// (`texcoord`, with a `texnumber`). Colours are bytes, 16-bit numbers or fractions of 1. In wider
/// types, they are bytes if the largest value of the file shows it. The property of the vertices
/// that [`ReadOptions::scalar`] names becomes the mesh's values. Of trained Gaussians, the centres
/// are read as points. Vertices that are not at finite coordinates are left out, with the faces
/// that use them. Edges (`element edge`) are lines.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header, a file that ends before its last
/// row, face indices without a vertex, and compressed Gaussians;
/// [`Error::Limit`](crate::Error::Limit) for more vertices or faces than the limits allow.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Mesh> {
    let header = header::read(source)?;
    gaussians::refuse_compressed(source, &header)?;
    let vertices = header.elements.iter().find(|element| element.name == "vertex");
    let mut mesh = Mesh::default();
    let (mut faces, mut edges) = (Vec::new(), None);
    let mut at = header.payload;
    for element in &header.elements {
        let is_face = matches!(element.name.as_str(), "face" | "tristrips");
        if is_face || element.name == "vertex" {
            source.check_points(
                &format!("the count of element “{}”", element.name),
                element.count as u64,
            )?;
        }
        let rows = Rows::find(source, element, header.encoding, &mut at)?;
        if vertices.is_some_and(|vertices| std::ptr::eq(vertices, element)) {
            if gaussians::are_gaussians(element) {
                gaussians::warn(source);
            }
            read_vertices(source, element, &rows, &mut mesh)?;
            read_values(source, element, &rows, options, &mut mesh)?;
        } else if is_face {
            warn_of_face_colors(source, element);
            // Faces are read last, because their vertices may come after them.
            faces.push((element, rows));
        } else if element.name == "edge" {
            source.check_points("the count of element “edge”", element.count as u64)?;
            edges = Some((element, rows));
        }
    }
    let mut all = Faces::default();
    for (element, rows) in faces {
        let pictures = if mesh.uvs.is_empty() { header.textures.len() } else { 0 };
        all.append(faces::read(source, element, &rows, &mesh.positions, pictures)?);
    }
    source.check_points("the number of triangles", all.triangles.len() as u64)?;
    if mesh.positions.is_empty() {
        return Err(source.error("header", "has no element “vertex” with at least one row"));
    }
    if let Some((element, rows)) = edges {
        mesh.lines = read_edges(source, element, &rows, mesh.positions.len())?;
    }
    let of_corners = all.have_uvs();
    all.give(source, &mut mesh)?;
    if let Some(element) = vertices {
        mesh.about.attributes = samples::attributes(element);
    }
    give_textures(source, &header.textures, of_corners, &mut mesh)?;
    unplaced::leave_out(source, &mut mesh)?;
    Ok(mesh)
}

/// Reads the lines of an element “edge”, by the vertices at their ends.
fn read_edges(
    source: &Source,
    element: &Element,
    rows: &Rows,
    vertices: usize,
) -> Result<Vec<[u32; 2]>> {
    let is_number = |&column: &usize| element.columns[column].width().is_some();
    let columns = [["vertex1", "v1"], ["vertex2", "v2"]]
        .map(|names| element.column(&names).filter(is_number));
    if columns.contains(&None) || element.count == 0 {
        return Ok(Vec::new());
    }
    let table = Table::read(source, element, rows, &columns)?;
    source.room::<[u32; 2]>("the lines", element.count)?;
    let ends = (0..element.count).map(|row| {
        let end = |role: usize| {
            let vertex = table.value(row, role);
            let is_one = vertex >= 0.0 && vertex < vertices as f64 && vertex.fract() == 0.0;
            is_one.then_some(vertex as u32).ok_or_else(|| {
                let message =
                    format!("refers to vertex {vertex}, but there are {vertices} vertices");
                source.error(format!("edge {row}"), message)
            })
        };
        Ok([end(0)?, end(1)?])
    });
    ends.collect()
}

/// Gives the mesh the pictures that the header names. `of_corners`: faces have texture coordinates
/// for their corners, and the number of their picture.
fn give_textures(
    source: &Source,
    textures: &[String],
    of_corners: bool,
    mesh: &mut Mesh,
) -> Result<()> {
    if textures.is_empty() || mesh.triangles.is_empty() {
        return Ok(());
    }
    if mesh.uvs.is_empty() {
        let file = source.path.display();
        warning::give!(
            "{file}: names a picture, but neither vertices nor faces have texture coordinates; \
             drawn without it"
        );
        return Ok(());
    }
    // Vertices added by splitting come after those of the file's rows.
    if let Some(vertex) = mesh.uvs.par_iter().position_first(|uv| !uv.is_finite()) {
        return Err(super::uv_error(source, format!("vertex {vertex}"), mesh.uvs[vertex]));
    }
    // Texture coordinates of vertices refer to the first picture.
    let used = if of_corners { textures.len() } else { 1 };
    if textures.len() > used {
        warning::give!(
            "{}: names {} pictures, of which vertices can have coordinates in the first only",
            source.path.display(),
            textures.len()
        );
    }
    for name in textures.iter().take(used) {
        let texture = texture::read_reference(source, "comment TextureFile", name)?;
        mesh.materials.push(Material {
            name: name.clone(),
            color: [1.0; 4],
            texture,
            unlit: false,
        });
    }
    if !of_corners {
        source.room::<u32>("the materials of the triangles", mesh.triangles.len())?;
        mesh.triangle_materials = vec![0; mesh.triangles.len()];
    }
    Ok(())
}

/// Says that colours of faces are not used.
fn warn_of_face_colors(source: &Source, element: &Element) {
    if element.count > 0 && ROLES[COLOR..ALPHA].iter().all(|names| element.column(names).is_some())
    {
        warning::give!(
            "{}: colours of faces are not drawn; give them to the vertices, in MeshLab by \
             “Transfer Color: Face to Vertex”",
            source.path.display()
        );
    }
}

/// Names of the vertex columns that are read. The constants below give their indices.
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
    let columns =
        ROLES.map(|names| element.column(names).filter(|&c| element.columns[c].width().is_some()));
    if let Some(missing) = (POSITION..POSITION + 3).find(|&role| columns[role].is_none()) {
        let name = ROLES[missing][0];
        return Err(
            source.error("header", format!("the element “vertex” has no scalar property “{name}”"))
        );
    }
    let table = Table::read(source, element, rows, &columns)?;
    fill(source, element, &columns, |row, role| table.value(row, role), mesh)
}

/// Returns the column of the property of a vertex that a user names.
fn column_named(source: &Source, element: &Element, name: &str) -> Result<usize> {
    Ok(samples::named_column(source, element, name)?.1)
}

/// Gives the mesh the values of the property that is named, if one is.
fn read_values(
    source: &Source,
    element: &Element,
    rows: &Rows,
    options: &ReadOptions,
    mesh: &mut Mesh,
) -> Result<()> {
    let Some(name) = options.scalar.as_deref() else { return Ok(()) };
    let (name, values) = samples::named_values(source, element, rows, name)?;
    let value = |value: f64| if is_hole(value, options.missing) { f32::NAN } else { value as f32 };
    mesh.values = values.into_iter().map(value).collect();
    mesh.about.name = name;
    Ok(())
}

/// Fills the mesh from the values of rows and roles.
fn fill(
    source: &Source,
    element: &Element,
    columns: &[Option<usize>; ROLES.len()],
    value: impl Fn(usize, usize) -> f64 + Sync,
    mesh: &mut Mesh,
) -> Result<()> {
    let count = element.count;
    let position =
        |row| DVec3::new(value(row, POSITION), value(row, POSITION + 1), value(row, POSITION + 2));
    (mesh.origin, mesh.positions) = positions::settle_some(source, count, position)?;
    let has = |from: usize, number: usize| columns[from..from + number].iter().all(Option::is_some);
    if has(NORMAL, 3) {
        source.room::<Vec3>("the normals", count)?;
        let normal = |row| Vec3::from_array([0, 1, 2].map(|axis| value(row, NORMAL + axis) as f32));
        mesh.normals = (0..count).into_par_iter().map(|row| positions::unit(normal(row))).collect();
    }
    if has(COLOR, 3) {
        source.room::<[u8; 4]>("the colours", count)?;
        let kinds = color_kind(element, columns);
        let channel = |row, channel: usize| {
            if kinds[channel].is_some() { value(row, COLOR + channel) } else { 0.0 }
        };
        let mut brightest = Brightest::default();
        if kinds.iter().flatten().any(ColorKind::is_wide) {
            brightest = Brightest::of(count, |row| [0, 1, 2, 3].map(|c| channel(row, c)));
        }
        let scale = color_scale(&kinds, &brightest);
        mesh.colors =
            (0..count).into_par_iter().map(|row| color(scale, |c| channel(row, c))).collect();
    }
    if has(UV, 2) {
        source.room::<Vec2>("the texture coordinates", count)?;
        // In PLY, v = 0 is the bottom of the picture.
        let uv = |row| Vec2::new(value(row, UV) as f32, 1.0 - value(row, UV + 1) as f32);
        mesh.uvs = (0..count).into_par_iter().map(uv).collect();
    }
    Ok(())
}

/// The type of a colour channel.
#[derive(Clone, Copy, PartialEq)]
enum ColorKind {
    Byte,
    Short,
    Fraction,
}

impl ColorKind {
    /// Returns whether the meaning of the largest value depends on all values, not just on the
    /// type.
    fn is_wide(&self) -> bool {
        *self != Self::Byte
    }
}

/// Returns the types of a vertex's colour channels; `None` for a missing channel.
fn color_kind(element: &Element, columns: &[Option<usize>; ROLES.len()]) -> [Option<ColorKind>; 4] {
    debug_assert_eq!(COLOR + 3, ALPHA);
    [0, 1, 2, 3].map(|channel| {
        columns[COLOR + channel].map(|column| match &element.columns[column].kind {
            PropertyType::Scalar(ScalarType::Float | ScalarType::Double) => ColorKind::Fraction,
            PropertyType::Scalar(ScalarType::UShort | ScalarType::Short) => ColorKind::Short,
            _ => ColorKind::Byte,
        })
    })
}

/// The brightness of the colours of vertices, and their opacity.
#[derive(Clone, Copy, Default)]
struct Brightest {
    hue: Brightness,
    opacity: Brightness,
}

impl Brightest {
    /// Looks at the colours of all rows.
    fn of(count: usize, color: impl Fn(usize) -> [f64; 4] + Sync) -> Self {
        let rows = (0..count).into_par_iter().with_min_len(1 << 12);
        rows.fold(Self::default, |seen, row| seen.with_color(color(row)))
            .reduce(Self::default, Self::with)
    }

    fn with_color(mut self, [red, green, blue, opacity]: [f64; 4]) -> Self {
        self.hue.add(red.max(green).max(blue));
        self.opacity.add(opacity);
        self
    }

    fn with(self, other: Self) -> Self {
        Self { hue: self.hue.with(other.hue), opacity: self.opacity.with(other.opacity) }
    }
}

/// Returns the factor that converts each channel to bytes, given the brightness of all colours.
/// Some programs write bytes as 16-bit numbers, others as floats.
fn color_scale(kinds: &[Option<ColorKind>; 4], brightest: &Brightest) -> [Option<f64>; 4] {
    // Fractions may be somewhat brighter than 1.
    const BRIGHTEST: f64 = 16.0;
    let (hue, opacity) = (brightest.hue.largest(), brightest.opacity.largest());
    std::array::from_fn(|channel| {
        let largest = if channel < 3 { hue } else { opacity };
        kinds[channel].map(|kind| match kind {
            ColorKind::Short if largest > 255.0 => 255.0 / 65535.0,
            ColorKind::Fraction if largest <= BRIGHTEST => 255.0,
            ColorKind::Fraction if largest > 255.0 => 255.0 / 65535.0,
            _ => 1.0,
        })
    })
}

/// Returns a colour from scaled channels; missing channels are 255.
fn color(scale: [Option<f64>; 4], value: impl Fn(usize) -> f64) -> [u8; 4] {
    std::array::from_fn(|channel| {
        scale[channel].map_or(255, |scale| (value(channel) * scale).round() as u8)
    })
}

//! Wavefront OBJ with its MTL materials and pictures.
//!
//! tobj parses the statements. Before that, our own survey (`survey`) scans the file. It gives
//! errors their line, and its feed hides from tobj what tobj would read wrongly. OBJ has no counts
//! and no end mark. So a file that is cut at the end of a line, or within its last number, reads as
//! a smaller one.

mod line;
mod material;
mod survey;
#[cfg(test)]
mod tests;

use super::shared::{polygon, unplaced};
use crate::{
    Error, Result,
    input::{Source, copy, isolate::isolated, positions, text},
    surface::{Material, Mesh},
};
use glam::{DVec3, Vec2, Vec3};
use std::{cell::RefCell, collections::HashMap, path::Path};
use survey::Survey;

/// Reads an OBJ file. Polygons, including concave ones, are cut into triangles, with vertex
/// colours, normals and materials. Texture coordinates are kept if a material has a picture. A
/// vertex is split if its corners differ in normal or texture coordinates. A file with vertices
/// only is a point cloud. Lines (`l`) are lines; points (`p`) are skipped.
///
/// # Errors
/// [`Error::Input`] for malformed numbers; for texture coordinates in pictures that are not finite;
/// for indices without a vertex; and for references to files outside the file's folder. Missing
/// material files, pictures, texture coordinates and normals, and damaged lines of materials are
/// warnings. Vertices that are not at finite coordinates are left out, with the faces that use
/// them.
pub fn read(source: &Source) -> Result<Mesh> {
    source.room::<u8>("the text", source.bytes().len())?;
    text::refuse_utf16(source)?;
    let text = join_lines(source, copy::lossy(text::without_mark(source.bytes())))?;
    let survey = Survey::of(source, &text)?;
    if survey.faces == 0 {
        return read_cloud(source, &text, &survey);
    }
    let lines = line::Lines::read(source, &text, &survey)?;
    let (models, materials, shifts) = statements(source, &text, &survey)?;
    let has_materials = !materials.is_empty();
    let textured: Vec<bool> = materials.iter().map(|material| material.texture.is_some()).collect();
    let mut mesh = Mesh { materials, ..Mesh::default() };
    let mut corners = Corners::default();
    for model in models {
        let id = model.mesh.material_id;
        let with_uv = id.is_some_and(|id| textured.get(id) == Some(&true));
        let first = corners.uvs.len();
        corners.add(source, &text, model.mesh, with_uv, textured.contains(&true))?;
        if let Some(shift) = id.and_then(|id| shifts.get(id)).filter(|_| with_uv) {
            corners.uvs[first..].iter_mut().for_each(|uv| *uv = shift.of(*uv));
        }
        if has_materials {
            let id = id.unwrap_or(mesh.materials.len());
            if id == mesh.materials.len() {
                mesh.materials.push(neutral());
            }
            mesh.triangle_materials.resize(corners.triangles.len(), id as u32);
        }
    }
    source.check_points("the number of vertices", corners.positions.len() as u64)?;
    source.check_points("the number of triangles", corners.triangles.len() as u64)?;
    if corners.triangles.is_empty() {
        let message = if survey.has_unplaced() {
            "each face uses a vertex that is not at finite coordinates"
        } else {
            "has faces, but none with three or more corners"
        };
        return Err(source.error("file", message));
    }
    mesh.lines = corners.add_lines(lines);
    let positions = &corners.positions;
    (mesh.origin, mesh.positions) =
        positions::settle_some(source, positions.len(), |i| positions[i])?;
    mesh.normals = corners.normals;
    mesh.uvs = corners.uvs;
    mesh.colors = to_bytes(&corners.colors);
    mesh.triangles = corners.triangles;
    // Vertices that no face uses are not among those of the mesh.
    unplaced::remove(source, &mut mesh)?;
    survey.warn_of_unplaced(source);
    Ok(mesh)
}

/// Parses the statements. Returns the models, the materials with their pictures, and how each
/// material shifts texture coordinates.
fn statements(
    source: &Source,
    text: &str,
    survey: &Survey,
) -> Result<(Vec<tobj::Model>, Vec<Material>, Vec<material::Shift>)> {
    let library = RefCell::new(material::Library::new(source));
    let failure: RefCell<Option<Error>> = RefCell::new(None);
    let is_over = || source.time_left().is_zero();
    let mut feed = survey.feed(text, &is_over);
    // tobj would triangulate by fans, which also cover area outside a concave polygon.
    let options =
        tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let load = |path: &Path| {
        let loaded = library.borrow_mut().load(&path.to_string_lossy());
        loaded.map(|(materials, index_of)| (materials, index_of.into_iter().collect())).map_err(
            |error| {
                failure.borrow_mut().get_or_insert(error);
                tobj::LoadError::OpenFileFailed
            },
        )
    };
    // tobj does unchecked arithmetic on numbers of the file.
    let loaded =
        isolated(source, "statements", || Ok(tobj::load_obj_buf(&mut feed, &options, load)))?;
    let line = feed.line();
    if let Some(error) = failure.into_inner() {
        return Err(error);
    }
    let (models, materials) = loaded.map_err(|error| {
        let wrong = || source.error(format!("line {line}"), error.to_string());
        source.check_time().err().unwrap_or_else(wrong)
    })?;
    let mut library = library.into_inner();
    let materials = materials.unwrap_or_default();
    let materials = materials.iter().map(|material| library.finish(material));
    let (materials, shifts) = materials.collect::<Result<Vec<_>>>()?.into_iter().unzip();
    library.warn();
    Ok((models, materials, shifts))
}

/// The material of faces that name no existing material.
fn neutral() -> Material {
    Material { name: "none".into(), color: [0.8, 0.8, 0.8, 1.0], ..Material::default() }
}

/// Joins lines that end with a backslash.
fn join_lines(source: &Source, text: String) -> Result<String> {
    if text.contains("\\\n") || text.contains("\\\r\n") {
        source.room::<u8>("the joined lines", 2 * text.len())?;
        return Ok(text.replace("\\\r\n", " ").replace("\\\n", " "));
    }
    Ok(text)
}

/// The vertices of all models; each distinct index triple of a corner makes one.
#[derive(Default)]
struct Corners {
    positions: Vec<DVec3>,
    colors: Vec<[f64; 3]>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl Corners {
    /// Adds the vertices of lines. Returns the ends of their segments.
    fn add_lines(&mut self, lines: line::Lines) -> Vec<[u32; 2]> {
        let first = self.positions.len() as u32;
        let all = self.positions.len() + lines.vertices.len();
        let has_colors = !self.colors.is_empty();
        self.positions.extend(lines.places);
        if has_colors {
            self.colors.extend(lines.colors);
            self.colors.resize(all, [1.0; 3]);
        }
        if !self.normals.is_empty() {
            self.normals.resize(all, Vec3::ZERO);
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(all, Vec2::ZERO);
        }
        lines.ends.into_iter().map(|ends| ends.map(|end| end + first)).collect()
    }

    /// Adds a model. `with_uv`: its texture coordinates matter; `any_uv`: those of any model do.
    fn add(
        &mut self,
        source: &Source,
        text: &str,
        mut mesh: tobj::Mesh,
        with_uv: bool,
        any_uv: bool,
    ) -> Result<()> {
        let mut corners = std::mem::take(&mut mesh.indices);
        let split =
            (with_uv && !mesh.texcoord_indices.is_empty()) || !mesh.normal_indices.is_empty();
        if split {
            let first = self.uvs.len();
            self.add_split(&mesh, &mut corners, with_uv, any_uv);
            if let Some(&uv) = self.uvs[first..].iter().find(|uv| !uv.is_finite()) {
                return Err(super::uv_error(source, survey::place_of_wide_uv(text), uv));
            }
        } else {
            let base = self.positions.len() as u32;
            self.positions.extend(mesh.positions.chunks_exact(3).map(DVec3::from_slice));
            self.colors.extend(mesh.vertex_color.chunks_exact(3).map(|c| [c[0], c[1], c[2]]));
            self.uvs.extend(std::iter::repeat_n(
                Vec2::ZERO,
                if any_uv { mesh.positions.len() / 3 } else { 0 },
            ));
            corners.iter_mut().for_each(|corner| *corner += base);
        }
        self.cut(source, &corners, &mesh.face_arities)
    }

    /// Adds the vertices that a model's corners make, and replaces the corners by their indices.
    fn add_split(&mut self, mesh: &tobj::Mesh, corners: &mut [u32], with_uv: bool, any_uv: bool) {
        let mut vertex_of: HashMap<(u32, u32, u32), u32> = HashMap::new();
        for (corner, index) in corners.iter_mut().enumerate() {
            let position = *index;
            let uv = if with_uv { mesh.texcoord_indices.get(corner).copied() } else { None };
            let normal = mesh.normal_indices.get(corner).copied();
            let key = (position, uv.unwrap_or(u32::MAX), normal.unwrap_or(u32::MAX));
            *index = *vertex_of.entry(key).or_insert_with(|| {
                let at = position as usize * 3;
                self.positions.push(DVec3::from_slice(&mesh.positions[at..at + 3]));
                if let Some(color) = mesh.vertex_color.get(at..at + 3) {
                    self.colors.push([color[0], color[1], color[2]]);
                }
                if let Some(normal) = normal {
                    let normal = DVec3::from_slice(&mesh.normals[normal as usize * 3..]);
                    self.normals.push(positions::unit(normal.as_vec3()));
                }
                if any_uv {
                    // In OBJ, v = 0 is the bottom of the picture.
                    let uv = uv.map_or([0.0, 0.0], |uv| {
                        [mesh.texcoords[uv as usize * 2], 1.0 - mesh.texcoords[uv as usize * 2 + 1]]
                    });
                    self.uvs.push(Vec2::new(uv[0] as f32, uv[1] as f32));
                }
                self.positions.len() as u32 - 1
            });
        }
    }

    /// Cuts faces into triangles, given all corners and the number of corners of each face. If
    /// `arities` is empty, all faces are triangles.
    fn cut(&mut self, source: &Source, corners: &[u32], arities: &[u32]) -> Result<()> {
        if arities.is_empty() {
            self.triangles.extend_from_slice(corners.as_chunks().0);
            return Ok(());
        }
        let mut rest = corners;
        for (face, &arity) in arities.iter().enumerate() {
            // Cutting a face with many corners may take long.
            if arity > 64 || face.is_multiple_of(1 << 12) {
                source.check_time()?;
            }
            let (face, others) = rest.split_at(arity as usize);
            rest = others;
            polygon::triangles(
                face,
                |vertex| self.positions[vertex as usize],
                |triangle| {
                    self.triangles.push(triangle);
                    Ok(())
                },
            )?;
        }
        Ok(())
    }
}

/// Converts colours to bytes. In most files they are fractions of 1, in some fractions of 255.
fn to_bytes(colors: &[[f64; 3]]) -> Vec<[u8; 4]> {
    let largest = colors.iter().flatten().fold(0.0, |a: f64, &b| a.max(b));
    let scale = if largest > 1.0 { 1.0 } else { 255.0 };
    colors
        .iter()
        .map(|c| {
            let [r, g, b] = c.map(|v| (v * scale).round() as u8);
            [r, g, b, 255]
        })
        .collect()
}

/// Reads vertices without faces, which tobj does not return.
fn read_cloud(source: &Source, text: &str, survey: &Survey) -> Result<Mesh> {
    let mut mesh = Mesh::default();
    let mut points: Vec<DVec3> = Vec::new();
    let mut colors: Vec<[f64; 3]> = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words.next() != Some("v") {
            continue;
        }
        let parsed = |word: &str| copy::float(word.as_bytes());
        let values: Vec<f64> = words.take(6).map_while(parsed).collect();
        if values.len() < 3 {
            return Err(
                source.error(format!("line {}", number + 1), "a vertex needs three numbers")
            );
        }
        points.push(DVec3::from_slice(&values));
        if survey.colors && values.len() >= 6 {
            colors.push([values[3], values[4], values[5]]);
        }
    }
    if points.is_empty() {
        return Err(source.error("file", "has no vertices (no line that begins with “v ”)"));
    }
    // Vertices come before faces, so a mesh that is cut within its vertices looks like a point
    // cloud, except for its last line.
    if !source.bytes().ends_with(b"\n") {
        let place = format!("byte {}", source.bytes().len());
        let message = "the file ends within a line and has no faces: it may be a mesh that is cut";
        let hint = "end the last line with a line break if these are points that are whole";
        return Err(source.error(place, message).hint(hint));
    }
    let has_colors = colors.len() == points.len();
    if survey.lines > 0 {
        let lines = line::Lines::read(source, text, survey)?;
        let used = |at: usize| lines.vertices[at] as usize;
        let placed = lines.vertices.iter().map(|&vertex| points[vertex as usize]).collect();
        colors = if has_colors {
            (0..lines.vertices.len()).map(|at| colors[used(at)]).collect()
        } else {
            colors
        };
        (points, mesh.lines) = (placed, lines.ends);
    }
    (mesh.origin, mesh.positions) = positions::settle_some(source, points.len(), |i| points[i])?;
    if has_colors {
        mesh.colors = to_bytes(&colors);
    }
    unplaced::leave_out(source, &mut mesh)?;
    Ok(mesh)
}

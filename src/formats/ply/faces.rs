//! The triangles of an element “face” or “tristrips”, and the texture coordinates of their corners.

use super::{
    CHUNK,
    header::{Element, width},
    rows::Rows,
};
use crate::{
    Error, Result,
    formats::shared::polygon,
    input::{Source, growing::Growing},
    parallel::prelude::*,
    surface::Mesh,
};
use glam::{Vec2, Vec3};
use ply_rs::ply::{PropertyType, ScalarType};
use std::collections::HashMap;

/// Represents −1, which separates strips.
const MARK: u32 = u32::MAX;

/// Bytes per corner while a polygon is cut; polygons with up to `FEW` corners are not counted.
const OF_CORNER: u64 = 128;
const FEW: usize = 1024;

/// The faces of a file.
#[derive(Default)]
pub(super) struct Faces {
    pub triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the triangles' corners, as in the file; empty if the file has none.
    uvs: Vec<[Vec2; 3]>,
    /// The picture of each triangle that has texture coordinates.
    pictures: Vec<u32>,
}

/// The columns of a face that are read.
struct Columns {
    indices: usize,
    /// A list with u and v of each corner, and the index of the picture, as MeshLab writes them.
    uvs: Option<usize>,
    picture: Option<usize>,
}

/// Reads an element's faces. `positions` are those of the vertices; `pictures` is the number of
/// pictures that corners may have coordinates in.
pub(super) fn read(
    source: &Source,
    element: &Element,
    rows: &Rows,
    positions: &[Vec3],
    pictures: usize,
) -> Result<Faces> {
    let is_list = |&column: &usize| element.columns[column].width().is_none();
    let Some(indices) = element.column(&["vertex_indices", "vertex_index"]).filter(is_list) else {
        if element.count == 0 {
            return Ok(Faces::default());
        }
        return Err(source.error(
            "header",
            format!("the element “{}” has no list “vertex_indices”", element.name),
        ));
    };
    // Once as they are read, once in their final list.
    if let Rows::Fixed { .. } = rows {
        source.room::<[[u32; 3]; 2]>("the triangles", element.count)?;
    }
    if let Some(triangles) = read_triangles(element, rows, indices, positions.len()) {
        return Ok(Faces { triangles, ..Faces::default() });
    }
    let uvs = element.column(&["texcoord"]).filter(|column| pictures > 0 && is_list(column));
    let picture = element.column(&["texnumber"]).filter(|column| uvs.is_some() && !is_list(column));
    let columns = Columns { indices, uvs, picture };
    let table = Table { source, element, rows, columns, positions, pictures };
    let chunks = element.count.div_ceil(CHUNK);
    let parts: Vec<Faces> = (0..chunks)
        .into_par_iter()
        .map(|chunk| table.faces(chunk * CHUNK..((chunk + 1) * CHUNK).min(element.count)))
        .collect::<Result<_>>()?;
    let count = parts.iter().map(|part| part.triangles.len()).sum();
    source.room::<[[u32; 3]; 2]>("the triangles", count)?;
    let mut all = Faces { triangles: Vec::with_capacity(count), ..Faces::default() };
    parts.into_iter().for_each(|part| all.append(part));
    Ok(all)
}

/// The rows of an element, what is read of them, and what they refer to.
struct Table<'a> {
    source: &'a Source<'a>,
    element: &'a Element,
    rows: &'a Rows<'a>,
    columns: Columns,
    positions: &'a [Vec3],
    pictures: usize,
}

/// A row of faces: a polygon or strips.
#[derive(Default)]
struct Row {
    corners: Vec<u32>,
    /// u and v of each corner; empty if the row has none.
    uvs: Vec<f64>,
    picture: f64,
}

impl Table<'_> {
    /// Reads the faces of a range of rows.
    fn faces(&self, range: std::ops::Range<usize>) -> Result<Faces> {
        let mut wanted = vec![false; self.element.columns.len()];
        [Some(self.columns.indices), self.columns.uvs, self.columns.picture]
            .into_iter()
            .flatten()
            .for_each(|column| wanted[column] = true);
        let mut triangles = Growing::new(self.source, "the triangles");
        let mut uvs = Growing::new(self.source, "the texture coordinates");
        let mut pictures = Growing::new(self.source, "the pictures of the triangles");
        let mut row = Row::default();
        // The corners of a face, by their index in its list.
        let mut order = Vec::new();
        for index in range {
            self.read_row(index, &wanted, &mut row)?;
            if self.are_strips() {
                strips(&row.corners, &mut triangles)?;
                continue;
            }
            let picture = self.check(index, &row)?;
            let place = |vertex: u32| self.positions[vertex as usize].as_dvec3();
            if self.columns.uvs.is_none() {
                polygon::triangles(&row.corners, place, |triangle| triangles.push(triangle))?;
                continue;
            }
            order.clear();
            order.extend(0..row.corners.len() as u32);
            let vertex = |corner: u32| row.corners[corner as usize];
            polygon::triangles(
                &order,
                |corner| place(vertex(corner)),
                |cut| {
                    triangles.push(cut.map(vertex))?;
                    uvs.push(cut.map(|corner| row.uv(corner)))?;
                    pictures.push(picture)
                },
            )?;
        }
        Ok(Faces {
            triangles: triangles.into_inner(),
            uvs: uvs.into_inner(),
            pictures: pictures.into_inner(),
        })
    }

    fn are_strips(&self) -> bool {
        self.element.name == "tristrips"
    }

    fn wrong(&self, row: usize, message: String) -> Error {
        self.source.error(self.rows.place(self.source, self.element, row), message)
    }

    /// Reads a row. Its corners must be vertices.
    fn read_row(&self, index: usize, wanted: &[bool], row: &mut Row) -> Result<()> {
        let (columns, vertices) = (&self.columns, self.positions.len());
        let mut stray = None;
        let mut room = Ok(());
        self.rows.visit(self.source, self.element, index, wanted, |at, value, list| {
            if let Some(list) = list.filter(|_| at == columns.indices) {
                row.corners.clear();
                room = self.room_for_corners(list.len(), &row.corners);
                if room.is_err() {
                    return;
                }
                row.corners.extend(list.iter().map(|&value| match vertex(value, vertices) {
                    None if self.are_strips() && value == -1.0 => MARK,
                    None => *stray.get_or_insert(value) as u32,
                    Some(index) => index,
                }));
            } else if let Some(list) = list.filter(|_| Some(at) == columns.uvs) {
                row.uvs.clear();
                row.uvs.extend_from_slice(list);
            } else if Some(at) == columns.picture {
                row.picture = value;
            }
        })?;
        room?;
        let Some(stray) = stray else { return Ok(()) };
        let last = vertices.saturating_sub(1);
        let message = format!("refers to vertex {stray}, but there are {vertices} (0 … {last})");
        Err(self.wrong(index, message))
    }

    /// Counts the memory by which a list grows that takes the corners of a row. Short lists are not
    /// counted.
    fn room_for_corners(&self, count: usize, list: &Vec<u32>) -> Result<()> {
        if count <= FEW || count <= list.capacity() {
            return Ok(());
        }
        let bytes = size_of::<u32>() * (count - list.capacity());
        self.source.spend("the size of a polygon in bytes", bytes as u64)
    }

    /// Checks a polygon: its memory, its texture coordinates and its picture, which is returned.
    fn check(&self, index: usize, row: &Row) -> Result<u32> {
        let corners = row.corners.len();
        if corners > FEW {
            self.source.spend("the size of a polygon in bytes", OF_CORNER * corners as u64)?;
        }
        // Faces without coordinates may occur among faces that have them.
        let numbers = row.uvs.len();
        if self.columns.uvs.is_some() && numbers != 0 && numbers != 2 * corners {
            let message = format!(
                "has {numbers} texture coordinates for {corners} corners, which need {}",
                2 * corners
            );
            return Err(self.wrong(index, message));
        }
        let Row { picture, .. } = *row;
        vertex(picture, self.pictures.max(1)).ok_or_else(|| {
            let named = self.pictures;
            let message =
                format!("shows picture {picture}, but “comment TextureFile” names {named}");
            self.wrong(index, message)
        })
    }
}

impl Row {
    /// Returns the texture coordinates of a corner; zero if the row has none.
    fn uv(&self, corner: u32) -> Vec2 {
        let at = 2 * corner as usize;
        self.uvs.get(at..at + 2).map_or(Vec2::ZERO, |uv| Vec2::new(uv[0] as f32, uv[1] as f32))
    }
}

/// The common case: binary rows with one list of three 32-bit indices. Returns `None` in other
/// cases and if an index is out of range; the general path then finds the row.
fn read_triangles(
    element: &Element,
    rows: &Rows,
    column: usize,
    vertices: usize,
) -> Option<Vec<[u32; 3]>> {
    let (Rows::Fixed { data, stride, big }, PropertyType::List(count, item)) =
        (rows, &element.columns[column].kind)
    else {
        return None;
    };
    if !matches!(item, ScalarType::Int | ScalarType::UInt)
        || element.name == "tristrips"
        || *stride == 0
    {
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
    triangles
        .par_iter()
        .all(|t| t.iter().all(|&index| (index as usize) < vertices))
        .then_some(triangles)
}

fn vertex(value: f64, vertices: usize) -> Option<u32> {
    (value >= 0.0 && value < vertices as f64 && value.fract() == 0.0).then_some(value as u32)
}

/// Cuts strips, separated by marks, into triangles.
fn strips(list: &[u32], triangles: &mut Growing<[u32; 3]>) -> Result<()> {
    for run in list.split(|&index| index == MARK) {
        for i in 2..run.len() {
            let (a, b) = if i % 2 == 0 { (i - 2, i - 1) } else { (i - 1, i - 2) };
            triangles.push([run[a], run[b], run[i]])?;
        }
    }
    Ok(())
}

impl Faces {
    /// Adds the faces of another element.
    pub fn append(&mut self, mut other: Self) {
        self.triangles.append(&mut other.triangles);
        self.uvs.append(&mut other.uvs);
        self.pictures.append(&mut other.pictures);
    }

    /// Returns whether all triangles have texture coordinates at their corners.
    pub fn have_uvs(&self) -> bool {
        !self.uvs.is_empty() && self.uvs.len() == self.triangles.len()
    }

    /// Moves the triangles into a mesh of vertices. A vertex whose corners have different texture
    /// coordinates becomes several vertices.
    pub fn give(mut self, source: &Source, mesh: &mut Mesh) -> Result<()> {
        if self.have_uvs() {
            let mut vertex_uvs: Vec<Option<Vec2>> = Vec::new();
            source.room::<(Option<Vec2>, Vec2)>("the texture coordinates", mesh.positions.len())?;
            vertex_uvs.resize(mesh.positions.len(), None);
            let mut others: HashMap<(u32, [u32; 2]), u32> = HashMap::new();
            for (triangle, uvs) in self.triangles.iter_mut().zip(&self.uvs) {
                for (index, &uv) in triangle.iter_mut().zip(uvs) {
                    let known = *vertex_uvs[*index as usize].get_or_insert(uv);
                    let bits = uv.to_array().map(f32::to_bits);
                    if known.to_array().map(f32::to_bits) == bits {
                        continue;
                    }
                    let count = vertex_uvs.len() as u32;
                    let other = *others.entry((*index, bits)).or_insert(count);
                    if other == count {
                        source.spend("the size of the vertices at seams in bytes", 128)?;
                        vertex_uvs.push(Some(uv));
                        copy(mesh, *index as usize);
                        source.check_points(
                            "the number of vertices including those at seams",
                            vertex_uvs.len() as u64,
                        )?;
                    }
                    *index = other;
                }
            }
            // In PLY, v = 0 is the bottom of the picture.
            mesh.uvs = vertex_uvs
                .iter()
                .map(|uv| uv.unwrap_or_default())
                .map(|uv| Vec2::new(uv.x, 1.0 - uv.y))
                .collect();
            mesh.triangle_materials = self.pictures;
        }
        mesh.triangles = self.triangles;
        Ok(())
    }
}

/// Adds a copy of a vertex.
fn copy(mesh: &mut Mesh, vertex: usize) {
    mesh.positions.push(mesh.positions[vertex]);
    if let Some(&normal) = mesh.normals.get(vertex) {
        mesh.normals.push(normal);
    }
    if let Some(&color) = mesh.colors.get(vertex) {
        mesh.colors.push(color);
    }
    if let Some(&value) = mesh.values.get(vertex) {
        mesh.values.push(value);
    }
}

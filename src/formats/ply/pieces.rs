//! Reads binary PLY files in pieces: vertices with a fixed stride, and faces with three corners
//! each.

use super::{
    super::{
        form::{Attribute, Coloring, Counts, Form, NumberType, Records, StreamPoint, in_order},
        shared::{raw_point::RawPoint, unplaced},
    },
    Brightest, COLOR, ColorKind, NORMAL, POSITION, ROLES, UV, color, color_kind, color_scale,
    column_named, gaussians,
    header::{self, Element, Header, width},
    rows::{cut, list_place, number, triangle_stride},
};
use crate::{
    Result,
    about::{About, Orientation},
    input::{Source, positions},
};
use glam::{DVec3, Vec3};
use ply_rs::ply::{Encoding, PropertyType, ScalarType};
use std::ops::Range;

/// Rows per piece.
const ROWS: usize = 1 << 16;

/// Where the vertices and faces are in a file.
pub struct Pieces {
    vertices: Vertices,
    faces: Option<Faces>,
    has_normals: bool,
    has_colors: bool,
    has_uvs: bool,
    /// Whether the points are the centres of trained 3D Gaussians.
    are_gaussians: bool,
    /// Whether vertices that are not at finite coordinates are left out, with their triangles.
    has_gaps: bool,
    /// The property that the user names: its offset in a row, and its type.
    value: Option<(usize, ScalarType)>,
}

/// Rows of equal length.
struct Rows {
    at: usize,
    count: usize,
    stride: usize,
    big: bool,
}

struct Vertices {
    rows: Rows,
    fields: [Option<(usize, ScalarType)>; ROLES.len()],
    color_kind: [Option<ColorKind>; 4],
    color_scale: [Option<f64>; 4],
}

struct Faces {
    rows: Rows,
    /// Offset of the number of corners in a row, and its type.
    length: (usize, ScalarType),
    /// Offset of the first of the three indices.
    indices: usize,
}

impl Pieces {
    /// Locates the rows by the header and a sample of the faces. Returns `None` for text, polygons,
    /// strips and textures, and for files that the reader refuses.
    pub fn find(source: &Source) -> Result<Option<Self>> {
        let header = header::read(source)?;
        let big = match header.encoding {
            Encoding::Ascii => return Ok(None),
            Encoding::BinaryBigEndian => true,
            Encoding::BinaryLittleEndian => false,
        };
        let Some(Located { vertices, faces }) = locate(source, &header, big)? else {
            return Ok(None);
        };
        let Some((element, rows)) = vertices.filter(|(element, _)| element.count > 0) else {
            return Ok(None);
        };
        let columns = ROLES
            .map(|names| element.column(names).filter(|&c| element.columns[c].width().is_some()));
        let has =
            |from: usize, number: usize| columns[from..from + number].iter().all(Option::is_some);
        let has_uvs = has(UV, 2);
        if !has(POSITION, 3) || (has_uvs && !header.textures.is_empty() && faces.is_some()) {
            return Ok(None);
        }
        let (has_normals, has_colors) = (has(NORMAL, 3), has(COLOR, 3));
        let are_gaussians = gaussians::are_gaussians(element);
        let color_kind = color_kind(element, &columns);
        let fields = columns.map(|column| column.and_then(|column| field(element, column)));
        let vertices = Vertices { rows, fields, color_kind, color_scale: [None; 4] };
        Ok(Some(Self {
            vertices,
            faces,
            has_normals,
            has_colors,
            has_uvs,
            are_gaussians,
            has_gaps: false,
            value: None,
        }))
    }

    /// Returns whether the scale of the colours depends on all of them.
    fn asks_for_colors(&self) -> bool {
        self.has_colors && self.vertices.color_kind.iter().flatten().any(ColorKind::is_wide)
    }

    /// Returns the values of a vertex's colour channels; 0 for a missing channel.
    fn channels(&self, source: &Source, row: usize) -> [f64; 4] {
        std::array::from_fn(|channel| self.value(source, row, COLOR + channel))
    }

    /// Sets the scale of the colours from the brightness of all. Without it there are no colours.
    fn settle_colors(&mut self, brightest: &Brightest) {
        self.vertices.color_scale = color_scale(&self.vertices.color_kind, brightest);
    }

    fn points(&self) -> usize {
        self.vertices.rows.count
    }

    fn triangles(&self) -> usize {
        self.faces.as_ref().map_or(0, |faces| faces.rows.count)
    }

    /// Returns the rows of a piece of points.
    fn rows(&self, piece: usize) -> Range<usize> {
        piece * ROWS..((piece + 1) * ROWS).min(self.points())
    }

    fn value(&self, source: &Source, row: usize, role: usize) -> f64 {
        let Vertices { rows, fields, .. } = &self.vertices;
        let row = &source.bytes()[rows.at + row * rows.stride..];
        fields[role].as_ref().map_or(0.0, |(offset, kind)| number(&row[*offset..], kind, rows.big))
    }

    fn position(&self, source: &Source, row: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.value(source, row, POSITION + axis)))
    }

    /// Returns a vertex, converted as by the reader of whole files.
    fn vertex(&self, source: &Source, row: usize) -> RawPoint {
        let value = |role: usize| self.value(source, row, role);
        let mut vertex = RawPoint {
            row,
            position: self.position(source, row),
            normal: Vec3::ZERO,
            color: [255; 4],
        };
        if self.has_normals {
            vertex.normal = positions::unit(Vec3::from_array(
                [0, 1, 2].map(|axis| value(NORMAL + axis) as f32),
            ));
        }
        if self.has_colors {
            vertex.color = color(self.vertices.color_scale, |channel| value(COLOR + channel));
        }
        if let Some((offset, kind)) = &self.value {
            let Rows { at, stride, big, .. } = self.vertices.rows;
            let bytes = &source.bytes()[at + row * stride + offset..];
            vertex.color = (number(bytes, kind, big) as f32).to_le_bytes();
        }
        vertex
    }

    /// Returns the triangles of a piece, and the index of the first one.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for a polygon, and for an index without a vertex.
    fn triangle_piece(&self, source: &Source, piece: usize) -> Result<(usize, Vec<[u32; 3]>)> {
        let Some(faces) = &self.faces else { return Ok((0, Vec::new())) };
        let Rows { at, count, stride, big } = faces.rows;
        let vertices = self.points();
        let triangle = |row: usize| {
            let bytes = &source.bytes()[at + row * stride..at + (row + 1) * stride];
            let wrong = |message: String| {
                let place = format!("element “face”, row {row}, byte {}", at + row * stride);
                Err(source.error(place, message))
            };
            let corners = number(&bytes[faces.length.0..], &faces.length.1, big);
            if corners != 3.0 {
                return wrong(format!(
                    "has {corners} corners; only triangles can be read in pieces"
                ));
            }
            let corners = [0, 4, 8].map(|corner| {
                let raw = [0, 1, 2, 3].map(|byte| bytes[faces.indices + corner + byte]);
                if big { u32::from_be_bytes(raw) } else { u32::from_le_bytes(raw) }
            });
            match corners.iter().find(|&&index| index as usize >= vertices) {
                Some(index) => wrong(format!("refers to vertex {index}, but there are {vertices}")),
                None => Ok(corners),
            }
        };
        let rows = piece * ROWS..((piece + 1) * ROWS).min(count);
        let is_whole = |corners: &[u32; 3]| {
            !self.has_gaps
                || corners.iter().all(|&row| self.position(source, row as usize).is_finite())
        };
        let is_left = |corners: &Result<[u32; 3]>| corners.as_ref().map_or(true, is_whole);
        Ok((rows.start, rows.map(triangle).filter(is_left).collect::<Result<_>>()?))
    }
}

impl Form for Pieces {
    fn counts(&self) -> Counts {
        Counts { points: self.points() as u64, triangles: self.triangles() as u64 }
    }

    fn pieces(&self) -> [usize; 2] {
        [self.points(), self.triangles()].map(|count| count.div_ceil(ROWS))
    }

    fn orientation(&self) -> Option<Orientation> {
        None
    }

    fn has_normals(&self) -> bool {
        self.has_normals
    }

    fn has_colors(&self) -> bool {
        self.has_colors
    }

    fn has_uvs(&self) -> bool {
        self.has_uvs
    }

    fn warn(&self, source: &Source) {
        if self.are_gaussians {
            gaussians::warn(source);
        }
    }

    fn choose(&mut self, source: &Source, name: &str) -> Result<About> {
        let header = header::read(source)?;
        let vertices = header.elements.iter().find(|element| element.name == "vertex");
        let Some(element) = vertices else { return Ok(About::default()) };
        let column = column_named(source, element, name)?;
        self.value = field(element, column);
        Ok(About { name: element.columns[column].name.clone(), ..About::default() })
    }

    fn survey(&mut self, source: &Source, watch: &dyn Fn(u64)) -> Result<(u64, [DVec3; 2])> {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut brightest, mut kept) = (Brightest::default(), 0);
        let asks_for_colors = self.asks_for_colors();
        let of_piece = |piece: usize| {
            let mut around = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let (mut brightest, mut kept) = (Brightest::default(), 0);
            for row in self.rows(piece) {
                let position = self.position(source, row);
                if !position.is_finite() {
                    continue;
                }
                kept += 1;
                around = (around.0.min(position), around.1.max(position));
                if asks_for_colors {
                    brightest = brightest.with_color(self.channels(source, row));
                }
            }
            Ok((around, brightest, kept, self.rows(piece).end as u64))
        };
        in_order(
            source,
            0..self.pieces()[0],
            |_| 0..0,
            of_piece,
            |(around, of_piece, of_kept, seen)| {
                (low, high) = (low.min(around.0), high.max(around.1));
                brightest = brightest.with(of_piece);
                kept += of_kept;
                watch(seen);
                Ok(())
            },
        )?;
        self.settle_colors(&brightest);
        if kept == 0 {
            let message = "none of the vertices is at finite coordinates";
            return Err(source.error("element “vertex”", message));
        }
        self.has_gaps = kept < self.points();
        if self.has_gaps {
            unplaced::warn(source, self.points() - kept, self.points());
        }
        Ok((kept as u64, [low, high]))
    }

    fn coloring(&self) -> Coloring {
        self.vertices.color_scale
    }

    fn resume(&mut self, coloring: Coloring, points: u64) {
        self.has_gaps = points < self.points() as u64;
        self.vertices.color_scale = coloring;
    }

    fn points(&self, source: &Source, piece: usize, origin: DVec3) -> Result<Vec<StreamPoint>> {
        let point = |row| StreamPoint::new(&self.vertex(source, row), origin);
        let is_placed = |row: &usize| !self.has_gaps || self.position(source, *row).is_finite();
        Ok(self.rows(piece).filter(is_placed).map(point).collect())
    }

    fn attributes(&self, source: &Source) -> Result<Vec<Attribute>> {
        let listed = listed(source)?.into_iter();
        Ok(listed.map(|(described, _)| described).collect())
    }

    fn records(&self, source: &Source, piece: usize, names: &[String]) -> Result<Records> {
        let mut listed = listed(source)?;
        listed.retain(|(described, _)| names.contains(&described.name));
        let Rows { at, stride, big, .. } = self.vertices.rows;
        let is_placed = |row: &usize| !self.has_gaps || self.position(source, *row).is_finite();
        let rows: Vec<usize> = self.rows(piece).filter(is_placed).collect();
        let mut records = Records::default();
        for &row in &rows {
            let vertex = self.vertex(source, row);
            records.positions.push(vertex.position);
            if self.has_normals {
                records.normals.push(vertex.normal);
            }
            if self.has_colors {
                records.colors.push(vertex.color);
            }
        }
        for (described, (offset, kind)) in listed {
            let value =
                |&row: &usize| number(&source.bytes()[at + row * stride + offset..], &kind, big);
            records.columns.push(rows.iter().map(value).collect());
            records.attributes.push(described);
        }
        Ok(records)
    }

    fn is_wide(&self) -> bool {
        let coordinates = self.vertices.fields[POSITION..].iter().take(3).flatten();
        coordinates.into_iter().any(|(_, kind)| {
            matches!(kind, ScalarType::Double | ScalarType::Int | ScalarType::UInt)
        })
    }

    fn triangles(&self, source: &Source, piece: usize) -> Result<(usize, Vec<[u32; 3]>)> {
        self.triangle_piece(source, piece)
    }

    fn vertex(&self, source: &Source, index: usize) -> Option<RawPoint> {
        Some(self.vertex(source, index))
    }

    fn position(&self, source: &Source, index: usize) -> Option<DVec3> {
        Some(self.position(source, index))
    }
}

/// Where the elements that matter are in a file.
#[derive(Default)]
struct Located<'h> {
    /// The first element “vertex”.
    vertices: Option<(&'h Element, Rows)>,
    faces: Option<Faces>,
}

/// Locates the elements. Returns `None` for rows of different lengths, and for faces that are not
/// triangles.
fn locate<'h>(source: &Source, header: &'h Header, big: bool) -> Result<Option<Located<'h>>> {
    let mut located = Located::default();
    let mut at = header.payload;
    for element in &header.elements {
        let is_face = element.name == "face";
        let stride = if is_face { triangle_stride(element) } else { element.stride() };
        let Some(stride) = stride.filter(|_| element.name != "tristrips") else {
            return Ok(None);
        };
        let left = source.bytes().len() - at;
        if is_face && element.count > 0 {
            let rows = Rows { at, count: element.count.min(left / stride), stride, big };
            let (None, Some(faces)) = (&located.faces, Faces::find(element, rows)) else {
                return Ok(None);
            };
            if !faces.are_triangles(source) {
                return Ok(None);
            }
            located.faces = Some(faces);
        }
        let size = element.count.checked_mul(stride).filter(|&size| size <= left);
        let Some(size) = size else { return Err(cut(source, element, left / stride)) };
        let rows = Rows { at, count: element.count, stride, big };
        at += size;
        if is_face || element.name == "vertex" {
            source.check_points(
                &format!("the count of element “{}”", element.name),
                element.count as u64,
            )?;
        }
        if element.name == "vertex" && located.vertices.is_none() {
            located.vertices = Some((element, rows));
        }
    }
    Ok(Some(located))
}

/// Returns the properties of the vertices that have no other role, each with its offset and type.
fn listed(source: &Source) -> Result<Vec<(Attribute, (usize, ScalarType))>> {
    let header = header::read(source)?;
    let vertices = header.elements.iter().find(|element| element.name == "vertex");
    let Some(element) = vertices else { return Ok(Vec::new()) };
    let columns = ROLES.map(|names| element.column(names));
    // A role counts if all of its columns are there.
    let of_role = |column: usize| {
        [POSITION..NORMAL, NORMAL..COLOR, COLOR..UV].into_iter().any(|roles| {
            let roles = &columns[roles];
            roles[..3].iter().all(Option::is_some) && roles.contains(&Some(column))
        })
    };
    let others = (0..element.columns.len()).filter(|column| !of_role(*column));
    let described = |column: usize| {
        let (offset, kind) = field(element, column)?;
        let name = element.columns[column].name.clone();
        Some((Attribute { name, kind: number_type(&kind) }, (offset, kind)))
    };
    Ok(others.filter_map(described).collect())
}

fn number_type(kind: &ScalarType) -> NumberType {
    match kind {
        ScalarType::Char => NumberType::I8,
        ScalarType::UChar => NumberType::U8,
        ScalarType::Short => NumberType::I16,
        ScalarType::UShort => NumberType::U16,
        ScalarType::Int => NumberType::I32,
        ScalarType::UInt => NumberType::U32,
        ScalarType::Float => NumberType::F32,
        ScalarType::Double => NumberType::F64,
    }
}

/// Returns the offset of a column of numbers in its row, and their type.
fn field(element: &Element, column: usize) -> Option<(usize, ScalarType)> {
    let offset: Option<usize> = element.columns[..column].iter().map(|before| before.width()).sum();
    let PropertyType::Scalar(kind) = &element.columns[column].kind else { return None };
    Some((offset?, kind.clone()))
}

impl Faces {
    /// Locates faces whose only list contains 32-bit indices.
    fn find(element: &Element, rows: Rows) -> Option<Self> {
        let column = element.column(&["vertex_indices", "vertex_index"])?;
        let PropertyType::List(_, ScalarType::Int | ScalarType::UInt) =
            element.columns[column].kind
        else {
            return None;
        };
        let (offset, kind) = list_place(element);
        Some(Self { rows, length: (offset, kind.clone()), indices: offset + width(kind) })
    }

    /// Returns whether sampled faces across the whole file have three corners. After a face with
    /// another number, no row is at its expected offset.
    fn are_triangles(&self, source: &Source) -> bool {
        const PROBES: usize = 1 << 10;
        let Rows { at, count, stride, big } = self.rows;
        let probes = PROBES.min(count);
        let row = |probe: usize| {
            probe as u128 * (count - 1) as u128 / probes.saturating_sub(1).max(1) as u128
        };
        (0..probes).all(|probe| {
            let start = at + row(probe) as usize * stride + self.length.0;
            number(&source.bytes()[start..], &self.length.1, big) == 3.0
        })
    }
}

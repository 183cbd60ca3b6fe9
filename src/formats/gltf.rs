//! glTF 2.0 and GLB: the meshes of the default scene, with base colours and pictures, or its
//! trained 3D Gaussians.
//!
//! The JSON is read into the types of the gltf crate without its validation, which panics on some
//! broken files and accepts others (cycles, counts without bytes). Every index is looked up and
//! every range checked where it is used.

mod accessor;
mod buffers;
mod gaussians;
mod materials;
mod nodes;
#[cfg(test)]
mod tests;

pub use gaussians::{holds_gaussians, read_gaussians, write_gaussians};

use super::shared::unplaced;
use crate::{
    Result,
    about::Orientation,
    input::{Source, copy, positions},
    surface::{Mesh, Texture},
    warning,
};
use ::gltf::json::{self, mesh::Mode, mesh::Semantic, validation::Checked};
use buffers::Buffers;
use gaussians::Marks;
use glam::{DMat3, DMat4, DVec3, Mat2, Vec2, Vec3};
use materials::{Alpha, Base};
use std::{
    collections::{BTreeSet, HashMap},
    ops::Range,
    sync::Arc,
};

/// Extensions that a file may require, by prefix. These are those that are read (among them
/// `KHR_materials_pbrSpecularGlossiness`), and those that only change the look of a material in
/// ways that splats do not show. Those of Gaussians are checked at each primitive.
const KNOWN: [&str; 7] = [
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_materials_",
    gaussians::NAME,
];

/// A file whose JSON is read.
struct Opened<'a> {
    root: json::Root,
    text: String,
    /// The binary chunk of a GLB.
    binary: Option<&'a [u8]>,
}

/// Reads a glTF or GLB file: the triangles, lines and points of the default scene in its world
/// frame. Reads vertex colours, base colours and textures, with opacities as the
/// alpha modes require, and instances (`EXT_mesh_gpu_instancing`). Materials may be unlit. What is
/// not drawn, such as skins and animations, is named in a warning.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for malformed JSON, indices and ranges outside their
/// target, cyclic nodes, and references outside the file's folder. Also for positions that are not
/// finite, and for required extensions that are not supported (among them Draco and meshopt
/// compression). [`Error::Limit`](crate::Error::Limit) for counts over the limits.
pub fn read(source: &Source) -> Result<Mesh> {
    let Opened { root, text, binary } = open(source)?;
    let marks = if root.extensions_used.iter().any(|name| name == gaussians::NAME) {
        Marks::read(source, &text)?
    } else {
        Marks::default()
    };
    drop(text);
    let buffers = Buffers::open(source, &root, binary)?;
    let mut builder = Builder {
        source,
        root: &root,
        buffers: &buffers,
        marks: &marks,
        has_gaussians: false,
        positions: Vec::new(),
        mesh: Mesh::default(),
        loose: Vec::new(),
        material_of: HashMap::new(),
        pictures: HashMap::new(),
        idle: BTreeSet::new(),
    };
    let meshes = nodes::meshes(source, &root, &buffers)?;
    builder.find_idle();
    builder.make_room(&meshes)?;
    for (transform, mesh) in meshes {
        builder.add_mesh(transform, mesh)?;
    }
    builder.finish()
}

/// Reads the JSON, and checks that no extension is required that is not supported.
fn open<'a>(source: &'a Source) -> Result<Opened<'a>> {
    let (text, binary) = buffers::split(source)?;
    // The copy of the text counts too.
    source.spend(
        "the size of the scene's tree in bytes",
        tree_bytes(text).saturating_add(text.len() as u64),
    )?;
    let text = copy::text(text)
        .map_err(|at| source.error("JSON", format!("byte {at} is not UTF-8 text")))?;
    let root: json::Root = json::deserialize::from_str(&text)
        .map_err(|error| source.error("JSON", error.to_string()))?;
    for extension in &root.extensions_required {
        if !KNOWN.iter().any(|known| extension.starts_with(known)) {
            return Err(source
                .error("extensionsRequired", format!("the extension {extension} is not supported"))
                .hint(materials::remedy(extension)));
        }
    }
    Ok(Opened { root, text, binary })
}

/// Returns an upper bound on the bytes that the tree of a JSON text takes: for each object the
/// largest type that objects become, and for each comma a number. Both include the spare capacity
/// of lists.
fn tree_bytes(text: &[u8]) -> u64 {
    let largest = [
        size_of::<json::Node>(),
        size_of::<json::Material>(),
        size_of::<json::Accessor>(),
        size_of::<json::mesh::Primitive>(),
        size_of::<json::buffer::View>(),
        size_of::<json::Image>(),
        size_of::<json::animation::Channel>(),
        // A map of an extension that the crate does not know: a node of a tree.
        11 * (size_of::<String>() + size_of::<serde_json::Value>()) + 64,
    ];
    let object = largest.into_iter().max().unwrap_or_default() as u64;
    let count = |letter: u8| text.iter().filter(|&&b| b == letter).count() as u64;
    text.len() as u64 + 2 * object * count(b'{') + 16 * count(b',')
}

/// Bytes that a vertex, and the corner of a face, may take in all lists while the file is read.
const VERTEX: u64 = 160;
const CORNER: u64 = 40;

/// A primitive in its place in the scene, and the indices of its vertices.
struct Part<'a> {
    primitive: &'a json::mesh::Primitive,
    /// Names the primitive in errors.
    place: &'a str,
    transform: DMat4,
    vertices: Range<usize>,
}

impl Part<'_> {
    /// Returns whether the transform mirrors the primitive.
    fn mirrors(&self) -> bool {
        self.transform.determinant() < 0.0
    }

    /// Returns an error if an attribute has another number of values than there are vertices.
    fn check(&self, source: &Source, what: &str, number: usize) -> Result<()> {
        let count = self.vertices.len();
        if number == count {
            return Ok(());
        }
        Err(source.error(self.place, format!("has {count} positions but {number} {what}")))
    }
}

/// Returns the index of the accessor of an attribute.
fn attribute(primitive: &json::mesh::Primitive, semantic: Semantic) -> Option<usize> {
    primitive.attributes.get(&Checked::Valid(semantic)).map(|index| index.value())
}

/// The mesh while it is being built.
struct Builder<'a> {
    source: &'a Source<'a>,
    root: &'a json::Root,
    buffers: &'a Buffers<'a>,
    /// Says which primitives are Gaussians.
    marks: &'a Marks,
    /// Whether the scene has Gaussians, which are left out.
    has_gaussians: bool,
    positions: Vec<DVec3>,
    mesh: Mesh,
    /// The vertices of points.
    loose: Vec<Range<u32>>,
    /// Index in the mesh's materials, by index in the file (`None`: the default material).
    material_of: HashMap<Option<usize>, u32>,
    /// Decoded images, by image and alpha mode.
    pictures: HashMap<(usize, Alpha), Arc<Texture>>,
    /// What the file says and the mesh does not, to be named in one warning.
    idle: BTreeSet<String>,
}

impl Builder<'_> {
    /// Adds the memory of the whole scene to the budget. A mesh may be used by many nodes, and an
    /// accessor by many primitives. Then the scene is far larger than the file, so its size must be
    /// known before it is built.
    fn make_room(&self, meshes: &[(DMat4, usize)]) -> Result<()> {
        let of_primitive = |primitive: &json::mesh::Primitive| {
            let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            let vertices = position.map_or(0, |accessor| self.buffers.claimed(accessor.value()));
            let corners = primitive
                .indices
                .map_or(vertices, |accessor| self.buffers.claimed(accessor.value()));
            // Each corner of a strip or fan makes one triangle.
            let triangles = if primitive.mode == Checked::Valid(Mode::Triangles) {
                corners / 3
            } else {
                corners
            };
            [vertices, corners, triangles]
        };
        let add = |sum: [u64; 3], more: [u64; 3]| [0, 1, 2].map(|i| sum[i].saturating_add(more[i]));
        let sizes: Vec<[u64; 3]> = self
            .root
            .meshes
            .iter()
            .enumerate()
            .map(|(index, mesh)| {
                let primitives = mesh.primitives.iter().enumerate();
                let primitives = primitives.filter(|(at, _)| !self.marks.are_gaussians(index, *at));
                primitives.map(|(_, primitive)| of_primitive(primitive)).fold([0; 3], add)
            })
            .collect();
        let all = meshes.iter().filter_map(|(_, mesh)| sizes.get(*mesh)).copied().fold([0; 3], add);
        let [vertices, corners, triangles] = all;
        self.source.check_points("the number of vertices", vertices)?;
        self.source.check_points("the number of triangles", triangles)?;
        let bytes = vertices.saturating_mul(VERTEX).saturating_add(corners.saturating_mul(CORNER));
        self.source.spend("the size of the scene in bytes", bytes)
    }

    /// Finds what the whole file says and the mesh does not.
    fn find_idle(&mut self) {
        let root = self.root;
        let morphs =
            |mesh: &json::Mesh| mesh.primitives.iter().any(|primitive| primitive.targets.is_some());
        let parts = [
            (!root.animations.is_empty(), "animations"),
            (!root.skins.is_empty(), "skins"),
            (root.meshes.iter().any(morphs), "morph targets"),
        ];
        let parts = parts.into_iter().filter(|(is_there, _)| *is_there);
        self.idle.extend(parts.map(|(_, name)| name.to_owned()));
        let is_idle = |name: &&String| {
            name.starts_with("KHR_materials_")
                && !matches!(
                    name.as_str(),
                    "KHR_materials_unlit"
                        | "KHR_materials_pbrSpecularGlossiness"
                        | "KHR_materials_emissive_strength"
                        | "KHR_materials_ior"
                        | "KHR_materials_specular"
                )
        };
        self.idle.extend(root.extensions_used.iter().filter(is_idle).cloned());
    }

    fn add_mesh(&mut self, transform: DMat4, index: usize) -> Result<()> {
        let root = self.root;
        let Some(mesh) = root.meshes.get(index) else {
            return Err(self.source.error(
                format!("mesh {index}"),
                format!("does not exist; there are {} meshes", root.meshes.len()),
            ));
        };
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            self.source.check_time()?;
            if self.marks.are_gaussians(index, number) {
                self.has_gaussians = true;
                continue;
            }
            self.add_primitive(transform, primitive, &format!("mesh {index}, primitive {number}"))?;
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        transform: DMat4,
        primitive: &json::mesh::Primitive,
        place: &str,
    ) -> Result<()> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err(self.source.error(place, "has an unknown mode"));
        };
        let Some(position) = attribute(primitive, Semantic::Positions) else { return Ok(()) };
        let draco = "KHR_draco_mesh_compression";
        let extensions = primitive.extensions.as_ref();
        let is_packed = extensions.is_some_and(|extensions| extensions.others.contains_key(draco));
        let has_data =
            |accessor: &json::Accessor| accessor.buffer_view.is_some() || accessor.sparse.is_some();
        if is_packed && !self.root.accessors.get(position).is_some_and(has_data) {
            return Err(self
                .source
                .error(place, format!("is compressed by {draco}, which is not supported"))
                .hint(materials::remedy(draco)));
        }
        let vertices = self.add_positions(transform, position, place)?;
        let base = self.base(primitive.material.map(|index| index.value()), place)?;
        let part = Part { primitive, place, transform, vertices };
        self.add_normals(&part)?;
        self.add_colors(&part, &base)?;
        self.add_uvs(&part, &base)?;
        match mode {
            Mode::Points => {
                self.tint(&part, &base);
                self.loose.push(part.vertices.start as u32..part.vertices.end as u32);
            }
            Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                self.tint(&part, &base);
                self.add_lines(&part, mode)?;
            }
            _ => self.add_triangles(&part, mode, &base)?,
        }
        Ok(())
    }

    /// Gives the vertices of points and lines the colour of their material, if they have none.
    fn tint(&mut self, part: &Part, base: &Base) {
        let Range { start, end } = part.vertices;
        let material = self
            .root
            .materials
            .get(part.primitive.material.map_or(usize::MAX, |index| index.value()));
        let Some(color) =
            material.map(|material| material.pbr_metallic_roughness.base_color_factor.0)
        else {
            return;
        };
        let [red, green, blue, alpha] = displayed(color);
        let tint = [red, green, blue].map(|part| (part * 255.0).round() as u8);
        let opacity = base.alpha.apply((alpha * 255.0).round() as u8);
        if self.mesh.colors.len() >= end {
            for color in &mut self.mesh.colors[start..end] {
                for (part, factor) in color.iter_mut().zip(tint) {
                    *part = (u16::from(*part) * u16::from(factor) / 255) as u8;
                }
            }
            return;
        }
        self.mesh.colors.resize(start, [255; 4]);
        self.mesh.colors.resize(end, [tint[0], tint[1], tint[2], opacity]);
    }

    /// Adds the segments of a primitive's lines.
    fn add_lines(&mut self, part: &Part, mode: Mode) -> Result<()> {
        let (start, count) = (part.vertices.start as u32, part.vertices.len());
        let corners = match part.primitive.indices {
            Some(index) => self.buffers.indices(index.value(), part.place, count)?,
            None => (0..count as u32).collect(),
        };
        let lines = &mut self.mesh.lines;
        let mut add = |a: u32, b: u32| lines.push([a + start, b + start]);
        match mode {
            Mode::Lines => corners.as_chunks().0.iter().for_each(|&[a, b]| add(a, b)),
            _ => corners.windows(2).for_each(|ends| add(ends[0], ends[1])),
        }
        if let (Mode::LineLoop, &[first, _, .., last]) = (mode, &corners[..]) {
            add(last, first);
        }
        self.source.check_points("the number of lines", self.mesh.lines.len() as u64)?;
        Ok(())
    }

    /// Adds the vertices of a primitive. Returns their indices.
    fn add_positions(
        &mut self,
        transform: DMat4,
        accessor: usize,
        place: &str,
    ) -> Result<Range<usize>> {
        let points: Vec<[f32; 3]> = self.buffers.floats(accessor, place, false)?;
        let start = self.positions.len();
        let total =
            self.source.check_points("the number of vertices", (start + points.len()) as u64)?;
        if u32::try_from(total).is_err() {
            return Err(self
                .source
                .error(place, "has more vertices than 32-bit indices can address"));
        }
        self.positions.extend(
            points.iter().map(|p| transform.transform_point3(Vec3::from_array(*p).as_dvec3())),
        );
        Ok(start..total)
    }

    /// Adds the normals of a primitive's vertices, if there are any.
    fn add_normals(&mut self, part: &Part) -> Result<()> {
        let Some(accessor) = attribute(part.primitive, Semantic::Normals) else { return Ok(()) };
        let normals: Vec<[f32; 3]> = self.buffers.floats(accessor, part.place, false)?;
        part.check(self.source, "normals", normals.len())?;
        // The cofactor matrix transforms normals like the inverse transpose, and also exists for a
        // flat transform. It carries the determinant as a factor, and so its sign.
        let [x, y, z] = DMat3::from_mat4(part.transform).to_cols_array_2d().map(DVec3::from_array);
        let sign = if part.mirrors() { -1.0 } else { 1.0 };
        let turn = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        let turned = normals
            .iter()
            .map(|n| positions::unit((turn * Vec3::from_array(*n).as_dvec3()).as_vec3()));
        self.mesh.normals.resize(part.vertices.start, Vec3::ZERO);
        self.mesh.normals.extend(turned);
        Ok(())
    }

    /// Adds the colours of a primitive's vertices, if there are any.
    fn add_colors(&mut self, part: &Part, base: &Base) -> Result<()> {
        let Some(accessor) = attribute(part.primitive, Semantic::Colors(0)) else { return Ok(()) };
        let colors = self.buffers.colors(accessor, part.place)?;
        part.check(self.source, "colours", colors.len())?;
        self.mesh.colors.resize(part.vertices.start, [255; 4]);
        self.mesh.colors.extend(colors.iter().map(|&color| {
            let [r, g, b, a] = displayed(color).map(|v| (v * 255.0).round() as u8);
            [r, g, b, base.alpha.apply(a)]
        }));
        Ok(())
    }

    /// Adds the texture coordinates of a primitive's vertices, if its material has a picture.
    fn add_uvs(&mut self, part: &Part, base: &Base) -> Result<()> {
        let Some(info) = base.texture else { return Ok(()) };
        let shift =
            info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
        let set = shift.and_then(|shift| shift.tex_coord).unwrap_or(info.tex_coord);
        let Some(accessor) = attribute(part.primitive, Semantic::TexCoords(set)) else {
            return Ok(());
        };
        let mut uvs: Vec<[f32; 2]> = self.buffers.floats(accessor, part.place, false)?;
        part.check(self.source, "texture coordinates", uvs.len())?;
        if let Some(shift) = shift {
            let turn = Mat2::from_angle(-shift.rotation.0);
            for uv in &mut uvs {
                let scaled = Vec2::from_array(*uv) * Vec2::from_array(shift.scale.0);
                *uv = (turn * scaled + Vec2::from_array(shift.offset.0)).to_array();
            }
        }
        if let Some(vertex) = uvs.iter().position(|uv| !Vec2::from_array(*uv).is_finite()) {
            let place = format!("{}: vertex {vertex}", part.place);
            return Err(super::uv_error(self.source, place, Vec2::from_array(uvs[vertex])));
        }
        self.mesh.uvs.resize(part.vertices.start, Vec2::ZERO);
        self.mesh.uvs.extend(uvs.iter().map(|&uv| Vec2::from_array(uv)));
        Ok(())
    }

    /// Adds the triangles of a primitive, and its material.
    fn add_triangles(&mut self, part: &Part, mode: Mode, base: &Base) -> Result<()> {
        let Part { primitive, place, .. } = *part;
        let (start, count) = (part.vertices.start as u32, part.vertices.len());
        let corners = match primitive.indices {
            Some(index) => self.buffers.indices(index.value(), place, count)?,
            None => (0..count as u32).collect(),
        };
        let material = self.material(primitive.material.map(|index| index.value()), base)?;
        let (mesh, mirrors) = (&mut self.mesh, part.mirrors());
        triangles(mode, &corners, |[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|corner| corner + start);
            mesh.triangles.push(if mirrors { [a, c, b] } else { [a, b, c] });
        });
        self.source.check_points("the number of triangles", self.mesh.triangles.len() as u64)?;
        self.mesh.triangle_materials.resize(self.mesh.triangles.len(), material);
        Ok(())
    }

    fn finish(mut self) -> Result<Mesh> {
        let count = self.positions.len();
        if count == 0 && self.has_gaussians {
            return Err(self
                .source
                .error("scene", "contains trained 3D Gaussians, and no meshes")
                .hint("read the file as Gaussians"));
        }
        if count == 0 {
            return Err(self.source.error("scene", "contains no meshes with positions"));
        }
        if self.has_gaussians {
            warning::give!(
                "{}: contains meshes and trained 3D Gaussians; the Gaussians are left out",
                self.source.path.display()
            );
        }
        if !self.idle.is_empty() {
            let idle: Vec<&str> = self.idle.iter().map(String::as_str).collect();
            let file = self.source.path.display();
            warning::give!("{file}: drawn without its {}", idle.join(", "));
        }
        let positions = &self.positions;
        (self.mesh.origin, self.mesh.positions) =
            positions::settle_some(self.source, count, |i| positions[i])?;
        if !self.mesh.normals.is_empty() {
            self.mesh.normals.resize(count, Vec3::ZERO);
        }
        if !self.mesh.colors.is_empty() {
            self.mesh.colors.resize(count, [255; 4]);
        }
        if !self.mesh.uvs.is_empty() {
            self.mesh.uvs.resize(count, Vec2::ZERO);
        }
        // Beside triangles and lines, points are balls: lines without a length.
        if !self.mesh.triangles.is_empty() || !self.mesh.lines.is_empty() {
            let points = std::mem::take(&mut self.loose).into_iter().flatten();
            self.mesh.lines.extend(points.map(|point| [point; 2]));
        }
        self.mesh.about.orientation = Some(Orientation::Y_UP);
        unplaced::leave_out(self.source, &mut self.mesh)?;
        Ok(self.mesh)
    }
}

/// Converts a colour from linear light to display values (sRGB); the opacity is unchanged.
fn displayed([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    let encode =
        |v: f32| if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    [encode(r), encode(g), encode(b), a].map(|v| if v.is_nan() { 1.0 } else { v.clamp(0.0, 1.0) })
}

/// Passes the triangles of a list, strip or fan of corners to `give`.
fn triangles(mode: Mode, corners: &[u32], mut give: impl FnMut([u32; 3])) {
    match mode {
        Mode::Triangles => corners.chunks_exact(3).for_each(|t| give([t[0], t[1], t[2]])),
        Mode::TriangleStrip => corners.windows(3).enumerate().for_each(|(i, t)| {
            give(if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] });
        }),
        Mode::TriangleFan => {
            corners.get(1..).unwrap_or(&[]).windows(2).for_each(|t| give([corners[0], t[0], t[1]]));
        }
        _ => {}
    }
}

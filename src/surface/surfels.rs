//! From meshes and point clouds to elliptic surfels.
//!
//! Large triangles are cut first ([`refine`]). Then every vertex gets one surfel for each nearly
//! flat group of the triangles around it ([`Maker`]), in the plane of the group's normal.
//!
//! A surfel has the moments of its triangles. If they surround the vertex, it is centred there. At
//! a boundary or a crease it is moved inward and is narrow across, so that half of the light is
//! gone near the edge. Then it is widened until it covers its share of each triangle. A surface
//! therefore has no holes, whatever the shapes of its triangles.

use super::{
    Mesh,
    adjacency::{Connected, is_split},
    cloud::{self, Parts},
    fan::{Made, Maker, Sums},
    fan_rules::{LEAST_RATIO_SQUARED, LEAST_SQUARE},
    refine::{Origin, budget, count_of_refined, is_fine, refine},
    smooth::Grouping,
    survey::has_area,
};
use crate::{
    Deadline, Error, Result,
    deadline::Clock,
    facet::{FacetSet, Size},
    math::Bounds,
    memory,
    parallel::prelude::*,
    splat::{Splat, Surfels},
};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::{borrow::Cow, ops::RangeInclusive, str::FromStr};

/// How the points of a cloud are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum PointStyle {
    /// Points on surfaces are surfels; others, and all whose size is given, are balls.
    Auto,
    /// Discs in the plane of a point's neighbours, which overlap to a surface.
    #[default]
    Surfels,
    /// Balls.
    Spheres,
    /// Flat discs that face the eye: lit by the file's normals, or not at all.
    Dots,
}

impl FromStr for PointStyle {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        Ok(match text {
            "auto" => Self::Auto,
            "surfels" => Self::Surfels,
            "spheres" => Self::Spheres,
            "dots" => Self::Dots,
            _ => return Err("points are auto, surfels, spheres or dots".into()),
        })
    }
}

/// How surfels are made from a mesh or point cloud.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfelOptions {
    /// Factor on all radii. Below 1 the surface may show holes.
    pub radius_scale: f32,
    /// Optical depth of the surface, times its own opacity where it has one. Below 7 the surfels'
    /// depths add up to it. From 7 on, which is opaque, it is the optical depth at the centre of
    /// each surfel; inside a triangle the total is then never below 0.28 times this.
    pub optical_depth: f32,
    /// Neighbouring triangles whose normals differ by more than this angle meet in a crease. An
    /// angle above 60, such as the default, is the usual one: 60, but 38 for the facets of a mesh
    /// as construction programs make it.
    pub crease_angle_degrees: f32,
    /// Triangles are cut until no edge is longer than this fraction of the bounding box's diagonal.
    pub largest_spacing: f32,
    /// Most triangles after cutting, unless an eighth more than the input is larger. The spacing
    /// grows to stay within this limit.
    pub most_triangles: usize,
    /// Whether the directions of normals are their colours: x, y and z from −1 to 1 become red,
    /// green and blue.
    pub color_by_normal: bool,
    /// Most triangles of a mesh that is drawn as facets ([`Mesh::facets`]), which have its outline
    /// exactly. In pictures of usual sizes, the triangles of a larger mesh are no larger than
    /// pixels. 0 draws surfels always.
    pub most_facets: usize,
    /// How the points of a cloud are drawn.
    #[serde(default)]
    pub points: PointStyle,
    /// The diameter of points that are balls or discs; by their distances if `None`.
    #[serde(default)]
    pub point_size: Option<Size>,
    /// The width of lines; [`LINE_WIDTH`](Self::LINE_WIDTH) if `None`.
    #[serde(default)]
    pub line_width: Option<Size>,
    /// When the surfels must be ready.
    #[serde(skip)]
    pub deadline: Deadline,
}

impl SurfelOptions {
    /// Factors on radii whose squares fit in 32 bits.
    pub const RADIUS_SCALES: RangeInclusive<f32> = 1e-6..=1e6;
    /// The usual width of lines.
    pub const LINE_WIDTH: Size = Size::Pixels(3.0);
    /// Fractions of the diagonal down to which edges can be cut. At smaller ones the fourth power
    /// does not fit in 32 bits. From 1 on, no edge is cut.
    pub const SPACINGS: RangeInclusive<f32> = 1e-9..=f32::MAX;

    /// Checks that the options are positive numbers, and within their ranges.
    ///
    /// # Errors
    /// [`Error::Argument`], which names the option.
    pub fn validate(&self) -> Result<()> {
        let values = [
            ("radius_scale", self.radius_scale),
            ("optical_depth", self.optical_depth),
            ("crease_angle_degrees", self.crease_angle_degrees),
            ("largest_spacing", self.largest_spacing),
        ];
        for (name, value) in values {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Argument(format!(
                    "{name} is {value}; a positive number is needed"
                )));
            }
        }
        for (name, value, range) in [
            ("radius_scale", self.radius_scale, Self::RADIUS_SCALES),
            ("largest_spacing", self.largest_spacing, Self::SPACINGS),
            ("optical_depth", self.optical_depth, 0.0..=Splat::MOST_OPTICAL_DEPTH),
        ] {
            if !range.contains(&value) {
                let (least, most) = (range.start(), range.end());
                return Err(Error::Argument(format!(
                    "{name} is {value:e}; {least:e} to {most:e} are allowed"
                )));
            }
        }
        for (name, size) in [("point_size", self.point_size), ("line_width", self.line_width)] {
            size.map_or(Ok(()), |size| size.validate(name))?;
        }
        Ok(())
    }

    /// Returns the most triangles that cutting `triangles` of them may produce.
    pub(crate) fn most_once_cut(&self, triangles: usize) -> usize {
        budget(self.most_triangles, triangles)
    }
}

impl Default for SurfelOptions {
    fn default() -> Self {
        Self {
            radius_scale: 1.0,
            optical_depth: 14.0,
            crease_angle_degrees: 75.0,
            largest_spacing: 1.0 / 128.0,
            most_triangles: 1 << 23,
            color_by_normal: false,
            most_facets: 1 << 20,
            points: PointStyle::Surfels,
            point_size: None,
            line_width: None,
            deadline: Deadline::NEVER,
        }
    }
}

/// Where footprints end, in standard deviations.
pub(crate) const EXTENT: f32 = 3.0;

/// The name of this module's work in errors.
const WORK: &str = "making surfels";

/// Vertices per parallel task.
const CHUNK: usize = 1 << 12;

impl Mesh {
    /// Makes surfels that cover the triangles without holes, stand for lines, or, without either,
    /// for the points. Lengths are in world units and centres are relative to the mesh's origin.
    /// The order depends on the input only.
    ///
    /// Colours are vertex colour × material × texture. A surfel has the file's normal at its vertex
    /// if there is one. Otherwise it has the angle-weighted normal of the triangles that are smooth
    /// with its own there, interpolated over a triangle that was cut. The surfel is perpendicular
    /// to this normal if that is within 20° of its triangles' mean normal. If a closed mesh has no
    /// normals, they are turned outward.
    ///
    /// Triangles without area and vertices that no triangle uses produce nothing. Of points that
    /// coincide, only the first produces a surfel.
    ///
    /// # Errors
    /// - [`Error::NothingToDraw`] if nothing is left.
    /// - [`Error::Timeout`] after the deadline.
    /// - [`Error::Memory`] if there is too little.
    /// - [`Error::Argument`] for options that are not positive numbers, or outside
    ///   [`RADIUS_SCALES`](SurfelOptions::RADIUS_SCALES), [`SPACINGS`](SurfelOptions::SPACINGS) and
    ///   [`MOST_OPTICAL_DEPTH`](Splat::MOST_OPTICAL_DEPTH). Also for a mesh whose origin, positions
    ///   or texture coordinates are not finite, or whose indices or attributes do not match its
    ///   positions.
    pub fn surfels(&self, options: &SurfelOptions) -> Result<Surfels> {
        let _span = tracing::info_span!("surfels").entered();
        self.check(options)?;
        let mut splats = match (self.triangles.is_empty(), self.lines.is_empty()) {
            (true, true) => cloud::surfels(self, options)?,
            (true, false) => Vec::new(),
            (false, _) => of_triangles(self, options)?,
        };
        if let Some(lines) = self.line_rods(options)? {
            splats.extend(lines.rod_splats().splats);
        }
        if splats.is_empty() {
            return Err(self.nothing());
        }
        Ok(self.set_of(splats))
    }

    /// Returns a point cloud as [`points`](SurfelOptions::points) says: the surfels of the points
    /// on surfaces, and the other points as [rods](crate::facet::Rod), which are balls or discs.
    /// Where some point is not opaque, all are surfels. Lengths are in world units, and centres are
    /// relative to the mesh's origin. The order depends on the input only.
    ///
    /// # Errors
    /// As [`surfels`](Self::surfels).
    pub fn points(&self, options: &SurfelOptions) -> Result<(Option<Surfels>, Option<FacetSet>)> {
        let _span = tracing::info_span!("points").entered();
        self.check(options)?;
        let Parts { surfels, dots } = cloud::parts(self, options)?;
        if surfels.is_empty() && dots.is_empty() {
            return Err(self.nothing());
        }
        let surfels = (!surfels.is_empty()).then(|| self.set_of(surfels));
        let dots = (!dots.is_empty()).then(|| FacetSet::of_rods(self.origin, dots));
        Ok((surfels, dots))
    }

    fn set_of(&self, splats: Vec<Splat>) -> Surfels {
        Surfels { origin: self.origin, splats, extent: EXTENT }
    }

    /// Returns the smallest and the largest world coordinates of what is drawn: the corners of all
    /// triangles, or all positions if there are no triangles. `None` if there is nothing.
    pub fn bounds(&self) -> Option<Bounds> {
        Some(Bounds::between(self.origin, self.local_bounds()?))
    }

    /// Like [`bounds`](Self::bounds), relative to the origin. Added to a distant origin, the size
    /// could vanish by rounding.
    pub(super) fn local_bounds(&self) -> Option<[Vec3; 2]> {
        let none = || (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let with = |(low, high): (Vec3, Vec3), place: &Vec3| (low.min(*place), high.max(*place));
        let union = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        let (low, high) = if self.triangles.is_empty() || !self.lines.is_empty() {
            self.positions.par_iter().fold(none, with).reduce(none, union)
        } else {
            let places =
                |triangle: &[u32; 3]| triangle.map(|vertex| self.positions.get(vertex as usize));
            let triangles = self.triangles.par_iter();
            triangles
                .fold(none, |all, t| places(t).into_iter().flatten().fold(all, with))
                .reduce(none, union)
        };
        low.cmple(high).all().then_some([low, high])
    }

    /// Returns the area of all triangles. Their indices must be within the positions.
    pub(super) fn area(&self) -> f64 {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize].as_dvec3());
            (b - a).cross(c - a).length() * 0.5
        };
        self.triangles.par_iter().with_min_len(CHUNK).map(area).sum()
    }

    /// Returns the number of triangles that surfels are made of, after large ones are cut. If there
    /// are more than `room`, the result is an estimate above `room`, which takes no more memory to
    /// compute.
    ///
    /// # Errors
    /// As [`surfels`](Self::surfels).
    pub fn triangles_once_cut(&self, options: &SurfelOptions, room: usize) -> Result<usize> {
        self.check(options)?;
        let Some(bounds) = self.local_bounds() else { return Ok(0) };
        let largest = largest_edge(bounds, self.area(), options);
        self.check_extent(largest)?;
        count_of_refined(self, largest, options.most_triangles, room, options.deadline)
    }

    pub(super) fn check(&self, options: &SurfelOptions) -> Result<()> {
        options.validate()?;
        self.validate()
    }

    /// Refuses a mesh that was built by hand and is inconsistent, or whose positions are not
    /// finite.
    pub(crate) fn validate(&self) -> Result<()> {
        if !self.origin.is_finite() {
            return Err(Error::Argument(format!(
                "the origin {} of the mesh is not finite",
                self.origin
            )));
        }
        self.validate_lengths()?;
        let count = self.positions.len();
        if u32::try_from(count).is_err() || self.triangles.len() > u32::MAX as usize / 3 {
            return Err(Error::Argument(
                "the mesh has more vertices or corners than 32 bits can name".into(),
            ));
        }
        if !self.triangles.par_iter().all(|t| t.iter().all(|&index| (index as usize) < count)) {
            return Err(Error::Argument(format!(
                "a triangle refers beyond the mesh's {count} vertices"
            )));
        }
        if !self.lines.par_iter().all(|line| line.iter().all(|&index| (index as usize) < count)) {
            return Err(Error::Argument(format!(
                "a line refers beyond the mesh's {count} vertices"
            )));
        }
        if !self.triangle_materials.par_iter().all(|&index| (index as usize) < self.materials.len())
        {
            return Err(Error::Argument(
                "a triangle refers to a material that is not there".into(),
            ));
        }
        let whole = |t: &super::Texture| {
            !t.texels.is_empty() && t.texels.len() == t.width as usize * t.height as usize
        };
        if !self.materials.iter().filter_map(|material| material.texture.as_deref()).all(whole) {
            return Err(Error::Argument(
                "a texture's width × height is not its number of texels".into(),
            ));
        }
        // The squares of these fit in 32 bits.
        let fits = |p: &Vec3| p.abs().max_element() <= 1e18 && p.is_finite();
        if let Some(vertex) = self.positions.par_iter().position_first(|p| !fits(p)) {
            let message = format!(
                "the position {} of vertex {vertex} is not finite, or beyond 1e18",
                self.positions[vertex]
            );
            return Err(Error::Argument(message));
        }
        let is_textured = self.materials.iter().any(|material| material.texture.is_some());
        let not_finite = || self.uvs.par_iter().position_first(|uv| !uv.is_finite());
        if let Some(vertex) = is_textured.then(not_finite).flatten() {
            let uv = self.uvs[vertex];
            return Err(Error::Argument(format!(
                "the texture coordinates {uv} of vertex {vertex} are not finite"
            )));
        }
        Ok(())
    }

    /// Refuses attributes that are not as long as what they belong to.
    fn validate_lengths(&self) -> Result<()> {
        let count = self.positions.len();
        for (name, length, wanted) in [
            ("normals", self.normals.len(), count),
            ("colors", self.colors.len(), count),
            ("uvs", self.uvs.len(), count),
            ("values", self.values.len(), count),
            ("radii", self.radii.len(), count),
            ("triangle_materials", self.triangle_materials.len(), self.triangles.len()),
        ] {
            if length != 0 && length != wanted {
                return Err(Error::Argument(format!(
                    "the mesh has {length} {name} where {wanted} are needed"
                )));
            }
        }
        Ok(())
    }

    /// Refuses a mesh if all its triangles would vanish when measured in `unit`, the longest edge
    /// that is not cut. This is known before any triangle is cut.
    pub(super) fn check_extent(&self, unit: f32) -> Result<()> {
        let unit = f64::from(unit);
        let [least_area, least_ratio] =
            [LEAST_SQUARE, LEAST_RATIO_SQUARED].map(|square| f64::from(square).sqrt());
        // The length that cutting leaves of an edge, in units. Textured triangles are cut into
        // smaller ones.
        let is_textured = self.materials.iter().any(|material| material.texture.is_some());
        let finest = if is_textured { 1.0 / 32.0 } else { 0.3 };
        let is_left = |triangle: &[u32; 3]| {
            let [a, b, c] =
                triangle.map(|vertex| self.positions[vertex as usize].as_dvec3() / unit);
            let longest = (b - a)
                .length_squared()
                .max((c - b).length_squared())
                .max((a - c).length_squared())
                .sqrt();
            // Cutting keeps the height of a needle. Surfels require twice these bounds.
            let height = (b - a).cross(c - a).length() / longest;
            let edge = longest.min(1.0);
            height > 0.5 * least_ratio * edge.min(finest) && height * edge > 0.5 * least_area
        };
        if self.triangles.is_empty() || self.triangles.par_iter().any(is_left) {
            Ok(())
        } else {
            Err(self.nothing())
        }
    }

    /// Returns the error for a mesh or point cloud that leaves nothing to draw.
    fn nothing(&self) -> Error {
        if self.positions.is_empty() {
            return Error::NothingToDraw("there are no points".into());
        }
        let used = || self.triangles.par_iter().flatten().copied();
        let place = |vertex: u32| self.positions[vertex as usize].as_dvec3();
        let center = used().map(place).sum::<DVec3>() / (3 * self.triangles.len()).max(1) as f64;
        let distance = |vertex: &u32| place(*vertex).distance_squared(center);
        let farthest = used().max_by(|a, b| distance(a).total_cmp(&distance(b)).then(b.cmp(a)));
        let what = match farthest
            .filter(|_| self.triangles.par_iter().any(|&triangle| has_area(self, triangle)))
        {
            Some(vertex) => {
                let at = (self.origin + place(vertex)).as_vec3();
                format!(
                    "vertex {vertex} at ({:e}, {:e}, {:e}) is so far from the others that their \
                     triangles are points beside it; remove it, or the triangles that use it",
                    at.x, at.y, at.z
                )
            }
            None => "no triangle has an area".into(),
        };
        Error::NothingToDraw(what)
    }
}

/// Most length of a mesh, as a multiple of the root of its area. In a longer mesh, a triangle or
/// two lie far from all others. The rest would be no more than points beside the whole, so the
/// extra length does not count.
const LONGEST: f64 = 1024.0;

/// Returns the longest edge that is not cut, for a mesh of this area between these positions
/// relative to its origin.
pub(super) fn largest_edge([low, high]: [Vec3; 2], area: f64, options: &SurfelOptions) -> f32 {
    // In 64 bits, squares of the smallest lengths do not underflow.
    let diagonal = (high.as_dvec3() - low.as_dvec3()).length();
    // Rounded to a power of two, so that adding up the area in another order gives the same length.
    let longest =
        if area > 0.0 { area.sqrt().log2().ceil().exp2() * LONGEST } else { f64::INFINITY };
    // No edge is longer than the diagonal. A longer unit would only be too coarse for the edges.
    (diagonal.min(longest) as f32 * options.largest_spacing.min(1.0)).max(f32::MIN_POSITIVE)
}

fn of_triangles(mesh: &Mesh, options: &SurfelOptions) -> Result<Vec<Splat>> {
    let Some(bounds) = mesh.local_bounds() else { return Ok(Vec::new()) };
    let largest = largest_edge(bounds, mesh.area(), options);
    mesh.check_extent(largest)?;
    // Most large meshes are fine enough and right side out. One pass over the triangles both checks
    // this and makes the surfels.
    let parts = make(mesh, None, is_split(mesh), options, [largest, 1.0], |_| true)?;
    let is_coarse = parts.iter().any(|part| part.longest > 1.0) && !is_fine(mesh, largest);
    let is_textured =
        !mesh.uvs.is_empty() && mesh.materials.iter().any(|material| material.texture.is_some());
    let sums = parts.iter().fold(Sums::default(), |sums, part| sums.with(part.sums));
    let outward = if sums.side(largest) < 0 { -1.0 } else { 1.0 };
    if !is_coarse && !is_textured && outward == 1.0 {
        return joined(parts);
    }
    drop(parts);
    let fine = refine(mesh, largest, options.most_triangles, options.deadline)?;
    let origin = fine.sources.map(|sources| origin_of(mesh, sources, options)).transpose()?;
    joined(make(&fine.mesh, origin.as_ref(), is_split(mesh), options, [largest, outward], |_| {
        true
    })?)
}

/// Returns what the triangles of a refined mesh were cut from.
fn origin_of<'a>(mesh: &'a Mesh, sources: Vec<u32>, options: &SurfelOptions) -> Result<Origin<'a>> {
    Origin::new(mesh, sources, (options.crease_angle_degrees, Grouping::Cones), options.deadline)
}

/// Properties of a whole mesh on which the surfels of its parts depend.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Whole {
    pub is_split: bool,
    /// Whether edges are cut. Then normals are interpolated everywhere.
    pub is_coarse: bool,
    /// The length that edges are measured in.
    pub unit: f32,
    /// −1 if the mesh is inside out, 1 otherwise.
    pub outward: f32,
}

/// Makes the surfels of the wanted vertices of a part of a mesh, as they are in the whole. With
/// `cut`, edges of the part longer than that are cut, into at most that many triangles, and the
/// vertices added by this are wanted too.
pub(super) fn of_part(
    part: &Mesh,
    whole: Whole,
    options: &SurfelOptions,
    cut: Option<(f32, usize)>,
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Result<Vec<Splat>> {
    let Whole { is_split, is_coarse, unit, outward } = whole;
    let measures = [unit, outward];
    let Some((length, most)) = cut else {
        let sources = (0..part.triangles.len() as u32).collect();
        let origin = is_coarse.then(|| origin_of(part, sources, options)).transpose()?;
        return joined(make(part, origin.as_ref(), is_split, options, measures, is_wanted)?);
    };
    // The caller chose a length that keeps to the budget.
    let fine = refine(part, length, most, options.deadline)?;
    let origin = fine.sources.map(|sources| origin_of(part, sources, options)).transpose()?;
    joined(make(&fine.mesh, origin.as_ref(), is_split, options, measures, is_wanted)?)
}

/// Makes the surfels of all wanted vertices, in chunks.
fn make(
    mesh: &Mesh,
    origin: Option<&Origin>,
    is_split: bool,
    options: &SurfelOptions,
    [unit, outward]: [f32; 2],
    is_wanted: impl Fn(usize) -> bool + Sync,
) -> Result<Vec<Made>> {
    options.deadline.check(WORK)?;
    let connected = Connected::new(mesh, is_split)?;
    memory::room(WORK, (size_of::<Splat>() * mesh.positions.len()) as u64)?;
    let clock = Clock::new(options.deadline);
    let plain = mesh.materials.is_empty()
        && (!mesh.is_painted() || matches!(connected.places, Cow::Borrowed(_)));
    let maker = Maker { mesh, connected: &connected, options, origin, unit, outward, plain };
    let made = (0..mesh.positions.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let vertices = chunk * CHUNK..((chunk + 1) * CHUNK).min(mesh.positions.len());
            let wanted: Vec<usize> = vertices.filter(|&vertex| is_wanted(vertex)).collect();
            let mut made = Made::new(options, wanted.len());
            maker.vertices(&wanted, &mut made, &clock);
            made
        })
        .collect();
    clock.finish(WORK)?;
    Ok(made)
}

/// Joins the surfels of all chunks, in order.
fn joined(parts: Vec<Made>) -> Result<Vec<Splat>> {
    let count = parts.iter().map(|part| part.splats.len()).sum();
    memory::room(WORK, (size_of::<Splat>() * count) as u64)?;
    let mut splats = bytemuck::zeroed_vec(count);
    let mut rest = &mut splats[..];
    let mut pairs = Vec::with_capacity(parts.len());
    for part in parts {
        let (place, after) = rest.split_at_mut(part.splats.len());
        pairs.push((place, part.splats));
        rest = after;
    }
    pairs.into_par_iter().for_each(|(place, part)| place.copy_from_slice(&part));
    Ok(splats)
}

#[cfg(test)]
mod tests;

//! Cells as a solid body: their boundary, and where clips cut it, the field inside.

use super::{
    CellOptions, Cells, Place, Tetrahedra,
    boundary::Boundary,
    cut::{Corner, Half, Kept, Polygon, Section, section, split},
};
use crate::{
    Error, Result,
    color::ColorScale,
    facet::{Facet, FacetSet},
    math::{Bounds, Clip},
    memory,
    parallel::prelude::*,
    splat::{NO_NORMAL, decode_normal},
    surface::{self, Bands, Mesh, Paint, SurfelOptions},
};
use glam::{DVec3, Vec3};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What colours a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tint {
    /// One colour: red, green and blue in 0 … 1.
    Plain([f32; 3]),
    /// The values of the cells.
    Values(ColorScale),
    /// The world coordinate along a direction of unit length.
    Height(ColorScale, DVec3),
    /// The direction of the normal.
    Normal,
}

/// How cells become a solid.
#[derive(Debug, Clone)]
pub struct SolidOptions {
    /// What colours it.
    pub tint: Tint,
    /// How its boundary becomes facets.
    pub surface: SurfelOptions,
    /// Whether its edges may be asked for ([`Solid::edges`]).
    pub has_edges: bool,
}

impl SolidOptions {
    /// Returns the defaults for this tint. Creases from 45° on look sharp.
    pub fn new(tint: Tint) -> Self {
        let surface = SurfelOptions {
            crease_angle_degrees: 45.0,
            most_facets: usize::MAX,
            ..SurfelOptions::default()
        };
        Self { tint, surface, has_edges: false }
    }
}

/// Cells as a solid body. Its boundary is drawn as lit facets; where clips cut it, faces show the
/// field inside.
///
/// ```
/// use glam::DVec3;
/// use splatkit::{
///     cells::{CellKind, Cells, Solid, SolidOptions, Tint},
///     color::{ColorMap, ColorScale},
///     math::{Clip, ClipShape},
/// };
///
/// let cells = Cells::tube(CellKind::Hexahedron, 2)?;
/// let scale = ColorScale { range: cells.range(), ..ColorScale::new(ColorMap::VIRIDIS) };
/// let solid = Solid::new(cells, &SolidOptions::new(Tint::Values(scale)))?;
/// let half = ClipShape::HalfSpace { normal: DVec3::Z, offset: 0.1 };
/// let cut = solid.facets(&[Clip { shape: half, inside: true }]);
/// let highest = cut.facets.iter().flat_map(|facet| facet.corners).map(|corner| corner[2]);
/// assert!((highest.fold(-1.0f32, f32::max) - 0.1).abs() < 1e-6);
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug)]
pub struct Solid {
    cells: Arc<Cells>,
    tint: Tint,
    bands: Option<Bands>,
    boundary: Arc<FacetSet>,
    /// The length from which on the edges of facets are cut, in world units.
    longest: f32,
    /// The edges of the boundary, by places.
    places: Vec<Vec3>,
    edges: Vec<[u32; 2]>,
    /// The cells as tetrahedra, which cuts need; `None` if they have no volume.
    inside: OnceLock<Option<Inside>>,
    /// The last clips, and what they left.
    last: Mutex<Option<(Vec<Clip>, Arc<FacetSet>)>>,
}

/// The inside of a solid.
#[derive(Debug)]
struct Inside {
    tetrahedra: Tetrahedra,
    /// The number of tetrahedra before each cell.
    starts: Vec<u32>,
    /// The boxes around groups of [`TOGETHER`] tetrahedra.
    boxes: Vec<Bounds>,
}

/// Tetrahedra, and facets, that are looked at together.
const TOGETHER: usize = 256;

/// A line in a plane that cuts tetrahedra.
struct Line {
    /// The corners of the face that it lies in.
    face: [u32; 3],
    cell: u32,
    /// The edges of the face at which it ends.
    names: [[u32; 2]; 2],
    ends: [DVec3; 2],
}

impl Cells {
    /// Returns the boundary of the cells as a mesh: the sides that only one cell has, and the faces
    /// beside the cells. If values are those of cells, no triangles share vertices.
    ///
    /// # Errors
    /// Those of [`validate`](Self::validate); [`Error::Argument`] for a tint by values that there
    /// are not, and if there is no boundary.
    pub fn surface(&self, tint: Tint) -> Result<Mesh> {
        let (Boundary { mut mesh, of_triangles, .. }, _) = tinted(self, tint)?;
        if let Tint::Values(scale) | Tint::Height(scale, _) = tint {
            mesh.scale = Some(scale);
        }
        if !of_triangles.is_empty() {
            let corners = mesh.triangles.as_flattened();
            mesh.positions = corners.iter().map(|at| mesh.positions[*at as usize]).collect();
            mesh.values = of_triangles.iter().flat_map(|value| [*value; 3]).collect();
            let first = |number: usize| 3 * number as u32;
            let alone = |number| [first(number), first(number) + 1, first(number) + 2];
            mesh.triangles = (0..mesh.triangles.len()).map(alone).collect();
        }
        Ok(mesh)
    }
}

/// Returns the boundary of cells with the values and colours of a tint, and its bands.
fn tinted(cells: &Cells, tint: Tint) -> Result<(Boundary, Option<Bands>)> {
    cells.validate()?;
    if matches!(tint, Tint::Values(_)) && cells.values.is_empty() {
        return Err(Error::Argument("the cells have no values to be coloured by".into()));
    }
    memory::room("finding the boundary of cells", 32 * cells.len() as u64)?;
    let mut boundary = Boundary::of(cells);
    let mesh = &mut boundary.mesh;
    if mesh.triangles.is_empty() {
        return Err(Error::NothingToDraw(
            "no cell has an outer side and values at all of its nodes".into(),
        ));
    }
    let bands = |scale| Some(Bands::new(scale, mesh.triangles.len()));
    let bands = match tint {
        Tint::Values(scale) | Tint::Height(scale, _) => bands(scale),
        Tint::Plain(_) | Tint::Normal => None,
    };
    match tint {
        Tint::Values(_) => return Ok((boundary, bands)),
        Tint::Height(_, up) => {
            let height = |place: &Vec3| height(mesh.origin + place.as_dvec3(), up);
            mesh.values = mesh.positions.iter().map(height).collect();
        }
        Tint::Plain(color) => {
            mesh.values.clear();
            mesh.colors = vec![Paint::bytes(color); mesh.positions.len()];
        }
        Tint::Normal => mesh.values.clear(),
    }
    boundary.of_triangles.clear();
    Ok((boundary, bands))
}

fn height(place: DVec3, up: DVec3) -> f32 {
    place.dot(up) as f32
}

impl Solid {
    /// Returns the solid of cells.
    ///
    /// # Errors
    /// Those of [`Cells::surface`] and [`Mesh::facets`]; [`Error::Argument`] if the options do not
    /// allow facets.
    pub fn new(cells: impl Into<Arc<Cells>>, options: &SolidOptions) -> Result<Self> {
        let cells = cells.into();
        let tint = options.tint;
        let (boundary, bands) = tinted(&cells, tint)?;
        let Boundary { mesh, of_triangles, edges } = boundary;
        let surface =
            SurfelOptions { color_by_normal: tint == Tint::Normal, ..options.surface.clone() };
        let by = bands.as_ref().map(|bands| (bands, &of_triangles[..]));
        let facets = mesh.facets_by(&surface, by)?.ok_or_else(|| {
            Error::Argument("the boundary of the cells cannot be drawn as facets".into())
        })?;
        let longest = mesh.longest_facet(&surface);
        let (places, edges) = match options.has_edges {
            true => (mesh.positions, edges),
            false => Default::default(),
        };
        let boundary = Arc::new(facets);
        let (inside, last) = (OnceLock::new(), Mutex::new(None));
        Ok(Self { cells, tint, bands, boundary, longest, places, edges, inside, last })
    }

    /// Returns the cells.
    pub fn cells(&self) -> &Arc<Cells> {
        &self.cells
    }

    /// Returns the boundary.
    pub fn boundary(&self) -> &Arc<FacetSet> {
        &self.boundary
    }

    /// Returns the box around the solid, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        self.boundary.bounds()
    }

    /// Returns what clips leave of the boundary, with the faces where they cut the cells. The
    /// result is kept until the clips change. The first cut divides the cells into tetrahedra; each
    /// takes time in proportion to the boundary and to the tetrahedra that its planes meet.
    pub fn facets(&self, clips: &[Clip]) -> Arc<FacetSet> {
        if clips.is_empty() {
            return self.boundary.clone();
        }
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((last_clips, facets)) = &*last
            && last_clips == clips
        {
            return facets.clone();
        }
        let _span = tracing::info_span!("cut").entered();
        let kept = Kept::new(clips, self.boundary.origin);
        let mut facets = self.left_of_boundary(&kept);
        if let Some(inside) = self.inside() {
            for section in kept.sections() {
                facets.extend(self.face(inside, &section));
            }
        }
        let facets = Arc::new(FacetSet {
            origin: self.boundary.origin,
            facets,
            sides: self.boundary.sides,
            whole: Some(self.bounds()),
            ..FacetSet::default()
        });
        *last = Some((clips.to_vec(), facets.clone()));
        facets
    }

    /// Returns the ends of the lines between the sides of cells, relative to the cells' origin: on
    /// the boundary and on the faces of cuts, as far as clips leave them. There are none unless
    /// [`SolidOptions::has_edges`] is set.
    pub fn edges(&self, clips: &[Clip]) -> Vec<[Vec3; 2]> {
        let place = |at: u32| self.places[at as usize];
        let all = self.edges.iter().map(|edge| edge.map(place));
        if clips.is_empty() || self.edges.is_empty() {
            return all.collect();
        }
        let kept = Kept::new(clips, self.boundary.origin);
        let single = |ends: [DVec3; 2]| ends.map(|end| end.as_vec3());
        let mut lines: Vec<[Vec3; 2]> =
            all.flat_map(|ends| kept.lines(ends.map(|end| end.as_dvec3()))).map(single).collect();
        let Some(inside) = self.inside() else { return lines };
        for Section { plane, within } in kept.sections() {
            let cuts = inside.lines(&plane);
            lines.extend(cuts.into_iter().flat_map(|ends| within.lines(ends)).map(single));
        }
        lines
    }

    /// Returns the cells as tetrahedra.
    fn inside(&self) -> Option<&Inside> {
        self.inside.get_or_init(|| Inside::new(&self.cells)).as_ref()
    }

    /// Returns the facets of the boundary, and parts of facets, that are kept.
    fn left_of_boundary(&self, kept: &Kept) -> Vec<Facet> {
        let of_some = |facets: &[Facet]| {
            let mut left = Vec::new();
            for facet in facets {
                let [a, b, c] = facet.corners.map(|corner| Vec3::from(corner).as_dvec3());
                match kept.of_box(&Bounds::around([a, b, c])) {
                    Some(true) => left.push(*facet),
                    Some(false) => {}
                    None => left.extend(parts(facet, kept)),
                }
            }
            left
        };
        let parts: Vec<Vec<Facet>> =
            self.boundary.facets.par_chunks(TOGETHER).map(of_some).collect();
        parts.concat()
    }

    /// Returns the facets of the face in which a plane cuts the cells.
    fn face(&self, inside: &Inside, section: &Section) -> Vec<Facet> {
        let Section { plane, within } = section;
        let of_some = |group: usize| {
            let mut facets = Vec::new();
            if within.of_box(&inside.boxes[group]) != Some(false) {
                for polygon in inside.polygons(group, plane) {
                    for part in within.cut(polygon.1) {
                        self.add_part(&part, plane.normal.as_vec3(), &mut facets);
                    }
                }
            }
            facets
        };
        let parts: Vec<Vec<Facet>> = inside.met(plane).into_par_iter().map(of_some).collect();
        parts.concat()
    }

    /// Adds the facets of a part of a face. Long ones are cut.
    fn add_part(&self, part: &Polygon<1>, normal: Vec3, facets: &mut Vec<Facet>) {
        let places = || part.iter().map(|corner| corner.place);
        let low = places().fold(DVec3::INFINITY, DVec3::min);
        let size = places().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
        let axis = size.max_position();
        if size[axis] > f64::from(self.longest) {
            let normal_to = DVec3::AXES[axis];
            let half = Half { normal: normal_to, offset: low[axis] + 0.5 * size[axis] };
            if let [Some(one), Some(other)] = split(part.clone(), &half) {
                self.add_part(&one, normal, facets);
                self.add_part(&other, normal, facets);
                return;
            }
        }
        let value = |corner: &Corner<1>| match self.tint {
            Tint::Height(_, up) => height(self.boundary.origin + corner.place, up),
            _ => corner.numbers[0] as f32,
        };
        match &self.bands {
            Some(bands) => {
                let corner = |corner: &Corner<1>| {
                    let place = corner.place.as_vec3();
                    surface::Corner { place, normal, value: value(corner) }
                };
                let corners: Vec<surface::Corner> = part.iter().map(corner).collect();
                bands.add(&corners, &mut |facet| facets.push(facet));
            }
            None => {
                let color = match self.tint {
                    Tint::Plain(color) => color,
                    _ => (0.5 * normal + 0.5).to_array(),
                };
                let [red, green, blue, _] = Paint::bytes(color);
                let numbers =
                    |at: Vec3| [at, normal, Vec3::from_array([red, green, blue].map(f32::from))];
                let places: Vec<[Vec3; 3]> =
                    part.iter().map(|corner| numbers(corner.place.as_vec3())).collect();
                facets.extend(fan(&places));
            }
        }
    }
}

/// Returns the triangles of a polygon whose corners have places, normals and colours of 0 … 255.
fn fan(polygon: &[[Vec3; 3]]) -> impl Iterator<Item = Facet> {
    (1..polygon.len().saturating_sub(1)).filter_map(|step| {
        let corners = [polygon[0], polygon[step], polygon[step + 1]];
        let [a, b, c] = corners.map(|[place, ..]| place.as_dvec3());
        let has_area = (b - a).cross(c - a).length_squared() > 0.0;
        has_area.then(|| {
            Facet::new(
                corners.map(|[place, ..]| place),
                corners.map(|[_, normal, _]| normal.normalize_or_zero()),
                corners.map(|[.., color]| color.to_array().map(|part| part.round() as u8)),
            )
        })
    })
}

/// Returns the parts of a facet that are kept.
fn parts(facet: &Facet, kept: &Kept) -> Vec<Facet> {
    let corner = |at: usize| {
        let normal = decode_normal(facet.normals[at]).unwrap_or(Vec3::ZERO);
        let [red, green, blue, _] = facet.colors[at].to_le_bytes();
        let [x, y, z] = normal.to_array().map(f64::from);
        let [red, green, blue] = [red, green, blue].map(f64::from);
        let place = Vec3::from(facet.corners[at]).as_dvec3();
        Corner { place, numbers: [x, y, z, red, green, blue] }
    };
    let numbers = |corner: &Corner<6>| {
        let [x, y, z, red, green, blue] = corner.numbers.map(|number| number as f32);
        [corner.place.as_vec3(), Vec3::new(x, y, z), Vec3::new(red, green, blue)]
    };
    let is_unlit = facet.normals == [NO_NORMAL; 3];
    let of_part = |part: Polygon<6>| -> Vec<Facet> {
        let corners: Vec<[Vec3; 3]> = part.iter().map(numbers).collect();
        fan(&corners).map(|facet| if is_unlit { facet.unlit() } else { facet }).collect()
    };
    kept.cut(vec![corner(0), corner(1), corner(2)]).into_iter().flat_map(of_part).collect()
}

impl Inside {
    fn new(cells: &Cells) -> Option<Self> {
        let divided = cells.divided(&CellOptions::default());
        let made = divided.and_then(|(made, starts)| Ok((made.finish(false)?, starts)));
        // Cells without volume have nothing inside.
        let (tetrahedra, starts) = made.ok()?;
        let place = |corner: &u32| tetrahedra.points[*corner as usize].as_dvec3();
        let around = |group: &[[u32; 4]]| Bounds::around(group.as_flattened().iter().map(place));
        let boxes = tetrahedra.corners.par_chunks(TOGETHER).map(around).collect();
        Some(Self { tetrahedra, starts, boxes })
    }

    /// Returns the groups of tetrahedra that a plane may cut.
    fn met(&self, plane: &Half) -> Vec<usize> {
        let is_met = |bounds: &Bounds| {
            let [low, high] = plane.reach(bounds);
            // Rounding must not lose any.
            let slack = 1e-9 * (high - low);
            low <= slack && high > -slack
        };
        (0..self.boxes.len()).into_par_iter().filter(|group| is_met(&self.boxes[*group])).collect()
    }

    /// Returns the polygons in which a plane cuts the tetrahedra of a group, with their numbers.
    fn polygons(&self, group: usize, plane: &Half) -> impl Iterator<Item = (usize, Polygon<1>)> {
        let all = group * TOGETHER..((group + 1) * TOGETHER).min(self.tetrahedra.len());
        all.filter_map(|number| Some((number, section(self.corners(number), plane)?)))
    }

    /// Returns the corners of a tetrahedron with their values.
    fn corners(&self, number: usize) -> [Corner<1>; 4] {
        let Tetrahedra { points, values, place, corners, .. } = &self.tetrahedra;
        corners[number].map(|corner| {
            let value = match place {
                Place::Points => values[corner as usize],
                Place::Cells => values[number],
            };
            Corner { place: points[corner as usize].as_dvec3(), numbers: [value.into()] }
        })
    }

    /// Returns the lines in which a plane cuts the sides of cells.
    fn lines(&self, plane: &Half) -> Vec<[DVec3; 2]> {
        let cell = |number: usize| {
            self.starts.partition_point(|start| *start as usize <= number).saturating_sub(1) as u32
        };
        let of_some = |group: usize| -> Vec<Line> {
            let all = group * TOGETHER..((group + 1) * TOGETHER).min(self.tetrahedra.len());
            all.flat_map(|number| self.lines_of(number, cell(number), plane)).collect()
        };
        let parts: Vec<Vec<Line>> = self.met(plane).into_par_iter().map(of_some).collect();
        let mut all: Vec<Line> = parts.into_iter().flatten().collect();
        all.par_sort_unstable_by_key(|line| (line.face, line.cell));
        // Faces between tetrahedra of one cell are none of its sides.
        let is_side =
            |lines: &&[Line]| lines.len() == 1 || lines[0].cell != lines[lines.len() - 1].cell;
        let equals = all.chunk_by(|a, b| a.face == b.face).filter(is_side);
        let mut sides: Vec<&Line> = equals.map(|lines| &lines[0]).collect();
        sides.par_sort_unstable_by_key(|line| line.names);
        sides.dedup_by_key(|line| line.names);
        sides.into_iter().map(|line| line.ends).collect()
    }

    /// Returns the lines in which a plane cuts the faces of a tetrahedron.
    fn lines_of(&self, number: usize, cell: u32, plane: &Half) -> Vec<Line> {
        let (corners, names) = (self.corners(number), self.tetrahedra.corners[number]);
        let beyond = corners.map(|corner| plane.beyond(corner.place));
        let mut lines = Vec::new();
        for face in [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]] {
            let mut crossings = Vec::new();
            for [a, b] in [[0, 1], [0, 2], [1, 2]].map(|edge| edge.map(|at: usize| face[at])) {
                if (beyond[a] <= 0.0) == (beyond[b] <= 0.0) {
                    continue;
                }
                let crossing =
                    super::cut::crossing([&corners[a], &corners[b]], [beyond[a], beyond[b]]);
                // All edges at a corner in the plane meet it there.
                let on_plane = [a, b].into_iter().find(|at| beyond[*at] == 0.0);
                // The numbers of a tetrahedron's corners ascend.
                let name = on_plane.map_or([names[a], names[b]], |at| [names[at]; 2]);
                crossings.push((name, crossing.place));
            }
            crossings.sort_by_key(|end| end.0);
            crossings.dedup_by_key(|end| end.0);
            if let [(from, start), (to, end)] = crossings[..] {
                let (face, names) = (face.map(|at| names[at]), [from, to]);
                lines.push(Line { face, cell, names, ends: [start, end] });
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cells::CellKind, color::ColorMap, math::ClipShape};

    fn solid(cells: Cells) -> Solid {
        let scale = ColorScale { range: cells.range(), ..ColorScale::new(ColorMap::VIRIDIS) };
        let options = SolidOptions { has_edges: true, ..SolidOptions::new(Tint::Values(scale)) };
        Solid::new(cells, &options).expect("a solid")
    }

    /// The volume inside facets, if they are closed: by the theorem of Gauss.
    fn volume(set: &FacetSet) -> f64 {
        let one = |facet: &Facet| {
            let [a, b, c] = facet.corners.map(|corner| Vec3::from(corner).as_dvec3());
            a.dot(b.cross(c)) / 6.0
        };
        set.facets.iter().map(one).sum()
    }

    fn half(normal: DVec3, offset: f64) -> Clip {
        Clip { shape: ClipShape::HalfSpace { normal, offset }, inside: true }
    }

    #[test]
    fn what_clips_leave_is_closed() {
        for kind in [
            CellKind::Tetrahedron,
            CellKind::Hexahedron,
            CellKind::Wedge,
            CellKind::Pyramid,
            CellKind::QuadraticTetrahedron,
            CellKind::QuadraticHexahedron,
        ] {
            let solid = solid(Cells::tube(kind, 2).unwrap());
            let whole = volume(&solid.facets(&[]));
            let expected = volume_of(solid.cells());
            assert!((whole / expected - 1.0).abs() < 1e-5, "{kind:?}: {whole} {expected}");
            let plane = half(DVec3::new(1.0, 2.0, 3.0), 0.2);
            let other = Clip { inside: false, ..plane };
            let bounds = Bounds { min: DVec3::splat(-0.4), max: DVec3::new(0.6, 2.0, 0.5) };
            let block = Clip { shape: ClipShape::Box(bounds), inside: true };
            let hole = Clip { inside: false, ..block };
            for pair in [[vec![plane], vec![other]], [vec![block], vec![hole]]] {
                let [a, b] = pair.map(|clips| volume(&solid.facets(&clips)));
                assert!(a > 0.01 * whole && b > 0.01 * whole, "{kind:?}: {a} {b}");
                assert!(((a + b) / whole - 1.0).abs() < 1e-5, "{kind:?}: {a} + {b} of {whole}");
            }
            let both =
                volume(&solid.facets(&[plane, hole])) + volume(&solid.facets(&[plane, block]));
            let part = volume(&solid.facets(&[plane]));
            assert!((both / part - 1.0).abs() < 1e-5, "{kind:?}: {both} {part}");
        }
    }

    fn volume_of(cells: &Cells) -> f64 {
        let made = cells.divided(&CellOptions::default()).unwrap().0.finish(false).unwrap();
        let one = |corners: &[u32; 4]| {
            let [a, b, c, d] = corners.map(|corner| made.points[corner as usize].as_dvec3());
            (b - a).dot((c - a).cross(d - a)).abs() / 6.0
        };
        made.corners.iter().map(one).sum()
    }

    #[test]
    fn faces_of_cuts_have_the_field_inside() {
        let mut cells = Cells::tube(CellKind::Tetrahedron, 4).unwrap();
        cells.values = cells.points.iter().map(|at| at.x + at.y).collect();
        let solid = solid(cells);
        let scale =
            ColorScale { range: solid.cells().range(), ..ColorScale::new(ColorMap::VIRIDIS) };
        let cut = solid.facets(&[half(DVec3::Z, 0.05)]);
        let is_face = |facet: &&Facet| facet.corners.iter().all(|at| (at[2] - 0.05).abs() < 1e-6);
        let faces: Vec<&Facet> = cut.facets.iter().filter(is_face).collect();
        assert!(faces.len() > 100);
        for facet in faces {
            for (corner, color) in facet.corners.iter().zip(facet.colors) {
                let wanted = scale.color((corner[0] + corner[1]).into());
                let [red, green, blue, _] = color.to_le_bytes();
                for (actual, wanted) in [red, green, blue].into_iter().zip(wanted) {
                    assert!((f32::from(actual) - 255.0 * wanted).abs() < 2.0);
                }
            }
        }
        // The same clips give the same facets, without more work.
        assert!(Arc::ptr_eq(&cut, &solid.facets(&[half(DVec3::Z, 0.05)])));
    }

    #[test]
    fn lines_are_those_of_cells() {
        let mut cells = Cells { values: vec![0.0; 12], ..Cells::default() };
        for z in 0..3 {
            for at in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                cells.points.push(Vec3::new(at[0], at[1], z as f32));
            }
        }
        cells.push(CellKind::Hexahedron, 0..8);
        cells.push(CellKind::Hexahedron, 4..12);
        let solid = solid(cells);
        assert_eq!(solid.edges(&[]).len(), 20);
        // Half of each cell: seven edges at the kept end and between, two halves, and the cut's.
        let length = |lines: &[[Vec3; 2]]| lines.iter().map(|[a, b]| a.distance(*b)).sum::<f32>();
        let across = solid.edges(&[half(DVec3::X, 0.5)]);
        // Three squares of four half edges each, four upright edges of a unit … and the face.
        assert!(
            (length(&across) - (3.0 * 2.0 + 4.0 + 3.0 + 4.0)).abs() < 1e-5,
            "{}",
            length(&across)
        );
        let level = solid.edges(&[half(DVec3::Z, 1.0)]);
        assert!((length(&level) - (12.0 + 4.0)).abs() < 1e-5, "{}", length(&level));
    }
}

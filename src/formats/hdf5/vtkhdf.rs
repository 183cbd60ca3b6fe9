//! VTKHDF: data sets of VTK in the group `VTKHDF` of an HDF5 file. Follows the definition at
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html>.

use super::{
    attributes::numbers,
    file::{File, StoredSet},
    number_type,
};
use crate::{
    Error, Result,
    cells::{CellKind, Cells, Place as CellPlace},
    formats::{
        Kind, ReadOptions,
        array::{Array, Place},
        shared::{
            choice::{self, Candidate, Chosen, Part, Role},
            grid::{Component, Grid},
            holes, polygon, several, unplaced,
        },
    },
    input::{Source, growing::Growing, positions},
    surface::Mesh,
    volume::{Lattice, Volume},
    warning,
};
use glam::{DMat3, DVec3};
use hdf5_pure::AttrValue;
use std::collections::HashMap;

/// The group with everything.
const ROOT: &str = "VTKHDF";

/// The groups with arrays, and where their values sit.
const SECTIONS: [(&str, Place); 2] = [("PointData", Place::Points), ("CellData", Place::Cells)];

/// A data set of VTK in a file.
pub struct DataSet<'a> {
    source: &'a Source<'a>,
    file: &'a File<'a>,
    kind: String,
    attributes: HashMap<String, AttrValue>,
    sets: Vec<StoredSet>,
    /// The arrays: their places in `sets`, and what to choose by.
    arrays: Vec<(usize, Candidate)>,
    /// Whether there are several times.
    has_steps: bool,
}

impl<'a> DataSet<'a> {
    /// Returns the data set of a file; `None` if it is not of VTK.
    pub fn of(source: &'a Source<'a>, file: &'a File<'a>) -> Result<Option<Self>> {
        let Some(group) = file.group(ROOT)? else { return Ok(None) };
        let attributes = file.attributes(&group)?;
        let kind = attributes.get("Type").and_then(AttrValue::as_str).unwrap_or_default();
        let kind = kind.trim_matches(['\0', ' ']).to_owned();
        let sets = file.data_sets_of(group, "")?;
        let has_steps = sets.iter().any(|set| set.path == "Steps/Values");
        let mut data = Self { source, file, kind, attributes, sets, arrays: Vec::new(), has_steps };
        data.arrays = data.candidates()?;
        Ok(Some(data))
    }

    /// Returns the kind of data.
    ///
    /// # Errors
    /// [`Error::Input`] for other types than image data, unstructured grids and surfaces.
    pub fn kind(&self) -> Result<Kind> {
        match self.kind.as_str() {
            "ImageData" => Ok(Kind::Volume),
            "UnstructuredGrid" => Ok(Kind::Cells),
            "PolyData" => Ok(Kind::Mesh),
            other => {
                let kind: String = other.chars().take(40).collect();
                let message = format!(
                    "is “{kind}”, but ImageData, UnstructuredGrid or PolyData was expected"
                );
                Err(self
                    .source
                    .error("VTKHDF, Type", message)
                    .hint("save one block of it from ParaView as VTU, VTP or VTI"))
            }
        }
    }

    /// Returns the number of axes of space that the arrays have.
    fn axes(&self) -> usize {
        if self.kind == "ImageData" { 3 } else { 1 }
    }

    fn candidates(&self) -> Result<Vec<(usize, Candidate)>> {
        let mut all = Vec::new();
        for (section, place) in SECTIONS {
            let active = match self.file.group(&format!("{ROOT}/{section}"))? {
                Some(group) => self.file.attributes(&group)?,
                None => HashMap::new(),
            };
            let is_active = |word: &str, name: &str| {
                active.get(word).and_then(AttrValue::as_str).is_some_and(|value| value == name)
            };
            for (index, set) in self.sets.iter().enumerate() {
                let Some(name) = set.path.strip_prefix(&format!("{section}/")) else { continue };
                let role = if is_active("Scalars", name) {
                    Role::Scalars
                } else if is_active("Vectors", name) || is_active("Tensors", name) {
                    Role::Vectors
                } else if is_active("Normals", name) || is_active("TCoords", name) {
                    Role::Geometry
                } else if is_active("GlobalIds", name) || is_active("PedigreeIds", name) {
                    Role::Identifiers
                } else {
                    Role::None
                };
                let element = number_type(&set.datatype);
                let kind = element.as_ref().map_or("string".into(), |(element, ..)| element.name());
                let is_numeric = element.is_some();
                let components = self.components(set);
                let name = name.to_owned();
                all.push((index, Candidate { name, place, kind, is_numeric, components, role }));
            }
        }
        Ok(all)
    }

    /// Returns the components of an array: its dimensions behind those of space and time.
    fn components(&self, set: &StoredSet) -> usize {
        let times = usize::from(self.has_steps && self.axes() == 3);
        let inner = set.shape.iter().skip(self.axes() + times);
        inner.fold(1usize, |all, &n| all.saturating_mul(usize::try_from(n).unwrap_or(usize::MAX)))
    }

    /// Returns the array to draw; `None` if none is named and none is worth drawing.
    fn chosen(&self, options: &ReadOptions, is_needed: bool) -> Result<Option<Chosen>> {
        let candidates: Vec<Candidate> =
            self.arrays.iter().map(|(_, candidate)| candidate.clone()).collect();
        let counts = |array: usize| {
            let set = &self.sets[self.arrays[array].0];
            let size = set.shape.iter().fold(8u64, |all, &n| all.saturating_mul(n));
            // Identifiers of a large data set are not worth reading to find out.
            Ok(size < 1 << 26 && choice::is_ramp(&self.numbers(set)?))
        };
        match &options.scalar {
            Some(name) => choice::named(self.source, &candidates, name).map(Some),
            None if is_needed => choice::needed(self.source, &candidates, counts).map(Some),
            None => choice::automatic(&candidates, counts),
        }
    }

    /// Lists the arrays.
    pub fn list(&self, options: &ReadOptions) -> Result<Vec<Array>> {
        let drawn = self.chosen(options, false)?.map(|chosen| chosen.array);
        let mut list = Vec::new();
        for (index, (set, candidate)) in self.arrays.iter().enumerate() {
            let mut array = candidate.listed();
            let set = &self.sets[*set];
            let size = set.shape.iter().fold(8u64, |all, &n| all.saturating_mul(n));
            if candidate.is_numeric && size < 1 << 26 {
                let whole = if candidate.components == 1 { Part::Whole } else { Part::Magnitude };
                let values = whole.values(self.numbers(set)?, candidate.components.max(1));
                array.range = choice::range(values.into_iter(), options.missing);
            }
            array.is_drawn = drawn == Some(index);
            list.push(array);
        }
        Ok(list)
    }

    /// Returns all numbers of an array.
    fn numbers(&self, set: &StoredSet) -> Result<Vec<f64>> {
        let place = format!("data set “{ROOT}/{}”", set.path);
        let (element, endian, inner) = number_type(&set.datatype)
            .ok_or_else(|| self.source.error(&place, "holds no numbers"))?;
        let count = set.shape.iter().chain(&inner).try_fold(1u64, |all, &n| all.checked_mul(n));
        let bytes = count.and_then(|count| count.checked_mul(element.bytes() as u64));
        let data = self.file.bytes(set, bytes)?;
        self.source.room::<f64>("the numbers", data.len() / element.bytes())?;
        Ok(element.doubles(&data, endian))
    }

    fn set(&self, path: &str) -> Result<&StoredSet> {
        let set = self.sets.iter().find(|set| set.path == path);
        set.ok_or_else(|| self.source.error(ROOT, format!("has no data set “{path}”")))
    }

    /// Returns the numbers of a data set as indices.
    fn indices(&self, path: &str) -> Result<Vec<u64>> {
        let numbers = self.numbers(self.set(path)?)?;
        self.source.room::<u64>("the indices", numbers.len())?;
        numbers
            .into_iter()
            .map(|number| {
                if (0.0..9e15).contains(&number) && number.fract() == 0.0 {
                    return Ok(number as u64);
                }
                let message = format!("contains {number}, but whole numbers were expected");
                Err(self.source.error(format!("data set “{ROOT}/{path}”"), message))
            })
            .collect()
    }

    /// Reads image data.
    pub fn volume(&self, options: &ReadOptions) -> Result<Volume> {
        let Some(chosen) = self.chosen(options, true)? else {
            return Err(self.source.error(ROOT, "contains no values that can be drawn"));
        };
        let (index, candidate) = &self.arrays[chosen.array];
        let set = &self.sets[*index];
        let place = format!("data set “{ROOT}/{}”", set.path);
        let (element, endian, _) = number_type(&set.datatype)
            .ok_or_else(|| self.source.error(&place, "holds no numbers"))?;
        let lattice = self.lattice(candidate.place)?;
        let times = if self.has_steps { set.shape.first().copied().unwrap_or(0) } else { 1 };
        let time = several::time(self.source, &place, times, options)?;
        let space: Vec<u64> = lattice.dims.iter().rev().map(|&n| n as u64).collect();
        let shape = set.shape.iter().skip(usize::from(self.has_steps)).take(3);
        if !shape.eq(space.iter()) {
            let message = format!("has the shape {:?}, but {space:?} was expected", set.shape);
            return Err(self.source.error(place, message));
        }
        let grid = Grid::interleaved(element, endian, lattice.dims, candidate.components);
        let size = grid.check(self.source)?;
        let data = self.file.bytes(set, (size as u64).checked_mul(times))?;
        let data = &data[size * time..][..size];
        let is_length = options.scalar.as_deref().is_some_and(|name| name.ends_with(":magnitude"));
        let component = match chosen.part {
            Part::Whole => Component::One(0),
            Part::Magnitude if candidate.is_color() && !is_length => Component::Color,
            Part::Magnitude => Component::Magnitude,
            Part::Component(at) => Component::One(at),
        };
        let mut volume = grid.volume(self.source, lattice, data.into(), component, options)?;
        volume.about.name = chosen.part.caption(&candidate.name, candidate.components);
        Ok(volume)
    }

    /// Returns the numbers of an attribute, or a default.
    fn attribute<const N: usize>(&self, name: &str, default: [f64; N]) -> Result<[f64; N]> {
        let Some(value) = self.attributes.get(name) else { return Ok(default) };
        numbers(value).try_into().map_err(|_| {
            self.source.error(format!("VTKHDF, {name}"), format!("is not a list of {N} numbers"))
        })
    }

    fn lattice(&self, place: Place) -> Result<Lattice> {
        let wrong = |message: String| self.source.error("VTKHDF", message);
        let extent = self.attribute("WholeExtent", [0.0, -1.0, 0.0, -1.0, 0.0, -1.0])?;
        let spacing = DVec3::from(self.attribute("Spacing", [1.0; 3])?);
        let origin = DVec3::from(self.attribute("Origin", [0.0; 3])?);
        let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let directions = self.attribute("Direction", identity)?;
        let axes = DMat3::from_cols_array(&directions).transpose() * DMat3::from_diagonal(spacing);
        let is_cells = place == Place::Cells;
        let dims = [0, 1, 2].map(|axis| {
            let points = extent[2 * axis + 1] - extent[2 * axis] + 1.0;
            // One layer of points has one layer of cells.
            let count = if is_cells && points > 1.0 { points - 1.0 } else { points };
            if count >= 1.0 { count as usize } else { 0 }
        });
        let half = [0, 1, 2].map(|axis| {
            let has_cells = is_cells && extent[2 * axis + 1] > extent[2 * axis];
            if has_cells { 0.5 } else { 0.0 }
        });
        let first = DVec3::new(extent[0], extent[2], extent[4]) + DVec3::from(half);
        let lattice = Lattice::cartesian(dims, origin + axes * first, axes);
        lattice.check().map_err(wrong)?;
        Ok(lattice)
    }

    /// Returns the position of every point: NaN if it is not at finite coordinates.
    fn points(&self) -> Result<(DVec3, Vec<glam::Vec3>)> {
        let numbers = self.numbers(self.set("Points")?)?;
        let places = numbers.as_chunks::<3>().0;
        self.source.check_points("the number of points", places.len() as u64)?;
        let position = |point: usize| DVec3::from_array(places[point]);
        positions::settle_some(self.source, places.len(), position)
    }

    /// Returns the values of the chosen array for each of `count` points or cells.
    fn values(&self, chosen: Chosen, count: usize, options: &ReadOptions) -> Result<Vec<f32>> {
        let (index, candidate) = &self.arrays[chosen.array];
        let set = &self.sets[*index];
        let values = chosen.part.values(self.numbers(set)?, candidate.components.max(1));
        if values.len() != count {
            let of = candidate.place.name();
            let message = format!("has {} values for {count} {of}", values.len());
            return Err(self.source.error(format!("data set “{ROOT}/{}”", set.path), message));
        }
        self.source.room::<f32>("the values", count)?;
        let is_hole = |value: f64| holes::is_hole(value, options.missing);
        let narrow = |value: f64| if is_hole(value) { f32::NAN } else { value as f32 };
        Ok(values.into_iter().map(narrow).collect())
    }

    /// Calls `take` with the number and the points of every cell of a group (empty for the root).
    fn each_cell(
        &self,
        group: &str,
        count: usize,
        mut take: impl FnMut(usize, &[u32]) -> Result<()>,
    ) -> Result<()> {
        let path =
            |name: &str| if group.is_empty() { name.into() } else { format!("{group}/{name}") };
        let (nodes, offsets) =
            (self.indices(&path("Connectivity"))?, self.indices(&path("Offsets"))?);
        let cells = self.indices(&path("NumberOfCells"))?;
        let (points, ids) =
            (self.indices("NumberOfPoints")?, self.indices(&path("NumberOfConnectivityIds"))?);
        let place = || format!("data set “{ROOT}/{}”", path("Offsets"));
        let wrong = |message: &str| self.source.error(place(), message);
        if points.len() != cells.len() || ids.len() != cells.len() {
            return Err(wrong("has other parts than the points"));
        }
        // Each part has a list of offsets of its own, one longer than its cells.
        let (mut at, mut first_node, mut first_point, mut number) = (0usize, 0u64, 0u64, 0);
        let mut corners = Vec::new();
        for (part, &cells) in cells.iter().enumerate() {
            for cell in 0..cells as usize {
                let bounds = offsets.get(at + cell).zip(offsets.get(at + cell + 1));
                let list = bounds.and_then(|(&start, &end)| {
                    let start = usize::try_from(start.checked_add(first_node)?).ok()?;
                    nodes.get(start..usize::try_from(end.checked_add(first_node)?).ok()?)
                });
                let list = list.ok_or_else(|| wrong("do not fit the points of the cells"))?;
                corners.clear();
                for &node in list {
                    let node = node.saturating_add(first_point);
                    if node >= count as u64 {
                        let message = format!("refers to point {node} of {count}");
                        return Err(self.source.error(format!("cell {number}"), message));
                    }
                    corners.push(node as u32);
                }
                take(number, &corners)?;
                number += 1;
            }
            at = at.saturating_add(cells as usize).saturating_add(1);
            first_node = first_node.saturating_add(ids[part]);
            first_point = first_point.saturating_add(points[part]);
        }
        Ok(())
    }

    fn refuse_steps(&self) -> Result<()> {
        if !self.has_steps {
            return Ok(());
        }
        let message = "has several times, which are read of image data only";
        Err(self.source.error("VTKHDF, Steps", message).hint("save one time from ParaView as VTU"))
    }

    /// Reads an unstructured grid.
    pub fn cells(&self, options: &ReadOptions) -> Result<Cells> {
        self.refuse_steps()?;
        let (origin, points) = self.points()?;
        if let Some(point) = points.iter().position(|point| !point.is_finite()) {
            let message = "is not at finite coordinates";
            return Err(self.source.error(format!("point {point}"), message));
        }
        let kinds = self.indices("Types")?;
        let chosen = self.chosen(options, true)?;
        let candidate = chosen.map(|chosen| &self.arrays[chosen.array].1);
        let of_cells = candidate.is_some_and(|candidate| candidate.place == Place::Cells);
        let count = if of_cells { kinds.len() } else { points.len() };
        let numbers = chosen.map(|chosen| self.values(chosen, count, options)).transpose()?;
        let numbers = numbers.unwrap_or_default();
        let place = if of_cells { CellPlace::Cells } else { CellPlace::Points };
        let mut cells = Cells { origin, points, place, ..Cells::default() };
        let (mut values, mut skipped) = (Vec::new(), 0usize);
        self.source.room::<usize>("the cells", kinds.len().saturating_mul(3))?;
        let total = cells.points.len();
        self.each_cell("", total, |cell, nodes| {
            match kinds.get(cell).and_then(|&kind| CellKind::of_vtk(kind)) {
                None if matches!(kinds.get(cell), Some(5 | 7 | 9)) => {
                    cells.faces.push(nodes.iter().copied());
                    if of_cells {
                        cells.faces.values.push(numbers[cell]);
                    }
                }
                Some(CellKind::Polyhedron) | None => skipped += 1,
                Some(kind) => {
                    cells.push(kind, nodes.iter().copied());
                    if of_cells {
                        values.push(numbers[cell]);
                    }
                }
            }
            Ok(())
        })?;
        if skipped > 0 {
            let file = self.source.path.display();
            warning::give!(
                "{file}: {skipped} cells that are neither solids, triangles, quadrilaterals nor \
                 polygons, or that are \
                 polyhedra, are left out"
            );
        }
        cells.values = if of_cells { values } else { numbers };
        cells.about.holes = cells.values.iter().filter(|value| value.is_nan()).count() as u64;
        if let (Some(chosen), Some(candidate)) = (chosen, candidate) {
            cells.about.name = chosen.part.caption(&candidate.name, candidate.components);
        }
        cells.check().map_err(|message| self.source.error("cells", message))?;
        Ok(cells)
    }

    /// Reads the polygons of a surface, or its points if it has no polygons.
    pub fn mesh(&self, options: &ReadOptions) -> Result<Mesh> {
        self.refuse_steps()?;
        let (origin, positions) = self.points()?;
        let mut triangles = Growing::new(self.source, "the triangles");
        let place = |vertex: u32| positions[vertex as usize].as_dvec3();
        if self.sets.iter().any(|set| set.path == "Polygons/Connectivity") {
            self.each_cell("Polygons", positions.len(), |_, corners| {
                polygon::triangles(corners, place, |triangle| triangles.push(triangle))
            })?;
        }
        let triangles = triangles.into_inner();
        let mut mesh = Mesh { origin, positions, triangles, ..Mesh::default() };
        let chosen = self.chosen(options, false)?;
        let of_points = |chosen: &Chosen| self.arrays[chosen.array].1.place == Place::Points;
        if let Some(chosen) = chosen.filter(of_points) {
            let candidate = &self.arrays[chosen.array].1;
            mesh.values = self.values(chosen, mesh.positions.len(), options)?;
            mesh.about.name = chosen.part.caption(&candidate.name, candidate.components);
        } else if chosen.is_some() && options.scalar.is_some() {
            let message = "of the cells does not colour a surface here";
            return Err(self.source.error("CellData", message).hint("name an array of the points"));
        }
        unplaced::leave_out(self.source, &mut mesh)?;
        Ok(mesh)
    }
}

/// Returns the error for a data set that the caller wants as something else.
pub fn other_kind(source: &Source) -> Error {
    source.error("VTKHDF, Type", "is another kind of data than was asked for")
}

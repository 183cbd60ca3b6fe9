//! The points and cells of data sets, with the values that are drawn, joined from all pieces.

use super::{
    super::{Place, ReadOptions, shared::holes::is_hole},
    data::{Block, Corners, Faces, Ghosts, Kind, List, ListKind, cells_of},
    files::{DataSet, visit},
    survey::Wanted,
    xml::dims,
};
use crate::{Result, input::Source, math::weld::first_of};
use glam::{DVec3, Vec3};

/// VTK's type of cells that are given by the stream of their faces.
pub const POLYHEDRON: u8 = 42;
/// VTK's type of cells without points.
const EMPTY: u8 = 0;

/// Points, cells and values.
#[derive(Debug, Default)]
pub struct Grid {
    pub points: Vec<DVec3>,
    /// Normals of any length at the points; empty if there are none.
    pub normals: Vec<Vec3>,
    /// Points that another piece has too, or that are not shown.
    pub ghosts: Vec<bool>,
    /// VTK's type of each cell.
    pub types: Vec<u8>,
    /// The points of all cells, in VTK's order; for polyhedra the number of faces, then for each
    /// face the number of its points and the points.
    pub corners: Vec<u32>,
    /// Where the corners of each cell end.
    pub ends: Vec<usize>,
    /// The value of each point or cell; NaN where there is none. Empty if none are wanted.
    pub values: Vec<f64>,
    /// Instead of values: colours.
    pub colors: Vec<[u8; 4]>,
    /// Number of data sets and pieces.
    blocks: usize,
}

/// The cells of a block with the points that they are made of, not yet checked.
struct Cell<'c> {
    kind: u8,
    corners: &'c [f64],
}

impl Grid {
    /// Reads all data sets of a file, with the values that are wanted.
    pub fn read(source: &Source, options: &ReadOptions, wanted: Option<&Wanted>) -> Result<Self> {
        let mut grid = Self::default();
        visit(source, options, &mut |set| {
            for block in &set.blocks {
                grid.add(set, block, wanted)?;
            }
            Ok(true)
        })?;
        for value in &mut grid.values {
            if is_hole(*value, options.missing) {
                *value = f64::NAN;
            }
        }
        Ok(grid)
    }

    /// The points of a cell; for polyhedra those of all faces.
    pub fn points_of(&self, cell: usize) -> impl Iterator<Item = u32> + Clone {
        let corners = self.corners_of(cell);
        let is_stream = self.types[cell] == POLYHEDRON;
        let faces = faces(if is_stream { corners } else { &[] });
        let listed = if is_stream { &[][..] } else { corners };
        listed.iter().chain(faces.flatten()).copied()
    }

    /// The corners of a cell, or the stream of a polyhedron.
    pub fn corners_of(&self, cell: usize) -> &[u32] {
        let start = if cell == 0 { 0 } else { self.ends[cell - 1] };
        &self.corners[start..self.ends[cell]]
    }

    fn add(&mut self, set: &DataSet, block: &Block, wanted: Option<&Wanted>) -> Result<()> {
        let source = set.source;
        if block.point_count == 0 {
            return Ok(());
        }
        self.blocks += 1;
        let first = self.points.len();
        let all = (first as u64).saturating_add(block.point_count as u64);
        source.check_points("the number of points", all)?;
        if u32::try_from(all).is_err() {
            return Err(source.error("points", format!("{all} are more than 32 bits can count")));
        }
        self.add_points(source, block)?;
        let ghosts = block.ghosts(source, Place::Points)?;
        let hidden: Vec<bool> = (0..block.point_count)
            .map(|point| ghosts.as_ref().is_some_and(|ghosts| ghosts.is_hidden_point(point)))
            .collect();
        let is_copy = |point: usize| ghosts.as_ref().is_some_and(|ghosts| ghosts.is_copy(point));
        self.ghosts.extend((0..block.point_count).map(|point| hidden[point] || is_copy(point)));
        let before = self.types.len();
        let kept = self.add_cells(source, block, &hidden)?;
        debug_assert_eq!(kept.len(), self.types.len() - before);
        if let Some(wanted) = wanted {
            self.add_values(source, block, wanted, &kept)?;
        }
        self.add_normals(source, block, first)
    }

    fn add_points(&mut self, source: &Source, block: &Block) -> Result<()> {
        source.room::<[DVec3; 2]>("the points", block.point_count)?;
        if let Some(points) = &block.points {
            let numbers = points.doubles(source)?;
            self.points.extend(numbers.chunks_exact(3).map(DVec3::from_slice));
            return Ok(());
        }
        let [nx, ny, nz] = dims(source, &block.extent)?;
        let places = match block.kind {
            Kind::Rectilinear => {
                let places: Result<Vec<Vec<f64>>> =
                    block.places.iter().map(|numbers| numbers.doubles(source)).collect();
                Some(places?)
            }
            _ => None,
        };
        let position = |index: [usize; 3]| match &places {
            Some(places) => DVec3::from_array([0, 1, 2].map(|axis| places[axis][index[axis]])),
            None => {
                let steps =
                    [0, 1, 2].map(|axis| (block.extent[axis][0] as f64) + index[axis] as f64);
                block.origin + block.axes * DVec3::from_array(steps)
            }
        };
        let rows = (0..nz).flat_map(|k| (0..ny).map(move |j| [j, k]));
        self.points.extend(rows.flat_map(|[j, k]| (0..nx).map(move |i| [i, j, k])).map(position));
        Ok(())
    }

    /// Adds the cells of a block that are neither ghosts nor hidden. Returns their numbers in the
    /// block.
    fn add_cells(&mut self, source: &Source, block: &Block, hidden: &[bool]) -> Result<Vec<u32>> {
        let all = (self.types.len() as u64).saturating_add(block.cell_count as u64);
        source.check_points("the number of cells", all)?;
        source.room::<(usize, u8, u32, f64)>("the cells", block.cell_count)?;
        let ghosts = block.ghosts(source, Place::Cells)?;
        let marks = Marks { ghosts, hidden };
        let mut kept = Vec::new();
        if matches!(block.kind, Kind::Image | Kind::Rectilinear | Kind::Structured) {
            self.add_grid(source, block, &marks, &mut kept)?;
        }
        let mut before = 0;
        for list in &block.lists {
            self.add_list(source, block, list, (&marks, before), &mut kept)?;
            before += list.count;
        }
        Ok(kept)
    }

    /// Adds the cells between the points of a structured grid.
    fn add_grid(
        &mut self,
        source: &Source,
        block: &Block,
        marks: &Marks,
        kept: &mut Vec<u32>,
    ) -> Result<()> {
        let first = self.points.len() - block.point_count;
        let [nx, ny, _] = dims(source, &block.extent)?;
        let steps = [1, nx, nx * ny];
        let axes: Vec<usize> =
            (0..3).filter(|&axis| block.extent[axis][1] > block.extent[axis][0]).collect();
        let kind = [1, 3, 9, 12][axes.len()];
        // The corners of a quadrilateral in order; those of a hexahedron are two of them.
        let square: &[[usize; 2]] = match axes.len() {
            0 => &[[0, 0]],
            1 => &[[0, 0], [1, 0]],
            _ => &[[0, 0], [1, 0], [1, 1], [0, 1]],
        };
        let step = |at: usize| axes.get(at).map_or(0, |&axis| steps[axis]);
        let layers = if axes.len() == 3 { 2 } else { 1 };
        let offsets: Vec<usize> = (0..layers)
            .flat_map(|k| square.iter().map(move |&[i, j]| [i, j, k]))
            .map(|[i, j, k]| i * step(0) + j * step(1) + k * step(2))
            .collect();
        source.room::<u32>("the corners of the cells", block.cell_count * offsets.len())?;
        let [cx, cy, _] = dims(source, &cells_of(&block.extent))?;
        for cell in 0..block.cell_count {
            let [i, j, k] = [cell % cx, cell / cx % cy, cell / cx / cy];
            let corner = i * steps[0] + j * steps[1] + k * steps[2];
            let points = offsets.iter().map(|offset| corner + offset);
            if marks.shows(cell, points.clone()) {
                self.corners.extend(points.map(|point| (first + point) as u32));
                self.close(kind, cell, kept);
            }
        }
        Ok(())
    }

    /// Adds the cells of a list; `before` counts those of the lists before it.
    fn add_list(
        &mut self,
        source: &Source,
        block: &Block,
        list: &List,
        (marks, before): (&Marks, usize),
        kept: &mut Vec<u32>,
    ) -> Result<()> {
        let (corners, ends) = corners(source, list)?;
        source.room::<[u32; 2]>("the corners of the cells", corners.len())?;
        let (types, streams) = match &list.cells {
            ListKind::Of(kind) => (vec![f64::from(*kind)], Vec::new()),
            ListKind::Types { types, faces } => {
                let types = types.doubles(source)?;
                let streams = streams(source, faces, &types)?;
                (types, streams)
            }
        };
        let mut streams = streams.into_iter();
        let mut start = 0;
        for (cell_number, &end) in ends.iter().enumerate() {
            if !(end >= start as f64 && end <= corners.len() as f64 && end.fract() == 0.0) {
                let message = format!(
                    "cell {cell_number} ends at corner {end}, but must end after {start} and at \
                     most at {}",
                    corners.len()
                );
                return Err(source.error("Cells", message));
            }
            let listed = &corners[start..end as usize];
            start = end as usize;
            let kind = types.get(cell_number).or(types.first()).map_or(0, |&kind| kind as u8);
            let stream = if kind == POLYHEDRON { streams.next() } else { None };
            let cell = Cell { kind, corners: stream.as_deref().unwrap_or(listed) };
            if self.add_cell(source, cell, (block.point_count, marks, before + cell_number))? {
                kept.push((before + cell_number) as u32);
            }
        }
        Ok(())
    }

    /// Adds a cell of the last block, unless it is a ghost, hidden or empty. Returns whether it was
    /// added.
    fn add_cell(
        &mut self,
        source: &Source,
        cell: Cell,
        (point_count, marks, number): (usize, &Marks, usize),
    ) -> Result<bool> {
        let first = self.points.len() - point_count;
        let place = || format!("cell {number}");
        let is_point =
            |&corner: &f64| corner >= 0.0 && corner < point_count as f64 && corner.fract() == 0.0;
        let wrong = |corner: f64| {
            let message =
                format!("a cell refers to point {corner}, but there are {point_count} points");
            source.error("Cells", message)
        };
        let start = self.corners.len();
        if cell.kind == POLYHEDRON {
            self.add_stream(source, cell.corners, first, &is_point)?;
        } else if cell.kind != EMPTY {
            if cell.corners.is_empty() {
                return Err(source.error(place(), "has no corners"));
            }
            if let Some(&corner) = cell.corners.iter().find(|corner| !is_point(corner)) {
                return Err(wrong(corner));
            }
            let corners = cell.corners.iter().map(|&corner| (first + corner as usize) as u32);
            self.corners.extend(corners);
        }
        self.types.push(cell.kind);
        self.ends.push(self.corners.len());
        let last = self.types.len() - 1;
        let in_block = |point: u32| point as usize - first;
        let is_shown =
            cell.kind != EMPTY && marks.shows(number, self.points_of(last).map(in_block));
        if !is_shown {
            self.types.pop();
            self.ends.pop();
            self.corners.truncate(start);
        }
        Ok(is_shown)
    }

    /// Adds the stream of a polyhedron's faces, whose points count from `first`.
    fn add_stream(
        &mut self,
        source: &Source,
        stream: &[f64],
        first: usize,
        is_point: &dyn Fn(&f64) -> bool,
    ) -> Result<()> {
        let wrong = || source.error("Cells", "a polyhedron has faces that are not well formed");
        let count = *stream.first().ok_or_else(wrong)?;
        self.corners.push(count as u32);
        let mut rest = &stream[1..];
        for _ in 0..count as usize {
            let (&corners, behind) = rest.split_first().ok_or_else(wrong)?;
            let (face, behind) = behind.split_at_checked(corners as usize).ok_or_else(wrong)?;
            if face.len() < 3 || !face.iter().all(is_point) {
                return Err(wrong());
            }
            self.corners.push(face.len() as u32);
            self.corners.extend(face.iter().map(|&corner| (first + corner as usize) as u32));
            rest = behind;
        }
        if rest.is_empty() && count >= 1.0 { Ok(()) } else { Err(wrong()) }
    }

    /// Closes a cell whose corners have been added.
    fn close(&mut self, kind: u8, number: usize, kept: &mut Vec<u32>) {
        self.types.push(kind);
        self.ends.push(self.corners.len());
        kept.push(number as u32);
    }

    /// Adds the values of a block's points, or of the cells that are kept; values that are not
    /// numbers where it has no such array.
    fn add_values(
        &mut self,
        source: &Source,
        block: &Block,
        wanted: &Wanted,
        kept: &[u32],
    ) -> Result<()> {
        let about = &wanted.array;
        let of_cells = about.place == Place::Cells;
        let count = if of_cells { kept.len() } else { block.point_count };
        source.room::<f64>("the values", count)?;
        let field = block.field(about.place, &about.name);
        let field = field.filter(|field| field.about.components == about.components);
        let Some(numbers) = field.and_then(|field| field.numbers.as_ref()) else {
            let missing = std::iter::repeat_n(f64::NAN, count);
            if wanted.is_color {
                self.colors.extend(std::iter::repeat_n([255; 4], count));
            } else {
                self.values.extend(missing);
            }
            return Ok(());
        };
        let numbers = numbers.doubles(source)?;
        if wanted.is_color {
            let color = |tuple: &[f64]| {
                let part = |at: usize| tuple.get(at).map_or(255, |&part| part as u8);
                [part(0), part(1), part(2), part(3)]
            };
            let tuple = |index: usize| &numbers[index * about.components..][..about.components];
            if of_cells {
                self.colors.extend(kept.iter().map(|&cell| color(tuple(cell as usize))));
            } else {
                self.colors.extend((0..count).map(|point| color(tuple(point))));
            }
            return Ok(());
        }
        let values = wanted.part.values(numbers, about.components);
        if of_cells {
            self.values.extend(kept.iter().map(|&cell| values[cell as usize]));
        } else {
            self.values.extend(values);
        }
        Ok(())
    }

    /// Adds the normals of the points, if all blocks have them.
    fn add_normals(&mut self, source: &Source, block: &Block, first: usize) -> Result<()> {
        let is_normals = |field: &&super::data::Field| {
            let about = &field.about;
            about.place == Place::Points && about.components == 3 && about.is_normals()
        };
        let field = block.fields.iter().find(is_normals);
        let Some(numbers) = field.and_then(|field| field.numbers.as_ref()) else {
            self.normals.clear();
            return Ok(());
        };
        if self.normals.len() == first {
            let numbers = numbers.doubles(source)?;
            let normals = numbers.chunks_exact(3).map(|n| DVec3::from_slice(n).as_vec3());
            self.normals.extend(normals);
        }
        Ok(())
    }

    /// Makes points of several blocks one if they have the same position and value.
    pub fn weld(&mut self, source: &Source, of_cells: bool) -> Result<()> {
        if self.blocks < 2 {
            return Ok(());
        }
        source.room::<[u32; 2]>("the list of equal points", self.points.len())?;
        let key = |point: u32| {
            let position = (self.points[point as usize] + DVec3::ZERO).to_array();
            let value = if of_cells { None } else { self.values.get(point as usize) };
            (position.map(f64::to_bits), value.map_or(0, |value| value.to_bits()))
        };
        let first = first_of(self.points.len(), key);
        for cell in 0..self.types.len() {
            let start = if cell == 0 { 0 } else { self.ends[cell - 1] };
            let corners = &mut self.corners[start..self.ends[cell]];
            if self.types[cell] != POLYHEDRON {
                corners.iter_mut().for_each(|corner| *corner = first[*corner as usize]);
                continue;
            }
            let mut at = 1;
            while at < corners.len() {
                let end = at + 1 + corners[at] as usize;
                corners[at + 1..end]
                    .iter_mut()
                    .for_each(|corner| *corner = first[*corner as usize]);
                at = end;
            }
        }
        Ok(())
    }
}

/// Which cells and points of a block are not shown.
struct Marks<'m> {
    ghosts: Option<Ghosts>,
    hidden: &'m [bool],
}

impl Marks<'_> {
    fn shows(&self, cell: usize, mut points: impl Iterator<Item = usize>) -> bool {
        let is_ghost = |ghosts: &Ghosts| ghosts.is_copy(cell) || ghosts.is_hidden_cell(cell);
        !self.ghosts.as_ref().is_some_and(is_ghost) && !points.any(|point| self.hidden[point])
    }
}

/// Returns the faces of a polyhedron, from their stream.
pub fn faces(stream: &[u32]) -> impl Iterator<Item = &[u32]> + Clone {
    let mut rest = stream.get(1..).unwrap_or(&[]);
    std::iter::from_fn(move || {
        let (&count, behind) = rest.split_first()?;
        let (face, behind) = behind.split_at_checked(count as usize)?;
        rest = behind;
        Some(face)
    })
}

/// Returns the points of all cells of a list, and where those of each cell end.
fn corners(source: &Source, list: &List) -> Result<(Vec<f64>, Vec<f64>)> {
    match &list.corners {
        Corners::Ready { points, ends } => {
            source.room::<f64>("the corners of the cells", points.len() + ends.len())?;
            Ok((points.clone(), ends.clone()))
        }
        Corners::Xml { document, points, ends } => {
            let ends = document.part(ends, list.count as u64)?.doubles(source)?;
            // The last offset is the number of corners; the cast saturates.
            let count = ends.last().map_or(0, |&end| end as u64);
            Ok((document.part(points, count)?.doubles(source)?, ends))
        }
    }
}

/// Returns the streams of faces of the polyhedra among cells of these types, in their order.
fn streams(source: &Source, faces: &Faces, types: &[f64]) -> Result<Vec<Vec<f64>>> {
    let polyhedra = || (0..types.len()).filter(|&cell| types[cell] as u8 == POLYHEDRON);
    let wrong = || source.error("Cells", "the faces of the polyhedra are not well formed");
    let largest = |ends: &[f64]| ends.iter().copied().fold(0.0, f64::max) as u64;
    let cut = |list: &[f64], start: f64, end: f64| -> Result<Vec<f64>> {
        let is_range = start >= 0.0 && end >= start;
        let range = is_range.then_some(start as usize..end as usize);
        Ok(range.and_then(|range| list.get(range)).ok_or_else(wrong)?.to_vec())
    };
    match faces {
        _ if polyhedra().next().is_none() => Ok(Vec::new()),
        Faces::None => Ok(Vec::new()),
        Faces::Stream { document, stream, ends } => {
            let ends = document.part(ends, types.len() as u64)?.doubles(source)?;
            let stream = document.part(stream, largest(&ends))?.doubles(source)?;
            let mut start = 0.0;
            let of_cell = |cell: usize| {
                let part = cut(&stream, start, ends[cell]);
                start = ends[cell];
                part
            };
            source.room::<f64>("the faces of the cells", stream.len())?;
            polyhedra().map(of_cell).collect()
        }
        Faces::Lists { document, arrays: [points, ends, of_cells, cell_ends] } => {
            let cell_ends = document.part(cell_ends, types.len() as u64)?.doubles(source)?;
            let of_cells = document.part(of_cells, largest(&cell_ends))?.doubles(source)?;
            let count = if of_cells.is_empty() { 0 } else { largest(&of_cells).saturating_add(1) };
            let ends = document.part(ends, count)?.doubles(source)?;
            let points = document.part(points, largest(&ends))?.doubles(source)?;
            let mut streams = Vec::new();
            for cell in polyhedra() {
                let start = if cell == 0 { 0.0 } else { cell_ends[cell - 1] };
                let cell_faces = cut(&of_cells, start, cell_ends[cell])?;
                let mut stream = vec![cell_faces.len() as f64];
                for face in cell_faces {
                    let at = face as usize;
                    let end = *ends.get(at).filter(|_| face >= 0.0).ok_or_else(wrong)?;
                    let corners = cut(&points, if at == 0 { 0.0 } else { ends[at - 1] }, end)?;
                    // Several cells may have the same faces.
                    source.room::<f64>("the faces of the cells", corners.len() + 1)?;
                    stream.push(corners.len() as f64);
                    stream.extend(corners);
                }
                streams.push(stream);
            }
            Ok(streams)
        }
    }
}

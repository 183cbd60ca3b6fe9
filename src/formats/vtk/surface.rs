//! Surfaces and point clouds of VTK's cells, with the values or colours that are drawn.

use super::{
    super::{
        Place,
        shared::{polygon, unplaced},
    },
    grid::{Grid, POLYHEDRON, faces},
    survey::{Wanted, dimension},
};
use crate::{
    Result,
    input::{Source, growing::Growing, positions},
    surface::Mesh,
};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Highest order of Lagrange and Bézier cells.
const MOST_ORDER: usize = 64;

/// Triangles and segments of lines, each with the number of its cell.
type Owned = (Vec<([u32; 3], u32)>, Vec<([u32; 2], u32)>);

/// Returns the faces and lines of a grid as a mesh. Vertices between cells of different values or
/// colours become several vertices. Points without faces or lines are left out.
pub fn mesh(source: &Source, grid: &Grid, wanted: Option<&Wanted>) -> Result<Mesh> {
    let mut triangles = Growing::new(source, "the triangles");
    let mut lines = Growing::new(source, "the lines");
    let position = |point: u32| grid.points[point as usize];
    for cell in 0..grid.types.len() {
        match dimension(grid.types[cell]) {
            Some(1) => {
                let nodes = nodes_in_order(grid.types[cell], grid.corners_of(cell));
                nodes
                    .windows(2)
                    .try_for_each(|ends| lines.push(([ends[0], ends[1]], cell as u32)))?;
            }
            Some(2) => cut(source, grid, cell, &mut |corners| {
                polygon::triangles(corners, position, |triangle| {
                    triangles.push((triangle, cell as u32))
                })
            })?,
            _ => {}
        }
    }
    give(source, grid, wanted, (triangles.into_inner(), lines.into_inner()))
}

/// Returns the nodes of a line from one end to the other. Those of higher order have both ends
/// first.
fn nodes_in_order(kind: u8, corners: &[u32]) -> Vec<u32> {
    match (kind, corners) {
        (21 | 35 | 68 | 75, [first, last, middle @ ..]) => [&[*first], middle, &[*last]].concat(),
        _ => corners.to_vec(),
    }
}

/// Returns the boundary of the cells that fill space, the faces that only one cell has, and the
/// surfaces beside them.
pub fn boundary(source: &Source, grid: &Grid) -> Result<Mesh> {
    let mut sides: Growing<([u32; 4], u32, u32)> = Growing::new(source, "the faces of the cells");
    let mut lists: Growing<u32> = Growing::new(source, "the corners of the faces");
    for cell in (0..grid.types.len()).filter(|&cell| dimension(grid.types[cell]) == Some(3)) {
        each_side(grid, cell, &mut |side| {
            let mut least = [u32::MAX; 4];
            let mut sorted: Vec<u32> = side.to_vec();
            sorted.sort_unstable();
            sorted.iter().zip(&mut least).for_each(|(&corner, slot)| *slot = corner);
            sides.push((least, lists.len() as u32, side.len() as u32))?;
            side.iter().try_for_each(|&corner| lists.push(corner))
        })?;
    }
    let (mut sides, lists) = (sides.into_inner(), lists.into_inner());
    sides.sort_unstable();
    let mut triangles = Growing::new(source, "the triangles");
    let position = |point: u32| grid.points[point as usize];
    for equals in sides.chunk_by(|a, b| a.0 == b.0) {
        if let &[(_, start, count)] = equals {
            let corners = &lists[start as usize..][..count as usize];
            polygon::triangles(corners, position, |triangle| triangles.push((triangle, 0)))?;
        }
    }
    for cell in (0..grid.types.len()).filter(|&cell| dimension(grid.types[cell]) == Some(2)) {
        cut(source, grid, cell, &mut |corners| {
            polygon::triangles(corners, position, |triangle| triangles.push((triangle, 0)))
        })?;
    }
    give(source, grid, None, (triangles.into_inner(), Vec::new()))
}

/// Returns the points of a grid as a cloud. Values of cells are given to their points.
pub fn cloud(source: &Source, grid: &Grid, wanted: Option<&Wanted>) -> Result<Mesh> {
    let count = grid.points.len();
    source.room::<(f64, [u8; 4], Vec3)>("the points", count)?;
    let (mut values, mut colors) = (grid.values.clone(), grid.colors.clone());
    if wanted.is_some_and(|wanted| wanted.array.place == Place::Cells) {
        values = if values.is_empty() { values } else { vec![f64::NAN; count] };
        colors = if colors.is_empty() { colors } else { vec![[255; 4]; count] };
        for cell in 0..grid.types.len() {
            for point in grid.points_of(cell).map(|point| point as usize) {
                values.get_mut(point).into_iter().for_each(|value| *value = grid.values[cell]);
                colors.get_mut(point).into_iter().for_each(|color| *color = grid.colors[cell]);
            }
        }
    }
    let kept: Vec<usize> = (0..count).filter(|&point| !grid.ghosts[point]).collect();
    let (origin, positions) =
        positions::settle_some(source, kept.len(), |row| grid.points[kept[row]])?;
    fn of<T: Copy>(kept: &[usize], list: &[T]) -> Vec<T> {
        if list.is_empty() { Vec::new() } else { kept.iter().map(|&point| list[point]).collect() }
    }
    let mut mesh = Mesh {
        origin,
        positions,
        normals: of(&kept, &grid.normals).into_iter().map(positions::unit).collect(),
        colors: of(&kept, &colors),
        values: of(&kept, &values).into_iter().map(|value| value as f32).collect(),
        ..Mesh::default()
    };
    unplaced::leave_out(source, &mut mesh)?;
    Ok(mesh)
}

/// Makes a mesh of triangles and lines over the points of a grid, each with the number of its cell.
fn give(
    source: &Source,
    grid: &Grid,
    wanted: Option<&Wanted>,
    (triangles, segments): Owned,
) -> Result<Mesh> {
    source.check_points("the number of triangles", triangles.len() as u64)?;
    source.check_points("the number of lines", segments.len() as u64)?;
    let of_cells = wanted.is_some_and(|wanted| wanted.array.place == Place::Cells);
    // What tells the vertices at a point apart.
    let key = |cell: u32| match (grid.values.get(cell as usize), grid.colors.get(cell as usize)) {
        _ if !of_cells => 0,
        (Some(value), _) => (*value as f32).to_bits(),
        (_, Some(color)) => u32::from_le_bytes(*color),
        _ => 0,
    };
    source.room::<[u32; 2]>("the vertices", grid.points.len())?;
    source.room::<[u32; 3]>("the triangles", triangles.len())?;
    source.room::<[u32; 2]>("the lines", segments.len())?;
    // The first vertex at each point with its key, and the others.
    let mut firsts: Vec<Option<(u32, u32)>> = vec![None; grid.points.len()];
    let mut others: HashMap<(u32, u32), u32> = HashMap::new();
    // The point and the cell of each vertex.
    let mut vertices: Growing<(u32, u32)> = Growing::new(source, "the vertices");
    let mut vertex = |point: u32, cell: u32| {
        let (key, next) = (key(cell), vertices.len() as u32);
        let (first_key, first) = *firsts[point as usize].get_or_insert((key, next));
        let vertex =
            if first_key == key { first } else { *others.entry((point, key)).or_insert(next) };
        if vertex == next {
            vertices.push((point, cell))?;
        }
        Ok(vertex)
    };
    let mut out = Vec::with_capacity(triangles.len());
    for ([a, b, c], cell) in triangles {
        out.push([vertex(a, cell)?, vertex(b, cell)?, vertex(c, cell)?]);
    }
    let mut lines = Vec::with_capacity(segments.len());
    for ([a, b], cell) in segments {
        lines.push([vertex(a, cell)?, vertex(b, cell)?]);
    }
    source.check_points("the number of vertices", vertices.len() as u64)?;
    let vertices = vertices.into_inner();
    let position = |row: usize| grid.points[vertices[row].0 as usize];
    let (origin, positions) = positions::settle_some(source, vertices.len(), position)?;
    source.room::<(Vec3, [u8; 4], f32)>("the vertices", vertices.len())?;
    let index = |&(point, cell): &(u32, u32)| if of_cells { cell } else { point } as usize;
    let at = |vertex: &(u32, u32)| vertex.0 as usize;
    let has = |length: usize| length > 0;
    let rows = |is_there: bool| vertices.iter().filter(move |_| is_there);
    let mut mesh = Mesh {
        origin,
        positions,
        normals: rows(has(grid.normals.len()))
            .map(|vertex| positions::unit(grid.normals[at(vertex)]))
            .collect(),
        colors: rows(has(grid.colors.len())).map(|vertex| grid.colors[index(vertex)]).collect(),
        values: rows(has(grid.values.len()))
            .map(|vertex| grid.values[index(vertex)] as f32)
            .collect(),
        triangles: out,
        lines,
        ..Mesh::default()
    };
    unplaced::leave_out(source, &mut mesh)?;
    Ok(mesh)
}

/// Passes the polygons of a cell that is a surface to `add`. Those of higher order are cut along
/// their nodes.
pub fn cut(
    source: &Source,
    grid: &Grid,
    cell: usize,
    add: &mut dyn FnMut(&[u32]) -> Result<()>,
) -> Result<()> {
    let corners = grid.corners_of(cell);
    let kind = grid.types[cell];
    let parts: &[&[usize]] = match kind {
        8 => &[&[0, 1, 3, 2]],
        22 => &[&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]],
        34 => &[&[0, 3, 6, 5], &[3, 1, 4, 6], &[5, 6, 4, 2]],
        23 => &[&[0, 4, 7], &[4, 1, 5], &[5, 2, 6], &[6, 3, 7], &[4, 5, 6, 7]],
        28 => &[&[0, 4, 8, 7], &[4, 1, 5, 8], &[8, 5, 2, 6], &[7, 8, 6, 3]],
        30 => &[&[0, 4, 5, 3], &[4, 1, 2, 5]],
        6 => {
            for (at, triangle) in corners.windows(3).enumerate() {
                let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
                add(&if at % 2 == 0 { [a, b, c] } else { [b, a, c] })?;
            }
            return Ok(());
        }
        36 => {
            let (ends, middles) = corners.split_at(corners.len() / 2);
            let ring: Vec<u32> = ends.iter().zip(middles).flat_map(|(&a, &b)| [a, b]).collect();
            return add(&ring);
        }
        69 | 76 | 70 | 77 => {
            let wrong = || {
                let message = format!("has {} nodes, which no order has", corners.len());
                source.error(format!("cell {cell}"), message)
            };
            let is_triangle = matches!(kind, 69 | 76);
            let order = order(corners.len(), is_triangle).ok_or_else(wrong)?;
            return if is_triangle {
                triangle_of_order(corners, order, add)
            } else {
                square_of_order(corners, order, add)
            };
        }
        _ => return add(corners),
    };
    for part in parts {
        let polygon: Option<Vec<u32>> = part.iter().map(|&at| corners.get(at).copied()).collect();
        let polygon = polygon.ok_or_else(|| {
            let message = format!("is of type {kind}, but has only {} points", corners.len());
            source.error(format!("cell {cell}"), message)
        })?;
        add(&polygon)?;
    }
    Ok(())
}

/// Returns the order of a triangle or quadrilateral with a number of nodes.
fn order(nodes: usize, is_triangle: bool) -> Option<usize> {
    let count = |n: usize| {
        if is_triangle { (n + 1) * (n + 2) / 2 } else { (n + 1) * (n + 1) }
    };
    (1..=MOST_ORDER).find(|&order| count(order) == nodes)
}

/// Cuts a quadrilateral along its nodes: corners, then the edges, then the inner rows.
fn square_of_order(
    corners: &[u32],
    order: usize,
    add: &mut dyn FnMut(&[u32]) -> Result<()>,
) -> Result<()> {
    let inner = order - 1;
    let node = |i: usize, j: usize| {
        let (is_end, is_top) = (i == order, j == order);
        corners[match (i == 0 || is_end, j == 0 || is_top) {
            (true, true) => [[0, 3], [1, 2]][usize::from(is_end)][usize::from(is_top)],
            (false, true) => 4 + if is_top { 2 * inner } else { 0 } + i - 1,
            (true, false) => 4 + if is_end { inner } else { 3 * inner } + j - 1,
            (false, false) => 4 + 4 * inner + (j - 1) * inner + i - 1,
        }]
    };
    for j in 0..order {
        for i in 0..order {
            add(&[node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)])?;
        }
    }
    Ok(())
}

/// Cuts a triangle along its nodes: corners, then the edges, then a smaller triangle inside.
fn triangle_of_order(
    corners: &[u32],
    order: usize,
    add: &mut dyn FnMut(&[u32]) -> Result<()>,
) -> Result<()> {
    // The node with i steps towards the second corner and j towards the third.
    let node = |i: usize, j: usize| {
        let (mut start, mut n, mut i, mut j) = (0, order, i, j);
        loop {
            if n == 0 {
                return corners[start];
            }
            let k = n - i - j;
            let at = match (i, j, k) {
                (0, 0, _) => 0,
                (_, 0, 0) => 1,
                (0, _, 0) => 2,
                (_, 0, _) => 3 + i - 1,
                (_, _, 0) => 3 + (n - 1) + j - 1,
                (0, _, _) => 3 + 2 * (n - 1) + k - 1,
                _ => {
                    (start, n, i, j) = (start + 3 * n, n - 3, i - 1, j - 1);
                    continue;
                }
            };
            return corners[start + at];
        }
    };
    for j in 0..order {
        for i in 0..order - j {
            add(&[node(i, j), node(i + 1, j), node(i, j + 1)])?;
            if i + j + 1 < order {
                add(&[node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)])?;
            }
        }
    }
    Ok(())
}

/// The sides of cells that fill space by their corners, counter-clockwise from outside.
const TETRAHEDRON: &[&[usize]] = &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]];
const VOXEL: &[&[usize]] =
    &[&[0, 4, 6, 2], &[1, 3, 7, 5], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 2, 3, 1], &[4, 5, 7, 6]];
const HEXAHEDRON: &[&[usize]] =
    &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]];
const WEDGE: &[&[usize]] = &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]];
const PYRAMID: &[&[usize]] = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const PENTAGONAL: &[&[usize]] = &[
    &[0, 4, 3, 2, 1],
    &[5, 6, 7, 8, 9],
    &[0, 1, 6, 5],
    &[1, 2, 7, 6],
    &[2, 3, 8, 7],
    &[3, 4, 9, 8],
    &[4, 0, 5, 9],
];
const HEXAGONAL: &[&[usize]] = &[
    &[0, 5, 4, 3, 2, 1],
    &[6, 7, 8, 9, 10, 11],
    &[0, 1, 7, 6],
    &[1, 2, 8, 7],
    &[2, 3, 9, 8],
    &[3, 4, 10, 9],
    &[4, 5, 11, 10],
    &[5, 0, 6, 11],
];

/// Passes the sides of a cell that fills space to `add`. Those of higher order have only their
/// corners.
fn each_side(grid: &Grid, cell: usize, add: &mut dyn FnMut(&[u32]) -> Result<()>) -> Result<()> {
    let corners = grid.corners_of(cell);
    let sides = match grid.types[cell] {
        10 | 24 | 71 | 78 => TETRAHEDRON,
        11 => VOXEL,
        12 | 25 | 29 | 33 | 72 | 79 => HEXAHEDRON,
        13 | 26 | 31 | 32 | 73 | 80 => WEDGE,
        14 | 27 | 37 => PYRAMID,
        15 => PENTAGONAL,
        16 => HEXAGONAL,
        POLYHEDRON => return faces(corners).try_for_each(add),
        _ => &[],
    };
    for side in sides {
        let side: Option<Vec<u32>> = side.iter().map(|&at| corners.get(at).copied()).collect();
        if let Some(side) = side {
            add(&side)?;
        }
    }
    Ok(())
}

/// Returns the centre of a cell, the mean of its corners, and the root mean square of their
/// distances from it.
pub fn centre(grid: &Grid, cell: usize) -> (DVec3, f64) {
    let points = grid.points_of(cell).map(|point| grid.points[point as usize]);
    let count = points.clone().count().max(1) as f64;
    let centre = points.clone().sum::<DVec3>() / count;
    let square = points.map(|point| point.distance_squared(centre)).sum::<f64>() / count;
    (centre, square.sqrt())
}

//! The boundary of cells as a mesh: the sides that only one cell has, curved ones divided as the
//! cells are, and the faces beside the cells.

use super::{
    CellKind, CellOptions, Cells, Place,
    sides::{self, Side},
    split::{Between, Divisions},
};
use crate::{math::weld::first_of_equals, parallel::prelude::*, surface::Mesh};
use glam::{DVec3, DVec4};
use std::collections::HashMap;

/// The boundary of cells.
pub(super) struct Boundary {
    /// Its triangles, counter-clockwise from outside, with the values of points if there are any.
    pub mesh: Mesh,
    /// The values of the triangles, if values are those of cells.
    pub of_triangles: Vec<f32>,
    /// The edges of the cells' sides, each once, by vertices of the mesh.
    pub edges: Vec<[u32; 2]>,
}

/// A boundary that is being made, by the numbers of points: first the cells' own, then those of
/// divided cells.
struct Made<'a> {
    cells: &'a Cells,
    divisions: Divisions,
    level: usize,
    between: Between,
    /// Places and values of the points that are no nodes.
    more: Vec<DVec4>,
    triangles: Vec<[u32; 3]>,
    of_triangles: Vec<f32>,
    edges: Vec<[u32; 2]>,
}

impl Boundary {
    /// Returns the boundary of cells that are usable. Cells with a hole at a node are left out.
    pub fn of(cells: &Cells) -> Self {
        let divisions = Divisions::new(cells);
        let visible: Vec<bool> =
            (0..cells.len()).into_par_iter().map(|cell| cells.is_shown(cell)).collect();
        let level = cells.level(&divisions, &visible, &CellOptions::default());
        let open = sides::open(cells, |cell| visible[cell]);
        let mut made = Made {
            cells,
            divisions,
            level,
            between: Between::default(),
            more: Vec::new(),
            triangles: Vec::with_capacity(2 * open.len()),
            of_triangles: Vec::new(),
            edges: Vec::with_capacity(4 * open.len()),
        };
        for side in &open {
            made.add_side(*side);
        }
        made.add_faces(&open);
        made.finish()
    }
}

impl Made<'_> {
    fn is_of_cells(&self) -> bool {
        self.cells.place == Place::Cells && !self.cells.values.is_empty()
    }

    /// Returns the place and the value of a point.
    fn point(&self, number: u32) -> DVec4 {
        match (number as usize).checked_sub(self.cells.points.len()) {
            None => self.cells.node(number),
            Some(more) => self.more[more],
        }
    }

    fn place(&self, number: u32) -> DVec3 {
        self.point(number).truncate()
    }

    /// Adds a side of a cell.
    fn add_side(&mut self, side: Side) {
        let polygons = self.polygons(side);
        let first = self.triangles.len();
        for polygon in &polygons {
            self.fan(polygon);
        }
        self.add_edges(&polygons);
        self.turn_out(first, side.cell as usize);
        if self.is_of_cells() {
            self.of_triangles.resize(self.triangles.len(), self.cells.values[side.cell as usize]);
        }
    }

    /// Returns the polygons of a side: one, or those that its division has.
    fn polygons(&mut self, side: Side) -> Vec<Vec<u32>> {
        let Self { cells, divisions, level, between, more, .. } = self;
        let (cell, number) = (side.cell as usize, side.number as usize);
        let divisions = divisions.of(cells, cell);
        let is_straight = divisions.len() <= 1;
        let division = divisions.get(*level).or(divisions.last());
        let Some(division) = division.filter(|_| !is_straight) else {
            let mut polygons = Vec::new();
            sides::each(cells, cell, &mut |index, corners| {
                if index as usize == number {
                    polygons = vec![corners.to_vec()];
                }
            });
            return polygons;
        };
        let nodes = cells.nodes_of(cell);
        let mut point = |at: &usize| {
            between.number(cells, nodes, &division.points[*at], |place| {
                more.push(place);
                (cells.points.len() + more.len() - 1) as u32
            })
        };
        division.sides[number].iter().map(|face| face.iter().map(&mut point).collect()).collect()
    }

    /// Adds the triangles of a polygon, around its point with the least number, as the tetrahedra
    /// of cells have them.
    fn fan(&mut self, polygon: &[u32]) {
        let least = (0..polygon.len()).min_by_key(|at| polygon[*at]).unwrap_or(0);
        let at = |step: usize| polygon[(least + step) % polygon.len()];
        for step in 1..polygon.len().saturating_sub(1) {
            let triangle = [at(0), at(step), at(step + 1)];
            let [a, b, c] = triangle;
            // Corners of collapsed cells may be one point.
            if a != b && b != c && c != a {
                self.triangles.push(triangle);
            }
        }
    }

    /// Adds the edges around polygons.
    fn add_edges(&mut self, polygons: &[Vec<u32>]) {
        let edges = polygons.iter().flat_map(|polygon| {
            let next = |at: usize| polygon[(at + 1) % polygon.len()];
            (0..polygon.len()).map(move |at| [polygon[at].min(next(at)), polygon[at].max(next(at))])
        });
        let mut edges: Vec<[u32; 2]> = edges.filter(|[a, b]| a != b).collect();
        if polygons.len() > 1 {
            // Those between the polygons are no edges of the side.
            edges.sort_unstable();
            let equals = edges.chunk_by(|a, b| a == b).filter(|equals| equals.len() == 1);
            edges = equals.map(|equals| equals[0]).collect();
        }
        self.edges.extend(edges);
    }

    /// Turns the triangles of a side, from the number `first` on, away from the middle of its cell,
    /// whose nodes may be in any order.
    fn turn_out(&mut self, first: usize, cell: usize) {
        let (mut sum, mut count) = (DVec3::ZERO, 0.0);
        for node in self.cells.points_of(cell) {
            sum += self.place(node);
            count += 1.0;
        }
        let middle = sum / count;
        let out: f64 = self.triangles[first..]
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|corner| self.place(corner) - middle);
                a.dot(b.cross(c))
            })
            .sum();
        if out < 0.0 {
            self.triangles[first..].iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        }
    }

    /// Adds the faces beside the cells that do not lie on a side, where they would be seen twice.
    fn add_faces(&mut self, open: &[Side]) {
        let cells = self.cells;
        if cells.faces.is_empty() {
            return;
        }
        let sides = Sides::new(self, open);
        for (number, polygon) in cells.faces.polygons().enumerate() {
            let has_hole = match self.is_of_cells() {
                true => cells.faces.values[number].is_nan(),
                false => polygon.iter().any(|corner| self.point(*corner).w.is_nan()),
            };
            if has_hole || sides.hold(polygon) {
                continue;
            }
            self.fan(polygon);
            self.add_edges(std::slice::from_ref(&polygon.to_vec()));
            if self.is_of_cells() {
                self.of_triangles.resize(self.triangles.len(), cells.faces.values[number]);
            }
        }
    }

    fn finish(mut self) -> Boundary {
        let mut numbers = vec![u32::MAX; self.cells.points.len() + self.more.len()];
        let mut used = Vec::new();
        for corner in self.triangles.as_flattened_mut() {
            let number = &mut numbers[*corner as usize];
            if *number == u32::MAX {
                *number = used.len() as u32;
                used.push(*corner);
            }
            *corner = *number;
        }
        let mut edges = self.edges.clone();
        for edge in &mut edges {
            let [a, b] = edge.map(|end| numbers[end as usize]);
            *edge = [a.min(b), a.max(b)];
        }
        edges.retain(|[_, last]| *last != u32::MAX);
        edges.par_sort_unstable();
        edges.dedup();
        let has_values = self.cells.place == Place::Points && !self.cells.values.is_empty();
        let valued = used.iter().filter(|_| has_values);
        let mesh = Mesh {
            origin: self.cells.origin,
            positions: used.iter().map(|point| self.place(*point).as_vec3()).collect(),
            values: valued.map(|point| self.point(*point).w as f32).collect(),
            triangles: self.triangles,
            ..Mesh::default()
        };
        Boundary { mesh, of_triangles: self.of_triangles, edges }
    }
}

/// The nodes of sides. Of nodes at one place, the first stands for all: pieces of a file may have
/// points of their own.
struct Sides {
    first: Vec<u32>,
    nodes: Vec<Vec<u32>>,
    /// The sides that have each node.
    of_nodes: HashMap<u32, Vec<u32>>,
}

impl Sides {
    fn new(made: &Made, open: &[Side]) -> Self {
        let cells = made.cells;
        let first = first_of_equals(&cells.points);
        let nodes_of = |side: &Side| {
            let (cell, number) = (side.cell as usize, side.number as usize);
            let mut side_nodes = Vec::new();
            let divisions = made.divisions.of(cells, cell);
            match divisions.get(1) {
                // Those that have a weight somewhere on the side.
                Some(division) if cells.kinds[cell] != CellKind::Polyhedron => {
                    let nodes = cells.nodes_of(cell);
                    for at in division.sides[number].iter().flatten() {
                        let weights = nodes.iter().zip(&division.points[*at]);
                        side_nodes.extend(
                            weights
                                .filter(|(_, weight)| weight.abs() > 1e-9)
                                .map(|(node, _)| *node),
                        );
                    }
                }
                _ => sides::each(cells, cell, &mut |index, corners| {
                    if index as usize == number {
                        side_nodes.extend(corners);
                    }
                }),
            }
            side_nodes.iter_mut().for_each(|node| *node = first[*node as usize]);
            side_nodes.sort_unstable();
            side_nodes.dedup();
            side_nodes
        };
        let nodes: Vec<Vec<u32>> = open.par_iter().map(nodes_of).collect();
        let mut of_nodes: HashMap<u32, Vec<u32>> = HashMap::new();
        for (side, nodes) in (0..).zip(&nodes) {
            nodes.iter().for_each(|node| of_nodes.entry(*node).or_default().push(side));
        }
        Self { first, nodes, of_nodes }
    }

    /// Returns whether all corners of a polygon are nodes of one side.
    fn hold(&self, polygon: &[u32]) -> bool {
        let corners: Vec<u32> = polygon.iter().map(|corner| self.first[*corner as usize]).collect();
        let sides = corners.first().and_then(|corner| self.of_nodes.get(corner));
        sides.is_some_and(|sides| {
            sides.iter().any(|side| {
                let nodes = &self.nodes[*side as usize];
                corners.iter().all(|corner| nodes.binary_search(corner).is_ok())
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn cube() -> Cells {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        let points: Vec<Vec3> = (0..8).map(corner).collect();
        let values = points.iter().map(|p| p.element_sum()).collect();
        let mut cells = Cells { points, values, ..Cells::default() };
        cells.push(CellKind::Voxel, 0..8);
        cells
    }

    /// Six times the volume inside.
    fn volume(mesh: &Mesh) -> f32 {
        let one = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            a.dot(b.cross(c))
        };
        mesh.triangles.iter().map(one).sum()
    }

    #[test]
    fn sides_face_outward_whatever_the_order_of_nodes() {
        for nodes in [[0, 1, 3, 2, 4, 5, 7, 6], [4, 5, 7, 6, 0, 1, 3, 2]] {
            let mut cells = Cells { kinds: vec![], offsets: vec![0], nodes: vec![], ..cube() };
            cells.push(CellKind::Hexahedron, nodes);
            let boundary = Boundary::of(&cells);
            assert!((volume(&boundary.mesh) - 6.0).abs() < 1e-6);
            assert_eq!((boundary.mesh.triangles.len(), boundary.edges.len()), (12, 12));
            assert!(boundary.mesh.is_solid());
        }
    }

    #[test]
    fn faces_on_a_side_are_left_out() {
        let mut cells = cube();
        // Another point at the place of the first, and one away.
        cells.points.extend([Vec3::ZERO, Vec3::new(0.0, 0.0, 2.0)]);
        cells.values.extend([9.0, 9.0]);
        cells.faces.push([0, 1, 3, 2]);
        cells.faces.push([8, 1, 3]);
        cells.faces.push([4, 5, 9]);
        cells.validate().unwrap();
        let boundary = Boundary::of(&cells);
        assert_eq!((boundary.mesh.triangles.len(), boundary.mesh.positions.len()), (13, 9));
        assert_eq!(boundary.edges.len(), 14);
        // With values of cells, the face has its own.
        let of_cells = Cells { place: Place::Cells, values: vec![1.0], ..cells };
        let faces = super::super::Faces { values: vec![5.0, 6.0, 7.0], ..of_cells.faces.clone() };
        let boundary = Boundary::of(&Cells { faces, ..of_cells });
        assert_eq!(boundary.of_triangles.len(), 13);
        assert_eq!((boundary.of_triangles[11], boundary.of_triangles[12]), (1.0, 7.0));
    }

    #[test]
    fn curved_sides_are_divided_and_holes_open_sides() {
        let cells = Cells::tube(CellKind::QuadraticHexahedron, 1).unwrap();
        let boundary = Boundary::of(&cells);
        let straight = Boundary::of(&Cells::tube(CellKind::Hexahedron, 1).unwrap());
        assert!(boundary.mesh.triangles.len() >= 4 * straight.mesh.triangles.len());
        assert!(boundary.mesh.is_solid() && straight.mesh.is_solid());
        // The inner and the outer wall, round to a thousandth.
        let radius = |edge: &[u32; 2]| {
            let [a, b] = edge.map(|end| boundary.mesh.positions[end as usize]);
            (0.5 * (a + b)).truncate().length()
        };
        let wall = |distance: f32| !(0.47..=0.98).contains(&distance);
        let off = boundary.edges.iter().map(radius).filter(|distance| wall(*distance));
        assert!(
            off.map(|distance| (distance - 0.45).abs().min((distance - 1.0).abs()))
                .all(|off| off < 5e-3)
        );
        let mut holed = Cells::tube(CellKind::Hexahedron, 1).unwrap();
        let node = holed.nodes_of(5)[0] as usize;
        holed.values[node] = f32::NAN;
        let holed = Boundary::of(&holed);
        assert!(holed.mesh.values.iter().all(|value| !value.is_nan()));
        assert_ne!(holed.mesh.triangles.len(), straight.mesh.triangles.len());
    }
}

//! Cells to try things on: a bent tube of cells of one kind, with a smooth field.

use super::{
    CellKind, Cells,
    basis::{CUBE, TETRAHEDRON},
};
use crate::{Error, Result};
use glam::Vec3;
use std::{collections::HashMap, f32::consts::TAU};

/// Corners of the cubes that are divided into wedges and tetrahedra: cut along the diagonals that
/// begin at the first corner.
const WEDGES: [[usize; 6]; 2] = [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]];
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]];
/// The quadrilaterals of a cube, seen from inside.
const FACES: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [3, 2, 6, 7], [0, 3, 7, 4], [1, 5, 6, 2]];

/// A place in half steps of the grid.
type Place = [u32; 3];

/// The grid of a tube, and its nodes.
struct Grid {
    /// Cubes through the wall, around and along the tube.
    dims: [u32; 3],
    nodes: HashMap<Place, u32>,
    cells: Cells,
}

impl Cells {
    /// Returns three quarters of a tube of cells of one kind: tetrahedra, hexahedra, wedges,
    /// pyramids, or the quadratic kinds of the first two. The tube is made of cubes, `parts`
    /// through its wall, each of one to six cells. The nodes of linear cells are moved a little.
    /// The field is smooth, with values from 0 to 100.
    ///
    /// # Errors
    /// [`Error::Argument`] for another kind, for no parts, and for more than 256.
    pub fn tube(kind: CellKind, parts: u32) -> Result<Self> {
        if !(1..=256).contains(&parts) {
            return Err(Error::Argument(format!("{parts} parts of a tube; 1 to 256 are allowed")));
        }
        let dims = [parts, 6 * parts, 3 * parts];
        let mut grid = Grid { dims, nodes: HashMap::new(), cells: Self::default() };
        for z in 0..dims[2] {
            for y in 0..dims[1] {
                for x in 0..dims[0] {
                    grid.add(kind, [2 * x, 2 * y, 2 * z])?;
                }
            }
        }
        let mut cells = grid.cells;
        cells.about.name = "density".into();
        Ok(cells)
    }
}

impl Grid {
    /// Adds the cells of the cube whose first corner is at a place.
    fn add(&mut self, kind: CellKind, [x, y, z]: Place) -> Result<()> {
        let corner = |[right, back]: [u32; 2], up: u32| [x + 2 * right, y + 2 * back, z + 2 * up];
        let square = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let corners: Vec<Place> =
            [0, 1].into_iter().flat_map(|up| square.map(|at| corner(at, up))).collect();
        let with_middles = |corners: &[Place], edges: &[[usize; 2]]| {
            let middle = |[a, b]: &[usize; 2]| {
                [0, 1, 2].map(|axis| (corners[*a][axis] + corners[*b][axis]) / 2)
            };
            corners.iter().copied().chain(edges.iter().map(middle)).collect::<Vec<Place>>()
        };
        match kind {
            CellKind::Hexahedron => self.push(kind, corners),
            CellKind::QuadraticHexahedron => self.push(kind, with_middles(&corners, CUBE)),
            CellKind::Wedge => {
                for wedge in WEDGES {
                    self.push(kind, wedge.map(|at| corners[at]).to_vec());
                }
            }
            CellKind::Pyramid => {
                let apex = [x + 1, y + 1, z + 1];
                for face in FACES {
                    self.push(kind, [face.map(|at| corners[at]).to_vec(), vec![apex]].concat());
                }
            }
            CellKind::Tetrahedron => {
                for tetrahedron in TETRAHEDRA {
                    self.push(kind, tetrahedron.map(|at| corners[at]).to_vec());
                }
            }
            CellKind::QuadraticTetrahedron => {
                for tetrahedron in TETRAHEDRA {
                    let nodes = tetrahedron.map(|at| corners[at]);
                    self.push(kind, with_middles(&nodes, TETRAHEDRON));
                }
            }
            other => {
                return Err(Error::Argument(format!(
                    "there is no tube of the kind {}",
                    other.name()
                )));
            }
        }
        Ok(())
    }

    fn push(&mut self, kind: CellKind, places: Vec<Place>) {
        let is_linear = places.len() <= 8;
        let nodes: Vec<u32> = places.into_iter().map(|place| self.node(place, is_linear)).collect();
        self.cells.push(kind, nodes);
    }

    fn node(&mut self, place: Place, is_moved: bool) -> u32 {
        if let Some(node) = self.nodes.get(&place) {
            return *node;
        }
        let mut steps = place.map(|half| 0.5 * half as f32);
        // Nodes on the boundary stay there.
        let mut number = place.iter().fold(1u32, |sum, at| (sum ^ at).wrapping_mul(0x0100_0193));
        for (step, count) in steps.iter_mut().zip(self.dims) {
            number = (number ^ (number >> 15)).wrapping_mul(0x2c1b_3c6d);
            let is_inside = *step > 0.0 && *step < count as f32;
            if is_moved && is_inside {
                *step += 0.4 * ((number >> 8) as f32 / (1 << 24) as f32 - 0.5);
            }
        }
        let [wall, around, along] = [0, 1, 2].map(|axis| steps[axis] / self.dims[axis] as f32);
        let (radius, angle) = (0.45 + 0.55 * wall, 0.75 * TAU * around);
        let at = Vec3::new(radius * angle.cos(), radius * angle.sin(), 1.6 * (along - 0.5));
        let node = self.cells.points.len() as u32;
        self.cells.points.push(at);
        self.cells.values.push(field(at));
        self.nodes.insert(place, node);
        node
    }
}

/// The field of the tube.
fn field(at: Vec3) -> f32 {
    let waves = (3.0 * at.x + at.z).sin() + (4.0 * at.y).cos() + (5.0 * at.z - 2.0 * at.x).sin();
    (50.0 + 16.5 * waves).clamp(0.0, 100.0)
}

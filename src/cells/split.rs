//! Cells, divided into tetrahedra.

use super::{
    CellKind, Cells, Place, Tetrahedra,
    basis::Basis,
    division::{Block, Division, faces_of},
    kind::faces,
    tetrahedra::Builder,
};
use crate::{Error, Result, parallel::prelude::*};
use glam::DVec4;
use std::collections::HashMap;

/// How cells become tetrahedra.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellOptions {
    /// How far linear tetrahedra may deviate from a cell: in its shape, as a part of its size; in
    /// its field, as a part of the range of all values. Cells that deviate more are divided more
    /// often, along each edge into up to eight parts. The default is 1/100.
    pub tolerance: f64,
    /// The most tetrahedra: cells are divided less if there would be more. The default is 2²⁶, for
    /// which 1 GiB of memory is enough.
    pub most: usize,
}

impl Default for CellOptions {
    fn default() -> Self {
        Self { tolerance: 0.01, most: 1 << 26 }
    }
}

/// The parts into which the edges of a cell may be divided, by level.
const PARTS: [usize; 4] = [1, 2, 4, 8];

impl Cells {
    /// Divides the cells into tetrahedra with linear fields. Neighbours divide the faces that they
    /// share in the same way, by the numbers of their points (Dompierre et al. 1999). All curved
    /// cells are divided equally often; those with straight edges are not divided further.
    ///
    /// Left out are cells with a hole at a node, and tetrahedra without a volume.
    ///
    /// # Errors
    /// Those of [`validate`](Self::validate), and [`Error::Argument`] if there are no values, or if
    /// nothing is left.
    pub fn tetrahedra(&self, options: &CellOptions) -> Result<Tetrahedra> {
        if self.values.is_empty() {
            return Err(Error::Argument("the cells have no values".into()));
        }
        self.divided(options)?.0.finish(true)
    }

    /// Returns the tetrahedra, to be completed, and the number of those before each cell.
    pub(super) fn divided(&self, options: &CellOptions) -> Result<(Builder, Vec<u32>)> {
        self.validate()?;
        let divisions = Divisions::new(self);
        let visible: Vec<bool> =
            (0..self.len()).into_par_iter().map(|cell| self.is_shown(cell)).collect();
        let level = self.level(&divisions, &visible, options);
        let mut made =
            Made { cells: self, between: Between::default(), builder: Builder::new(self) };
        let mut starts = Vec::with_capacity(self.len());
        for (cell, is_shown) in visible.into_iter().enumerate() {
            starts.push(made.builder.len() as u32);
            if is_shown {
                let levels = divisions.of(self, cell);
                made.add(cell, levels.get(level).or(levels.last()));
            }
        }
        Ok((made.builder, starts))
    }

    /// Returns the level to which the visible cells are divided. All have the same, so that the
    /// faces between curved cells fit. A cell with fewer levels takes its last one.
    pub(super) fn level(
        &self,
        divisions: &Divisions,
        visible: &[bool],
        options: &CellOptions,
    ) -> usize {
        let [low, high] = self.range();
        let (shape, field) = (options.tolerance, options.tolerance * (high - low));
        let cells = || (0..self.len()).into_par_iter().filter(|cell| visible[*cell]);
        let wanted = |cell: usize| {
            // The finest level is taken as it is.
            let coarser = divisions.of(self, cell).split_last().map_or(&[][..], |(_, rest)| rest);
            let fits = |division: &Division| self.fits(cell, division, shape, field);
            coarser.iter().position(fits).unwrap_or(coarser.len())
        };
        let wanted = cells().map(wanted).reduce(|| 0, usize::max);
        // Blocks of a cell grow with the cube of the parts; a block holds up to six tetrahedra.
        let count = |level: usize| -> usize {
            let of_cell = |cell: usize| {
                let finest = divisions.of(self, cell).len().saturating_sub(1);
                6 * PARTS[level.min(finest)].pow(3)
            };
            cells().map(of_cell).sum()
        };
        (1..=wanted).rev().find(|level| count(*level) <= options.most).unwrap_or(0)
    }

    /// Whether a cell has values at all of its nodes.
    pub(super) fn is_shown(&self, cell: usize) -> bool {
        match self.place {
            _ if self.values.is_empty() => true,
            Place::Points => self.points_of(cell).all(|node| !self.values[node as usize].is_nan()),
            Place::Cells => !self.values[cell].is_nan(),
        }
    }

    /// Whether the linear blocks of a division are as close to a cell as wanted.
    fn fits(&self, cell: usize, division: &Division, shape: f64, field: f64) -> bool {
        let nodes = self.nodes_of(cell);
        let corners: Vec<DVec4> = nodes.iter().map(|node| self.node(*node)).collect();
        let of = |weights: &[f64]| -> DVec4 {
            weights.iter().zip(&corners).map(|(weight, corner)| *weight * *corner).sum()
        };
        let low = corners.iter().copied().fold(DVec4::INFINITY, DVec4::min);
        let high = corners.iter().copied().fold(DVec4::NEG_INFINITY, DVec4::max);
        let shape = shape * (high - low).truncate().length();
        let points: Vec<DVec4> = division.points.iter().map(|weights| of(weights)).collect();
        division.middles.iter().all(|([a, b], weights)| {
            let away = of(weights) - 0.5 * (points[*a] + points[*b]);
            away.truncate().length() <= shape && away.w.abs() <= field
        })
    }

    /// Returns a node's place and value. Values of cells count as 0, and so does a missing field.
    pub(super) fn node(&self, node: u32) -> DVec4 {
        let value = match self.place {
            Place::Points if !self.values.is_empty() => f64::from(self.values[node as usize]),
            _ => 0.0,
        };
        self.points[node as usize].as_dvec3().extend(value)
    }
}

/// The divisions of all kinds of cells of a mesh, by kind and number of nodes, at each level.
pub(super) struct Divisions(HashMap<(CellKind, usize), Vec<Division>>);

impl Divisions {
    pub fn new(cells: &Cells) -> Self {
        let mut divisions: HashMap<_, Vec<Division>> = HashMap::new();
        for (cell, kind) in cells.kinds.iter().enumerate() {
            let nodes = cells.nodes_of(cell).len();
            let Some(form) = kind.form() else { continue };
            divisions.entry((*kind, nodes)).or_insert_with(|| {
                let Some(basis) = Basis::of(*kind, nodes) else { return Vec::new() };
                // Cells with straight edges are divided once: their faces then fit each other.
                let is_straight = nodes <= 8 && kind.order(nodes).is_none();
                let levels = if is_straight { 1 } else { PARTS.len() };
                let parts = PARTS[..levels].iter();
                parts.map(|parts| Division::new(form, &basis, *parts)).collect()
            });
        }
        Self(divisions)
    }

    /// Returns the divisions of a cell, the coarsest first; none for prisms and polyhedra.
    pub fn of(&self, cells: &Cells, cell: usize) -> &[Division] {
        let key = (cells.kinds[cell], cells.nodes_of(cell).len());
        self.0.get(&key).map_or(&[], Vec::as_slice)
    }
}

/// Tetrahedra that are being made.
struct Made<'a> {
    cells: &'a Cells,
    between: Between,
    builder: Builder,
}

/// A smaller weight is one of rounding.
const LEAST_WEIGHT: f64 = 1e-9;

/// The points of divided cells that are no nodes, by the weights of the nodes that make them.
#[derive(Default)]
pub(super) struct Between(HashMap<u128, u32>);

impl Between {
    /// Returns the number of the point with these weights of a cell's nodes. `add` adds one that
    /// was not met before, with its place and value, and returns its number.
    pub fn number(
        &mut self,
        cells: &Cells,
        nodes: &[u32],
        weights: &[f64],
        add: impl FnOnce(DVec4) -> u32,
    ) -> u32 {
        let parts = nodes.iter().zip(weights).filter(|(_, weight)| weight.abs() > LEAST_WEIGHT);
        // Weights add up to 1. Between the nodes, polynomials of a high order may exceed 1.
        let mut weighted = parts.clone();
        if let (Some((node, _)), None) = (weighted.next(), weighted.next()) {
            return *node;
        }
        // A point of a face has weights of the nodes of this face only, in all of its cells. The
        // sum does not depend on their order.
        let key = parts.clone().fold(0u128, |sum, (node, weight)| {
            sum.wrapping_add(mixed(*node, (weight * 65536.0).round() as i64))
        });
        let at = || parts.map(|(node, weight)| *weight * cells.node(*node)).sum();
        *self.0.entry(key).or_insert_with(|| add(at()))
    }
}

impl Made<'_> {
    fn add(&mut self, cell: usize, division: Option<&Division>) {
        let nodes = self.cells.nodes_of(cell);
        let value = match self.cells.place {
            Place::Points => 0.0,
            Place::Cells => self.cells.values.get(cell).copied().unwrap_or_default(),
        };
        let Some(division) = division else {
            return match faces_of(self.cells.kinds[cell]) {
                Some(faces) => self.cone(&faces, nodes, value),
                None => self.polyhedron(nodes, value),
            };
        };
        let points: Vec<u32> =
            division.points.iter().map(|weights| self.point(nodes, weights)).collect();
        for block in &division.blocks {
            match block {
                Block::Tetrahedron(corners) => {
                    self.builder.add(corners.map(|corner| points[corner]), value);
                }
                Block::Solid(faces) => self.cone(faces, &points, value),
            }
        }
    }

    /// Returns the number of the point with these weights of the nodes.
    fn point(&mut self, nodes: &[u32], weights: &[f64]) -> u32 {
        let add = |at: DVec4| self.builder.point(at.truncate().as_vec3(), at.w as f32);
        self.between.number(self.cells, nodes, weights, add)
    }

    /// Adds a convex solid: the cone from its point with the least number over the faces that do
    /// not have this point. Faces are fans around their point with the least number, so that both
    /// sides of a face agree.
    fn cone(&mut self, faces: &[Vec<usize>], points: &[u32], value: f32) {
        let Some(apex) = faces.iter().flatten().map(|corner| points[*corner]).min() else { return };
        for face in faces {
            let face: Vec<u32> = face.iter().map(|corner| points[*corner]).collect();
            if !face.contains(&apex) {
                self.fan(&face, apex, value);
            }
        }
    }

    fn fan(&mut self, face: &[u32], apex: u32, value: f32) {
        let least = (0..face.len()).min_by_key(|corner| face[*corner]).unwrap_or(0);
        let at = |step: usize| face[(least + step) % face.len()];
        for step in 1..face.len().saturating_sub(1) {
            self.builder.add([apex, at(0), at(step), at(step + 1)], value);
        }
    }

    /// Adds a polyhedron: the cone from its middle over all faces.
    fn polyhedron(&mut self, stream: &[u32], value: f32) {
        let mut corners: Vec<u32> =
            faces(stream).filter_map(Result::ok).flatten().copied().collect();
        corners.sort_unstable();
        corners.dedup();
        let sum: DVec4 = corners.iter().map(|corner| self.cells.node(*corner)).sum();
        let middle = sum / corners.len() as f64;
        let apex = self.builder.point(middle.truncate().as_vec3(), middle.w as f32);
        for face in faces(stream).filter_map(Result::ok) {
            self.fan(face, apex, value);
        }
    }
}

/// Mixes a node and its weight into a number that others are not likely to have (Steele, Lea &
/// Flood 2014).
fn mixed(node: u32, weight: i64) -> u128 {
    let mix = |seed: u64| {
        let mut z = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let first = mix(u64::from(node) ^ mix(weight as u64 ^ 0x5851_f42d));
    u128::from(first) << 64 | u128::from(mix(first ^ u64::from(node).rotate_left(17)))
}

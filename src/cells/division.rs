//! Reference cells, divided into linear blocks: tetrahedra, and solids whose faces are divided
//! later, by the numbers of their points.

use super::{
    CellKind,
    basis::{At, Basis, Form},
};
use glam::DVec3;
use std::collections::BTreeSet;

/// A part of a divided cell, by the numbers of its points.
#[derive(Debug, Clone)]
pub(super) enum Block {
    Tetrahedron([usize; 4]),
    /// The faces of a convex solid.
    Solid(Vec<Vec<usize>>),
}

/// A cell divided into blocks.
pub(super) struct Division {
    /// The weight of each node at each of the points.
    pub points: Vec<Vec<f64>>,
    pub blocks: Vec<Block>,
    /// Pairs of points between which the blocks are linear, and the weights in the middle.
    pub middles: Vec<([usize; 2], Vec<f64>)>,
    /// The faces of blocks on each face of the cell ([`Form::sides`]), as seen from outside.
    pub sides: Vec<Vec<Vec<usize>>>,
}

/// The faces of the forms, counter-clockwise from outside.
const TETRAHEDRON: &[&[usize]] = &[&[0, 1, 3], &[1, 2, 3], &[2, 0, 3], &[0, 2, 1]];
const HEXAHEDRON: &[&[usize]] =
    &[&[0, 4, 7, 3], &[1, 2, 6, 5], &[0, 1, 5, 4], &[3, 7, 6, 2], &[0, 3, 2, 1], &[4, 5, 6, 7]];
const WEDGE: &[&[usize]] = &[&[0, 1, 2], &[3, 5, 4], &[0, 3, 4, 1], &[1, 4, 5, 2], &[2, 5, 3, 0]];
const PYRAMID: &[&[usize]] = &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];

/// Returns the faces of a prism over a pentagon or a hexagon, by its corners; `None` for other
/// kinds.
pub(super) fn faces_of(kind: CellKind) -> Option<Vec<Vec<usize>>> {
    let prism = |sides: usize| {
        let mut faces = vec![(0..sides).collect(), (sides..2 * sides).collect()];
        faces.extend((0..sides).map(|side| {
            let next = (side + 1) % sides;
            vec![side, next, next + sides, side + sides]
        }));
        faces
    };
    Some(match kind {
        CellKind::PentagonalPrism => prism(5),
        CellKind::HexagonalPrism => prism(6),
        _ => return None,
    })
}

impl Form {
    /// Returns the corners of each face, counter-clockwise from outside.
    pub fn sides(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tetrahedron => TETRAHEDRON,
            Self::Hexahedron => HEXAHEDRON,
            Self::Wedge => WEDGE,
            Self::Pyramid => PYRAMID,
        }
    }

    /// Returns a place in the plane of a face, and the direction out of the form there.
    fn plane(self, side: &[usize]) -> [DVec3; 2] {
        let corner = |at: usize| DVec3::from_array(self.corners()[side[at]]);
        [corner(0), (corner(1) - corner(0)).cross(corner(2) - corner(0))]
    }
}

impl Division {
    /// Divides the edges of a cell into `parts`.
    pub fn new(form: Form, basis: &Basis, parts: usize) -> Self {
        let (places, blocks) = match form {
            Form::Tetrahedron => tetrahedron(parts),
            Form::Hexahedron => hexahedron(parts),
            Form::Wedge => wedge(parts),
            Form::Pyramid => pyramid(parts),
        };
        let scale = 1.0 / parts as f64;
        let at = |place: [usize; 3]| place.map(|step| step as f64 * scale);
        let mut pairs = BTreeSet::new();
        for block in &blocks {
            let corners = block.corners();
            for (index, a) in corners.iter().enumerate() {
                pairs.extend(corners[index + 1..].iter().map(|b| [*a.min(b), *a.max(b)]));
            }
        }
        let middle = |[a, b]: [usize; 2]| -> At {
            let (a, b) = (at(places[a]), at(places[b]));
            [0, 1, 2].map(|axis| 0.5 * (a[axis] + b[axis]))
        };
        let middles = pairs.into_iter().map(|pair| (pair, basis.weights(middle(pair)))).collect();
        let points = places.iter().map(|place| basis.weights(at(*place))).collect();
        let on_side = |side: &&[usize]| {
            let [start, out] = form.plane(side);
            let place = |corner: usize| DVec3::from_array(at(places[corner]));
            let is_on = |corner: &usize| out.dot(place(*corner) - start).abs() < 1e-9;
            let faces = blocks.iter().flat_map(Block::faces);
            let faces = faces.filter(|face| face.iter().all(is_on)).map(|mut face| {
                let [a, b, c] = [0, 1, 2].map(|corner| place(face[corner]));
                // Tetrahedra have their corners in any order.
                if (b - a).cross(c - a).dot(out) < 0.0 {
                    face.reverse();
                }
                face
            });
            faces.collect()
        };
        let sides = form.sides().iter().map(on_side).collect();
        Self { points, blocks, middles, sides }
    }
}

impl Block {
    /// Returns the corners of the faces.
    fn faces(&self) -> Vec<Vec<usize>> {
        match self {
            Self::Tetrahedron(corners) => TETRAHEDRON
                .iter()
                .map(|face| face.iter().map(|at| corners[*at]).collect())
                .collect(),
            Self::Solid(faces) => faces.clone(),
        }
    }

    fn corners(&self) -> Vec<usize> {
        match self {
            Self::Tetrahedron(corners) => corners.to_vec(),
            Self::Solid(faces) => {
                let all: BTreeSet<usize> = faces.iter().flatten().copied().collect();
                all.into_iter().collect()
            }
        }
    }
}

/// The places of points, in parts of an edge, and the blocks between them.
type Parts = (Vec<[usize; 3]>, Vec<Block>);

/// The points of a form, and where they are in the list.
struct Places(Vec<[usize; 3]>);

impl Places {
    /// All places up to a number of parts along each axis that lie in a form.
    fn new(parts: usize, is_in: impl Fn([usize; 3]) -> bool) -> Self {
        let all = || 0..=parts;
        let places = all().flat_map(|z| all().flat_map(move |y| all().map(move |x| [x, y, z])));
        Self(places.filter(|place| is_in(*place)).collect())
    }

    fn number(&self, place: [usize; 3]) -> usize {
        let order = |[x, y, z]: [usize; 3]| [z, y, x];
        self.0.partition_point(|point| order(*point) < order(place))
    }

    fn solid(&self, faces: &[&[usize]], corners: &[[usize; 3]]) -> Block {
        let face = |face: &&[usize]| face.iter().map(|&at| self.number(corners[at])).collect();
        Block::Solid(faces.iter().map(face).collect())
    }
}

/// Cubes.
fn hexahedron(parts: usize) -> Parts {
    let places = Places::new(parts, |_| true);
    let blocks = Places::new(parts - 1, |_| true).0.into_iter().map(|[x, y, z]| {
        let corners = [0, 1].map(|up| {
            [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[right, back]| [x + right, y + back, z + up])
        });
        places.solid(HEXAHEDRON, corners.as_flattened())
    });
    let blocks = blocks.collect();
    (places.0, blocks)
}

/// Wedges: triangles of both directions in each layer.
fn wedge(parts: usize) -> Parts {
    let places = Places::new(parts, |[x, y, _]| x + y <= parts);
    let mut blocks = Vec::new();
    for [x, y, z] in Places::new(parts - 1, |[x, y, _]| x + y < parts).0 {
        let mut add = |triangle: [[usize; 2]; 3]| {
            let layer = |z: usize| triangle.map(|[x, y]| [x, y, z]);
            blocks.push(places.solid(WEDGE, [layer(z), layer(z + 1)].as_flattened()));
        };
        add([[x, y], [x + 1, y], [x, y + 1]]);
        if x + y + 1 < parts {
            add([[x + 1, y], [x + 1, y + 1], [x, y + 1]]);
        }
    }
    (places.0, blocks)
}

/// Tetrahedra: those of cubes cut along their diagonals (Freudenthal 1942) that lie in the cell.
fn tetrahedron(parts: usize) -> Parts {
    let places = Places::new(parts, |[x, y, z]| x + y + z <= parts);
    // In cubes, the cell is parts ≥ x ≥ y ≥ z; its own places are the differences.
    let number = |[x, y, z]: [usize; 3]| places.number([x - y, y - z, z]);
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let is_in = |[x, y, z]: [usize; 3]| parts >= x && x >= y && y >= z;
    let mut blocks = Vec::new();
    for cube in Places::new(parts - 1, is_in).0 {
        for order in orders {
            let mut at = cube;
            let corners = [0, 1, 2, 3].map(|step| {
                if step > 0 {
                    at[order[step - 1]] += 1;
                }
                at
            });
            if corners.into_iter().all(is_in) {
                blocks.push(Block::Tetrahedron(corners.map(number)));
            }
        }
    }
    (places.0, blocks)
}

/// Pyramids that stand and hang, and tetrahedra between the standing ones.
fn pyramid(parts: usize) -> Parts {
    let places = Places::new(parts, |[x, y, z]| x.max(y) + z <= parts);
    let mut blocks = Vec::new();
    for [x, y, z] in Places::new(parts - 1, |[x, y, z]| x.max(y) + z < parts).0 {
        let square = |z: usize| [[x, y, z], [x + 1, y, z], [x + 1, y + 1, z], [x, y + 1, z]];
        let solid = |z: usize, apex: [usize; 3]| {
            places.solid(PYRAMID, [&square(z)[..], &[apex]].concat().as_slice())
        };
        blocks.push(solid(z, [x, y, z + 1]));
        let ends = z + 1 + x.max(y) + 1 > parts;
        if !ends {
            blocks.push(solid(z + 1, [x + 1, y + 1, z]));
        }
        let mut add = |corners: [[usize; 3]; 4]| {
            blocks.push(Block::Tetrahedron(corners.map(|at| places.number(at))));
        };
        if x + 1 + z < parts {
            add([[x + 1, y, z], [x + 1, y + 1, z], [x, y, z + 1], [x + 1, y, z + 1]]);
        }
        if y + 1 + z < parts {
            add([[x, y + 1, z], [x + 1, y + 1, z], [x, y, z + 1], [x, y + 1, z + 1]]);
        }
    }
    (places.0, blocks)
}

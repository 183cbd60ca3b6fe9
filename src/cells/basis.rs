//! What the kinds of cells interpolate: the place of each node in the reference cell, and each
//! node's weight at any place.
//!
//! Reference cells are VTK's. The tetrahedron has the corners 0 and the three axes; the hexahedron
//! is the unit cube; the wedge is the triangle of the first two axes times the third. The pyramid
//! is the unit square at the bottom, which shrinks towards the apex at (0, 0, 1).

use super::CellKind;

/// A place in a reference cell.
pub(super) type At = [f64; 3];

/// The form of a reference cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Form {
    Tetrahedron,
    Hexahedron,
    Wedge,
    Pyramid,
}

/// The interpolation of a kind of cell.
pub(super) enum Basis {
    /// Each weight is a sum of functions; one row of factors a node.
    Solved { terms: fn(At) -> Vec<f64>, factors: Vec<Vec<f64>> },
    /// Lagrange or Bernstein polynomials of a number of nodes along the edges. The steps of each
    /// node, up to four: along the three axes, or away from the four corners of a tetrahedron.
    Ordered { form: Form, order: usize, is_bezier: bool, steps: Vec<[usize; 4]> },
}

impl CellKind {
    /// Returns the form of the kind's reference cell; `None` for those that are no image of one.
    pub(super) fn form(self) -> Option<Form> {
        Some(match self {
            Self::Tetrahedron
            | Self::QuadraticTetrahedron
            | Self::LagrangeTetrahedron
            | Self::BezierTetrahedron => Form::Tetrahedron,
            Self::Voxel
            | Self::Hexahedron
            | Self::QuadraticHexahedron
            | Self::TriquadraticHexahedron
            | Self::BiquadraticQuadraticHexahedron
            | Self::LagrangeHexahedron
            | Self::BezierHexahedron => Form::Hexahedron,
            Self::Wedge
            | Self::QuadraticWedge
            | Self::QuadraticLinearWedge
            | Self::BiquadraticQuadraticWedge
            | Self::LagrangeWedge
            | Self::BezierWedge => Form::Wedge,
            Self::Pyramid | Self::QuadraticPyramid | Self::TriquadraticPyramid => Form::Pyramid,
            Self::PentagonalPrism | Self::HexagonalPrism | Self::Polyhedron => return None,
        })
    }
}

/// The edges of the forms, as pairs of corners, in the order of their middle nodes.
pub(super) const TETRAHEDRON: &[[usize; 2]] = &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
pub(super) const CUBE: &[[usize; 2]] = &[
    [0, 1],
    [1, 2],
    [2, 3],
    [3, 0],
    [4, 5],
    [5, 6],
    [6, 7],
    [7, 4],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];
const WEDGE: &[[usize; 2]] =
    &[[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 3], [0, 3], [1, 4], [2, 5]];
const PYRAMID: &[[usize; 2]] = &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]];

impl Form {
    /// Returns the places of the corners.
    pub(super) fn corners(self) -> &'static [At] {
        const SQUARE: [At; 8] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        const APEX: [At; 5] = [SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[3], SQUARE[4]];
        const TRIANGLES: [At; 6] =
            [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[4], SQUARE[5], SQUARE[7]];
        const AXES: [At; 4] = [SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[4]];
        match self {
            Self::Tetrahedron => &AXES,
            Self::Hexahedron => &SQUARE,
            Self::Wedge => &TRIANGLES,
            Self::Pyramid => &APEX,
        }
    }
}

/// The middles of the faces of a cube, and its own.
const FACES: [At; 7] = [
    [0.0, 0.5, 0.5],
    [1.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
    [0.5, 1.0, 0.5],
    [0.5, 0.5, 0.0],
    [0.5, 0.5, 1.0],
    [0.5, 0.5, 0.5],
];

/// Returns the places of the nodes of a kind whose number of nodes is fixed.
fn places(kind: CellKind, form: Form) -> Vec<At> {
    let corners = form.corners();
    let middles = |edges: &[[usize; 2]]| -> Vec<At> {
        let middle = |&[a, b]: &[usize; 2]| {
            [0, 1, 2].map(|axis| 0.5 * (corners[a][axis] + corners[b][axis]))
        };
        edges.iter().map(middle).collect()
    };
    // The middles of a wedge's quadrilaterals, and of a pyramid's faces with one place inside.
    let sides = [[0.5, 0.0, 0.5], [0.5, 0.5, 0.5], [0.0, 0.5, 0.5]];
    let third = 1.0 / 3.0;
    let inner = [
        [0.5, 0.5, 0.0],
        [third, 0.0, third],
        [2.0 * third, third, third],
        [third, 2.0 * third, third],
        [0.0, third, third],
        [0.375, 0.375, 0.25],
    ];
    let more: Vec<At> = match kind {
        CellKind::QuadraticTetrahedron => middles(TETRAHEDRON),
        CellKind::QuadraticHexahedron => middles(CUBE),
        CellKind::TriquadraticHexahedron => [middles(CUBE), FACES.to_vec()].concat(),
        CellKind::BiquadraticQuadraticHexahedron => [middles(CUBE), FACES[..4].to_vec()].concat(),
        CellKind::QuadraticWedge => middles(WEDGE),
        CellKind::QuadraticLinearWedge => middles(&WEDGE[..6]),
        CellKind::BiquadraticQuadraticWedge => [middles(WEDGE), sides.to_vec()].concat(),
        CellKind::QuadraticPyramid => middles(PYRAMID),
        CellKind::TriquadraticPyramid => [middles(PYRAMID), inner.to_vec()].concat(),
        _ => Vec::new(),
    };
    [corners.to_vec(), more].concat()
}

/// Returns the functions whose sums interpolate in a kind of cell with a fixed number of nodes.
fn terms(kind: CellKind) -> fn(At) -> Vec<f64> {
    match kind {
        CellKind::Tetrahedron => |[x, y, z]| vec![1.0, x, y, z],
        CellKind::Wedge => |[x, y, z]| vec![1.0, x, y, z, x * z, y * z],
        CellKind::Pyramid => |at| {
            let [x, y, z] = at;
            vec![1.0, x, y, z, x * y * over(z)]
        },
        CellKind::QuadraticTetrahedron => quadratic,
        CellKind::QuadraticHexahedron => serendipity,
        CellKind::BiquadraticQuadraticHexahedron => |at| {
            let [x, y, z] = at;
            let (xz, yz) = (x * x * z * z, y * y * z * z);
            [serendipity(at), vec![yz, yz * x, xz, xz * y]].concat()
        },
        CellKind::TriquadraticHexahedron => {
            |[x, y, z]| products(&[square(x), square(y), square(z)])
        }
        CellKind::QuadraticWedge => |[x, y, z]| {
            let more = [z * z, x * z * z, y * z * z];
            [products(&[flat([x, y]), vec![1.0, z]]), more.to_vec()].concat()
        },
        CellKind::QuadraticLinearWedge => |[x, y, z]| products(&[flat([x, y]), vec![1.0, z]]),
        CellKind::BiquadraticQuadraticWedge => |[x, y, z]| products(&[flat([x, y]), square(z)]),
        CellKind::QuadraticPyramid => pyramid,
        CellKind::TriquadraticPyramid => |at| {
            // Bubbles: one for each face, which vanishes on all others, and one inside.
            let [x, y, z] = at;
            let (p, q, w) = (x * over(z), y * over(z), 1.0 - z);
            let bubbles = [
                p * (1.0 - p) * q * (1.0 - q) * w * w,
                p * (1.0 - p) * w * w * z * (1.0 - q),
                q * (1.0 - q) * w * w * z * p,
                p * (1.0 - p) * w * w * z * q,
                q * (1.0 - q) * w * w * z * (1.0 - p),
                p * (1.0 - p) * q * (1.0 - q) * w * w * z,
            ];
            [pyramid(at), bubbles.to_vec()].concat()
        },
        _ => |[x, y, z]| products(&[vec![1.0, x], vec![1.0, y], vec![1.0, z]]),
    }
}

/// One over the width of a pyramid at a height; 0 at the apex, where all that it scales vanishes.
fn over(z: f64) -> f64 {
    if z < 1.0 { 1.0 / (1.0 - z) } else { 0.0 }
}

fn square(x: f64) -> Vec<f64> {
    vec![1.0, x, x * x]
}

/// The polynomials of the second degree in the plane.
fn flat([x, y]: [f64; 2]) -> Vec<f64> {
    vec![1.0, x, y, x * x, x * y, y * y]
}

/// The polynomials of the second degree.
fn quadratic([x, y, z]: At) -> Vec<f64> {
    [flat([x, y]), vec![z, z * z, x * z, y * z]].concat()
}

/// All products of one number from each list.
fn products(lists: &[Vec<f64>]) -> Vec<f64> {
    lists.iter().fold(vec![1.0], |all, list| {
        all.iter().flat_map(|a| list.iter().map(move |b| a * b)).collect()
    })
}

/// The functions of a cube with nodes at the corners and on the edges: at most one factor is
/// quadratic.
fn serendipity([x, y, z]: At) -> Vec<f64> {
    let line = |a: f64| vec![1.0, a];
    let plane = |a: f64, b: f64| products(&[line(a), line(b)]);
    let more = [(x, plane(y, z)), (y, plane(x, z)), (z, plane(x, y))];
    let more = more.into_iter().flat_map(|(a, rest)| rest.into_iter().map(move |b| a * a * b));
    products(&[line(x), line(y), line(z)]).into_iter().chain(more).collect()
}

/// The functions of a quadratic pyramid: quadratic on triangles, those of a square with nodes at
/// the corners and on the edges at the bottom (Bedrosian 1992).
fn pyramid(at: At) -> Vec<f64> {
    let [x, y, z] = at;
    let ratio = x * y * over(z);
    [quadratic(at), vec![ratio, ratio * x, ratio * y]].concat()
}

impl Basis {
    /// Returns the interpolation of a kind with a number of nodes; `None` if the kind has none, or
    /// not that number.
    pub fn of(kind: CellKind, nodes: usize) -> Option<Self> {
        let form = kind.form()?;
        if let Some(order) = kind.order(nodes) {
            let is_bezier = matches!(
                kind,
                CellKind::BezierTetrahedron | CellKind::BezierHexahedron | CellKind::BezierWedge
            );
            let steps = match form {
                Form::Tetrahedron => tetrahedron_steps(order),
                Form::Hexahedron => hexahedron_steps(order),
                _ => wedge_steps(order),
            };
            return Some(Self::Ordered { form, order, is_bezier, steps });
        }
        if kind.nodes()? != nodes {
            return None;
        }
        let (places, terms) = (places(kind, form), terms(kind));
        // The corners of a voxel are those of a cube in another order.
        let places = if kind == CellKind::Voxel {
            [0, 1, 3, 2, 4, 5, 7, 6].map(|corner| places[corner]).to_vec()
        } else {
            places
        };
        let rows: Vec<Vec<f64>> = places.into_iter().map(terms).collect();
        Some(Self::Solved { terms, factors: inverse(rows) })
    }

    /// Returns the weight of each node at a place.
    pub fn weights(&self, at: At) -> Vec<f64> {
        match self {
            Self::Solved { terms, factors } => {
                let terms = terms(at);
                let node = |factors: &Vec<f64>| -> f64 {
                    factors.iter().zip(&terms).map(|(factor, term)| factor * term).sum()
                };
                factors.iter().map(node).collect()
            }
            Self::Ordered { form, order, is_bezier, steps } => {
                let [x, y, z] = at;
                let line = |at: f64, step: usize| {
                    // The product of both ends is a polynomial of the full order.
                    half(*is_bezier, *order, at, step)
                        * half(*is_bezier, *order, 1.0 - at, order - step)
                        * if *is_bezier { choose(*order, step) } else { 1.0 }
                };
                let simplex = |parts: &[f64], steps: &[usize]| -> f64 {
                    let halves = parts.iter().zip(steps);
                    let product: f64 =
                        halves.map(|(part, step)| half(*is_bezier, *order, *part, *step)).product();
                    product * if *is_bezier { multinomial(steps) } else { 1.0 }
                };
                let weight = |&[i, j, k, l]: &[usize; 4]| match form {
                    Form::Tetrahedron => simplex(&[1.0 - x - y - z, x, y, z], &[i, j, k, l]),
                    Form::Wedge => simplex(&[1.0 - x - y, x, y], &[i, j, k]) * line(z, l),
                    _ => line(x, i) * line(y, j) * line(z, k),
                };
                steps.iter().map(weight).collect()
            }
        }
    }
}

/// Returns the factor that an end contributes to a polynomial: of Lagrange's, the product of the
/// differences to the nodes before `step`, scaled to 1 there; of Bernstein's, the power.
fn half(is_bezier: bool, order: usize, at: f64, step: usize) -> f64 {
    if is_bezier {
        return at.powi(step as i32);
    }
    let at = at * order as f64;
    (0..step).map(|before| (at - before as f64) / (step - before) as f64).product()
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|i| i as f64).product()
}

fn choose(n: usize, k: usize) -> f64 {
    factorial(n) / factorial(k) / factorial(n - k)
}

fn multinomial(parts: &[usize]) -> f64 {
    factorial(parts.iter().sum()) / parts.iter().map(|part| factorial(*part)).product::<f64>()
}

/// Returns the inverse of a matrix, transposed, by elimination with pivots (Gauss & Jordan).
fn inverse(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let count = rows.len();
    for (index, row) in rows.iter_mut().enumerate() {
        row.extend((0..count).map(|column| f64::from(u8::from(column == index))));
    }
    for column in 0..count {
        let largest =
            |a: &usize, b: &usize| rows[*a][column].abs().total_cmp(&rows[*b][column].abs());
        let pivot = (column..count).max_by(largest).unwrap_or(column);
        rows.swap(column, pivot);
        let scale = 1.0 / rows[column][column];
        rows[column].iter_mut().for_each(|entry| *entry *= scale);
        let pivot_row = rows[column].clone();
        for (index, row) in rows.iter_mut().enumerate() {
            let factor = row[column];
            if index != column && factor != 0.0 {
                row.iter_mut().zip(&pivot_row).for_each(|(entry, value)| *entry -= factor * value);
            }
        }
    }
    (0..count).map(|node| rows.iter().map(|row| row[count + node]).collect()).collect()
}

/// Returns the places between two corners of a cell of an order, in steps.
fn between<const N: usize>(from: [usize; N], to: [usize; N], order: usize) -> Vec<[usize; N]> {
    let place = |step: usize| {
        std::array::from_fn(|axis| (from[axis] * (order - step) + to[axis] * step) / order)
    };
    (1..order).map(place).collect()
}

/// Returns the steps of the nodes of a triangle: corners, edges, then the triangle inside. `grown`
/// counts the triangles around it.
fn triangle_steps(order: usize, grown: usize) -> Vec<[usize; 3]> {
    let corners = [[order, 0, 0], [0, order, 0], [0, 0, order]];
    if order == 0 {
        return vec![[grown; 3]];
    }
    let mut nodes = corners.to_vec();
    for [a, b] in [[0, 1], [1, 2], [2, 0]] {
        nodes.extend(between(corners[a], corners[b], order));
    }
    nodes.iter_mut().for_each(|steps| *steps = steps.map(|step| step + grown));
    if order >= 3 {
        nodes.extend(triangle_steps(order - 3, grown + 1));
    }
    nodes
}

/// Returns the nodes inside a triangle of an order.
fn inner_triangle(order: usize) -> Vec<[usize; 3]> {
    if order >= 3 { triangle_steps(order - 3, 1) } else { Vec::new() }
}

/// Returns the steps of the nodes of a tetrahedron away from its corners.
fn tetrahedron_steps(order: usize) -> Vec<[usize; 4]> {
    if order == 0 {
        return vec![[0; 4]];
    }
    let corner = |at: usize| std::array::from_fn(|axis| if axis == at { order } else { 0 });
    let mut nodes: Vec<[usize; 4]> = (0..4).map(corner).collect();
    for [a, b] in TETRAHEDRON {
        nodes.extend(between(corner(*a), corner(*b), order));
    }
    for face in [[0, 1, 3], [2, 3, 1], [0, 3, 2], [0, 2, 1]] {
        nodes.extend(inner_triangle(order).into_iter().map(|steps| {
            let mut node = [0; 4];
            face.iter().zip(steps).for_each(|(corner, step)| node[*corner] = step);
            node
        }));
    }
    if order >= 4 {
        nodes
            .extend(tetrahedron_steps(order - 4).into_iter().map(|node| node.map(|step| step + 1)));
    }
    nodes
}

/// Returns the steps of the nodes of a hexahedron along its axes.
fn hexahedron_steps(order: usize) -> Vec<[usize; 4]> {
    let corner = |at: usize| {
        let [x, y, z] = Form::Hexahedron.corners()[at].map(|end| end as usize * order);
        [x, y, z, 0]
    };
    let mut nodes: Vec<[usize; 4]> = (0..8).map(corner).collect();
    // All edges run along an axis.
    for [a, b] in CUBE {
        let (a, b) = (corner(*a), corner(*b));
        nodes.extend(between(a.min(b), a.max(b), order));
    }
    let inner = || 1..order;
    for [fixed, first, second] in [[0, 1, 2], [1, 0, 2], [2, 0, 1]] {
        for side in [0, order] {
            for b in inner() {
                nodes.extend(inner().map(|a| {
                    let mut node = [0; 4];
                    (node[fixed], node[first], node[second]) = (side, a, b);
                    node
                }));
            }
        }
    }
    for z in inner() {
        for y in inner() {
            nodes.extend(inner().map(|x| [x, y, z, 0]));
        }
    }
    nodes
}

/// Returns the steps of the nodes of a wedge: away from the corners of its triangle, and along its
/// axis.
fn wedge_steps(order: usize) -> Vec<[usize; 4]> {
    let corner = |at: usize| {
        let mut node = [0; 4];
        (node[at % 3], node[3]) = (order, at / 3 * order);
        node
    };
    let mut nodes: Vec<[usize; 4]> = (0..6).map(corner).collect();
    for [a, b] in WEDGE {
        nodes.extend(between(corner(*a), corner(*b), order));
    }
    let triangle = inner_triangle(order);
    let at = |layer: usize| triangle.iter().map(move |&[a, b, c]| [a, b, c, layer]);
    nodes.extend([0, order].into_iter().flat_map(at));
    for [a, b] in [[0, 1], [1, 2], [2, 0]] {
        let side = between(corner(a), corner(b), order);
        nodes.extend(
            (1..order).flat_map(|layer| side.iter().map(move |&[a, b, c, _]| [a, b, c, layer])),
        );
    }
    nodes.extend((1..order).flat_map(at));
    nodes
}

//! The kinds of cells, with the numbers and the order of nodes of VTK.

use std::ops::RangeInclusive;

/// Highest order of Lagrange and Bézier cells.
pub(super) const MOST_ORDER: usize = 6;

/// A kind of cell that fills space. The order of its nodes is VTK's (“VTK File Formats”, and
/// `vtkCellType.h`): corners, then the middles of edges, then of faces, then inner nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
#[repr(u8)]
pub enum CellKind {
    /// 4 corners.
    Tetrahedron = 10,
    /// 8 corners of a box, x fastest, then y, then z.
    Voxel = 11,
    /// 8 corners: a quadrilateral, then the opposite one.
    Hexahedron = 12,
    /// A prism over a triangle: 6 corners.
    Wedge = 13,
    /// A quadrilateral and an apex.
    Pyramid = 14,
    /// A prism over a pentagon: 10 corners.
    PentagonalPrism = 15,
    /// A prism over a hexagon: 12 corners.
    HexagonalPrism = 16,
    /// 10 nodes.
    QuadraticTetrahedron = 24,
    /// 20 nodes.
    QuadraticHexahedron = 25,
    /// 15 nodes.
    QuadraticWedge = 26,
    /// 13 nodes.
    QuadraticPyramid = 27,
    /// 27 nodes.
    TriquadraticHexahedron = 29,
    /// Quadratic along the triangles, linear between them: 12 nodes.
    QuadraticLinearWedge = 31,
    /// Quadratic, with nodes in the middles of the quadrilaterals: 18 nodes.
    BiquadraticQuadraticWedge = 32,
    /// Quadratic, with nodes in the middles of the four sides: 24 nodes.
    BiquadraticQuadraticHexahedron = 33,
    /// 19 nodes: those of the quadratic pyramid, the middles of the faces and one inside.
    TriquadraticPyramid = 37,
    /// Any number of flat faces. Its nodes are a stream: the number of faces, then for each face
    /// the number of its points and the points.
    Polyhedron = 42,
    /// Of any order, by the number of nodes.
    LagrangeTetrahedron = 71,
    /// Of any order, the same along the three axes.
    LagrangeHexahedron = 72,
    /// Of any order, the same along the triangles and between them.
    LagrangeWedge = 73,
    /// Of any order, with weights of Bernstein polynomials.
    BezierTetrahedron = 78,
    /// Of any order, the same along the three axes.
    BezierHexahedron = 79,
    /// Of any order, the same along the triangles and between them.
    BezierWedge = 80,
}

impl CellKind {
    /// Every kind.
    pub const ALL: [Self; 23] = [
        Self::Tetrahedron,
        Self::Voxel,
        Self::Hexahedron,
        Self::Wedge,
        Self::Pyramid,
        Self::PentagonalPrism,
        Self::HexagonalPrism,
        Self::QuadraticTetrahedron,
        Self::QuadraticHexahedron,
        Self::QuadraticWedge,
        Self::QuadraticPyramid,
        Self::TriquadraticHexahedron,
        Self::QuadraticLinearWedge,
        Self::BiquadraticQuadraticWedge,
        Self::BiquadraticQuadraticHexahedron,
        Self::TriquadraticPyramid,
        Self::Polyhedron,
        Self::LagrangeTetrahedron,
        Self::LagrangeHexahedron,
        Self::LagrangeWedge,
        Self::BezierTetrahedron,
        Self::BezierHexahedron,
        Self::BezierWedge,
    ];

    /// Returns the kind with a number of VTK; `None` if it does not fill space, or is not known.
    pub fn of_vtk(number: u64) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| u64::from(kind.vtk()) == number)
    }

    /// Returns the number by which VTK knows the kind.
    pub fn vtk(self) -> u8 {
        self as u8
    }

    /// Returns its name for one cell.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tetrahedron => "tetrahedron",
            Self::Voxel => "voxel",
            Self::Hexahedron => "hexahedron",
            Self::Wedge => "wedge",
            Self::Pyramid => "pyramid",
            Self::PentagonalPrism => "pentagonal prism",
            Self::HexagonalPrism => "hexagonal prism",
            Self::QuadraticTetrahedron => "quadratic tetrahedron",
            Self::QuadraticHexahedron => "quadratic hexahedron",
            Self::QuadraticWedge => "quadratic wedge",
            Self::QuadraticPyramid => "quadratic pyramid",
            Self::TriquadraticHexahedron => "triquadratic hexahedron",
            Self::QuadraticLinearWedge => "quadratic linear wedge",
            Self::BiquadraticQuadraticWedge => "biquadratic quadratic wedge",
            Self::BiquadraticQuadraticHexahedron => "biquadratic quadratic hexahedron",
            Self::TriquadraticPyramid => "triquadratic pyramid",
            Self::Polyhedron => "polyhedron",
            Self::LagrangeTetrahedron => "Lagrange tetrahedron",
            Self::LagrangeHexahedron => "Lagrange hexahedron",
            Self::LagrangeWedge => "Lagrange wedge",
            Self::BezierTetrahedron => "Bézier tetrahedron",
            Self::BezierHexahedron => "Bézier hexahedron",
            Self::BezierWedge => "Bézier wedge",
        }
    }

    /// Returns the number of nodes; `None` if it differs from cell to cell.
    pub fn nodes(self) -> Option<usize> {
        Some(match self {
            Self::Tetrahedron => 4,
            Self::Voxel | Self::Hexahedron => 8,
            Self::Wedge => 6,
            Self::Pyramid => 5,
            Self::PentagonalPrism | Self::QuadraticTetrahedron => 10,
            Self::HexagonalPrism | Self::QuadraticLinearWedge => 12,
            Self::QuadraticHexahedron => 20,
            Self::QuadraticWedge => 15,
            Self::QuadraticPyramid => 13,
            Self::TriquadraticHexahedron => 27,
            Self::BiquadraticQuadraticWedge => 18,
            Self::BiquadraticQuadraticHexahedron => 24,
            Self::TriquadraticPyramid => 19,
            _ => return None,
        })
    }

    /// Returns the order of a cell with a number of nodes, for kinds of any order; `None` if no
    /// order has as many nodes.
    pub fn order(self, nodes: usize) -> Option<usize> {
        let count: fn(usize) -> usize = match self {
            Self::LagrangeTetrahedron | Self::BezierTetrahedron => {
                |n| (n + 1) * (n + 2) * (n + 3) / 6
            }
            Self::LagrangeHexahedron | Self::BezierHexahedron => |n| (n + 1).pow(3),
            Self::LagrangeWedge | Self::BezierWedge => |n| (n + 1) * (n + 1) * (n + 2) / 2,
            _ => return None,
        };
        const ORDERS: RangeInclusive<usize> = 1..=MOST_ORDER;
        ORDERS.into_iter().find(|&order| count(order) == nodes)
    }

    /// Checks the nodes of a cell: their number, and the faces of a polyhedron.
    pub(super) fn check(self, nodes: &[u32]) -> Result<(), String> {
        let (name, count) = (self.name(), nodes.len());
        match self {
            Self::Polyhedron => faces(nodes).try_for_each(|face| face.map(drop)),
            _ => match self.nodes() {
                Some(expected) if expected == count => Ok(()),
                Some(expected) => {
                    Err(format!("is a {name} with {count} nodes, but has {expected}"))
                }
                None if self.order(count).is_some() => Ok(()),
                None => Err(format!(
                    "is a {name} with {count} nodes, which no order from 1 to {MOST_ORDER} has"
                )),
            },
        }
    }
}

/// Returns the faces of a polyhedron. After a face that is wrong there are no more.
pub(super) fn faces(stream: &[u32]) -> impl Iterator<Item = Result<&[u32], String>> {
    let mut left = stream.split_first().map_or((0, stream), |(&count, rest)| (count, rest));
    let is_short = left.0 < 4;
    let mut is_wrong = false;
    std::iter::from_fn(move || {
        let (count, rest) = left;
        let wrong = |what: &str| Some(Err(format!("is a polyhedron whose faces {what}")));
        if is_wrong {
            return None;
        }
        is_wrong = true;
        if is_short {
            return wrong("are fewer than 4");
        }
        if count == 0 {
            return if rest.is_empty() { None } else { wrong("have numbers behind the last") };
        }
        let Some((&corners, rest)) = rest.split_first() else {
            return wrong("end before the last");
        };
        let Some((face, rest)) = rest.split_at_checked(corners as usize) else {
            return wrong("end within one");
        };
        if face.len() < 3 {
            return wrong("have fewer than 3 corners");
        }
        (left, is_wrong) = ((count - 1, rest), false);
        Some(Ok(face))
    })
}

use super::{CellKind, Cells, Place};
use crate::math::Bounds;
use glam::{DVec3, Vec3};

/// The corners of a unit cube, x fastest, each with the sum of its coordinates.
fn cube() -> Cells {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
    let points: Vec<Vec3> = (0..8).map(corner).collect();
    let values = points.iter().map(|p| p.element_sum()).collect();
    let mut cells = Cells { points, values, origin: DVec3::X, ..Cells::default() };
    cells.push(CellKind::Voxel, 0..8);
    cells
}

/// The same cube as a polyhedron.
fn faces() -> Vec<u32> {
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    std::iter::once(6).chain(faces.into_iter().flat_map(|f| std::iter::once(4).chain(f))).collect()
}

#[test]
fn facts_of_a_cube() {
    let mut cells = cube();
    cells.push(CellKind::Polyhedron, faces());
    cells.validate().expect("a cube");
    assert_eq!((cells.len(), cells.range()), (2, [0.0, 3.0]));
    let bounds = Bounds { min: DVec3::X, max: DVec3::new(2.0, 1.0, 1.0) };
    assert_eq!(cells.bounds(), bounds);
    assert_eq!(cells.histogram(3).unwrap(), [1, 3, 4]);
    assert_eq!(cells.points_of(1).count(), 24);
    // Points without a cell do not count, values that are holes neither.
    cells.points.push(Vec3::splat(9.0));
    cells.values.push(f32::NAN);
    cells.validate().expect("a hole");
    assert_eq!(cells.bounds(), bounds);
    assert_eq!(cells.range(), [0.0, 3.0]);
}

#[test]
fn kinds_have_the_numbers_of_vtk() {
    for kind in CellKind::ALL {
        assert_eq!(CellKind::of_vtk(kind.vtk().into()), Some(kind));
        assert!(kind.nodes().is_none_or(|count| kind.check(&vec![0; count]).is_ok()));
    }
    // A line, a triangle, and a number beyond all.
    assert!([3, 5, 9, 10_000_000_000].into_iter().all(|n| CellKind::of_vtk(n).is_none()));
    let order = |kind: CellKind, nodes| kind.order(nodes);
    assert_eq!(order(CellKind::LagrangeTetrahedron, 20), Some(3));
    assert_eq!(order(CellKind::LagrangeHexahedron, 27), Some(2));
    assert_eq!(order(CellKind::BezierWedge, 40), Some(3));
    assert_eq!(order(CellKind::LagrangeHexahedron, 28), None);
    assert_eq!(order(CellKind::Hexahedron, 8), None);
}

#[test]
fn what_is_wrong_is_named() {
    let refuses = |change: &dyn Fn(&mut Cells), expected: &str| {
        let mut cells = cube();
        change(&mut cells);
        let message = cells.validate().unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    };
    refuses(&|cells| *cells = Cells::default(), "there are no cells");
    refuses(&|cells| cells.values.truncate(3), "there are 3 values for 8 points");
    refuses(&|cells| cells.place = Place::Cells, "there are 8 values for 1 cells");
    refuses(&|cells| cells.offsets = vec![0, 9], "2 ascending numbers from 0 to 8");
    refuses(&|cells| cells.offsets = vec![0], "2 ascending numbers from 0 to 8");
    refuses(&|cells| cells.points[2].y = f32::NAN, "of point 2 is not finite");
    refuses(&|cells| cells.values[3] = f32::INFINITY, "the value of point 3 is inf");
    refuses(&|cells| cells.nodes[5] = 8, "cell 0 refers to point 8 of 8");
    refuses(&|cells| cells.kinds[0] = CellKind::Wedge, "is a wedge with 8 nodes, but has 6");
    refuses(
        &|cells| cells.push(CellKind::LagrangeWedge, 0..7),
        "cell 1 is a Lagrange wedge with 7",
    );
    refuses(&|cells| cells.origin.x = f64::NAN, "the origin");
    let stream = |stream: &[u32], expected: &str| {
        refuses(&|cells| cells.push(CellKind::Polyhedron, stream.to_vec()), expected);
    };
    stream(&[], "fewer than 4");
    stream(&[3], "fewer than 4");
    stream(&faces()[..20], "end within one");
    stream(&faces()[..26], "end before the last");
    stream(&[&faces()[..], &[1]].concat(), "behind the last");
    stream(&[4, 2, 0, 1], "fewer than 3 corners");
    stream(&[4, u32::MAX, 0, 1], "end within one");
}

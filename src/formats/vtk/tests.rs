//! Data sets of every kind as XML, alone, in pieces and in collections.

use super::*;
use crate::{
    cells::{self, CellKind},
    formats::Place,
    input::testing::*,
    math::Bounds,
    volume::Samples,
};
use glam::{DVec3, Vec3};

fn array(attributes: &str, text: &str) -> String {
    format!("<DataArray format='ascii' {attributes}>{text}</DataArray>")
}

fn file(kind: &str, attributes: &str, pieces: &str) -> String {
    format!("<VTKFile type='{kind}'><{kind} {attributes}>{pieces}</{kind}></VTKFile>")
}

/// Reads a file by a reader, with an array by name.
fn with<T>(
    text: &str,
    scalar: Option<&str>,
    read: fn(&Source, &ReadOptions) -> Result<T>,
) -> Result<T> {
    let folder = Folder::new();
    let options = ReadOptions::scalar(scalar);
    read_with(&folder.write("a.xml", text), |source| read(source, &options))
}

fn message<T>(result: Result<T>) -> String {
    match result {
        Ok(_) => panic!("no error"),
        Err(Error::Input { place, message, hint, .. }) => {
            format!("{place}: {message}; {}", hint.unwrap_or_default())
        }
        Err(error) => error.to_string(),
    }
}

const XYZ: &str = "type='Float32' NumberOfComponents='3'";

/// A tetrahedron with edge 2 and a square beside it.
fn grid(point_data: &str, cell_data: &str) -> String {
    let points = array(XYZ, "0 0 0 2 0 0 0 2 0 0 0 2  5 0 0 7 0 0 7 2 0 5 2 0");
    let corners = array("type='Int64' Name='connectivity'", "0 1 2 3 4 5 6 7");
    let ends = array("type='Int64' Name='offsets'", "4 8");
    let kinds = array("type='UInt8' Name='types'", "10 9");
    let piece = format!(
        "<Piece NumberOfPoints='8' NumberOfCells='2'><PointData>{point_data}</PointData><CellData>\
         {cell_data}</CellData><Points>{points}</Points><Cells>{corners}{ends}{kinds}</Cells>\
         </Piece>"
    );
    file("UnstructuredGrid", "", &piece)
}

#[test]
fn unstructured_grids() {
    let of_points = array("type='Float64' Name='p'", "1 2 3 4 5 6 7 8");
    let vector = array("type='Float32' Name='v' NumberOfComponents='3'", "0");
    let of_cells = array("type='Int32' Name='c'", "10 -20");
    let both = grid(&format!("{vector}{of_points}"), &of_cells);
    let cells = with(&both, None, read_cells).unwrap();
    let values: Vec<f32> = (1..=8).map(|value| value as f32).collect();
    assert_eq!((cells.kinds, cells.values), (vec![CellKind::Tetrahedron], values));
    // The square lies beside the cells.
    assert_eq!((cells.faces.corners, cells.faces.ends), (vec![4, 5, 6, 7], vec![4]));
    let points = with(&both, None, read_samples).unwrap();
    assert_eq!(
        (points.len(), points.positions[6], points.values[6]),
        (8, Vec3::new(7.0, 2.0, 0.0), 7.0)
    );
    let whole = grid("", &of_cells);
    for (text, scalar) in [(&both, Some("c")), (&whole, None)] {
        let cells = with(text, scalar, read_cells).unwrap();
        assert_eq!((cells.place, cells.values), (cells::Place::Cells, vec![10.0]));
        assert_eq!(cells.faces.values, [-20.0]);
        let points = with(text, scalar, read_samples).unwrap();
        assert_eq!(points.positions, [Vec3::splat(0.5), Vec3::new(6.0, 1.0, 0.0)]);
        assert_eq!(points.values, [10.0, -20.0]);
        // Mean squares of the distances: (0.75 + 3 · 2.75) / 4 = 2.25, and 2.
        assert_eq!(points.radii, [1.4 * 1.5, 1.4 * 2f32.sqrt()]);
    }
    every_cut(&Folder::new(), "a.vtu", whole.as_bytes(), |source| {
        read_cells(source, &ReadOptions::default())
    });
    for (text, scalar, word) in [
        (&both, Some("none"), "no array “none”"),
        (&both, Some("none"), "v (f32 × 3, points), p (f64, points), cell:c (i32, cells)"),
        (&both, Some("v"), "1 numbers where 24"),
        (&both, Some("v:q"), "none is “q”"),
        (&whole.replace("4 8", "4 9"), None, "8 numbers where 9"),
        (&whole.replace("4 8", "9 8"), None, "ends at corner 9"),
        (&whole.replace("4 8", "-4 8"), None, "ends at corner -4"),
        (&whole.replace("4 8", "0 8"), None, "cell 0: has no corners"),
        (&whole.replace("6 7<", "6 8<"), None, "point 8, but there are 8 points"),
        (&whole.replace("10 -20", "10"), None, "1 numbers where 2"),
        (&whole.replace("0 0 2  5", "0 0 nan 5"), None, "not at finite coordinates"),
        (&whole.replace("Name='offsets'", ""), None, "no array “offsets”"),
        (&whole.replace("NumberOfComponents='3'", ""), None, "positions have 3"),
        (&whole.replace("UnstructuredGrid", "HyperTreeGrid"), None, "HyperTreeGrid"),
    ] {
        let message = message(with(text, scalar, read_cells));
        assert!(message.contains(word), "{message}");
    }
    let lie = whole.replace("NumberOfPoints='8'", "NumberOfPoints='99999999999'");
    assert!(matches!(with(&lie, None, read_cells), Err(Error::Limit { .. })));
    // Without values, the boundary is drawn.
    assert_eq!(with(&grid("", ""), None, kind).unwrap(), Kind::Cells);
    assert_eq!(with(&grid("", ""), None, read_mesh).unwrap().triangles.len(), 6);
    let bare = with(&grid("", ""), None, read_cells).unwrap();
    assert_eq!((bare.len(), bare.faces.len(), bare.values.len()), (1, 1, 0));
}

/// Polyhedra as VTK writes them until 9.3, and since.
#[test]
fn polyhedra() {
    let points = array(XYZ, "0 0 0 1 0 0 0 1 0 0 0 1");
    let [corners, ends, kinds] = [("connectivity", "0 1 2 3"), ("offsets", "4"), ("types", "42")]
        .map(|(name, text)| array(&format!("type='Int64' Name='{name}'"), text));
    let list = |name: &str, text: &str| array(&format!("type='Int64' Name='{name}'"), text);
    let old = list("faces", "4 3 0 2 1 3 0 1 3 3 1 2 3 3 2 0 3") + &list("faceoffsets", "17");
    let new = list("face_connectivity", "0 2 1 0 1 3 1 2 3 2 0 3")
        + &list("face_offsets", "3 6 9 12")
        + &list("polyhedron_to_faces", "0 1 2 3")
        + &list("polyhedron_offsets", "4");
    let value = array("type='Float32' Name='t'", "1 2 3 4");
    let grid = |faces: &str, value: &str| {
        let piece = format!(
            "<Piece NumberOfPoints='4' NumberOfCells='1'><PointData>{value}</PointData>\
             <Points>{points}</Points><Cells>{corners}{ends}{kinds}{faces}</Cells></Piece>"
        );
        file("UnstructuredGrid", "", &piece)
    };
    for faces in [&old, &new] {
        let cells = with(&grid(faces, &value), None, read_cells).unwrap();
        assert_eq!(cells.kinds, [CellKind::Polyhedron]);
        assert_eq!(cells.nodes, [4, 3, 0, 1, 2, 3, 0, 2, 3, 3, 2, 1, 3, 3, 1, 0, 3]);
        assert_eq!(cells.values, [1.0, 3.0, 2.0, 4.0]);
        assert!(with(&grid(faces, ""), None, read_mesh).unwrap().is_solid());
    }
    for bad in [old.replace("4 3 0 2 1", "5 3 0 2 1"), new.replace("12<", "13<"), String::new()] {
        message(with(&grid(&bad, &value), None, read_cells));
    }
}

#[test]
fn polygons_are_surfaces() {
    let piece = |x: f64, values: &str| {
        let points = array(XYZ, &format!("{x} 0 0 {x} 3 0 {x} 0 3 {x} 3 3 {x} 9 9"));
        let cells = |corners: &str, ends: &str| {
            array("type='Int32' Name='connectivity'", corners)
                + &array("type='Int32' Name='offsets'", ends)
        };
        format!(
            "<Piece NumberOfPoints='5' NumberOfVerts='1' NumberOfLines='0' NumberOfPolys='1' \
             NumberOfStrips='1'><CellData Scalars='c'>{}</CellData><PointData Normals='N'>{}{}\
             </PointData><Points>{points}</Points><Verts>{}</Verts><Lines>{}</Lines>\
             <Polys>{}</Polys><Strips>{}</Strips></Piece>",
            array("type='Float32' Name='c'", values),
            array("type='Float32' Name='Normals' NumberOfComponents='3'", &"2 0 0 ".repeat(5)),
            array("type='Int32' Name='PointIds'", "9 8 7 6 5"),
            cells("3", "1"),
            cells("", ""),
            cells("0 1 2", "3"),
            cells("1 3 2", "3"),
        )
    };
    let text = file("PolyData", "", &(piece(0.0, "1 2 3") + &piece(9.0, "4 5 5")));
    // Values of faces: the vertices between faces of different values are split.
    let mesh = with(&text, None, read_mesh).unwrap();
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8], [7, 9, 8]]);
    assert_eq!(mesh.values, [2., 2., 2., 3., 3., 3., 5., 5., 5., 5.]);
    assert_eq!((mesh.normals[0], mesh.about.name.as_str()), (Vec3::X, "c"));
    // Identifiers only by name.
    let mesh = with(&text, Some("PointIds"), read_mesh).unwrap();
    assert_eq!(mesh.values, [9., 8., 7., 6., 9., 8., 7., 6.]);
    let bare = text.replace("Name='c'", "Name='CellIds'");
    let mesh = with(&bare, None, read_mesh).unwrap();
    assert!(mesh.values.is_empty() && mesh.normals.len() == mesh.positions.len());
    // Without faces: a cloud, or samples.
    let points = text.replace("NumberOfPolys='1'", "").replace("NumberOfStrips='1'", "");
    let points = points.replace("1 2 3<", "1<").replace("4 5 5<", "4<");
    let cloud = with(&points, None, read_mesh).unwrap();
    assert_eq!((cloud.positions.len(), cloud.triangles.len()), (10, 0));
    assert!((cloud.values[3], cloud.values[8]) == (1.0, 4.0) && cloud.values[0].is_nan());
    assert_eq!(with(&points, Some("PointIds"), kind).unwrap(), Kind::Samples);
}

/// Bytes with three components are colours.
#[test]
fn colors_of_points_and_faces() {
    let colors = array("type='UInt8' Name='RGB' NumberOfComponents='3'", "1 2 3 4 5 6 7 8 9");
    let points = array(XYZ, "0 0 0 1 0 0 0 1 0");
    let cells = array("type='Int32' Name='connectivity'", "0 1 2")
        + &array("type='Int32' Name='offsets'", "3");
    let text = file(
        "PolyData",
        "",
        &format!(
            "<Piece NumberOfPoints='3' NumberOfPolys='1'><PointData Scalars='RGB'>{colors}\
             </PointData><Points>{points}</Points><Polys>{cells}</Polys></Piece>"
        ),
    );
    let mesh = with(&text, None, read_mesh).unwrap();
    assert_eq!((mesh.colors[1], mesh.values.len()), ([4, 5, 6, 255], 0));
    let mesh = with(&text, Some("RGB:1"), read_mesh).unwrap();
    assert_eq!((mesh.values, mesh.about.name), (vec![2.0, 5.0, 8.0], "RGB y".into()));
    let length = with(&text, Some("RGB:magnitude"), read_mesh).unwrap().values;
    assert_eq!(length[0], 14f32.sqrt());
}

/// Every type of cell that is a surface covers it once.
#[test]
fn surfaces_of_higher_order() {
    let nodes = |count: usize, at: &dyn Fn(usize) -> [f64; 2]| {
        let points = (0..count).map(at).map(|[x, y]| format!("{x} {y} 0 ")).collect::<String>();
        (points, (0..count).map(|node| format!("{node} ")).collect::<String>())
    };
    let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0.5, 0.], [1., 0.5], [0.5, 1.]];
    let eight = [&square[..], &[[0., 0.5], [0.5, 0.5]]].concat();
    let triangle = [[0., 0.], [1., 0.], [0., 1.], [0.5, 0.], [0.5, 0.5], [0., 0.5]];
    let third = 1.0 / 3.0;
    let cubic = [
        [0., 0.],
        [1., 0.],
        [0., 1.],
        [third, 0.],
        [2. * third, 0.],
        [2. * third, third],
        [third, 2. * third],
        [0., 2. * third],
        [0., third],
        [third, third],
    ];
    let linear = [[0., 0.], [1., 0.], [1., 1.], [0., 1.], [0.5, 0.], [0.5, 1.]];
    let pixel = [[0., 0.], [1., 0.], [0., 1.], [1., 1.]];
    for (kind, places, count, area) in [
        (5, &triangle[..3], 1, 0.5),
        (6, &pixel[..], 2, 1.0),
        (8, &pixel[..], 2, 1.0),
        (9, &eight[..4], 2, 1.0),
        (22, &triangle[..], 4, 0.5),
        (23, &eight[..8], 6, 1.0),
        (28, &eight[..], 8, 1.0),
        (30, &linear[..], 4, 1.0),
        (36, &triangle[..], 4, 0.5),
        (69, &cubic[..], 9, 0.5),
        (69, &triangle[..], 4, 0.5),
        (70, &eight[..], 8, 1.0),
    ] {
        let (points, corners) = nodes(places.len(), &|node| places[node]);
        let piece = format!(
            "<Piece NumberOfPoints='{0}' NumberOfCells='1'><Points>{1}</Points><Cells>{2}{3}{4}\
             </Cells></Piece>",
            places.len(),
            array(XYZ, &points),
            array("type='Int64' Name='connectivity'", &corners),
            array("type='Int64' Name='offsets'", &places.len().to_string()),
            array("type='UInt8' Name='types'", &kind.to_string()),
        );
        let mesh = with(&file("UnstructuredGrid", "", &piece), None, read_mesh).unwrap();
        let sizes = mesh.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            (b - a).cross(c - a).z / 2.0
        });
        assert!(sizes.clone().all(|size| size >= 0.0), "type {kind}");
        assert!((sizes.sum::<f32>() - area).abs() < 1e-6, "type {kind}");
        assert_eq!(mesh.triangles.len(), count, "type {kind}");
    }
}

/// Lines from one end to the other, also of higher order, with values of their cells or points.
#[test]
fn lines_are_lines() {
    for (kind, nodes, wanted) in [
        (3, 2, &[[0, 1]][..]),
        (4, 4, &[[0, 1], [1, 2], [2, 3]]),
        (21, 3, &[[0, 2], [2, 1]]),
        (35, 4, &[[0, 2], [2, 3], [3, 1]]),
        (68, 5, &[[0, 2], [2, 3], [3, 4], [4, 1]]),
    ] {
        let points: Vec<String> = (0..nodes).map(|i| format!("{i} {} 0", i * i)).collect();
        let corners: Vec<String> = (0..nodes).map(|i| i.to_string()).collect();
        let piece = format!(
            "<Piece NumberOfPoints='{nodes}' NumberOfCells='1'><Points>{0}</Points><CellData>{4}\
             </CellData><Cells>{1}{2}{3}</Cells></Piece>",
            array(XYZ, &points.join(" ")),
            array("type='Int64' Name='connectivity'", &corners.join(" ")),
            array("type='Int64' Name='offsets'", &nodes.to_string()),
            array("type='UInt8' Name='types'", &kind.to_string()),
            array("type='Float32' Name='heat'", "7.5"),
        );
        let mesh = with(&file("UnstructuredGrid", "", &piece), None, read_mesh).unwrap();
        let place = |end: u32| (mesh.positions[end as usize] + mesh.origin.as_vec3()).x as u32;
        let lines: Vec<[u32; 2]> = mesh.lines.iter().map(|ends| ends.map(place)).collect();
        assert_eq!(lines, wanted, "type {kind}");
        assert_eq!((mesh.triangles.len(), mesh.values), (0, vec![7.5; nodes]));
    }
}

fn lattice(kind: &str, whole: &str, piece: &str) -> String {
    file(
        kind,
        &format!("WholeExtent='{whole}' Origin='1 0 0' Spacing='2 1 1'"),
        &format!("<Piece Extent='{whole}'>{piece}</Piece>"),
    )
}

/// Values of cells are samples at the cells' centres.
#[test]
fn cell_arrays_of_lattices() {
    let cells = format!("<CellData>{}</CellData>", array("type='UInt8' Name='c'", "7 5 6 9"));
    let image = lattice("ImageData", "3 5 0 2 4 4", &cells);
    let volume = with(&image, None, read_volume).unwrap();
    assert_eq!(volume.samples, Samples::U8(vec![7, 5, 6, 9]));
    assert_eq!((volume.lattice.dims, volume.about.name.as_str()), ([2, 2, 1], "c"));
    assert_eq!(volume.lattice.origin, DVec3::new(8.0, 0.5, 4.0));
    let places = ["0 1 5", "0 2 3", "7"].map(|text| array("type='Float64'", text)).concat();
    let grid = lattice(
        "RectilinearGrid",
        "0 2 0 2 0 0",
        &format!("{cells}<Coordinates>{places}</Coordinates>"),
    );
    let volume = with(&grid, Some("cell:c"), read_volume).unwrap();
    assert_eq!(volume.lattice.sample_position(3), DVec3::new(3.0, 2.5, 7.0));
}

/// Rectilinear grids, whole and in pieces.
#[test]
fn rectilinear_grids() {
    let piece = |extent: &str, places: [&str; 3], values: &str| {
        let places = places.map(|text| array("type='Float64'", text)).concat();
        let value = array("type='UInt8' Name='s'", values);
        format!(
            "<Piece Extent='{extent}'><PointData Scalars='s'>{value}</PointData>\
             <Coordinates>{places}</Coordinates></Piece>"
        )
    };
    let grid = |pieces: &str| file("RectilinearGrid", "WholeExtent='0 2 0 1 0 0'", pieces);
    let whole = grid(&piece("0 2 0 1 0 0", ["0 1 5", "-1 1", "7"], "0 1 2 3 4 5"));
    let pieces = grid(
        &(piece("0 1 0 1 0 0", ["0 1", "-1 1", "7"], "0 1 3 4")
            + &piece("1 2 0 1 0 0", ["1 5", "-1 1", "7"], "1 2 4 5")),
    );
    for text in [&whole, &pieces] {
        let volume = with(text, None, read_volume).unwrap();
        assert_eq!((volume.lattice.dims, volume.range), ([3, 2, 1], [0.0, 5.0]));
        assert_eq!(volume.lattice.sample_position(5), DVec3::new(5.0, 1.0, 7.0));
        let (min, max) = (DVec3::new(0.0, -1.0, 7.0), DVec3::new(5.0, 1.0, 7.0));
        assert_eq!(volume.bounds(), Bounds { min, max });
    }
    every_cut(&Folder::new(), "a.vtr", whole.as_bytes(), |source| {
        read_volume(source, &ReadOptions::default())
    });
    for (from, to, word) in [
        ("0 1 5", "0 2 2", "must ascend"),
        ("0 1 5", "0 2", "2 numbers where 3"),
        ("0 1 5", "0 2 nan", "ascend"),
        ("Coordinates", "Places", "0 arrays"),
    ] {
        let message = message(with(&whole.replace(from, to), None, read_volume));
        assert!(message.contains(word), "{message}");
    }
}

/// Structured grids are hexahedra, flat ones quadrilaterals, without those that are hidden.
#[test]
fn structured_grids() {
    let points = |[nx, ny, nz]: [usize; 3]| -> String {
        let place = |at: usize| format!("{} {} {} ", at % nx, at / nx % ny, at / nx / ny);
        (0..nx * ny * nz).map(place).collect()
    };
    let grid = |size: [usize; 3], data: &str| {
        let extent = format!("0 {} 0 {} 0 {}", size[0] - 1, size[1] - 1, size[2] - 1);
        let points = array(XYZ, &points(size));
        lattice("StructuredGrid", &extent, &format!("{data}<Points>{points}</Points>"))
    };
    let values = array("type='Float32' Name='t'", &"1 2 3 ".repeat(4));
    let solid = grid([3, 2, 2], &format!("<PointData>{values}</PointData>"));
    let cells = with(&solid, None, read_cells).unwrap();
    assert_eq!(cells.kinds, [CellKind::Hexahedron; 2]);
    let corners: Vec<Vec3> =
        cells.nodes_of(1).iter().map(|&node| cells.points[node as usize]).collect();
    let unit =
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let moved = unit.map(|[x, y, z]| Vec3::new(x as f32 + 1.0, y as f32, z as f32));
    assert_eq!(corners, moved);
    let boundary = with(&grid([3, 4, 5], ""), None, read_mesh).unwrap();
    assert!(boundary.is_solid());
    assert_eq!(boundary.triangles.len(), 2 * 2 * (2 * 3 + 2 * 4 + 3 * 4));
    let flat = with(&grid([3, 1, 4], ""), None, read_mesh).unwrap();
    assert_eq!((flat.triangles.len(), flat.positions.len()), (12, 12));
    // Blanked cells and points.
    let ghosts = array("type='UInt8' Name='vtkGhostType'", "32 0");
    let holed = solid.replace("<Points>", &format!("<CellData>{ghosts}</CellData><Points>"));
    assert_eq!(with(&holed, None, read_cells).unwrap().len(), 1);
    let ghosts = array("type='UInt8' Name='vtkGhostType'", "2 0 0 0 0 0 0 0 0 0 0 0");
    let holed = solid.replace("<PointData>", &format!("<PointData>{ghosts}"));
    assert_eq!(with(&holed, None, read_cells).unwrap().len(), 1);
}

#[test]
fn values_without_numbers_are_holes() {
    let of_points = array("type='Float32' Name='p'", "1 nan 3 4 5 6 -99 8");
    let text = grid(&of_points, "");
    let read = |missing| {
        let folder = Folder::new();
        let options = ReadOptions { missing, ..ReadOptions::default() };
        read_with(&folder.write("a.vtu", &text), |source| {
            Ok((read_cells(source, &options)?, read_samples(source, &options)?))
        })
        .unwrap()
    };
    let (cells, points) = read(None);
    assert!(cells.values[1].is_nan() && cells.about.holes == 1);
    assert_eq!((points.len(), points.about.holes), (7, 1));
    assert_eq!(read(Some(-99.0)).1.about.holes, 2);
    let image = lattice(
        "ImageData",
        "0 3 0 0 0 0",
        &format!("<PointData>{}</PointData>", array("type='Float32'", "nan 7 inf 5")),
    );
    let volume = with(&image, None, read_volume).unwrap();
    assert_eq!((volume.samples, volume.about.holes), (Samples::F32(vec![5., 7., 5., 5.]), 2));
}

/// The rules of the choice, and what the list of arrays says of it.
#[test]
fn the_choice_of_the_array() {
    let scalar = |name: &str, kind: &str| array(&format!("type='{kind}' Name='{name}'"), "0 1 2 3");
    let vector = |name: &str| {
        let about = format!("type='Float32' Name='{name}' NumberOfComponents='3'");
        array(&about, "3 4 0 0 0 0 0 0 1 2 0 0")
    };
    let drawn = |attributes: &str, arrays: &[&str]| {
        let data = format!("<PointData {attributes}>{}</PointData>", arrays.concat());
        let image = lattice("ImageData", "0 3 0 0 0 0", &data);
        let list = with(&image, None, super::arrays).unwrap();
        let mut drawn = list.into_iter().filter(|array| array.is_drawn);
        let name = drawn.next().map(|array| array.name).unwrap_or_default();
        assert!(drawn.next().is_none());
        name
    };
    let t = &scalar("t", "Float32");
    let v = &vector("v");
    assert_eq!(drawn("", &[v, t]), "t");
    assert_eq!(drawn("Vectors='v'", &[t, v]), "v");
    assert_eq!(drawn("Scalars='t' Vectors='v'", &[v, t]), "t");
    assert_eq!(drawn("Scalars='GlobalNodeId'", &[&scalar("GlobalNodeId", "Float32"), t]), "t");
    assert_eq!(drawn("Scalars='count'", &[&scalar("count", "Int32"), t]), "t");
    assert_eq!(drawn("Normals='n'", &[&vector("n"), v]), "v");
    assert_eq!(drawn("", &[&vector("Normals"), &scalar("vtkGhostType", "UInt8"), v]), "v");
    // Better a ramp than nothing; but never identifiers.
    assert_eq!(drawn("", &[&scalar("count", "Int32")]), "count");
    let ids = format!("<PointData>{}</PointData>", scalar("PointIds", "Int32"));
    let image = lattice("ImageData", "0 3 0 0 0 0", &ids);
    assert!(message(with(&image, None, read_volume)).contains("PointIds (i32, points)"));
    let image = lattice("ImageData", "0 3 0 0 0 0", &format!("<PointData>{t}{v}</PointData>"));
    let volume = |name| with(&image, Some(name), read_volume).unwrap();
    assert_eq!(volume("v").samples, Samples::F32(vec![5.0, 0.0, 1.0, 2.0]));
    assert_eq!(volume("v:magnitude").about.name, "v magnitude");
    assert_eq!(volume("v:y").samples, Samples::F32(vec![4.0, 0.0, 0.0, 0.0]));
    assert_eq!((volume("V:2").range, volume("point:t").range), ([0.0, 1.0], [0.0, 3.0]));
    let list = with(&image, Some("v:x"), super::arrays).unwrap();
    let of = |array: &Array| (array.components, array.place, array.range, array.is_drawn);
    assert_eq!(of(&list[0]), (1, Place::Points, Some([0.0, 3.0]), false));
    assert_eq!(of(&list[1]), (3, Place::Points, Some([0.0, 5.0]), true));
}

/// LZ4 without a frame, and LZMA in an xz stream.
#[test]
fn other_compressors() {
    let values: Vec<u8> =
        [0.5f32, 1.5, -2.0, 3.0, 4.0, 5.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let blocks: Vec<Vec<u8>> = values.chunks(16).map(lz4_flex::block::compress).collect();
    let head = [2, 16, 8, blocks[0].len(), blocks[1].len()];
    let head: Vec<u8> = head.iter().flat_map(|&count| (count as u32).to_le_bytes()).collect();
    use base64::{Engine, engine::general_purpose::STANDARD};
    let lz4 = STANDARD.encode(head) + &STANDARD.encode(blocks.concat());
    let image = |compressor: &str, text: &str| {
        let array = array("type='Float32' Name='t'", text).replace("ascii", "binary");
        lattice("ImageData", "0 5 0 0 0 0", &format!("<PointData>{array}</PointData>"))
            .replace("<VTKFile", &format!("<VTKFile compressor='vtk{compressor}DataCompressor'"))
    };
    for (compressor, text) in [("LZ4", lz4.as_str()), ("LZMA", LZMA)] {
        let volume = with(&image(compressor, text), None, read_volume).unwrap();
        assert_eq!(volume.samples, Samples::F32(vec![0.5, 1.5, -2.0, 3.0, 4.0, 5.0]));
        let other = if compressor == "LZ4" { "LZMA" } else { "LZ4" };
        message(with(&image(other, text), None, read_volume));
        for at in (0..text.len()).step_by(3) {
            let damaged = format!("{}{}{}", &text[..at], "Zz9", &text[(at + 3).min(text.len())..]);
            drop(with(&image(compressor, &damaged), None, read_volume));
        }
    }
}

/// Six floats, as Python's lzma module packs them.
const LZMA: &str = "AQAAABgAAAAAAAAAUAAAAA==/Td6WFoAAAFpIt42AgAhARYAAAB0L+Wj4AAXABVdAABoDj\
    /KBNJrLwQCzWwiVAr8XdwAAAAAAAB6fTkbAAEtGJJ3wBOQQpkNAQAAAAABWVo=";

/// Pieces in other files, without the cells that several have.
#[test]
fn parallel_files_and_collections() {
    let folder = Folder::new();
    let image = |extent: &str, values: &str| {
        let data = array("type='Int32' Name='s'", values);
        lattice("ImageData", extent, &format!("<PointData Scalars='s'>{data}</PointData>"))
    };
    folder.write("p0.vti", image("0 1 0 1 0 0", "0 1 3 4"));
    folder.write("p1.vti", image("1 2 0 1 0 0", "1 2 4 9"));
    let pieces = "<Piece Extent='0 1 0 1 0 0' Source='p0.vti'/><Piece Extent='1 2 0 1 0 0' \
                  Source='p1.vti'/>";
    let whole = file("PImageData", "WholeExtent='0 2 0 1 0 0'", pieces);
    let none = ReadOptions::default();
    let path = folder.write("a.pvti", whole);
    let volume = read_with(&path, |source| read_volume(source, &none)).unwrap();
    assert_eq!(volume.samples, Samples::I32(vec![0, 1, 2, 3, 4, 9]));
    // The square is a ghost in the second piece; the copied points of the tetrahedron are one.
    let value = array("type='Float32' Name='p'", "1 2 3 4 5 6 7 8");
    let ghost = array("type='UInt8' Name='vtkGhostType'", "0 1");
    folder.write("u0.vtu", grid(&value, ""));
    folder.write("u1.vtu", grid(&value, &ghost));
    let pieces = "<Piece Source='u0.vtu'/><Piece Source='u1.vtu'/>";
    let path = folder.write("a.pvtu", file("PUnstructuredGrid", "GhostLevel='1'", pieces));
    let cells = read_with(&path, |source| read_cells(source, &none)).unwrap();
    assert_eq!((cells.len(), cells.points.len()), (2, 8));
    // A collection of blocks within blocks.
    let blocks = "<Block index='0'><DataSet index='0' name='grid' file='a.pvtu'/></Block>\
                  <Block index='1'><Block index='0'><DataSet index='0' file='p0.vti'/></Block>\
                  <DataSet index='2'/></Block>";
    let path = folder.write("a.vtm", file("vtkMultiBlockDataSet", "version='1.0'", blocks));
    let options = ReadOptions::scalar(Some("p"));
    let cells = read_with(&path, |source| read_cells(source, &options)).unwrap();
    assert_eq!(cells.len(), 2);
    // Times.
    let times = "<DataSet timestep='0.5' file='p0.vti'/><DataSet timestep='1' file='p1.vti'/>";
    let path = folder.write("a.pvd", file("Collection", "", times));
    let at = |time| {
        let options = ReadOptions { time: Some(time), ..ReadOptions::default() };
        read_with(&path, |source| read_volume(source, &options))
    };
    assert_eq!((at(0).unwrap().range, at(1).unwrap().range), ([0.0, 4.0], [1.0, 9.0]));
    assert!(message(at(2)).contains("has 2 times, but number 2"));
    // References stay in the folder, and are not followed for ever.
    for (reference, word) in
        [("../a.vti", "leads out"), ("none.vti", "No such"), ("b.vtm", "itself")]
    {
        let blocks = format!("<DataSet index='0' file='{reference}'/>");
        let path = folder.write("b.vtm", file("vtkMultiBlockDataSet", "", &blocks));
        let message = message(read_with(&path, |source| read_mesh(source, &none)));
        assert!(message.contains(word), "{message}");
    }
    let refer = |to: &str| file("vtkMultiBlockDataSet", "", &format!("<DataSet file='{to}'/>"));
    folder.write("d.vtm", refer("c.vtm"));
    let path = folder.write("c.vtm", refer("d.vtm"));
    let message = message(read_with(&path, |source| read_mesh(source, &none)));
    assert!(message.contains("more than 4 files"), "{message}");
}

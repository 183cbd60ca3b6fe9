//! Data sets of VTKHDF that the crate's own writer makes.

use super::*;
use crate::{
    cells::{CellKind, Place as CellPlace},
    formats::{Kind, read_cells, read_mesh, read_volume},
    input::testing::*,
};
use glam::{DVec3, Vec3};
use hdf5_pure::{AttrValue, FileBuilder};

/// A file of image data: 3 × 2 × 1 points.
fn image(kind: &str) -> Vec<u8> {
    let mut file = FileBuilder::new();
    let mut root = file.create_group("VTKHDF");
    root.set_attr("Type", AttrValue::AsciiString(kind.into()));
    root.set_attr("WholeExtent", AttrValue::I64Array(vec![1, 3, 0, 1, 0, 0]));
    root.set_attr("Origin", AttrValue::F64Array(vec![1.0, 2.0, 3.0]));
    root.set_attr("Spacing", AttrValue::F64Array(vec![0.5, 1.0, 2.0]));
    let mut points = root.create_group("PointData");
    points.create_dataset("ids").with_i32_data(&[0, 1, 2, 3, 4, 5]).with_shape(&[1, 2, 3]);
    points.create_dataset("ct").with_f32_data(&[9., 8., 7., 6., 5., 4.]).with_shape(&[1, 2, 3]);
    points.create_dataset("flow").with_u8_data(&[3, 4].repeat(6)).with_shape(&[1, 2, 3, 2]);
    root.add_group(points.finish());
    let mut cells = root.create_group("CellData");
    cells.create_dataset("q").with_u8_data(&[1, 2]).with_shape(&[1, 1, 2]);
    root.add_group(cells.finish());
    file.add_group(root.finish());
    file.finish().unwrap()
}

/// A file of points and cells: the corners of a tetrahedron in two parts.
fn grid(kind: &str, group: Option<&str>) -> Vec<u8> {
    let mut file = FileBuilder::new();
    let mut root = file.create_group("VTKHDF");
    root.set_attr("Type", AttrValue::AsciiString(kind.into()));
    let corners = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
    let points: Vec<f64> = [corners, corners.map(|v| v + 5.0)].concat();
    root.create_dataset("Points").with_f64_data(&points).with_shape(&[8, 3]);
    root.create_dataset("NumberOfPoints").with_i64_data(&[4, 4]).with_shape(&[2]);
    root.create_dataset("Types").with_u8_data(&[10, 5, 10]).with_shape(&[3]);
    let mut topology = root.create_group(group.unwrap_or("unused"));
    let target = if group.is_some() { &mut topology } else { &mut root };
    let nodes = [0, 1, 2, 3, 0, 1, 2, 0, 1, 2, 3];
    target.create_dataset("Connectivity").with_i64_data(&nodes).with_shape(&[11]);
    target.create_dataset("Offsets").with_i64_data(&[0, 4, 7, 0, 4]).with_shape(&[5]);
    target.create_dataset("NumberOfCells").with_i64_data(&[2, 1]).with_shape(&[2]);
    target.create_dataset("NumberOfConnectivityIds").with_i64_data(&[7, 4]).with_shape(&[2]);
    root.add_group(topology.finish());
    let mut data = root.create_group("PointData");
    data.create_dataset("t").with_f64_data(&[1., 2., 3., 4., 5., 6., 7., 80.]).with_shape(&[8]);
    root.add_group(data.finish());
    let mut data = root.create_group("CellData");
    data.create_dataset("q").with_f64_data(&[1.5, 9.0, f64::NAN]).with_shape(&[3]);
    root.add_group(data.finish());
    file.add_group(root.finish());
    file.finish().unwrap()
}

fn with<T>(bytes: &[u8], read: impl Fn(&Source) -> Result<T>) -> Result<T> {
    let folder = Folder::new();
    read_with(&folder.write("a.vtkhdf", bytes), read)
}

#[test]
fn image_data_are_volumes() {
    let bytes = image("ImageData");
    let load = |name: Option<&str>| {
        with(&bytes, |source| {
            assert_eq!(Kind::of_source(source, &ReadOptions::default())?, Some(Kind::Volume));
            read_volume(source, &ReadOptions::scalar(name))
        })
    };
    // Identifiers are not drawn by themselves.
    let volume = load(None).unwrap();
    assert_eq!((volume.lattice.dims, volume.range), ([3, 2, 1], [4.0, 9.0]));
    assert_eq!(volume.lattice.spacing(), DVec3::new(0.5, 1.0, 2.0));
    assert_eq!(volume.lattice.origin, DVec3::new(1.5, 2.0, 3.0));
    assert_eq!(volume.about.name, "ct");
    assert_eq!(load(Some("flow")).unwrap().range, [5.0, 5.0]);
    assert_eq!(load(Some("flow:y")).unwrap().range, [4.0, 4.0]);
    let cells = load(Some("cell:q")).unwrap();
    assert_eq!((cells.lattice.dims, cells.range), ([2, 1, 1], [1.0, 2.0]));
    assert_eq!(cells.lattice.origin, DVec3::new(1.75, 2.5, 3.0));
    let error = load(Some("pressure")).unwrap_err().to_string();
    assert!(error.contains("has no array “pressure”"), "{error}");
    let list = with(&bytes, |source| arrays(source, &ReadOptions::default())).unwrap();
    let drawn: Vec<_> = list.iter().filter(|array| array.is_drawn).collect();
    assert_eq!((list.len(), drawn.len(), &drawn[0].name[..]), (4, 1, "ct"));
    let other =
        with(&image("OverlappingAMR"), |source| read_volume(source, &ReadOptions::default()));
    let error = other.unwrap_err().to_string();
    assert!(error.contains("“OverlappingAMR”, but ImageData"), "{error}");
}

#[test]
fn unstructured_grids_are_cells() {
    let bytes = grid("UnstructuredGrid", None);
    let load =
        |name: Option<&str>| with(&bytes, |source| read_cells(source, &ReadOptions::scalar(name)));
    // The triangle is left out.
    let cells = load(None).unwrap();
    assert_eq!(cells.kinds, [CellKind::Tetrahedron; 2]);
    assert_eq!(cells.nodes, [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!((cells.range(), cells.place), ([1.0, 80.0], CellPlace::Points));
    let cells = load(Some("cell:q")).unwrap();
    assert_eq!((cells.values[0], cells.place, cells.about.holes), (1.5, CellPlace::Cells, 1));
    let kind = with(&bytes, |source| Kind::of_source(source, &ReadOptions::default()));
    assert_eq!(kind.unwrap(), Some(Kind::Cells));
    let folder = Folder::new();
    for end in (0..bytes.len()).step_by(11) {
        let path = folder.write("a.vtkhdf", &bytes[..end]);
        let load = read_with(&path, |source| read_cells(source, &ReadOptions::default()));
        assert!(load.is_err() || end + 64 > bytes.len(), "cut at {end} of {}", bytes.len());
    }
}

#[test]
fn polygons_are_surfaces() {
    let bytes = grid("PolyData", Some("Polygons"));
    let mesh = with(&bytes, |source| read_mesh(source, &ReadOptions::default())).unwrap();
    // Two quadrilaterals and a triangle.
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (8, 5));
    assert_eq!(mesh.positions[5], Vec3::new(6.0, 5.0, 5.0));
    assert_eq!((mesh.values[7], &mesh.about.name[..]), (80.0, "t"));
    let named = with(&bytes, |source| read_mesh(source, &ReadOptions::scalar(Some("cell:q"))));
    assert!(named.unwrap_err().to_string().contains("does not colour a surface"));
}

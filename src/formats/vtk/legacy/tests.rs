//! Legacy files as VTK writes them, and ways to write them wrong.

use super::super::{
    super::{Array, Kind, ReadOptions},
    arrays, kind, read_cells, read_mesh, read_samples, read_volume,
};
use crate::{
    Error, Result,
    cells::{self, CellKind},
    input::testing::*,
    math::Bounds,
    scattered::Points,
    surface::Mesh,
    volume::{Samples, Volume},
};
use glam::{DVec3, Vec3};

/// A file in text or binary. Each entry of the body is a line, the type of the numbers after it,
/// and the numbers.
fn file(binary: bool, body: &[(&str, &str, &str)]) -> Vec<u8> {
    let encoding = if binary { "BINARY" } else { "ASCII" };
    let mut file =
        format!("# vtk DataFile Version 3.0\nmade for a test\n{encoding}\n").into_bytes();
    for (line, kind, numbers) in body {
        file.extend(format!("{line}\n").bytes());
        if !binary {
            file.extend(numbers.bytes());
        }
        for word in numbers.split_whitespace().filter(|_| binary) {
            let number: f64 = word.parse().unwrap();
            match *kind {
                "uchar" => file.push(number as u8),
                "int" => file.extend((number as i32).to_be_bytes()),
                "long" => file.extend((number as i64).to_be_bytes()),
                "float" => file.extend((number as f32).to_be_bytes()),
                _ => file.extend(number.to_be_bytes()),
            }
        }
        if !numbers.is_empty() {
            file.push(b'\n');
        }
    }
    file
}

fn volume(content: &[u8]) -> Result<Volume> {
    let folder = Folder::new();
    read_with(&folder.write("a.vtk", content), |source| {
        read_volume(source, &ReadOptions::default())
    })
}

/// Reads with an array by name.
fn with<T>(
    content: &[u8],
    scalar: Option<&str>,
    read: fn(&crate::input::Source, &ReadOptions) -> Result<T>,
) -> Result<T> {
    let folder = Folder::new();
    let options = ReadOptions::scalar(scalar);
    read_with(&folder.write("a.vtk", content), |source| read(source, &options))
}

fn samples(content: &[u8], scalar: Option<&str>) -> Result<Points> {
    let folder = Folder::new();
    read_with(&folder.write("a.vtk", content), |source| {
        read_samples(source, &ReadOptions::scalar(scalar))
    })
}

const IMAGE: &[(&str, &str, &str)] = &[
    (
        "DATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 1\nORIGIN 10 20 30\nSPACING 0.5 1 2\nPOINT_DATA \
         6",
        "",
        "",
    ),
    ("VECTORS v float", "float", "1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18"),
    ("SCALARS density unsigned_char 1\nLOOKUP_TABLE default", "uchar", "0 1 2 30 4 255"),
];

#[test]
fn structured_points() {
    for binary in [false, true] {
        let whole = file(binary, IMAGE);
        let loaded = volume(&whole).unwrap();
        assert_eq!(loaded.samples, Samples::U8(vec![0, 1, 2, 30, 4, 255]));
        let (min, max) = (DVec3::new(10.0, 20.0, 30.0), DVec3::new(11.0, 21.0, 30.0));
        assert_eq!(loaded.bounds(), Bounds { min, max });
        // Without the line end after the last number, the file is still whole. A text without its
        // last digits has a shorter number.
        for end in 0..whole.len() - if binary { 1 } else { 3 } {
            // Behind the vectors, the file may end.
            let is_shorter = volume(&whole[..end]).is_ok_and(|it| it.about.name != "v magnitude");
            assert!(!is_shorter, "cut at {end}");
        }
        let read = |binary| samples(&file(binary, IMAGE), None).unwrap_err().to_string();
        assert!(read(binary).contains("a volume"));
    }
}

#[test]
fn rectilinear_grids() {
    for binary in [false, true] {
        let grid = file(
            binary,
            &[
                ("DATASET RECTILINEAR_GRID\nDIMENSIONS 3 2 1", "", ""),
                ("X_COORDINATES 3 double", "double", "0 1 5"),
                ("Y_COORDINATES 2 float", "float", "-1 1"),
                ("Z_COORDINATES 1 float", "float", "7"),
                ("POINT_DATA 6\nFIELD FieldData 1\nmy%20field 1 6 float", "float", "0 1 2 3 4 5.5"),
            ],
        );
        let loaded = volume(&grid).unwrap();
        assert_eq!((loaded.range, loaded.lattice.dims), ([0.0, 5.5], [3, 2, 1]));
        assert_eq!(loaded.lattice.sample_position(5), DVec3::new(5.0, 1.0, 7.0));
    }
}

/// A tetrahedron and a square.
const POINTS: (&str, &str, &str) =
    ("POINTS 8 float", "float", "0 0 0 2 0 0 0 2 0 0 0 2  5 0 0 7 0 0 7 2 0 5 2 0");
const DATA: [(&str, &str, &str); 2] = [
    ("CELL_DATA 2\nSCALARS c int\nLOOKUP_TABLE default", "int", "10 -20"),
    ("POINT_DATA 8\nSCALARS p double 1\nLOOKUP_TABLE default", "double", "1 2 3 4 5 6 7 8"),
];

#[test]
fn unstructured_grids_of_both_versions() {
    let old = [
        ("DATASET UNSTRUCTURED_GRID", "", ""),
        POINTS,
        ("CELLS 2 10", "int", "4 0 1 2 3 4 4 5 6 7"),
        ("CELL_TYPES 2", "int", "10 9"),
        DATA[0],
        DATA[1],
    ];
    let new = [
        ("DATASET UNSTRUCTURED_GRID", "", ""),
        POINTS,
        ("METADATA\nINFORMATION 0\n\nCELLS 3 8\nOFFSETS vtktypeint64", "long", "0 4 8"),
        ("CONNECTIVITY vtktypeint64", "long", "0 1 2 3 4 5 6 7"),
        ("CELL_TYPES 2", "int", "10 9"),
        DATA[0],
        DATA[1],
    ];
    for body in [&old[..], &new[..]] {
        for binary in [false, true] {
            let content = file(binary, body);
            let points = samples(&content, None).unwrap();
            assert_eq!(
                (points.len(), points.positions[6], points.values[6]),
                (8, Vec3::new(7.0, 2.0, 0.0), 7.0)
            );
            let cells = samples(&content, Some("c")).unwrap();
            assert_eq!(cells.positions, [Vec3::splat(0.5), Vec3::new(6.0, 1.0, 0.0)]);
            assert_eq!(
                (cells.values, cells.radii),
                (vec![10.0, -20.0], vec![1.4 * 1.5, 1.4 * 2f32.sqrt()])
            );
            let message = samples(&content, Some("none")).unwrap_err().to_string();
            assert!(message.contains("no array “none”"), "{message}");
            let solid = with(&content, None, read_cells).unwrap();
            assert_eq!((&solid.kinds, solid.points.len()), (&vec![CellKind::Tetrahedron], 8));
            // The square lies beside the cells.
            let values: Vec<f32> = (1..=8).map(|value| value as f32).collect();
            assert_eq!((solid.values, solid.about.name), (values, "p".into()));
            assert_eq!(with(&content, Some("c"), kind).unwrap(), Kind::Cells);
            let solid = with(&content, Some("cell:c"), read_cells).unwrap();
            assert_eq!((solid.place, solid.values), (cells::Place::Cells, vec![10.0]));
            assert!(volume(&content).unwrap_err().to_string().contains("not a volume"));
            for end in 0..content.len() {
                // Whole parts may be missing at the end. Nothing panics, and data that are read are
                // valid.
                if let Ok(points) = samples(&content[..end], None) {
                    points.validate().unwrap();
                }
            }
        }
    }
}

#[test]
fn polygons_and_structured_grids() {
    let polygons = file(
        false,
        &[
            ("DATASET POLYDATA", "", ""),
            POINTS,
            ("VERTICES 1 2", "int", "1 0"),
            ("POLYGONS 1 4", "int", "3 4 5 6"),
            DATA[0],
        ],
    );
    let points = samples(&polygons, None).unwrap();
    assert_eq!((points.positions[0], points.values), (Vec3::ZERO, vec![10.0, -20.0]));
    assert!(points.radii.is_empty(), "a vertex has no size");
    let grid =
        file(true, &[("DATASET STRUCTURED_GRID\nDIMENSIONS 2 2 2", "", ""), POINTS, DATA[1]]);
    assert_eq!(samples(&grid, None).unwrap().values[7], 8.0);
}

#[test]
fn what_is_wrong_is_told() {
    let image = |from: &str, to: &str| {
        let text = String::from_utf8(file(false, IMAGE)).unwrap();
        assert!(text.contains(from), "{from}");
        volume(text.replace(from, to).as_bytes()).unwrap_err()
    };
    for (from, to, word) in [
        ("# vtk", "# VTK", "does not begin"),
        ("ASCII", "EBCDIC", "neither ASCII nor BINARY"),
        ("STRUCTURED_POINTS", "HYPER_TREE_GRID", "not supported"),
        ("DATASET", "DATABASE", "was expected"),
        ("DIMENSIONS 3 2 1", "DIMENSIONS 3 2", "needs 3 numbers"),
        ("DIMENSIONS 3 2 1", "DIMENSIONS 3 2 2", "claims 6 points, but the data set has 12"),
        ("SPACING 0.5", "SPACING 0", "spacing"),
        ("SCALARS", "SCALES", "“SCALES” is not a known keyword"),
        ("30 4", "300 4", "300"),
        ("4 255", "4", "5 numbers where 6"),
        ("POINT_DATA 6", "POINT_DATA six", "“six” is not a count"),
        ("POINT_DATA 6", "", "before POINT_DATA"),
    ] {
        let message = image(from, to).to_string();
        assert!(message.contains(word), "{from}: {message}");
    }
    assert!(matches!(image("POINT_DATA 6", "POINT_DATA 99999999999"), Error::Limit { .. }));
    assert!(image("POINT_DATA 6", "POINT_DATA 2000000000").to_string().contains("the file ends"));
    let cells = |cells: &'static str| {
        let start = ("DATASET UNSTRUCTURED_GRID", "", "");
        let types = ("CELL_TYPES 1", "int", "5");
        let file = file(true, &[start, POINTS, ("CELLS 1 4", "int", cells), types]);
        assert!(samples(&file, None).is_err());
        with(&file, None, read_mesh).unwrap_err().to_string()
    };
    assert!(cells("4 0 1 2").contains("more corners than are listed"));
    assert!(cells("3 0 1 8").contains("point 8"));
}

/// Bits and strings are skipped, in text and binary; the arrays after them are read.
#[test]
fn arrays_that_are_not_numbers_are_skipped() {
    let head = "DATASET POLYDATA\nPOINTS 3 float";
    let text = format!(
        "# vtk DataFile Version 4.0\nt\nASCII\n{head}\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 2\n\
         POINT_DATA 3\nSCALARS b bit\nLOOKUP_TABLE default\n1 0 1\nFIELD FieldData 2\n\
         s 1 3 string\none\ntwo%20words\n\nv 3 3 float\n3 4 0 0 0 1 0 0 2\n\
         CELL_DATA 1\nCOLOR_SCALARS rgb 3\n1 0.5 0\n"
    );
    let mut bytes = format!("# vtk DataFile Version 4.0\nt\nBINARY\n{head}\n").into_bytes();
    let floats = |values: &[f32]| -> Vec<u8> {
        values.iter().flat_map(|value| value.to_be_bytes()).chain(*b"\n").collect()
    };
    bytes.extend(floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
    bytes.extend(b"POLYGONS 1 4\n");
    bytes.extend([3i32, 0, 1, 2].iter().flat_map(|value| value.to_be_bytes()));
    bytes.extend(b"\nPOINT_DATA 3\nSCALARS b bit\nLOOKUP_TABLE default\n\xa0\n");
    bytes.extend(b"FIELD FieldData 2\ns 1 3 string\n\xc3one\x80\x09two words\xc0\n");
    bytes.extend(b"v 3 3 float\n");
    bytes.extend(floats(&[3.0, 4.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0]));
    bytes.extend(b"CELL_DATA 1\nCOLOR_SCALARS rgb 3\n\xff\x80\x00\n");
    for content in [text.as_bytes(), &bytes] {
        let names = |arrays: Vec<Array>| -> Vec<(String, String, bool)> {
            arrays.into_iter().map(|array| (array.name, array.kind, array.is_drawn)).collect()
        };
        let listed = names(with(content, Some("v"), arrays).unwrap());
        let row = |name: &str, kind: &str, drawn| (name.to_owned(), kind.to_owned(), drawn);
        let rows = [
            row("b", "bit", false),
            row("s", "string", false),
            row("v", "f32", true),
            row("rgb", "u8", false),
        ];
        assert_eq!(listed, rows);
        assert_eq!(with(content, Some("v"), read_mesh).unwrap().values, [5.0, 1.0, 2.0]);
        let mesh: Mesh = with(content, None, read_mesh).unwrap();
        assert_eq!((mesh.colors, mesh.values.len()), (vec![[255, 128, 0, 255]; 3], 0));
        let error = with(content, Some("s"), read_mesh).unwrap_err();
        assert!(matches!(error, Error::Input { .. }) && error.to_string().contains("not numbers"));
    }
}

/// A text is a stream of words: line breaks do not matter, nor does their lack.
#[test]
fn a_text_is_a_stream_of_words() {
    let text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA POINTS 3 float 0 0 0\n1 0\n\
                0 0 1 0 POLYGONS 1\n4 3 0 1 2 POINT_DATA 3 FIELD f 1 v 1 3\nfloat 5 6 7 \
                CELL_DATA 1 NORMALS n float 0 0 1\n";
    let mesh = with(text.as_bytes(), Some("v"), read_mesh).unwrap();
    assert_eq!((mesh.positions.len(), mesh.triangles), (3, vec![[0, 1, 2]]));
    assert_eq!(mesh.values, [5.0, 6.0, 7.0]);
}

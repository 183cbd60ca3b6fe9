//! Legacy files as VTK writes them, and ways to write them wrong.

use super::*;
use crate::{input::testing::*, volume::Samples};
use glam::Vec3;

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
        let found = volume(&whole).unwrap();
        assert_eq!(found.samples, Samples::U8(vec![0, 1, 2, 30, 4, 255]));
        assert_eq!(found.bounds(), [DVec3::new(10.0, 20.0, 30.0), DVec3::new(11.0, 21.0, 30.0)]);
        // Without the line end after the last number, the file is still whole. A text without its
        // last digits has a shorter number.
        for end in 0..whole.len() - if binary { 1 } else { 3 } {
            assert!(volume(&whole[..end]).is_err(), "cut at {end}");
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
        let found = volume(&grid).unwrap();
        assert_eq!((found.range, found.lattice.dims), ([0.0, 5.5], [3, 2, 1]));
        assert_eq!(found.lattice.sample_position(5), DVec3::new(5.0, 1.0, 7.0));
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
            assert!(
                samples(&content, Some("none"))
                    .unwrap_err()
                    .to_string()
                    .contains("no scalar “none”")
            );
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
        ("DIMENSIONS 3 2 1", "DIMENSIONS 3 2", "three numbers"),
        ("DIMENSIONS 3 2 1", "DIMENSIONS 3 2 2", "claims 6 points, but the data set has 12"),
        ("SPACING 0.5", "SPACING 0", "spacing"),
        ("unsigned_char", "bit", "type bit"),
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
        samples(
            &file(
                true,
                &[("DATASET UNSTRUCTURED_GRID", "", ""), POINTS, ("CELLS 1 4", "int", cells)],
            ),
            None,
        )
        .unwrap_err()
        .to_string()
    };
    assert!(cells("4 0 1 2").contains("more corners than are listed"));
    assert!(cells("3 0 1 8").contains("point 8"));
    assert!(cells("3 0 1 2").contains("has no scalar"));
}

use super::*;
use crate::{
    Error,
    io::{Limits, testing::Folder},
};

fn load(bytes: impl AsRef<[u8]>) -> Result<Mesh> {
    load_within(bytes, &Limits::default())
}

fn load_within(bytes: impl AsRef<[u8]>, limits: &Limits) -> Result<Mesh> {
    let folder = Folder::new();
    let path = folder.write("a.ply", bytes);
    read(&Source::open(&path, limits)?)
}

const POINTS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [1.0, 1.0, 0.25], [0.0, 1.0, -2.0]];

fn check(mesh: &Mesh) {
    assert_eq!(mesh.positions, POINTS.map(|p| Vec3::new(p[0] as f32, p[1] as f32, p[2] as f32)));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

/// A number as bytes of a PLY type.
fn put(out: &mut Vec<u8>, kind: &str, value: f64, big: bool) {
    macro_rules! put {
        ($t:ty) => {{
            let value = value as $t;
            out.extend(if big { value.to_be_bytes() } else { value.to_le_bytes() });
        }};
    }
    match kind {
        "char" | "int8" => put!(i8),
        "uchar" | "uint8" => put!(u8),
        "short" | "int16" => put!(i16),
        "ushort" | "uint16" => put!(u16),
        "int" | "int32" => put!(i32),
        "uint" | "uint32" => put!(u32),
        "float" | "float32" => put!(f32),
        "double" | "float64" => put!(f64),
        other => panic!("{other}"),
    }
}

/// A square of one quad (or two triangles) with everything around it that a reader may meet.
fn square(format: &str, real: &str, count: &str, index: &str, quad: bool, extras: bool) -> Vec<u8> {
    let mut head = format!("ply\r\nformat {format} 1.0\r\ncomment a test\r\n");
    if extras {
        head += "obj_info x 1\r\nelement first 2\r\nproperty list uchar float weights\r\nproperty int n\r\n";
    }
    head += "element vertex 4\r\n";
    if extras {
        head += "property short scalar.x\r\n";
    }
    head += &format!("property {real} z\r\nproperty {real} x\r\nproperty {real} y\r\nproperty uchar red\r\n");
    head += "property uchar green\r\nproperty uchar blue\r\n";
    let faces: &[&[u32]] = if quad { &[&[0, 1, 2, 3]] } else { &[&[0, 1, 2], &[0, 2, 3]] };
    head += &format!("element face {}\r\n", faces.len());
    if extras {
        head += "property float quality\r\n";
    }
    head += &format!("property list {count} {index} vertex_indices\r\nend_header\r\n");
    let mut rows: Vec<Vec<(&str, f64)>> = Vec::new();
    if extras {
        rows.push(vec![("uchar", 2.0), ("float", 1.0), ("float", 2.0), ("int", -1.0)]);
        rows.push(vec![("uchar", 0.0), ("int", 3.0)]);
    }
    for (i, p) in POINTS.iter().enumerate() {
        let mut row = vec![(real, p[2]), (real, p[0]), (real, p[1])];
        row.extend([("uchar", 10.0 * i as f64), ("uchar", 20.0), ("uchar", 255.0)]);
        if extras {
            row.insert(0, ("short", -7.0));
        }
        rows.push(row);
    }
    for face in faces {
        let mut row = vec![(count, face.len() as f64)];
        row.extend(face.iter().map(|&v| (index, f64::from(v))));
        if extras {
            row.insert(0, ("float", 0.5));
        }
        rows.push(row);
    }
    let mut out = head.into_bytes();
    for row in rows {
        for &(kind, value) in &row {
            match format {
                "ascii" => out.extend(format!("{value} ").bytes()),
                _ => put(&mut out, kind, value, format == "binary_big_endian"),
            }
        }
        if format == "ascii" {
            out.extend(b"\r\n");
        }
    }
    out
}

#[test]
fn every_format_and_type() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (real, count, index) in [
            ("float", "uchar", "int"),
            ("double", "uchar", "uint"),
            ("float32", "int32", "short"),
            ("float64", "ushort", "uchar"),
            ("float", "char", "uint16"),
            ("double", "uint8", "int8"),
            ("float", "short", "float"),
        ] {
            for (quad, extras) in [(false, false), (true, false), (false, true), (true, true)] {
                let mesh = load(square(format, real, count, index, quad, extras))
                    .unwrap_or_else(|e| panic!("{format} {real} {count} {index} {quad} {extras}: {e}"));
                check(&mesh);
                assert_eq!(mesh.colors[2], [20, 20, 255, 255]);
            }
        }
    }
}

#[test]
fn a_cut_file_is_an_error_wherever_it_is_cut() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (quad, extras) in [(false, false), (true, true)] {
            let whole = square(format, "float", "uchar", "int", quad, extras);
            // Text may lose its line end, and the last number is of one digit.
            let least = if format == "ascii" { whole.trim_ascii_end().len() } else { whole.len() };
            for length in 0..least {
                assert!(load(&whole[..length]).is_err(), "{format}: {length} of {} bytes", whole.len());
            }
            check(&load(&whole[..least]).expect("whole"));
        }
    }
}

#[test]
fn text_as_real_files_have_it() {
    let file = b"ply\nformat ascii 1.0\ncomment caf\xe9\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nproperty float confidence\nelement empty 40000000000\nelement face 1\n\
        property list uchar int vertex_index\nend_header\n\n0 0 0 nan\n\n1 0 0 -inf\n \t\n0 1 0 1e3\n\n3 0 1 2";
    let mesh = load(file).expect("loads");
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3, 1));
}

#[test]
fn normals_colors_and_uvs() {
    let file = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float diffuse_red\n\
        property float diffuse_green\nproperty float diffuse_blue\nproperty float alpha\n\
        property float s\nproperty float t\nend_header\n\
        0 0 0 0 0 2 1 0.5 0 0.2 0.25 0.25\n1 0 0 nan 0 0 2 -1 nan 1 0 0\n0 1 0 0 0 0 0 0 0 0 1 1\n";
    let mesh = load(file).expect("loads");
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::ZERO, Vec3::ZERO]);
    assert_eq!(mesh.colors, [[255, 128, 0, 51], [255, 0, 0, 255], [0, 0, 0, 0]]);
    assert_eq!(mesh.uvs, [Vec2::new(0.25, 0.75), Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0)]);
    let short = file.replace("float diffuse_", "ushort diffuse_").replace(" 1 0.5 0 0.2 ", " 65535 32896 0 1 ");
    assert_eq!(load(short.replace("2 -1 nan", "0 0 0")).expect("loads").colors[0], [255, 128, 0, 255]);
}

#[test]
fn large_coordinates_keep_their_precision() {
    let mut file = b"ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty double x\nproperty double y\n\
        property double z\nend_header\n"
        .to_vec();
    let points = [[4_500_000.125, 5_600_000.25, 100.0], [4_500_001.375, 5_600_002.5, 101.0]];
    points.iter().flatten().for_each(|&v| put(&mut file, "double", v, false));
    let mesh = load(file).expect("loads");
    for (own, point) in mesh.positions.iter().zip(points) {
        assert_eq!(mesh.origin + own.as_dvec3(), DVec3::from_array(point));
    }
    assert_eq!(mesh.origin, mesh.origin.round());
}

#[test]
fn strips_become_triangles() {
    let file = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n8 0 1 2 3 -1 2 3 4\n";
    assert_eq!(load(file).expect("loads").triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    load(bytes).expect_err("an error").to_string()
}

#[test]
fn counts_that_lie_and_broken_numbers() {
    let file = |format: &str, count: &str, body: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
            element face 1\nproperty list uchar int vertex_indices\nend_header\n{body}"
        )
    };
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    load(file("ascii", "3", body)).expect("loads");
    for count in ["0", "2", "4", "4294967296", "18446744073709551615", "18446744073709551616", "-1", "x"] {
        for format in ["ascii", "binary_little_endian"] {
            load(file(format, count, body)).expect_err(count);
        }
    }
    assert!(message(file("ascii", "3", &body.replace("1 0 0", "1 nan 0"))).contains("element “vertex”, row 1"));
    assert!(message(file("ascii", "3", &body.replace("1 0 0", "1 0,5 0"))).contains("“0,5” is not a number"));
    assert!(message(file("ascii", "3", &body.replace("3 0 1 2", "3 0 1 3"))).contains("vertex 3"));
    assert!(message(file("ascii", "3", &body.replace("3 0 1 2", "3 0 1 -1"))).contains("vertex -1"));
    assert!(message(file("ascii", "3", &body.replace("3 0 1 2", "-1 0"))).contains("impossible length"));
    assert!(message(file("ascii", "3", &body.replace("3 0 1 2", "1e300 0 1 2"))).contains("the line ends"));
    assert!(message(file("ascii", "3", &body.replace("3 0 1 2", "3 0 1 2 7"))).contains("more values"));
    assert!(message("ply\nformat ascii 1.0\nelement vertex 2000000000\nend_header\n").contains("no scalar property"));
    assert!(message("").contains("end_header"));
    assert!(message("ply\nproperty float x\nend_header\n").contains("before any element"));
    let limits = Limits { points: 2, ..Limits::default() };
    assert!(matches!(load_within(file("ascii", "3", body), &limits), Err(Error::Limit { found: 3, .. })));
}

#[test]
fn a_list_longer_than_the_file_in_binary() {
    for (count, index) in [("uint", "double"), ("double", "uchar"), ("int", "int")] {
        let whole = square("binary_little_endian", "float", count, index, true, false);
        let at = whole.len() - (put_len(count) + 4 * put_len(index));
        for length in [4_294_967_295.0, -1.0, 5.0, 1e300] {
            if count == "uint" && length < 0.0 {
                continue;
            }
            let mut file = whole[..at].to_vec();
            put(&mut file, count, length, false);
            file.extend(&whole[at + put_len(count)..]);
            load(file).expect_err("a list that is too long");
        }
    }
}

fn put_len(kind: &str) -> usize {
    let mut out = Vec::new();
    put(&mut out, kind, 0.0, false);
    out.len()
}

use super::*;
use crate::{
    Error,
    formats::{Stream, StreamPoint},
    input::{Limits, testing::Folder},
};
use std::path::Path;

fn load(bytes: impl AsRef<[u8]>) -> Result<Mesh> {
    load_within(bytes, &Limits::default())
}

fn load_within(bytes: impl AsRef<[u8]>, limits: &Limits) -> Result<Mesh> {
    let folder = Folder::new();
    let path = folder.write("a.ply", bytes);
    read(&Source::open(&path, limits)?, &ReadOptions::default())
}

#[test]
fn the_header_is_parsed_once() {
    let text = b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float \
                 y\nproperty float z\nend_header\n1 2 3\n";
    let limits = Limits::default();
    let source = Source::from_bytes(Path::new("a.ply"), text, &limits).unwrap();
    let first = header::read(&source).unwrap();
    let kind = crate::formats::Kind::of_source(&source, &ReadOptions::default()).unwrap();
    assert_eq!(kind, Some(crate::formats::Kind::Mesh));
    assert_eq!(read(&source, &ReadOptions::default()).unwrap().positions.len(), 1);
    assert!(std::sync::Arc::ptr_eq(&first, &header::read(&source).unwrap()));
}

const POINTS: [[f64; 3]; 4] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [1.0, 1.0, 0.25], [0.0, 1.0, -2.0]];

fn check(mesh: &Mesh) {
    assert_eq!(mesh.positions, POINTS.map(|p| Vec3::new(p[0] as f32, p[1] as f32, p[2] as f32)));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

/// Appends a number as bytes of a PLY type.
pub fn put(out: &mut Vec<u8>, kind: &str, value: f64, big: bool) {
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

/// A square of one quad (or two triangles) with every extra that a reader may meet.
fn square(format: &str, real: &str, count: &str, index: &str, quad: bool, extras: bool) -> Vec<u8> {
    let mut head = format!("ply\r\nformat {format} 1.0\r\ncomment a test\r\n");
    if extras {
        head += "obj_info x 1\r\nelement first 2\r\nproperty list uchar float weights\r\nproperty \
                 int n\r\n";
    }
    head += "element vertex 4\r\n";
    if extras {
        head += "property short scalar.x\r\n";
    }
    head += &format!(
        "property {real} z\r\nproperty {real} x\r\nproperty {real} y\r\nproperty uchar red\r\n"
    );
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
                let mesh =
                    load(square(format, real, count, index, quad, extras)).unwrap_or_else(|e| {
                        panic!("{format} {real} {count} {index} {quad} {extras}: {e}")
                    });
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
            // Text may lose its line end, and the last number has one digit.
            let least = if format == "ascii" { whole.trim_ascii_end().len() } else { whole.len() };
            for length in 0..least {
                assert!(
                    load(&whole[..length]).is_err(),
                    "{format}: {length} of {} bytes",
                    whole.len()
                );
            }
            check(&load(&whole[..least]).expect("whole"));
        }
    }
}

#[test]
fn text_as_real_files_have_it() {
    let file = b"ply\nformat ascii 1.0\ncomment caf\xe9\nelement vertex 3\nproperty float x\n\
                 property float y\nproperty float z\nproperty float confidence\nelement empty \
                 40000000000\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\n\
                 0 0 0 nan\n\n1 0 0 -inf\n \t\n0 1 0 1e3\n\n3 0 1 2";
    let mesh = load(file).expect("loads");
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3, 1));
}

#[test]
fn normals_colors_and_uvs() {
    let file = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nproperty float nx\nproperty float ny\nproperty float nz\n\
                property float diffuse_red\nproperty float diffuse_green\nproperty float \
                diffuse_blue\nproperty float alpha\nproperty float s\nproperty float t\n\
                end_header\n0 0 0 0 0 2 1 0.5 0 0.2 0.25 0.25\n1 0 0 nan 0 0 2 -1 nan 1 0 0\n0 1 0 \
                0 0 0 0 0 0 0 1 1\n";
    let mesh = load(file).expect("loads");
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::ZERO, Vec3::ZERO]);
    assert_eq!(mesh.colors, [[255, 128, 0, 51], [255, 0, 0, 255], [0, 0, 0, 0]]);
    assert_eq!(mesh.uvs, [Vec2::new(0.25, 0.75), Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0)]);
    let short = file
        .replace("float diffuse_", "ushort diffuse_")
        .replace(" 1 0.5 0 0.2 ", " 65535 32896 0 1 ");
    assert_eq!(
        load(short.replace("2 -1 nan", "0 0 0")).expect("loads").colors[0],
        [255, 128, 0, 255]
    );
}

/// A binary file with columns after or before the position, and its rows.
fn cloud(before: &str, behind: &str, rows: &[&[(&str, f64)]]) -> Vec<u8> {
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{before}property float x\n\
         property float y\nproperty float z\n{behind}end_header\n",
        rows.len()
    )
    .into_bytes();
    rows.iter().copied().flatten().for_each(|&(kind, value)| put(&mut file, kind, value, false));
    file
}

/// Points at a single position, which becomes the origin.
#[test]
fn columns_around_a_list_of_three_are_read() {
    let list = [("uchar", 3.0), ("float", 7.0), ("float", 8.0), ("float", 9.0)];
    let place = [("float", 1.0), ("float", 2.0), ("float", 3.0)];
    let colors = [("uchar", 255.0), ("uchar", 128.0), ("uchar", 64.0)];
    let row = [list.as_slice(), &place, &colors].concat();
    let (lists, hues) = (
        "property list uchar float q\n",
        "property uchar red\nproperty uchar green\nproperty uchar blue\n",
    );
    let mesh = load(cloud(lists, hues, &[&row, &row])).expect("loads");
    assert_eq!((mesh.origin, mesh.colors[1]), (DVec3::new(1.0, 2.0, 3.0), [255, 128, 64, 255]));
    let row = [place.as_slice(), &list, &colors].concat();
    let mesh = load(cloud("", &[lists, hues].concat(), &[&row, &row])).expect("loads");
    assert_eq!((mesh.origin, mesh.colors[1]), (DVec3::new(1.0, 2.0, 3.0), [255, 128, 64, 255]));
}

/// The colours of a file that is read in pieces.
fn colors_in_pieces(bytes: &[u8]) -> Vec<[u8; 4]> {
    let limits = Limits::default();
    let source = Source::from_bytes(Path::new("a.ply"), bytes, &limits).expect("small");
    let mut stream = Stream::of(source).expect("opens").expect("can be read in pieces");
    stream.settle(&|_| {}).expect("points");
    let mut colors = Vec::new();
    let of = |points: &[StreamPoint]| points.iter().map(|point| point.color).collect::<Vec<_>>();
    stream
        .points(of, |piece| {
            colors.extend(piece);
            Ok(())
        })
        .expect("points");
    colors
}

/// The largest value decides the scale of colours in types wider than bytes, read whole and in
/// pieces.
#[test]
fn colors_of_wider_types_may_be_bytes() {
    for (kind, values, expected) in [
        ("ushort", [200.0, 100.0, 50.0], [200, 100, 50]),
        ("ushort", [65535.0, 32896.0, 0.0], [255, 128, 0]),
        ("float", [128.0, 64.0, 2.0], [128, 64, 2]),
        ("float", [1.0, 0.5, 0.0], [255, 128, 0]),
        ("float", [1.25, 0.5, 0.0], [255, 128, 0]),
        ("double", [65535.0, 257.0, 0.0], [255, 1, 0]),
        ("uchar", [200.0, 1.0, 0.0], [200, 1, 0]),
    ] {
        let columns =
            ["red", "green", "blue"].map(|name| format!("property {kind} {name}\n")).concat();
        let row = |scale: f64| {
            let place = [("float", scale), ("float", 0.0), ("float", 0.0)];
            [place, values.map(|value| (kind, value * scale))].concat()
        };
        let file = cloud("", &columns, &[&row(0.0), &row(1.0)]);
        let [red, green, blue] = expected;
        let expected = [[0, 0, 0, 255], [red, green, blue, 255]];
        assert_eq!(load(&file).expect("loads").colors, expected, "{kind} {values:?}");
        assert_eq!(colors_in_pieces(&file), expected, "{kind} {values:?} in pieces");
    }
}

/// Corners of one vertex may have several texture coordinates, in several pictures (MeshLab).
#[test]
fn texture_coordinates_of_corners() {
    let folder = Folder::new();
    let dot = |color| image::RgbaImage::from_pixel(1, 1, image::Rgba(color));
    dot([255, 0, 0, 255]).save(folder.path("a.png")).expect("a picture");
    dot([0, 255, 0, 255]).save(folder.path("b.png")).expect("a picture");
    let file = |faces: &str| {
        let text = format!(
            "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\nelement \
             vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
             property uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int \
             vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n\
             end_header\n0 0 0 1 0 0\n1 0 0 2 0 0\n1 1 0 3 0 0\n0 1 0 4 0 0\n{faces}",
            faces.lines().count()
        );
        let path = folder.write("a.ply", text);
        read(&Source::open(&path, &Limits::default())?, &ReadOptions::default())
    };
    let mesh =
        file("3 0 1 2 6 0 0 1 0 1 1 0\n3 0 2 3 6 0 0 0.5 1 0 1 1\n3 0 1 3 0 0\n").expect("loads");
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 4, 3], [0, 5, 6]]);
    assert_eq!((mesh.positions[4], mesh.colors[4]), (Vec3::new(1.0, 1.0, 0.0), [3, 0, 0, 255]));
    assert_eq!(mesh.uvs[2..5], [Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0), Vec2::new(0.5, 0.0)]);
    assert_eq!(mesh.uvs.len(), mesh.positions.len());
    assert_eq!(mesh.triangle_materials, [0, 1, 0]);
    let colors: Vec<_> =
        mesh.materials.iter().map(|m| m.texture.as_ref().expect("a picture").texels[0]).collect();
    assert_eq!(colors, [[255, 0, 0, 255], [0, 255, 0, 255]]);
    let quad = file("4 0 1 2 3 8 0 0 1 0 1 1 0 1 1\n").expect("loads");
    assert_eq!((quad.triangles.len(), quad.positions.len()), (2, 4));
    assert_eq!((quad.uvs[3], quad.triangle_materials), (Vec2::new(0.0, 0.0), vec![1, 1]));
    for (faces, word) in [
        ("3 0 1 2 5 0 0 1 0 1 0\n", "has 5 texture coordinates for 3 corners"),
        ("3 0 1 2 6 0 0 1 0 1 1 2\n", "shows picture 2"),
    ] {
        let message = file(faces).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

/// The triangles of a concave polygon stay inside it.
#[test]
fn concave_polygons() {
    let file = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n\
                element vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
                end_header\n6 0 1 2 3 4 5\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 0\n";
    let mesh = load(file).expect("loads");
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|index| mesh.positions[index as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    assert_eq!(mesh.triangles.len(), 4);
    assert!(mesh.triangles.iter().all(|t| area(t) > 0.0));
    assert_eq!(mesh.triangles.iter().map(area).sum::<f32>(), 3.0);
}

/// Files with polygons are read as a whole, wherever the polygons are.
#[test]
fn polygons_are_not_read_in_pieces() {
    let limits = Limits::default();
    for (quad, streams) in [(false, true), (true, false)] {
        let file = square("binary_little_endian", "float", "uchar", "int", quad, false);
        let source = Source::from_bytes(Path::new("a.ply"), &file, &limits).expect("small");
        assert_eq!(Stream::of(source).expect("opens").is_some(), streams);
        assert_eq!(load(&file).expect("loads").triangles.len(), 2);
    }
}

#[test]
fn large_coordinates_keep_their_precision() {
    let mut file = b"ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty double x\n\
                     property double y\nproperty double z\nend_header\n"
        .to_vec();
    let points = [[4_500_000.125, 5_600_000.25, 100.0], [4_500_001.375, 5_600_002.5, 101.0]];
    points.iter().flatten().for_each(|&v| put(&mut file, "double", v, false));
    let mesh = load(file).expect("loads");
    for (position, point) in mesh.positions.iter().zip(points) {
        assert_eq!(mesh.origin + position.as_dvec3(), DVec3::from_array(point));
    }
    assert_eq!(mesh.origin, mesh.origin.round());
}

#[test]
fn strips_become_triangles() {
    let file = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n\
                property float z\nelement tristrips 1\nproperty list int int vertex_indices\n\
                end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n8 0 1 2 3 -1 2 3 4\n";
    assert_eq!(load(file).expect("loads").triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    load(bytes).expect_err("an error").to_string()
}

/// Names in capitals, and vertices that are not at finite coordinates, in every encoding.
#[test]
fn what_other_programs_read_is_read() {
    let head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement Vertex 4\nproperty float X\nproperty float Y\n\
             property float Z\nproperty uchar Red\nproperty uchar Green\nproperty uchar Blue\n\
             element FACE 2\nproperty list uchar int Vertex_Indices\nend_header\n"
        )
    };
    let mut binary = head("binary_little_endian").into_bytes();
    for place in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0], [0.0, 1.0, 0.0f32]] {
        binary.extend(place.iter().flat_map(|value| value.to_le_bytes()));
        binary.extend([1, 2, 3]);
    }
    for face in [[0, 1, 3], [0, 1, 2i32]] {
        binary.push(3);
        binary.extend(face.iter().flat_map(|index| index.to_le_bytes()));
    }
    let rows = "0 0 0 1 2 3\n1 0 0 1 2 3\n-nan(ind) 0 0 1 2 3\n0 1 0 1 2 3\n3 0 1 3\n3 0 1 2\n";
    let text = head("ascii") + rows;
    for file in [binary, text.into_bytes()] {
        let mesh = load(file).expect("loads");
        assert_eq!((mesh.positions.len(), &mesh.triangles[..]), (3, &[[0, 1, 2]][..]));
        assert_eq!(mesh.colors, [[1, 2, 3, 255]; 3]);
    }
}

#[test]
fn counts_that_lie_and_broken_numbers() {
    let file = |format: &str, count: &str, body: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
             property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
             {body}"
        )
    };
    let body = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    load(file("ascii", "3", body)).expect("loads");
    for count in
        ["0", "2", "4", "4294967296", "18446744073709551615", "18446744073709551616", "-1", "x"]
    {
        for format in ["ascii", "binary_little_endian"] {
            load(file(format, count, body)).expect_err(count);
        }
    }
    assert!(
        message(file("ascii", "3", &body.replace("1 0 0", "1 nan 0")))
            .contains("each uses a point that is not at finite coordinates")
    );
    assert!(
        message(file("ascii", "3", &body.replace("1 0 0", "1 0,5 0")))
            .contains("“0,5” is not a number")
    );
    assert!(message(file("ascii", "3", &body.replace("3 0 1 2", "3 0 1 3"))).contains("vertex 3"));
    assert!(
        message(file("ascii", "3", &body.replace("3 0 1 2", "3 0 1 -1"))).contains("vertex -1")
    );
    assert!(
        message(file("ascii", "3", &body.replace("3 0 1 2", "-1 0"))).contains("impossible length")
    );
    assert!(
        message(file("ascii", "3", &body.replace("3 0 1 2", "1e300 0 1 2")))
            .contains("the line ends")
    );
    assert!(
        message(file("ascii", "3", &body.replace("3 0 1 2", "3 0 1 2 7"))).contains("more values")
    );
    assert!(
        message("ply\nformat ascii 1.0\nelement vertex 2000000000\nend_header\n")
            .contains("no scalar property")
    );
    assert!(message("").contains("end_header"));
    assert!(message("ply\nproperty float x\nend_header\n").contains("before any element"));
    let limits = Limits { points: 2, ..Limits::default() };
    assert!(matches!(
        load_within(file("ascii", "3", body), &limits),
        Err(Error::Limit { found: 3, .. })
    ));
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

#[test]
fn properties_are_values_by_name() {
    let folder = Folder::new();
    let row = |value: f64| [value, 2.0 * value, 1.0, 10.0 * value, 5.0].map(|v| ("float", v));
    let rows = [0.0, 1.0, 3.0].map(row);
    let names = "property float scalar_Heat\nproperty float t\n";
    let path = folder.write("a.ply", cloud("", names, &[&rows[0], &rows[1], &rows[2]]));
    let options = |name| ReadOptions::scalar(Some(name));
    let read = |name| {
        crate::input::testing::read_with(&path, |source| super::read(source, &options(name)))
    };
    for name in ["scalar_Heat", "heat"] {
        let mesh = read(name).unwrap();
        assert_eq!((mesh.values, mesh.about.name.as_str()), (vec![0.0, 10.0, 30.0], "scalar_Heat"));
    }
    assert_eq!(read("x").unwrap().values, [0.0, 1.0, 3.0]);
    let message = read("cold").unwrap_err().to_string();
    assert!(message.contains("no array “cold”"), "{message}");
}

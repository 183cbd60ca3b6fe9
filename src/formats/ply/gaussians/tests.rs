use super::*;
use crate::{
    Error,
    formats::{
        ReadOptions,
        ply::{self, tests::put},
    },
    gaussians::harmonics::{constant_of, terms},
    input::testing::*,
    surface::Mesh,
};
use glam::{DVec3, Quat, Vec3};

/// The name of an element, its properties with their types, and its rows.
type Part = (&'static str, Vec<String>, Vec<Vec<f64>>);

const FORMATS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

fn file(format: &str, parts: &[Part]) -> Vec<u8> {
    let mut head = format!("ply\nformat {format} 1.0\ncomment a test\n");
    for (name, properties, rows) in parts {
        head += &format!("element {name} {}\n", rows.len());
        properties.iter().for_each(|property| head += &format!("property {property}\n"));
    }
    let mut out = (head + "end_header\n").into_bytes();
    for (_, properties, rows) in parts {
        for row in rows {
            assert_eq!(row.len(), properties.len());
            for (&value, property) in row.iter().zip(properties) {
                match format {
                    "ascii" => out.extend(format!("{value} ").into_bytes()),
                    _ => {
                        let kind = property.split(' ').next().unwrap_or_default();
                        put(&mut out, kind, value, format == "binary_big_endian");
                    }
                }
            }
            if format == "ascii" {
                out.push(b'\n');
            }
        }
    }
    out
}

fn load(bytes: impl AsRef<[u8]>) -> Result<Gaussians> {
    let folder = Folder::new();
    read_with(&folder.write("a.ply", bytes), read_gaussians)
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    load(bytes).expect_err("an error").to_string()
}

fn center(set: &Gaussians, index: usize) -> DVec3 {
    set.origin + set.centers[index].as_dvec3()
}

/// The value of a property in the trainer's file of the tests.
fn value(name: &str) -> f64 {
    match name {
        "x" => 1.0,
        "y" => 2.0,
        "z" => -3.0,
        "f_dc_0" => 0.5,
        "f_dc_1" => -0.25,
        "f_dc_2" => 1.0,
        "opacity" | "scale_0" => 0.0,
        "scale_1" => 1.0,
        "scale_2" => -1.0,
        "rot_0" | "rot_1" | "rot_2" => 0.0,
        "rot_3" => 2.0,
        "red" => 255.0,
        "green" => 0.0,
        "blue" => 51.0,
        "nx" => 9.0,
        "filter_3D" => 2.0,
        rest => rest.strip_prefix("f_rest_").unwrap().parse::<f64>().unwrap() / 8.0,
    }
}

const SHAPE: [&str; 11] =
    ["x", "opacity", "nx", "y", "z", "rot_3", "rot_0", "rot_1", "rot_2", "scale_1", "scale_0"];
const CONSTANTS: [&str; 3] = ["f_dc_2", "f_dc_0", "f_dc_1"];

/// A file of two equal Gaussians, with these properties in this order.
fn trained(format: &str, kind: &str, names: &[String]) -> Vec<u8> {
    let row: Vec<f64> = names.iter().map(|name| value(name)).collect();
    let properties = names.iter().map(|name| format!("{kind} {name}")).collect();
    file(format, &[("vertex", properties, vec![row.clone(), row])])
}

fn names(lists: &[&[&str]], rest: usize) -> Vec<String> {
    let rest = (0..rest).rev().map(|number| format!("f_rest_{number}"));
    rest.chain(lists.iter().copied().flatten().map(|name| (*name).to_owned())).collect()
}

#[test]
fn every_encoding_degree_and_order() {
    for format in FORMATS {
        for (kind, degree) in [("float", 0), ("double", 1), ("float", 2), ("float", 3)] {
            let terms = terms(degree);
            let names = names(&[&["scale_2"], &SHAPE, &CONSTANTS], 3 * (terms - 1));
            let set = load(trained(format, kind, &names)).unwrap();
            assert_eq!((set.len(), set.degree, set.validate()), (2, degree, Ok(())));
            assert_eq!(center(&set, 1), DVec3::new(1.0, 2.0, -3.0));
            assert_eq!(
                (set.opacities[1], set.rotations[1]),
                (0.5, Quat::from_xyzw(0., 0., 1., 0.))
            );
            let e = std::f32::consts::E;
            assert!((set.scales[1] - Vec3::new(1.0, e, 1.0 / e)).length() < 1e-6);
            let colors = set.harmonics_of(1);
            assert_eq!(colors[0], [0.5, -0.25, 1.0]);
            for (term, color) in colors.iter().enumerate().skip(1) {
                // All of red come first, then green, then blue.
                let number = |channel: usize| (channel * (terms - 1) + term - 1) as f32 / 8.0;
                assert_eq!(*color, [0, 1, 2].map(number), "{format} {degree}");
            }
        }
    }
}

/// Mip-Splatting: the squares of the scales and the filter add up; the opacity shrinks by the ratio
/// of the volumes.
#[test]
fn filters_widen_scales_and_lower_opacities() {
    let names = names(&[&["scale_2", "filter_3D"], &SHAPE, &CONSTANTS], 0);
    let set = load(trained("ascii", "float", &names)).unwrap();
    let plain = [1.0, std::f32::consts::E, 1.0 / std::f32::consts::E];
    let wide = plain.map(|scale| (scale * scale + 4.0).sqrt());
    assert!((set.scales[0] - Vec3::from(wide)).length() < 1e-5);
    let share: f32 = (0..3).map(|axis| plain[axis] / wide[axis]).product();
    assert!((set.opacities[0] - 0.5 * share).abs() < 1e-6);
}

#[test]
fn flat_ones_and_painted_ones() {
    let folder = Folder::new();
    for format in FORMATS {
        let set = load(trained(format, "float", &names(&[&SHAPE, &CONSTANTS], 0))).unwrap();
        assert_eq!((set.scales[0].x, set.scales[0].z), (1.0, 0.0));
        for (kind, divisor) in [("uchar", 1.0), ("float", 255.0)] {
            let paint = ["red", "green", "blue"];
            let properties = SHAPE.map(|name| format!("float {name}")).into_iter();
            let properties = properties.chain(paint.map(|name| format!("{kind} {name}")));
            let row = SHAPE.map(value).into_iter().chain(paint.map(|name| value(name) / divisor));
            let painted = file(format, &[("vertex", properties.collect(), vec![row.collect()])]);
            let path = folder.write("a.ply", &painted);
            assert!(read_with(&path, holds_gaussians).unwrap());
            let set = load(painted).unwrap();
            for (actual, part) in set.harmonics[0].iter().zip([1.0, 0.0, 0.2]) {
                assert!((actual - constant_of(part)).abs() < 1e-5, "{format} {kind}");
            }
        }
    }
}

#[test]
fn what_is_wrong_is_named() {
    let good = names(&[&["scale_2"], &SHAPE, &CONSTANTS], 9);
    let text = |names: &[String]| String::from_utf8(trained("ascii", "float", names)).unwrap();
    let file = text(&good);
    for (from, to, word) in [
        ("f_rest_8", "g_rest_8", "8 properties “f_rest_…”, but only 0, 9, 24 or 45"),
        ("f_rest_8", "f_rest_9", "no scalar property “f_rest_8”"),
        ("float rot_2", "float rot2", "no scalar property “rot_2”"),
        ("float f_dc_1", "float green", "no scalar property “f_dc_1”"),
        ("float x\n", "list uchar float x\n", "no scalar property “x”"),
        ("element vertex", "element point", "no element “vertex”"),
        ("element vertex 2", "element vertex 3", "the file ends"),
        ("element vertex 2", "element vertex 0", "no Gaussians"),
    ] {
        assert!(file.contains(from));
        let message = message(file.replacen(from, to, 1));
        assert!(message.contains(word), "{word}: {message}");
    }
    for format in ["ascii", "binary_little_endian"] {
        let claims = |count: &str| {
            let old = trained(format, "float", &good);
            let at = old.windows(8).position(|w| w == b"vertex 2").unwrap();
            [&old[..at], b"vertex ", count.as_bytes(), &old[at + 8..]].concat()
        };
        for count in ["3", "4000000", "4000000000", "18446744073709551615"] {
            load(claims(count)).expect_err(count);
        }
    }
    let plain = text(&names(&[&["x", "y", "z"]], 0));
    match load(&plain) {
        Err(Error::Input { hint, .. }) => assert!(hint.unwrap().contains("as a mesh")),
        other => panic!("{other:?}"),
    }
    let nan = file.replacen(" -3 ", " nan ", 1);
    assert_eq!(load(nan).unwrap().broken.all(), 1);
}

#[test]
fn cut_files_are_errors() {
    let folder = Folder::new();
    for format in &FORMATS[1..] {
        let names = names(&[&SHAPE, &CONSTANTS], 0);
        every_cut(&folder, "a.ply", &trained(format, "float", &names), read_gaussians);
        every_cut(&folder, "a.ply", &file(format, &compressed(true)), read_gaussians);
    }
}

/// A compressed file of two Gaussians, of degree 1.
fn compressed(has_colors: bool) -> Vec<Part> {
    let mut ranges: Vec<String> = ["min", "max", "min_scale", "max_scale"]
        .iter()
        .flat_map(|end| ["x", "y", "z"].map(|axis| format!("float {end}_{axis}")))
        .collect();
    let mut chunk = vec![0., 0., 0., 2047., 1023., 2047., 0., 0., 0., 0., 0., 1.];
    if has_colors {
        ranges.extend(
            ["min", "max"]
                .iter()
                .flat_map(|end| ["r", "g", "b"].map(|c| format!("float {end}_{c}"))),
        );
        chunk.extend([0.0, 0.0, 0.0, 1.0, 2.0, 1.0]);
    }
    let words = ["position", "rotation", "scale", "color"];
    let words = words.map(|name| format!("uint packed_{name}")).to_vec();
    // Steps of 11, 10 and 11 bits; the largest part and three others; three colours and opacity.
    let first = [3 << 21 | 5 << 11 | 7, 2 << 30 | 1023 << 20 | 512 << 10 | 512, 2047, 0xffff_0033];
    let second = [u32::MAX, 512 << 20 | 512 << 10 | 512, 0, 0x3366_99ff];
    let rows = [first, second].map(|row| row.map(f64::from).to_vec()).to_vec();
    let rest = (0..9).map(|number| format!("uchar f_rest_{number}")).collect();
    let bytes = [0., 1., 2., 127., 128., 129., 253., 254., 255.];
    vec![
        ("chunk", ranges, vec![chunk]),
        ("vertex", words, rows),
        ("sh", rest, vec![bytes.to_vec(), vec![128.0; 9]]),
    ]
}

#[test]
fn compressed_ones_by_hand() {
    for format in FORMATS {
        let set = load(file(format, &compressed(true))).unwrap();
        assert_eq!((set.len(), set.degree, set.validate()), (2, 1, Ok(())));
        assert!(center(&set, 0).distance(DVec3::new(3.0, 5.0, 7.0)) < 1e-3);
        assert!(center(&set, 1).distance(DVec3::new(2047.0, 1023.0, 2047.0)) < 1e-3);
        let scale = Vec3::new(1.0, 1.0, std::f32::consts::E);
        assert!((set.scales[0] - scale).length() < 1e-6 && set.scales[1] == Vec3::ONE);
        // The largest is y; w is the end of its range.
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let turns = [Quat::from_xyzw(0.0, half, 0.0, half), Quat::IDENTITY];
        for (actual, wanted) in set.rotations.iter().zip(turns) {
            assert!((*actual - wanted).length() < 2e-3, "{actual}");
        }
        assert_eq!(set.opacities, [0.2, 1.0]);
        let near = |actual: [f32; 3], wanted: [f32; 3]| {
            let near = actual.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-5);
            assert!(near, "{actual:?} {wanted:?}");
        };
        near(set.harmonics_of(0)[0], [1.0, 2.0, 0.0].map(constant_of));
        near(set.harmonics_of(1)[0], [0.2, 0.8, 0.6].map(constant_of));
        // (byte + ½) / 32 − 4, but the ends are −4 and 4.
        near(set.harmonics_of(0)[1], [-4.0, -0.015_625, 3.921_875]);
        near(set.harmonics_of(0)[2], [-3.953_125, 0.015_625, 3.953_125]);
        near(set.harmonics_of(0)[3], [-3.921_875, 0.046_875, 4.0]);
        let old = load(file(format, &compressed(false)[..2])).unwrap();
        assert_eq!(old.degree, 0);
        near(old.harmonics[0], [1.0, 1.0, 0.0].map(constant_of));
    }
}

#[test]
fn chunks_are_256_long() {
    let mut parts = compressed(true);
    parts.truncate(2);
    let mut far = parts[0].2[0].clone();
    far[..6].fill(5000.0);
    parts[0].2.push(far);
    let row = parts[1].2[0].clone();
    parts[1].2 = vec![row; 257];
    let set = load(file("binary_little_endian", &parts)).unwrap();
    assert!(center(&set, 255).distance(DVec3::new(3.0, 5.0, 7.0)) < 1e-3);
    assert!(center(&set, 256).distance(DVec3::splat(5000.0)) < 1e-3);
    parts[1].2.pop();
    let wrong = message(file("binary_little_endian", &parts));
    assert!(wrong.contains("“chunk” has 2 rows, but 256 Gaussians need 1"), "{wrong}");
}

#[test]
fn what_is_wrong_in_compressed_ones_is_named() {
    let text = String::from_utf8(file("ascii", &compressed(true))).unwrap();
    for (from, to, word) in [
        ("float max_scale_y", "float other", "no scalar property “max_scale_y”"),
        ("float max_b", "float other", "no scalar property “max_b”"),
        ("uint packed_scale", "float packed_scale", "“packed_scale” is not of the type uint"),
        ("packed_color", "other", "no scalar property “packed_color”"),
        ("uchar f_rest_3", "int f_rest_3", "not of the type uchar"),
        ("element sh 2", "element sh 1", "“sh” has 1 rows for 2 Gaussians"),
        ("uchar f_rest_8", "uchar other", "8 properties"),
        ("element vertex 2", "element vertex 3000000", "need 11719"),
        ("element sh", "element harmonics", ""),
    ] {
        assert!(text.contains(from));
        let result = load(text.replacen(from, to, 1));
        match result {
            Ok(set) => assert!(word.is_empty() && set.degree == 0),
            Err(error) => {
                let message = error.to_string();
                assert!(!word.is_empty() && message.contains(word), "{word}: {message}");
            }
        }
    }
}

#[test]
fn readers_of_meshes_see_points_or_refuse() {
    let folder = Folder::new();
    let mesh = |bytes: &[u8]| {
        let path = folder.write("a.ply", bytes);
        let holds = read_with(&path, holds_gaussians).unwrap();
        (holds, read_with(&path, |source| ply::read(source, &ReadOptions::default())))
    };
    let (holds, points) =
        mesh(&trained("ascii", "float", &names(&[&["scale_2"], &SHAPE, &CONSTANTS], 0)));
    assert_eq!((holds, points.unwrap().positions.len()), (true, 2));
    let (holds, refused) = mesh(&file("binary_little_endian", &compressed(true)));
    let wrong = refused.unwrap_err().to_string();
    assert!(holds && wrong.contains("compressed Gaussians, not a mesh"), "{wrong}");
    let path = folder.path("b.ply");
    ply::write(&Mesh::cube(1.0), &path).unwrap();
    assert!(!read_with(&path, holds_gaussians).unwrap());
}

/// Gaussians at random places, of every kind.
fn random(count: usize, degree: u32) -> Gaussians {
    let mut state = 7u64;
    let mut next = |low: f32, high: f32| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        low + (high - low) * (state >> 40) as f32 / (1 << 24) as f32
    };
    let mut set = Gaussians { origin: DVec3::new(100.0, -20.0, 3.0), degree, ..Default::default() };
    for _ in 0..count {
        set.centers.push(Vec3::from([(); 3].map(|()| next(-5.0, 5.0))));
        set.scales.push(Vec3::from([(); 3].map(|()| next(-6.0, 0.0).exp())));
        let [x, y, z, w] = [(); 4].map(|()| next(-1.0, 1.0));
        set.rotations.push(Quat::from_xyzw(x, y, z, w + 0.01).normalize());
        set.opacities.push(next(0.0, 1.0));
        set.harmonics.extend((0..terms(degree)).map(|_| [(); 3].map(|()| next(-2.0, 2.0))));
    }
    set
}

/// The largest differences of the numbers of two Gaussians.
fn differences(a: (&Gaussians, usize), b: (&Gaussians, usize)) -> [f32; 5] {
    let ((a, i), (b, j)) = (a, b);
    let colors = a.harmonics_of(i).as_flattened().iter().zip(b.harmonics_of(j).as_flattened());
    [
        center(a, i).distance(center(b, j)) as f32,
        (a.scales[i] / b.scales[j] - 1.0).abs().max_element(),
        1.0 - a.rotations[i].dot(b.rotations[j]).abs(),
        (a.opacities[i] - b.opacities[j]).abs(),
        colors.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max),
    ]
}

#[test]
fn what_is_written_reads_back() {
    let folder = Folder::new();
    for degree in 0..=3 {
        let mut set = random(300, degree);
        set.scales[0].z = 0.0;
        let path = folder.path("made.ply");
        write_gaussians(&set, &path).unwrap();
        let read = read_with(&path, read_gaussians).unwrap();
        assert_eq!((read.len(), read.degree, read.broken.all()), (set.len(), degree, 0));
        assert!(read.scales[0].z < 1e-18);
        for index in 1..set.len() {
            let errors = differences((&read, index), (&set, index));
            assert!(errors.iter().all(|v| *v < 2e-5), "{index}: {errors:?}");
        }
        let path = folder.path("compressed.ply");
        write_compressed_gaussians(&set, &path).unwrap();
        let read = read_with(&path, read_gaussians).unwrap();
        assert_eq!((read.len(), read.degree, read.broken.all()), (set.len(), degree, 0));
        // Their order is another one.
        for index in 1..set.len() {
            let far = |other: &usize| center(&read, *other).distance(center(&set, index));
            let near = (0..read.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
            let errors = differences((&read, near), (&set, index));
            // Half a step of each number, and a little more.
            let allowed = [1e-2, 2e-2, 1e-4, 2e-3, 1.7e-2];
            assert!(errors.iter().zip(allowed).all(|(v, most)| *v < most), "{index}: {errors:?}");
        }
    }
}

#[test]
fn trainers_write_this_header() {
    let folder = Folder::new();
    let path = folder.path("a.ply");
    write_gaussians(&random(2, 1), &path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let names = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 f_rest_3 f_rest_4 \
                 f_rest_5 f_rest_6 f_rest_7 f_rest_8 opacity scale_0 scale_1 scale_2 rot_0 rot_1 \
                 rot_2 rot_3";
    let head = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n".to_owned();
    let head = names.split(' ').fold(head, |head, name| head + "property float " + name + "\n");
    assert_eq!(bytes[..end], *(head + "end_header\n").as_bytes());
    assert_eq!(bytes[end..].len(), 2 * 26 * 4);
    assert_eq!(bytes[end + 12..end + 24], [0; 12]);
}

#[test]
fn broken_sets_are_not_written() {
    let folder = Folder::new();
    let mut set = random(3, 0);
    set.opacities.pop();
    let path = folder.path("a.ply");
    assert!(matches!(write_gaussians(&set, &path), Err(Error::Argument(_))));
    assert!(matches!(write_compressed_gaussians(&set, &path), Err(Error::Argument(_))));
    assert!(!path.exists());
}

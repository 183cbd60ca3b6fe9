use super::super::tests::{bytes, data_uri, glb};
use super::*;
use crate::{
    Error,
    gaussians::harmonics::{CONSTANT, color, terms},
    input::{
        Limits,
        testing::{Folder, every_cut, read_with},
    },
};
use glam::{DMat3, DQuat, DVec3, Mat3, Vec4};
use serde_json::{Value, json};
use std::path::Path;

/// Two Gaussians of degree 1.
const POSITIONS: [f32; 6] = [1.0, 2.0, 3.0, -1.0, 0.5, 0.25];
const SCALES: [f32; 6] = [0.5, 0.25, 0.125, 1.0, 2.0, 0.0];
const ROTATIONS: [f32; 8] = [0.0, 0.0, 0.0, 1.0, 0.6, 0.0, 0.0, 0.8];
const OPACITIES: [f32; 2] = [0.25, 1.0];
const TERMS: [[f32; 6]; 4] = [
    [1.0, 0.5, 0.25, -0.5, 0.0, 0.125],
    [0.1, 0.2, 0.3, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.4, 0.5, 0.6],
    [-0.1, -0.2, -0.3, 0.7, 0.8, 0.9],
];

fn read_json(value: &Value) -> Result<Gaussians> {
    let text = value.to_string();
    let limits = Limits::default();
    read_gaussians(&Source::from_bytes(Path::new("a.gltf"), text.as_bytes(), &limits)?)
}

/// A file with one primitive. Each attribute has a buffer of its own: its type and component, the
/// bytes, and whether they are normalised.
fn file(count: usize, attributes: &[(&str, &str, u32, Vec<u8>, bool)]) -> Value {
    let (mut names, mut accessors) = (serde_json::Map::new(), Vec::new());
    let (mut views, mut buffers) = (Vec::new(), Vec::new());
    for (index, (name, kind, component, bytes, normalized)) in attributes.iter().enumerate() {
        names.insert((*name).into(), json!(index));
        accessors.push(json!({"bufferView": index, "componentType": component, "count": count,
            "type": kind, "normalized": normalized}));
        views.push(json!({"buffer": index, "byteLength": bytes.len()}));
        buffers.push(json!({"byteLength": bytes.len(), "uri": data_uri(bytes)}));
    }
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_gaussian_splatting"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "mode": 0,
            "attributes": names,
            "extensions": {"KHR_gaussian_splatting": {
                "kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": buffers
    })
}

fn two() -> Value {
    const FLOAT: u32 = 5126;
    file(
        2,
        &[
            ("POSITION", "VEC3", FLOAT, bytes(&POSITIONS), false),
            ("KHR_gaussian_splatting:SCALE", "VEC3", FLOAT, bytes(&SCALES), false),
            ("KHR_gaussian_splatting:ROTATION", "VEC4", FLOAT, bytes(&ROTATIONS), false),
            ("KHR_gaussian_splatting:OPACITY", "SCALAR", FLOAT, bytes(&OPACITIES), false),
            ("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", "VEC3", FLOAT, bytes(&TERMS[0]), false),
            ("KHR_gaussian_splatting:SH_DEGREE_1_COEF_0", "VEC3", FLOAT, bytes(&TERMS[1]), false),
            ("KHR_gaussian_splatting:SH_DEGREE_1_COEF_1", "VEC3", FLOAT, bytes(&TERMS[2]), false),
            ("KHR_gaussian_splatting:SH_DEGREE_1_COEF_2", "VEC3", FLOAT, bytes(&TERMS[3]), false),
        ],
    )
}

fn primitive(value: &mut Value) -> &mut Value {
    &mut value["meshes"][0]["primitives"][0]
}

fn is_near(actual: &[f32], wanted: &[f32]) -> bool {
    actual.len() == wanted.len()
        && actual.iter().zip(wanted).all(|(a, b)| (a - b).abs() <= 5e-6 * b.abs().max(1.0))
}

/// The covariance of a Gaussian.
fn covariance(set: &Gaussians, index: usize) -> DMat3 {
    let axes = DMat3::from_quat(set.rotations[index].as_dquat())
        * DMat3::from_diagonal(set.scales[index].as_dvec3());
    axes * axes.transpose()
}

#[test]
fn numbers_are_those_of_the_file() {
    let set = read_json(&two()).expect("loads");
    assert_eq!(set.origin, DVec3::ZERO);
    assert_eq!(set.centers, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 0.5, 0.25)]);
    assert_eq!(set.scales, [Vec3::new(0.5, 0.25, 0.125), Vec3::new(1.0, 2.0, 0.0)]);
    assert!(is_near(&set.rotations[1].to_array(), &[0.6, 0.0, 0.0, 0.8]));
    assert_eq!((set.opacities.as_slice(), set.degree), (&OPACITIES[..], 1));
    for (term, values) in TERMS.iter().enumerate() {
        assert_eq!(set.harmonics_of(0)[term], values[..3]);
        assert_eq!(set.harmonics_of(1)[term], values[3..]);
    }
    assert_eq!((set.about.orientation, set.broken.all()), (Some(Orientation::Y_UP), 0));
    set.validate().expect("valid");
}

#[test]
fn integers_are_scaled() {
    let [byte, unsigned_byte, unsigned_short] = [5120, 5121, 5123];
    let value = file(
        1,
        &[
            ("POSITION", "VEC3", 5126, bytes(&[0.0; 3]), false),
            ("KHR_gaussian_splatting:SCALE", "VEC3", unsigned_byte, vec![51, 102, 255], true),
            ("KHR_gaussian_splatting:ROTATION", "VEC4", byte, vec![0, 0x81, 0, 0], true),
            ("KHR_gaussian_splatting:OPACITY", "SCALAR", unsigned_short, vec![0xff, 0x7f], true),
            ("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", "VEC3", 5126, bytes(&[0.0; 3]), false),
        ],
    );
    let mut plain = value.clone();
    plain["accessors"][1]["normalized"] = json!(false);
    let set = read_json(&value).expect("loads");
    assert!(is_near(&set.scales[0].to_array(), &[0.2, 0.4, 1.0]));
    assert_eq!(set.rotations[0].to_array(), [0.0, -1.0, 0.0, 0.0]);
    assert!(is_near(&set.opacities, &[32767.0 / 65535.0]));
    // Scales may also be whole numbers.
    let set = read_json(&plain).expect("loads");
    assert_eq!(set.scales[0], Vec3::new(51.0, 102.0, 255.0));
}

#[test]
fn drafts_are_read() {
    let mut value = file(
        1,
        &[
            ("POSITION", "VEC3", 5126, bytes(&[0.0; 3]), false),
            ("_SCALE", "VEC3", 5126, bytes(&[1.0, 2.0, 3.0]), false),
            ("_ROTATION", "VEC4", 5126, bytes(&[0.0, 0.0, 0.0, 1.0]), false),
            ("COLOR_0", "VEC4", 5121, vec![255, 51, 0, 204], true),
        ],
    );
    primitive(&mut value)["extensions"] = json!({"KHR_gaussian_splatting": {}});
    let set = read_json(&value).expect("loads");
    assert_eq!((set.scales[0], set.degree), (Vec3::new(1.0, 2.0, 3.0), 0));
    assert!(is_near(&set.opacities, &[0.8]));
    assert!(is_near(&color(0, set.harmonics_of(0), Vec3::X), &[1.0, 0.2, 0.0]));
    // Most scales are negative, so they are logarithms.
    let logarithms = bytes(&[-1.0, 0.5, -2.0]);
    value["buffers"][1]["uri"] = json!(data_uri(&logarithms));
    let set = read_json(&value).expect("loads");
    let wanted = [-1f32, 0.5, -2.0].map(f32::exp);
    assert!(is_near(&set.scales[0].to_array(), &wanted), "{}", set.scales[0]);
}

#[test]
fn nodes_move_shapes_and_colours() {
    let still = read_json(&two()).expect("loads");
    let turn = DQuat::from_xyzw(0.5, 0.1, -0.7, 0.5).normalize();
    let rotation = DMat3::from_quat(turn);
    let quaternion = turn.as_quat().to_array();
    let stretch = DVec3::new(2.0, 0.5, 3.0);
    let mirror = DVec3::new(-2.0, 2.0, 2.0);
    for scale in [DVec3::splat(2.0), stretch, mirror, mirror * stretch, DVec3::NEG_ONE] {
        let linear = rotation * DMat3::from_diagonal(scale);
        let turned = rotation * DMat3::from_diagonal(scale.signum());
        let mut value = two();
        value["nodes"] = json!([
            {"translation": [10, 20, 30], "children": [1]},
            {"rotation": quaternion, "scale": scale.to_array(), "mesh": 0}
        ]);
        let moved = read_json(&value).expect("loads");
        moved.validate().expect("valid");
        for index in 0..2 {
            let center = linear * still.centers[index].as_dvec3() + DVec3::new(10.0, 20.0, 30.0);
            let actual = moved.origin + moved.centers[index].as_dvec3();
            assert!(actual.distance(center) < 1e-5, "{actual} is not {center}");
            let wanted = linear * covariance(&still, index) * linear.transpose();
            let actual = covariance(&moved, index);
            assert!(actual.abs_diff_eq(wanted, 1e-4), "{actual} is not {wanted}");
            for direction in [DVec3::X, DVec3::Y, DVec3::NEG_Z, DVec3::ONE.normalize()] {
                let wanted = color(1, still.harmonics_of(index), direction.as_vec3());
                let seen = (turned * direction).as_vec3();
                let actual = color(1, moved.harmonics_of(index), seen);
                assert!(is_near(&actual, &wanted), "{actual:?} is not {wanted:?}");
            }
        }
    }
}

#[test]
fn flat_and_sheared_nodes() {
    let with = |matrix: Value| {
        let mut value = two();
        value["nodes"] = json!([{"matrix": matrix, "mesh": 0}]);
        read_json(&value)
    };
    let still = read_json(&two()).expect("loads");
    // x takes half of y.
    let sheared = with(json!([1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])).expect("loads");
    let linear = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z);
    let flat = with(json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1])).expect("loads");
    let onto = DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0));
    for (set, linear) in [(sheared, linear), (flat, onto)] {
        set.validate().expect("valid");
        for index in 0..2 {
            let wanted = linear * covariance(&still, index) * linear.transpose();
            assert!(covariance(&set, index).abs_diff_eq(wanted, 1e-5), "{index}");
        }
    }
    let none = with(json!([0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 5, 6, 1])).expect("loads");
    assert_eq!(none.scales, [Vec3::ZERO; 2]);
    let far = with(json!([1e300, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])).unwrap_err();
    assert!(matches!(far, Error::Input { .. }), "{far}");
}

#[test]
fn primitives_are_joined() {
    let mut value = two();
    // The same mesh at two nodes; a second primitive has only the constant term.
    let mut second = primitive(&mut value).clone();
    let attributes = second["attributes"].as_object_mut().expect("an object");
    attributes.retain(|name, _| !name.contains("SH_DEGREE_1"));
    value["meshes"][0]["primitives"].as_array_mut().expect("a list").push(second);
    value["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [0, 0, 5]}]);
    value["scenes"] = json!([{"nodes": [0, 1]}]);
    let set = read_json(&value).expect("loads");
    assert_eq!((set.len(), set.degree), (8, 1));
    assert_eq!(set.harmonics.len(), 8 * terms(1));
    for (index, z) in [3.0, 0.25, 3.0, 0.25, 8.0, 5.25, 8.0, 5.25].into_iter().enumerate() {
        assert_eq!(set.centers[index].z, z, "{index}");
        let harmonics = set.harmonics_of(index);
        assert_eq!(harmonics[0], TERMS[0][3 * (index % 2)..][..3]);
        let is_constant = harmonics[1..].as_flattened().iter().all(|v| *v == 0.0);
        assert_eq!(is_constant, index % 4 >= 2, "{index}");
    }
}

#[test]
fn linear_colours_are_converted() {
    let mut value = two();
    primitive(&mut value)["extensions"]["KHR_gaussian_splatting"]["colorSpace"] =
        json!("lin_rec709_display");
    let attributes = primitive(&mut value)["attributes"].as_object_mut().expect("an object");
    attributes.retain(|name, _| !name.contains("SH_DEGREE_1"));
    let set = read_json(&value).expect("loads");
    let [r, g, b] = [0, 1, 2].map(|channel| 0.5 + CONSTANT * TERMS[0][channel]);
    let wanted = displayed([r, g, b, 1.0]);
    let actual = color(0, set.harmonics_of(0), Vec3::Y);
    assert!(is_near(&actual, &wanted[..3]), "{actual:?} is not {wanted:?}");
}

/// A change of a file, and a word of the error.
type Change = (fn(&mut Value), &'static str);

#[test]
fn wrong_files_are_refused() {
    let changes: [Change; 13] = [
        (|v| v["extensions"]["KHR_gaussian_splatting"]["kernel"] = json!("cube"), "“cube”"),
        (
            |v| {
                v["extensions"]["KHR_gaussian_splatting"]["extensions"] =
                    json!({"KHR_gaussian_splatting_compression_spz_2": {"bufferView": 0}});
            },
            "KHR_gaussian_splatting_compression_spz_2",
        ),
        (|v| v["mode"] = json!(4), "mode 0"),
        (|v| v["extensions"] = json!({}), "no primitives"),
        (|v| without(v, "POSITION"), "no attribute POSITION"),
        (|v| without(v, "SCALE"), "no attribute KHR_gaussian_splatting:SCALE"),
        (|v| without(v, "ROTATION"), "KHR_gaussian_splatting:ROTATION"),
        (|v| without(v, "OPACITY"), "KHR_gaussian_splatting:OPACITY"),
        (|v| without(v, "SH_DEGREE_0_COEF_0"), "SH_DEGREE_0_COEF_0"),
        (|v| without(v, "SH_DEGREE_1_COEF_1"), "2 of 3 harmonics of degree 1"),
        (|v| v["attributes"]["KHR_gaussian_splatting:SCALE"] = json!(2), "4 components"),
        (|v| v["attributes"]["KHR_gaussian_splatting:SCALE"] = json!(99), "0 values of SCALE"),
        (
            |v| {
                for coefficient in 0..5 {
                    let name = format!("KHR_gaussian_splatting:SH_DEGREE_2_COEF_{coefficient}");
                    v["attributes"][name] = json!(4);
                }
                without(v, "SH_DEGREE_1_COEF_0");
            },
            "2 of 3 harmonics",
        ),
    ];
    for (change, word) in changes {
        let mut value = two();
        change(primitive(&mut value));
        let message = read_json(&value).unwrap_err().to_string();
        assert!(message.contains(word), "{message} does not contain {word}");
    }
}

/// Removes an attribute of the extension, or one of glTF.
fn without(primitive: &mut Value, name: &str) {
    let attributes = primitive["attributes"].as_object_mut().expect("an object");
    let key = format!("KHR_gaussian_splatting:{name}");
    attributes.remove(&key).or_else(|| attributes.remove(name)).expect("an attribute");
}

#[test]
fn wrong_counts_are_refused() {
    let mut value = two();
    value["accessors"][2]["count"] = json!(1);
    let message = read_json(&value).unwrap_err().to_string();
    assert!(message.contains("2 positions, but 1 values of ROTATION"), "{message}");
    // Counts that no bytes hold.
    for count in [1_000_000u64, u64::MAX] {
        let mut value = two();
        for accessor in value["accessors"].as_array_mut().expect("a list") {
            accessor["count"] = json!(count);
        }
        let error = read_json(&value).unwrap_err();
        assert!(matches!(error, Error::Input { .. } | Error::Limit { .. }), "{error}");
    }
}

#[test]
fn numbers_that_are_not_finite_are_left_out() {
    let mut value = two();
    let positions = bytes(&[f32::NAN, 0.0, 0.0, 1.0, 1.0, 1.0]);
    value["buffers"][0]["uri"] = json!(data_uri(&positions));
    let set = read_json(&value).expect("loads");
    assert_eq!((set.len(), set.broken.all()), (1, 1));
    assert_eq!(set.opacities, [1.0]);
}

#[test]
fn required_extensions_are_known() {
    let mut value = two();
    value["extensionsRequired"] = json!(["KHR_gaussian_splatting"]);
    read_json(&value).expect("loads");
    value["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    assert!(read_json(&value).unwrap_err().to_string().contains("EXT_meshopt_compression"));
}

#[test]
fn gaussians_are_no_mesh() {
    let folder = Folder::new();
    let read =
        |value: &Value| read_with(&folder.write("a.gltf", value.to_string()), super::super::read);
    let mut value = two();
    let error = read(&value).unwrap_err();
    assert!(error.to_string().contains("trained 3D Gaussians"), "{error}");
    // A triangle beside them.
    let triangle = json!({"attributes": {"POSITION": 8}});
    value["meshes"][0]["primitives"].as_array_mut().expect("a list").push(triangle);
    let corners = bytes(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let push = |list: &mut Value, item| list.as_array_mut().expect("a list").push(item);
    push(
        &mut value["accessors"],
        json!({"bufferView": 8, "componentType": 5126, "count": 3, "type": "VEC3"}),
    );
    push(&mut value["bufferViews"], json!({"buffer": 8, "byteLength": 36}));
    push(&mut value["buffers"], json!({"byteLength": 36, "uri": data_uri(&corners)}));
    let mesh = read(&value).expect("loads");
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (3, 1));
    assert_eq!(read_json(&value).expect("loads").len(), 2);
}

#[test]
fn files_with_gaussians_are_known() {
    let holds = |bytes: &[u8]| {
        let limits = Limits::default();
        holds_gaussians(&Source::from_bytes(Path::new("a.glb"), bytes, &limits).expect("opens"))
    };
    let value = two();
    assert!(holds(value.to_string().as_bytes()).expect("reads"));
    assert!(holds(&glb(&value, &[])).expect("reads"));
    let mut unused = value.clone();
    primitive(&mut unused)["extensions"] = json!({});
    assert!(!holds(unused.to_string().as_bytes()).expect("reads"));
    let mut unnamed = value;
    unnamed["extensionsUsed"] = json!([]);
    assert!(!holds(unnamed.to_string().as_bytes()).expect("reads"));
    assert!(!holds(b"{}").expect("reads"));
    assert!(holds(b"{\"KHR_gaussian_splatting\": ").is_err());
}

/// A set without a pattern.
fn made(count: usize, degree: u32, origin: DVec3) -> Gaussians {
    let value = |at: usize| ((at * 7919 + 13) % 101) as f32 / 101.0;
    let vector = |at: usize| Vec3::new(value(at), value(at + 1), value(at + 2));
    Gaussians {
        origin,
        centers: (0..count).map(|i| vector(3 * i) * 8.0 - 4.0).collect(),
        scales: (0..count).map(|i| vector(5 * i)).collect(),
        rotations: (0..count)
            .map(|i| Quat::from_vec4(Vec4::from((vector(9 * i), 0.5)).normalize()))
            .collect(),
        opacities: (0..count).map(value).collect(),
        degree,
        harmonics: (0..count * terms(degree)).map(|i| (vector(2 * i) - 0.5).to_array()).collect(),
        ..Gaussians::default()
    }
}

#[test]
fn written_files_are_read_back() {
    let folder = Folder::new();
    let path = folder.path("a.glb");
    let origins = [DVec3::ZERO, DVec3::new(4e5, -2e6, 7.0), DVec3::new(123_456_789.0, 0.1, 0.0)];
    for (degree, origin) in (0..=MOST_DEGREE).flat_map(|d| origins.map(|origin| (d, origin))) {
        let set = made(11, degree, origin);
        write_gaussians(&set, &path).expect("writes");
        let read = read_with(&path, read_gaussians).expect("reads");
        assert_eq!((read.len(), read.degree), (set.len(), degree));
        for index in 0..set.len() {
            let wanted = set.origin + set.centers[index].as_dvec3();
            let actual = read.origin + read.centers[index].as_dvec3();
            assert!(actual.distance(wanted) < 1e-6, "{actual} is not {wanted}");
            let [actual, wanted] =
                [&read, &set].map(|set| Mat3::from_quat(set.rotations[index]).to_cols_array());
            assert!(is_near(&actual, &wanted));
        }
        assert_eq!(read.scales, set.scales);
        assert_eq!(read.opacities, set.opacities);
        assert_eq!(read.harmonics, set.harmonics);
    }
}

#[test]
fn written_files_say_what_they_hold() {
    let folder = Folder::new();
    let path = folder.path("a.glb");
    let mut set = made(2, 1, DVec3::new(0.0, 8.0, 0.0));
    set.centers = vec![Vec3::new(1.0, -2.0, 3.0), Vec3::new(-4.0, 5.0, 0.0)];
    set.harmonics[0] = [harmonics::constant_of(1.0), harmonics::constant_of(0.5), -9.0];
    set.opacities[0] = 1.0;
    write_gaussians(&set, &path).expect("writes");
    let bytes = std::fs::read(&path).expect("a file");
    let limits = Limits::default();
    let source = Source::from_bytes(&path, &bytes, &limits).expect("opens");
    assert!(holds_gaussians(&source).expect("reads"));
    let (text, binary) = buffers::split(&source).expect("a GLB");
    let json: Value = serde_json::from_reader(text).expect("JSON");
    let binary = binary.expect("a binary chunk");
    assert_eq!(json["extensionsUsed"], json!(["KHR_gaussian_splatting"]));
    assert_eq!(json["nodes"], json!([{"translation": [0.0, 8.0, 0.0], "mesh": 0}]));
    assert_eq!(json["accessors"][0]["min"], json!([-4.0, -2.0, 0.0]));
    assert_eq!(json["accessors"][0]["max"], json!([1.0, 5.0, 3.0]));
    assert_eq!(json["buffers"][0]["byteLength"], json!(binary.len()));
    assert_eq!(binary[..4], 1f32.to_le_bytes());
    // Two Gaussians of 44 bytes and four terms of 12 bytes come before the colours: white, half
    // of white as linear light (0.2140), black, opaque.
    let color = &binary[2 * (44 + 4 * 12)..][..8];
    let color: Vec<u16> = color.chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    assert_eq!(color, [65535, 14027, 0, 65535]);
    assert_eq!(binary.len(), 2 * (44 + 4 * 12 + 8));
}

#[test]
fn every_cut_of_a_glb_is_an_error() {
    let folder = Folder::new();
    let path = folder.path("a.glb");
    write_gaussians(&made(2, 1, DVec3::ONE), &path).expect("writes");
    let bytes = std::fs::read(&path).expect("a file");
    every_cut(&folder, "cut.glb", &bytes, read_gaussians);
}

#[test]
fn sets_that_cannot_be_written_are_refused() {
    let folder = Folder::new();
    let path = folder.path("a.glb");
    let mut wrong = made(2, 0, DVec3::ZERO);
    wrong.opacities[1] = 2.0;
    let far = made(1, 0, DVec3::splat(1e300));
    for set in [Gaussians::default(), wrong, far] {
        assert!(matches!(write_gaussians(&set, &path), Err(Error::Argument(_))));
    }
    assert!(!path.exists());
}

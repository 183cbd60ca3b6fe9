use super::*;
use crate::{
    Error,
    formats::{ReadOptions, load_mesh},
    input::{
        Limits,
        testing::{Folder, png},
    },
};
use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

fn load(name: &str, bytes: impl AsRef<[u8]>) -> Result<Mesh> {
    let folder = Folder::new();
    load_mesh(folder.write(name, bytes), &Limits::default(), &ReadOptions::default())
}

fn load_json(value: &Value) -> Result<Mesh> {
    load("a.gltf", value.to_string())
}

pub(super) fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", STANDARD.encode(bytes))
}

pub(super) fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + 8 + binary.len();
    let mut out = b"glTF".to_vec();
    out.extend(2u32.to_le_bytes());
    out.extend((length as u32).to_le_bytes());
    for (kind, data) in [(b"JSON", text), (b"BIN\0", binary)] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    out
}

pub(super) fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A square of four vertices: positions at 0, uvs at 48, colours at 80, u16 indices at 96; 108
/// bytes.
fn square_bytes() -> Vec<u8> {
    let mut out = bytes(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    out.extend(bytes(&[0.25, 0.5, 0.75, 0.5, 0.75, 0.5, 0.25, 0.5]));
    out.extend([255, 0, 0, 255, 55, 55, 55, 255, 0, 0, 0, 128, 255, 255, 255, 0]);
    out.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
    out
}

fn square() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2},
            "indices": 3, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0, 0.25]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 0, "byteOffset": 80, "componentType": 5121, "normalized": true,
                "count": 4, "type": "VEC4"},
            {"bufferView": 0, "byteOffset": 96, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 108}],
        "buffers": [{"byteLength": 108, "uri": data_uri(&square_bytes())}]
    })
}

/// The square, changed at JSON pointers.
fn changed(changes: &[(&str, Value)]) -> Value {
    let mut value = square();
    for (pointer, new) in changes {
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        match value.pointer_mut(parent).unwrap_or_else(|| panic!("{pointer}")) {
            Value::Array(items) => items[key.parse::<usize>().expect("an index")] = new.clone(),
            Value::Object(map) => drop(map.insert(key.into(), new.clone())),
            _ => panic!("{pointer}"),
        }
    }
    value
}

#[test]
fn a_square_with_colours() {
    let mesh = load_json(&square()).expect("loads");
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    // Linear light becomes display values: 55/255 is about half when displayed, 0.5 about 0.735.
    assert_eq!(
        mesh.colors,
        [[255, 0, 0, 255], [128, 128, 128, 255], [0, 0, 0, 255], [255, 255, 255, 255]]
    );
    let color = mesh.materials[0].color;
    assert!((color[1] - 0.735).abs() < 1e-3 && color[3] == 1.0, "{color:?}");
}

/// The square with these materials, each on its own primitive, and a picture of four texels with
/// these alphas.
fn painted(materials: &[Value], alphas: [u8; 4]) -> Mesh {
    let picture = png(4, 1, &alphas.map(|alpha| [9, 8, 7, alpha]));
    let mut value = changed(&[
        ("/materials", json!(materials)),
        ("/images", json!([{"uri": data_uri(&picture)}])),
        ("/textures", json!([{"source": 0}])),
    ]);
    let primitive = value["meshes"][0]["primitives"][0].take();
    let primitives = (0..materials.len()).map(|material| {
        let mut primitive = primitive.clone();
        primitive["material"] = json!(material);
        primitive
    });
    value["meshes"][0]["primitives"] = primitives.collect();
    load_json(&value).expect("loads")
}

/// A material with the picture, with an alpha mode and this alpha as its factor.
fn picture_material(mode: &str, factor: f32) -> Value {
    let base = json!({"baseColorFactor": [1, 1, 1, factor], "baseColorTexture": {"index": 0}});
    json!({"alphaMode": mode, "pbrMetallicRoughness": base})
}

fn texel_alphas(mesh: &Mesh, material: usize) -> Vec<u8> {
    mesh.materials[material]
        .texture
        .as_ref()
        .expect("a picture")
        .texels
        .iter()
        .map(|texel| texel[3])
        .collect()
}

fn vertex_alphas(mesh: &Mesh) -> Vec<u8> {
    mesh.colors.iter().map(|color| color[3]).collect()
}

#[test]
fn opaque_materials_ignore_every_alpha() {
    let mut default = picture_material("", 0.25);
    default.as_object_mut().expect("an object").remove("alphaMode");
    for material in [default, picture_material("OPAQUE", 0.25)] {
        let mesh = painted(&[material], [0, 1, 128, 255]);
        assert_eq!(mesh.materials[0].color[3], 1.0);
        assert_eq!(texel_alphas(&mesh, 0), [255; 4]);
        assert_eq!(vertex_alphas(&mesh), [255; 4]);
        assert_eq!(
            mesh.materials[0].texture.as_ref().expect("a picture").texels[0][..3],
            [9, 8, 7]
        );
    }
    // Without a material, the default one applies, which is opaque.
    let mut value = square();
    value["meshes"][0]["primitives"][0].as_object_mut().expect("an object").remove("material");
    assert_eq!(vertex_alphas(&load_json(&value).expect("loads")), [255; 4]);
}

#[test]
fn masks_show_all_or_nothing() {
    let check =
        |factor: f32, cutoff: Option<f32>, alpha: f32, texels: [u8; 4], vertices: [u8; 4]| {
            let mut material = picture_material("MASK", factor);
            if let Some(cutoff) = cutoff {
                material["alphaCutoff"] = json!(cutoff);
            }
            let mesh = painted(&[material], [0, 159, 160, 255]);
            let alphas = (mesh.materials[0].color[3], texel_alphas(&mesh, 0), vertex_alphas(&mesh));
            assert_eq!(alphas, (alpha, texels.to_vec(), vertices.to_vec()), "{factor} {cutoff:?}");
        };
    // The vertices have alphas of 255, 255, 128 and 0.
    check(0.8, None, 1.0, [0, 0, 255, 255], [255, 255, 0, 0]);
    check(1.0, None, 1.0, [0, 255, 255, 255], [255, 255, 255, 0]);
    check(1.0, Some(1.0), 1.0, [0, 0, 0, 255], [255, 255, 0, 0]);
    check(0.4, None, 0.0, [0; 4], [0; 4]);
    check(1.0, Some(1.5), 0.0, [0; 4], [0; 4]);
    check(0.0, Some(0.0), 1.0, [255; 4], [255; 4]);
}

#[test]
fn one_picture_in_several_alpha_modes() {
    let modes = ["OPAQUE", "BLEND", "MASK", "OPAQUE", "BLEND"];
    let materials = modes.map(|mode| picture_material(mode, 0.75));
    let mesh = painted(&materials, [0, 100, 200, 255]);
    assert_eq!(mesh.triangle_materials, [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]);
    assert_eq!(texel_alphas(&mesh, 0), [255; 4]);
    assert_eq!(texel_alphas(&mesh, 1), [0, 100, 200, 255]);
    assert_eq!(texel_alphas(&mesh, 2), [0, 0, 255, 255]);
    assert_eq!([0, 1, 2].map(|i| mesh.materials[i].color[3]), [1.0, 0.75, 1.0]);
    // The vertices of each primitive follow its own material.
    assert_eq!(vertex_alphas(&mesh)[..8], [255, 255, 255, 255, 255, 255, 128, 0]);
    let same = |mesh: &Mesh, a: usize, b: usize| {
        let [a, b] = [a, b].map(|i| mesh.materials[i].texture.as_ref().expect("a picture"));
        Arc::ptr_eq(a, b)
    };
    assert!(same(&mesh, 0, 3) && same(&mesh, 1, 4) && !same(&mesh, 0, 1));
    let opaque = painted(&materials, [255; 4]);
    assert!((1..5).all(|i| same(&opaque, 0, i)));
}

#[test]
fn specular_glossiness_replaces_the_base_colour() {
    let mesh = painted(
        &[json!({
            "alphaMode": "BLEND",
            "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
            "extensions": {"KHR_materials_pbrSpecularGlossiness": {
                "diffuseFactor": [1, 0.5, 0, 0.25],
                "diffuseTexture": {"index": 0,
                    "extensions": {"KHR_texture_transform":
                        {"offset": [0.5, 0.0], "scale": [2.0, 1.0]}}}
            }}
        })],
        [255, 0, 255, 0],
    );
    let color = mesh.materials[0].color;
    assert!((color[0] - 1.0).abs() < 1e-6 && (color[1] - 0.735).abs() < 1e-3, "{color:?}");
    assert_eq!(color[2..], [0.0, 0.25]);
    assert_eq!(texel_alphas(&mesh, 0), [255, 0, 255, 0]);
    assert_eq!(mesh.uvs[0], Vec2::new(1.0, 0.5));
}

#[test]
fn a_binary_file_with_a_texture_cut_anywhere() {
    let picture = png(2, 1, &[[9, 8, 7, 255], [1, 2, 3, 255]]);
    let mut binary = square_bytes();
    binary.extend(&picture);
    let json = changed(&[
        ("/buffers/0", json!({"byteLength": binary.len()})),
        (
            "/bufferViews",
            json!([{"buffer": 0, "byteLength": 108},
            {"buffer": 0, "byteOffset": 108, "byteLength": picture.len()}]),
        ),
        ("/images", json!([{"bufferView": 1, "mimeType": "image/png"}])),
        ("/textures", json!([{"source": 0}])),
        (
            "/materials/0/pbrMetallicRoughness/baseColorTexture",
            json!({"index": 0,
            "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.0], "scale": [2.0, 1.0]}}}),
        ),
    ]);
    let file = glb(&json, &binary);
    let mesh = load("a.glb", &file).expect("loads");
    assert_eq!(mesh.materials[0].texture.as_ref().expect("a picture").texels[1], [1, 2, 3, 255]);
    assert_eq!(mesh.uvs[0], Vec2::new(1.0, 0.5));
    assert_eq!(load("no-extension", &file).expect("by its first bytes").triangles.len(), 2);
    for length in 0..file.len() {
        load("a.glb", &file[..length]).expect_err("cut");
    }
    for at in 0..file.len() {
        let mut broken = file.clone();
        broken[at] ^= 0x81;
        let _ = load("a.glb", broken);
    }
}

#[test]
fn a_text_file_cut_anywhere() {
    let text = square().to_string();
    for length in 0..text.len() {
        load("a.gltf", &text[..length]).expect_err("cut");
    }
}

#[test]
fn transforms_and_mirrors() {
    let nodes = json!([
        {"children": [1], "translation": [10, 0, 0],
            "rotation": [0, 0, 0.5f64.sqrt(), 0.5f64.sqrt()]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 3, 1]}
    ]);
    let mesh = load_json(&changed(&[("/nodes", nodes)])).expect("loads");
    let world = mesh.origin + mesh.positions[2].as_dvec3();
    assert!(world.distance(DVec3::new(8.0, -1.0, 3.0)) < 1e-6, "{world}");
    assert_eq!(mesh.triangles[0], [0, 2, 1]);
}

#[test]
fn normals_agree_with_triangles_under_mirrors() {
    let mut binary = square_bytes();
    binary.extend(bytes(&[0.0, 0.0, 1.0].repeat(4)));
    let mut value = square();
    value["buffers"] = json!([{"byteLength": binary.len(), "uri": data_uri(&binary)}]);
    value["bufferViews"] = json!([{"buffer": 0, "byteLength": binary.len()}]);
    value["accessors"].as_array_mut().expect("a list").push(json!({
        "bufferView": 0, "byteOffset": 108, "componentType": 5126, "count": 4, "type": "VEC3"
    }));
    value["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(4);
    for (scale, normal) in [
        ([1, 1, 1], Vec3::Z),
        ([-1, 1, 1], Vec3::Z),
        ([1, 1, -1], Vec3::NEG_Z),
        ([-2, -3, -4], Vec3::NEG_Z),
        ([-1, -1, 1], Vec3::Z),
        ([1, 1, 0], Vec3::Z),
    ] {
        value["nodes"] = json!([{"mesh": 0, "scale": scale}]);
        let mesh = load_json(&value).expect("loads");
        assert_eq!(mesh.normals, [normal; 4], "{scale:?}");
        let [a, b, c] = mesh.triangles[0].map(|vertex| mesh.positions[vertex as usize]);
        let facing = (b - a).cross(c - a).dot(normal);
        assert!(facing > 0.0, "{scale:?}: {facing}");
    }
}

#[test]
fn strips_fans_and_points() {
    let primitive = "/meshes/0/primitives/0";
    let with = |mode: u32| {
        let indices = json!({
            "bufferView": 0, "byteOffset": 96, "componentType": 5123, "count": 4, "type": "SCALAR"
        });
        changed(&[(&format!("{primitive}/mode"), json!(mode)), ("/accessors/3", indices)])
    };
    assert_eq!(load_json(&with(5)).expect("loads").triangles, [[0, 1, 2], [2, 1, 0]]);
    assert_eq!(load_json(&with(6)).expect("loads").triangles, [[0, 1, 2], [0, 2, 0]]);
    let cloud = load_json(&with(0)).expect("loads");
    assert_eq!((cloud.positions.len(), cloud.triangles.len()), (4, 0));
    for (mode, lines) in [
        (1, &[[0, 1], [2, 0]][..]),
        (2, &[[0, 1], [1, 2], [2, 0], [0, 0]]),
        (3, &[[0, 1], [1, 2], [2, 0]]),
    ] {
        let mesh = load_json(&with(mode)).expect("loads");
        assert_eq!((mesh.lines, mesh.triangles.len()), (lines.to_vec(), 0), "mode {mode}");
    }
}

#[test]
fn quantised_positions() {
    let values: Vec<u8> = [0i16, 0, 0, 0, 32767, 0, -32768, 0, 0, 32767, 0, 0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    for (normalized, scale) in [(true, 1.0), (false, 32767.0)] {
        let mesh = load_json(&json!({
            "asset": {"version": "2.0"}, "extensionsRequired": ["KHR_mesh_quantization"],
            "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5122, "normalized": normalized,
                "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}],
            "buffers": [{"byteLength": 24, "uri": data_uri(&values)}]
        }))
        .expect("loads");
        assert_eq!(mesh.positions[1].x, scale);
        assert_eq!(mesh.positions[1].z, if normalized { -1.0 } else { -32768.0 });
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
    }
}

#[test]
fn sparse_accessors() {
    let sparse = |count: u64, index: u64, view: Value| {
        let base = json!({
            "componentType": 5126, "count": 4, "type": "VEC3", "bufferView": view,
            "sparse": {
                "count": count,
                "indices": {"bufferView": 1, "componentType": 5121},
                "values": {"bufferView": 0, "byteOffset": 12}
            }
        });
        let mut base = base;
        if view.is_null() {
            base.as_object_mut().expect("an object").remove("bufferView");
        }
        let indices = data_uri(&[index as u8]);
        changed(&[
            ("/accessors/0", base),
            (
                "/bufferViews",
                json!([{"buffer": 0, "byteLength": 108}, {"buffer": 1, "byteLength": 1}]),
            ),
            (
                "/buffers",
                json!([
                    {"byteLength": 108, "uri": data_uri(&square_bytes())},
                    {"byteLength": 1, "uri": indices}
                ]),
            ),
        ])
    };
    assert_eq!(load_json(&sparse(1, 3, json!(0))).expect("loads").positions[3], Vec3::X);
    assert_eq!(
        load_json(&sparse(1, 3, Value::Null)).expect("loads").positions,
        [Vec3::ZERO, Vec3::ZERO, Vec3::ZERO, Vec3::X]
    );
    for (count, index) in [(1, 4), (2, 0), (1 << 40, 0)] {
        load_json(&sparse(count, index, json!(0))).expect_err("out of range");
    }
    for count in [1u64 << 20, 4_000_000_000, u64::MAX] {
        let mut value = sparse(1, 0, Value::Null);
        value["accessors"][0]["count"] = json!(count);
        load_json(&value).expect_err("a count without bytes");
    }
}

#[test]
fn hostile_files_are_refused_with_a_reason() {
    let deep: Vec<Value> =
        (0..200).map(|i| json!({"children": [i + 1]})).chain([json!({"mesh": 0})]).collect();
    let nan = bytes(&[f32::NAN])
        .into_iter()
        .chain(square_bytes().into_iter().skip(4))
        .collect::<Vec<u8>>();
    for (pointer, value, reason) in [
        ("/nodes/0", json!({"mesh": 0, "children": [0]}), "own ancestor"),
        ("/nodes", json!([{"children": [1]}, {"children": [0]}]), "own ancestor"),
        ("/nodes", json!(deep), "the nesting depth is 65, over the limit of 64"),
        ("/nodes/0", json!({"children": [7]}), "node 7"),
        ("/nodes/0/mesh", json!(7), "mesh 7"),
        ("/scene", json!(7), "scene"),
        ("/scenes/0/nodes", json!([4_294_967_295u32]), "node"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), "accessor 9"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(1), "components"),
        ("/meshes/0/primitives/0/indices", json!(9), "accessor 9"),
        ("/meshes/0/primitives/0/indices", json!(1), "unsigned integers"),
        ("/meshes/0/primitives/0/material", json!(9), "material 9"),
        ("/meshes/0/primitives/0/mode", json!(9), "mode"),
        ("/accessors/0/count", json!(u64::MAX), "the number of vertices is 18446744073709551615"),
        ("/accessors/0/count", json!(1 << 20), "reach beyond"),
        ("/accessors/0/count", json!(3), "has 3 positions but 4"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "reach beyond"),
        ("/accessors/0/bufferView", json!(5), "buffer view 5"),
        ("/accessors/3/byteOffset", json!(48), "refers to vertex"),
        ("/bufferViews/0/byteStride", json!(0), "stride"),
        ("/bufferViews/0/byteStride", json!(u64::MAX / 2), ""),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "reach beyond"),
        ("/bufferViews/0/buffer", json!(5), "buffer 5"),
        ("/bufferViews/0/byteLength", json!(109), "reach beyond"),
        ("/buffers/0/byteLength", json!(u64::MAX), "claims"),
        ("/buffers/0/uri", json!("../../secret"), "leads out of"),
        ("/buffers/0/uri", json!("file:///etc/hostname"), "an address or a drive"),
        ("/buffers/0/uri", json!("%2e%2e/secret"), "leads out of"),
        ("/buffers/0/uri", json!("%ff"), "UTF-8"),
        ("/buffers/0/uri", json!("%zz%"), "UTF-8"),
        ("/buffers/0/uri", json!("a%00b"), "UTF-8"),
        ("/buffers/0/uri", json!("data:;base64,@@"), "base64"),
        ("/buffers/0/uri", json!("data:"), "comma"),
        ("/buffers/0/uri", json!(data_uri(&nan)), "finite coordinates"),
        ("/buffers/0", json!({"byteLength": 108}), "reach beyond"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "not supported"),
        ("/extensionsRequired", json!(["EXT_meshopt_compression"]), "not supported"),
    ] {
        let error =
            load_json(&changed(&[(pointer, value.clone())])).expect_err(pointer).to_string();
        assert!(error.contains(reason), "{pointer} {value}: {error}");
    }
    for file in [
        &b"glTF"[..],
        b"glTF\x02\0\0\0\x04\0\0\0",
        b"glTF\x02\0\0\0\x0c\0\0\0",
        b"{}",
        b"[]",
        b"{\"asset\":{}}",
    ] {
        load("a.glb", file).expect_err("broken");
    }
}

#[test]
fn instances_are_drawn_each() {
    let mut binary = square_bytes();
    binary.extend(bytes(&[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 7.0, 0.0]));
    binary.extend(bytes(&[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0]));
    let instances = json!({"mesh": 0, "translation": [0, 0, 1], "extensions":
        {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 4, "SCALE": 5}}}});
    let mut value = changed(&[
        ("/buffers/0", json!({"byteLength": 180, "uri": data_uri(&binary)})),
        ("/bufferViews/0/byteLength", json!(180)),
        ("/nodes/0", instances),
        ("/extensionsRequired", json!(["EXT_mesh_gpu_instancing"])),
    ]);
    for at in [108, 144] {
        value["accessors"].as_array_mut().unwrap().push(json!({"bufferView": 0, "byteOffset": at,
            "componentType": 5126, "count": 3, "type": "VEC3"}));
    }
    let mesh = load_json(&value).expect("loads");
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 6));
    assert_eq!(mesh.positions[6], Vec3::new(7.0, 2.0, 1.0));
    assert_eq!(mesh.positions[9], Vec3::new(1.0, 7.0, 1.0));
    value["accessors"][5]["count"] = json!(2);
    let error = load_json(&value).unwrap_err().to_string();
    assert!(error.contains("different counts"), "{error}");
}

#[test]
fn pictures_of_extensions() {
    let mut webp = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_raw(1, 1, vec![9, 8, 7, 255]).unwrap();
    picture.write_to(&mut webp, image::ImageFormat::WebP).expect("encodes");
    let of = |name: &str| {
        changed(&[
            ("/images", json!([{"uri": data_uri(webp.get_ref())}])),
            ("/textures", json!([{"extensions": {name: {"source": 0}}}])),
            ("/materials/0", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})),
        ])
    };
    let mesh = load_json(&of("EXT_texture_webp")).expect("loads");
    assert_eq!(mesh.materials[0].texture.as_ref().unwrap().texels, [[9, 8, 7, 255]]);
    let Error::Input { message, hint, .. } = load_json(&of("KHR_texture_basisu")).unwrap_err()
    else {
        panic!("an input error");
    };
    assert!(message.contains("KHR_texture_basisu") && hint.unwrap().contains("ktxdecompress"));
}

#[test]
fn unlit_materials_are_drawn_without_light() {
    for (material, unlit) in [
        (json!({"extensions": {"KHR_materials_unlit": {}}}), true),
        (
            json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
            "emissiveFactor": [1, 1, 1]}),
            true,
        ),
        (json!({"emissiveFactor": [1, 1, 1]}), false),
    ] {
        let mesh = load_json(&changed(&[("/materials/0", material.clone())])).expect("loads");
        assert_eq!(mesh.materials[0].unlit, unlit, "{material}");
        let color = mesh.materials[0].color;
        assert!(color.iter().all(|part| (part - 1.0).abs() < 1e-6), "{material}: {color:?}");
        let options = crate::surface::SurfelOptions::default();
        let is_flat = |normal: u32| normal == crate::splat::NO_NORMAL;
        let surfels = mesh.surfels(&options).unwrap();
        assert!(surfels.splats.iter().all(|splat| is_flat(splat.normal) == unlit));
        let colors = vec![[255; 4]; mesh.positions.len()];
        let facets = Mesh { colors, ..mesh }.facets(&options).unwrap().expect("facets");
        assert!(facets.facets.iter().all(|facet| is_flat(facet.normals[0]) == unlit));
    }
}

#[test]
fn texture_coordinates_are_finite() {
    for (at, value) in [(0, f32::NAN), (5, f32::INFINITY)] {
        let mut binary = square_bytes();
        binary[48 + 4 * at..][..4].copy_from_slice(&value.to_le_bytes());
        let picture = png(1, 1, &[[9; 4]]);
        let scene = changed(&[
            ("/buffers/0/uri", json!(data_uri(&binary))),
            ("/images", json!([{"uri": data_uri(&picture)}])),
            ("/textures", json!([{"source": 0}])),
            ("/materials/0", json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})),
        ]);
        let error = load_json(&scene).unwrap_err().to_string();
        let vertex = format!("vertex {}: the texture coordinates [", at / 2);
        assert!(error.contains(&vertex) && error.contains("are not finite"), "{error}");
    }
}

use super::*;
use crate::{
    formats::{ReadOptions, load_mesh},
    input::{
        Limits,
        testing::{Folder, png},
    },
};

fn load(text: impl AsRef<[u8]>) -> Result<Mesh> {
    let folder = Folder::new();
    load_mesh(folder.write("a.obj", text), &Limits::default(), &ReadOptions::default())
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

#[test]
fn polygons_negative_indices_and_line_ends() {
    for text in [
        SQUARE.to_owned(),
        SQUARE.replace('\n', "\r\n"),
        SQUARE.replace("f 1 2 3 4", "f -4 -3 -2 -1"),
        SQUARE.replace("f 1 2 3 4", "g a\nl 1 2 3\np 1\nf 1 2 \\\n3 4"),
        SQUARE.trim_end().to_owned(),
    ] {
        let mesh = load(&text).expect(&text);
        assert_eq!(mesh.positions[..4], [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    }
    assert_eq!(
        load([b"# caf\xe9\n", SQUARE.as_bytes()].concat()).expect("Latin-1").triangles.len(),
        2
    );
}

#[test]
fn lines_are_lines() {
    let places = |mesh: &Mesh| -> Vec<[Vec3; 2]> {
        let place = |end: u32| mesh.positions[end as usize] + mesh.origin.as_vec3();
        mesh.lines.iter().map(|ends| ends.map(place)).collect()
    };
    let [a, b, c, d] = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    let wanted = [[a, b], [b, c], [d, a]];
    // Beside faces, with normals that split vertices, and alone: then the fifth vertex is left out.
    let lines = "l 1/1 2/1 3/1\nl -1 1\n";
    let corners = SQUARE.split("f ").next().unwrap();
    for text in [
        format!("{SQUARE}{lines}"),
        format!("{corners}vn 0 0 1\nf 1//1 2//1 3//1 4//1\n{lines}"),
        format!("{corners}{lines}v 9 9 9\n"),
    ] {
        let mesh = load(&text).expect(&text);
        assert_eq!(places(&mesh), wanted, "{text}");
        let alone = text.contains("9 9 9");
        assert_eq!(mesh.triangles.len(), if alone { 0 } else { 2 });
        assert!(!alone || mesh.positions.len() == 4);
    }
    let colored = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nl 2 1\n";
    assert_eq!(load(colored).unwrap().colors, [[0, 255, 0, 255], [255, 0, 0, 255]]);
    for (line, message) in
        [("l 1 9", "vertex 9, which does not exist"), ("l 1 x", "“x”"), ("l -9 1", "“-9”")]
    {
        let error = load(format!("{SQUARE}{line}\n")).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn concave_polygons_cover_themselves_only() {
    let l =
        ([[2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0]].as_slice(), 3.0);
    let dart = ([[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]].as_slice(), 1.5);
    // With a normal, vertices are split. With an extra triangle (of zero area), a model has faces
    // with different numbers of corners.
    for ((outline, area), normal, beside, far) in [
        (l, "", "", 0.0),
        (l, "//1", "", 0.0),
        (l, "", "f 1 2 1\n", 0.0),
        (l, "", "", 5e6),
        (dart, "", "", 0.0),
        (dart, "//1", "f 1//1 2//1 1//1\n", 0.0),
        (dart, "", "", 5e6),
    ] {
        for turned in [false, true] {
            let mut text = String::from("vn 0 0 1\n");
            outline.iter().for_each(|[x, y]| text += &format!("v {} {} 7\n", x + far, y + far));
            let mut face: Vec<String> =
                (1..=outline.len()).map(|vertex| format!("{vertex}{normal}")).collect();
            if turned {
                face.reverse();
            }
            text += &format!("{beside}f {}\n{beside}", face.join(" "));
            let mesh = load(&text).expect(&text);
            let areas: Vec<f32> = mesh
                .triangles
                .iter()
                .map(|t| t.map(|corner| mesh.positions[corner as usize]))
                .map(|[a, b, c]| (b - a).cross(c - a).z * if turned { -0.5 } else { 0.5 })
                .collect();
            assert_eq!(areas.len(), outline.len() - 2 + beside.lines().count() * 2, "{text}");
            assert!(areas.iter().all(|&area| area >= 0.0), "{text}: {areas:?}");
            assert!((areas.iter().sum::<f32>() - area).abs() < 1e-5, "{text}: {areas:?}");
        }
    }
    let error = load(format!("{SQUARE}f\n")).expect_err("a face without corners").to_string();
    assert!(error.contains("line 6: a face has no corners"), "{error}");
}

#[test]
fn every_triangle_of_a_polygon_has_its_material() {
    let head = "v 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nv 0 0 0\n";
    let folder = Folder::new();
    folder.write("m.mtl", "newmtl a\nnewmtl b\n");
    let obj =
        format!("mtllib m.mtl\n{head}usemtl a\nf 1 2 3 4 5 6\nusemtl b\nf 1 2 3\nf 1 2 3 6\n");
    let mesh = load_mesh(folder.write("a.obj", obj), &Limits::default(), &ReadOptions::default())
        .expect("loads");
    let names: Vec<&str> =
        mesh.triangle_materials.iter().map(|&m| mesh.materials[m as usize].name.as_str()).collect();
    assert_eq!(names, ["a", "a", "a", "a", "b", "b", "b"]);
}

#[test]
fn colors_and_clouds() {
    let cloud = "v 0 0 0 1 0.5 0\nv 1 0 0 0 0 1\n";
    let mesh = load(cloud).expect("loads");
    assert_eq!(mesh.colors, [[255, 128, 0, 255], [0, 0, 255, 255]]);
    assert!(mesh.triangles.is_empty());
    let mesh = load(format!("{cloud}v 0 1 0 0 255 0\nf 1 2 3\n")).expect("loads");
    assert_eq!(mesh.colors[2], [0, 255, 0, 255]);
    // Colours of some vertices only are left out, not shifted to others.
    let mesh = load("v 0 0 0\nv 1 0 0 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("loads");
    assert!(mesh.colors.is_empty());
}

#[test]
fn normals_split_vertices_and_partial_ones_are_left_out() {
    let head = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 2\nvn 1 0 0\n";
    let mesh = load(format!("{head}f 1//1 2//1 3//1\nf 1//2 3//2 4//2\n")).expect("loads");
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.normals[0], Vec3::Z);
    assert_eq!(mesh.normals[5], Vec3::X);
    let mesh = load(format!("{head}f 1//1 2//1 3//1\nf 1 3 4\n")).expect("loads");
    assert_eq!((mesh.positions.len(), mesh.normals.len()), (4, 0));
}

/// tobj ends a part of the mesh at each material, with the normals it has read so far.
#[test]
fn faces_may_stand_before_what_they_refer_to() {
    let faces = ["f 1//1 2//1 3//1\n", "usemtl other\nf 1//2 3//2 4//2\n"];
    let positions = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let ahead = load(format!("{}{positions}vn 0 0 1\n{}vn 1 0 0\n", faces[0], faces[1])).unwrap();
    let behind = load(format!("{positions}vn 0 0 1\nvn 1 0 0\n{}{}", faces[0], faces[1])).unwrap();
    assert_eq!((&ahead.positions, &ahead.normals), (&behind.positions, &behind.normals));
    assert_eq!((ahead.triangles, ahead.normals.len()), (behind.triangles, 6));
    let error =
        load(format!("{}{positions}vn 0 0 1\nf -4 -3 -1\n", faces[0])).unwrap_err().to_string();
    assert!(error.contains("line 1: a face refers to vertex 1, which comes after it"), "{error}");
}

#[test]
fn materials_and_pictures() {
    let folder = Folder::new();
    folder.write("t.png", png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 255]]));
    folder.write(
        "a b.mtl",
        "newmtl red\nKd 1 0 0\nd 0.5\n\nnewmtl tex\n\tKd 1 1 1\n\tmap_Kd -s 1 1 \
                           1 -clamp on t.png\n",
    );
    let obj = "mtllib a b.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n\
        usemtl red\nf 1 2 3\nusemtl tex\nf 1/1 3/3 4/2\nusemtl unknown\nf 1 2 4\n";
    let mesh = load_mesh(folder.write("a.obj", obj), &Limits::default(), &ReadOptions::default())
        .expect("loads");
    let names: Vec<&str> =
        mesh.triangle_materials.iter().map(|&m| mesh.materials[m as usize].name.as_str()).collect();
    assert_eq!(names, ["red", "tex", "none"]);
    let material = &mesh.materials[mesh.triangle_materials[1] as usize];
    assert_eq!(
        material.texture.as_ref().expect("a picture").texels,
        [[255, 0, 0, 255], [0, 255, 0, 255]]
    );
    assert_eq!(mesh.materials[mesh.triangle_materials[0] as usize].color, [1.0, 0.0, 0.0, 0.5]);
    assert_eq!(mesh.uvs[mesh.triangles[1][1] as usize], Vec2::new(1.0, 0.0));
    assert_eq!(mesh.uvs.len(), mesh.positions.len());
    let limits = Limits { texels: 1, ..Limits::default() };
    assert!(matches!(
        load_mesh(folder.path("a.obj"), &limits, &ReadOptions::default()),
        Err(Error::Limit { found: 2, .. })
    ));
}

/// Only `d` is part of the format; `Tr` has two meanings.
#[test]
fn opacities_of_materials() {
    let folder = Folder::new();
    for (statements, opacity) in [
        ("", 1.0),
        ("d 0.25", 0.25),
        ("Tr 0.25", 0.75),
        ("Tr 1.000000", 1.0),
        ("Tr 0", 1.0),
        ("d 1.0\nTr 1.0", 1.0),
        ("Tr 0.5\nd 0.25", 0.25),
        ("d 0.25\nTr 0.25", 0.25),
        ("d 0", 0.0),
    ] {
        folder.write("a.mtl", format!("newmtl m\nKd 1 1 1\n{statements}\n"));
        let obj = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let mesh =
            load_mesh(folder.write("a.obj", obj), &Limits::default(), &ReadOptions::default())
                .expect("loads");
        assert_eq!(
            mesh.materials[mesh.triangle_materials[0] as usize].color[3], opacity,
            "{statements}"
        );
    }
}

#[test]
fn missing_files_are_warnings_and_traversal_is_refused() {
    assert_eq!(
        load(format!("mtllib no.mtl\nusemtl a\n{SQUARE}")).expect("loads").triangles.len(),
        2
    );
    for path in
        ["../up.mtl", "/etc/hostname", "a/../../up.mtl", "..\\up.mtl", "file:///etc/hostname"]
    {
        let error = load(format!("mtllib {path}\n{SQUARE}")).expect_err(path).to_string();
        assert!(error.contains("refers to “") && error.contains("folder"), "{error}");
    }
    let folder = Folder::new();
    for (mtl, reason) in [
        ("newmtl a\nmap_Kd ../up.png\n", "leads out of the file's own folder"),
        ("newmtl a\nKd 1\n", ""),
        ("newmtl a\nKd 1 2\nd\nd half\n", ""),
        ("newmtl a\nKd x y z\n", ""),
        ("newmtl a\nKd nan 1 1\nmap_Kd\nmap_Kd no.png\nmap_Kd -s\n", ""),
    ] {
        folder.write("m.mtl", mtl);
        let loaded = load_mesh(
            folder.write("a.obj", format!("mtllib m.mtl\n{SQUARE}")),
            &Limits::default(),
            &ReadOptions::default(),
        );
        match loaded {
            Ok(_) => assert!(reason.is_empty(), "{mtl}"),
            Err(error) => {
                assert!(!reason.is_empty() && error.to_string().contains(reason), "{mtl}: {error}");
            }
        }
    }
}

#[test]
fn broken_statements_are_errors_with_their_line() {
    for (text, reason) in [
        (SQUARE.replace("v 1 0 0", "v 1 nan 0"), "each face uses a vertex that is not at finite"),
        (SQUARE.replace("v 1 0 0", "v 1 0"), "line 2: position parse error"),
        (SQUARE.replace("v 1 0 0", "v 1,0 0 0"), "line 2"),
        (SQUARE.replace("3 4", "3 5"), "line 5: a face refers to vertex 5"),
        (SQUARE.replace("3 4", "3 0"), "line 5"),
        (SQUARE.replace("3 4", "3 -5"), "line 5"),
        (SQUARE.replace("3 4", "3 9223372036854775807"), "line 5"),
        (SQUARE.replace("3 4", "3 4/a"), "not a face corner"),
        (SQUARE.replace("3 4", "3 4/1/1/1"), "line 5"),
        (String::new(), "no vertices"),
        ("{}".into(), "no vertices"),
    ] {
        let error = load(&text).expect_err(&text).to_string();
        assert!(error.contains(reason), "{text}: {error}");
    }
}

#[test]
fn what_other_programs_read_is_read() {
    let triangles = |text: &str| load(text).unwrap_or_else(|e| panic!("{text}: {e}")).triangles;
    for text in [
        format!("\u{feff}{SQUARE}"),
        SQUARE.replace("3 4", "3 4/1"),
        SQUARE.replace("3 4", "3 4//1"),
        SQUARE.replace("1 2 3 4", "1/-1/-1 2/-2 3/9/9 4"),
        SQUARE.replace("f 1", "usemtl\nf 1"),
        SQUARE.replace("f 1", "usemtl\ta b\nf 1"),
        SQUARE.replace("f 1", "mtllib\nf 1"),
        SQUARE.replace("f 1", "g f 9 9 9\no v f 1\ng\nf 1"),
        SQUARE.replace("3 4", "3 4 # all of it"),
        SQUARE.replace("0 1 0\n", "0 1 0 # the last\n"),
        SQUARE.trim_end().replace("\n", "  \n"),
        format!("{SQUARE}vt 0 0\nf 1/1 2/7 9999999/1\n").replace("9999999/1", "3/1"),
    ] {
        assert_eq!(triangles(&text)[..2], [[0, 1, 2], [0, 2, 3]], "{text}");
    }
    // Without faces, it may be a mesh that is cut within its vertices.
    let error = load("v 1 2 3\nv 4 5 6").unwrap_err().to_string();
    assert!(error.contains("ends within a line"), "{error}");
}

#[test]
fn vertices_without_a_place_are_left_out() {
    for bad in ["nan nan nan", "1 -nan(ind) 0", "1.#QNAN 0 0", "0 -inf 0", "1e999 0 0"] {
        let mesh = load(format!("{SQUARE}v {bad}\nf 1 2 5\nf 1 2 3 5\n")).expect(bad);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2), "{bad}");
        let cloud = load(format!("v 1 2 3\nv {bad}\nv 4 5 6\n")).expect(bad);
        assert_eq!(cloud.positions.len(), 2, "{bad}");
    }
}

#[test]
fn pictures_are_tiled_and_masked() {
    let folder = Folder::new();
    folder.write("a b.png", png(1, 1, &[[10, 20, 30, 255]]));
    folder.write("mask.png", png(2, 1, &[[0, 0, 0, 255], [255, 255, 255, 255]]));
    folder.write("a.mtl", "newmtl m\nmap_Kd -s 2 3 1 -o 0.5 a b.png\nmap_d mask.png\n");
    let obj =
        format!("mtllib a.mtl\nvt 1 1\nusemtl m\n{}", SQUARE.replace("1 2 3 4", "1/1 2/1 3/1"));
    let mesh = load_mesh(folder.write("a.obj", obj), &Limits::default(), &ReadOptions::default())
        .expect("loads");
    // From the bottom left corner: 1 · 2 + 0.5 and 1 · 3.
    assert_eq!(mesh.uvs[0], Vec2::new(2.5, -2.0));
    let texture = mesh.materials[0].texture.as_ref().expect("a picture");
    assert_eq!(texture.texels, [[10, 20, 30, 0], [10, 20, 30, 255]]);
}

#[test]
fn a_cut_file_never_panics() {
    let text =
        format!("mtllib no.mtl\no name\nvt 0 0\nvn 0 0 1\n{SQUARE}usemtl x\nf 1/1/1 2/1/1 3/1/1\n");
    for length in 0..text.len() {
        let _ = load(&text[..length]);
    }
}

#[test]
fn large_coordinates_keep_their_precision() {
    let mesh = load(
        "v 4500000.125 5600000.25 1\nv 4500001.125 5600000.25 1\nv 4500000.125 5600001.5 1\nf 1 2 \
         3\n",
    );
    let mesh = mesh.expect("loads");
    assert_eq!(
        mesh.origin + mesh.positions[2].as_dvec3(),
        DVec3::new(4_500_000.125, 5_600_001.5, 1.0)
    );
}

/// Texture coordinates that are not numbers, or do not fit in 32 bits, matter only if there is a
/// picture.
#[test]
fn texture_coordinates_are_finite() {
    let folder = Folder::new();
    folder.write("t.png", png(1, 1, &[[9; 4]]));
    folder.write("m.mtl", "newmtl a\nmap_Kd t.png\nnewmtl b\n");
    let obj = |uv: &str, material: &str| {
        let text = format!(
            "mtllib m.mtl\nusemtl {material}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt {uv}\nvt 1 1\n\
             f 1/1 2/2 3/3\n"
        );
        load_mesh(folder.write("a.obj", text), &Limits::default(), &ReadOptions::default())
    };
    for uv in ["inf 0", "0 NaN", "-inf nan", "1e39 0", "0 -1e400"] {
        let error = obj(uv, "a").unwrap_err().to_string();
        assert!(
            error.contains("a.obj: line 7: the texture coordinates [")
                && error.contains("not finite"),
            "{error}"
        );
        assert!(obj(uv, "b").is_ok());
    }
    assert!(obj("3e38 -1e38", "a").is_ok());
}

//! Which way is up, what fills the picture, and where it goes.

use crate::common::*;
use serde_json::Value;
use std::fmt::Write;

const SMALL: &str = "--size 64x48 --engine cpu";

/// A table on four legs, with this axis up, as OBJ. No format states how it stands.
fn table(up: usize) -> String {
    let mut out = String::new();
    let mut count = 0;
    let mut add = |middle: [f64; 3], sides: [f64; 3]| {
        for corner in 0..8 {
            let at = |axis: usize| {
                let sign = if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
                middle[axis] + sign * sides[axis]
            };
            // The third axis becomes the one that is up.
            let turned: [f64; 3] = std::array::from_fn(|axis| at((axis + 5 - up) % 3));
            writeln!(out, "v {} {} {}", turned[0], turned[1], turned[2]).expect("text");
        }
        for face in ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"] {
            let corners = face.split(' ').map(|c| c.parse::<usize>().expect("a number") + count);
            let corners: Vec<String> = corners.map(|corner| corner.to_string()).collect();
            writeln!(out, "f {}", corners.join(" ")).expect("text");
        }
        count += 8;
    };
    add([0.0, 0.0, 1.0], [2.0, 1.2, 0.1]);
    for [x, y] in [[-0.9, -0.5], [0.9, -0.5], [-0.9, 0.5], [0.9, 0.5]] {
        add([x, y, 0.5], [0.1, 0.1, 1.0]);
    }
    out
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("y.obj", table(1));
    folder.put("z.obj", table(2));
    folder.put("x.obj", table(0));
    folder.put("survey.xyz", "0 0 0\n1 0 0\n0 1 0\n1 1 0.1\n0.5 0.5 0.3\n");
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("square.glb", glb());
    folder
}

fn draw(folder: &Folder, arguments: &str) -> Value {
    folder.json(&format!("render {arguments} -o out.png --overwrite --json {SMALL}"))
}

fn numbers(value: &Value) -> [f64; 3] {
    std::array::from_fn(|axis| value[axis].as_f64().expect("a number"))
}

#[test]
fn statements_count_more_than_conventions_and_these_more_than_guesses() {
    let folder = folder();
    for (inputs, up, from) in [
        ("x.obj", "+X", "guess"),
        ("y.obj", "+Y", "guess"),
        ("z.obj", "+Z", "guess"),
        ("z.obj y.obj", "+Z", "guess"),
        ("y.obj survey.xyz", "+Z", "file"),
        ("survey.xyz y.obj", "+Z", "file"),
        ("y.obj a.nrrd", "+Z", "convention"),
        ("a.nrrd y.obj", "+Z", "convention"),
        ("a.nrrd square.glb", "+Y", "file"),
        ("square.glb a.nrrd", "+Y", "file"),
        ("square.glb survey.xyz", "+Y", "file"),
        ("survey.xyz square.glb", "+Z", "file"),
        ("y.obj --up -X", "-X", "flag"),
    ] {
        let report = draw(&folder, inputs);
        assert_eq!((report["up"].as_str(), report["up_from"].as_str()), (Some(up), Some(from)));
    }
    let stderr = folder.run(&format!("render survey.xyz square.glb -o b.png {SMALL}")).stderr();
    assert!(
        stderr.contains("square.glb is turned: it stands with +Y up, and the input before with +Z"),
        "{stderr}"
    );
    let stderr = folder.run(&format!("render y.obj -o c.png {SMALL}")).stderr();
    assert!(
        stderr.contains("up: +Y, front: +Z, guessed from the shape; --up sets another"),
        "{stderr}"
    );
    // Warnings of the library look as those of the command do.
    let text = std::fs::read_to_string(folder.path("y.obj")).expect("text");
    folder.write("m.obj", format!("mtllib none.mtl\n{text}"));
    let stderr = folder.run(&format!("render m.obj -o e.png {SMALL}")).stderr();
    assert!(stderr.lines().any(|line| line.starts_with("warning: m.obj: mtllib")), "{stderr}");
    let stderr = folder.run(&format!("render y.obj -o d.png -q {SMALL}")).stderr();
    assert_eq!(stderr, "");
}

#[test]
fn a_hierarchy_is_drawn_as_its_mesh_is() {
    let folder = folder();
    folder.put("sheet.ply", sheet(40));
    for name in ["x.obj", "sheet.ply", "survey.xyz"] {
        folder.run(&format!("convert {name} -o tree.splk --overwrite")).ok();
        let (mesh, tree) = (draw(&folder, name), draw(&folder, "tree.splk"));
        assert_eq!((&mesh["up"], &mesh["up_from"]), (&tree["up"], &tree["up_from"]), "{name}");
        let [a, b] = [&mesh, &tree].map(|report| numbers(&report["camera"]["position"]));
        let size = a.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 1e-2 * size, "{name}: {a:?} {b:?}");
    }
    folder.run("convert y.obj -o tree.splk --overwrite --up -z").ok();
    assert_eq!(folder.json("info tree.splk --json")["up"], "-Z");
    let report = draw(&folder, "tree.splk");
    assert_eq!((report["up"].as_str(), report["up_from"].as_str()), (Some("-Z"), Some("file")));
}

#[test]
fn named_views_look_from_their_sides() {
    let folder = folder();
    for (view, toward) in [
        ("front", [0.0, -1.0, 0.0]),
        ("back", [0.0, 1.0, 0.0]),
        ("right", [1.0, 0.0, 0.0]),
        ("left", [-1.0, 0.0, 0.0]),
        ("top", [0.0, 0.0, 1.0]),
        ("bottom", [0.0, 0.0, -1.0]),
        ("iso", [1.0, -1.0, 1.0].map(|v: f64| v / 3f64.sqrt())),
    ] {
        let report = draw(&folder, &format!("z.obj --view {view}"));
        let [eye, focus] = ["position", "focal_point"].map(|name| numbers(&report["camera"][name]));
        let away: [f64; 3] = std::array::from_fn(|axis| eye[axis] - focus[axis]);
        let length = away.iter().map(|v| v * v).sum::<f64>().sqrt();
        for axis in 0..3 {
            assert!((away[axis] / length - toward[axis]).abs() < 1e-9, "{view}: {away:?}");
        }
    }
    let report = draw(&folder, "z.obj --view right --azimuth 90 --distance 7");
    let [eye, focus] = ["position", "focal_point"].map(|name| numbers(&report["camera"][name]));
    assert!((eye[1] - focus[1] - 7.0).abs() < 1e-9, "{eye:?}");
}

#[test]
fn a_turntable_keeps_its_distance() {
    let folder = folder();
    let run = folder.run(&format!("render z.obj -o turn.png --turntable 5 --json {SMALL}"));
    let stderr = run.stderr();
    assert!(
        stderr.contains("turn_0000.png to turn_0004.png: 5 frames of 64 × 48 pixels"),
        "{stderr}"
    );
    let last: Value = serde_json::from_slice(&run.ok().stdout).expect("JSON");
    let first = draw(&folder, "z.obj");
    let distance = |report: &Value| {
        let [eye, focus] = ["position", "focal_point"].map(|name| numbers(&report["camera"][name]));
        eye.iter().zip(focus).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    // All frames fit, so none is nearer than a fitted one.
    assert!(distance(&last) > 0.9 * distance(&first), "{last}");
}

#[test]
fn a_file_alone_is_drawn_beside_itself() {
    let folder = folder();
    let mut stderr = folder.run(&format!("z.obj {SMALL}")).stderr();
    assert!(stderr.contains("z.png: 64 × 48 pixels, "), "{stderr}");
    let first = std::fs::read(folder.path("z.png")).expect("a picture");
    assert!(is_png(&first, 64, 48));
    stderr = folder.run(&format!("render z.obj --view top {SMALL}")).stderr();
    assert!(stderr.contains("z_2.png: 64 × 48 pixels, "), "{stderr}");
    assert_eq!(std::fs::read(folder.path("z.png")).expect("a picture"), first);
    folder.run(&format!("z.obj --view top --overwrite {SMALL}")).ok();
    assert_ne!(std::fs::read(folder.path("z.png")).expect("a picture"), first);
    assert!(!folder.path("z_3.png").exists());
}

//! Colours of values and of surfaces, and the texts over pictures.

use crate::common::*;
use serde_json::json;

const SMALL: &str = "--size 200x150 --overwrite --json";

/// A sheet of 21 × 21 vertices with a value that rises along x, and one without a number.
fn sheet(with_faces: bool) -> String {
    let mut vertices = String::new();
    for j in 0..21 {
        for i in 0..21 {
            let value = if i + j == 0 { "nan".to_owned() } else { format!("{}", i * 10) };
            vertices += &format!("{i} {j} 0 {value} 7\n");
        }
    }
    let mut faces = String::new();
    let corner = |i: usize, j: usize| j * 21 + i;
    for (i, j) in (0..400).map(|at| (at % 20, at / 20)) {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        faces += &format!("4 {a} {b} {c} {d}\n");
    }
    let head = "ply\nformat ascii 1.0\nelement vertex 441\nproperty float x\nproperty float y\n\
        property float z\nproperty float heat\nproperty float scalar_Age\n";
    match with_faces {
        true => format!(
            "{head}element face 400\nproperty list uchar int vertex_indices\nend_header\n\
             {vertices}{faces}"
        ),
        false => format!("{head}end_header\n{vertices}"),
    }
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("sheet.ply", sheet(true));
    folder.put("cloud.ply", sheet(false));
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.obj", OBJ);
    folder
}

#[test]
fn values_colour_surfaces_and_the_bar_says_how() {
    let folder = folder();
    let bar_of = |flags: &str| {
        let report = folder.json(&format!("render {flags} -o out.png --scalar-bar {SMALL}"));
        report["overlay"]["scalar_bars"][0].clone()
    };
    let bar = bar_of("sheet.ply --scalar heat");
    assert_eq!((bar["title"].as_str(), &bar["range"]), (Some("heat"), &json!([0.0, 200.0])));
    assert_eq!(bar_of("sheet.ply --color heat"), bar);
    // Outliers of point clouds do not count; the name may leave out what CloudCompare adds.
    assert_eq!(bar_of("cloud.ply --color heat")["range"], bar["range"]);
    assert_eq!(bar_of("cloud.ply --color age")["range"], json!([7.0, 7.0]));
    assert_eq!(bar_of("sheet.ply --color heat --range 10,50")["range"], json!([10.0, 50.0]));
    let height = bar_of("sheet.ply --color height --up +Y");
    assert_eq!((height["title"].as_str(), &height["range"]), (Some("height"), &json!([0.0, 20.0])));
    let log = bar_of("sheet.ply --color heat --log-colors --colormap turbo_r --nan-color red");
    assert_eq!((&log["log"], &log["range"]), (&json!(true), &json!([10.0, 200.0])));
    let volume = bar_of("a.nrrd --colormap coolwarm --range 0,255 --iso 50:orange");
    assert_eq!(volume["range"], json!([0.0, 255.0]));
    assert_eq!(volume["ticks"][1], 100.0);
}

#[test]
fn colours_change_the_picture() {
    let folder = folder();
    let draw = |name: &str, flags: &str| {
        folder.json(&format!("render {flags} -o {name}.png {SMALL}"));
    };
    draw("plain", "sheet.ply");
    for (name, flags) in [
        ("viridis", "sheet.ply --color heat"),
        ("reversed", "sheet.ply --color heat --colormap viridis_r"),
        ("orange", "sheet.ply --color orange"),
        ("normal", "sheet.ply --color normal"),
        ("height", "sheet.ply --color height"),
        ("log", "sheet.ply --color heat --log-colors"),
        ("bar", "sheet.ply --color heat --scalar-bar"),
        ("axes", "sheet.ply --axes"),
        ("ruler", "sheet.ply --scale-bar"),
        ("caption", "sheet.ply --caption Heat"),
    ] {
        draw(name, flags);
        folder.run(&format!("compare plain.png {name}.png --threshold 50")).fails(5, &[]);
    }
    draw("same", "sheet.ply --color #f80");
    draw("hex", "sheet.ply --color #ff8800");
    folder.run("compare same.png hex.png --threshold 90").ok();
    folder.run("compare orange.png hex.png --threshold 60").fails(5, &[]);
    // A converted file keeps the colours.
    folder.run("convert sheet.ply -o sheet.splk --color heat --lossless").ok();
    draw("whole", "sheet.splk");
    folder.run("compare viridis.png whole.png --threshold 28").ok();
    folder.run("compare plain.png whole.png --threshold 28").fails(5, &[]);
}

#[test]
fn flags_without_effect_are_told() {
    let folder = folder();
    folder.run("convert sheet.ply -o sheet.splk").ok();
    for (flags, code, words) in [
        ("sheet.ply --color heats", 3, &["no array “heats”", "scalar_Age"][..]),
        ("a.obj --color heat", 3, &["neither a colour nor an attribute", "orange"]),
        ("a.obj --colormap viridis", 2, &["--colormap has no effect", "--color height"]),
        ("a.obj --scalar-bar", 2, &["--scalar-bar has nothing to show", "--color with height"]),
        ("a.nrrd --color height", 2, &["--color colours meshes"]),
        ("sheet.splk --color height", 2, &["--color colours meshes", "converted"]),
        ("a.nrrd --colormap virids", 2, &["virids", "viridis", "_r"]),
        ("a.nrrd --colormap hot --log-colors --range 0,9", 2, &["--log-colors", "--range"]),
        ("a.nrrd --background oranje", 2, &["#rgb", "orange", "none"]),
    ] {
        let run = format!("render {flags} -o out.png");
        folder.run(&run).fails(code, words);
    }
    folder.run("convert a.nrrd -o b.nrrd --colormap hot").fails(2, &["--colormap colours meshes"]);
}

/// An input's own colour and opacity count more than those of all inputs.
#[test]
fn each_input_has_its_colour_and_opacity() {
    let folder = folder();
    let view = "--camera-position 10,10,60 --focal-point 10,10,0 --view-up 0,1,0 --no-shade";
    // The mean of 40 × 40 pixels in the middle of the sheet.
    let middle = |flags: &str| {
        let raw = format!("render sheet.ply {flags} -o - --raw --size 600x600 {view} --engine cpu");
        let pixels = folder.run(&raw).ok().stdout;
        let rows = pixels.chunks_exact(4 * 600).skip(280).take(40);
        let inside = rows.flat_map(|row| row.chunks_exact(4).skip(280).take(40));
        let sums = inside
            .fold([0; 4], |sums, pixel| [0, 1, 2, 3].map(|at| sums[at] + u32::from(pixel[at])));
        sums.map(|sum| sum / 1600)
    };
    let opaque = middle("--color orange --background none");
    assert!(opaque[3] == 255 && opaque[0] > opaque[2], "{opaque:?}");
    let half = middle("--color sheet.ply=orange --opacity sheet.ply=0.5 --background none");
    assert!((120..136).contains(&half[3]) && half[0] > half[2], "{half:?}");
    let shared = middle("--color orange --color sheet.ply=blue --background none");
    assert!(shared[2] > shared[0], "{shared:?}");
    for (flags, word) in [
        ("--color gone.ply=red", "no input has this name"),
        ("--opacity 0.5 --opacity 0.2", "given twice"),
        ("--opacity 0", "above 0"),
    ] {
        folder.run(&format!("render sheet.ply -o y.png {flags}")).fails(2, &[word]);
    }
}

//! Scene files: the same picture as from flags, and errors that name what is wrong.

use crate::common::*;

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder
}

#[test]
fn a_scene_file_draws_what_its_flags_draw() {
    let folder = folder();
    let camera = r#"{"position": [40, -20.1, 25], "focal_point": [7, 7.3, 7], "view_up": [0, 0, 1],
        "view_angle": 31.7}"#;
    let transfer = r#"{"color": [[0, 0.9, 0.5, 0.1]], "opacity": [[60, 0], [200, 0.7]],
        "unit": 1.5, "shade": {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "power": 10}}"#;
    std::fs::create_dir(folder.path("scenes")).unwrap();
    folder.put(
        "scenes/s.json",
        format!(
            r#"{{"splatkit_scene": 2, "inputs": [{{"file": "../a.nrrd"}}, {{"file": "../a.ply"}}],
                "camera": {camera}, "appearance": {{"transfer": {transfer}}},
                "picture": {{"size": [64, 48], "background": "white",
                             "clips": [{{"plane": [1, 0, 0, 9.5]}}]}},
                "engine": "cpu"}}"#
        ),
    );
    folder
        .run_with(&[
            "render",
            "a.nrrd",
            "a.ply",
            "--size=64x48",
            "--camera",
            camera,
            "--transfer",
            transfer,
            "--clip=plane:1,0,0,9.5",
            "--background=white",
            "--engine=cpu",
            "-o",
            "flags.png",
        ])
        .ok();
    folder
        .run("render scenes/s.json -o scene.png")
        .fails(3, &["scenes/s.json: inputs[0].file", "../a.nrrd", "--trust-scene"]);
    folder.run("render scenes/s.json -o scene.png --trust-scene").ok();
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert!(is_png(&read("scene.png"), 64, 48));
    assert_eq!(read("flags.png"), read("scene.png"));
    // Flags beside the scene count more.
    folder.run("render scenes/s.json --trust-scene -o other.png --size 32x32 --azimuth 70").ok();
    assert!(is_png(&read("other.png"), 32, 32));
    // A transfer function in a file of its own, seen from the scene's folder.
    folder.put("scenes/t.json", transfer);
    let named = std::fs::read_to_string(folder.path("scenes/s.json")).unwrap();
    folder.put("scenes/n.json", named.replace(transfer, "\"t.json\""));
    folder.run("render scenes/n.json -o named.png --trust-scene").ok();
    assert_eq!(read("named.png"), read("scene.png"));
    // The file itself draws beside itself.
    folder.run("scenes/s.json -o same.png --trust-scene").ok();
    assert_eq!(read("same.png"), read("scene.png"));
    let report = folder.json("bench scenes/s.json --trust-scene --frames 1 --json");
    assert!(report.is_object());
}

#[test]
fn a_camera_that_was_printed_is_taken_again() {
    let folder = folder();
    let flags = "--size 64x48 --engine cpu --orthographic --azimuth 33";
    let report = folder.json(&format!("render a.ply {flags} -o a.png --json"));
    let camera = report["camera"].to_string();
    folder
        .run_with(&[
            "render",
            "a.ply",
            "--size=64x48",
            "--engine=cpu",
            "--camera",
            &camera,
            "-o",
            "b.png",
        ])
        .ok();
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert_eq!(read("a.png"), read("b.png"));
    folder.run("render a.ply -o c.png --camera {}").fails(2, &["position"]);
}

#[test]
fn wrong_scenes_name_what_is_wrong() {
    let folder = folder();
    let wrong = |text: &str, words: &[&str]| {
        folder.put("s.json", text);
        folder.run("render s.json -o x.png").fails(3, &[&["s.json"], words].concat());
    };
    let input = r#""splatkit_scene": 2, "inputs": [{"file": "a.ply"}]"#;
    wrong("{", &["EOF", "line 1"]);
    wrong(r#"{"splatkit_scene": 1, "inputs": [{"file": "a.ply"}]}"#, &["version 2"]);
    wrong(r#"{"splatkit_scene": 2, "inputs": []}"#, &["no input"]);
    wrong(&format!("{{{input}, \"sise\": [1, 1]}}"), &["sise"]);
    let picture = |text: &str| format!("{{{input}, \"picture\": {text}}}");
    wrong(&picture(r#"{"output": "y.png"}"#), &["picture", "output"]);
    wrong(&picture(r#"{"backgroud": "red"}"#), &["picture", "backgroud"]);
    wrong(&picture(r#"{"clips": [{}]}"#), &["picture.clips", "a plane, a side or a box"]);
    let hidden = r#"{"splatkit_scene": 2, "inputs": [{"file": "a.ply", "visible": false}]}"#;
    wrong(hidden, &["visible"]);
    folder.put("s.json", format!("{{{input}}}"));
    folder.run("render s.json a.ply -o x.png").fails(2, &["drawn alone"]);
    folder.run("render none.json -o x.png").fails(3, &["none.json"]);
}

/// A scene is an input: it raises no limits, reads nothing elsewhere, asks no server, and says as
/// much as a picture can show.
#[test]
fn scenes_of_strangers_are_bounded() {
    let folder = folder();
    std::fs::create_dir(folder.path("s")).unwrap();
    folder.put("s/a.ply", PLY);
    let scene = |inputs: &str, more: &str| {
        let text = format!(r#"{{"splatkit_scene": 2, "inputs": [{inputs}]{more}}}"#);
        folder.put("s/s.json", text);
        folder.run("render s/s.json -o s.png --engine cpu --size 8x8")
    };
    let input = r#"{"file": "a.ply"}"#;
    scene(input, r#", "reading": {"limits": {"bytes": 1000000, "seconds": 60}}"#).ok();
    let many = vec![input; 10_001].join(",");
    let letters = "A".repeat(500_000);
    for (inputs, more, words) in [
        (r#"{"file": "../a.ply"}"#, "", ["inputs[0].file", "--trust-scene"]),
        (r#"{"file": "https://127.0.0.1:1/a.ply"}"#, "", ["inputs[0].file", "--trust-scene"]),
        (
            input,
            r#", "appearance": {"transfer": "/etc/hostname"}"#,
            ["“/etc/hostname”", "--trust-scene"],
        ),
        (input, r#", "reading": {"labels": "../a.ply"}"#, ["reading.labels", "--trust-scene"]),
        (
            input,
            r#", "reading": {"limits": {"bytes": 9000000000000}}"#,
            ["reading.limits.bytes", "only lower"],
        ),
        (input, r#", "picture": {"memory": 1000000000}"#, ["picture.memory", "--memory"]),
        (input, r#", "gpu_timeout": 1e9"#, ["gpu_timeout", "unknown field"]),
        (&many, "", ["there are 10001", "at most 10000"]),
        (
            input,
            &format!(r#", "overlay": {{"caption": "{letters}"}}"#),
            ["overlay.caption", "has 500000 letters"],
        ),
    ] {
        let words = [&["s/s.json"], &words[..]].concat();
        scene(inputs, more).fails(3, &words);
    }
}

/// Flags and scene files move inputs alike, and a flag counts more than the scene's own value.
#[test]
fn inputs_are_moved_by_flags_as_by_scene_files() {
    let folder = folder();
    let scene = |turn: &str| {
        format!(
            r#"{{"splatkit_scene": 2, "inputs": [{{"file": "a.nrrd"}}, {{"file": "a.ply",
                "transform": {{"scale": 9, "rotate": {turn}, "translate": [-3, 0.5, 12]}}}}],
                "picture": {{"size": [48, 48]}}, "engine": "cpu"}}"#
        )
    };
    folder.put("s.json", scene(r#"{"axis": [0, 1, 1], "degrees": 40}"#));
    folder.put("other.json", scene(r#"{"axis": [1, 0, 0], "degrees": 5}"#));
    let given = "render a.nrrd a.ply --size 48x48 --engine cpu";
    folder.run(&format!("{given} -o still.png")).ok();
    folder.run("render s.json -o scene.png").ok();
    folder.run("render other.json -o changed.png --rotate a.ply=0,1,1:40").ok();
    let moved = "--scale a.ply=9 --rotate a.ply=0,1,1:40 --translate a.ply=-3,0.5,12";
    folder.run(&format!("{given} {moved} -o flags.png")).ok();
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert_eq!(read("flags.png"), read("scene.png"));
    assert_eq!(read("flags.png"), read("changed.png"));
    assert_ne!(read("flags.png"), read("still.png"));
}

#[test]
fn moves_that_cannot_be_are_refused() {
    let folder = folder();
    for (flags, message) in [
        ("--rotate w:90", "an axis is one of"),
        ("--scale b.ply=2", "--scale b.ply=…: no input has this name"),
        ("--translate 1,2,3 --translate 4,5,6", "--translate is given twice for all inputs"),
    ] {
        folder.run(&format!("render a.ply -o a.png {flags}")).fails(2, &[message]);
    }
    folder.run("convert a.ply -o a.splk").ok();
    let refused = ["a.splk: transform", "read page by page", "move the file"];
    folder.run("render a.splk -o a.png --scale 2").fails(3, &refused);
}

//! Whose fault a wrong value is: that of the file that states it (exit code 3, with the file's
//! name), or that of a flag (exit code 2).

use crate::common::*;

/// A volume of 4³ samples with these steps and this origin, as MetaImage.
fn volume(spacing: &str, origin: &str) -> Vec<u8> {
    let mut out = format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = {spacing}\n\
         Offset = {origin}\nDimSize = 4 4 4\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
    )
    .into_bytes();
    out.extend((0..64).map(|value| value * 4));
    out
}

/// Points as a table.
fn points(scale: &str) -> String {
    let row = |i: usize| format!("{}{scale} {}{scale} {}{scale}\n", i % 3, i / 3 % 3, i / 9);
    (0..27).map(row).collect()
}

/// `check` and `render` agree on what no camera sees, and name the file and what it says.
#[test]
fn places_past_any_camera_are_the_files_fault() {
    let folder = Folder::new();
    folder.put("far.mha", volume("1 1 1e19", "0 0 0"));
    folder.put("moved.mha", volume("1e17 1e17 1e17", "5e17 0 0"));
    folder.put("tiny.mha", volume("1e-30 1e-30 1e-30", "0 0 0"));
    folder.put("far.xyz", points("e17"));
    folder.put("near.mha", volume("1 1 1", "0 0 0"));
    for name in ["far.mha", "moved.mha", "tiny.mha", "far.xyz"] {
        for engine in ["--engine cpu", "--reference"] {
            let run = folder.run(&format!("render {name} -o a.png --size 16x16 {engine}"));
            run.fails(3, &[name, "e"]);
        }
    }
    for name in ["far.mha", "moved.mha"] {
        let run = folder.run(&format!("check {name}"));
        assert!(run.code() == Some(3) && run.printed().contains(name), "{}", run.printed());
    }
    // Of two inputs, the one that is far is named, wherever it stands.
    for inputs in ["near.mha moved.mha", "moved.mha near.mha"] {
        let run = folder.run(&format!("render {inputs} -o a.png --size 16x16 --engine cpu"));
        assert!(run.stderr().contains("moved.mha: bounds"), "{}", run.stderr());
        run.fails(3, &["the camera"]);
    }
    // A sound file with a camera that is too far is wrong usage.
    folder.run("check near.mha").ok();
    folder
        .run("render near.mha -o a.png --size 16x16 --engine cpu --camera-position 1e30,0,0")
        .fails(2, &["the camera is"]);
    folder
        .run("render near.mha -o a.png --size 16x16 --engine cpu --zoom 1e30")
        .fails(2, &["the camera shows"]);
}

/// A path's camera that sees nothing is the path's fault, and so are times of endless films.
#[test]
fn cameras_of_a_path_are_the_paths_fault() {
    let folder = Folder::new();
    folder.put("near.mha", volume("1 1 1", "0 0 0"));
    let path = |position: &str, time: &str| {
        let camera = |position: &str| {
            format!(
                r#"{{"position": [{position}], "focal_point": [0, 0, 0], "view_up": [0, 0, 1],
                "view_angle": 30}}"#
            )
        };
        format!(
            r#"{{"splatkit_path": 1, "keyframes": [{{"time": 0, "camera": {}}},
            {{"time": {time}, "camera": {}}}]}}"#,
            camera("0, -20, 0"),
            camera(position)
        )
    };
    folder.put("path.json", path("0, -1e20, 0", "0.04"));
    let render = "render near.mha -o a.png --size 16x16 --engine cpu --path path.json";
    folder.run(render).fails(3, &["path.json", "“camera” of keyframe 2", "1e20 away"]);
    folder.put("path.json", path("0, -21, 0", "1e9"));
    folder.run(render).fails(3, &["path.json", "“time”", "1000000000 s", "too many frames"]);
    // At a rate that the user gives, the rate is at fault.
    folder.put("path.json", path("0, -21, 0", "200"));
    folder.run(&format!("{render} --fps 1000")).fails(2, &["path.json", "1000 frames"]);
}

/// Values that a scene file states are the scene's fault, unless the user gives them beside it.
#[test]
fn values_of_a_scene_are_the_scenes_fault() {
    let folder = Folder::new();
    folder.put("near.mha", volume("1 1 1", "0 0 0"));
    let render = "render s.json -o a.png --engine cpu";
    for (rest, words) in [
        (r#""appearance": {"crease": 255}"#, ["appearance.crease", "angle", "0 to 180 degrees"]),
        (r#""appearance": {"sigma": -1}"#, ["appearance.sigma", "standard deviation", "0"]),
        (r#""framing": {"view_angle": "wide"}"#, ["framing.view_angle", "wide", "f64"]),
        (r#""framing": {"view": "inside"}"#, ["framing.view", "inside", "front"]),
        (r#""appearance": {"range": [5, 1]}"#, ["appearance.range", "5 to 1", "ascend"]),
        (r#""framing": {"zoom": 1e30}"#, ["framing", "the camera", "1e18"]),
        (r#""picture": {"size": [0, 5]}"#, ["picture.size", "width", "above 0"]),
        (r#""picture": {"clips": [{"plane": [0, 0, 0, 1]}]}"#, ["picture.clips", "plane", "0,0,0"]),
        (
            r#""camera": {"position": [1e30, 0, 0], "focal_point": [0, 0, 0],
            "view_up": [0, 0, 1], "view_angle": 30}"#,
            ["“camera”", "away from", "1e18"],
        ),
        (r#""appearance": {"transfer": "no-such-name"}"#, ["s.json", "no-such-name", "mri"]),
    ] {
        folder.put(
            "s.json",
            format!(r#"{{"splatkit_scene": 2, "inputs": [{{"file": "near.mha"}}], {rest}}}"#),
        );
        let run = folder.run(render);
        assert!(!run.stderr().contains("--help"), "{}", run.stderr());
        run.fails(3, &[&["s.json"][..], &words].concat());
    }
    folder.put(
        "s.json",
        r#"{"splatkit_scene": 2,
            "inputs": [{"file": "near.mha", "appearance": {"range": [4, 1]}}]}"#,
    );
    folder.run(render).fails(3, &["s.json", "inputs[0].appearance.range"]);
    folder.put("s.json", r#"{"splatkit_scene": 2, "inputs": [{"file": "near.mha"}]}"#);
    // A scene is no file of data.
    for task in ["info", "check"] {
        folder.run(&format!("{task} s.json")).fails(3, &["s.json", "is a scene file"]);
    }
    // A damaged one is no model either.
    let damaged = [
        (r#"{"splatkit_scene": 2, "inputs": [], "pcture": 3}"#, "unknown field `pcture`"),
        (r#"{"splatkit_scene": 2,"#, "s.json: scene: EOF"),
    ];
    for (text, words) in damaged {
        folder.put("s.json", text);
        folder.run("info s.json").fails(3, &[words, "splatkit_scene"]);
    }
    folder.put("s.json", r#"{"splatkit_scene": 2, "inputs": [{"file": "near.mha"}]}"#);
    // What the user gives beside a scene stays wrong usage.
    for (flags, word) in
        [("--crease 255", "--crease"), ("--camera-position 1e30,0,0", "the camera")]
    {
        folder.run(&format!("{render} {flags}")).fails(2, &[word]);
    }
    folder.put(
        "s.json",
        r#"{"splatkit_scene": 2, "inputs": [{"file": "near.mha"}], "framing": {"view": "top"}}"#,
    );
    // The position counts more than the scene's view.
    folder.run(&format!("{render} --camera-position 9,9,9")).ok();
    folder.run("render s.json -o a.bmp --engine cpu").fails(2, &["a.bmp"]);
}

/// Gaussians whose sizes no hierarchy can hold are the file's fault.
#[test]
fn gaussians_that_cannot_be_merged_are_the_files_fault() {
    let folder = Folder::new();
    let names =
        "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let mut text = "ply\nformat ascii 1.0\nelement vertex 8\n".to_owned();
    names.split(' ').for_each(|name| text += &format!("property float {name}\n"));
    text += "end_header\n";
    for i in 0..8 {
        text += &format!("{} {} {} 1 1 1 2 30 0 0 1 0 0 0\n", i & 1, i >> 1 & 1, i >> 2);
    }
    folder.put("large.ply", text);
    folder.run("convert large.ply -o a.splk").fails(3, &["large.ply", "can be merged"]);
    folder.run("convert large.ply -o a.splk --dry-run").fails(3, &["large.ply", "can be merged"]);
}

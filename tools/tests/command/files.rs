//! The commands and errors that need no adapter.

use crate::common::*;

#[test]
fn info_tells_what_a_file_holds() {
    let folder = Folder::new();
    let mesh = folder.json(&format!("info {} --json", folder.put("a.ply", PLY)));
    assert_eq!(
        (mesh["kind"].as_str(), mesh["count"].as_u64(), mesh["triangles"].as_u64()),
        (Some("mesh"), Some(4), Some(4))
    );
    assert_eq!(mesh["bounds"]["max"], serde_json::json!([7.0, 7.0, 7.0]));
    assert_eq!(mesh["attributes"], serde_json::json!(["position", "color"]));
    assert_eq!(mesh["bytes"].as_u64(), Some(PLY.len() as u64));
    let cloud =
        PLY.replace("face 4", "face 0").split_inclusive("255 255 255\n").next().unwrap().to_owned();
    assert_eq!(
        folder.json(&format!("info {} --json", folder.put("cloud.ply", cloud)))["kind"],
        "cloud"
    );
    let textured = folder.json(&format!("info {} --json", folder.put("a.glb", glb())));
    assert_eq!(textured["textures"].as_u64(), Some(1));
    folder.put("a.raw", ball());
    for arguments in [
        folder.put("a.vti", vti()),
        folder.put("a.nrrd", nrrd("uint8", &ball())),
        "a.raw --dims 16,16,16 --type u8 --endian little --header 0",
    ] {
        let volume = folder.json(&format!("info {arguments} --json"));
        assert_eq!(volume["kind"], "volume");
        assert_eq!(volume["dims"], serde_json::json!([16, 16, 16]));
        assert_eq!((volume["count"].as_u64(), volume["type"].as_str()), (Some(4096), Some("u8")));
        for name in [
            "file",
            "bounds",
            "attributes",
            "bytes",
            "bytes_per_point",
            "levels",
            "range",
            "spacing",
        ] {
            assert!(!volume[name].is_null(), "{arguments}: {name}");
        }
    }
    let text = folder.run("info a.vti").ok().stdout;
    assert!(String::from_utf8_lossy(&text).contains("16, 16, 16"));
}

#[test]
fn texts_of_files_do_not_command_the_terminal() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.run_with(&["convert", "a.ply", "-o", "a.splk", "--unit", "\u{1b}[31m"]).ok();
    let stdout = folder.run("info a.splk").stdout();
    assert!(stdout.contains(r"\u{1b}[31m") && !stdout.contains('\u{1b}'), "{stdout:?}");
}

#[test]
fn scattered_samples_are_told_from_clouds_and_volumes() {
    let folder = Folder::new();
    let ply = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
        property float z\nproperty float p\nproperty float q\nproperty float radius\nend_header\n\
        0 0 0 1 5 1\n1 0 0 2 6 1\n";
    folder.put("a.ply", ply);
    assert_eq!(folder.json("info a.ply --json")["kind"], "cloud");
    let samples = folder.json("info a.ply --json --scalar q");
    assert_eq!((samples["kind"].as_str(), samples["count"].as_u64()), (Some("samples"), Some(2)));
    assert_eq!(samples["range"], serde_json::json!([5.0, 6.0]));
    assert_eq!(samples["attributes"], serde_json::json!(["position", "value", "radius"]));
    folder.run("info a.ply --scalar t").fails(3, &["a.ply", "no array “t”"]);
    folder.put("b.ply", PLY);
    assert_eq!(folder.json("info b.ply --json")["kind"], "mesh");
    folder.run("info b.ply --scalar q").fails(3, &["b.ply", "no array “q”", "x (f32, points)"]);
    assert_eq!(
        folder.json(&format!("info {} --json", folder.put("a.csv", "1,2,3,4\n5,6,7,8\n")))["kind"],
        "samples"
    );
    let header = "# vtk DataFile Version 3.0\n\nASCII\nDATASET";
    let image = format!(
        "{header} STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nPOINT_DATA 2\nSCALARS s int\n\
         LOOKUP_TABLE d\n1 2\n"
    );
    assert_eq!(
        folder.json(&format!("info {} --json", folder.put("image.vtk", image)))["kind"],
        "volume"
    );
    let points = format!(
        "{header} POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nPOINT_DATA 2\nSCALARS s int\n\
         LOOKUP_TABLE d\n1 2\n"
    );
    assert_eq!(
        folder.json(&format!("info {} --json", folder.put("points.vtk", points)))["kind"],
        "cloud"
    );
    folder.run("info a.csv --neighbours 3").fails(2, &["4 to 64"]);
}

/// The files that a model refers to are inputs as well, under any of their names.
#[test]
fn pictures_do_not_replace_what_the_scene_is_read_from() {
    let folder = Folder::new();
    let text = "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
        f 1/1 2/2 3/3\n";
    folder.put("a.obj", text);
    folder.put("a.mtl", "newmtl m\nmap_Kd a.png\n");
    let pixels = vec![[1.0; 4]; 4];
    let texture =
        splatkit::picture::Picture { width: 2, height: 2, color: pixels, depth: vec![1.0; 4] };
    let png = texture
        .encode(&splatkit::picture::Encoding::new(splatkit::picture::PictureFormat::Png))
        .unwrap();
    folder.put("a.png", &png);
    folder.put("a_0001.png", &png);
    folder.put("raw.png", [7; 64]);
    std::fs::create_dir(folder.path("below")).unwrap();
    let needed = ["is read too: an input or a flag refers to it", "give another name"];
    for arguments in ["a.obj -o a.png", "a.obj -o below/../a.png", "a.obj -o b.png --depth a.png"] {
        folder
            .run(&format!("render {arguments} --overwrite --reference --size 8x8"))
            .fails(1, &needed[1..]);
    }
    folder
        .run("render a.obj -o a.png --overwrite --reference --size 8x8")
        .fails(1, &[needed[0], "a.png"]);
    folder.put("a.mtl", "newmtl m\nmap_Kd a_0001.png\n");
    folder
        .run("render a.obj -o a.png --turntable 2 --overwrite --reference --size 8x8")
        .fails(1, &["a_0001.png: is read too"]);
    folder
        .run("render raw.png --dims 4x4x4 --type u8 -o raw.png --overwrite")
        .fails(1, &["raw.png: is an input too", "give another name"]);
    assert_eq!(
        [folder.path("a.png"), folder.path("a_0001.png")].map(|path| std::fs::read(path).unwrap()),
        [png.clone(), png]
    );
    // A texture that the model no longer refers to may be replaced.
    folder.run("render a.obj -o a.png --overwrite --reference --size 8x8").ok();
}

#[test]
fn bad_inputs_are_named() {
    let folder = Folder::new();
    let cut = |bytes: &[u8]| bytes[..bytes.len() * 3 / 4].to_vec();
    let nan: Vec<u8> =
        (0..4096).flat_map(|i| (if i == 7 { f32::NAN } else { 1.0 }).to_le_bytes()).collect();
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("cut.ply", cut(PLY.as_bytes())),
        ("cut.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 3\n".to_vec()),
        ("cut.glb", cut(&glb())),
        ("cut.nrrd", cut(&nrrd("uint8", &ball()))),
        ("cut.vti", cut(vti().as_bytes())),
        ("nan.ply", PLY.replace("7 0 0 0", "nan 0 0 0").into_bytes()),
        ("nan.obj", OBJ.replace("v 1 0 0", "v nan 0 0").into_bytes()),
        ("nan.nrrd", nrrd("float", &nan)),
        ("empty.ply", Vec::new()),
        ("empty.obj", Vec::new()),
        ("empty.glb", Vec::new()),
        ("empty.gltf", Vec::new()),
        ("empty.nrrd", Vec::new()),
        ("empty.vti", Vec::new()),
        (
            "flat.ply",
            PLY.replace("0 7 0 0", "0 0 0 0")
                .replace("0 0 7", "0 0 0")
                .replace("7 0 0 0", "0 0 0 0")
                .into_bytes(),
        ),
    ];
    for (name, bytes) in files {
        folder.put(name, bytes);
        folder.run(&format!("render {name} -o out.png")).fails(3, &[name]);
    }
    folder.run("render none.ply -o out.png").fails(3, &["none.ply"]);
    folder.run("info none.ply").fails(3, &["none.ply"]);
    folder.run("render . -o out.png").fails(3, &["regular file"]);
    folder.put("text.dat", "hello");
    folder.run("info text.dat").fails(3, &["text.dat", ".ply", ".nrrd", "--dims", ".csv"]);
    folder.put("text.txt", "hello");
    folder.run("info text.txt").fails(3, &["text.txt", "line 1", "“x”"]);
    folder.put("a.raw", &ball()[..4000]);
    folder.run("info a.raw --dims 16x16x16 --type u8").fails(3, &["a.raw", "4000"]);
    folder.put("nan.raw", nan);
    let run = folder.run("info nan.raw --dims 16x16x16 --type f32");
    assert!(run.stderr().contains("1 of 4,096 values missing"), "{}", run.stderr());
    folder.put("a.vti", vti());
    folder.run("info a.vti --limit-bytes 100").fails(3, &["a.vti", "limit"]);
    assert!(!folder.path("out.png").exists());
}

#[test]
fn pictures_are_compared() {
    let folder = Folder::new();
    let picture = |name: &str, size: u32, value: f32| {
        let color = vec![[value, value, value, 1.0]; (size * size) as usize];
        let picture =
            splatkit::picture::Picture { width: size, height: size, color, depth: Vec::new() };
        picture.save(folder.path(name), None).unwrap();
    };
    picture("a.png", 16, 0.5);
    picture("b.png", 16, 0.6);
    picture("c.png", 8, 0.5);
    let same = folder.json("compare a.png a.png --json --threshold 99");
    assert_eq!(
        (&same["psnr"], same["different_pixels"].as_u64()),
        (&serde_json::Value::Null, Some(0))
    );
    let comparison = folder.json("compare a.png b.png --json");
    assert!((comparison["psnr"].as_f64().unwrap() - 20.0).abs() < 0.5, "{comparison}");
    assert_eq!(comparison["different_pixels"].as_u64(), Some(256));
    assert!(comparison["ssim"].is_f64() && comparison["max_difference"].is_f64());
    folder.run("compare a.png b.png --threshold 10").ok();
    folder.run("compare a.png b.png --threshold 30").fails(5, &["30"]);
    folder.run("compare a.png c.png").fails(5, &["16x16", "8x8"]);
    folder.put("text.png", "no picture");
    folder.run("compare a.png text.png").fails(3, &["text.png"]);
    folder.run("compare a.png none.png").fails(3, &["none.png"]);
}

#[test]
fn the_cpu_engine_needs_no_adapter() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.run("render a.ply -o a.png --engine cpu --size 64x48").ok();
    let report = folder.json("bench a.ply --engine cpu --size 64x48 --frames 1 --threads 1 --json");
    assert_eq!(report["adapter"], "CPU");
    assert!(
        report["splats"].as_u64() > Some(0) && report["entries"].as_u64() > Some(0),
        "{report}"
    );
    folder
        .run("render a.ply -o b.png --engine cpu --pass-entries 100")
        .fails(2, &["--engine cpu cannot be used with"]);
}

#[test]
fn wrong_usage_is_told() {
    let folder = Folder::new();
    for arguments in [
        "",
        "paint",
        "render",
        "render a.ply -o a.png --size 10",
        "render a.ply -o a.png --samples 3",
        "render a.ply -o a.png --engine cpu --gpu 0",
        "render a.ply -o a.png --background redd",
        "render a.ply -o a.png --view-angle 180",
        "render a.ply -o a.png --dims 2x2x2",
        "render a.ply -o a.png --sigma -1",
        "render a.ply -o a.png -v -q",
        "render a.ply -o a.png --gradient sideways",
        "bench a.ply --frames 0",
        "compare a.png",
    ] {
        folder.run(arguments).fails(2, &[]);
    }
    folder.run("--help").ok();
    folder.run("render --help").ok();
    folder.run("--version").ok();
}

/// Unix allows file names that are not Unicode. Messages show them with replacement characters.
#[cfg(target_os = "linux")]
#[test]
fn names_that_are_no_text_are_told() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
    let folder = Folder::new();
    for (name, bytes) in [
        (&b"\xff.ply"[..], PLY.into()),
        (b"\xff.nrrd", nrrd("uint8", &ball())),
        (b"s\xff.ply", sheet(300)),
    ] {
        std::fs::write(folder.path(OsStr::from_bytes(name)), bytes).unwrap();
    }
    for (arguments, expected) in [
        (&b"info \xff.ply"[..], "\u{fffd}.ply"),
        (b"info \xff.ply --json", "\u{fffd}.ply"),
        (b"convert \xff.ply -o \xff.splk --json", "\u{fffd}.splk"),
        (b"convert s\xff.ply -o s\xff.splk --json --memory 8MiB", "s\u{fffd}.splk"),
        (b"convert \xff.nrrd -o \xff.splv --json", "\u{fffd}.splv"),
        (b"convert \xff.nrrd -o b\xff.nrrd --json", "b\u{fffd}.nrrd"),
        (b"render \xff.ply -o \xff.png --reference --size 8x6 --json", "\u{fffd}.png"),
    ] {
        let arguments: Vec<_> =
            arguments.split(|byte| *byte == b' ').map(OsStr::from_bytes).collect();
        let run = folder.run_with(&arguments);
        assert!(run.stdout().contains(expected), "{arguments:?}: {}", run.stderr());
        run.ok();
    }
    let turntable = b"render \xff.ply -o t\xff.png --turntable 2 --reference --size 8x6";
    folder
        .run_with(&turntable.split(|byte| *byte == b' ').map(OsStr::from_bytes).collect::<Vec<_>>())
        .ok();
    assert!(folder.path(OsStr::from_bytes(b"t\xff_0001.png")).exists());
}

#[test]
fn formats_are_listed() {
    let folder = Folder::new();
    let list = folder.json("formats --json");
    let text = folder.run("formats").stdout();
    let named = |name: &str| {
        let format = list.as_array().unwrap().iter().find(|format| format["name"] == name);
        format.unwrap_or_else(|| panic!("no {name}")).clone()
    };
    assert_eq!(named("LAS")["extensions"], serde_json::json!(["las", "laz"]));
    assert_eq!(
        named("PLY")["holds"],
        serde_json::json!([
            {"content": "mesh", "when": "with faces"},
            {"content": "point cloud", "when": "without faces"},
            {"content": "scattered samples", "when": "without faces, if a scalar is named"},
            {"content": "trained Gaussians", "when": "as trainers write them, also compressed"},
        ])
    );
    for (name, in_pieces, written) in
        [("PLY", true, true), ("LAS", true, true), ("VTI", false, false), ("NRRD", true, true)]
    {
        let format = named(name);
        assert_eq!(
            (format["read_in_pieces"].as_bool(), format["written"].as_bool()),
            (Some(in_pieces), Some(written)),
            "{name}"
        );
    }
    for format in list.as_array().unwrap() {
        assert!(text.contains(format["name"].as_str().unwrap()), "{format}");
    }
    assert!(
        text.contains("\nLAS  .las .laz\n   point cloud\n   read in pieces, written as .las\n")
    );
    // A file in none of them: the message lists all extensions.
    folder.put("a.bin", "hello");
    folder.run("info a.bin").fails(
        3,
        &[
            "a.bin: file: is in no format that can be read",
            "hierarchies: .splk; volumes in bricks: .zarr, .zarr.zip, .ozx, .splv; meshes: .ply,",
            ".obj, .gltf, .glb, .stl,",
            "volumes: .vtr, .vti, .vtk,",
            ".nrrd, .nhdr,",
            "and raw samples",
            "--dims and --type;",
            "scattered samples: .ply, .xyz,",
        ],
    );
}

#[test]
fn phantoms_become_files() {
    let folder = Folder::new();
    folder.run("generate ball -o ball.nrrd --dims 9x7x5").ok();
    let facts = folder.json("info ball.nrrd --json");
    assert_eq!(
        (&facts["dims"], facts["type"].as_str()),
        (&serde_json::json!([9, 7, 5]), Some("f32"))
    );
    assert_eq!(facts["bounds"]["max"], serde_json::json!([1.0, 1.0, 1.0]));
    folder.run("generate ball -o ball.csv --points 12").ok();
    assert_eq!(std::fs::read_to_string(folder.path("ball.csv")).unwrap().lines().count(), 13);
    folder.run("generate ball -o ball.csv").fails(1, &["ball.csv", "exists", "--overwrite"]);
    folder.run("generate ball -o ball.vti").fails(2, &[".nrrd, .vtr, .csv, .ply or .vtu"]);
    folder.run("generate egg -o egg.nrrd").fails(2, &["marschner-lobb", "head"]);
    folder.run("generate ball -o none.nrrd --dims 0x2x2").fails(2, &["holds none"]);
}

/// Ten processes begin a result of one new name: one wins, the others say so, and nothing of
/// theirs is left.
#[test]
fn one_of_ten_writers_of_a_new_name_wins() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    let begin = |_| {
        let mut command = folder.command();
        command.args(["convert", "a.ply", "-o", "new.splk"]);
        command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped());
        command.spawn().unwrap()
    };
    let all: Vec<_> = (0..10).map(begin).collect();
    let done: Vec<_> = all.into_iter().map(|one| one.wait_with_output().unwrap()).collect();
    let (won, lost): (Vec<_>, Vec<_>) = done.into_iter().partition(|one| one.status.success());
    assert_eq!(won.len(), 1);
    for one in lost {
        let stderr = String::from_utf8_lossy(&one.stderr).into_owned();
        assert_eq!(one.status.code(), Some(1), "{stderr}");
        let is_named = stderr.contains("appeared while") || stderr.contains("exists already");
        assert!(
            is_named && stderr.contains("new.splk") && stderr.contains("--overwrite"),
            "{stderr}"
        );
    }
    folder.run("check new.splk").ok();
    let mut left: Vec<_> = std::fs::read_dir(folder.path("")).unwrap().flatten().collect();
    left.retain(|file| file.file_name().to_string_lossy().ends_with("splatkit-part"));
    assert!(left.is_empty(), "{left:?}");
}

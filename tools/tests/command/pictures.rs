//! The commands that draw. They need an adapter; a software adapter is enough.

use crate::common::*;

const SMALL: &str = "--size 64x48";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.put("a.obj", OBJ);
    folder.put("a.glb", glb());
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.vti", vti());
    folder.put("a.raw", ball());
    folder
}

/// A hierarchy whose pages do not fit in memory is drawn coarser, and that is told.
#[test]
fn too_little_memory_for_pages_is_told() {
    let folder = Folder::new();
    folder.put("sheet.ply", sheet(120));
    folder.run("convert sheet.ply -o a.splk").ok();
    let warns = |memory: &str| {
        let run =
            format!("render a.splk -o a.png --overwrite --engine cpu --cut 0 {SMALL} {memory}");
        let run = folder.run(&run).ok();
        String::from_utf8_lossy(&run.stderr).contains("pages that the picture needs do not fit")
    };
    assert!(warns("--memory 200KiB") && !warns(""));
}

/// Cells are solid bodies in the colours of their values, and a clip shows the field inside.
#[test]
fn cells_are_solid() {
    let folder = Folder::new();
    folder.run("generate hexahedra --parts 2 -o a.vtu").ok();
    folder.put("one.vtk", ONE_VALUE);
    let pixels = |flags: &str| -> Vec<[u8; 4]> {
        let run = format!("render {flags} --raw -o - --background none --engine cpu {SMALL}");
        let bytes = folder.run(&run).ok().stdout;
        bytes.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2], pixel[3]]).collect()
    };
    let opaque = |pixels: &[[u8; 4]]| pixels.iter().filter(|pixel| pixel[3] == 255).count();
    let whole = pixels("a.vtu");
    assert!(opaque(&whole) > 600, "{}", opaque(&whole));
    for field in ["--cells volume", "--x-ray"] {
        assert!(opaque(&pixels(&format!("a.vtu {field}"))) < 200, "{field}");
    }
    // The largest values of the field, in grey.
    let grey = |[red, green, blue, _]: &[u8; 4]| red == green && green == blue;
    assert!(pixels("a.vtu --mip").iter().all(grey) && !whole.iter().all(grey));
    // The camera is fitted to what is left.
    let cut = pixels("a.vtu --clip z<40% --view top");
    assert!(opaque(&cut) > 600 && cut != whole);
    let dark = |pixels: &[[u8; 4]]| -> u64 {
        pixels.iter().map(|[r, g, b, _]| u64::from(*r) + u64::from(*g) + u64::from(*b)).sum()
    };
    assert!(dark(&pixels("a.vtu --edges")) < dark(&whole) * 97 / 100);
    let red = pixels("a.vtu --color red --crease 0");
    assert!(red.iter().all(|[r, g, b, a]| *a < 255 || r > g && r > b));
    // A cell of one value is drawn, too.
    assert!(opaque(&pixels("one.vtk")) > 600);
    folder.run("render one.vtk -o one.png --cells volume").fails(3, &["all values of one.vtk"]);
    let both = "render a.vtu -o a.png --cells solid --iso 50";
    folder.run(both).fails(2, &["a solid have no use for isosurfaces"]);
}

/// A cube of one value.
const ONE_VALUE: &str = "# vtk DataFile Version 3.0\none\nASCII\nDATASET UNSTRUCTURED_GRID\n\
    POINTS 8 float\n0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\n\
    CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\n\
    POINT_DATA 8\nSCALARS t float\nLOOKUP_TABLE default\n3 3 3 3 3 3 3 3\n";

#[test]
fn every_format_gives_a_picture() {
    let folder = folder();
    for input in [
        "a.ply",
        "a.obj",
        "a.glb",
        "a.nrrd",
        "a.vti",
        "a.raw --dims 16x16x16 --type u8 --spacing 1,1,1",
    ] {
        let report = folder.json(&format!("render {input} -o out.png --overwrite --json {SMALL}"));
        assert!(is_png(&std::fs::read(folder.path("out.png")).unwrap(), 64, 48), "{input}");
        assert_eq!((report["width"].as_u64(), report["height"].as_u64()), (Some(64), Some(48)));
        assert_eq!(report["output"].as_str(), Some("out.png"));
        let shows = report["entries"].as_u64() > Some(0) || report["gathered"].as_u64() > Some(0);
        assert!(shows && report["gpu_bytes"].as_u64() > Some(0), "{input}: {report}");
        assert!(
            report["frame_ms"].as_f64() > Some(0.0)
                && report["load_ms"].is_f64()
                && report["adapter"].is_string()
        );
    }
    // The same bytes under a name without an extension are recognised by their content.
    std::fs::copy(folder.path("a.ply"), folder.path("mesh")).unwrap();
    std::fs::copy(folder.path("a.nrrd"), folder.path("volume")).unwrap();
    folder.run(&format!("render mesh volume -o both.png {SMALL}")).ok();
    // The same samples, read from two formats, give the same picture.
    for name in ["a.nrrd", "a.vti"] {
        folder.run(&format!("render {name} -o {name}.png --zoom 1 {SMALL}")).ok();
    }
    assert!(folder.json("compare a.nrrd.png a.vti.png --json")["psnr"].is_null());
}

#[test]
fn stdout_takes_a_picture_and_nothing_else() {
    let folder = folder();
    let output = folder.run(&format!("render a.ply -o - -vv {SMALL}")).ok();
    assert!(is_png(&output.stdout, 64, 48));
    assert!(!output.stderr.is_empty());
    folder.run("render a.ply -o - --json").fails(2, &["stdout"]);
    let quiet = folder.run(&format!("render a.ply -o quiet.png -q {SMALL}")).ok();
    assert!(quiet.stdout.is_empty());
}

#[test]
fn files_are_not_replaced_unasked() {
    let folder = folder();
    folder.put("out.png", "mine");
    folder
        .run(&format!("render a.ply -o out.png {SMALL}"))
        .fails(1, &["out.png", "exists", "--overwrite"]);
    assert_eq!(std::fs::read(folder.path("out.png")).unwrap(), b"mine");
    folder.run(&format!("render a.ply -o out.png --overwrite {SMALL}")).ok();
    assert!(is_png(&std::fs::read(folder.path("out.png")).unwrap(), 64, 48));
    folder.run("render a.ply -o none/out.png").fails(1, &["folder"]);
    folder.run("render a.ply -o out.xyz").fails(2, &[".png"]);
    let mut parts = folder.names();
    parts.retain(|name| name.contains(".part"));
    assert_eq!(parts, [""; 0]);
}

#[test]
fn what_shows_nothing_is_no_picture() {
    let folder = folder();
    let away = "--camera-position 0,0,100 --focal-point 0,0,200 --view-up 0,1,0";
    folder
        .run(&format!("render a.ply -o out.png {SMALL} {away}"))
        .fails(3, &["nothing to draw", "camera"]);
    folder.run(&format!("bench a.ply {SMALL} {away}")).fails(3, &["nothing to draw"]);
    folder.put("clear.json", r#"{"color": [[0, 1, 1, 1]], "opacity": [[0, 0], [255, 0]]}"#);
    folder
        .run("render a.vti -o out.png --transfer clear.json")
        .fails(3, &["clear.json", "without opacity"]);
    folder.put("high.json", r#"{"color": [[0, 1, 1, 1]], "opacity": [[300, 0], [400, 1]]}"#);
    folder
        .run("render a.vti -o out.png --transfer high.json")
        .fails(3, &["nothing to draw", "300", "a.vti", "--transfer"]);
    folder.run(&format!("render a.vti -o out.png --transfer high.json --range 0,255 {SMALL}")).ok();
    folder
        .run("render a.vti -o out.png --transfer ct-wood --overwrite")
        .fails(2, &["ct-wood", "ct-bone"]);
    folder.put("empty.ply", PLY.replace("vertex 4", "vertex 0").replace("face 4", "face 0"));
    folder.run("render empty.ply -o none.png").fails(3, &["empty.ply"]);
}

#[test]
fn the_engine_draws_what_the_reference_draws() {
    let folder = folder();
    let flags = ["", "--gradient central", "--no-shade", "--orthographic"];
    for (scene, flags) in [("a.ply", &flags[..1]), ("a.vti", &flags[..1]), ("a.ply a.vti", &flags)]
    {
        for flags in flags {
            // The reference takes its time.
            let arguments = format!("render {scene} --overwrite --size 32x24 {flags}");
            folder.run(&format!("{arguments} -o engine.png")).ok();
            let report = folder.json(&format!("{arguments} -o reference.png --reference --json"));
            assert_eq!(report["adapter"], "reference");
            // The engine computes in 32 and 16 bits, the reference in 64: their bytes differ by
            // steps of 1/255.
            folder.run("compare engine.png reference.png --threshold 40").ok();
        }
    }
}

#[test]
fn cameras_and_pictures_follow_their_flags() {
    let folder = folder();
    let view = "--distance 50 --focal-point 7.5,7.5,7.5 --zoom 1.3 --up +Y";
    let report = folder.json(&format!("render a.vti -o a.png --json {view} {SMALL}"));
    let camera = &report["camera"];
    let text = |name: &str| {
        let numbers = camera[name].as_array().unwrap().iter().map(ToString::to_string);
        numbers.collect::<Vec<_>>().join(",")
    };
    // VTK's camera at this distance after Azimuth(30), Elevation(20), Zoom(1.3).
    let distance = 50.0;
    let [azimuth, elevation] = [30f64, 20.0].map(f64::to_radians);
    let expected =
        [azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos()];
    for (axis, expected) in expected.iter().enumerate() {
        assert!(
            (camera["position"][axis].as_f64().unwrap() - 7.5 - distance * expected).abs() < 1e-9,
            "{camera}"
        );
    }
    assert!((camera["view_angle"].as_f64().unwrap() - 30.0 / 1.3).abs() < 1e-12);
    let same = format!(
        "--camera-position {} --focal-point {} --view-up {} --view-angle {}",
        text("position"),
        text("focal_point"),
        text("view_up"),
        camera["view_angle"]
    );
    folder.run(&format!("render a.vti -o b.png {SMALL} {same}")).ok();
    folder.run("compare a.png b.png --threshold 60").ok();
    let away = "--azimuth -150 --elevation -20 --background none --samples 4 --depth depth.png \
        --radius-scale 1.2";
    folder.run(&format!("render a.ply -o c.png {SMALL} {away}")).ok();
    assert!(is_png(&std::fs::read(folder.path("depth.png")).unwrap(), 64, 48));
    folder.run("compare a.png c.png --threshold 60").fails(5, &["dB"]);
    folder.run(&format!("render a.ply -o turn.jpg --turntable 3 {SMALL}")).ok();
    assert!((0..3).all(|frame| folder.path(format!("turn_000{frame}.jpg")).is_file()));
    folder
        .run(&format!("render a.ply -o turn.jpg --turntable 3 {SMALL}"))
        .fails(1, &["turn_0000.jpg"]);
    folder
        .run("render a.ply -o d.png --camera-position 1,2,3 --focal-point 1,2,3")
        .fails(2, &["camera"]);
    folder.run("render a.ply -o d.png --size 100000x100000").fails(2, &["100000"]);
    folder
        .run("render a.vti a.nrrd a.vti a.nrrd a.vti a.nrrd a.vti a.nrrd a.vti -o d.png")
        .fails(2, &["8 volumes", "the scene has 9"]);
}

#[test]
fn bench_measures() {
    let folder = folder();
    let report = folder.json(&format!("bench a.ply a.vti --frames 2 --json {SMALL}"));
    let ms = |name: &str| report["frame_ms"][name].as_f64().unwrap();
    assert!(0.0 < ms("min") && ms("min") <= ms("median") && ms("median") <= ms("max"), "{report}");
    for name in [
        "scene",
        "adapter",
        "width",
        "height",
        "frames",
        "splats",
        "entries",
        "culled",
        "gpu_bytes",
    ] {
        assert!(!report[name].is_null(), "{name}: {report}");
    }
    let passes = report["passes"].as_array().unwrap();
    assert!(
        passes.iter().any(|pass| pass["name"] == "march" && pass["ms"].as_f64() > Some(0.0)),
        "{report}"
    );
}

#[test]
fn adapters_are_listed_and_chosen() {
    let folder = folder();
    let list = folder.json("gpus --json");
    assert!(list[0]["name"].is_string() && list[0]["max_binding_bytes"].is_u64());
    let output = folder.run("gpus").ok();
    assert!(String::from_utf8_lossy(&output.stdout).contains(list[0]["name"].as_str().unwrap()));
    folder
        .run("render a.ply -o a.png --gpu nonexistent")
        .fails(4, &["nonexistent", "splatkit gpus"]);
    folder.run("render a.ply -o a.png --gpu 99").fails(4, &["99"]);
    folder.run(&format!("render a.ply -o a.png --gpu 0 --pass-entries 100000 {SMALL}")).ok();
    // The hint names the flag of the budget.
    folder
        .run(&format!("render a.nrrd -o b.png --evaluate scatter --pass-entries 16 {SMALL}"))
        .fails(4, &["raise --pass-entries", "--size"]);
}

#[test]
fn the_demo_draws_its_pictures() {
    let folder = Folder::new();
    let output = folder.run("demo out").ok();
    let text = String::from_utf8_lossy(&output.stdout);
    for name in ["mesh.png", "volume.png", "mixed.png", "gaussians.png"] {
        assert!(text.contains(name) && folder.path("out").join(name).is_file(), "{text}");
    }
    folder.run("demo out").fails(1, &["exists", "--overwrite"]);
    folder.run("info out/knot.ply").ok();
    folder.run("info out/specimen.nrrd").ok();
}

#[test]
fn real_scans_are_drawn() {
    let Some(data) = real_data() else {
        println!("skipped: no real data in ../shared/data or $SPLATKIT_DATA");
        return;
    };
    let folder = Folder::new();
    for (name, flags) in [
        ("bun_zipper.ply", ""),
        ("armadillo.obj", ""),
        ("tooth.nrrd", ""),
        ("headsq_64x64x93_int16le.raw.gz", "--dims 64,64,93 --type i16"),
    ] {
        let path = data.join(name);
        let mut arguments = vec![
            "render",
            path.to_str().unwrap(),
            "-o",
            "out.png",
            "--overwrite",
            "--size",
            "96x64",
        ];
        arguments.extend(flags.split_whitespace());
        folder.run_with(&arguments).ok();
        assert!(is_png(&std::fs::read(folder.path("out.png")).unwrap(), 96, 64), "{name}");
    }
}

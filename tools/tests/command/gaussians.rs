//! Trained Gaussians: read, converted, described, checked and drawn, in every format.

use crate::common::{trained::*, *};
use serde_json::{Value, json};

/// Draws on the CPU.
const VIEW: &str = "--size 96x72 --engine cpu";

fn near(a: &Value, b: &Value, most: f64) -> bool {
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().filter_map(Value::as_f64).collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most)
}

/// Converts to a format. A glTF file stands upright: it is turned by 180° about x.
fn converted(folder: &Folder, extension: &str) -> (String, splatkit::gaussians::Gaussians) {
    let name = format!("made.{extension}");
    let report = folder.json(&format!("convert scene.ply -o {name} --json"));
    assert_eq!(report["splats"], json!(COUNT), "{name}");
    let set = load(folder, &name);
    let set = if extension == "glb" { half_turn(set, 0) } else { set };
    (name, set)
}

#[test]
fn every_format_keeps_the_numbers_within_its_steps() {
    const DEGREE: u32 = 2;
    let folder = Folder::new();
    let set = scene(DEGREE);
    write(&set, "ply", &folder.path("scene.ply"));
    for (extension, highest, most) in WRITTEN {
        let (name, made) = converted(&folder, extension);
        assert_eq!((made.degree, made.broken.all()), (DEGREE.min(highest), 0), "{name}");
        Apart::of(&made, &set).within(&most, &name);
        folder.run(&format!("convert {name} -o back.ply --overwrite")).ok();
        Apart::of(&load(&folder, "back.ply"), &set).within(&most, &format!("{name}, back in PLY"));
    }
    sog(&folder, "made.sog", &set);
    folder.run("convert made.sog -o back.ply --overwrite").ok();
    for name in ["made.sog", "back.ply"] {
        Apart::of(&load(&folder, name), &set).within(&OF_SOG, name);
    }
}

#[test]
fn info_says_the_same_of_every_format() {
    let folder = Folder::new();
    write(&scene(1), "ply", &folder.path("scene.ply"));
    let expected = folder.json("info scene.ply --json");
    assert_eq!(
        (&expected["kind"], &expected["count"], &expected["degree"], &expected["broken"]),
        (&json!("trained Gaussians"), &json!(COUNT), &json!(1), &json!(0))
    );
    for (extension, highest, most) in WRITTEN {
        let (name, _) = converted(&folder, extension);
        let facts = folder.json(&format!("info {name} --json"));
        for key in ["kind", "count", "invisible", "broken", "attributes"] {
            assert_eq!(facts[key], expected[key], "{name}: {key}");
        }
        assert_eq!(facts["degree"], json!(highest.min(1)), "{name}");
        assert_eq!(facts["bytes"], json!(folder.path(&name).metadata().unwrap().len()), "{name}");
        // Deviations are at most 0.23.
        assert!(near(&facts["scales"], &expected["scales"], 0.25 * most.scale), "{name}: {facts}");
        assert!(near(&facts["opacities"], &expected["opacities"], most.opacity), "{name}: {facts}");
        for end in ["min", "max"].into_iter().filter(|_| extension != "glb") {
            let (actual, wanted) = (&facts["bounds"][end], &expected["bounds"][end]);
            let reach = most.center + most.scale + 2.0 * most.turn;
            assert!(near(actual, wanted, reach), "{name}: {actual} {wanted}");
        }
    }
    let text = folder.run("info scene.ply").stdout();
    for line in ["kind            trained Gaussians", "degree          1", "broken          0"] {
        assert!(text.contains(line), "{text}");
    }
}

#[test]
fn every_format_gives_the_same_picture() {
    let folder = Folder::new();
    let set = scene(2);
    write(&set, "ply", &folder.path("scene.ply"));
    sog(&folder, "planes.sog", &set);
    folder.run("convert scene.ply -o flat.ply --degree 0").ok();
    let report = folder.json(&format!("render scene.ply -o scene.png --json {VIEW}"));
    assert_eq!(
        (report["up"].as_str(), report["up_from"].as_str()),
        (Some("-Y"), Some("convention"))
    );
    let camera = format!("--camera={}", report["camera"]);
    let draw = |name: &str| {
        let (picture, size) = (format!("{name}.png"), "--size=96x72");
        folder.run_with(&["render", name, "-o", &picture, size, "--engine=cpu", &camera]).ok();
        picture
    };
    let flat = draw("flat.ply");
    let apart = psnr(&folder, "scene.png", &flat);
    assert!(apart < 45.0, "colours of degree 2 look as those of degree 0: {apart:.1} dB");
    let mut pictures = vec![("planes.sog", draw("planes.sog"), "scene.png")];
    for (extension, ..) in WRITTEN {
        let (name, _) = converted(&folder, extension);
        let (picture, wanted) = match extension {
            "splat" => (draw(&name), &*flat),
            "glb" => {
                // It stands another way, and the camera with it.
                folder.run(&format!("render {name} -o upright.png {VIEW}")).ok();
                ("upright.png".into(), "scene.png")
            }
            _ => (draw(&name), "scene.png"),
        };
        pictures.push((extension, picture, wanted));
    }
    for (name, picture, wanted) in pictures {
        let alike = psnr(&folder, &picture, wanted);
        println!("{name}: {alike:.1} dB");
        assert!(alike >= 35.0, "{name}: {alike:.1} dB");
    }
}

/// The text of a scene in planes is a scene, though scene files have the same extension.
#[test]
fn a_folder_of_planes_is_drawn() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("scene")).unwrap();
    sog(&folder, "scene/meta.json", &scene(1));
    let facts = folder.json("info scene/meta.json --json");
    assert_eq!((&facts["kind"], &facts["degree"]), (&json!("trained Gaussians"), &json!(1)));
    folder.run(&format!("render scene/meta.json -o out.png {VIEW}")).ok();
    assert!(is_png(&std::fs::read(folder.path("out.png")).unwrap(), 96, 72));
    folder.run("convert scene/meta.json -o scene.spz").ok();
    assert_eq!(load(&folder, "scene.spz").len(), COUNT);
}

/// A scene is written as a folder of planes too, all of them or none.
#[test]
fn a_folder_of_planes_is_written() {
    let folder = Folder::new();
    write(&scene(1), "ply", &folder.path("scene.ply"));
    std::fs::create_dir(folder.path("made")).unwrap();
    folder.write("made/quats.webp", "something else");
    let text = ["quats.webp", "exists already"];
    folder.run("convert scene.ply -o made/meta.json").fails(1, &text);
    let listed = || std::fs::read_dir(folder.path("made")).unwrap().count();
    assert_eq!(listed(), 1);
    folder.run("convert scene.ply -o made/meta.json --overwrite").ok();
    assert_eq!(listed(), 8);
    folder.run("convert scene.ply -o made.sog").ok();
    let [beside, whole] = ["made/meta.json", "made.sog"].map(|name| load(&folder, name));
    assert_eq!((beside.centers, beside.harmonics), (whole.centers, whole.harmonics));
    folder.run("convert scene.ply -o made/scene.json").fails(2, &["lod-meta.json of SOG"]);
}

#[test]
fn a_streamed_scene_is_written_in_folders() {
    let folder = Folder::new();
    write(&scene(1), "ply", &folder.path("scene.ply"));
    std::fs::create_dir(folder.path("made")).unwrap();
    let said = folder.json("convert scene.ply -o made/lod-meta.json --json");
    let size = |name: &str| std::fs::metadata(folder.path(name)).unwrap().len();
    let level = std::fs::read_dir(folder.path("made/0_0")).unwrap();
    let files = level.map(|file| file.unwrap().metadata().unwrap().len()).sum::<u64>();
    assert_eq!(said["bytes"], size("made/lod-meta.json") + files);
    assert_eq!(load(&folder, "made/lod-meta.json").len(), scene(1).len());
    let text = ["made/lod-meta.json", "exists already"];
    folder.run("convert scene.ply -o made/lod-meta.json").fails(1, &text);
}

#[test]
fn spz_has_two_versions() {
    let folder = Folder::new();
    let set = scene(1);
    write(&set, "ply", &folder.path("scene.ply"));
    let (.., most) = WRITTEN[3];
    for (flag, start) in [("", [0x1f, 0x8b]), (" --spz-version 3", [0x1f, 0x8b])]
        .into_iter()
        .chain([(" --spz-version 4", *b"NG")])
    {
        folder.run(&format!("convert scene.ply -o a.spz --overwrite{flag}")).ok();
        assert_eq!(std::fs::read(folder.path("a.spz")).unwrap()[..2], start, "{flag}");
        Apart::of(&load(&folder, "a.spz"), &set).within(&most, flag);
    }
    folder.run("convert scene.ply -o b.spz --spz-version 2").fails(2, &["2", "3..=4"]);
    folder
        .run("convert scene.ply -o b.ply --spz-version 4")
        .fails(2, &["--spz-version is for .spz files"]);
}

/// Writes a scene in every format, as `whole` and the extension.
fn every_format(folder: &Folder) {
    let set = scene(1);
    for (extension, ..) in WRITTEN {
        write(&set, extension, &folder.path(format!("whole.{extension}")));
    }
    sog(folder, "whole.sog", &set);
}

#[test]
fn cut_files_are_named_with_a_place_and_a_reason() {
    let folder = Folder::new();
    every_format(&folder);
    for (extension, words) in [
        ("ply", ["element “vertex”", "the file ends"]),
        ("compressed.ply", ["element “vertex”", "the file ends"]),
        ("splat", ["byte 5472", "the file ends after 16 of the 32 bytes of Gaussian 171"]),
        ("spz", [": ", "unpack"]),
        ("glb", ["byte 8", "the GLB header claims"]),
        ("sog", ["meta.json", "EOF"]),
    ] {
        let bytes = std::fs::read(folder.path(format!("whole.{extension}"))).unwrap();
        let name = format!("cut.{extension}");
        folder.write(&name, &bytes[..bytes.len() / 2]);
        let words = [&*name, words[0], words[1]];
        folder.run(&format!("info {name}")).fails(3, &words);
        folder.run(&format!("render {name} -o out.png {VIEW}")).fails(3, &words);
        folder.run(&format!("convert {name} -o out.ply")).fails(3, &words);
    }
    let plane = std::fs::read(folder.path("q.webp")).unwrap();
    folder.write("q.webp", &plane[..24]);
    folder.run("info whole.sog").fails(3, &["q.webp", "quats.files[0]", "cannot be decoded"]);
    std::fs::remove_file(folder.path("q.webp")).unwrap();
    folder.run("info whole.sog").fails(3, &["whole.sog", "quats.files[0]", "“q.webp”"]);
    assert!(!folder.path("out.png").exists() && !folder.path("out.ply").exists());
}

#[test]
fn garbled_files_are_named_with_a_place_and_a_reason() {
    let folder = Folder::new();
    every_format(&folder);
    for (extension, from, to, words) in [
        ("ply", "f_dc_2", "f_dc_x", ["header", "no scalar property “f_dc_2”"]),
        ("ply", "f_rest_8", "f_more_8", ["header", "has 8 properties “f_rest_…”"]),
        (
            "compressed.ply",
            "chunk 2",
            "chunk 1",
            ["header", "has 1 rows, but 343 Gaussians need 2"],
        ),
        ("glb", ":SCALE\"", ":SCALF\"", ["mesh 0, primitive 0", "no attribute"]),
        ("glb", "\"ellipse\"", "\"ellipsx\"", ["mesh 0, primitive 0", "the kernel “ellipsx”"]),
        ("sog", "\"version\":2", "\"version\":7", ["meta.json", "has the version 7"]),
        ("sog", "\"count\":343", "\"count\":943", ["means.files[0]", "fewer than the 943 needed"]),
    ] {
        let mut bytes = std::fs::read(folder.path(format!("whole.{extension}"))).unwrap();
        let at = bytes.windows(from.len()).position(|part| part == from.as_bytes());
        bytes[at.expect(from)..][..to.len()].copy_from_slice(to.as_bytes());
        let name = format!("garbled.{extension}");
        folder.write(&name, bytes);
        // A missing plane is a fault of the plane's own file.
        let file = if words[0].starts_with("means") { "l.webp" } else { &*name };
        folder.run(&format!("info {name}")).fails(3, &[file, words[0], words[1]]);
    }
    folder.write("garbled.splat", [255u8; 64]);
    folder.run("info garbled.splat").fails(3, &["garbled.splat", "none of the 2 Gaussians"]);
    let later = [&b"NGSP\x09\0\0\0\x01\0\0\0"[..], &[0; 20]].concat();
    folder.write("garbled.spz", later);
    folder.run("info garbled.spz").fails(3, &["garbled.spz", "header", "has the version 9"]);
}

#[test]
fn check_names_what_is_odd() {
    let folder = Folder::new();
    write(&scene(0), "ply", &folder.path("a.ply"));
    assert_eq!(folder.json("check a.ply --json"), json!({"ok": true, "findings": []}));
    let mut bytes = std::fs::read(folder.path("a.ply")).unwrap();
    // Position, normal, colour, opacity, deviations and rotation, of 32 bits each.
    const ROW: usize = 4 * 17;
    let rows = bytes.len() - ROW * COUNT;
    let mut put = |row: usize, column: usize, value: f32| {
        bytes[rows + ROW * row + 4 * column..][..4].copy_from_slice(&value.to_le_bytes());
    };
    put(0, 0, f32::NAN);
    (13..17).for_each(|column| put(1, column, 0.0));
    put(2, 9, -9.0);
    put(3, 10, 4.0);
    folder.write("odd.ply", bytes);
    let report = folder.json("check odd.ply --json");
    assert_eq!(report["ok"], json!(true));
    let findings = report["findings"].as_array().unwrap();
    let codes: Vec<&str> = findings.iter().filter_map(|finding| finding["code"].as_str()).collect();
    assert_eq!(codes, ["not-finite", "no-rotation", "invisible", "needles"]);
    let run = folder.run("check odd.ply");
    let text = run.stdout();
    for line in [
        "warning (not-finite) Gaussians: 1 of 343 have numbers that are not finite; left out",
        "warning (no-rotation) Gaussians: 1 of 343 have a zero quaternion; left out",
        "warning (invisible) Gaussians: 1 of 343 cover less than 1/255 of any pixel",
        "warning (needles) Gaussians: 1 of 343 are at least 25 times as long as they are wide",
        "sound",
    ] {
        assert!(text.contains(line), "{text}");
    }
    let warning = "odd.ply: 2 of 343 Gaussians have numbers that are not finite, or no rotation; \
                   they are left out";
    assert!(run.stderr().contains(warning), "{}", run.stderr());
    let facts = folder.json("info odd.ply --json");
    assert_eq!((&facts["count"], &facts["broken"]), (&json!(COUNT - 2), &json!(2)));
    folder.run("convert odd.ply -o odd.spz").ok();
    assert_eq!(load(&folder, "odd.spz").len(), COUNT - 2);
}

#[test]
fn surfaces_become_gaussians() {
    let folder = Folder::new();
    folder.put("mesh.ply", PLY);
    folder.run("convert mesh.ply -o tree.splk").ok();
    for input in ["mesh.ply", "tree.splk"] {
        for (extension, ..) in WRITTEN {
            let name = format!("made.{extension}");
            let report = folder.json(&format!("convert {input} -o {name} --json --overwrite"));
            let facts = folder.json(&format!("info {name} --json"));
            assert_eq!(facts["kind"], json!("trained Gaussians"), "{name}");
            assert_eq!(
                (&facts["count"], &facts["degree"]),
                (&report["splats"], &json!(0)),
                "{name}"
            );
            let expected = folder.json(&format!("convert {input} -o {name} --json --dry-run"));
            assert_eq!(expected["splats"], report["splats"], "{name}");
        }
    }
    // Twice as wide, in the same places.
    folder.run("convert tree.splk -o wide.splat --radius-scale 2").ok();
    folder.run("convert tree.splk -o same.splat").ok();
    let [wide, same] = ["wide.splat", "same.splat"].map(|name| load(&folder, name));
    assert_eq!(wide.centers, same.centers);
    assert!(wide.scales.iter().zip(&same.scales).all(|(a, b)| (*a - 2.0 * *b).length() < 1e-5));
}

#[test]
fn colours_keep_a_degree() {
    let folder = Folder::new();
    let set = scene(3);
    write(&set, "ply", &folder.path("scene.ply"));
    for degree in [0, 1, 3] {
        let name = format!("degree-{degree}.spz");
        let report = folder.json(&format!("convert scene.ply -o {name} --degree {degree} --json"));
        assert_eq!(report["degree"], json!(degree));
        let mut wanted = set.clone();
        wanted.set_degree(degree);
        let loaded = load(&folder, &name);
        assert_eq!(loaded.degree, degree);
        let (.., most) = WRITTEN[3];
        Apart::of(&loaded, &wanted).within(&most, &name);
    }
    // A file of a lower degree stays as it is.
    folder.run("convert degree-1.spz -o again.spz --degree 3").ok();
    assert_eq!(load(&folder, "again.spz").degree, 1);
    folder.run("convert scene.ply -o more.spz --degree 4").fails(2, &["4", "0..=3"]);
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.run("convert a.nrrd -o b.nrrd --degree 1").fails(2, &["--degree is for .splk"]);
}

#[test]
fn scenes_are_merged() {
    let folder = Folder::new();
    for degree in [0, 2] {
        write(&scene(degree), "ply", &folder.path(format!("{degree}.ply")));
    }
    folder.put("mesh.ply", PLY);
    let report = folder.json("convert 0.ply 2.ply -o both.ply --json");
    assert_eq!((&report["splats"], &report["degree"]), (&json!(2 * COUNT), &json!(2)));
    let report = folder.json("convert 2.ply mesh.ply -o mixed.spz --json");
    assert!(report["splats"].as_u64() > Some(COUNT as u64), "{report}");
}

#[test]
fn gaussians_are_drawn_with_a_volume_and_a_mesh() {
    let folder = Folder::new();
    folder.put("ball.nrrd", nrrd("uint8", &ball()));
    folder.put("mesh.ply", PLY);
    write(&scene(1), "spz", &folder.path("scene.spz"));
    let inputs = ["scene.spz", "ball.nrrd", "mesh.ply"];
    let all = inputs.join(" ");
    let report = folder.json(&format!("render {all} -o all.png --json --up +Z {VIEW}"));
    assert_eq!(report["up"].as_str(), Some("+Z"));
    let camera = format!("--camera={}", report["camera"]);
    // Without any of them, the picture is another one.
    for left_out in inputs {
        let rest = inputs.iter().filter(|name| **name != left_out);
        let arguments = ["render", "-o", "rest.png", "--overwrite", "--size=96x72", "--engine=cpu"];
        let arguments: Vec<&str> =
            arguments.iter().chain(rest).copied().chain([&*camera]).collect();
        folder.run_with(&arguments).ok();
        let apart = psnr(&folder, "all.png", "rest.png");
        assert!(apart < 60.0, "{left_out} is not seen: {apart:.1} dB");
    }
}

#[test]
fn a_made_scene_is_drawn_as_sheets_and_as_whole_splats() {
    let folder = Folder::new();
    folder.run("generate gaussians -o made.ply --points 600").ok();
    folder.run(&format!("render made.ply -o sheets.png {VIEW}")).ok();
    folder.run(&format!("render made.ply -o splats.png --mode splats {VIEW}")).ok();
    let alike = psnr(&folder, "sheets.png", "splats.png");
    assert!((20.0..100.0).contains(&alike), "{alike:.1} dB");
}

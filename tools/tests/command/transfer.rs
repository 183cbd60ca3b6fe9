//! `splatkit transfer`, and the transfer functions of pictures. They need an adapter; a software
//! adapter is enough.

use crate::common::*;

const SMALL: &str = "--size 64x48";

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("flat.nrrd", nrrd("uint8", &[7; 16 * 16 * 16]));
    folder.put("a.ply", PLY);
    let samples = (0..200).map(|i| format!("{},{},{},{}\n", i % 5, i / 5 % 5, i / 25, i % 7));
    folder.put("a.csv", format!("x,y,z,value\n{}", samples.collect::<String>()));
    folder
}

/// The file of the automatic function gives the same picture as no file, and so does every other
/// function with the flags that change it.
#[test]
fn what_is_written_draws_the_same_picture() {
    let folder = folder();
    for (input, flags) in [
        ("a.nrrd", ""),
        ("a.csv", ""),
        ("a.nrrd", "--transfer mri"),
        ("a.nrrd", "--range 10,90 --opacity-unit 0.7"),
        ("a.nrrd", "--iso 50:#ff0000:0.5 --gradient-opacity 0,0:20,1"),
    ] {
        folder.run(&format!("transfer {input} -o t.json --overwrite {flags}")).ok();
        folder.run(&format!("render {input} -o without.png --overwrite {SMALL} {flags}")).ok();
        folder
            .run(&format!("render {input} -o with.png --overwrite {SMALL} --transfer t.json"))
            .ok();
        let [with, without] =
            ["with.png", "without.png"].map(|name| std::fs::read(folder.path(name)).unwrap());
        assert!(with == without, "{input} {flags}");
        let printed = folder.run(&format!("transfer {input} -o - {flags}")).ok();
        assert_eq!(printed.stdout, std::fs::read(folder.path("t.json")).unwrap());
    }
}

#[test]
fn what_cannot_be_written_is_refused() {
    let folder = folder();
    folder.put("mine.json", "mine");
    folder.run("transfer a.nrrd -o mine.json").fails(1, &["mine.json", "exists", "--overwrite"]);
    folder.run("transfer a.nrrd -o t.txt").fails(2, &["t.txt", ".json"]);
    folder.run("transfer a.nrrd -o none/t.json").fails(1, &["folder"]);
    folder.run("transfer a.ply -o t.json").fails(3, &["a.ply", "colours of its own", "--scalar"]);
    folder.run("transfer none.nrrd -o t.json").fails(3, &["none.nrrd"]);
    folder
        .run("transfer a.nrrd -o t.json --sigma 0.7")
        .fails(2, &["--sigma", "has no effect on a transfer function"]);
    folder
        .run("transfer a.nrrd -o t.json --transfer mine.json")
        .fails(3, &["mine.json", "transfer function"]);
    assert_eq!(std::fs::read(folder.path("mine.json")).unwrap(), b"mine");
    assert!(!folder.path("t.json").exists());
}

#[test]
fn values_that_are_all_the_same_need_a_function() {
    let folder = folder();
    let words = ["all values of flat.nrrd are 7", "--transfer"];
    folder.run(&format!("render flat.nrrd -o out.png {SMALL}")).fails(3, &words);
    folder.run("transfer flat.nrrd -o t.json").fails(3, &words);
    folder.run(&format!("render flat.nrrd -o out.png {SMALL} --transfer mri --range 0,7")).ok();
}

/// A volume in metres, millimetres or micrometres looks the same with every preset and without.
#[test]
fn presets_follow_the_unit_of_length() {
    let folder = folder();
    let spaced = |spacing: &str| {
        String::from_utf8_lossy(&nrrd("uint8", &[]))
            .replace("\n\n", &format!("\nspacings: {spacing} {spacing} {spacing}\n\n"))
    };
    let bytes = ball();
    for (name, spacing) in [("mm", "1"), ("km", "1e-6"), ("nm", "1e6")] {
        let mut file = spaced(spacing).into_bytes();
        file.extend(&bytes);
        folder.put(&format!("{name}.nrrd"), file);
    }
    for flags in
        ["", "--transfer mri", "--transfer generic", "--transfer ct-angiography --range 20,200"]
    {
        for name in ["mm", "km", "nm"] {
            folder
                .run(&format!("render {name}.nrrd -o {name}.png --overwrite {SMALL} {flags}"))
                .ok();
        }
        for name in ["km", "nm"] {
            let comparison = folder.json(&format!("compare mm.png {name}.png --json"));
            let psnr = comparison["psnr"].as_f64().unwrap_or(f64::INFINITY);
            assert!(psnr > 50.0, "{name} {flags}: {psnr} dB");
        }
    }
}

/// Two volumes in one picture: flags are for both, or for one of them.
#[test]
fn each_volume_has_its_own_function() {
    let folder = folder();
    let mut other = ball();
    // Four slices further, and a bit aside.
    other.rotate_right(4 * 16 * 16 + 3);
    folder.put("b.nrrd", nrrd("uint8", &other));
    let mut drawn = 0;
    let mut render = |flags: &str| {
        drawn += 1;
        let name = format!("{drawn}.png");
        let report = folder.json(&format!("render a.nrrd b.nrrd {SMALL} {flags} -o {name} --json"));
        (std::fs::read(folder.path(&name)).unwrap(), report)
    };
    let both = render("--transfer mri");
    assert!(render("--transfer a.nrrd=mri --transfer b.nrrd=mri").0 == both.0);
    let one = render("--transfer mri --transfer b.nrrd=generic");
    assert!(one.0 != both.0);
    assert!(render("--transfer a.nrrd=mri --transfer b.nrrd=generic").0 == one.0);
    assert!(render("--transfer b.nrrd=mri --transfer a.nrrd=generic").0 != one.0);
    let report = render("--transfer mri --iso b.nrrd=50%:red,90 --iso b.nrrd=20 --scalar-bar").1;
    let fields = report["settings"]["fields"].as_array().unwrap();
    let surfaces = |field: usize| fields[field]["isosurfaces"].as_array().unwrap().len();
    assert_eq!((fields.len(), surfaces(0), surfaces(1)), (2, 0, 3), "{report}");
    let bars = report["overlay"]["scalar_bars"].as_array().unwrap();
    let titles: Vec<&str> = bars.iter().map(|bar| bar["title"].as_str().unwrap()).collect();
    assert_eq!(titles, ["a", "b"], "{report}");
    // Both engines draw them.
    let by = ["cpu", "gpu --gpu software"]
        .map(|engine| render(&format!("--transfer mri --engine {engine}")).1["output"].clone());
    let [cpu, gpu] = by.each_ref().map(|name| name.as_str().unwrap());
    let alike = folder.json(&format!("compare {cpu} {gpu} --json"));
    let psnr = alike["psnr"].as_f64().unwrap_or(f64::INFINITY);
    assert!(psnr > 45.0, "{psnr} dB");
    let ranged = render("--transfer generic --range b.nrrd=100,200");
    assert!(ranged.0 != render("--transfer generic").0);
    // A scene file says the same.
    folder.put(
        "s.json",
        r#"{"splatkit_scene": 2, "picture": {"size": [64, 48]}, "appearance": {"transfer": "mri"},
            "inputs": [{"file": "a.nrrd"},
                       {"file": "b.nrrd", "appearance": {"transfer": "generic"}}]}"#,
    );
    folder.run("render s.json -o s.png").ok();
    assert!(std::fs::read(folder.path("s.png")).unwrap() == one.0);
}

#[test]
fn what_several_volumes_cannot_do_is_told() {
    let folder = folder();
    folder.put("b.nrrd", nrrd("uint8", &ball()));
    let render =
        |flags: &str| folder.run(&format!("render a.nrrd b.nrrd -o o.png {SMALL} {flags}"));
    render("--transfer c.nrrd=mri").fails(2, &["--transfer c.nrrd=…", "no input has this name"]);
    render("--iso c.nrrd=3").fails(2, &["--iso c.nrrd=…", "no input has this name"]);
    render("--transfer mri --transfer generic").fails(2, &["--transfer is given twice"]);
    render("--range 1,2 --range 3,4").fails(2, &["--range is given twice"]);
    render("--transfer b.nrrd=bones").fails(2, &["bones"]);
    render("--classify pre").fails(2, &["after interpolation"]);
    let linear = "--engine gpu --gpu software --kernel linear";
    render(linear).fails(2, &["the kernel linear", "the CPU engine does"]);
    let nine = "--iso 1,2,3 --iso b.nrrd=1,2,3,4,5,6,7,8,9";
    render(nine).fails(2, &["9 isosurfaces are given; at most 8"]);
}

//! `splatkit transfer`, and the transfer functions of pictures. They need an adapter; a software
//! adapter is enough.

mod common;

use common::*;

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
            let found = folder.json(&format!("compare mm.png {name}.png --json"));
            let psnr = found["psnr"].as_f64().unwrap_or(f64::INFINITY);
            assert!(psnr > 50.0, "{name} {flags}: {psnr} dB");
        }
    }
}

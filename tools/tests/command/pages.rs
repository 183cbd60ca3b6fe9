//! Pages for browsers: what is in them. tools/web/test opens them.

use crate::common::*;
use splatkit::{formats::ply, surface::Mesh, volume::phantoms::Phantom};
use std::fs;

/// An engine, packed by lzip: the word “engine”.
const ENGINE: [u8; 42] = [
    0x4c, 0x5a, 0x49, 0x50, 0x01, 0x1a, 0x00, 0x32, 0x9b, 0x89, 0x19, 0xdf, 0xb8, 0x67, 0xcd, 0xf9,
    0x7f, 0xff, 0xfc, 0xd5, 0xc0, 0x00, 0x8d, 0x1a, 0xa8, 0xe8, 0x06, 0x00, 0x00, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x2a, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
];

/// Returns a folder with a viewer that draws nothing.
fn folder() -> Folder {
    let folder = Folder::new();
    fs::create_dir(folder.path("viewer")).unwrap();
    folder.put("viewer/splatkit-worker.js", "// draws");
    folder.put("viewer/splatkit-viewer.js", "// shows");
    folder.put("viewer/splatkit-unpack.wasm", "unpacks");
    folder.put("viewer/splatkit.wasm.lz", ENGINE);
    folder
}

#[test]
fn a_page_shows_a_part_of_its_inputs() {
    let folder = folder();
    ply::write(&Mesh::knot(120, 30), folder.path("a.ply")).unwrap();
    let volume = Phantom::MarschnerLobb.sample_bytes([40; 3]).unwrap();
    splatkit::formats::nrrd::write(&volume, folder.path("a.nrrd")).unwrap();
    let page = |name: &str, flags: &str| {
        folder.json(&format!("publish a.ply a.nrrd --viewer viewer -o {name} --json {flags}"))
    };
    let whole = page("whole", "");
    assert_eq!(fs::read(folder.path("whole/splatkit.wasm")).unwrap(), b"engine");
    assert!(whole["files"]["a.ply"].is_u64() && whole["psnr"].is_null(), "{whole}");
    let part = page("part", "--quality 25%");
    assert_eq!(part["share"], 0.25);
    assert!(part["psnr"].as_f64().unwrap() > 20.0, "{part}");
    let counts = |folder_name: &str| {
        let count = |file: &str| {
            folder.json(&format!("info {folder_name}/{file} --json"))["count"].as_f64().unwrap()
        };
        [count("a.ply"), count("a.nrrd")]
    };
    let (all, some) = (counts("whole"), counts("part"));
    for (all, some) in all.into_iter().zip(some) {
        assert!((0.2..0.3).contains(&(some / all)), "{some} of {all}");
    }

    let limited = page("limited.html", "--limit 60KB");
    let bytes = limited["bytes"].as_u64().unwrap();
    assert!((48_000..=60_000).contains(&bytes), "{limited}");
    assert_eq!(fs::metadata(folder.path("limited.html")).unwrap().len(), bytes);
    let roomy = page("roomy.html", "--limit 1GB");
    assert_eq!(roomy["share"], 1.0);

    let publish = "publish a.ply --viewer viewer -o b.html";
    folder.run(&format!("{publish} --limit 100B")).fails(2, &["--limit: the viewer alone has"]);
    folder.run(&format!("{publish} --quality 0%")).fails(2, &["above 0 % and at most 100 %"]);
    folder.run(&format!("{publish} --limit small")).fails(2, &["the units are KiB"]);
    fs::write(folder.path("viewer/splatkit.wasm.lz"), &ENGINE[..30]).unwrap();
    folder.run(publish).fails(3, &["splatkit.wasm.lz", "cannot be read"]);
    assert!(!folder.path("b.html").exists());
}

/// Points keep the values that colour them, and their places far from the origin.
#[test]
fn a_thinned_cloud_is_coloured_as_before() {
    let folder = folder();
    let rows = (0..4000).map(|at| {
        let (x, y) = (500_000.0 + f64::from(at % 64) / 8.0, f64::from(at / 64) / 8.0);
        format!("{x} {y} {} {at}\n", (x + y).sin())
    });
    let head = "ply\nformat ascii 1.0\nelement vertex 4000\nproperty double x\n\
                property double y\nproperty double z\nproperty float heat\nend_header\n";
    folder.put("a.ply", format!("{head}{}", rows.collect::<String>()));
    folder.run("publish a.ply --color heat --viewer viewer -o site --quality 50%").ok();
    let text = fs::read_to_string(folder.path("site/scene.json")).unwrap();
    assert!(text.contains("\"file\": \"a.ply\"") && text.contains("\"color\": \"heat\""), "{text}");
    let info = folder.json("info site/a.ply --json --stats");
    let text = info.to_string();
    assert!(text.contains("heat") && text.contains("5000"), "{text}");
    folder.run("render site/scene.json -o a.png --size 40x30 --engine cpu").ok();
}

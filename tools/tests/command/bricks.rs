//! Volumes in bricks: `splatkit convert`, `info` and `check`.

use crate::common::*;

/// 100 × 40 × 70 bytes that change along all axes.
fn bytes() -> Vec<u8> {
    (0..100 * 40 * 70).map(|i| (i % 100 + i / 100 % 40 + 2 * (i / 4000)) as u8 / 2).collect()
}

#[test]
fn volumes_of_any_format_become_bricks() {
    let folder = Folder::new();
    folder.put("a.raw", ball());
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.vti", vti());
    let range = folder.json("info a.vti --json")["range"].clone();
    let slice_by_slice = |arguments: &str| {
        let report = folder.json(&format!("convert {arguments} -o a.splv --overwrite --json"));
        assert_eq!(
            (report["dims"].clone(), report["type"].as_str()),
            (serde_json::json!([16, 16, 16]), Some("u8"))
        );
        folder.run("check a.splv").ok();
        let facts = folder.json("info a.splv --json");
        assert_eq!((facts["kind"].as_str(), &facts["range"]), (Some("volume in bricks"), &range));
        report["slice_by_slice"].as_bool().unwrap()
    };
    assert!(slice_by_slice("a.raw --dims 16x16x16 --type u8"));
    assert!(slice_by_slice("a.nrrd"));
    assert!(!slice_by_slice("a.vti"));
}

#[test]
fn bricks_tell_what_they_hold() {
    let folder = Folder::new();
    folder.put("a.raw", bytes());
    let arguments = "convert a.raw --dims 100x40x70 --type u8 --spacing 1,2,3 -o a.splv --unit mm";
    let expected = folder.json(&format!("{arguments} --dry-run --json"));
    assert_eq!(
        (expected["slice_by_slice"].as_bool(), expected["type"].as_str()),
        (Some(true), Some("u8"))
    );
    assert!(!folder.path("a.splv").exists());
    let text = folder.run(arguments).ok().stdout;
    assert!(String::from_utf8_lossy(&text).contains("280000 (100 × 40 × 70, u8)"));
    let facts = folder.json("info a.splv --json");
    assert_eq!(
        (facts["dims"].clone(), facts["spacing"].clone()),
        (serde_json::json!([100, 40, 70]), serde_json::json!([1.0, 2.0, 3.0]))
    );
    // 4 × 2 × 3, 2 × 1 × 2 and 1 bricks.
    assert_eq!((facts["levels"].as_u64(), facts["bricks"].as_u64()), (Some(3), Some(29)));
    assert_eq!((facts["unit"].as_str(), facts["source"].as_str()), (Some("mm"), Some("a.raw")));
    assert_eq!(folder.json("check a.splv --json")["ok"].as_bool(), Some(true));
    // The first bytes of a file name its kind.
    std::fs::rename(folder.path("a.splv"), folder.path("b")).unwrap();
    assert_eq!(folder.json("info b --json")["levels"].as_u64(), Some(3));
    folder.run("render b -o b.png --size 64x48").ok();
    folder
        .run("convert b -o b.splk")
        .fails(2, &["hierarchies are built from meshes and point clouds"]);
    folder.run("convert b -o b.splv").fails(2, &["b holds a volume in bricks already"]);
}

#[test]
fn damaged_bricks_are_found() {
    let folder = Folder::new();
    folder.put("a.raw", bytes());
    folder.run("convert a.raw --dims 100x40x70 --type u8 -o a.splv").ok();
    let whole = std::fs::read(folder.path("a.splv")).unwrap();
    let mut damaged = whole.clone();
    damaged[whole.len() - 100] ^= 1;
    folder.put("flip.splv", &damaged);
    let run = folder.run("check flip.splv");
    let stdout = run.stdout();
    assert!(
        stdout.contains("error (hash)") && stdout.contains("error (brick) level 0, brick 23"),
        "{stdout}"
    );
    folder.put("cut.splv", &whole[..whole.len() - 7]);
    folder.run("info cut.splv").fails(3, &["cut.splv", "the file is incomplete"]);
    folder.put("not.splv", "text");
    folder.run("info not.splv").fails(3, &["not.splv", "is not a volume in bricks"]);
}

#[test]
fn what_cannot_be_cut_in_bricks_is_told() {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.raw", ball());
    folder.put("a.ply", PLY);
    folder.run("convert a.nrrd -o bcc.nrrd --lattice bcc").ok();
    folder.run("convert bcc.nrrd -o a.splv").fails(3, &["bcc.nrrd", "body-centred", "Cartesian"]);
    folder.run("convert a.ply -o a.splv").fails(2, &["a.ply", "holds no volume"]);
    folder.run("convert a.nrrd a.nrrd -o a.splv").fails(2, &["one by one"]);
    folder.run("convert a.nrrd -o a.splv --lattice bcc").fails(2, &["--lattice is for"]);
    folder.run("convert a.nrrd -o a.splv --memory 1MiB").fails(2, &["--memory allows more"]);
    folder
        .run("convert a.raw --dims 16x16x17 --type u8 -o a.splv")
        .fails(3, &["a.raw", "16 × 16 × 17"]);
    folder.put("nan.nrrd", nrrd("float", &f32::NAN.to_le_bytes().repeat(4096)));
    folder.run("convert nan.nrrd -o a.splv").fails(3, &["nan.nrrd", "none of the", "has a value"]);
    assert_eq!(folder.names(), ["a.nrrd", "a.ply", "a.raw", "bcc.nrrd", "nan.nrrd"]);
}

#[test]
fn generated_bytes_come_slice_by_slice() {
    let folder = Folder::new();
    folder.run("generate ball -o a.nrrd --dims 40x30x20 --type u8").ok();
    let report = folder.json("convert a.nrrd -o a.splv --json");
    assert_eq!(
        (report["type"].as_str(), report["slice_by_slice"].as_bool()),
        (Some("u8"), Some(true))
    );
    assert_eq!(folder.json("info a.nrrd --json")["dims"], serde_json::json!([40, 30, 20]));
    folder.run("generate head -o b.nrrd --type u8").fails(2, &["head"]);
}

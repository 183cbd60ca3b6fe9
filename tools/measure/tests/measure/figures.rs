//! The figures of quality.

use crate::common::*;

/// Returns a figure of a table, by the beginning of its row's name.
fn figure(table: &serde_json::Value, row: &str, column: &str) -> f64 {
    let rows = table["rows"].as_array().unwrap();
    let row = rows.iter().find(|entry| entry["name"].as_str().unwrap().starts_with(row)).unwrap();
    row[column].as_f64().unwrap()
}

#[test]
fn figures_are_measured_and_written() {
    let folder = Folder::new();
    let marks = [
        "<!-- figures: written by `splatkit-measure figures --write` -->",
        "<!-- end of figures -->",
    ];
    folder
        .put("page.md", format!("before\n{}\n**Another.** Kept.\n{}\nafter\n", marks[0], marks[1]));
    folder.put("plain.md", "no marks");
    folder.run("figures --only ripple --write plain.md").fails(3, &["plain.md", "end of figures"]);
    folder.run("figures --only ripple --write page.md").ok();
    let page = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(page.starts_with("before\n<!--") && page.ends_with("-->\nafter\n"), "{page}");
    assert!(page.contains("\n**Another.** Kept.\n"), "{page}");
    assert!(page.contains("| Gaussian, σ 0.6, extent 2 (default) | 1."), "{page}");
    let report = folder.json("figures --only bleeding --json");
    let bleeding = &report["tables"][0];
    // Slices of the data along the other axis contain both slabs side by side.
    assert!(
        figure(bleeding, "axis-aligned sheets", "50°")
            > 2.0 * figure(bleeding, "image-aligned sheets", "50°"),
        "{report}"
    );
}

/// Inputs that cannot be measured and results that cannot be kept are reported before a GPU is
/// opened: none has this name.
#[test]
fn wrong_inputs_and_outputs_of_figures_are_told_first() {
    let folder = Folder::new();
    folder.put("a.obj", OBJ);
    folder.put("a.ply", PLY);
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("b.obj", OBJ);
    folder.put("b_splats.png", "kept");
    for (arguments, code, words) in [
        ("a.nrrd a.obj", 3, ["a.obj: file: is not a volume", ""]),
        ("a.nrrd none.nrrd", 3, ["none.nrrd", "cannot open"]),
        ("a.nrrd --only ripple", 2, ["volumes are for the part dense", "--only"]),
        ("--surfaces a.obj a.nrrd", 3, ["a.nrrd: file: is not a mesh", ""]),
        ("--detail a.obj a.nrrd", 3, ["a.nrrd: file: is not a mesh, point cloud or hierarchy", ""]),
        ("--surfaces a.obj --pictures none", 1, ["none/a_truth.png", "make the folder first"]),
        (
            "--surfaces a.obj a.ply --pictures .",
            2,
            ["a_truth.png would be the picture of a.obj and of a.ply", ""],
        ),
        ("--surfaces b.obj --pictures .", 1, ["b_splats.png: exists already", "--overwrite"]),
        ("--surfaces b.obj --pictures . --overwrite", 4, ["no usable GPU", ""]),
        ("--surfaces b.obj --overwrite", 2, ["--pictures", ""]),
    ] {
        folder.run(&format!("figures --gpu none-of-this-name {arguments}")).fails(code, &words);
    }
    assert!(!folder.path("a_truth.png").exists());
    assert_eq!(std::fs::read(folder.path("b_splats.png")).unwrap(), b"kept");
}

#[cfg(unix)]
#[test]
fn pages_that_are_no_files_are_refused() {
    let folder = Folder::new();
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.md")).unwrap();
    let mut pages = vec!["zero.md"];
    let pipe = std::process::Command::new("mkfifo").arg(folder.path("pipe.md")).status();
    if pipe.is_ok_and(|status| status.success()) {
        pages.push("pipe.md");
    }
    for page in pages {
        for command in ["figures --only ripple", "suite --effort quick"] {
            folder
                .run(&format!("{command} --write {page}"))
                .fails(3, &[page, "is not a regular file"]);
        }
    }
}

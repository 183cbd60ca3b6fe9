//! Generated data and the figures that are measured with it.

mod common;

use common::*;

#[test]
fn phantoms_become_files() {
    let folder = Folder::new("generate");
    folder.run("generate ball -o ball.nrrd --dims 9x7x5").ok();
    let found = folder.json("info ball.nrrd --json");
    assert_eq!((&found["dims"], found["type"].as_str()), (&serde_json::json!([9, 7, 5]), Some("f32")));
    assert_eq!(found["bounds"]["max"], serde_json::json!([1.0, 1.0, 1.0]));
    folder.run("generate ball -o ball.csv --points 12").ok();
    assert_eq!(std::fs::read_to_string(folder.path("ball.csv")).unwrap().lines().count(), 13);
    folder.run("generate ball -o ball.csv").fails(1, &["ball.csv", "exists", "--overwrite"]);
    folder.run("generate ball -o ball.vti").fails(2, &[".nrrd, .vtr, .csv or .ply"]);
    folder.run("generate egg -o egg.nrrd").fails(2, &["marschner-lobb", "head"]);
    folder.run("generate ball -o none.nrrd --dims 0x2x2").fails(2, &["holds none"]);
}

/// A table's figure, by the beginning of its row's name.
fn figure(table: &serde_json::Value, row: &str, column: &str) -> f64 {
    let rows = table["rows"].as_array().unwrap();
    let row = rows.iter().find(|found| found["name"].as_str().unwrap().starts_with(row)).unwrap();
    row[column].as_f64().unwrap()
}

#[test]
fn figures_are_measured_and_written() {
    let folder = Folder::new("figures");
    let marks = ["<!-- figures: written by `splatkit figures --write` -->", "<!-- end of figures -->"];
    folder.put("page.md", format!("before\n{}\nold\n{}\nafter\n", marks[0], marks[1]));
    folder.put("plain.md", "no marks");
    folder.run("figures --only ripple --write plain.md").fails(3, &["plain.md", "end of figures"]);
    folder.run("figures --only ripple --write page.md").ok();
    let page = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(page.starts_with("before\n<!--") && page.ends_with("-->\nafter\n") && !page.contains("old"), "{page}");
    assert!(page.contains("| Gaussian, σ 0.6, extent 2 (default) | 1."), "{page}");
    let found = folder.json("figures --only bleeding --json");
    let bleeding = &found["tables"][0];
    // Slices of the data along the other axis hold both slabs side by side.
    assert!(
        figure(bleeding, "axis-aligned sheets", "50°") > 2.0 * figure(bleeding, "image-aligned sheets", "50°"),
        "{found}"
    );
}

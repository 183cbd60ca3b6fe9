//! Files that VTK itself writes are read as VTK means them: every kind of data set in every mode,
//! with every compressor, in pieces, and with arrays that are not numbers. Skipped where Python has
//! no package `vtk`; `SPLATKIT_PYTHON` names another Python.

use crate::testing::folder::Folder;
use serde_json::Value;
use splatkit::{
    formats::{self, Kind, ReadOptions},
    input::Limits,
    math::Bounds,
    surface::Mesh,
};
use std::{path::Path, process::Command};

/// Writes the files. Returns what VTK says of each; `None` if there is no VTK.
fn write(folder: &Folder) -> Option<Vec<Value>> {
    let python = std::env::var("SPLATKIT_PYTHON").unwrap_or_else(|_| "python3".into());
    let has_vtk = Command::new(&python).args(["-c", "import vtk"]).output();
    if !has_vtk.is_ok_and(|out| out.status.success()) {
        println!("skipped: {python} has no package vtk");
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files/vtk_files.py");
    let out = Command::new(&python).arg(script).arg(folder.path("")).output().expect("Python");
    let text = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    Some(text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect())
}

fn area(mesh: &Mesh) -> f64 {
    let size = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
        (b - a).cross(c - a).length() / 2.0
    };
    mesh.triangles.iter().map(size).sum()
}

/// What is read of a file, with an array: counts of points and cells, bounds, range, area.
struct Summary {
    points: usize,
    cells: Option<usize>,
    bounds: Bounds,
    range: [f64; 2],
    area: Option<f64>,
}

fn read(path: &Path, kind: Kind, options: &ReadOptions) -> splatkit::Result<Summary> {
    let limits = Limits::default();
    Ok(match kind {
        Kind::Volume => {
            let volume = formats::load_volume(path, &limits, options)?;
            let (points, bounds) = (volume.len(), volume.bounds());
            Summary { points, cells: None, bounds, range: volume.range, area: None }
        }
        Kind::Cells => {
            let cells = formats::load_cells(path, &limits, options)?;
            let (points, count) = (cells.points.len(), Some(cells.len()));
            let (bounds, range) = (cells.bounds(), cells.range());
            Summary { points, cells: count, bounds, range, area: None }
        }
        _ => {
            let mesh = formats::load_mesh(path, &limits, options)?;
            let ends = mesh.values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |range, &v| {
                [range[0].min(v.into()), range[1].max(v.into())]
            });
            let (bounds, size) = (mesh.bounds().expect("points"), Some(area(&mesh)));
            Summary { points: mesh.positions.len(), cells: None, bounds, range: ends, area: size }
        }
    })
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("f64")).collect()
}

/// Whether numbers agree to 32-bit floats of a size.
fn near(a: f64, b: f64, size: f64) -> bool {
    (a - b).abs() <= 2e-6 * size.abs().max(1.0)
}

fn check(folder: &Folder, facts: &Value, scalar: Option<&str>, key: &str) {
    let name = facts["file"].as_str().expect("a name");
    let what = format!("{name} with {scalar:?}");
    let path = folder.path(name);
    let options = ReadOptions::scalar(scalar);
    let kind = Kind::of(&path, &Limits::default(), &options);
    let kind = kind.unwrap_or_else(|error| panic!("{what}: {error}")).expect("a known kind");
    let expected = match facts["kind"].as_str() {
        Some("volume") => Kind::Volume,
        Some("cells") => Kind::Cells,
        _ => Kind::Mesh,
    };
    assert_eq!(kind, expected, "{what}");
    let summary = read(&path, kind, &options).unwrap_or_else(|error| panic!("{what}: {error}"));
    let range = numbers(&facts[key]);
    assert!(
        near(summary.range[0], range[0], range[1]) && near(summary.range[1], range[1], range[1]),
        "{what}: {:?} instead of {range:?}",
        summary.range
    );
    let of_cells = key == "c";
    if let (Kind::Cells, Some(cells)) = (kind, summary.cells) {
        assert_eq!(Some(cells as u64), facts["cells"].as_u64(), "{what}");
    }
    if kind == Kind::Volume {
        let count = if of_cells { &facts["cells"] } else { &facts["points"] };
        assert_eq!(Some(summary.points as u64), count.as_u64(), "{what}");
    }
    let bounds = numbers(&facts["bounds"]);
    for (axis, ends) in bounds.chunks(2).enumerate().filter(|_| !(of_cells && kind == Kind::Volume))
    {
        let size = ends[0].abs().max(ends[1].abs());
        let actual = [summary.bounds.min[axis], summary.bounds.max[axis]];
        let fits = near(actual[0], ends[0], size) && near(actual[1], ends[1], size);
        assert!(fits, "{what}: axis {axis}: {actual:?} instead of {ends:?}");
    }
    if let (Some(actual), Some(area)) = (summary.area, facts["area"].as_f64()) {
        assert!((actual - area).abs() < 1e-4 * area, "{what}: area {actual} instead of {area}");
    }
}

#[test]
fn files_of_vtk_are_read_as_vtk_means_them() {
    let folder = Folder::new();
    let Some(files) = write(&folder) else { return };
    assert!(files.len() > 100, "{} files", files.len());
    for facts in &files {
        if facts.get("RTData").is_some() {
            check(&folder, facts, None, "RTData");
            continue;
        }
        // Without a name it is neither the identifiers nor the strings, which come first.
        check(&folder, facts, None, "t");
        check(&folder, facts, Some("v"), "v");
        check(&folder, facts, Some("cell:c"), "c");
    }
}

//! Files that the programs of laboratories write are read as these programs mean them: NumPy,
//! SimpleITK (MetaImage), tifffile, mrcfile and h5py. Every sample is compared. A package that
//! Python does not have is skipped, with a word; `SPLATKIT_PYTHON` names another Python.

use crate::testing::folder::Folder;
use glam::DVec3;
use serde_json::Value;
use splatkit::{
    formats::{ReadOptions, load_volume},
    input::Limits,
};
use std::{path::Path, process::Command};

/// Writes the files of a package. Returns what it says of each; `None` if Python does not have it.
fn write(folder: &Folder, package: &str) -> Option<Vec<Value>> {
    let python = std::env::var("SPLATKIT_PYTHON").unwrap_or_else(|_| "python3".into());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files/laboratories.py");
    let arguments = [script.as_path(), folder.as_ref(), Path::new(package)];
    let out = Command::new(&python).args(["-W", "ignore"]).args(arguments).output();
    let Ok(out) = out else {
        println!("skipped: there is no {python}");
        return None;
    };
    let errors = String::from_utf8_lossy(&out.stderr);
    if out.status.code() == Some(3) {
        println!("skipped: {python} has no package {package}");
        return None;
    }
    assert!(out.status.success(), "{errors}");
    println!("{errors}");
    let text = String::from_utf8_lossy(&out.stdout);
    Some(text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect())
}

fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array().map(|all| all.iter().filter_map(Value::as_f64).collect())
}

fn compare(folder: &Folder, line: &Value) {
    let text = |value: &Value| value.as_str().map(String::from);
    let file = text(&line["file"]).expect("a name");
    let how = &line["how"];
    let options = ReadOptions {
        scalar: text(&how["scalar"]),
        dataset: text(&how["dataset"]),
        time: how["time"].as_u64().map(|time| time as usize),
        ..ReadOptions::default()
    };
    let volume = load_volume(folder.path(&file), &Limits::default(), &options)
        .unwrap_or_else(|error| panic!("{file} {how}: {error}"));
    let shape: Vec<f64> = volume.lattice.dims.iter().rev().map(|&n| n as f64).collect();
    assert_eq!(numbers(&line["shape"]), Some(shape), "{file} {how}");
    let expected = std::fs::read(folder.path(text(&line["expected"]).expect("a name")));
    let expected = expected.expect("the values");
    for (index, &value) in expected.as_chunks().0.iter().enumerate() {
        let (actual, value) = (volume.value(index), f64::from_le_bytes(value));
        let near = (actual - value).abs() <= 1e-6 * value.abs();
        assert!(near, "{file} {how}: sample {index} is {actual}, not {value}");
    }
    let near = |a: DVec3, b: Vec<f64>| (a - DVec3::from_slice(&b)).abs().max_element() < 1e-5;
    if let Some(spacing) = numbers(&line["spacing"]) {
        assert!(near(volume.lattice.spacing(), spacing), "{file}: {:?}", volume.lattice);
    }
    if let Some(origin) = numbers(&line["origin"]) {
        assert!(near(volume.lattice.origin, origin), "{file}: {:?}", volume.lattice);
    }
    if let Some(at) = numbers(&how["at"]) {
        let position = volume.lattice.position(DVec3::new(3.0, 1.0, 2.0));
        assert!(near(position, at), "{file}: {:?}", volume.lattice);
    }
}

fn check(package: &str, at_least: usize) {
    let folder = Folder::new();
    let Some(lines) = write(&folder, package) else { return };
    assert!(lines.len() >= at_least, "{package} wrote {} files", lines.len());
    lines.iter().for_each(|line| compare(&folder, line));
}

#[test]
fn files_of_numpy() {
    check("numpy", 22);
}

#[test]
fn files_of_simple_itk() {
    check("SimpleITK", 15);
}

#[test]
fn files_of_tifffile() {
    check("tifffile", 20);
}

#[test]
fn files_of_mrcfile() {
    check("mrcfile", 7);
}

#[test]
fn files_of_h5py() {
    check("h5py", 14);
}

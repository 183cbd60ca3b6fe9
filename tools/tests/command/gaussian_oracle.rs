//! Another program reads the trained Gaussians that are written here, and writes others that are
//! read here: splat-transform of PlayCanvas. Every number of every Gaussian is compared.
//!
//! npm installs the program into the build folder once. Where it cannot, the tests are skipped with
//! a word. `SPLATKIT_SPLAT_TRANSFORM` names a program that is installed already.

use crate::common::{trained::*, *};
use std::{
    fs,
    path::{Path, PathBuf},
    process::{self, Command, Output},
    sync::OnceLock,
};

/// The version that is compared. Those before 3 turn the axes of SPZ.
const VERSION: &str = "3.7.0";

/// Returns the program; `None` if there is none.
fn program() -> Option<&'static Path> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let find = || {
        let named = std::env::var_os("SPLATKIT_SPLAT_TRANSFORM").map(PathBuf::from);
        let program = named.or_else(installed)?;
        let runs = Command::new(&program).arg("--version").output();
        if runs.is_ok_and(|output| output.status.success()) {
            return Some(program);
        }
        println!("skipped: {} does not run here", program.display());
        None
    };
    PROGRAM.get_or_init(find).as_deref()
}

/// Returns the program in the build folder, and installs it there if it is missing.
fn installed() -> Option<PathBuf> {
    let build = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let home = build.join(format!("splat-transform-{VERSION}"));
    let program = home.join("node_modules/.bin/splat-transform");
    if program.exists() {
        return Some(program);
    }
    let made = build.join(format!("splat-transform-{VERSION}.{}", process::id()));
    fs::create_dir_all(&made).expect("a folder");
    let package = format!("@playcanvas/splat-transform@{VERSION}");
    // The program needs none of the scripts that packages would run.
    let flags = ["--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=0"];
    let npm = Command::new("npm")
        .args(["install", "--prefix"])
        .arg(&made)
        .args(flags)
        .args(["--fetch-timeout=60000", &package])
        .output();
    match &npm {
        Ok(output) if output.status.success() => {
            // Another process may have been faster.
            fs::rename(&made, &home).ok();
        }
        Ok(output) => println!("skipped: npm cannot install {package}: {}", errors(output)),
        Err(error) => println!("skipped: npm does not run: {error}"),
    }
    fs::remove_dir_all(&made).ok();
    program.exists().then_some(program)
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Converts a file of the folder with the other program.
fn transform(program: &Path, folder: &Folder, flags: &[&str], from: &str, to: &str) {
    let output = Command::new(program)
        .current_dir(folder)
        .args(["--quiet", "--overwrite", "--gpu", "cpu"])
        .args(flags)
        .args([from, to])
        .output()
        .expect("the program runs");
    let is_there = folder.path(to).exists();
    assert!(output.status.success() && is_there, "{from} to {to}: {}", errors(&output));
}

/// The viewer that .splat comes from reads the bytes of a turn as (byte − 128) / 128, and so does
/// splatkit. The other program spreads them from −1 to 1.
fn allowed(extension: &str, most: Apart) -> Apart {
    if extension == "splat" { Apart { turn: 0.025, ..most } } else { most }
}

#[test]
fn what_is_written_is_read_alike() {
    let Some(program) = program() else { return };
    let folder = Folder::new();
    for degree in 0..=3 {
        let set = scene(degree);
        // It does not read glTF.
        for (extension, highest, most) in
            WRITTEN.into_iter().filter(|(extension, ..)| *extension != "glb")
        {
            let name = format!("ours-{degree}.{extension}");
            write(&set, extension, &folder.path(&name));
            transform(program, &folder, &[], &name, "theirs.ply");
            let (ours, theirs) = (load(&folder, &name), load(&folder, "theirs.ply"));
            assert_eq!((theirs.degree, ours.degree), (degree.min(highest), degree.min(highest)));
            let [most, alike] = [most, Apart::EXACT].map(|most| allowed(extension, most));
            Apart::of(&theirs, &set).within(&most, &name);
            Apart::of(&theirs, &ours).within(&alike, &format!("{name}, read by both"));
        }
    }
}

#[test]
fn what_others_write_is_read_alike() {
    let Some(program) = program() else { return };
    let folder = Folder::new();
    for degree in [0, 1, 3] {
        let set = scene(degree);
        write(&set, "ply", &folder.path("scene.ply"));
        fs::create_dir_all(folder.path(degree.to_string())).expect("a folder");
        for (spz, name) in [
            ("4", format!("{degree}.compressed.ply")),
            ("3", format!("{degree}-3.spz")),
            ("4", format!("{degree}-4.spz")),
            ("4", format!("{degree}.sog")),
            ("4", format!("{degree}/meta.json")),
        ] {
            transform(program, &folder, &["--spz-version", spz], "scene.ply", &name);
            transform(program, &folder, &[], &name, "theirs.ply");
            let (ours, theirs) = (load(&folder, &name), load(&folder, "theirs.ply"));
            assert_eq!((ours.degree, theirs.degree), (degree, degree), "{name}");
            Apart::of(&ours, &theirs).within(&Apart::EXACT, &name);
        }
        // Its glTF files stand upright: they are turned by 180° about z.
        let name = format!("{degree}.glb");
        transform(program, &folder, &[], "scene.ply", &name);
        Apart::of(&half_turn(load(&folder, &name), 2), &set).within(&Apart::EXACT, &name);
    }
}

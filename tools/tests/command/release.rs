//! The names of what a release packs: those that tools/release makes for the targets of the
//! workflow are those that `cargo binstall` asks for, by the metadata of tools/Cargo.toml.

use serde_json::Value;
use std::{fs, path::Path, process::Command};

/// Returns the project's folder.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

fn stdout(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Returns the metadata for `cargo binstall`.
fn metadata() -> Value {
    let cargo = ["metadata", "--format-version", "1", "--no-deps", "--offline", "--locked"];
    let text = stdout(Command::new(env!("CARGO")).args(cargo).current_dir(root()));
    let all: Value = serde_json::from_str(&text).unwrap();
    let packages = all["packages"].as_array().unwrap();
    let tools = packages.iter().find(|package| package["name"] == "splatkit-tools").unwrap();
    tools["metadata"]["binstall"].clone()
}

/// Returns the targets that the workflow builds for.
fn targets() -> Vec<String> {
    let workflow = fs::read_to_string(root().join(".github/workflows/release.yml")).unwrap();
    let targets = workflow.lines().filter_map(|line| line.trim().strip_prefix("- target: "));
    targets.map(str::to_owned).collect()
}

/// Fills a template, as `cargo binstall` does.
fn fill(template: &Value, target: &str) -> String {
    let extension = if target.contains("windows") { ".exe" } else { "" };
    template
        .as_str()
        .unwrap()
        .replace("{ version }", env!("CARGO_PKG_VERSION"))
        .replace("{ target }", target)
        .replace("{ bin }", "splatkit")
        .replace("{ binary-ext }", extension)
}

#[test]
fn archives_are_named_as_binstall_expects() {
    let metadata = metadata();
    let targets = targets();
    assert_eq!(targets.len(), 5, "{targets:?}");
    for target in &targets {
        let field = |key: &str| {
            let value = &metadata["overrides"][target][key];
            if value.is_null() { metadata[key].clone() } else { value.clone() }
        };
        let mut release = Command::new(root().join("tools/release"));
        let archive = stdout(release.args(["--archive", target]));
        let archive = archive.trim_end();
        let version = env!("CARGO_PKG_VERSION");
        let url = format!("{{ repo }}/releases/download/v{version}/{archive}");
        assert_eq!(fill(&field("pkg-url"), target), url);
        let format = if archive.ends_with(".zip") { "zip" } else { "txz" };
        assert_eq!(field("pkg-fmt"), format, "{target}");
        // tools/release packs one folder of the archive's name, and looks for the program there.
        let folder = archive.trim_end_matches(".zip").trim_end_matches(".tar.xz");
        let program = if target.contains("windows") { "splatkit.exe" } else { "splatkit" };
        assert_eq!(fill(&field("bin-dir"), target), format!("{folder}/{program}"));
    }
    let overrides = metadata["overrides"].as_object().unwrap();
    assert!(overrides.keys().all(|target| targets.contains(target)), "{overrides:?}");
}

#[test]
fn notes_need_a_tag_of_this_version() {
    let mut release = Command::new(root().join("tools/release"));
    let output = release.args(["--notes", "v999.0.0"]).output().unwrap();
    assert!(!output.status.success());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(stderr.contains("the tag must be v"), "{stderr}");
}

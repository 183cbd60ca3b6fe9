//! Tests that a scene is written alike, whoever describes it: the flags, the window, and Python.
//!
//! tools/tests/scenes.json holds flags, and the text of the scene file that they describe. The test
//! of the Python package (tools/python/tests/test_scenes.py) compares its files with the same
//! texts. `SPLATKIT_WRITE=1` writes the file.

use super::document::{Document, tests::document};
use serde_json::{Value, json};
use splatkit::session::Description;
use std::{fs, path::Path};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scenes.json");

/// Returns the text of the scene file of these flags.
fn of_flags(flags: &str) -> String {
    document(&format!("splatkit render {flags}")).scene().to_json(Path::new(""))
}

/// Returns the text that the window saves after it has opened a scene file.
fn of_window(scene: &str, folder: &Path) -> String {
    let [opened, saved] = ["opened.json", "saved.json"].map(|name| folder.join(name));
    fs::write(&opened, scene).expect("a file");
    // Names of files that are there are written as seen from the scene file.
    let json: Value = serde_json::from_str(scene).expect(scene);
    for input in json["inputs"].as_array().expect(scene) {
        fs::write(folder.join(input["file"].as_str().expect(scene)), "").expect("a file");
    }
    let mut document = Document::new(Description::new([]), Default::default());
    let read = Description::read(&opened, &Default::default()).expect(scene);
    document.open(read, opened);
    // Panels change what an input says, not what all inputs share.
    document.change(|scene| {
        let shared = std::mem::take(&mut scene.appearance);
        for input in &mut scene.inputs {
            let entry = Description { appearance: shared.clone(), ..Description::new([]) };
            input.appearance = entry.appearance_of(input);
        }
    });
    document.save(&saved).expect("a file");
    fs::read_to_string(saved).expect("a text")
}

#[test]
fn flags_and_the_window_write_the_same_scene_files() {
    let text = fs::read_to_string(FILE).expect("a list of scenes");
    let mut cases: Vec<Value> = serde_json::from_str(&text).expect("a list of scenes");
    assert!(cases.len() >= 20, "{} scenes", cases.len());
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        for case in &mut cases {
            case["scene"] = json!(of_flags(case["flags"].as_str().expect("flags")));
        }
        let text = serde_json::to_string_pretty(&cases).expect("texts") + "\n";
        fs::write(FILE, text).expect("a file");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for case in &cases {
        let [flags, scene] = ["flags", "scene"].map(|name| case[name].as_str().expect("a text"));
        assert_eq!(of_flags(flags), scene, "{flags}: SPLATKIT_WRITE=1 writes {FILE}");
        assert_eq!(of_window(scene, folder.path()), scene, "{flags}");
    }
}

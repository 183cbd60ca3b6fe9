//! What users come for, by mouse and keys alone: each test is one task, told in docs/window.md.

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../../../../tests/inputs/medical.rs"]
mod inputs;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../../../../tests/testing/server.rs"]
mod server;

use super::*;
use egui::{Key, Modifiers, ViewportCommand, ViewportId};
use inputs::{dicom, element};
use server::Server;
use std::{fmt::Write as _, path::PathBuf};

type Driven = Harness<'static, Option<Window>>;

fn steps(harness: &mut Driven, count: usize) {
    for _ in 0..count {
        harness.step();
    }
}

fn click(harness: &mut Driven, label: &str) {
    harness.get_by_label(label).click();
    steps(harness, 5);
}

fn click_part(harness: &mut Driven, label: &str) {
    harness.get_by_label_contains(label).click();
    steps(harness, 5);
}

fn key(harness: &mut Driven, modifiers: Modifiers, key: Key) {
    harness.key_press_modifiers(modifiers, key);
    steps(harness, 2);
}

fn scene(harness: &mut Driven) -> Description {
    window(harness).document.scene().clone()
}

fn drag(harness: &mut Driven, from: egui::Pos2, by: egui::Vec2) {
    harness.hover_at(from);
    harness.step();
    harness.drag_at(from);
    harness.step();
    for part in 1..5 {
        harness.hover_at(from + by * (part as f32 / 4.0));
        harness.step();
    }
    harness.drop_at(from + by);
    steps(harness, 2);
}

/// A volume of 4³ samples with two arrays, of which the values lie apart.
fn two_arrays(folder: &Path) -> PathBuf {
    let mut text = "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET STRUCTURED_POINTS\n\
        DIMENSIONS 4 4 4\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 64\n"
        .to_owned();
    for (name, first) in [("heat", 0), ("flow", 1000)] {
        write!(text, "SCALARS {name} float 1\nLOOKUP_TABLE default\n").expect("text");
        (0..64).for_each(|at| writeln!(text, "{}", first + at * at % 61).expect("text"));
    }
    let file = folder.join("two.vtk");
    std::fs::write(&file, text).expect("written");
    file
}

/// A volume in the frame of a patient.
fn patient(folder: &Path) -> PathBuf {
    let mut bytes = b"NRRD0005\ntype: uint8\ndimension: 3\nsizes: 6 5 4\nencoding: raw\n\
        space: right-anterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\
        space origin: (0,0,0)\n\n"
        .to_vec();
    bytes.extend((0..120u8).map(|at| at.wrapping_mul(37)));
    let file = folder.join("patient.nrrd");
    std::fs::write(&file, bytes).expect("written");
    file
}

fn surface(folder: &Path) -> PathBuf {
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nproperty float heat\nproperty float flow\nelement face 2\n\
        property list uchar int vertex_indices\nend_header\n\
        0 0 0 0 9\n1 0 0 1 8\n0 1 0 2 7\n1 1 0.5 3 1\n3 0 1 2\n3 1 3 2\n";
    let file = folder.join("surface.ply");
    std::fs::write(&file, ply).expect("written");
    file
}

#[test]
fn another_array_is_chosen_from_a_list() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), two_arrays(folder.path()));
    rest(&mut harness);
    wait_for_list(&mut harness, "Array");
    assert!(values(&mut harness)[1] < 100.0);
    choose(&mut harness, "Array", "flow");
    rest(&mut harness);
    assert_eq!(scene(&mut harness).reading.scalar.as_deref(), Some("flow"));
    assert!(values(&mut harness)[0] >= 1000.0, "{:?}", values(&mut harness));
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    rest(&mut harness);
    assert!(values(&mut harness)[1] < 100.0, "the array was not undone");
}

/// Two series in a folder, the second one of two slices.
fn study(folder: &Path) -> PathBuf {
    let study = folder.join("study");
    std::fs::create_dir_all(&study).expect("a folder");
    for (series, number, words, values) in
        [("1.2.3", "4", "thin", &[10u8, 20, 30][..]), ("1.2.5", "9", "thick ", &[100, 110])]
    {
        for (z, value) in values.iter().enumerate() {
            let file = dicom(".1", &[*value, value + 1, value + 2, value + 3]);
            let at = file.windows(4).position(|tag| tag == [0x28, 0, 2, 0]).expect("pixels");
            let (before, after) = file.split_at(at);
            let text = |group, tag, kind, text: &str| {
                let even = if text.len() % 2 == 1 { format!("{text} ") } else { text.to_owned() };
                element(group, tag, kind, even.as_bytes())
            };
            let whole = [
                before,
                &text(8, 0x103e, "LO", words),
                &text(0x20, 0xe, "UI", series),
                &text(0x20, 0x11, "IS", number),
                &text(0x20, 0x32, "DS", &format!("0\\0\\{z}")),
                &text(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"),
                after,
            ];
            std::fs::write(study.join(format!("{number}-{z}")), whole.concat()).expect("written");
        }
    }
    study
}

/// Steps until a list is there: it is read in the background.
fn wait_for_list(harness: &mut Driven, name: &str) {
    for _ in 0..1000 {
        if harness.query_by_role_and_label(egui::Role::ComboBox, name).is_some() {
            return;
        }
        harness.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("no list “{name}”; messages: {:?}", window(harness).messages);
}

fn values(harness: &mut Driven) -> [f64; 2] {
    window(harness).scene_view.as_ref().expect("a scene").stage.values(0)
}

#[test]
fn another_series_is_chosen_from_a_list() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), study(folder.path()));
    rest(&mut harness);
    wait_for_list(&mut harness, "Series");
    assert_eq!(values(&mut harness), [10.0, 33.0]);
    choose(&mut harness, "Series", "9 CT thick (2 pictures)");
    rest(&mut harness);
    assert_eq!(scene(&mut harness).reading.series.as_deref(), Some("1.2.5"));
    assert_eq!(values(&mut harness), [100.0, 113.0]);
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    rest(&mut harness);
    assert_eq!(values(&mut harness), [10.0, 33.0], "the series was not undone");
}

#[test]
fn another_time_is_chosen_by_a_slider() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = b"NRRD0005\ntype: uint8\ndimension: 4\nsizes: 4 4 4 3\nencoding: raw\n\
        kinds: domain domain domain time\n\n"
        .to_vec();
    bytes.extend((0..192u8).map(|at| at % 64 + 70 * (at / 64)));
    let file = folder.path().join("times.nrrd");
    std::fs::write(&file, bytes).expect("written");
    let mut harness = harness_of(folder.path(), file);
    rest(&mut harness);
    assert_eq!(values(&mut harness), [0.0, 63.0]);
    harness.get_by_label("of 0 to 2");
    harness.get_by_role_and_label(egui::Role::SpinButton, "Time").set_value_accesskit(2.0);
    steps(&mut harness, 3);
    rest(&mut harness);
    assert_eq!(scene(&mut harness).reading.time, Some(2));
    assert_eq!(values(&mut harness), [140.0, 203.0]);
    // A file of one time has no slider.
    let mut alone = harness_of(folder.path(), patient(folder.path()));
    rest(&mut alone);
    assert!(alone.query_by_label("Time").is_none());
}

/// An object on a server was fetched to be drawn, so that its arrays are listed too.
#[test]
fn an_array_of_a_remote_file_is_chosen_from_a_list() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = two_arrays(folder.path());
    let server = Server::of(std::fs::read(file).expect("a file"));
    let address = splatkit::input::address(server.address("two.vtk"));
    let mut harness = harness_of(folder.path(), address);
    rest(&mut harness);
    wait_for_list(&mut harness, "Array");
    choose(&mut harness, "Array", "flow");
    rest(&mut harness);
    assert!(values(&mut harness)[0] >= 1000.0, "{:?}", values(&mut harness));
}

/// The file is the one that `render` writes of the same scene.
#[test]
fn a_figure_is_saved_with_all_its_views() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let figure = folder.path().join("figure.json");
    let text = r#"{"splatkit_scene": 2, "inputs": [{"file": "v.nrrd"}], "engine": "cpu",
        "picture": {"views": ["front", "left"], "size": [96, 48], "samples": 1}}"#;
    std::fs::write(&figure, text).expect("written");
    window(&mut harness).open(vec![figure.clone()]);
    rest(&mut harness);
    let messages = window(&mut harness).messages.clone();
    let is_said = |(text, is_error): &(String, bool)| text.contains("2 views") && !is_error;
    assert!(messages.iter().any(is_said), "{messages:?}");
    click(&mut harness, "File");
    click(&mut harness, "Save figure of 2 views…");
    let [saved, drawn] = ["saved.png", "drawn.png"].map(|name| folder.path().join(name));
    key(&mut harness, Modifiers::COMMAND, Key::A);
    harness.event(egui::Event::Text(saved.display().to_string()));
    harness.step();
    harness.key_press(Key::Enter);
    steps(&mut harness, 2);
    for _ in 0..4000 {
        harness.step();
        if window(&mut harness).exporting.is_none() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let words = ["splatkit", "render", &figure.display().to_string(), "-o"].map(str::to_owned);
    let words = words.into_iter().chain([drawn.display().to_string()]);
    let matches = Command::command().try_get_matches_from(words).expect("flags");
    let Task::Render(render) = Command::from_arg_matches(&matches).expect("a command").task else {
        panic!("another task");
    };
    render.run(&Given::of(&matches), &Progress::kept()).expect("a picture");
    let [saved, drawn] = [saved, drawn].map(|file| std::fs::read(file).expect("a picture"));
    assert!(saved == drawn, "{:?}", window(&mut harness).messages);
}

#[test]
fn a_box_crops_by_its_handle() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let whole = picture_of(&mut harness);
    unfold(&mut harness, "Clips");
    click(&mut harness, "Box");
    let ends = |harness: &mut Driven| scene(harness).picture.clips[0].corners().expect("a box");
    let [_, before] = ends(&mut harness);
    let at = harness.get_by_label("Handle of clip 1, z to").rect().center();
    drag(&mut harness, at, egui::vec2(0.0, 60.0));
    let [_, after] = ends(&mut harness);
    assert!(after[2] < before[2], "{after:?}");
    assert!(picture_of(&mut harness) != whole, "nothing is cropped");
    // The whole drag is one step.
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(ends(&mut harness)[1], before);
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    assert!(scene(&mut harness).picture.clips.is_empty());
}

#[test]
fn three_slices_of_a_patient_have_their_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), patient(folder.path()));
    rest(&mut harness);
    click(&mut harness, "Slices");
    let places = ["Axial", "Coronal", "Sagittal"].map(|name| {
        harness.get_by_label(name);
        harness.get_by_label(&format!("{name} picture")).rect().top()
    });
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn a_preset_of_ct_says_that_the_values_are_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    click(&mut harness, "Presets");
    click(&mut harness, "ct-bone");
    let after = picture_of(&mut harness);
    assert!(after != before && after.iter().any(|pixel| pixel[3] > 0.05), "nothing is shown");
    let (message, is_error) = window(&mut harness).messages.last().expect("a message").clone();
    assert!(message.contains("not in Hounsfield units") && !is_error, "{message}");
}

/// A file that says nothing about its values, but has those of a scan, keeps Hounsfield units.
#[test]
fn a_preset_of_ct_shows_hounsfield_units_as_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut bytes = b"NRRD0005\ntype: int16\ndimension: 3\nsizes: 4 4 4\nencoding: raw\n\
        endian: little\n\n"
        .to_vec();
    bytes.extend((0..64i16).flat_map(|at| (at * 40 - 1000).to_le_bytes()));
    let file = folder.path().join("ct.nrrd");
    std::fs::write(&file, bytes).expect("written");
    let mut harness = harness_of(folder.path(), file);
    rest(&mut harness);
    click(&mut harness, "Presets");
    click(&mut harness, "ct-bone");
    let state = window(&mut harness);
    let transfer = state.transfer().expect("a field");
    assert_eq!(transfer.opacity[0].0, 150.0);
    let messages = state.messages.iter();
    assert!(messages.into_iter().all(|(text, _)| !text.contains("Hounsfield")));
}

#[test]
fn a_colour_is_picked() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    choose(&mut harness, "Background", "gray");
    let gray = scene(&mut harness).picture.background();
    pick(&mut harness, "Colour of the background");
    let picked = scene(&mut harness).picture.background().expect("a colour");
    assert!(picked[0] > picked[1] + 0.3, "{picked:?} is not the picked colour");
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(scene(&mut harness).picture.background(), gray, "picking is one step");
}

#[test]
fn maps_and_colours_of_surfaces_are_chosen_from_lists() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), surface(folder.path()));
    let plain = picture_of(&mut harness);
    choose(&mut harness, "Colour", "heat");
    let viridis = picture_of(&mut harness);
    assert!(viridis != plain, "the values have no colours");
    choose(&mut harness, "Colour map", "plasma");
    let plasma = picture_of(&mut harness);
    assert!(plasma != viridis, "the map is the same");
    let map = scene(&mut harness).appearance.colormap.expect("a map");
    assert_eq!(map.to_string(), "plasma");
    // The range of the map, and back to all values.
    harness.get_by_role_and_label(egui::Role::SpinButton, "Highest value").set_value_accesskit(1.0);
    steps(&mut harness, 2);
    assert_eq!(scene(&mut harness).appearance.range, Some([0.0, 1.0]));
    rest(&mut harness);
    click(&mut harness, "All values");
    assert_eq!(scene(&mut harness).appearance.range, None);
    assert!(picture_of(&mut harness) == plasma);
}

#[test]
fn the_map_of_a_field_is_chosen_from_a_list() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    click(&mut harness, "Presets");
    click_part(&mut harness, "Colours");
    click(&mut harness, "plasma");
    assert!(picture_of(&mut harness) != before, "the colours are the same");
}

#[test]
fn the_up_axis_and_the_view_are_chosen_from_lists() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    choose(&mut harness, "Up", "+X");
    let turned = picture_of(&mut harness);
    assert_eq!(scene(&mut harness).framing.up, Some(glam::DVec3::X));
    assert!(turned != before, "nothing turned");
    choose(&mut harness, "View", "top");
    assert!(picture_of(&mut harness) != turned);
    let camera = window(&mut harness).scene_view.as_ref().expect("a scene").orbit.camera().clone();
    let way = (camera.focal_point - camera.position).normalize();
    assert!(way.x < -0.99, "{way} is not from above");
}

#[test]
fn a_film_is_exported_by_the_dialog() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    harness.set_size(egui::vec2(480.0, 1600.0));
    rest(&mut harness);
    unfold(&mut harness, "Camera path");
    let height = harness.get_by_label("Save path…").rect().height();
    assert!(height < 30.0, "a button is {height} points high");
    click(&mut harness, "Turn around");
    harness
        .get_by_role_and_label(egui::Role::SpinButton, "Frames per second")
        .set_value_accesskit(1.0);
    steps(&mut harness, 2);
    click(&mut harness, "Export film…");
    let film = folder.path().join("film.gif");
    key(&mut harness, Modifiers::COMMAND, Key::A);
    harness.event(egui::Event::Text(film.display().to_string()));
    harness.step();
    harness.key_press(Key::Enter);
    steps(&mut harness, 2);
    for _ in 0..4000 {
        harness.step();
        if window(&mut harness).exporting.is_none() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(film.exists(), "{:?}", window(&mut harness).messages);
}

#[test]
fn keys_undo_and_redo() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    click(&mut harness, "Axes");
    assert!(scene(&mut harness).overlay.axes);
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    assert!(!scene(&mut harness).overlay.axes);
    key(&mut harness, Modifiers::COMMAND, Key::Y);
    assert!(scene(&mut harness).overlay.axes);
}

#[test]
fn recent_files_are_opened_again_and_missing_ones_say_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let other = surface(folder.path());
    window(&mut harness).open(vec![other.clone()]);
    window(&mut harness).document.change(|scene| drop(scene.inputs.remove(0)));
    rest(&mut harness);
    click(&mut harness, "File");
    click_part(&mut harness, "Open recent");
    click(&mut harness, "v.nrrd");
    rest(&mut harness);
    let files = |harness: &mut Driven| {
        scene(harness).inputs.into_iter().map(|input| input.file).collect::<Vec<_>>()
    };
    assert_eq!(files(&mut harness), [folder.path().join("v.nrrd")]);
    std::fs::remove_file(&other).expect("removed");
    click(&mut harness, "File");
    click_part(&mut harness, "Open recent");
    let messages = window(&mut harness).messages.len();
    click(&mut harness, "surface.ply (missing)");
    steps(&mut harness, 20);
    let after = &window(&mut harness).messages[messages..];
    assert!(after.is_empty(), "it could be chosen: {after:?}");
    assert_eq!(files(&mut harness), [folder.path().join("v.nrrd")]);
}

#[test]
fn the_engine_changes_while_the_scene_stays_loaded() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let state = |harness: &mut Driven| {
        let stage = &window(harness).scene_view.as_ref().expect("a scene").stage;
        (std::sync::Arc::clone(&stage.loaded), stage.device.name().to_owned())
    };
    let (loaded, cpu) = state(&mut harness);
    std::fs::remove_file(folder.path().join("v.nrrd")).expect("removed");
    choose(&mut harness, "Engine", "gpu");
    rest(&mut harness);
    let (same, gpu) = state(&mut harness);
    let messages = window(&mut harness).messages.clone();
    assert!(std::sync::Arc::ptr_eq(&loaded, &same), "the file was read again");
    assert_ne!(cpu, gpu, "{messages:?}");
    choose(&mut harness, "Engine", "cpu");
    rest(&mut harness);
    assert_eq!(state(&mut harness).1, cpu);
}

#[test]
fn the_window_has_a_title_fills_the_screen_and_closes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let commands = |harness: &mut Driven, key: Option<(Modifiers, Key)>| {
        if let Some((modifiers, key)) = key {
            let (physical_key, pressed, repeat) = (None, true, false);
            harness.event(egui::Event::Key { key, physical_key, pressed, repeat, modifiers });
        }
        // Each event has a frame of its own, of which the last one is asked.
        harness.step();
        harness.output().viewport_output[&ViewportId::ROOT].commands.clone()
    };
    assert_eq!(window(&mut harness).document.title(), "v.nrrd — splatkit");
    let other = surface(folder.path());
    window(&mut harness).open(vec![other]);
    let title = ViewportCommand::Title("v.nrrd + 1 — splatkit".into());
    let titled = commands(&mut harness, None);
    assert!(titled.contains(&title), "{titled:?}");
    let full = commands(&mut harness, Some((Modifiers::NONE, Key::F11)));
    assert!(full.contains(&ViewportCommand::Fullscreen(true)), "{full:?}");
    let close = commands(&mut harness, Some((Modifiers::COMMAND, Key::Q)));
    assert!(close.contains(&ViewportCommand::Close), "{close:?}");
}

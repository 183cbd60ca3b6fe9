//! The window without a screen: it is driven by events, and draws on the CPU engine.

mod selection;
mod tasks;

use super::{
    dialogs::Dialogs,
    document::Document,
    recent::Recent,
    window::{Surroundings, Window},
};
use crate::{Command, Task, engine::DeviceFlags, given::Given, progress::Progress};
use clap::{CommandFactory, FromArgMatches};
use eframe::egui;
use egui_kittest::{Harness, kittest::Queryable};
use splatkit::session::{Description, Engine, SurfaceColor};
use std::path::{Path, PathBuf};

/// A window that shows a small volume in a folder.
fn harness(folder: &Path) -> Harness<'static, Option<Window>> {
    let volume = splatkit::volume::phantoms::Phantom::Specimen.sample([16; 3]).expect("a volume");
    let file = folder.join("v.nrrd");
    splatkit::formats::nrrd::write(&volume, &file).expect("written");
    harness_of(folder, file)
}

/// A window that shows a file, with its settings in a folder.
fn harness_of(folder: &Path, file: PathBuf) -> Harness<'static, Option<Window>> {
    let mut scene = Description::new([file]);
    scene.engine = Engine::Cpu;
    let mut document = Some(Document::new(scene, DeviceFlags::default()));
    let store = folder.join("settings").join("recent.json");
    Harness::builder().with_size(egui::vec2(800.0, 1600.0)).allow_missing_glyphs().build_ui_state(
        move |ui, window: &mut Option<Window>| {
            let context = ui.ctx().clone();
            let opened = window.get_or_insert_with(|| {
                let document = document.take().expect("one window");
                let recent = Recent::at(store.clone());
                let surroundings = Surroundings { recent, dialogs: Dialogs::plain() };
                Window::new(document, surroundings, &context, None).expect("a window")
            });
            opened.ui(ui);
        },
        None,
    )
}

fn window<'a>(harness: &'a mut Harness<'static, Option<Window>>) -> &'a mut Window {
    harness.state_mut().as_mut().expect("a window")
}

/// Steps until the exact picture is shown.
fn rest(harness: &mut Harness<'static, Option<Window>>) {
    // On a machine with other work, a driver compiles for half a minute.
    for _ in 0..8000 {
        harness.step();
        let state = window(harness);
        if state.rests() && (state.frame.is_some() || state.document.scene().inputs.is_empty()) {
            harness.step();
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("no exact picture; messages: {:?}", window(harness).messages);
}

/// Returns the scene that `splatkit render` draws with these words.
fn scene_of_words(words: &[String]) -> Description {
    let command = ["splatkit".to_owned(), "render".to_owned()];
    let words = command.iter().chain(words);
    let matches = Command::command().try_get_matches_from(words).expect("flags");
    let Task::Render(render) = Command::from_arg_matches(&matches).expect("a command").task else {
        panic!("another task");
    };
    render.job(&Given::of(&matches)).expect("a job").scene
}

/// Opens a part of the side panel.
fn unfold(harness: &mut Harness<'static, Option<Window>>, name: &str) {
    harness.get_by_label(name).click();
    for _ in 0..30 {
        harness.step();
    }
}

/// Chooses an entry of a list.
fn choose(harness: &mut Harness<'static, Option<Window>>, list: &str, entry: &str) {
    harness.get_by_role_and_label(egui::Role::ComboBox, list).click();
    for _ in 0..5 {
        harness.step();
    }
    harness.get_by_role_and_label(egui::Role::Button, entry).click();
    for _ in 0..5 {
        harness.step();
    }
}

/// Picks a strong colour: by a click into the square of the picker that a button opens.
fn pick(harness: &mut Harness<'static, Option<Window>>, button: &str) {
    harness.get_by_label(button).click();
    for _ in 0..5 {
        harness.step();
    }
    let area = harness.ctx.memory(|memory| {
        let picker = memory.areas().top_layer_id(egui::Order::Foreground).expect("a picker");
        memory.area_rect(picker.id).expect("a picker")
    });
    let at = area.left_bottom() + egui::vec2(240.0, -240.0);
    harness.hover_at(at);
    harness.drag_at(at);
    for _ in 0..3 {
        harness.step();
    }
    harness.drop_at(at);
    for _ in 0..3 {
        harness.step();
    }
    harness.key_press(egui::Key::Escape);
    harness.step();
}

fn picture_of(harness: &mut Harness<'static, Option<Window>>) -> Vec<[f32; 4]> {
    rest(harness);
    window(harness).frame.as_ref().expect("a frame").picture.color.clone()
}

#[test]
fn a_drag_turns_the_scene_and_undo_does_not_turn_it_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    let camera = window(&mut harness).scene_view.as_ref().expect("a scene").orbit.camera().clone();
    harness.drag_at(egui::pos2(120.0, 200.0));
    harness.step();
    harness.hover_at(egui::pos2(190.0, 220.0));
    harness.step();
    harness.drop_at(egui::pos2(190.0, 220.0));
    let after = picture_of(&mut harness);
    assert!(before != after, "nothing turned");
    let turned = window(&mut harness).scene_view.as_ref().expect("a scene").orbit.camera().clone();
    let distance = |c: &splatkit::math::Camera| (c.position - c.focal_point).length();
    assert_ne!(turned.position, camera.position);
    assert!((distance(&turned) / distance(&camera) - 1.0).abs() < 1e-9);
    assert!(!window(&mut harness).document.can_undo());
}

#[test]
fn a_switch_changes_the_picture_and_is_undone() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    harness.get_by_label("Axes").click();
    harness.step();
    assert!(picture_of(&mut harness) != before, "there are no axes");
    window(&mut harness).document.undo();
    harness.step();
    assert!(picture_of(&mut harness) == before, "the axes are still there");
}

#[test]
fn a_clip_is_added_and_cuts() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    unfold(&mut harness, "Clips");
    harness.get_by_label("Plane x").click();
    harness.step();
    let cut = picture_of(&mut harness);
    assert!(cut != before, "nothing is cut");
    assert_eq!(window(&mut harness).document.scene().picture.clips.len(), 1);
    // Its handle moves it, as one step.
    let offset = |harness: &mut Harness<'static, Option<Window>>| {
        window(harness).document.scene().picture.clips[0].plane.expect("a plane")[3]
    };
    let old = offset(&mut harness);
    let at = harness.get_by_label("Handle of clip 1").rect().center();
    harness.hover_at(at);
    harness.step();
    harness.drag_at(at);
    harness.step();
    for step in 1..5 {
        harness.hover_at(at + egui::vec2(8.0, 3.0) * step as f32);
        harness.step();
    }
    harness.drop_at(at + egui::vec2(32.0, 12.0));
    harness.step();
    assert_ne!(offset(&mut harness), old);
    assert!(picture_of(&mut harness) != cut, "the clip was not moved");
    window(&mut harness).document.undo();
    assert_eq!(offset(&mut harness), old);
}

#[test]
fn a_broken_file_is_a_message_and_the_scene_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    let broken = folder.path().join("b.ply");
    std::fs::write(&broken, "ply\nformat ascii 1.0\nelement vertex x\n").expect("written");
    window(&mut harness).open(vec![broken]);
    for _ in 0..200 {
        harness.step();
        if window(&mut harness).messages.iter().any(|(_, is_error)| *is_error) {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let (text, _) = window(&mut harness)
        .messages
        .iter()
        .rfind(|(_, is_error)| *is_error)
        .expect("an error")
        .clone();
    assert!(text.contains("b.ply"), "{text}");
    assert_eq!(window(&mut harness).document.scene().inputs.len(), 1);
    assert!(picture_of(&mut harness) == before, "the scene is gone");
}

/// The saved picture is the one that `splatkit render scene.json` draws, byte for byte.
#[test]
fn pictures_and_scenes_are_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let (picture, scene) = (folder.path().join("p.png"), folder.path().join("s.json"));
    window(&mut harness).save_picture(picture.clone());
    rest(&mut harness);
    window(&mut harness).save_scene(&scene);
    rest(&mut harness);
    assert!(picture.exists() && scene.exists());
    let saved = Description::read(&scene, &splatkit::input::Limits::default()).expect("a scene");
    assert!(saved.camera.is_some() && saved.picture.size.is_some());
    let text = std::fs::read_to_string(&scene).expect("text");
    assert!(text.contains("\"v.nrrd\""), "{text}");
    let again = folder.path().join("again.png");
    let words = ["splatkit".into(), "render".into(), scene, "-o".into(), again.clone()];
    let words = words.map(std::path::PathBuf::into_os_string);
    let matches = Command::command().try_get_matches_from(&words).expect("arguments");
    let Task::Render(render) = Command::from_arg_matches(&matches).expect("a command").task else {
        panic!("another task");
    };
    render.run(&Given::of(&matches), &Progress::kept()).expect("a picture");
    let bytes = [again, picture].map(|file| std::fs::read(file).expect("a picture"));
    assert!(bytes[0] == bytes[1], "the command draws another picture");
}

#[test]
fn a_path_of_the_camera_is_played_saved_and_exported() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    unfold(&mut harness, "Camera path");
    harness.get_by_label("Turn around").click();
    harness.step();
    harness.step();
    assert_eq!(window(&mut harness).keyframes.len(), 5);
    let before = window(&mut harness).document.scene().camera;
    harness.get_by_label("Play").click();
    for _ in 0..10 {
        harness.step();
    }
    harness.get_by_label("Pause").click();
    harness.step();
    let camera = window(&mut harness).document.scene().camera;
    assert!(camera.is_some() && camera != before, "the camera stood still");
    let (path, film) = (folder.path().join("path.json"), folder.path().join("film.gif"));
    window(&mut harness).save_path(&path);
    window(&mut harness).keyframes.clear();
    window(&mut harness).load_path(&path);
    assert_eq!(window(&mut harness).keyframes.len(), 5);
    window(&mut harness).player.rate = 1.0;
    window(&mut harness).size = [40, 30];
    window(&mut harness).export_film(film.clone());
    for _ in 0..2000 {
        harness.step();
        if window(&mut harness).exporting.is_none() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(film.exists(), "{:?}", window(&mut harness).messages);
}

#[test]
fn transfer_functions_are_saved_and_loaded() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    let path = folder.path().join("t.json");
    window(&mut harness).save_transfer(&path);
    let text = std::fs::read_to_string(&path).expect("a file");
    let mut transfer = splatkit::volume::TransferFunction::from_json(&text).expect("JSON");
    transfer.color = vec![(0.0, [0.0, 0.0, 1.0])];
    std::fs::write(&path, transfer.to_json()).expect("written");
    window(&mut harness).load_transfer(&path);
    harness.step();
    assert!(picture_of(&mut harness) != before, "the colours are the same");
    // The bar shows the new colours.
    let unlit = picture_of(&mut harness);
    harness.get_by_label("Scalar bar").click();
    harness.step();
    assert!(picture_of(&mut harness) != unlit, "there is no bar");
    let finish = window(&mut harness).scene_view.as_ref().expect("a scene").finish.clone();
    assert!(finish.bar_colors().iter().all(|color| color[2] > 0.9), "the bar is an old one");
    window(&mut harness).document.undo();
    window(&mut harness).document.undo();
    harness.step();
    assert!(picture_of(&mut harness) == before);
}

#[test]
fn surfaces_have_a_colour_and_an_opacity() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let file = folder.path().join("t.ply");
    std::fs::write(&file, ply).expect("written");
    window(&mut harness).document.change(|scene| scene.inputs.clear());
    window(&mut harness).open(vec![file]);
    let gray = picture_of(&mut harness);
    choose(&mut harness, "Colour", "one colour");
    rest(&mut harness);
    pick(&mut harness, "Colour of the surface");
    let color = window(&mut harness).document.scene().inputs[0].appearance.color.clone();
    let Some(SurfaceColor::Plain([r, g, b])) = color else { panic!("{color:?}") };
    assert!(r > g && r > b, "{color:?} is not the picked colour");
    let red = picture_of(&mut harness);
    assert!(red != gray, "the colour is the same");
    window(&mut harness).document.change(|scene| scene.inputs[0].appearance.opacity = Some(0.3));
    harness.step();
    let faint = picture_of(&mut harness);
    let most = |picture: &[[f32; 4]]| picture.iter().map(|c| c[3]).fold(0.0, f32::max);
    assert!(most(&faint) < 0.6 && most(&red) > 0.99, "{} {}", most(&faint), most(&red));
}

#[test]
fn slices_stand_beside_the_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let width = window(&mut harness).size[0];
    harness.get_by_label("Slices").click();
    rest(&mut harness);
    harness.get_by_label("z picture");
    assert!(window(&mut harness).size[0] < width);
}

#[test]
fn a_window_without_room_draws_nothing_and_comes_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    for size in [[1.0, 1.0], [0.0, 0.0], [3840.0, 2160.0], [800.0, 1600.0]] {
        harness.set_size(egui::vec2(size[0], size[1]));
        rest(&mut harness);
    }
    // A narrow window makes the panels narrow, so that the picture is a wider one.
    let opaque = picture_of(&mut harness).iter().filter(|pixel| pixel[3] > 0.9).count();
    assert!(opaque > 10_000, "{opaque}");
}

/// The file may go while its scene is shown: it is in memory.
#[test]
fn a_deleted_file_does_no_harm() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    std::fs::remove_file(folder.path().join("v.nrrd")).expect("removed");
    harness.get_by_label("Axes").click();
    harness.step();
    assert!(picture_of(&mut harness) != before);
    // What must be read again says so, and the picture stays.
    window(&mut harness).document.change(|scene| {
        scene.appearance.sharp = true;
    });
    for _ in 0..200 {
        harness.step();
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let messages = &window(&mut harness).messages;
    assert!(messages.iter().any(|(text, is_error)| *is_error && text.contains("v.nrrd")));
    assert!(window(&mut harness).frame.is_some());
}

#[test]
fn one_of_several_fields_is_edited() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    rest(&mut harness);
    let ball = splatkit::volume::phantoms::Phantom::Ball.sample([12; 3]).expect("a volume");
    let file = folder.path().join("ball.nrrd");
    splatkit::formats::nrrd::write(&ball, &file).expect("written");
    window(&mut harness).open(vec![file]);
    let before = picture_of(&mut harness);
    let fields_of = |harness: &mut Harness<'static, Option<Window>>| {
        let scene_view = window(harness).scene_view.as_ref().expect("a scene");
        (scene_view.field, scene_view.fields())
    };
    let (field, fields) = fields_of(&mut harness);
    assert_eq!((field, fields.len(), &*fields[1].1), (0, 2, "ball.nrrd"));
    // The second field is chosen and changed; the first one stays.
    window(&mut harness).scene_view.as_mut().expect("a scene").field = 1;
    harness.step();
    let transfer_of = |harness: &mut Harness<'static, Option<Window>>, item: usize| {
        let state = window(harness);
        let scene_view = state.scene_view.as_ref().expect("a scene");
        scene_view.transfer_of(&state.document, item)
    };
    let first = transfer_of(&mut harness, 0).expect("a field");
    let mut transfer = window(&mut harness).transfer().expect("a field");
    transfer.color = vec![(0.0, [0.0, 0.0, 1.0])];
    window(&mut harness).set_transfer(&transfer);
    harness.step();
    assert!(picture_of(&mut harness) != before, "the colours are the same");
    assert_eq!(transfer_of(&mut harness, 1), Some(transfer));
    assert_eq!(transfer_of(&mut harness, 0), Some(first));
    let scene = window(&mut harness).document.scene().clone();
    assert!(scene.appearance.transfer.is_none());
    assert!(scene.inputs.iter().all(|input| input.appearance.transfer.is_some()));
    window(&mut harness).document.undo();
    harness.step();
    assert!(picture_of(&mut harness) == before);
}

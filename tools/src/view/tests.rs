//! The window without a screen: it is driven by events, and draws on the CPU engine.

use super::{document::Document, window::Window};
use eframe::egui;
use egui_kittest::{Harness, kittest::Queryable};
use splatkit::interaction::SceneFile;
use std::path::Path;

/// A window that shows a small volume in a folder.
fn harness(folder: &Path) -> Harness<'static, Option<Window>> {
    let volume = splatkit::volume::phantoms::Phantom::Specimen.sample([16; 3]).expect("a volume");
    let file = folder.join("v.nrrd");
    splatkit::formats::nrrd::write(&volume, &file).expect("written");
    let mut scene = SceneFile::new([file]);
    scene.options.insert("engine".into(), "cpu".into());
    let mut document = Some(Document::new(scene));
    Harness::builder().with_size(egui::vec2(800.0, 1600.0)).build_ui_state(
        move |ui, window: &mut Option<Window>| {
            let context = ui.ctx().clone();
            let own = window.get_or_insert_with(|| {
                let document = document.take().expect("one window");
                Window::new(document, &context).expect("a window")
            });
            own.ui(ui);
        },
        None,
    )
}

fn window<'a>(harness: &'a mut Harness<'static, Option<Window>>) -> &'a mut Window {
    harness.state_mut().as_mut().expect("a window")
}

/// Steps until the exact picture is shown.
fn rest(harness: &mut Harness<'static, Option<Window>>) {
    for _ in 0..2000 {
        harness.step();
        let own = window(harness);
        if own.rests() && (own.frame.is_some() || own.document.scene().inputs.is_empty()) {
            harness.step();
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("no exact picture; messages: {:?}", window(harness).messages);
}

fn picture_of(harness: &mut Harness<'static, Option<Window>>) -> Vec<[f32; 4]> {
    rest(harness);
    window(harness).frame.as_ref().expect("a frame").0.picture.color.clone()
}

#[test]
fn a_drag_turns_the_scene_and_undo_does_not_turn_it_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness(folder.path());
    let before = picture_of(&mut harness);
    let camera = window(&mut harness).shown.as_ref().expect("a scene").orbit.camera().clone();
    harness.drag_at(egui::pos2(120.0, 200.0));
    harness.step();
    harness.hover_at(egui::pos2(190.0, 220.0));
    harness.step();
    harness.drop_at(egui::pos2(190.0, 220.0));
    let after = picture_of(&mut harness);
    assert!(before != after, "nothing turned");
    let turned = window(&mut harness).shown.as_ref().expect("a scene").orbit.camera().clone();
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
    harness.get_by_label("Clips").click();
    for _ in 0..30 {
        harness.step();
    }
    harness.get_by_label("Plane x").click();
    harness.step();
    assert!(picture_of(&mut harness) != before, "nothing is cut");
    assert_eq!(window(&mut harness).document.scene().clips.len(), 1);
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
    assert!(picture_of(&mut harness) == before, "the scene is gone");
}

/// The saved picture is the one that `splatkit render scene.json` draws: the command's own test
/// compares the bytes (tools/tests/view.rs); this one saves both.
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
    let own = SceneFile::read(&scene, &splatkit::input::Limits::default()).expect("a scene");
    assert!(own.camera.is_some() && own.size.is_some());
    let text = std::fs::read_to_string(&scene).expect("text");
    assert!(text.contains("\"v.nrrd\""), "{text}");
}

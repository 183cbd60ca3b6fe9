//! Selecting and deleting in the window, by the hand and the keys alone.

use super::{super::window::Window, harness_of, rest, unfold, window};
use eframe::egui::{self, Key, Modifiers, Pos2, Role};
use egui_kittest::{Harness, kittest::Queryable};
use glam::{DVec2, DVec3};
use splatkit::{
    edit::Expression,
    session::{Data, Description, Side, convert::Conversion},
};
use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

type Driven = Harness<'static, Option<Window>>;

/// A square of 21 × 21 points with heights below it at the same places, and a value.
fn cloud(folder: &Path, layers: &[f64]) -> PathBuf {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty float heat\nend_header\n",
        441 * layers.len()
    );
    for z in layers {
        for at in 0..441 {
            writeln!(text, "{} {} {z} {at}", at % 21, at / 21).expect("text");
        }
    }
    let file = folder.join("cloud.ply");
    std::fs::write(&file, text).expect("written");
    file
}

fn steps(harness: &mut Driven, count: usize) {
    (0..count).for_each(|_| harness.step());
}

fn key(harness: &mut Driven, modifiers: Modifiers, key: Key) {
    harness.key_press_modifiers(modifiers, key);
    steps(harness, 2);
}

/// Looks from above, against z, and rests.
fn from_above(harness: &mut Driven) {
    rest(harness);
    window(harness).document.adjust(|scene| scene.framing.up = Some(DVec3::Z));
    steps(harness, 2);
    rest(harness);
    window(harness).apply(super::super::action::Action::View(Some(Side::Top)));
    steps(harness, 2);
    rest(harness);
}

/// Returns where a point of the world is on the screen.
fn screen(harness: &mut Driven, place: [f64; 3]) -> Pos2 {
    let area = harness.get_by_label("The picture").rect();
    let state = window(harness);
    let camera = state.scene_view.as_ref().expect("a scene").orbit.camera().clone();
    let view = camera.view(state.size).expect("a view");
    let at = view.to_view(DVec3::from_array(place));
    let depth = if view.perspective { at.z } else { 1.0 };
    let pixel = at.truncate() * view.scale / depth + view.center;
    let DVec2 { x, y } = pixel;
    area.min + egui::vec2(x as f32, y as f32)
}

/// Drags along these points of the world, and waits for what is selected.
fn trace(harness: &mut Driven, places: &[[f64; 3]]) {
    let path: Vec<Pos2> = places.iter().map(|place| screen(harness, *place)).collect();
    harness.hover_at(path[0]);
    harness.step();
    harness.drag_at(path[0]);
    harness.step();
    for (from, to) in path.iter().zip(&path[1..]) {
        for part in 1..=6 {
            harness.hover_at(from.lerp(*to, part as f32 / 6.0));
            harness.step();
        }
    }
    harness.drop_at(path[path.len() - 1]);
    steps(harness, 2);
    rest(harness);
}

/// Returns how many are selected, and of how many.
fn counts(harness: &mut Driven) -> Option<[u64; 2]> {
    rest(harness);
    window(harness).selection.selected.as_ref().map(super::super::selection::Selected::counts)
}

fn click(harness: &mut Driven, label: &str) {
    harness.get_by_label(label).click();
    steps(harness, 5);
}

fn edits(harness: &mut Driven) -> Vec<String> {
    let input = &window(harness).document.scene().inputs[0];
    input.edits.iter().map(|edit| edit.text().to_owned()).collect()
}

/// How many points of the scene that is shown are left.
fn left(harness: &mut Driven) -> usize {
    rest(harness);
    let scene = window(harness).document.scene().clone();
    match scene.read_input(&scene.inputs[0]).expect("an input").data {
        Data::Mesh(mesh) => mesh.positions.len(),
        Data::Gaussians(set) => set.len(),
        _ => panic!("another kind"),
    }
}

const LEFT_HALF: [[f64; 3]; 5] =
    [[-0.5, -0.5, 0.0], [9.5, -0.5, 0.0], [9.5, 20.5, 0.0], [-0.5, 20.5, 0.0], [-0.5, 0.0, 0.0]];

#[test]
fn a_lasso_selects_what_is_deleted_undone_and_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), cloud(folder.path(), &[0.0]));
    from_above(&mut harness);
    let picture = |harness: &mut Driven| {
        rest(harness);
        window(harness).frame.as_ref().expect("a frame").picture.color.clone()
    };
    let before = picture(&mut harness);
    let camera = window(&mut harness).scene_view.as_ref().expect("one").orbit.camera().clone();
    key(&mut harness, Modifiers::NONE, Key::L);
    trace(&mut harness, &LEFT_HALF);
    assert_eq!(counts(&mut harness), Some([210, 441]));
    // The lasso has not turned the scene, and nothing is changed yet.
    let state = window(&mut harness);
    assert_eq!(*state.scene_view.as_ref().expect("one").orbit.camera(), camera);
    assert!(!state.document.can_undo());
    key(&mut harness, Modifiers::COMMAND, Key::I);
    assert_eq!(counts(&mut harness), Some([231, 441]));
    key(&mut harness, Modifiers::COMMAND, Key::I);
    assert_eq!(counts(&mut harness), Some([210, 441]));
    key(&mut harness, Modifiers::NONE, Key::Delete);
    assert_eq!((edits(&mut harness).len(), left(&mut harness)), (1, 231));
    let cut = picture(&mut harness);
    assert!(cut != before, "nothing was deleted");
    assert!(window(&mut harness).selection.condition.is_none());
    key(&mut harness, Modifiers::COMMAND, Key::Z);
    assert!(left(&mut harness) == 441 && picture(&mut harness) == before, "not undone");
    key(&mut harness, Modifiers::COMMAND, Key::Y);
    assert!(left(&mut harness) == 231 && picture(&mut harness) == cut, "not done again");
    // The copied command draws the same scene, and so does a saved one.
    let scene = window(&mut harness).document.scene().clone();
    let words = super::super::words::words_of(&scene).expect("flags");
    assert_eq!(super::scene_of_words(&words).inputs, scene.inputs);
    let text = scene.to_json(folder.path());
    assert!(text.contains("\"edits\": [") && text.contains("seen:"), "{text}");
    // What is left is written as convert writes it.
    let output = folder.path().join("out.points.ply");
    window(&mut harness).save_edited(0, &output);
    for _ in 0..2000 {
        harness.step();
        if window(&mut harness).saving.is_none() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(splatkit::read(&output).expect("points").count(), 231);
}

#[test]
fn a_box_on_the_picture_selects_to_the_depth_that_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), cloud(folder.path(), &[0.0, -9.0]));
    from_above(&mut harness);
    key(&mut harness, Modifiers::NONE, Key::B);
    let corners = [[-0.5, -0.5, 0.0], [9.5, 20.5, 0.0]];
    trace(&mut harness, &corners);
    let [some, all] = counts(&mut harness).expect("a selection");
    assert!(all == 882 && some > 400, "{some} of {all}");
    unfold(&mut harness, "Selection");
    click(&mut harness, "No deeper than what is seen");
    trace(&mut harness, &corners);
    assert_eq!(counts(&mut harness), Some([210, 882]));
    // Another box is taken away, and one is added.
    click(&mut harness, "take away");
    trace(&mut harness, &[[-0.5, -0.5, 0.0], [9.5, 1.5, 0.0]]);
    assert_eq!(counts(&mut harness), Some([190, 882]));
    click(&mut harness, "add");
    trace(&mut harness, &[[9.6, -0.5, 0.0], [10.5, 20.5, 0.0]]);
    assert_eq!(counts(&mut harness), Some([211, 882]));
    key(&mut harness, Modifiers::NONE, Key::Escape);
    assert_eq!(counts(&mut harness), None);
    assert!(window(&mut harness).selection.tool.is_none());
}

#[test]
fn values_and_boxes_in_the_world_select() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut harness = harness_of(folder.path(), cloud(folder.path(), &[0.0]));
    rest(&mut harness);
    unfold(&mut harness, "Selection");
    harness.get_by_role_and_label(Role::TextInput, "Condition").focus();
    steps(&mut harness, 2);
    harness.get_by_role_and_label(Role::TextInput, "Condition").type_text("heat < 100");
    steps(&mut harness, 2);
    click(&mut harness, "Select by values");
    assert_eq!(counts(&mut harness), Some([100, 441]));
    click(&mut harness, "Keep selected");
    assert_eq!(left(&mut harness), 100);
    assert_eq!(edits(&mut harness), ["where:heat < 100"]);
    click(&mut harness, "Box in the world");
    steps(&mut harness, 30);
    click(&mut harness, "Select the box");
    assert_eq!(counts(&mut harness), Some([100, 100]));
    // Nothing would be left.
    click(&mut harness, "Delete selected");
    assert_eq!(left(&mut harness), 100);
    assert!(window(&mut harness).messages.iter().any(|(text, _)| text.contains("nothing would")));
    // A wrong condition is a message, and the selection stays.
    window(&mut harness).apply(super::super::action::Action::Select(
        super::super::action::Select::Condition("heat >".into()),
    ));
    let message = window(&mut harness).messages.last().expect("a message").clone();
    assert!(message.1 && message.0.contains("column 7"), "{message:?}");
    assert_eq!(counts(&mut harness), Some([100, 100]));
    click(&mut harness, "Remove edit 1");
    assert_eq!((left(&mut harness), edits(&mut harness).len()), (441, 0));
}

/// Meshes lose triangles with a selected corner, and trained Gaussians themselves.
#[test]
fn meshes_and_trained_gaussians_are_cut_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let cloud = cloud(folder.path(), &[0.0]);
    let trained = folder.path().join("trained.ply");
    Conversion::default().convert(&[cloud], &trained, &()).expect("Gaussians");
    let mesh = folder.path().join("mesh.ply");
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n9 0 0\n0 9 0\n9 9 0\n3 0 1 2\n3 1 3 2\n";
    std::fs::write(&mesh, text).expect("written");
    for (file, places, selected, wanted) in [
        (trained, LEFT_HALF.to_vec(), [210, 441], 231),
        (mesh, vec![[8.0, 8.0, 0.0], [9.5, 8.0, 0.0], [9.5, 9.5, 0.0]], [1, 4], 3),
    ] {
        let mut harness = harness_of(folder.path(), file.clone());
        from_above(&mut harness);
        key(&mut harness, Modifiers::NONE, Key::L);
        trace(&mut harness, &places);
        assert_eq!(counts(&mut harness), Some(selected), "{}", file.display());
        let marks = window(&mut harness).selection.selected.clone().expect("marks");
        let is_mesh = wanted == 3;
        assert_eq!(
            (marks.triangles.len(), marks.places.is_empty()),
            (usize::from(is_mesh), is_mesh)
        );
        key(&mut harness, Modifiers::NONE, Key::Delete);
        assert_eq!(left(&mut harness), wanted, "{}", file.display());
    }
}

/// What is selected is where it is moved to.
#[test]
fn a_moved_input_is_selected_where_it_is_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut scene = Description::new([cloud(folder.path(), &[0.0])]);
    scene.inputs[0].transform.translate = Some([100.0, 0.0, 0.0]);
    let condition: Expression = "inside(\"99,-1,-1,109.5,30,1\")".parse().expect("a condition");
    let input = scene.read_editable(&scene.inputs[0], &["heat"]).expect("points");
    let count = |condition| {
        let kept: Vec<bool> = input.select(condition).expect("marks");
        kept.iter().filter(|kept| **kept).count()
    };
    assert_eq!(count(&condition), 210);
    assert_eq!(count(&"heat >= 440 && x == 120".parse().expect("a condition")), 1);
}

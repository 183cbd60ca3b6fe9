use super::*;
use eframe::egui::{Event, Key, Modifiers, Pos2};
use egui_kittest::{Harness, kittest::Queryable};
use splatkit::{
    math::Kernel,
    scene::Item,
    volume::{Isosurface, phantoms::Phantom},
};
use std::sync::Arc;

struct State {
    editor: CurveEditor,
    transfer: TransferFunction,
    histogram: Histogram,
    edits: Vec<Edit>,
}

fn transfer() -> TransferFunction {
    TransferFunction {
        color: vec![(0.0, [1.0, 0.0, 0.0]), (100.0, [0.0, 0.0, 1.0])],
        opacity: vec![(0.0, 0.0), (50.0, 0.25), (100.0, 1.0)],
        ..TransferFunction::default()
    }
}

fn harness_of(transfer: TransferFunction) -> Harness<'static, State> {
    let volume = Phantom::Specimen.sample_bytes([12; 3]).unwrap();
    let item = Item::Volume(Arc::new(volume), Kernel::default(), transfer.clone());
    let histogram = Histogram::of_item(&item).unwrap();
    let editor = CurveEditor::new(2.0);
    let state = State { editor, transfer, histogram, edits: Vec::new() };
    let show = |ui: &mut Ui, state: &mut State| {
        let State { editor, transfer, histogram, edits } = state;
        let edit = editor.show(ui, Some(histogram), transfer, [0.0, 100.0]);
        if edit != Edit::Unchanged {
            edits.push(edit);
        }
    };
    let mut harness = Harness::builder()
        .with_size(vec2(520.0, 700.0))
        // The font of the tests has no sign for the clipboard, which the colour picker shows.
        .allow_missing_glyphs()
        // Two clicks are a double click.
        .with_step_dt(0.02)
        .with_max_steps(100)
        .build_ui_state(show, state);
    harness.run();
    harness
}

fn harness() -> Harness<'static, State> {
    harness_of(transfer())
}

/// The place of a value and an opacity on the screen.
fn place(harness: &Harness<'_, State>, value: f64, opacity: f64) -> Pos2 {
    let rect = harness.get_by_label("Opacity plot").rect().shrink2(MARGIN);
    let range = harness.state().editor.values.range([0.0, 100.0]);
    Plot { rect, range, scale: Scale::Root }.at((value, opacity))
}

fn button(harness: &Harness<'_, State>, pos: Pos2, button: PointerButton, pressed: bool) {
    let modifiers = Modifiers::NONE;
    harness.event(Event::PointerButton { pos, button, pressed, modifiers });
}

fn double_click(harness: &mut Harness<'_, State>, at: Pos2) {
    // A click shortly before would make it a triple click.
    harness.run_steps(60);
    harness.hover_at(at);
    for pressed in [true, false, true, false] {
        button(harness, at, PointerButton::Primary, pressed);
    }
    harness.run();
}

fn drag(harness: &mut Harness<'_, State>, from: Pos2, to: Pos2) {
    harness.hover_at(from);
    button(harness, from, PointerButton::Primary, true);
    harness.hover_at(from.lerp(to, 0.5));
    harness.hover_at(to);
    harness.run();
    button(harness, to, PointerButton::Primary, false);
    harness.run();
}

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() < tolerance, "{value} is not {expected}");
}

#[test]
fn showing_a_function_changes_nothing() {
    // Numbers outside the ranges of the fields, and points outside the values.
    let odd = TransferFunction {
        color: vec![(-1e9, [0.123_456, 0.0, 0.0])],
        opacity: vec![(1e-9, 1e-9), (1e12, 0.5)],
        unit: 1e-15,
        shade: Some(Shade { ambient: 7.0, power: 1e4, ..Shade::default() }),
        gradient: vec![(1e9, 0.1)],
        isosurfaces: vec![Isosurface { value: 1e6, color: [0.123; 3], opacity: 1e-6 }],
    };
    odd.validate().unwrap();
    let mut harness = harness_of(odd.clone());
    harness.get_by_label("Gradient curve").click();
    harness.run();
    assert_eq!((&harness.state().transfer, harness.state().edits.len()), (&odd, 0));
}

#[test]
fn a_point_is_dragged_and_the_drag_is_committed_once() {
    let mut harness = harness();
    let from = place(&harness, 50.0, 0.25);
    let to = place(&harness, 70.0, 0.04);
    drag(&mut harness, from, to);
    let State { transfer, edits, .. } = harness.state();
    near(transfer.opacity[1].0, 70.0, 0.1);
    near(transfer.opacity[1].1, 0.04, 0.001);
    assert_eq!(transfer.opacity.len(), 3);
    let (last, before) = edits.split_last().unwrap();
    assert_eq!(*last, Edit::Committed);
    assert!(!before.is_empty() && before.iter().all(|edit| *edit == Edit::Dragging), "{edits:?}");
    // Past its neighbour, a point stops at the neighbour's value.
    let from = place(&harness, 70.0, 0.04);
    let to = place(&harness, 70.0, 0.04) + vec2(300.0, -500.0);
    drag(&mut harness, from, to);
    assert_eq!(harness.state().transfer.opacity[1], (100.0, 1.0));
    harness.state().transfer.validate().unwrap();
}

#[test]
fn a_double_click_adds_a_point() {
    let mut harness = harness();
    let at = place(&harness, 25.0, 0.5);
    double_click(&mut harness, at);
    let State { transfer, edits, editor, .. } = harness.state();
    assert_eq!((transfer.opacity.len(), &edits[..]), (4, &[Edit::Committed][..]));
    near(transfer.opacity[1].0, 25.0, 0.1);
    near(transfer.opacity[1].1, 0.5, 0.01);
    assert_eq!(editor.selected, Some(Selected::Opacity(1)));
    // Its numbers can be typed.
    harness.get_by_role_and_label(Role::SpinButton, "Opacity").set_value_accesskit(0.125);
    harness.run();
    assert_eq!(harness.state().transfer.opacity[1].1, 0.125);
}

#[test]
fn points_are_removed_but_something_stays_visible() {
    let mut harness = harness();
    harness.get_by_label("Opacity point 2").click_secondary();
    harness.run();
    assert_eq!(harness.state().transfer.opacity, [(0.0, 0.0), (100.0, 1.0)]);
    // Without the other point every opacity is 0.
    harness.get_by_label("Opacity point 2").click_secondary();
    harness.run();
    assert_eq!(harness.state().transfer.opacity.len(), 2);
    assert_eq!(harness.state().edits, [Edit::Committed]);
    harness.get_by_label("Opacity point 1").click();
    harness.run();
    harness.key_press(Key::Delete);
    harness.run();
    assert_eq!(harness.state().transfer.opacity, [(100.0, 1.0)]);
}

#[test]
fn a_drag_cannot_hide_everything() {
    let only = TransferFunction { opacity: vec![(20.0, 0.0), (50.0, 0.25)], ..transfer() };
    let mut harness = harness_of(only);
    let from = place(&harness, 50.0, 0.25);
    drag(&mut harness, from, from + vec2(0.0, 400.0));
    harness.state().transfer.validate().unwrap();
    assert!(harness.state().transfer.opacity[1].1 > 0.0);
}

#[test]
fn counts_are_shown_by_their_logarithm_or_not() {
    let mut harness = harness();
    assert!(harness.state().editor.log);
    harness.get_by_label("Logarithmic counts").click();
    harness.run();
    assert!(!harness.state().editor.log);
    assert!(harness.state().edits.is_empty());
}

#[test]
fn the_wheel_zooms_and_a_drag_pans() {
    let mut harness = harness();
    let at = place(&harness, 25.0, 0.8);
    harness.hover_at(at);
    harness.event(Event::MouseWheel {
        unit: eframe::egui::MouseWheelUnit::Point,
        delta: vec2(0.0, 100.0),
        phase: eframe::egui::TouchPhase::Move,
        source: eframe::egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
    harness.run();
    let [low, high] = harness.state().editor.values.range([0.0, 100.0]);
    assert!(low > 1.0 && high < 99.0, "{low} {high}");
    near(place(&harness, 25.0, 0.8).x.into(), at.x.into(), 0.5);
    drag(&mut harness, at, at + vec2(40.0, 0.0));
    let [moved, _] = harness.state().editor.values.range([0.0, 100.0]);
    assert!(moved < low - 1.0, "{moved} {low}");
    assert!(harness.state().edits.is_empty());
    harness.get_by_label("Whole range").click();
    harness.run();
    assert_eq!(harness.state().editor.values.range([0.0, 100.0]), [0.0, 100.0]);
}

#[test]
fn isosurfaces_are_added_moved_and_removed() {
    let mut harness = harness();
    harness.get_by_label("Add isosurface").click();
    harness.run();
    let expected = Isosurface { value: 50.0, color: [0.5, 0.0, 0.5], opacity: 1.0 };
    assert_eq!(harness.state().transfer.isosurfaces, [expected]);
    harness.get_by_label("Value of isosurface 1").set_value_accesskit(30.0);
    harness.run();
    assert_eq!(harness.state().transfer.isosurfaces[0].value, 30.0);
    harness.get_by_label("Slider of isosurface 1").set_value_accesskit(40.0);
    harness.run();
    assert_eq!(harness.state().transfer.isosurfaces[0].value, 40.0);
    let from = harness.get_by_label("Isosurface 1").rect().center();
    let to = place(&harness, 80.0, 0.5);
    drag(&mut harness, from, to);
    near(harness.state().transfer.isosurfaces[0].value, 80.0, 0.2);
    for _ in 1..TransferFunction::MAX_ISOSURFACES + 3 {
        harness.get_by_label("Add isosurface").click();
        harness.run();
    }
    let count = harness.state().transfer.isosurfaces.len();
    assert_eq!(count, TransferFunction::MAX_ISOSURFACES);
    harness.get_by_label("Removal of isosurface 1").click();
    harness.run();
    assert_eq!(harness.state().transfer.isosurfaces.len(), count - 1);
    harness.state().transfer.validate().unwrap();
}

#[test]
fn colour_stops_are_added_dragged_coloured_and_removed() {
    let mut harness = harness();
    let bar = harness.get_by_label("Colour bar").rect();
    let at = pos2(place(&harness, 25.0, 0.5).x, bar.top() + 5.0);
    double_click(&mut harness, at);
    let stops = |harness: &Harness<'_, State>| harness.state().transfer.color.clone();
    let added = stops(&harness)[1];
    near(added.0, 25.0, 0.2);
    near(added.1[0], 0.75, 0.01);
    let from = harness.get_by_label("Colour stop 2").rect().center();
    let to = pos2(place(&harness, 60.0, 0.5).x, from.y);
    drag(&mut harness, from, to);
    near(stops(&harness)[1].0, 60.0, 0.2);
    assert_eq!(stops(&harness)[1].1, added.1);
    let from_value = stops(&harness)[1].0;
    // In the picker, the colour is chosen by a click into its square.
    harness.get_by_label("Colour").click();
    harness.run();
    let well = harness.get_by_label("Colour").rect();
    let before = stops(&harness)[1].1;
    let at = well.left_bottom() + vec2(60.0, 150.0);
    drag(&mut harness, at, at + vec2(30.0, 20.0));
    assert_ne!(stops(&harness)[1].1, before);
    assert_eq!(stops(&harness)[1].0, from_value);
    harness.key_press(Key::Escape);
    harness.run();
    harness.get_by_label("Colour stop 2").click_secondary();
    harness.run();
    assert_eq!(stops(&harness), transfer().color);
}

#[test]
fn colours_and_functions_by_name() {
    let mut harness = harness();
    harness.get_by_label("Presets").click();
    harness.run();
    harness.get_by_label("generic").click();
    harness.run();
    let named = TransferFunction::named("generic", [0.0, 100.0]).unwrap().for_size(2.0);
    assert_eq!(harness.state().transfer, named);
    harness.get_by_label("Presets").click();
    harness.run();
    harness.get_by_label_contains("Colours").click();
    harness.run();
    harness.get_by_label("viridis").click();
    harness.run();
    let colors = &harness.state().transfer.color;
    assert!(colors.len() > 40 && colors[0].0 == named.visible_range().unwrap()[0], "{colors:?}");
    assert_eq!(harness.state().edits, [Edit::Committed; 2]);
}

#[test]
fn factors_by_gradient_are_edited_in_the_same_way() {
    let mut harness = harness();
    harness.get_by_label("Gradient curve").click();
    harness.run();
    let rect = harness.get_by_label("Gradient plot").rect().shrink2(MARGIN);
    double_click(&mut harness, rect.lerp_inside(vec2(0.5, 0.25)));
    let magnitude = harness.state().histogram.joint.as_ref().unwrap().magnitude;
    let gradient = harness.state().transfer.gradient.clone();
    assert_eq!(gradient.len(), 1);
    near(gradient[0].0 / magnitude, 0.5, 0.01);
    near(gradient[0].1, 0.75, 0.01);
    // A magnitude is at least 0.
    let from = harness.get_by_label("Factor point 1").rect().center();
    drag(&mut harness, from, from - vec2(2000.0, 0.0));
    assert_eq!(harness.state().transfer.gradient[0].0, 0.0);
    harness.get_by_label("Factor point 1").click_secondary();
    harness.run();
    assert!(harness.state().transfer.gradient.is_empty());
}

#[test]
fn light_comes_back_as_it_was() {
    let shade = Shade { ambient: 0.5, ..Shade::default() };
    let mut harness = harness_of(TransferFunction { shade: Some(shade), ..transfer() });
    harness.get_by_label("Light, opacity unit").click();
    harness.run();
    harness.get_by_role_and_label(Role::SpinButton, "Power").set_value_accesskit(42.0);
    harness.run();
    harness.get_by_label("Light").click();
    harness.run();
    assert_eq!(harness.state().transfer.shade, None);
    harness.get_by_label("Light").click();
    harness.run();
    assert_eq!(harness.state().transfer.shade, Some(Shade { power: 42.0, ..shade }));
    harness.get_by_role_and_label(Role::SpinButton, "Opacity unit").set_value_accesskit(0.5);
    harness.run();
    assert_eq!(harness.state().transfer.unit, 0.5);
}

#[test]
fn window_and_level_keep_the_editor_s_function_valid() {
    let mut harness = harness();
    let state = harness.state_mut();
    window_level(&mut state.transfer, vec2(0.0, -60.0), [0.0, 100.0]);
    assert_eq!(state.transfer.opacity[0].0, 10.0);
    harness.run();
    // The change came from outside.
    assert!(harness.state().edits.is_empty());
}

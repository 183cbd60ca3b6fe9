//! What keys ask for.

use super::{
    action::{Action, Motion, Part, Purpose, Select},
    selection::Tool,
};
use eframe::egui::{Key, Modifiers, Ui};
use glam::DVec3;
use splatkit::session::Side;

/// The part of the way to the focal point that the camera flies in a second.
const SPEED: f64 = 0.5;

/// Takes the keys that were pressed, unless a text is being written.
pub fn take(ui: &Ui) -> Vec<Action> {
    if ui.ctx().text_edit_focused() {
        return Vec::new();
    }
    let pressed = |modifiers, key| ui.input_mut(|input| input.consume_key(modifiers, key));
    let command = Modifiers::COMMAND;
    let shift = Modifiers::COMMAND | Modifiers::SHIFT;
    let mut actions = Vec::new();
    // With Shift before without: the latter takes both.
    for (modifiers, key, action) in [
        (shift, Key::C, Action::CopyCommand),
        (shift, Key::Z, Action::Redo),
        (command, Key::Y, Action::Redo),
        (command, Key::Z, Action::Undo),
        (command, Key::O, Action::Ask(Purpose::Open)),
        (command, Key::S, Action::Ask(Purpose::SaveScene)),
        (command, Key::P, Action::Ask(Purpose::SavePicture)),
        (command, Key::Q, Action::Quit),
        (Modifiers::NONE, Key::F11, Action::FullScreen),
        (Modifiers::NONE, Key::M, Action::Measure),
        (command, Key::I, Action::Select(Select::Invert)),
        (Modifiers::NONE, Key::B, Action::Select(Select::Tool(Some(Tool::Box)))),
        (Modifiers::NONE, Key::L, Action::Select(Select::Tool(Some(Tool::Lasso)))),
        (Modifiers::NONE, Key::Delete, Action::Select(Select::Delete)),
        (Modifiers::NONE, Key::Escape, Action::Select(Select::Clear)),
        (Modifiers::NONE, Key::F1, Action::Toggle(Part::Help)),
        (Modifiers::NONE, Key::H, Action::Toggle(Part::Help)),
        (Modifiers::NONE, Key::Tab, Action::Toggle(Part::Side)),
        (command, Key::Num1, Action::View(Some(Side::Back))),
        (command, Key::Num3, Action::View(Some(Side::Left))),
        (command, Key::Num7, Action::View(Some(Side::Bottom))),
        (Modifiers::NONE, Key::Num1, Action::View(Some(Side::Front))),
        (Modifiers::NONE, Key::Num3, Action::View(Some(Side::Right))),
        (Modifiers::NONE, Key::Num7, Action::View(Some(Side::Top))),
        (Modifiers::NONE, Key::Num0, Action::View(Some(Side::Iso))),
        (Modifiers::NONE, Key::Home, Action::View(None)),
        (Modifiers::NONE, Key::O, Action::Move(Motion::Perspective)),
    ] {
        if pressed(modifiers, key) {
            actions.push(action);
        }
    }
    actions.extend(fly(ui));
    actions
}

/// Flies while keys are held.
fn fly(ui: &Ui) -> Option<Action> {
    let (held, time) = ui.input(|input| {
        let held = |key, back| {
            f64::from(u8::from(input.key_down(key))) - f64::from(u8::from(input.key_down(back)))
        };
        let is_plain = !input.modifiers.any();
        let step = DVec3::new(held(Key::D, Key::A), held(Key::E, Key::Q), held(Key::W, Key::S));
        (if is_plain { step } else { DVec3::ZERO }, f64::from(input.stable_dt.min(0.1)))
    });
    (held != DVec3::ZERO).then(|| {
        ui.ctx().request_repaint();
        Action::Move(Motion::Fly(held * SPEED * time))
    })
}

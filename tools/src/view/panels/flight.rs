//! The path of the camera: keyframes, a preview, and films.

use crate::view::action::{Action, Motion, Purpose};
use eframe::egui::{Button, DragValue, Slider, Ui};
use glam::DVec2;
use splatkit::{
    interaction::Orbit,
    math::{Camera, CameraPath, Keyframe},
};

/// Seconds from one keyframe to the next one that is added.
const STEP: f64 = 2.0;
/// Moves of a turn around the scene, and the seconds that it takes.
const TURNS: usize = 4;
const TURN: f64 = 8.0;

/// What the panel shows.
pub struct Flight<'a> {
    pub orbit: &'a Orbit,
    pub keyframes: &'a [Keyframe],
    /// What is being done for a film, and for how many seconds.
    pub film: Option<(String, f32)>,
}

/// What the panel keeps.
pub struct Player {
    /// The time that is shown, in seconds.
    time: f64,
    is_playing: bool,
    /// Frames per second of films.
    pub rate: f64,
}

impl Default for Player {
    fn default() -> Self {
        Self { time: 0.0, is_playing: false, rate: 30.0 }
    }
}

pub fn show(ui: &mut Ui, model: &Flight, player: &mut Player) -> Vec<Action> {
    let mut actions = Vec::new();
    buttons(ui, model, player, &mut actions);
    keyframes(ui, model, player, &mut actions);
    let path = CameraPath::new(model.keyframes.to_vec());
    match &path {
        Ok(path) => preview(ui, path, player, &mut actions),
        Err(_) if model.keyframes.is_empty() => {
            ui.weak("Look at the scene, add a keyframe, look from elsewhere, add another.");
        }
        Err(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
        }
    }
    films(ui, model, path.is_ok(), player, &mut actions);
    actions
}

fn buttons(ui: &mut Ui, model: &Flight, player: &mut Player, actions: &mut Vec<Action>) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("Add keyframe").clicked() {
            let mut keyframes = model.keyframes.to_vec();
            let time = keyframes.last().map_or(0.0, |keyframe| keyframe.time + STEP);
            keyframes.push(Keyframe { time, camera: model.orbit.camera().clone() });
            player.time = time;
            actions.push(Action::Keyframes(keyframes));
        }
        let turns = ui.button("Turn around").on_hover_text("Keyframes once around the scene");
        if turns.clicked() {
            actions.push(Action::Keyframes(around(model.orbit)));
        }
        if ui.button("Open path…").clicked() {
            actions.push(Action::Ask(Purpose::OpenPath));
        }
        // A part of the panel that is switched off would not wrap to the next row.
        let save = ui.add_enabled(!model.keyframes.is_empty(), Button::new("Save path…"));
        if save.clicked() {
            actions.push(Action::Ask(Purpose::SavePath));
        }
    });
}

/// Returns the keyframes of a turn around the scene.
fn around(orbit: &Orbit) -> Vec<Keyframe> {
    let mut turning = orbit.clone();
    let mut keyframes = Vec::new();
    for number in 0..TURNS {
        let time = TURN * number as f64 / TURNS as f64;
        keyframes.push(Keyframe { time, camera: turning.camera().clone() });
        // A drag over the height turns half around.
        turning.turn(DVec2::new(2.0 / TURNS as f64, 0.0), [1, 1]);
    }
    // The last camera is the first one exactly, so that the film is a loop.
    keyframes.push(Keyframe { time: TURN, camera: orbit.camera().clone() });
    keyframes
}

fn look_from(camera: &Camera) -> Action {
    Action::Move(Motion::Set(Box::new(camera.clone())))
}

/// Shows the keyframes.
fn keyframes(ui: &mut Ui, model: &Flight, player: &mut Player, actions: &mut Vec<Action>) {
    let mut edited = model.keyframes.to_vec();
    let mut removed = None;
    for (number, keyframe) in edited.iter_mut().enumerate() {
        // Times ascend.
        let before = number.checked_sub(1).map(|before| model.keyframes[before].time + 1e-3);
        let after = model.keyframes.get(number + 1).map(|next| next.time - 1e-3);
        let range = before.unwrap_or(f64::MIN)..=after.unwrap_or(f64::MAX);
        ui.horizontal(|ui| {
            let name = format!("keyframe {}", number + 1);
            let time = DragValue::new(&mut keyframe.time).range(range).speed(0.05);
            ui.add(time.suffix(" s").update_while_editing(false))
                .on_hover_text(format!("When {name} is reached"));
            let show = ui.button("Show");
            if show.on_hover_text(format!("Look from {name}")).clicked() {
                actions.push(look_from(&keyframe.camera));
                player.time = keyframe.time;
            }
            let set = ui.button("Set").on_hover_text(format!("Make {name} what is shown now"));
            if set.clicked() {
                keyframe.camera = model.orbit.camera().clone();
            }
            if ui.small_button("×").on_hover_text(format!("Remove {name}")).clicked() {
                removed = Some(number);
            }
        });
    }
    if let Some(number) = removed {
        edited.remove(number);
    }
    if edited != model.keyframes {
        actions.push(Action::Keyframes(edited));
    }
}

/// Shows the time, and moves the camera to its place at that time.
fn preview(ui: &mut Ui, path: &CameraPath, player: &mut Player, actions: &mut Vec<Action>) {
    let (start, end) = (path.start(), path.start() + path.duration());
    let mut is_moved = false;
    ui.horizontal(|ui| {
        let name = if player.is_playing { "Pause" } else { "Play" };
        if ui.button(name).clicked() {
            player.is_playing = !player.is_playing;
            if player.time >= end {
                player.time = start;
            }
        }
        let slider = Slider::new(&mut player.time, start..=end).suffix(" s").fixed_decimals(1);
        is_moved = ui.add(slider).accessible_name("Time").changed();
    });
    if player.is_playing && !is_moved {
        player.time += f64::from(ui.input(|input| input.stable_dt.min(0.2)));
        is_moved = true;
        if player.time >= end {
            (player.time, player.is_playing) = (end, false);
        }
        ui.ctx().request_repaint();
    }
    if is_moved {
        actions.push(look_from(&path.at(player.time)));
    }
}

/// Shows what writes a film, and how far that is.
fn films(
    ui: &mut Ui,
    model: &Flight,
    is_ready: bool,
    player: &mut Player,
    actions: &mut Vec<Action>,
) {
    if let Some((step, seconds)) = &model.film {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(format!("{step} ({seconds:.0} s)"));
            if ui.button("Cancel").clicked() {
                actions.push(Action::CancelFilm);
            }
        });
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("Frames per second");
        let rate = DragValue::new(&mut player.rate).range(0.1..=240.0);
        ui.add(rate.update_while_editing(false)).labelled_by(label.id);
        ui.add_enabled_ui(is_ready, |ui| {
            if ui.button("Export film…").clicked() {
                actions.push(Action::Ask(Purpose::Export));
            }
        });
    });
}

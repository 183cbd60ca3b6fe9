//! The way of the camera: keyframes, a preview, and films.

use super::Ask;
use crate::view::{export::Exporting, window::Window};
use eframe::egui::{DragValue, Slider, Ui};
use glam::DVec2;
use splatkit::math::{Camera, CameraPath, Keyframe};

/// Seconds from one keyframe to the next one that is added.
const STEP: f64 = 2.0;
/// Moves of a turn around the scene, and the seconds that it takes.
const TURNS: usize = 4;
const TURN: f64 = 8.0;

/// The keyframes, and what is done with them.
pub struct Flight {
    pub keyframes: Vec<Keyframe>,
    /// The time that is shown, in seconds.
    time: f64,
    is_playing: bool,
    /// Frames per second of films.
    pub rate: f64,
    pub exporting: Option<Exporting>,
}

impl Default for Flight {
    fn default() -> Self {
        Self { keyframes: Vec::new(), time: 0.0, is_playing: false, rate: 30.0, exporting: None }
    }
}

impl Flight {
    /// Returns the path through the keyframes.
    pub fn path(&self) -> splatkit::Result<CameraPath> {
        CameraPath::new(self.keyframes.clone())
    }

    fn end(&self) -> f64 {
        self.keyframes.last().map_or(0.0, |keyframe| keyframe.time)
    }

    /// Adds a keyframe behind the last one.
    fn add(&mut self, camera: Camera) {
        let time = if self.keyframes.is_empty() { 0.0 } else { self.end() + STEP };
        self.keyframes.push(Keyframe { time, camera });
        self.time = time;
    }
}

pub fn show(window: &mut Window, ui: &mut Ui) {
    let camera = window.scene_view.as_ref().map(|scene_view| scene_view.orbit.camera().clone());
    let Some(camera) = camera else { return };
    buttons(window, ui, &camera);
    let mut chosen = keyframes(&mut window.panels.flight, ui, &camera);
    match window.panels.flight.path() {
        Ok(path) => chosen = preview(&mut window.panels.flight, ui, &path).or(chosen),
        Err(_) if window.panels.flight.keyframes.is_empty() => {
            ui.weak("Look at the scene, add a keyframe, look from elsewhere, add another.");
        }
        Err(error) => {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
        }
    }
    if let Some(camera) = chosen {
        window.move_camera(|orbit| orbit.set_camera(camera));
    }
    films(window, ui);
}

fn buttons(window: &mut Window, ui: &mut Ui, camera: &Camera) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("Add keyframe").clicked() {
            window.panels.flight.add(camera.clone());
        }
        let turns = ui.button("Turn around").on_hover_text("Keyframes once around the scene");
        if turns.clicked()
            && let Some(scene_view) = &window.scene_view
        {
            let mut orbit = scene_view.orbit.clone();
            let flight = &mut window.panels.flight;
            flight.keyframes.clear();
            for number in 0..TURNS {
                let time = TURN * number as f64 / TURNS as f64;
                flight.keyframes.push(Keyframe { time, camera: orbit.camera().clone() });
                // A drag over the height turns half around.
                orbit.turn(DVec2::new(2.0 / TURNS as f64, 0.0), [1, 1]);
            }
            // The last camera is the first one exactly, so that the film is a loop.
            flight.keyframes.push(Keyframe { time: TURN, camera: camera.clone() });
        }
        if ui.button("Open path…").clicked() {
            window.panels.ask(Ask::OpenPath);
        }
        let has_path = !window.panels.flight.keyframes.is_empty();
        ui.add_enabled_ui(has_path, |ui| {
            if ui.button("Save path…").clicked() {
                window.panels.ask(Ask::SavePath);
            }
        });
    });
}

/// Shows the keyframes. Returns the camera of one that is to be shown.
fn keyframes(flight: &mut Flight, ui: &mut Ui, camera: &Camera) -> Option<Camera> {
    let (mut chosen, mut removed) = (None, None);
    let times: Vec<f64> = flight.keyframes.iter().map(|keyframe| keyframe.time).collect();
    for (number, keyframe) in flight.keyframes.iter_mut().enumerate() {
        // Times ascend.
        let after = number.checked_sub(1).map_or(f64::MIN, |before| times[before] + 1e-3);
        let before = times.get(number + 1).map_or(f64::MAX, |next| next - 1e-3);
        ui.horizontal(|ui| {
            let name = format!("keyframe {}", number + 1);
            let time = DragValue::new(&mut keyframe.time).range(after..=before).speed(0.05);
            ui.add(time.suffix(" s").update_while_editing(false))
                .on_hover_text(format!("When {name} is reached"));
            let show = ui.button("Show");
            if show.on_hover_text(format!("Look from {name}")).clicked() {
                chosen = Some(keyframe.camera.clone());
                flight.time = keyframe.time;
            }
            let set = ui.button("Set").on_hover_text(format!("Make {name} what is shown now"));
            if set.clicked() {
                keyframe.camera = camera.clone();
            }
            if ui.small_button("×").on_hover_text(format!("Remove {name}")).clicked() {
                removed = Some(number);
            }
        });
    }
    if let Some(number) = removed {
        flight.keyframes.remove(number);
    }
    chosen
}

/// Shows the time, and returns the camera at that time if it changes.
fn preview(flight: &mut Flight, ui: &mut Ui, path: &CameraPath) -> Option<Camera> {
    let (start, end) = (path.start(), path.start() + path.duration());
    let mut is_moved = false;
    ui.horizontal(|ui| {
        let name = if flight.is_playing { "Pause" } else { "Play" };
        if ui.button(name).clicked() {
            flight.is_playing = !flight.is_playing;
            if flight.time >= end {
                flight.time = start;
            }
        }
        let slider = Slider::new(&mut flight.time, start..=end).suffix(" s").fixed_decimals(1);
        is_moved = ui.add(slider).accessible_name("Time").changed();
    });
    if flight.is_playing && !is_moved {
        flight.time += f64::from(ui.input(|input| input.stable_dt.min(0.2)));
        is_moved = true;
        if flight.time >= end {
            (flight.time, flight.is_playing) = (end, false);
        }
        ui.ctx().request_repaint();
    }
    is_moved.then(|| path.at(flight.time))
}

/// Shows what writes a film, and how far that is.
fn films(window: &mut Window, ui: &mut Ui) {
    let Some(exporting) = &window.panels.flight.exporting else {
        ui.horizontal(|ui| {
            let label = ui.label("Frames per second");
            let rate = DragValue::new(&mut window.panels.flight.rate).range(0.1..=240.0);
            ui.add(rate.update_while_editing(false)).labelled_by(label.id);
            let is_ready = window.panels.flight.path().is_ok();
            ui.add_enabled_ui(is_ready, |ui| {
                if ui.button("Export film…").clicked() {
                    window.panels.ask(Ask::Export);
                }
            });
        });
        return;
    };
    let text = format!("{} ({:.0} s)", exporting.step(), exporting.since.elapsed().as_secs_f32());
    ui.horizontal(|ui| {
        ui.spinner();
        ui.label(text);
        if ui.button("Cancel").clicked() {
            window.panels.flight.exporting = None;
            window.say("the film was cancelled", false);
        }
    });
}

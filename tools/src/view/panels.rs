//! The menu, the panels beside the picture, and the windows over it.

use super::{
    curve::{self, CurveEditor, Edit},
    painter::Stage,
    slices::SlicePanes,
    window::{Tool, Window},
};
use eframe::egui::{self, Color32, Grid, Ui, Vec2};
use glam::DVec3;
use serde_json::Value;
use splatkit::{
    interaction::{ClipEntry, Probe, SceneFile},
    math::Bounds,
    scene::Item,
};
use std::{
    path::PathBuf,
    sync::{
        Arc,
        mpsc::{Receiver, channel},
    },
};

/// Backgrounds to choose from.
const BACKGROUNDS: [&str; 5] = ["black", "white", "#10141c", "gray", "none"];

/// What a path is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ask {
    Open,
    SaveScene,
    SavePicture,
}

/// A path that is asked for.
struct Asked {
    ask: Ask,
    text: String,
    /// Whether the field has not been shown yet: it is then where the keys go.
    is_new: bool,
    /// The files that were chosen in the system's own dialog.
    chosen: Option<Receiver<Vec<PathBuf>>>,
}

/// The state of the panels.
pub struct State {
    pub shows_side: bool,
    pub shows_help: bool,
    /// The depth of the point where a drag began.
    pub grabbed: Option<f64>,
    pub before_drag: Option<SceneFile>,
    /// The scene before a point of the transfer function was dragged.
    before_edit: Option<SceneFile>,
    /// The world point under the cursor.
    pub under_cursor: Option<DVec3>,
    asked: Option<Asked>,
    bounds: Option<Bounds>,
    curve: Option<CurveEditor>,
    slices: Option<SlicePanes>,
    shows_slices: bool,
}

impl Default for State {
    fn default() -> Self {
        Self {
            shows_side: true,
            shows_help: false,
            grabbed: None,
            before_drag: None,
            before_edit: None,
            under_cursor: None,
            asked: None,
            bounds: None,
            curve: None,
            slices: None,
            shows_slices: false,
        }
    }
}

impl State {
    pub fn ask(&mut self, ask: Ask) {
        let text = match ask {
            Ask::Open => "",
            Ask::SaveScene => "scene.json",
            Ask::SavePicture => "picture.png",
        };
        self.asked = Some(Asked { ask, text: text.to_owned(), is_new: true, chosen: None });
    }

    /// Forgets what belonged to the scene before.
    pub fn scene_changed(&mut self, stage: &Stage) {
        let bounds = stage.loaded.subject.bounds;
        self.bounds = Some(bounds);
        self.curve = Some(CurveEditor::new(bounds.diagonal()));
        self.slices = Some(SlicePanes::default());
        (self.under_cursor, self.grabbed) = (None, None);
    }

    /// Sets the place at which slices cross.
    pub fn set_place(&mut self, place: DVec3) {
        if let Some(slices) = &mut self.slices {
            slices.set_place(place);
        }
    }
}

fn file_menu(window: &mut Window, ui: &mut Ui) {
    if ui.button("Open… (Ctrl+O)").clicked() {
        window.panels.ask(Ask::Open);
        ui.close();
    }
    if ui.button("Save picture… (Ctrl+P)").clicked() {
        window.panels.ask(Ask::SavePicture);
        ui.close();
    }
    if ui.button("Save scene… (Ctrl+S)").clicked() {
        window.panels.ask(Ask::SaveScene);
        ui.close();
    }
    if ui.button("Copy command (Ctrl+Shift+C)").clicked() {
        window.copy_command();
        ui.close();
    }
}

fn view_menu(window: &mut Window, ui: &mut Ui) {
    for side in ["front", "back", "left", "right", "top", "bottom", "iso"] {
        if ui.button(side).clicked() {
            window.look_from(side);
            ui.close();
        }
    }
    if ui.button("whole scene (Home)").clicked() {
        window.look_from("");
        ui.close();
    }
    ui.separator();
    ui.checkbox(&mut window.panels.shows_side, "panels (Tab)");
    egui::global_theme_preference_buttons(ui);
}

pub fn menu(window: &mut Window, ui: &mut Ui) {
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file_menu(window, ui));
        ui.menu_button("Edit", |ui| {
            let can_undo = window.document.can_undo();
            if ui.add_enabled(can_undo, egui::Button::new("Undo (Ctrl+Z)")).clicked() {
                window.document.undo();
            }
            let can_redo = window.document.can_redo();
            if ui.add_enabled(can_redo, egui::Button::new("Redo (Ctrl+Y)")).clicked() {
                window.document.redo();
            }
        });
        ui.menu_button("View", |ui| view_menu(window, ui));
        let measures = window.tool == Tool::Measure;
        if ui.selectable_label(measures, "Measure").clicked() {
            window.tool = if measures { Tool::Look } else { Tool::Measure };
            window.measured.clear();
        }
        ui.toggle_value(&mut window.panels.shows_slices, "Slices");
        if ui.button("Help").clicked() {
            window.panels.shows_help = !window.panels.shows_help;
        }
        if let Some((name, share, seconds)) = window.loading_step() {
            ui.separator();
            let bar = egui::ProgressBar::new(share.unwrap_or(0.0)).desired_width(160.0);
            ui.add(if share.is_none() { bar.animate(true) } else { bar });
            ui.label(format!("{name} ({seconds:.0} s)"));
            if ui.button("Cancel").clicked() {
                window.cancel();
            }
        }
    });
}

pub fn status(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        if let Some(DVec3 { x, y, z }) = window.panels.under_cursor {
            ui.label(format!("{x:.4}, {y:.4}, {z:.4}"));
            if let Some(shown) = &window.shown
                && let Some(value) =
                    Probe::new(&shown.stage.loaded.scene).value_at(DVec3 { x, y, z })
            {
                ui.label(format!("value {value:.4}"));
            }
            ui.separator();
        }
        if let Some((frame, _)) = &window.frame {
            let state = if window.rests() { "exact" } else { "refining" };
            ui.label(format!("{state}, {:.0} ms", frame.milliseconds));
            ui.separator();
        }
        if let Some((text, is_error)) = window.messages.last() {
            let color = if *is_error { Color32::LIGHT_RED } else { ui.visuals().text_color() };
            let line = text.lines().next().unwrap_or_default();
            ui.colored_label(color, line).on_hover_text(text);
        }
    });
}

/// The panels beside the picture.
pub fn side(window: &mut Window, ui: &mut Ui) {
    egui::CollapsingHeader::new("Inputs").default_open(true).show(ui, |ui| inputs(window, ui));
    if window.transfer().is_some() {
        egui::CollapsingHeader::new("Transfer function")
            .default_open(true)
            .show(ui, |ui| transfer_function(window, ui));
    }
    egui::CollapsingHeader::new("Look").default_open(true).show(ui, |ui| look(window, ui));
    egui::CollapsingHeader::new("Clips").default_open(false).show(ui, |ui| clips(window, ui));
    egui::CollapsingHeader::new("Frame").default_open(false).show(ui, |ui| frame(window, ui));
    egui::CollapsingHeader::new("Messages").default_open(false).show(ui, |ui| {
        for (text, is_error) in window.messages.iter().rev() {
            let color = if *is_error { Color32::LIGHT_RED } else { ui.visuals().text_color() };
            ui.colored_label(color, text);
        }
    });
}

fn inputs(window: &mut Window, ui: &mut Ui) {
    let entries = window.document.scene().inputs.clone();
    for (number, entry) in entries.iter().enumerate() {
        ui.horizontal(|ui| {
            let name = entry.file.file_name().unwrap_or(entry.file.as_os_str());
            let name = name.to_string_lossy();
            let mut visible = entry.visible;
            if ui
                .checkbox(&mut visible, &*name)
                .on_hover_text(entry.file.display().to_string())
                .changed()
            {
                window.document.change(|scene| scene.inputs[number].visible = visible);
            }
            if ui.small_button("×").on_hover_text(format!("Remove {name}")).clicked() {
                window.document.change(|scene| {
                    scene.inputs.remove(number);
                });
            }
        });
    }
    if ui.button("Add…").clicked() {
        window.panels.ask(Ask::Open);
    }
}

fn transfer_function(window: &mut Window, ui: &mut Ui) {
    let (Some(mut transfer), Some(stage), Some(mut curve)) = (
        window.transfer(),
        window.shown.as_ref().map(|shown| Arc::clone(&shown.stage)),
        window.panels.curve.take(),
    ) else {
        return;
    };
    let values = stage.loaded.scene.items.iter().find_map(Item::value_range);
    let histogram = stage.histogram.as_ref();
    let edit = curve.show(ui, histogram, &mut transfer, values.unwrap_or([0.0, 1.0]));
    window.panels.curve = Some(curve);
    if edit == Edit::Unchanged {
        return;
    }
    // A drag is one step.
    let before = window.panels.before_edit.take();
    let before = before.unwrap_or_else(|| window.document.scene().clone());
    window.set_transfer(&transfer);
    match edit {
        Edit::Committed => window.document.keep(before),
        _ => window.panels.before_edit = Some(before),
    }
}

/// Shows three slices of the volume in a window of their own.
fn slices(window: &mut Window, ui: &mut Ui) {
    let (Some(stage), Some(transfer), Some(mut panes)) = (
        window.shown.as_ref().map(|shown| Arc::clone(&shown.stage)),
        window.transfer(),
        window.panels.slices.take(),
    ) else {
        return;
    };
    let mut shows = window.panels.shows_slices;
    let volume = stage.loaded.scene.items.iter().find_map(|item| match item {
        Item::Volume(volume, kernel, _) => Some((volume, kernel)),
        _ => None,
    });
    egui::Window::new("Slices").open(&mut shows).default_width(720.0).show(ui.ctx(), |ui| {
        match volume {
            Some((volume, kernel)) => {
                panes.show(ui, volume, kernel, &transfer);
            }
            None => {
                ui.label("slices are for volumes on a lattice in memory");
            }
        }
    });
    (window.panels.slices, window.panels.shows_slices) = (Some(panes), shows);
}

/// Returns an option as a text.
fn text_option(window: &Window, name: &str) -> String {
    match window.document.scene().options.get(name) {
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
        None => String::new(),
    }
}

/// Sets or removes an option as a step.
fn set_option(window: &mut Window, name: &str, value: Option<Value>) {
    window.document.change(|scene| match value {
        Some(value) => {
            scene.options.insert(name.to_owned(), value);
        }
        None => {
            scene.options.remove(name);
        }
    });
}

/// Shows a switch for a flag without a value.
fn switch(window: &mut Window, ui: &mut Ui, name: &str, label: &str) {
    let mut on = window.document.scene().options.contains_key(name);
    if ui.checkbox(&mut on, label).changed() {
        set_option(window, name, on.then_some(Value::Bool(true)));
    }
}

/// Shows a field for a flag with a value, which counts when it is left.
fn field(window: &mut Window, ui: &mut Ui, name: &str, label: &str, hint: &str) {
    let id = ui.scope_id().with(name);
    let own = text_option(window, name);
    let mut text = ui.data(|data| data.get_temp::<String>(id)).unwrap_or_else(|| own.clone());
    let label = ui.label(label);
    let response = ui.add(egui::TextEdit::singleline(&mut text).hint_text(hint));
    let response = response.labelled_by(label.id);
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
    } else {
        if response.lost_focus() && text != own {
            let value = Some(text.trim()).filter(|text| !text.is_empty());
            set_option(window, name, value.map(|text| Value::String(text.to_owned())));
        }
        ui.data_mut(|data| data.remove::<String>(id));
    }
    ui.end_row();
}

fn look(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        let label = ui.label("Background");
        let own = text_option(window, "background");
        let own = if own.is_empty() { "black".to_owned() } else { own };
        let choice = egui::ComboBox::from_id_salt("background").selected_text(&own);
        let shown = choice.show_ui(ui, |ui| {
            for name in BACKGROUNDS {
                if ui.selectable_label(own == name, name).clicked() {
                    set_option(window, "background", Some(Value::String(name.into())));
                }
            }
        });
        shown.response.labelled_by(label.id);
    });
    switch(window, ui, "no-shade", "Without light");
    switch(window, ui, "axes", "Axes");
    switch(window, ui, "scale-bar", "Scale bar");
    switch(window, ui, "scalar-bar", "Scalar bar");
    Grid::new("look").num_columns(2).show(ui, |ui| {
        field(window, ui, "color", "Colour", "a colour, a map, height, …");
        field(window, ui, "scalar", "Array", "the file's first");
        field(window, ui, "range", "Range", "LOW,HIGH");
        field(window, ui, "iso", "Isosurface", "VALUE or 50%");
        field(window, ui, "radius-scale", "Radius", "1");
        field(window, ui, "cut", "Cut (pixels)", "2");
        field(window, ui, "up", "Up", "+Z");
        field(window, ui, "caption", "Caption", "");
    });
}

fn clips(window: &mut Window, ui: &mut Ui) {
    let Some(bounds) = window.panels.bounds else { return };
    let middle = bounds.center();
    ui.horizontal(|ui| {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if ui.button(format!("Plane {name}")).clicked() {
                let mut plane = [0.0; 4];
                (plane[axis], plane[3]) = (1.0, middle[axis]);
                window.change_clips(|clips| {
                    clips.push(ClipEntry { plane: Some(plane), cuboid: None, inside: true });
                });
            }
        }
        if ui.button("Box").clicked() {
            let cuboid = Some([bounds.min.to_array(), bounds.max.to_array()]);
            window.change_clips(|clips| {
                clips.push(ClipEntry { plane: None, cuboid, inside: true });
            });
        }
    });
    let mut entries = window.document.scene().clips.clone();
    let (mut is_changed, mut removed) = (false, None);
    for (number, clip) in entries.iter_mut().enumerate() {
        ui.push_id(number, |ui| {
            ui.horizontal(|ui| {
                let label = if clip.inside { "keeps the inside" } else { "keeps the outside" };
                is_changed |= ui.checkbox(&mut clip.inside, label).changed();
                if ui.small_button("×").on_hover_text("Remove the clip").clicked() {
                    removed = Some(number);
                }
            });
            is_changed |= clip_sliders(clip, &bounds, ui);
        });
    }
    if let Some(number) = removed {
        window.change_clips(|clips| {
            clips.remove(number);
        });
    } else if is_changed {
        // A drag of a slider is one step.
        if window.panels.before_drag.is_none() {
            window.panels.before_drag = Some(window.document.scene().clone());
        }
        window.document.adjust(|scene| scene.clips = entries);
    }
    if !ui.input(|input| input.pointer.any_down())
        && let Some(before) = window.panels.before_drag.take()
    {
        window.document.keep(before);
    }
}

/// Shows the sliders of a clip, and says whether one was moved.
fn clip_sliders(clip: &mut ClipEntry, bounds: &Bounds, ui: &mut Ui) -> bool {
    let mut is_changed = false;
    if let Some(plane) = &mut clip.plane {
        let normal = DVec3::new(plane[0], plane[1], plane[2]);
        let ends = bounds.corners().map(|corner| corner.dot(normal));
        let [low, high] = ends
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
        let slider = egui::Slider::new(&mut plane[3], low..=high).text("offset");
        is_changed |= ui.add(slider).changed();
    }
    if let Some([first, last]) = &mut clip.cuboid {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let range = bounds.min[axis]..=bounds.max[axis];
            for (end, value) in [("from", &mut first[axis]), ("to", &mut last[axis])] {
                let slider = egui::Slider::new(value, range.clone());
                is_changed |= ui.add(slider.text(format!("{name} {end}"))).changed();
            }
            // A box has an inside.
            let least = 1e-3 * (bounds.max[axis] - bounds.min[axis]);
            last[axis] = last[axis].max(first[axis] + least);
        }
    }
    is_changed
}

fn frame(window: &mut Window, ui: &mut Ui) {
    let Some((frame, _)) = &window.frame else { return };
    let stats = &frame.stats;
    let [width, height] = [frame.picture.width, frame.picture.height];
    Grid::new("frame").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.label(name);
            ui.label(value);
            ui.end_row();
        };
        row("Pixels", format!("{width} × {height}"));
        row("Splats", stats.splats.to_string());
        row("Hidden", stats.hidden.to_string());
        row("Entries", stats.entries.to_string());
        row("Passes", stats.passes.to_string());
        row("Missing pages", stats.missing_pages.to_string());
        row("Bytes", stats.gpu_bytes.to_string());
        row("Frame", format!("{:.1} ms", frame.milliseconds));
        row("Behind the hand", format!("{:.1} ms", frame.delay));
        let device = window.shown.as_ref().map(|shown| shown.stage.device.name().to_owned());
        row("Device", device.unwrap_or_default());
    });
}

/// Moves and widens the transfer function as a hand drags.
pub fn window_level(window: &mut Window, drag: Vec2) {
    let Some(mut transfer) = window.transfer() else { return };
    let values = window
        .shown
        .as_ref()
        .and_then(|shown| shown.stage.loaded.scene.items.iter().find_map(Item::value_range));
    if let Some(values) = values {
        curve::window_level(&mut transfer, drag, values);
        window.set_transfer(&transfer);
    }
}

/// The windows over the picture: paths that are asked for, and help.
pub fn windows(window: &mut Window, ui: &mut Ui) {
    asked(window, ui);
    if window.panels.shows_slices {
        slices(window, ui);
    }
    let mut shows = window.panels.shows_help;
    egui::Window::new("Help").open(&mut shows).show(ui.ctx(), |ui| {
        Grid::new("help").num_columns(2).show(ui, |ui| {
            for (key, what) in HELP {
                ui.strong(*key);
                ui.label(*what);
                ui.end_row();
            }
        });
    });
    window.panels.shows_help = shows;
}

const HELP: &[(&str, &str)] = &[
    ("drag", "turn"),
    ("right or middle drag, Shift+drag", "move"),
    ("Alt+drag", "look around"),
    ("wheel", "closer or farther, to what is under the cursor"),
    ("Ctrl+drag", "move and widen the transfer function (level, window)"),
    ("double click", "turn about this point"),
    ("W A S D, E Q", "fly"),
    ("1 3 7, with Ctrl", "front, right, top; back, left, bottom"),
    ("0, Home", "corner; whole scene"),
    ("O", "perspective on or off"),
    ("M", "measure between two points"),
    ("Tab", "panels"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo"),
    ("Ctrl+O, Ctrl+S, Ctrl+P", "open, save the scene, save the picture"),
    ("Ctrl+Shift+C", "copy the command that draws this"),
    ("H, F1", "this help"),
];

/// Asks for a path.
fn asked(window: &mut Window, ui: &mut Ui) {
    let Some(mut asked) = window.panels.asked.take() else { return };
    let (title, action) = match asked.ask {
        Ask::Open => ("Open a file", "Open"),
        Ask::SaveScene => ("Save the scene", "Save"),
        Ask::SavePicture => ("Save the picture", "Save"),
    };
    let mut chosen = asked.chosen.as_ref().and_then(|chosen| chosen.try_recv().ok());
    let (mut stays, mut is_done) = (true, false);
    egui::Window::new(title).collapsible(false).open(&mut stays).show(ui.ctx(), |ui| {
        let field = ui.add(
            egui::TextEdit::singleline(&mut asked.text).hint_text("a path").desired_width(360.0),
        );
        if std::mem::take(&mut asked.is_new) {
            field.request_focus();
        }
        let enters = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        ui.horizontal(|ui| {
            is_done = ui.button(action).clicked() || enters;
            if ui.button("Browse…").clicked() {
                asked.chosen = Some(browse(asked.ask, asked.text.clone(), ui.ctx().clone()));
            }
        });
    });
    if is_done && !asked.text.trim().is_empty() {
        chosen = Some(vec![PathBuf::from(asked.text.trim())]);
    }
    let Some(files) = chosen.filter(|files| !files.is_empty()) else {
        window.panels.asked = stays.then_some(asked);
        return;
    };
    match (asked.ask, files.first()) {
        (Ask::Open, _) => window.open(files),
        (Ask::SaveScene, Some(path)) => window.save_scene(path),
        (Ask::SavePicture, Some(path)) => window.save_picture(path.clone()),
        (_, None) => {}
    }
}

/// Opens the system's own dialog in a thread, so that the window stays alive.
fn browse(ask: Ask, name: String, context: egui::Context) -> Receiver<Vec<PathBuf>> {
    let (send, receive) = channel();
    let dialog = move || {
        let dialog = rfd::FileDialog::new();
        let files = match ask {
            Ask::Open => dialog.pick_files(),
            Ask::SaveScene | Ask::SavePicture => {
                dialog.set_file_name(name).save_file().map(|file| vec![file])
            }
        };
        send.send(files.unwrap_or_default()).ok();
        context.request_repaint();
    };
    // Without a thread there is no dialog; the field stays.
    std::thread::Builder::new().name("dialog".into()).spawn(dialog).ok();
    receive
}

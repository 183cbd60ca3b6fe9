//! The menu, the panels beside the picture, and the windows over it.

mod appearance;
mod asked;
mod clips;
mod flight;
mod inputs;
mod transfer;

pub use asked::Ask;
pub use transfer::window_level;

use super::{
    curve::CurveEditor,
    painter::Stage,
    slices::SlicePanes,
    window::{Tool, Window},
};
use asked::Asked;
use eframe::egui::{self, Color32, Grid, Ui};
use flight::Flight;
use glam::DVec3;
use splatkit::{
    interaction::Probe,
    math::Bounds,
    scene::Item,
    session::{Description, Side},
};
use std::sync::Arc;

/// The state of the panels.
pub struct State {
    pub shows_side: bool,
    pub shows_help: bool,
    /// The depth of the point where a drag began.
    pub grabbed: Option<f64>,
    pub before_drag: Option<Description>,
    /// The scene before a point of the transfer function was dragged.
    before_edit: Option<Description>,
    /// The world point under the cursor.
    pub under_cursor: Option<DVec3>,
    asked: Option<Asked>,
    pub bounds: Option<Bounds>,
    curve: Option<CurveEditor>,
    slices: Option<SlicePanes>,
    pub shows_slices: bool,
    /// Whether clips have handles in the picture.
    pub shows_handles: bool,
    pub flight: Flight,
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
            shows_handles: true,
            flight: Flight::default(),
        }
    }
}

impl State {
    pub fn ask(&mut self, ask: Ask) {
        self.asked = Some(Asked::new(ask));
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
    for side in Side::ALL {
        if ui.button(side.name()).clicked() {
            window.look_from(Some(side));
            ui.close();
        }
    }
    if ui.button("whole scene (Home)").clicked() {
        window.look_from(None);
        ui.close();
    }
    ui.separator();
    ui.checkbox(&mut window.panels.shows_side, "panels (Tab)");
    theme_switch(ui);
}

/// Chooses between light and dark by words: the fonts have no signs for these.
fn theme_switch(ui: &mut egui::Ui) {
    let now = ui.ctx().options(|options| options.theme_preference);
    let mut wanted = now;
    ui.horizontal(|ui| {
        for (theme, name) in [
            (egui::ThemePreference::System, "as the system"),
            (egui::ThemePreference::Light, "light"),
            (egui::ThemePreference::Dark, "dark"),
        ] {
            ui.selectable_value(&mut wanted, theme, name);
        }
    });
    if wanted != now {
        ui.ctx().set_theme(wanted);
    }
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
            window.tool = if measures { Tool::Navigate } else { Tool::Measure };
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
            if let Some(scene_view) = &window.scene_view
                && let Some(value) =
                    Probe::new(&scene_view.stage.loaded.scene).value_at(DVec3 { x, y, z })
            {
                ui.label(format!("value {value:.4}"));
            }
            ui.separator();
        }
        if let Some(frame) = &window.frame {
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
    egui::CollapsingHeader::new("Inputs")
        .default_open(true)
        .show(ui, |ui| inputs::show(window, ui));
    if window.transfer().is_some() {
        egui::CollapsingHeader::new("Transfer function")
            .default_open(true)
            .show(ui, |ui| transfer::show(window, ui));
    }
    egui::CollapsingHeader::new("Look")
        .default_open(true)
        .show(ui, |ui| appearance::show(window, ui));
    egui::CollapsingHeader::new("Clips").default_open(false).show(ui, |ui| clips::show(window, ui));
    egui::CollapsingHeader::new("Camera path")
        .default_open(false)
        .show(ui, |ui| flight::show(window, ui));
    egui::CollapsingHeader::new("Frame").default_open(false).show(ui, |ui| frame(window, ui));
    egui::CollapsingHeader::new("Messages").default_open(false).show(ui, |ui| {
        for (text, is_error) in window.messages.iter().rev() {
            let color = if *is_error { Color32::LIGHT_RED } else { ui.visuals().text_color() };
            ui.colored_label(color, text);
        }
    });
}

/// Shows three slices of the volume.
pub fn slices(window: &mut Window, ui: &mut Ui) {
    if window.transfer().is_none() {
        return;
    }
    let (Some((stage, field)), Some(mut panes)) = (
        window
            .scene_view
            .as_ref()
            .map(|scene_view| (Arc::clone(&scene_view.stage), scene_view.field)),
        window.panels.slices.take(),
    ) else {
        return;
    };
    let items = &stage.loaded.scene.items;
    let volume = |number: usize| match items.get(number)? {
        Item::Volume(volume, kernel, _) => Some((volume, kernel, window.transfer_of(number)?)),
        _ => None,
    };
    // The field that is edited, or else the first that has slices.
    match [field].into_iter().chain(0..items.len()).find_map(volume) {
        Some((volume, kernel, transfer)) => {
            panes.show(ui, volume, kernel, &transfer);
        }
        None => {
            ui.label("slices are for volumes on a lattice in memory");
        }
    }
    window.panels.slices = Some(panes);
}

fn frame(window: &mut Window, ui: &mut Ui) {
    let Some(frame) = &window.frame else { return };
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
        row("Behind the hand", format!("{:.1} ms", window.delay));
        let device =
            window.scene_view.as_ref().map(|scene_view| scene_view.stage.device.name().to_owned());
        row("Device", device.unwrap_or_default());
    });
}

/// The windows over the picture: paths that are asked for, and help.
pub fn windows(window: &mut Window, ui: &mut Ui) {
    asked::show(window, ui);
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

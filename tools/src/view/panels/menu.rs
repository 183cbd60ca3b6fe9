//! The menu above the picture, the line below it, and the help.

use crate::view::{
    action::{Action, Part, Purpose, Select},
    recent::is_missing,
    selection::Tool,
};
use eframe::egui::{self, Color32, Grid, Ui};
use glam::DVec3;
use splatkit::session::Side;
use std::path::PathBuf;

/// What the menu shows.
pub struct Menu<'a> {
    pub recent: &'a [PathBuf],
    /// The number of views of the figure that was opened, or 0.
    pub views: usize,
    pub can_undo: bool,
    pub can_redo: bool,
    pub measures: bool,
    pub shows_side: bool,
    pub shows_slices: bool,
    /// The step that loading is at, how much of it is done, and for how many seconds it goes on.
    pub loading: Option<(String, Option<f32>, f32)>,
}

/// Shows an entry of a menu.
fn entry(ui: &mut Ui, name: &str, action: Action, actions: &mut Vec<Action>) {
    if ui.button(name).clicked() {
        actions.push(action);
        ui.close();
    }
}

pub fn menu(ui: &mut Ui, model: &Menu) -> Vec<Action> {
    let mut actions = Vec::new();
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file(ui, model, &mut actions));
        ui.menu_button("Edit", |ui| {
            ui.add_enabled_ui(model.can_undo, |ui| {
                entry(ui, "Undo (Ctrl+Z)", Action::Undo, &mut actions);
            });
            ui.add_enabled_ui(model.can_redo, |ui| {
                entry(ui, "Redo (Ctrl+Y)", Action::Redo, &mut actions);
            });
            ui.separator();
            for (name, select) in [
                ("Select by box (B)", Select::Tool(Some(Tool::Box))),
                ("Select by lasso (L)", Select::Tool(Some(Tool::Lasso))),
                ("Invert selection (Ctrl+I)", Select::Invert),
                ("Delete selection (Delete)", Select::Delete),
            ] {
                entry(ui, name, Action::Select(select), &mut actions);
            }
        });
        ui.menu_button("View", |ui| view(ui, model, &mut actions));
        if ui.selectable_label(model.measures, "Measure").clicked() {
            actions.push(Action::Measure);
        }
        if ui.selectable_label(model.shows_slices, "Slices").clicked() {
            actions.push(Action::Toggle(Part::Slices));
        }
        if ui.button("Help").clicked() {
            actions.push(Action::Toggle(Part::Help));
        }
        if let Some((name, share, seconds)) = &model.loading {
            ui.separator();
            let bar = egui::ProgressBar::new(share.unwrap_or(0.0)).desired_width(160.0);
            ui.add(if share.is_none() { bar.animate(true) } else { bar });
            ui.label(format!("{name} ({seconds:.0} s)"));
            if ui.button("Cancel").clicked() {
                actions.push(Action::CancelLoading);
            }
        }
    });
    actions
}

fn file(ui: &mut Ui, model: &Menu, actions: &mut Vec<Action>) {
    let recent = model.recent;
    entry(ui, "Open… (Ctrl+O)", Action::Ask(Purpose::Open), actions);
    ui.add_enabled_ui(!recent.is_empty(), |ui| {
        ui.menu_button("Open recent", |ui| {
            for file in recent {
                let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
                let path = file.display().to_string();
                let is_gone = is_missing(file);
                let name = if is_gone { format!("{name} (missing)") } else { name.into_owned() };
                let button = ui.add_enabled(!is_gone, egui::Button::new(name));
                let button = button.on_hover_text(&path).on_disabled_hover_text(&path);
                if button.clicked() {
                    actions.push(Action::OpenRecent(file.clone()));
                    ui.close();
                }
            }
            ui.separator();
            entry(ui, "Forget these", Action::ForgetRecent, actions);
        });
    });
    entry(ui, "Save picture… (Ctrl+P)", Action::Ask(Purpose::SavePicture), actions);
    if model.views > 0 {
        let name = format!("Save figure of {} views…", model.views);
        entry(ui, &name, Action::Ask(Purpose::SaveFigure), actions);
    }
    entry(ui, "Save scene… (Ctrl+S)", Action::Ask(Purpose::SaveScene), actions);
    entry(ui, "Copy command (Ctrl+Shift+C)", Action::CopyCommand, actions);
    ui.separator();
    entry(ui, "Quit (Ctrl+Q)", Action::Quit, actions);
}

fn view(ui: &mut Ui, model: &Menu, actions: &mut Vec<Action>) {
    for side in Side::ALL {
        entry(ui, side.name(), Action::View(Some(side)), actions);
    }
    entry(ui, "whole scene (Home)", Action::View(None), actions);
    ui.separator();
    let mut shows_side = model.shows_side;
    if ui.checkbox(&mut shows_side, "panels (Tab)").changed() {
        actions.push(Action::Toggle(Part::Side));
    }
    entry(ui, "full screen (F11)", Action::FullScreen, actions);
    theme(ui, actions);
}

/// Chooses between light and dark by words: the fonts have no signs for these.
fn theme(ui: &mut Ui, actions: &mut Vec<Action>) {
    let now = ui.ctx().options(|options| options.theme_preference);
    ui.horizontal(|ui| {
        for (theme, name) in [
            (egui::ThemePreference::System, "as the system"),
            (egui::ThemePreference::Light, "light"),
            (egui::ThemePreference::Dark, "dark"),
        ] {
            if ui.selectable_label(now == theme, name).clicked() {
                actions.push(Action::Theme(theme));
            }
        }
    });
}

/// What the line below the picture shows.
pub struct Status<'a> {
    /// The world point under the cursor, and the value there.
    pub under_cursor: Option<(DVec3, Option<f64>)>,
    /// Whether the picture is exact, and the milliseconds that it took.
    pub frame: Option<(bool, f64)>,
    /// The last message, and whether it is an error.
    pub message: Option<&'a (String, bool)>,
}

pub fn status(ui: &mut Ui, model: &Status) {
    ui.horizontal(|ui| {
        if let Some((DVec3 { x, y, z }, value)) = model.under_cursor {
            ui.label(format!("{x:.4}, {y:.4}, {z:.4}"));
            if let Some(value) = value {
                ui.label(format!("value {value:.4}"));
            }
            ui.separator();
        }
        if let Some((is_exact, milliseconds)) = model.frame {
            let state = if is_exact { "exact" } else { "refining" };
            ui.label(format!("{state}, {milliseconds:.0} ms"));
            ui.separator();
        }
        if let Some((text, is_error)) = model.message {
            let line = text.lines().next().unwrap_or_default();
            ui.colored_label(color_of(ui, *is_error), line).on_hover_text(text);
        }
    });
}

/// Returns the colour of a message.
fn color_of(ui: &Ui, is_error: bool) -> Color32 {
    if is_error { Color32::LIGHT_RED } else { ui.visuals().text_color() }
}

/// Shows the messages, the newest first.
pub fn messages(ui: &mut Ui, messages: &[(String, bool)]) {
    for (text, is_error) in messages.iter().rev() {
        ui.colored_label(color_of(ui, *is_error), text);
    }
}

/// Shows the help, if it is open.
pub fn help(ui: &Ui, is_open: bool) -> Vec<Action> {
    let mut stays = is_open;
    // Below the menu, which closes the help too.
    let window = egui::Window::new("Help").default_pos([24.0, 40.0]).resizable(false);
    window.open(&mut stays).show(ui.ctx(), |ui| {
        Grid::new("help").num_columns(2).show(ui, |ui| {
            for (key, what) in HELP {
                ui.strong(*key);
                ui.label(*what);
                ui.end_row();
            }
        });
    });
    if stays == is_open { Vec::new() } else { vec![Action::Toggle(Part::Help)] }
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
    ("B, L", "select by a box or a lasso; Esc ends that"),
    ("Ctrl+I, Delete", "select everything else; delete what is selected"),
    ("Tab", "panels"),
    ("F11", "full screen"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo"),
    ("Ctrl+O, Ctrl+S, Ctrl+P", "open, save the scene, save the picture"),
    ("Ctrl+Shift+C", "copy the command that draws this"),
    ("H, F1", "this help"),
    ("Ctrl+Q", "quit"),
];

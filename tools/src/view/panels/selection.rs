//! What is selected, and the edits of each input.

use crate::view::{
    action::{Action, Purpose, Select},
    selection::{Form, Mode, Tool},
};
use eframe::egui::{self, DragValue, TextEdit, Ui};
use splatkit::{math::Bounds, session::Description};

/// What the panel shows.
pub struct Selection<'a> {
    pub scene: &'a Description,
    pub tool: Option<Tool>,
    pub mode: Mode,
    pub is_near: bool,
    pub condition: Option<&'a str>,
    /// How many are selected, and how many there are; `None` while that is being found.
    pub counts: Option<[u64; 2]>,
    /// The names of values that conditions compare.
    pub names: Vec<String>,
    /// The box around the scene.
    pub bounds: Bounds,
}

pub fn show(ui: &mut Ui, model: &Selection, form: &mut Form) -> Vec<Action> {
    let mut actions = Vec::new();
    outlines(ui, model, &mut actions);
    values(ui, model, form, &mut actions);
    world_box(ui, model, form, &mut actions);
    ui.separator();
    selected(ui, model, &mut actions);
    edits(ui, model.scene, &mut actions);
    actions
}

/// Chooses what outlines are drawn with, and what they do.
fn outlines(ui: &mut Ui, model: &Selection, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        for (tool, name, hint) in [
            (Tool::Box, "Select by box", "Drag a box on the picture (B)"),
            (Tool::Lasso, "Select by lasso", "Draw around something on the picture (L)"),
        ] {
            let is_chosen = model.tool == Some(tool);
            if ui.selectable_label(is_chosen, name).on_hover_text(hint).clicked() {
                actions.push(Action::Select(Select::Tool((!is_chosen).then_some(tool))));
            }
        }
    });
    ui.horizontal(|ui| {
        for (mode, name) in
            [(Mode::Replace, "replace"), (Mode::Add, "add"), (Mode::Remove, "take away")]
        {
            if ui.radio(model.mode == mode, name).clicked() {
                actions.push(Action::Select(Select::Mode(mode)));
            }
        }
    });
    let mut is_near = model.is_near;
    let near = ui.checkbox(&mut is_near, "No deeper than what is seen");
    let hint = "Without it, outlines select everything before and behind, too";
    if near.on_hover_text(hint).changed() {
        actions.push(Action::Select(Select::Near(is_near)));
    }
}

/// Selects by values.
fn values(ui: &mut Ui, model: &Selection, form: &mut Form, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label("Condition");
        let hint = format!("Values: {}", model.names.join(", "));
        let field = TextEdit::singleline(&mut form.condition).hint_text("x > 2 && height < 1");
        let field = ui.add(field.desired_width(170.0)).labelled_by(label.id).on_hover_text(hint);
        let is_entered =
            field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let is_clicked = ui.button("Select by values").clicked();
        if (is_entered || is_clicked) && !form.condition.trim().is_empty() {
            let condition = form.condition.trim().to_owned();
            actions.push(Action::Select(Select::Condition(condition)));
        }
    });
}

/// Selects by a box in the world.
fn world_box(ui: &mut Ui, model: &Selection, form: &mut Form, actions: &mut Vec<Action>) {
    let Bounds { min, max } = model.bounds;
    let mut corners = form.corners.unwrap_or([min.to_array(), max.to_array()]);
    let mut is_changed = false;
    ui.collapsing("Box in the world", |ui| {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let speed = 2e-3 * (max[axis] - min[axis]).max(1e-9);
            ui.horizontal(|ui| {
                for (corner, end) in corners.iter_mut().zip(["from", "to"]) {
                    let label = ui.label(format!("{name} {end}"));
                    let value = DragValue::new(&mut corner[axis]).speed(speed).max_decimals(6);
                    is_changed |= ui.add(value).labelled_by(label.id).changed();
                }
            });
        }
        if is_changed {
            form.corners = Some(corners);
        }
        if ui.button("Select the box").clicked() {
            let numbers: Vec<String> = corners.as_flattened().iter().map(f64::to_string).collect();
            let condition = format!("inside(\"{}\")", numbers.join(","));
            actions.push(Action::Select(Select::Condition(condition)));
        }
    });
}

/// Shows how much is selected, and what can be done with it.
fn selected(ui: &mut Ui, model: &Selection, actions: &mut Vec<Action>) {
    match (model.condition, model.counts) {
        (None, _) => ui.label("nothing is selected"),
        (Some(_), None) => ui.label("selecting…"),
        (Some(condition), Some([some, all])) => {
            ui.label(format!("{some} of {all} are selected")).on_hover_text(condition)
        }
    };
    let has_some = model.counts.is_some_and(|[some, _]| some > 0) && model.condition.is_some();
    ui.horizontal(|ui| {
        for (name, hint, is_enabled, select) in [
            ("Delete selected", "Delete what is selected (Delete)", has_some, Select::Delete),
            ("Keep selected", "Delete everything else", has_some, Select::Keep),
            ("Invert", "Select everything else (Ctrl+I)", true, Select::Invert),
            ("Clear", "Select nothing (Esc)", model.condition.is_some(), Select::Clear),
        ] {
            let button = ui.add_enabled(is_enabled, egui::Button::new(name));
            if button.on_hover_text(hint).clicked() {
                actions.push(Action::Select(select));
            }
        }
    });
}

/// Lists the edits of each input.
fn edits(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    for (number, input) in scene.inputs.iter().enumerate().filter(|(_, i)| !i.edits.is_empty()) {
        ui.separator();
        let name = input.file.file_name().unwrap_or(input.file.as_os_str()).to_string_lossy();
        ui.label(format!("Edits of {name}"));
        for (at, edit) in input.edits.iter().enumerate() {
            ui.push_id((number, at), |ui| {
                ui.horizontal(|ui| {
                    let button = ui.small_button("×").on_hover_text("Remove the edit");
                    let name = format!("Remove edit {}", at + 1);
                    if button.accessible_name(name).clicked() {
                        actions.push(Action::change(move |scene| {
                            scene.inputs[number].edits.remove(at);
                        }));
                    }
                    let text = ui.add(egui::Label::new(edit.text()).truncate());
                    text.on_hover_text(edit.text());
                });
            });
        }
        if ui.button(format!("Save edited {name}…")).clicked() {
            actions.push(Action::Ask(Purpose::SaveEdited(number)));
        }
    }
}

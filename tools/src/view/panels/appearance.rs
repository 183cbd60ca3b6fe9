//! How the scene looks: view, up axis, background, engine, light, texts, and numbers.

use super::lists::{choice, color, held, map};
use crate::{
    given::{self, Kinds},
    view::action::Action,
};
use eframe::egui::{DragValue, Grid, TextEdit, Ui};
use splatkit::{
    about::direction_name,
    glam::DVec3,
    session::{Background, ColorEntry, Description, Engine, Side},
};

/// Backgrounds by name.
const BACKGROUNDS: [&str; 5] = ["black", "white", "#10141c", "gray", "none"];
/// The sheet of splats that is drawn if nothing else is asked for, in pixels.
const CUT: f64 = 2.0;

/// What the panel shows.
pub struct Appearance<'a> {
    pub scene: &'a Description,
    /// What the visible inputs are.
    pub kinds: &'a [Kinds],
    /// The up axis of the scene, and the values that colour surfaces.
    pub up: Option<DVec3>,
    pub range: Option<[f64; 2]>,
}

impl Appearance<'_> {
    fn has(&self, wanted: Kinds) -> bool {
        self.kinds.iter().any(|kinds| kinds & wanted != 0)
    }
}

pub fn show(ui: &mut Ui, model: &Appearance) -> Vec<Action> {
    let mut actions = Vec::new();
    let scene = model.scene;
    Grid::new("lists").num_columns(2).show(ui, |ui| {
        view(ui, scene, &mut actions);
        up(ui, model, &mut actions);
        background(ui, scene, &mut actions);
        engine(ui, scene, &mut actions);
    });
    Grid::new("switches").num_columns(2).show(ui, |ui| switches(ui, scene, &mut actions));
    Grid::new("numbers").num_columns(2).show(ui, |ui| {
        if model.has(given::MESH | given::CLOUD) {
            surfaces(ui, model, &mut actions);
        }
        if model.has(given::HIERARCHY | given::BRICKS) {
            cut(ui, scene, &mut actions);
        }
        caption(ui, scene, &mut actions);
    });
    actions
}

fn view(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    // A camera that was moved looks from nowhere in particular.
    let current = match scene.camera {
        None => Some(scene.framing.view),
        Some(_) => None,
    };
    let sides = Side::ALL.into_iter().map(|side| (side.name().to_owned(), Some(Some(side))));
    let whole = [("whole scene".to_owned(), Some(None))];
    let chosen = choice(ui, "View", whole.into_iter().chain(sides), &current, Some("as turned"));
    actions.extend(chosen.flatten().map(Action::View));
    ui.end_row();
}

fn up(ui: &mut Ui, model: &Appearance, actions: &mut Vec<Action>) {
    let usual = model.up.filter(|_| model.scene.framing.up.is_none());
    let usual =
        usual.map_or("automatic".to_owned(), |up| format!("automatic ({})", direction_name(up)));
    let axes = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    let axes = axes.map(|axis| (direction_name(axis), Some(axis)));
    let current = model.scene.framing.up;
    let name = current.map(direction_name);
    let entries = [(usual, None)].into_iter().chain(axes);
    if let Some(up) = choice(ui, "Up", entries, &current, name.as_deref()) {
        // The camera is fitted anew: the one before would stand askew.
        actions.push(Action::change(move |scene| (scene.framing.up, scene.camera) = (up, None)));
    }
    ui.end_row();
}

fn background(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    let current = scene.picture.background;
    let entries = BACKGROUNDS.map(|name| (name.to_owned(), name.parse::<Background>().ok()));
    let effective = current.or_else(|| BACKGROUNDS[0].parse().ok());
    let mut chosen = choice(ui, "Background", entries, &effective, Some("a colour"));
    if let Some(plain) = scene.picture.background()
        && let Some(picked) = color(ui, "Colour of the background", plain)
    {
        chosen = Some(Some(Background::Color(ColorEntry(picked))));
    }
    if let Some(background) = chosen {
        actions.push(Action::change(move |scene| scene.picture.background = background));
    }
    ui.end_row();
}

fn engine(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    let entries = [
        ("auto".to_owned(), Engine::Auto),
        ("cpu".to_owned(), Engine::Cpu),
        ("gpu".to_owned(), Engine::Gpu),
    ];
    if let Some(engine) = choice(ui, "Engine", entries, &scene.engine, None) {
        actions.push(Action::change(move |scene| scene.engine = engine));
    }
    ui.end_row();
}

/// Shows a switch.
fn switch(
    ui: &mut Ui,
    label: &str,
    is_on: bool,
    set: impl FnOnce(&mut Description, bool) + 'static,
    actions: &mut Vec<Action>,
) {
    let mut on = is_on;
    if ui.checkbox(&mut on, label).changed() {
        actions.push(Action::change(move |scene| set(scene, on)));
    }
}

fn switches(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    let overlay = &scene.overlay;
    let is_dark = scene.picture.shade == Some(false);
    let darken = |scene: &mut Description, on: bool| scene.picture.shade = on.then_some(false);
    switch(ui, "Without light", is_dark, darken, actions);
    switch(ui, "Axes", overlay.axes, |scene, on| scene.overlay.axes = on, actions);
    ui.end_row();
    let scale_bar = overlay.scale_bar;
    switch(ui, "Scale bar", scale_bar, |scene, on| scene.overlay.scale_bar = on, actions);
    let scalar_bar = overlay.scalar_bar;
    switch(ui, "Scalar bar", scalar_bar, |scene, on| scene.overlay.scalar_bar = on, actions);
}

/// Shows what all surfaces have in common: the map of their values, its range, and their radii.
fn surfaces(ui: &mut Ui, model: &Appearance, actions: &mut Vec<Action>) {
    let scene = model.scene;
    if let Some(map) = map(ui, "Colour map", scene.appearance.colormap) {
        actions.push(Action::change(move |scene| scene.appearance.colormap = map));
    }
    ui.end_row();
    if let Some(values) = scene.appearance.range.or(model.range) {
        range(ui, scene.appearance.range, values, actions);
    }
    let current = scene.appearance.radius_scale.unwrap_or(1.0);
    let label = ui.label("Radius");
    let radius = held(ui, "radius", current, |ui, radius| {
        let field = DragValue::new(radius).range(0.01..=100.0).speed(0.01);
        ui.add(field.update_while_editing(false)).labelled_by(label.id);
    });
    if let Some(radius) = radius {
        let radius = Some(radius).filter(|radius| *radius != 1.0);
        actions.push(Action::change(move |scene| scene.appearance.radius_scale = radius));
    }
    ui.end_row();
}

/// Shows the values with the first and the last colour.
fn range(ui: &mut Ui, chosen: Option<[f64; 2]>, values: [f64; 2], actions: &mut Vec<Action>) {
    ui.label("Range");
    ui.horizontal(|ui| {
        let speed = (values[1] - values[0]).abs().max(1e-9) / 300.0;
        let edited = held(ui, "range", values, |ui, ends| {
            for (end, name) in ends.iter_mut().zip(["Lowest value", "Highest value"]) {
                let field = DragValue::new(end).speed(speed).update_while_editing(false);
                let field = ui.add(field.custom_formatter(|value, _| super::plain(value)));
                field.accessible_name(name);
            }
        });
        if let Some(ends) = edited.filter(|[low, high]| low < high) {
            actions.push(Action::change(move |scene| scene.appearance.range = Some(ends)));
        }
        if chosen.is_some() && ui.button("All values").clicked() {
            actions.push(Action::change(|scene| scene.appearance.range = None));
        }
    });
    ui.end_row();
}

/// Shows the width of the splats that hierarchies and bricks are drawn with.
fn cut(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    let label = ui.label("Cut (pixels)");
    let current = scene.picture.cut.unwrap_or(CUT);
    let cut = held(ui, "cut", current, |ui, cut| {
        let field = DragValue::new(cut).range(0.0..=64.0).speed(0.05);
        ui.add(field.update_while_editing(false)).labelled_by(label.id);
    });
    if let Some(cut) = cut {
        actions.push(Action::change(move |scene| {
            scene.picture.cut = Some(cut);
            (scene.picture.budget, scene.picture.frame_time) = (None, None);
        }));
    }
    ui.end_row();
}

/// Shows the text over the picture, which counts once the field is left.
fn caption(ui: &mut Ui, scene: &Description, actions: &mut Vec<Action>) {
    let current = scene.overlay.caption.clone().unwrap_or_default();
    let id = ui.scope_id().with("caption");
    let kept = ui.data(|data| data.get_temp::<String>(id));
    let mut text = kept.unwrap_or_else(|| current.clone());
    let label = ui.label("Caption");
    let response = ui.add(TextEdit::singleline(&mut text)).labelled_by(label.id);
    if response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, text));
    } else {
        ui.data_mut(|data| data.remove::<String>(id));
        if response.lost_focus() && text != current {
            let text = Some(text.trim().to_owned()).filter(|text| !text.is_empty());
            actions.push(Action::change(|scene| scene.overlay.caption = text));
        }
    }
    ui.end_row();
}

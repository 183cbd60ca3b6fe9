//! The inputs: which are drawn, their series, times and arrays, and the colours and opacities of
//! surfaces.

use super::lists::{choice, color, held};
use crate::{
    given::{self, Kinds},
    view::{
        action::{Action, Purpose},
        choices::{self, Choices},
    },
};
use eframe::egui::{DragValue, Slider, Ui};
use splatkit::{
    formats::Times,
    session::{Description, InputEntry, LoadedInput, SurfaceColor},
};

/// The colour of a surface when one colour is chosen for it first.
const PLAIN: [f32; 3] = [0.8, 0.8, 0.8];

/// What the panel shows.
pub struct Inputs<'a> {
    pub scene: &'a Description,
    /// What the visible inputs are, as far as they are loaded.
    pub loaded: &'a [LoadedInput],
    pub choices: &'a Choices,
}

pub fn show(ui: &mut Ui, model: &Inputs) -> Vec<Action> {
    let mut actions = Vec::new();
    for (number, entry) in model.scene.inputs.iter().enumerate() {
        ui.push_id(number, |ui| {
            head(ui, number, entry, &mut actions);
            let loaded = model.loaded.iter().find(|input| input.file == entry.file);
            let Some(loaded) = loaded.filter(|_| entry.visible) else { return };
            ui.indent("input", |ui| {
                series(ui, number, entry, model, &mut actions);
                if let Some(times) = loaded.times {
                    time(ui, number, (entry, times), model.scene, &mut actions);
                }
                array(ui, number, entry, model, &mut actions);
                let kinds: Kinds = given::kinds_of_input(loaded);
                if kinds & (given::MESH | given::CLOUD) != 0 {
                    colors(ui, number, entry, (model.scene, loaded), &mut actions);
                    opacity(ui, number, entry, &mut actions);
                }
            });
        });
    }
    if ui.button("Add…").clicked() {
        actions.push(Action::Ask(Purpose::Open));
    }
    actions
}

/// Shows the name of an input, whether it is drawn, and what removes it.
fn head(ui: &mut Ui, number: usize, entry: &InputEntry, actions: &mut Vec<Action>) {
    let name = entry.file.file_name().unwrap_or(entry.file.as_os_str());
    let name = name.to_string_lossy().into_owned();
    ui.horizontal(|ui| {
        let mut visible = entry.visible;
        let path = entry.file.display().to_string();
        if ui.checkbox(&mut visible, &*name).on_hover_text(path).changed() {
            actions.push(Action::change(move |scene| scene.inputs[number].visible = visible));
        }
        if ui.small_button("×").on_hover_text(format!("Remove {name}")).clicked() {
            actions.push(Action::change(move |scene| drop(scene.inputs.remove(number))));
        }
    });
}

/// Shows the series of an input, if it has several.
fn series(
    ui: &mut Ui,
    number: usize,
    entry: &InputEntry,
    model: &Inputs,
    actions: &mut Vec<Action>,
) {
    let all = model.choices.series(model.scene, entry);
    let named = all.map(|series| (series.title(), Some(series.identifier.clone())));
    let named: Vec<_> = named.collect();
    let current = model.scene.reading_of(entry).series;
    if named.len() < 2 && current.is_none() {
        return;
    }
    let automatic = [("automatic".to_owned(), None)];
    ui.horizontal(|ui| {
        let entries = automatic.into_iter().chain(named);
        if let Some(series) = choice(ui, "Series", entries, &current, current.as_deref()) {
            actions.push(Action::change(move |scene| {
                choices::choose_series(scene, number, series);
            }));
        }
    });
}

/// Shows the times of an input. Another one is read once, at the end of a drag.
fn time(
    ui: &mut Ui,
    number: usize,
    (entry, times): (&InputEntry, Times),
    scene: &Description,
    actions: &mut Vec<Action>,
) {
    ui.horizontal(|ui| {
        let label = ui.label("Time");
        let last = usize::try_from(times.count - 1).unwrap_or(usize::MAX);
        let current = scene.reading_of(entry).time.unwrap_or(times.read);
        let time = held(ui, "time", current, |ui, time| {
            let slider = Slider::new(time, 0..=last).integer().update_while_editing(false);
            ui.add(slider).labelled_by(label.id);
        });
        ui.weak(format!("of 0 to {last}"));
        if let Some(time) = time {
            actions.push(Action::change(move |scene| choices::choose_time(scene, number, time)));
        }
    });
}

/// Shows the arrays of an input, if it has several.
fn array(
    ui: &mut Ui,
    number: usize,
    entry: &InputEntry,
    model: &Inputs,
    actions: &mut Vec<Action>,
) {
    let names = model.choices.arrays(model.scene, entry);
    let current = choices::array_of(model.scene, entry);
    if names.len() < 2 && current.is_none() {
        return;
    }
    let automatic = [("automatic".to_owned(), None)];
    let named = names.into_iter().map(|name| (name.clone(), Some(name)));
    ui.horizontal(|ui| {
        let entries = automatic.into_iter().chain(named);
        if let Some(array) = choice(ui, "Array", entries, &current, current.as_deref()) {
            actions.push(Action::change(move |scene| {
                choices::choose_array(scene, number, array);
            }));
        }
    });
}

/// Shows what can colour a surface.
fn colors(
    ui: &mut Ui,
    number: usize,
    entry: &InputEntry,
    (scene, loaded): (&Description, &LoadedInput),
    actions: &mut Vec<Action>,
) {
    let current = scene.appearance_of(entry).color;
    let plain = match current {
        Some(SurfaceColor::Plain(color)) => Some(color),
        _ => None,
    };
    let one = SurfaceColor::Plain(plain.unwrap_or(PLAIN));
    let fixed = [
        ("automatic", None),
        ("the file's colours", Some(SurfaceColor::File)),
        ("one colour", Some(one)),
        ("height", Some(SurfaceColor::Height)),
        ("direction of the surface", Some(SurfaceColor::Normal)),
    ];
    let fixed = fixed.into_iter().map(|(name, color)| (name.to_owned(), color));
    let attribute = |name: &String| (name.clone(), Some(SurfaceColor::Attribute(name.clone())));
    let entries = fixed.chain(loaded.attributes.iter().map(attribute));
    let name = current.as_ref().map(ToString::to_string);
    ui.horizontal(|ui| {
        let mut chosen = choice(ui, "Colour", entries, &current, name.as_deref());
        if let Some(plain) = plain
            && let Some(picked) = color(ui, "Colour of the surface", plain)
        {
            chosen = Some(Some(SurfaceColor::Plain(picked)));
        }
        if let Some(color) = chosen {
            actions.push(Action::change(move |scene| set_color(scene, number, color)));
        }
    });
}

/// Colours one surface. What colours all of them becomes what colours each.
fn set_color(scene: &mut Description, number: usize, color: Option<SurfaceColor>) {
    if let Some(shared) = scene.appearance.color.take() {
        for input in &mut scene.inputs {
            input.appearance.color.get_or_insert_with(|| shared.clone());
        }
    }
    scene.inputs[number].appearance.color = color;
}

/// Shows the opacity of a surface. Its splats are made anew: once, at the end of a drag.
fn opacity(ui: &mut Ui, number: usize, entry: &InputEntry, actions: &mut Vec<Action>) {
    ui.horizontal(|ui| {
        let label = ui.label("Opacity");
        let current = f64::from(entry.appearance.opacity.unwrap_or(1.0));
        let opacity = held(ui, "opacity", current, |ui, opacity| {
            let field = DragValue::new(opacity).range(0.01..=1.0).speed(0.005);
            ui.add(field.update_while_editing(false)).labelled_by(label.id);
        });
        if let Some(opacity) = opacity {
            let opacity = Some(opacity as f32).filter(|value| *value < 1.0);
            actions.push(Action::change(move |scene| {
                scene.inputs[number].appearance.opacity = opacity;
            }));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_coloured_all_colours_each() {
        let mut scene = Description::new(["a.ply".into(), "b.ply".into()]);
        scene.appearance.color = Some(SurfaceColor::Height);
        set_color(&mut scene, 1, None);
        let colors = [0, 1].map(|number| scene.appearance_of(&scene.inputs[number]).color);
        assert_eq!(colors, [Some(SurfaceColor::Height), None]);
    }
}

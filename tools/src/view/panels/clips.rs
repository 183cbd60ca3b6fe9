//! Clips, as numbers.

use crate::view::{
    action::{Action, Part},
    handles::offsets,
};
use eframe::egui::{self, Ui};
use glam::DVec3;
use splatkit::{math::Bounds, session::ClipEntry};

/// What the panel shows.
pub struct Clips<'a> {
    pub clips: &'a [ClipEntry],
    /// The box around the scene.
    pub bounds: Bounds,
    /// Whether clips have handles in the picture.
    pub has_handles: bool,
}

pub fn show(ui: &mut Ui, model: &Clips) -> Vec<Action> {
    let mut actions = Vec::new();
    let add = |clip: ClipEntry| Action::change(move |scene| scene.picture.clips.push(clip));
    let Bounds { min, max } = model.bounds;
    ui.horizontal(|ui| {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if ui.button(format!("Plane {name}")).clicked() {
                let mut plane = [0.0; 4];
                (plane[axis], plane[3]) = (1.0, model.bounds.center()[axis]);
                actions.push(add(ClipEntry::of_plane(plane)));
            }
        }
        if ui.button("Box").clicked() {
            actions.push(add(ClipEntry::of_box([min.to_array(), max.to_array()])));
        }
    });
    let mut handles = model.has_handles;
    if ui.checkbox(&mut handles, "Handles in the picture").changed() {
        actions.push(Action::Toggle(Part::Handles));
    }
    let mut entries = model.clips.to_vec();
    let mut removed = None;
    for (number, clip) in entries.iter_mut().enumerate() {
        ui.push_id(number, |ui| {
            ui.horizontal(|ui| {
                let label = if clip.inside { "keeps the inside" } else { "keeps the outside" };
                ui.checkbox(&mut clip.inside, label);
                if ui.small_button("×").on_hover_text("Remove the clip").clicked() {
                    removed = Some(number);
                }
            });
            sliders(ui, clip, &model.bounds);
        });
    }
    if let Some(number) = removed {
        actions.push(Action::change(move |scene| {
            scene.picture.clips.remove(number);
        }));
    } else if entries != model.clips {
        actions.push(Action::drag(|scene| scene.picture.clips = entries));
    }
    actions
}

/// Shows the sliders of a clip.
fn sliders(ui: &mut Ui, clip: &mut ClipEntry, bounds: &Bounds) {
    if let Some(plane) = &mut clip.plane {
        let normal = DVec3::new(plane[0], plane[1], plane[2]);
        let [low, high] = offsets(bounds, normal);
        ui.add(egui::Slider::new(&mut plane[3], low..=high).text("offset"));
    }
    let Some([mut first, mut last]) = clip.corners() else { return };
    let mut is_moved = false;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let range = bounds.min[axis]..=bounds.max[axis];
        for (end, value) in [("from", &mut first[axis]), ("to", &mut last[axis])] {
            let slider = egui::Slider::new(value, range.clone());
            is_moved |= ui.add(slider.text(format!("{name} {end}"))).changed();
        }
        // A box has an inside.
        let least = 1e-3 * (bounds.max[axis] - bounds.min[axis]);
        last[axis] = last[axis].max(first[axis] + least);
    }
    if is_moved {
        *clip = ClipEntry { inside: clip.inside, ..ClipEntry::of_box([first, last]) };
    }
}

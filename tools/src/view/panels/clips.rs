//! Clips, as numbers.

use crate::view::{handles::offsets, window::Window};
use eframe::egui::{self, Ui};
use glam::DVec3;
use splatkit::{math::Bounds, session::ClipEntry};

pub fn show(window: &mut Window, ui: &mut Ui) {
    let Some(bounds) = window.panels.bounds else { return };
    let middle = bounds.center();
    ui.horizontal(|ui| {
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            if ui.button(format!("Plane {name}")).clicked() {
                let mut plane = [0.0; 4];
                (plane[axis], plane[3]) = (1.0, middle[axis]);
                window.change_clips(|clips| {
                    clips.push(ClipEntry::of_plane(plane));
                });
            }
        }
        if ui.button("Box").clicked() {
            let corners = [bounds.min.to_array(), bounds.max.to_array()];
            window.change_clips(|clips| {
                clips.push(ClipEntry::of_box(corners));
            });
        }
    });
    ui.checkbox(&mut window.panels.shows_handles, "Handles in the picture");
    let mut entries = window.document.scene().picture.clips.clone();
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
        window.document.adjust(|scene| scene.picture.clips = entries);
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
        let [low, high] = offsets(bounds, normal);
        let slider = egui::Slider::new(&mut plane[3], low..=high).text("offset");
        is_changed |= ui.add(slider).changed();
    }
    if let Some([mut first, mut last]) = clip.corners() {
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
        *clip = ClipEntry { inside: clip.inside, ..ClipEntry::of_box([first, last]) };
    }
    is_changed
}

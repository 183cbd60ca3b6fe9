//! The panels beside the picture, with what each of them shows.

use super::Window;
use crate::view::{
    action::Action,
    panels::{appearance, clips, flight, frame, inputs, menu, transfer},
    scene_view::SceneView,
};
use eframe::egui::{CollapsingHeader, Ui};

/// Shows a part that can be folded, and takes what its panel asks for.
fn part<R>(ui: &mut Ui, name: &str, is_open: bool, show: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    CollapsingHeader::new(name).default_open(is_open).show(ui, show).body_returned
}

impl Window {
    pub(super) fn side(&mut self, ui: &mut Ui, actions: &mut Vec<Action>) {
        let mut take = |asked: Option<Vec<Action>>| actions.extend(asked.unwrap_or_default());
        take(part(ui, "Inputs", true, |ui| self.inputs(ui)));
        if let Some(scene_view) = &self.scene_view
            && let Some(transfer) = scene_view.transfer_of(&self.document, scene_view.field)
        {
            let (stage, field) = (&scene_view.stage, scene_view.field);
            let model = transfer::Transfer {
                fields: &scene_view.fields(),
                field,
                transfer: &transfer,
                histogram: stage.histogram(field),
                values: stage.values(field),
                is_hounsfield: stage.is_hounsfield(field),
            };
            let curve = &mut self.curve;
            let panel = |ui: &mut Ui| transfer::show(ui, &model, curve);
            take(part(ui, "Transfer function", true, panel));
        }
        take(part(ui, "Appearance", true, |ui| self.appearance(ui)));
        if let Some(scene_view) = &self.scene_view {
            let model = clips::Clips {
                clips: &self.document.scene().picture.clips,
                bounds: scene_view.stage.loaded.subject.bounds,
                has_handles: self.parts.handles,
            };
            take(part(ui, "Clips", false, |ui| clips::show(ui, &model)));
        }
        if self.scene_view.is_some() {
            take(part(ui, "Selection", false, |ui| self.selection(ui)));
        }
        if let Some(scene_view) = &self.scene_view {
            let film = self.exporting.as_ref().map(|film| {
                let seconds = film.since.elapsed().as_secs_f32();
                (film.step(), seconds)
            });
            let (orbit, keyframes) = (&scene_view.orbit, &self.keyframes[..]);
            let model = flight::Flight { orbit, keyframes, film };
            let player = &mut self.player;
            take(part(ui, "Camera path", false, |ui| flight::show(ui, &model, player)));
        }
        if let (Some(last), Some(scene_view)) = (&self.frame, &self.scene_view) {
            let device = scene_view.stage.device.name();
            part(ui, "Frame", false, |ui| frame::show(ui, last, self.delay, device));
        }
        part(ui, "Messages", false, |ui| menu::messages(ui, &self.messages));
    }

    fn inputs(&self, ui: &mut Ui) -> Vec<Action> {
        let loaded = self.scene_view.as_ref().map(|view| &view.stage.loaded.inputs[..]);
        let model = inputs::Inputs {
            scene: self.document.scene(),
            loaded: loaded.unwrap_or_default(),
            choices: &self.choices,
        };
        inputs::show(ui, &model)
    }

    fn appearance(&self, ui: &mut Ui) -> Vec<Action> {
        let scene_view = self.scene_view.as_ref();
        let kinds = scene_view.map_or(Vec::new(), SceneView::kinds);
        let model = appearance::Appearance {
            scene: self.document.scene(),
            kinds: &kinds,
            up: scene_view.map(|scene_view| scene_view.up),
            range: scene_view.and_then(SceneView::surface_range),
        };
        appearance::show(ui, &model)
    }

    /// Shows three slices of a volume.
    pub(super) fn slices(&mut self, ui: &mut Ui) {
        let Some(scene_view) = &self.scene_view else { return };
        let Some((volume, kernel, item)) = scene_view.sliced() else {
            ui.label("slices are for volumes on a lattice in memory");
            return;
        };
        if let Some(transfer) = scene_view.transfer_of(&self.document, item) {
            self.slices.show(ui, volume, kernel, &transfer);
        }
    }
}

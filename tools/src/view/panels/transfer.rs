//! The transfer functions of the fields, of which one is edited.

use super::lists::choice;
use crate::view::{
    action::{Action, Purpose},
    curve::{CurveEditor, Edit},
};
use eframe::egui::Ui;
use splatkit::{interaction::Histogram, volume::TransferFunction};

/// What the panel shows.
pub struct Transfer<'a> {
    /// The items that have a field, with their names, and the one that is edited.
    pub fields: &'a [(usize, String)],
    pub field: usize,
    pub transfer: &'a TransferFunction,
    pub histogram: Option<&'a Histogram>,
    /// The smallest and the largest value, and whether they are Hounsfield units.
    pub values: [f64; 2],
    pub is_hounsfield: bool,
}

pub fn show(ui: &mut Ui, model: &Transfer, curve: &mut CurveEditor) -> Vec<Action> {
    let mut actions = Vec::new();
    if model.fields.len() > 1 {
        let entries = model.fields.iter().map(|(item, name)| (name.clone(), *item));
        ui.horizontal(|ui| {
            actions
                .extend(choice(ui, "Field", entries, &model.field, None).map(Action::ChooseField));
        });
    }
    ui.horizontal(|ui| {
        if ui.button("Load…").clicked() {
            actions.push(Action::Ask(Purpose::OpenTransfer));
        }
        if ui.button("Save…").clicked() {
            actions.push(Action::Ask(Purpose::SaveTransfer));
        }
    });
    curve.set_hounsfield(model.is_hounsfield);
    let mut transfer = model.transfer.clone();
    let show_curve = |ui: &mut Ui| curve.show(ui, model.histogram, &mut transfer, model.values);
    let edit = ui.push_id(model.field, show_curve).inner;
    actions.extend(curve.take_note().map(Action::Say));
    if edit != Edit::Unchanged {
        actions.push(Action::Transfer(Box::new(transfer)));
    }
    actions
}

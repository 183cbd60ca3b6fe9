//! Changes of a scene that is prepared: items are added, taken out and moved. What is kept of the
//! other items stays.

use super::{CpuRenderer, fields::FieldState, items::Prepared};
use crate::{Result, math::Pose, scene::Item};

/// What is kept of an item that is not drawn.
#[derive(Debug)]
pub struct Parked {
    prepared: Prepared,
    field: Option<FieldState>,
}

impl CpuRenderer {
    /// Adds an item before the one with this number, with what was kept of it.
    pub(crate) fn insert(
        &mut self,
        number: usize,
        (item, pose): (Item, Option<Pose>),
        parked: Option<Parked>,
    ) {
        self.scene.insert(number, item, pose);
        self.shadows.forget();
        for field in self.fields.iter_mut().filter(|field| field.number >= number) {
            field.number += 1;
        }
        let (prepared, field) = match parked {
            Some(Parked { prepared, field }) => (prepared, field),
            None => {
                let item = &self.scene.items[number];
                let field = item.transfer().map(|_| FieldState::new(&self.scene, number));
                (Prepared::new(item), field)
            }
        };
        self.prepared.insert(number, prepared);
        if let Some(mut field) = field {
            field.number = number;
            let place = self.fields.iter().filter(|other| other.number < number).count();
            self.fields.insert(place, field);
        }
        self.update_item(number);
    }

    /// Takes an item out.
    pub(crate) fn take(&mut self, number: usize) -> Parked {
        self.scene.remove(number);
        self.shadows.forget();
        let place = self.fields.iter().position(|field| field.number == number);
        let field = place.map(|place| self.fields.remove(place));
        for field in self.fields.iter_mut().filter(|field| field.number > number) {
            field.number -= 1;
        }
        Parked { prepared: self.prepared.remove(number), field }
    }

    /// Moves an item.
    ///
    /// # Errors
    /// Those of [`Scene::set_pose`](crate::scene::Scene::set_pose).
    pub(crate) fn set_pose(&mut self, number: usize, pose: Pose) -> Result<()> {
        self.scene.set_pose(number, pose)?;
        self.shadows.forget();
        self.update_item(number);
        Ok(())
    }

    /// Gives what is kept of an item its volume, transfer function and pose.
    fn update_item(&mut self, number: usize) {
        let item = &self.scene.items[number];
        let pose = self.scene.view_pose(number);
        self.prepared[number].update(item, pose);
        for field in self.fields.iter_mut().filter(|field| field.number == number) {
            field.update(item, pose);
        }
    }
}

//! Items that are added, hidden, moved and removed while a renderer keeps the others prepared.

use super::{Drawer, Renderer};
#[cfg(feature = "gpu")]
use crate::gpu;
use crate::{
    Error, Result, cpu,
    math::{Bounds, Pose},
    scene::{Item, Scene},
    volume::TransferFunction,
};

/// The name of an item of a renderer. It stays the same while other items come and go.
///
/// The items of the scene that a renderer was made with are named by their numbers in it:
/// `ItemId::from(0)` is the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ItemId(usize);

impl From<usize> for ItemId {
    fn from(number: usize) -> Self {
        Self(number)
    }
}

/// An item of a renderer.
#[derive(Debug)]
pub(super) struct Slot {
    id: ItemId,
    /// The item if it is hidden.
    hidden: Option<Hidden>,
}

#[derive(Debug)]
struct Hidden {
    /// A scene of this item alone, at its pose.
    scene: Scene,
    /// What the engine keeps of it.
    parked: Option<Parked>,
}

#[derive(Debug)]
enum Parked {
    #[cfg(feature = "gpu")]
    Gpu(Box<gpu::Parked>),
    Cpu(Box<cpu::Parked>),
}

/// Returns the items of a scene that is new.
pub(super) fn slots(scene: &Scene) -> Vec<Slot> {
    (0..scene.items.len()).map(|number| Slot { id: ItemId(number), hidden: None }).collect()
}

impl Renderer {
    /// Returns the items, hidden ones too, in the order in which they were added.
    pub fn items(&self) -> impl Iterator<Item = ItemId> {
        self.slots.iter().map(|slot| slot.id)
    }

    /// Returns the scene that is drawn: the visible items.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the box around the visible items, footprints included.
    pub fn bounds(&self) -> Bounds {
        self.scene.bounds()
    }

    /// Adds an item behind the others. The data of the others stay where they are; only if the item
    /// is facets that show images are all images packed anew. A frame that is being drawn is
    /// abandoned, as by each change below.
    ///
    /// # Errors
    /// Those that [`new`](Self::new) has with this item. The scene is then as before.
    pub fn add(&mut self, item: Item) -> Result<ItemId> {
        let id = ItemId(self.next_item);
        self.show(self.slots.len(), Scene::from(vec![item]), None)?;
        self.next_item += 1;
        self.slots.push(Slot { id, hidden: None });
        Ok(id)
    }

    /// Removes an item, and frees what the engine keeps of it.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such item.
    pub fn remove(&mut self, id: impl Into<ItemId>) -> Result<()> {
        let place = self.place(id.into())?;
        let parked = match self.slots[place].hidden.take() {
            Some(hidden) => hidden.parked,
            None => Some(self.take(place)?.1),
        };
        self.slots.remove(place);
        #[cfg(feature = "gpu")]
        if let (Some(Parked::Gpu(parked)), Drawer::Gpu(_, prepared)) = (parked, &mut self.drawer) {
            prepared.forget(*parked);
        }
        #[cfg(not(feature = "gpu"))]
        drop(parked);
        Ok(())
    }

    /// Hides an item, or shows it again. A hidden item keeps its data on the device.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such item, or if the scene cannot be drawn with it.
    pub fn set_visible(&mut self, id: impl Into<ItemId>, is_visible: bool) -> Result<()> {
        let place = self.place(id.into())?;
        match (self.slots[place].hidden.take(), is_visible) {
            (None, false) => {
                let (scene, parked) = self.take(place)?;
                self.slots[place].hidden = Some(Hidden { scene, parked: Some(parked) });
                Ok(())
            }
            (Some(Hidden { scene, parked }), true) => {
                let kept = scene.clone();
                let result = self.show(place, scene, parked);
                if result.is_err() {
                    self.slots[place].hidden = Some(Hidden { scene: kept, parked: None });
                }
                result
            }
            (hidden, _) => {
                self.slots[place].hidden = hidden;
                Ok(())
            }
        }
    }

    /// Returns whether an item is visible.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such item.
    pub fn is_visible(&self, id: impl Into<ItemId>) -> Result<bool> {
        Ok(self.slots[self.place(id.into())?].hidden.is_none())
    }

    /// Moves an item to a pose, from where its data are. Nothing is uploaded.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such item, and those of [`Scene::set_pose`].
    pub fn set_pose(&mut self, id: impl Into<ItemId>, pose: Pose) -> Result<()> {
        let place = self.place(id.into())?;
        if let Some(hidden) = &mut self.slots[place].hidden {
            return hidden.scene.set_pose(0, pose);
        }
        let number = self.number(place);
        self.scene.set_pose(number, pose)?;
        self.changed();
        match &mut self.drawer {
            #[cfg(feature = "gpu")]
            Drawer::Gpu(_, prepared) => prepared.set_pose(number, pose),
            Drawer::Cpu(worker) => worker.engine().set_pose(number, pose),
        }
    }

    /// Returns the pose of an item.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such item.
    pub fn pose(&self, id: impl Into<ItemId>) -> Result<Pose> {
        let place = self.place(id.into())?;
        Ok(match &self.slots[place].hidden {
            Some(hidden) => hidden.scene.pose(0),
            None => self.scene.pose(self.number(place)),
        })
    }

    /// Sets the transfer function of an item's field.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such item, or if it has no field; [`Error::Transfer`] if
    /// [`new`](Self::new) would refuse the function. The scene then keeps its old one.
    pub fn set_transfer(
        &mut self,
        id: impl Into<ItemId>,
        transfer: &TransferFunction,
    ) -> Result<()> {
        let place = self.place(id.into())?;
        if let Some(hidden) = &mut self.slots[place].hidden {
            hidden.scene = hidden.scene.with_transfer(0, transfer)?;
            return Ok(());
        }
        let number = self.number(place);
        self.scene = self.scene.with_transfer(number, transfer)?;
        self.changed();
        match &mut self.drawer {
            #[cfg(feature = "gpu")]
            Drawer::Gpu(_, prepared) => prepared.set_transfer(number, transfer),
            Drawer::Cpu(worker) => worker.engine().set_transfer(number, transfer),
        }
    }

    /// Forgets what the engine keeps of hidden items, which are prepared anew when they are shown.
    pub(super) fn forget_parked(&mut self) {
        for hidden in self.slots.iter_mut().filter_map(|slot| slot.hidden.as_mut()) {
            hidden.parked = None;
        }
    }

    /// Returns the place of an item among all.
    fn place(&self, id: ItemId) -> Result<usize> {
        self.slots.iter().position(|slot| slot.id == id).ok_or_else(|| {
            Error::Argument(format!("the renderer has no item {}; it may have been removed", id.0))
        })
    }

    /// Returns the number of an item in the scene that is drawn.
    fn number(&self, place: usize) -> usize {
        self.slots[..place].iter().filter(|slot| slot.hidden.is_none()).count()
    }

    /// Adds the item of a scene of one to those that are drawn.
    fn show(&mut self, place: usize, one: Scene, parked: Option<Parked>) -> Result<()> {
        let number = self.number(place);
        let pose = one.has_pose(0).then(|| one.pose(0));
        one.validate_item(0)?;
        let Some(item) = one.items.into_iter().next() else { return Ok(()) };
        let mut scene = self.scene.clone();
        scene.insert(number, item.clone(), pose);
        scene.validate_fields()?;
        self.changed();
        match (&mut self.drawer, parked) {
            #[cfg(feature = "gpu")]
            (Drawer::Gpu(_, prepared), parked) => {
                let parked = match parked {
                    Some(Parked::Gpu(parked)) => Some(*parked),
                    _ => None,
                };
                prepared.insert(number, (item, pose), parked)?;
            }
            (Drawer::Cpu(worker), parked) => {
                let parked = match parked {
                    Some(Parked::Cpu(parked)) => Some(*parked),
                    _ => None,
                };
                worker.engine().insert(number, (item, pose), parked);
            }
        }
        self.scene = scene;
        Ok(())
    }

    /// Takes an item out of those that are drawn. Returns a scene of it alone.
    fn take(&mut self, place: usize) -> Result<(Scene, Parked)> {
        let number = self.number(place);
        let pose = self.scene.has_pose(number).then(|| self.scene.pose(number));
        let mut one = Scene::new();
        one.insert(0, self.scene.remove(number), pose);
        self.changed();
        let parked = match &mut self.drawer {
            #[cfg(feature = "gpu")]
            Drawer::Gpu(_, prepared) => Parked::Gpu(prepared.take(number)?.into()),
            Drawer::Cpu(worker) => Parked::Cpu(worker.engine().take(number).into()),
        };
        Ok((one, parked))
    }
}

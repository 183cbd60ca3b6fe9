//! Items that are moved. Splats, facets and cells stay where they are; the view is moved instead.
//! Of a volume, the lattice is moved, and its samples are shared.

use super::{Item, Scene};
use crate::{
    Error, Result,
    math::{Bounds, Pose, View},
};
use std::{borrow::Cow, collections::BTreeMap};

impl Scene {
    /// Returns where an item is moved to from where its data are.
    pub fn pose(&self, number: usize) -> Pose {
        self.poses.get(&number).copied().unwrap_or_default()
    }

    /// Moves an item, by its number, to a pose from where its data are. No data are copied, except
    /// the coefficients of sharp volumes.
    ///
    /// # Errors
    /// [`Error::Argument`] if the scene has no such item; for volumes in bricks, whose lattice is
    /// that of their file; and for a pose whose rotation is no rotation, or that is not finite.
    pub fn set_pose(&mut self, number: usize, pose: Pose) -> Result<()> {
        let last = self.pose(number);
        let Some(item) = self.items.get_mut(number) else { return Err(no_item(number)) };
        if !(pose.rotation.is_normalized() && pose.translation.is_finite()) {
            return Err(Error::Argument(format!(
                "{pose:?} is no motion: its rotation needs unit length"
            )));
        }
        match item {
            Item::Bricks(..) => {
                return Err(Error::Argument("a volume in bricks cannot be moved".into()));
            }
            Item::Volume(volume, ..) => {
                *volume = volume.clone().moved(&pose.after(&last.inverse())).into();
            }
            _ => {}
        }
        self.poses.insert(number, pose);
        Ok(())
    }

    /// Whether an item is moved.
    pub(crate) fn has_pose(&self, number: usize) -> bool {
        self.poses.contains_key(&number)
    }

    /// Returns a view as it is from the data of an item.
    pub(crate) fn view_of<'a>(&self, number: usize, view: &'a View) -> Cow<'a, View> {
        match self.poses.get(&number) {
            Some(pose) if self.items[number].lattice().is_none() => Cow::Owned(pose.view(view)),
            _ => Cow::Borrowed(view),
        }
    }

    /// Returns the pose of an item whose data are not moved themselves.
    pub(crate) fn view_pose(&self, number: usize) -> Pose {
        if self.items[number].lattice().is_some() { Pose::IDENTITY } else { self.pose(number) }
    }

    /// Returns the box around an item where it is.
    pub fn bounds_of(&self, number: usize) -> Bounds {
        self.view_pose(number).bounds(&self.items[number].bounds())
    }

    /// Adds an item before another one, by number, at a pose.
    pub(crate) fn insert(&mut self, number: usize, item: Item, pose: Option<Pose>) {
        self.items.insert(number, item);
        self.poses = renumbered(&self.poses, |old| Some(old + usize::from(old >= number)));
        self.poses.extend(pose.map(|pose| (number, pose)));
    }

    /// Removes an item.
    pub(crate) fn remove(&mut self, number: usize) -> Item {
        self.poses = renumbered(&self.poses, |old| {
            (old != number).then_some(old - usize::from(old > number))
        });
        self.items.remove(number)
    }

    /// Returns the scene with each item replaced by what it becomes, at the same pose.
    pub(crate) fn map(&self, item: impl FnMut((usize, &Item)) -> Result<Item>) -> Result<Self> {
        let items = self.items.iter().enumerate().map(item).collect::<Result<_>>()?;
        Ok(Self { items, poses: self.poses.clone() })
    }

    /// Returns the scene with those items that are kept, by number.
    pub(crate) fn filtered(&self, is_kept: impl Fn(usize) -> bool) -> Self {
        let numbers: Vec<usize> = (0..self.items.len()).filter(|number| is_kept(*number)).collect();
        Self {
            items: numbers.iter().map(|number| self.items[*number].clone()).collect(),
            poses: renumbered(&self.poses, |old| numbers.iter().position(|kept| *kept == old)),
        }
    }
}

/// Returns the error for an item that the scene does not have.
pub(super) fn no_item(number: usize) -> Error {
    Error::Argument(format!("the scene has no item {number}"))
}

fn renumbered(
    poses: &BTreeMap<usize, Pose>,
    number: impl Fn(usize) -> Option<usize>,
) -> BTreeMap<usize, Pose> {
    poses.iter().filter_map(|(old, pose)| Some((number(*old)?, *pose))).collect()
}

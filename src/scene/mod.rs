//! The scene (splats, hierarchies and volumes) and the settings of a picture.

mod choice;
mod item;
mod lighting;
mod numbers;
mod poses;
mod seen;
mod settings;
mod sheets;
mod specks;
mod validate;

pub use crate::math::{Clip, ClipShape};
pub use item::Item;
pub use lighting::{Aside, KeyLight, Lighting, Occlusion, Sky};
pub(crate) use lighting::{MapView, OcclusionBox};
pub use settings::{
    Classification, Controls, Evaluate, Gradient, Mode, Optics, Order, Region, Settings,
};
pub(crate) use sheets::MOST_GATHERED;

use crate::{
    Error, Result,
    bricks::Bricks,
    cells::{Solid, Tetrahedra},
    facet::FacetSet,
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    math::{Bounds, Kernel, Pose, Tensor},
    splat::{BRIGHTEST_TRAINED, SampleSplats, Surfels},
    volume::{TransferFunction, Volume},
};
use std::{collections::BTreeMap, sync::Arc};

/// The items of a picture. All are drawn together, in the same sheets.
///
/// A volume and a mesh in one picture:
///
/// ```
/// use splatkit::{
///     math::Kernel,
///     scene::Scene,
///     surface::{Mesh, SurfelOptions},
///     volume::{TransferFunction, phantoms::Phantom},
/// };
///
/// let volume = Phantom::Ball.sample_bytes([16; 3])?;
/// let transfer = TransferFunction::automatic(&volume);
/// let scene = Scene::new()
///     .with_volume(volume, Kernel::default(), transfer)
///     .with_splats(Mesh::sphere(2).surfels(&SurfelOptions::default())?);
/// assert_eq!(scene.items.len(), 2);
/// assert!(scene.bounds().diagonal() > 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// The items, in any order.
    pub items: Vec<Item>,
    /// Where items are moved to that are not where their data are, by their numbers.
    poses: BTreeMap<usize, Pose>,
}

impl From<Vec<Item>> for Scene {
    fn from(items: Vec<Item>) -> Self {
        Self { items, poses: BTreeMap::new() }
    }
}

impl Scene {
    /// The largest number of fields: volumes, sample sets and cells.
    pub const MAX_FIELDS: usize = 8;

    /// Creates a scene without items.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds splats that carry their own colour and optical depth.
    #[must_use]
    pub fn with_splats(mut self, set: impl Into<Arc<Surfels>>) -> Self {
        self.items.push(Item::Radiance(set.into()));
        self
    }

    /// Adds splats whose footprint is a triangle.
    #[must_use]
    pub fn with_facets(mut self, set: impl Into<Arc<FacetSet>>) -> Self {
        self.items.push(Item::Facets(set.into()));
        self
    }

    /// Adds a trained scene of 3D Gaussians.
    #[must_use]
    pub fn with_gaussians(mut self, set: impl Into<Arc<Gaussians>>) -> Self {
        self.items.push(Item::Gaussians(set.into()));
        self
    }

    /// Adds a hierarchy of splats.
    #[must_use]
    pub fn with_hierarchy(mut self, hierarchy: impl Into<Arc<Hierarchy>>) -> Self {
        self.items.push(Item::Hierarchy(hierarchy.into()));
        self
    }

    /// Adds scattered samples.
    #[must_use]
    pub fn with_samples(
        mut self,
        set: impl Into<Arc<SampleSplats>>,
        transfer: TransferFunction,
    ) -> Self {
        self.items.push(Item::Scalar(set.into(), transfer));
        self
    }

    /// Adds cells, as the tetrahedra that are made of them
    /// ([`Cells::tetrahedra`](crate::cells::Cells::tetrahedra)). Only the CPU engine draws them.
    #[must_use]
    pub fn with_cells(
        mut self,
        tetrahedra: impl Into<Arc<Tetrahedra>>,
        transfer: TransferFunction,
    ) -> Self {
        self.items.push(Item::Cells(tetrahedra.into(), transfer));
        self
    }

    /// Adds cells as a solid body.
    #[must_use]
    pub fn with_solid(mut self, solid: impl Into<Arc<Solid>>) -> Self {
        self.items.push(Item::Solid(solid.into()));
        self
    }

    /// Adds a volume. Of a label map ([`Volume::with_labels`]), each label has what the transfer
    /// function shows of its value, and an isosurface shows the label of its value.
    #[must_use]
    pub fn with_volume(
        mut self,
        volume: impl Into<Arc<Volume>>,
        kernel: Kernel,
        transfer: TransferFunction,
    ) -> Self {
        let volume = volume.into();
        let transfer = if volume.is_label_map() { transfer.over_labels(&volume) } else { transfer };
        self.items.push(Item::Volume(volume, kernel, transfer));
        self
    }

    /// Adds a volume in bricks.
    #[must_use]
    pub fn with_bricks(
        mut self,
        bricks: impl Into<Arc<Bricks>>,
        kernel: Kernel,
        transfer: TransferFunction,
    ) -> Self {
        self.items.push(Item::Bricks(bricks.into(), kernel, transfer));
        self
    }

    /// Returns the same scene with another transfer function for the field of an item.
    ///
    /// # Errors
    /// [`Error::Argument`] if the scene has no such field; [`Error::Transfer`] if
    /// [`validate`](Self::validate) would refuse the function.
    pub fn with_transfer(&self, number: usize, transfer: &TransferFunction) -> Result<Self> {
        let mut scene = self.clone();
        let Some(item) = scene.items.get_mut(number) else { return Err(poses::no_item(number)) };
        let Some(function) = item.transfer_mut() else {
            return Err(Error::Argument(format!(
                "item {number} of the scene has colours of its own, and no transfer function"
            )));
        };
        function.clone_from(transfer);
        if let Item::Volume(volume, _, function) = item
            && volume.is_label_map()
        {
            *function = transfer.over_labels(volume);
        }
        numbers::check_field(item).map_err(numbers::of_item(number))?;
        Ok(scene)
    }

    /// Returns the numbers of the items that have a field, in their order: volumes, sample sets and
    /// cells.
    pub fn fields(&self) -> Vec<usize> {
        let has_field = |number: &usize| self.items[*number].transfer().is_some();
        (0..self.items.len()).filter(has_field).collect()
    }

    /// Returns whether the file of an item comes in parts, and some were missed since the picture
    /// began.
    pub(crate) fn lacks(&self) -> bool {
        self.items.iter().any(|item| match item {
            Item::Hierarchy(hierarchy) => hierarchy.lacks(),
            Item::Bricks(bricks, ..) => bricks.lacks(),
            _ => false,
        })
    }

    /// Returns the scene without its fields, except that of item `number`.
    pub(crate) fn with_one_field(&self, number: usize) -> Self {
        self.filtered(|index| index == number || self.items[index].transfer().is_none())
    }

    /// Returns the kernel of the scene's first volume of tensor products: the function along each
    /// axis of the lattice.
    pub fn tensor(&self) -> Option<Tensor> {
        self.items.iter().find_map(|item| item.kernel()?.as_tensor())
    }

    /// Returns what of the scene only the CPU engine draws (“the kernel linear”, “cells”, “several
    /// volumes in bricks”); `None` if the GPU engine draws all of it.
    pub fn beyond_gpu(&self) -> Option<String> {
        if let Some(tensor) = self.tensor() {
            return Some(format!("the kernel {}", tensor.name()));
        }
        if self.fields().len() > 1 && self.items.iter().any(Item::is_label_map) {
            return Some("a label map beside another field".into());
        }
        if self.items.iter().any(|item| matches!(item, Item::Cells(..))) {
            return Some("cells".into());
        }
        let bricks = self.items.iter().filter(|item| matches!(item, Item::Bricks(..)));
        (bricks.count() > 1).then(|| "several volumes in bricks".into())
    }

    /// Returns the box around everything that can be seen, footprints included.
    pub fn bounds(&self) -> Bounds {
        let bounds = (0..self.items.len()).map(|number| self.bounds_of(number));
        bounds.fold(Bounds::EMPTY, Bounds::union)
    }

    /// Whether the scene contains explicit splats (surfaces or scattered samples). These are
    /// widened by [`FOOTPRINT_BLUR`](crate::splat::FOOTPRINT_BLUR) and have edges.
    pub fn has_splats(&self) -> bool {
        let is_of_splats =
            |item: &Item| item.lattice().is_none() && !matches!(item, Item::Cells(..));
        self.items.iter().any(is_of_splats)
    }

    /// Returns the largest channel of a colour in the scene: 1, but trained Gaussians are brighter
    /// where their trainer made them so.
    pub(crate) fn brightest(&self) -> f32 {
        if self.items.iter().any(Item::is_trained) { BRIGHTEST_TRAINED } else { 1.0 }
    }

    /// Whether a picture shows trained Gaussians alone, each as a whole at the depth of its centre
    /// along the view's axis, as in the training. Beside other items, and in a part of a picture,
    /// their optical depth is spread along the rays instead, where they meet those.
    pub(crate) fn is_by_centers(&self, settings: &Settings) -> bool {
        let is_whole = settings.mode == Mode::Sheets && settings.region.is_none();
        is_whole && !self.items.is_empty() && self.items.iter().all(Item::is_trained)
    }

    /// Whether any part can become opaque enough to hide what lies behind it. Surfaces can. A field
    /// can if it has isosurfaces, or if a line through its box can absorb nearly all light.
    pub(crate) fn can_hide(&self) -> bool {
        const OPTICAL_DEPTH: f64 = 7.0;
        self.items.iter().any(|item| {
            let Some(transfer) = item.transfer() else { return true };
            !transfer.isosurfaces.is_empty()
                || transfer.most_extinction() * item.bounds().diagonal() > OPTICAL_DEPTH
        })
    }
}

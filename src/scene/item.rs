//! The items of a scene.

use super::{Settings, numbers};
use crate::{
    Result,
    bricks::Bricks,
    cells::{Solid, Tetrahedra},
    facet::FacetSet,
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    math::{Bounds, Kernel},
    splat::{SampleSplats, Splats, Surfels},
    volume::{Lattice, Shade, TransferFunction, Volume},
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// An item of a scene.
#[derive(Debug, Clone)]
pub enum Item {
    /// Surfels or 3D Gaussians: splats that carry their own colour and optical depth.
    Radiance(Arc<Surfels>),
    /// Facets: splats whose footprint is a triangle.
    Facets(Arc<FacetSet>),
    /// A trained scene of 3D Gaussians, whose colours depend on the view.
    Gaussians(Arc<Gaussians>),
    /// A hierarchy of surfels. A picture shows a cut of it
    /// ([`Settings::detail`](super::Settings::detail)).
    Hierarchy(Arc<Hierarchy>),
    /// Scattered samples: splats that carry a value, shown by a transfer function.
    Scalar(Arc<SampleSplats>, TransferFunction),
    /// Samples on a lattice, each the centre of one kernel, shown by a transfer function.
    Volume(Arc<Volume>, Kernel, TransferFunction),
    /// A volume that may be larger than memory. A picture shows the bricks that it needs
    /// ([`Settings::detail`](super::Settings::detail),
    /// [`Controls::page_memory`](super::Controls::page_memory)).
    Bricks(Arc<Bricks>, Kernel, TransferFunction),
    /// Tetrahedra with a linear field inside, shown by a transfer function.
    Cells(Arc<Tetrahedra>, TransferFunction),
    /// Cells as a solid body: facets of their boundary, and of the faces where clips cut them.
    Solid(Arc<Solid>),
}

impl Item {
    /// Checks that the item can be drawn by itself, as [`Scene::validate`](super::Scene::validate)
    /// does for all items.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for numbers that are not finite, or do not fit
    /// 32 bits.
    pub fn validate(&self) -> Result<()> {
        numbers::check_item(self)
    }

    /// Returns the transfer function that shows the item's field; `None` for splats that carry
    /// their own colour.
    pub fn transfer(&self) -> Option<&TransferFunction> {
        match self {
            Self::Scalar(_, transfer)
            | Self::Volume(_, _, transfer)
            | Self::Bricks(_, _, transfer)
            | Self::Cells(_, transfer) => Some(transfer),
            Self::Radiance(_)
            | Self::Facets(_)
            | Self::Solid(_)
            | Self::Gaussians(_)
            | Self::Hierarchy(_) => None,
        }
    }

    /// Like [`transfer`](Self::transfer), to be changed.
    pub(super) fn transfer_mut(&mut self) -> Option<&mut TransferFunction> {
        match self {
            Self::Scalar(_, transfer)
            | Self::Volume(_, _, transfer)
            | Self::Bricks(_, _, transfer)
            | Self::Cells(_, transfer) => Some(transfer),
            Self::Radiance(_)
            | Self::Facets(_)
            | Self::Solid(_)
            | Self::Gaussians(_)
            | Self::Hierarchy(_) => None,
        }
    }

    /// Returns whether the item consists of trained Gaussians.
    pub fn is_trained(&self) -> bool {
        match self {
            Self::Gaussians(_) => true,
            Self::Hierarchy(hierarchy) => hierarchy.header().degree.is_some(),
            _ => false,
        }
    }

    /// Returns the item's explicit splats, if it has any that do not depend on the view.
    pub(crate) fn splats(&self) -> Option<Splats> {
        match self {
            Self::Radiance(set) => Some(Splats::Surfels(set.clone())),
            Self::Scalar(set, _) => Some(Splats::Samples(set.clone())),
            Self::Facets(_)
            | Self::Solid(_)
            | Self::Gaussians(_)
            | Self::Hierarchy(_)
            | Self::Volume(..)
            | Self::Bricks(..)
            | Self::Cells(..) => None,
        }
    }

    /// Returns the kernel of the samples of a lattice; `None` for splats.
    pub fn kernel(&self) -> Option<&Kernel> {
        match self {
            Self::Volume(_, kernel, _) | Self::Bricks(_, kernel, _) => Some(kernel),
            Self::Radiance(_)
            | Self::Facets(_)
            | Self::Solid(_)
            | Self::Gaussians(_)
            | Self::Hierarchy(_)
            | Self::Scalar(..)
            | Self::Cells(..) => None,
        }
    }

    /// Returns the lattice of the samples, at the finest level of bricks; `None` for splats.
    pub fn lattice(&self) -> Option<&Lattice> {
        match self {
            Self::Volume(volume, ..) => Some(&volume.lattice),
            Self::Bricks(bricks, ..) => Some(&bricks.header().lattice),
            Self::Radiance(_)
            | Self::Facets(_)
            | Self::Solid(_)
            | Self::Gaussians(_)
            | Self::Hierarchy(_)
            | Self::Scalar(..)
            | Self::Cells(..) => None,
        }
    }

    /// Returns whether the item is a volume whose values are drawn as labels
    /// ([`Volume::is_label_map`]).
    pub fn is_label_map(&self) -> bool {
        matches!(self, Self::Volume(volume, ..) if volume.is_label_map())
    }

    /// Returns the smallest and largest value of the item's field; `None` for splats that carry
    /// their own colour. Scattered samples are searched for it.
    pub fn value_range(&self) -> Option<[f64; 2]> {
        match self {
            Self::Scalar(set, _) => Some(set.value_range()),
            Self::Volume(volume, ..) => Some(volume.range),
            Self::Bricks(bricks, ..) => Some(bricks.header().range),
            Self::Cells(cells, _) => Some(cells.range()),
            Self::Radiance(_)
            | Self::Facets(_)
            | Self::Solid(_)
            | Self::Gaussians(_)
            | Self::Hierarchy(_) => None,
        }
    }

    /// Returns how the item's field is lit. `None` if the field is not lit, or the item has no
    /// field. Scattered samples are searched for their range and bounds.
    pub(crate) fn light(&self, settings: &Settings) -> Option<Shade> {
        let (transfer, range) = (self.transfer()?, self.value_range()?);
        settings.light_of(transfer, range, self.field_diagonal())
    }

    /// Returns the length of the diagonal of the box around the field's samples. Scattered samples
    /// are searched for it.
    pub(crate) fn field_diagonal(&self) -> f64 {
        self.lattice().map_or_else(|| self.bounds(), Lattice::bounds).diagonal()
    }

    /// Returns the box around the item, footprints included.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Radiance(set) => set.bounds(),
            Self::Scalar(set, _) => set.bounds(),
            Self::Facets(set) => set.bounds(),
            Self::Solid(solid) => solid.bounds(),
            Self::Gaussians(set) => set.bounds(),
            Self::Hierarchy(hierarchy) => hierarchy.bounds(),
            Self::Cells(cells, _) => cells.bounds(),
            Self::Volume(volume, kernel, _) => reached(&volume.lattice, kernel),
            // Kernels of coarser levels reach further, but nothing is drawn outside the field's
            // box.
            Self::Bricks(bricks, kernel, _) => reached(&bricks.header().lattice, kernel),
        }
    }
}

/// Returns the box that the kernels of a lattice reach.
fn reached(lattice: &Lattice, kernel: &Kernel) -> Bounds {
    let axes = lattice.axes * DMat3::from_diagonal(lattice.largest_unit());
    let reach = kernel.extent
        * DVec3::new(axes.row(0).length(), axes.row(1).length(), axes.row(2).length());
    lattice.bounds().widened(reach)
}

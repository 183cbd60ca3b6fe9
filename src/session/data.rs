//! What an input holds, of any kind.

use crate::{
    Result,
    bricks::Bricks,
    cells::{Cells, Tint},
    formats::Kind,
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    math::Bounds,
    scattered::Points,
    surface::Mesh,
    volume::Volume,
    warning,
};
use std::sync::Arc;

/// The content of an input.
pub enum Data {
    /// A mesh or a point cloud.
    Mesh(Mesh),
    /// Samples on a lattice.
    Volume(Volume),
    /// Samples anywhere.
    Samples(Points),
    /// Cells of a solver.
    Cells(Cells),
    /// Trained 3D Gaussians.
    Gaussians(Gaussians),
    /// A hierarchy of splats, of which pages are read as a picture needs them.
    Hierarchy(Arc<Hierarchy>),
    /// A volume in bricks, which are read as a picture needs them.
    Bricks(Arc<Bricks>),
}

impl Data {
    /// Returns which of the kinds this is.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Mesh(_) => Kind::Mesh,
            Self::Volume(_) => Kind::Volume,
            Self::Samples(_) => Kind::Samples,
            Self::Cells(_) => Kind::Cells,
            Self::Gaussians(_) => Kind::Gaussians,
            Self::Hierarchy(_) => Kind::Hierarchy,
            Self::Bricks(_) => Kind::Bricks,
        }
    }

    /// Returns the boundary as a mesh for cells without values, which say no more; everything else
    /// as it is.
    ///
    /// # Errors
    /// Those of [`Cells::surface`].
    pub fn with_surface_of_bare_cells(self) -> Result<Self> {
        match self {
            Self::Cells(cells) if cells.values.is_empty() => {
                let mut mesh = cells.surface(Tint::Plain([1.0; 3]))?;
                mesh.colors.clear();
                mesh.about = cells.about;
                Ok(Self::Mesh(mesh))
            }
            other => Ok(other),
        }
    }

    /// Returns the number of points, samples, values of cells or Gaussians. A hierarchy counts the
    /// points that it was made from.
    pub fn count(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.positions.len(),
            Self::Volume(volume) => volume.len(),
            Self::Samples(points) => points.len(),
            Self::Cells(cells) => cells.len(),
            Self::Gaussians(set) => set.len(),
            Self::Hierarchy(hierarchy) => hierarchy.header().source_points as usize,
            Self::Bricks(bricks) => bricks.header().lattice.len(),
        }
    }

    /// Returns the box around everything, in world units; `None` for a mesh without points.
    pub fn bounds(&self) -> Option<Bounds> {
        Some(match self {
            Self::Mesh(mesh) => mesh.bounds()?,
            Self::Volume(volume) => volume.bounds(),
            Self::Samples(points) => points.bounds(),
            Self::Cells(cells) => cells.bounds(),
            Self::Gaussians(set) => set.bounds(),
            Self::Hierarchy(hierarchy) => hierarchy.header().bounds,
            Self::Bricks(bricks) => bricks.bounds(),
        })
    }

    /// Returns how many values are missing.
    pub fn holes(&self) -> u64 {
        match self {
            Self::Mesh(mesh) => mesh.about.holes,
            Self::Volume(volume) => volume.about.holes,
            Self::Samples(points) => points.about.holes,
            Self::Cells(cells) => cells.about.holes,
            // Their readers have said how many are left out.
            Self::Gaussians(_) | Self::Hierarchy(_) | Self::Bricks(_) => 0,
        }
    }

    /// Warns of missing values, and says what was done about them. `name` is the input's.
    pub fn warn_of_holes(&self, name: &str) {
        let holes = self.holes();
        let (all, done) = match self {
            Self::Samples(points) => (points.len() as u64 + holes, "left out"),
            Self::Cells(cells) => {
                (cells.values.len() as u64, "nothing is drawn in the cells around them")
            }
            Self::Mesh(mesh) => (mesh.values.len() as u64, "drawn without a colour"),
            _ => (self.count() as u64, "read as the lowest value"),
        };
        warn_of_holes(name, holes, all, done);
    }
}

/// Warns if an input lacks `holes` of `all` values, and says what was `done` about them.
pub fn warn_of_holes(name: &str, holes: u64, all: u64, done: &str) {
    if holes > 0 {
        let (holes, all) = (grouped(holes), grouped(all));
        warning::give!("{name}: {holes} of {all} values missing: {done}");
    }
}

/// Formats a count in groups of three digits: 1,234,567.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let groups: Vec<&[u8]> = digits.as_bytes().rchunks(3).rev().collect();
    groups.into_iter().map(String::from_utf8_lossy).collect::<Vec<_>>().join(",")
}

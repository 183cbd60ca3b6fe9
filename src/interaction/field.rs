//! The field of a volume at single positions, on every lattice.

use crate::{
    Error, Result,
    math::Kernel,
    volume::{Arrangement, Reconstruction, Volume},
};
use glam::{DMat3, DVec3};

/// The field between the samples of a volume.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    volume: &'a Volume,
    kind: Kind<'a>,
}

#[derive(Debug, Clone)]
enum Kind<'a> {
    /// As the kernel's splats draw it.
    Kernel(Reconstruction<'a>),
    /// Linear between the samples of a rectilinear lattice, whose kernels have no common shape.
    /// With the map from world positions to steps.
    Linear(DMat3, &'a [Vec<f64>; 3]),
    /// The label of the nearest sample. With the map from world positions to steps.
    Nearest(DMat3),
}

impl<'a> Field<'a> {
    /// Prepares a volume, whose samples are not looked at.
    ///
    /// # Errors
    /// Those of [`check`] and of [`Reconstruction::new`], but rectilinear lattices are accepted.
    pub fn new(volume: &'a Volume, kernel: &'a Kernel) -> Result<Self> {
        check(volume)?;
        let kind = match &volume.lattice.arrangement {
            _ if volume.is_label_map() => Kind::Nearest(volume.lattice.axes.inverse()),
            Arrangement::Rectilinear(places) => Kind::Linear(volume.lattice.axes.inverse(), places),
            _ => Kind::Kernel(Reconstruction::of_checked(volume, kernel)?),
        };
        Ok(Self { volume, kind })
    }

    /// Returns the value at a world position, or `None` outside the field.
    pub fn value_at(&self, position: DVec3) -> Option<f64> {
        match &self.kind {
            Kind::Kernel(reconstruction) => reconstruction.value_at(position),
            Kind::Linear(inverse, places) => {
                self.linear_at(*inverse * (position - self.volume.lattice.origin), places)
            }
            Kind::Nearest(inverse) => {
                self.nearest_to(*inverse * (position - self.volume.lattice.origin))
            }
        }
    }

    /// Returns the sample nearest to a position in steps.
    fn nearest_to(&self, steps: DVec3) -> Option<f64> {
        let dims = self.volume.lattice.dims;
        let mut index = [0; 3];
        for (axis, coordinate) in index.iter_mut().enumerate() {
            let nearest = (steps[axis] + 0.5).floor();
            *coordinate =
                (0.0..dims[axis] as f64).contains(&nearest).then_some(nearest as usize)?;
        }
        Some(self.volume.value(index[0] + dims[0] * (index[1] + dims[1] * index[2])))
    }

    /// Interpolates between the eight samples around a position in steps.
    fn linear_at(&self, steps: DVec3, places: &[Vec<f64>; 3]) -> Option<f64> {
        let mut ends = [([0; 2], 0.0); 3];
        for axis in 0..3 {
            ends[axis] = between(&places[axis], steps[axis])?;
        }
        let [nx, ny, _] = self.volume.lattice.dims;
        let corner = |corner: usize| {
            let sides: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let index: [usize; 3] = std::array::from_fn(|axis| ends[axis].0[sides[axis]]);
            let share = |axis: usize| {
                if sides[axis] == 1 { ends[axis].1 } else { 1.0 - ends[axis].1 }
            };
            let weight = share(0) * share(1) * share(2);
            weight * self.volume.value(index[0] + nx * (index[1] + ny * index[2]))
        };
        Some((0..8).map(corner).sum())
    }
}

/// Checks what can be checked at once of a volume that may have been built by hand.
///
/// # Errors
/// [`Error::Argument`] for an invalid lattice and for samples that do not fill it.
pub fn check(volume: &Volume) -> Result<()> {
    volume.lattice.validate()?;
    let drawn = volume.coefficients.as_ref().map(|drawn| (drawn.values.len(), drawn.lattice.len()));
    for (count, expected) in [(volume.len(), volume.lattice.len())].into_iter().chain(drawn) {
        if count != expected {
            let message = format!("{count} samples do not fill a lattice of {expected}");
            return Err(Error::Argument(message));
        }
    }
    Ok(())
}

/// Returns the indices before and after a place, and where it lies between them (0 … 1). Places
/// outside by less than rounding count as the ends; the only place of an axis reaches half a unit.
fn between(places: &[f64], place: f64) -> Option<([usize; 2], f64)> {
    let (first, last) = (*places.first()?, *places.last()?);
    let margin = if last > first { 1e-9 * (last - first) } else { 0.5 };
    if !(first - margin..=last + margin).contains(&place) {
        return None;
    }
    let after = places.partition_point(|other| *other <= place).min(places.len() - 1);
    let before = after.saturating_sub(1);
    let width = places[after] - places[before];
    let share = if width > 0.0 { (place - places[before]) / width } else { 0.0 };
    Some(([before, after], share.clamp(0.0, 1.0)))
}

//! Where the samples of a volume lie.

use glam::{DMat3, DVec3};

/// Where the samples of a volume lie: sample (i, j, k) is at `origin + axes · (i, j, k)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Samples along each axis, first axis fastest in memory.
    pub dims: [usize; 3],
    /// World position of sample (0, 0, 0).
    pub origin: DVec3,
    /// Columns are the steps between neighbouring samples (spacing times direction), in world units.
    pub axes: DMat3,
}

impl Lattice {
    /// Samples `spacing` world units apart along x, y and z, the first one at the world's origin.
    pub fn with_spacing(dims: [usize; 3], spacing: DVec3) -> Self {
        Self { dims, origin: DVec3::ZERO, axes: DMat3::from_diagonal(spacing) }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// World position of a (fractional) index.
    pub fn position(&self, index: DVec3) -> DVec3 {
        self.origin + self.axes * index
    }

    /// Length of the step along each axis, in world units.
    pub fn spacing(&self) -> DVec3 {
        DVec3::from_array(self.axes.to_cols_array_2d().map(|axis| DVec3::from_array(axis).length()))
    }

    /// Smallest and largest world coordinates of the sample positions. Kernels reach further.
    pub fn bounds(&self) -> [DVec3; 2] {
        let last = DVec3::from_array(self.dims.map(|n| n.saturating_sub(1) as f64));
        let corners = (0..8).map(|corner| {
            let at_end = DVec3::new(f64::from(corner & 1), f64::from(corner >> 1 & 1), f64::from(corner >> 2));
            self.position(last * at_end)
        });
        corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
    }

    /// Says in words why samples cannot lie so: no samples, more than memory could index, or steps that are not finite
    /// or do not span space.
    pub fn validate(&self) -> Result<(), String> {
        let [nx, ny, nz] = self.dims;
        if self.dims.contains(&0) {
            return Err(format!("a volume of {nx} × {ny} × {nz} samples holds none"));
        }
        if nx.checked_mul(ny).and_then(|n| n.checked_mul(nz)).is_none() {
            return Err(format!("{nx} × {ny} × {nz} samples are more than memory can hold"));
        }
        if !self.origin.is_finite() || !self.axes.is_finite() {
            return Err("the origin and the steps between samples must be finite".into());
        }
        // The determinant of the directions, not of the steps: its size does not depend on the unit of length.
        let spacing = self.spacing();
        let directions =
            DMat3::from_cols(self.axes.x_axis / spacing.x, self.axes.y_axis / spacing.y, self.axes.z_axis / spacing.z);
        if spacing.min_element() <= 0.0 {
            return Err(format!(
                "the spacing is {} × {} × {}, but every step needs a length",
                spacing.x, spacing.y, spacing.z
            ));
        }
        if directions.determinant().abs() < 1e-6 {
            return Err("the directions of the axes lie in one plane".into());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_take_all_corners() {
        let lattice = Lattice {
            dims: [3, 2, 1],
            origin: DVec3::new(10.0, 0.0, 0.0),
            axes: DMat3::from_cols(DVec3::new(0.0, 1.0, 0.0), DVec3::new(-2.0, 0.5, 0.0), DVec3::Z),
        };
        assert_eq!(lattice.bounds(), [DVec3::new(8.0, 0.0, 0.0), DVec3::new(10.0, 2.5, 0.0)]);
        assert_eq!(lattice.spacing(), DVec3::new(1.0, 4.25f64.sqrt(), 1.0));
        lattice.validate().unwrap();
    }

    #[test]
    fn impossible_lattices_are_told() {
        let good = Lattice::with_spacing([2, 2, 2], DVec3::splat(1e-9));
        good.validate().unwrap();
        let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y);
        for (bad, word) in [
            (Lattice { dims: [2, 0, 2], ..good.clone() }, "none"),
            (Lattice { dims: [usize::MAX, 2, 2], ..good.clone() }, "memory"),
            (Lattice { origin: DVec3::NAN, ..good.clone() }, "finite"),
            (Lattice::with_spacing([2, 2, 2], DVec3::new(1.0, 0.0, 1.0)), "spacing"),
            (Lattice { axes: flat, ..good.clone() }, "plane"),
        ] {
            assert!(bad.validate().unwrap_err().contains(word), "{bad:?}");
        }
    }
}

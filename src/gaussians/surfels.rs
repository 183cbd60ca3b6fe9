//! Surfels as Gaussians, for viewers that draw trained scenes.

use super::{Gaussians, harmonics::constant_of, shape_of};
use crate::{
    Result, memory,
    parallel::prelude::*,
    splat::{Splat, Surfels},
};
use glam::{DMat3, DVec3, Quat, Vec3};

impl Gaussians {
    /// Returns surfels as Gaussians that cover as much along a ray through their centres. Their
    /// colours are the same in all directions: the shading of the splats is lost, and so is the
    /// extent of their footprints.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory) if the Gaussians do not fit in memory.
    pub fn from_splats(set: &Surfels) -> Result<Self> {
        // One more list of shapes until they are in lists of their own.
        const OF_ONE: usize = 2 * size_of::<(Vec3, Quat)>() + size_of::<(Vec3, [f32; 3], f32)>();
        memory::room("making Gaussians of splats", (OF_ONE * set.splats.len()) as u64)?;
        let shapes: Vec<(Vec3, Quat)> = set.splats.par_iter().map(shape).collect();
        let (scales, rotations) = shapes.into_iter().unzip();
        Ok(Self {
            origin: set.origin,
            centers: set.splats.par_iter().map(|splat| Vec3::from(splat.center)).collect(),
            scales,
            rotations,
            opacities: set.splats.par_iter().map(opacity).collect(),
            degree: 0,
            harmonics: set.splats.par_iter().map(color).collect(),
            ..Self::default()
        })
    }
}

/// Returns the deviations and the axes of a splat.
fn shape(splat: &Splat) -> (Vec3, Quat) {
    let b = factor(splat);
    shape_of(b * b.transpose())
}

/// Returns the factor B of the covariance.
fn factor(splat: &Splat) -> DMat3 {
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    DMat3::from_cols(
        DVec3::new(b00, b10, b20),
        DVec3::new(0.0, b11, b21),
        DVec3::new(0.0, 0.0, b22),
    )
}

/// Returns what a splat covers along a ray through its centre.
fn opacity(splat: &Splat) -> f32 {
    let depth = f64::from(splat.strength) * f64::from(splat.color >> 24) / 255.0;
    (-(-depth).exp_m1()).clamp(0.0, 1.0) as f32
}

fn color(splat: &Splat) -> [f32; 3] {
    [0, 8, 16].map(|shift| constant_of((splat.color >> shift & 255) as f32 / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{gaussians::harmonics, surface::Mesh};

    #[test]
    fn gaussians_are_the_splats() {
        let set = Mesh::sphere(2).surfels(&Default::default()).unwrap();
        let gaussians = Gaussians::from_splats(&set).unwrap();
        assert_eq!((gaussians.len(), gaussians.validate()), (set.splats.len(), Ok(())));
        assert_eq!(
            (gaussians.origin, gaussians.degree, gaussians.broken.all()),
            (set.origin, 0, 0)
        );
        for (index, splat) in set.splats.iter().enumerate() {
            assert_eq!(gaussians.centers[index].to_array(), splat.center);
            let depth = f64::from(splat.strength) * f64::from(splat.color >> 24) / 255.0;
            let opacity = f64::from(gaussians.opacities[index]);
            assert!((opacity - (1.0 - (-depth).exp())).abs() < 1e-6);
            let [red, ..] = harmonics::color(0, gaussians.harmonics_of(index), Vec3::Z);
            assert!((red - (splat.color & 255) as f32 / 255.0).abs() < 1e-6);
            // R · diag(σ²) · Rᵀ is B · Bᵀ.
            let axes = gaussians.axes(index).as_dmat3();
            let wanted = factor(splat) * factor(splat).transpose();
            let miss = axes * axes.transpose() - wanted;
            let miss = miss.to_cols_array().iter().map(|v| v.abs()).fold(0.0, f64::max);
            let largest = f64::from(gaussians.scales[index].max_element());
            assert!(miss < 1e-5 * largest * largest, "{miss}");
        }
    }
}

//! Gaussians as an eye sees them: splats whose colours are those of their directions.

use super::{Gaussians, harmonics};
use crate::{
    math::View,
    parallel::prelude::*,
    splat::{Splat, TrainedSplats, encode_trained_color},
};
use glam::{DMat3, DVec3, Vec3};

/// Footprints end this many standard deviations from the centre: there a Gaussian covers less than
/// 1/255 of a pixel, whatever its opacity, and is not drawn. √(2·ln 255) and a little more.
pub const EXTENT: f32 = 3.34;

/// Where a scene is seen from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Eye {
    /// From this world position.
    At(DVec3),
    /// Along this direction of the world, of unit length, from infinitely far away.
    Along(DVec3),
}

impl Eye {
    /// Returns the eye of a view.
    pub fn of(view: &View) -> Self {
        if view.perspective {
            Self::At(view.position)
        } else {
            Self::Along(view.rotation.transpose() * DVec3::Z)
        }
    }

    /// Returns the direction in which a place is seen, of unit length; zero at the eye itself.
    pub(crate) fn toward(self, place: DVec3) -> Vec3 {
        match self {
            Self::At(position) => (place - position).normalize_or_zero().as_vec3(),
            Self::Along(direction) => direction.as_vec3(),
        }
    }
}

impl Gaussians {
    /// Returns the splats that an eye sees, in the order of the Gaussians.
    pub fn seen_from(&self, eye: Eye) -> TrainedSplats {
        let splat = |index: usize| {
            let [color, normal] = self.color(index, eye);
            Splat {
                center: self.centers[index].to_array(),
                strength: -self.opacities[index],
                factor: lower(self.axes(index).as_dmat3()),
                color,
                normal,
            }
        };
        TrainedSplats {
            origin: self.origin,
            splats: (0..self.len()).into_par_iter().map(splat).collect(),
            extent: EXTENT,
        }
    }

    /// Gives the splats of [`seen_from`](Self::seen_from) the colours for another eye.
    pub(crate) fn recolor(&self, eye: Eye, splats: &mut [Splat]) {
        splats.par_iter_mut().enumerate().for_each(|(index, splat)| {
            [splat.color, splat.normal] = self.color(index, eye);
        });
    }

    /// Returns whether colours depend on the eye.
    pub fn depends_on_eye(&self) -> bool {
        self.degree > 0
    }

    /// Returns the colour of one Gaussian as its splat stores it, in `color` and `normal`.
    pub(crate) fn color(&self, index: usize, eye: Eye) -> [u32; 2] {
        let place = self.origin + self.centers[index].as_dvec3();
        let direction = eye.toward(place);
        encode_trained_color(harmonics::color(self.degree, self.harmonics_of(index), direction))
    }
}

/// Returns the lower triangular B, row by row, with B·Bᵀ = M·Mᵀ. A flat Gaussian has zeros in it.
fn lower(axes: DMat3) -> [f32; 6] {
    let s = axes * axes.transpose();
    let root = |square: f64| square.max(0.0).sqrt();
    let part = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
    let b00 = root(s.x_axis.x);
    let (b10, b20) = (part(s.x_axis.y, b00), part(s.x_axis.z, b00));
    let b11 = root(s.y_axis.y - b10 * b10);
    let b21 = part(s.y_axis.z - b10 * b20, b11);
    let b22 = root(s.z_axis.z - b20 * b20 - b21 * b21);
    [b00, b10, b11, b20, b21, b22].map(|b| b as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splat::decode_trained_color;
    use glam::{Quat, Vec3};

    fn scene() -> Gaussians {
        let mut harmonics = vec![[0.0; 3]; 8];
        // The second Gaussian is redder from −x than from +x: the third term of degree 1 is −x.
        harmonics[4 + 3] = [-0.5, 0.0, 0.0];
        Gaussians {
            origin: DVec3::new(100.0, 0.0, 0.0),
            centers: vec![Vec3::ZERO, Vec3::Y],
            scales: vec![Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.2, 0.1, 0.0)],
            rotations: vec![Quat::from_rotation_z(0.5), Quat::from_rotation_x(1.2)],
            opacities: vec![0.5, 1.0],
            degree: 1,
            harmonics,
            ..Gaussians::default()
        }
    }

    #[test]
    fn splats_have_the_covariance_of_their_gaussians() {
        let scene = scene();
        let set = scene.seen_from(Eye::Along(DVec3::Z));
        for (index, splat) in set.splats.iter().enumerate() {
            let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
            let b = DMat3::from_cols(
                DVec3::new(b00, b10, b20),
                DVec3::new(0.0, b11, b21),
                DVec3::new(0.0, 0.0, b22),
            );
            let axes = scene.axes(index).as_dmat3();
            let miss = b * b.transpose() - axes * axes.transpose();
            let miss = miss.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
            assert!(miss < 1e-7, "{miss}");
            assert_eq!(splat.strength, -scene.opacities[index]);
        }
    }

    #[test]
    fn colours_follow_the_eye() {
        let scene = scene();
        let red = |set: &TrainedSplats| decode_trained_color(&set.splats[1])[0];
        let place = DVec3::new(100.0, 1.0, 0.0);
        let mut set = scene.seen_from(Eye::At(place - DVec3::X));
        assert!((red(&set) - (0.5 + 0.488_602_5 * 0.5)).abs() < 1e-4, "{}", red(&set));
        scene.recolor(Eye::At(place + DVec3::X), &mut set.splats);
        assert!((red(&set) - (0.5 - 0.488_602_5 * 0.5)).abs() < 1e-4, "{}", red(&set));
        // An eye at the centre sees no direction, but a colour.
        scene.recolor(Eye::At(place), &mut set.splats);
        assert!((red(&set) - 0.5).abs() < 1e-4);
    }
}

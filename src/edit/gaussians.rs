//! Trained Gaussians.

use super::{Editable, Motion, find, reduce, retain, thin::Thin};
use crate::{
    Result,
    gaussians::{
        Gaussians,
        harmonics::{CONSTANT, terms},
        shape_of, turn,
    },
    parallel::prelude::*,
};
use glam::{DQuat, DVec3, Quat, Vec3};

/// The names of the values of a Gaussian.
const NAMES: [&str; 8] =
    ["opacity", "scale", "scale_x", "scale_y", "scale_z", "red", "green", "blue"];

impl Editable for Gaussians {
    fn count(&self) -> usize {
        self.len()
    }

    fn place(&self, index: usize) -> DVec3 {
        self.origin + self.centers[index].as_dvec3()
    }

    fn names(&self) -> Vec<String> {
        NAMES.map(str::to_owned).to_vec()
    }

    /// Scales are deviations in world units; `scale` is the largest one. Colours are those of the
    /// constant term, from 0 to 255.
    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let at = find(NAMES.into_iter(), name)?;
        let value = |index: usize| match at {
            0 => self.opacities[index],
            1 => self.scales[index].max_element(),
            2..5 => self.scales[index][at - 2],
            _ => 255.0 * (0.5 + CONSTANT * self.harmonics_of(index)[0][at - 5]),
        };
        Some((0..self.len()).map(|index| f64::from(value(index))).collect())
    }

    fn keep(&mut self, kept: &[bool]) {
        retain(&mut self.centers, kept, 1);
        retain(&mut self.scales, kept, 1);
        retain(&mut self.rotations, kept, 1);
        retain(&mut self.opacities, kept, 1);
        retain(&mut self.harmonics, kept, terms(self.degree));
    }

    fn move_by(&mut self, motion: &Motion) {
        let linear = motion.linear();
        self.origin = motion.place(self.origin);
        self.centers.par_iter_mut().for_each(|center| {
            *center = (linear * center.as_dvec3()).as_vec3();
        });
        match motion.similarity() {
            Some((scale, rotation)) if rotation.determinant() > 0.0 => {
                let quat = DQuat::from_mat3(&rotation);
                self.scales.par_iter_mut().for_each(|scales| *scales *= scale as f32);
                self.rotations.par_iter_mut().for_each(|rotation| {
                    *rotation = (quat * rotation.as_dquat()).normalize().as_quat();
                });
            }
            _ => {
                let shapes: Vec<(Vec3, Quat)> = (0..self.len())
                    .into_par_iter()
                    .map(|index| {
                        let axes = linear * self.axes(index).as_dmat3();
                        shape_of(axes * axes.transpose())
                    })
                    .collect();
                (self.scales, self.rotations) = shapes.into_iter().unzip();
            }
        }
        let colors = turn::turn(self.degree, motion.turn());
        let terms = terms(self.degree);
        self.harmonics.par_chunks_mut(terms).for_each(|harmonics| colors.apply(harmonics));
    }

    fn reach(&self, index: usize) -> f32 {
        self.scales[index].max_element()
    }

    fn thin(&mut self, thin: &Thin) -> Result<()> {
        reduce::thin(self, thin)
    }
}

//! The splats of a hierarchy of surfaces.

use super::{Editable, Motion, find, merge, retain, thin::Thin};
use crate::{
    Result,
    math::lower,
    parallel::prelude::*,
    splat::{Splat, Surfels, decode_normal, encode_normal},
};
use glam::{DVec3, Vec3};

/// The names of the values of a splat.
const NAMES: [&str; 8] = ["opacity", "scale", "red", "green", "blue", "nx", "ny", "nz"];

/// Returns the columns of the factor of a splat's covariance.
fn columns(splat: &Splat) -> [DVec3; 3] {
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    [DVec3::new(b00, b10, b20), DVec3::new(0.0, b11, b21), DVec3::new(0.0, 0.0, b22)]
}

impl Editable for Surfels {
    fn count(&self) -> usize {
        self.splats.len()
    }

    fn place(&self, index: usize) -> DVec3 {
        self.origin + Vec3::from(self.splats[index].center).as_dvec3()
    }

    fn names(&self) -> Vec<String> {
        NAMES.map(str::to_owned).to_vec()
    }

    /// Colours are from 0 to 255. Splats without a normal have NaN.
    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let at = find(NAMES.into_iter(), name)?;
        let value = |splat: &Splat| match at {
            0 => {
                let depth = f64::from(splat.strength) * f64::from(splat.color >> 24) / 255.0;
                -(-depth).exp_m1()
            }
            1 => f64::from(reach(splat)),
            2..5 => f64::from(splat.color >> (8 * (at - 2)) & 255),
            _ => decode_normal(splat.normal).map_or(f64::NAN, |normal| f64::from(normal[at - 5])),
        };
        Some(self.splats.iter().map(value).collect())
    }

    fn keep(&mut self, kept: &[bool]) {
        retain(&mut self.splats, kept, 1);
    }

    fn move_by(&mut self, motion: &Motion) {
        let linear = motion.linear();
        self.origin = motion.place(self.origin);
        self.splats.par_iter_mut().for_each(|splat| {
            splat.center = (linear * Vec3::from(splat.center).as_dvec3()).as_vec3().to_array();
            splat.factor = lower(columns(splat).map(|column| linear * column));
            if let Some(normal) = decode_normal(splat.normal) {
                splat.normal = encode_normal(motion.normal(normal.as_dvec3()).as_vec3());
            }
        });
    }

    fn reach(&self, index: usize) -> f32 {
        reach(&self.splats[index])
    }

    fn thin(&mut self, thin: &Thin) -> Result<()> {
        *self = merge::splats(self, thin)?;
        Ok(())
    }
}

/// Returns about the largest deviation of a splat: the longest row of its factor.
fn reach(splat: &Splat) -> f32 {
    let [x, y, z] = columns(splat);
    let row = |axis: usize| x[axis] * x[axis] + y[axis] * y[axis] + z[axis] * z[axis];
    row(0).max(row(1)).max(row(2)).sqrt() as f32
}

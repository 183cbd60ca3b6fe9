//! The field of a label map: the label of the nearest sample, and the gradient of its smooth mask.

use super::{field::Layer, ray::Ray};
use crate::{
    math::View,
    plan::weighting::MASK_DEVIATION,
    volume::{Lattice, OWN_DEVIATION, OWN_REACH, Volume},
};
use glam::{DMat3, DVec3};

/// A label map, in view space.
pub(super) struct LabelMap<'a> {
    volume: &'a Volume,
    /// The map from view space to steps, and the place of the first sample in view space.
    to_steps: DMat3,
    origin: DVec3,
}

impl<'a> LabelMap<'a> {
    /// Returns the field of a volume, or `None` if its values are not labels.
    pub fn new(volume: &'a Volume, view: &View) -> Option<Self> {
        let Lattice { axes, origin, .. } = volume.lattice;
        let to_steps = (view.rotation * axes).inverse();
        volume.is_label_map().then(|| Self { volume, to_steps, origin: view.to_view(origin) })
    }

    fn value(&self, [i, j, k]: [usize; 3]) -> f64 {
        let [nx, ny, _] = self.volume.lattice.dims;
        self.volume.value((k * ny + j) * nx + i)
    }

    /// Returns the share of a sample's own label around it.
    fn own_share(&self, at: [usize; 3]) -> f64 {
        let around = [0, 1, 2].map(|axis| {
            let (at, count) = (at[axis], self.volume.lattice.dims[axis]);
            let inside = at.saturating_sub(OWN_REACH)..(at + OWN_REACH + 1).min(count);
            inside.map(move |other| {
                (other, (-0.5 * (other.abs_diff(at) as f64 / OWN_DEVIATION).powi(2)).exp())
            })
        });
        let label = self.value(at);
        let (mut sum, mut all) = (0.0, 0.0);
        for (k, wz) in around[2].clone() {
            for (j, wy) in around[1].clone() {
                for (i, wx) in around[0].clone() {
                    all += wx * wy * wz;
                    sum += if self.value([i, j, k]) == label { wx * wy * wz } else { 0.0 };
                }
            }
        }
        sum / all
    }

    /// Returns the label at a point of view space, and the gradient of its mask.
    fn at(&self, point: DVec3) -> (f64, DVec3) {
        let place = self.to_steps * (point - self.origin);
        let dims = self.volume.lattice.dims;
        let nearest =
            |axis: usize| (place[axis] + 0.5).floor().clamp(0.0, dims[axis] as f64 - 1.0) as usize;
        let label = self.value([0, 1, 2].map(nearest));
        let taps = [0, 1, 2].map(|axis| taps(place[axis], dims[axis]));
        // The mean of the mask, and its derivative by the quotient rule.
        let (mut sum, mut sums) = (0.0, DVec3::ZERO);
        for &(k, wz) in &taps[2] {
            for &(j, wy) in &taps[1] {
                for &(i, wx) in &taps[0] {
                    let share = self.own_share([i, j, k]);
                    let is_own = self.value([i, j, k]) == label;
                    let weight = wx * wy * wz * if is_own { share } else { 1.0 - share };
                    sum += weight;
                    sums += weight * DVec3::new(i as f64, j as f64, k as f64);
                }
            }
        }
        let mean = |axis: usize| taps[axis].iter().map(|&(at, weight)| at as f64 * weight).sum();
        let means = DVec3::new(mean(0), mean(1), mean(2));
        let slopes = (sums - means * sum) / (MASK_DEVIATION * MASK_DEVIATION);
        (label, self.to_steps.transpose() * slopes)
    }

    /// Returns the field in a part of a ray: that of the middle of the pieces where it counts.
    pub fn layer(&self, ray: &Ray, span: [f64; 2], pieces: &[[f64; 2]]) -> Option<Layer> {
        let (first, last) = (pieces.first()?, pieces.last()?);
        let (label, gradient) = self.at(ray.point(0.5 * (first[0] + last[1])));
        Some(Layer {
            span,
            mean: label,
            faces: [Some(label); 2],
            gradients: [Some(gradient); 2],
            middle: Some(gradient),
            filling: 1.0,
            clipped: None,
        })
    }
}

/// Returns the samples around a place along an axis, as far as the lattice has them, with weights
/// that add up to 1.
fn taps(place: f64, count: usize) -> Vec<(usize, f64)> {
    let first = place.floor() - 1.0;
    let inside = (0..4).map(|tap| first + f64::from(tap));
    let inside = inside.filter(|at| (0.0..count as f64).contains(at));
    let weight = |at: f64| (-0.5 * ((place - at) / MASK_DEVIATION).powi(2)).exp();
    let taps: Vec<_> = inside.map(|at| (at as usize, weight(at))).collect();
    let all: f64 = taps.iter().map(|(_, weight)| weight).sum();
    taps.into_iter().map(|(at, weight)| (at, weight / all)).collect()
}

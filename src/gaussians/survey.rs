//! What the numbers of a trained scene say about it.

use super::Gaussians;
use crate::{parallel::prelude::*, splat::TRAINED_OPACITIES};

/// A needle is at least this many times as long as it is wide.
const NEEDLE: f32 = 25.0;

/// Ranges and oddities of a trained scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// The smallest and the largest standard deviation, in world units.
    pub scales: [f32; 2],
    /// The smallest and the largest opacity.
    pub opacities: [f32; 2],
    /// The number of Gaussians that cover less than 1/255 of any pixel.
    pub invisible: u64,
    /// The number of Gaussians that are at least 25 times as long as they are wide. From other
    /// views than those of the training, they stick out.
    pub needles: u64,
}

impl Gaussians {
    /// Returns the ranges and oddities of the scene. Those of an empty one are from infinity down.
    pub fn survey(&self) -> Survey {
        let empty = [f32::INFINITY, f32::NEG_INFINITY];
        let none = Survey { scales: empty, opacities: empty, invisible: 0, needles: 0 };
        let one = |index: usize| {
            let (mut sides, opacity) = (self.scales[index].to_array(), self.opacities[index]);
            sides.sort_by(f32::total_cmp);
            let [least, middle, most] = sides;
            Survey {
                scales: [least, most],
                opacities: [opacity; 2],
                invisible: u64::from(f64::from(opacity) < TRAINED_OPACITIES[0]),
                needles: u64::from(most > 0.0 && most >= NEEDLE * middle),
            }
        };
        let wider = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let both = |a: Survey, b: Survey| Survey {
            scales: wider(a.scales, b.scales),
            opacities: wider(a.opacities, b.opacities),
            invisible: a.invisible + b.invisible,
            needles: a.needles + b.needles,
        };
        (0..self.len()).into_par_iter().map(one).reduce(|| none, both)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn needles_and_invisible_ones_are_counted() {
        let set = Gaussians {
            centers: vec![Vec3::ZERO; 3],
            scales: vec![Vec3::new(1.0, 30.0, 0.1), Vec3::new(2.0, 30.0, 0.1), Vec3::ZERO],
            opacities: vec![0.5, 0.003, 0.9],
            ..Gaussians::default()
        };
        let wanted =
            Survey { scales: [0.0, 30.0], opacities: [0.003, 0.9], invisible: 1, needles: 1 };
        assert_eq!(set.survey(), wanted);
    }
}

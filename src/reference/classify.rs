//! A transfer function, averaged over ranges of values.

use super::quadrature::quadrature;
use crate::volume::TransferFunction;
use glam::DVec3;

/// Larger opacities count as this one ([`TransferFunction::extinction`]).
const OPAQUE: f64 = 0.9999;

/// A transfer function, and the values between which its extinction and colour are smooth.
#[derive(Debug)]
pub(super) struct Classifier<'a> {
    pub transfer: &'a TransferFunction,
    cuts: Vec<f64>,
}

impl<'a> Classifier<'a> {
    pub fn new(transfer: &'a TransferFunction) -> Self {
        let points = transfer.color.iter().map(|p| p.0).chain(transfer.opacity.iter().map(|p| p.0));
        let mut cuts: Vec<f64> = points.collect();
        // The logarithm of a transmittance is smooth where the transmittance does not fall by a
        // large factor: cut wherever it halves.
        let levels = (1..14).map(|halvings| 1.0 - 0.5_f64.powi(halvings)).chain([OPAQUE]);
        for level in levels {
            for pair in transfer.opacity.windows(2) {
                let [(v0, p0), (v1, p1)] = [pair[0], pair[1]];
                let share = (level - p0) / (p1 - p0);
                if share > 0.0 && share < 1.0 {
                    cuts.push(v0 + share * (v1 - v0));
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        Self { transfer, cuts }
    }

    /// Returns the extinction and colour of a value.
    pub fn at(&self, value: f64) -> (f64, DVec3) {
        (self.transfer.extinction(value), DVec3::from(self.transfer.color(value)))
    }

    /// Returns the mean extinction over all values between two values, and their mean colour,
    /// weighted by extinction (Engel et al. 2001).
    pub fn between(&self, a: f64, b: f64) -> (f64, DVec3) {
        let (low, high) = (a.min(b), a.max(b));
        if low == high {
            return self.at(a);
        }
        let first = self.cuts.partition_point(|cut| *cut <= low);
        let past = self.cuts.partition_point(|cut| *cut < high);
        let ends = self.cuts[first..past.max(first)].iter().copied().chain([high]);
        let (mut from, mut sums) = (low, [0.0; 4]);
        for to in ends {
            let piece = quadrature([from, to], |value| {
                let (extinction, color) = self.at(value);
                (extinction * color).extend(extinction).to_array()
            });
            (0..4).for_each(|i| sums[i] += piece[i] / (high - low));
            from = to;
        }
        let [red, green, blue, extinction] = sums;
        let color = DVec3::new(red, green, blue);
        (extinction, if extinction > 0.0 { color / extinction } else { DVec3::ZERO })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_over_steps_and_ramps_are_exact() {
        let half = 1.0 - (-2.0_f64).exp();
        let transfer = TransferFunction {
            color: vec![(0.0, [1.0, 0.0, 0.0]), (3.0, [1.0, 0.0, 0.0]), (3.0, [0.0, 0.0, 1.0])],
            opacity: vec![(2.0, 0.0), (2.0, half), (4.0, half), (4.0, 0.0), (5.0, 0.0), (6.0, 1.0)],
            unit: 0.5,
            ..TransferFunction::default()
        };
        let classifier = Classifier::new(&transfer);
        // The extinction is 4 from 2 to 4.
        for (a, b, extinction, blue) in
            [(1.0, 2.5, 4.0 / 3.0, 0.0), (3.5, 1.5, 3.0, 1.0 / 3.0), (0.0, 5.0, 1.6, 0.5)]
        {
            let (mean, color) = classifier.between(a, b);
            assert!((mean - extinction).abs() < 1e-12, "{mean}");
            assert!((color - DVec3::new(1.0 - blue, 0.0, blue)).length() < 1e-12, "{color}");
        }
        assert_eq!(classifier.between(0.0, 1.0), (0.0, DVec3::ZERO));
        let (exact, _) = classifier.between(2.5, 2.5);
        assert!((exact - 4.0).abs() < 1e-12);
        // −∫ ln(1 − x) dx = (1 − x)·ln(1 − x) + x, up to the opacity that counts as full.
        let (mean, _) = classifier.between(5.0, 5.0 + OPAQUE);
        let expected = ((1.0 - OPAQUE) * (1.0 - OPAQUE).ln() + OPAQUE) / OPAQUE / 0.5;
        assert!((mean - expected).abs() < 1e-9, "{mean} {expected}");
        let tiny = classifier.between(5.5, 5.5 + 1e-13).0;
        assert!((tiny - transfer.extinction(5.5)).abs() < 1e-9);
    }
}

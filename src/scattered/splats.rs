//! From scattered samples to splats: kernels, weights and slopes.

use super::{
    Points,
    neighbourhood::{MOST, Place, places},
};
use crate::{
    Deadline, Error, Result, memory,
    parallel::prelude::*,
    splat::{SampleSplats, Splat},
};
use glam::{DVec3, Vec3};

/// Footprints end this many standard deviations from the sample, at 1.1 % of the kernel's height.
const EXTENT: f32 = 3.0;
/// Standard deviation of a kernel that is made from the neighbours, in spacings of the samples. On
/// average 5.4 kernels overlap at a position. Random samples leave no empty ball within the
/// footprints' reach of 2.1 spacings: a ball of that size occurs once in e³⁹ samples.
const SPREAD: f64 = 0.7;
/// The range of weights, whose median is 1 or more. Samples outside it count for more or less than
/// their volume. In this range, 16 bits hold weights with all their digits. A smaller weight would
/// be invisible beside others of weight 1.
pub(super) const WEIGHTS: [f64; 2] = [1e-4, 6e4];
/// Over the whole extent of its kernel, a sample's value changes by at most this many widths of the
/// range of its neighbours.
const LARGEST_RISE: f64 = 2.5;

/// Bytes of temporary memory per sample: the tree, its neighbourhood twice, its kernel and its
/// splat.
const OF_SAMPLE: u64 = 350;

/// How scattered samples become splats.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleOptions {
    /// Nearest neighbours that a sample's spacing and slope are computed from, 4 to 64. More of
    /// them make wide kernels even.
    pub neighbours: usize,
    /// One radius for all samples, in world units, instead of their own.
    pub radius: Option<f64>,
    /// Standard deviations of the kernel per radius.
    pub deviations: f64,
    /// Whether samples carry slopes. Without slopes, values stay inside the samples' range but show
    /// steps (Shepard 1968).
    pub slopes: bool,
    /// When the splats must be ready.
    pub deadline: Deadline,
}

impl Default for SampleOptions {
    fn default() -> Self {
        Self {
            neighbours: 16,
            radius: None,
            deviations: 2.0,
            slopes: true,
            deadline: Deadline::NEVER,
        }
    }
}

/// The shape of a kernel, and its weight.
struct Shape {
    /// B of Σ = B·Bᵀ, row by row.
    factor: [f64; 6],
    weight: f64,
}

impl Points {
    /// Makes the splats that draw the samples, in their order.
    ///
    /// **Kernels** have the sample's covariance, or are round. For a round kernel the radius of the
    /// options, else the sample's own, is [`SampleOptions::deviations`] standard deviations.
    /// Without a radius, the standard deviation is 0.7 of the local spacing of the samples: the
    /// edge of a cube that holds one of them. A single sample gets 0.5 world units.
    ///
    /// **Weights** keep the density of the samples from showing. Kernels from neighbours have
    /// weight 1. Given kernels have the volume of the sample's cube over that of the kernel, up to
    /// a common factor. Samples at the same position share the weight of one sample, and the field
    /// there is their mean.
    ///
    /// **Slopes** are fitted to the neighbours by weighted least squares and limited by the range
    /// of their values. They are 0 in directions in which the samples have no extent.
    ///
    /// # Errors
    /// - [`Error::Argument`] for what [`validate`](Self::validate) finds, and for options outside
    ///   their ranges.
    /// - [`Error::Timeout`] after the deadline.
    /// - [`Error::Memory`] if there is too little.
    pub fn to_splats(&self, options: &SampleOptions) -> Result<SampleSplats> {
        self.validate()?;
        options.validate()?;
        memory::room("making splats of samples", OF_SAMPLE.saturating_mul(self.len() as u64))?;
        let (places, place_of) = places(self, options.neighbours, options.deadline)?;
        let place = |index: usize| places[place_of[index] as usize];
        // 32-bit coordinates cannot resolve distances below this, so a narrower kernel would vanish
        // in rounding.
        let finest = (self.bounds().diagonal() * 1e-7).max(f64::from(f32::MIN_POSITIVE));
        let mut shapes: Vec<Shape> = (0..self.len())
            .into_par_iter()
            .map(|index| self.shape(options, index, place(index), finest))
            .collect();
        settle_weights(&mut shapes);
        let slope = |index: usize| slope(&shapes[index].factor, &place(index));
        let slope = |index: usize| if options.slopes { slope(index) } else { DVec3::ZERO };
        let splat = |index: usize| {
            let Shape { factor, weight } = &shapes[index];
            let factor = factor.map(|term| term as f32);
            Splat::sample(
                self.positions[index],
                self.values[index],
                factor,
                *weight as f32,
                slope(index).as_vec3(),
            )
        };
        let splats: Vec<Splat> = (0..self.len()).into_par_iter().map(splat).collect();
        options.deadline.check("comparing kernels")?;
        let overlap = overlap(&splats);
        Ok(SampleSplats { origin: self.origin, splats, extent: EXTENT, overlap })
    }

    /// Returns the kernel of a sample, with its weight up to a common factor.
    fn shape(&self, options: &SampleOptions, index: usize, place: Place, finest: f64) -> Shape {
        let share = 1.0 / f64::from(place.samples);
        let round = |deviation: f64| {
            let b = deviation.clamp(finest, f64::from(f32::MAX) / 1e6);
            [b, 0.0, b, 0.0, 0.0, b]
        };
        let radius = options.radius.or_else(|| {
            let listed = || self.radii.get(index).map(|&radius| f64::from(radius));
            if self.covariances.is_empty() { listed() } else { None }
        });
        let given = match radius {
            Some(radius) => Some(round(radius / options.deviations)),
            None => self.covariances.get(index).and_then(factor),
        };
        let Some(factor) = given else {
            let deviation = if place.spacing > 0.0 { SPREAD * place.spacing } else { 0.5 };
            return Shape { factor: round(deviation), weight: share };
        };
        // A single position has no spacing and needs no weight.
        let room = if place.spacing > 0.0 { place.spacing.max(finest) } else { 1.0 };
        let [b00, _, b11, _, _, b22] = factor;
        Shape { factor, weight: share * (room / b00) * (room / b11) * (room / b22) }
    }
}

impl SampleOptions {
    /// Checks the options.
    ///
    /// # Errors
    /// [`Error::Argument`] that names what [`Points::to_splats`] would refuse.
    pub fn validate(&self) -> Result<()> {
        let wrong = |message: String| Err(Error::Argument(message));
        if !(4..=MOST).contains(&self.neighbours) {
            return wrong(format!(
                "the number of neighbours must be 4 to {MOST}, found {}",
                self.neighbours
            ));
        }
        for (name, value) in
            [("a radius", self.radius.unwrap_or(1.0)), ("deviations", self.deviations)]
        {
            if !(value > 0.0 && value.is_finite()) {
                return wrong(format!("samples need {name} above 0, found {value}"));
            }
        }
        Ok(())
    }
}

/// Returns the lower triangular B of Σ = B·Bᵀ, row by row (Cholesky); `None` if Σ is not positive
/// definite in 32 bits.
pub(super) fn factor(covariance: &[f32; 6]) -> Option<[f64; 6]> {
    let [xx, xy, xz, yy, yz, zz] = covariance.map(f64::from);
    let root = |left: f64, of: f64| (left > 1e-6 * of && left.is_finite()).then(|| left.sqrt());
    let b00 = root(xx, 0.0)?;
    let (b10, b20) = (xy / b00, xz / b00);
    let b11 = root(yy - b10 * b10, yy)?;
    let b21 = (yz - b20 * b10) / b11;
    let b22 = root(zz - b20 * b20 - b21 * b21, zz)?;
    let factor = [b00, b10, b11, b20, b21, b22];
    factor.iter().all(|term| term.is_finite()).then_some(factor)
}

/// Scales the weights to a median of 1 and clamps them to their range. If most kernels are far
/// smaller than the spacing, the median stays above 1. The weights of volume over b³ sum to
/// (2π)^1.5 on average over space, and must sum to at least 1. Otherwise the wide kernels between
/// the small ones would count as empty.
fn settle_weights(shapes: &mut [Shape]) {
    let mut weights: Vec<f64> = shapes.iter().map(|shape| shape.weight).collect();
    let middle = weights.len() / 2;
    let median = *weights.select_nth_unstable_by(middle, f64::total_cmp).1;
    let unit = median.min(std::f64::consts::TAU.powf(1.5));
    shapes
        .par_iter_mut()
        .for_each(|shape| shape.weight = (shape.weight / unit).clamp(WEIGHTS[0], WEIGHTS[1]));
}

/// Returns the slope in the kernel's whitened space, Bᵀ·g.
fn slope([b00, b10, b11, b20, b21, b22]: &[f64; 6], place: &Place) -> DVec3 {
    let g = place.gradient;
    let slope = DVec3::new(b00 * g.x + b10 * g.y + b20 * g.z, b11 * g.y + b21 * g.z, b22 * g.z);
    slope.clamp_length_max(LARGEST_RISE * place.width / f64::from(EXTENT))
}

/// Returns the sum of the weighted kernels at the samples, averaged over some of them spread
/// through the list. All kernels are evaluated at each one, because kernels of very different sizes
/// have no common search radius.
fn overlap(splats: &[Splat]) -> f32 {
    let tried = ((1 << 26) / splats.len()).clamp(16, 512).min(splats.len());
    let sums = (0..tried).into_par_iter().map(|sample| {
        let at = Vec3::from(
            splats[(sample as u64 * splats.len() as u64 / tried as u64) as usize].center,
        );
        splats.iter().map(|splat| weighted_kernel(splat, at)).sum::<f64>()
    });
    (sums.sum::<f64>() / tried as f64) as f32
}

/// Returns weight times kernel of a splat at a position, 0 beyond its extent.
fn weighted_kernel(splat: &Splat, at: Vec3) -> f64 {
    let d = at - Vec3::from(splat.center);
    let [b00, b10, b11, b20, b21, b22] = splat.factor;
    let x = d.x / b00;
    // Most kernels are far away along the first axis already.
    if x.abs() > EXTENT {
        return 0.0;
    }
    let y = (d.y - b10 * x) / b11;
    let z = (d.z - b20 * x - b21 * y) / b22;
    let squared = x * x + y * y + z * z;
    if squared > EXTENT * EXTENT {
        0.0
    } else {
        f64::from(splat.weight_and_slope().0 * (-0.5 * squared).exp())
    }
}

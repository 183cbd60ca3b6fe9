//! The one primitive: an ellipsoidal Gaussian kernel with a payload.

use crate::{Error, Result, math::Bounds, parallel::prelude::*};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};
use half::f16;
use std::sync::Arc;

/// An ellipsoidal Gaussian splat as stored in memory and on the GPU (48 bytes).
///
/// The covariance is Σ = B·Bᵀ with B lower triangular. In the whitened space x′ = B⁻¹(x − center),
/// the kernel is the unit Gaussian exp(−|x′|²/2).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Splat {
    /// World position, relative to the set's origin.
    pub center: [f32; 3],
    /// Surfels: the optical depth through the centre. Samples: the value.
    pub strength: f32,
    /// B row by row: b00, b10, b11, b20, b21, b22, in world units.
    pub factor: [f32; 6],
    /// Surfels: red, green, blue and opacity, 8 bits each, red in the lowest bits. The opacity is
    /// a factor on the strength. A splat with an opacity below 1 is translucent: where it is
    /// widened in the picture, its optical depth shrinks as its area grows. Samples: the weight as
    /// a 16-bit float, and a part of the slope ([`Splat::sample`]).
    pub color: u32,
    /// Surfels: the unit normal, octahedral, two signed 16-bit components ([`encode_normal`]);
    /// [`NO_NORMAL`] if there is none, which draws the splat unshaded. Samples: the rest of the
    /// slope.
    pub normal: u32,
}

impl Splat {
    /// A scattered sample at `center` with a `value`. The field is a weighted mean, in which this
    /// sample's kernel has the given `factor` and counts `weight` times.
    ///
    /// The kernel carries value + slope·x′, where x′ is the position in whitened space. With the
    /// right slopes, a linear field is reproduced exactly (Franke & Nielson 1980).
    ///
    /// The weight is a 16-bit float. The components of the slope are integers of 13 bits with a
    /// common exponent of 9 bits (as colours of Ward 1991). So slopes of any unit keep 12 bits of
    /// their largest component.
    pub fn sample(center: Vec3, value: f32, factor: [f32; 6], weight: f32, slope: Vec3) -> Self {
        let (parts, exponent) = encode_slope(slope);
        let [x, y, z] = parts.map(|part| part as u32 & SLOPE_MASK);
        Self {
            center: center.to_array(),
            strength: value,
            factor,
            color: u32::from(f16::from_f32(weight).to_bits()) | x << 16 | exponent >> 6 << 29,
            normal: y | z << 13 | exponent << 26,
        }
    }

    /// The weight and the slope of a [`sample`](Self::sample).
    pub fn weight_and_slope(&self) -> (f32, Vec3) {
        let weight = f16::from_bits(self.color as u16).to_f32();
        let exponent = self.color >> 29 << 6 | self.normal >> 26;
        if exponent == NO_SLOPE {
            return (weight, Vec3::NAN);
        }
        let unit = 2f64.powi(exponent as i32 - SLOPE_BIAS);
        // Shifted to the top and back as a signed number, to extend the sign.
        let parts = [self.color >> 16, self.normal, self.normal >> 13]
            .map(|bits| ((bits << 19) as i32 >> 19) as f32);
        (weight, Vec3::from(parts.map(|part| (f64::from(part) * unit) as f32)))
    }
}

/// The bits of one component of a slope: a signed integer.
const SLOPE_MASK: u32 = 0x1fff;
/// The largest component of a slope.
const SLOPE_MOST: f64 = 4095.0;
/// A component of 1 with the exponent 0 is 2⁻²⁰⁰. splats.wgsl has the same number.
const SLOPE_BIAS: i32 = 200;
/// The exponent of a slope that is not finite.
const NO_SLOPE: u32 = 511;

/// Returns the components of a slope as integers, and their common exponent.
fn encode_slope(slope: Vec3) -> ([i32; 3], u32) {
    let largest = f64::from(slope.abs().max_element());
    if !slope.is_finite() {
        return ([0; 3], NO_SLOPE);
    }
    if largest == 0.0 {
        return ([0; 3], 0);
    }
    // The smallest power of two by which the largest component fits. 32-bit floats reach from 2⁻¹⁴⁹
    // to 2¹²⁸, so exponents lie far inside 0 … 510.
    let exponent = (largest / SLOPE_MOST).log2().ceil() as i32;
    let unit = 2f64.powi(exponent);
    let parts = slope.to_array().map(|part| (f64::from(part) / unit).round() as i32);
    (parts, (exponent + SLOPE_BIAS) as u32)
}

/// The [`Splat::normal`] of a splat that has none.
pub const NO_NORMAL: u32 = 0x8000_8000;

/// Standard deviation, in pixels, by which every splat is widened in the picture so that none falls
/// between the pixels. Lattice samples are not widened, because their kernels overlap.
pub const FOOTPRINT_BLUR: f64 = 0.35;

/// When a radiance splat with a normal is widened, it moves back along the normal by this many of
/// the added standard deviations. Where opaque splats overlap, half of the light is absorbed about
/// this many standard deviations from their centres, so the shift keeps silhouettes in place.
pub const STEP_BACK: f64 = 2.4;

/// Standard deviation, in pixels, by which trained Gaussians are widened: their trainer adds 0.3 to
/// the variances in the picture (Kerbl et al. 2023).
pub const TRAINED_BLUR: f64 = 0.547_722_557_505_166_1;

/// The widening of a trained Gaussian along the view's axis, as a share of the widening across it.
/// The trainer widens across the axis only, and widening along it as well is visible away from the
/// picture's centre. Without any, a flat Gaussian may have no volume.
pub const TRAINED_BLUR_ALONG: f64 = 0.1;

/// A trained Gaussian covers at most the second of these shares of a pixel. Where it covers less
/// than the first, it is not drawn (Kerbl et al. 2023).
pub const TRAINED_OPACITIES: [f64; 2] = [1.0 / 255.0, 0.99];

/// The colours of trained Gaussians are numbers of 16 bits in this unit. They may exceed 1, up to
/// almost 8. kernels.wgsl and splats.wgsl have the same number.
pub const TRAINED_COLOR: f32 = 1.0 / 8192.0;

/// The largest part of such a colour.
pub const BRIGHTEST_TRAINED: f32 = 65535.0 * TRAINED_COLOR;

/// Packs a colour of a trained Gaussian into the fields `color` and `normal` of its splat: red and
/// the high byte of green, then blue and the low byte of green. The highest byte of both makes them
/// usual 32-bit floats, which no device changes as it copies them.
pub fn encode_trained_color(color: [f32; 3]) -> [u32; 2] {
    const FLOAT: u32 = 0x4000_0000;
    let [red, green, blue] =
        color.map(|part| (part / TRAINED_COLOR).round().clamp(0.0, 65535.0) as u32);
    [FLOAT | (green >> 8) << 16 | red, FLOAT | (green & 255) << 16 | blue]
}

/// Unpacks the colour of a splat of [`TrainedSplats`].
pub fn decode_trained_color(splat: &Splat) -> [f32; 3] {
    let green = (splat.color >> 16 & 255) << 8 | splat.normal >> 16 & 255;
    [splat.color & 0xffff, green, splat.normal & 0xffff].map(|part| part as f32 * TRAINED_COLOR)
}

/// Splats that carry their own colour, optical depth and normal, around a common origin: those of
/// meshes, point clouds and hierarchies.
#[derive(Debug, Clone)]
pub struct Surfels {
    /// World position that the centres are relative to.
    pub origin: DVec3,
    /// The splats, in any order.
    pub splats: Vec<Splat>,
    /// Footprints end this many standard deviations from the centre.
    pub extent: f32,
}

/// Splats that carry a value each ([`Splat::sample`]), around a common origin: those of scattered
/// samples. A transfer function classifies their values after interpolation.
#[derive(Debug, Clone)]
pub struct SampleSplats {
    /// World position that the centres are relative to.
    pub origin: DVec3,
    /// The splats, in any order.
    pub splats: Vec<Splat>,
    /// Footprints end this many standard deviations from the centre.
    pub extent: f32,
    /// The average sum of the weighted kernels inside the set. Used when samples are classified
    /// before they are added.
    pub overlap: f32,
}

/// Splats that carry the colour and opacity of trained Gaussians ([`crate::gaussians`]) as one eye
/// sees them, around a common origin.
///
/// A negative strength is minus what a splat covers at its centre. A positive one is an optical
/// depth: such a splat stands for several Gaussians, seen from afar. The colour is that of
/// [`decode_trained_color`].
#[derive(Debug, Clone)]
pub struct TrainedSplats {
    /// World position that the centres are relative to.
    pub origin: DVec3,
    /// The splats, in any order.
    pub splats: Vec<Splat>,
    /// Footprints end this many standard deviations from the centre.
    pub extent: f32,
}

/// The splats of an item that has explicit ones.
#[derive(Debug, Clone)]
pub(crate) enum Splats {
    Surfels(Arc<Surfels>),
    Samples(Arc<SampleSplats>),
}

/// What all splats of a set have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Common {
    pub origin: DVec3,
    pub extent: f32,
    pub payload: Payload,
}

/// What the splats of a set carry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Payload {
    /// Colour, optical depth and normal, already classified.
    Radiance,
    /// A sample's value, classified after interpolation. `overlap` is that of [`SampleSplats`].
    Scalar { overlap: f32 },
    /// Colour and opacity of a trained Gaussian.
    Trained,
}

/// Packs a unit vector into 32 bits (octahedral, Meyer et al. 2010).
pub fn encode_normal(n: Vec3) -> u32 {
    let sum = n.x.abs() + n.y.abs() + n.z.abs();
    if sum == 0.0 || !sum.is_finite() {
        return NO_NORMAL;
    }
    let (mut x, mut y) = (n.x / sum, n.y / sum);
    if n.z < 0.0 {
        (x, y) = ((1.0 - y.abs()) * x.signum(), (1.0 - x.abs()) * y.signum());
    }
    let pack = |v: f32| u32::from((v.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    pack(x) | pack(y) << 16
}

/// Unpacks the unit vector packed by [`encode_normal`]; `None` for [`NO_NORMAL`].
pub fn decode_normal(packed: u32) -> Option<Vec3> {
    if packed == NO_NORMAL {
        return None;
    }
    let part = |v: u32| f32::from(v as u16 as i16) / 32767.0;
    let (x, y) = (part(packed), part(packed >> 16));
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(0.0);
    Some(Vec3::new(x - fold * x.signum(), y - fold * y.signum(), z).normalize())
}

impl Splat {
    /// The largest optical depth. Anything above it is just as opaque, and would swallow its
    /// neighbours' depths in sums.
    pub const MOST_OPTICAL_DEPTH: f32 = 1e10;

    /// The farthest that footprints of a set may end from the centre, in standard deviations.
    pub const MAX_EXTENT: f32 = 8.0;

    /// The standard deviations along the coordinate axes: the lengths of the rows of the factor.
    pub(crate) fn deviations(&self) -> Vec3 {
        let [b00, b10, b11, b20, b21, b22] = self.factor;
        Vec3::new(
            b00.abs(),
            (b10 * b10 + b11 * b11).sqrt(),
            (b20 * b20 + b21 * b21 + b22 * b22).sqrt(),
        )
    }
}

impl Surfels {
    /// Returns the box around all footprints, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        bounds(&self.common(), &self.splats)
    }

    pub(crate) fn common(&self) -> Common {
        Common { origin: self.origin, extent: self.extent, payload: Payload::Radiance }
    }

    /// Changes the origin of the set; all splats stay where they are in the world.
    ///
    /// # Errors
    /// [`Error::Argument`] if the origin is not finite, or if 32-bit coordinates around it are too
    /// coarse. Their steps may be at most a quarter of the splats' mean deviation, or neighbouring
    /// splats would coincide.
    pub fn move_origin(&mut self, origin: DVec3) -> Result<()> {
        if !origin.is_finite() {
            return Err(Error::Argument(format!(
                "the new origin {origin} of the splats is not finite"
            )));
        }
        let shift = self.origin - origin;
        self.origin = origin;
        if shift == DVec3::ZERO || self.splats.is_empty() {
            return Ok(());
        }
        let move_one = |splat: &mut Splat| {
            let center = (Vec3::from(splat.center).as_dvec3() + shift).as_vec3();
            splat.center = center.to_array();
            let size = splat.factor.iter().map(|b| f64::from(b * b)).sum::<f64>().sqrt();
            (f64::from(center.abs().max_element()), size)
        };
        let both = |a: (f64, f64), b: (f64, f64)| (a.0.max(b.0), a.1 + b.1);
        let (farthest, sizes) =
            self.splats.par_iter_mut().map(move_one).reduce(|| (0.0, 0.0), both);
        let (step, size) = (farthest * f64::from(f32::EPSILON), sizes / self.splats.len() as f64);
        if step > 0.25 * size {
            return Err(Error::Argument(format!(
                "splats are up to {farthest:.0} from the first input, where 32-bit coordinates \
                 have steps of {step:.3}, but their mean deviation is {size:.3}; convert inputs \
                 this far apart to separate files"
            )));
        }
        Ok(())
    }
}

impl SampleSplats {
    /// Returns the smallest and the largest value.
    pub fn value_range(&self) -> [f64; 2] {
        let values = self.splats.iter().map(|splat| f64::from(splat.strength));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    }

    /// Returns the box around all footprints, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        bounds(&self.common(), &self.splats)
    }

    pub(crate) fn common(&self) -> Common {
        let payload = Payload::Scalar { overlap: self.overlap };
        Common { origin: self.origin, extent: self.extent, payload }
    }
}

impl TrainedSplats {
    pub(crate) fn common(&self) -> Common {
        Common { origin: self.origin, extent: self.extent, payload: Payload::Trained }
    }
}

impl Splats {
    pub fn splats(&self) -> &[Splat] {
        match self {
            Self::Surfels(set) => &set.splats,
            Self::Samples(set) => &set.splats,
        }
    }

    pub fn common(&self) -> Common {
        match self {
            Self::Surfels(set) => set.common(),
            Self::Samples(set) => set.common(),
        }
    }

    /// Whether both are the same set in memory.
    pub fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Surfels(set), Self::Surfels(other)) => Arc::ptr_eq(set, other),
            (Self::Samples(set), Self::Samples(other)) => Arc::ptr_eq(set, other),
            _ => false,
        }
    }
}

/// Returns the box around the footprints of splats, in world coordinates.
fn bounds(common: &Common, splats: &[Splat]) -> Bounds {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let grow = |(low, high): (Vec3, Vec3), splat: &Splat| {
        let reach = common.extent * splat.deviations();
        let center = Vec3::from(splat.center);
        (low.min(center - reach), high.max(center + reach))
    };
    let both = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
    let (low, high) = splats.par_iter().fold(|| none, grow).reduce(|| none, both);
    Bounds::between(common.origin, [low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_any_unit_keep_their_digits() {
        let direction = Vec3::new(0.3, -1.0, 0.7);
        for power in (-130..=127).step_by(3) {
            for stretch in [1.0, 1.3, 1.999_9] {
                let slope = direction * (2f64.powi(power) * stretch).min(3e38) as f32;
                let sample = Splat::sample(Vec3::ZERO, 1.0, [1.0; 6], 0.37, slope);
                let (weight, decoded) = sample.weight_and_slope();
                assert!((weight - 0.37).abs() < 2e-4, "{weight}");
                let error = (decoded.as_dvec3() - slope.as_dvec3()).abs().max_element();
                let largest = f64::from(slope.abs().max_element());
                assert!(error <= 2.5e-4 * largest, "{slope} {decoded}");
            }
        }
        for (slope, expected) in [
            (Vec3::ZERO, Vec3::ZERO),
            (Vec3::new(-4095.0, 4095.0, 1.0), Vec3::new(-4095.0, 4095.0, 1.0)),
            (Vec3::new(-65_536.0, 16.0, 15.0), Vec3::new(-65_536.0, 32.0, 0.0)),
        ] {
            let sample = Splat::sample(Vec3::ZERO, 1.0, [1.0; 6], 1.0, slope);
            assert_eq!(sample.weight_and_slope(), (1.0, expected));
        }
        let broken = Splat::sample(Vec3::ZERO, 1.0, [1.0; 6], 1.0, Vec3::X * f32::NAN);
        assert!(broken.weight_and_slope().1.is_nan());
    }

    #[test]
    fn trained_colours_keep_their_digits() {
        for color in [[0.0, 0.5, 1.0], [7.9, 0.003, 0.25], [0.123, 1.456, 2.789]] {
            let [packed, rest] = encode_trained_color(color);
            assert!([packed, rest].map(f32::from_bits).iter().all(|v| v.is_normal()));
            let splat = Splat { color: packed, normal: rest, ..Splat::zeroed() };
            for (decoded, wanted) in decode_trained_color(&splat).iter().zip(color) {
                assert!((decoded - wanted).abs() <= 0.51 * TRAINED_COLOR, "{decoded} {wanted}");
            }
        }
        let [packed, rest] = encode_trained_color([-1.0, 100.0, f32::NAN]);
        let splat = Splat { color: packed, normal: rest, ..Splat::zeroed() };
        assert_eq!(decode_trained_color(&splat), [0.0, 65535.0 * TRAINED_COLOR, 0.0]);
    }

    #[test]
    fn places_hold_while_the_origin_moves() {
        let splat = |x: f32| Splat {
            center: [x, 0.0, 0.0],
            factor: [0.01, 0.0, 0.01, 0.0, 0.0, 0.01],
            ..Splat::zeroed()
        };
        let splats = vec![splat(0.0), splat(0.25)];
        let mut set = Surfels { origin: DVec3::X, splats, extent: 3.0 };
        set.move_origin(DVec3::new(1001.0, 0.0, 0.0)).unwrap();
        let places: Vec<f64> =
            set.splats.iter().map(|s| set.origin.x + f64::from(s.center[0])).collect();
        assert!((places[0] - 1.0).abs() < 1e-4 && (places[1] - 1.25).abs() < 1e-4, "{places:?}");
        let error = set.move_origin(DVec3::new(4e6, 0.0, 0.0)).unwrap_err().to_string();
        assert!(error.contains("have steps of 0.477"), "{error}");
        let (before, nowhere) = (set.origin, DVec3::new(0.0, f64::NAN, 0.0));
        let error = set.move_origin(nowhere).unwrap_err().to_string();
        assert!(error.contains("is not finite") && set.origin == before, "{error}");
    }
}

//! Merged splats: one splat that stands for several, seen from afar.
//!
//! A merged splat keeps the mass of its splats (optical depth times area) and their mean position,
//! colour and normal. It also keeps the second moments of their mass about the mean. If one of the
//! splats were chosen to stand for all, surfaces would thin out from level to level.

use super::Node;
use crate::splat::{Splat, decode_normal, encode_normal};
use glam::Vec3;

/// Full width at half height of a Gaussian, in standard deviations.
pub(crate) const WIDTH: f32 = 2.354_82;

/// Factor on the variance between the splats. A patch of uniform mass and width L has the variance
/// L²/12 along it. Gaussians of that variance, spaced L apart, leave 0.4 of the mean where four
/// meet; with a factor of 1.3 they leave 0.6.
const SPREAD: f32 = 1.3;

/// Splats with at least this optical depth count as opaque. The thinning by `SPREAD` is compensated
/// for them in full, so that irregular groups leave no holes between them.
const OPAQUE: f32 = 4.0;

/// Upper bound on merged strengths. Beyond it, a splat only grows wider.
const MOST_STRENGTH: f32 = 64.0;

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
pub(crate) type Moments = [f32; 6];

/// The values of a node that its parent is merged from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mass {
    /// Optical depth, weighted by opacity, times area.
    pub mass: f32,
    pub area: f32,
    pub mean: Vec3,
    /// Central second moments, divided by the mass.
    pub moments: Moments,
}

/// Returns the covariance of a splat from its factor.
pub(crate) fn covariance(factor: &[f32; 6]) -> Moments {
    let [b00, b10, b11, b20, b21, b22] = *factor;
    [
        b00 * b00,
        b00 * b10,
        b00 * b20,
        b10 * b10 + b11 * b11,
        b10 * b20 + b11 * b21,
        b20 * b20 + b21 * b21 + b22 * b22,
    ]
}

/// The lower Cholesky factor, with lower bounds that keep it regular.
fn factor(m: &Moments) -> [f32; 6] {
    let [xx, xy, xz, yy, yz, zz] = *m;
    let least = 1e-9 * (xx + yy + zz) + f32::MIN_POSITIVE;
    let b00 = xx.max(least).sqrt();
    let (b10, b20) = (xy / b00, xz / b00);
    let b11 = (yy - b10 * b10).max(least).sqrt();
    let b21 = (yz - b20 * b10) / b11;
    let b22 = (zz - b20 * b20 - b21 * b21).max(least).sqrt();
    [b00, b10, b11, b20, b21, b22]
}

/// Coefficients, by rising powers, of a polynomial in √(1 + r) for cos(acos(r)/3). The error is at
/// most 3·10⁻⁶.
pub(super) const THIRD: [f32; 6] =
    [0.500_002_7, 0.408_164, -0.054_907_8, 0.016_816_5, -0.004_783_6, 0.000_734_3];

/// Returns the mean variance along the axes, and the matrix divided by it; all zero if there is no
/// variance. Products of the variances themselves are lost in 32 bits for splats smaller than 1e-10
/// or larger than 1e9.
fn by_mean([xx, xy, xz, yy, yz, zz]: &Moments) -> (f32, Moments) {
    let mean = ((xx + yy + zz) / 3.0).max(0.0);
    let per_mean = if mean > 0.0 { 1.0 / mean } else { 0.0 };
    (mean, [xx, xy, xz, yy, yz, zz].map(|value| value * per_mean))
}

/// The largest eigenvalue, by the trigonometric solution of the characteristic polynomial (Smith
/// 1961).
fn largest(m: &Moments) -> f32 {
    let (mean, [xx, xy, xz, yy, yz, zz]) = by_mean(m);
    let (x, y, z) = (xx - 1.0, yy - 1.0, zz - 1.0);
    let p = ((x * x + y * y + z * z + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0).sqrt();
    if p <= 1e-6 {
        return mean + mean * p;
    }
    let (x, y, z, xy, xz, yz) = (x / p, y / p, z / p, xy / p, xz / p, yz / p);
    let half = (x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)) * 0.5;
    let root = (1.0 + half.clamp(-1.0, 1.0)).sqrt();
    mean + mean * 2.0 * p * THIRD.iter().rev().fold(0.0, |sum, factor| sum * root + factor)
}

/// Approximates σ₁·σ₂ by the root of the sum of the principal minors. For a flat splat, only the
/// two larger axes contribute.
fn area(m: &Moments) -> f32 {
    let (mean, [xx, xy, xz, yy, yz, zz]) = by_mean(m);
    mean * (xx * yy - xy * xy + xx * zz - xz * xz + yy * zz - yz * yz).max(0.0).sqrt()
}

/// The largest standard deviation of a splat.
pub(crate) fn deviation(splat: &Splat) -> f32 {
    largest(&covariance(&splat.factor)).max(0.0).sqrt()
}

/// Returns the node of a leaf, whose footprint ends `extent` standard deviations from its centre.
pub(crate) fn leaf(splat: &Splat, extent: f32) -> Node {
    let sigma = deviation(splat);
    Node {
        splat: *splat,
        center: splat.center,
        // With a margin for rounding.
        radius: extent * sigma * (1.0 + 1e-5),
        size: WIDTH * sigma,
        cone: decode_normal(splat.normal)
            .map_or(-1.0, |normal| leaf_cone(normal.dot(thin_axis(&splat.factor, normal)))),
        first_child: 0,
        children: 0,
    }
}

/// Culling tests shading normals, but the surface itself is what faces away. If a surfel's plane is
/// this near to that of its triangles (cosine of 20°), the margin of culling covers the difference.
pub(super) const ALIKE: f32 = 0.94;

/// Returns the cone of a leaf, given the cosine between its normal and its thinnest axis.
pub(crate) fn leaf_cone(cosine: f32) -> f32 {
    // With a margin for rounding.
    if cosine.abs() < ALIKE { (cosine.abs() - 2e-6).max(0.0) } else { 1.0 }
}

/// Returns the axis along which a splat is thinnest, by two steps of inverse iteration from a
/// nearby direction.
fn thin_axis(factor: &[f32; 6], from: Vec3) -> Vec3 {
    let scale = factor.iter().fold(f32::MIN_POSITIVE, |most, v| most.max(v.abs())).recip();
    let [b00, b10, b11, b20, b21, b22] = factor.map(|v| v * scale);
    // Lower bounds for splats that are nearly infinitely flat.
    let [c00, c11, c22] = [b00, b11, b22].map(|v| v.abs().max(1e-6).copysign(v).recip());
    let mut axis = from;
    for _ in 0..2 {
        let x = axis.x * c00;
        let y = (axis.y - b10 * x) * c11;
        let z = (axis.z - b20 * x - b21 * y) * c22 * c22;
        let y = (y - b21 * z) * c11;
        axis = Vec3::new((x - b10 * y - b20 * z) * c00, y, z).normalize_or(from);
    }
    axis
}

impl Mass {
    /// Returns the mass of a splat that is not merged, or whose parts are no longer known.
    pub fn of(splat: &Splat) -> Self {
        let covariance = covariance(&splat.factor);
        Self::with(splat, area(&covariance), covariance)
    }

    /// Returns the mass of a splat whose area and covariance are known.
    pub fn with(splat: &Splat, area: f32, covariance: Moments) -> Self {
        let alpha = (splat.color >> 24) as f32 / 255.0;
        // A fully transparent splat still counts for the mean position.
        let mass = (splat.strength.min(MOST_STRENGTH) * alpha * area).max(f32::MIN_POSITIVE);
        Self { mass, area, mean: Vec3::from(splat.center), moments: covariance }
    }
}

/// Merges `children` with the given masses into their parent. Its sphere and its first child are
/// set later.
pub(crate) fn merge(children: &[Node], masses: &[Mass]) -> (Node, Mass) {
    let total: f32 = masses.iter().map(|m| m.mass).sum();
    let share = |m: &Mass| m.mass / total;
    let base = masses[0].mean;
    let mean = base + masses.iter().map(|m| (m.mean - base) * share(m)).sum::<Vec3>();
    let mut within = [0.0; 6];
    let mut between = [0.0; 6];
    let mut color = [0.0; 4];
    let mut normal = Vec3::ZERO;
    let mut depth = 0.0;
    for (child, m) in children.iter().zip(masses) {
        let (share, d) = (share(m), m.mean - mean);
        let spread = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
        for i in 0..6 {
            within[i] += share * m.moments[i];
            between[i] += share * spread[i];
        }
        for (sum, part) in color.iter_mut().zip(child.splat.color.to_le_bytes()) {
            *sum += share * f32::from(part);
        }
        depth += share * child.splat.strength;
        normal += decode_normal(child.splat.normal).unwrap_or(Vec3::ZERO) * m.area;
    }
    let moments: Moments = std::array::from_fn(|i| within[i] + between[i]);
    let drawn: Moments = std::array::from_fn(|i| within[i] + SPREAD * between[i]);
    let drawn_area = area(&drawn).max(f32::MIN_POSITIVE);
    let alpha = (color[3] / 255.0).max(1.0 / 255.0);
    // What is not opaque keeps its mass: it is meant to let light pass.
    let opaque = if color[3] < 254.5 { 0.0 } else { (depth / OPAQUE).min(1.0) };
    let made_up = 1.0 + (SPREAD - 1.0) * opaque;
    let packed_normal = encode_normal(normal.normalize_or_zero());
    let splat = Splat {
        center: mean.to_array(),
        strength: (total / drawn_area / alpha * made_up).min(MOST_STRENGTH),
        factor: factor(&drawn),
        color: u32::from_le_bytes(color.map(|part| part.round() as u8)),
        normal: packed_normal,
    };
    let sigma = deviation(&splat);
    let size = children.iter().map(|child| child.size).fold(WIDTH * sigma, f32::max);
    let node = Node {
        splat,
        center: splat.center,
        radius: 0.0,
        size,
        cone: cone(packed_normal, children),
        first_child: 0,
        children: children.len() as u32,
    };
    (node, Mass { mass: total, area: masses.iter().map(|m| m.area).sum(), mean, moments })
}

/// Returns the cosine of the half-angle of the cone around `axis` that contains the cones of all
/// children.
fn cone(axis: u32, children: &[Node]) -> f32 {
    let Some(axis) = decode_normal(axis) else { return -1.0 };
    let mut narrowest = 1.0f32;
    for child in children {
        let Some(normal) = decode_normal(child.splat.normal).filter(|_| child.cone > -1.0) else {
            return -1.0;
        };
        let (cos, sin) = (axis.dot(normal), axis.cross(normal).length());
        let (cone_cos, cone_sin) = (child.cone, (1.0 - child.cone * child.cone).max(0.0).sqrt());
        // Two angles that add up to more than half a turn have no cone.
        if sin * cone_cos + cos * cone_sin < 0.0 {
            return -1.0;
        }
        narrowest = narrowest.min(cos * cone_cos - sin * cone_sin);
    }
    // With a margin for rounding.
    (narrowest - 2e-6).max(-1.0)
}

//! The footprint of a splat: the pixels and sheets that it covers (shaders/shared/footprint.wgsl),
//! and the record that tiles read.

use super::plan::Plan;
use crate::{
    plan::{source::Source, tables::Values},
    scene::{Mode, Order},
    splat::{STEP_BACK, Splat, TRAINED_OPACITIES, decode_normal, decode_trained_color},
};
use glam::{Mat3, Vec3};

/// Factor by which a splat's windows reach beyond the ellipsoid, as in the shader.
pub const SECTION_OVERREACH: f32 = 1.25;
/// Shorter gradients have no direction.
const LEAST_GRADIENT: f32 = 1e-20;
/// The least share of a pixel that a trained Gaussian covers, less what rounding may take from it.
pub const LEAST_TRAINED: f32 = TRAINED_OPACITIES[0] as f32 * 0.999;

/// The payload of a splat.
#[derive(Debug, Clone, Copy)]
pub enum Carried {
    /// Colour and a normal, or a zero vector for none. `strength` is an optical depth, or minus the
    /// opacity of a trained Gaussian.
    Radiance { color: [f32; 3], normal: Vec3 },
    /// A value of the field: its weight, and the change of the value per world unit.
    Scalar { weight: f32, gradient: Vec3 },
}

/// A splat in view space.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    pub center: Vec3,
    pub covariance: Mat3,
    pub extent: f32,
    /// The radius beyond which it covers nothing of a pixel. A faint trained Gaussian ends before
    /// its extent.
    pub rim: f32,
    pub strength: f32,
    pub carried: Carried,
}

/// Returns the square of the radius, in standard deviations, beyond which a trained Gaussian of an
/// opacity covers too little of a pixel to be drawn. It is below 0 if it does so everywhere.
fn trained_rim2(opacity: f32) -> f32 {
    2.0 * (opacity / LEAST_TRAINED).ln()
}

/// The meaning of a record's strength and payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Optical depth through the centre, or minus what a trained Gaussian covers there. Payload: 1,
    /// the facing weight, and colour and normal times that weight.
    Radiance,
    /// The same for a classified sample, whose strength is an extinction.
    Classified,
    /// A value. Payload: weight, and slope in whitened space.
    Scalar,
    /// A facet. The centre is its first corner, and `whitening` has the other two. The strength is
    /// 1 for a front and −1 for a back. Payload: the normals and the colours at the corners, as
    /// bits.
    Facet,
    /// A rod. The centre is its first end; `whitening` has the other one, both radii and the least
    /// radius in pixels. Payload: the normal as bits, whether the rod is round, 0, and the colours
    /// at the ends as bits.
    Rod,
}

/// The data of a splat that tiles need.
#[derive(Debug, Clone, Copy)]
pub struct Record {
    pub center: [f32; 3],
    pub strength: f32,
    /// The whitening M = L⁻¹ of the covariance L·Lᵀ: m00, m10, m20, m11, m21, m22.
    pub whitening: [f32; 6],
    /// The squared radius of the footprint in whitened space.
    pub extent2: f32,
    pub kind: Kind,
    pub payload: [f32; 8],
    /// The first and the last pixel that the splat covers, and the first and the last sheet.
    pub pixels: [[i32; 2]; 2],
    pub sheets: [u16; 2],
    /// The number of the sample's field.
    pub field: u8,
}

impl Record {
    /// A splat that covers nothing.
    pub const NONE: Self = Self {
        center: [0.0; 3],
        strength: 0.0,
        whitening: [0.0; 6],
        extent2: 0.0,
        kind: Kind::Radiance,
        payload: [0.0; 8],
        pixels: [[0; 2], [-1; 2]],
        sheets: [0; 2],
        field: 0,
    };
}

/// The pixels and sheets of a footprint.
struct Place {
    pixels: [[i32; 2]; 2],
    sheets: [usize; 2],
}

/// Returns a splat of a set or a hierarchy in view space, widened so that it cannot fall between
/// pixels (shaders/shared/splats.wgsl).
pub fn widened(plan: &Plan, source: &Source, splat: &Splat) -> Candidate {
    let to_view = source.to_view;
    let mut center = to_view * Vec3::from(splat.center) + source.origin;
    let [b00, b10, b11, b20, b21, b22] = splat.factor;
    let factor = Mat3::from_cols(
        Vec3::new(b00, b10, b20),
        Vec3::new(0.0, b11, b21),
        Vec3::new(0.0, 0.0, b22),
    );
    let turned = to_view * factor;
    let distance = if source.is_trained { center.z.abs() } else { center.length() };
    let pixel = if plan.view.perspective { distance } else { 1.0 } / plan.frame.scale;
    let [blur2, along2] = source.blur().map(|blur| (blur * pixel).powi(2));
    let covariance =
        turned * turned.transpose() + Mat3::from_diagonal(Vec3::new(blur2, blur2, along2));
    let mut strength = splat.strength;
    let carried = if source.is_trained {
        Carried::Radiance { color: decode_trained_color(splat), normal: Vec3::ZERO }
    } else if source.has_radiance {
        let [red, green, blue, opacity] =
            splat.color.to_le_bytes().map(|part| f32::from(part) / 255.0);
        strength *= opacity;
        if opacity < 1.0 {
            let toward = if plan.view.perspective { center.normalize_or(Vec3::Z) } else { Vec3::Z };
            strength *= thinned(turned, toward, blur2);
        }
        let normal = decode_normal(splat.normal).map_or(Vec3::ZERO, |normal| to_view * normal);
        if normal != Vec3::ZERO {
            // Opaque splats must not grow through widening, so they step back.
            let own2 = (turned.transpose() * normal).length_squared();
            center -= normal * (STEP_BACK as f32 * ((own2 + blur2).sqrt() - own2.sqrt()));
        }
        Carried::Radiance { color: [red, green, blue], normal }
    } else {
        let (weight, slope) = splat.weight_and_slope();
        // A widened sample keeps its weight over space. Both determinants are in units of the
        // sample's size, so that they fit 32 bits.
        let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
        let unit = 1.0 / trace.max(1e-37).sqrt();
        let before = (b00 * unit * b11 * unit * b22 * unit).abs();
        let after = (covariance * (unit * unit)).determinant().max(1e-37).sqrt();
        // The slope is in the splat's whitened space; B⁻ᵀ maps it to the set's space.
        let slope_z = slope.z / b22;
        let slope_y = (slope.y - b21 * slope_z) / b11;
        let slope_x = (slope.x - b10 * slope_y - b20 * slope_z) / b00;
        let gradient = to_view * Vec3::new(slope_x, slope_y, slope_z) * plan.field.values.per_value;
        strength = counted(plan, strength);
        Carried::Scalar { weight: weight * before / after, gradient }
    };
    let extent = source.extent;
    // A merged node of trained Gaussians has an optical depth.
    let has_opacity = source.is_trained && strength < 0.0;
    let rim = if has_opacity { trained_rim2(-strength).max(0.0).sqrt() } else { extent };
    Candidate { center, covariance, extent, rim: rim.min(extent), strength, carried }
}

/// Returns the area of a splat with these axes, seen along a direction, over its area once it is
/// widened: the factor on the optical depth of translucent splats. All lengths are in units of the
/// splat's own size, so that their fourth powers fit 32 bits.
fn thinned(axes: Mat3, toward: Vec3, blur2: f32) -> f32 {
    let Mat3 { x_axis: a, y_axis: b, z_axis: c } = axes;
    let trace = a.length_squared() + b.length_squared() + c.length_squared();
    let unit = 1.0 / (trace + blur2).max(1e-37);
    let shadow = [b.cross(c), c.cross(a), a.cross(b)].map(|v| v.dot(toward) * unit);
    let along = [a, b, c].map(|v| v.dot(toward).powi(2)).iter().sum::<f32>();
    let (before, blur2) = (shadow.iter().map(|v| v * v).sum::<f32>(), blur2 * unit);
    let after = before + blur2 * ((trace - along) * unit) + blur2 * blur2;
    (before / after.max(1e-37)).sqrt()
}

/// Returns a value in entries of the transfer function's table, clamped so that it stays finite.
pub fn counted(plan: &Plan, value: f32) -> f32 {
    ((value - plan.field.values.zero) * plan.field.values.per_value).clamp(-1e30, 1e30)
}

/// Returns the record of a splat, or `None` if the splat meets no pixel or no sheet.
pub fn record(plan: &Plan, source: &Source, splat: &Candidate) -> Option<Record> {
    if splat.rim <= 0.0 {
        return None;
    }
    let Place { pixels, sheets } = locate(plan, splat, source.ends)?;
    let s = &splat.covariance;
    // The minimum keeps discs much thinner than wide invertible in 32 bits.
    let least = 1e-7 * s.x_axis.x.max(s.y_axis.y.max(s.z_axis.z)) + 1e-37;
    let l00 = s.x_axis.x.max(least).sqrt();
    let (l10, l20) = (s.x_axis.y / l00, s.x_axis.z / l00);
    let l11 = (s.y_axis.y - l10 * l10).max(least).sqrt();
    let l21 = (s.y_axis.z - l10 * l20) / l11;
    let l22 = (s.z_axis.z - l20 * l20 - l21 * l21).max(least).sqrt();
    let (m00, m11, m22) = (1.0 / l00, 1.0 / l11, 1.0 / l22);
    let (m10, m21) = (-l10 * m00 * m11, -l21 * m11 * m22);
    let m20 = -(l20 * m00 + l21 * m10) * m22;
    let mut strength = splat.strength;
    let radiance = |color: [f32; 3], normal: Vec3| {
        let facing =
            if plan.single().is_some() { 1.0 } else { facing_weight(plan, normal, splat.center) };
        let [red, green, blue] = color;
        [1.0, 1.0, red, green, blue, normal.x, normal.y, normal.z].map(|part| part * facing)
    };
    let (kind, mut payload) = match splat.carried {
        Carried::Radiance { color, normal } => (Kind::Radiance, radiance(color, normal)),
        Carried::Scalar { weight, gradient } if plan.is_classified => {
            let [red, green, blue, extinction] = classify(plan, splat.strength);
            strength = extinction * weight * plan.field.kernel.per_overlap;
            let size = gradient.length();
            // The normal points to smaller values: outward.
            let has_direction = plan.lit_surfaces && size > LEAST_GRADIENT;
            let normal = if has_direction { -gradient / size } else { Vec3::ZERO };
            (Kind::Classified, radiance([red, green, blue], normal))
        }
        Carried::Scalar { weight, gradient: g } => {
            // Lᵀ·g: the slope in whitened space.
            let slope = [l00 * g.x + l10 * g.y + l20 * g.z, l11 * g.y + l21 * g.z, l22 * g.z];
            (Kind::Scalar, [weight, slope[0], slope[1], slope[2], 0.0, 0.0, 0.0, 0.0])
        }
    };
    if kind != Kind::Scalar {
        payload[0] = 1.0;
    }
    Some(Record {
        center: splat.center.to_array(),
        strength,
        whitening: [m00, m10, m20, m11, m21, m22],
        extent2: splat.rim * splat.rim,
        kind,
        payload,
        pixels,
        sheets: sheets.map(|sheet| sheet as u16),
        field: plan.number,
    })
}

/// Looks up the colour and extinction of a value.
fn classify(plan: &Plan, value: f32) -> [f32; 4] {
    let Values { last: end, place, .. } = plan.field.values;
    let at = (value + place).clamp(0.0, end);
    let (low, part) = (at as usize, at.fract());
    let (a, b) = (plan.tables.colors[low], plan.tables.colors[low + 1]);
    std::array::from_fn(|channel| a[channel] + (b[channel] - a[channel]) * part)
}

/// Returns the facing weight: within a sheet, splats that face the eye hide those that face away.
/// Far sides keep a small weight, so that they have a colour when alone.
fn facing_weight(plan: &Plan, normal: Vec3, center: Vec3) -> f32 {
    if normal == Vec3::ZERO {
        return 1.0;
    }
    let away = if plan.view.perspective {
        normal.dot(center) / center.length().max(1e-30)
    } else {
        normal.z
    };
    (0.5 - 4.0 * away).clamp(1.0 / 255.0, 1.0)
}

/// Bounds x/z over an ellipsoid in front of the eye, by the tangents to its silhouette; exact in
/// perspective.
pub fn tangent_bounds(x: f32, z: f32, xx: f32, xz: f32, zz: f32) -> [f32; 2] {
    let p = x / z;
    let (a, b, c) = (xx / z / z, xz / z / z, zz / z / z);
    let denominator = 1.0 / (1.0 - c);
    let middle = (p - b) * denominator;
    let square = a - 2.0 * b * p + c * p * p - (a * c - b * b);
    let half = square.max(0.0).sqrt() * denominator.abs();
    [middle - half, middle + half]
}

/// Bounds x/z over the part of a box beyond the nearest visible z.
pub fn box_bounds(x: f32, reach: f32, z_low: f32, z_high: f32) -> [f32; 2] {
    let (low, high) = (x - reach, x + reach);
    [low / if low < 0.0 { z_low } else { z_high }, high / if high < 0.0 { z_high } else { z_low }]
}

fn locate(plan: &Plan, splat: &Candidate, ends: bool) -> Option<Place> {
    let (c, s, extent) = (splat.center, &splat.covariance, splat.extent);
    let deviations = Vec3::new(s.x_axis.x.sqrt(), s.y_axis.y.sqrt(), s.z_axis.z.sqrt());
    let reaches = extent * deviations;
    let (mut distance, mut reach, mut far) = (c.z, reaches.z, c.z + reaches.z);
    if plan.view.perspective {
        if c.z + reaches.z <= plan.frame.z_near {
            return None;
        }
        distance = c.length();
        let toward = c / distance.max(1e-30);
        reach = extent * toward.dot(*s * toward).max(0.0).sqrt();
        let across = extent * extent * (s.x_axis.x + s.y_axis.y + s.z_axis.z);
        far = ((distance + reach) * (distance + reach) + across).sqrt();
    }
    // Near the rim of a footprint, sections reach beyond the ellipsoid, because kernels are not cut
    // along a ray.
    let overreach = if ends { 1.0 } else { SECTION_OVERREACH };
    far = distance + overreach * (far - distance);
    let near = distance - overreach * reach;
    // Written so that NaN fails.
    let meets = far > plan.planes[1] && near < plan.planes[plan.sheets + 1];
    if !plan.is_whole() && !meets {
        return None;
    }
    let pixels = pixels(plan, bounds(plan, splat, splat.rim * deviations))?;
    if plan.is_whole() {
        return whole_sheet(plan, c, distance).map(|sheet| Place { pixels, sheets: [sheet; 2] });
    }
    // Beside the eye, a kernel's middle lies behind the ray's start: the part in front of the first
    // plane must be cut off.
    let is_beside = plan.view.perspective && distance < 2.0 * reach;
    let first = if is_beside { 0 } else { plan.sheet_of(near) };
    Some(Place { pixels, sheets: [first, plan.sheet_of(far).max(1)] })
}

/// Bounds a splat in the image plane, at distance 1 in perspective. `reaches` are half the sides of
/// the box around it in view space.
fn bounds(plan: &Plan, splat: &Candidate, reaches: Vec3) -> [[f32; 2]; 2] {
    let (c, s, e2) = (splat.center, &splat.covariance, splat.rim * splat.rim);
    if !plan.view.perspective {
        return [[c.x - reaches.x, c.x + reaches.x], [c.y - reaches.y, c.y + reaches.y]];
    }
    let z_near = plan.frame.z_near;
    if c.z - reaches.z > z_near {
        let (xz, yz, zz) = (e2 * s.x_axis.z, e2 * s.y_axis.z, e2 * s.z_axis.z);
        [
            tangent_bounds(c.x, c.z, e2 * s.x_axis.x, xz, zz),
            tangent_bounds(c.y, c.z, e2 * s.y_axis.y, yz, zz),
        ]
    } else {
        let high = c.z + reaches.z;
        [box_bounds(c.x, reaches.x, z_near, high), box_bounds(c.y, reaches.y, z_near, high)]
    }
}

/// Returns the first and the last pixel whose centre lies in a box of the image plane, with a
/// margin for rounding, or `None` if there is none.
fn pixels(plan: &Plan, bounds: [[f32; 2]; 2]) -> Option<[[i32; 2]; 2]> {
    let frame = &plan.frame;
    let apron = plan.apron() as f32;
    let mut pixels = [[0; 2]; 2];
    for axis in 0..2 {
        let limit = frame.size[axis] as f32 + apron;
        let [low, high] = bounds[axis].map(|bound| frame.center[axis] + frame.scale * bound);
        let first = (low - 0.51).clamp(-apron, limit).ceil();
        let last = (high - 0.49).clamp(-apron - 1.0, limit - 1.0).floor();
        let is_some = first <= last;
        if !is_some {
            return None;
        }
        (pixels[0][axis], pixels[1][axis]) = (first as i32, last as i32);
    }
    Some(pixels)
}

/// Returns the sheet of a splat that is drawn whole: that of its centre, or `None` if no sheet
/// contains the centre.
pub fn whole_sheet(plan: &Plan, center: Vec3, distance: f32) -> Option<usize> {
    let mut place = distance;
    if plan.mode == Mode::AxisSheets {
        place = plan.frame.sheet_normal.dot(center);
        place = if plan.view.perspective { place.abs() } else { place };
    }
    let is_within = place >= plan.planes[1] && place < plan.planes[plan.sheets + 1];
    let key = if plan.single().is_some() { plan.key(center) } else { place };
    // A depth may be smaller than the distance of the first plane.
    let mut sheet = plan.sheet_of(key).clamp(1, plan.sheets);
    if plan.single() == Some(Order::BackToFront) {
        sheet = plan.sheets + 1 - sheet;
    }
    is_within.then_some(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_faint_gaussian_ends_where_it_covers_too_little() {
        for opacity in [0.005, 0.02, 0.1, 0.5, 1.0] {
            let rim2 = trained_rim2(opacity);
            let covered = opacity * (-0.5 * rim2).exp();
            let least = TRAINED_OPACITIES[0] as f32;
            assert!(covered < least && covered > 0.99 * least, "{opacity}: {covered}");
        }
        assert!(trained_rim2(0.0039) < 0.0);
    }
}

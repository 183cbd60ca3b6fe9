//! The pixels and sheets that splats of radiance cover: the result of `footprint`, for eight splats
//! at a time.

use super::{
    footprint::{Kind, LEAST_TRAINED, Record, SECTION_OVERREACH, whole_sheet},
    plan::Plan,
    vector::{Lanes, dot, each, log2, three},
};
use crate::{
    plan::source::Source,
    splat::{NO_NORMAL, STEP_BACK, Splat, TRAINED_COLOR},
};
use fearless_simd::{Simd, i32x8, mask32x8, prelude::*};
use glam::Vec3;

/// Splats of radiance that share an origin.
pub struct Projector<'a> {
    plan: &'a Plan<'a>,
    source: Source,
    /// Columns of the rotation to view space.
    axes: [[f32; 3]; 3],
    origin: [f32; 3],
}

/// Eight splats, as a structure of arrays.
struct Eight {
    center: [[f32; 8]; 3],
    factor: [[f32; 8]; 6],
    strength: [f32; 8],
    color: [i32; 8],
    normal: [i32; 8],
}

/// Eight splats in view space, widened as by [`widened`].
struct Widened<S: Simd> {
    center: [Lanes<S>; 3],
    covariance: Symmetric<S>,
    /// A zero vector for none.
    normal: [Lanes<S>; 3],
    has_normal: mask32x8<S>,
    /// The factor on the optical depth.
    thinned: Lanes<S>,
    /// The radii beyond which they cover nothing of a pixel ([`Candidate::rim`]).
    rim: Lanes<S>,
}

/// The places of footprints: the first and the last pixel, the range of distances, and which
/// footprints meet the picture.
struct Places<S: Simd> {
    pixels: [[Lanes<S>; 2]; 2],
    distance: Lanes<S>,
    near: Lanes<S>,
    far: Lanes<S>,
    meets: mask32x8<S>,
}

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
type Symmetric<S> = [Lanes<S>; 6];

impl<'a> Projector<'a> {
    pub fn new(plan: &'a Plan<'a>, source: Source) -> Self {
        let axes = source.to_view.to_cols_array_2d();
        Self { plan, source, axes, origin: source.origin.to_array() }
    }

    fn is_trained(&self) -> bool {
        self.source.is_trained
    }

    /// Adds the records of splats, each with a share of its strength.
    #[inline(always)]
    pub fn add<'s, S: Simd>(
        &self,
        simd: S,
        splats: impl ExactSizeIterator<Item = (&'s Splat, f32)>,
        records: &mut Vec<Record>,
    ) {
        let mut eight = Eight {
            center: [[0.0; 8]; 3],
            factor: [[1.0; 8]; 6],
            strength: [0.0; 8],
            color: [0; 8],
            normal: [NO_NORMAL as i32; 8],
        };
        let mut count = 0;
        for (splat, share) in splats {
            for (parts, part) in eight.center.iter_mut().zip(splat.center) {
                parts[count] = part;
            }
            for (parts, part) in eight.factor.iter_mut().zip(splat.factor) {
                parts[count] = part;
            }
            eight.strength[count] = splat.strength * share;
            eight.color[count] = splat.color as i32;
            eight.normal[count] = splat.normal as i32;
            count += 1;
            if count == 8 {
                self.add_eight(simd, &eight, u64::MAX, records);
                count = 0;
            }
        }
        if count > 0 {
            self.add_eight(simd, &eight, (1 << count) - 1, records);
        }
    }

    /// Adds the records of those of eight splats whose bit in a mask is set.
    #[inline(always)]
    fn add_eight<S: Simd>(&self, simd: S, eight: &Eight, mask: u64, records: &mut Vec<Record>) {
        let splats = self.widened(simd, eight);
        let Places { pixels, distance, near, far, meets } = self.locate(simd, &splats);
        let mut bits = meets.to_bitmask() & mask;
        if bits == 0 {
            return;
        }
        let whitening = whitening(simd, &splats.covariance);
        let extent2: [f32; 8] = (splats.rim * splats.rim).into();
        let [strength, payload @ ..] = self.payload(simd, eight, &splats);
        let strength: [f32; 8] = strength.into();
        let payload: [[f32; 8]; 7] = each!([0, 1, 2, 3, 4, 5, 6], I => payload[I].into());
        let center: [[f32; 8]; 3] = three!(I => splats.center[I].into());
        let whitening: [[f32; 8]; 6] = each!([0, 1, 2, 3, 4, 5], I => whitening[I].into());
        let mut sheets = [sheets_of(self.plan, simd, near), sheets_of(self.plan, simd, far)];
        if self.plan.by_centers {
            for (lane, depth) in center[2].into_iter().enumerate() {
                let first = self.plan.sheet_before(sheets[0][lane].into(), depth);
                let last = (first + 1).min(self.plan.sheets);
                (sheets[0][lane], sheets[1][lane]) = (first as u16, last as u16);
            }
        }
        if self.plan.is_whole() {
            let distance: [f32; 8] = distance.into();
            for lane in 0..8 {
                let center = Vec3::from_array(three!(I => center[I][lane]));
                match whole_sheet(self.plan, center, distance[lane]) {
                    Some(sheet) => {
                        (sheets[0][lane], sheets[1][lane]) = (sheet as u16, sheet as u16);
                    }
                    None => bits &= !(1 << lane),
                }
            }
        }
        let [[left, top], [right, bottom]]: [[[i32; 8]; 2]; 2] =
            each!([0, 1], I => each!([0, 1], J => i32x8::truncate_from(pixels[I][J]).into()));
        records.reserve(8);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let [facing, red, green, blue, nx, ny, nz] =
                each!([0, 1, 2, 3, 4, 5, 6], I => payload[I][lane]);
            records.push(Record {
                center: three!(I => center[I][lane]),
                strength: strength[lane],
                whitening: each!([0, 1, 2, 3, 4, 5], I => whitening[I][lane]),
                extent2: extent2[lane],
                kind: Kind::Radiance,
                payload: [1.0, facing, red, green, blue, nx, ny, nz],
                pixels: [[left[lane], top[lane]], [right[lane], bottom[lane]]],
                sheets: [sheets[0][lane], sheets[1][lane].max(1)],
                field: self.plan.number,
            });
        }
    }

    /// Returns splats in view space, widened so that none falls between pixels.
    #[inline(always)]
    fn widened<S: Simd>(&self, simd: S, eight: &Eight) -> Widened<S> {
        let plan = self.plan;
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let turned = self.turned(three!(I => eight.center[I].simd_into(simd)));
        let center: [Lanes<S>; 3] = three!(I => turned[I] + self.origin[I]);
        let [b00, b10, b11, b20, b21, b22]: [Lanes<S>; 6] =
            each!([0, 1, 2, 3, 4, 5], I => eight.factor[I].simd_into(simd));
        let [_, b, c] = self.axes;
        let columns = [
            self.turned([b00, b10, b20]),
            three!(I => b11 * b[I] + b21 * c[I]),
            three!(I => b22 * c[I]),
        ];
        let distance = match self.is_trained() {
            true => center[2].abs(),
            false => dot(center, center).sqrt(),
        };
        let pixel = if plan.view.perspective { distance } else { one } * (1.0 / plan.frame.scale);
        let [blur2, along2] = self.source.blur().map(|blur| (pixel * blur) * (pixel * blur));
        let [x, y, z]: [[Lanes<S>; 3]; 3] = three!(I => three!(J => columns[J][I]));
        let covariance = [
            dot(x, x) + blur2,
            dot(x, y),
            dot(x, z),
            dot(y, y) + blur2,
            dot(y, z),
            dot(z, z) + along2,
        ];
        let (normal, mut has_normal) = normals(simd, eight.normal.simd_into(simd));
        if self.is_trained() {
            has_normal = mask32x8::splat(simd, false);
        }
        let normal = self.turned(normal);
        let normal = three!(I => has_normal.select(normal[I], none));
        let mut thinned = one;
        let is_translucent =
            !self.is_trained() && eight.color.iter().any(|&color| color as u32 >> 24 < 255);
        if is_translucent {
            thinned = self.thinned(simd, eight, center, columns, blur2);
        }
        // Opaque splats must not grow through widening, so they step back.
        let along = three!(I => dot(columns[I], normal));
        let variance = dot(along, along);
        let back = ((variance + blur2).sqrt() - variance.sqrt()) * STEP_BACK as f32;
        let center = three!(I => center[I] - normal[I] * back);
        let extent = Lanes::splat(simd, self.source.extent);
        let mut rim = extent;
        if self.is_trained() {
            let strength: Lanes<S> = eight.strength.simd_into(simd);
            let opacity = strength.abs().max(Lanes::splat(simd, LEAST_TRAINED));
            let rim2 = log2(simd, opacity * (1.0 / LEAST_TRAINED)) * (2.0 * std::f32::consts::LN_2);
            // A merged node has an optical depth.
            let has_opacity = strength.simd_lt(0.0);
            rim = has_opacity.select(rim2.max(none).sqrt().min(extent), extent);
        }
        Widened { center, covariance, normal, has_normal, thinned, rim }
    }

    /// Returns the areas of translucent splats, seen from the eye, over those of the widened ones
    /// (`thinned` in `footprint`); 1 for opaque ones.
    #[inline(always)]
    fn thinned<S: Simd>(
        &self,
        simd: S,
        eight: &Eight,
        center: [Lanes<S>; 3],
        [a, b, c]: [[Lanes<S>; 3]; 3],
        blur2: Lanes<S>,
    ) -> Lanes<S> {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let least = Lanes::splat(simd, 1e-37);
        let mut toward = [none, none, one];
        if self.plan.view.perspective {
            let inverse = one / dot(center, center).max(least).sqrt();
            toward = three!(I => center[I] * inverse);
        }
        let trace = dot(a, a) + dot(b, b) + dot(c, c);
        let unit = one / (trace + blur2).max(least);
        let axes = [a, b, c];
        let shadow = three!(I => {
            let (u, v) = (axes[(I + 1) % 3], axes[(I + 2) % 3]);
            let across = three!(J => {
                u[(J + 1) % 3] * v[(J + 2) % 3] - u[(J + 2) % 3] * v[(J + 1) % 3]
            });
            dot(across, toward) * unit
        });
        let along = three!(I => dot(axes[I], toward));
        let (before, blur2) = (dot(shadow, shadow), blur2 * unit);
        let after = before + blur2 * ((trace - dot(along, along)) * unit) + blur2 * blur2;
        let packed: i32x8<S> = eight.color.simd_into(simd);
        let is_opaque = ((packed >> 24) & 0xff).simd_eq(255);
        is_opaque.select(one, (before / after.max(least)).sqrt())
    }

    /// Returns the strengths of splats, and the payloads of their records after the first part.
    #[inline(always)]
    fn payload<S: Simd>(&self, simd: S, eight: &Eight, splats: &Widened<S>) -> [Lanes<S>; 8] {
        let Widened { center, normal, has_normal, thinned, .. } = *splats;
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        if self.is_trained() {
            let first: i32x8<S> = eight.color.simd_into(simd);
            let second: i32x8<S> = eight.normal.simd_into(simd);
            let green = (((first >> 16) & 0xff) << 8) | ((second >> 16) & 0xff);
            let parts = [first & 0xffff, green, second & 0xffff];
            let [red, green, blue] = three!(I => Lanes::<S>::float_from(parts[I]) * TRAINED_COLOR);
            let strength: Lanes<S> = eight.strength.simd_into(simd);
            return [strength, one, red, green, blue, none, none, none];
        }
        // Within a sheet, splats that face the eye hide those that face away.
        let mut away = normal[2];
        if self.plan.view.perspective {
            away = dot(normal, center) / dot(center, center).sqrt().max(Lanes::splat(simd, 1e-30));
        }
        let facing = (away * -4.0 + 0.5).max(Lanes::splat(simd, 1.0 / 255.0)).min(one);
        let facing = has_normal.select(facing, one);
        let facing = if self.plan.single().is_some() { one } else { facing };
        let packed: i32x8<S> = eight.color.simd_into(simd);
        let [red, green, blue, opacity] = each!([0, 8, 16, 24], SHIFT =>
            Lanes::<S>::float_from((packed >> SHIFT as u32) & 0xff) * (1.0 / 255.0));
        let strength: Lanes<S> = eight.strength.simd_into(simd);
        [
            strength * opacity * thinned,
            facing,
            red * facing,
            green * facing,
            blue * facing,
            normal[0] * facing,
            normal[1] * facing,
            normal[2] * facing,
        ]
    }

    #[inline(always)]
    fn turned<S: Simd>(&self, [x, y, z]: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let [a, b, c] = self.axes;
        three!(I => x * a[I] + y * b[I] + z * c[I])
    }

    #[inline(always)]
    fn locate<S: Simd>(&self, simd: S, splats: &Widened<S>) -> Places<S> {
        let (plan, extent) = (self.plan, self.source.extent);
        let c = splats.center;
        let [xx, xy, xz, yy, yz, zz] = splats.covariance;
        let deviations = [xx.sqrt(), yy.sqrt(), zz.sqrt()];
        let reaches = three!(I => deviations[I] * extent);
        let (mut distance, mut reach, mut far) = (c[2], reaches[2], c[2] + reaches[2]);
        let mut meets = mask32x8::splat(simd, true);
        let mut is_beside = mask32x8::splat(simd, false);
        if plan.view.perspective {
            meets = (c[2] + reaches[2]).simd_gt(plan.frame.z_near);
            distance = dot(c, c).sqrt();
            let inverse = Lanes::splat(simd, 1.0) / distance.max(Lanes::splat(simd, 1e-30));
            let toward = three!(I => c[I] * inverse);
            let along = [
                xx * toward[0] + xy * toward[1] + xz * toward[2],
                xy * toward[0] + yy * toward[1] + yz * toward[2],
                xz * toward[0] + yz * toward[1] + zz * toward[2],
            ];
            reach = dot(toward, along).max(Lanes::splat(simd, 0.0)).sqrt() * extent;
            let across = (xx + yy + zz) * (extent * extent);
            far = ((distance + reach) * (distance + reach) + across).sqrt();
            // Beside the eye, a kernel's middle lies behind the ray's start: the part in front of
            // the first plane must be cut off.
            is_beside = distance.simd_lt(reach * 2.0);
        }
        // Near the rim of a footprint, sections reach beyond the ellipsoid, because kernels are not
        // cut along a ray.
        far = (far - distance) * SECTION_OVERREACH + distance;
        let near = distance - reach * SECTION_OVERREACH;
        if !plan.is_whole() {
            meets &= far.simd_gt(plan.planes[1]) & near.simd_lt(plan.planes[plan.sheets + 1]);
        }
        let mut near = is_beside.select(Lanes::splat(simd, -1e38), near);
        if plan.by_centers {
            (near, far) = (c[2], c[2]);
            meets &= near.simd_ge(plan.planes[1]) & far.simd_lt(plan.planes[plan.sheets + 1]);
        }
        let across = three!(I => deviations[I] * splats.rim);
        let (pixels, has_pixels) = self.pixels(simd, self.bounds(simd, splats, across));
        let covers = splats.rim.simd_gt(0.0);
        Places { pixels, distance, near, far, meets: meets & has_pixels & covers }
    }

    /// Bounds splats in the image plane, at distance 1 in perspective. `reaches` are half the sides
    /// of the boxes around them in view space.
    #[inline(always)]
    fn bounds<S: Simd>(
        &self,
        simd: S,
        splats: &Widened<S>,
        reaches: [Lanes<S>; 3],
    ) -> [[Lanes<S>; 2]; 2] {
        let c = splats.center;
        let bounds = each!([0, 1], I => [c[I] - reaches[I], c[I] + reaches[I]]);
        if !self.plan.view.perspective {
            return bounds;
        }
        let [xx, _, xz, yy, yz, zz] = splats.covariance;
        let e2 = splats.rim * splats.rim;
        let is_front = (c[2] - reaches[2]).simd_gt(self.plan.frame.z_near);
        let (xz, yz, zz) = (xz * e2, yz * e2, zz * e2);
        let tangents = [
            tangent_bounds(simd, c[0], c[2], xx * e2, xz, zz),
            tangent_bounds(simd, c[1], c[2], yy * e2, yz, zz),
        ];
        if is_front.all_true() {
            return tangents;
        }
        let (low, high) = (Lanes::splat(simd, self.plan.frame.z_near), c[2] + reaches[2]);
        let boxes = each!([0, 1], I => box_bounds(simd, bounds[I], low, high));
        each!([0, 1], I => each!([0, 1], J => is_front.select(tangents[I][J], boxes[I][J])))
    }

    /// Returns the first and the last pixels whose centres lie in boxes of the image plane, with a
    /// margin for rounding, and which boxes contain any.
    #[inline(always)]
    fn pixels<S: Simd>(
        &self,
        simd: S,
        bounds: [[Lanes<S>; 2]; 2],
    ) -> ([[Lanes<S>; 2]; 2], mask32x8<S>) {
        let frame = &self.plan.frame;
        let apron = self.plan.apron() as f32;
        let mut has_pixels = mask32x8::splat(simd, true);
        let mut pixels = [[Lanes::splat(simd, 0.0); 2]; 2];
        for axis in 0..2 {
            let limit = frame.size[axis] as f32 + apron;
            let low = bounds[axis][0] * frame.scale + frame.center[axis];
            let high = bounds[axis][1] * frame.scale + frame.center[axis];
            // NaN fails.
            has_pixels &= low.simd_le(high);
            let first =
                (low - 0.51).max(Lanes::splat(simd, -apron)).min(Lanes::splat(simd, limit)).ceil();
            let last = (high - 0.49)
                .max(Lanes::splat(simd, -apron - 1.0))
                .min(Lanes::splat(simd, limit - 1.0))
                .floor();
            has_pixels &= first.simd_le(last);
            (pixels[0][axis], pixels[1][axis]) = (first, last);
        }
        (pixels, has_pixels)
    }
}

/// Returns the sheets that contain distances.
#[inline(always)]
pub fn sheets_of<S: Simd>(plan: &Plan, simd: S, distance: Lanes<S>) -> [u16; 8] {
    let frame = &plan.frame;
    let one = Lanes::splat(simd, 1.0);
    let near = plan.planes[1];
    let geometric = frame.geometric_sheets as usize;
    let turn = plan.planes[1 + geometric];
    let log = log2(simd, (distance * (1.0 / near)).max(one)) * frame.per_ratio_log2;
    let even = (distance - turn) * frame.per_step + geometric as f32;
    let estimate = distance.simd_lt(turn).select(log, even).floor() + 1.0;
    let estimate = estimate.max(one).min(Lanes::splat(simd, plan.sheets as f32));
    let [distances, estimates]: [[f32; 8]; 2] = [distance.into(), estimate.into()];
    let mut sheets = [0; 8];
    for ((sheet, estimate), distance) in sheets.iter_mut().zip(estimates).zip(distances) {
        let mut number = (estimate as usize).min(plan.sheets);
        // The closed form may be off by one or two where rounding meets a plane. The list
        // decides.
        for _ in 0..2 {
            if distance < plan.planes[number] {
                number -= 1;
            } else if distance >= plan.planes[number + 1] && number < plan.sheets {
                number += 1;
            }
        }
        *sheet = number as u16;
    }
    sheets
}

/// The whitening M = L⁻¹ of covariances L·Lᵀ: m00, m10, m20, m11, m21, m22.
#[inline(always)]
fn whitening<S: Simd>(simd: S, [xx, xy, xz, yy, yz, zz]: &Symmetric<S>) -> [Lanes<S>; 6] {
    let one = Lanes::splat(simd, 1.0);
    // The minimum keeps discs much thinner than wide invertible in 32 bits.
    let least = xx.max(yy.max(*zz)) * 1e-7 + 1e-37;
    let m00 = one / xx.max(least).sqrt();
    let (l10, l20) = (*xy * m00, *xz * m00);
    let m11 = one / (*yy - l10 * l10).max(least).sqrt();
    let l21 = (*yz - l10 * l20) * m11;
    let m22 = one / (*zz - l20 * l20 - l21 * l21).max(least).sqrt();
    let m10 = -(l10 * m00 * m11);
    let m21 = -(l21 * m11 * m22);
    let m20 = -((l20 * m00 + l21 * m10) * m22);
    [m00, m10, m20, m11, m21, m22]
}

/// Returns unit vectors from their octahedral codes (`decode_normal`), and which codes are normals.
#[inline(always)]
pub fn normals<S: Simd>(simd: S, packed: i32x8<S>) -> ([Lanes<S>; 3], mask32x8<S>) {
    let none = Lanes::splat(simd, 0.0);
    let x = Lanes::<S>::float_from((packed << 16) >> 16) * (1.0 / 32767.0);
    let y = Lanes::<S>::float_from(packed >> 16) * (1.0 / 32767.0);
    let z = 1.0 - x.abs() - y.abs();
    let fold = (-z).max(none);
    let x = x - x.simd_ge(none).select(fold, -fold);
    let y = y - y.simd_ge(none).select(fold, -fold);
    let inverse = Lanes::splat(simd, 1.0) / (x * x + y * y + z * z).sqrt();
    ([x * inverse, y * inverse, z * inverse], !packed.simd_eq(NO_NORMAL as i32))
}

/// Bounds x/z over an ellipsoid in front of the eye, by the tangents to its silhouette; exact in
/// perspective.
#[inline(always)]
fn tangent_bounds<S: Simd>(
    simd: S,
    x: Lanes<S>,
    z: Lanes<S>,
    xx: Lanes<S>,
    xz: Lanes<S>,
    zz: Lanes<S>,
) -> [Lanes<S>; 2] {
    let one = Lanes::splat(simd, 1.0);
    let inverse = one / z;
    let p = x * inverse;
    let (a, b, c) = (xx * inverse * inverse, xz * inverse * inverse, zz * inverse * inverse);
    let denominator = one / (one - c);
    let middle = (p - b) * denominator;
    let square = a - b * p * 2.0 + c * p * p - (a * c - b * b);
    let half = square.max(Lanes::splat(simd, 0.0)).sqrt() * denominator.abs();
    [middle - half, middle + half]
}

/// Bounds x/z over the part of a box beyond the nearest visible z.
#[inline(always)]
fn box_bounds<S: Simd>(
    simd: S,
    [low, high]: [Lanes<S>; 2],
    z_low: Lanes<S>,
    z_high: Lanes<S>,
) -> [Lanes<S>; 2] {
    let none = Lanes::splat(simd, 0.0);
    [low / low.simd_lt(none).select(z_low, z_high), high / high.simd_lt(none).select(z_high, z_low)]
}

//! The pixels and sheets that facets cover, for eight facets at a time.

use super::{
    footprint::{Kind, Record},
    plan::Plan,
    project::{normals, sheets_of},
    rods,
    vector::{Lanes, dot, each, three},
};
use crate::{
    facet::{Facet, FacetSet, Sides},
    math::View,
    plan::source::Source,
    scene::Settings,
    splat::NO_NORMAL,
};
use fearless_simd::{Simd, i32x8, mask32x8, prelude::*};
use std::sync::Arc;

/// `extent2` of the record of a facet that ends at the clips already.
const CUT: f32 = 1.0;
/// The margin of boxes of pixels, against rounding.
const MARGIN: f32 = 0.01;

/// Facets of a set in a view.
pub struct FacetProjector<'a> {
    plan: &'a Plan<'a>,
    set: &'a FacetSet,
    /// One more than the place of the set among those with images; 0 without.
    images: u32,
    source: Source,
    /// Columns of the rotation to view space.
    axes: [[f32; 3]; 3],
    is_culled: bool,
}

/// Eight facets in view space.
struct Eight<S: Simd> {
    corners: [[Lanes<S>; 3]; 3],
    /// The eye sees the front of those with a negative number.
    away: Lanes<S>,
}

/// The first and the last pixel of facets, as whole numbers, and which facets cover any.
struct Covered<S: Simd> {
    pixels: [[Lanes<S>; 2]; 2],
    meets: mask32x8<S>,
}

impl<'a> FacetProjector<'a> {
    /// `view` is the plan's as it is from the set.
    pub fn new(
        plan: &'a Plan<'a>,
        view: &View,
        set: &'a Arc<FacetSet>,
        settings: &Settings,
    ) -> Self {
        let is_culled = settings.culls(set.sides == Sides::Closed, &set.bounds(), view);
        let source = Source::of_radiance(view, set.origin, 0.0);
        let place = plan.with_images.iter().position(|other| Arc::ptr_eq(other, set));
        let images = place.map_or(0, |place| place as u32 + 1);
        let axes = source.to_view.to_cols_array_2d();
        Self { plan, set, images, source, axes, is_culled }
    }

    /// Adds the records of a batch of facets, whose first has a number. Facets that meet no pixel
    /// or no sheet have none; nor have those that face away, if their backs are never seen.
    #[inline(always)]
    pub fn add<S: Simd>(&self, simd: S, first: usize, batch: &[Facet], records: &mut Vec<Record>) {
        for (group, facets) in batch.chunks(8).enumerate() {
            self.add_eight(simd, first + 8 * group, facets, records);
        }
    }

    /// Adds the records of up to eight facets.
    #[inline(always)]
    fn add_eight<S: Simd>(
        &self,
        simd: S,
        first: usize,
        facets: &[Facet],
        records: &mut Vec<Record>,
    ) {
        let mut bits = 0u64;
        for (lane, facet) in facets.iter().enumerate() {
            if facet.is_rod() {
                let Source { to_view, origin, .. } = self.source;
                records.extend(rods::record(self.plan, facet, to_view, origin));
            } else {
                bits |= 1 << lane;
            }
        }
        if bits == 0 {
            return;
        }
        let eight = self.in_view(simd, facets);
        if self.is_culled {
            bits &= eight.away.simd_lt(0.0).to_bitmask();
        }
        let Covered { pixels, meets } = self.pixels(simd, &eight.corners);
        bits &= meets.to_bitmask();
        if bits == 0 {
            return;
        }
        let [near, far] = self.distances(simd, &eight.corners);
        let (planes, sheets) = (&self.plan.planes, self.plan.sheets);
        // NaN fails.
        bits &= (far.simd_ge(planes[1]) & near.simd_lt(planes[sheets + 1])).to_bitmask();
        let sheets = [sheets_of(self.plan, simd, near), sheets_of(self.plan, simd, far)];
        let normals = self.normals(simd, facets);
        let corners: [[[f32; 8]; 3]; 3] = three!(I => three!(J => eight.corners[I][J].into()));
        let away: [f32; 8] = eight.away.into();
        let [[left, top], [right, bottom]]: [[[i32; 8]; 2]; 2] =
            each!([0, 1], I => each!([0, 1], J => i32x8::truncate_from(pixels[I][J]).into()));
        records.reserve(8);
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize & 7;
            bits &= bits - 1;
            let [a, b, c] = three!(I => three!(J => corners[I][J][lane]));
            // On a set that winds in any way, all facets count as fronts.
            let is_front = away[lane] < 0.0 || self.set.sides == Sides::Mixed;
            let [red, green, blue] = facets[lane].colors.map(f32::from_bits);
            records.push(Record {
                center: a,
                strength: if is_front { 1.0 } else { -1.0 },
                whitening: [b[0], b[1], b[2], c[0], c[1], c[2]],
                extent2: if self.set.whole.is_some() { CUT } else { 0.0 },
                kind: Kind::Facet,
                payload: [
                    f32::from_bits(normals[0][lane]),
                    f32::from_bits(normals[1][lane]),
                    f32::from_bits(normals[2][lane]),
                    red,
                    green,
                    blue,
                    f32::from_bits(self.images),
                    f32::from_bits((first + lane) as u32),
                ],
                pixels: [[left[lane], top[lane]], [right[lane], bottom[lane]]],
                sheets: [sheets[0][lane], sheets[1][lane].max(1)],
                field: self.plan.number,
            });
        }
    }

    #[inline(always)]
    fn turned<S: Simd>(&self, [x, y, z]: [Lanes<S>; 3]) -> [Lanes<S>; 3] {
        let [a, b, c] = self.axes;
        three!(I => x * a[I] + y * b[I] + z * c[I])
    }

    /// Returns facets in view space. Lanes without a facet have one in the origin.
    #[inline(always)]
    fn in_view<S: Simd>(&self, simd: S, facets: &[Facet]) -> Eight<S> {
        let mut places = [[[0.0f32; 8]; 3]; 3];
        for (lane, facet) in facets.iter().enumerate() {
            for (corner, place) in facet.corners.iter().zip(&mut places) {
                place.iter_mut().zip(corner).for_each(|(lanes, part)| lanes[lane] = *part);
            }
        }
        let origin = self.source.origin.to_array();
        let corners: [[Lanes<S>; 3]; 3] = three!(I => {
            let turned = self.turned(three!(J => places[I][J].simd_into(simd)));
            three!(J => turned[J] + origin[J])
        });
        let [a, b, c] = &corners;
        let (u, v) = (three!(I => b[I] - a[I]), three!(I => c[I] - a[I]));
        let across = three!(I => u[(I + 1) % 3] * v[(I + 2) % 3] - u[(I + 2) % 3] * v[(I + 1) % 3]);
        let away = if self.plan.view.perspective { dot(across, *a) } else { across[2] };
        Eight { corners, away }
    }

    /// Returns the pixels that facets may cover in part.
    #[inline(always)]
    fn pixels<S: Simd>(&self, simd: S, corners: &[[Lanes<S>; 3]; 3]) -> Covered<S> {
        let frame = &self.plan.frame;
        let none = Lanes::splat(simd, 0.0);
        let least: [Lanes<S>; 3] = three!(J => corners[0][J].min(corners[1][J]).min(corners[2][J]));
        let most: [Lanes<S>; 3] = three!(J => corners[0][J].max(corners[1][J]).max(corners[2][J]));
        let mut meets = mask32x8::splat(simd, true);
        let mut bounds = each!([0, 1], J => [least[J], most[J]]);
        if self.plan.view.perspective {
            let z_near = Lanes::splat(simd, frame.z_near);
            let is_before = least[2].simd_gt(frame.z_near);
            meets = most[2].simd_gt(frame.z_near);
            let inverse = three!(I => Lanes::splat(simd, 1.0) / corners[I][2].max(z_near));
            let places: [[Lanes<S>; 3]; 2] =
                each!([0, 1], J => three!(I => corners[I][J] * inverse[I]));
            bounds = each!([0, 1], J => {
                let [a, b, c] = places[J];
                [a.min(b).min(c), a.max(b).max(c)]
            });
            if !is_before.all_true() {
                // Bounds of x/z over the part of the box beyond the nearest visible z.
                let z = [z_near.max(least[2]), most[2]];
                bounds = each!([0, 1], J => {
                    let (low, high) = (least[J], most[J]);
                    let low = low / low.simd_lt(none).select(z[0], z[1]);
                    let high = high / high.simd_lt(none).select(z[1], z[0]);
                    [is_before.select(bounds[J][0], low), is_before.select(bounds[J][1], high)]
                });
            }
        }
        let apron = self.plan.apron() as f32;
        let mut pixels = [[none; 2]; 2];
        for axis in 0..2 {
            let limit = frame.size[axis] as f32 + apron;
            let [low, high] =
                each!([0, 1], I => bounds[axis][I] * frame.scale + frame.center[axis]);
            let first = (low - MARGIN)
                .max(Lanes::splat(simd, -apron))
                .min(Lanes::splat(simd, limit))
                .floor();
            let last = (high + MARGIN)
                .max(Lanes::splat(simd, -apron - 1.0))
                .min(Lanes::splat(simd, limit - 1.0))
                .floor();
            // NaN fails.
            meets &= low.simd_le(high) & first.simd_le(last);
            (pixels[0][axis], pixels[1][axis]) = (first, last);
        }
        Covered { pixels, meets }
    }

    /// Returns the least and the largest distance at which facets are.
    #[inline(always)]
    fn distances<S: Simd>(&self, simd: S, [a, b, c]: &[[Lanes<S>; 3]; 3]) -> [Lanes<S>; 2] {
        if !self.plan.view.perspective {
            return [a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2])];
        }
        let center = three!(J => (a[J] + b[J] + c[J]) * (1.0 / 3.0));
        let reach = three!(I => {
            let away = three!(J => [a, b, c][I][J] - center[J]);
            dot(away, away)
        });
        let reach = reach[0].max(reach[1]).max(reach[2]).sqrt();
        let distance = dot(center, center).sqrt();
        let far = distance + reach;
        // A pixel's ray is up to a pixel beside the facet.
        let pixel = far * Lanes::splat(simd, 1.0 / self.plan.frame.scale);
        [distance - reach - pixel, far + pixel]
    }

    /// Returns the normals at the corners in view space, encoded as those of facets are.
    #[inline(always)]
    fn normals<S: Simd>(&self, simd: S, facets: &[Facet]) -> [[u32; 8]; 3] {
        let mut packed = [[NO_NORMAL; 8]; 3];
        if !self.plan.lit_surfaces {
            return packed;
        }
        for (lane, facet) in facets.iter().enumerate() {
            packed.iter_mut().zip(facet.normals).for_each(|(lanes, normal)| lanes[lane] = normal);
        }
        three!(I => {
            let words = packed[I].map(u32::cast_signed);
            let (normal, has_normal) = normals(simd, words.simd_into(simd));
            let turned = encoded(simd, self.turned(normal));
            let none = i32x8::splat(simd, NO_NORMAL.cast_signed());
            let words: [i32; 8] = has_normal.select(turned, none).into();
            words.map(i32::cast_unsigned)
        })
    }
}

/// Encodes unit vectors octahedrally, as [`encode_normal`](crate::splat::encode_normal) does.
#[inline(always)]
fn encoded<S: Simd>(simd: S, [x, y, z]: [Lanes<S>; 3]) -> i32x8<S> {
    let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
    let inverse = one / (x.abs() + y.abs() + z.abs());
    let (x, y) = (x * inverse, y * inverse);
    let [fold_x, fold_y] = [one - y.abs(), one - x.abs()];
    let is_behind = z.simd_lt(none);
    let x = is_behind.select(x.simd_ge(none).select(fold_x, -fold_x), x);
    let y = is_behind.select(y.simd_ge(none).select(fold_y, -fold_y), y);
    let [x, y] = [x, y].map(
        #[inline(always)]
        |part| {
            let part = part.max(-one).min(one) * 32767.0;
            i32x8::truncate_from((part + 0.5).floor())
        },
    );
    (x & 0xffff) | (y << 16)
}

//! Rods: the pixels and sheets that they cover, and where rays meet them
//! (shaders/shared/rods.wgsl).

use super::{
    close::Packet,
    covered::{Covered, Covering, LEAST_SHARE, Side},
    footprint::{Kind, Record, box_bounds, tangent_bounds},
    plan::Plan,
    scatter::{OpenTile, Window, is_kept},
    vector::{Lanes, dot, three},
};
use crate::{
    facet::{Facet, OVERLAP},
    splat::{decode_normal, encode_normal},
};
use fearless_simd::{Simd, prelude::*};
use glam::{Mat3, Vec3};
use std::f32::consts::FRAC_PI_2;

/// Rays whose squared sine to a rod is smaller run along the rod.
const LEAST_SINE_SQUARED: f32 = 1e-10;
/// Divisors are at least this.
const LEAST: f32 = 1e-30;

/// Returns the record of a rod, or `None` if the rod meets no pixel or no sheet.
pub fn record(plan: &Plan, facet: &Facet, turn: Mat3, origin: Vec3) -> Option<Record> {
    let [a, b, [first, last, pixels]] = facet.corners;
    let [a, b] = [a, b].map(|end| turn * Vec3::from(end) + origin);
    let pixel = |end: Vec3| {
        if plan.view.perspective { end.length() / plan.frame.scale } else { 1.0 / plan.frame.scale }
    };
    let radii = [(a, first), (b, last)].map(|(end, radius)| radius.max(pixels * pixel(end)));
    let covered = covered_pixels(plan, outline([a, b], radii, plan))?;
    let sheets = sheets(plan, [a, b], radii)?;
    let [normal, form, _] = facet.normals;
    let normal = decode_normal(normal).map_or(normal, |direction| encode_normal(turn * direction));
    let [from, to, _] = facet.colors.map(f32::from_bits);
    Some(Record {
        center: a.to_array(),
        strength: 1.0,
        whitening: [b.x, b.y, b.z, first, last, pixels],
        extent2: 0.0,
        kind: Kind::Rod,
        payload: [f32::from_bits(normal), form as f32, 0.0, from, to, 0.0, 0.0, 0.0],
        pixels: covered,
        sheets,
        field: plan.number,
    })
}

/// Bounds a rod in the image plane, at distance 1 in perspective: along x, then along y.
fn outline(ends: [Vec3; 2], radii: [f32; 2], plan: &Plan) -> [[f32; 2]; 2] {
    let z_near = plan.frame.z_near;
    let is_before = ends.iter().zip(radii).all(|(end, radius)| end.z - radius > z_near);
    [0, 1].map(|axis| {
        let bounds = [0, 1].map(|end: usize| {
            let (place, z, radius) = (ends[end][axis], ends[end].z, radii[end]);
            if !plan.view.perspective {
                return [place - radius, place + radius];
            }
            if is_before {
                return tangent_bounds(place, z, radius * radius, 0.0, radius * radius);
            }
            // The part of the box around both ends beyond the nearest visible z.
            let far = (ends[0].z + radii[0]).max(ends[1].z + radii[1]);
            box_bounds(place, radius, z_near, far.max(z_near))
        });
        [bounds[0][0].min(bounds[1][0]), bounds[0][1].max(bounds[1][1])]
    })
}

/// Returns the first and the last pixel that a box of the image plane meets in part.
fn covered_pixels(plan: &Plan, bounds: [[f32; 2]; 2]) -> Option<[[i32; 2]; 2]> {
    let frame = &plan.frame;
    let apron = plan.apron() as f32;
    let mut pixels = [[0; 2]; 2];
    for axis in 0..2 {
        let limit = frame.size[axis] as f32 + apron;
        let [low, high] = bounds[axis].map(|at| at * frame.scale + frame.center[axis]);
        // Shares are by the distance of pixels' centres, whose corners lie farther away.
        let first = (low - 0.5).clamp(-apron, limit).floor();
        let last = (high + 0.5).clamp(-apron - 1.0, limit - 1.0).floor();
        // NaN fails.
        let is_some = first <= last;
        if !is_some {
            return None;
        }
        (pixels[0][axis], pixels[1][axis]) = (first as i32, last as i32);
    }
    Some(pixels)
}

/// Returns the first and the last sheet that a rod may meet.
fn sheets(plan: &Plan, [a, b]: [Vec3; 2], radii: [f32; 2]) -> Option<[u16; 2]> {
    let reach = radii[0].max(radii[1]);
    let (near, far) = if plan.view.perspective {
        let along = b - a;
        let part = (-a.dot(along) / along.length_squared().max(LEAST)).clamp(0.0, 1.0);
        let far = a.length().max(b.length()) + reach;
        // A pixel's ray is up to a pixel beside the rod.
        let pixel = far / plan.frame.scale;
        ((a + along * part).length() - reach - pixel, far + pixel)
    } else {
        (a.z.min(b.z) - reach, a.z.max(b.z) + reach)
    };
    // NaN fails.
    let meets = far >= plan.planes[1] && near < plan.planes[plan.sheets + 1];
    meets.then(|| [plan.sheet_of(near) as u16, plan.sheet_of(far).max(1) as u16])
}

/// A rod on its way to the pixels of a tile.
struct DrawnRod {
    /// An end, and the way from there to the other one.
    start: Vec3,
    along: Vec3,
    radii: [f32; 2],
    pixels: f32,
    is_round: bool,
    /// Another rod begins at the end.
    is_joined: bool,
    /// The normal of a flat rod, or the direction of the rod before a round one; zero if there is
    /// none.
    normal: Vec3,
    colors: [[f32; 3]; 2],
}

/// Where the rays of eight pixels meet a rod.
struct Met<S: Simd> {
    share: Lanes<S>,
    distance: Lanes<S>,
    /// How far along the rod the place lies, from 0 to 1.
    part: Lanes<S>,
    normal: [Lanes<S>; 3],
}

impl DrawnRod {
    fn new(record: &Record) -> Self {
        let [x, y, z, first, last, pixels] = record.whitening;
        let start = Vec3::from(record.center);
        let [normal, form, _, from, to, ..] = record.payload;
        let unpack = |bits: f32| {
            let [red, green, blue, _] = bits.to_bits().to_le_bytes();
            [red, green, blue].map(|part| f32::from(part) * (1.0 / 255.0))
        };
        Self {
            start,
            along: Vec3::new(x, y, z) - start,
            radii: [first, last],
            pixels,
            is_round: form > 0.5,
            is_joined: form > 1.5,
            normal: decode_normal(normal.to_bits()).unwrap_or(Vec3::ZERO),
            colors: [from, to].map(unpack),
        }
    }

    /// Returns the share of each pixel that the rod fills, and where its ray meets the rod.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, plan: &Plan, packet: &Packet<S>) -> Met<S> {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let least = Lanes::splat(simd, LEAST);
        let (way, cosine) = (packet.rays.direction, packet.rays.cosine);
        let perspective = plan.view.perspective;
        let mut to: [Lanes<S>; 3] = three!(I => Lanes::splat(simd, self.start[I]));
        if !perspective {
            to = [to[0] - packet.rays.aside[0], to[1] - packet.rays.aside[1], to[2]];
        }
        // Everything across the ray is small, so that nothing cancels.
        let along: [Lanes<S>; 3] = three!(I => Lanes::splat(simd, self.along[I]));
        let (to_depth, depth) = (dot(to, way), dot(along, way));
        let to = three!(I => to[I] - way[I] * to_depth);
        let across = three!(I => along[I] - way[I] * depth);
        let across2 = dot(across, across);
        let nearest = (none - dot(to, across)) / across2.max(least);
        let nearest = nearest.max(none).min(one);
        let aside = three!(I => to[I] + across[I] * nearest);
        let away = dot(aside, aside).sqrt();
        let before = to_depth + depth * nearest;
        // The size of a pixel there.
        let scale = 1.0 / plan.frame.scale;
        let pixel = if perspective { (before * cosine).max(least) } else { one } * scale;
        let [first, last] = self.radii;
        let radius = (nearest * (last - first) + first).max(pixel * self.pixels);
        let inside = ((radius - away) / pixel + 0.5).max(none).min(one);
        let beyond = ((radius + away) / pixel + 0.5).max(none).min(one);
        let size = (radius * FRAC_PI_2 + across2.sqrt()) / pixel;
        let mut share = (inside + beyond - one).max(none) * size.min(one);
        if perspective {
            share = before.simd_gt(none).select(share, none);
        }
        if !self.is_round {
            let normal = three!(I => Lanes::splat(simd, self.normal[I]));
            return Met { share, distance: before, part: nearest, normal };
        }
        let share = self.outlined(simd, share, to, across, pixel);
        // The middle of what the pixel sees of the rod across: nearer than the outline.
        let half = pixel * 0.5;
        let middle = ((away + half).min(radius) + (away - half).max(none - radius)) * 0.5;
        let moved = one - middle / away.max(least);
        let moved = away.simd_gt(least).select(moved, none);
        let to = three!(I => to[I] - aside[I] * moved);
        let length2 = self.along.length_squared();
        let mut part = none;
        if length2 > 0.0 {
            let square = across2.max(Lanes::splat(simd, LEAST_SINE_SQUARED * length2));
            let on_line = (none - dot(to, across)) / square;
            let off = three!(I => to[I] + across[I] * on_line);
            let chord = (radius * radius - dot(off, off)).max(none).sqrt();
            let half = chord * (length2.sqrt() / square.sqrt());
            part = on_line - half * depth / length2;
        }
        // The ball around that place of the segment touches the rod's surface where the ray enters.
        let part = part.max(none).min(one);
        let off = three!(I => to[I] + across[I] * part);
        let height = (radius * radius - dot(off, off)).max(none).sqrt();
        let distance = to_depth + depth * part - height;
        let normal = three!(I => none - off[I] - way[I] * height);
        Met { share, distance, part, normal }
    }
}

impl DrawnRod {
    /// Returns the shares without those on the outline of round ends at joints, where the outline
    /// is that of the other rod. `to` is the way to the start and `across` the way from there to
    /// the end, both across the rays.
    #[inline(always)]
    fn outlined<S: Simd>(
        &self,
        simd: S,
        share: Lanes<S>,
        to: [Lanes<S>; 3],
        across: [Lanes<S>; 3],
        pixel: Lanes<S>,
    ) -> Lanes<S> {
        let (none, one) = (Lanes::splat(simd, 0.0), Lanes::splat(simd, 1.0));
        let slack = pixel * OVERLAP as f32;
        let mut outlined = share;
        if self.is_joined {
            let behind = three!(I => to[I] + across[I]);
            let beyond = none - dot(behind, across);
            let is_beyond = beyond.simd_gt(slack * dot(across, across).sqrt());
            outlined = is_beyond.select(none, outlined);
        }
        if self.normal != Vec3::ZERO {
            let before: [Lanes<S>; 3] = three!(I => Lanes::splat(simd, self.normal[I]));
            let part = dot(to, before);
            let is_before = dot(to, across).simd_gt(none);
            // `to` lies across the ray, so that its product with a vector is that with the part of
            // the vector across the ray.
            let is_beside_other = part.simd_gt(slack);
            outlined = (is_before & is_beside_other).select(none, outlined);
        }
        share.simd_lt(one).select(outlined, share)
    }
}

impl<S: Simd> Covering<S> for DrawnRod {
    #[inline(always)]
    fn covered(
        &self,
        simd: S,
        plan: &Plan,
        _window: Window,
        packet: &Packet<S>,
    ) -> Option<Covered<S>> {
        let Met { share, distance, part, normal } = self.at(simd, plan, packet);
        let mut covers = share.simd_gt(LEAST_SHARE);
        if !covers.any_true() {
            return None;
        }
        let rays = &packet.rays;
        if plan.has_clips() {
            covers &= is_kept(plan, rays, distance);
        }
        let [from, to] = self.colors;
        let mut color = three!(I => part * (to[I] - from[I]) + from[I]);
        if plan.lit_surfaces && (self.is_round || self.normal != Vec3::ZERO) {
            color = plan.lit_surface(simd, color, normal, (rays, distance));
        }
        Some(Covered { share, seen: share, distance, color, covers, side: Side::Rod })
    }
}

impl<S: Simd> OpenTile<'_, S> {
    /// Adds the window of a rod to the packets that it meets, given as bits.
    #[inline(always)]
    pub fn add_rod(&mut self, simd: S, plan: &Plan, record: &Record, window: Window, packets: u8) {
        self.add_covering(simd, plan, &DrawnRod::new(record), window, packets);
    }
}

//! The shares of pixels that facets fill (shaders/shared/facets.wgsl).

use super::{
    close::Packet,
    covered::{Covered, Covering, LEAST_SHARE, Side},
    footprint::Record,
    plan::Plan,
    scatter::{OpenTile, Window, is_kept},
    sums::WINDOW,
    vector::{Lanes, dot_with, three},
};
use crate::{facet::Image, splat::decode_normal};
use fearless_simd::{Simd, mask32x8, prelude::*};
use glam::{Vec2, Vec3};

/// A facet on its way to the pixels of a tile.
struct DrawnFacet<'a> {
    /// The image that it shows, and where.
    image: Option<Mapped<'a>>,
    corners: [Vec3; 3],
    /// The corners in the picture, in pixels, if all lie in front of the eye.
    places: Option<[Vec2; 3]>,
    /// One over the corners' z in perspective; 1 otherwise.
    nearness: [f32; 3],
    /// The distances along the view's axis, the normals and the colours of the corners: corner by
    /// corner, for each axis and channel.
    z: [f32; 3],
    normals: [[f32; 3]; 3],
    colors: [[f32; 3]; 3],
    has_normals: bool,
    is_front: bool,
    /// Whether the facet ends at the clips already.
    is_cut: bool,
    /// Factor that makes the area in the picture positive.
    turn: f32,
}

/// The image that a facet shows. The weights of the corners at a place in the picture are linear
/// there, up to a factor that they share.
struct Mapped<'a> {
    image: &'a Image,
    /// The weights' values at pixel (0, 0), and their changes per pixel to the right and down.
    weights: [[f32; 3]; 3],
    /// The corners' places in the image.
    places: [Vec2; 3],
}

impl Mapped<'_> {
    /// Returns the colours of the pixels of a packet that are covered, and the shares that are
    /// seen.
    #[inline(always)]
    fn of_packet<S: Simd>(
        &self,
        simd: S,
        packet: &Packet<S>,
        covers: mask32x8<S>,
    ) -> [Lanes<S>; 4] {
        let wanted = covers.select(Lanes::splat(simd, 1.0), Lanes::splat(simd, 0.0));
        let [x, y] = &packet.rays.pixel;
        let mut seen = [[0.0f32; 8]; 4];
        for lane in (0..8).filter(|lane| wanted[*lane] > 0.0) {
            let color = self.at(x[lane], y[lane]);
            seen.iter_mut().zip(color).for_each(|(seen, channel)| seen[lane] = channel);
        }
        let [red, green, blue, alpha] = seen;
        [red.simd_into(simd), green.simd_into(simd), blue.simd_into(simd), alpha.simd_into(simd)]
    }

    /// Returns the colour of a pixel, by the place of its centre, and the share that is seen.
    fn at(&self, x: f32, y: f32) -> [f32; 4] {
        let [start, right, down] = self.weights;
        let weights: [f32; 3] = std::array::from_fn(|i| start[i] + x * right[i] + y * down[i]);
        // Beside the facet, its nearest place counts.
        let inside = weights.map(|weight| weight.max(0.0));
        let sum = |values: [f32; 3]| values[0] + values[1] + values[2];
        let of = |values: [f32; 3]| {
            self.places[0] * values[0] + self.places[1] * values[1] + self.places[2] * values[2]
        };
        let all = sum(inside);
        let (uv, all) = match all > 1e-30 {
            true => (of(inside) / all, all),
            false => (of([1.0 / 3.0; 3]), 1.0),
        };
        let change = |by: [f32; 3]| (of(by) - uv * sum(by)) / all;
        self.image.mean(uv, change(right), change(down))
    }
}

impl<'a> DrawnFacet<'a> {
    #[inline(always)]
    fn new(plan: &'a Plan, record: &Record) -> Self {
        let [bx, by, bz, cx, cy, cz] = record.whitening;
        let corners = [Vec3::from(record.center), Vec3::new(bx, by, bz), Vec3::new(cx, cy, cz)];
        let frame = &plan.frame;
        let center = Vec2::from(frame.center);
        let (is_perspective, z_near) = (plan.view.perspective, frame.z_near);
        let z: [f32; 3] = three!(I => corners[I].z);
        let is_before = !is_perspective || (z[0] > z_near && z[1] > z_near && z[2] > z_near);
        let nearness: [f32; 3] = three!(I => if is_perspective { 1.0 / z[I] } else { 1.0 });
        let places = is_before
            .then_some(three!(I => center + corners[I].truncate() * (frame.scale * nearness[I])));
        let [p, q, r] = corners;
        let across = (q - p).cross(r - p);
        let away = if is_perspective { across.dot(p) } else { across.z };
        let turn = if away < 0.0 { -1.0 } else { 1.0 };
        let [.., images, number] = record.payload;
        let set = (images.to_bits() as usize).checked_sub(1).map(|set| &plan.with_images[set]);
        let image = set.and_then(|set| set.image_of(number.to_bits() as usize));
        let image = image.map(|(image, places)| {
            let weights =
                linear_weights(plan, corners).map(|part| part.map(|weight| weight * turn));
            Mapped { image, weights, places }
        });
        let normals: [Vec3; 3] = if plan.lit_surfaces {
            three!(I => decode_normal(record.payload[I].to_bits()).unwrap_or(Vec3::ZERO))
        } else {
            [Vec3::ZERO; 3]
        };
        let colors: [[u8; 4]; 3] = three!(I => record.payload[3 + I].to_bits().to_le_bytes());
        Self {
            image,
            corners,
            places,
            nearness,
            z,
            normals: three!(J => three!(I => normals[I][J])),
            colors: three!(J => three!(I => f32::from(colors[I][J]) * (1.0 / 255.0))),
            has_normals: normals != [Vec3::ZERO; 3],
            is_front: record.strength > 0.0,
            is_cut: record.extent2 > 0.0,
            turn,
        }
    }

    /// Returns the share of each pixel that the facet fills, and the weights of its corners at the
    /// pixel's centre or near it. The weights of corners are not negative, and add up to 1.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, packet: &Packet<S>) -> (Lanes<S>, [Lanes<S>; 3]) {
        let none = Lanes::splat(simd, 0.0);
        let rays = &packet.rays;
        let (share, mut weights) = match &self.places {
            Some(places) => {
                let to: [[Lanes<S>; 2]; 3] = three!(I => [
                    Lanes::splat(simd, places[I].x) - rays.pixel[0],
                    Lanes::splat(simd, places[I].y) - rays.pixel[1],
                ]);
                let area = part_left(simd, to[0], to[1])
                    + part_left(simd, to[1], to[2])
                    + part_left(simd, to[2], to[0]);
                let weights = three!(I => {
                    let (from, next) = (to[(I + 1) % 3], to[(I + 2) % 3]);
                    (from[0] * next[1] - from[1] * next[0]) * (self.turn * self.nearness[I])
                });
                (area * self.turn, weights)
            }
            None => {
                // A corner beside or behind the eye has no place in the picture: whether the ray
                // through the pixel's centre meets the facet (Olano & Greer 1997).
                let weights = three!(I => {
                    let edge =
                        self.corners[(I + 1) % 3].cross(self.corners[(I + 2) % 3]) * self.turn;
                    rays.aside[0] * edge.x + rays.aside[1] * edge.y + edge.z
                });
                let inside =
                    weights[0].simd_ge(none) & weights[1].simd_ge(none) & weights[2].simd_ge(none);
                (inside.select(Lanes::splat(simd, 1.0), none), weights)
            }
        };
        weights = three!(I => weights[I].max(none));
        let sum = weights[0] + weights[1] + weights[2];
        let has_sum = sum.simd_gt(1e-30);
        let inverse = Lanes::splat(simd, 1.0) / has_sum.select(sum, Lanes::splat(simd, 1.0));
        let third = Lanes::splat(simd, 1.0 / 3.0);
        (share, three!(I => has_sum.select(weights[I] * inverse, third)))
    }
}

/// Returns the weights of a facet's corners at pixel (0, 0), and their changes per pixel to the
/// right and down, up to a common factor (Olano & Greer 1997). They are positive within the facet
/// if its back is seen, and negative if its front is.
fn linear_weights(plan: &Plan, corners: [Vec3; 3]) -> [[f32; 3]; 3] {
    let frame = &plan.frame;
    let edges = [0, 1, 2].map(|i| {
        let [from, to] = [1, 2].map(|next| corners[(i + next) % 3]);
        match plan.view.perspective {
            true => from.cross(to),
            // Through the places in the picture, where z counts as 1.
            false => from.with_z(1.0).cross(to.with_z(1.0)),
        }
    });
    let of = |part: fn(Vec3) -> f32| edges.map(part);
    let (right, down) = (of(|edge| edge.x), of(|edge| edge.y));
    let [right, down] = [right, down].map(|part| part.map(|weight| weight / frame.scale));
    let start = std::array::from_fn(|i| {
        edges[i].z - frame.center[0] * right[i] - frame.center[1] * down[i]
    });
    [start, right, down]
}

/// Returns the integral of the part of pixels to the left of an edge, over the edge's rise inside
/// them: positive if the edge goes down. Added up over a polygon's edges it is the area of the
/// pixel inside the polygon. Places are relative to the pixels' centres.
#[inline(always)]
fn part_left<S: Simd>(simd: S, from: [Lanes<S>; 2], to: [Lanes<S>; 2]) -> Lanes<S> {
    let (low, high) = (Lanes::splat(simd, -0.5), Lanes::splat(simd, 0.5));
    let none = Lanes::splat(simd, 0.0);
    let one = Lanes::splat(simd, 1.0);
    let y = [from[1].max(low).min(high), to[1].max(low).min(high)];
    let rise = to[1] - from[1];
    let rises = rise.abs().simd_gt(1e-20);
    let inverse = one / rises.select(rise, one);
    let x: [Lanes<S>; 2] = super::vector::each!([0, 1], I => {
        let part = ((y[I] - from[1]) * inverse).max(none).min(one);
        part.mul_add(to[0] - from[0], from[0])
    });
    // The mean of the edge's place between the pixel's sides, from 0 to 1.
    let (least, most) = (x[0].min(x[1]), x[0].max(x[1]));
    let (a, b) = (least.max(low).min(high), most.max(low).min(high));
    let width = most - least;
    let is_steep = width.simd_lt(1e-5);
    let wide = is_steep.select(one, width);
    let sum = (b - a) * ((a + b) * 0.5 + 0.5) + (most - least.max(high)).max(none);
    let mean = is_steep.select(a + 0.5, sum / wide);
    rises.select((y[1] - y[0]) * mean, none)
}

impl<S: Simd> Covering<S> for DrawnFacet<'_> {
    #[inline(always)]
    fn covered(
        &self,
        simd: S,
        plan: &Plan,
        window: Window,
        packet: &Packet<S>,
    ) -> Option<Covered<S>> {
        let (share, weights) = self.at(simd, packet);
        // The share that is seen, if the facet shows an image.
        let mut seen_share = share;
        let rays = &packet.rays;
        let mut covers = share.simd_gt(LEAST_SHARE);
        if !covers.any_true() {
            return None;
        }
        let distance = dot_with(self.z, weights) / rays.cosine;
        if plan.has_clips() && !self.is_cut {
            covers &= is_kept(plan, rays, distance);
        }
        let mut color = three!(I => dot_with(self.colors[I], weights));
        if let Some(image) = &self.image {
            // Only what lies in this window is needed.
            covers &= distance.simd_lt(plan.planes[window.front + WINDOW]);
            if window.is_continued {
                covers &= distance.simd_ge(plan.planes[window.front + 1]);
            }
            let [red, green, blue, alpha] = image.of_packet(simd, packet, covers);
            color = [color[0] * red, color[1] * green, color[2] * blue];
            seen_share = share * alpha;
            covers &= seen_share.simd_gt(LEAST_SHARE);
            if !covers.any_true() {
                return None;
            }
        }
        // Facets without normals keep their colours.
        if plan.lit_surfaces && self.has_normals {
            let normal = three!(I => dot_with(self.normals[I], weights));
            color = plan.lit_surface(simd, color, normal, (rays, distance));
        }
        let side = if self.is_front { Side::Front } else { Side::Back };
        Some(Covered { share, seen: seen_share, distance, color, covers, side })
    }
}

impl<S: Simd> OpenTile<'_, S> {
    /// Adds the window of a facet to the packets that it meets, given as bits.
    #[inline(always)]
    pub fn add_facet(
        &mut self,
        simd: S,
        plan: &Plan,
        record: &Record,
        window: Window,
        packets: u8,
    ) {
        self.add_covering(simd, plan, &DrawnFacet::new(plan, record), window, packets);
    }
}
